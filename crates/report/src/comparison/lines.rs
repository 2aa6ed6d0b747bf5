//! One quantity over another: curves with their names at their ends, bands, and budgets.

use super::cast::Cast;
use super::figures::Drawn;
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, band_opacity, finite_runs, span, thin};
use crate::format;
use crate::panels::{CURVE_POINTS, TwoWidths, curve};
use crate::record::{LineSeries, Lines, Quantity};

/// A curve of at most this many points shows each as a dot.
const DOTTED: usize = 40;

/// # Errors
/// [`ReportError::Draw`].
pub(super) fn draw(title: &str, lines: &Lines, cast: Cast<'_>) -> Result<Drawn<'static>, ReportError> {
    Ok(Drawn { wide: Some(TwoWidths::new(|size| plot(title, lines, cast, size))?), ..Drawn::default() })
}

fn plot(title: &str, lines: &Lines, cast: Cast<'_>, size: (f64, f64)) -> Plot {
    let xs = lines.series.iter().flat_map(|series| series.x.iter().copied());
    let ys = lines.series.iter().flat_map(|series| [&series.y, &series.lower, &series.upper]).flatten().copied();
    let limits = lines.limits.iter().map(|limit| limit.value);
    let x = axis(&lines.x, xs, (size.0 / 70.0) as usize, false);
    let y = axis(&lines.y, ys.chain(limits), 5, true);
    let mut marks = Vec::new();
    for limit in &lines.limits {
        marks.push(Mark::Horizontal { ink: Ink::Goal, y: limit.value });
        let at = (x.range().0, limit.value);
        let text = limit.name.clone();
        marks.push(Mark::Label { ink: Ink::Axis, text, at, shift: (4.0, -8.0), anchor: Anchor::Start });
    }
    let named: Vec<_> =
        lines.series.iter().filter_map(|series| Some((cast.player(&series.controller)?, series))).collect();
    for (player, series) in &named {
        let ends = series.lower.iter().zip(&series.upper);
        let points = series.x.iter().zip(ends).map(|(x, (lower, upper))| (*x, *lower, *upper)).collect();
        marks.push(Mark::Band { ink: player.ink, opacity: band_opacity(named.len()), points });
    }
    let (mut longest, mut summary) = (0, Vec::new());
    for (player, series) in &named {
        let text = if series.name.is_empty() { player.name.to_owned() } else { series.name.clone() };
        summary.extend(ends(&text, series, lines));
        longest = longest.max(text.chars().count());
        let points = thin(&curve(&series.x, &series.y), 2 * CURVE_POINTS);
        if let Some((_, y)) = finite_runs(&points).last().and_then(<[_]>::last) {
            marks.push(Mark::EndLabel { ink: player.ink, text, y: *y });
        }
        if points.len() <= DOTTED {
            marks.push(Mark::Dots { ink: player.ink, radius: 2.6, opacity: 1.0, points: points.clone() });
        }
        marks.push(Mark::Line { ink: player.ink, width: 1.8, points });
    }
    Plot {
        title: title.to_owned(),
        description: format!("{}.", summary.join("; ")),
        size,
        x,
        y,
        right: 12.0 + 6.6 * longest as f64,
        marks,
    }
}

fn axis(quantity: &Quantity, values: impl Iterator<Item = f64>, count: usize, padded: bool) -> Axis {
    let Quantity { name, unit, log } = quantity;
    let caption = if unit.is_empty() { name.clone() } else { format!("{name} ({unit})") };
    if *log {
        Axis::log(caption, span(values.filter(|value| *value > 0.0)).unwrap_or((0.1, 1.0)))
    } else {
        let range = span(values).unwrap_or((0.0, 1.0));
        if padded { Axis::padded(caption, range, count) } else { Axis::linear(caption, range, count) }
    }
}

/// Where a curve begins and ends, in words.
fn ends(name: &str, series: &LineSeries, lines: &Lines) -> Option<String> {
    let points = curve(&series.x, &series.y);
    let mut finite = points.iter().filter(|(_, y)| y.is_finite());
    let (first, last) = (finite.clone().next()?, finite.next_back()?);
    let at = |(x, y): &(f64, f64)| {
        format!("{} at {}", format::with_unit(*y, &lines.y.unit), format::with_unit(*x, &lines.x.unit))
    };
    Some(format!("{name} from {} to {}", at(first), at(last)))
}
