//! An arm picks up a bottle that nobody told its controller about: how far it sags, and how long it takes to forget.
//!
//! `cargo run --release -p examples --example 05_payload_swap`

use std::error::Error;
use std::path::Path;

use certune::closed_loop::{
    Gains, GainsFile, NoiseStream, Plant, PlantSetting, Row, Sample, Scenario, Trajectory, simulate,
};
use certune::control::aic::{Aic, AicParams, AicState};
use certune::dynamics::Robot;

fn main() -> Result<(), Box<dyn Error>> {
    let robot = Robot::panda();
    let file = Path::new("tuning/scenarios/payload-swap.toml");
    let swap = Scenario::parse(file, include_str!("../tuning/scenarios/payload-swap.toml"))?;
    let empty_handed = Scenario { payloads: Vec::new(), ..swap.clone() };

    let file = Path::new("tuning/presets/pezzato2020-simulation.toml");
    let preset = GainsFile::parse(file, include_str!("../tuning/presets/pezzato2020-simulation.toml"))?;
    let Gains::Aic(table) = &preset.gains else { return Err("the preset is of another controller".into()) };
    let controller = Aic::new(&AicParams::new(&table.bind::<7>()?, swap.step_s)?);
    let plant = Plant::<7>::new(&robot, &PlantSetting::nominal(&robot, true))?;

    // The same minute twice, with and without the bottles; a row each 10 ms.
    let run = |scenario: &Scenario| -> Result<Vec<Row<7, ()>>, Box<dyn Error>> {
        let mut trajectory = Trajectory::new(10, |_: &Sample<'_, 7, AicState<7>>| ());
        let metrics = simulate(&plant, &scenario.bind(&robot)?, &controller, NoiseStream::default(), &mut trajectory);
        assert_eq!((metrics.diverged_at_s, metrics.saturated_steps()), (None, 0));
        Ok(trajectory.into_rows())
    };
    let (with, without) = (run(&swap)?, run(&empty_handed)?);
    // How far the bottles alone have moved the arm: the worst joint.
    let deviation_mrad: Vec<(f64, f64)> =
        with.iter().zip(&without).map(|(with, without)| (with.t_s, 1e3 * (with.q - without.q).amax())).collect();
    let during = |from_s: f64, until_s: f64| {
        let inside = deviation_mrad.iter().filter(|(t_s, _)| (from_s..until_s).contains(t_s));
        inside.map(|(_, mrad)| *mrad).fold(0.0, f64::max)
    };

    println!("{:>8} {:>10} {:>8} {:>16} {:>18}", "bottle", "", "at", "pushed off by", "left 5 s later");
    let mut sags = Vec::new();
    for bottle in &swap.payloads {
        let release_s = bottle.release_s.ok_or("every bottle is put down")?;
        for (event, at_s) in [("picked up", bottle.attach_s), ("put down", release_s)] {
            let (peak, left) = (during(at_s, at_s + 6.0), during(at_s + 5.0, at_s + 6.0));
            println!("{:>5} kg {event:>10} {at_s:>6} s {peak:>11.2} mrad {left:>13.2} mrad", bottle.mass_kg);
            assert!(left < 0.25 * peak, "the torque has taken up the load, or let it go");
            sags.push(peak);
        }
    }

    // Before the first bottle the runs are one and the same; a bottle of seven times the mass pushes about seven times as far.
    assert!(during(0.0, swap.payloads[0].attach_s) < f64::MIN_POSITIVE);
    let ratio = swap.payloads[1].mass_kg / swap.payloads[0].mass_kg;
    for (light, heavy) in sags[..2].iter().zip(&sags[2..]) {
        let measured = heavy / light;
        assert!((measured / ratio - 1.0).abs() < 0.15, "the loop is nearly linear: {measured} for {ratio}");
    }
    Ok(())
}
