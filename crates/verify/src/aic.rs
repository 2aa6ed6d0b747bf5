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
use crate::quantity::{require, require_length};

/// States of one joint's controller: e, m, mu', mu'', u~.
pub const STATES: usize = 5;

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
        for (gain, list) in self.named() {
            require_length(gain, list.len(), joints)?;
            if list.iter().any(|x| Some(x.value()) != list.first().map(Number::value)) {
                return Err(Flaw::UnequalGains { gain });
            }
        }
        self.of_joint(0)
    }

    /// The weights of one joint's equations, joints counted from 0.
    ///
    /// # Errors
    /// [`Flaw`] when a list ends before that joint or the joint's gain is not positive.
    pub(crate) fn of_joint(&self, joint: usize) -> Result<SharedGains, Flaw> {
        let value = |gain, list: &[Number]| {
            let Some(number) = list.get(joint) else {
                return Err(Flaw::Length { quantity: gain, found: list.len(), expected: joint + 1 });
            };
            require(gain, number, positive(number.value()), "a positive number")?;
            Ok(number.value().clone())
        };
        let kappa_mu = value("kappa_mu", &self.kappa_mu)?;
        let kappa_a = value("kappa_a", &self.kappa_a)?;
        let sigma_q = value("sigma_q", &self.sigma_q)?;
        let sigma_dq = value("sigma_dq", &self.sigma_dq)?;
        Ok(SharedGains {
            a: &kappa_mu / &sigma_q,
            av: &kappa_mu / &sigma_dq,
            b: &kappa_mu / value("sigma_mu", &self.sigma_mu)?,
            c: &kappa_mu / value("sigma_dmu", &self.sigma_dmu)?,
            torque_per_position: &kappa_a / sigma_q,
            torque_per_velocity: &kappa_a / sigma_dq,
            time_constant: value("reference_time_constant_s", &self.reference_time_constant_s)?,
        })
    }

    /// `z' = A z + B dq` of one joint, joints counted from 0.
    ///
    /// # Errors
    /// [`Flaw`] when a list ends before that joint or the joint's gain is not positive.
    pub fn controller(&self, joint: usize) -> Result<Controller<BigRational>, Flaw> {
        Ok(self.of_joint(joint)?.matrices())
    }
}

/// The weights of the controller's equations of one joint, or of every joint when all have the same gains.
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
#[derive(Clone, Debug, PartialEq)]
pub struct Controller<T> {
    /// A, row by row.
    pub a: [[T; STATES]; STATES],
    /// B.
    pub b: [T; STATES],
}

impl<T> Controller<T> {
    /// The matrices over another field.
    pub fn map<S>(&self, convert: impl Fn(&T) -> S) -> Controller<S> {
        Controller { a: self.a.each_ref().map(|row| row.each_ref().map(&convert)), b: self.b.each_ref().map(&convert) }
    }
}

impl SharedGains {
    pub(crate) fn matrices(&self) -> Controller<BigRational> {
        let Self { a, av, b, c, torque_per_position, torque_per_velocity, time_constant: t } = self;
        let zero = BigRational::zero;
        let one = BigRational::one();
        Controller {
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

    /// One sampling step of length h: `x+ = F x + G y`, `x = (m, mu', mu'', u~)`, `y = (e, dq)`; the torque that follows is `u~+`.
    ///
    /// The beliefs take an Euler step from the old beliefs and the new measurement; the torque then descends with the beliefs just updated.
    pub(crate) fn sampled(&self, h: &BigRational) -> SampledMatrices {
        const BELIEFS: usize = 3;
        let Controller { a, b } = self.matrices();
        let mut f: [[BigRational; 4]; 4] = Default::default();
        let mut g: [[BigRational; 2]; 4] = Default::default();
        for i in 0..BELIEFS {
            for j in 0..BELIEFS {
                f[i][j] = h * &a[i + 1][j + 1];
            }
            f[i][i] += BigRational::one();
            g[i] = [h * &a[i + 1][0], h * &b[i + 1]];
        }
        // u~+ = u~ + h (a_40 e + b_4 dq + a_41 m+ + a_42 mu'+).
        let [of_e, of_m, of_dmu, ..] = &a[BELIEFS + 1];
        let chained = |m: &BigRational, dmu: &BigRational| h * (of_m * m + of_dmu * dmu);
        for j in 0..BELIEFS {
            f[BELIEFS][j] = chained(&f[0][j], &f[1][j]);
        }
        f[BELIEFS][BELIEFS] = BigRational::one();
        for (j, direct) in [of_e, &b[BELIEFS + 1]].into_iter().enumerate() {
            g[BELIEFS][j] = chained(&g[0][j], &g[1][j]) + h * direct;
        }
        SampledMatrices { f, g }
    }
}

/// `x+ = F x + G y` of one joint; the torque is the last state.
pub(crate) struct SampledMatrices {
    pub(crate) f: [[BigRational; 4]; 4],
    pub(crate) g: [[BigRational; 2]; 4],
}
