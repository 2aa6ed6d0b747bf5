//! Where the published gains stop being stable: the torque gain is halved until the certifier refuses, the boundary is bisected, and
//! the arm that the refusal names does run away.
//!
//! `cargo run --release -p examples --example 03_lose_stability`

use std::error::Error;
use std::path::Path;

use certune::closed_loop::{Gains, GainsFile, PlantBox, PlantSetting, linearise_aic};
use certune::control::aic::{AicGains, AicParams};
use certune::dynamics::Robot;
use certune::linsys::Joints;
use certune::verify::{Attained, Certificate, Claim, ClaimKind, RefusedClaim};
use certune::{ArmCertifier, family_of, growth};

/// A refusal, and the arm and configuration that it names.
fn attained(certificate: &Certificate) -> Option<(&RefusedClaim, &Attained)> {
    let Claim::Refused(refused) = &certificate.document().claims[0].claim else { return None };
    Some((refused, refused.attained.as_ref()?))
}

fn main() -> Result<(), Box<dyn Error>> {
    // The Panda as it is described, without friction, and nobody holds up its weight: the torque gain has to.
    let robot = Robot::panda();
    let certifier = ArmCertifier::<7>::new(&robot, &family_of(&PlantBox::nominal(false))?)?;
    let file = Path::new("tuning/presets/pezzato2020-simulation.toml");
    let preset = GainsFile::parse(file, include_str!("../tuning/presets/pezzato2020-simulation.toml"))?;
    let Gains::Aic(table) = &preset.gains else { return Err("the preset is of another controller".into()) };
    let published = table.bind::<7>()?;
    let with = |kappa_a: f64| AicGains { kappa_a: [kappa_a; 7], ..published };
    let examine = |kappa_a: f64| -> Result<Certificate, Box<dyn Error>> {
        let certificate = certifier.certify(&with(kappa_a), &[ClaimKind::Exponential])?;
        println!("kappa_a = {kappa_a:>5.1}: {:?}", certificate.checked()[0].verdict);
        Ok(certificate)
    };

    let mut held = published.kappa_a[0];
    assert!(examine(held)?.all_hold(), "the published gains are stable");
    // Halved until an arm is found that is unstable, then bisected between the gains that hold and those that do not.
    let mut refused_at = held / 2.0;
    let (lost, refusal) = loop {
        let certificate = examine(refused_at)?;
        if attained(&certificate).is_some() {
            break (refused_at, certificate);
        }
        (held, refused_at) = (refused_at, refused_at / 2.0);
    };
    while held / refused_at > 1.01 {
        let middle = (held * refused_at).sqrt();
        *if examine(middle)?.all_hold() { &mut held } else { &mut refused_at } = middle;
    }
    println!(
        "\nevery linearised loop is proved stable at {held:.1}, not at {refused_at:.1}; at {lost:.1} an arm is unstable"
    );

    // The refusal names a configuration. Its loop, linearised here again, has a pole right of zero; with the gain that held, none.
    let (refused, at) = attained(&refusal).ok_or("no arm was found")?;
    let q = Joints::<7>::from_iterator(at.q_rad.iter().map(|angle| angle.to_f64()));
    let model = PlantSetting::nominal(&robot, false).model::<7>(&robot)?;
    let slowest = |kappa_a: f64| -> Result<f64, Box<dyn Error>> {
        let closed = linearise_aic(&model, &q, &AicParams::new(&with(kappa_a), 1e-3)?, false)?;
        Ok(closed.eigenvalues().iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max))
    };
    let (stable, unstable) = (slowest(held)?, slowest(lost)?);
    println!(
        "at q = {:.2?} rad the slowest pole is {stable:.3} /s at {held:.1} and {unstable:.3} /s at {lost:.1}",
        q.as_slice()
    );
    assert!(stable < 0.0 && unstable > 0.0);

    // And the nonlinear arm, released a thousandth of a radian beside that configuration, leaves it.
    let run = growth::<7>(&robot, refusal.document(), refused)?.ok_or("nothing to simulate")?;
    println!("in {} s a deviation of {:.4} rad grows to {:.4} rad", run.after_s, run.from_rad, run.to_rad);
    assert!(run.to_rad > run.from_rad);
    assert!(lost <= refused_at && refused_at < held && held < 350.0);
    Ok(())
}
