//! Linear loops whose time domain is a type, their spectra, and the scalar that every recursion of this
//! workspace is generic in.
//!
//! The crate has two floors. The lower one ([`Real`], [`Joints`], [`JointMatrix`]) needs neither `std` nor a heap, so that
//! a controller built on it runs on a microcontroller; the upper one ([`Loop`], feature `std`, on by default) holds closed
//! loops of any order.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

#[cfg(feature = "std")]
mod counted;
pub mod hyperbolic;
mod scalar;
#[cfg(feature = "std")]
mod spectrum;
pub mod trig;

#[cfg(feature = "std")]
pub use counted::{Counted, Operations, operations, operations_by_kind};
pub use scalar::{JointMatrix, Joints, Lanes, Real};
#[cfg(feature = "std")]
pub use spectrum::{Continuous, Discrete, Loop, LoopError, TimeDomain};
