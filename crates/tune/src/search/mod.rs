//! Derivative-free search with an exact budget of evaluations, driven by argmin.
//!
//! | method | what it does |
//! |--------|--------------|
//! | [`Method::Schedule`] | Nelder-Mead from the start, CMA-ES with restarts where a look at the whole space says, Nelder-Mead around the best |
//! | [`Method::CmaEs`] | CMA-ES with restarts from the start, or from the middle of the space |
//! | [`Method::NelderMead`] | Nelder-Mead from the start, or from the middle, set up anew as often as that finds something better |
//! | [`Method::ParticleSwarm`] | particle swarm from random points. A start is evaluated first, so that the record can compare, but the swarm does not see it |
//!
//! **Budget.** At most `evaluations` calls reach the objective; argmin counts iterations, so the count is kept in the ledger, and the call after the last ends the run.
//! A candidate met a second time (the same gains after rounding) costs nothing.
//!
//! **Stopping early.** A search says above which cost it treats all candidates alike, and the objective stops there. For Nelder-Mead that is the worst corner or the
//! reflected point, for a swarm each particle's own best; CMA-ES learns from the bad ones too. The candidates and the winner are the same without.
//!
//! **Reproducibility.** A generation is evaluated in parallel and recorded in the order in which it was asked for. All chance comes from ChaCha8 seeded with `seed`. The
//! record therefore does not depend on the number of threads if the objective does not.
//!
//! Limits: none of these has a proof of convergence; the record says how a search ended, not that it found the best gains.

mod asked;
mod ledger;
mod schedule;
mod simplex;
mod swarm;

use certune_closed_loop::Gains;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use simplex::SPREAD;

use crate::outcome::{Finite, Outcome};
use crate::space::{Method, Space, SpaceError};
use crate::worst::WorsePlant;
use ledger::Ledger;
pub(crate) use ledger::bits;

/// What turns gains into an outcome. Total: an objective that fails says so by a rank of [`Outcome`].
pub trait Objective: Sync {
    /// The outcome of `gains`: a pure function of them and of `enough`.
    ///
    /// Whatever costs more than `enough`, or fails in simulation, may be answered with [`Outcome::Stopped`], as soon as that is sure.
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome;

    /// The outcomes of a generation in its order; none when nobody answers any more, which ends the search. By default all at once, on the current rayon pool.
    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        // Indexed, so that the outcomes come back in the order of the candidates whatever thread made them.
        Some(candidates.par_iter().map(|candidate| self.evaluate(&candidate.gains, candidate.enough)).collect())
    }

    /// The same under conditions that are worse for `gains`, as bad as a search finds them; none when it finds none that are worse, or the conditions are not the objective's to
    /// choose. `round` numbers the searches.
    fn hardened(&self, _gains: &Gains, _round: u32) -> Option<Hardened<'_>> {
        None
    }
}

/// An objective that is harder on gains which did well so far.
pub struct Hardened<'a> {
    /// The objective.
    pub objective: Box<dyn Objective + 'a>,
    /// What made it harder.
    pub plant: WorsePlant,
}

/// What a search wants to know.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The gains.
    pub gains: Gains,
    /// What costs more need not be known better than that.
    pub enough: Option<Finite>,
}

/// An objective that never stops early.
impl<F: Fn(&Gains) -> Outcome + Sync> Objective for F {
    fn evaluate(&self, gains: &Gains, _: Option<Finite>) -> Outcome {
        self(gains)
    }
}

/// Who is told about the progress of a search; `()` is nobody.
pub trait Progress: Sync {
    /// `evaluation` has been recorded, the `done`-th of at most `evaluations`; `best` is the best so far.
    fn evaluated(&self, done: usize, evaluations: usize, evaluation: &Evaluation, best: &Evaluation);
}

impl Progress for () {
    fn evaluated(&self, _: usize, _: usize, _: &Evaluation, _: &Evaluation) {}
}

/// Which part of a search asked for an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Phase {
    /// The gains that the search was given.
    Start,
    /// Nelder-Mead from the start.
    Simplex,
    /// Points over the whole space.
    Scatter,
    /// CMA-ES.
    CmaEs {
        /// 0 for the first run, then the number of the restart.
        restart: u32,
    },
    /// The best of the round before, on one plant more.
    Retest,
    /// Nelder-Mead around the best of a search before it.
    Polish,
    /// Particle swarm.
    Swarm {
        /// 0 for the random start.
        generation: usize,
    },
}

/// One candidate and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// Its place in the order of the search, from 0.
    pub index: usize,
    /// On how many plants more than the first time: candidates of different rounds are not comparable.
    pub round: u32,
    /// Which part of the search asked.
    pub phase: Phase,
    /// The candidate.
    pub gains: Gains,
    /// What became of it.
    pub outcome: Outcome,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Termination {
    /// Every evaluation was used.
    BudgetSpent,
    /// The solver met only candidates that it knew, although evaluations were left.
    Converged,
    /// Nobody answered any more.
    Interrupted,
}

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchSettings {
    /// The solver.
    pub method: Method,
    /// How many candidates may be evaluated, at least 1.
    pub evaluations: usize,
    /// The seed of CMA-ES and the swarm; Nelder-Mead draws nothing.
    pub seed: u64,
    /// Particles of the swarm, at least 2. Default 10.
    pub particles: usize,
    /// Size of the first simplex along each coordinate, a fraction of the range in `(0, 0.5]`. Default 0.1: a start that is good should be left in small steps.
    pub simplex_step: f64,
    /// Whether a candidate is given up once its place no longer matters. Default true; the winner is the same either way.
    pub stop_early: bool,
}

impl SearchSettings {
    /// Settings with the default swarm and simplex.
    pub const fn new(method: Method, evaluations: usize, seed: u64) -> Self {
        Self { method, evaluations, seed, particles: 10, simplex_step: 0.1, stop_early: true }
    }
}

/// Why a search could not run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// No evaluation is allowed.
    #[error("a search needs a budget of at least 1 evaluation, got 0")]
    NoBudget,
    /// A swarm needs somebody to follow.
    #[error("a swarm needs at least 2 particles, got {particles}")]
    Particles {
        /// The number given.
        particles: usize,
    },
    /// A simplex without extent, or wider than the space.
    #[error("the first simplex spans {simplex_step} of the range, expected more than 0 and at most 0.5")]
    SimplexStep {
        /// The fraction given.
        simplex_step: f64,
    },
    /// The start does not lie in the space.
    #[error(transparent)]
    Start(#[from] SpaceError),
    /// The solver refused its parameters or lost its state, neither of which a search of this crate can cause.
    #[error("the {method:?} solver failed after {evaluations} evaluations")]
    Solver {
        /// The solver.
        method: Method,
        /// How many candidates had been evaluated.
        evaluations: usize,
    },
}

/// A finished search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchRun {
    /// Every evaluation in order; at least one.
    pub evaluations: Vec<Evaluation>,
    /// Why it ended.
    pub termination: Termination,
}

impl SearchRun {
    /// The evaluations from the best to the worst; of equals the earlier first.
    pub fn ranked(&self) -> Vec<&Evaluation> {
        let mut ranked: Vec<_> = self.evaluations.iter().collect();
        ranked.sort_by_key(|evaluation| (evaluation.outcome, evaluation.index));
        ranked
    }
}

/// Searches `space` for the gains with the best outcome.
///
/// `start` is written as the space writes it first ([`Space::admit`]) and is evaluation 0 if given. Costs at most `settings.evaluations` calls
/// of the objective; runs on the current rayon pool.
///
/// # Errors
/// [`SearchError`] for settings out of range or a start outside the space.
pub fn search(
    space: &Space,
    start: Option<&Gains>,
    settings: &SearchSettings,
    objective: &dyn Objective,
    progress: &dyn Progress,
) -> Result<SearchRun, SearchError> {
    if settings.evaluations == 0 {
        return Err(SearchError::NoBudget);
    }
    if settings.particles < 2 {
        return Err(SearchError::Particles { particles: settings.particles });
    }
    if !(settings.simplex_step > 0.0 && settings.simplex_step <= 0.5) {
        return Err(SearchError::SimplexStep { simplex_step: settings.simplex_step });
    }
    let start = start.map(|gains| space.admit(gains)).transpose()?;
    let ledger = Ledger::new(space, objective, progress, settings);
    let termination = match start.as_ref().map_or(Ok(()), |gains| ledger.evaluate_start(gains)) {
        Err(ledger::BudgetSpent) => Termination::BudgetSpent,
        Ok(()) => {
            let start = start.as_ref().map(|gains| space.encode(gains));
            let centre = start.clone().unwrap_or_else(|| vec![0.5; space.dimension()]);
            let ended = match settings.method {
                Method::Schedule => schedule::schedule(&ledger, start.as_deref(), settings),
                Method::CmaEs => schedule::cma_alone(&ledger, &centre, settings),
                Method::NelderMead => schedule::simplex_alone(&ledger, &centre, settings),
                Method::ParticleSwarm => swarm::run(&ledger, settings),
            };
            let failed = |_| SearchError::Solver { method: settings.method, evaluations: ledger.len() };
            ended.map_err(failed)?
        }
    };
    let termination = if ledger.is_interrupted() { Termination::Interrupted } else { termination };
    Ok(SearchRun { evaluations: ledger.into_evaluations(), termination })
}
