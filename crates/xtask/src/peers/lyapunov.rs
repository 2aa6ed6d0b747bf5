//! The rows about Lyapunov certificates: two figures of ours with a bound, and one beside cvxpy with Clarabel on the same matrices.
//!
//! Ours is the bench `lyapunov` of `certune-certify`, and includes the exact check; the peer's program is `crates/xtask/peers/common_matrix.py`, whose matrix
//! nobody checks exactly. CPU time of the process on both sides, one thread each, but for the thousand configurations: wall-clock time on two threads.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::{ROUNDS, bench, median, number, said};
use crate::{Outcome, root};

/// A row without a peer: its words, our work, the largest acceptable figure and its unit.
const ROWS: [(&str, &str, f64, &str); 2] = [
    ("certificate of 42 states, CPU", "certificate", 50.0, "ms"),
    ("1,000 of them on 2 threads, wall", "thousand", 20.0, "s"),
];

/// The largest acceptable share of the peer's time.
const SHARE: f64 = 0.5;

/// The peer takes ten seconds and more; odd, so that the median is one of them.
const PEER_ROUNDS: usize = 3;

/// Measures and prints the rows.
///
/// # Errors
/// A program that cannot be built or printed no figure.
pub(super) fn table(folder: &Path) -> Outcome {
    let program = bench("certune-certify", "lyapunov")?;
    let ours = |work: &str| number(&said(Command::new(&program).arg(work))?);
    println!("\n{:<34} {:>9} {:>9}", "Lyapunov, with the exact check", "ours", "at most");
    for (title, work, most, unit) in ROWS {
        let figure = median((0..ROUNDS).map(|_| ours(work)).collect::<Result<_, _>>()?);
        let met = if figure <= most { "" } else { "  not met" };
        println!("{title:<34} {figure:>9.3} {most:>9.1} {unit}{met}");
    }

    let file = folder.join("loops.txt");
    fs::write(&file, said(Command::new(&program).arg("matrices"))?).map_err(|e| format!("{}: {e}", file.display()))?;
    let python = folder.join("venv/bin/python");
    let script = root().join("crates/xtask/peers/common_matrix.py");
    let (mut own, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..PEER_ROUNDS {
        own.push(ours("common-matrix")?);
        theirs.push(number(&said(Command::new(&python).arg(&script).arg(&file))?)?);
    }
    let (own, theirs) = (median(own), median(theirs));
    let share = own / theirs;
    let met = if share <= SHARE { "" } else { "  not met" };
    println!("\n{:<34} {:>9} {:>9}  {:<16} {:>7} {:>7}", "work, s of CPU", "ours", "peer", "", "share", "aim");
    println!(
        "{:<34} {own:>9.3} {theirs:>9.3}  {:<16} {share:>7.3} {SHARE:>7.3}{met}",
        "one matrix for two loops of 42", "cvxpy + Clarabel"
    );
    Ok(())
}
