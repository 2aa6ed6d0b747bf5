//! The published gains with a certificate: a statement about every arm of a family, which anybody can check and nobody can edit.
//!
//! `cargo run --release -p examples --example 02_certify`

use std::error::Error;
use std::path::Path;

use certune::closed_loop::{Gains, GainsFile, Scenario};
use certune::dynamics::Robot;
use certune::verify::{ClaimKind, Grade, Rejection, Verdict, verify};
use certune::{ArmCertifier, certificate_text, family_of};

fn main() -> Result<(), Box<dyn Error>> {
    // The family: the plants that the scenario's box declares, any configuration.
    let file = Path::new("tuning/scenarios/pick-and-place.toml");
    let scenario = Scenario::parse(file, include_str!("../tuning/scenarios/pick-and-place.toml"))?;
    let certifier = ArmCertifier::<7>::new(&Robot::panda(), &family_of(&scenario.plant_box)?)?;

    let file = Path::new("tuning/presets/pezzato2020-simulation.toml");
    let preset = GainsFile::parse(file, include_str!("../tuning/presets/pezzato2020-simulation.toml"))?;
    let Gains::Aic(table) = &preset.gains else { return Err("the preset is of another controller".into()) };
    let certificate = certifier.certify(&table.bind()?, &[ClaimKind::Exponential, ClaimKind::Region])?;
    for claim in certificate.checked() {
        println!("{}: {}\n", claim.kind.name(), claim.statement);
        // The arm's constants are sampled, so the claims hold if those do; the certificate never says "proved".
        assert_eq!((claim.verdict, claim.grade), (Verdict::Holds, Some(Grade::Conditional)));
    }
    for assumption in certificate.assumptions() {
        println!("assumed: {}", assumption.text);
    }

    // Whoever gets the file needs neither this robot nor this solver: the checker derives every matrix again, in exact arithmetic.
    let text = certificate_text(&certificate)?;
    let again = verify(&text, &[])??;
    assert_eq!(again.checked(), certificate.checked());

    // One digit of one gain changed in the file, and it is rejected.
    let edited = text.replacen("11.67", "11.68", 1);
    assert_ne!(edited, text, "the gain stands in the file as it was written");
    let rejection = verify(&edited, &[])?.err().ok_or("an edited certificate was accepted")?;
    println!("\nwith one digit edited: {rejection}");
    assert!(matches!(rejection, Rejection::Hash { .. }));
    Ok(())
}
