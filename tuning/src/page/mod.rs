//! A run's record into the data of its page.
//!
//! What the record does not hold, the course of single runs, is simulated again: the same numbers come out, so `tune` and `report`
//! make the same page. The nominal plant is the middle of the scenario's plant box.

mod comparison;
mod evidence;
mod figures;
mod learnt;
mod maps;
mod runs;

use certune::closed_loop::{Gains, PlantBox};
use certune::dynamics::Robot;
use certune::report::{
    Asked, CommandLine, CostMeaning, Evaluation, GainRow, Pair, RangeRow, SearchBounds, SearchRecord, SensitivityRow,
    TuningReport, Version, tuning_report,
};
use certune::tune::{Goal, Goals, Outcome, Phase, RunRecord, Scale, Source, Termination};

use crate::catalogue;
use crate::error::Error;
use crate::promise;
use crate::run::{Folder, Run};

pub use comparison::comparison_page;
pub use figures::{FIGURES, Spread, spread};
pub use runs::largest_error;

/// Two values this close, as a fraction of the range, are called the same.
const ON_BOUND: f64 = 0.005;

/// The page of a run on an arm of `N` joints. `robot_argument` names the robot in the commands that the page shows.
pub fn page<const N: usize>(run: &Run, robot: &Robot, robot_argument: &str, folder: &Folder) -> Result<String, Error> {
    let record = &run.file.record;
    let gains = compared(run)?;
    let runs = runs::runs::<N>(run, robot, &gains)?;
    let certified = record.winner.is_some();
    let report = TuningReport {
        asked: asked(run, robot, robot_argument),
        gains: gain_rows(record, robot, &gains),
        response: runs.response,
        segments: runs.segments,
        held_out: runs.held_out,
        search: search(record),
        sensitivity: sensitivity(record),
        learnt: learnt::learnt(run, &gains, runs.cost_parts, maps::slices::<N>(run, robot, &gains)?),
        certificate: evidence::evidence::<N>(run, robot, &gains)?,
        recheck: recheck(run, robot_argument, folder, certified),
        method: method(run, certified),
        versions: record
            .question
            .versions
            .iter()
            .map(|(name, version)| Version { name: name.clone(), version: version.clone() })
            .collect(),
    };
    Ok(tuning_report(&report)?)
}

/// The published gains, and the winner or, without one, the candidate of the lowest cost.
fn compared(run: &Run) -> Result<Pair<Gains>, Error> {
    let record = &run.file.record;
    let published = match record.start() {
        Some(start) => start.gains.clone(),
        None => catalogue::GainsSource::find(&run.file.preset)?.gains.gains,
    };
    let best = || record.evaluations.iter().min_by_key(|evaluation| (evaluation.outcome, evaluation.index));
    let tuned = record.winner().or_else(best).map_or_else(|| published.clone(), |found| found.gains.clone());
    Ok(Pair { published, tuned })
}

fn asked(run: &Run, robot: &Robot, robot_argument: &str) -> Asked {
    let question = &run.file.record.question;
    Asked {
        robot: question.robot.clone(),
        joints: robot.joints(),
        controller: run.file.controller.clone(),
        preset: run.file.preset.clone(),
        scenario: question.scenario.clone(),
        scenario_in_words: run.file.scenario.description.clone(),
        plant_box: plant_box_rows(&run.file.scenario.plant_box),
        cost: CostMeaning {
            unit: question.goals.for_comparison().objective.cost_unit().to_owned(),
            in_words: cost_in_words(&question.goals),
        },
        seed: question.search.seed,
        budget: question.search.evaluations as u64,
        command: command(run, robot_argument),
    }
}

/// What the cost of the held-out plants means, after what the search was after if that is something else, and before what had to be kept.
fn cost_in_words(goals: &Goals) -> String {
    let judged = goals.for_comparison();
    let sought = if judged.objective == goals.objective {
        String::new()
    } else {
        format!(
            "The search was after the best {}. The held-out plants are compared by this cost. ",
            words(goals.objective)
        )
    };
    let cost = match judged.objective {
        Goal::SettlingCost => "Per move: lag (the time constant of a first-order arm with the same time-weighted error) + torque-rate RMS over \
             1000 N m/s + overshoot + time at the torque limits; mean over the moves"
            .to_owned(),
        objective => format!("Per run: {}", words(objective)),
    };
    let limits: Vec<String> = goals.limits.iter().map(ToString::to_string).collect();
    let kept =
        if limits.is_empty() { String::new() } else { format!(" Limits on every plant: {}.", limits.join(", ")) };
    format!("{sought}{cost}, then over the worst {} % of the plants.{kept}", percent_of_tail(goals))
}

/// A goal's name as a sentence has it.
fn words(goal: Goal) -> String {
    goal.name().replace('-', " ")
}

/// The share of the plants that make the cost, %.
pub fn percent_of_tail(goals: &Goals) -> f64 {
    (1e6 * (1.0 - goals.cvar)).round() / 1e4
}

/// The command that repeats the run; a scenario or space that is not built in is named by a file of its name.
fn command(run: &Run, robot_argument: &str) -> String {
    let question = &run.file.record.question;
    let search = &question.search;
    let scenario = &run.file.scenario;
    let mut command = format!("autotune --robot {}", quoted(robot_argument));
    if catalogue::is_built_in(scenario) {
        command.push_str(&format!(" --scenario {}", scenario.name));
    } else if scenario.name != "generic" {
        command.push_str(&format!(" --scenario {}", quoted(&format!("{}.toml", scenario.name))));
    }
    if !catalogue::SPACES.iter().any(|(name, _)| *name == run.file.space_name) {
        command.push_str(&format!(" --space {}", quoted(&format!("{}.toml", run.file.space_name))));
    } else if run.file.space_name != catalogue::SPACES[0].0 {
        command.push_str(&format!(" --controller {}", run.file.controller));
    }
    command.push_str(&format!(" --objective {}", question.goals.objective));
    command.push_str(&format!(" --seed {} --budget {}", search.seed, search.evaluations));
    command
}

/// An argument for a shell.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.' | '/' | ':' | '\\');
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', r"'\''"))
    }
}

fn plant_box_rows(plants: &PlantBox) -> Vec<RangeRow> {
    let row = |name: &str, [lower, upper]: [f64; 2], unit: &str| RangeRow {
        name: name.to_owned(),
        lower,
        upper,
        unit: unit.to_owned(),
    };
    let switch = f64::from(u8::from(plants.gravity_compensation));
    vec![
        row("link masses over nominal", [1.0 - plants.mass_uncertainty, 1.0 + plants.mass_uncertainty], ""),
        row("payload", plants.payload_kg, "kg"),
        row("viscous friction", plants.friction_n_m_s_per_rad, "N m s/rad"),
        row("rotor inertia", plants.rotor_inertia_kg_m2, "kg m²"),
        row("delay", plants.delay_samples.map(|samples| samples as f64), "samples"),
        row("gravity compensation by the arm", [switch; 2], "1 on, 0 off"),
    ]
}

/// A row for each row of the gains file, or for each of its joints where they differ.
fn gain_rows(record: &RunRecord, robot: &Robot, gains: &Pair<Gains>) -> Vec<GainRow> {
    let rows = gains.published.rows().into_iter().zip(gains.tuned.rows());
    rows.flat_map(|((name, published), (_, tuned))| {
        let row = |joint: Option<usize>| {
            let index = joint.unwrap_or(0);
            let (published, tuned) = (published.of(index).unwrap_or(f64::NAN), tuned.of(index).unwrap_or(f64::NAN));
            GainRow {
                name: name.to_owned(),
                joint: joint.and_then(|joint| robot.links().get(joint)).map(|link| link.joint_name.clone()),
                unit: unit(name).to_owned(),
                published,
                tuned,
                bounds: bounds(record, name, index, tuned),
            }
        };
        if published.shared().is_some() && tuned.shared().is_some() {
            vec![row(None)]
        } else {
            (0..robot.joints()).map(|joint| row(Some(joint))).collect()
        }
    })
    .collect()
}

fn unit(row: &str) -> &'static str {
    match row {
        "kappa_mu" => "1/s",
        "kappa_a" => "N m/(rad s)",
        "omega_rad_per_s" => "rad/s",
        "reference_time_constant_s" => "s",
        _ => "",
    }
}

/// The range of a number in the search; none for one that was fixed.
fn bounds(record: &RunRecord, row: &str, joint: usize, tuned: f64) -> Option<SearchBounds> {
    let unit = |knob: &certune::tune::Knob| knob.per_unit.get(row)?.of(joint).filter(|unit| *unit > 0.0);
    let (range, unit) = record.space.knobs.iter().find_map(|knob| Some((knob.range, unit(knob)?)))?;
    let (lower, upper) = (range.lower * unit, range.upper * unit);
    let place = match range.scale {
        Scale::Log => (tuned / lower).ln() / (upper / lower).ln(),
        Scale::Linear => (tuned - lower) / (upper - lower),
    };
    Some(SearchBounds { lower, upper, on_bound: !(ON_BOUND..=1.0 - ON_BOUND).contains(&place) })
}

fn search(record: &RunRecord) -> SearchRecord {
    let objective = record.question.goals.objective;
    let asks_each = objective.source() == Source::Proved || is_adaptive(record);
    // Costs of different rounds are not comparable: with every plant that joins, the best is sought anew.
    let mut best_so_far: Option<f64> = None;
    let mut round = 0;
    let evaluations = record.evaluations.iter().map(|evaluation| {
        // A candidate without a certificate has no figure to compare.
        let cost = match evaluation.outcome {
            Outcome::Uncertified { .. } if asks_each => None,
            outcome => outcome.cost(),
        };
        if evaluation.round != round {
            (round, best_so_far) = (evaluation.round, None);
        }
        best_so_far = match (best_so_far, cost) {
            (Some(best), Some(cost)) => Some(best.min(cost)),
            (best, cost) => best.or(cost),
        };
        let phase = match evaluation.phase {
            Phase::Start => "start",
            Phase::Simplex => "nelder-mead",
            Phase::Scatter => "scatter",
            Phase::CmaEs { .. } => "cma-es",
            Phase::Retest => "retest",
            Phase::Polish => "polish",
            Phase::Swarm { .. } => "particle-swarm",
        };
        let outcome = match evaluation.outcome {
            Outcome::Certified { .. } => "certified",
            Outcome::Simulated { .. } => "simulated, certificate not asked for",
            Outcome::Stopped { .. } => "given up",
            Outcome::Violates { .. } => "beyond a limit",
            Outcome::Uncertified { .. } => "certificate refused",
            Outcome::Unstable { .. } => "unstable",
            Outcome::Diverged { .. } => "diverged",
        };
        Evaluation {
            index: evaluation.index as u64,
            phase: phase.to_owned(),
            outcome: outcome.to_owned(),
            cost,
            best_so_far,
        }
    });
    SearchRecord {
        evaluations: evaluations.collect(),
        unit: objective.cost_unit().to_owned(),
        published_cost: record.start().and_then(|start| start.outcome.cost()),
    }
}

/// Whether the run is about the adaptive controller, whose search asks the certifier about each candidate that finishes the task.
fn is_adaptive(record: &RunRecord) -> bool {
    record.evaluations.first().is_some_and(|first| matches!(first.gains, Gains::Mrac(_)))
}

fn sensitivity(record: &RunRecord) -> Vec<SensitivityRow> {
    let Some(cost) = record.winner().and_then(|winner| winner.outcome.cost()) else { return Vec::new() };
    let ratio = |outcome: Outcome| outcome.cost().map(|changed| changed / cost);
    let row = |row: &certune::tune::Sensitivity| SensitivityRow {
        gain: row.knob.clone(),
        ratio_at_minus_10_percent: ratio(row.at_minus_10_percent),
        ratio_at_plus_10_percent: ratio(row.at_plus_10_percent),
    };
    record.sensitivity.iter().map(row).collect()
}

fn recheck(run: &Run, robot_argument: &str, folder: &Folder, certified: bool) -> Vec<CommandLine> {
    let line = |command: String, shows: &str| CommandLine { command, shows: shows.to_owned() };
    let file = |path: std::path::PathBuf| quoted(&path.to_string_lossy());
    let mut lines = Vec::new();
    if !run.certificates.is_empty() {
        let paths = folder.certificates(run.file.certificates()).into_iter().take(run.certificates.len());
        lines.push(line(
            format!("autotune verify {}", paths.map(file).collect::<Vec<_>>().join(" ")),
            "Reads certificates alone, derives every matrix again and decides every inequality in exact arithmetic.",
        ));
    }
    let scenario = &run.file.scenario;
    let scenario_argument = if catalogue::is_built_in(scenario) {
        format!(" --scenario {}", scenario.name)
    } else if scenario.name == "generic" {
        String::new()
    } else {
        format!(" --scenario {}", quoted(&format!("{}.toml", scenario.name)))
    };
    if certified {
        let robot = quoted(robot_argument);
        let gains = file(folder.gains());
        if !scenario_argument.is_empty() {
            // Claims about the adaptive controller are about one goal each.
            let goals = promise::goals(scenario).into_iter().take(run.file.certificates());
            for goal in goals {
                let at = goal.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
                let at = if run.file.controller == "mrac" {
                    format!(" --claim adaptive-convergence,pi-exponential --at={at}")
                } else {
                    String::new()
                };
                lines.push(line(
                    format!("autotune certify --robot {robot} --gains {gains}{scenario_argument}{at}"),
                    "Samples the arm's constants again and searches for the proofs again.",
                ));
            }
        }
        let plant = runs::middle(&scenario.plant_box);
        lines.push(line(
            format!(
                "autotune simulate --robot {robot} --gains {gains}{scenario_argument} --payload {} --friction {} --rotor-inertia {}",
                plant.payload_kg, plant.friction_n_m_s_per_rad, plant.rotor_inertia_kg_m2
            ),
            "Repeats the nominal run with the tuned gains.",
        ));
    }
    lines.push(line(
        command(run, robot_argument),
        "Repeats the whole run; gains.toml and run.json come out the same to the byte.",
    ));
    lines
}

fn method(run: &Run, certified: bool) -> Vec<String> {
    let record = &run.file.record;
    let question = &record.question;
    let plants = runs::middle(&run.file.scenario.plant_box);
    let mut paragraphs = vec![
        if question.goals.from(Source::Simulated).is_empty() {
            format!(
                "{} candidates were looked at. Each whose linearised loop decays at every configuration of a fixed sample was certified on the \
                 box; its cost is the inverse of the certified figure. None was simulated in the search.",
                record.evaluations.len()
            )
        } else {
            format!(
                "{} candidates were looked at. Each whose linearised loop decays at every configuration of a fixed sample ran the scenario \
                 on the same {} plants, drawn from the box with seed {}.",
                record.evaluations.len(),
                question.batch_plants,
                question.search.seed
            )
        },
        format!(
            "Candidates went before the certifier from the lowest cost upwards ({} of them). The certificate is claimed on the whole box, \
             not on the plants that were drawn. {} further plants, which the search never saw, judge the result.",
            record.certification.len(),
            question.held_out_plants
        ),
        format!(
            "The nominal plant of the curves is the middle of the box: nominal link masses, payload {} kg, friction {} N m s/rad, rotor \
             inertia {} kg m².",
            plants.payload_kg, plants.friction_n_m_s_per_rad, plants.rotor_inertia_kg_m2
        ),
    ];
    if record.termination == Termination::Interrupted {
        let budget = question.search.evaluations;
        paragraphs.insert(
            0,
            format!("The search was interrupted before it had looked at the {budget} candidates that were asked for."),
        );
    }
    if !certified {
        paragraphs.insert(
            0,
            "No candidate was certified. What the page calls tuned is the candidate of the lowest cost; it is not recommended, and no gains \
             file was written."
                .to_owned(),
        );
    }
    if is_adaptive(record) {
        paragraphs.push(
            "The search asked the certifier about every candidate that finished the task: one that was refused ranks below all that were \
             not, whatever its cost."
                .to_owned(),
        );
    }
    paragraphs.extend(crate::commands::tune::law_of_the_start(&run.file));
    paragraphs.extend(crate::commands::tune::beyond_the_claims(&run.file.scenario));
    paragraphs
}
