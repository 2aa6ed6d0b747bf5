//! The share of each gain in the cost around the tuned gains, and maps of stability.

use super::HALF;
use crate::error::ReportError;
use crate::figure::{Axis, Ink, Mark, Plot, on_grid, row_at};
use crate::format;
use crate::record::{Learnt, Slice, SliceAxis};

/// Height of a row.
const ROW: f64 = 26.0;

/// Pairs of gains that are shown: the strongest, and none of less than a hundredth.
const MOST_PAIRS: usize = 2;
const LEAST_SHARE: f64 = 0.01;

/// Candidates that are drawn in a map.
const MOST_DOTS: usize = 400;

/// A bar for each gain alone, then for the strongest pairs.
pub(super) fn shares(learnt: &Learnt) -> Result<Option<String>, ReportError> {
    let Some(surface) = &learnt.surface else { return Ok(None) };
    let alone = surface.gains.iter().map(|gain| (gain.gain.clone(), gain.share));
    let pairs = surface.pairs.iter().filter(|pair| pair.share >= LEAST_SHARE).take(MOST_PAIRS);
    let rows: Vec<(String, f64)> = alone
        .chain(pairs.map(|pair| (pair.gains.join(" with "), pair.share)))
        .filter(|(_, share)| share.is_finite())
        .collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let largest = rows.iter().fold(0.01_f64, |largest, (_, share)| largest.max(*share));
    let mut marks = Vec::new();
    for (index, (_, share)) in rows.iter().enumerate() {
        let from = (0.0, row_at(index));
        marks.push(Mark::Bar { ink: Ink::Tuned, opacity: 1.0, height: 11.0, from, to_x: 100.0 * share });
        marks.push(Mark::EndLabel {
            ink: Ink::Text,
            text: format!("{} %", format::number(100.0 * share)),
            y: row_at(index),
        });
    }
    Plot {
        title: "Share of each gain in the cost".to_owned(),
        description:
            "One bar for each gain alone and for the strongest two pairs, in percent of the surface's variance."
                .to_owned(),
        size: (HALF.0, 68.0 + ROW * rows.len() as f64),
        x: Axis::linear("share of the variance (%)", (0.0, 100.0 * largest), 4),
        y: Axis::rows(rows.into_iter().map(|(name, _)| name)),
        right: 58.0,
        marks,
    }
    .svg()
    .map(Some)
}

/// One map for each two gains.
pub(super) fn maps(learnt: &Learnt) -> Result<Vec<String>, ReportError> {
    learnt.slices.iter().map(map).collect()
}

fn map(slice: &Slice) -> Result<String, ReportError> {
    let caption = |axis: &SliceAxis| {
        if axis.unit.is_empty() { axis.gain.clone() } else { format!("{} ({})", axis.gain, axis.unit) }
    };
    let axis = |axis: &SliceAxis| Axis::log_within(caption(axis), (axis.lower, axis.upper));
    let (x, y) = (axis(&slice.x), axis(&slice.y));
    let mut marks = blocks(slice, &slice.stable, Ink::Goal, 0.2);
    marks.extend(blocks(slice, &slice.certified, Ink::Certified, 0.4));
    let log = |(lower, upper): (f64, f64)| (lower.ln(), upper.ln());
    let candidates: Vec<(f64, f64)> = slice.candidates.iter().map(|[x, y]| (x.ln(), y.ln())).collect();
    let points = on_grid(&candidates, log(x.range()), log(y.range()), (160, 100), MOST_DOTS);
    let points = points.into_iter().map(|(x, y)| (x.exp(), y.exp())).collect();
    marks.push(Mark::Dots { ink: Ink::Candidate, radius: 1.4, opacity: 0.8, points });
    for (ink, [x, y]) in [(Ink::Published, slice.gains.published), (Ink::Tuned, slice.gains.tuned)] {
        marks.push(Mark::Dots { ink, radius: 4.5, opacity: 1.0, points: vec![(x, y)] });
    }
    let count = |cells: &[Vec<bool>]| {
        let all = cells.iter().map(Vec::len).sum::<usize>().max(1);
        let set = cells.iter().flatten().filter(|cell| **cell).count();
        format::number(100.0 * set as f64 / all as f64)
    };
    let certified = if slice.certified.is_empty() {
        String::new()
    } else {
        format!(", certified on {} %", count(&slice.certified))
    };
    Plot {
        title: format!("Stability over {} and {}", slice.x.gain, slice.y.gain),
        description: format!(
            "Logarithmic axes; the other gains are the tuned ones. Sampled loops decay on {} % of the map{certified}.",
            count(&slice.stable)
        ),
        size: HALF,
        x,
        y,
        right: 14.0,
        marks,
    }
    .svg()
}

/// The cells that are set: neighbours in a row are drawn as one block.
fn blocks(slice: &Slice, cells: &[Vec<bool>], ink: Ink, opacity: f64) -> Vec<Mark> {
    let edge = |axis: &SliceAxis, index: usize, count: usize| {
        axis.lower * (axis.upper / axis.lower).powf(index as f64 / count as f64)
    };
    let mut marks = Vec::new();
    for (row, set) in cells.iter().enumerate() {
        let mut column = 0;
        for run in set.chunk_by(|a, b| a == b) {
            let end = column + run.len();
            if run.first() == Some(&true) {
                let at = |column, row| (edge(&slice.x, column, set.len()), edge(&slice.y, row, cells.len()));
                marks.push(Mark::Block { ink, opacity, from: at(column, row), to: at(end, row + 1) });
            }
            column = end;
        }
    }
    marks
}
