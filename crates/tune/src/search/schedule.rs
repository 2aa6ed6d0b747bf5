//! The default: Nelder-Mead from the start, CMA-ES where a look at the whole space says, Nelder-Mead again around the best.
//!
//! ```text
//! simplex    from the start                until it converges, gains nothing for a while, or has spent a fifth of the budget
//! scatter    over the whole space          eight points a gain, at most a fifth of the budget
//! cma-es     from the best of the scatter  until eight tenths of the budget are spent
//! polish     around the best               until it converges
//! cma-es     goes on, restarted            until the budget is spent
//! ```
//!
//! Published gains are good, so the simplex improves on them at once, but it stays in their basin; the scatter sees others; the last digits are the simplex's again.

use argmin::core::Error;
use certune_search::{Bipop, BipopOptions, Options, Scatter, Search};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::asked::{Left, run};
use super::ledger::Ledger;
use super::simplex::{SPREAD, simplex};
use super::{Phase, SearchSettings, Termination};
use crate::outcome::score_of_ratio;
use crate::streams;

/// Spread of the first population of CMA-ES and of its large restarts, a fraction of each range.
const SIGMA: f64 = 0.25;
/// Edge of the polishing simplex, a fraction of each range.
const POLISH: f64 = 0.03;

/// CMA-ES with restarts, from `centre`.
fn cma_es(centre: &[f64], settings: &SearchSettings) -> Result<Bipop, Error> {
    // Scores below each other by less than nobody can tell apart are a flat valley: the run begins anew elsewhere.
    let run = Options { tol_fun: score_of_ratio(SPREAD), tol_x: 1e-3, ..Options::default() };
    let seed = chance(settings, streams::CMA_ES);
    Ok(Bipop::new(centre, SIGMA, seed, BipopOptions { run, sigma: SIGMA, ..BipopOptions::default() })?)
}

/// The seed that belongs to a part of the search.
fn chance(settings: &SearchSettings, stream: u64) -> u64 {
    let mut chance = ChaCha8Rng::seed_from_u64(settings.seed);
    chance.set_stream(stream);
    chance.next_u64()
}

fn restart_of(search: &Bipop) -> Phase {
    Phase::CmaEs { restart: search.restarts() }
}

/// CMA-ES alone, from `centre`.
pub(super) fn cma_alone(ledger: &Ledger<'_>, centre: &[f64], settings: &SearchSettings) -> Result<Termination, Error> {
    Ok(match run(ledger, &mut cma_es(centre, settings)?, restart_of, || false)? {
        Left::BudgetSpent => Termination::BudgetSpent,
        Left::Ended | Left::TurnOver => Termination::Converged,
    })
}

/// Nelder-Mead alone, from `centre`.
pub(super) fn simplex_alone(
    ledger: &Ledger<'_>,
    centre: &[f64],
    settings: &SearchSettings,
) -> Result<Termination, Error> {
    Ok(match run(ledger, &mut simplex(centre, settings.simplex_step)?, |_| Phase::Simplex, || false)? {
        Left::BudgetSpent => Termination::BudgetSpent,
        Left::Ended | Left::TurnOver => Termination::Converged,
    })
}

/// The whole schedule; without a `start` it begins with the scatter.
pub(super) fn schedule(
    ledger: &Ledger<'_>,
    start: Option<&[f64]>,
    settings: &SearchSettings,
) -> Result<Termination, Error> {
    let (budget, dimension) = (settings.evaluations, ledger.space().dimension());
    if let Some(start) = start {
        let turn = Turn::new(ledger, budget / 5, 6 * (dimension + 1));
        if run(ledger, &mut simplex(start, settings.simplex_step)?, |_| Phase::Simplex, || turn.is_over(ledger))?
            == Left::BudgetSpent
        {
            return Ok(Termination::BudgetSpent);
        }
    }
    let mut scatter = Scatter::new(dimension, (8 * dimension).min(budget / 5), chance(settings, streams::SCATTER))?;
    if run(ledger, &mut scatter, |_| Phase::Scatter, || false)? == Left::BudgetSpent {
        return Ok(Termination::BudgetSpent);
    }
    let centre = scatter.best().map_or_else(|| vec![0.5; dimension], |best| best.point.clone());
    let mut search = cma_es(&centre, settings)?;
    let polish_from = budget - budget / 5;
    let mut left = run(ledger, &mut search, restart_of, || ledger.len() >= polish_from)?;
    if left != Left::BudgetSpent
        && let Some(best) = ledger.best()
    {
        let best = ledger.space().encode(&best);
        left = run(ledger, &mut simplex(&best, POLISH)?, |_| Phase::Polish, || false)?;
    }
    if left != Left::BudgetSpent {
        left = run(ledger, &mut search, restart_of, || false)?;
    }
    Ok(if left == Left::BudgetSpent { Termination::BudgetSpent } else { Termination::Converged })
}

/// How long a search that may stop helping goes on.
struct Turn {
    /// The ledger's length at which it is over in any case.
    end: usize,
    /// Evaluations without a new best after which it is over.
    patience: usize,
}

impl Turn {
    fn new(ledger: &Ledger<'_>, evaluations: usize, patience: usize) -> Self {
        Self { end: ledger.len() + evaluations, patience }
    }

    fn is_over(&self, ledger: &Ledger<'_>) -> bool {
        ledger.len() >= self.end || ledger.len() - ledger.best_index() > self.patience
    }
}
