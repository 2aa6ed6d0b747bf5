//! The table of the adaptive controller.

use certune_control::mrac::{MracGains, MracLaw};
use serde::{Deserialize, Serialize};

use super::per_joint::{PerJoint, non_negative, positive};
use crate::file::KeyError;

/// The table `[mrac]`: the law's name and 19 rows. Index 1 is proportional, 2 integral, 3 derivative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MracTable {
    /// Which of the three laws.
    pub law: LawName,
    /// Frequency of the reference model, rad/s.
    #[serde(deserialize_with = "positive")]
    pub omega_rad_per_s: PerJoint,
    /// Damping of the reference model.
    #[serde(deserialize_with = "positive")]
    pub zeta: PerJoint,
    /// Lyapunov weight of the position error.
    #[serde(deserialize_with = "positive")]
    pub l1: PerJoint,
    /// Lyapunov weight of the velocity error.
    #[serde(deserialize_with = "positive")]
    pub l2: PerJoint,
    /// Proportional gain of the modified error.
    #[serde(deserialize_with = "positive")]
    pub alpha1: PerJoint,
    /// Integral gain of the modified error.
    #[serde(deserialize_with = "positive")]
    pub alpha2: PerJoint,
    /// Derivative gain of the modified error; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub alpha3: PerJoint,
    /// Proportional gain of the feedback of position.
    #[serde(deserialize_with = "positive")]
    pub e01: PerJoint,
    /// Integral gain of the feedback of position.
    #[serde(deserialize_with = "positive")]
    pub e02: PerJoint,
    /// Derivative gain of the feedback of position; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub e03: PerJoint,
    /// Proportional gain of the feedback of velocity.
    #[serde(deserialize_with = "positive")]
    pub e11: PerJoint,
    /// Integral gain of the feedback of velocity.
    #[serde(deserialize_with = "positive")]
    pub e12: PerJoint,
    /// Derivative gain of the feedback of velocity; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub e13: PerJoint,
    /// Proportional gain of the feed-forward of the reference position.
    #[serde(deserialize_with = "positive")]
    pub f01: PerJoint,
    /// Integral gain of the feed-forward of the reference position.
    #[serde(deserialize_with = "positive")]
    pub f02: PerJoint,
    /// Derivative gain of the feed-forward of the reference position; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub f03: PerJoint,
    /// Proportional gain of the feed-forward of the reference velocity.
    #[serde(deserialize_with = "positive")]
    pub f11: PerJoint,
    /// Integral gain of the feed-forward of the reference velocity.
    #[serde(deserialize_with = "positive")]
    pub f12: PerJoint,
    /// Derivative gain of the feed-forward of the reference velocity; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub f13: PerJoint,
}

fn zero() -> PerJoint {
    PerJoint::Shared(0.0)
}

/// The three adaptive laws by the names they have in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawName {
    /// The paper's equations, the reference from a second-order model.
    ReferenceModel,
    /// The paper's equations, the reference is the goal.
    RawGoal,
    /// The authors' released code.
    ReleasedCode,
}

impl From<LawName> for MracLaw {
    fn from(name: LawName) -> Self {
        match name {
            LawName::ReferenceModel => Self::ReferenceModel,
            LawName::RawGoal => Self::RawGoal,
            LawName::ReleasedCode => Self::ReleasedCode,
        }
    }
}

impl From<MracLaw> for LawName {
    fn from(law: MracLaw) -> Self {
        match law {
            MracLaw::ReferenceModel => Self::ReferenceModel,
            MracLaw::RawGoal => Self::RawGoal,
            MracLaw::ReleasedCode => Self::ReleasedCode,
        }
    }
}

impl MracTable {
    /// The gains of an arm with `N` joints.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self) -> Result<MracGains<N>, KeyError> {
        Ok(MracGains {
            law: self.law.into(),
            omega_rad_per_s: self.omega_rad_per_s.bind("mrac.omega_rad_per_s")?,
            zeta: self.zeta.bind("mrac.zeta")?,
            l1: self.l1.bind("mrac.l1")?,
            l2: self.l2.bind("mrac.l2")?,
            alpha: [
                self.alpha1.bind("mrac.alpha1")?,
                self.alpha2.bind("mrac.alpha2")?,
                self.alpha3.bind("mrac.alpha3")?,
            ],
            e0: [self.e01.bind("mrac.e01")?, self.e02.bind("mrac.e02")?, self.e03.bind("mrac.e03")?],
            e1: [self.e11.bind("mrac.e11")?, self.e12.bind("mrac.e12")?, self.e13.bind("mrac.e13")?],
            f0: [self.f01.bind("mrac.f01")?, self.f02.bind("mrac.f02")?, self.f03.bind("mrac.f03")?],
            f1: [self.f11.bind("mrac.f11")?, self.f12.bind("mrac.f12")?, self.f13.bind("mrac.f13")?],
        })
    }

    /// The rows in the order of the file, each with its key.
    pub fn rows(&self) -> [(&'static str, &PerJoint); 19] {
        [
            ("omega_rad_per_s", &self.omega_rad_per_s),
            ("zeta", &self.zeta),
            ("l1", &self.l1),
            ("l2", &self.l2),
            ("alpha1", &self.alpha1),
            ("alpha2", &self.alpha2),
            ("alpha3", &self.alpha3),
            ("e01", &self.e01),
            ("e02", &self.e02),
            ("e03", &self.e03),
            ("e11", &self.e11),
            ("e12", &self.e12),
            ("e13", &self.e13),
            ("f01", &self.f01),
            ("f02", &self.f02),
            ("f03", &self.f03),
            ("f11", &self.f11),
            ("f12", &self.f12),
            ("f13", &self.f13),
        ]
    }

    /// The row of that key.
    pub(super) fn row_mut(&mut self, key: &str) -> Option<&mut PerJoint> {
        Some(match key {
            "omega_rad_per_s" => &mut self.omega_rad_per_s,
            "zeta" => &mut self.zeta,
            "l1" => &mut self.l1,
            "l2" => &mut self.l2,
            "alpha1" => &mut self.alpha1,
            "alpha2" => &mut self.alpha2,
            "alpha3" => &mut self.alpha3,
            "e01" => &mut self.e01,
            "e02" => &mut self.e02,
            "e03" => &mut self.e03,
            "e11" => &mut self.e11,
            "e12" => &mut self.e12,
            "e13" => &mut self.e13,
            "f01" => &mut self.f01,
            "f02" => &mut self.f02,
            "f03" => &mut self.f03,
            "f11" => &mut self.f11,
            "f12" => &mut self.f12,
            "f13" => &mut self.f13,
            _ => return None,
        })
    }

    /// The table with the same number in every row.
    pub fn uniform(law: LawName, value: f64) -> Self {
        let row = || PerJoint::Shared(value);
        Self {
            law,
            omega_rad_per_s: row(),
            zeta: row(),
            l1: row(),
            l2: row(),
            alpha1: row(),
            alpha2: row(),
            alpha3: row(),
            e01: row(),
            e02: row(),
            e03: row(),
            e11: row(),
            e12: row(),
            e13: row(),
            f01: row(),
            f02: row(),
            f03: row(),
            f11: row(),
            f12: row(),
            f13: row(),
        }
    }
}

impl<const N: usize> From<&MracGains<N>> for MracTable {
    fn from(gains: &MracGains<N>) -> Self {
        Self {
            law: gains.law.into(),
            omega_rad_per_s: gains.omega_rad_per_s.into(),
            zeta: gains.zeta.into(),
            l1: gains.l1.into(),
            l2: gains.l2.into(),
            alpha1: gains.alpha[0].into(),
            alpha2: gains.alpha[1].into(),
            alpha3: gains.alpha[2].into(),
            e01: gains.e0[0].into(),
            e02: gains.e0[1].into(),
            e03: gains.e0[2].into(),
            e11: gains.e1[0].into(),
            e12: gains.e1[1].into(),
            e13: gains.e1[2].into(),
            f01: gains.f0[0].into(),
            f02: gains.f0[1].into(),
            f03: gains.f0[2].into(),
            f11: gains.f1[0].into(),
            f12: gains.f1[1].into(),
            f13: gains.f1[2].into(),
        }
    }
}
