//! Contracts: numbers of the record are those that anybody finds in the rows of `autotune simulate --csv`; the record does not depend on the number of threads; inputs that do not fit
//! are refused.

mod common;

use std::path::Path;
use std::sync::OnceLock;

use certune_closed_loop::scenario::{Goal, Noise};
use certune_closed_loop::{
    Gains, GainsFile, NoiseStream, Plant, PlantBox, Row, Sample, Scenario, Trajectory, simulate,
};
use certune_control::Controller;
use certune_control::aic::{Aic, AicParams};
use certune_dynamics::Robot;
use certune_paper::statements::Verdict;
use certune_paper::{CompareError, Comparison, Inputs, Size, compare, names};

const STEP_S: f64 = 1e-3;

/// Two arms everywhere, three candidates on one plant.
fn small() -> Inputs {
    let size = Size { seed: 3, arms: 2, grid_arms: 1, candidates: 3, search_plants: 1, time_batches: 1 };
    Inputs { size, ..common::inputs() }
}

fn on_threads(threads: usize) -> Comparison {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| compare(&small(), &|_| ())).expect("a comparison")
}

fn found() -> &'static Comparison {
    static FOUND: OnceLock<Comparison> = OnceLock::new();
    FOUND.get_or_init(|| on_threads(1))
}

fn timeless(comparison: &Comparison) -> String {
    let comparison = Comparison { measured_times: Vec::new(), ..comparison.clone() };
    serde_json::to_string_pretty(&comparison).expect("a record")
}

#[test]
fn the_record_is_the_same_for_any_number_of_threads_and_is_read_back() {
    let text = timeless(found());
    assert_eq!(text, timeless(&on_threads(2)));
    let read: Comparison = serde_json::from_str(&text).expect("what was written");
    assert_eq!(timeless(&read), text);
}

fn published() -> AicParams<7> {
    aic(include_str!("../../../tuning/presets/pezzato2020-simulation.toml"))
}

fn aic(text: &str) -> AicParams<7> {
    let Gains::Aic(table) = GainsFile::parse(Path::new("gains"), text).expect("a preset").gains else { unreachable!() };
    AicParams::new(&table.bind().expect("seven joints"), STEP_S).expect("valid gains")
}

fn scenario(text: &str) -> Scenario {
    Scenario::parse(Path::new("scenario"), text).expect("a scenario")
}

fn family(friction: f64, mass_uncertainty: f64, gravity_compensation: bool) -> PlantBox {
    PlantBox {
        mass_uncertainty,
        friction_n_m_s_per_rad: [friction; 2],
        rotor_inertia_kg_m2: [0.1; 2],
        ..PlantBox::nominal(gravity_compensation)
    }
}

/// The rows that `autotune simulate --csv` writes: one each 10 ms.
fn rows(robot: &Robot, scenario: &Scenario, plant: &Plant<7>, params: &AicParams<7>) -> Vec<Row<7, ()>> {
    let controller = Aic::<7>::new(params);
    let mut recorder = Trajectory::new(10, |_: &Sample<'_, 7, <Aic<7> as Controller<7>>::State>| ());
    simulate(plant, &scenario.bind(robot).expect("seven joints"), &controller, NoiseStream::default(), &mut recorder);
    recorder.into_rows()
}

#[test]
fn figures_of_the_nominal_arm_are_those_of_its_rows() {
    let robot = Robot::panda_cuboid();
    let mut scenario = scenario(include_str!("../../../tuning/scenarios/pick-and-place-paper.toml"));
    scenario.plant_box = family(0.0, 0.0, false);
    let plant = Plant::new(&robot, &scenario.plant_box.draw(7, 0, 0)).expect("a plant");
    let rows = rows(&robot, &scenario, &plant, &published());
    let metrics = found().approximated.of(names::AIC).and_then(|arms| arms.nominal.clone()).expect("a nominal run");
    for (index, segment) in metrics.segments.iter().enumerate().take(4) {
        let (from, until) = (600 * index, 600 * (index + 1));
        let goal = &scenario.segments[index].goal_rad;
        for joint in [0, 1, 3, 5] {
            let error = |row: usize| rows[row].q[joint] - goal[joint];
            // The row at the next goal is the end of this one.
            assert!((error(until) - segment.final_error_rad[joint]).abs() < 1e-7);
            let before =
                if index == 0 { scenario.start_rad[joint] } else { scenario.segments[index - 1].goal_rad[joint] };
            let step = goal[joint] - before;
            if step.abs() > 1e-3 {
                let outside = (from..until).filter(|row| error(*row).abs() > 0.02 * step.abs()).max().expect("a step");
                let settled = rows[outside].t_s - segment.from_s;
                // Samples lie within the 10 ms behind the row.
                let told = segment.settling_time_s[joint].expect("it settles");
                assert!((settled - 1e-9..settled + 0.0101).contains(&told), "{settled} {told}");
            }
            let speed = (from..until).map(|row| rows[row].dq[joint].abs()).fold(0.0, f64::max);
            let told = segment.peak_speed_rad_per_s[joint];
            assert!(speed <= told + 1e-9 && speed > 0.97 * told - 1e-3, "{speed} {told}");
        }
    }
    let trace = found().traces.iter().find(|trace| trace.experiment == "approximated" && trace.contender == names::AIC);
    for (row, (q, tau)) in trace.map(|trace| trace.q_rad.iter().zip(&trace.tau_n_m)).expect("a trace").enumerate() {
        for joint in 0..7 {
            assert!((q[joint] - rows[5 * row].q[joint]).abs() < 6e-5);
            assert!((tau[joint] - rows[5 * row].tau[joint]).abs() < 6e-3);
        }
    }
}

/// Both arms of the small comparison.
fn drawn(robot: &Robot, scenario: &Scenario) -> [Plant<7>; 2] {
    [0, 1].map(|index| Plant::new(robot, &scenario.plant_box.draw(7, 3, index)).expect("a plant"))
}

#[test]
fn deviations_under_payloads_are_those_of_the_rows() {
    let robot = Robot::panda();
    let mut scenario = scenario(include_str!("../../../tuning/scenarios/payload-swap.toml"));
    let goals: Vec<Vec<f64>> = scenario.segments.iter().map(|segment| segment.goal_rad.clone()).collect();
    let goal = |place: usize, duration_s| Goal { goal_rad: goals[place].clone(), duration_s };
    scenario.start_rad.clone_from(&goals[1]);
    scenario.segments = vec![goal(1, 7.0), goal(2, 5.0), goal(3, 5.0), goal(3, 4.0)];
    scenario.plant_box = family(1.0, 0.2, true);
    let params = aic(include_str!("../../../tuning/presets/pezzato2020-libfranka.toml"));
    let told = &found().payloads.of(names::AIC_ROBOT).expect("it was run").figures["lift_deviation_rad"];
    let bottle = |mass_kg: f64, plant: &Plant<7>| {
        let mut scenario = scenario.clone();
        scenario.payloads.truncate(1);
        let event = &mut scenario.payloads[0];
        (event.mass_kg, event.attach_s, event.release_s) = (mass_kg, 2.0, Some(17.0));
        rows(&robot, &scenario, plant, &params)
    };
    for (plant, told) in drawn(&robot, &scenario).iter().zip(&told.values) {
        let (light, full) = (bottle(0.1, plant), bottle(0.7, plant));
        let apart = (200..700).map(|row| (light[row].q - full[row].q).amax()).fold(0.0, f64::max);
        assert!((apart / told.expect("a figure") - 1.0).abs() < 1e-4, "{apart} {told:?}");
    }
}

#[test]
fn the_answer_to_a_push_is_that_of_the_rows() {
    let robot = Robot::panda();
    let mut scenario = scenario(include_str!("../../../tuning/scenarios/push.toml"));
    scenario.segments[0].duration_s = 10.0;
    scenario.pushes.truncate(1);
    scenario.noise = Noise::default();
    scenario.plant_box = family(1.0, 0.2, true);
    let result = found().push.of(names::AIC).expect("it was run");
    for (index, plant) in drawn(&robot, &scenario).iter().enumerate() {
        let rows = rows(&robot, &scenario, plant, &published());
        let told = |figure: &str| result.figures[figure].values[index].expect("a figure");
        let peak = rows.iter().map(|row| (row.q - row.goal).amax()).fold(0.0, f64::max);
        // The comparison looks each 5 ms.
        assert!((peak / told("peak_deviation_rad") - 1.0).abs() < 2e-3, "{peak}");
        let outside = rows.iter().rfind(|row| (row.q - row.goal).amax() > 0.1 * peak);
        let back = outside.expect("a deviation").t_s - 3.0;
        assert!((back - told("recovery_s")).abs() < 0.02, "{back}");
    }
}

#[test]
fn every_statement_is_judged_and_rests_on_readings() {
    let statements = &found().statements;
    assert!(statements.len() >= 14, "{}", statements.len());
    for statement in statements {
        assert!(!statement.readings.is_empty() && !statement.rule.is_empty() && !statement.figure.is_empty());
        assert_eq!(statement.verdict == Verdict::AgreesOnlyIf, !statement.condition.is_empty(), "{statement:?}");
        let same = |other: &&certune_paper::statements::Statement| other.name == statement.name;
        assert_eq!(statements.iter().filter(same).count(), 1, "{}", statement.name);
    }
}

#[test]
fn given_gains_are_not_searched() {
    let preset = |text| Some(GainsFile::parse(Path::new("gains"), text).expect("a preset").gains);
    let tuned_aic = preset(include_str!("../../../tuning/presets/pezzato2020-libfranka.toml"));
    let tuned_mrac = preset(include_str!("../../../tuning/presets/pezzato2020-mrac-robot.toml"));
    // Without the grid: it has tests enough.
    let size = Size { arms: 1, grid_arms: 0, ..small().size };
    let inputs = Inputs { tuned_aic: tuned_aic.clone(), tuned_mrac, size, ..small() };
    let found = compare(&inputs, &|_| ()).expect("a comparison");
    assert!(found.effort.searches.is_empty());
    let of = |name: &str| found.contenders.iter().find(|contender| contender.name == name).map(|c| c.gains.clone());
    assert_eq!(of(names::AIC_TUNED), tuned_aic);
    let effort = found.statements.iter().find(|statement| statement.name == "tuning-effort");
    assert_eq!(effort.map(|statement| statement.verdict), Some(Verdict::NotTested));
}

#[test]
fn inputs_that_do_not_fit_are_refused() {
    let swapped = Inputs { tuned_aic: Some(common::inputs().published.mrac_robot), ..small() };
    assert!(matches!(compare(&swapped, &|_| ()), Err(CompareError::Controller { found: "mrac", .. })));
    let nobody = Inputs { size: Size { arms: 0, ..small().size }, ..small() };
    assert!(matches!(compare(&nobody, &|_| ()), Err(CompareError::NoArms)));
    let mut short = small();
    short.scenarios.payloads.segments.truncate(2);
    assert!(matches!(compare(&short, &|_| ()), Err(CompareError::Scenario { what: "goals", found: 2, .. })));
    let six = Robot::panda().links()[..6].to_vec();
    let robot = Robot::new("six", Robot::panda().gravity_m_per_s2(), six).expect("an arm");
    let error = compare(&Inputs { robot, ..small() }, &|_| ()).expect_err("six joints");
    assert!(error.to_string().contains("robot six has 6 joints"), "{error}");
    let mut links = Robot::panda().links().to_vec();
    links[3].frame.xyz_m[0] += 0.01;
    let robot = Robot::new("other", Robot::panda().gravity_m_per_s2(), links).expect("an arm");
    assert!(
        matches!(Inputs { robot, ..small() }.check(), Err(CompareError::Geometry { link, .. }) if link == "panda_link4")
    );
}
