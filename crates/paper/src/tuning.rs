//! Searches for gains, all with the same plants, objective, limits and budget.
//!
//! Both controllers are tuned where the paper tuned them: on the approximated model, gravity not compensated, masses uncertain. The objective is the settling cost, which counts lag, jitter,
//! overshoot and saturation together; there are no limits. The task is that of the first three goals.
//!
//! **Matched references.** The AIC's belief is drawn to the goal as by a first-order lag of time constant T, MRAC's reference model is critically damped of frequency omega. Both settle to 2 % at the same time if
//!
//! ```text
//! omega = x/(T ln 50),   (1 + x) exp(-x) = 1/50
//! ```

use std::collections::BTreeMap;

use certune_closed_loop::{Gains, PerJoint, Scenario};
use certune_dynamics::{Model, Robot, mass_matrix};
use certune_linsys::Joints;
use certune_tune::filter::DEFAULT_SAMPLES;
use certune_tune::{Outcome, SearchSettings, Setting, SimulatedObjective, SpaceFile, search};

use crate::error::CompareError;
use crate::inputs::{Inputs, MASS_UNCERTAINTY, ROTOR_KG_M2, names};
use crate::record::{Contender, Effort, Reached, Search, rounded};
use crate::runs::{JOINTS, masses_only};

/// Goals of the task on which gains are tuned.
const GOALS: usize = 3;
/// What counts as settled.
const BAND: f64 = 0.02;

/// The frequency of a critically damped model that settles to 2 % when a first-order lag of that time constant does.
pub fn matched_omega_rad_per_s(time_constant_s: f64) -> f64 {
    // Newton's method; (1 + x) exp(-x) falls and is convex beyond x = 1.
    let mut x: f64 = 6.0;
    for _ in 0..50 {
        x += ((1.0 + x) * (-x).exp() - BAND) / (x * (-x).exp());
    }
    x / (time_constant_s * BAND.recip().ln())
}

/// The tuned contenders, and what it took.
pub(crate) fn tune(inputs: &Inputs, told: &dyn Fn(&str)) -> Result<(Vec<Contender>, Effort), CompareError> {
    let mut scenario = inputs.scenarios.pick_and_place.clone();
    scenario.segments.truncate(GOALS);
    scenario.plant_box = masses_only(MASS_UNCERTAINTY, 0.0, ROTOR_KG_M2, 0, false);
    let mut found = Vec::new();
    let mut searches = Vec::new();
    let mut add = |name: &str, title: &str, gains: Gains| {
        found.push(Contender { name: name.to_owned(), title: title.to_owned(), gains });
    };
    let published = &inputs.published;
    if let Some(gains) = &inputs.tuned_aic {
        add(names::AIC_TUNED, "AIC, tuned gains as given", gains.clone());
    } else {
        told(&format!("searching for {}", names::AIC_TUNED));
        let start = &published.aic_simulation;
        let (gains, run) = searched(inputs, names::AIC_TUNED, &inputs.spaces.aic, start, &scenario)?;
        add(names::AIC_TUNED, "AIC, tuned on the approximated model", gains);
        searches.push(run);
    }
    if let Some(gains) = &inputs.tuned_mrac {
        add(names::MRAC_MATCHED, "MRAC, tuned gains as given", gains.clone());
    } else {
        let row = "omega_rad_per_s";
        let time_constant_s = match &published.aic_simulation {
            Gains::Aic(table) => table.reference_time_constant_s.of(0).unwrap_or(1.0),
            Gains::Mrac(_) => 1.0,
        };
        let omega = matched_omega_rad_per_s(time_constant_s);
        let matched = inputs.spaces.mrac.clone().holding(row, omega);
        let start = published.mrac_simulation.clone();
        let in_matched = start.clone().with(row, PerJoint::Shared(omega));
        told(&format!("searching for {}", names::MRAC_MATCHED));
        let (gains, run) = searched(inputs, names::MRAC_MATCHED, &matched, &in_matched, &scenario)?;
        add(names::MRAC_MATCHED, "MRAC, tuned on the approximated model, its reference as fast as the AIC's", gains);
        searches.push(run);
        told(&format!("searching for {}", names::MRAC_FREE));
        let (gains, run) = searched(inputs, names::MRAC_FREE, &inputs.spaces.mrac, &start, &scenario)?;
        add(names::MRAC_FREE, "MRAC, tuned on the approximated model, the speed of its reference free", gains);
        searches.push(run);
    }
    Ok((found, effort(searches)))
}

/// The inertia about each joint: the diagonal of M at the scenario's start.
fn inertia_kg_m2(robot: &Robot, scenario: &Scenario) -> Result<Vec<f64>, CompareError> {
    let model = Model::<JOINTS>::new(robot)?;
    let start = Joints::from_fn(|joint, _| scenario.start_rad.get(joint).copied().unwrap_or(0.0));
    Ok(mass_matrix(&model, &start).diagonal().iter().copied().collect())
}

fn searched(
    inputs: &Inputs,
    contender: &str,
    space: &SpaceFile,
    start: &Gains,
    scenario: &Scenario,
) -> Result<(Gains, Search), CompareError> {
    let robot = &inputs.approximated;
    let inertia = inertia_kg_m2(robot, scenario)?;
    let space = space.on(Setting { start: Some(start), inertia_kg_m2: Some(&inertia) })?;
    let size = inputs.size;
    let objective = SimulatedObjective::<JOINTS>::new(robot, scenario, size.seed, size.search_plants, DEFAULT_SAMPLES)?;
    let written = space.admit(start)?;
    let objective = objective.hardest_first(&written);
    let settings = SearchSettings::new(space.method(), size.candidates, size.seed);
    let run = search(&space, Some(start), &settings, &objective, &())?;
    let mut best_so_far: Vec<(usize, f64)> = Vec::new();
    for evaluation in &run.evaluations {
        let cost = evaluation.outcome.cost().and_then(rounded);
        if let Some(cost) = cost.filter(|cost| best_so_far.last().is_none_or(|(_, best)| cost < best)) {
            best_so_far.push((evaluation.index + 1, cost));
        }
    }
    let nothing = || Outcome::Diverged { at_s: certune_tune::Finite::saturating(0.0) };
    let best = run.ranked().first().map(|evaluation| (evaluation.gains.clone(), evaluation.outcome));
    let (gains, outcome) = best.unwrap_or_else(|| (written, nothing()));
    let found = Search {
        contender: contender.to_owned(),
        knobs: space.dimension(),
        termination: run.termination,
        start: run.evaluations.first().map_or_else(nothing, |evaluation| evaluation.outcome),
        best: outcome,
        best_so_far,
    };
    Ok((gains, found))
}

/// Costs that every search reached, down to the highest of the bests, and when each got there.
fn effort(searches: Vec<Search>) -> Effort {
    let bests: Vec<f64> = searches.iter().filter_map(|search| Some(search.best_so_far.last()?.1)).collect();
    let highest = bests.iter().copied().fold(0.0, f64::max);
    let factors: &[f64] = if bests.is_empty() { &[] } else { &[2.0, 1.5, 1.2, 1.1, 1.05, 1.0] };
    let reached = factors
        .iter()
        .filter_map(|factor| {
            let cost_s = rounded(highest * factor)?;
            let until = |search: &Search| (search.contender.clone(), search.until(cost_s));
            Some(Reached { cost_s, candidates: searches.iter().map(until).collect::<BTreeMap<_, _>>() })
        })
        .collect();
    Effort {
        // Two kappas, four sigmas.
        aic_parameters: 6,
        aic_degrees_of_freedom: 5,
        // alpha1..3, e01..f13, l1 and l2 of every joint.
        mrac_parameters: 17 * JOINTS,
        searches,
        reached,
    }
}
