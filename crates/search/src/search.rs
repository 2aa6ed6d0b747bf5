//! What all searches share: the trait, its endings and its errors.

use serde::{Deserialize, Serialize};

use crate::plain;

/// A minimiser over `[0, 1]^d` that asks for scores and is told them.
///
/// `ask` and `tell` alternate. Asking twice without telling gives the same
/// points again, so that a search written between the two loses nothing.
pub trait Search {
    /// The points whose scores the search needs next; none once it has ended.
    fn ask(&mut self) -> Vec<Vec<f64>>;

    /// Takes the scores of the points last asked, in their order.
    ///
    /// Lower is better; infinite scores and ties are welcome. A refused call
    /// changes nothing.
    fn tell(&mut self, scores: &[f64]) -> Result<(), TellError>;

    /// A value at which the evaluation of a point now asked may stop.
    ///
    /// `Some(t)` promises: told any number not below `t` in place of a score
    /// that is not below `t`, the search asks the same points ever after.
    /// `None` promises nothing: every score is wanted exactly.
    fn enough(&self) -> Option<f64>;

    /// Why the search has ended, or `None` while it has not.
    fn ended(&self) -> Option<Ending>;

    /// The best point told so far, the first of equals.
    fn best(&self) -> Option<&Best>;

    /// The number of scores told so far.
    fn evaluations(&self) -> u64;
}

/// A point and its score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Best {
    /// The point, in the unit box.
    pub point: Vec<f64>,
    /// Its score.
    #[serde(with = "plain::score")]
    pub score: f64,
}

impl Best {
    /// Keeps the better of what is `held` and the offer, the first of equals.
    pub(crate) fn keep(held: &mut Option<Best>, point: &[f64], score: f64) {
        if held.as_ref().is_none_or(|best| score < best.score) {
            *held = Some(Best { point: point.to_vec(), score });
        }
    }
}

/// Why a search has ended.
///
/// Those of CMA-ES bear the names of section B.3 of Hansen's tutorial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// The scores of late differ by no more than the tolerance.
    TolFun,
    /// The best scores of the late generations are all equal.
    EqualFunValues,
    /// The distribution is smaller than the tolerance in every coordinate.
    TolX,
    /// The distribution grew by a factor of 10⁴: it started far too small.
    TolXUp,
    /// The covariance matrix is numerically singular.
    ConditionCov,
    /// A tenth of a standard deviation along an axis leaves the mean as it is.
    NoEffectAxis,
    /// A fifth of a standard deviation along a coordinate leaves the mean.
    NoEffectCoord,
    /// Neither the best nor the median scores have got better for long.
    Stagnation,
    /// The iterations granted are used up.
    MaxIter,
    /// The restarts granted are used up.
    MaxRestarts,
    /// The simplex is as small and as flat as was asked.
    Converged,
}

/// Why a search cannot start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SetupError {
    /// The start has no coordinate.
    #[error("the start has no coordinate")]
    NoDimension,
    /// A coordinate of the start lies outside `[0, 1]` or is not a number.
    #[error("the start lies outside the unit box")]
    StartOutsideBox,
    /// The initial spread is not a positive number up to 1, the edge of the box.
    #[error("the initial spread is not in (0, 1]")]
    Sigma,
    /// A population needs at least two.
    #[error("a population needs at least two points")]
    Population,
}

/// Why a search refuses the scores it is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TellError {
    /// Not as many scores as points asked (none, if nothing was asked).
    #[error("{asked} points were asked, {told} scores were told")]
    Count {
        /// The number of points asked.
        asked: usize,
        /// The number of scores told.
        told: usize,
    },
    /// A score is not a number.
    #[error("a score is not a number")]
    NotANumber,
}

/// Whether a search may start at `start` with spread `sigma`.
pub(crate) fn check_start(start: &[f64], sigma: f64) -> Result<(), SetupError> {
    if start.is_empty() {
        Err(SetupError::NoDimension)
    } else if !start.iter().all(|x| (0.0..=1.0).contains(x)) {
        Err(SetupError::StartOutsideBox)
    } else {
        check_spread(sigma)
    }
}

/// Whether `sigma` is a spread within the unit box.
pub(crate) fn check_spread(sigma: f64) -> Result<(), SetupError> {
    if sigma > 0.0 && sigma <= 1.0 { Ok(()) } else { Err(SetupError::Sigma) }
}

/// Whether `scores` answer `asked` points.
pub(crate) fn check_scores(asked: usize, scores: &[f64]) -> Result<(), TellError> {
    if asked == 0 || scores.len() != asked {
        Err(TellError::Count { asked, told: scores.len() })
    } else if scores.iter().any(|score| score.is_nan()) {
        Err(TellError::NotANumber)
    } else {
        Ok(())
    }
}
