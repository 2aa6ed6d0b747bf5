//! The scenario on a fixed batch of seeded plants: the objective of a search, and the judge of its winner.
//!
//! Every candidate meets the same plants and the same sensor noise (common random numbers): with fresh plants at each evaluation the best cost is the luckiest draw, and the search
//! follows the luck. The price is that the batch may be fitted, so the winner is judged on plants that no candidate has met.
//!
//! Plants run in parallel on the current rayon pool and are collected in the order of their indices, so a result does not depend on the number of threads.

use core::ops::Range;
use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use certune_closed_loop::{
    Gains, KeyError, Metrics, NoiseStream, Parameters, Plant, PlantBox, PlantError, PlantSetting, Run, Scenario, Task,
    simulate_many, simulate_many_while,
};
use certune_dynamics::Robot;
use certune_simd::InstructionSet;
use rayon::prelude::*;

use crate::checked::Checked;
use crate::filter::StabilityFilter;
use crate::front::Measure;
use crate::goals::{Excess, Goal, Goals, Source};
use crate::outcome::{Finite, Outcome};
use crate::record::{PlantResult, Verdict};
use crate::score::Scoring;
use crate::search::{Hardened, Objective};
use crate::streams;
use crate::tune::Judge;

/// How often, in simulated time, somebody looks whether a batch still has a chance, s.
const LOOK_EVERY_S: f64 = 0.5;

/// Why a scenario gives no batch.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// A batch without plants would find every candidate good.
    #[error("a batch needs at least 1 plant, got 0")]
    NoPlants,
    /// The scenario does not fit the arm.
    #[error(transparent)]
    Task(#[from] KeyError),
    /// A plant of the box does not fit the arm.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// A scenario on plants of its box.
#[derive(Clone, Debug)]
pub struct Batch<const N: usize> {
    task: Task<N>,
    scoring: Scoring,
    seed: u64,
    robot: Robot,
    plant_box: PlantBox,
    plants: Vec<(u64, Plant<N>)>,
    /// Plants that were added.
    added: u64,
}

impl<const N: usize> Batch<N> {
    /// The plants `indices` of `seed`, drawn from the box of `scenario`, judged by their settling cost until [`Batch::with_goals`].
    ///
    /// # Errors
    /// [`BatchError`] when `indices` is empty or robot and scenario do not fit each other or `N`.
    pub fn new(robot: &Robot, scenario: &Scenario, seed: u64, indices: Range<u64>) -> Result<Self, BatchError> {
        if indices.is_empty() {
            return Err(BatchError::NoPlants);
        }
        let task = scenario.bind(robot)?;
        let draw = |index| Ok((index, Plant::new(robot, &scenario.plant_box.draw(N, seed, index))?));
        let plants = indices.map(draw).collect::<Result<_, PlantError>>()?;
        let scoring = Scoring::new(Goals::default(), &task);
        let (robot, plant_box) = (robot.clone(), scenario.plant_box.clone());
        Ok(Self { task, scoring, seed, robot, plant_box, plants, added: 0 })
    }

    /// The same plants, judged by other goals. What limits say of the start is not theirs to know: see [`Batch::resolved`].
    #[must_use]
    pub fn with_goals(self, goals: &Goals) -> Self {
        Self { scoring: Scoring::new(goals.clone(), &self.task), ..self }
    }

    /// `goals` with numbers for what limits say of the gains that the search starts from: what those reach on the worst of these plants.
    pub fn resolved(&self, goals: Goals, start: &Gains) -> Goals {
        if !goals.look_at_start() {
            return goals;
        }
        let found = self.metrics_of(start, &self.plants);
        let worst = |goal: Goal| found.iter().map(|run| self.scoring.figure(goal, run)).fold(0.0, f64::max);
        goals.with_start(worst)
    }

    /// How its runs are judged.
    pub const fn scoring(&self) -> &Scoring {
        &self.scoring
    }

    /// The batch that a search meets: the first `plants` plants of `seed`.
    ///
    /// # Errors
    /// As [`Batch::new`].
    pub fn for_search(robot: &Robot, scenario: &Scenario, seed: u64, plants: usize) -> Result<Self, BatchError> {
        Self::new(robot, scenario, seed, 0..(plants as u64).min(streams::FIRST_HELD_OUT_PLANT))
    }

    /// `plants` plants of `seed` that no search meets.
    ///
    /// # Errors
    /// As [`Batch::new`].
    pub fn held_out(robot: &Robot, scenario: &Scenario, seed: u64, plants: usize) -> Result<Self, BatchError> {
        let first = streams::FIRST_HELD_OUT_PLANT;
        Self::new(robot, scenario, seed, first..first + (plants as u64).min(streams::FIRST_HELD_OUT_PLANT))
    }

    /// The task that every plant performs.
    pub const fn task(&self) -> &Task<N> {
        &self.task
    }

    /// The family that the plants are drawn from.
    pub const fn plant_box(&self) -> &PlantBox {
        &self.plant_box
    }

    /// The seed of plants and noise.
    pub(crate) const fn seed(&self) -> u64 {
        self.seed
    }

    /// The index of a plant that would be added next.
    pub(crate) const fn next_index(&self) -> u64 {
        streams::FIRST_WORST_PLANT + self.added
    }

    /// A plant of the batch's arm.
    pub(crate) fn plant(&self, setting: &PlantSetting) -> Result<Plant<N>, PlantError> {
        Plant::new(&self.robot, setting)
    }

    /// The same with one more plant, in front of all others.
    ///
    /// # Errors
    /// [`PlantError`] when the setting does not fit the arm.
    pub fn with_plant(mut self, setting: &PlantSetting) -> Result<Self, PlantError> {
        let plant = self.plant(setting)?;
        self.plants.insert(0, (self.next_index(), plant));
        self.added += 1;
        Ok(self)
    }

    /// The plants with the indices of their draws.
    pub fn plants(&self) -> &[(u64, Plant<N>)] {
        &self.plants
    }

    /// The stream of sensor noise that belongs to the plant of that index.
    pub const fn noise(&self, index: u64) -> NoiseStream {
        NoiseStream { seed: self.seed, index }
    }

    /// Plants with the noise and the gains that they run with.
    fn runs<'a, P: Parameters<N>>(&'a self, plants: &'a [(u64, Plant<N>)], params: &'a P) -> Vec<(Run<'a, N>, &'a P)> {
        let run =
            |(index, plant): &'a (u64, Plant<N>)| (Run { plant, task: &self.task, noise: self.noise(*index) }, params);
        plants.iter().map(run).collect()
    }

    /// The figures of one run on each of `plants`.
    fn metrics_on<P: Parameters<N>>(&self, params: &P, plants: &[(u64, Plant<N>)]) -> Vec<Metrics> {
        // As many plants at a time as run side by side.
        let bundles = plants.par_chunks(InstructionSet::widest().lanes());
        bundles.flat_map_iter(|plants| simulate_many(&self.runs(plants, params))).collect()
    }

    /// The figures of one run on each plant of the batch.
    fn metrics<P: Parameters<N>>(&self, params: &P) -> Vec<Metrics> {
        self.metrics_on(params, &self.plants)
    }

    /// The same for gains of either controller; none for gains that make no controller.
    fn metrics_of(&self, gains: &Gains, plants: &[(u64, Plant<N>)]) -> Vec<Metrics> {
        match Checked::new(gains, self.task.step_s) {
            None => Vec::new(),
            Some(Checked::Aic(params)) => self.metrics_on(&params, plants),
            Some(Checked::Mrac(params)) => self.metrics_on(&*params, plants),
        }
    }

    /// The outcome of one run on each of `plants`; of none for gains that make no controller.
    pub(crate) fn outcomes(&self, gains: &Gains, plants: &[(u64, Plant<N>)]) -> Vec<Outcome> {
        self.metrics_of(gains, plants).iter().map(|run| self.scoring.of_run(run)).collect()
    }

    /// One run on each plant. Costs one simulation of the scenario per plant.
    pub fn run<P: Parameters<N>>(&self, params: &P) -> Vec<PlantResult> {
        let found = self.metrics(params);
        let result = |(metrics, (index, _)): (Metrics, &(u64, Plant<N>))| PlantResult {
            plant: *index,
            outcome: self.scoring.of_run(&metrics),
            figures: self.scoring.figures(&metrics),
        };
        found.into_iter().zip(&self.plants).map(result).collect()
    }

    /// What the plants say together, given up once that is known to be worse than `enough`: every half second of the task each bundle of plants writes down what its
    /// runs cost at least, and all stop when the plants together cost too much, or one has diverged or gone beyond a limit.
    ///
    /// Which thread sees it first depends on the hour; the answer does not, as whatever is worse than `enough` is answered alike.
    pub fn outcome<P: Parameters<N>>(&self, params: &P, enough: Option<Finite>) -> Outcome {
        let Some(enough) = enough else {
            return self.scoring.of_batch(self.metrics(params).iter().map(|run| self.scoring.of_run(run)));
        };
        let every = ((LOOK_EVERY_S / self.task.step_s).round() as u64).max(1);
        let lanes = InstructionSet::widest().lanes();
        let at_least = Mutex::new(vec![0.0; self.plants.len()]);
        let stopped = AtomicBool::new(false);
        let bundle = |(place, plants): (usize, &[(u64, Plant<N>)])| {
            let mut go_on = |first: usize, found: &[Metrics]| {
                let mut costs = at_least.lock().unwrap_or_else(PoisonError::into_inner);
                let mut fails = false;
                for (cost, metrics) in costs[place + first..].iter_mut().zip(found) {
                    match self.scoring.of_run_so_far(metrics) {
                        Some(so_far) => *cost = so_far,
                        None => fails = true,
                    }
                }
                if fails || self.scoring.of_batch_so_far(&costs) > enough.get() {
                    stopped.store(true, Ordering::Relaxed);
                }
                !stopped.load(Ordering::Relaxed)
            };
            let found = if stopped.load(Ordering::Relaxed) {
                Vec::new()
            } else {
                simulate_many_while(&self.runs(plants, params), every, &mut go_on)
            };
            found.into_iter().map(|metrics| self.scoring.of_run(&metrics)).collect::<Vec<_>>()
        };
        // The hardest plants decide the cost, so nobody begins with the others before these are done; but no thread idles.
        let first = lanes * rayon::current_num_threads();
        let mut outcomes: Vec<Outcome> = Vec::with_capacity(self.plants.len());
        for (index, plants) in self.plants.chunks(first).enumerate() {
            let bundles = plants.par_chunks(lanes).enumerate();
            outcomes.par_extend(bundles.flat_map_iter(|(at, plants)| bundle((index * first + at * lanes, plants))));
        }
        let outcome = self.scoring.of_batch(outcomes);
        if stopped.into_inner() || outcome > (Outcome::Simulated { cost: enough }) {
            return Outcome::Stopped { cost_above: enough };
        }
        outcome
    }

    /// Puts the plants on which `gains` fare worst first; what they say together stays the same.
    #[must_use]
    pub fn hardest_first(mut self, gains: &Gains) -> Self {
        let found = self.judge(gains).plants;
        if found.is_empty() {
            return self;
        }
        let outcomes = found.iter().map(|plant| plant.outcome);
        let mut plants: Vec<_> = outcomes.zip(core::mem::take(&mut self.plants)).collect();
        plants.sort_by(|(a, _), (b, _)| b.cmp(a));
        self.plants = plants.into_iter().map(|(_, plant)| plant).collect();
        self
    }
}

/// Gains that make no controller fail before the first sample.
fn no_controller() -> Outcome {
    Outcome::Diverged { at_s: Finite::saturating(0.0) }
}

impl<const N: usize> Judge for Batch<N> {
    fn judge(&self, gains: &Gains) -> Verdict {
        let plants = match Checked::new(gains, self.task.step_s) {
            None => return Verdict { outcome: no_controller(), plants: Vec::new() },
            Some(Checked::Aic(params)) => self.run(&params),
            Some(Checked::Mrac(params)) => self.run(&*params),
        };
        Verdict { outcome: self.scoring.of_batch(plants.iter().map(|plant| plant.outcome)), plants }
    }
}

/// Who proves figures: this room knows nothing of proofs.
pub trait Prover: Sync {
    /// The proved figures of `goals`, in their order, for the whole plant box; `None` when a proof fails.
    fn figures(&self, gains: &Gains, goals: &[Goal]) -> Option<Vec<f64>>;
}

/// Nobody proves anything.
impl Prover for () {
    fn figures(&self, _: &Gains, _: &[Goal]) -> Option<Vec<f64>> {
        None
    }
}

/// The objective of a search for gains of either controller: the stability filter, then what is proved, then the batch, each only where a goal asks for it.
#[derive(Clone)]
pub struct SimulatedObjective<'a, const N: usize> {
    batch: Batch<N>,
    filter: StabilityFilter<N>,
    prover: &'a dyn Prover,
}

impl<const N: usize> SimulatedObjective<'static, N> {
    /// The settling cost on the first `plants` plants of `seed`, behind a filter of `filter_samples` samples.
    ///
    /// # Errors
    /// [`BatchError`] when there is no plant, or robot and scenario do not fit each other or `N`.
    pub fn new(
        robot: &Robot,
        scenario: &Scenario,
        seed: u64,
        plants: usize,
        filter_samples: usize,
    ) -> Result<Self, BatchError> {
        let batch = Batch::for_search(robot, scenario, seed, plants)?;
        let filter = StabilityFilter::new(robot, scenario, batch.task(), seed, filter_samples)?;
        Ok(Self { batch, filter, prover: &() })
    }
}

impl<const N: usize> SimulatedObjective<'_, N> {
    /// Other goals on the same plants, where `prover` answers those that are proved. Limits must be numbers: see [`Batch::resolved`].
    #[must_use]
    pub fn with_goals<'b>(self, goals: &Goals, prover: &'b dyn Prover) -> SimulatedObjective<'b, N> {
        SimulatedObjective { batch: self.batch.with_goals(goals), filter: self.filter, prover }
    }

    /// The plants on which `gains` fare worst come first, so that a candidate that is not good enough is known soon. Outcomes do not change.
    #[must_use]
    pub fn hardest_first(mut self, gains: &Gains) -> Self {
        self.batch = self.batch.hardest_first(gains);
        self
    }

    /// The plants.
    pub const fn batch(&self) -> &Batch<N> {
        &self.batch
    }

    /// The filter.
    pub const fn filter(&self) -> &StabilityFilter<N> {
        &self.filter
    }

    /// The figures of those of `goals` that no run answers, or what becomes of gains that are unstable or without a proof.
    fn unsimulated<P: Parameters<N>>(
        &self,
        gains: &Gains,
        params: &P,
        goals: &[Goal],
    ) -> Result<Vec<(Goal, f64)>, Outcome> {
        let growth_per_s = self.filter.growth_per_s(params);
        if growth_per_s.get() >= 0.0 {
            return Err(Outcome::Unstable { abscissa_per_s: growth_per_s });
        }
        let of = |source: Source| goals.iter().copied().filter(|goal| goal.source() == source).collect::<Vec<_>>();
        let proved = of(Source::Proved);
        let mut figures = Vec::new();
        if !proved.is_empty() {
            // Where nothing is proved the slowest mode of the sample is what can be compared.
            let refused = || Outcome::Uncertified { cost: Finite::saturating(-growth_per_s.get().recip()) };
            let found = self.prover.figures(gains, &proved).ok_or_else(refused)?;
            figures.extend(proved.into_iter().zip(found));
        }
        for goal in of(Source::Linearised) {
            figures.push((goal, self.filter.delay_margin_s(params, self.batch.task.step_s)));
        }
        Ok(figures)
    }

    /// The outcome, where `simulate` runs the batch and is told what is enough.
    fn outcome<P: Parameters<N>>(
        &self,
        gains: &Gains,
        params: &P,
        enough: Option<Finite>,
        simulate: impl FnOnce(Option<Finite>) -> Outcome,
    ) -> Outcome {
        let goals = self.batch.scoring.goals();
        let figures = match self.unsimulated(gains, params, &goals.all()) {
            Ok(figures) => figures,
            Err(failed) => return failed,
        };
        let figure = |goal: Goal| figures.iter().find(|(other, _)| *other == goal).map(|(_, figure)| *figure);
        let mut excess = Excess::default();
        for (goal, bound) in goals.limits_from(Source::Proved).chain(goals.limits_from(Source::Linearised)) {
            excess.add(goal, figure(goal).unwrap_or(0.0), bound);
        }
        let found = figure(goals.objective).map(|figure| {
            let cost = goals.objective.cost(figure);
            match goals.objective.source() {
                Source::Proved => Outcome::Certified { cost },
                Source::Simulated | Source::Linearised => Outcome::Simulated { cost },
            }
        });
        match (found, enough) {
            (Some(found), _) if goals.from(Source::Simulated).is_empty() => excess.judge(found),
            (None, Some(enough)) if excess.is_any() => Outcome::Stopped { cost_above: enough },
            (found, enough) => {
                let simulated = simulate(if found.is_some() { None } else { enough });
                excess.judge(match (simulated, found) {
                    (Outcome::Simulated { .. }, Some(found)) => found,
                    _ => simulated,
                })
            }
        }
    }

    fn answer<P: Parameters<N>>(&self, gains: &Gains, params: &P, enough: Option<Finite>) -> Outcome {
        self.outcome(gains, params, enough, |enough| self.batch.outcome(params, enough))
    }

    fn verdict<P: Parameters<N>>(&self, gains: &Gains, params: &P) -> Verdict {
        let mut plants = Vec::new();
        let outcome = self.outcome(gains, params, None, |_| {
            plants = self.batch.run(params);
            self.batch.scoring.of_batch(plants.iter().map(|plant| plant.outcome))
        });
        Verdict { outcome, plants }
    }
}

impl<const N: usize> Objective for SimulatedObjective<'_, N> {
    fn hardened(&self, gains: &Gains, round: u32) -> Option<Hardened<'_>> {
        // Without runs there is nothing that a plant could make worse.
        if self.batch.scoring.goals().from(Source::Simulated).is_empty() {
            return None;
        }
        let plant = self.batch.worse_plant(gains, round)?;
        let batch = self.batch.clone().with_plant(&plant.setting).ok()?;
        Some(Hardened { objective: Box::new(Self { batch, ..self.clone() }), plant })
    }

    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        match Checked::new(gains, self.batch.task.step_s) {
            None => no_controller(),
            Some(Checked::Aic(params)) => self.answer(gains, &params, enough),
            Some(Checked::Mrac(params)) => self.answer(gains, &*params, enough),
        }
    }
}

impl<const N: usize> SimulatedObjective<'_, N> {
    fn measured<P: Parameters<N>>(&self, gains: &Gains, params: &P, goals: &[Goal]) -> Result<Vec<f64>, Outcome> {
        let figures = self.unsimulated(gains, params, goals)?;
        let runs = self.batch.metrics(params);
        let scoring = &self.batch.scoring;
        // Limits first, and divergence: whoever fails has no figures.
        let outcome = scoring.of_batch(runs.iter().map(|run| scoring.of_run(run)));
        if !matches!(outcome, Outcome::Simulated { .. }) {
            return Err(outcome);
        }
        let figure = |goal: &Goal| match figures.iter().find(|(other, _)| other == goal) {
            Some((_, figure)) => *figure,
            None => scoring.tail(runs.iter().map(|run| scoring.figure(*goal, run))),
        };
        Ok(goals.iter().map(figure).collect())
    }
}

impl<const N: usize> Measure for SimulatedObjective<'_, N> {
    fn measure(&self, gains: &Gains, goals: &[Goal]) -> Result<Vec<f64>, Outcome> {
        match Checked::new(gains, self.batch.task.step_s) {
            None => Err(no_controller()),
            Some(Checked::Aic(params)) => self.measured(gains, &params, goals),
            Some(Checked::Mrac(params)) => self.measured(gains, &*params, goals),
        }
    }
}

/// The same outcome, with what each plant says; without plants when none had to be run.
impl<const N: usize> Judge for SimulatedObjective<'_, N> {
    fn judge(&self, gains: &Gains) -> Verdict {
        match Checked::new(gains, self.batch.task.step_s) {
            None => Verdict { outcome: no_controller(), plants: Vec::new() },
            Some(Checked::Aic(params)) => self.verdict(gains, &params),
            Some(Checked::Mrac(params)) => self.verdict(gains, &*params),
        }
    }
}
