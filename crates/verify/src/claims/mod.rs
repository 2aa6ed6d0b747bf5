//! The kinds of claims. Each file holds what one kind states, its words, and its proof.

mod adaptive_convergence;
mod adaptive_sampled;
mod disturbance;
mod energy;
mod exponential;
mod joint_region;
mod lyapunov;
mod moving_goal;
mod not_proved;
mod pi_exponential;
mod plane_region;
mod refused;
mod region;
mod sampled;
mod sampled_motion;
mod sampled_region;
mod variation;

use num_bigint::BigInt;
use num_rational::BigRational;
use serde::{Deserialize, Serialize};

use crate::algebra::{Matrix, positive_definite_pivots};
use crate::definite::{Integers, least_pivot};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::Number;

pub use adaptive_convergence::{
    AdaptiveConvergenceClaim, AdaptiveLoop, AdaptiveRefusedClaim, AdaptiveWitness, adaptive_inequalities,
};
pub use adaptive_sampled::{AdaptiveSampledClaim, AdaptiveSampledRefusedClaim};
pub use disturbance::{DisturbanceClaim, DisturbanceWitness, DisturbedArm, disturbance_inequalities};
pub use energy::{Energy, Plant, Point, State, TRIANGLE, triangle};
pub(crate) use exponential::in_words;
pub use exponential::{ExponentialClaim, LoopBox, LoopFamily, family_box};
pub use joint_region::{
    CoveredSteps, JointProblem, JointRegionClaim, JointRegionWitness, JointWeights, joint_region_inequalities,
};
pub use lyapunov::{LyapunovClaim, LyapunovRefusedClaim, LyapunovWitness, Polytope};
pub use moving_goal::{GoalList, ListedGoal, MovingGoalClaim, moving_goal_inequalities};
pub use not_proved::{NotProvedClaim, Reason};
pub use pi_exponential::{PiExponentialClaim, PiRefusedClaim, pi_inequalities};
pub use plane_region::PlaneRegion;
pub use refused::{Attained, BoxPoint, RefusedClaim};
pub use region::{RegionClaim, RegionProblem, RegionWitness, region_inequalities};
pub use sampled::{LoopTiming, SampledClaim};
pub use sampled_motion::{Coordinates, Corner, Reach, SampledLoop, SampledUnknowns};
pub use sampled_region::{
    Compensation, SampledRegionClaim, SampledRegionWitness, Sampling, sampled_loop, sampled_region_inequalities,
};
pub use variation::{Quantity, Variation};

/// What an entry of a document claims.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Claim {
    /// Every linearised loop of the family decays at a rate.
    Exponential(ExponentialClaim),
    /// Every linearised loop of the family decays when the controller is sampled and delayed.
    Sampled(Box<SampledClaim>),
    /// The nonlinear loop decays from every start in a ball.
    Region(Box<RegionClaim>),
    /// The adaptive loop's error converges.
    AdaptiveConvergence(Box<AdaptiveConvergenceClaim>),
    /// No function of the form that `adaptive-convergence` needs falls.
    AdaptiveRefused(Box<AdaptiveRefusedClaim>),
    /// The adaptive loop decays when its adaptation is frozen.
    PiExponential(Box<PiExponentialClaim>),
    /// It does not, for one joint and inertia.
    PiRefused(Box<PiRefusedClaim>),
    /// The adaptive loop's velocity loop survives sampling and delay.
    AdaptiveSampled(Box<AdaptiveSampledClaim>),
    /// It does not, because of one joint.
    AdaptiveSampledRefused(Box<AdaptiveSampledRefusedClaim>),
    /// The same with gains, frictions and limits of each joint.
    JointRegion(Box<JointRegionClaim>),
    /// The state stays in the region of an earlier entry while the goal moves.
    MovingGoal(Box<MovingGoalClaim>),
    /// The sampled nonlinear loop decays from every start in a ball.
    SampledRegion(Box<SampledRegionClaim>),
    /// Every matrix of a polytope has its eigenvalues in a region.
    Lyapunov(Box<LyapunovClaim>),
    /// One of them has not.
    LyapunovRefused(Box<LyapunovRefusedClaim>),
    /// The error stays bounded under bounded noise and pushes.
    Disturbance(Box<DisturbanceClaim>),
    /// A claim that does not hold for the family's box, with the point that breaks it.
    Refused(Box<RefusedClaim>),
    /// A claim for which no proof was found, and no counterexample either.
    NotProved(NotProvedClaim),
}

impl Claim {
    pub(crate) fn provable(&self) -> &dyn Provable {
        match self {
            Self::Exponential(claim) => claim,
            Self::Sampled(claim) => claim.as_ref(),
            Self::Region(claim) => claim.as_ref(),
            Self::AdaptiveConvergence(claim) => claim.as_ref(),
            Self::AdaptiveRefused(claim) => claim.as_ref(),
            Self::PiExponential(claim) => claim.as_ref(),
            Self::PiRefused(claim) => claim.as_ref(),
            Self::AdaptiveSampled(claim) => claim.as_ref(),
            Self::AdaptiveSampledRefused(claim) => claim.as_ref(),
            Self::JointRegion(claim) => claim.as_ref(),
            Self::MovingGoal(claim) => claim.as_ref(),
            Self::SampledRegion(claim) => claim.as_ref(),
            Self::Lyapunov(claim) => claim.as_ref(),
            Self::LyapunovRefused(claim) => claim.as_ref(),
            Self::Disturbance(claim) => claim.as_ref(),
            Self::Refused(claim) => claim.as_ref(),
            Self::NotProved(claim) => claim,
        }
    }

    /// The kind: of a refusal, what was refused.
    pub fn kind(&self) -> ClaimKind {
        self.provable().kind()
    }

    /// What a checked entry of this kind amounts to.
    pub fn verdict(&self) -> Verdict {
        match self {
            Self::Refused(_)
            | Self::AdaptiveRefused(_)
            | Self::PiRefused(_)
            | Self::AdaptiveSampledRefused(_)
            | Self::LyapunovRefused(_) => Verdict::Refused,
            Self::NotProved(_) => Verdict::NotProved,
            Self::Exponential(_)
            | Self::Sampled(_)
            | Self::Region(_)
            | Self::JointRegion(_)
            | Self::MovingGoal(_)
            | Self::SampledRegion(_)
            | Self::Disturbance(_)
            | Self::AdaptiveConvergence(_)
            | Self::PiExponential(_)
            | Self::AdaptiveSampled(_)
            | Self::Lyapunov(_) => Verdict::Holds,
        }
    }

    /// The figures of the claim, the most telling first.
    pub fn figures(&self) -> Vec<Figure> {
        self.provable().figures()
    }
}

/// The kinds of claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimKind {
    /// Every linearised loop of the family decays at a rate.
    Exponential,
    /// Every linearised loop of the family decays when the controller is sampled and delayed.
    Sampled,
    /// The nonlinear loop decays from every start in a ball.
    Region,
    /// The same with gains, frictions and limits of each joint.
    JointRegion,
    /// The nonlinear sampled loop decays from every start in a ball.
    SampledRegion,
    /// The state stays in a region while the goal moves.
    MovingGoal,
    /// The error is bounded under bounded noise and pushes.
    Disturbance,
    /// A linear loop, or a polytope of loops, decays.
    Lyapunov,
    /// The adaptive loop's error converges.
    AdaptiveConvergence,
    /// The adaptive loop decays when its adaptation is frozen.
    PiExponential,
    /// The adaptive loop's velocity loop survives sampling and delay.
    AdaptiveSampled,
}

impl ClaimKind {
    /// Every kind.
    pub const ALL: [Self; 11] = [
        Self::Exponential,
        Self::Sampled,
        Self::Region,
        Self::JointRegion,
        Self::SampledRegion,
        Self::MovingGoal,
        Self::Disturbance,
        Self::Lyapunov,
        Self::AdaptiveConvergence,
        Self::PiExponential,
        Self::AdaptiveSampled,
    ];

    /// The name as it is written in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exponential => "exponential",
            Self::Sampled => "sampled",
            Self::Region => "region",
            Self::JointRegion => "joint-region",
            Self::SampledRegion => "sampled-region",
            Self::MovingGoal => "moving-goal",
            Self::Disturbance => "disturbance",
            Self::Lyapunov => "lyapunov",
            Self::AdaptiveConvergence => "adaptive-convergence",
            Self::PiExponential => "pi-exponential",
            Self::AdaptiveSampled => "adaptive-sampled",
        }
    }
}

/// What became of one entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The claim holds, with its grade.
    Holds,
    /// The claim is refused and the counterexample stands.
    Refused,
    /// The entry itself says that nothing was proved.
    NotProved,
}

/// A number that a claim is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// What it is.
    pub name: &'static str,
    /// The number as written in the claim.
    pub value: Number,
    /// Its unit, `1` when it has none.
    pub unit: &'static str,
}

/// Rational LDL' of dyadic matrices is quick up to this order.
const LARGEST_EXACT_ORDER: usize = 12;

/// A positive definite matrix of a proof, with the smallest pivot of its LDL'.
#[derive(Clone, Debug, PartialEq)]
pub struct Inequality {
    /// What it says, and where (at which end of an interval, for which joint).
    pub name: String,
    /// Order of the matrix.
    pub order: usize,
    /// The smallest pivot of LDL' (of a large matrix: a number no larger, the diagonal scaled near 1), `None` when the matrix is not recognised as positive definite.
    pub smallest_pivot: Option<BigRational>,
}

impl Inequality {
    /// Decides by exact LDL' whether the matrix is positive definite.
    pub(crate) fn decide(name: String, matrix: &Matrix) -> Self {
        let smallest_pivot = positive_definite_pivots(matrix).and_then(|pivots| pivots.into_iter().min());
        Self { name, order: matrix.len(), smallest_pivot }
    }

    /// The same for `whole / unit`, `unit` positive, of any order: beyond [`LARGEST_EXACT_ORDER`] by integers, with a pivot of the matrix scaled to a diagonal near 1.
    pub(crate) fn decide_whole(name: String, whole: &Integers, unit: &BigInt) -> Self {
        let order = whole.len();
        if order > LARGEST_EXACT_ORDER {
            return Self { name, order, smallest_pivot: least_pivot(whole) };
        }
        let entry = |x: &BigInt| BigRational::new(x.clone(), unit.clone());
        let matrix = whole.iter().map(|row| row.iter().map(entry).collect()).collect();
        Self::decide(name, &matrix)
    }
}

/// Every inequality, or the first that does not hold.
pub(crate) fn all_hold(inequalities: Vec<Inequality>) -> Result<Vec<Inequality>, Flaw> {
    match inequalities.iter().find(|inequality| inequality.smallest_pivot.is_none()) {
        Some(failed) => Err(Flaw::Inequality { inequality: failed.name.clone() }),
        None => Ok(inequalities),
    }
}

/// What each kind of claim must be able to do.
pub(crate) trait Provable {
    /// Which kind it is.
    fn kind(&self) -> ClaimKind;

    /// What it says, in words derived from its numbers.
    fn sentence(&self, document: &Document) -> String;

    /// What the loop is taken to be (time, limits, delay, noise); empty for what claims nothing.
    fn scope(&self, document: &Document) -> String;

    /// Its figures, the most telling first.
    fn figures(&self) -> Vec<Figure> {
        Vec::new()
    }

    /// Checks the proof. The entry's own position lets a claim rest on earlier ones: every entry of a document is checked.
    fn prove(&self, document: &Document, position: usize) -> Result<Vec<Inequality>, Flaw>;
}

/// Scope of the claims in continuous time.
pub(crate) const CONTINUOUS: &str =
    "continuous time, no torque limit, no delay, no noise, no Coulomb friction, joint limits not modelled";
