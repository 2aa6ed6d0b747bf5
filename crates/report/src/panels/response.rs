//! Joint angles, torques and free energy of the nominal runs.

use super::over_time::{Curve, OverTime};
use super::{CURVE_POINTS, THIRD, TwoWidths, curve};
use crate::error::ReportError;
use crate::figure::{Axis, Ink, Mark, Plot, span, thin};
use crate::record::{Response, Trajectory};

/// One figure a joint: goal, published, tuned.
pub(super) fn positions(response: &Response) -> Result<Vec<String>, ReportError> {
    let goals = &response.runs.tuned;
    figures(response, |joint, name| OverTime {
        title: format!("Angle of {name} over time"),
        description: "Goal, published and tuned gains; in rad.".to_owned(),
        caption: format!("{name} (rad)"),
        unit: "rad",
        goal: goals.goal_rad.get(joint).map(|goal| (&goals.time_s[..], &goal[..])),
        limits: Vec::new(),
        moments: Vec::new(),
        curves: pair(response, joint, |run| &run.q_rad),
        least: 0.02,
        reach: 0.5,
    })
}

/// One figure a joint: published, tuned, and the limit where it is near.
pub(super) fn torques(response: &Response) -> Result<Vec<String>, ReportError> {
    figures(response, |joint, name| {
        let limit = response.torque_limit_n_m.get(joint).copied().filter(|limit| *limit > 0.0);
        OverTime {
            title: format!("Torque of {name} over time"),
            description: "Published and tuned gains; in N m.".to_owned(),
            caption: format!("{name} (N m)"),
            unit: "N m",
            goal: None,
            limits: limit.into_iter().flat_map(|limit| [("", -limit), ("", limit)]).collect(),
            moments: Vec::new(),
            curves: pair(response, joint, |run| &run.tau_n_m),
            least: 0.2,
            reach: 0.0,
        }
    })
}

fn figures<'a>(
    response: &'a Response,
    figure: impl Fn(usize, &'a String) -> OverTime<'a>,
) -> Result<Vec<String>, ReportError> {
    let figures = response.joint_names.iter().enumerate().map(|(joint, name)| figure(joint, name).svg(THIRD));
    figures.collect()
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

fn pair<'a>(response: &'a Response, joint: usize, of: fn(&Trajectory) -> &Vec<Vec<f64>>) -> Vec<Curve<'a>> {
    [(Ink::Published, &response.runs.published), (Ink::Tuned, &response.runs.tuned)]
        .into_iter()
        .filter_map(|(ink, run)| {
            let value = of(run).get(joint)?;
            Some(Curve { name: word(ink), ink, time_s: &run.time_s, value, band: None })
        })
        .collect()
}

fn time_axis(response: &Response, width: f64) -> Axis {
    let times = [&response.runs.published, &response.runs.tuned].into_iter().flat_map(|run| run.time_s.iter().copied());
    Axis::linear("time (s)", span(times).unwrap_or((0.0, 1.0)), (width / 48.0) as usize)
}
