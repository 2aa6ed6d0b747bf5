//! The active inference controller (AIC): beliefs about position, velocity and acceleration descend the free energy, and so
//! does the torque. It needs no model of the arm.
//!
//! Per joint, with `m = μ − μ_d` and the reference `f(μ) = (μ_d − μ)/T`, the free energy is
//!
//! ```text
//! F = ½ [ (q − μ)²/σ_q + (q̇ − μ′)²/σ_q̇ + (μ′ + m/T)²/σ_μ + (μ″ + μ′/T)²/σ_μ′ ]
//! ```
//!
//! The last two terms are the errors of the generative model: `μ′ = f(μ)`, and its time derivative `μ″ = (∂f/∂μ) μ′ = −μ′/T`.
//! The gradient of F is
//!
//! ```text
//! ∂F/∂μ  = −(q − μ)/σ_q  + (1/T) (μ′ + m/T)/σ_μ
//! ∂F/∂μ′ = −(q̇ − μ′)/σ_q̇ +       (μ′ + m/T)/σ_μ + (1/T) (μ″ + μ′/T)/σ_μ′
//! ∂F/∂μ″ =                                              (μ″ + μ′/T)/σ_μ′
//! ```
//!
//! so that T enters once through each model error and once more as the factor `1/T` where a model error is differentiated with respect
//! to the lower belief. The beliefs follow `dμ/dt = μ′ − κ_μ ∂F/∂μ`, `dμ′/dt = μ″ − κ_μ ∂F/∂μ′`, `dμ″/dt = −κ_μ ∂F/∂μ″`.
//! The torque follows `du/dt = −κ_a (∂y/∂u)ᵀ ∂F/∂y`; more torque raises position and velocity, the paper takes
//! both sensitivities as the identity, and what is left is
//!
//! ```text
//! du/dt = −κ_a [ (q − μ)/σ_q + (q̇ − μ′)/σ_q̇ ]
//! ```
//!
//! With T = 1 s these are the lines of the paper. T sets rise and settling time.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | μ, μ′, μ″ | `mu`, `dmu`, `ddmu` | beliefs about q, q̇, q̈ | rad, rad/s, rad/s² |
//! | μ_d    | `goal` | goal | rad |
//! | σ_q, σ_q̇ | `sigma_q`, `sigma_dq` | variances of the measurements | rad², (rad/s)² in a strict reading |
//! | σ_μ, σ_μ′ | `sigma_mu`, `sigma_dmu` | variances of the model errors | as σ_q̇, (rad/s²)² |
//! | κ_μ    | `kappa_mu` | learning rate of the beliefs | 1/s when F has no unit |
//! | κ_a    | `kappa_a` | learning rate of the torque | N m/s when F has no unit |
//! | T      | `reference_time_constant_s` | time constant of the reference | s |
//!
//! The published gains are plain numbers without units; the mixed units of κ and σ cancel in the quotients that act (κ/σ).
//!
//! **One sampling step**, as in Algorithm 1 of the paper and in the authors' released controller: all three belief derivatives from the old
//! beliefs and the new measurement, one Euler step of each belief, then `u ← u − h κ_a [...]` with the new beliefs.
//!
//! Source: Pezzato, Ferrari, Hernández Corbato, *A Novel Adaptive Controller for Robot Manipulators Based on Active Inference*, IEEE
//! Robotics and Automation Letters 5(2), 2020. The paper calls the σ standard deviations in one place; its equations and its code use them as
//! variances (`Σ⁻¹ = 1/σ`), and so does this module.
//!
//! Limits: proprioception only (no camera); the learning rates and variances are constant; the torque integrates without
//! anti-windup, so a saturated joint winds up.

mod law;
pub mod linear;
mod params;

pub use law::{Aic, AicState, BeliefGradient};
pub use linear::{ContinuousJoint, SampledJoint};
pub use params::{AicGains, AicParams};
