//! Claims about the adaptive controller near a goal: convergence of the error, the frozen loop, the sampled velocity loop.
//!
//! Notation as in `certune_verify`'s `adaptive_convergence`, whose matrices are assembled here with `f64` for the solver. For convergence
//! Lambda is one number for all joints, as large as the inequalities allow: the larger it is beside `lambda M lambda`, the more of the box
//! the sublevel set fills. U and W are the solver's.

use certune_verify::{
    AdaptiveConvergenceClaim, AdaptiveLoop, AdaptiveRefusedClaim, AdaptiveSampledClaim, AdaptiveSampledRefusedClaim,
    AdaptiveWitness, Claim, ClaimKind, Document, Flaw, Form, MracLaw, Number, PiExponentialClaim, PiRefusedClaim,
    Reason, adaptive_inequalities, checked_alone, pi_inequalities,
};
use nalgebra::{DMatrix, SymmetricEigen};

use crate::lmi::{Affine, Program};
use crate::not_proved;
use crate::problem::Problem;

/// Shares of the solver's Lambda that are tried in turn.
const SHARES: [f64; 4] = [0.95, 0.8, 0.5, 0.2];
/// No Lambda beyond this is of use, N m/rad.
const LARGEST_SPRING_N_M_PER_RAD: f64 = 1e3;
/// Start radii and levels are certified in steps of 1e-6.
const STEPS_PER_UNIT: f64 = 1e6;
/// Accumulated gains are certified in steps of 1/1000 N m/rad, up to 1e6.
const GAIN_STEPS_PER_UNIT: u32 = 1000;
const MOST_GAIN_STEPS: u32 = 1_000_000_000;

/// Why the proofs about the equations do not cover a document.
fn outside(document: &Document) -> Option<Reason> {
    match document.gains.mrac() {
        Err(_) => Some(Reason::OtherController),
        Ok(gains) if gains.law == MracLaw::ReleasedCode => Some(Reason::ReleasedCode),
        Ok(_) => None,
    }
}

fn reason(flaw: &Flaw) -> Reason {
    match flaw {
        Flaw::Missing { .. } => Reason::ConstantMissing,
        Flaw::NotCovered { .. } => Reason::FamilyNotCovered,
        Flaw::Controller { .. } => Reason::OtherController,
        Flaw::UnequalGains { .. } => Reason::UnequalGains,
        Flaw::Inequality { .. } | Flaw::Polynomial { .. } | Flaw::Counterexample { .. } => Reason::CandidateFailed,
        Flaw::Quantity { .. } | Flaw::Length { .. } => Reason::OutOfRange,
    }
}

fn matrix(form: &Form<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(form.0.len(), form.0.len(), |i, j| form.0[i][j])
}

fn decimals(values: &[f64]) -> Option<Vec<Number>> {
    values.iter().map(|&x| Number::decimal(x)).collect()
}

fn floor(x: f64) -> f64 {
    (x * STEPS_PER_UNIT).floor() / STEPS_PER_UNIT
}

/// The claim `adaptive-convergence` at a goal; refused with a direction in which every Lyapunov function of its form rises, when there is one.
///
/// The problem's constants must be about a box around the goal and hold an enclosure of the inertia matrix.
pub fn adaptive_convergence(problem: &Problem, goal_rad: &[f64]) -> Claim {
    const KIND: ClaimKind = ClaimKind::AdaptiveConvergence;
    let document = problem.document();
    if let Some(reason) = outside(document) {
        return not_proved(KIND, reason, None);
    }
    let Some(goal_rad) = decimals(goal_rad) else { return not_proved(KIND, Reason::OutOfRange, None) };
    let numbers = match AdaptiveLoop::new(document, &goal_rad) {
        Ok(numbers) => numbers.to_f64(),
        Err(flaw) => return not_proved(KIND, reason(&flaw), None),
    };
    let (x, distance) = match search(&numbers) {
        Some(found) => found,
        None => return refuse(document, goal_rad, &numbers, None),
    };
    if distance > 0.0 {
        return refuse(document, goal_rad, &numbers, Some(distance));
    }
    for share in SHARES {
        let claim = candidate(&numbers, &goal_rad, &x, share);
        let holds = |claim: &AdaptiveConvergenceClaim| {
            adaptive_inequalities(document, claim)
                .is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some()))
        };
        if let Some(claim) = claim.filter(holds) {
            return Claim::AdaptiveConvergence(Box::new(claim));
        }
    }
    not_proved(KIND, Reason::CandidateFailed, None)
}

/// Lambda (one number), U and W with the largest Lambda, and the distance to feasibility: the least t with which `split + t I` and
/// `decay + t I` are positive semidefinite, 0 when the inequalities are feasible as they stand.
fn search(numbers: &AdaptiveLoop<f64>) -> Option<(Vec<f64>, f64)> {
    let n = numbers.damping.len();
    let (spring, slack) = (0, 1 + 2 * n);
    let parts = |x: &[f64]| (vec![x[spring]; n], x[1..=n].to_vec(), x[1 + n..slack].to_vec());
    let solve = |cost: Vec<f64>, margin: f64| {
        let relaxed = |form: DMatrix<f64>, x: &[f64]| {
            let order = form.nrows();
            form + DMatrix::identity(order, order) * (x[slack] - margin)
        };
        let blocks: Vec<Affine<'_>> = vec![
            Box::new(|x| {
                let (_, u, w) = parts(x);
                relaxed(matrix(&numbers.split(&u, &w)), x)
            }),
            Box::new(|x| {
                let (spring, u, w) = parts(x);
                relaxed(matrix(&numbers.decay(&spring, &u, &w)), x)
            }),
            Box::new(|x| DMatrix::from_element(1, 1, LARGEST_SPRING_N_M_PER_RAD - x[spring])),
        ];
        Program { cost, nonnegative: (0..=slack).collect(), blocks }.solve().ok().map(|solution| solution.x)
    };
    let mut cost = vec![0.0; slack + 1];
    cost[slack] = 1.0;
    let nearest = solve(cost.clone(), 0.0)?;
    if nearest[slack] > 1e-6 {
        return Some((nearest.clone(), nearest[slack]));
    }
    cost[slack] = 1e6;
    cost[spring] = -1.0;
    solve(cost, 1e-3).map(|x| (x, 0.0))
}

fn candidate(
    numbers: &AdaptiveLoop<f64>,
    goal_rad: &[Number],
    x: &[f64],
    share: f64,
) -> Option<AdaptiveConvergenceClaim> {
    let n = numbers.damping.len();
    // Three digits say as much as sixteen here.
    let short = |x: f64| format!("{x:.3e}").parse::<f64>().unwrap_or(x);
    let spring = short(x[0] * share);
    let room = numbers.room.iter().copied().fold(f64::INFINITY, f64::min);
    let level = floor(0.5 * spring * room * room * (1.0 - 1e-6));
    let worst = -matrix(&numbers.start(&vec![spring; n], &0.0));
    let largest = SymmetricEigen::new(worst).eigenvalues.max();
    let radius = floor(((2.0 * level / largest).sqrt() * (1.0 - 1e-6)).min(room));
    Some(AdaptiveConvergenceClaim {
        goal_rad: goal_rad.to_vec(),
        level_j: Number::decimal(level)?,
        start_radius_rad: Number::decimal(radius)?,
        witness: AdaptiveWitness {
            spring_n_m_per_rad: vec![Number::decimal(spring)?; n],
            split_s: x[1..=n].iter().map(|&u| Number::decimal(short(u))).collect::<Option<_>>()?,
            split_dq: x[1 + n..=2 * n].iter().map(|&w| Number::decimal(short(w))).collect::<Option<_>>()?,
        },
    })
}

/// The direction in which `K + D - M lambda` is least, if every function V rises along it.
fn refuse(document: &Document, goal_rad: Vec<Number>, numbers: &AdaptiveLoop<f64>, distance: Option<f64>) -> Claim {
    let n = numbers.damping.len();
    let form = DMatrix::from_fn(n, n, |i, j| {
        let inertia = 0.5 * numbers.midpoint[i][j] * (numbers.lambda[i] + numbers.lambda[j]);
        let damping = numbers.damping[i] + numbers.friction[i] - numbers.friction_radius[i];
        if i == j { damping - inertia } else { -inertia }
    });
    let eigen = SymmetricEigen::new(form);
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let short = |x: &f64| Number::decimal((x * 1e3).round() / 1e3);
    let refused = direction
        .iter()
        .map(short)
        .collect::<Option<Vec<_>>>()
        .map(|direction| Claim::AdaptiveRefused(Box::new(AdaptiveRefusedClaim { goal_rad, direction })));
    match refused.filter(|claim| checked_alone(document, claim).is_ok()) {
        Some(claim) => claim,
        None => {
            let rounded = distance.and_then(|d| format!("{d:.1e}").parse().ok());
            not_proved(ClaimKind::AdaptiveConvergence, Reason::Infeasible, rounded)
        }
    }
}

/// The claim `pi-exponential` at a goal with the largest accumulated gain on q that exact arithmetic certifies, or a joint and inertia that refuse it.
pub fn pi_exponential(problem: &Problem, goal_rad: &[f64]) -> Claim {
    const KIND: ClaimKind = ClaimKind::PiExponential;
    let document = problem.document();
    if let Some(reason) = outside(document) {
        return not_proved(KIND, reason, None);
    }
    let Some(goal_rad) = decimals(goal_rad) else { return not_proved(KIND, Reason::OutOfRange, None) };
    let claim = |steps: u32| {
        let text = format!("{}.{:03}", steps / GAIN_STEPS_PER_UNIT, steps % GAIN_STEPS_PER_UNIT);
        let accumulated_k0_n_m_per_rad = text.parse().unwrap_or_else(|_| Number::zero());
        PiExponentialClaim { goal_rad: goal_rad.clone(), accumulated_k0_n_m_per_rad }
    };
    let holds = |steps: u32| {
        pi_inequalities(document, &claim(steps))
            .map(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some()))
    };
    match holds(0) {
        Err(flaw) => not_proved(KIND, reason(&flaw), None),
        Ok(true) => {
            let (mut certified, mut refused) = (0, MOST_GAIN_STEPS);
            while refused - certified > 1 {
                let middle = certified.midpoint(refused);
                if holds(middle) == Ok(true) { certified = middle } else { refused = middle }
            }
            Claim::PiExponential(Box::new(claim(certified)))
        }
        Ok(false) => {
            let inertia_kg_m2 = document.constants.bounds.m_hi_kg_m2.clone();
            (1..=document.arm.joints)
                .map(|joint| {
                    let (goal_rad, inertia_kg_m2) = (goal_rad.clone(), inertia_kg_m2.clone());
                    Claim::PiRefused(Box::new(PiRefusedClaim { goal_rad, joint, inertia_kg_m2 }))
                })
                .find(|claim| checked_alone(document, claim).is_ok())
                .unwrap_or_else(|| not_proved(KIND, Reason::NoPointFound, None))
        }
    }
}

/// The claim `adaptive-sampled` at a goal for a step and a delay of 0, 1 or 2 samples, or the joint that refuses it.
pub fn adaptive_sampled(problem: &Problem, goal_rad: &[f64], step_s: f64, delay_samples: u32) -> Claim {
    const KIND: ClaimKind = ClaimKind::AdaptiveSampled;
    let document = problem.document();
    if let Some(reason) = outside(document) {
        return not_proved(KIND, reason, None);
    }
    let (Some(goal_rad), Some(step_s)) = (decimals(goal_rad), Number::decimal(step_s)) else {
        return not_proved(KIND, Reason::OutOfRange, None);
    };
    let velocity_loop = AdaptiveSampledClaim { goal_rad, step_s, delay_samples };
    let claim = Claim::AdaptiveSampled(Box::new(velocity_loop.clone()));
    let flaw = match checked_alone(document, &claim) {
        Ok(_) => return claim,
        Err(flaw) => flaw,
    };
    (1..=document.arm.joints)
        .map(|joint| {
            let velocity_loop = velocity_loop.clone();
            Claim::AdaptiveSampledRefused(Box::new(AdaptiveSampledRefusedClaim { velocity_loop, joint }))
        })
        .find(|claim| checked_alone(document, claim).is_ok())
        .unwrap_or_else(|| match flaw {
            Flaw::Inequality { .. } => not_proved(KIND, Reason::NoPointFound, None),
            other => not_proved(KIND, reason(&other), None),
        })
}
