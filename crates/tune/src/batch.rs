//! The scenario on a fixed batch of seeded plants: the objective of a search, and the judge of its winner.
//!
//! Every candidate meets the same plants and the same sensor noise (common random numbers): with fresh plants at each evaluation the best cost is the luckiest draw, and the search
//! follows the luck. The price is that the batch may be fitted, so the winner is judged on plants that no candidate has met.
//!
//! Plants run in parallel on the current rayon pool and are collected in the order of their indices, so a result does not depend on the number of threads.

use core::ops::Range;

use certune_closed_loop::{KeyError, NoiseStream, Plant, PlantError, Run, Scenario, Task, simulate_many};
use certune_control::aic::AicParams;
use certune_dynamics::Robot;
use certune_simd::InstructionSet;
use rayon::prelude::*;

use crate::filter::StabilityFilter;
use crate::gains::Gains;
use crate::outcome::{Finite, Outcome};
use crate::record::{PlantResult, Verdict};
use crate::score;
use crate::search::Objective;
use crate::streams;
use crate::tune::Judge;

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
    start_rad: Vec<f64>,
    seed: u64,
    plants: Vec<(u64, Plant<N>)>,
}

impl<const N: usize> Batch<N> {
    /// The plants `indices` of `seed`, drawn from the box of `scenario`.
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
        Ok(Self { task, start_rad: scenario.start_rad.clone(), seed, plants })
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

    /// The plants with the indices of their draws.
    pub fn plants(&self) -> &[(u64, Plant<N>)] {
        &self.plants
    }

    /// The stream of sensor noise that belongs to the plant of that index.
    pub const fn noise(&self, index: u64) -> NoiseStream {
        NoiseStream { seed: self.seed, index }
    }

    /// One run on each plant. Costs one simulation of the scenario per plant.
    pub fn run(&self, params: &AicParams<N>) -> Vec<PlantResult> {
        // As many plants at a time as run side by side.
        self.plants
            .par_chunks(InstructionSet::widest().lanes())
            .flat_map_iter(|plants| {
                let runs: Vec<_> = plants
                    .iter()
                    .map(|(index, plant)| (Run { plant, task: &self.task, noise: self.noise(*index) }, params))
                    .collect();
                simulate_many(&runs).into_iter().zip(plants).map(|(metrics, (index, _))| PlantResult {
                    plant: *index,
                    outcome: score::of_run(&metrics, &self.start_rad, self.task.step_s),
                    figures: score::figures(&metrics),
                })
            })
            .collect()
    }

    fn params(&self, gains: &Gains) -> Option<AicParams<N>> {
        AicParams::new(&gains.on_every_joint(), self.task.step_s).ok()
    }
}

/// Gains that make no controller fail before the first sample.
fn no_controller() -> Outcome {
    Outcome::Diverged { at_s: Finite::saturating(0.0) }
}

impl<const N: usize> Judge for Batch<N> {
    fn judge(&self, gains: &Gains) -> Verdict {
        let Some(params) = self.params(gains) else {
            return Verdict { outcome: no_controller(), plants: Vec::new() };
        };
        let plants = self.run(&params);
        Verdict { outcome: score::of_batch(plants.iter().map(|plant| plant.outcome)), plants }
    }
}

/// The objective of a search for gains of the active inference controller: the stability filter, then the batch.
#[derive(Clone, Debug)]
pub struct AicObjective<const N: usize> {
    batch: Batch<N>,
    filter: StabilityFilter<N>,
}

impl<const N: usize> AicObjective<N> {
    /// The first `plants` plants of `seed`, behind a filter of `filter_samples` samples.
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
        Ok(Self { batch, filter })
    }

    /// The plants.
    pub const fn batch(&self) -> &Batch<N> {
        &self.batch
    }

    /// The filter.
    pub const fn filter(&self) -> &StabilityFilter<N> {
        &self.filter
    }
}

impl<const N: usize> Objective for AicObjective<N> {
    fn evaluate(&self, gains: &Gains) -> Outcome {
        let Some(params) = self.batch.params(gains) else { return no_controller() };
        let growth_per_s = self.filter.growth_per_s(&params);
        if growth_per_s.get() >= 0.0 {
            return Outcome::Unstable { abscissa_per_s: growth_per_s };
        }
        score::of_batch(self.batch.run(&params).iter().map(|plant| plant.outcome))
    }
}
