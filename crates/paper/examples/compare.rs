//! Runs the comparison and prints what each part took and found: for work on the experiments.

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::Instant;

use certune_paper::record::Experiment;
use certune_paper::{Size, compare};

fn print(experiment: &Experiment) {
    println!("\n{}: {}", experiment.name, experiment.conditions);
    for arms in &experiment.results {
        println!("  {} ({} diverged)", arms.contender, arms.diverged);
        for (name, figure) in &arms.figures {
            let quantiles = [0.0, 0.1, 0.5, 0.9, 1.0].map(|share| figure.quantile(share).unwrap_or(f64::NAN));
            println!("    {name:32} missing {:3}  {quantiles:11.4?}", figure.missing());
        }
    }
}

fn main() {
    let begun = Instant::now();
    let mut inputs = common::inputs();
    if let Some(arms) = std::env::args().nth(1).and_then(|arms| arms.parse().ok()) {
        inputs.size = Size { arms, grid_arms: arms.min(8), candidates: 10 * arms, ..inputs.size };
    }
    let told = |part: &str| eprintln!("{:6.1} s  {part}", begun.elapsed().as_secs_f64());
    let found = compare(&inputs, &told).expect("a comparison");
    eprintln!("{:6.1} s  done", begun.elapsed().as_secs_f64());
    for experiment in [
        &found.approximated,
        &found.paper_limit,
        &found.transfer.ideal,
        &found.transfer.robot,
        &found.payloads,
        &found.push,
    ] {
        print(experiment);
    }
    for cell in &found.transfer.cells {
        println!("{:?}", cell.effects);
        for result in &cell.results {
            println!(
                "  {:22} stops {} (rate apart {}) at {:?} s for {:?} joint {:?}, error {:?}, jitter {:.4?}",
                result.contender,
                result.stopped,
                result.stopped_rate_apart,
                result.stop_s,
                result.stop_for,
                result.stop_joint,
                result.worst_error_rad,
                result.acceleration_rad_per_s2
            );
        }
    }
    for search in &found.effort.searches {
        println!("{search:?}");
    }
    println!("{:?}", found.effort.reached);
    for cost in &found.cost {
        println!(
            "{cost:?} per joint {} {}",
            cost.additions as f64 / cost.joints as f64,
            cost.multiplications as f64 / cost.joints as f64
        );
    }
    println!("{:?}", found.measured_times);
    for contender in &found.contenders {
        println!("{contender:?}");
    }
    for statement in &found.statements {
        println!("{statement:?}");
    }
    let text = serde_json::to_string(&found).expect("a record");
    println!("{} bytes, of which traces {}", text.len(), serde_json::to_string(&found.traces).expect("traces").len());
    std::fs::write("compare.json", text).expect("a file");
}
