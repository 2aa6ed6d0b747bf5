//! The gains a search moves: those of the active inference controller, the same on every joint.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | κ_μ | `kappa_mu` | 1/s (with sigma_q = 1) |
//! | κ_a | `kappa_a` | N m/(rad s) (with sigma_q = 1) |
//! | σ_q, σ_q̇, σ_μ, σ_μ′ | `sigma_*` | variances; only their ratios to the two kappas matter |
//! | T | `reference_time_constant_s` | s |
//!
//! The law contains the kappas and sigmas only as κ/σ, so that multiplying all six by one number changes nothing: six gains
//! are five degrees of freedom ([`Gains::rescaled`]).
//!
//! Source: Pezzato, Ferrari, Hernández Corbato, *A novel adaptive controller for robot manipulators based on active
//! inference* (2020), with the sigmas read as variances as in the authors' released controller.

use certune_closed_loop::AicTable;
use certune_control::aic::AicGains;
use serde::{Deserialize, Serialize};

/// One gain by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gain {
    /// Learning rate of the beliefs.
    KappaMu,
    /// Learning rate of the torque.
    KappaA,
    /// Variance of the measured position.
    SigmaQ,
    /// Variance of the measured velocity.
    SigmaDq,
    /// Variance of the first model error.
    SigmaMu,
    /// Variance of the second model error.
    SigmaDmu,
    /// Time constant of the reference model, s.
    ReferenceTimeConstantS,
}

impl Gain {
    /// Every gain, in the order of the files.
    pub const ALL: [Self; 7] = [
        Self::KappaMu,
        Self::KappaA,
        Self::SigmaQ,
        Self::SigmaDq,
        Self::SigmaMu,
        Self::SigmaDmu,
        Self::ReferenceTimeConstantS,
    ];

    /// The key of the gain in a file.
    pub const fn key(self) -> &'static str {
        match self {
            Self::KappaMu => "kappa_mu",
            Self::KappaA => "kappa_a",
            Self::SigmaQ => "sigma_q",
            Self::SigmaDq => "sigma_dq",
            Self::SigmaMu => "sigma_mu",
            Self::SigmaDmu => "sigma_dmu",
            Self::ReferenceTimeConstantS => "reference_time_constant_s",
        }
    }
}

impl core::fmt::Display for Gain {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.key())
    }
}

/// The gains of one candidate, the same on every joint. Plain data: the controller's own constructor judges them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Learning rate of the beliefs.
    pub kappa_mu: f64,
    /// Learning rate of the torque.
    pub kappa_a: f64,
    /// Variance of the measured position.
    pub sigma_q: f64,
    /// Variance of the measured velocity.
    pub sigma_dq: f64,
    /// Variance of the first model error.
    pub sigma_mu: f64,
    /// Variance of the second model error.
    pub sigma_dmu: f64,
    /// Time constant of the reference model, s.
    pub reference_time_constant_s: f64,
}

/// Gains that differ from joint to joint, where a search moves one number for all.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{gain} is {first} on one joint and {other} on another; a search moves one number for all joints, so start from gains that all joints share"
)]
pub struct NotShared {
    /// The gain.
    pub gain: Gain,
    /// Its value on the first joint.
    pub first: f64,
    /// The first other value.
    pub other: f64,
}

impl Gains {
    /// The value of `gain`.
    pub const fn get(&self, gain: Gain) -> f64 {
        match gain {
            Gain::KappaMu => self.kappa_mu,
            Gain::KappaA => self.kappa_a,
            Gain::SigmaQ => self.sigma_q,
            Gain::SigmaDq => self.sigma_dq,
            Gain::SigmaMu => self.sigma_mu,
            Gain::SigmaDmu => self.sigma_dmu,
            Gain::ReferenceTimeConstantS => self.reference_time_constant_s,
        }
    }

    /// The same gains with `gain` set to `value`.
    #[must_use]
    pub const fn with(mut self, gain: Gain, value: f64) -> Self {
        match gain {
            Gain::KappaMu => self.kappa_mu = value,
            Gain::KappaA => self.kappa_a = value,
            Gain::SigmaQ => self.sigma_q = value,
            Gain::SigmaDq => self.sigma_dq = value,
            Gain::SigmaMu => self.sigma_mu = value,
            Gain::SigmaDmu => self.sigma_dmu = value,
            Gain::ReferenceTimeConstantS => self.reference_time_constant_s = value,
        }
        self
    }

    /// The same control law written with another `sigma_q`: both kappas and all sigmas times `sigma_q / self.sigma_q`.
    #[must_use]
    pub fn rescaled(self, sigma_q: f64) -> Self {
        let factor = sigma_q / self.sigma_q;
        Self {
            kappa_mu: self.kappa_mu * factor,
            kappa_a: self.kappa_a * factor,
            sigma_q,
            sigma_dq: self.sigma_dq * factor,
            sigma_mu: self.sigma_mu * factor,
            sigma_dmu: self.sigma_dmu * factor,
            reference_time_constant_s: self.reference_time_constant_s,
        }
    }

    /// The gains of a file whose joints all share them.
    ///
    /// # Errors
    /// [`NotShared`] with the first gain that differs from joint to joint.
    pub fn from_table(table: &AicTable) -> Result<Self, NotShared> {
        let mut gains = [0.0; 7];
        for ((slot, gain), (_, numbers)) in gains.iter_mut().zip(Gain::ALL).zip(table.rows()) {
            let (first, others) =
                numbers.values().split_first().ok_or(NotShared { gain, first: f64::NAN, other: f64::NAN })?;
            if let Some(other) = others.iter().find(|other| other.to_bits() != first.to_bits()) {
                return Err(NotShared { gain, first: *first, other: *other });
            }
            *slot = *first;
        }
        let [kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s] = gains;
        Ok(Self { kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s })
    }

    /// The same gains on each of `N` joints, as the controller takes them.
    pub const fn on_every_joint<const N: usize>(&self) -> AicGains<N> {
        AicGains {
            kappa_mu: [self.kappa_mu; N],
            kappa_a: [self.kappa_a; N],
            sigma_q: [self.sigma_q; N],
            sigma_dq: [self.sigma_dq; N],
            sigma_mu: [self.sigma_mu; N],
            sigma_dmu: [self.sigma_dmu; N],
            reference_time_constant_s: [self.reference_time_constant_s; N],
        }
    }

    /// The bits of every gain, the identity of a candidate.
    pub(crate) fn bits(&self) -> [u64; 7] {
        Gain::ALL.map(|gain| self.get(gain).to_bits())
    }
}
