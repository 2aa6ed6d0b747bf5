//! x
use certune_closed_loop::Scenario;
use certune_dynamics::Robot;
use certune_tune::*;
use std::path::Path;
use std::time::Instant;
#[test]
fn measure() {
    let robot = Robot::panda();
    let name = std::env::var("SC").unwrap_or("pick-and-place".into());
    let scenario = Scenario::read(Path::new(&format!("../../tuning/scenarios/{name}.toml"))).unwrap();
    let space =
        Space::parse(Path::new("s"), &std::fs::read_to_string("../../tuning/spaces/panda-aic.toml").unwrap()).unwrap();
    let start = Gains {
        kappa_mu: 11.67,
        kappa_a: 700.0,
        sigma_q: 1.0,
        sigma_dq: 1.0,
        sigma_mu: 5.0,
        sigma_dmu: 10.0,
        reference_time_constant_s: 1.0,
    };
    let plants: usize = std::env::var("P").map_or(8, |x| x.parse().unwrap());
    let evals: usize = std::env::var("E").map_or(20, |x| x.parse().unwrap());
    let objective = AicObjective::<7>::new(&robot, &scenario, 0, plants, 24).unwrap();
    let params = certune_control::aic::AicParams::new(&start.on_every_joint::<7>(), 1e-3).unwrap();
    let t = Instant::now();
    println!("growth {:?} in {:?}", objective.filter().growth_per_s(&params), t.elapsed());
    let t = Instant::now();
    let v = objective.batch().judge(&start);
    println!("batch {:?} in {:?}", v.outcome, t.elapsed());
    println!("{:?}", v.plants[0]);
    let held = Batch::<7>::held_out(&robot, &scenario, 0, 16).unwrap();
    println!("held out start {:?}", held.judge(&start).outcome);
    for g in [
        start.with(Gain::SigmaDmu, 1.0),
        start.with(Gain::KappaMu, 40.0),
        start.with(Gain::KappaA, 2000.0),
        start.with(Gain::SigmaDq, 0.3),
    ] {
        let v = objective.batch().judge(&g);
        println!("{g:?} {:?} {:?} {:?}", objective.evaluate(&g), v.plants[0].outcome, v.plants[0].figures);
    }
    for (method, seed) in [(Method::NelderMead, 0), (Method::ParticleSwarm, 0)] {
        let t = Instant::now();
        let run = search(&space, Some(&start), &SearchSettings::new(method, evals, seed), &objective, &()).unwrap();
        println!("{method:?} {:?} per eval, total {:?}", t.elapsed() / evals as u32, t.elapsed());
        let mut best = f64::INFINITY;
        for e in &run.evaluations {
            if e.outcome.score() < best {
                best = e.outcome.score();
                println!("{} {:?} {:?} {:?}", e.index, e.phase, e.outcome, e.gains);
            }
        }
        println!("unsim {}", run.evaluations.iter().filter(|e| e.outcome.cost_s().is_none()).count());
        let b = run.ranked()[0];
        let v = held.judge(&b.gains);
        println!("held {:?} {:?}", v.outcome, v.plants[0].figures);
    }
}
