//! `autotune simulate`: a scenario on one plant, and its figures.

use std::fmt::Write as _;

use certune::closed_loop::{
    Gains, Metrics, NoiseStream, Plant, PlantSetting, Recorder, Sample, Scenario, Segment, Task, Trajectory, simulate,
};
use certune::control::Controller;
use certune::control::aic::Aic;
use certune::control::mrac::Mrac;
use certune::dynamics::Robot;
use serde::Serialize;

use crate::catalogue::{self, GainsSource};
use crate::cli::{Context, Exit, SimulateArgs, Switch};
use crate::error::Error;
use crate::output::{self, number, table};
use crate::sizes::for_joint_count;

/// Rows of the CSV file: one each so many samples, 10 ms at 1 kHz.
const CSV_EVERY: u64 = 10;

#[derive(Debug, Serialize)]
struct Summary<'a> {
    robot: &'a str,
    gains: &'a str,
    scenario: &'a str,
    plant: &'a PlantSetting,
    #[serde(flatten)]
    metrics: &'a Metrics,
}

pub fn run(args: &SimulateArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let gains = GainsSource::find(&args.gains)?;
    let scenario = catalogue::scenario(args.scenario.as_deref(), &robot)?;
    let setting = setting(args, &robot, &scenario);
    let (metrics, csv) = for_joint_count!(robot.joints(), N => run_on::<N>(args, &robot, &gains, &scenario, &setting))
        .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    if let (Some(path), Some(csv)) = (&args.csv, csv) {
        output::write_file(path, &csv)?;
    }
    if context.json {
        let (robot, scenario) = (robot.name(), scenario.name.as_str());
        output::print_json(&Summary { robot, gains: &args.gains, scenario, plant: &setting, metrics: &metrics })?;
    } else {
        output::print(&in_words(args, &robot, &scenario, &setting, &metrics, context.verbose))?;
    }
    Ok(Exit::Holds)
}

/// The robot as described, with what the options change.
fn setting(args: &SimulateArgs, robot: &Robot, scenario: &Scenario) -> PlantSetting {
    let compensated =
        args.gravity_compensation.map_or(scenario.plant_box.gravity_compensation, |switch| switch == Switch::On);
    let mut setting = PlantSetting::nominal(robot, compensated)
        .with_payload(args.payload.unwrap_or(0.0))
        .with_delay(args.delay.unwrap_or(0));
    if let Some(friction) = args.friction {
        setting = setting.with_friction(friction);
    }
    if let Some(inertia) = args.rotor_inertia {
        setting = setting.with_rotor_inertia(inertia);
    }
    setting
}

fn run_on<const N: usize>(
    args: &SimulateArgs,
    robot: &Robot,
    gains: &GainsSource,
    scenario: &Scenario,
    setting: &PlantSetting,
) -> Result<(Metrics, Option<String>), Error> {
    let misfit = |source| Error::ScenarioFit {
        scenario: scenario.name.clone(),
        robot: robot.name().to_owned(),
        source: Box::new(source),
    };
    let task = scenario.bind::<N>(robot).map_err(misfit)?;
    let plant = Plant::<N>::new(robot, setting)?;
    let noise = NoiseStream { seed: args.seed.unwrap_or(1), index: 0 };
    let csv = args.csv.is_some();
    Ok(match &gains.gains.gains {
        Gains::Aic(table) => {
            let controller = Aic::<N>::new(&gains.aic_params(table, task.step_s)?);
            run_with(&plant, &task, &controller, noise, csv)
        }
        Gains::Mrac(table) => {
            let controller = Mrac::<N>::new(&gains.mrac_params(table, task.step_s)?);
            run_with(&plant, &task, &controller, noise, csv)
        }
    })
}

fn run_with<const N: usize, C: Controller<N>>(
    plant: &Plant<N>,
    task: &Task<N>,
    controller: &C,
    noise: NoiseStream,
    csv: bool,
) -> (Metrics, Option<String>) {
    if !csv {
        return (simulate(plant, task, controller, noise, &mut ()), None);
    }
    let mut recorder = Trajectory::new(CSV_EVERY, |_: &Sample<'_, N, C::State>| ());
    let metrics = record(plant, task, controller, noise, &mut recorder);
    let names = ["q_rad", "dq_rad_per_s", "goal_rad", "tau_n_m"];
    let mut text = "t_s".to_owned();
    for name in names {
        (1..=N).for_each(|joint| {
            let _ = write!(text, ",{name}_{joint}");
        });
    }
    text.push('\n');
    for row in recorder.rows() {
        let _ = write!(text, "{}", row.t_s);
        for value in [&row.q, &row.dq, &row.goal, &row.tau].into_iter().flat_map(|list| list.iter()) {
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    (metrics, Some(text))
}

fn record<const N: usize, C: Controller<N>, R: Recorder<N, C::State>>(
    plant: &Plant<N>,
    task: &Task<N>,
    controller: &C,
    noise: NoiseStream,
    recorder: &mut R,
) -> Metrics {
    simulate(plant, task, controller, noise, recorder)
}

fn in_words(
    args: &SimulateArgs,
    robot: &Robot,
    scenario: &Scenario,
    setting: &PlantSetting,
    metrics: &Metrics,
    per_joint: bool,
) -> String {
    let compensated = if setting.gravity_compensation { "gravity compensated" } else { "gravity not compensated" };
    let mut text = format!(
        "{} with {} in {}: {compensated}, payload {} kg, delay {} samples\n",
        robot.name(),
        args.gains,
        scenario.name,
        setting.payload_kg,
        setting.delay_samples
    );
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let row = |(index, segment): (usize, &Segment)| {
        vec![
            (index + 1).to_string(),
            number(Some(segment.from_s), 1),
            number(segment.slowest_settling_time_s(), 3),
            number(Some(1e3 * segment.worst_final_error_rad()), 3),
            number(Some(100.0 * segment.worst_overshoot()), 2),
            number(Some(largest(&segment.peak_torque_n_m)), 2),
            number(Some(largest(&segment.torque_rate_rms_n_m_per_s)), 1),
            segment.saturated_steps.iter().sum::<u64>().to_string(),
        ]
    };
    let header = ["move", "at s", "settles s", "error mrad", "overshoot %", "peak N m", "rate N m/s", "saturated"];
    text.push_str(&table(&header, &metrics.segments.iter().enumerate().map(row).collect::<Vec<_>>()));
    if per_joint {
        text.push_str("final error per joint, mrad\n");
        let row = |(index, segment): (usize, &Segment)| {
            let errors = segment.final_error_rad.iter().map(|error| number(Some(1e3 * error), 3));
            std::iter::once((index + 1).to_string()).chain(errors).collect()
        };
        text.push_str(&table(&[], &metrics.segments.iter().enumerate().map(row).collect::<Vec<Vec<_>>>()));
    } else {
        text.push_str("worst joint of each move; every joint with -v or --json\n");
    }
    if let Some(at_s) = metrics.diverged_at_s {
        let _ = writeln!(text, "DIVERGED at {at_s:.3} s: the run ended there");
    }
    text
}
