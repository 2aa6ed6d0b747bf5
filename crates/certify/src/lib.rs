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
pub use problem::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Problem, ProblemError, SampledConstantValues, arm_ranges,
};
pub use region::{RegionOptions, region};

use certune_verify::{
    Attained, Certificate, Claim, ClaimKind, Document, NotProvedClaim, Number, Reason, Rejection, seal, verify,
};

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

/// How each kind of claim is searched.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// The region of the nonlinear loop.
    pub region: RegionOptions,
}

/// Makes the claims about a problem, in the order asked for, and has them checked.
///
/// `attain` is asked, after a refusal of `exponential`, for an arm and configuration of the family whose linearised loop is
/// unstable; it may return `None`.
///
/// # Errors
/// [`CertifyError`] when the checker does not accept the document, which would be a defect of this crate.
pub fn certify(
    problem: &Problem,
    claims: &[ClaimKind],
    options: &Options,
    attain: &dyn Fn() -> Option<(UnstableLoop, Attained)>,
) -> Result<Certificate, CertifyError> {
    let mut document = problem.document().clone();
    for kind in claims {
        let claim = match kind {
            ClaimKind::Exponential => exponential(problem, attain),
            ClaimKind::Region => region(problem, &options.region),
            other => not_proved(*other, Reason::FamilyNotCovered, None),
        };
        document.claims.push(claim.into());
    }
    let document = seal(document);
    Ok(verify(&to_json(&document)?, problem.records())??)
}

/// An entry that says why there is neither a proof nor a counterexample.
pub(crate) fn not_proved(of: ClaimKind, reason: Reason, distance: Option<f64>) -> Claim {
    Claim::NotProved(NotProvedClaim { of, distance: distance.and_then(Number::decimal), reason })
}

/// The text of a sealed document, as it is written to a file.
///
/// # Errors
/// When the document does not serialise.
pub fn to_json(document: &Document) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(document).map(|text| text + "\n")
}
