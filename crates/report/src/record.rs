//! What a tuning run hands to the page: plain data, no behaviour.
//!
//! Every number keeps its SI unit in its name. Colours, words and layout are the page's business; means, quantiles,
//! poles and verdicts are computed by those who made the record. All types serialise, and refuse unknown keys.
//!
//! Missing numbers: `Option` where a value may not exist (a move that never settles), NaN inside a series (after a run
//! diverged). JSON has no NaN, so series write it as `null` and read `null` as NaN.

use serde::{Deserialize, Serialize};

mod comparison;
mod learnt;

pub use comparison::*;
pub use learnt::*;

/// One tuning run: what was asked, what came out, and the evidence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TuningReport {
    /// The question.
    pub asked: Asked,
    /// Published against tuned gains, in the order of the gains file.
    pub gains: Vec<GainRow>,
    /// One run of the scenario on the nominal plant, with each set of gains.
    pub response: Response,
    /// The same runs as figures, one row for each move of the scenario.
    pub segments: Vec<SegmentRow>,
    /// Random plants that the search never saw.
    pub held_out: HeldOut,
    /// Every candidate the search looked at.
    pub search: SearchRecord,
    /// What a small change of one gain does to the cost.
    pub sensitivity: Vec<SensitivityRow>,
    /// What the candidates say together.
    pub learnt: Learnt,
    /// Claims about stability, with their evidence.
    pub certificate: CertificateRecord,
    /// Commands with which a reader checks the result.
    pub recheck: Vec<CommandLine>,
    /// How it was done, one paragraph an entry.
    pub method: Vec<String>,
    /// Software that took part.
    pub versions: Vec<Version>,
}

/// A value for the published gains and one for the tuned gains.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pair<T> {
    /// With the published gains, where the search started.
    pub published: T,
    /// With the tuned gains, where it ended.
    pub tuned: T,
}

/// The question that the run answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// Name of the robot, for instance `panda`.
    pub robot: String,
    /// Number of joints.
    pub joints: usize,
    /// Name of the controller, for instance `aic`.
    pub controller: String,
    /// Name of the published gains, for instance `pezzato2020-simulation`.
    pub preset: String,
    /// Name of the scenario.
    pub scenario: String,
    /// The scenario in one sentence; may be empty.
    pub scenario_in_words: String,
    /// The ranges that plants are drawn from and that the certificate speaks of.
    pub plant_box: Vec<RangeRow>,
    /// What the search minimises.
    pub cost: CostMeaning,
    /// Seed of every random stream.
    pub seed: u64,
    /// Number of candidates that the search could look at.
    pub budget: u64,
    /// The command that repeats the run.
    pub command: String,
}

/// One uncertain quantity of the plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeRow {
    /// What it is, for instance `payload`.
    pub name: String,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// Unit, empty for a ratio.
    pub unit: String,
}

/// What a cost means.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostMeaning {
    /// Unit, empty when it has none.
    pub unit: String,
    /// One sentence; lower is better.
    pub in_words: String,
}

/// One gain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GainRow {
    /// Key in the gains file.
    pub name: String,
    /// The joint it belongs to; `None` when all joints share it.
    pub joint: Option<String>,
    /// Unit, empty when it has none.
    pub unit: String,
    /// Published value.
    pub published: f64,
    /// Tuned value.
    pub tuned: f64,
    /// Range that the search could use; `None` when the gain was held fixed.
    pub bounds: Option<SearchBounds>,
}

/// Range of one gain in the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchBounds {
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// The tuned value lies on one of the two: a wider range might do better.
    pub on_bound: bool,
}

/// Two runs on the nominal plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// Names of the joints, base to tip.
    pub joint_names: Vec<String>,
    /// Torque limit of each joint; empty when none applied.
    pub torque_limit_n_m: Vec<f64>,
    /// The runs.
    pub runs: Pair<Trajectory>,
}

/// One run, sampled in time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trajectory {
    /// Times of the samples.
    #[serde(with = "series")]
    pub time_s: Vec<f64>,
    /// Joint angles, `[joint][sample]`.
    #[serde(with = "series::rows")]
    pub q_rad: Vec<Vec<f64>>,
    /// Goals, `[joint][sample]`.
    #[serde(with = "series::rows")]
    pub goal_rad: Vec<Vec<f64>>,
    /// Controller torques, `[joint][sample]`.
    #[serde(with = "series::rows")]
    pub tau_n_m: Vec<Vec<f64>>,
    /// Free energy of the controller's beliefs; empty for a controller that has none.
    #[serde(with = "series")]
    pub free_energy: Vec<f64>,
    /// When the run was stopped because it ran away.
    pub diverged_at_s: Option<f64>,
}

/// One move of the scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentRow {
    /// Name of the move, for instance `B to A`.
    pub label: String,
    /// Figures of both runs.
    pub metrics: Pair<SegmentMetrics>,
}

/// Figures of one move, the worst over the joints unless said otherwise; `None` where a figure does not exist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentMetrics {
    /// Time until every joint stays within 2 % of its step; `None` when one never does.
    pub settling_time_s: Option<f64>,
    /// Error at the end of the move.
    pub final_error_rad: Option<f64>,
    /// Overshoot as a fraction of the step.
    pub overshoot: Option<f64>,
    /// Largest torque.
    pub peak_torque_n_m: Option<f64>,
    /// Jitter: root mean square of the torque's rate.
    pub torque_rate_rms_n_m_per_s: Option<f64>,
    /// Steps with a torque at its limit, summed over the joints.
    pub saturated_steps: u64,
    /// Time-weighted absolute error, summed over the joints.
    pub itae_rad_s2: Option<f64>,
}

/// Judgement by plants that the search never saw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Cost of each plant; `None` when the run diverged.
    pub plants: Vec<PlantRow>,
    /// Quantiles over the plants; empty series when not recorded.
    pub bands: Pair<Bands>,
}

/// One plant of the held-out set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantRow {
    /// Index of the draw.
    pub index: u64,
    /// What was drawn, in a few words; may be empty.
    pub in_words: String,
    /// Cost with each set of gains; `None` when the run diverged.
    pub cost: Pair<Option<f64>>,
}

/// Quantiles of the norm of the position error, over the plants, at each time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bands {
    /// Times of the samples.
    #[serde(with = "series")]
    pub time_s: Vec<f64>,
    /// 5 % of the plants lie below.
    #[serde(with = "series")]
    pub error_p05_rad: Vec<f64>,
    /// Median.
    #[serde(with = "series")]
    pub error_p50_rad: Vec<f64>,
    /// 95 % of the plants lie below.
    #[serde(with = "series")]
    pub error_p95_rad: Vec<f64>,
}

/// The course of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchRecord {
    /// Every candidate, in order.
    pub evaluations: Vec<Evaluation>,
    /// Unit of the costs, empty when they have none; a search may be after another cost than the one that judges the held-out plants.
    pub unit: String,
    /// Cost of the published gains in the search.
    pub published_cost: Option<f64>,
}

/// One candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// Running number.
    pub index: u64,
    /// Solver that proposed it, for instance `nelder-mead`.
    pub phase: String,
    /// Rank of the outcome in words, for instance `certified`, `unstable`.
    pub outcome: String,
    /// Cost, when the candidate has one.
    pub cost: Option<f64>,
    /// Lowest cost so far among those that count.
    pub best_so_far: Option<f64>,
}

/// Cost of a changed gain over the cost of the tuned gains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensitivityRow {
    /// Name of the gain, with its joint if it has one.
    pub gain: String,
    /// Ratio with the gain 10 % lower; `None` when that run has no cost.
    pub ratio_at_minus_10_percent: Option<f64>,
    /// Ratio with the gain 10 % higher; `None` when that run has no cost.
    pub ratio_at_plus_10_percent: Option<f64>,
}

/// Claims and the figures that go with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CertificateRecord {
    /// Name of the file that a reader can check.
    pub file_name: String,
    /// SHA-256 of its canonical content; may be empty.
    pub sha256: String,
    /// The claims that were examined.
    pub claims: Vec<Claim>,
    /// Poles of the linearised loop.
    pub pole_map: Option<PoleMap>,
    /// Certified starting error against the moves of the scenario.
    pub region: Option<RegionRecord>,
}

/// One claim about stability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Name of the kind, for instance `exponential`.
    pub kind: String,
    /// What came out.
    pub verdict: Verdict,
    /// What the evidence is worth.
    pub grade: Grade,
    /// The statement in words; for a claim that does not hold, what was found instead.
    pub statement: String,
    /// What the statement rests on.
    pub assumptions: Vec<Assumption>,
    /// How far it is from failing, or from holding.
    pub margins: Vec<Margin>,
    /// For a refusal, what a reader can check; one sentence an entry.
    pub counterexample: Vec<String>,
}

/// Outcome of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// It holds, to its grade.
    #[serde(rename = "holds")]
    Holds,
    /// It is false, and the counterexample shows why.
    #[serde(rename = "refused")]
    Refused,
    /// Neither shown nor refuted.
    #[serde(rename = "not proved")]
    NotProved,
}

/// Worth of a piece of evidence, weakest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// Looked at in samples only.
    Sampled,
    /// Exact, given constants that are not.
    Conditional,
    /// Exact, all the way down.
    Proved,
}

/// One thing a claim rests on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assumption {
    /// In words, with its numbers.
    pub text: String,
    /// Worth of its own evidence; `None` for what the arm and the loop are taken to be, which is part of the statement.
    pub grade: Option<Grade>,
}

/// One figure of merit of a claim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Margin {
    /// What it is.
    pub name: String,
    /// Value; `None` when it does not exist.
    pub value: Option<f64>,
    /// Unit, empty when it has none.
    pub unit: String,
}

/// Poles over sampled configurations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoleMap {
    /// Number of configurations.
    pub configurations: u64,
    /// The poles.
    pub poles: Pair<Vec<Pole>>,
    /// Certified decay rate: no pole right of minus this.
    pub certified_rate_per_s: Option<f64>,
}

/// A pole, in 1/s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pole {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

/// Certified starting error, and what the scenario asks for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionRecord {
    /// Largest norm of the starting error that the claim covers; `None` when it covers none.
    pub radius_rad: Option<f64>,
    /// Moves of the scenario.
    pub steps: Vec<GoalStep>,
}

/// One change of the goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalStep {
    /// Name of the move.
    pub label: String,
    /// Euclidean norm over the joints.
    pub size_rad: f64,
}

/// A command and what it shows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandLine {
    /// To be typed as it stands.
    pub command: String,
    /// What the reader learns from it.
    pub shows: String,
}

/// Name and version of a program or library.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Version {
    /// Name.
    pub name: String,
    /// Version.
    pub version: String,
}

/// Series of numbers in which NaN travels as `null`.
mod series {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    fn with_gaps(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().map(|value| value.is_finite().then_some(*value)).collect()
    }

    fn without_gaps(values: Vec<Option<f64>>) -> Vec<f64> {
        values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect()
    }

    pub(super) fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        with_gaps(values).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        Vec::deserialize(deserializer).map(without_gaps)
    }

    /// The same for `[joint][sample]`.
    pub(super) mod rows {
        use super::{Deserialize, Deserializer, Serialize, Serializer, with_gaps, without_gaps};

        pub(in super::super) fn serialize<S: Serializer>(rows: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
            rows.iter().map(|row| with_gaps(row)).collect::<Vec<_>>().serialize(serializer)
        }

        pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
            deserializer: D,
        ) -> Result<Vec<Vec<f64>>, D::Error> {
            let rows: Vec<Vec<Option<f64>>> = Vec::deserialize(deserializer)?;
            Ok(rows.into_iter().map(without_gaps).collect())
        }
    }
}
