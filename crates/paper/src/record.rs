//! What a comparison leaves behind: `compare.json`.
//!
//! Everything but [`Comparison::measured_times`] is the same to the bit for the same question, whatever the number of threads. Numbers per arm are kept, in the order of the arms, so that
//! every quantile and every test can be done again from the record; they are rounded to five significant digits, and all verdicts are drawn from the rounded ones.

use std::collections::BTreeMap;

use certune_closed_loop::{Gains, Guarded, Metrics};
use certune_tune::{Outcome, Termination};
use serde::{Deserialize, Serialize};

use crate::statements::{Finding, Statement};
use crate::statistics::{self, quantile};

/// The schema of [`Comparison`].
pub const COMPARISON_SCHEMA: u32 = 1;

/// The whole comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// [`COMPARISON_SCHEMA`].
    pub schema: u32,
    /// What was asked.
    pub question: Question,
    /// Those compared.
    pub contenders: Vec<Contender>,
    /// Pick and place on the approximated model.
    pub approximated: Experiment,
    /// The same with the paper's torque limit on every joint.
    pub paper_limit: Experiment,
    /// The same gains on the identified arm, over a grid of plant effects.
    pub transfer: Transfer,
    /// Two bottles.
    pub payloads: Experiment,
    /// A push at the flange.
    pub push: Experiment,
    /// Operations of one step.
    pub cost: Vec<StepCost>,
    /// What tuning took.
    pub effort: Effort,
    /// Runs on the nominal arm, thinned.
    pub traces: Vec<Trace>,
    /// The paper's statements and what is left of them.
    pub statements: Vec<Statement>,
    /// What was found beside them.
    pub findings: Vec<Finding>,
    /// What a step took on this machine: differs from run to run.
    pub measured_times: Vec<StepTime>,
}

/// What was asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    /// The identified arm.
    pub robot: String,
    /// Its hash.
    pub robot_sha256: String,
    /// Seed of arms, noise and searches.
    pub seed: u64,
    /// Arms of every experiment with a spread.
    pub arms: usize,
    /// Arms of a cell of the grid of plant effects.
    pub grid_arms: usize,
    /// Candidates of each search.
    pub candidates: usize,
    /// Plants that every candidate meets.
    pub search_plants: usize,
    /// Relative uncertainty of every link's mass.
    pub mass_uncertainty: f64,
    /// Torque rate at which the arm stops, and to which the limiter limits, N m/s.
    pub torque_rate_limit_n_m_per_s: f64,
}

/// One of those compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contender {
    /// Small letters, digits and hyphens.
    pub name: String,
    /// In words.
    pub title: String,
    /// Its gains.
    pub gains: Gains,
}

/// Some controllers on the same arms under the same conditions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Small letters and hyphens.
    pub name: String,
    /// The conditions in words.
    pub conditions: String,
    /// What each controller did.
    pub results: Vec<Arms>,
    /// Pairs of controllers on the same arms.
    pub tests: Vec<PairedTest>,
}

impl Experiment {
    /// The result of a controller.
    pub fn of(&self, contender: &str) -> Option<&Arms> {
        self.results.iter().find(|arms| arms.contender == contender)
    }

    /// The test of a figure between two controllers.
    pub fn test(&self, figure: &str, first: &str, second: &str) -> Option<&PairedTest> {
        self.tests.iter().find(|test| test.figure == figure && test.first == first && test.second == second)
    }

    /// Tests every figure of the pairs that are there.
    pub(crate) fn with_tests(mut self, pairs: &[(&str, &str)]) -> Self {
        for (first, second) in pairs {
            let (Some(one), Some(other)) = (self.of(first), self.of(second)) else { continue };
            let tests: Vec<PairedTest> = one
                .figures
                .iter()
                .filter(|(figure, _)| !figure.starts_with("safety_stop"))
                .filter_map(|(figure, values)| {
                    let others = &other.figures.get(figure)?.values;
                    let found = statistics::sign_test(values.values.iter().copied().zip(others.iter().copied()));
                    Some(PairedTest {
                        figure: figure.clone(),
                        first: (*first).to_owned(),
                        second: (*second).to_owned(),
                        first_lower: found.first,
                        second_lower: found.second,
                        ties: found.ties,
                        p_value: found.p_value,
                    })
                })
                .collect();
            self.tests.extend(tests);
        }
        self
    }
}

/// What one controller did on every arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arms {
    /// Its name.
    pub contender: String,
    /// Runs that ran away.
    pub diverged: usize,
    /// Each figure by its name, which ends in its unit.
    pub figures: BTreeMap<String, Figure>,
    /// The run on the nominal arm in full, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<Metrics>,
}

impl Arms {
    /// A figure's quantile over the arms that have it.
    pub fn quantile(&self, figure: &str, share: f64) -> Option<f64> {
        self.figures.get(figure)?.quantile(share)
    }

    /// A figure's median over the arms that have it.
    pub fn median(&self, figure: &str) -> Option<f64> {
        self.quantile(figure, 0.5)
    }
}

/// One figure over the arms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Figure {
    /// One number an arm, in their order; none where the arm has none: it did not settle, or it ran away.
    pub values: Vec<Option<f64>>,
}

impl Figure {
    /// The quantile over the arms that have the figure.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        quantile(&self.values.iter().flatten().copied().collect::<Vec<_>>(), share)
    }

    /// Arms without the figure.
    pub fn missing(&self) -> usize {
        self.values.iter().filter(|value| value.is_none()).count()
    }
}

/// A sign test over the same arms; see [`statistics`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairedTest {
    /// Which figure.
    pub figure: String,
    /// One controller.
    pub first: String,
    /// The other.
    pub second: String,
    /// Arms on which the first has the lower figure.
    pub first_lower: usize,
    /// Arms on which the second has.
    pub second_lower: usize,
    /// Arms on which both are equal.
    pub ties: usize,
    /// Two-sided, exact.
    pub p_value: f64,
}

/// The gains of the simulation on the identified arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transfer {
    /// The conditions that all cells share, in words.
    pub conditions: String,
    /// The grid.
    pub cells: Vec<Cell>,
    /// The cell without noise, delay and limiter, on many arms.
    pub ideal: Experiment,
    /// The cell with noise, one sample of delay and the limiter, on many arms.
    pub robot: Experiment,
}

/// The plant effects of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// Viscous friction of every joint, N m s/rad.
    pub friction_n_m_s_per_rad: f64,
    /// Rotor inertia of every joint, kg m².
    pub rotor_inertia_kg_m2: f64,
    /// Whether the sensors are noisy.
    pub noise: bool,
    /// Whole samples from command to torque.
    pub delay_samples: usize,
    /// Whether the torque's rate is limited.
    pub torque_rate_limited: bool,
}

/// A cell of the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// The plant.
    pub effects: Effects,
    /// What each controller did.
    pub results: Vec<CellResult>,
}

/// What a controller did in a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellResult {
    /// Its name.
    pub contender: String,
    /// Arms that would have stopped themselves.
    pub stopped: usize,
    /// The same, a torque that is too fast apart.
    pub stopped_rate_apart: usize,
    /// Arms that would have stopped for what they did, range or speed, whatever they were told.
    pub stopped_motion: usize,
    /// The median of the times of these stops, s.
    pub stop_s: Option<f64>,
    /// What most of them were for.
    pub stop_for: Option<Guarded>,
    /// At which joint most of them were, from 1.
    pub stop_joint: Option<usize>,
    /// Median of the largest error at the end of a move, rad; of the arms that did not run away.
    pub worst_error_rad: Option<f64>,
    /// Median over the arms of each joint's torque rate once it has settled, root mean square, N m/s.
    pub torque_rate_n_m_per_s: Vec<Option<f64>>,
    /// The same of the acceleration, rad/s²: what jitter there is of the motion.
    pub acceleration_rad_per_s2: Vec<Option<f64>>,
}

/// The operations of one step of a controller for so many joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepCost {
    /// `aic`, or `mrac-` and the law.
    pub controller: String,
    /// Joints.
    pub joints: usize,
    /// Additions and subtractions.
    pub additions: u64,
    /// Multiplications.
    pub multiplications: u64,
    /// Divisions and square roots.
    pub others: u64,
    /// Numbers kept from step to step.
    pub state: usize,
}

impl StepCost {
    /// All operations.
    pub const fn total(&self) -> u64 {
        self.additions + self.multiplications + self.others
    }
}

/// What a step took on this machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepTime {
    /// `aic` or `mrac`.
    pub controller: String,
    /// Joints.
    pub joints: usize,
    /// Median over batches of steps, ns.
    pub median_ns: f64,
}

/// What tuning took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effort {
    /// Numbers to tune of the AIC: the same on all joints.
    pub aic_parameters: usize,
    /// Of these are independent: multiplying all by one number changes nothing.
    pub aic_degrees_of_freedom: usize,
    /// Numbers to tune of MRAC.
    pub mrac_parameters: usize,
    /// The searches, all with the same plants, objective, limits and budget; none where gains were given.
    pub searches: Vec<Search>,
    /// How many candidates each search took to costs that several reached.
    pub reached: Vec<Reached>,
}

/// One search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Whose gains it found.
    pub contender: String,
    /// Knobs that it moved.
    pub knobs: usize,
    /// Why it ended.
    pub termination: Termination,
    /// The outcome of the published gains.
    pub start: Outcome,
    /// The best.
    pub best: Outcome,
    /// Candidates so far and their best cost, s, each time that it fell.
    pub best_so_far: Vec<(usize, f64)>,
}

impl Search {
    /// Candidates until the cost was first as low as that, s.
    pub fn until(&self, cost_s: f64) -> Option<usize> {
        self.best_so_far.iter().find(|(_, best)| *best <= cost_s).map(|(candidates, _)| *candidates)
    }
}

/// How many candidates it took to a cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reached {
    /// The cost, s.
    pub cost_s: f64,
    /// By contender; none where the search never got there.
    pub candidates: BTreeMap<String, Option<usize>>,
}

/// A run on the nominal arm, thinned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trace {
    /// Of which experiment.
    pub experiment: String,
    /// Whose.
    pub contender: String,
    /// What tells it from others of the same experiment; may be empty.
    pub case: String,
    /// Time between rows, s.
    pub row_s: f64,
    /// Goals, rad, each with the row at which it was set.
    pub goals: Vec<(usize, Vec<f64>)>,
    /// Positions by row and joint, rad.
    pub q_rad: Vec<Vec<f64>>,
    /// Torque that the motors gave, by row and joint, N m.
    pub tau_n_m: Vec<Vec<f64>>,
    /// By row: origins of the joints from base to tip, then the flange, m. Empty for runs that are not replayed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points_m: Vec<Vec<[f64; 3]>>,
    /// When the arm would have stopped itself, s.
    pub stop_s: Option<f64>,
}

/// `value` to five significant digits; what is not finite has no place in a record.
pub(crate) fn rounded(value: f64) -> Option<f64> {
    value.is_finite().then(|| format!("{value:.4e}").parse().unwrap_or(value))
}

/// `value` to so many digits behind the point, for traces.
pub(crate) fn fixed(value: f64, digits: i32) -> f64 {
    let scale = 10.0_f64.powi(digits);
    // Adding zero turns -0 into 0.
    (value * scale).round() / scale + 0.0
}
