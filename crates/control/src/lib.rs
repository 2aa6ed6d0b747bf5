//! Joint-space torque controllers as pure functions: state, measurement and goal in, next state and torque out.
//!
//! | controller | module | model of the arm | integrates |
//! |------------|--------|------------------|------------|
//! | active inference (AIC) | [`aic`] | none | beliefs and torque |
//! | model reference adaptive control (MRAC), three named laws | [`mrac`] | none | adaptive gains |
//! | gravity-compensated PD, computed torque | [`baseline`] | handed in by the caller | nothing |
//!
//! A goal that jumps may be handed to any of them through a [`GoalRateLimiter`], which makes it a ramp.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | q, q̇  | [`Measurement::q`], [`Measurement::dq`] | measured position and velocity | rad, rad/s |
//! | μ_d    | `goal` | joint positions to reach, at rest | rad |
//! | u      | the second result of [`Controller::step`] | joint torques | N m |
//! | h      | `step_s` | sampling step, fixed when the parameters are checked | s |
//!
//! The crate needs neither `std` nor a heap, and every state is `Copy`: a run can be forked, replayed or compared at any step. A gain is
//! checked once, where parameters are made from plain numbers ([`ParamError`]); from there on nothing can fail.
//!
//! ```
//! use certune_control::aic::{Aic, AicGains, AicParams};
//! use certune_control::{Controller, Measurement};
//! use certune_linsys::Joints;
//!
//! // The published gains on one joint of 1 kg m², pulled by a constant 20 N m that nobody told the controller about.
//! let gains = AicGains {
//!     kappa_mu: [11.67],
//!     kappa_a: [700.0],
//!     sigma_q: [1.0],
//!     sigma_dq: [1.0],
//!     sigma_mu: [5.0],
//!     sigma_dmu: [10.0],
//!     reference_time_constant_s: [1.0],
//! };
//! let step_s = 1e-3;
//! let controller = Aic::<1>::new(&AicParams::new(&gains, step_s)?);
//! let goal = Joints::<1>::new(0.5);
//! let mut at = Measurement { q: Joints::<1>::zeros(), dq: Joints::<1>::zeros() };
//! let mut state = controller.start(&at);
//! for _ in 0..12_000 {
//!     let (next, u) = controller.step(&state, &at, &goal);
//!     state = next;
//!     at.dq += (u - Joints::<1>::new(20.0)) * step_s;
//!     at.q += at.dq * step_s;
//! }
//! assert!((at.q[0] - 0.5).abs() < 1e-4);
//! assert!((state.u[0] - 20.0).abs() < 1e-2);
//! assert!(controller.free_energy(&state, &at, &goal) < 1e-6);
//! # Ok::<(), certune_control::ParamError>(())
//! ```
//!
//! Limits: the laws know nothing of torque limits, delays or noise; who closes the loop applies them.
#![no_std]
#![forbid(unsafe_code)]

pub mod aic;
pub mod baseline;
mod controller;
mod goal;
pub mod mrac;
mod param;

pub use controller::{Controller, Measurement};
pub use goal::GoalRateLimiter;
pub use param::{Expected, ParamError, Precision};
