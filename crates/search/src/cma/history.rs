//! The scores of late, and the endings that depend on them.
//!
//! All comparisons are of rank, but for that of `TolFun` which is of
//! differences (and by its nature depends on the scale of the objective).

use serde::{Deserialize, Serialize};

use crate::{plain, search::Ending};

/// No more generations than this are looked at for stagnation.
const LONGEST: usize = 20_000;

/// The best and the median score of each generation of late.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct History {
    #[serde(with = "plain::scores")]
    best: Vec<f64>,
    #[serde(with = "plain::scores")]
    median: Vec<f64>,
}

impl History {
    /// Notes a generation, the `generation`-th, whose scores are `sorted`.
    pub(crate) fn note(&mut self, generation: u64, shortest: usize, sorted: &[f64]) {
        let Some((&best, &median)) = sorted.first().zip(sorted.get(sorted.len() / 2)) else {
            return;
        };
        let fifth = usize::try_from(generation / 5).unwrap_or(LONGEST);
        let window = fifth.min(LONGEST).max(shortest);
        for (list, score) in [(&mut self.best, best), (&mut self.median, median)] {
            list.push(score);
            list.drain(..list.len().saturating_sub(window));
        }
    }

    /// TolFun and EqualFunValues of the tutorial, section B.3.
    ///
    /// The best scores of the last `window` generations are all equal, or they
    /// and all scores of the latest generation, `sorted`, differ by no more
    /// than `tol_fun`.
    pub(crate) fn flat(&self, window: usize, sorted: &[f64], tol_fun: f64) -> Option<Ending> {
        let late = self.best.get(self.best.len().checked_sub(window)?..)?;
        let (low, high) = range(late)?;
        let (lowest, highest) = range(sorted)?;
        if low.total_cmp(&high).is_eq() {
            Some(Ending::EqualFunValues)
        } else if high.max(highest) - low.min(lowest) <= tol_fun {
            Some(Ending::TolFun)
        } else {
            None
        }
    }

    /// Stagnation of the tutorial, section B.3.
    ///
    /// Over the last fifth of all generations, but at least the `shortest`
    /// number of them, the median of the latest 30 % is no better than that of
    /// the earliest 30 %, both for the best and for the median scores.
    pub(crate) fn stagnates(&self, shortest: usize) -> bool {
        self.best.len() >= shortest && !improves(&self.best) && !improves(&self.median)
    }

    /// Whether the two lists are of one length.
    pub(crate) fn sound(&self) -> bool {
        self.best.len() == self.median.len()
    }
}

/// The least and the greatest score.
fn range(scores: &[f64]) -> Option<(f64, f64)> {
    let low = scores.iter().copied().min_by(f64::total_cmp)?;
    let high = scores.iter().copied().max_by(f64::total_cmp)?;
    Some((low, high))
}

/// Whether the latest 30 % have a lower median than the earliest 30 %.
fn improves(scores: &[f64]) -> bool {
    let part = (scores.len() * 3).div_ceil(10);
    let early = scores.get(..part).and_then(median);
    let late = scores.get(scores.len() - part..).and_then(median);
    early.zip(late).is_none_or(|(early, late)| late < early)
}

/// The upper median, which is one of the scores: a mean of two would not be
/// invariant to monotone transformations.
fn median(scores: &[f64]) -> Option<f64> {
    let mut scores = scores.to_vec();
    let middle = scores.len() / 2;
    (!scores.is_empty()).then(|| *scores.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(scores: impl IntoIterator<Item = f64>, shortest: usize) -> History {
        let mut history = History::default();
        for (score, generation) in scores.into_iter().zip(0..) {
            history.note(generation, shortest, &[score, score + 1.0]);
        }
        history
    }

    #[test]
    fn what_falls_does_not_stagnate_and_what_does_not_fall_does() {
        assert!(!history((0..200).map(|g| -f64::from(g)), 150).stagnates(150));
        assert!(history((0..200).map(|g| f64::from(g % 7)), 150).stagnates(150));
        assert!(!history((0..100).map(|g| f64::from(g % 7)), 150).stagnates(150));
        assert!(history((0..200).map(|_| f64::INFINITY), 150).stagnates(150));
    }

    #[test]
    fn flatness_is_of_the_late_generations_alone() {
        let falling_then = |floor: f64| history((0..40).map(|g| (30.0 - f64::from(g)).max(floor)), 99);
        assert_eq!(falling_then(20.0).flat(10, &[20.0, 20.0], 0.0), Some(Ending::EqualFunValues));
        assert_eq!(falling_then(-10.0).flat(10, &[-9.0, -8.0], 8.5), None);
        assert_eq!(falling_then(-10.0).flat(10, &[-9.0, -8.0], 9.0), Some(Ending::TolFun));
        assert_eq!(falling_then(20.0).flat(60, &[20.0, 20.0], 0.0), None);
    }

    #[test]
    fn infinite_scores_are_equal_to_one_another_and_far_from_all_others() {
        let infinite = history((0..20).map(|_| f64::INFINITY), 99);
        assert_eq!(infinite.flat(10, &[f64::INFINITY], 1.0), Some(Ending::EqualFunValues));
        let mixed = history((0..20).map(|g| f64::from(g % 2) * 1e-15), 99);
        assert_eq!(mixed.flat(10, &[0.0, f64::INFINITY], 1.0), None);
    }
}
