//! The default: Nelder-Mead from the start, CMA-ES where a look at the whole space says, Nelder-Mead again around the best.
//!
//! ```text
//! simplex    from the start                until it converges, gains little for a while, or has spent a fifth of the budget (forty times the corners at least)
//! scatter    over the whole space          eight points a gain, at most a fifth of the budget
//! cma-es     from the best of the scatter  until it has come down, no deeper than the best known
//! ...        the two in turn               until eight tenths of the budget are spent
//! polish     around the best               until it converges; then the two in turn again
//! ```
//!
//! Published gains are good, so the simplex improves on them at once, but it stays in their basin; the scatter sees others; the last digits are the simplex's again.

use core::ops::RangeFrom;

use argmin::core::Error;
use certune_search::{Bipop, BipopOptions, Cma, Options, Scatter, Search};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::asked::{Left, run};
use super::ledger::Ledger;
use super::simplex::{SPREAD, simplex};
use super::{Phase, SearchSettings, Termination};
use crate::outcome::score_of_ratio;
use crate::streams;

/// Spread of the first population of CMA-ES and of its large restarts, a fraction of each range.
const SIGMA: f64 = 0.2;
/// Points of a scatter for each gain.
const SCATTERED: usize = 8;
/// A generation whose costs lie within this share of each other, and of the best known, has nothing more to find; the last digits are the polish's.
const FLAT: f64 = 0.01;
/// A simplex that gains less than this share in a while has had its turn.
const GAIN: f64 = 0.002;
/// A small budget is the simplex's as long as it gains: each of its corners may move this often before anybody looks elsewhere.
///
/// Neither a scatter nor CMA-ES comes down in the hundred evaluations that would be left to them; the simplex from the published gains is within 2 % of the best known after 200, on
/// one joint with eight masses (`cargo xtask peers tuners`).
const SHORTEST: usize = 40;
/// Edge of the polishing simplex, a fraction of each range.
const POLISH: f64 = 0.03;

/// Scores below each other by less than anybody can tell apart are a flat valley.
fn tolerances() -> Options {
    Options { tol_fun: score_of_ratio(SPREAD), tol_x: 1e-3, ..Options::default() }
}

/// The seed that belongs to the `count`-th use of a part of the search.
fn chance(settings: &SearchSettings, stream: u64, count: u32) -> u64 {
    let mut chance = ChaCha8Rng::seed_from_u64(settings.seed);
    chance.set_stream(stream);
    chance.set_word_pos(2 * u128::from(count));
    chance.next_u64()
}

/// CMA-ES alone, from `centre`, with large and small restarts.
pub(super) fn cma_alone(ledger: &Ledger<'_>, centre: &[f64], settings: &SearchSettings) -> Result<Termination, Error> {
    let options = BipopOptions { run: tolerances(), sigma: SIGMA, ..BipopOptions::default() };
    let mut search = Bipop::new(centre, SIGMA, chance(settings, streams::CMA_ES, 0), options)?;
    let phase = |search: &Bipop| Phase::CmaEs { restart: search.restarts() };
    Ok(run(ledger, &mut search, phase, || false)?.into())
}

/// Nelder-Mead alone, from `centre`.
pub(super) fn simplex_alone(
    ledger: &Ledger<'_>,
    centre: &[f64],
    settings: &SearchSettings,
) -> Result<Termination, Error> {
    Ok(run(ledger, &mut simplex(centre, settings.simplex_step)?, |_| Phase::Simplex, || false)?.into())
}

/// The whole schedule; without a `start` it begins with the scatter.
pub(super) fn schedule(
    ledger: &Ledger<'_>,
    start: Option<&[f64]>,
    settings: &SearchSettings,
) -> Result<Termination, Error> {
    let (budget, dimension) = (settings.evaluations, ledger.space().dimension());
    if let Some(start) = start {
        let mut turn = Turn::new(ledger, (budget / 5).max(SHORTEST * (dimension + 1)), 4 * (dimension + 1));
        if run(ledger, &mut simplex(start, settings.simplex_step)?, |_| Phase::Simplex, || turn.is_over(ledger))?
            == Left::BudgetSpent
        {
            return Ok(Termination::BudgetSpent);
        }
    }
    let mut rounds = 0..;
    let polish_from = budget - budget / 5;
    let mut left = explore(ledger, settings, &mut rounds, || ledger.len() >= polish_from)?;
    if left != Left::BudgetSpent
        && let Some(best) = ledger.best()
    {
        let best = ledger.space().encode(&best);
        left = run(ledger, &mut simplex(&best, POLISH)?, |_| Phase::Polish, || false)?;
    }
    if left != Left::BudgetSpent {
        left = explore(ledger, settings, &mut rounds, || false)?;
    }
    Ok(left.into())
}

/// Rounds of a scatter and a run of CMA-ES from its best, until `turn_over`. A run that has come down into a basin no deeper than the best known is left for the next round.
fn explore(
    ledger: &Ledger<'_>,
    settings: &SearchSettings,
    rounds: &mut RangeFrom<u32>,
    turn_over: impl Fn() -> bool,
) -> Result<Left, Error> {
    let dimension = ledger.space().dimension();
    for restart in rounds {
        let before = ledger.len();
        let points = (SCATTERED * dimension).min(settings.evaluations / 5);
        let mut scatter = Scatter::new(dimension, points, chance(settings, streams::SCATTER, restart))?;
        let left = run(ledger, &mut scatter, |_| Phase::Scatter, &turn_over)?;
        if left != Left::Ended {
            return Ok(left);
        }
        let centre = scatter.best().map_or_else(|| vec![0.5; dimension], |best| best.point.clone());
        let mut search = Cma::new(&centre, SIGMA, chance(settings, streams::CMA_ES, restart), tolerances())?;
        let flat = || turn_over() || ledger.is_flat(FLAT);
        let left = run(ledger, &mut search, |_| Phase::CmaEs { restart }, flat)?;
        if left == Left::BudgetSpent || turn_over() {
            return Ok(left);
        }
        if ledger.len() == before {
            break; // every point of the space is known
        }
    }
    Ok(Left::Ended)
}

/// How long a simplex that may stop helping goes on.
struct Turn {
    /// The ledger's length at which it is over in any case.
    end: usize,
    /// Evaluations without a gain of [`GAIN`] after which it is over.
    patience: usize,
    /// Where the last such gain was made, and the cost there.
    last: Option<(usize, f64)>,
}

impl Turn {
    fn new(ledger: &Ledger<'_>, evaluations: usize, patience: usize) -> Self {
        Self { end: ledger.len() + evaluations, patience, last: None }
    }

    fn is_over(&mut self, ledger: &Ledger<'_>) -> bool {
        let now = ledger.len();
        if let Some(cost) = ledger.best_cost()
            && self.last.is_none_or(|(_, before)| cost < before - GAIN * before.abs())
        {
            self.last = Some((now, cost));
        }
        now >= self.end || self.last.is_some_and(|(at, _)| now - at > self.patience)
    }
}
