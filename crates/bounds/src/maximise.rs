//! Search for the largest value of any score over a box: low-discrepancy samples, then pattern search from the best.
//!
//! `max f(x)`, `x_j` in `[lower_j, upper_j]` or on a circle. Nothing is asked of `f` but that it can be evaluated: it may have
//! kinks, as a spectral abscissa has. The result is a point that anyone can evaluate again; that nothing larger was
//! found proves nothing. Source: Hooke and Jeeves, *"Direct search" solution of numerical and statistical problems* (1961).
//! Limits: a lower estimate of the maximum; the effort grows with the number of axes.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::error::BoundsError;
use crate::sequence::Kronecker;

/// First step of the pattern search, as a fraction of an axis.
const FIRST_STEP: f64 = 0.1;
/// Samples between two looks at [`SearchOptions::enough`]: fixed, so that the answer does not depend on the threads.
const SAMPLES_PER_LOOK: usize = 128;
/// Climbs between two looks.
const CLIMBS_PER_LOOK: usize = 4;

/// One coordinate of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axis {
    /// A closed interval; `lower == upper` pins the coordinate.
    Interval {
        /// Lower end, in the unit of the coordinate.
        lower: f64,
        /// Upper end, in the unit of the coordinate.
        upper: f64,
    },
    /// A full turn in rad that closes on itself, reported in `[start, start + 2π)`.
    Circle {
        /// Where the turn starts, rad.
        start: f64,
    },
}

impl Axis {
    /// The coordinate at a fraction of the axis.
    fn at(self, fraction: f64) -> f64 {
        match self {
            Self::Interval { lower, upper } => (lower + fraction * (upper - lower)).clamp(lower, upper),
            Self::Circle { start } => start + TAU * fraction,
        }
    }

    /// A fraction brought back onto the axis.
    fn onto(self, fraction: f64) -> f64 {
        match self {
            Self::Interval { .. } => fraction.clamp(0.0, 1.0),
            Self::Circle { .. } => fraction.rem_euclid(1.0),
        }
    }

    fn is_pinned(self) -> bool {
        match self {
            Self::Interval { lower, upper } => lower >= upper,
            Self::Circle { .. } => false,
        }
    }

    /// Its ends if it is no axis at all.
    fn fault(self) -> Option<[f64; 2]> {
        match self {
            Self::Interval { lower, upper } => {
                let ordered = lower <= upper && (upper - lower).is_finite();
                (!ordered).then_some([lower, upper])
            }
            Self::Circle { start } => (!start.is_finite()).then_some([start, start + TAU]),
        }
    }
}

/// How hard [`maximise`] searches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchOptions {
    /// Points sampled first; at least 1 is taken.
    pub samples: usize,
    /// Pattern searches, from the best samples.
    pub local_starts: usize,
    /// Evaluations that each pattern search may spend.
    pub evaluations_per_start: usize,
    /// Step, as a fraction of an axis, below which a pattern search ends.
    pub resolution: f64,
    /// A value with which the caller is content: the search ends soon after. Infinity searches to the end.
    pub enough: f64,
}

impl Default for SearchOptions {
    /// 2,000 samples, 16 starts of at most 2,000 evaluations, resolution 1e-5 of an axis, to the end.
    fn default() -> Self {
        Self { samples: 2_000, local_starts: 16, evaluations_per_start: 2_000, resolution: 1e-5, enough: f64::INFINITY }
    }
}

/// The best point of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Maximum {
    /// The point, one coordinate per axis.
    pub at: Vec<f64>,
    /// The score there; minus infinity if no score was a number.
    pub value: f64,
    /// Evaluations spent.
    pub evaluations: usize,
}

/// A point in fractions of the axes.
#[derive(Clone)]
struct Scored {
    fractions: Vec<f64>,
    value: f64,
}

/// The largest `score` found over the product of `axes`.
///
/// Deterministic and independent of the number of threads, provided `score` is a function of its argument alone. A score
/// that is NaN counts as minus infinity. Runs on the current rayon pool.
///
/// # Errors
/// [`BoundsError::Axis`] names the first axis that is reversed or not finite.
///
/// ```
/// use certune_bounds::{Axis, SearchOptions, maximise};
/// let axes = [Axis::Circle { start: -3.2 }, Axis::Interval { lower: 0.0, upper: 2.0 }];
/// let top = maximise(&axes, &SearchOptions::default(), |x| x[0].sin() * x[1])?;
/// assert!((top.value - 2.0).abs() < 1e-6);
/// # Ok::<(), certune_bounds::BoundsError>(())
/// ```
pub fn maximise(
    axes: &[Axis],
    options: &SearchOptions,
    score: impl Fn(&[f64]) -> f64 + Sync,
) -> Result<Maximum, BoundsError> {
    if let Some((axis, [lower, upper])) =
        axes.iter().enumerate().find_map(|(i, axis)| axis.fault().map(|ends| (i, ends)))
    {
        return Err(BoundsError::Axis { axis, lower, upper });
    }
    let evaluate = |fractions: &[f64]| -> f64 {
        let value = score(&coordinates(axes, fractions));
        if value.is_nan() { f64::NEG_INFINITY } else { value }
    };

    let sequence = Kronecker::new(axes.len());
    let total = options.samples.max(1);
    let mut samples: Vec<Scored> = Vec::with_capacity(total);
    while samples.len() < total {
        let first = samples.len();
        let look: Vec<Scored> = (first..total.min(first + SAMPLES_PER_LOOK))
            .into_par_iter()
            .map(|index| {
                let fractions: Vec<f64> = sequence.point(index).collect();
                Scored { value: evaluate(&fractions), fractions }
            })
            .collect();
        let content = look.iter().any(|sample| sample.value >= options.enough);
        samples.extend(look);
        if content {
            break;
        }
    }
    let mut evaluations = samples.len();
    // Stable: the earlier of equals stays first.
    samples.sort_by(|a, b| b.value.total_cmp(&a.value));
    let mut best = samples[0].clone();

    let starts = &samples[..options.local_starts.min(samples.len())];
    for look in starts.chunks(CLIMBS_PER_LOOK) {
        if best.value >= options.enough {
            break;
        }
        let climbed: Vec<(Scored, usize)> =
            look.par_iter().map(|start| pattern_search(axes, options, start.clone(), &evaluate)).collect();
        for (top, spent) in climbed {
            evaluations += spent;
            if top.value > best.value {
                best = top;
            }
        }
    }
    Ok(Maximum { at: coordinates(axes, &best.fractions), value: best.value, evaluations })
}

fn coordinates(axes: &[Axis], fractions: &[f64]) -> Vec<f64> {
    axes.iter().zip(fractions).map(|(axis, fraction)| axis.at(*fraction)).collect()
}

/// Hooke and Jeeves: a round of single-axis trials; after a good round the whole displacement again, else half the step.
fn pattern_search(
    axes: &[Axis],
    options: &SearchOptions,
    start: Scored,
    evaluate: &impl Fn(&[f64]) -> f64,
) -> (Scored, usize) {
    let mut spent = 0;
    let mut try_point = |fractions: Vec<f64>| {
        spent += 1;
        Scored { value: evaluate(&fractions), fractions }
    };
    let mut best = start;
    let mut step = FIRST_STEP;
    let mut budget = options.evaluations_per_start;
    while step >= options.resolution && best.value < options.enough {
        let base = best.clone();
        for (axis, kind) in axes.iter().enumerate() {
            for signed in [step, -step] {
                let mut fractions = best.fractions.clone();
                fractions[axis] = kind.onto(fractions[axis] + signed);
                // A pinned coordinate, or one that already leans on its end, has nowhere to go.
                if kind.is_pinned() || (fractions[axis] - best.fractions[axis]).abs() < f64::MIN_POSITIVE {
                    continue;
                }
                if budget == 0 {
                    return (best, spent);
                }
                budget -= 1;
                let trial = try_point(fractions);
                if trial.value > best.value {
                    best = trial;
                    break;
                }
            }
        }
        if best.value <= base.value {
            step *= 0.5;
            continue;
        }
        if budget == 0 {
            break;
        }
        budget -= 1;
        let ahead =
            axes.iter().enumerate().map(|(j, axis)| axis.onto(leap(*axis, base.fractions[j], best.fractions[j])));
        let trial = try_point(ahead.collect());
        if trial.value > best.value {
            best = trial;
        }
    }
    (best, spent)
}

/// `to` moved on by the displacement that led there, the short way round on a circle.
fn leap(axis: Axis, from: f64, to: f64) -> f64 {
    let moved = to - from;
    match axis {
        Axis::Interval { .. } => to + moved,
        Axis::Circle { .. } => to + moved - moved.round(),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{Axis, SearchOptions, maximise};

    const BOX: [Axis; 4] = [
        Axis::Circle { start: -PI },
        Axis::Circle { start: 0.0 },
        Axis::Interval { lower: -1.0, upper: 4.0 },
        Axis::Interval { lower: 2.0, upper: 2.0 },
    ];

    /// Largest, 7, at x0 = π (where the circle closes), x1 = 1, x2 = 4 (an end).
    fn hill(x: &[f64]) -> f64 {
        -x[0].cos() + (x[1] - 1.0).cos() + 0.75 * x[2] + x[3] - (x[2] - 4.0).abs().min(1.0) * 0.1 * x[1].sin().abs()
    }

    #[test]
    fn finds_a_maximum_on_a_seam_and_at_an_end() {
        let top = maximise(&BOX, &SearchOptions::default(), hill).unwrap();
        assert!((top.value - 7.0).abs() < 1e-6, "{top:?}");
        assert!((top.value - hill(&top.at)).abs() < f64::EPSILON, "the value belongs to the point");
        assert!((top.at[0].abs() - PI).abs() < 1e-3 && (top.at[2] - 4.0).abs() < 1e-9);
        assert!((top.at[3] - 2.0).abs() < f64::EPSILON);
    }

    #[test]
    fn the_same_bits_for_any_number_of_threads() {
        let run = |threads: usize, enough: f64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| maximise(&BOX, &SearchOptions { enough, ..SearchOptions::default() }, hill)).unwrap()
        };
        for enough in [f64::INFINITY, 6.9, 0.0] {
            assert_eq!(run(1, enough), run(3, enough));
        }
    }

    #[test]
    fn ends_early_once_content() {
        let all = maximise(&BOX, &SearchOptions::default(), hill).unwrap();
        let soon = maximise(&BOX, &SearchOptions { enough: 5.0, ..SearchOptions::default() }, hill).unwrap();
        assert!(soon.value >= 5.0 && soon.evaluations < all.evaluations / 4);
    }

    #[test]
    fn a_score_that_is_not_a_number_never_wins() {
        let top = maximise(&BOX, &SearchOptions::default(), |x| if x[2] > 1.0 { f64::NAN } else { x[2] }).unwrap();
        assert!(top.value <= 1.0 && top.value > 0.999);
        let none = maximise(&BOX, &SearchOptions::default(), |_| f64::NAN).unwrap();
        assert!(none.value.is_infinite() && none.value < 0.0);
    }

    #[test]
    fn the_budget_of_evaluations_is_kept() {
        let options =
            SearchOptions { samples: 100, local_starts: 3, evaluations_per_start: 17, ..SearchOptions::default() };
        assert!(maximise(&BOX, &options, hill).unwrap().evaluations <= 100 + 3 * 17);
    }

    #[test]
    fn a_reversed_axis_is_named() {
        let axes = [BOX[0], Axis::Interval { lower: 1.0, upper: f64::NAN }];
        let error = maximise(&axes, &SearchOptions::default(), |_| 0.0).unwrap_err();
        assert!(error.to_string().starts_with("search axis 1 is 1 to NaN"), "{error}");
    }
}
