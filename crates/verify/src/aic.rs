//! The active inference controller as the linear system it is, from its gains.
//!
//! Per joint, with `z = (e, m, mu', mu'', u~)`, `e = q - goal`, `m = mu - goal`, and `u~` the torque away from its equilibrium:
//!
//! ```text
//! e'    = dq
//! m'    = mu'  + a (e - m)    - (b/T) (mu' + m/T)
//! mu''  = mu'' + av (dq - mu') - b (mu' + m/T) - (c/T) (mu'' + mu'/T)
//! mu''' =                                      - c (mu'' + mu'/T)
//! u~'   = -kappa_a [ (e - m)/sigma_q + (dq - mu')/sigma_dq ]
//! ```
//!
//! (left-hand sides are time derivatives of `e, m, mu', mu'', u~` in this order)
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, av | `kappa_mu / sigma_q`, `kappa_mu / sigma_dq` | 1/s |
//! | b, c | `kappa_mu / sigma_mu`, `kappa_mu / sigma_mu'` | 1/s |
//! | T | reference time constant | s |
//!
//! Source: Pezzato, Ferrari, Hernandez Corbato, "A Novel Adaptive Controller for Robot Manipulators Based on Active
//! Inference", RA-L 2020, eqs. of the free energy and Algorithm 1; sigmas are variances.

use num_rational::BigRational;
use num_traits::{One, Zero};
use serde::{Deserialize, Serialize};

use crate::error::Flaw;
use crate::number::{Number, positive};

/// States of one joint's controller: e, m, mu', mu'', u~.
pub(crate) const STATES: usize = 5;

/// Gains as written: one number per joint, base to tip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AicGains {
    /// Learning rate of the beliefs, 1/s times a variance.
    pub kappa_mu: Vec<Number>,
    /// Learning rate of the torque.
    pub kappa_a: Vec<Number>,
    /// Variance of the position sensor.
    pub sigma_q: Vec<Number>,
    /// Variance of the velocity sensor.
    pub sigma_dq: Vec<Number>,
    /// Variance of the model of mu'.
    pub sigma_mu: Vec<Number>,
    /// Variance of the model of mu''.
    pub sigma_dmu: Vec<Number>,
    /// Time constant of the reference model, s.
    pub reference_time_constant_s: Vec<Number>,
}

impl AicGains {
    pub(crate) fn named(&self) -> [(&'static str, &[Number]); 7] {
        [
            ("kappa_mu", &self.kappa_mu),
            ("kappa_a", &self.kappa_a),
            ("sigma_q", &self.sigma_q),
            ("sigma_dq", &self.sigma_dq),
            ("sigma_mu", &self.sigma_mu),
            ("sigma_dmu", &self.sigma_dmu),
            ("reference_time_constant_s", &self.reference_time_constant_s),
        ]
    }

    /// Whether every joint has the same, positive gains.
    ///
    /// # Errors
    /// [`Flaw`] with the gain that is not positive, missing, or different between joints.
    pub fn shared_by_all(&self) -> Result<(), Flaw> {
        self.shared(self.kappa_mu.len()).map(|_| ())
    }

    /// The gains that every joint shares.
    ///
    /// # Errors
    /// [`Flaw`] when a list has the wrong length, a gain is not positive, or joints differ.
    pub(crate) fn shared(&self, joints: usize) -> Result<SharedGains, Flaw> {
        let mut values = Vec::with_capacity(7);
        for (gain, list) in self.named() {
            if list.len() != joints {
                return Err(Flaw::Length { quantity: gain, found: list.len(), expected: joints });
            }
            let Some(first) = list.first() else {
                return Err(Flaw::Length { quantity: gain, found: 0, expected: joints });
            };
            if let Some(bad) = list.iter().find(|x| !positive(x.value())) {
                return Err(Flaw::Quantity { quantity: gain, value: bad.to_string(), expected: "a positive number" });
            }
            if list.iter().any(|x| x.value() != first.value()) {
                return Err(Flaw::UnequalGains { gain });
            }
            values.push(first.value().clone());
        }
        let [kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, time_constant] = &values[..] else {
            return Err(Flaw::Length { quantity: "gains", found: values.len(), expected: 7 });
        };
        Ok(SharedGains {
            a: kappa_mu / sigma_q,
            av: kappa_mu / sigma_dq,
            b: kappa_mu / sigma_mu,
            c: kappa_mu / sigma_dmu,
            torque_per_position: kappa_a / sigma_q,
            torque_per_velocity: kappa_a / sigma_dq,
            time_constant: time_constant.clone(),
        })
    }
}

/// The weights of the controller's equations when all joints have the same gains.
#[derive(Clone, Debug)]
pub(crate) struct SharedGains {
    a: BigRational,
    av: BigRational,
    b: BigRational,
    c: BigRational,
    torque_per_position: BigRational,
    torque_per_velocity: BigRational,
    time_constant: BigRational,
}

/// `z' = A z + B dq` of one joint; the torque is the last state.
pub(crate) struct ControllerMatrices {
    pub(crate) a: [[BigRational; STATES]; STATES],
    pub(crate) b: [BigRational; STATES],
}

impl SharedGains {
    pub(crate) fn matrices(&self) -> ControllerMatrices {
        let Self { a, av, b, c, torque_per_position, torque_per_velocity, time_constant: t } = self;
        let zero = BigRational::zero;
        let one = BigRational::one();
        ControllerMatrices {
            a: [
                [zero(), zero(), zero(), zero(), zero()],
                [a.clone(), -a - b / (t * t), &one - b / t, zero(), zero()],
                [zero(), -b / t, -av - b - c / (t * t), &one - c / t, zero()],
                [zero(), zero(), -c / t, -c, zero()],
                [-torque_per_position, torque_per_position.clone(), torque_per_velocity.clone(), zero(), zero()],
            ],
            b: [one, zero(), av.clone(), zero(), -torque_per_velocity],
        }
    }
}
