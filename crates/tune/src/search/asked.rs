//! A search that asks and is told, as a solver of argmin: one generation an iteration, evaluated in bulk.

use argmin::core::{Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};
use certune_search::Search;

use super::ledger::{BudgetSpent, Ledger};
use super::{Phase, Termination};
use crate::outcome::Outcome;

/// Why a search was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    /// It has ended.
    Ended,
    /// It has had its turn.
    TurnOver,
    /// Every evaluation is used.
    BudgetSpent,
}

impl From<Left> for Termination {
    fn from(left: Left) -> Self {
        match left {
            Left::BudgetSpent => Self::BudgetSpent,
            Left::Ended | Left::TurnOver => Self::Converged,
        }
    }
}

/// Runs `search` until it ends, `turn_over` says so after a generation, or the budget is spent. `phase` names what the search is at.
pub(super) fn run<S: Search>(
    ledger: &Ledger<'_>,
    search: &mut S,
    phase: impl Fn(&S) -> Phase,
    turn_over: impl FnMut() -> bool,
) -> Result<Left, Error> {
    let solver = Asked { ledger, search, phase, turn_over, left: None };
    match Executor::new((), solver).configure(|state: State| state.max_iters(u64::MAX)).timer(false).run() {
        Ok(result) => Ok(result.solver.left.unwrap_or(Left::Ended)),
        Err(error) if error.downcast_ref::<BudgetSpent>().is_some() => Ok(Left::BudgetSpent),
        Err(error) => Err(error),
    }
}

type State = IterState<Vec<f64>, (), (), (), (), f64>;

/// The solver. Its problem is empty: what a point is worth depends on what would be enough, which argmin's problems cannot be told.
struct Asked<'a, 'b, S, P, T> {
    ledger: &'a Ledger<'b>,
    search: &'a mut S,
    phase: P,
    turn_over: T,
    left: Option<Left>,
}

impl<S: Search, P: Fn(&S) -> Phase, T: FnMut() -> bool> Solver<(), State> for Asked<'_, '_, S, P, T> {
    fn name(&self) -> &'static str {
        "asked and told"
    }

    fn next_iter(&mut self, _: &mut Problem<()>, state: State) -> Result<(State, Option<KV>), Error> {
        let points = self.search.ask();
        let enough = self.search.enough().and_then(Outcome::cost_at_score);
        if !points.is_empty() {
            self.ledger.enter((self.phase)(self.search));
            let points: Vec<&Vec<f64>> = points.iter().collect();
            let outcomes = self.ledger.outcomes(&points, |_| enough)?;
            let scores: Vec<f64> = outcomes.into_iter().map(Outcome::score).collect();
            self.search.tell(&scores)?;
        }
        self.left = match self.search.ended() {
            Some(_) => Some(Left::Ended),
            None => (self.turn_over)().then_some(Left::TurnOver),
        };
        let state = match self.search.best() {
            Some(best) => state.param(best.point.clone()).cost(best.score),
            None => state,
        };
        Ok((state, None))
    }

    fn terminate(&mut self, _: &State) -> TerminationStatus {
        match self.left {
            None => TerminationStatus::NotTerminated,
            Some(_) => TerminationStatus::Terminated(TerminationReason::SolverConverged),
        }
    }
}
