//! `autotune compare`: the paper's experiments run again, and what is left of its statements.
//!
//! The folder holds `compare.json`, which but for the measured times is the same to the byte for the same question, and `compare.html`, the page made of it.

use std::path::PathBuf;

use certune::dynamics::Robot;
use certune_paper::statements::Verdict;
use certune_paper::{Comparison, Inputs, Published, Scenarios, Size, Spaces, compare};
use serde::Serialize;

use super::tune::{DEFAULT_SEED, run_name};
use crate::catalogue::{self, GainsSource};
use crate::cli::{CompareArgs, Context, ControllerName, Exit};
use crate::error::Error;
use crate::output::{self, table, wrapped};
use crate::page::comparison_page;
use crate::progress::Terminal;

#[derive(Debug, Serialize)]
struct Summary<'a> {
    directory: String,
    statements: &'a [certune_paper::statements::Statement],
    elapsed_s: f64,
}

pub fn run(args: &CompareArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let seed = args.seed.unwrap_or(DEFAULT_SEED);
    let inputs = inputs(args, robot, seed)?;
    // Before a folder is made.
    inputs.check()?;
    let folder =
        args.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(run_name(&inputs.robot, "compare", seed)));
    output::prepare_folder(&folder)?;
    let threads = args.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| Error::Threads { threads, source })?;
    let progress = Terminal::new(context.verbose);
    let found = pool.install(|| compare(&inputs, &|part: &str| progress.begin(part)));
    progress.finish();
    let found = found?;
    let page = comparison_page(&found, &command(args))?;
    let json = serde_json::to_string(&found)? + "\n";
    let files = [(folder.join("compare.json"), json), (folder.join("compare.html"), page)];
    output::commit(output::stage(&files)?)?;
    if context.json {
        output::print_json(&Summary {
            directory: folder.display().to_string(),
            statements: &found.statements,
            elapsed_s: progress.elapsed_s(),
        })?;
    } else {
        output::print(&in_words(&found, &folder, progress.elapsed_s(), context.verbose))?;
    }
    Ok(Exit::Holds)
}

fn inputs(args: &CompareArgs, robot: Robot, seed: u64) -> Result<Inputs, Error> {
    let preset = |name: &str| GainsSource::find(name).map(|source| source.gains.gains);
    let given = |name: Option<&String>| name.map(|name| preset(name)).transpose();
    // The scenarios are the Panda's; whether the robot is one is for the comparison to say.
    let approximated = Robot::panda_cuboid();
    let scenario = |name: &str| catalogue::scenario(Some(name), &approximated);
    let space = |controller| catalogue::space(None, Some(controller)).map(|source| source.space);
    Ok(Inputs {
        published: Published {
            aic_simulation: preset("pezzato2020-simulation")?,
            aic_robot: preset("pezzato2020-libfranka")?,
            mrac_simulation: preset("pezzato2020-mrac-simulation")?,
            mrac_robot: preset("pezzato2020-mrac-robot")?,
        },
        tuned_aic: given(args.gains_aic.as_ref())?,
        tuned_mrac: given(args.gains_mrac.as_ref())?,
        scenarios: Scenarios {
            pick_and_place: scenario("pick-and-place-paper")?,
            payloads: scenario("payload-swap")?,
            push: scenario("push")?,
            noise: scenario("hold")?,
        },
        spaces: Spaces { aic: space(ControllerName::Aic)?, mrac: space(ControllerName::Mrac)? },
        size: Size { seed, ..Size::default() },
        robot,
        approximated,
    })
}

/// The command that repeats the comparison.
fn command(args: &CompareArgs) -> String {
    let mut command = format!("autotune compare --robot {}", args.robot.robot);
    let mut add = |flag: &str, value: Option<String>| {
        if let Some(value) = value {
            command.push_str(&format!(" --{flag} {value}"));
        }
    };
    add("tip", args.robot.tip.clone());
    add("gains-aic", args.gains_aic.clone());
    add("gains-mrac", args.gains_mrac.clone());
    add("seed", args.seed.map(|seed| seed.to_string()));
    command
}

fn in_words(found: &Comparison, folder: &std::path::Path, elapsed_s: f64, verbose: bool) -> String {
    let verdict = |verdict| match verdict {
        Verdict::Agrees => "agrees",
        Verdict::AgreesOnlyIf => "agrees only if",
        Verdict::DoesNotAgree => "does not agree",
        Verdict::NotTested => "not tested",
    };
    let mut text = String::from("What the paper says, and what was measured\n");
    if verbose {
        for statement in &found.statements {
            text.push_str(&format!("\n  {}: {}\n", statement.name, verdict(statement.verdict)));
            for line in [&statement.statement, &statement.measured, &statement.condition] {
                if !line.is_empty() {
                    text.push_str(&wrapped(line, 4));
                }
            }
        }
    } else {
        let row = |statement: &certune_paper::statements::Statement| {
            vec![statement.name.clone(), verdict(statement.verdict).to_owned()]
        };
        text.push_str(&table(&[], &found.statements.iter().map(row).collect::<Vec<_>>()));
        text.push_str("measurements, rules and conditions with -v, --json or on the page\n");
    }
    text.push_str(&format!("{} in {elapsed_s:.0} s\n", folder.join("compare.html").display()));
    text
}

#[cfg(test)]
mod tests {
    use certune::closed_loop::Gains;

    use super::*;

    #[test]
    fn what_is_shipped_fits_a_comparison() {
        let args = CompareArgs {
            robot: crate::cli::RobotArgs { robot: "panda".to_owned(), tip: None },
            gains_aic: Some("pezzato2020-libfranka".to_owned()),
            gains_mrac: None,
            seed: Some(3),
            threads: None,
            out: None,
        };
        let inputs = inputs(&args, Robot::panda(), 3).unwrap();
        assert!(matches!(inputs.tuned_aic, Some(Gains::Aic(_))) && inputs.tuned_mrac.is_none());
        assert_eq!(command(&args), "autotune compare --robot panda --gains-aic pezzato2020-libfranka --seed 3");
    }
}
