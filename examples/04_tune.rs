//! Better gains than the published ones, in seconds, and certified: search, certify, judge.
//!
//! `cargo run --release -p examples --example 04_tune`

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use certune::closed_loop::{Gains, GainsFile, Scenario};
use certune::dynamics::Robot;
use certune::tune::{
    Batch, Bench, Goals, Outcome, Question, SearchSettings, Setting, SimulatedObjective, SpaceFile, tune,
};
use certune::verify::ClaimKind;
use certune::{ArmCertifier, ArmGains, Request, family_of};

fn main() -> Result<(), Box<dyn Error>> {
    let robot = Robot::panda();
    let file = Path::new("tuning/scenarios/pick-and-place.toml");
    let scenario = Scenario::parse(file, include_str!("../tuning/scenarios/pick-and-place.toml"))?;
    let file = Path::new("tuning/spaces/panda-aic.toml");
    let space = SpaceFile::parse(file, include_str!("../tuning/spaces/panda-aic.toml"))?;
    let file = Path::new("tuning/presets/pezzato2020-simulation.toml");
    let published = GainsFile::parse(file, include_str!("../tuning/presets/pezzato2020-simulation.toml"))?.gains;
    let space = space.on(Setting { start: Some(&published), ..Setting::default() })?;

    // Twenty candidates, two plants of the box; a real run has 150 and 8.
    let (seed, evaluations) = (1, 20);
    let question = Question {
        robot: robot.name().to_owned(),
        robot_sha256: robot.sha256(),
        scenario: scenario.name.clone(),
        versions: BTreeMap::from([("certune".to_owned(), env!("CARGO_PKG_VERSION").to_owned())]),
        goals: Goals::default(),
        search: SearchSettings::new(space.method(), evaluations, seed),
        batch_plants: 2,
        held_out_plants: 4,
        worst_plants: 0,
        certification_attempts: 4,
    };
    // The search meets the first plants of the seed behind a filter of 16 linearised loops; the judge has plants that no candidate has met.
    let objective = SimulatedObjective::<7>::new(&robot, &scenario, seed, question.batch_plants, 16)?;
    let judge = Batch::<7>::held_out(&robot, &scenario, seed, question.held_out_plants)?;
    let bench = Bench { objective: &objective, judge: &judge, progress: &() };

    // What "certified" means is decided here: every claim, for the whole plant box.
    let certifier = ArmCertifier::<7>::new(&robot, &family_of(&scenario.plant_box)?)?;
    let asked = Request { claims: vec![ClaimKind::Exponential, ClaimKind::Region], ..Request::default() };
    let certify = |gains: &Gains| {
        let gains = ArmGains::bind(gains).map_err(|error| error.to_string())?;
        let certificate = certifier.answer(&gains, &asked).map_err(|error| error.to_string())?.certificate;
        if certificate.all_hold() { Ok(certificate) } else { Err("a claim does not hold".to_owned()) }
    };
    let tuned = tune(question, &space, Some(&published), bench, certify)?;

    let record = &tuned.record;
    let winner = record.winner().ok_or("nothing was certified")?;
    let certificate = tuned.certificate.ok_or("a winner has its certificate")?;
    let cost = |outcome: Outcome| outcome.cost().ok_or("a run without a cost");
    let start_s = cost(record.start().ok_or("the published gains are evaluated first")?.outcome)?;
    let winner_s = cost(winner.outcome)?;
    println!(
        "{} candidates: cost {start_s:.3} s with the published gains, {winner_s:.3} s tuned",
        record.evaluations.len()
    );
    println!("{:?}", winner.gains);
    for claim in certificate.checked() {
        println!("\n{}: {}", claim.kind.name(), claim.statement);
    }

    assert!(certificate.all_hold());
    assert!(matches!(winner.outcome, Outcome::Certified { .. }));
    assert!(winner_s <= start_s, "the published gains are among the candidates");
    assert!(record.held_out.tuned.is_some(), "plants that the search never met have judged it");
    Ok(())
}
