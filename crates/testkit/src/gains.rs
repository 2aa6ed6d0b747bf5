//! Gains of the active inference controller, log-uniform around the published ones.
//!
//! | symbol | code | default range | published | unit |
//! |--------|------|---------------|-----------|------|
//! | κ_μ | `kappa_mu` | 2 to 60 | 11.67 | 1/s (with sigma_q = 1) |
//! | κ_a | `kappa_a` | 50 to 20,000 | 700 | N m/(rad s) (with sigma_q = 1) |
//! | σ_q | `sigma_q` | 1 | 1 | variance |
//! | σ_q̇ | `sigma_dq` | 0.2 to 5 | 1 | variance |
//! | σ_μ | `sigma_mu` | 0.5 to 50 | 5 | variance |
//! | σ_μ′ | `sigma_dmu` | 0.5 to 100 | 10 | variance |
//! | T | `reference_time_constant_s` | 1 | 1 | s |
//!
//! Source: the published gains are those of Pezzato, Ferrari, Hernández Corbato, *A novel adaptive controller for robot
//! manipulators based on active inference* (2020), simulation; the ranges are those of the shipped search space.
//! Limits: every draw is valid for the controller, none is promised to be stable on an arm.

use std::ops::RangeInclusive;

use certune_control::aic::AicGains;
use proptest::prelude::*;

use crate::draw::log_within;

/// The published gains for the simulated Panda.
pub const PUBLISHED: AicGains<1> = AicGains {
    kappa_mu: [11.67],
    kappa_a: [700.0],
    sigma_q: [1.0],
    sigma_dq: [1.0],
    sigma_mu: [5.0],
    sigma_dmu: [10.0],
    reference_time_constant_s: [1.0],
};

/// The range of every gain; all ends are positive and finite.
#[derive(Clone, Debug, PartialEq)]
pub struct AicRanges {
    /// Learning rate of the beliefs.
    pub kappa_mu: RangeInclusive<f64>,
    /// Learning rate of the torque.
    pub kappa_a: RangeInclusive<f64>,
    /// Variance of the measured position.
    pub sigma_q: RangeInclusive<f64>,
    /// Variance of the measured velocity.
    pub sigma_dq: RangeInclusive<f64>,
    /// Variance of the first model error.
    pub sigma_mu: RangeInclusive<f64>,
    /// Variance of the second model error.
    pub sigma_dmu: RangeInclusive<f64>,
    /// Time constant of the reference, s.
    pub reference_time_constant_s: RangeInclusive<f64>,
}

impl Default for AicRanges {
    /// The ranges of the shipped search space, `tuning/spaces/panda-aic.toml`.
    fn default() -> Self {
        Self {
            kappa_mu: 2.0..=60.0,
            kappa_a: 50.0..=20_000.0,
            sigma_q: 1.0..=1.0,
            sigma_dq: 0.2..=5.0,
            sigma_mu: 0.5..=50.0,
            sigma_dmu: 0.5..=100.0,
            reference_time_constant_s: 1.0..=1.0,
        }
    }
}

/// Gains that all joints share; shrinks to [`PUBLISHED`], or what is nearest to it in `ranges`.
///
/// # Panics
/// Unless every end of `ranges` is positive and finite, and in order.
pub fn shared_aic_gains<const N: usize>(ranges: &AicRanges) -> impl Strategy<Value = AicGains<N>> + Clone + use<N> {
    let gain = |range: &RangeInclusive<f64>, [published]: [f64; 1]| log_within(range.clone(), published);
    (
        gain(&ranges.kappa_mu, PUBLISHED.kappa_mu),
        gain(&ranges.kappa_a, PUBLISHED.kappa_a),
        gain(&ranges.sigma_q, PUBLISHED.sigma_q),
        gain(&ranges.sigma_dq, PUBLISHED.sigma_dq),
        gain(&ranges.sigma_mu, PUBLISHED.sigma_mu),
        gain(&ranges.sigma_dmu, PUBLISHED.sigma_dmu),
        gain(&ranges.reference_time_constant_s, PUBLISHED.reference_time_constant_s),
    )
        .prop_map(|(kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s)| {
            AicGains {
                kappa_mu: [kappa_mu; N],
                kappa_a: [kappa_a; N],
                sigma_q: [sigma_q; N],
                sigma_dq: [sigma_dq; N],
                sigma_mu: [sigma_mu; N],
                sigma_dmu: [sigma_dmu; N],
                reference_time_constant_s: [reference_time_constant_s; N],
            }
        })
}

/// Gains drawn joint by joint; shrinks to [`PUBLISHED`] on every joint, or what is nearest to it in `ranges`.
///
/// # Panics
/// As [`shared_aic_gains`].
pub fn aic_gains<const N: usize>(ranges: &AicRanges) -> impl Strategy<Value = AicGains<N>> + Clone + use<N> {
    proptest::array::uniform::<_, N>(shared_aic_gains::<1>(ranges)).prop_map(|joints| AicGains {
        kappa_mu: joints.map(|gains| gains.kappa_mu[0]),
        kappa_a: joints.map(|gains| gains.kappa_a[0]),
        sigma_q: joints.map(|gains| gains.sigma_q[0]),
        sigma_dq: joints.map(|gains| gains.sigma_dq[0]),
        sigma_mu: joints.map(|gains| gains.sigma_mu[0]),
        sigma_dmu: joints.map(|gains| gains.sigma_dmu[0]),
        reference_time_constant_s: joints.map(|gains| gains.reference_time_constant_s[0]),
    })
}
