//! Curves over time: goal, limits, moments, and one curve with an optional band for each that is compared.

use super::{CURVE_POINTS, curve};
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, Reading, Readings, band_opacity, corners, finite_runs, span, thin};

/// Room above and below the outermost limit, as a part of it.
const BEYOND_LIMIT: f64 = 0.15;

/// Points of each side of a band.
const BAND_POINTS: usize = 200;

/// Moments of a panel that are named.
const NAMED_MOMENTS: usize = 4;

/// What one figure over time is made of.
pub(crate) struct OverTime<'a> {
    /// Names the figure for a screen reader.
    pub(crate) title: String,
    /// What is to be seen, for one who does not.
    pub(crate) description: String,
    /// What stands above the vertical axis, with its unit.
    pub(crate) caption: String,
    /// The unit alone.
    pub(crate) unit: &'a str,
    /// Times and values of the goal.
    pub(crate) goal: Option<(&'a [f64], &'a [f64])>,
    /// Horizontal lines with their names.
    pub(crate) limits: Vec<(&'a str, f64)>,
    /// Times with their names.
    pub(crate) moments: Vec<(&'a str, f64)>,
    /// The curves, in the order of the legend.
    pub(crate) curves: Vec<Curve<'a>>,
    /// Least height of the vertical axis: a resting joint is not shown as drama.
    pub(crate) least: f64,
    /// How far beyond the goals a curve is followed; what leaves this window is drawn on its edge.
    pub(crate) reach: f64,
}

/// One curve over time.
pub(crate) struct Curve<'a> {
    pub(crate) name: &'a str,
    pub(crate) ink: Ink,
    pub(crate) time_s: &'a [f64],
    pub(crate) value: &'a [f64],
    /// Its lower and upper ends.
    pub(crate) band: Option<(&'a [f64], &'a [f64])>,
}

impl Curve<'_> {
    fn values(&self) -> impl Iterator<Item = f64> {
        let (lower, upper) = self.band.unwrap_or_default();
        self.value.iter().chain(lower).chain(upper).copied()
    }
}

impl OverTime<'_> {
    /// The figure; `labelled` curves carry their names at their ends.
    pub(crate) fn plot(&self, size: (f64, f64), labelled: bool) -> Plot {
        let y = Axis::padded(self.caption.clone(), self.window(), if labelled { 5 } else { 4 });
        let longest = self.curves.iter().map(|curve| curve.name.chars().count()).max().unwrap_or(0);
        Plot {
            title: self.title.clone(),
            description: self.description.clone(),
            size,
            x: Axis::linear("time (s)", self.times(), (size.0 / 48.0) as usize),
            right: if labelled { 12.0 + 6.6 * longest as f64 } else { 12.0 },
            marks: self.marks(&y, labelled, if labelled { 2 * CURVE_POINTS } else { CURVE_POINTS }),
            y,
        }
    }

    /// The figure as a small multiple, with what can be read off it.
    ///
    /// # Errors
    /// As [`Plot::svg_with`].
    pub(crate) fn svg(&self, size: (f64, f64)) -> Result<String, ReportError> {
        let plot = self.plot(size, false);
        self.readings().map_or_else(|| plot.svg(), |readings| plot.svg_with(&readings))
    }

    /// What can be read off it, unless the curves have times of their own.
    pub(crate) fn readings(&self) -> Option<Readings> {
        let longest = self.curves.iter().map(|curve| curve.time_s).max_by_key(|times| times.len())?;
        let same = |times: &[f64]| times.iter().zip(longest).all(|(a, b)| (a - b).abs() <= f64::EPSILON);
        let goal = self.goal.filter(|(_, values)| !values.is_empty());
        let times = self.curves.iter().map(|curve| curve.time_s).chain(goal.map(|(times, _)| times));
        if !times.clone().all(same) {
            return None;
        }
        // A run that was stopped has no values afterwards.
        let whole = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(longest.len(), f64::NAN);
            values
        };
        let goal = goal.map(|(_, values)| Reading {
            name: "goal".to_owned(),
            ink: Ink::Goal,
            value: whole(values),
            band: None,
        });
        let curves = self.curves.iter().map(|curve| Reading {
            name: curve.name.to_owned(),
            ink: curve.ink,
            value: whole(curve.value),
            band: curve.band.map(|(lower, upper)| (whole(lower), whole(upper))),
        });
        Some(Readings {
            time_s: longest.to_vec(),
            unit: self.unit.to_owned(),
            series: goal.into_iter().chain(curves).collect(),
        })
    }

    fn times(&self) -> (f64, f64) {
        span(self.curves.iter().flat_map(|curve| curve.time_s.iter().copied())).unwrap_or((0.0, 1.0))
    }

    /// Range of the vertical axis: a run that diverges must not flatten all else.
    fn window(&self) -> (f64, f64) {
        let goals = self.goal.map_or(&[][..], |(_, values)| values).iter().copied();
        let mut range = span(goals.clone().chain(self.curves.iter().flat_map(Curve::values))).unwrap_or((0.0, 1.0));
        if let Some((lower, upper)) = span(goals) {
            let reach = (upper - lower).max(self.reach);
            range = (range.0.max(lower - reach), range.1.min(upper + reach));
        }
        range = least(range, self.least);
        if let Some((lower, upper)) = span(self.limits.iter().map(|(_, limit)| *limit)) {
            if upper > 0.0 {
                range.1 = range.1.min(upper * (1.0 + BEYOND_LIMIT)).max(range.0);
            }
            if lower < 0.0 {
                range.0 = range.0.max(lower * (1.0 + BEYOND_LIMIT)).min(range.1);
            }
        }
        range
    }

    fn marks(&self, y: &Axis, labelled: bool, count: usize) -> Vec<Mark> {
        let ((first, last), (lowest, highest)) = (self.times(), y.range());
        let (mut marks, mut words) = (Vec::new(), Vec::new());
        for (name, value) in self.limits.iter().filter(|(_, value)| (lowest..=highest).contains(value)) {
            marks.push(Mark::Horizontal { ink: Ink::Goal, y: *value });
            words.push(above((*name).to_owned(), (first, *value), (3.0, if *value < 0.0 { 8.0 } else { -7.0 })));
        }
        for (name, time_s) in self.moments.iter().filter(|(_, time_s)| (first..=last).contains(time_s)) {
            marks.push(Mark::Vertical { ink: Ink::Goal, x: *time_s });
            if self.moments.len() <= NAMED_MOMENTS {
                words.push(above((*name).to_owned(), (*time_s, highest), (4.0, 6.0)));
            }
        }
        let opacity = band_opacity(self.curves.iter().filter(|curve| curve.band.is_some()).count());
        marks.extend(self.curves.iter().filter_map(|curve| {
            let (lower, upper) = curve.band?;
            let stride = curve.time_s.len().div_ceil(BAND_POINTS).max(1);
            let ends = lower.iter().copied().zip(upper.iter().copied());
            let points = curve.time_s.iter().copied().zip(ends).map(|(time, (lower, upper))| (time, lower, upper));
            Some(Mark::Band { ink: curve.ink, opacity, points: points.step_by(stride).collect() })
        }));
        if let Some((times, values)) = self.goal {
            marks.push(Mark::Line { ink: Ink::Goal, width: 1.3, points: corners(&curve(times, values)) });
        }
        // The restless ones first, so that they do not hide the smooth ones.
        let mut by_unrest: Vec<&Curve> = self.curves.iter().collect();
        by_unrest.sort_by(|a, b| unrest(b.value).total_cmp(&unrest(a.value)));
        for one in by_unrest {
            let points = thin(&curve(one.time_s, one.value), count);
            if let Some((_, y)) = finite_runs(&points).last().and_then(<[_]>::last).filter(|_| labelled) {
                marks.push(Mark::EndLabel { ink: one.ink, text: one.name.to_owned(), y: *y });
            }
            marks.push(Mark::Line { ink: one.ink, width: 1.6, points });
        }
        marks.extend(words);
        marks
    }
}

fn above(text: String, at: (f64, f64), shift: (f64, f64)) -> Mark {
    Mark::Label { ink: Ink::Axis, text, at, shift, anchor: Anchor::Start }
}

/// The way that a curve goes up and down in all.
fn unrest(values: &[f64]) -> f64 {
    values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| step.is_finite()).sum()
}

/// The range, widened about its middle to at least `size`.
fn least((lower, upper): (f64, f64), size: f64) -> (f64, f64) {
    let missing = (size - (upper - lower)).max(0.0);
    (lower - 0.5 * missing, upper + 0.5 * missing)
}
