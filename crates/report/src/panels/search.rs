//! Convergence of the search.

use super::TwoWidths;
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, corners, on_grid, span};
use crate::record::{Evaluation, TuningReport};

/// More candidates than this are not drawn one by one.
const MOST_DOTS: usize = 1200;

/// Phases are named only while they follow one another; interleaved ones would be a picket fence.
const MOST_PHASES: usize = 6;

/// What axes and their words take of the height.
const FRAME: f64 = 64.0;

/// Height of a lane of candidates without a cost, in nominal pixels, and of all above the lanes.
const LANE: f64 = 13.0;
const ABOVE: f64 = 21.0;

/// The outcomes of candidates without a cost in the order of their first, each with the places of its candidates.
fn without_cost(evaluations: &[Evaluation]) -> Vec<(&str, Vec<(f64, f64)>)> {
    let mut lanes: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    for evaluation in evaluations.iter().filter(|e| e.cost.is_none_or(|cost| !cost.is_finite())) {
        let at = (evaluation.index as f64, 0.0);
        match lanes.iter_mut().find(|(outcome, _)| *outcome == evaluation.outcome) {
            Some((_, places)) => places.push(at),
            None => lanes.push((&evaluation.outcome, vec![at])),
        }
    }
    lanes
}

/// Cost of every candidate, the best so far, and a lane of marks for each way to have no cost.
pub(super) fn convergence(record: &TuningReport) -> Result<Option<TwoWidths>, ReportError> {
    let evaluations = &record.search.evaluations;
    let costs: Vec<(f64, f64)> =
        evaluations.iter().filter_map(|e| Some((e.index as f64, e.cost.filter(|cost| cost.is_finite())?))).collect();
    let published = record.search.published_cost.filter(|cost| cost.is_finite());
    let Some((lowest, highest)) = span(costs.iter().map(|(_, cost)| *cost).chain(published)) else { return Ok(None) };
    let Some(last) = evaluations.last().map(|e| e.index as f64) else { return Ok(None) };
    let first = evaluations.first().map_or(0.0, |e| e.index as f64);
    let best: Vec<(f64, f64)> = evaluations
        .iter()
        .filter_map(|e| Some((e.index as f64, e.best_so_far.filter(|cost| cost.is_finite())?)))
        .collect();
    let lanes = without_cost(evaluations);
    let mut phases: Vec<(f64, &str)> = Vec::new();
    for evaluation in evaluations {
        if phases.last().is_none_or(|(_, name)| *name != evaluation.phase) {
            phases.push((evaluation.index as f64, &evaluation.phase));
        }
    }
    let names = lanes.iter().map(|(outcome, _)| outcome.chars().count());
    let longest = names.chain(["best so far".len()]).max().unwrap_or(0);
    let unit = &record.search.unit;
    let caption = if unit.is_empty() { "cost (no unit)".to_owned() } else { format!("cost ({unit})") };

    TwoWidths::new(|size| {
        let x = Axis::linear("candidates looked at", (first, last.max(first + 1.0)), (size.0 / 70.0) as usize);
        // The top belongs to candidates without a cost, and to the names of the phases; the figure grows by the lanes.
        let lanes_px = ABOVE + LANE * lanes.len() as f64;
        let size = (size.0, size.1 + (LANE * lanes.len() as f64 - LANE).max(0.0));
        let room = lanes_px / (size.1 - FRAME - lanes_px);
        let y = if lowest > 0.0 {
            Axis::log(caption.clone(), (0.96 * lowest, highest * (highest / lowest).powf(room).max(1.1)))
        } else {
            Axis::linear(caption.clone(), (lowest, highest + room * (highest - lowest)), 5)
        };
        let top = y.range().1;
        let dots = on_grid(&costs, x.range(), y.range(), (1600, 500), MOST_DOTS);
        let mut marks = vec![Mark::Dots { ink: Ink::Candidate, radius: 1.9, opacity: 0.55, points: dots }];
        if let Some(cost) = published {
            marks.push(Mark::Line {
                ink: Ink::Published,
                width: 1.4,
                points: vec![(first, cost), (x.range().1, cost)],
            });
            marks.push(Mark::EndLabel { ink: Ink::Published, text: "published".to_owned(), y: cost });
        }
        if let Some((_, cost)) = best.last() {
            marks.push(Mark::EndLabel { ink: Ink::Tuned, text: "best so far".to_owned(), y: *cost });
        }
        marks.push(Mark::Line { ink: Ink::Tuned, width: 2.0, points: corners(&best) });
        for (lane, (outcome, places)) in lanes.iter().enumerate() {
            let down = ABOVE + LANE * lane as f64;
            for (at, _) in on_grid(places, x.range(), (-1.0, 1.0), (200, 1), 200) {
                let (text, at) = ("×".to_owned(), (at, top));
                marks.push(Mark::Label { ink: Ink::Outside, text, at, shift: (0.0, down), anchor: Anchor::Middle });
            }
            let (text, at) = ((*outcome).to_owned(), (x.range().1, top));
            marks.push(Mark::Label { ink: Ink::Outside, text, at, shift: (6.0, down), anchor: Anchor::Start });
        }
        if phases.len() <= MOST_PHASES {
            for (index, (at, name)) in phases.iter().enumerate() {
                if index > 0 {
                    marks.push(Mark::Vertical { ink: Ink::Axis, x: *at });
                }
                let (at, text) = ((*at, top), (*name).to_owned());
                marks.push(Mark::Label { ink: Ink::Text, text, at, shift: (5.0, 7.0), anchor: Anchor::Start });
            }
        }
        Plot {
            title: "Cost of every candidate".to_owned(),
            description: format!(
                "{} candidates, {} of them without a cost; the line is the best so far.",
                evaluations.len(),
                lanes.iter().map(|(_, places)| places.len()).sum::<usize>()
            ),
            size,
            x,
            y,
            right: 7.0 * longest as f64,
            marks,
        }
    })
    .map(Some)
}
