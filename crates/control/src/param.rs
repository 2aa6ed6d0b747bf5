//! Numbers checked once, at the door; the proof stays in the type.

use certune_linsys::Real;

/// What a parameter should have been.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Finite and above zero.
    Positive,
    /// Finite and not below zero; zero switches the term off.
    NonNegative,
    /// Finite, above zero, and so is its inverse.
    PositiveWithFiniteInverse,
    /// A learning rate whose quotients by the variances stay finite.
    FiniteWeights,
    /// Zero: the named law has no such term.
    ZeroInThisLaw,
    /// Slow enough for the sampling step: `ζωh + (ωh)²/4 < 1`, or the sampled reference model diverges.
    StableReference,
}

impl core::fmt::Display for Expected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Positive => "a positive finite number",
            Self::NonNegative => "a finite number, zero or above",
            Self::PositiveWithFiniteInverse => "a positive finite number with a finite inverse",
            Self::FiniteWeights => "a number whose quotients by the variances are finite",
            Self::ZeroInThisLaw => "0: this law has no such term",
            Self::StableReference => "zeta omega h + (omega h)^2 / 4 < 1, h the sampling step",
        })
    }
}

/// Why plain numbers are no controller parameters.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// A gain of one joint is out of its range.
    #[error("{gain} of joint {number} is {value}, expected {expected}", number = joint + 1)]
    Gain {
        /// The gain's name, as in a gains file.
        gain: &'static str,
        /// The joint, counted from 0 at the base (the message counts from 1).
        joint: usize,
        /// The number given.
        value: f64,
        /// What it should have been.
        expected: Expected,
    },
    /// A parameter shared by all joints is out of its range.
    #[error("{parameter} is {value}, expected {expected}")]
    Shared {
        /// The parameter's name, with its unit.
        parameter: &'static str,
        /// The number given.
        value: f64,
        /// What it should have been.
        expected: Expected,
    },
    /// A variance has no finite positive inverse.
    #[error("variance is {value}, expected a positive finite number with a finite inverse")]
    Variance {
        /// The number given.
        value: f64,
    },
}

/// Inverse variance of one channel: finite, strictly positive.
///
/// The controllers of the literature call both `sigma` and `1/sigma` by the same name; here a `sigma_*` is always a
/// variance and its inverse always a `Precision`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision(f64);

impl Precision {
    /// The precision of a unit variance.
    pub const ONE: Self = Self(1.0);

    /// The precision `1 / variance`.
    ///
    /// # Errors
    /// [`ParamError::Variance`] unless `1 / variance` is finite and positive.
    pub fn from_variance(variance: f64) -> Result<Self, ParamError> {
        let precision = variance.recip();
        (precision > 0.0 && precision.is_finite())
            .then_some(Self(precision))
            .ok_or(ParamError::Variance { value: variance })
    }

    /// The inverse variance.
    pub fn value(self) -> f64 {
        self.0
    }

    /// The inverse variance as the scalar of a recursion.
    pub(crate) fn splat<T: Real>(self) -> T {
        T::from_f64(self.0)
    }
}

/// `value` as the gain `gain` of `joint`, if positive and finite.
pub(crate) fn positive(gain: &'static str, joint: usize, value: f64) -> Result<f64, ParamError> {
    let expected = Expected::Positive;
    (value > 0.0 && value.is_finite()).then_some(value).ok_or(ParamError::Gain { gain, joint, value, expected })
}

/// `value` as the gain `gain` of `joint`, if finite and not negative.
pub(crate) fn non_negative(gain: &'static str, joint: usize, value: f64) -> Result<f64, ParamError> {
    let expected = Expected::NonNegative;
    (value >= 0.0 && value.is_finite()).then_some(value).ok_or(ParamError::Gain { gain, joint, value, expected })
}

/// `value` as the gain `gain` of `joint`, if it and its inverse are positive and finite.
pub(crate) fn with_inverse(gain: &'static str, joint: usize, value: f64) -> Result<f64, ParamError> {
    let expected = Expected::PositiveWithFiniteInverse;
    let inverse = value.recip();
    let holds = value > 0.0 && value.is_finite() && inverse.is_finite();
    holds.then_some(value).ok_or(ParamError::Gain { gain, joint, value, expected })
}

/// `step_s` as a sampling step, if positive and finite.
pub(crate) fn positive_step(step_s: f64) -> Result<f64, ParamError> {
    let (parameter, expected) = ("step_s", Expected::Positive);
    (step_s > 0.0 && step_s.is_finite()).then_some(step_s).ok_or(ParamError::Shared {
        parameter,
        value: step_s,
        expected,
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_precision_is_the_inverse_of_a_variance_or_nothing() {
        assert_eq!(Precision::from_variance(4.0).map(Precision::value), Ok(0.25));
        for bad in [0.0, -0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, 1e-310] {
            assert_eq!(Precision::from_variance(bad), Err(ParamError::Variance { value: bad }));
        }
        assert!(matches!(Precision::from_variance(f64::NAN), Err(ParamError::Variance { value }) if value.is_nan()));
    }

    #[test]
    fn an_error_counts_joints_from_one_and_says_what_would_do() {
        let error = positive("kappa_a", 2, -1.5).map_err(|error| error.to_string());
        assert_eq!(error, Err("kappa_a of joint 3 is -1.5, expected a positive finite number".to_string()));
    }
}
