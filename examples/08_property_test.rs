//! Gains as a property that one's own CI tests: on any arm of the family the goal is reached; a failure shrinks to the simplest arm.
//!
//! `cargo run --release -p examples --example 08_property_test`

use std::error::Error;

use certune::closed_loop::{NoiseStream, Plant, PlantBox, PlantSetting, Scenario, simulate};
use certune::control::aic::{Aic, AicGains, AicParams};
use certune::dynamics::Robot;
use certune_testkit::{PUBLISHED, PlantNumbers, PlantRanges, plant_numbers};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestError, TestRunner};

/// The property, as it would stand in a test file: these gains take this arm to the goal.
fn reaches_the_goal(gains: &AicGains<7>, arm: &PlantNumbers<7>) -> Result<(), TestCaseError> {
    let robot = Robot::panda();
    let setting = PlantSetting {
        link_mass_scale: arm.link_mass_scale.to_vec(),
        payload_kg: arm.payload_kg,
        viscous_n_m_s_per_rad: arm.viscous_n_m_s_per_rad.to_vec(),
        rotor_inertia_kg_m2: arm.rotor_inertia_kg_m2.to_vec(),
        ..PlantSetting::nominal(&robot, true)
    };
    let plant = Plant::<7>::new(&robot, &setting)?;
    let mut scenario = Scenario::generic(&robot, PlantBox::nominal(true));
    scenario.segments.truncate(1);
    let controller = Aic::new(&AicParams::new(gains, scenario.step_s)?);
    let metrics = simulate(&plant, &scenario.bind(&robot)?, &controller, NoiseStream::default(), &mut ());
    prop_assert_eq!(metrics.diverged_at_s, None, "the arm runs away");
    let error_rad = metrics.worst_final_error_rad();
    prop_assert!(error_rad < 10e-3, "{:.1} mrad off after 6 s", 1e3 * error_rad);
    Ok(())
}

/// Proptest's own runner, so that this story can look at a failure; in a test file the macro `proptest!` stands here.
fn test(cases: u32, gains: &AicGains<7>) -> Result<(), Box<TestError<PlantNumbers<7>>>> {
    let rng = proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha);
    let config = Config { cases, failure_persistence: None, max_shrink_iters: 2000, ..Config::default() };
    // Links within 20 % of their masses, up to a full bottle in hand, friction, rotor inertia: what pick-and-place declares.
    let arms = plant_numbers::<7>(&PlantRanges::pick_and_place());
    TestRunner::new_with_rng(config, rng).run(&arms, |arm| reaches_the_goal(gains, &arm)).map_err(Box::new)
}

fn main() -> Result<(), Box<dyn Error>> {
    let published = PUBLISHED.on_every_joint::<7>();
    test(64, &published)?;
    println!("the published gains reach the goal on 64 arms of the family");

    // A torque too slow for a bottle: the runner finds an arm that misses, and makes it as ordinary as a failing arm can be.
    let slow = AicGains { kappa_a: [100.0; 7], ..published };
    let Err(TestError::Fail(reason, arm)) = test(64, &slow).map_err(|error| *error) else {
        return Err("slow gains passed".into());
    };
    println!("\nwith kappa_a = 100: {reason}, on the arm\n{arm:.2?}");
    assert!(reaches_the_goal(&slow, &arm).is_err() && reaches_the_goal(&published, &arm).is_ok());
    // What is left is what matters: the links are those of the description, the hand holds most of a full bottle.
    assert!(arm.link_mass_scale.iter().all(|scale| (scale - 1.0).abs() < 1e-6) && arm.payload_kg > 0.4);
    let empty_handed = PlantNumbers { payload_kg: 0.0, ..arm };
    assert!(reaches_the_goal(&slow, &empty_handed).is_ok());
    Ok(())
}
