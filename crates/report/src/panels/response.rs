//! Joint angles, torques and free energy of the nominal runs.

use super::{CURVE_POINTS, THIRD, TwoWidths, curve};
use crate::error::ReportError;
use crate::figure::{Axis, Ink, Mark, Plot, corners, span, thin};
use crate::record::{Response, Trajectory};

/// One figure a joint: goal, published, tuned.
pub(super) fn positions(response: &Response) -> Result<Vec<String>, ReportError> {
    let runs = &response.runs;
    let figure = |(joint, name): (usize, &String)| {
        let goals = || runs.tuned.goal_rad.get(joint).into_iter().flatten().copied();
        let angles = [&runs.published, &runs.tuned].map(|run| run.q_rad.get(joint)).into_iter().flatten().flatten();
        let range = span(goals().chain(angles.copied())).unwrap_or((0.0, 1.0));
        // A run that diverges would flatten all else: what leaves this window is drawn on its edge.
        let window = span(goals()).map_or(range, |(lower, upper)| {
            let reach = (upper - lower).max(0.5);
            (range.0.max(lower - reach), range.1.min(upper + reach))
        });
        let y = Axis::padded(format!("{name} (rad)"), least(window, 0.02), 4);
        let mut marks = Vec::new();
        if let Some(goal) = runs.tuned.goal_rad.get(joint) {
            let points = corners(&curve(&runs.tuned.time_s, goal));
            marks.push(Mark::Line { ink: Ink::Goal, width: 1.3, points });
        }
        marks.extend(pair(response, joint, |run| &run.q_rad));
        let title = format!("Angle of {name} over time");
        panel(response, title, "Goal, published and tuned gains; in rad.", y, marks).svg()
    };
    response.joint_names.iter().enumerate().map(figure).collect()
}

/// One figure a joint: published, tuned, and the limit where it is near.
pub(super) fn torques(response: &Response) -> Result<Vec<String>, ReportError> {
    let runs = &response.runs;
    let figure = |(joint, name): (usize, &String)| {
        let torques = [&runs.published, &runs.tuned].map(|run| run.tau_n_m.get(joint)).into_iter().flatten().flatten();
        let mut range = least(span(torques.copied()).unwrap_or((0.0, 1.0)), 0.2);
        let mut marks = Vec::new();
        if let Some(limit) = response.torque_limit_n_m.get(joint).copied().filter(|limit| *limit > 0.0) {
            range = (range.0.max(-1.15 * limit), range.1.min(1.15 * limit));
            for limit in [-limit, limit] {
                if range.0 <= limit && limit <= range.1 {
                    marks.push(Mark::Horizontal { ink: Ink::Goal, y: limit });
                }
            }
        }
        marks.extend(pair(response, joint, |run| &run.tau_n_m));
        let title = format!("Torque of {name} over time");
        let y = Axis::padded(format!("{name} (N m)"), range, 4);
        panel(response, title, "Published and tuned gains; in N m.", y, marks).svg()
    };
    response.joint_names.iter().enumerate().map(figure).collect()
}

/// Free energy on a logarithmic axis.
pub(super) fn free_energy(response: &Response) -> Result<Option<TwoWidths>, ReportError> {
    let runs = &response.runs;
    let positive = [&runs.published, &runs.tuned]
        .into_iter()
        .flat_map(|run| run.free_energy.iter().copied())
        .filter(|value| *value > 0.0);
    let Some((lowest, highest)) = span(positive) else { return Ok(None) };
    TwoWidths::new(|size| {
        let mut marks = Vec::new();
        for (ink, run) in [(Ink::Published, &runs.published), (Ink::Tuned, &runs.tuned)] {
            let points = thin(&curve(&run.time_s, &run.free_energy), 2 * CURVE_POINTS);
            if let Some((_, y)) = points.iter().rev().find(|(_, y)| *y > 0.0) {
                marks.push(Mark::EndLabel { ink, text: word(ink).to_owned(), y: *y });
            }
            marks.push(Mark::Line { ink, width: 1.6, points });
        }
        Plot {
            title: "Free energy over time".to_owned(),
            description: "Published and tuned gains, logarithmic axis.".to_owned(),
            size,
            x: time_axis(response, size.0),
            y: Axis::log("free energy (no unit)", (lowest.max(1e-9 * highest), highest)),
            right: 66.0,
            marks,
        }
    })
    .map(Some)
}

/// How a curve is called at its end.
pub(super) fn word(ink: Ink) -> &'static str {
    if ink == Ink::Tuned { "tuned" } else { "published" }
}

fn pair(response: &Response, joint: usize, of: fn(&Trajectory) -> &Vec<Vec<f64>>) -> Vec<Mark> {
    [(Ink::Published, &response.runs.published), (Ink::Tuned, &response.runs.tuned)]
        .into_iter()
        .filter_map(|(ink, run)| {
            let points = thin(&curve(&run.time_s, of(run).get(joint)?), CURVE_POINTS);
            Some(Mark::Line { ink, width: 1.6, points })
        })
        .collect()
}

fn panel(response: &Response, title: String, description: &str, y: Axis, marks: Vec<Mark>) -> Plot {
    let x = time_axis(response, THIRD.0);
    Plot { title, description: description.to_owned(), size: THIRD, x, y, right: 12.0, marks }
}

fn time_axis(response: &Response, width: f64) -> Axis {
    let times = [&response.runs.published, &response.runs.tuned].into_iter().flat_map(|run| run.time_s.iter().copied());
    Axis::linear("time (s)", span(times).unwrap_or((0.0, 1.0)), (width / 48.0) as usize)
}

/// The range, widened about its middle to at least `size`: a resting joint is not shown as drama.
fn least((lower, upper): (f64, f64), size: f64) -> (f64, f64) {
    let missing = (size - (upper - lower)).max(0.0);
    (lower - 0.5 * missing, upper + 0.5 * missing)
}
