//! Every arm a dot, with median and quartiles: one figure a figure of merit, one strip a controller.

use super::cast::Cast;
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, row_at, span};
use crate::format;
use crate::panels::HALF;
use crate::quantile::quantile;
use crate::record::{Quantity, SpreadPanel, SpreadRow};

/// Height of a strip and of what is around all of them, in nominal pixels.
const STRIP: f64 = 40.0;
const AROUND: f64 = 64.0;

/// Half the height over which the dots of a strip are spread, as a part of the strip.
const HALF_CLOUD: f64 = 0.2;

/// Where the middle of the dots lies below that of the strip, which has words above.
const BELOW: f64 = 0.14;

/// # Errors
/// [`ReportError::Draw`].
pub(super) fn draw(panel: &SpreadPanel, cast: Cast<'_>) -> Result<String, ReportError> {
    let axis = axis(panel);
    let (start, end) = axis.range();
    let (mut marks, mut summary, mut strip, mut category) = (vec![Mark::Ticks], Vec::new(), 0, "");
    for row in &panel.rows {
        if row.category != category {
            let text = row.category.clone();
            let at = (start, row_at(strip));
            marks.push(Mark::Label { ink: Ink::Text, text, at, shift: (-36.0, 8.0), anchor: Anchor::Start });
            strip += 1;
            category = &row.category;
        }
        let Some(player) = cast.player(&row.controller) else { continue };
        let words = in_words(row, &panel.quantity.unit);
        let height = row_at(strip);
        let label = |ink, text, x, shift, anchor| Mark::Label { ink, text, at: (x, height), shift, anchor };
        marks.extend(cloud(row, player.ink, height - BELOW, end));
        marks.push(label(player.ink, player.name.to_owned(), start, (-36.0, -12.0), Anchor::Start));
        marks.push(label(Ink::Text, words.clone(), end, (0.0, -12.0), Anchor::End));
        summary.push(format!("{}{}: {words}", player.name, in_category(category)));
        strip += 1;
    }
    Plot {
        title: format::sentence(&panel.quantity.name),
        description: format!("One dot an arm. {}.", summary.join("; ")),
        size: (HALF.0, AROUND + STRIP * f64::from(strip as u32)),
        x: axis,
        y: Axis::strips(strip),
        right: 14.0,
        marks,
    }
    .svg()
}

/// Dots, quartiles, median, and crosses on the edge for runs without a value.
fn cloud(row: &SpreadRow, ink: Ink, height: f64, end: f64) -> Vec<Mark> {
    // Steps of the golden ratio fill a strip evenly, and the same way each time.
    let offset = |index: usize| (((index as f64 + 1.0) * 0.618_034).fract() - 0.5) * 2.0 * HALF_CLOUD;
    let points = row.values.iter().enumerate().filter(|(_, value)| value.is_finite());
    let points: Vec<_> = points.map(|(index, value)| (*value, height + offset(index))).collect();
    let opacity = if points.len() > 60 { 0.45 } else { 0.75 };
    let mut marks = vec![Mark::Dots { ink, radius: 1.7, opacity, points }];
    let values = arms(row);
    if let (Some(from), Some(to)) = (quantile(&values, 0.25), quantile(&values, 0.75)) {
        marks.push(Mark::Bar { ink, opacity: 0.28, height: 2.0 * HALF_CLOUD * STRIP, from: (from, height), to_x: to });
    }
    if let Some(median) = quantile(&values, 0.5) {
        let points = vec![(median, height - 1.4 * HALF_CLOUD), (median, height + 1.4 * HALF_CLOUD)];
        marks.push(Mark::Line { ink: Ink::Text, width: 2.0, points });
    }
    if row.values.iter().any(|value| !value.is_finite()) {
        let (text, at) = ("×".to_owned(), (end, height));
        marks.push(Mark::Label { ink, text, at, shift: (7.0, 0.0), anchor: Anchor::Middle });
    }
    marks
}

fn axis(panel: &SpreadPanel) -> Axis {
    let Quantity { name, unit, log } = &panel.quantity;
    let caption = if unit.is_empty() { name.clone() } else { format!("{name} ({unit})") };
    let values = || panel.rows.iter().flat_map(|row| row.values.iter().copied());
    if *log {
        let range = span(values().filter(|value| *value > 0.0)).unwrap_or((0.1, 1.0));
        Axis::log(caption, range)
    } else {
        let (lower, upper) = span(values()).unwrap_or((0.0, 1.0));
        // Zero is shown where it is not far: lengths then compare.
        if lower >= 0.0 && lower < 0.5 * upper {
            Axis::linear(caption, (0.0, 1.05 * upper), 6)
        } else {
            Axis::padded(caption, (lower, upper), 6)
        }
    }
}

fn in_words(row: &SpreadRow, unit: &str) -> String {
    let values = arms(row);
    let lost = values.iter().filter(|value| value.is_none()).count();
    let median = quantile(&values, 0.5).map(|median| format!("median {}", format::with_unit(median, unit)));
    let lost = (lost > 0).then(|| format!("{lost} of {} not finished", values.len()));
    let parts: Vec<String> = median.into_iter().chain(lost).collect();
    if parts.is_empty() { "no arm".to_owned() } else { parts.join(", ") }
}

fn arms(row: &SpreadRow) -> Vec<Option<f64>> {
    row.values.iter().map(|value| value.is_finite().then_some(*value)).collect()
}

fn in_category(category: &str) -> String {
    if category.is_empty() { String::new() } else { format!(" at {category}") }
}
