//! Gains of either controller for an arm of `N` joints, and as a certificate writes them.

use certune_certify::{AicGainValues, ProblemError};
use certune_control::aic::AicGains;
use certune_control::mrac::{self, MracGains};
use certune_verify::{self as verify, Number};

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
    /// Whether every joint has the same gains, to the bit.
    pub(super) fn are_shared(&self) -> bool {
        let same = |list: &[f64; N]| list.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits());
        match self {
            Self::Aic(gains) => aic_lists(gains).into_iter().all(same),
            Self::Mrac(gains) => mrac_lists(gains).into_iter().all(same),
        }
    }

    pub(super) fn written(&self) -> Result<verify::Gains, ProblemError> {
        match self {
            Self::Aic(gains) => {
                let [kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s] =
                    aic_lists(gains).map(|list| list.to_vec());
                AicGainValues { kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s }
                    .written()
            }
            Self::Mrac(gains) => mrac_written(gains),
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

fn mrac_written<const N: usize>(gains: &MracGains<N>) -> Result<verify::Gains, ProblemError> {
    let list = |quantity, values: &[f64; N]| {
        let number = |&value| Number::decimal(value).ok_or(ProblemError::NotRepresentable { quantity, value });
        values.iter().map(number).collect::<Result<Vec<_>, _>>()
    };
    let three = |quantity, [first, second, third]: &[[f64; N]; 3]| {
        Ok::<_, ProblemError>([list(quantity, first)?, list(quantity, second)?, list(quantity, third)?])
    };
    Ok(verify::Gains::Mrac(verify::MracGains {
        law: match gains.law {
            mrac::MracLaw::ReferenceModel => verify::MracLaw::ReferenceModel,
            mrac::MracLaw::RawGoal => verify::MracLaw::RawGoal,
            mrac::MracLaw::ReleasedCode => verify::MracLaw::ReleasedCode,
        },
        omega_rad_per_s: list("omega_rad_per_s", &gains.omega_rad_per_s)?,
        zeta: list("zeta", &gains.zeta)?,
        l1: list("l1", &gains.l1)?,
        l2: list("l2", &gains.l2)?,
        alpha: three("alpha", &gains.alpha)?,
        e0: three("e0", &gains.e0)?,
        e1: three("e1", &gains.e1)?,
        f0: three("f0", &gains.f0)?,
        f1: three("f1", &gains.f1)?,
    }))
}
