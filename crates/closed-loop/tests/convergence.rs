//! Contract: `pezzato2020-simulation` takes every arm with masses within 20 % of nominal and up to 0.7 kg in hand to each goal within 10 mrad.

use std::path::Path;

use certune_closed_loop::{Gains, GainsFile, NoiseStream, Plant, PlantSetting, Scenario, simulate};
use certune_control::aic::{Aic, AicParams};
use certune_dynamics::Robot;
use proptest::prelude::*;

const WITHIN_RAD: f64 = 10e-3;

proptest! {
    // 512 runs of 30 s of arm time: about 15 s on one core.
    #![proptest_config(ProptestConfig::with_cases(512))]
    #[test]
    fn every_arm_of_the_box_reaches_every_goal(
        link_mass_scale in prop::collection::vec(0.8..=1.2_f64, 7),
        payload_kg in 0.0..=0.7_f64,
        gravity_compensation: bool,
    ) {
        let robot = Robot::panda();
        let setting = PlantSetting { link_mass_scale, payload_kg, ..PlantSetting::nominal(&robot, gravity_compensation) };
        let plant = Plant::<7>::new(&robot, &setting).expect("a plant of the box");
        let file = Path::new("pick-and-place-paper.toml");
        let scenario = Scenario::parse(file, include_str!("../../../tuning/scenarios/pick-and-place-paper.toml")).expect("a scenario");
        let task = scenario.bind::<7>(&robot).expect("seven joints");
        let text = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
        let Gains::Aic(gains) = GainsFile::parse(Path::new("preset"), text).expect("a preset").gains else {
            unreachable!("an AIC preset")
        };
        let aic = Aic::new(&AicParams::new(&gains.bind().expect("seven joints"), 1e-3).expect("valid gains"));
        let metrics = simulate(&plant, &task, &aic, NoiseStream::default(), &mut ());
        prop_assert_eq!(metrics.diverged_at_s, None);
        prop_assert_eq!(metrics.segments.len(), 5);
        let worst = metrics.worst_final_error_rad();
        prop_assert!(worst < WITHIN_RAD, "{} mrad", worst * 1e3);
    }
}
