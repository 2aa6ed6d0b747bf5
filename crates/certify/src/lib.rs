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
//! | `sampled` | decay rate and delay margin of the sampled linearised loops, or a counterexample |
//! | `margins` | how far a bound of the family may, or must, be moved |
//! | `region` | largest certified ball of starts of the nonlinear loop |
//! | `disturbance` | least bound on the error under noise and pushes |
//! | `digits` | figures rounded to the safe side |
//! | `joint_region` | the same, an ellipsoid, with gains, frictions and limits of each joint |
//! | `moving_goal` | the fastest goal that a region allows |
//! | `sampled_region` | the same of the sampled nonlinear loop |
//! | `adaptive` | convergence, the frozen loop and the sampled velocity loop of the adaptive controller |
//! | `lyapunov` | Lyapunov matrices of any linear loop or polytope of loops |
//! | `equation` | the Lyapunov equation of one matrix |
//! | `common_matrix` | one Lyapunov matrix for large matrices, by Newton's method |
//! | `lmi` | linear matrix inequalities for clarabel |
//!
//! Plants and controllers are unknown here: they arrive as numbers, so the same code certifies textbook loops.
#![forbid(unsafe_code)]

mod adaptive;
mod common_matrix;
mod digits;
mod disturbance;
mod equation;
mod exponential;
mod joint_region;
mod lmi;
mod lyapunov;
mod margins;
mod moving_goal;
mod problem;
mod region;
mod sampled;
mod sampled_region;

pub use adaptive::{adaptive_convergence, adaptive_sampled, pi_exponential};
pub use disturbance::{DisturbanceOptions, disturbance};
pub use exponential::{Attain, UnstableLoop, exponential};
pub use joint_region::{JointRegionOptions, joint_region};
pub use lmi::{Affine, Program, Solution, SolveError};
pub use lyapunov::{LinearFamily, LyapunovFailure, LyapunovMatrix, fastest_decay, lyapunov};
pub use moving_goal::{GoalListValues, MovingGoalOptions, moving_goal, moving_goal_on};
pub use problem::{
    AicGainValues, ArmValues, ConstantValues, EnclosureValues, FamilyValues, MracGainValues, Problem, ProblemError,
    SampledConstantValues, arm_ranges,
};
pub use region::{RegionOptions, region};
pub use sampled::{SampledOptions, light_inertia_rule_s, sampled};
pub use sampled_region::{SampledRegionOptions, sampled_region};

use certune_verify::{
    Certificate, Claim, ClaimKind, Document, NotProvedClaim, Number, Reason, Rejection, seal, verify,
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
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// The region of the nonlinear loop.
    pub region: RegionOptions,
    /// The region with gains, frictions and limits of each joint.
    pub joint_region: JointRegionOptions,
    /// The sampled loop.
    pub sampled: SampledOptions,
    /// The goal that moves.
    pub moving_goal: MovingGoalOptions,
    /// The region of the sampled nonlinear loop.
    pub sampled_region: SampledRegionOptions,
    /// The error under noise and pushes.
    pub disturbance: DisturbanceOptions,
}

/// Makes the claims about a problem, in the order asked for, and has them checked.
///
/// `attain` is asked, after a refusal of `exponential` or `sampled`, for an arm and configuration of the family whose linearised loop, in continuous
/// time or sampled, is unstable; it may return `None`.
///
/// # Errors
/// [`CertifyError`] when the checker does not accept the document, which would be a defect of this crate.
pub fn certify(
    problem: &Problem,
    claims: &[ClaimKind],
    options: &Options,
    attain: &Attain<'_>,
) -> Result<Certificate, CertifyError> {
    let mut document = problem.document().clone();
    // The search knows no box of angles: what it finds outside is no arm of the document.
    let over = &problem.document().constants.over;
    let attain: &Attain<'_> = &|timing| attain(timing).filter(|(_, attained)| over.contains(&attained.q_rad));
    for kind in claims {
        let made = match kind {
            ClaimKind::Exponential => vec![exponential(problem, attain)],
            ClaimKind::Sampled => vec![sampled(problem, &options.sampled, attain)],
            ClaimKind::Region => vec![region(problem, &options.region)],
            ClaimKind::JointRegion => vec![joint_region(problem, &options.joint_region)],
            ClaimKind::MovingGoal => moving_goal(problem, &document, &options.moving_goal),
            ClaimKind::SampledRegion => vec![sampled_region(problem, &options.sampled_region)],
            ClaimKind::Disturbance => vec![disturbance(problem, &options.disturbance)],
            other => vec![not_proved(*other, Reason::FamilyNotCovered, None)],
        };
        document.claims.extend(made.into_iter().map(Into::into));
    }
    let document = seal(document);
    Ok(verify(&to_json(&document)?, problem.records())??)
}

/// An entry that says why there is neither a proof nor a counterexample.
pub(crate) fn not_proved(of: ClaimKind, reason: Reason, distance: Option<f64>) -> Claim {
    let distance = distance.and_then(Number::decimal);
    Claim::NotProved(NotProvedClaim { of, sampling: None, distance, reason, remedies: Vec::new() })
}

/// The text of a sealed document, as it is written to a file.
///
/// # Errors
/// When the document does not serialise.
pub fn to_json(document: &Document) -> Result<String, serde_json::Error> {
    serde_json::to_string_pretty(document).map(|text| text + "\n")
}
