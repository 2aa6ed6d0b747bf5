//! Particle swarm. Source: Zambrano-Bigiarini and others, *Standard Particle Swarm Optimisation 2011 at CEC-2013* (2013), as in argmin.

use std::sync::atomic::{AtomicUsize, Ordering};

use argmin::core::{Executor, PopulationState};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::ledger::{Ledger, Problem, is_budget_spent};
use super::{Phase, SearchError, SearchSettings, Termination};
use crate::space::Method;
use crate::streams;

pub(super) fn run(ledger: &Ledger<'_>, settings: &SearchSettings) -> Result<Termination, SearchError> {
    let dimension = ledger.space().dimension();
    let mut chance = ChaCha8Rng::seed_from_u64(settings.seed);
    chance.set_stream(streams::SWARM);
    let box_ = (vec![0.0; dimension], vec![1.0; dimension]);
    let solver = ParticleSwarm::new(box_, settings.particles).with_rng_generator(chance);
    let generation = AtomicUsize::new(0);
    let count = || ledger.enter(Phase::Swarm { generation: generation.fetch_add(1, Ordering::Relaxed) });
    let problem = Problem { ledger, before_batch: &count };
    // A generation that meets a new candidate spends at least one evaluation, so more generations than evaluations only repeat.
    let generations = settings.evaluations as u64 + 1;
    let ended = Executor::new(problem, solver)
        .configure(|state: PopulationState<Particle<Vec<f64>, f64>, f64>| state.max_iters(generations))
        .timer(false)
        .run();
    match ended {
        Ok(_) if ledger.left() == 0 => Ok(Termination::BudgetSpent),
        Ok(_) => Ok(Termination::Converged),
        Err(error) if is_budget_spent(&error) => Ok(Termination::BudgetSpent),
        Err(_) => Err(SearchError::Solver { method: Method::ParticleSwarm, evaluations: ledger.len() }),
    }
}
