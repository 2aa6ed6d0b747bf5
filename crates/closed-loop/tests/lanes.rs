//! Contract: a run is the same to the bit whatever it is run beside, and the same as alone up to rounding.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::path::Path;

use certune_closed_loop::scenario::{Noise, PayloadEvent, Push};
use certune_closed_loop::{
    Metrics, NoiseStream, Plant, PlantSetting, Run, Scenario, Task, simulate, simulate_many, simulate_many_on,
};
use certune_control::aic::{Aic, AicGains, AicParams};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams};
use certune_dynamics::Robot;
use certune_simd::InstructionSet;
use certune_testkit::PUBLISHED;
use proptest::prelude::*;

fn scenario() -> Scenario {
    let file = Path::new("pick-and-place.toml");
    Scenario::parse(file, include_str!("../../../tuning/scenarios/pick-and-place.toml")).unwrap()
}

/// Runs that differ in everything a lane may differ in.
struct Mixed {
    plants: Vec<Plant<7>>,
    tasks: Vec<Task<7>>,
    gains: Vec<AicParams<7>>,
}

impl Mixed {
    fn new(count: usize, seed: u64) -> Self {
        let robot = Robot::panda();
        let mut mixed = Self { plants: Vec::new(), tasks: Vec::new(), gains: Vec::new() };
        for index in 0..count {
            let mut scenario = scenario();
            let setting = scenario.plant_box.draw(7, seed, index as u64);
            let setting = PlantSetting {
                delay_samples: index % 3,
                gravity_compensation: index % 5 != 4,
                coulomb_n_m: vec![if index % 4 == 3 { 0.3 } else { 0.0 }; 7],
                ..setting
            };
            if index % 4 == 1 {
                let (com_m, about_com_kg_m2) = (None, [0.0; 6]);
                let load = PayloadEvent { mass_kg: 0.5, com_m, about_com_kg_m2, attach_s: 1.0, release_s: Some(9.0) };
                scenario.payloads = vec![load];
                scenario.segments.swap(0, 1);
            }
            if index % 4 == 2 {
                let push = |torque_n_m, flange_force_n| Push { from_s: 2.0, until_s: 2.5, torque_n_m, flange_force_n };
                scenario.pushes = vec![push(Some(vec![1.0; 7]), None), push(None, Some([0.0, 5.0, 5.0]))];
                scenario.noise = Noise { q_rad: 1e-5, dq_rad_per_s: 1e-4 };
            }
            // Stable with two samples of delay, or without compensation: a loop that chatters at its limits multiplies rounding instead of forgetting it.
            let kappa_a = [if setting.gravity_compensation { 300.0 } else { 700.0 } + 20.0 * index as f64];
            mixed.plants.push(Plant::new(&robot, &setting).unwrap());
            mixed.tasks.push(scenario.bind(&robot).unwrap());
            mixed.gains.push(AicParams::new(&AicGains { kappa_a, ..PUBLISHED }.on_every_joint(), 1e-3).unwrap());
        }
        mixed
    }

    fn runs(&self) -> Vec<(Run<'_, 7>, &AicParams<7>)> {
        (0..self.plants.len())
            .map(|index| {
                let noise = NoiseStream { seed: 5, index: index as u64 };
                (Run { plant: &self.plants[index], task: &self.tasks[index], noise }, &self.gains[index])
            })
            .collect()
    }

    fn alone(&self, index: usize) -> Metrics {
        let (run, gains) = self.runs()[index];
        simulate(run.plant, run.task, &Aic::new(gains), run.noise, &mut ())
    }
}

/// The smooth figures of both, number by number; those that count samples may differ by one.
fn assert_near(lanes: &Metrics, alone: &Metrics, relative: f64) {
    assert_eq!(lanes.diverged_at_s, alone.diverged_at_s);
    assert_eq!(lanes.segments.len(), alone.segments.len());
    for (a, b) in lanes.segments.iter().zip(&alone.segments) {
        assert_eq!((a.from_s.to_bits(), a.duration_s.to_bits()), (b.from_s.to_bits(), b.duration_s.to_bits()));
        let pairs = [
            (&a.final_error_rad, &b.final_error_rad),
            (&a.peak_torque_n_m, &b.peak_torque_n_m),
            (&a.torque_rate_rms_n_m_per_s, &b.torque_rate_rms_n_m_per_s),
            (&a.itae_rad_s2, &b.itae_rad_s2),
            (&a.energy_j, &b.energy_j),
            (&a.peak_speed_rad_per_s, &b.peak_speed_rad_per_s),
        ];
        for (a, b) in pairs {
            // Relative to the run's own size, a radian, a newton metre: what is left of an error holds the rounding of the positions.
            let size = b.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() <= relative * size, "{a} against {b}");
            }
        }
        for (a, b) in a.settling_time_s.iter().zip(&b.settling_time_s) {
            assert!(a.is_some() == b.is_some() && (a.unwrap_or(0.0) - b.unwrap_or(0.0)).abs() < 1.5e-3);
        }
    }
}

#[test]
fn lanes_agree_with_single_runs_over_thirty_seconds() {
    // Rounding of 30,000 steps of a loop that forgets it.
    const RELATIVE: f64 = 1e-12;
    let mixed = Mixed::new(11, 3);
    for (index, lanes) in simulate_many(&mixed.runs()).iter().enumerate() {
        assert!((lanes.segments.iter().map(|s| s.duration_s).sum::<f64>() - 30.0).abs() < 1e-9);
        assert_near(lanes, &mixed.alone(index), RELATIVE);
    }
}

#[test]
fn on_plain_numbers_a_bundle_is_a_single_run_to_the_bit() {
    let mixed = Mixed::new(5, 8);
    for (index, found) in simulate_many_on(InstructionSet::Plain, &mixed.runs()).into_iter().enumerate() {
        assert_eq!(found, mixed.alone(index));
    }
}

#[test]
fn a_lane_that_diverges_leaves_the_others_alone() {
    let mut mixed = Mixed::new(8, 4);
    let calm = simulate_many(&mixed.runs());
    // sigma_dq = 5 runs away.
    mixed.gains[2] = AicParams::new(&AicGains { sigma_dq: [5.0], ..PUBLISHED }.on_every_joint(), 1e-3).unwrap();
    let found = simulate_many(&mixed.runs());
    for (index, (found, calm)) in found.iter().zip(&calm).enumerate() {
        if index == 2 {
            let alone = mixed.alone(2);
            let times = [found.diverged_at_s.unwrap(), alone.diverged_at_s.unwrap()];
            // It grows fast enough for rounding to shift the end by samples.
            assert!((times[0] - times[1]).abs() < 0.02, "{times:?}");
        } else {
            assert_eq!(found, calm);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn a_run_does_not_depend_on_what_it_is_run_beside(order in Just((0..9_usize).collect::<Vec<_>>()).prop_shuffle(), taken in 1..9_usize) {
        let mut mixed = Mixed::new(9, 6);
        for task in &mut mixed.tasks {
            task.segments.truncate(2);
            task.segments.iter_mut().for_each(|segment| segment.steps = 1_500);
        }
        let runs = mixed.runs();
        let together = simulate_many(&runs);
        let some: Vec<_> = order.iter().take(taken).map(|index| runs[*index]).collect();
        for (found, index) in simulate_many(&some).iter().zip(&order) {
            prop_assert_eq!(found, &together[*index]);
        }
    }
}

/// Gains of an adaptive controller that differ from run to run, in inertia and damping those of the Panda.
fn adaptive(index: usize, law: MracLaw) -> MracParams<7> {
    let each = |value: f64| [value; 7];
    let gains = MracGains {
        law,
        omega_rad_per_s: each(3.0 + 0.1 * index as f64),
        zeta: each(1.0),
        l1: each(1.0),
        l2: each(0.2),
        alpha: [[900.0, 900.0, 600.0, 400.0, 20.0, 20.0, 20.0], each(30.0), each(0.0)],
        e0: [each(1.0), each(0.5), each(0.0)],
        e1: [each(5.0), each(0.5), each(if index % 3 == 2 { 1e-4 } else { 0.0 })],
        f0: [each(1.0), each(0.5), each(0.0)],
        f1: [each(1.0), each(0.5), each(0.0)],
    };
    MracParams::new(&gains, 1e-3).unwrap()
}

#[test]
fn adaptive_controllers_run_in_lanes_as_alone_whatever_their_laws() {
    let mixed = Mixed::new(9, 3);
    let laws = [MracLaw::ReferenceModel, MracLaw::ReferenceModel, MracLaw::RawGoal];
    let params: Vec<MracParams<7>> = (0..9).map(|index| adaptive(index, laws[index / 3])).collect();
    let runs: Vec<_> = mixed.runs().into_iter().zip(&params).map(|((run, _), params)| (run, params)).collect();
    let alone = |index: usize| {
        let (run, params) = runs[index];
        simulate(run.plant, run.task, &Mrac::new(params), run.noise, &mut ())
    };
    // Adaptive gains keep what rounding has put into them: the loop forgets less than that of the AIC.
    const RELATIVE: f64 = 1e-9;
    for (index, lanes) in simulate_many(&runs).iter().enumerate() {
        assert!(lanes.diverged_at_s.is_none(), "run {index} tests nothing");
        assert_near(lanes, &alone(index), RELATIVE);
    }
    for (index, plain) in simulate_many_on(InstructionSet::Plain, &runs).into_iter().enumerate() {
        assert_eq!(plain, alone(index));
    }
    let backwards: Vec<_> = runs.iter().rev().copied().collect();
    let together = simulate_many(&runs);
    for (found, expected) in simulate_many(&backwards).iter().zip(together.iter().rev()) {
        assert_eq!(found, expected);
    }
}
