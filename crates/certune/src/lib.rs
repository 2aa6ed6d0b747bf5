//! Certified tuning of robot-arm controllers.
//!
//! The facade a user adds: every room of the house under one roof, and the few functions that need several of them at once.
//!
//! | module | what it holds |
//! |---|---|
//! | [`linsys`] | linear loops whose time domain is a type |
//! | [`dynamics`] | robot descriptions, rigid-body algorithms, the Panda |
//! | [`control`] | the active inference controller, MRAC and baselines |
//! | [`closed_loop`] | plant, controller and task together |
//! | [`bounds`] | constants of an arm |
//! | [`certify`](mod@certify), [`verify`] | claims, and the checker that decides them |
//! | [`tune`], [`report`] | the search over gains, and the page that tells of it |
//! | [`ArmCertifier`] | an arm, its family of plants and a controller, to a certificate |
//!
//! ```
//! use certune::certify::FamilyValues;
//! use certune::verify::ClaimKind;
//! use certune::{ArmCertifier, control::aic::AicGains, dynamics::Robot};
//!
//! let family = FamilyValues {
//!     gravity_compensation: true,
//!     friction_n_m_s_per_rad: [1.0, 3.0],
//!     mass_uncertainty: 0.0,
//!     payload_kg: [0.0, 0.0],
//!     rotor_inertia_kg_m2: [0.0, 0.0],
//! };
//! let published = AicGains::<7> {
//!     kappa_mu: [11.67; 7],
//!     kappa_a: [700.0; 7],
//!     sigma_q: [1.0; 7],
//!     sigma_dq: [1.0; 7],
//!     sigma_mu: [5.0; 7],
//!     sigma_dmu: [10.0; 7],
//!     reference_time_constant_s: [1.0; 7],
//! };
//! let claims = [ClaimKind::Exponential, ClaimKind::Region];
//! let certificate = ArmCertifier::<7>::new(&Robot::panda(), &family)?.certify(&published, &claims)?;
//! assert!(certificate.all_hold());
//! # Ok::<(), certune::StabilityError>(())
//! ```
#![forbid(unsafe_code)]

pub use certune_bounds as bounds;
pub use certune_certify as certify;
pub use certune_closed_loop as closed_loop;
pub use certune_control as control;
pub use certune_dynamics as dynamics;
pub use certune_linsys as linsys;
pub use certune_report as report;
pub use certune_tune as tune;
pub use certune_verify as verify;

/// How the workspace is laid out, what its names mean, and what a claim is worth.
#[doc = include_str!("_docs/architecture.md")]
pub mod guide {}

/// Where the time of a simulation goes, and what the limit is.
#[doc = include_str!("_docs/speed.md")]
pub mod speed {}

/// How the search of gains compares with its peers.
#[doc = include_str!("_docs/search.md")]
pub mod search {}

mod adaptive;
mod lyapunov;
mod stability;

pub use adaptive::AdaptiveSetting;
pub use stability::{
    Answer, ArmCertifier, ArmGains, Effort, Growth, Over, ProvingEffort, ProvingTask, Request, StabilityError,
    TorqueLimits, certificate_text, claims_for, family_of, growth, poles_per_s, prove_constants,
};
