//! Contracts: the motor follows a command no faster than the task allows, and a limit that is never reached changes nothing; the monitor keeps the first violation of each kind
//! and misses none; recorders of runs side by side see what they would see alone.

use std::path::Path;

use certune_closed_loop::{
    Gains, GainsFile, Guarded, NoiseStream, Plant, PlantSetting, Recorder, Run, SafetyLimits, SafetyMonitor, Sample,
    Scenario, Task, Trajectory, simulate, simulate_many, simulate_many_recorded,
};
use certune_control::Controller;
use certune_control::aic::{Aic, AicParams};
use certune_control::mrac::{Mrac, MracParams};
use certune_dynamics::{Joints, Robot};
use proptest::prelude::*;

const STEP_S: f64 = 1e-3;

fn scenario() -> Scenario {
    let text = include_str!("../../../tuning/scenarios/pick-and-place.toml");
    let mut scenario = Scenario::parse(Path::new("pick-and-place.toml"), text).expect("a scenario");
    scenario.segments.truncate(1);
    scenario.segments[0].duration_s = 0.5;
    scenario
}

fn limited(rate: Option<f64>) -> Task<7> {
    let mut scenario = scenario();
    scenario.torque_rate_limit_n_m_per_s = rate;
    scenario.bind(&Robot::panda()).expect("seven joints")
}

fn plant(delay: usize) -> Plant<7> {
    let robot = Robot::panda();
    Plant::new(&robot, &PlantSetting::nominal(&robot, true).with_rotor_inertia(0.1).with_delay(delay)).expect("a plant")
}

fn aic_params() -> AicParams<7> {
    let text = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
    let Gains::Aic(table) = GainsFile::parse(Path::new("aic"), text).expect("a preset").gains else { unreachable!() };
    AicParams::new(&table.bind().expect("seven joints"), STEP_S).expect("valid gains")
}

fn mrac_params() -> MracParams<7> {
    let text = include_str!("../../../tuning/presets/pezzato2020-mrac-simulation.toml");
    let Gains::Mrac(table) = GainsFile::parse(Path::new("mrac"), text).expect("a preset").gains else { unreachable!() };
    MracParams::new(&table.bind().expect("seven joints"), STEP_S).expect("valid gains")
}

type Commands = Vec<(Joints<7>, Joints<7>)>;

/// What the controller asked for and what reached the motor, sample by sample.
fn commands<C: Controller<7>>(controller: &C, delay: usize, rate: Option<f64>) -> Commands {
    let mut seen = Trajectory::new(1, |sample: &Sample<'_, 7, C::State>| (sample.u, sample.command));
    simulate(&plant(delay), &limited(rate), controller, NoiseStream::default(), &mut seen);
    seen.into_rows().into_iter().map(|row| row.diagnostics).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_command_follows_as_fast_as_it_may_and_no_faster(rate in 20.0..5000.0_f64, delay in 0_usize..3) {
        let seen = commands(&Mrac::<7>::new(&mrac_params()), delay, Some(rate));
        let most = rate * STEP_S;
        let mut before = Joints::<7>::zeros();
        for (step, (_, command)) in seen.iter().enumerate() {
            let asked = step.checked_sub(delay).map_or(Joints::zeros(), |then| seen[then].0);
            for joint in 0..7 {
                let change = command[joint] - before[joint];
                prop_assert!(change.abs() <= most * (1.0 + 1e-9), "{change}");
                // Either it has arrived, or it moves towards what was asked for at the full rate.
                let left = asked[joint] - before[joint];
                let arrived = command[joint].to_bits() == asked[joint].to_bits();
                prop_assert!(arrived || (change - most.copysign(left)).abs() <= 1e-9 * (1.0 + left.abs()));
            }
            before = *command;
        }
    }

    #[test]
    fn the_monitor_finds_the_first_sample_beyond_each_limit(rate in 10.0..3000.0_f64, share in 0.02..1.2_f64) {
        let robot = Robot::panda();
        let mut limits = SafetyLimits::<7>::of(&robot, rate);
        limits.speed_rad_per_s *= share;
        limits.torque_n_m *= share;
        limits.upper_rad *= share;
        let mut both = Both(SafetyMonitor::new(limits.clone(), STEP_S), Vec::new());
        simulate(&plant(0), &limited(None), &Mrac::<7>::new(&mrac_params()), NoiseStream::default(), &mut both);
        let Both(monitor, rows) = both;
        let mut before = Joints::<7>::zeros();
        let beyond: Vec<[bool; 4]> = rows.iter().map(|(q, dq, command)| {
            let any = |condition: &dyn Fn(usize) -> bool| (0..7).any(condition);
            let found = [
                any(&|j| q[j] < limits.lower_rad[j] || q[j] > limits.upper_rad[j]),
                any(&|j| dq[j].abs() > limits.speed_rad_per_s[j]),
                any(&|j| command[j].abs() > limits.torque_n_m[j]),
                any(&|j| ((command[j] - before[j]) / STEP_S).abs() > rate * (1.0 + 1e-9)),
            ];
            before = *command;
            found
        }).collect();
        for (kind, guarded) in Guarded::ALL.into_iter().enumerate() {
            let first = beyond.iter().position(|found| found[kind]);
            let told = monitor.first_of(guarded).map(|violation| (violation.t_s / STEP_S).round() as usize);
            prop_assert_eq!(first, told, "{:?}", guarded);
        }
        let first = beyond.iter().position(|found| found.contains(&true)).map(|step| step as f64 * STEP_S);
        prop_assert_eq!(monitor.first().map(|violation| violation.t_s), first);
    }
}

/// A monitor, and what it was shown.
struct Both(SafetyMonitor<7>, Vec<(Joints<7>, Joints<7>, Joints<7>)>);

impl<S> Recorder<7, S> for Both {
    fn sample(&mut self, sample: &Sample<'_, 7, S>) {
        self.0.sample(sample);
        self.1.push((sample.at.q, sample.at.dq, sample.command));
    }
}

#[test]
fn a_rate_that_is_never_reached_changes_nothing() {
    let aic = Aic::<7>::new(&aic_params());
    let metrics = |rate| simulate(&plant(1), &limited(rate), &aic, NoiseStream::default(), &mut ());
    assert_eq!(metrics(None), metrics(Some(1000.0)));
    assert_ne!(metrics(None), metrics(Some(5.0)));
}

#[test]
fn a_limited_command_is_never_too_fast_for_the_monitor() {
    let mut monitor = SafetyMonitor::<7>::new(SafetyLimits::of(&Robot::panda(), 1000.0), STEP_S);
    let mrac = Mrac::<7>::new(&mrac_params());
    simulate(&plant(0), &limited(Some(1000.0)), &mrac, NoiseStream::default(), &mut monitor);
    assert_eq!(monitor.first_of(Guarded::TorqueRate), None);
    // Without the limiter the first command alone is.
    let mut monitor = SafetyMonitor::<7>::new(SafetyLimits::of(&Robot::panda(), 1000.0), STEP_S);
    simulate(&plant(0), &limited(None), &mrac, NoiseStream::default(), &mut monitor);
    assert_eq!(monitor.first_of(Guarded::TorqueRate).map(|violation| violation.t_s), Some(0.0));
}

#[test]
fn recorders_side_by_side_see_what_they_see_alone() {
    let (task, limited) = (limited(None), limited(Some(5.0)));
    let plants: Vec<Plant<7>> = (0..3).map(plant).collect();
    let params = aic_params();
    let tasks = [&task, &task, &task, &limited, &limited];
    let run = |(index, task)| Run { plant: &plants[index % 3], task, noise: NoiseStream::default() };
    let runs: Vec<_> = tasks.into_iter().enumerate().map(|pair| (run(pair), &params)).collect();
    let fresh = || Trajectory::new(7, |sample: &Sample<'_, 7, ()>| sample.command);
    let mut together: Vec<_> = runs.iter().map(|_| fresh()).collect();
    let figures = simulate_many_recorded(&runs, &mut together);
    assert_eq!(figures, simulate_many(&runs));
    for ((run, recorder), metrics) in runs.iter().zip(&together).zip(&figures) {
        let mut alone = Trajectory::new(7, |sample: &Sample<'_, 7, _>| sample.command);
        let single = simulate(run.0.plant, run.0.task, &Aic::<7>::new(&params), run.0.noise, &mut alone);
        assert_eq!((single.segments.len(), recorder.rows().len()), (metrics.segments.len(), alone.rows().len()));
        for (a, b) in recorder.rows().iter().zip(alone.rows()) {
            // Lanes round as a fused multiply-add does.
            assert!((a.q - b.q).amax() < 1e-9 && (a.diagnostics - b.diagnostics).amax() < 1e-6, "{a:?} {b:?}");
        }
    }
}
