//! The search on the arm itself: what the filter rejects runs away, what is found is better on plants it never met, threads do not matter.

use std::collections::BTreeMap;
use std::path::Path;

use certune_closed_loop::{GainsFile, PerJoint, Scenario};
use certune_dynamics::{Joints, Model, Robot, mass_matrix};
use certune_tune::filter::DEFAULT_SAMPLES;
use certune_tune::{
    Batch, BatchError, Bench, Finite, Gains, Goals, Judge, Method, Objective, Outcome, Question, SearchSettings,
    Setting, SimulatedObjective, Space, SpaceError, SpaceFile, tune,
};

const SCENARIO: &str = include_str!("../../../tuning/scenarios/pick-and-place.toml");
const SPACE: &str = include_str!("../../../tuning/spaces/panda-aic.toml");
const PRESET: &str = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
const MRAC_SPACE: &str = include_str!("../../../tuning/spaces/panda-mrac.toml");
const MRAC_PRESET: &str = include_str!("../../../tuning/presets/pezzato2020-mrac-simulation.toml");
const PER_JOINT_PRESET: &str = include_str!("../../../tuning/presets/pezzato2020-robot.toml");

/// The default task, its first `goals` goals of `duration_s` each.
fn scenario(goals: usize, duration_s: f64) -> Scenario {
    let mut scenario = Scenario::parse(Path::new("pick-and-place.toml"), SCENARIO).expect("a valid scenario");
    scenario.segments.truncate(goals);
    for segment in &mut scenario.segments {
        segment.duration_s = duration_s;
    }
    scenario
}

/// The same gains with another number in a row, on every joint.
fn holding(gains: Gains, row: &str, value: f64) -> Gains {
    gains.with(row, PerJoint::Shared(value))
}

fn preset(text: &str) -> Gains {
    GainsFile::parse(Path::new("preset.toml"), text).expect("a valid preset").gains
}

fn published() -> Gains {
    preset(PRESET)
}

fn space(text: &str, start: &Gains) -> Result<Space, SpaceError> {
    let robot = Robot::panda();
    let model = Model::<7>::new(&robot).expect("an arm");
    let inertia = mass_matrix(&model, &Joints::from_fn(|joint, _| scenario(1, 1.0).start_rad[joint]));
    let inertia_kg_m2: Vec<f64> = inertia.diagonal().iter().copied().collect();
    let file = SpaceFile::parse(Path::new("space.toml"), text).expect("the shipped space");
    file.on(Setting { start: Some(start), inertia_kg_m2: Some(&inertia_kg_m2) })
}

#[test]
fn the_published_gains_settle_as_the_literature_says() {
    let batch = Batch::<7>::held_out(&Robot::panda(), &scenario(1, 6.0), 1, 2).unwrap();
    let verdict = batch.judge(&published());
    for plant in &verdict.plants {
        let settling_time_s = plant.figures.settling_time_s.unwrap();
        assert!((3.9..4.3).contains(&settling_time_s), "{settling_time_s}");
    }
    // A first-order lag that settles to 2 % in 4.05 s has a time constant of 1.04 s; jitter adds some hundredths.
    let cost_s = verdict.outcome.cost().unwrap();
    assert!((1.0..1.2).contains(&cost_s), "{cost_s}");
}

#[test]
fn what_the_filter_rejects_runs_away_or_never_settles() {
    let robot = Robot::panda();
    let scenario = scenario(1, 6.0);
    let objective = SimulatedObjective::<7>::new(&robot, &scenario, 1, 2, DEFAULT_SAMPLES).unwrap();
    assert!(matches!(objective.evaluate(&published(), None), Outcome::Simulated { .. }));
    // The published reference behaviour: sigma_dq = 5 runs away.
    let restless = holding(published(), "sigma_dq", 5.0);
    assert!(
        matches!(objective.evaluate(&restless, None), Outcome::Unstable { .. }),
        "{:?}",
        objective.evaluate(&restless, None)
    );
    let verdict = objective.batch().judge(&restless);
    let settles = |figures: &certune_tune::Figures| figures.settling_time_s.is_some();
    assert!(
        verdict.plants.iter().all(|plant| plant.outcome.cost().is_none() || !settles(&plant.figures)),
        "{verdict:?}"
    );
}

#[test]
fn the_filter_sees_the_slowest_mode_and_an_euler_step_that_is_too_long() {
    let robot = Robot::panda();
    let objective = SimulatedObjective::<7>::new(&robot, &scenario(1, 6.0), 1, 1, DEFAULT_SAMPLES).unwrap();
    let growth_per_s = |gains: &Gains| objective.filter().growth_of(gains, 1e-3).expect("a controller").get();
    // The slowest mode of the published gains is the reference's, about 1 /s.
    assert!((-1.2..-0.8).contains(&growth_per_s(&published())), "{}", growth_per_s(&published()));
    assert!(growth_per_s(&holding(published(), "kappa_mu", 2000.0)) > 0.0, "an Euler step of 2 leak rates is unstable");
    assert_eq!(objective.filter().len(), DEFAULT_SAMPLES);
}

#[test]
fn gains_that_make_no_controller_are_the_worst_outcome() {
    let objective = SimulatedObjective::<7>::new(&Robot::panda(), &scenario(1, 0.1), 1, 1, 3).unwrap();
    let none = objective.evaluate(&holding(published(), "sigma_mu", 0.0), None);
    assert!(matches!(none, Outcome::Diverged { at_s } if at_s.get() == 0.0), "{none:?}");
}

#[test]
fn batch_and_held_out_plants_are_disjoint_and_a_batch_is_never_empty() {
    let robot = Robot::panda();
    let scenario = scenario(1, 0.1);
    let seen = Batch::<7>::for_search(&robot, &scenario, 1, 20).unwrap();
    let unseen = Batch::<7>::held_out(&robot, &scenario, 1, 20).unwrap();
    assert!(
        seen.plants()
            .iter()
            .all(|(index, plant)| unseen.plants().iter().all(|(other, twin)| index != other && plant != twin))
    );
    assert!(matches!(Batch::<7>::for_search(&robot, &scenario, 1, 0), Err(BatchError::NoPlants)));
    assert!(Batch::<6>::for_search(&robot, &scenario, 1, 1).is_err());
}

#[test]
fn gains_per_joint_are_no_start_and_the_error_names_the_gain() {
    let error = space(SPACE, &preset(PER_JOINT_PRESET)).unwrap_err().to_string();
    assert!(error.contains("sigma_q = 10") && error.contains("search.start"), "{error}");
}

#[test]
fn a_candidate_is_given_up_exactly_when_it_is_worse_than_what_is_enough() {
    let objective =
        SimulatedObjective::<7>::new(&Robot::panda(), &scenario(2, 3.0), 3, 6, 3).unwrap().hardest_first(&published());
    let slow = holding(published(), "kappa_a", 300.0);
    for gains in [published(), slow, holding(published(), "sigma_dmu", 5.0)] {
        let exact = objective.evaluate(&gains, None);
        let Outcome::Simulated { cost } = exact else { panic!("{exact:?}") };
        for factor in [0.1, 0.5, 0.9, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 2.0] {
            let enough = Finite::saturating(cost.get() * factor);
            let expected = if cost > enough { Outcome::Stopped { cost_above: enough } } else { exact };
            assert_eq!(objective.evaluate(&gains, Some(enough)), expected, "{factor}");
        }
    }
}

#[test]
fn the_order_of_the_plants_does_not_change_an_outcome() {
    let objective = SimulatedObjective::<7>::new(&Robot::panda(), &scenario(1, 2.0), 3, 6, 3).unwrap();
    let sorted = objective.clone().hardest_first(&published());
    let order = |objective: &SimulatedObjective<7>| {
        objective.batch().plants().iter().map(|(index, _)| *index).collect::<Vec<_>>()
    };
    assert_ne!(order(&objective), order(&sorted), "a batch that is sorted by chance tests nothing");
    let gains = holding(published(), "kappa_a", 500.0);
    assert_eq!(objective.evaluate(&gains, None), sorted.evaluate(&gains, None));
}

#[test]
fn stopping_early_changes_no_candidate_and_no_winner() {
    let with = run(Method::ParticleSwarm, 2, true);
    let without = run(Method::ParticleSwarm, 2, false);
    let gains = |record: &certune_tune::RunRecord| {
        record.evaluations.iter().map(|found| found.gains.clone()).collect::<Vec<_>>()
    };
    assert_eq!(gains(&with), gains(&without));
    assert_eq!((with.winner, with.tuned()), (without.winner, without.tuned()));
    let stopped = |outcome: &Outcome| matches!(outcome, Outcome::Stopped { .. });
    let count = |record: &certune_tune::RunRecord| record.evaluations.iter().filter(|e| stopped(&e.outcome)).count();
    assert_eq!(count(&without), 0);
    assert!(count(&with) > 2, "{} of {}", count(&with), with.evaluations.len());
    for (with, without) in with.evaluations.iter().zip(&without.evaluations).filter(|(with, _)| stopped(&with.outcome))
    {
        let Outcome::Stopped { cost_above } = with.outcome else { unreachable!() };
        assert!(without.outcome > Outcome::Simulated { cost: cost_above });
    }
}

/// A small tuning run of the AIC: one goal, two plants.
fn run(method: Method, threads: usize, stop_early: bool) -> certune_tune::RunRecord {
    let search = SearchSettings { particles: 6, stop_early, ..SearchSettings::new(method, 36, 5) };
    run_of(&published(), SPACE, search, 0, threads)
}

fn run_of(
    start: &Gains,
    space_text: &str,
    search: SearchSettings,
    worst_plants: u32,
    threads: usize,
) -> certune_tune::RunRecord {
    let robot = Robot::panda();
    let scenario = scenario(1, 4.0);
    let space = space(space_text, start).expect("a start in the space");
    let question = Question {
        robot: robot.name().to_owned(),
        robot_sha256: robot.sha256(),
        scenario: scenario.name.clone(),
        versions: BTreeMap::new(),
        goals: Goals::default(),
        search,
        batch_plants: 2,
        held_out_plants: 3,
        worst_plants,
        certification_attempts: 3,
    };
    let objective =
        SimulatedObjective::<7>::new(&robot, &scenario, 5, question.batch_plants, 6).expect("plants that fit");
    let judge = Batch::<7>::held_out(&robot, &scenario, 5, question.held_out_plants).expect("plants that fit");
    let bench = Bench { objective: &objective, judge: &judge, progress: &() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let certify = |_: &Gains| Ok::<_, &str>(());
    pool.install(|| tune(question, &space, Some(start), bench, certify)).expect("a valid run").record
}

#[test]
fn mrac_is_tuned_by_the_same_search_and_threads_do_not_matter() {
    let start = preset(MRAC_PRESET);
    let run = |threads| run_of(&start, MRAC_SPACE, SearchSettings::new(Method::Schedule, 60, 5), 0, threads);
    let one = run(1);
    let [before, after] = [&one.held_out.start, &one.held_out.tuned].map(|verdict| verdict.as_ref().unwrap().outcome);
    assert!(after < before, "{before:?} {after:?}");
    let text = |record: &certune_tune::RunRecord| serde_json::to_string_pretty(record).unwrap();
    assert_eq!(text(&one), text(&run(2)));
    let read: certune_tune::RunRecord = serde_json::from_str(&text(&one)).unwrap();
    assert_eq!(read, one);
}

#[test]
fn a_plant_that_was_searched_for_is_worse_than_all_that_were_drawn() {
    let run = |threads| run_of(&published(), SPACE, SearchSettings::new(Method::NelderMead, 40, 5), 1, threads);
    let one = run(1);
    let [found] = &one.worst_plants[..] else { panic!("{:?}", one.worst_plants) };
    let robot = Robot::panda();
    let scenario = scenario(1, 4.0);
    let batch = Batch::<7>::for_search(&robot, &scenario, 5, 2).unwrap();
    let gains = &one.evaluations[found.evaluation].gains;
    let drawn = batch.judge(gains);
    assert!(drawn.plants.iter().all(|plant| plant.outcome < found.outcome), "{drawn:?} {found:?}");
    // The run on the plant, by itself, gives the same.
    let harder = batch.with_plant(&found.setting).unwrap().judge(gains);
    assert!((harder.plants[0].outcome.cost().unwrap() - found.outcome.cost().unwrap()).abs() < 1e-9);
    assert_eq!(serde_json::to_string(&one).unwrap(), serde_json::to_string(&run(2)).unwrap());
}

#[test]
fn nelder_mead_beats_the_published_gains_on_plants_it_never_met_and_threads_do_not_matter() {
    let one = run(Method::NelderMead, 1, true);
    let (start, tuned) = (one.held_out.start.as_ref().unwrap(), one.held_out.tuned.as_ref().unwrap());
    assert!(tuned.outcome.cost().unwrap() < 0.97 * start.outcome.cost().unwrap(), "{start:?} {tuned:?}");
    let text = |record| serde_json::to_string_pretty(record).unwrap();
    assert_eq!(text(&one), text(&run(Method::NelderMead, 2, true)));
}

#[test]
fn a_cold_swarm_gives_the_same_record_for_any_number_of_threads() {
    let text = |threads| serde_json::to_string_pretty(&run(Method::ParticleSwarm, threads, true)).unwrap();
    let one = text(1);
    assert_eq!(one, text(2));
    assert_eq!(one, text(4));
}
