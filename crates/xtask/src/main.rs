//! The project's own commands; CI calls nothing else.
//!
//! | command | what it does |
//! |---|---|
//! | `cargo xtask ci` | every check, in the order in which a failure is cheapest to learn |
//! | `cargo xtask browser` | opens every kind of report in headless Chromium and tests it; pictures and prints in `target/browser` |
//! | `cargo xtask golden` | writes the golden data again from Pinocchio (needs `pip install pin example-robot-data`) |
//! | `cargo xtask peers` | sets up Pinocchio, MuJoCo and cvxpy from PyPI, and measures them and ours in turn: tables |
//! | `cargo xtask peers tuners` | our search beside pycma, Optuna, SciPy and Nevergrad on a cheap objective: a table |
//! | `cargo xtask peers panda` | the same on the Panda's objective |
//! | `cargo xtask peers search` | our CMA-ES beside pycma on classic functions: a table |
//! | `cargo xtask claims` | writes the certificates in `proofs/certificates/` again, and the list of them in `proofs/README.md` |
#![forbid(unsafe_code)]

mod browser;
mod house;
mod peers;
mod venv;

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

type Outcome = Result<(), String>;

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let outcome = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ci"] => ci(),
        ["browser"] => browser::browser(),
        ["golden"] => golden(),
        ["claims"] => claims(),
        ["peers"] => peers::peers(),
        ["peers", "tuners"] => peers::compare("tuners.py"),
        ["peers", "panda"] => peers::compare("panda_tuners.py"),
        ["peers", "search"] => peers::search(),
        _ => Err("usage: cargo xtask ci | browser | golden | claims | peers [tuners | panda | search]".to_owned()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("xtask: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// The workspace's root: two folders above this package.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map_or_else(PathBuf::new, Path::to_path_buf)
}

fn run(title: &str, mut command: Command) -> Outcome {
    println!("\n==> {title}");
    let start = Instant::now();
    let status = command.current_dir(root()).status().map_err(|e| format!("{title}: cannot start: {e}"))?;
    println!("<== {title}: {:.0} s", start.elapsed().as_secs_f64());
    if status.success() { Ok(()) } else { Err(format!("{title}: {status}")) }
}

fn cargo(words: &[&str]) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(words);
    command
}

fn ci() -> Outcome {
    let start = Instant::now();
    println!("==> the house's rules");
    house::check(&root())?;
    run("formatting", cargo(&["fmt", "--all", "--check"]))?;
    run("lints", cargo(&["clippy", "--release", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    let mut documentation = cargo(&["doc", "--release", "--workspace", "--no-deps"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    run("documentation", documentation)?;
    // `--all-targets` leaves documentation tests out; benches are built and run once each as tests.
    run("tests and benches", cargo(&["test", "--release", "--workspace", "--all-targets"]))?;
    run("documentation tests", cargo(&["test", "--release", "--workspace", "--doc"]))?;
    browser::browser()?;
    println!("\nall checks passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn golden() -> Outcome {
    let python = env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(python);
    command.arg("crates/dynamics/tests/golden/make.py");
    run("golden data", command)
}

fn claims() -> Outcome {
    let mut command = cargo(&["test", "--release", "--package", "proofs"]);
    command.env("CERTUNE_WRITE_CLAIMS", "1");
    run("claims", command)?;
    // The page lists what the certificates say, so it comes after them.
    let mut command = cargo(&["test", "--release", "--package", "proofs", "--test", "claims", "index::"]);
    command.env("CERTUNE_WRITE_CLAIMS", "1");
    run("the page that lists them", command)
}
