//! The command line's shape.
//!
//! `tune` is the default command: its options also stand at the top level. Usage errors exit with 1, since 2 means "not certified".

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use certune::TorqueLimits;
use certune::tune::Goal;
use certune::verify::ClaimKind;
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};

use crate::commands::{
    ask_tell, certify, compare, constants, diff, evaluate, front, inspect, lists, report, resume, runs, simulate, tune,
    verify,
};
use crate::error::Error;
use crate::interrupt;
use crate::output;
use crate::values::{
    ARMS_OWN, Interval, Numbers, claim, delay, interval, non_negative, numbers, objective, plants, share, threads,
    torque_limits,
};

const AFTER_HELP: &str = "\
Examples:
  autotune --robot panda                            tune, certify and report, in under a minute
  autotune certify --robot panda --gains pezzato2020-simulation --gravity-compensation on --friction 1..3
  autotune verify runs/panda-aic-1/certificate.json
  autotune presets                                  what --gains knows by name

Exit codes: 0 every claim holds (conditional ones included), 2 a claim is refused, not proved or rejected, 1 usage, an unreadable file or any other error, 130 interrupted.";

/// Tune the gains of a robot-arm controller, certify its stability, and report.
#[derive(Debug, Parser)]
#[command(name = "autotune", version, after_help = AFTER_HELP, subcommand_negates_reqs = true, arg_required_else_help = true)]
#[command(disable_help_subcommand = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub tune: Option<TuneArgs>,
    #[command(flatten)]
    pub shared: Context,
}

/// Options of every command.
#[derive(Clone, Copy, Debug, Args)]
pub struct Context {
    /// Print the result as JSON on stdout
    #[arg(long, global = true)]
    pub json: bool,
    /// Say more on stderr
    #[arg(short, long, global = true)]
    pub verbose: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Search for gains, certify the best and write a report (the default command)
    Tune(TuneArgs),
    /// Search for gains with scores that you provide: candidates out and scores in, a JSON line each
    AskTell(AskTellArgs),
    /// What becomes of gains that you provide: gains in and figures out, a JSON line each
    Evaluate(EvaluateArgs),
    /// Find what two or three goals cost each other: certified points of which none is better in every goal
    Front(FrontArgs),
    /// Write gains and certificates of one point of a front
    Pick(PickArgs),
    /// Finish a run that was interrupted
    Resume(ResumeArgs),
    /// List the runs in a folder
    Runs(RunsArgs),
    /// Compare runs: what was asked, gains, and figures on held-out plants
    Diff(DiffArgs),
    /// Certify that an arm with given gains is stable, or say why not
    Certify(CertifyArgs),
    /// Check certificates again, in exact arithmetic, from the files alone
    Verify(VerifyArgs),
    /// Prove the constants of an arm that claims rest on, and store them as a record
    Constants(ConstantsArgs),
    /// Run a scenario and print its figures
    Simulate(SimulateArgs),
    /// Run the experiments of the paper again, AIC and MRAC side by side, and judge its statements
    Compare(CompareArgs),
    /// Print the arm's dynamics at one state
    Inspect(InspectArgs),
    /// Rebuild report.html from a run's folder
    Report(ReportArgs),
    /// List the built-in robots
    Robots,
    /// List the built-in gain presets
    Presets,
    /// List the built-in scenarios
    Scenarios,
}

#[derive(Clone, Debug, Args)]
pub struct RobotArgs {
    /// Built-in robot (see `autotune robots`) or a URDF file
    #[arg(long, value_name = "NAME|FILE.urdf")]
    pub robot: String,
    /// Last link of the arm, for a URDF file that branches
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ControllerName {
    /// Active inference
    Aic,
    /// Model reference adaptive control
    Mrac,
}

impl ControllerName {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aic => "aic",
            Self::Mrac => "mrac",
        }
    }
}

#[derive(Debug, Args)]
pub struct TuneArgs {
    // Not a flattened `RobotArgs`: clap sees an optional group only in its own arguments.
    /// Built-in robot (see `autotune robots`) or a URDF file
    #[arg(long, value_name = "NAME|FILE.urdf")]
    pub robot: String,
    /// Last link of the arm, for a URDF file that branches
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Controller to tune [default: that of the search space, or aic]
    #[arg(long, value_name = "NAME")]
    pub controller: Option<ControllerName>,
    /// Search space: a TOML file, or the built-in panda-aic or panda-mrac [default: that of the controller]
    #[arg(long, value_name = "FILE")]
    pub space: Option<String>,
    /// Scenario by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE")]
    pub scenario: Option<String>,
    /// What the search is after: settling-cost, settling-time, final-error, itae, overshoot, jitter, peak-torque, energy, certified-rate, certified-radius or
    /// delay-margin [default: as the search space says, or settling-cost]
    #[arg(long, value_name = "GOAL", value_parser = objective)]
    pub objective: Option<Goal>,
    /// Candidates to evaluate [default: 300]
    #[arg(long, value_name = "N")]
    pub budget: Option<usize>,
    /// Plants of the scenario's box on which each candidate is simulated [default: 8]
    #[arg(long, value_name = "N", value_parser = plants)]
    pub plants: Option<usize>,
    /// Seed of every random draw [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    pub threads: Option<usize>,
    /// Folder for the results [default: runs/ROBOT-CONTROLLER-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Watch the search on the whole screen: the best figure, what the best gains do, where the candidates lie
    #[arg(long)]
    pub dashboard: bool,
}

#[derive(Debug, Args)]
pub struct AskTellArgs {
    /// Search space: a TOML file, or the built-in panda-aic or panda-mrac [default: panda-aic]
    #[arg(long, value_name = "FILE")]
    pub space: Option<String>,
    /// Candidates to evaluate [default: 300]
    #[arg(long, value_name = "N")]
    pub budget: Option<usize>,
    /// Seed of every random draw [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Robot whose linearised loops keep unstable gains from being asked for: built-in or a URDF file
    #[arg(long, value_name = "NAME|FILE.urdf")]
    pub robot: Option<String>,
    /// Last link of the arm, for a URDF file that branches
    #[arg(long, value_name = "LINK", requires = "robot")]
    pub tip: Option<String>,
    /// Scenario whose plants those loops are about, by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE", requires = "robot")]
    pub scenario: Option<String>,
}

#[derive(Debug, Args)]
pub struct EvaluateArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Search space whose goals judge: a TOML file [default: the built-in panda-aic]
    #[arg(long, value_name = "FILE")]
    pub space: Option<String>,
    /// Scenario by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE")]
    pub scenario: Option<String>,
    /// Plants of the scenario's box on which each line's gains are simulated [default: 8]
    #[arg(long, value_name = "N", value_parser = plants)]
    pub plants: Option<usize>,
    /// Seed of every random draw [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
}

#[derive(Debug, Args)]
pub struct FrontArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Two or three goals, separated by commas; for their names see --objective of `autotune tune`
    #[arg(long, value_name = "GOAL,GOAL[,GOAL]", value_parser = objective, value_delimiter = ',', required = true)]
    pub goals: Vec<Goal>,
    /// Controller to tune [default: aic]
    #[arg(long, value_name = "NAME")]
    pub controller: Option<ControllerName>,
    /// Search space, whose limits every point keeps: a TOML file [default: the built-in panda-aic]
    #[arg(long, value_name = "FILE")]
    pub space: Option<String>,
    /// Scenario by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE")]
    pub scenario: Option<String>,
    /// Candidates to measure [default: 600]
    #[arg(long, value_name = "N")]
    pub budget: Option<usize>,
    /// Plants of the scenario's box on which each candidate is simulated [default: 8]
    #[arg(long, value_name = "N", value_parser = plants)]
    pub plants: Option<usize>,
    /// Seed of every random draw [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    pub threads: Option<usize>,
    /// Folder for the results [default: runs/ROBOT-CONTROLLER-front-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Tuned gains of the AIC: a preset (see `autotune presets`) or a TOML file [default: searched]
    #[arg(long, value_name = "NAME|FILE")]
    pub gains_aic: Option<String>,
    /// Tuned gains of MRAC: a preset or a TOML file [default: searched]
    #[arg(long, value_name = "NAME|FILE")]
    pub gains_mrac: Option<String>,
    /// Seed of every random draw [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Threads; the result does not depend on it, but for the measured times [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    pub threads: Option<usize>,
    /// Folder for the results [default: runs/ROBOT-compare-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct PickArgs {
    /// Folder of the front
    #[arg(value_name = "FRONT_DIR")]
    pub front_dir: PathBuf,
    /// Number of the point, as the front's table has it
    #[arg(long, value_name = "K")]
    pub point: usize,
    /// The URDF file of a front that was made with one
    #[arg(long, value_name = "FILE.urdf")]
    pub robot: Option<String>,
    /// Its last link, if it was named
    #[arg(long, value_name = "LINK", requires = "robot")]
    pub tip: Option<String>,
    /// Folder for gains and certificates [default: FRONT_DIR/point-K]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// Folder of the run
    #[arg(value_name = "RUN_DIR")]
    pub run_dir: PathBuf,
    /// Threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    pub threads: Option<usize>,
    /// Watch the search on the whole screen, as with `autotune tune`
    #[arg(long)]
    pub dashboard: bool,
}

#[derive(Debug, Args)]
pub struct RunsArgs {
    /// Folder whose folders are runs [default: runs]
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct DiffArgs {
    /// Folders of runs
    #[arg(value_name = "RUN_DIR", required = true, num_args = 2..)]
    pub run_dirs: Vec<PathBuf>,
}

/// Which configurations a claim speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OverName {
    /// Every angle of every joint
    Torus,
    /// Between the joints' end stops
    Range,
    /// A box around the start and the goals of the scenario
    Scenario,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    On,
    Off,
}

/// Which arms, around the robot's nominal one.
#[derive(Debug, Args)]
pub struct ArmsArgs {
    /// Payload from 0 to this mass, kg; a point held at the grasp point [default: 0]
    #[arg(long, value_name = "KG", value_parser = non_negative, allow_hyphen_values = true)]
    pub payload: Option<f64>,
    /// Link masses differ from nominal by up to this share, 0.2 for ±20 % [default: 0]
    #[arg(long, value_name = "SHARE", value_parser = share, allow_hyphen_values = true)]
    pub mass_uncertainty: Option<f64>,
    /// Rotor inertia of every joint, kg m² [default: the robot's own]
    #[arg(long, value_name = "X|MIN..MAX", value_parser = interval, allow_hyphen_values = true)]
    pub rotor_inertia: Option<Interval>,
}

#[derive(Debug, Args)]
pub struct CertifyArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Gains: a preset (see `autotune presets`) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    pub gains: String,
    /// Claims to examine, by name, separated by commas [default: all that apply to the controller]
    #[arg(long = "claim", value_name = "NAME", value_parser = claim, value_delimiter = ',')]
    pub claims: Vec<ClaimKind>,
    /// Samples from a command to its torque, for the claims about the sampled loop, and for moving-goal when it is named [default: 0]
    #[arg(long, value_name = "K", value_parser = delay, allow_hyphen_values = true)]
    pub delay: Option<usize>,
    /// Respect torque limits: the arm's own less gravity's share, or, with a number, this 2-norm of the controller's torque
    #[arg(long, value_name = "N_M", value_parser = torque_limits, num_args = 0..=1, default_missing_value = ARMS_OWN, allow_negative_numbers = true)]
    pub torque_limits: Option<TorqueLimits>,
    /// Configurations that the claims speak of [default: torus]
    #[arg(long, value_name = "torus|range|scenario", hide_possible_values = true)]
    pub over: Option<OverName>,
    /// Configuration of the claims about one (lyapunov, and all about MRAC), rad, separated by commas [default: the scenario's first goal]
    #[arg(long, value_name = "LIST", value_parser = numbers, allow_hyphen_values = true)]
    pub at: Option<Numbers>,
    /// Claim it for every plant of this scenario's plant box, instead of the five options below
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["gravity_compensation", "friction", "payload", "mass_uncertainty", "rotor_inertia"])]
    pub scenario: Option<String>,
    /// Whether the robot compensates its own gravity [default: off]
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    pub gravity_compensation: Option<Switch>,
    /// Viscous friction of every joint, N m s/rad [default: the robot's own, 0 for the built-in ones]
    #[arg(long, value_name = "X|MIN..MAX", value_parser = interval, allow_hyphen_values = true)]
    pub friction: Option<Interval>,
    #[command(flatten)]
    pub arms: ArmsArgs,
    /// A record of proved constants that the claims may rest on, besides the built-in ones; may be repeated
    #[arg(long, value_name = "FILE.json")]
    pub constants: Vec<PathBuf>,
    /// Write the certificate to this file
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Certificate files
    #[arg(required_unless_present = "full", value_name = "CERTIFICATE.json")]
    pub files: Vec<PathBuf>,
    /// Derive the proved constants again from the arm, which takes minutes; without a file, all built-in ones
    #[arg(long)]
    pub full: bool,
    /// A record of proved constants that certificates may rest on, besides the built-in ones; may be repeated
    #[arg(long, value_name = "FILE.json")]
    pub constants: Vec<PathBuf>,
    /// The URDF file of a record that is about no built-in robot
    #[arg(long, value_name = "FILE.urdf", requires = "full")]
    pub robot: Option<String>,
    /// Its last link, if it was named
    #[arg(long, value_name = "LINK", requires = "robot")]
    pub tip: Option<String>,
}

/// How much time goes into tight constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EffortName {
    /// Seconds to a minute
    Quick,
    /// Minutes
    Standard,
    /// Half an hour and more
    Thorough,
}

#[derive(Debug, Args)]
pub struct ConstantsArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Configurations that the constants hold for [default: torus]
    #[arg(long, value_name = "torus|range|scenario", hide_possible_values = true)]
    pub over: Option<OverName>,
    /// Scenario of `--over scenario`, by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE")]
    pub scenario: Option<String>,
    #[command(flatten)]
    pub arms: ArmsArgs,
    /// How much time goes into tightness [default: standard]
    #[arg(long, value_name = "quick|standard|thorough", hide_possible_values = true)]
    pub effort: Option<EffortName>,
    /// Write the record to this file
    #[arg(long, value_name = "FILE.json")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Gains: a preset (see `autotune presets`) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    pub gains: String,
    /// Scenario by name or TOML file [default: pick-and-place; for a URDF file a generic one]
    #[arg(long, value_name = "NAME|FILE")]
    pub scenario: Option<String>,
    /// Payload at the grasp point, kg [default: 0]
    #[arg(long, value_name = "KG", value_parser = non_negative, allow_hyphen_values = true)]
    pub payload: Option<f64>,
    /// Viscous friction of every joint, N m s/rad [default: the robot's own, 0 for the built-in ones]
    #[arg(long, value_name = "D", value_parser = non_negative, allow_hyphen_values = true)]
    pub friction: Option<f64>,
    /// Rotor inertia of every joint, kg m² [default: the robot's own]
    #[arg(long, value_name = "I", value_parser = non_negative, allow_hyphen_values = true)]
    pub rotor_inertia: Option<f64>,
    /// Samples from a command to its torque [default: 0]
    #[arg(long, value_name = "K")]
    pub delay: Option<usize>,
    /// Whether the robot compensates its own gravity [default: as the scenario says]
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    pub gravity_compensation: Option<Switch>,
    /// Seed of the sensor noise, if the scenario has any [default: 1]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Write positions, velocities, goals and torques to this file, one row each 10 ms
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct InspectArgs {
    #[command(flatten)]
    pub robot: RobotArgs,
    /// Joint positions, rad, separated by commas
    #[arg(long, value_name = "LIST", value_parser = numbers, allow_hyphen_values = true)]
    pub q: Numbers,
    /// Joint velocities, rad/s [default: zeros]
    #[arg(long, value_name = "LIST", value_parser = numbers, allow_hyphen_values = true)]
    pub dq: Option<Numbers>,
    /// Joint torques, N m, for the acceleration [default: zeros]
    #[arg(long, value_name = "LIST", value_parser = numbers, allow_hyphen_values = true)]
    pub tau: Option<Numbers>,
}

#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder of a run
    #[arg(value_name = "RUN_DIR")]
    pub run_dir: PathBuf,
    /// The URDF file of a run that was made with one
    #[arg(long, value_name = "FILE.urdf")]
    pub robot: Option<String>,
    /// Its last link, if it was named
    #[arg(long, value_name = "LINK", requires = "robot")]
    pub tip: Option<String>,
}

/// What a command that came to an answer says by its exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// Every claim holds, or none was made.
    Holds,
    /// A claim is refused, not proved or rejected.
    NotCertified,
    /// A file or line among several could not be read; it has been named.
    Unreadable,
    /// Ctrl-C has ended it before its end.
    Interrupted,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Holds => Self::SUCCESS,
            Exit::NotCertified => Self::from(2),
            Exit::Unreadable => Self::FAILURE,
            Exit::Interrupted => interrupt::exit_code(),
        }
    }
}

/// Reads the arguments and runs the command.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(arguments).and_then(without_mixture) {
        Ok(cli) => cli,
        Err(error) => {
            // Only a closed stdout or stderr can keep the text from being printed.
            let _ = error.print();
            return if error.use_stderr() { ExitCode::FAILURE } else { ExitCode::SUCCESS };
        }
    };
    match dispatch(cli) {
        Ok(exit) => exit.into(),
        Err(error) => {
            output::say(&error.in_full());
            ExitCode::FAILURE
        }
    }
}

/// Options of `tune` before another command would be ignored silently.
fn without_mixture(cli: Cli) -> Result<Cli, clap::Error> {
    match (&cli.command, &cli.tune) {
        (Some(_), Some(_)) => {
            let message = "options of `tune` stand before another command; put every option behind the command's name";
            Err(Cli::command().error(ErrorKind::ArgumentConflict, message))
        }
        (Some(_), None) | (None, Some(_)) => Ok(cli),
        (None, None) => {
            Err(Cli::command().error(ErrorKind::MissingRequiredArgument, "--robot <NAME|FILE.urdf> is needed"))
        }
    }
}

fn dispatch(cli: Cli) -> Result<Exit, Error> {
    let context = cli.shared;
    match (cli.command, cli.tune) {
        (Some(Command::Tune(args)), _) | (None, Some(args)) => tune::run(&args, context),
        (Some(Command::AskTell(args)), _) => ask_tell::run(&args),
        (Some(Command::Evaluate(args)), _) => evaluate::run(&args),
        (Some(Command::Front(args)), _) => front::run(&args, context),
        (Some(Command::Pick(args)), _) => front::pick(&args, context),
        (Some(Command::Resume(args)), _) => resume::run(&args, context),
        (Some(Command::Runs(args)), _) => runs::run(&args, context),
        (Some(Command::Diff(args)), _) => diff::run(&args, context),
        (Some(Command::Certify(args)), _) => certify::run(&args, context),
        (Some(Command::Verify(args)), _) => verify::run(&args, context),
        (Some(Command::Constants(args)), _) => constants::run(&args, context),
        (Some(Command::Simulate(args)), _) => simulate::run(&args, context),
        (Some(Command::Compare(args)), _) => compare::run(&args, context),
        (Some(Command::Inspect(args)), _) => inspect::run(&args, context),
        (Some(Command::Report(args)), _) => report::run(&args, context),
        (Some(Command::Robots), _) => lists::robots(context),
        (Some(Command::Presets), _) => lists::presets(context),
        (Some(Command::Scenarios), _) => lists::scenarios(context),
        (None, None) => Ok(Exit::Unreadable), // `without_mixture` has refused it
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
