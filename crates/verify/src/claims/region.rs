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
use serde::{Deserialize, Serialize};

use super::{CONTINUOUS, ClaimKind, Figure, Inequality, LoopBox, Provable, all_hold, family_box};
use crate::aic::{STATES, SharedGains};
use crate::algebra::{Matrix, add_symmetric, zeros};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::{Number, positive, ratio, unit_interval};
use crate::quantity::{require, require_length, require_positive};

/// The nonlinear loop decays from every start in a ball.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionClaim {
    /// Every start at rest within this distance of the goal (2-norm over the joints) is covered, rad.
    pub radius_rad: Number,
    /// `sqrt V` decays at least as `exp(-rate t)`, 1/s.
    pub rate_per_s: Number,
    /// The numbers that prove it.
    pub witness: RegionWitness,
}

/// The Lyapunov function and multipliers of a region claim, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionWitness {
    /// Weight of the kinetic energy.
    pub p: Number,
    /// Cross terms of dq'M with (e, m, mu', mu'', u~).
    pub b: [Number; 5],
    /// Upper triangle of the symmetric 5 x 5 matrix S, row by row.
    pub s: Vec<Number>,
    /// `|y| <= rho` on the region.
    pub rho: Number,
    /// How the cubic term is shared between its two bounds, in [0, 1].
    pub theta: Number,
    /// Multiplier of the friction interval.
    pub friction_multiplier: Number,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: Number,
    /// Multiplier of the torque at the start.
    pub start_multiplier: Number,
}

impl Provable for RegionClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Region
    }

    fn sentence(&self, document: &Document) -> String {
        let torque = if document.family.gravity_compensation {
            "with zero controller torque"
        } else {
            "with the controller's torque holding gravity there"
        };
        format!(
            "from rest at any configuration within {} rad of a constant goal (2-norm over the joints, angles not wrapped), beliefs at the \
             measurement (mu = q, mu' = mu'' = 0), {torque}, the nonlinear loop converges to the goal, and the Lyapunov function of the \
             file's witness falls at least as fast as exp(-2 x {} t), t in s",
            self.radius_rad, self.rate_per_s
        )
    }

    fn scope(&self, _: &Document) -> String {
        CONTINUOUS.to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        vec![
            Figure { name: "radius", value: self.radius_rad.clone(), unit: "rad" },
            Figure { name: "rate", value: self.rate_per_s.clone(), unit: "1/s" },
        ]
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(region_inequalities(document, self)?)
    }
}

/// The inequalities of a region claim about `document`, in the order of the module's table, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn region_inequalities(document: &Document, claim: &RegionClaim) -> Result<Vec<Inequality>, Flaw> {
    let (gains, arm, witness) = parts(document, claim)?;
    Ok(inequalities(&gains, &arm, &witness))
}

/// The arm as the proof sees it.
#[derive(Clone, Debug)]
struct ArmConstants {
    inertia: [BigRational; 2],
    friction: [BigRational; 2],
    /// Largest gravity stiffness, zero when gravity is compensated.
    stiffness: BigRational,
    coriolis: BigRational,
    coriolis_relative: BigRational,
}

/// The numbers that prove a region, and the region.
#[derive(Clone, Debug)]
struct Witness {
    p: BigRational,
    b: [BigRational; STATES],
    s: Matrix,
    rho: BigRational,
    theta: BigRational,
    friction_multiplier: BigRational,
    gravity_multiplier: BigRational,
    start_multiplier: BigRational,
    rate: BigRational,
    radius: BigRational,
}

/// Coordinates: dq, then z, then f (when friction is an interval), then w (when gravity acts).
const DQ: usize = 0;
const E: usize = 1;
const U: usize = 5;

fn inequalities(gains: &SharedGains, arm: &ArmConstants, witness: &Witness) -> Vec<Inequality> {
    let mut all = Vec::new();
    let mut record = |name: String, matrix: &Matrix| all.push(Inequality::decide(name, matrix));
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

fn parts(document: &Document, claim: &RegionClaim) -> Result<(SharedGains, ArmConstants, Witness), Flaw> {
    let gains = document.gains.aic()?.shared(document.arm.joints)?;
    let bounds = &document.constants.bounds;
    let LoopBox { inertia, friction, stiffness: [_, stiffness] } = family_box(document);
    let values = |interval: [Number; 2]| interval.map(|end| end.value().clone());
    let arm = ArmConstants {
        inertia: values(inertia),
        friction: values(friction),
        stiffness: stiffness.value().clone(),
        coriolis: bounds.k_c_kg_m2.value().clone(),
        coriolis_relative: match &bounds.k_r {
            Some(k_r) => k_r.value().clone(),
            // Without the relative bound the cubic term rests on the absolute one alone.
            None if claim.witness.theta.value().is_one() => BigRational::from_integer(0.into()),
            None => return Err(Flaw::Missing { constant: "k_r" }),
        },
    };
    let witness = &claim.witness;
    require_positive("radius_rad", &claim.radius_rad)?;
    require_positive("rate_per_s", &claim.rate_per_s)?;
    // A witness is only ever computed with: dyadics of any size will do.
    require("p", &witness.p, positive(witness.p.value()), "a positive number")?;
    require("rho", &witness.rho, positive(witness.rho.value()), "a positive number")?;
    require("theta", &witness.theta, unit_interval(witness.theta.value()), "a share in [0, 1]")?;
    for (name, multiplier) in [
        ("friction_multiplier", &witness.friction_multiplier),
        ("gravity_multiplier", &witness.gravity_multiplier),
        ("start_multiplier", &witness.start_multiplier),
    ] {
        require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
    }
    require_length("s", witness.s.len(), 15)?;
    let mut s = zeros(STATES);
    let mut entries = witness.s.iter();
    for (i, j) in (0..5).flat_map(|i| (i..5).map(move |j| (i, j))) {
        if let Some(entry) = entries.next() {
            s[i][j].clone_from(entry.value());
            s[j][i].clone_from(entry.value());
        }
    }
    let witness = Witness {
        p: witness.p.value().clone(),
        b: witness.b.clone().map(|x| x.value().clone()),
        s,
        rho: witness.rho.value().clone(),
        theta: witness.theta.value().clone(),
        friction_multiplier: witness.friction_multiplier.value().clone(),
        gravity_multiplier: witness.gravity_multiplier.value().clone(),
        start_multiplier: witness.start_multiplier.value().clone(),
        rate: claim.rate_per_s.value().clone(),
        radius: claim.radius_rad.value().clone(),
    };
    Ok((gains, arm, witness))
}
