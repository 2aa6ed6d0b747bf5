//! Gains of the active inference controller, as plain numbers and as checked parameters.

use crate::param::{self, Expected, ParamError, Precision};

/// Gains per joint, as in a gains file: plain numbers, unchecked. Symbols in [the module](super).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AicGains<const N: usize> {
    /// Learning rate of the beliefs.
    pub kappa_mu: [f64; N],
    /// Learning rate of the torque.
    pub kappa_a: [f64; N],
    /// Variance of the measured position.
    pub sigma_q: [f64; N],
    /// Variance of the measured velocity.
    pub sigma_dq: [f64; N],
    /// Variance of the model error `μ′ − f(μ)`.
    pub sigma_mu: [f64; N],
    /// Variance of the model error `μ″ − (∂f/∂μ) μ′`.
    pub sigma_dmu: [f64; N],
    /// Time constant of the reference `f(μ) = (μ_d − μ)/T`, s; the paper has 1.
    pub reference_time_constant_s: [f64; N],
}

impl AicGains<1> {
    /// The same gains on each of `N` joints.
    pub fn on_every_joint<const N: usize>(&self) -> AicGains<N> {
        AicGains {
            kappa_mu: [self.kappa_mu[0]; N],
            kappa_a: [self.kappa_a[0]; N],
            sigma_q: [self.sigma_q[0]; N],
            sigma_dq: [self.sigma_dq[0]; N],
            sigma_mu: [self.sigma_mu[0]; N],
            sigma_dmu: [self.sigma_dmu[0]; N],
            reference_time_constant_s: [self.reference_time_constant_s[0]; N],
        }
    }
}

impl<const N: usize> AicGains<N> {
    /// The gains of one joint, counted from 0 at the base.
    ///
    /// # Panics
    /// If `joint >= N`.
    pub fn joint(&self, joint: usize) -> AicGains<1> {
        AicGains {
            kappa_mu: [self.kappa_mu[joint]],
            kappa_a: [self.kappa_a[joint]],
            sigma_q: [self.sigma_q[joint]],
            sigma_dq: [self.sigma_dq[joint]],
            sigma_mu: [self.sigma_mu[joint]],
            sigma_dmu: [self.sigma_dmu[joint]],
            reference_time_constant_s: [self.reference_time_constant_s[joint]],
        }
    }

    /// The gains that all joints share, if they share them all to the bit.
    pub fn shared(&self) -> Option<AicGains<1>> {
        let first = (N > 0).then(|| self.joint(0))?;
        (1..N).all(|joint| self.joint(joint) == first).then_some(first)
    }
}

/// Checked parameters of the active inference controller at a fixed sampling step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AicParams<const N: usize> {
    gains: AicGains<N>,
    step_s: f64,
    pub(super) precision: [JointPrecisions; N],
}

/// Inverse variances of one joint's four channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JointPrecisions {
    pub(super) q: Precision,
    pub(super) dq: Precision,
    pub(super) mu: Precision,
    pub(super) dmu: Precision,
}

impl<const N: usize> AicParams<N> {
    /// Checks `gains` for use with one step each `step_s` seconds.
    ///
    /// # Errors
    /// [`ParamError::Gain`] for the first gain, joint by joint, that is not positive and finite, whose inverse (variances, time constant) is not
    /// finite, or whose quotients by the variances leave the range of `f64`; [`ParamError::Shared`] for the step.
    pub fn new(gains: &AicGains<N>, step_s: f64) -> Result<Self, ParamError> {
        param::positive_step(step_s)?;
        let mut failure = Ok(());
        let precision = core::array::from_fn(|joint| {
            checked_joint(&gains.joint(joint), joint).unwrap_or_else(|error| {
                if failure.is_ok() {
                    failure = Err(error);
                }
                JointPrecisions { q: Precision::ONE, dq: Precision::ONE, mu: Precision::ONE, dmu: Precision::ONE }
            })
        });
        failure?;
        Ok(Self { gains: *gains, step_s, precision })
    }

    /// The numbers these parameters were made from.
    pub fn gains(&self) -> &AicGains<N> {
        &self.gains
    }

    /// The sampling step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }
}

fn checked_joint(gains: &AicGains<1>, joint: usize) -> Result<JointPrecisions, ParamError> {
    let kappa_mu = param::positive("kappa_mu", joint, gains.kappa_mu[0])?;
    let kappa_a = param::positive("kappa_a", joint, gains.kappa_a[0])?;
    let variance = |gain, value| param::with_inverse(gain, joint, value).and_then(Precision::from_variance);
    let q = variance("sigma_q", gains.sigma_q[0])?;
    let dq = variance("sigma_dq", gains.sigma_dq[0])?;
    let mu = variance("sigma_mu", gains.sigma_mu[0])?;
    let dmu = variance("sigma_dmu", gains.sigma_dmu[0])?;
    let rate = param::with_inverse("reference_time_constant_s", joint, gains.reference_time_constant_s[0])?.recip();
    let finite = |gain, value, weight: f64| {
        let expected = Expected::FiniteWeights;
        if weight.is_finite() { Ok(()) } else { Err(ParamError::Gain { gain, joint, value, expected }) }
    };
    finite("kappa_a", kappa_a, kappa_a * (q.value() + dq.value()))?;
    let largest = q.value() + dq.value() + (mu.value() + dmu.value()) * (1.0 + rate) * (1.0 + rate);
    finite("kappa_mu", kappa_mu, kappa_mu * largest)?;
    Ok(JointPrecisions { q, dq, mu, dmu })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PUBLISHED: AicGains<1> = AicGains {
        kappa_mu: [11.67],
        kappa_a: [700.0],
        sigma_q: [1.0],
        sigma_dq: [1.0],
        sigma_mu: [5.0],
        sigma_dmu: [10.0],
        reference_time_constant_s: [1.0],
    };

    type Field = fn(&mut AicGains<7>) -> &mut [f64; 7];
    const FIELDS: [(&str, Field); 7] = [
        ("kappa_mu", |g| &mut g.kappa_mu),
        ("kappa_a", |g| &mut g.kappa_a),
        ("sigma_q", |g| &mut g.sigma_q),
        ("sigma_dq", |g| &mut g.sigma_dq),
        ("sigma_mu", |g| &mut g.sigma_mu),
        ("sigma_dmu", |g| &mut g.sigma_dmu),
        ("reference_time_constant_s", |g| &mut g.reference_time_constant_s),
    ];

    #[test]
    fn a_bad_gain_is_named_with_its_joint_and_value() {
        for (name, field) in FIELDS {
            for bad in [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut gains = PUBLISHED.on_every_joint::<7>();
                field(&mut gains)[4] = bad;
                match AicParams::new(&gains, 1e-3) {
                    Err(ParamError::Gain { gain, joint, value, .. }) => {
                        assert_eq!((gain, joint, value.to_bits()), (name, 4, bad.to_bits()));
                    }
                    other => panic!("{name} = {bad} gave {other:?}"),
                }
            }
        }
    }

    #[test]
    fn the_first_bad_joint_is_reported() {
        let mut gains = PUBLISHED.on_every_joint::<7>();
        gains.sigma_mu[5] = -1.0;
        gains.sigma_dmu[2] = -2.0;
        let expected = Expected::PositiveWithFiniteInverse;
        let error = ParamError::Gain { gain: "sigma_dmu", joint: 2, value: -2.0, expected };
        assert_eq!(AicParams::new(&gains, 1e-3), Err(error));
    }

    #[test]
    fn a_bad_step_is_refused() {
        for bad in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
            assert!(matches!(AicParams::new(&PUBLISHED, bad), Err(ParamError::Shared { parameter: "step_s", .. })));
        }
    }

    #[test]
    fn weights_that_overflow_are_refused() {
        let tiny_variance = AicGains { sigma_q: [1e-300], kappa_a: [1e30], ..PUBLISHED };
        let error = AicParams::new(&tiny_variance, 1e-3);
        assert!(matches!(error, Err(ParamError::Gain { gain: "kappa_a", expected: Expected::FiniteWeights, .. })));
        let no_inverse = AicGains { sigma_q: [1e-310], ..PUBLISHED };
        assert!(matches!(AicParams::new(&no_inverse, 1e-3), Err(ParamError::Gain { gain: "sigma_q", .. })));
    }

    #[test]
    fn gains_are_shared_only_if_no_joint_differs() {
        let mut gains = PUBLISHED.on_every_joint::<7>();
        assert_eq!(gains.shared(), Some(PUBLISHED));
        gains.sigma_q[6] = 100.0;
        assert_eq!(gains.shared(), None);
    }
}
