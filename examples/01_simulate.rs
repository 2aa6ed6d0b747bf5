//! The published gains on the Panda's pick-and-place: where the arm ends up, how fast, and with what torque.
//!
//! `cargo run --release -p examples --example 01_simulate`

use std::error::Error;
use std::path::Path;

use certune::closed_loop::{Gains, GainsFile, NoiseStream, Plant, PlantSetting, Scenario, simulate};
use certune::control::aic::{Aic, AicParams};
use certune::dynamics::Robot;

fn main() -> Result<(), Box<dyn Error>> {
    let robot = Robot::panda();

    // What to do, and the gains to do it with: the files that the command line ships.
    let file = Path::new("tuning/scenarios/pick-and-place.toml");
    let scenario = Scenario::parse(file, include_str!("../tuning/scenarios/pick-and-place.toml"))?;
    let file = Path::new("tuning/presets/pezzato2020-simulation.toml");
    let preset = GainsFile::parse(file, include_str!("../tuning/presets/pezzato2020-simulation.toml"))?;
    let Gains::Aic(table) = &preset.gains else { return Err("the preset is of another controller".into()) };
    let controller = Aic::new(&AicParams::new(&table.bind::<7>()?, scenario.step_s)?);

    // The arm as identified: no payload, no friction, holding up its own weight as the Panda's torque interface does. The controller
    // knows nothing of its masses.
    let plant = Plant::<7>::new(&robot, &PlantSetting::nominal(&robot, scenario.plant_box.gravity_compensation))?;

    // Thirty seconds at 1 kHz. The two last arguments would name the sensor noise and keep the trajectory.
    let metrics = simulate(&plant, &scenario.bind(&robot)?, &controller, NoiseStream::default(), &mut ());

    println!("{:>6} {:>14} {:>14} {:>14}", "goal", "worst error", "settled after", "peak torque");
    for (number, segment) in metrics.segments.iter().enumerate() {
        let settled_s = segment.slowest_settling_time_s().unwrap_or(f64::NAN);
        let peak_n_m = segment.peak_torque_n_m.iter().copied().fold(0.0, f64::max);
        let error_mrad = 1e3 * segment.worst_final_error_rad();
        println!("{:>6} {error_mrad:>9.2} mrad {settled_s:>12.2} s {peak_n_m:>10.1} N m", number + 1);
    }

    assert_eq!(metrics.segments.len(), 5);
    assert_eq!(metrics.diverged_at_s, None);
    assert_eq!(metrics.saturated_steps(), 0, "no motor is asked for more than it has");
    assert!(metrics.worst_final_error_rad() < 3e-3, "every joint ends within 3 mrad of every goal");
    for segment in &metrics.segments {
        let settled_s = segment.slowest_settling_time_s().ok_or("a joint did not settle")?;
        assert!((settled_s - 4.05).abs() < 0.1, "settled after {settled_s} s, expected about 4.05 s");
        assert!(segment.worst_overshoot() < 1e-3, "no joint runs past its goal");
    }
    Ok(())
}
