//! Particle swarm. Source: Zambrano-Bigiarini and others, *Standard Particle Swarm Optimisation 2011 at CEC-2013* (2013), as in argmin.

use std::sync::{Mutex, PoisonError};

use argmin::core::{Error, Executor, PopulationState};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::ledger::{BudgetSpent, Ledger, Problem, is_budget_spent};
use super::{Phase, SearchSettings, Termination};
use crate::outcome::Outcome;
use crate::streams;

/// What a swarm remembers from one generation to the next.
///
/// A particle is compared with its own best and with the best of all, which is one of those: what is worse than the particle's own best need not be known better.
#[derive(Default)]
struct Flight {
    generation: usize,
    /// The best outcome of each particle, in argmin's order.
    best: Vec<Outcome>,
}

impl Flight {
    fn generation(&mut self, ledger: &Ledger<'_>, points: &[&Vec<f64>]) -> Result<Vec<f64>, BudgetSpent> {
        ledger.enter(Phase::Swarm { generation: self.generation });
        self.generation += 1;
        let enough = |particle: usize| match self.best.get(particle)? {
            Outcome::Certified { cost } | Outcome::Simulated { cost } => Some(*cost),
            _ => None,
        };
        let found = ledger.outcomes(points, enough)?;
        if self.best.is_empty() {
            self.best.clone_from(&found);
            // argmin sorts the particles by their first scores, once.
            self.best.sort_by(|a, b| a.score().total_cmp(&b.score()));
        }
        for (best, outcome) in self.best.iter_mut().zip(&found).filter(|_| self.generation > 1) {
            *best = (*best).min(*outcome);
        }
        Ok(found.into_iter().map(Outcome::score).collect())
    }
}

pub(super) fn run(ledger: &Ledger<'_>, settings: &SearchSettings) -> Result<Termination, Error> {
    let dimension = ledger.space().dimension();
    let mut chance = ChaCha8Rng::seed_from_u64(settings.seed);
    chance.set_stream(streams::SWARM);
    let box_ = (vec![0.0; dimension], vec![1.0; dimension]);
    let solver = ParticleSwarm::new(box_, settings.particles).with_rng_generator(chance);
    let flight = Mutex::new(Flight::default());
    let problem = Problem(|points: &[&Vec<f64>]| {
        flight.lock().unwrap_or_else(PoisonError::into_inner).generation(ledger, points)
    });
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
        Err(error) => Err(error),
    }
}
