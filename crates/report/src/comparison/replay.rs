//! Stick figures: where each run starts and ends, the way of the hand between, and all frames for the script.

use serde::Serialize;

use super::cast::{Cast, Player};
use crate::error::ReportError;
use crate::figure::{Axis, Ink, Mark, Plot, embedded, span};
use crate::record::{Replay, ReplayRun};

/// Nominal width of a figure; its height follows from the scale.
const WIDTH: f64 = 336.0;

/// Whence the arm is looked at: angle to the x axis seen from above, and above the ground.
const AZIMUTH_RAD: f64 = -0.95;
const ELEVATION_RAD: f64 = 0.35;

/// Half the side of the square on the ground.
const GROUND_M: f64 = 0.25;

type Point = (f64, f64);

#[derive(Debug, Serialize)]
pub(super) struct ReplayView<'a> {
    caption: &'a str,
    duration_s: f64,
    step_s: f64,
    runs: Vec<RunView<'a>>,
    /// For the script.
    data: String,
}

#[derive(Debug, Serialize)]
struct RunView<'a> {
    player: Player<'a>,
    end: &'a str,
    svg: String,
}

#[derive(Serialize)]
struct Data<'a> {
    step_s: f64,
    runs: Vec<RunData<'a>>,
}

#[derive(Serialize)]
struct RunData<'a> {
    ink: String,
    end: &'a str,
    /// x and y of each point in turn, in units of the view box.
    frames: Vec<Vec<i32>>,
}

/// # Errors
/// [`ReportError::Draw`] and [`ReportError::Json`].
pub(super) fn replay<'a>(replay: &'a Replay, cast: Cast<'a>) -> Result<ReplayView<'a>, ReportError> {
    let runs: Vec<(Player<'a>, &ReplayRun, Vec<Vec<Point>>)> = replay
        .runs
        .iter()
        .filter_map(|run| {
            let frames = run.frames_m.iter().map(|frame| frame.iter().copied().map(seen).collect()).collect();
            Some((cast.player(&run.controller)?, run, frames))
        })
        .collect();
    // One scale for all runs: what looks farther is farther.
    let points = || runs.iter().flat_map(|(_, _, frames)| frames).flatten().copied().chain(ground());
    let range = |of: fn(Point) -> f64| span(points().map(of)).unwrap_or((0.0, 1.0));
    let (x, y) = (range(|point| point.0), range(|point| point.1));
    let mut view = ReplayView {
        caption: &replay.caption,
        duration_s: 0.0,
        step_s: replay.step_s,
        runs: Vec::new(),
        data: String::new(),
    };
    let mut data = Data { step_s: replay.step_s, runs: Vec::new() };
    for (player, run, frames) in runs {
        let plot = plot(&player, &frames, x, y);
        let placed = |frame: &Vec<Point>| {
            frame.iter().filter_map(|point| plot.place(*point)).flat_map(|(x, y)| [x, y]).collect()
        };
        data.runs.push(RunData {
            ink: player.ink.sentinel(),
            end: &run.end,
            frames: frames.iter().map(placed).collect(),
        });
        view.duration_s = view.duration_s.max(replay.step_s * (frames.len().saturating_sub(1)) as f64);
        view.runs.push(RunView { player, end: &run.end, svg: plot.svg()? });
    }
    view.data = embedded(&data)?;
    Ok(view)
}

fn plot(player: &Player<'_>, frames: &[Vec<Point>], x: Point, y: Point) -> Plot {
    let (first, last) = (frames.first().cloned().unwrap_or_default(), frames.last().cloned().unwrap_or_default());
    let hand = frames.iter().filter_map(|frame| frame.last().copied()).collect();
    let line = |ink, width, points| Mark::Line { ink, width, points };
    Plot {
        title: format!("Arm under {}", player.name),
        description:
            "Stick figure, seen from the front right: grey where the run starts, in colour where it ends, and \
                      the way of the hand between."
                .to_owned(),
        size: (WIDTH, WIDTH),
        x: Axis::padded("across (m)", x, 5),
        y: Axis::padded("up the view (m)", y, 5),
        right: 12.0,
        marks: vec![
            line(Ink::Axis, 1.0, ground().collect()),
            line(Ink::Candidate, 1.0, hand),
            line(Ink::Candidate, 3.0, first),
            line(player.ink, 4.0, last.clone()),
            Mark::Dots { ink: player.ink, radius: 3.6, opacity: 1.0, points: last },
        ],
    }
    .true_to_scale()
}

/// Orthographic projection: a position in m to the right of the view and up.
fn seen([x, y, z]: [f64; 3]) -> Point {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (AZIMUTH_RAD.sin_cos(), ELEVATION_RAD.sin_cos());
    (cos_a * y - sin_a * x, cos_e * z - sin_e * (cos_a * x + sin_a * y))
}

/// The square on the ground, closed.
fn ground() -> impl Iterator<Item = Point> {
    [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .into_iter()
        .map(|(x, y)| seen([GROUND_M * x, GROUND_M * y, 0.0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_keeps_lengths_across_it_and_shows_up_as_up() {
        assert!(seen([0.0, 0.0, 1.0]).1 > 0.9 && seen([0.0, 0.0, 1.0]).0.abs() < 1e-12);
        let across = [-AZIMUTH_RAD.sin(), AZIMUTH_RAD.cos(), 0.0];
        assert!((seen(across).0 - 1.0).abs() < 1e-12 && seen(across).1.abs() < 1e-12);
        assert!(seen([1.0, 0.0, 0.0]).1 < 0.0, "what comes nearer goes down");
    }
}
