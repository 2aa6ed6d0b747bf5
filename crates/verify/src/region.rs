//! Claim `region`: the nonlinear loop, at any configuration, decays from every start at rest within a ball.
//!
//! With `z = (e, m, mu', mu'', u~)` and `y = (b' (x) I) z` the function
//!
//! ```text
//! V = p dq'M dq + 2 dq'M y + z'(S (x) I) z   [+ 2p (U(q) - U(goal) - g(goal)'e)  without gravity compensation]
//! ```
//!
//! obeys, along the loop, with `D = d0 I + Delta`, `f = Delta dq`, `w = g(q) - g(goal)`,
//!
//! ```text
//! dV/dt = 2p dq'(u~ - d0 dq - f) + 2 y'(u~ - d0 dq - f - w) + 2 dq'M (b' (x) I) z' + 2 z'(S (x) I) z' + dq'(sum_j y_j dM/dq_j) dq
//! ```
//!
//! In an eigenbasis of `M(q)` every term splits by joints, affine in the eigenvalue `m`; so each inequality below is checked at `m_lo` and `m_hi`:
//!
//! | inequality | says |
//! |---|---|
//! | containment | `V <= 1` implies `\|y\| <= rho` |
//! | decay | `dV/dt + 2 rate V < 0` wherever `\|y\| <= rho`, with multipliers for f and w |
//! | start | at rest at distance `radius` from the goal, `V <= 1` |
//!
//! The derivation is in `proofs/claims/region.md`.

use num_rational::BigRational;
use num_traits::{One, Signed};

use crate::aic::{STATES, SharedGains};
use crate::algebra::{Matrix, add_symmetric, positive_definite_pivots, zeros};
use crate::number::ratio;

/// A positive definite matrix of the proof, with the smallest pivot of its LDL'.
#[derive(Clone, Debug, PartialEq)]
pub struct Inequality {
    /// What it says, and at which end of the inertia interval.
    pub name: String,
    /// Order of the matrix.
    pub order: usize,
    /// The smallest pivot of LDL', `None` when the matrix is not positive definite.
    pub smallest_pivot: Option<BigRational>,
}

/// The arm as the proof sees it.
#[derive(Clone, Debug)]
pub(crate) struct ArmConstants {
    pub(crate) inertia: [BigRational; 2],
    pub(crate) friction: [BigRational; 2],
    /// Largest gravity stiffness, zero when gravity is compensated.
    pub(crate) stiffness: BigRational,
    pub(crate) coriolis: BigRational,
    pub(crate) coriolis_relative: BigRational,
}

/// The numbers that prove a region, and the region.
#[derive(Clone, Debug)]
pub(crate) struct Witness {
    pub(crate) p: BigRational,
    pub(crate) b: [BigRational; STATES],
    pub(crate) s: Matrix,
    pub(crate) rho: BigRational,
    pub(crate) theta: BigRational,
    pub(crate) friction_multiplier: BigRational,
    pub(crate) gravity_multiplier: BigRational,
    pub(crate) start_multiplier: BigRational,
    pub(crate) rate: BigRational,
    pub(crate) radius: BigRational,
}

/// The inequalities of a sealed or unsealed region claim of `document`, in the order of the module's table.
///
/// # Errors
/// [`crate::Rejection`] when the document's numbers are outside what the proof allows.
pub fn region_inequalities(
    document: &crate::Document,
    claim: &crate::RegionClaim,
) -> Result<Vec<Inequality>, crate::Rejection> {
    let (gains, arm, witness) = crate::check::region_parts(document, claim)?;
    Ok(inequalities(&gains, &arm, &witness))
}

/// Coordinates: dq, then z, then f (when friction is an interval), then w (when gravity acts).
const DQ: usize = 0;
const E: usize = 1;
const U: usize = 5;

pub(crate) fn inequalities(gains: &SharedGains, arm: &ArmConstants, witness: &Witness) -> Vec<Inequality> {
    let mut all = Vec::new();
    let mut record = |name: String, matrix: &Matrix| {
        let smallest_pivot = positive_definite_pivots(matrix).and_then(|pivots| pivots.into_iter().min());
        all.push(Inequality { name, order: matrix.len(), smallest_pivot });
    };
    for (m, end) in arm.inertia.iter().zip(["least", "largest"]) {
        record(format!("containment at the {end} inertia"), &containment(arm, witness, m));
        record(format!("decay at the {end} inertia"), &decay(gains, arm, witness, m));
    }
    record("start".to_owned(), &start(arm, witness));
    all
}

/// The quadratic form of V without its potential, per joint: coordinates (dq, z).
fn quadratic_form(witness: &Witness, m: &BigRational) -> Matrix {
    let mut form = zeros(1 + STATES);
    form[DQ][DQ] = &witness.p * m;
    for i in 0..STATES {
        add_symmetric(&mut form, DQ, 1 + i, &(m * &witness.b[i]));
        for j in 0..STATES {
            form[1 + i][1 + j].clone_from(&witness.s[i][j]);
        }
    }
    form
}

/// `[[P(m) - p k_g e e', beta], [beta', rho^2]]`.
fn containment(arm: &ArmConstants, witness: &Witness, m: &BigRational) -> Matrix {
    let form = quadratic_form(witness, m);
    let order = form.len();
    let mut matrix = zeros(order + 1);
    for i in 0..order {
        for j in 0..order {
            matrix[i][j].clone_from(&form[i][j]);
        }
    }
    matrix[E][E] -= &witness.p * &arm.stiffness;
    for i in 0..STATES {
        add_symmetric(&mut matrix, 1 + i, order, &witness.b[i]);
    }
    matrix[order][order] = &witness.rho * &witness.rho;
    matrix
}

/// Minus the form of `dV/dt + 2 rate V` with the multiplier terms.
fn decay(gains: &SharedGains, arm: &ArmConstants, witness: &Witness, m: &BigRational) -> Matrix {
    let controller = gains.matrices();
    let [least_friction, largest_friction] = &arm.friction;
    let friction_span = largest_friction - least_friction;
    let has_friction = friction_span.is_positive();
    let has_gravity = arm.stiffness.is_positive();
    let f = 1 + STATES;
    let w = f + usize::from(has_friction);
    let mut q = zeros(w + usize::from(has_gravity));
    let (one, two, half) = (BigRational::one(), ratio(2, 1), ratio(1, 2));
    let Witness { p, b, s, rho, theta, rate, .. } = witness;

    // 2p dq'(u~ - d0 dq) + 2 dq'M b'(B dq) + the bound 2 rho (theta k_c + (1 - theta) k_r m) |dq|^2 of the cubic term.
    let b_dot: BigRational = b.iter().zip(&controller.b).map(|(x, y)| x * y).sum();
    let cubic = &two * rho * (theta * &arm.coriolis + (&one - theta) * &arm.coriolis_relative * m);
    q[DQ][DQ] = -(&two * p * least_friction) + &two * m * b_dot + cubic;
    add_symmetric(&mut q, DQ, U, p);
    for i in 0..STATES {
        // -2 y' d0 dq, 2 dq'M b'A z, 2 z'S B dq.
        let b_a: BigRational = (0..STATES).map(|k| &b[k] * &controller.a[k][i]).sum();
        let s_b: BigRational = (0..STATES).map(|k| &s[i][k] * &controller.b[k]).sum();
        add_symmetric(&mut q, DQ, 1 + i, &(m * b_a + s_b - &b[i] * least_friction));
        // 2 y'u~: b_i z_i u~ and its mirror.
        q[1 + i][U] += &b[i];
        q[U][1 + i] += &b[i];
        // 2 z'S A z.
        for j in 0..STATES {
            let s_a: BigRational = (0..STATES).map(|k| &s[i][k] * &controller.a[k][j]).sum();
            q[1 + i][1 + j] += &s_a;
            q[1 + j][1 + i] += &s_a;
        }
    }
    // 2 rate V; the potential is at most p k_g |e|^2.
    let form = quadratic_form(witness, m);
    for (i, row) in form.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            q[i][j] += &two * rate * entry;
        }
    }
    q[E][E] += &two * rate * p * &arm.stiffness;
    if has_friction {
        // -2 (p dq + y)'f + lambda f'((d1 - d0) dq - f).
        let lambda = &witness.friction_multiplier;
        add_symmetric(&mut q, DQ, f, &(-p + lambda * &friction_span * &half));
        for (i, entry) in b.iter().enumerate() {
            add_symmetric(&mut q, 1 + i, f, &-entry);
        }
        q[f][f] -= lambda;
    }
    if has_gravity {
        // -2 y'w + lambda (k_g^2 |e|^2 - |w|^2); the p-part is cancelled by the potential.
        let lambda = &witness.gravity_multiplier;
        for (i, entry) in b.iter().enumerate() {
            add_symmetric(&mut q, 1 + i, w, &-entry);
        }
        q[E][E] += lambda * &arm.stiffness * &arm.stiffness;
        q[w][w] -= lambda;
    }
    for row in &mut q {
        for entry in row {
            *entry = -entry.clone();
        }
    }
    q
}

/// Coordinates (e0, u~0): `e = m = e0`, the rest zero; `u~0 = 0` with gravity compensated, `|u~0| <= k_g |e0|` without.
fn start(arm: &ArmConstants, witness: &Witness) -> Matrix {
    let Witness { p, s, radius, start_multiplier: lambda, .. } = witness;
    let mut position = (radius * radius).recip() - (&s[0][0] + &s[0][1] + &s[1][0] + &s[1][1]) - p * &arm.stiffness;
    if !arm.stiffness.is_positive() {
        return vec![vec![position]];
    }
    position -= lambda * &arm.stiffness * &arm.stiffness;
    let cross = -(&s[0][4] + &s[1][4]);
    let torque = lambda - &s[4][4];
    vec![vec![position, cross.clone()], vec![cross, torque]]
}
