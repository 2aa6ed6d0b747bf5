//! What the candidates of a run say together.

use certune::closed_loop::Gains;
use certune::report::{
    CostPart, Direction, Learnt, NearestLimit, Pair, PairShare, Share, Slice, Surface, WorstPlantRow,
};
use certune::tune::learnt::{nearest_limit, surface};
use certune::tune::{Bound, Goal, Limit, Outcome, RunRecord, WorstPlant};

use super::runs::in_words;
use super::words;
use crate::run::Run;

/// A step along a direction whose effect is reported, a fraction of the ranges.
const STEP: f64 = 0.1;

/// The section's data.
pub fn learnt(run: &Run, gains: &Pair<Gains>, cost_parts: Vec<CostPart>, slices: Vec<Slice>) -> Learnt {
    let record = &run.file.record;
    let (surface, no_surface) = match around(record, &gains.tuned) {
        Ok(surface) => (Some(surface), String::new()),
        Err(reason) => (None, reason),
    };
    Learnt {
        surface,
        no_surface,
        limit: nearest(record),
        cost_parts,
        worst_plants: record.worst_plants.iter().map(|found| worst_plant(record, found)).collect(),
        slices,
    }
}

/// The fitted surface.
fn around(record: &RunRecord, gains: &Gains) -> Result<Surface, String> {
    let found = surface(record, gains).map_err(|too_few| too_few.to_string())?;
    let share = |(gain, share)| Share { gain, share };
    Ok(Surface {
        points: found.points as u64,
        coefficients: found.coefficients as u64,
        reach: found.reach,
        r_squared: found.r_squared,
        predicted_r_squared: found.predicted_r_squared,
        gains: found.knobs.into_iter().map(share).collect(),
        pairs: found.pairs.into_iter().map(|(gains, share)| PairShare { gains, share }).collect(),
        directions: found
            .directions
            .into_iter()
            .map(|direction| Direction { parts: direction.parts, change: STEP * direction.slope })
            .collect(),
    })
}

/// The limit that the tuned gains come nearest to on the held-out plants.
fn nearest(record: &RunRecord) -> Option<NearestLimit> {
    let (goal, bound, figure) = nearest_limit(record, record.held_out.tuned.as_ref()?)?;
    Some(NearestLimit {
        in_words: Limit { goal, bound: Bound::At(bound) }.to_string(),
        figure_in_words: figure_in_words(goal, figure),
        excess: Some(goal.excess(figure, bound)).filter(|excess| excess.is_finite()),
    })
}

fn figure_in_words(goal: Goal, figure: f64) -> String {
    match goal {
        Goal::Overshoot => format!("{:.2} %", 100.0 * figure),
        _ => format!("{figure:.4} {}", goal.unit()),
    }
}

fn worst_plant(record: &RunRecord, found: &WorstPlant) -> WorstPlantRow {
    let objective = record.question.goals.objective;
    let figure = |cost: f64| format!("{} {}", words(objective), figure_in_words(objective, objective.figure(cost)));
    let outcome = match found.outcome {
        Outcome::Certified { cost } | Outcome::Simulated { cost } | Outcome::Uncertified { cost } => figure(cost.get()),
        Outcome::Stopped { cost_above } => format!("given up as no better than {}", figure(cost_above.get())),
        Outcome::Violates { excess, limit } => {
            format!("beyond its limits by {:.1} %, most of it in {}", 100.0 * excess.get(), words(limit))
        }
        Outcome::Unstable { abscissa_per_s } => format!("unstable, its loop grows at {:.3} /s", abscissa_per_s.get()),
        Outcome::Diverged { at_s } => format!("ran away after {:.2} s", at_s.get()),
    };
    WorstPlantRow { candidate: found.evaluation as u64, in_words: in_words(&found.setting), outcome }
}
