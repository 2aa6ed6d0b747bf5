//! The held-out plants: error bands over time, and cost plant by plant.

use super::response::word;
use super::{CURVE_POINTS, HALF, curve};
use crate::error::ReportError;
use crate::figure::{Axis, Ink, Mark, Plot, band_opacity, finite_runs, span, thin};
use crate::format;
use crate::record::{HeldOut, TuningReport};

/// Quantile bands of the position error.
pub(super) fn bands(held_out: &HeldOut) -> Result<Option<String>, ReportError> {
    let both = [(Ink::Published, &held_out.bands.published), (Ink::Tuned, &held_out.bands.tuned)];
    let positive = both
        .iter()
        .flat_map(|(_, band)| [&band.error_p05_rad, &band.error_p95_rad])
        .flat_map(|series| series.iter().copied())
        .filter(|value| *value > 0.0);
    let Some((lowest, highest)) = span(positive) else { return Ok(None) };
    let mut marks = Vec::new();
    for (ink, band) in both {
        let stride = band.time_s.len().div_ceil(CURVE_POINTS).max(1);
        let points = (0..band.time_s.len())
            .step_by(stride)
            .map(|k| (band.time_s[k], band.error_p05_rad[k], band.error_p95_rad[k]))
            .collect();
        marks.push(Mark::Band { ink, opacity: band_opacity(2), points });
    }
    for (ink, band) in both {
        let points = thin(&curve(&band.time_s, &band.error_p50_rad), CURVE_POINTS);
        if let Some((_, y)) = finite_runs(&points).last().and_then(<[_]>::last) {
            marks.push(Mark::EndLabel { ink, text: word(ink).to_owned(), y: *y });
        }
        marks.push(Mark::Line { ink, width: 1.8, points });
    }
    let times = both.iter().flat_map(|(_, band)| band.time_s.iter().copied());
    Plot {
        title: "Position error over time on the held-out plants".to_owned(),
        description: "Median and the band from 5 to 95 % of the plants; published and tuned gains; logarithmic axis."
            .to_owned(),
        size: HALF,
        x: Axis::linear("time (s)", span(times).unwrap_or((0.0, 1.0)), 6),
        y: Axis::log("position error, all joints (rad)", (lowest.max(1e-6 * highest), highest)),
        right: 66.0,
        marks,
    }
    .svg()
    .map(Some)
}

/// Cost of each plant, sorted by the published gains' cost: two dots and the line between them.
pub(super) fn plants(record: &TuningReport) -> Result<Option<String>, ReportError> {
    let finite = |cost: Option<f64>| cost.filter(|value| value.is_finite());
    let mut rows: Vec<(Option<f64>, Option<f64>)> =
        record.held_out.plants.iter().map(|plant| (finite(plant.cost.published), finite(plant.cost.tuned))).collect();
    let Some((lowest, highest)) = span(rows.iter().flat_map(|(a, b)| [*a, *b]).flatten()) else { return Ok(None) };
    let key = |row: &(Option<f64>, Option<f64>)| row.0.unwrap_or(f64::INFINITY);
    rows.sort_by(|a, b| key(a).total_cmp(&key(b)));

    let (mut lines, mut published, mut tuned, mut lost) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, row) in rows.iter().enumerate() {
        let x = (index + 1) as f64;
        if let (Some(a), Some(b)) = row {
            lines.push(Mark::Line { ink: Ink::Axis, width: 0.5, points: vec![(x, *a), (x, *b)] });
        }
        match row.0 {
            Some(cost) => published.push((x, cost)),
            None => lost.push((Ink::Published, x)),
        }
        match row.1 {
            Some(cost) => tuned.push((x, cost)),
            None => lost.push((Ink::Tuned, x)),
        }
    }
    let unit = &record.asked.cost.unit;
    let caption =
        if unit.is_empty() { "cost of a plant (no unit)".to_owned() } else { format!("cost of a plant ({unit})") };
    let y = if lowest > 0.0 && highest > 20.0 * lowest {
        Axis::log(caption, (lowest, highest))
    } else {
        Axis::linear(caption, (0.0_f64.min(lowest), 1.08 * highest), 5)
    };
    let mut marks = lines;
    for (ink, points) in [(Ink::Published, published), (Ink::Tuned, tuned)] {
        if let Some((_, y)) = points.last() {
            marks.push(Mark::EndLabel { ink, text: word(ink).to_owned(), y: *y });
        }
        marks.push(Mark::Dots { ink, radius: 2.8, opacity: 1.0, points });
    }
    for (ink, x) in lost {
        let text = "×".to_owned();
        marks.push(Mark::Label {
            ink,
            text,
            at: (x, y.range().1),
            shift: (0.0, 4.0),
            anchor: crate::figure::Anchor::Middle,
        });
    }
    Plot {
        title: "Cost of each held-out plant".to_owned(),
        description: format!(
            "Published and tuned gains on {} plants; lowest {}, highest {}.",
            rows.len(),
            format::with_unit(lowest, unit),
            format::with_unit(highest, unit)
        ),
        size: HALF,
        x: Axis::linear("plants, easiest for the published gains first", (0.0, rows.len() as f64 + 1.0), 6),
        y,
        right: 66.0,
        marks,
    }
    .svg()
    .map(Some)
}
