//! Claim `pi-exponential`: linearised at the goal with its adaptive gains frozen, the adaptive loop is exponentially stable.
//!
//! Near a goal r at rest only `K_i = P3 (alpha1 + (e01 + f01)|r|^2)` and `K_I,i = P3 (alpha2 + (e02 + f02)|r|^2)` act: an eigenvalue s with joint
//! vector v, `|v| = 1`, is a root of
//!
//! ```text
//! m s^3 + a s^2 + c1 s + c0,   a = v*(K + D)v,  c1 = v*(lambda K + K_I - K0)v,  c0 = v*(lambda K_I)v,   m = v*Mv,
//! ```
//!
//! with K0 what the gain on q has accumulated, a symmetric matrix of at most `k0 I`. All coefficients are real and positive, so it is enough that
//! `a c1 > m c0`; as the c's are means of the joints' values with the same weights, that
//!
//! ```text
//! min_j (K_j + d_j) (lambda_i K_i + K_I,i - k0) > m_hi lambda_i K_I,i     for every joint i.
//! ```
//!
//! Equal gains on all joints make it necessary as well for every m that is an eigenvalue of M. The derivation is in `proofs/claims/pi-exponential.md`.

use num_rational::BigRational;
use num_traits::Zero;
use serde::{Deserialize, Serialize};

use super::{CONTINUOUS, ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::document::Document;
use crate::error::Flaw;
use crate::mrac::{Adaptation, goal};
use crate::number::Number;
use crate::quantity::{require_at_least_zero, require_positive};
use crate::statement::each;

/// The loop decays when its adaptive gains are frozen.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PiExponentialClaim {
    /// The constant goal, rad.
    pub goal_rad: Vec<Number>,
    /// Largest eigenvalue that the accumulated gain on q may have, N m/rad.
    pub accumulated_k0_n_m_per_rad: Number,
}

/// The frozen loop of one joint with an inertia of the family's interval is not asymptotically stable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PiRefusedClaim {
    /// The constant goal, rad.
    pub goal_rad: Vec<Number>,
    /// The joint whose gains the loop has, from 1 at the base.
    pub joint: usize,
    /// Its inertia, kg m^2.
    pub inertia_kg_m2: Number,
}

/// The frozen loop of each joint.
struct Frozen {
    /// `K_i + d_i` at the least friction.
    damping: Vec<BigRational>,
    /// `lambda_i K_i + K_I,i`.
    linear: Vec<BigRational>,
    /// `lambda_i K_I,i`.
    constant: Vec<BigRational>,
}

impl Frozen {
    fn new(document: &Document, goal_rad: &[Number]) -> Result<Self, Flaw> {
        let adaptation = Adaptation::of(document)?;
        let (_, square) = goal(document, goal_rad)?;
        let mut frozen = Self { damping: Vec::new(), linear: Vec::new(), constant: Vec::new() };
        for (joint, [least, _]) in document.family.friction_n_m_s_per_rad.iter().enumerate() {
            let damping = adaptation.damping(joint, [&square, &square]);
            let stiffness = adaptation.stiffness(joint, &square);
            let lambda = &adaptation.lambda[joint];
            frozen.linear.push(lambda * &damping + &stiffness);
            frozen.constant.push(lambda * stiffness);
            frozen.damping.push(damping + least.value());
        }
        Ok(frozen)
    }
}

/// The inequalities of a claim about `document`, one for each joint, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn pi_inequalities(document: &Document, claim: &PiExponentialClaim) -> Result<Vec<Inequality>, Flaw> {
    let Frozen { damping, linear, constant } = Frozen::new(document, &claim.goal_rad)?;
    let accumulated = &claim.accumulated_k0_n_m_per_rad;
    require_at_least_zero("accumulated_k0_n_m_per_rad", accumulated)?;
    let least = damping.into_iter().min().unwrap_or_else(BigRational::zero);
    let largest_inertia = document.constants.bounds.m_hi_kg_m2.value();
    let mut all = Vec::new();
    for (joint, (linear, constant)) in linear.iter().zip(&constant).enumerate() {
        let margin = &least * (linear - accumulated.value()) - largest_inertia * constant;
        // With a positive c0 the margin makes a and c1 positive too.
        let positive = [("integral action", constant.clone()), ("margin", margin)];
        for (name, entry) in positive {
            all.push(Inequality::decide(format!("{name} of joint {}", joint + 1), &vec![vec![entry]]));
        }
    }
    all.push(Inequality::decide("damping".to_owned(), &vec![vec![least]]));
    Ok(all)
}

impl Provable for PiExponentialClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::PiExponential
    }

    fn sentence(&self, _: &Document) -> String {
        format!(
            "linearised at rest at the goal [{}] rad with its adaptive gains frozen, the loop is exponentially stable, whatever symmetric gain on q \
             has accumulated up to {} N m/rad (largest eigenvalue; the gain on dq at 0). The adaptive gains themselves are neutral directions: \
             the adaptive loop has no exponential rate",
            each(&self.goal_rad),
            self.accumulated_k0_n_m_per_rad
        )
    }

    fn scope(&self, _: &Document) -> String {
        CONTINUOUS.to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        let value = self.accumulated_k0_n_m_per_rad.clone();
        vec![Figure { name: "accumulated gain on q", value, unit: "N m/rad" }]
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(pi_inequalities(document, self)?)
    }
}

impl Provable for PiRefusedClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::PiExponential
    }

    fn sentence(&self, _: &Document) -> String {
        format!(
            "Refused: at the goal [{}] rad the frozen loop with the gains of joint {}, inertia {} kg m^2 and that joint's least friction is not asymptotically \
             stable. The inertia lies in the interval of the stated constants but is not shown to be that of an arm of the family.",
            each(&self.goal_rad),
            self.joint,
            self.inertia_kg_m2
        )
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        let Frozen { damping, linear, constant } = Frozen::new(document, &self.goal_rad)?;
        require_positive("inertia_kg_m2", &self.inertia_kg_m2)?;
        let inertia = self.inertia_kg_m2.value();
        let bounds = &document.constants.bounds;
        if inertia < bounds.m_lo_kg_m2.value() || inertia > bounds.m_hi_kg_m2.value() {
            return Err(Flaw::Counterexample { reason: "the inertia lies outside the family's interval" });
        }
        let Some(index) = self.joint.checked_sub(1).filter(|&index| index < document.arm.joints) else {
            return Err(Flaw::Counterexample { reason: "the arm has no such joint" });
        };
        if &damping[index] * &linear[index] > inertia * &constant[index] {
            return Err(Flaw::Counterexample { reason: "the loop with this inertia is asymptotically stable" });
        }
        Ok(Vec::new())
    }
}
