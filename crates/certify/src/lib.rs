//! A claim in, a certificate or a refusal with a counterexample out.
//!
//! The search for a proof happens here, in floating point: bisection over rates, semidefinite programs solved by clarabel. What it
//! finds is only a candidate. It is rounded to exact numbers, written into a document and handed to `certune_verify`, whose rational
//! arithmetic decides; a candidate that fails is backed off and tried again, and what never passes is reported as not proved.
//!
//! | file | what it holds |
//! |---|---|
//! | `problem` | gains, family and constants of an arm as a document without claims |
//! | `exponential` | largest certified decay rate of the linearised loops, or a counterexample |
//! | `region` | largest certified ball of starts of the nonlinear loop |
//! | `lmi` | linear matrix inequalities for clarabel |
//!
//! Plants and controllers are unknown here: they arrive as numbers, so the same code certifies textbook loops.
#![forbid(unsafe_code)]

mod exponential;
mod lmi;
mod problem;
mod region;

pub use exponential::{UnstableLoop, exponential};
pub use lmi::{Affine, Program, Solution, SolveError};
pub use problem::{AicGainValues, ArmValues, FamilyValues, Problem, ProblemError, SampledConstantValues};
pub use region::{RegionOptions, region};

use certune_verify::{Attained, Certificate, Claim, Document, Rejection, seal, verify};

/// A document could not be turned into a certificate by its own checker: a defect of this crate, never of the input.
#[derive(Debug, thiserror::Error)]
pub enum CertifyError {
    /// The checker does not read what was written.
    #[error("the certificate written is unreadable: {0}")]
    Unreadable(#[from] certune_verify::VerifyError),
    /// The checker rejects what was written.
    #[error("the certificate written was rejected: {0}")]
    Rejected(#[from] Rejection),
    /// The document does not serialise.
    #[error("the certificate cannot be written: {0}")]
    Unwritable(#[from] serde_json::Error),
}

/// Which claims to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claims {
    /// Only the linearised loops.
    Exponential,
    /// Only the nonlinear region.
    Region,
    /// Both.
    All,
}

/// Makes the claims about a problem, and returns the sealed document and its verdict.
///
/// `attain` is asked, after a refusal of `exponential`, for an arm and configuration of the family whose linearised loop is
/// unstable; it may return `None`.
///
/// # Errors
/// [`CertifyError`] when the checker does not accept the document, which would be a defect of this crate.
pub fn certify(
    problem: &Problem,
    claims: Claims,
    options: &RegionOptions,
    attain: &dyn Fn() -> Option<(UnstableLoop, Attained)>,
) -> Result<Certificate, CertifyError> {
    let mut entries: Vec<Claim> = Vec::new();
    if matches!(claims, Claims::Exponential | Claims::All) {
        entries.push(exponential(problem, attain));
    }
    if matches!(claims, Claims::Region | Claims::All) {
        entries.push(region(problem, options));
    }
    let document = seal(Document { claims: entries, ..problem.document().clone() });
    Ok(verify(&to_json(&document)?)??)
}

/// The text of a sealed document, as it is written to a file.
///
/// # Errors
/// When the document does not serialise.
pub fn to_json(document: &Document) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(document).map(|text| text + "\n")
}
