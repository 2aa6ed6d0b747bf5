//! Certificate file in, verdict out.
//!
//! A certificate is a JSON document that says which controller, which family of arms and which claim, and carries the
//! numbers that prove it. This crate reads the document alone, derives every matrix again from the gains and constants written
//! in it, and decides each inequality in exact rational arithmetic. It has no solver, no search and no floating point on
//! the path to a verdict; `f64` appears only in what is printed beside a verdict.
//!
//! | file | what it holds |
//! |---|---|
//! | `number` | decimals and dyadics as written, and the rational numbers they are |
//! | `algebra` | characteristic polynomial, Hurwitz determinants, Sturm sequences, LDL' |
//! | `aic` | the controller's matrices from its gains |
//! | `exponential` | claim: every linearised loop of a box decays at a rate |
//! | `region` | claim: the nonlinear loop decays from every start in a ball |
//! | `document` | the file |
//! | `statement` | the words of a claim, from its numbers |
//! | `check` | seal and hash, and the verdict on a file |
//!
//! The mathematics of each claim is in `proofs/claims/`.
#![forbid(unsafe_code)]

mod aic;
mod algebra;
mod check;
mod document;
mod error;
mod exponential;
mod number;
mod polytope;
mod region;
mod sampled;
mod statement;

pub use aic::AicGains;
pub use check::{Certificate, Checked, Verdict, family_box, seal, verify};
pub use document::{
    Arm, Attained, BoxPoint, Claim, ClaimKind, Constants, Document, Evidence, ExponentialClaim, Family, Grade,
    NotProvedClaim, Reason, RefusedClaim, RegionClaim, RegionWitness, SampledSet,
};
pub use error::{Rejection, VerifyError};
pub use exponential::{LoopBox, LoopFamily};
pub use number::{Number, NumberError};
pub use region::{Inequality, region_inequalities};
pub use sampled::{MOST_DELAY_SAMPLES, Plant, SampledFamily};
pub use statement::Assumption;
