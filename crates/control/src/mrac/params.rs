//! Gains of the adaptive controller, as plain numbers and as checked parameters.

use super::linear::ErrorWeights;
use crate::param::{self, Expected, ParamError};

/// Which of the three laws runs; see [the module](super).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MracLaw {
    /// The paper's equations, q_r the output of the reference model.
    ReferenceModel,
    /// The paper's equations with q_r = goal, q̇_r = 0.
    RawGoal,
    /// The authors' released code, deviations included.
    ReleasedCode,
}

impl MracLaw {
    /// All laws, in the order of [the module](super).
    pub const ALL: [Self; 3] = [Self::ReferenceModel, Self::RawGoal, Self::ReleasedCode];

    /// The law's name in a gains file.
    pub fn name(self) -> &'static str {
        match self {
            Self::ReferenceModel => "reference-model",
            Self::RawGoal => "raw-goal",
            Self::ReleasedCode => "released-code",
        }
    }

    /// The law of that name in a gains file, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|law| law.name() == name)
    }
}

impl core::fmt::Display for MracLaw {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Gains per joint, as in a gains file: plain numbers, unchecked. Symbols in [the module](super).
///
/// The five families hold the proportional, integral and derivative gains in this order: `alpha[1]` is the file's `alpha2`, `e0[2]` its `e03`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MracGains<const N: usize> {
    /// Which law runs.
    pub law: MracLaw,
    /// Frequency of the reference model, rad/s.
    pub omega_rad_per_s: [f64; N],
    /// Damping ratio of the reference model; 1 is critical.
    pub zeta: [f64; N],
    /// Weight of the position in the Lyapunov equation.
    pub l1: [f64; N],
    /// Weight of the velocity in the Lyapunov equation.
    pub l2: [f64; N],
    /// Gains of the feed-forward f.
    pub alpha: [[f64; N]; 3],
    /// Gains of K₀, which multiplies q.
    pub e0: [[f64; N]; 3],
    /// Gains of K₁, which multiplies q̇.
    pub e1: [[f64; N]; 3],
    /// Gains of Q₀, which multiplies q_r.
    pub f0: [[f64; N]; 3],
    /// Gains of Q₁, which multiplies q̇_r.
    pub f1: [[f64; N]; 3],
}

impl<const N: usize> MracGains<N> {
    /// The five families with the names of their rows in a gains file.
    fn families(&self) -> [([&'static str; 3], &[[f64; N]; 3]); 5] {
        [
            (["alpha1", "alpha2", "alpha3"], &self.alpha),
            (["e01", "e02", "e03"], &self.e0),
            (["e11", "e12", "e13"], &self.e1),
            (["f01", "f02", "f03"], &self.f0),
            (["f11", "f12", "f13"], &self.f1),
        ]
    }
}

/// Checked parameters of the adaptive controller at a fixed sampling step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MracParams<const N: usize> {
    gains: MracGains<N>,
    step_s: f64,
    weights: [ErrorWeights; N],
}

impl<const N: usize> MracParams<N> {
    /// Checks `gains` for use with one step each `step_s` seconds.
    ///
    /// # Errors
    /// [`ParamError::Gain`] for the first number that is not positive and finite (derivative gains may be zero, and must be under
    /// [`MracLaw::ReleasedCode`], which has none), for an ω too fast for the step under [`MracLaw::ReferenceModel`], and for l₁, l₂ whose P₂, P₃ leave the
    /// range of `f64`; [`ParamError::Shared`] for the step.
    pub fn new(gains: &MracGains<N>, step_s: f64) -> Result<Self, ParamError> {
        param::positive_step(step_s)?;
        let mut weights = [ErrorWeights { p2: 0.0, p3: 0.0 }; N];
        for (joint, weight) in weights.iter_mut().enumerate() {
            *weight = checked_reference(gains, joint, step_s)?;
            for (names, [proportional, integral, derivative]) in gains.families() {
                param::positive(names[0], joint, proportional[joint])?;
                param::positive(names[1], joint, integral[joint])?;
                let value = param::non_negative(names[2], joint, derivative[joint])?;
                if gains.law == MracLaw::ReleasedCode && value > 0.0 {
                    return Err(ParamError::Gain { gain: names[2], joint, value, expected: Expected::ZeroInThisLaw });
                }
            }
        }
        Ok(Self { gains: *gains, step_s, weights })
    }

    /// The numbers these parameters were made from.
    pub fn gains(&self) -> &MracGains<N> {
        &self.gains
    }

    /// The sampling step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Whether any derivative gain is above zero.
    pub fn has_derivatives(&self) -> bool {
        self.gains.families().iter().any(|(_, [_, _, derivative])| derivative.iter().any(|gain| *gain > 0.0))
    }

    /// P₂ and P₃ of each joint.
    pub fn error_weights(&self) -> &[ErrorWeights; N] {
        &self.weights
    }
}

fn checked_reference<const N: usize>(
    gains: &MracGains<N>,
    joint: usize,
    step_s: f64,
) -> Result<ErrorWeights, ParamError> {
    let omega = param::positive("omega_rad_per_s", joint, gains.omega_rad_per_s[joint])?;
    let zeta = param::positive("zeta", joint, gains.zeta[joint])?;
    let l1 = param::positive("l1", joint, gains.l1[joint])?;
    let l2 = param::positive("l2", joint, gains.l2[joint])?;
    let turn = omega * step_s;
    // Jury's conditions of the semi-implicit Euler step leave this one; written so that an overflow is refused too.
    let stable = zeta * turn + 0.25 * turn * turn < 1.0;
    if gains.law == MracLaw::ReferenceModel && !stable {
        let expected = Expected::StableReference;
        return Err(ParamError::Gain { gain: "omega_rad_per_s", joint, value: omega, expected });
    }
    let weights = ErrorWeights::new(omega, zeta, l1, l2);
    let usable = |weight: f64| weight > 0.0 && weight.is_finite();
    if !usable(weights.p2) || !usable(weights.p3) {
        let expected = Expected::FiniteWeights;
        return Err(ParamError::Gain { gain: "l1", joint, value: l1, expected });
    }
    Ok(weights)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The published simulation gains of joint 1 on two joints.
    pub(in crate::mrac) fn published(law: MracLaw) -> MracGains<2> {
        MracGains {
            law,
            omega_rad_per_s: [2.0; 2],
            zeta: [1.0; 2],
            l1: [1.0; 2],
            l2: [1.0; 2],
            alpha: [[40.0; 2], [4.0; 2], [0.0; 2]],
            e0: [[20.0; 2], [2.0; 2], [0.0; 2]],
            e1: [[10.0; 2], [1.0; 2], [0.0; 2]],
            f0: [[10.0; 2], [1.0; 2], [0.0; 2]],
            f1: [[1.0; 2], [1.0; 2], [0.0; 2]],
        }
    }

    #[test]
    fn a_bad_gain_is_named_with_its_joint_and_value() {
        type Field = fn(&mut MracGains<2>) -> &mut [f64; 2];
        let fields: [(&str, Field); 19] = [
            ("omega_rad_per_s", |g| &mut g.omega_rad_per_s),
            ("zeta", |g| &mut g.zeta),
            ("l1", |g| &mut g.l1),
            ("l2", |g| &mut g.l2),
            ("alpha1", |g| &mut g.alpha[0]),
            ("alpha2", |g| &mut g.alpha[1]),
            ("alpha3", |g| &mut g.alpha[2]),
            ("e01", |g| &mut g.e0[0]),
            ("e02", |g| &mut g.e0[1]),
            ("e03", |g| &mut g.e0[2]),
            ("e11", |g| &mut g.e1[0]),
            ("e12", |g| &mut g.e1[1]),
            ("e13", |g| &mut g.e1[2]),
            ("f01", |g| &mut g.f0[0]),
            ("f02", |g| &mut g.f0[1]),
            ("f03", |g| &mut g.f0[2]),
            ("f11", |g| &mut g.f1[0]),
            ("f12", |g| &mut g.f1[1]),
            ("f13", |g| &mut g.f1[2]),
        ];
        for (name, field) in fields {
            for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let mut gains = published(MracLaw::RawGoal);
                field(&mut gains)[1] = bad;
                match MracParams::new(&gains, 1e-3) {
                    Err(ParamError::Gain { gain, joint, value, .. }) => {
                        assert_eq!((gain, joint, value.to_bits()), (name, 1, bad.to_bits()));
                    }
                    // Only a derivative gain may be zero.
                    Ok(_) => assert!(bad.to_bits() == 0 && name.ends_with('3'), "{name} = {bad} was accepted"),
                    Err(other) => panic!("{name} = {bad} gave {other:?}"),
                }
            }
        }
    }

    #[test]
    fn the_released_code_has_no_derivative_term() {
        let mut gains = published(MracLaw::ReleasedCode);
        gains.e1[2][0] = 0.5;
        let expected = Expected::ZeroInThisLaw;
        let error = ParamError::Gain { gain: "e13", joint: 0, value: 0.5, expected };
        assert_eq!(MracParams::new(&gains, 1e-3), Err(error));
        gains.law = MracLaw::RawGoal;
        assert!(MracParams::new(&gains, 1e-3).is_ok());
    }

    #[test]
    fn a_reference_too_fast_for_the_step_is_refused_only_where_it_runs() {
        // zeta w h + (w h)^2/4 = 1 at w h = 2 (sqrt 2 - 1) = 0.828 for zeta = 1.
        for (omega, accepted) in [(828.0, true), (829.0, false)] {
            let mut gains = published(MracLaw::ReferenceModel);
            gains.omega_rad_per_s[1] = omega;
            assert_eq!(MracParams::new(&gains, 1e-3).is_ok(), accepted);
            gains.law = MracLaw::ReleasedCode;
            assert!(MracParams::new(&gains, 1e-3).is_ok());
        }
    }

    #[test]
    fn a_law_is_found_by_its_name() {
        for law in MracLaw::ALL {
            assert_eq!(MracLaw::from_name(law.name()), Some(law));
        }
        assert_eq!(MracLaw::from_name("raw goal"), None);
    }
}
