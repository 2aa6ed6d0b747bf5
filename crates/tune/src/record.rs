//! What a tuning run leaves behind: every number that led to the gains, and nothing that differs from run to run.
//!
//! No time, host or thread count is recorded, so two runs with the same question and versions give the same bytes.

use std::collections::BTreeMap;

use certune_closed_loop::{Gains, PerJoint, PlantSetting};
use serde::{Deserialize, Serialize};

use crate::goals::{Goal, Goals, Source};
use crate::outcome::Outcome;
use crate::search::{Evaluation, SearchSettings, Termination};
use crate::space::{Knob, Space};

/// The version of the record that this crate writes.
pub const RECORD_SCHEMA: u32 = 4;

/// What was asked, in names and numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    /// Name of the robot.
    pub robot: String,
    /// SHA-256 of the robot's canonical description.
    pub robot_sha256: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Names and versions of the programs and libraries that took part.
    pub versions: BTreeMap<String, String>,
    /// What the search is after and what it must keep.
    pub goals: Goals,
    /// The search.
    pub search: SearchSettings,
    /// Plants on which every candidate is simulated.
    pub batch_plants: usize,
    /// Plants that judge the winner.
    pub held_out_plants: usize,
    /// The most plants that are searched for, on which the best candidate fares worse than on those of the batch; they join it. With any, a fifth of the evaluations is kept for them.
    pub worst_plants: u32,
    /// The most candidates that are brought before the certifier; the start, if none of them passes, comes on top. At least 1.
    pub certification_attempts: usize,
}

/// Where was searched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpaceRecord {
    /// The rows that stayed.
    pub fixed: BTreeMap<String, PerJoint>,
    /// What moved the others, in the order of the coordinates.
    pub knobs: Vec<Knob>,
}

impl From<&Space> for SpaceRecord {
    fn from(space: &Space) -> Self {
        let fixed = space.fixed().map(|(row, numbers)| (row.to_owned(), numbers.clone()));
        Self { fixed: fixed.collect(), knobs: space.knobs().to_vec() }
    }
}

/// A plant on which a candidate fared worse than on all before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorstPlant {
    /// The candidate, by the index of its evaluation.
    pub evaluation: usize,
    /// The plant.
    pub setting: PlantSetting,
    /// What became of the candidate on it.
    pub outcome: Outcome,
}

/// A visit to the certifier.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attempt {
    /// The candidate, by the index of its evaluation.
    pub evaluation: usize,
    /// Why it was refused; `None` if it was certified.
    pub refusal: Option<String>,
}

/// What one plant says about one set of gains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantResult {
    /// Index of the draw.
    pub plant: u64,
    /// What became of the run.
    pub outcome: Outcome,
    /// Figures of the run as far as it went.
    pub figures: Figures,
}

/// Figures of one run: the worst over its segments and joints, except where said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// The settling cost, s; `None` for a run that diverged.
    pub settling_cost_s: Option<f64>,
    /// Longest time until a joint stays within 2 % of its step; `None` if one never does.
    pub settling_time_s: Option<f64>,
    /// Largest error at the end of a segment.
    pub final_error_rad: Option<f64>,
    /// Largest overshoot, as a fraction of the joint's step.
    pub overshoot: Option<f64>,
    /// Largest torque.
    pub peak_torque_n_m: Option<f64>,
    /// Jitter: the largest root mean square of a torque's rate.
    pub torque_rate_rms_n_m_per_s: Option<f64>,
    /// Integral of time times absolute error, summed over segments and joints.
    pub itae_rad_s2: Option<f64>,
    /// Mechanical work of the motors, given and taken, summed over segments and joints.
    pub energy_j: Option<f64>,
    /// Steps with a torque at its limit, summed over segments and joints.
    pub saturated_steps: u64,
}

impl Figures {
    /// The figure of a goal; none when there is none, or no run alone answers it.
    pub const fn get(&self, goal: Goal) -> Option<f64> {
        match goal {
            Goal::SettlingCost => self.settling_cost_s,
            Goal::SettlingTime => self.settling_time_s,
            Goal::FinalError => self.final_error_rad,
            Goal::Itae => self.itae_rad_s2,
            Goal::Overshoot => self.overshoot,
            Goal::Jitter => self.torque_rate_rms_n_m_per_s,
            Goal::PeakTorque => self.peak_torque_n_m,
            Goal::Energy => self.energy_j,
            Goal::CertifiedRate | Goal::CertifiedRadius | Goal::DelayMargin => None,
        }
    }
}

/// The judgement of plants that the search never saw, over the same plants for both.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Outcome of the start over the plants, aggregated as in the search; `None` without a start.
    pub start: Option<Verdict>,
    /// The same for the winner; `None` without a winner.
    pub tuned: Option<Verdict>,
}

impl Verdict {
    /// On how many plants every limit is kept that runs answer. A run without a figure, one that never settles say, keeps no limit on it.
    pub fn keep_limits(&self, goals: &Goals) -> usize {
        let keeps = |plant: &&PlantResult| {
            let mut limits = goals.limits_from(Source::Simulated);
            limits.all(|(goal, bound)| plant.figures.get(goal).is_some_and(|figure| figure <= bound))
        };
        self.plants.iter().filter(keeps).count()
    }
}

/// One set of gains before the held-out plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// All plants together.
    pub outcome: Outcome,
    /// Each plant.
    pub plants: Vec<PlantResult>,
}

/// What a change of one knob of the winner does to the outcome on the batch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensitivity {
    /// The knob.
    pub knob: String,
    /// With every gain that it sets times 0.9.
    pub at_minus_10_percent: Outcome,
    /// With every gain that it sets times 1.1.
    pub at_plus_10_percent: Outcome,
}

/// The record of a tuning run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunRecord {
    /// [`RECORD_SCHEMA`].
    pub schema: u32,
    /// What was asked.
    pub question: Question,
    /// Where was searched.
    pub space: SpaceRecord,
    /// Every candidate in order, with its final rank.
    pub evaluations: Vec<Evaluation>,
    /// Why the search ended.
    pub termination: Termination,
    /// The plants that were searched for, in order: one a round.
    pub worst_plants: Vec<WorstPlant>,
    /// Every visit to the certifier in order.
    pub certification: Vec<Attempt>,
    /// The evaluation of the start.
    pub start: Option<usize>,
    /// The evaluation of the best certified candidate; `None` if no candidate was certified.
    pub winner: Option<usize>,
    /// What plants say that the search never saw.
    pub held_out: HeldOut,
    /// How much each knob of the winner matters.
    pub sensitivity: Vec<Sensitivity>,
}

impl RunRecord {
    /// The start, as evaluated.
    pub fn start(&self) -> Option<&Evaluation> {
        self.evaluations.get(self.start?)
    }

    /// The best certified candidate.
    pub fn winner(&self) -> Option<&Evaluation> {
        self.evaluations.get(self.winner?)
    }

    /// The winner's gains.
    pub fn tuned(&self) -> Option<&Gains> {
        self.winner().map(|evaluation| &evaluation.gains)
    }
}
