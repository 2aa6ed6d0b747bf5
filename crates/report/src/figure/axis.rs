//! An axis: its range, its scale, its ticks.

use crate::format;

/// The largest number on an axis.
const LARGEST: f64 = 1e290;

/// Decades of a logarithmic axis: below them lies nothing that a reader could use.
const MOST_DECADES: i32 = 12;

/// One axis of a plot.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// What is shown, with its unit.
    pub(crate) caption: String,
    scale: Scale,
    lower: f64,
    upper: f64,
    ticks: Vec<(f64, String)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scale {
    Linear,
    Log,
}

impl Axis {
    /// Equal distances, about `count` ticks; the range is widened until it has a size.
    pub(crate) fn linear(caption: impl Into<String>, (lower, upper): (f64, f64), count: usize) -> Self {
        // A range must have a finite size: what lies beyond is drawn on the edge.
        let [lower, upper] = [lower, upper].map(|end| end.clamp(-LARGEST, LARGEST));
        let size = upper - lower;
        let tiny = 1e-9_f64.max(1e-6 * lower.abs().max(upper.abs()));
        let missing = if size > tiny { 0.0 } else { tiny.max(0.5) };
        let (lower, upper) = (lower - missing, upper + missing);
        let step = nice_step((upper - lower) / count.max(1) as f64);
        let first = (lower / step - 1e-6).ceil() as i64;
        // A recording ends one sample early: its last round tick still counts.
        let last = (upper / step + 0.01 * (upper - lower) / step).floor() as i64;
        let ticks =
            (first..=last).map(|index| index as f64 * step).map(|value| (value, format::tick(value, step))).collect();
        Self { caption: caption.into(), scale: Scale::Linear, lower, upper, ticks }
    }

    /// [`Axis::linear`] with a margin on both sides, so that no curve runs along the frame.
    pub(crate) fn padded(caption: impl Into<String>, (lower, upper): (f64, f64), count: usize) -> Self {
        let margin = 0.06 * (upper - lower);
        Self::linear(caption, (lower - margin, upper + margin), count)
    }

    /// Equal ratios; both ends must be positive, otherwise the lower end is put six decades below the upper. More than
    /// [`MOST_DECADES`] are not shown.
    pub(crate) fn log(caption: impl Into<String>, (lower, upper): (f64, f64)) -> Self {
        let upper = if upper > 1.0 / LARGEST { upper.min(LARGEST) } else { 1.0 };
        let lower = if lower > 0.0 && lower < upper { lower } else { upper * 1e-6 };
        let lower = lower.max(upper * 10_f64.powi(-MOST_DECADES));
        let margin = (upper / lower).powf(0.05).max(1.1);
        Self::log_within(caption, (lower / margin, upper * margin))
    }

    /// [`Axis::log`] without a margin, for a map that fills its frame; `0 < lower < upper`.
    pub(crate) fn log_within(caption: impl Into<String>, (lower, upper): (f64, f64)) -> Self {
        let (first, last) = (lower.log10().floor() as i32, upper.log10().ceil() as i32);
        let stride = ((last - first) / 6 + 1) as usize;
        let plain = lower.log10().ceil() >= -3.0 && upper.log10().floor() <= 4.0;
        let fine: &[f64] = match (upper / lower).log10() {
            decades if decades < 1.2 => &[1.0, 2.0, 3.0, 5.0, 7.0],
            decades if decades < 2.2 => &[1.0, 3.0],
            _ => &[1.0],
        };
        let ticks = (first..=last)
            .step_by(stride)
            .flat_map(|exponent| {
                fine.iter().map(move |digit| {
                    let value = digit * 10_f64.powi(exponent);
                    let label = match (plain, *digit > 1.0) {
                        (true, _) => format::tick(value, 10_f64.powi(exponent)),
                        (false, false) => format::decade(exponent),
                        (false, true) => format::number(value),
                    };
                    (value, label)
                })
            })
            .filter(|(value, _)| (lower..=upper).contains(value))
            .collect();
        Self { caption: caption.into(), scale: Scale::Log, lower, upper, ticks }
    }

    /// Rows with names, the first at the top.
    pub(crate) fn rows(names: impl IntoIterator<Item = String>) -> Self {
        let ticks: Vec<_> = names.into_iter().enumerate().map(|(row, name)| (row_at(row), name)).collect();
        let lower = row_at(ticks.len().max(1)) + 0.5;
        Self { caption: String::new(), scale: Scale::Linear, lower, upper: 0.5, ticks }
    }

    /// [`Axis::rows`] that say themselves what they are.
    pub(crate) fn strips(count: usize) -> Self {
        let named = Self::rows((0..count).map(|_| String::new()));
        Self { ticks: Vec::new(), ..named }
    }

    /// The range.
    pub(crate) fn range(&self) -> (f64, f64) {
        (self.lower, self.upper)
    }

    /// Ticks: where, and what they say.
    pub(super) fn ticks(&self) -> &[(f64, String)] {
        &self.ticks
    }

    /// Position in the range, 0 to 1; what lies outside is put on the nearer end. `None` for a NaN.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        let fraction = match self.scale {
            Scale::Linear => (value - self.lower) / (self.upper - self.lower),
            Scale::Log if value > 0.0 => (value / self.lower).ln() / (self.upper / self.lower).ln(),
            Scale::Log if value <= 0.0 => 0.0,
            Scale::Log => f64::NAN,
        };
        (!fraction.is_nan()).then(|| fraction.clamp(0.0, 1.0))
    }
}

/// Where row `index` of [`Axis::rows`] lies.
pub(crate) fn row_at(index: usize) -> f64 {
    -(index as f64)
}

/// The smallest of 1, 2, 5 times a power of ten that is not much below `rough`.
fn nice_step(rough: f64) -> f64 {
    let least = 0.7 * rough;
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|step| *step >= 0.999 * least).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks().iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_inside_the_range() {
        assert_eq!(labels(&Axis::linear("", (0.0, 24.0), 5)), ["0", "5", "10", "15", "20"]);
        assert_eq!(labels(&Axis::linear("", (-0.31, 1.02), 4)), ["0", "0.5", "1.0"]);
        assert_eq!(labels(&Axis::log("", (0.002, 1.9))), ["0.01", "0.1", "1"]);
        assert_eq!(labels(&Axis::log("", (0.32, 1.4))), ["0.3", "0.5", "0.7", "1"]);
    }

    #[test]
    fn a_range_without_size_is_widened_and_nan_has_no_place() {
        let flat = Axis::linear("", (2.0, 2.0), 4);
        assert_eq!(flat.fraction(2.0), Some(0.5));
        assert_eq!(flat.fraction(1e9), Some(1.0));
        assert_eq!(flat.fraction(f64::NAN), None);
        let log = Axis::log("", (0.0, 0.0));
        assert_eq!(log.fraction(0.0), Some(0.0));
        assert_eq!(log.fraction(f64::NAN), None);
    }

    #[test]
    fn the_largest_numbers_have_an_axis() {
        let whole = Axis::padded("", (f64::MIN, f64::MAX), 5);
        assert!((2..9).contains(&whole.ticks().len()), "{:?}", whole.ticks());
        assert_eq!(Axis::linear("", (1e200, 1e200), 5).fraction(1e200), Some(0.5));
        assert_eq!([whole.fraction(f64::MAX), whole.fraction(0.0)], [Some(1.0), Some(0.5)]);
        let decades = Axis::log("", (f64::MIN_POSITIVE, f64::MAX));
        assert!((2..9).contains(&decades.ticks().len()), "{:?}", decades.ticks());
    }

    #[test]
    fn rows_run_from_top_to_bottom() {
        let rows = Axis::rows(["a".to_owned(), "b".to_owned()]);
        assert_eq!(rows.fraction(row_at(0)), Some(0.75));
        assert_eq!(rows.fraction(row_at(1)), Some(0.25));
    }
}
