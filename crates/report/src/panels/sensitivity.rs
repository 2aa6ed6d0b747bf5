//! What a change of 10 % in one gain does to the cost.

use super::HALF;
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, row_at, span};
use crate::format;
use crate::record::TuningReport;

/// Height of a row.
const ROW: f64 = 30.0;

/// Two bars for each gain, from the tuned cost to the cost of the changed gain.
pub(super) fn bars(record: &TuningReport) -> Result<Option<String>, ReportError> {
    let rows = &record.sensitivity;
    let change = |ratio: Option<f64>| ratio.filter(|ratio| ratio.is_finite()).map(|ratio| 100.0 * (ratio - 1.0));
    let changes =
        rows.iter().flat_map(|row| [row.ratio_at_minus_10_percent, row.ratio_at_plus_10_percent]).filter_map(change);
    if rows.is_empty() {
        return Ok(None);
    }
    // One gain on the edge of stability must not hide the others: 100 % is the end of the axis.
    let (lower, upper) = span(changes).unwrap_or((0.0, 1.0));
    let (lower, upper) = (lower.clamp(-100.0, -0.2), upper.clamp(0.5, 100.0));
    let room = 0.22 * (upper - lower);
    let x = Axis::linear("change of the cost (%)", (lower - room, upper + room), 5);
    let mut marks = vec![Mark::Vertical { ink: Ink::Axis, x: 0.0 }];
    for (index, row) in rows.iter().enumerate() {
        let sides = [(row.ratio_at_minus_10_percent, -6.0, "−10 %"), (row.ratio_at_plus_10_percent, 6.0, "+10 %")];
        for (ratio, shift, name) in sides {
            let at = (0.0, row_at(index) - shift / ROW);
            let Some(change) = change(ratio) else {
                let text = format!("{name}: no cost");
                marks.push(Mark::Label { ink: Ink::Outside, text, at, shift: (5.0, 0.0), anchor: Anchor::Start });
                continue;
            };
            let opacity = if shift < 0.0 { 0.5 } else { 1.0 };
            marks.push(Mark::Bar { ink: Ink::Tuned, opacity, height: 9.0, from: at, to_x: change.min(upper) });
            let (anchor, away) = if change < 0.0 { (Anchor::End, -4.0) } else { (Anchor::Start, 4.0) };
            let text = if change > upper { format!("{name}: {} %", format::number(change)) } else { name.to_owned() };
            marks.push(Mark::Label { ink: Ink::Axis, text, at: (change.min(upper), at.1), shift: (away, 0.0), anchor });
        }
    }
    Plot {
        title: "Change of the cost when one gain changes by 10 %".to_owned(),
        description: "Two bars for each gain, 10 % lower and 10 % higher.".to_owned(),
        size: (HALF.0, 64.0 + ROW * rows.len() as f64),
        x,
        y: Axis::rows(rows.iter().map(|row| row.gain.clone())),
        right: 14.0,
        marks,
    }
    .svg()
    .map(Some)
}
