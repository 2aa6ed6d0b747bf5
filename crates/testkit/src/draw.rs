//! Numbers from a range whose ends are drawn, and which shrink to a value of one's choice.
//!
//! ```text
//! within:      x = clamp(simplest + d),       d uniform on [low - simplest - w, high - simplest + w],   w = (high - low)/10
//! log_within:  x = clamp(simplest exp(d)),    the same in logarithms
//! ```
//!
//! Each end comes up once in twelve draws, and proptest's bisection of `d` towards 0 is a bisection of `x` towards the simplest value (or the
//! end nearest to it). Drawing the ends by a second strategy instead would cut a failure found there off from its neighbours.

use std::ops::RangeInclusive;

use proptest::prelude::*;

/// How far the draw reaches beyond each end, as a fraction of the width.
const BEYOND: f64 = 0.1;

/// `d` of the [module](self) for a range given relative to its simplest value.
fn offset(low: f64, high: f64) -> RangeInclusive<f64> {
    let width = high - low;
    // A range of one number still needs some width to draw from; every draw is clamped to that number.
    let beyond = if width > 0.0 { BEYOND * width } else { 1.0 };
    low - beyond..=high + beyond
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
    let range = offset((low / simplest).ln(), (high / simplest).ln());
    range.prop_map(move |d| (simplest * d.exp()).clamp(low, high))
}
