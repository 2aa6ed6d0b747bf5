//! Numbers from a range whose ends are drawn, and which shrink to a value of one's choice.
//!
//! ```text
//! within:      x = clamp(simplest + d),     d uniform on [low - simplest - w, high - simplest + w],  w = (high - low)/10
//! log_within:  x = clamp(simplest exp(d)),  the same in logarithms
//! ```
//!
//! Each end comes up once in twelve draws, and shrinking bisects `d` towards 0: `x` towards the simplest value, or the end nearest to
//! it. Drawing the ends by a second strategy instead would cut a failure found there off from its neighbours.
//!
//! `d` is a whole number of steps, 2^24 of them to the width, because proptest (1.12) bisects integers only: a range of
//! `f64` tries the simplest value and, if that passes, keeps what it found. A failure is therefore reported to 1e-7 of
//! the range.

use std::ops::RangeInclusive;

use proptest::prelude::*;

/// How far the draw reaches beyond each end, as a fraction of the width.
const BEYOND: f64 = 0.1;
/// Steps to the width of a range: the resolution of draws and of shrinking.
const STEPS: f64 = 16_777_216.0;

/// `d` of the [module](self) for a range given relative to its simplest value.
fn offset(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    // A range of one number still needs some width to draw from; every draw is clamped to that number.
    let width = if high > low { high - low } else { 1.0 };
    let step = width / STEPS;
    let [first, last] = [low - BEYOND * width, high + BEYOND * width].map(|end| end / step);
    // Out of the range of i64 only when the simplest value is 1e11 widths away; the cast saturates there and draws an end.
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    let steps = first.floor() as i64..=last.ceil() as i64;
    steps.prop_map(move |n| n as f64 * step)
}

/// A number of `range`, both ends included and often met; shrinks towards `simplest`.
///
/// ```
/// use certune_testkit::within;
/// use proptest::strategy::{Strategy, ValueTree};
/// use proptest::test_runner::TestRunner;
///
/// let mut tree = within(0.8..=1.2, 1.0).new_tree(&mut TestRunner::deterministic())?;
/// assert!((0.8..=1.2).contains(&tree.current()));
/// while tree.simplify() {}
/// assert!((tree.current() - 1.0).abs() < 1e-12);
/// # Ok::<(), proptest::test_runner::Reason>(())
/// ```
///
/// # Panics
/// Unless `low <= high` and both are finite, as `simplest` is.
pub fn within(range: RangeInclusive<f64>, simplest: f64) -> impl Strategy<Value = f64> + Clone {
    let (low, high) = range.into_inner();
    assert!(low <= high && (high - low).is_finite(), "no range of finite numbers: {low}..={high}");
    assert!(simplest.is_finite(), "no number to shrink to: {simplest}");
    offset(low - simplest, high - simplest).prop_map(move |d| (simplest + d).clamp(low, high))
}

/// A number of `range` with a uniform logarithm, both ends included and often met; shrinks towards `simplest`.
///
/// # Panics
/// Unless `0 < low <= high` and both are finite, as `simplest > 0` is.
pub fn log_within(range: RangeInclusive<f64>, simplest: f64) -> impl Strategy<Value = f64> + Clone {
    let (low, high) = range.into_inner();
    assert!(0.0 < low && low <= high && high.is_finite(), "no range of positive numbers: {low}..={high}");
    assert!(simplest > 0.0 && simplest.is_finite(), "no positive number to shrink to: {simplest}");
    let logarithms = offset((low / simplest).ln(), (high / simplest).ln());
    logarithms.prop_map(move |d| (simplest * d.exp()).clamp(low, high))
}
