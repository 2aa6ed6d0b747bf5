//! Gains of either controller for an arm of `N` joints, and as a certificate writes them.

use certune_certify::{AicGainValues, MracGainValues, ProblemError};
use certune_closed_loop::{Gains as GainsTable, KeyError};
use certune_control::aic::AicGains;
use certune_control::mrac::{MracGains, MracLaw};
use certune_verify::{Gains, MracLaw as WrittenLaw};

/// Gains of either controller.
#[derive(Clone, Debug, PartialEq)]
pub enum ArmGains<const N: usize> {
    /// The active inference controller.
    Aic(AicGains<N>),
    /// The model reference adaptive controller.
    Mrac(Box<MracGains<N>>),
}

impl<const N: usize> From<AicGains<N>> for ArmGains<N> {
    fn from(gains: AicGains<N>) -> Self {
        Self::Aic(gains)
    }
}

impl<const N: usize> From<MracGains<N>> for ArmGains<N> {
    fn from(gains: MracGains<N>) -> Self {
        Self::Mrac(Box::new(gains))
    }
}

impl<const N: usize> ArmGains<N> {
    /// The gains of a file's table on an arm.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind(table: &GainsTable) -> Result<Self, KeyError> {
        Ok(match table {
            GainsTable::Aic(table) => table.bind()?.into(),
            GainsTable::Mrac(table) => table.bind()?.into(),
        })
    }

    /// Whether every joint has the same gains, to the bit.
    pub fn are_shared(&self) -> bool {
        let same = |list: &[f64; N]| list.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits());
        match self {
            Self::Aic(gains) => aic_lists(gains).into_iter().all(same),
            Self::Mrac(gains) => mrac_lists(gains).into_iter().all(same),
        }
    }

    pub(crate) fn written(&self) -> Result<Gains, ProblemError> {
        match self {
            Self::Aic(gains) => {
                let [kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s] =
                    aic_lists(gains).map(|list| list.to_vec());
                AicGainValues { kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s }
                    .written()
            }
            Self::Mrac(gains) => {
                let list = |values: &[f64; N]| values.to_vec();
                let three = |rows: &[[f64; N]; 3]| rows.map(|row| row.to_vec());
                MracGainValues {
                    law: match gains.law {
                        MracLaw::ReferenceModel => WrittenLaw::ReferenceModel,
                        MracLaw::RawGoal => WrittenLaw::RawGoal,
                        MracLaw::ReleasedCode => WrittenLaw::ReleasedCode,
                    },
                    omega_rad_per_s: list(&gains.omega_rad_per_s),
                    zeta: list(&gains.zeta),
                    l1: list(&gains.l1),
                    l2: list(&gains.l2),
                    alpha: three(&gains.alpha),
                    e0: three(&gains.e0),
                    e1: three(&gains.e1),
                    f0: three(&gains.f0),
                    f1: three(&gains.f1),
                }
                .written()
            }
        }
    }
}

fn aic_lists<const N: usize>(gains: &AicGains<N>) -> [&[f64; N]; 7] {
    [
        &gains.kappa_mu,
        &gains.kappa_a,
        &gains.sigma_q,
        &gains.sigma_dq,
        &gains.sigma_mu,
        &gains.sigma_dmu,
        &gains.reference_time_constant_s,
    ]
}

fn mrac_lists<const N: usize>(gains: &MracGains<N>) -> Vec<&[f64; N]> {
    let MracGains { omega_rad_per_s, zeta, l1, l2, alpha, e0, e1, f0, f1, .. } = gains;
    [omega_rad_per_s, zeta, l1, l2].into_iter().chain([alpha, e0, e1, f0, f1].into_iter().flatten()).collect()
}
