//! Gains as written, of either controller.

use serde::{Deserialize, Serialize};

use crate::aic::AicGains;
use crate::error::Flaw;
use crate::number::Number;
use crate::quantity::{require_at_least_zero, require_length, require_positive};

/// A controller with its gains.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "controller", rename_all = "kebab-case")]
pub enum Gains {
    /// The active inference controller.
    Aic(AicGains),
    /// The model reference adaptive controller.
    Mrac(Box<MracGains>),
}

impl Gains {
    /// The gains of the AIC.
    ///
    /// # Errors
    /// [`Flaw::Controller`] when they belong to the MRAC.
    pub fn aic(&self) -> Result<&AicGains, Flaw> {
        match self {
            Self::Aic(gains) => Ok(gains),
            Self::Mrac(_) => Err(Flaw::Controller { expected: "the AIC" }),
        }
    }

    /// The gains of the MRAC.
    ///
    /// # Errors
    /// [`Flaw::Controller`] when they belong to the AIC.
    pub fn mrac(&self) -> Result<&MracGains, Flaw> {
        match self {
            Self::Mrac(gains) => Ok(gains),
            Self::Aic(_) => Err(Flaw::Controller { expected: "the MRAC" }),
        }
    }

    /// The controller's name, and every gain with its list.
    pub(crate) fn named(&self) -> (&'static str, Vec<(&'static str, &[Number])>) {
        match self {
            Self::Aic(gains) => ("AIC", gains.named().to_vec()),
            Self::Mrac(gains) => (gains.law.in_words(), gains.named().to_vec()),
        }
    }

    pub(crate) fn check(&self, joints: usize) -> Result<(), Flaw> {
        for (gain, list) in self.named().1 {
            require_length(gain, list.len(), joints)?;
            for number in list {
                // The MRAC's adaptation may be switched off, term by term.
                let may_be_zero = gain.starts_with(['a', 'e', 'f']);
                if may_be_zero { require_at_least_zero(gain, number)? } else { require_positive(gain, number)? }
            }
        }
        Ok(())
    }
}

/// Which of its published forms the MRAC has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MracLaw {
    /// The paper's equations with its reference model.
    ReferenceModel,
    /// The paper's equations, the goal itself as reference.
    RawGoal,
    /// The authors' released code.
    ReleasedCode,
}

impl MracLaw {
    fn in_words(self) -> &'static str {
        match self {
            Self::ReferenceModel => "MRAC (equations, with reference model)",
            Self::RawGoal => "MRAC (equations, raw goal)",
            Self::ReleasedCode => "MRAC (released code)",
        }
    }
}

/// Gains of the MRAC: one number per joint, base to tip; rows as in the paper's Table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MracGains {
    /// Which form.
    pub law: MracLaw,
    /// Natural frequency of the reference model, rad/s.
    pub omega_rad_per_s: Vec<Number>,
    /// Its damping ratio.
    pub zeta: Vec<Number>,
    /// Weight of the position error in `Q = diag(l1, l2)`.
    pub l1: Vec<Number>,
    /// Weight of the velocity error.
    pub l2: Vec<Number>,
    /// Proportional, integral and derivative weights of the feed-forward term.
    pub alpha: [Vec<Number>; 3],
    /// The same for the gain on q.
    pub e0: [Vec<Number>; 3],
    /// The same for the gain on dq.
    pub e1: [Vec<Number>; 3],
    /// The same for the gain on the reference position.
    pub f0: [Vec<Number>; 3],
    /// The same for the gain on the reference velocity.
    pub f1: [Vec<Number>; 3],
}

impl MracGains {
    fn named(&self) -> [(&'static str, &[Number]); 19] {
        let Self { alpha, e0, e1, f0, f1, .. } = self;
        [
            ("omega_rad_per_s", &self.omega_rad_per_s),
            ("zeta", &self.zeta),
            ("l1", &self.l1),
            ("l2", &self.l2),
            ("alpha1", &alpha[0]),
            ("alpha2", &alpha[1]),
            ("alpha3", &alpha[2]),
            ("e01", &e0[0]),
            ("e02", &e0[1]),
            ("e03", &e0[2]),
            ("e11", &e1[0]),
            ("e12", &e1[1]),
            ("e13", &e1[2]),
            ("f01", &f0[0]),
            ("f02", &f0[1]),
            ("f03", &f0[2]),
            ("f11", &f1[0]),
            ("f12", &f1[1]),
            ("f13", &f1[2]),
        ]
    }
}
