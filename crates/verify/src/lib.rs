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
//! | `quantity` | what a number must be before anything is derived from it |
//! | `outward` | square roots and exponentials rounded to the safe side |
//! | `algebra` | characteristic polynomial, Hurwitz determinants, LDL' |
//! | `definite` | definiteness of large matrices, by integers |
//! | `polytope` | whether every polynomial of a box of them is stable |
//! | `sampled_loops` | the polynomials of the loops with a sampled controller and a delayed torque |
//! | `form` | quadratic forms assembled from linear ones |
//! | `aic`, `gains` | the controllers' gains, and the AIC's matrices |
//! | `normed` | what a claim may rest on when an earlier one proves a region |
//! | `mrac` | what the proofs about the adaptive controller need of its gains |
//! | `claims` | one file for each kind of claim: what it states, its words, its proof |
//! | `document` | the file |
//! | `record` | proved constants of an arm, referred to by their hash |
//! | `statement` | what a document is about, in words |
//! | `check` | seal and hash, and the verdict on a file |
//!
//! The mathematics of each claim is in `proofs/claims/`.
#![forbid(unsafe_code)]

mod aic;
mod algebra;
mod check;
mod claims;
mod definite;
mod document;
mod error;
mod form;
mod gains;
mod mrac;
mod normed;
mod number;
mod outward;
mod polytope;
mod quantity;
mod record;
mod sampled_loops;
mod statement;

pub use aic::{AicGains, Controller, STATES};
pub use check::{Certificate, Checked, checked_alone, seal, verify};
pub use claims::*;
pub use document::{
    Arm, ArmRanges, Bounds, ConfigurationSet, Constants, Document, Entry, Evidence, Family, Grade, InertiaEnclosure,
};
pub use error::{Flaw, Rejection, VerifyError};
pub use form::{Field, Form, Row};
pub use gains::{Gains, MracGains, MracLaw};
pub use normed::{Norm, region_norm};
pub use number::{Number, NumberError};
pub use record::{BoundProof, Record};
pub use sampled_loops::{MOST_DELAY_SAMPLES, PlantStep, SampledFamily};
pub use statement::Assumption;
