//! The table of the active inference controller.

use certune_control::aic::AicGains;
use serde::{Deserialize, Serialize};

use super::per_joint::{PerJoint, positive};
use crate::file::KeyError;

/// The table `[aic]`: seven rows, all strictly positive. `sigma_*` are variances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AicTable {
    /// Learning rate of the beliefs.
    #[serde(deserialize_with = "positive")]
    pub kappa_mu: PerJoint,
    /// Learning rate of the torque.
    #[serde(deserialize_with = "positive")]
    pub kappa_a: PerJoint,
    /// Variance of the measured position.
    #[serde(deserialize_with = "positive")]
    pub sigma_q: PerJoint,
    /// Variance of the measured velocity.
    #[serde(deserialize_with = "positive")]
    pub sigma_dq: PerJoint,
    /// Variance of the belief's position dynamics.
    #[serde(deserialize_with = "positive")]
    pub sigma_mu: PerJoint,
    /// Variance of the belief's velocity dynamics.
    #[serde(deserialize_with = "positive")]
    pub sigma_dmu: PerJoint,
    /// Time constant of the reference model, s; 1 in the literature.
    #[serde(deserialize_with = "positive", default = "one")]
    pub reference_time_constant_s: PerJoint,
}

fn one() -> PerJoint {
    PerJoint::Shared(1.0)
}

impl AicTable {
    /// The gains of an arm with `N` joints.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self) -> Result<AicGains<N>, KeyError> {
        Ok(AicGains {
            kappa_mu: self.kappa_mu.bind("aic.kappa_mu")?,
            kappa_a: self.kappa_a.bind("aic.kappa_a")?,
            sigma_q: self.sigma_q.bind("aic.sigma_q")?,
            sigma_dq: self.sigma_dq.bind("aic.sigma_dq")?,
            sigma_mu: self.sigma_mu.bind("aic.sigma_mu")?,
            sigma_dmu: self.sigma_dmu.bind("aic.sigma_dmu")?,
            reference_time_constant_s: self.reference_time_constant_s.bind("aic.reference_time_constant_s")?,
        })
    }

    /// The rows in the order of the file, each with its key.
    pub fn rows(&self) -> [(&'static str, &PerJoint); 7] {
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

    /// The row of that key.
    pub(super) fn row_mut(&mut self, key: &str) -> Option<&mut PerJoint> {
        Some(match key {
            "kappa_mu" => &mut self.kappa_mu,
            "kappa_a" => &mut self.kappa_a,
            "sigma_q" => &mut self.sigma_q,
            "sigma_dq" => &mut self.sigma_dq,
            "sigma_mu" => &mut self.sigma_mu,
            "sigma_dmu" => &mut self.sigma_dmu,
            "reference_time_constant_s" => &mut self.reference_time_constant_s,
            _ => return None,
        })
    }

    /// The table with the same number in every row.
    pub fn uniform(value: f64) -> Self {
        let row = || PerJoint::Shared(value);
        Self {
            kappa_mu: row(),
            kappa_a: row(),
            sigma_q: row(),
            sigma_dq: row(),
            sigma_mu: row(),
            sigma_dmu: row(),
            reference_time_constant_s: row(),
        }
    }
}

impl<const N: usize> From<&AicGains<N>> for AicTable {
    fn from(gains: &AicGains<N>) -> Self {
        Self {
            kappa_mu: gains.kappa_mu.into(),
            kappa_a: gains.kappa_a.into(),
            sigma_q: gains.sigma_q.into(),
            sigma_dq: gains.sigma_dq.into(),
            sigma_mu: gains.sigma_mu.into(),
            sigma_dmu: gains.sigma_dmu.into(),
            reference_time_constant_s: gains.reference_time_constant_s.into(),
        }
    }
}
