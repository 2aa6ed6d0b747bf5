//! The first screen: what came out, in words a manager understands.

use serde::Serialize;

use crate::claims::{self, Tone};
use crate::format;
use crate::quantile::quantile;
use crate::record::{GainRow, PlantRow, RegionRecord, SegmentMetrics, SegmentRow, TuningReport, Verdict};

/// The first screen.
#[derive(Debug, Serialize)]
pub(crate) struct Answer {
    /// The result as the page's heading.
    headline: String,
    /// How well it generalises.
    held_out: String,
    /// Where the gains should be taken with care; may be empty.
    warnings: Vec<String>,
    /// Stability in one line, and its colour.
    stability: String,
    tone: Tone,
    /// Figures at a glance.
    tiles: Vec<Tile>,
}

/// One figure at a glance.
#[derive(Debug, Serialize)]
struct Tile {
    label: &'static str,
    tuned: String,
    published: Option<String>,
    note: String,
}

/// Two costs this close are called equal.
const SAME: f64 = 0.005;

/// What the held-out plants say.
struct Tally {
    plants: usize,
    better: usize,
    /// Worst cost; `None` when a run diverged.
    worst: (Option<f64>, Option<f64>),
    median: (Option<f64>, Option<f64>),
}

/// Writes the first screen.
pub(crate) fn answer(record: &TuningReport) -> Answer {
    let settling =
        (slowest(&record.segments, |row| &row.metrics.published), slowest(&record.segments, |row| &row.metrics.tuned));
    let tally = tally(&record.held_out.plants);
    let (tone, stability) = claims::in_one_line(&record.certificate);
    Answer {
        headline: headline(record, settling, &tally),
        held_out: held_out(&tally, &record.asked.cost.unit),
        warnings: warnings(record),
        stability,
        tone,
        tiles: tiles(record, settling, &tally),
    }
}

fn headline(record: &TuningReport, settling: (Option<f64>, Option<f64>), tally: &Tally) -> String {
    let robot = format::sentence(&record.asked.robot);
    let claims = &record.certificate.claims;
    if claims.is_empty() || claims.iter().any(|claim| claim.verdict != Verdict::Holds) {
        return format!("{robot}: no gains were certified");
    }
    let moves =
        record.certificate.region.as_ref().is_none_or(|region| region.steps.iter().any(|step| step.size_rad > 0.0));
    if let (false, (Some(published), Some(tuned))) = (moves, tally.median) {
        let cost = |value| format::with_unit(value, &record.asked.cost.unit);
        return format!(
            "{robot}: tuned gains hold the arm at a cost of {} instead of {}",
            cost(tuned),
            cost(published)
        );
    }
    settling_headline(&robot, settling)
}

fn settling_headline(robot: &str, settling: (Option<f64>, Option<f64>)) -> String {
    let seconds = |value| format::with_unit(value, "s");
    match settling {
        (Some(published), Some(tuned)) if tuned < published * (1.0 - SAME) => {
            format!("{robot}: tuned gains settle every move in {} instead of {}", seconds(tuned), seconds(published))
        }
        (Some(published), Some(tuned)) if tuned <= published * (1.0 + SAME) => {
            format!("{robot}: tuned gains settle every move in {}, as the published gains do", seconds(tuned))
        }
        (Some(published), Some(tuned)) => {
            format!(
                "{robot}: tuned gains settle every move in {}, slower than the published {}",
                seconds(tuned),
                seconds(published)
            )
        }
        (None, Some(tuned)) => {
            format!("{robot}: tuned gains settle every move in {}; the published gains do not", seconds(tuned))
        }
        (Some(_), None) => format!("{robot}: the tuned gains do not settle every move; the published gains do"),
        (None, None) => format!("{robot}: neither the tuned nor the published gains settle every move"),
    }
}

fn held_out(tally: &Tally, unit: &str) -> String {
    let Tally { plants, better, median, .. } = tally;
    let count = match (*better, *plants) {
        (_, 0) => return "No held-out arm was simulated.".to_owned(),
        (better, plants) if better == plants => format!("on every one of {plants} random arms"),
        (0, plants) => format!("on none of {plants} random arms"),
        (better, plants) => format!("on {better} of {plants} random arms"),
    };
    let figures = match median {
        (Some(published), Some(tuned)) => {
            format!(": median {} instead of {}", format::with_unit(*tuned, unit), format::with_unit(*published, unit))
        }
        (None, _) | (_, None) => String::new(),
    };
    format!("The tuned gains cost less {count} that the search never saw{figures}.")
}

fn warnings(record: &TuningReport) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(time) = record.response.runs.tuned.diverged_at_s {
        warnings.push(format!("The nominal run with the tuned gains ran away after {}.", format::with_unit(time, "s")));
    }
    let lost = record.held_out.plants.iter().filter(|plant| finite(plant.cost.tuned).is_none()).count();
    if lost > 0 {
        let count = record.held_out.plants.len();
        warnings.push(format!("With the tuned gains, {lost} of {count} held-out arms did not finish the task."));
    }
    let on_bound = on_bound(&record.gains);
    if !on_bound.is_empty() {
        warnings
            .push(format!("On the edge of the search space: {}. A wider space might do better.", on_bound.join(", ")));
    }
    if let Some(region) = &record.certificate.region {
        let (moves, outside) = (region.steps.len(), region.steps.len() - covered(region));
        match region.radius_rad {
            None if moves > 0 => warnings.push(
                "No starting error is certified for the nonlinear arm: for every move, simulation is the evidence.".to_owned(),
            ),
            Some(radius) if outside > 0 => warnings.push(format!(
                "{outside} of {moves} moves of the scenario start farther from the goal than the certified radius of {}: \
                 for those, simulation is the evidence.",
                format::certified(radius, "rad")
            )),
            None | Some(_) => {}
        }
    }
    warnings
}

/// The gains whose tuned value lies on a bound of the search.
pub(crate) fn on_bound(gains: &[GainRow]) -> Vec<String> {
    let on_bound = gains.iter().filter(|gain| gain.bounds.as_ref().is_some_and(|bounds| bounds.on_bound));
    let name = |gain: &GainRow| {
        gain.joint.as_ref().map_or_else(|| gain.name.clone(), |joint| format!("{} of {joint}", gain.name))
    };
    on_bound.map(name).collect()
}

fn tiles(record: &TuningReport, settling: (Option<f64>, Option<f64>), tally: &Tally) -> Vec<Tile> {
    let unit = &record.asked.cost.unit;
    let show = |value: Option<f64>, unit: &str, none: &str| {
        value.map_or_else(|| none.to_owned(), |value| format::with_unit(value, unit))
    };
    let certified = |value: Option<f64>, unit: &str| {
        value.map_or_else(|| "none".to_owned(), |value| format::certified(value, unit))
    };
    let mut tiles = vec![Tile {
        label: "Slowest move settles in",
        tuned: show(settling.1, "s", "never"),
        published: Some(show(settling.0, "s", "never")),
        note: "to 2 % of the step, nominal arm".to_owned(),
    }];
    if tally.plants > 0 {
        tiles.push(Tile {
            label: "Worst held-out cost",
            tuned: show(tally.worst.1, unit, "diverged"),
            published: Some(show(tally.worst.0, unit, "diverged")),
            note: format!("better on {} of {} arms", tally.better, tally.plants),
        });
    }
    if let Some(region) = &record.certificate.region {
        let inside = covered(region);
        tiles.push(Tile {
            label: "Certified starting error",
            tuned: certified(region.radius_rad, "rad"),
            published: None,
            note: format!("covers {inside} of {} moves", region.steps.len()),
        });
    }
    if let Some(map) = &record.certificate.pole_map {
        tiles.push(Tile {
            label: "Certified decay rate",
            tuned: certified(map.certified_rate_per_s, "/s"),
            published: None,
            note: "of the linearised loop".to_owned(),
        });
    }
    tiles
}

fn tally(plants: &[PlantRow]) -> Tally {
    let costs = |of: fn(&PlantRow) -> Option<f64>| plants.iter().map(|plant| finite(of(plant))).collect::<Vec<_>>();
    let (published, tuned) = (costs(|plant| plant.cost.published), costs(|plant| plant.cost.tuned));
    let better = published
        .iter()
        .zip(&tuned)
        .filter(|pair| match pair {
            (Some(published), Some(tuned)) => tuned < published,
            (None, Some(_)) => true,
            (_, None) => false,
        })
        .count();
    Tally {
        plants: plants.len(),
        better,
        worst: (quantile(&published, 1.0), quantile(&tuned, 1.0)),
        median: (quantile(&published, 0.5), quantile(&tuned, 0.5)),
    }
}

/// One row of the held-out table: a figure, published, tuned.
#[derive(Debug, Serialize)]
pub(crate) struct SummaryRow {
    name: &'static str,
    published: Option<f64>,
    tuned: Option<f64>,
}

/// Quantiles of the held-out costs.
pub(crate) fn summary(plants: &[PlantRow]) -> Vec<SummaryRow> {
    let published: Vec<_> = plants.iter().map(|plant| finite(plant.cost.published)).collect();
    let tuned: Vec<_> = plants.iter().map(|plant| finite(plant.cost.tuned)).collect();
    [("best", 0.0), ("median", 0.5), ("95 % of the arms below", 0.95), ("worst", 1.0)]
        .into_iter()
        .filter(|_| !plants.is_empty())
        .map(|(name, part)| SummaryRow { name, published: quantile(&published, part), tuned: quantile(&tuned, part) })
        .collect()
}

fn slowest(rows: &[SegmentRow], of: fn(&SegmentRow) -> &SegmentMetrics) -> Option<f64> {
    let times: Option<Vec<f64>> = rows.iter().map(|row| finite(of(row).settling_time_s)).collect();
    times?.into_iter().max_by(f64::total_cmp)
}

/// Moves within the certified radius.
fn covered(region: &RegionRecord) -> usize {
    region.steps.iter().filter(|step| region.radius_rad.is_some_and(|radius| step.size_rad <= radius)).count()
}

fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_headline_never_calls_a_worse_result_better() {
        assert!(settling_headline("panda", (Some(4.1), Some(3.1))).contains("3.10\u{a0}s instead of 4.10\u{a0}s"));
        assert!(settling_headline("panda", (Some(4.1), Some(4.1))).contains("as the published gains do"));
        assert!(settling_headline("panda", (Some(3.1), Some(4.1))).contains("slower than"));
        assert!(settling_headline("panda", (None, Some(4.1))).ends_with("the published gains do not"));
        assert!(settling_headline("panda", (Some(4.1), None)).contains("do not settle every move"));
        assert!(settling_headline("panda", (None, None)).contains("neither"));
    }
}
