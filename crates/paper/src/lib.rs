//! The experiments of the paper that both controllers come from, run again on our plants, and what is left of its statements.
//!
//! C. Pezzato, R. Ferrari, C. Hernandez Corbato, "A Novel Adaptive Controller for Robot Manipulators Based on Active Inference", IEEE Robotics and Automation Letters 5(2), 2020.
//!
//! | module | what it holds |
//! |--------|---------------|
//! | `inputs` | arms, gains, scenarios and search spaces, given as data |
//! | `tuning` | searches for gains of both controllers, alike in everything |
//! | `pick_and_place` | the approximated model, and the same gains on the identified arm over a grid of plant effects |
//! | `payloads`, `push`, `cost` | two bottles; a push at the flange; operations and time of a step |
//! | `runs`, `watch` | controllers on many arms side by side, and what is read off a run while it goes on |
//! | [`statistics`] | quantiles, and an exact paired test |
//! | [`record`](mod@record) | what a comparison leaves behind |
//! | [`statements`] | the paper's statements in our words, with rules, readings and verdicts |
//!
//! Limits: everything is simulated; rigid joints and links, no Coulomb friction, no contact. The gravity compensation of the identified arm knows the arm's own masses exactly.
#![forbid(unsafe_code)]

mod cost;
mod error;
mod inputs;
mod payloads;
mod pick_and_place;
mod push;
pub mod record;
mod runs;
pub mod statements;
pub mod statistics;
mod tuning;
mod watch;

pub use error::CompareError;
pub use inputs::{Inputs, Published, Scenarios, Size, Spaces, names};
pub use record::{COMPARISON_SCHEMA, Comparison};
pub use tuning::matched_omega_rad_per_s;

/// Runs all experiments, and judges every statement.
///
/// `told` hears the name of each part before it begins. Runs on the current rayon pool; but for [`Comparison::measured_times`] the record is the same to the bit whatever its number of threads.
///
/// # Errors
/// [`CompareError`] when arms, gains, scenarios or spaces do not fit the experiments.
pub fn compare(inputs: &Inputs, told: &dyn Fn(&str)) -> Result<Comparison, CompareError> {
    inputs.check()?;
    let mut contenders = inputs.published();
    let (tuned, effort) = tuning::tune(inputs, told)?;
    contenders.extend(tuned);
    let mut traces = Vec::new();
    told("approximated model");
    let approximated = pick_and_place::approximated(inputs, &contenders, &mut traces)?;
    told("the paper's torque limit");
    let paper_limit = pick_and_place::paper_limit(inputs, &contenders)?;
    told("transfer to the identified arm");
    let transfer = pick_and_place::transfer(inputs, &contenders, &mut traces)?;
    told("payloads");
    let payloads = payloads::payloads(inputs, &contenders, &mut traces)?;
    told("push");
    let push = push::push(inputs, &contenders, &mut traces)?;
    told("cost of a step");
    let (cost, measured_times) = cost::cost(inputs.size.time_batches)?;
    let mut comparison = Comparison {
        schema: COMPARISON_SCHEMA,
        question: inputs.question(),
        contenders,
        approximated,
        paper_limit,
        transfer,
        payloads,
        push,
        cost,
        effort,
        traces,
        statements: Vec::new(),
        findings: Vec::new(),
        measured_times,
    };
    comparison.statements = statements::statements(&comparison);
    comparison.findings = statements::findings(&comparison);
    Ok(comparison)
}
