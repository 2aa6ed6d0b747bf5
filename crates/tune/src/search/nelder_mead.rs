//! Nelder-Mead with restarts. Source: Nelder, Mead, *A simplex method for function minimization* (1965), as in argmin.

use argmin::core::{Executor, IterState};
use argmin::solver::neldermead::NelderMead;

use super::ledger::{Ledger, Problem, is_budget_spent};
use super::{Phase, SearchError, SearchSettings, Termination};
use crate::gains::Gains;
use crate::outcome::score_of_ratio;
use crate::space::Method;

/// A simplex whose costs differ by less than this fraction is started again: nobody could tell such gains apart.
pub const SPREAD: f64 = 1e-4;

/// A solver that meets only known candidates stops after this many iterations for each evaluation of the budget.
const ITERATIONS_PER_EVALUATION: u64 = 100;

/// The corners of a simplex around `centre`: one more for each coordinate, a step away in the direction `sign` if the space has room there.
fn corners(centre: &[f64], step: f64, sign: f64) -> Vec<Vec<f64>> {
    let moved = |coordinate: usize| {
        let mut corner = centre.to_vec();
        let forward = corner[coordinate] + sign * step;
        corner[coordinate] = if (0.0..=1.0).contains(&forward) { forward } else { corner[coordinate] - sign * step };
        corner
    };
    core::iter::once(centre.to_vec()).chain((0..centre.len()).map(moved)).collect()
}

pub(super) fn run(
    ledger: &Ledger<'_>,
    start: Option<&Gains>,
    settings: &SearchSettings,
) -> Result<Termination, SearchError> {
    let space = ledger.space();
    let failed = || SearchError::Solver { method: Method::NelderMead, evaluations: ledger.len() };
    let mut centre = start.map_or_else(|| vec![0.5; space.dimension()], |gains| space.encode(gains));
    let iterations = ITERATIONS_PER_EVALUATION * (settings.evaluations as u64 + 1);
    for restart in 0.. {
        ledger.enter(Phase::Simplex { restart });
        let before = ledger.len();
        let sign = if restart % 2 == 0 { 1.0 } else { -1.0 };
        let corners = corners(&centre, settings.simplex_step, sign);
        // argmin unwraps the costs of the corners, so they are evaluated here, where the end of the budget is a value;
        // argmin then meets known candidates.
        if ledger.scores(&corners.iter().collect::<Vec<_>>()).is_err() {
            return Ok(Termination::BudgetSpent);
        }
        let solver = NelderMead::new(corners).with_sd_tolerance(score_of_ratio(SPREAD)).map_err(|_| failed())?;
        let problem = Problem(|points: &[&Vec<f64>]| ledger.scores(points));
        let ended = Executor::new(problem, solver)
            .configure(|state: IterState<Vec<f64>, (), (), (), (), f64>| state.max_iters(iterations))
            .timer(false)
            .run();
        match ended {
            Ok(_) if ledger.left() == 0 => return Ok(Termination::BudgetSpent),
            Ok(_) if ledger.len() == before => return Ok(Termination::Converged),
            Ok(_) => {}
            Err(error) if is_budget_spent(&error) => return Ok(Termination::BudgetSpent),
            Err(_) => return Err(failed()),
        }
        centre = ledger.best().map_or(centre, |gains| space.encode(&gains));
    }
    Ok(Termination::Converged)
}

#[cfg(test)]
mod tests {
    use super::corners;

    #[test]
    fn a_simplex_steps_away_from_the_wall() {
        assert_eq!(corners(&[0.5, 0.95], 0.1, 1.0), vec![vec![0.5, 0.95], vec![0.6, 0.95], vec![0.5, 0.95 - 0.1]]);
        assert_eq!(corners(&[0.0], 0.5, -1.0), vec![vec![0.0], vec![0.5]]);
    }
}
