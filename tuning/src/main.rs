//! `autotune`: tune the gains of a robot-arm controller, certify its stability, and report.
//!
//! | module | what it holds |
//! |--------|---------------|
//! | `cli` | the command line's shape, and from there to a command |
//! | `commands` | one file a command |
//! | `values` | values of options: what they may be, and what is said when they are not |
//! | `catalogue` | robots, presets, scenarios, search spaces and proved constants, by name or by path |
//! | `promise` | what a tuned set of gains must have certified |
//! | `sizes` | an arm's number of joints as a type |
//! | `run` | a run's folder: `gains.toml`, `run.json`, `certificate.json`, `report.html` |
//! | `journal` | `journal.jsonl` of a run that is not finished |
//! | `interrupt` | Ctrl-C |
//! | `page` | a run's record into the data of its page |
//! | `lines` | JSON lines on stdin and stdout |
//! | `output` | tables, wrapped text, JSON, files written whole or not at all |
//! | `progress` | bars on a terminal's stderr |
//! | `error` | what can go wrong, and what to do about it |
//!
//! Exit codes: 0 every claim holds (a conditional one included, and said), 2 a claim is refused, not proved or rejected, 1 anything
//! that kept the command from an answer, 130 a run that Ctrl-C has interrupted.
#![forbid(unsafe_code)]

mod catalogue;
mod certificate;
mod cli;
mod commands;
mod dashboard;
mod error;
mod interrupt;
mod journal;
mod lines;
mod output;
mod page;
mod progress;
mod promise;
mod run;
mod sizes;
mod values;
mod versions;

fn main() -> std::process::ExitCode {
    cli::run(std::env::args_os())
}
