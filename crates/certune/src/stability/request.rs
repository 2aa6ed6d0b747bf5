//! What is asked of a certifier.

use certune_bounds::SearchOptions;
use certune_certify::{GoalListValues, Options};
use certune_verify::{Certificate, ClaimKind, Evidence, Record};

use super::gains::ArmGains;

/// Torque limits that a claim must respect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TorqueLimits {
    /// None.
    #[default]
    None,
    /// The arm's own, less what gravity may take.
    LessGravity,
    /// The 2-norm of the controller's own torque is at most this, N m.
    Norm(f64),
}

/// How hard a certificate is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// The search for proofs.
    pub proofs: Options,
    /// The arm and configuration of a refusal.
    pub counterexample: SearchOptions,
}

impl Default for Effort {
    /// A few seconds at most on two cores.
    fn default() -> Self {
        let counterexample = SearchOptions {
            samples: 1_000,
            local_starts: 4,
            evaluations_per_start: 300,
            // An eigenvalue this far right is no rounding of a stable one, and the search may stop.
            enough: 0.05,
            ..SearchOptions::default()
        };
        Self { proofs: Options::default(), counterexample }
    }
}

/// What is asked of a certifier.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request {
    /// The claims, in this order; empty for all that apply to the gains ([`claims_for`]).
    pub claims: Vec<ClaimKind>,
    /// Samples from a command to its torque, for the claims about the sampled loop; `None` leaves them as the effort has them. `moving-goal` rests
    /// on the sampled loop when it is asked for by name and with a delay, on continuous time otherwise.
    pub delay_samples: Option<usize>,
    /// Torque limits, for the claims that can respect some.
    pub torque_limits: TorqueLimits,
    /// The configuration of the claims that are about one, rad: of `lyapunov`, and of an adaptive controller's goal.
    pub at_rad: Option<Vec<f64>>,
    /// Goals that follow each other, for `moving-goal`; without any it speaks of goals in general.
    pub goals: Option<GoalListValues>,
    /// How hard to search.
    pub effort: Effort,
}

/// What a certifier answers.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The checked claims.
    pub certificate: Certificate,
    /// The record of proved constants that it rests on: whoever checks it needs it. None when they are sampled.
    pub record: Option<Record>,
}

impl Answer {
    /// A certificate with the one of the records that it names.
    pub fn new(certificate: Certificate, records: &[Record]) -> Self {
        let record = match &certificate.document().constants.evidence {
            Evidence::Proved { record_sha256 } => {
                records.iter().find(|record| record.sha256 == *record_sha256).cloned()
            }
            Evidence::Sampled { .. } => None,
        };
        Self { certificate, record }
    }
}

/// The claims that apply to a controller with these gains, in the order in which they are examined.
pub fn claims_for<const N: usize>(gains: &ArmGains<N>) -> Vec<ClaimKind> {
    match gains {
        ArmGains::Aic(_) if gains.are_shared() => vec![
            ClaimKind::Exponential,
            ClaimKind::Sampled,
            ClaimKind::Region,
            ClaimKind::MovingGoal,
            ClaimKind::SampledRegion,
            ClaimKind::Disturbance,
        ],
        ArmGains::Aic(_) => vec![ClaimKind::JointRegion, ClaimKind::MovingGoal, ClaimKind::Lyapunov],
        ArmGains::Mrac(_) => vec![ClaimKind::AdaptiveConvergence, ClaimKind::PiExponential, ClaimKind::AdaptiveSampled],
    }
}
