//! `autotune evaluate`: gains in and figures out, a JSON line each: the plants of `autotune tune` for any other optimiser.
//!
//! ```text
//! in   {"gains":{"kappa_mu":11.67, ..}}                                     the object that `ask-tell` asks with
//! out  {"outcome":{"rank":"simulated","cost":1.086},"cost":1.086,"score":1.5,"figures":{"overshoot":0.01, ..}}
//! out  {"error":{"line":7,"message":".."}}                                  a line that could not be used; nothing is lost by it
//! ```
//!
//! One line out for each line in, in order. `outcome` is what the search would be told of a candidate that it does not stop early, to the bit: the stability filter first, then
//! every plant of the batch. `cost` is in s, and null for gains that have none. `score` is a number for every outcome, lower is better: the ranks one after
//! the other, see [`Outcome::score`]. `figures` are the worst over the plants, null for gains that were not simulated.

use std::io::{BufRead, Write};

use certune::closed_loop::{AicTable, MracTable, Scenario};
use certune::dynamics::Robot;
use certune::tune::filter::DEFAULT_SAMPLES;
use certune::tune::{Gains, Judge, Outcome, SimulatedObjective};
use certune::{ArmCertifier, ArmGains, Over, family_of};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::tune::{DEFAULT_PLANTS, DEFAULT_SEED, inertia_kg_m2, misfit, started};
use crate::catalogue;
use crate::cli::{EvaluateArgs, Exit};
use crate::error::Error;
use crate::lines::{Lines, nobody_listens};
use crate::page::{Spread, spread};
use crate::sizes::for_joint_count;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heard {
    gains: Value,
}

#[derive(Debug, Serialize)]
struct Found {
    outcome: Outcome,
    cost: Option<f64>,
    score: f64,
    figures: Option<Spread>,
}

impl Found {
    fn new(outcome: Outcome, figures: Option<Spread>) -> Self {
        Self { outcome, cost: outcome.cost(), score: outcome.score(), figures }
    }
}

pub fn run(args: &EvaluateArgs) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let scenario = catalogue::scenario(args.scenario.as_deref(), &robot)?;
    let source = catalogue::space(args.space.as_deref(), None)?;
    let (_, space, start) = started(&source, Some(&inertia_kg_m2(&robot, &scenario)?))?;
    let (seed, plants) = (args.seed.unwrap_or(DEFAULT_SEED), args.plants.unwrap_or(DEFAULT_PLANTS));
    let family = family_of(&scenario.plant_box)?;
    let records = catalogue::records(&[])?;
    let lines = Lines::standard();
    for_joint_count!(robot.joints(), N => {
        let certifier = ArmCertifier::<N>::new(&robot, &family)?.with_records(&records, &Over::AllAngles)?;
        let objective = objective::<N>(&robot, &scenario, seed, plants)?;
        let goals = objective.batch().resolved(space.goals().clone(), &start);
        match answer(lines, &objective.with_goals(&goals, &certifier)) {
            // Whoever has heard enough has every answer that it wanted.
            Err(error) if nobody_listens(&error) => Ok(Exit::Holds),
            ended => ended,
        }
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))
}

/// The plants of `autotune tune`. Which come first decides only how soon a candidate can be stopped, which none is here.
fn objective<const N: usize>(
    robot: &Robot,
    scenario: &Scenario,
    seed: u64,
    plants: usize,
) -> Result<SimulatedObjective<'static, N>, Error> {
    SimulatedObjective::new(robot, scenario, seed, plants, DEFAULT_SAMPLES)
        .map_err(|error| misfit(robot, scenario, error))
}

/// Answers every line until the input ends.
fn answer<R: BufRead, W: Write, const N: usize>(
    mut lines: Lines<R, W>,
    objective: &SimulatedObjective<'_, N>,
) -> Result<Exit, Error> {
    let mut exit = Exit::Holds;
    while let Some(text) = lines.hear()? {
        match found(text, objective) {
            Ok(found) => lines.say(&found)?,
            Err(message) => {
                lines.refuse(&message)?;
                exit = Exit::Unreadable;
            }
        }
    }
    Ok(exit)
}

/// What becomes of the gains on a line, or why the line cannot be used.
fn found<const N: usize>(text: &[u8], objective: &SimulatedObjective<'_, N>) -> Result<Found, String> {
    let expected = |error: serde_json::Error| format!("expected {{\"gains\":{{\"kappa_mu\":11.67, ..}}}}: {error}");
    let Heard { gains } = serde_json::from_slice(text).map_err(expected)?;
    // Only the adaptive controller has laws: a table is read as one of its controller, so that what is wrong with it can be said.
    let gains: Gains = match gains.get("law") {
        None => serde_json::from_value::<AicTable>(gains).map_err(expected)?.into(),
        Some(_) => serde_json::from_value::<MracTable>(gains).map_err(expected)?.into(),
    };
    ArmGains::<N>::bind(&gains).map_err(|error| format!("gains: {error}"))?;
    let verdict = objective.judge(&gains);
    let figures = (!verdict.plants.is_empty()).then(|| spread(&verdict));
    Ok(Found::new(verdict.outcome, figures))
}

#[cfg(test)]
mod tests {
    use super::*;
    use certune::closed_loop::PerJoint;
    use certune::tune::Objective;
    use proptest::prelude::*;

    fn short() -> SimulatedObjective<'static, 7> {
        let robot = Robot::panda();
        let mut scenario = catalogue::scenario(Some("hold"), &robot).unwrap();
        for segment in &mut scenario.segments {
            segment.duration_s = 0.2;
        }
        scenario.pushes.clear();
        scenario.payloads.clear();
        objective(&robot, &scenario, 1, 2).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Stable or not, the answer is the objective's own.
        #[test]
        fn what_is_said_is_what_the_search_is_told(kappa_mu in 1.0..200.0_f64, kappa_a in 10.0..1e5_f64, sigma_dmu in 0.1..100.0_f64) {
            let rows = [("kappa_mu", kappa_mu), ("kappa_a", kappa_a), ("sigma_mu", 5.0), ("sigma_dmu", sigma_dmu)];
            let blank = Gains::from(AicTable::uniform(1.0));
            let gains = rows.into_iter().fold(blank, |gains, (row, value)| gains.with(row, PerJoint::Shared(value)));
            let objective = short();
            let text = serde_json::json!({ "gains": gains }).to_string();
            let said = found(text.as_bytes(), &objective).unwrap();
            prop_assert_eq!(said.outcome, objective.evaluate(&gains, None));
            prop_assert_eq!(said.figures.is_none(), matches!(said.outcome, Outcome::Unstable { .. }));
        }
    }
}
