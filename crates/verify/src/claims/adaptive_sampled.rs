//! Claim `adaptive-sampled`: the fastest part of the adaptive loop, its velocity loop, survives sampling and delay.
//!
//! At the goal r the torque holds `-K dq` with `K = P3 (alpha1 + (e01 + f01)|r|^2)` between samples h apart, k samples late. Without friction
//! the velocity obeys, exactly for a constant inertia matrix,
//!
//! ```text
//! M v_(j+1) = M v_j - h K v_(j-k),      z^(k+1) - z^k + x = 0  for every eigenvalue x of h M^-1 K.
//! ```
//!
//! All roots lie in the open unit disk iff `0 < x < 2, 1, (sqrt 5 - 1)/2` for k = 0, 1, 2 (Jury). `M >= diag(l)` gives `x <= max_i h K_i/l_i`, and
//! `x >= h K_i/M_ii` for one of them. The golden section is entered as 0.618 from below and 0.6181 from above. Position, integral and Coriolis
//! terms are left out: a velocity loop that fails here chatters; one that holds is no proof of the whole loop.

use num_rational::BigRational;
use num_traits::Signed;
use serde::{Deserialize, Serialize};

use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::document::Document;
use crate::error::Flaw;
use crate::mrac::{Adaptation, goal, room};
use crate::number::{Number, positive, ratio};
use crate::quantity::require_positive;
use crate::statement::{each, refused};

/// The sampled velocity loop decays, or (as [`Claim::AdaptiveSampledRefused`](super::Claim)) grows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveSampledClaim {
    /// The constant goal, rad.
    pub goal_rad: Vec<Number>,
    /// Sampling step, s.
    pub step_s: Number,
    /// Samples of delay: 0, 1 or 2.
    pub delay_samples: u32,
}

/// The same loop is unstable because of one joint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveSampledRefusedClaim {
    /// The loop.
    pub velocity_loop: AdaptiveSampledClaim,
    /// The joint, from 1 at the base.
    pub joint: usize,
}

/// Rationals below and above the largest stable `h K/m`.
fn limits(delay_samples: u32) -> Result<[BigRational; 2], Flaw> {
    match delay_samples {
        0 => Ok([ratio(2, 1), ratio(2, 1)]),
        1 => Ok([ratio(1, 1), ratio(1, 1)]),
        // x^2 + x < 1 at 0.618, > 1 at 0.6181.
        2 => Ok([ratio(618, 1000), ratio(6181, 10_000)]),
        _ => Err(Flaw::NotCovered { what: "more than two samples of delay" }),
    }
}

impl AdaptiveSampledClaim {
    /// `h K_i` for every joint, kg m^2.
    fn reach(&self, document: &Document) -> Result<Vec<BigRational>, Flaw> {
        require_positive("step_s", &self.step_s)?;
        let adaptation = Adaptation::of(document)?;
        let (_, square) = goal(document, &self.goal_rad)?;
        let joints = 0..document.arm.joints;
        Ok(joints.map(|joint| adaptation.damping(joint, [&square, &square]) * self.step_s.value()).collect())
    }

    fn in_words(&self) -> String {
        format!(
            "sampled every {} s with {} samples of delay, torque held between samples, the velocity loop M dv/dt = -K v that the proportional terms \
             close at the goal [{}] rad (no friction; position, integral and Coriolis terms left out, M constant)",
            self.step_s,
            self.delay_samples,
            each(&self.goal_rad)
        )
    }
}

impl Provable for AdaptiveSampledClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::AdaptiveSampled
    }

    fn sentence(&self, _: &Document) -> String {
        format!(
            "{} is exponentially stable for every inertia matrix of the family. The rest of the loop is not covered",
            self.in_words()
        )
    }

    fn scope(&self, _: &Document) -> String {
        "discrete time, linear, no torque limit, no noise".to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        vec![Figure { name: "step", value: self.step_s.clone(), unit: "s" }]
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        let reach = self.reach(document)?;
        if !reach.iter().all(positive) {
            return Err(Flaw::NotCovered { what: "a joint without damping" });
        }
        let [limit, _] = limits(self.delay_samples)?;
        let bounds = &document.constants.bounds;
        let uniform = vec![bounds.m_lo_kg_m2.clone(); document.family.joints()];
        let below = bounds.diagonal_kg_m2.as_ref().map(|[lower, _]| lower.clone());
        let check = |lower: &[Number]| -> Vec<Inequality> {
            reach
                .iter()
                .zip(lower)
                .enumerate()
                .map(|(joint, (reach, lower))| {
                    let margin = lower.value() * &limit - reach;
                    Inequality::decide(format!("step of joint {}", joint + 1), &vec![vec![margin]])
                })
                .collect()
        };
        match below.map(|lower| all_hold(check(&lower))) {
            Some(Ok(held)) => Ok(held),
            Some(Err(_)) | None => all_hold(check(&uniform)),
        }
    }
}

impl Provable for AdaptiveSampledRefusedClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::AdaptiveSampled
    }

    fn sentence(&self, document: &Document) -> String {
        format!(
            "{}: {} is unstable for every arm of the family at the goal, because of joint {}.",
            refused(document),
            self.velocity_loop.in_words(),
            self.joint
        )
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        let reach = self.velocity_loop.reach(document)?;
        let [_, limit] = limits(self.velocity_loop.delay_samples)?;
        room(document, &self.velocity_loop.goal_rad)?;
        let inertia = document.constants.bounds.inertia.as_ref().ok_or(Flaw::Missing { constant: "inertia" })?;
        let Some(index) = self.joint.checked_sub(1).filter(|&index| index < document.arm.joints) else {
            return Err(Flaw::Counterexample { reason: "the arm has no such joint" });
        };
        let largest = inertia.midpoint_kg_m2[index][index].value() + inertia.radius_kg_m2[index][index].value();
        // The largest eigenvalue of K^(1/2) M^-1 K^(1/2) is at least K_i (M^-1)_ii >= K_i / M_ii.
        if (&reach[index] - limit * largest).is_positive() {
            Ok(Vec::new())
        } else {
            Err(Flaw::Counterexample { reason: "the joint's own inertia does not show the velocity loop unstable" })
        }
    }
}
