//! Nelder-Mead, once: from the start, or as the polish of what another search has found.

use certune_search::{Coefficients, NelderMead, NelderMeadOptions, SetupError};

use crate::outcome::score_of_ratio;

/// A simplex whose costs differ by less than this fraction has converged: nobody could tell such gains apart.
pub const SPREAD: f64 = 1e-4;

/// A simplex that is wider than this has not, however flat it is; a fraction of each gain's range.
const WIDTH: f64 = 1e-2;

/// A simplex of edge `step` at `centre`, set up anew as often as that finds something better.
///
/// Its moves are the classic ones. Those of Gao and Han are milder, for the sake of many dimensions, and slower in the five of a controller: on twelve draws of the plants of
/// `cargo xtask peers tuners`, 200 evaluations from the published gains left 5.2 % more than the best known with theirs and 3.5 % with these, medians.
pub(super) fn simplex(centre: &[f64], step: f64) -> Result<NelderMead, SetupError> {
    let options = NelderMeadOptions {
        coefficients: Some(Coefficients::classic()),
        tol_fun: score_of_ratio(SPREAD),
        tol_x: WIDTH,
        restarts: u32::MAX,
    };
    NelderMead::new(centre, step, options)
}
