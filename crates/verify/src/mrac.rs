//! What the proofs about the adaptive controller need of its gains.
//!
//! ```text
//! P2 = l1/(2 w^2)    P3 = l2/(4 zeta w) + l1/(4 zeta w^3)    lambda = P2/P3
//! K(x, r)   = P3 (alpha1 + e01 |x|^2 + f01 |r|^2)            damping that the proportional terms give to s = de/dt + lambda e
//! K_I(r)    = P3 (alpha2 + (e02 + f02) |r|^2)                stiffness of the integral terms at the goal r
//! ```
//!
//! Source: Pezzato, Ferrari, Hernandez Corbato, RA-L 2020; the module of the controller says how its three laws differ.

use num_rational::BigRational;
use num_traits::{Signed, Zero};

use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::gains::{MracGains, MracLaw};
use crate::number::{Number, ratio};
use crate::quantity::{require, require_length, require_plain};

/// The controller's gains as rationals, one entry per joint.
#[derive(Clone, Debug)]
pub(crate) struct Adaptation<'a> {
    gains: &'a MracGains,
    /// P3.
    pub(crate) p3: Vec<BigRational>,
    /// lambda, 1/s.
    pub(crate) lambda: Vec<BigRational>,
}

impl<'a> Adaptation<'a> {
    /// The gains of a document whose loop the proofs about the paper's equations cover.
    ///
    /// # Errors
    /// [`Flaw`] for the AIC, the released code, derivative terms, and gravity that is not compensated.
    pub(crate) fn of(document: &'a Document) -> Result<Self, Flaw> {
        let gains = document.gains.mrac()?;
        match gains.law {
            MracLaw::ReferenceModel | MracLaw::RawGoal => {}
            MracLaw::ReleasedCode => {
                return Err(Flaw::NotCovered {
                    what: "the released code, whose integrals lack the step and whose K1 reads the sum of K0",
                });
            }
        }
        if !document.family.gravity_compensation {
            return Err(Flaw::NotCovered { what: "an arm without gravity compensation" });
        }
        let derivative = [&gains.alpha[2], &gains.e0[2], &gains.e1[2], &gains.f0[2], &gains.f1[2]];
        if derivative.into_iter().flatten().any(|gain| !gain.value().is_zero()) {
            return Err(Flaw::NotCovered { what: "derivative terms of the adaptation" });
        }
        let (mut p3, mut lambda) = (Vec::new(), Vec::new());
        for joint in 0..document.arm.joints {
            let [omega, zeta, l1, l2] =
                [&gains.omega_rad_per_s, &gains.zeta, &gains.l1, &gains.l2].map(|list| list[joint].value());
            let square = omega * omega;
            let weight = (l2 + l1 / &square) / (ratio(4, 1) * zeta * omega);
            lambda.push(l1 / (ratio(2, 1) * square) / &weight);
            p3.push(weight);
        }
        Ok(Self { gains, p3, lambda })
    }

    /// `K(x, r)` of one joint from `|x|^2` and `|r|^2`.
    pub(crate) fn damping(&self, joint: usize, [x, r]: [&BigRational; 2]) -> BigRational {
        let MracGains { alpha, e0, f0, .. } = self.gains;
        &self.p3[joint] * (alpha[0][joint].value() + e0[0][joint].value() * x + f0[0][joint].value() * r)
    }

    /// `K_I(r)` of one joint from `|r|^2`.
    pub(crate) fn stiffness(&self, joint: usize, r: &BigRational) -> BigRational {
        let MracGains { alpha, e0, f0, .. } = self.gains;
        &self.p3[joint] * (alpha[1][joint].value() + (e0[1][joint].value() + f0[1][joint].value()) * r)
    }

    /// `min_i P3 e11`: what pays for the Coriolis term.
    pub(crate) fn least_velocity_adaptation(&self) -> BigRational {
        let products = self.p3.iter().zip(&self.gains.e1[0]).map(|(p3, e11)| p3 * e11.value());
        products.min().unwrap_or_else(BigRational::zero)
    }
}

/// A goal that stands in a statement, among the configurations of the constants; returns its joint angles and their squared norm.
pub(crate) fn goal(document: &Document, goal_rad: &[Number]) -> Result<(Vec<BigRational>, BigRational), Flaw> {
    require_length("goal_rad", goal_rad.len(), document.arm.joints)?;
    for angle in goal_rad {
        require_plain("goal_rad", angle)?;
    }
    if let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over {
        for ((lower, upper), angle) in lower_rad.iter().zip(upper_rad).zip(goal_rad) {
            let inside = lower.value() <= angle.value() && angle.value() <= upper.value();
            require("goal_rad", angle, inside, "an angle inside the constants' box")?;
        }
    }
    let angles: Vec<BigRational> = goal_rad.iter().map(|angle| angle.value().clone()).collect();
    let square = angles.iter().map(|x| x * x).sum();
    Ok((angles, square))
}

/// How far each joint may be from the goal before it leaves the constants' box, and the least `|q|^2` in the box.
///
/// # Errors
/// [`Flaw`] when the constants are not about a box, or the goal is not inside it.
pub(crate) fn room(document: &Document, goal_rad: &[Number]) -> Result<(Vec<BigRational>, BigRational), Flaw> {
    let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over else {
        return Err(Flaw::NotCovered { what: "constants over all angles: a box around the goal is needed" });
    };
    let mut rooms = Vec::new();
    let mut least_square = BigRational::zero();
    for ((lower, upper), goal) in lower_rad.iter().zip(upper_rad).zip(goal_rad) {
        let (below, above) = (goal.value() - lower.value(), upper.value() - goal.value());
        let room = below.min(above);
        require("goal_rad", goal, room.is_positive(), "an angle inside the constants' box")?;
        rooms.push(room);
        let (l, u) = (lower.value(), upper.value());
        if l.is_positive() || u.is_negative() {
            least_square += (l * l).min(u * u);
        }
    }
    Ok((rooms, least_square))
}
