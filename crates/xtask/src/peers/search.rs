//! `cargo xtask peers search`: our CMA-ES with BIPOP restarts beside pycma's on ten classic functions, in 2 to 20 dimensions, from 25 starts each.
//!
//! Ours is the bench `classics` of `certune-search`, which also writes the problems down for `crates/xtask/peers/search.py`. The peer takes an hour and a half on two threads; its runs
//! are kept in `target/peers/search` as long as the problems stay the same, so that a comparison that broke off goes on.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use super::{bench, folder, said};
use crate::venv::python;
use crate::{Outcome, root, run};

const PACKAGES: [&str; 2] = ["cma==4.5.0", "numpy==2.4.6"];

/// The largest acceptable ratio of the median evaluations.
const RATIO_AIM: f64 = 1.2;

/// The runs of a function in a dimension: whether each is solved, and its evaluations.
type Runs = BTreeMap<(String, usize), Vec<(bool, u64)>>;

/// Runs both sides and prints the table.
///
/// # Errors
/// A step of the set-up that failed, or a program that printed no figures.
pub fn search() -> Outcome {
    let parent = folder()?;
    let python = python(&parent, "pycma", &PACKAGES)?;
    let folder = parent.join("search");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let program = bench("certune-search", "classics")?;
    let (problems, theirs) = (folder.join("problems.json"), folder.join("pycma.csv"));
    let described = said(Command::new(&program).arg("problems"))?;
    if fs::read_to_string(&problems).ok().as_ref() != Some(&described) {
        // Runs on other problems are of no use.
        if theirs.exists() {
            fs::remove_file(&theirs).map_err(|e| format!("{}: {e}", theirs.display()))?;
        }
        fs::write(&problems, described).map_err(|e| format!("{}: {e}", problems.display()))?;
    }
    let ours = read(&said(Command::new(&program).arg("run"))?)?;
    let mut peer = Command::new(python);
    peer.arg(root().join("crates/xtask/peers/search.py")).arg(&problems).arg(&theirs);
    run("pycma on the same problems", peer)?;
    table(&ours, &read(&text(&theirs)?)?)
}

fn text(file: &Path) -> Result<String, String> {
    fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))
}

fn read(lines: &str) -> Result<Runs, String> {
    let mut runs = Runs::new();
    for line in lines.lines() {
        let run = match line.split(',').collect::<Vec<_>>()[..] {
            [name, n, _, solved, count] => {
                n.parse().ok().zip(count.parse().ok()).map(|(n, count)| (name, n, solved, count))
            }
            _ => None,
        };
        let (name, n, solved, count) = run.ok_or_else(|| format!("no run in {line:?}"))?;
        runs.entry((name.to_owned(), n)).or_default().push((solved == "1", count));
    }
    Ok(runs)
}

/// What is compared of the runs of a row.
struct Figures {
    solved: usize,
    /// Evaluations of the middle run, where a failure counts as more than any success; none if that run failed.
    median: Option<u64>,
    /// All evaluations, those of failures included, for each success: the expected cost of starting again until it succeeds.
    expected: Option<f64>,
}

impl Figures {
    fn of(runs: &[(bool, u64)]) -> Self {
        let mut counts: Vec<u64> = runs.iter().filter(|(solved, _)| *solved).map(|(_, count)| *count).collect();
        counts.sort_unstable();
        let total: u64 = runs.iter().map(|(_, count)| count).sum();
        Self {
            solved: counts.len(),
            median: counts.get(runs.len() / 2).copied(),
            expected: (!counts.is_empty()).then(|| total as f64 / counts.len() as f64),
        }
    }
}

fn table(ours: &Runs, theirs: &Runs) -> Outcome {
    let show =
        |figure: Option<f64>, digits: usize| figure.map_or("-".to_owned(), |figure| format!("{figure:.digits$}"));
    println!(
        "\n| function | dimension | solved, ours | pycma | median evaluations, ours | pycma | ratio | expected evaluations, ours | pycma | |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for ((name, n), runs) in ours {
        let others = theirs.get(&(name.clone(), *n)).filter(|others| others.len() == runs.len());
        let others = others.ok_or_else(|| format!("pycma has not run {name} in {n} dimensions as often as ours"))?;
        let (a, b) = (Figures::of(runs), Figures::of(others));
        let ratio = a.median.zip(b.median).map(|(a, b)| a as f64 / b as f64);
        let slower = match (a.median, b.median) {
            (Some(_), Some(_)) => ratio.is_some_and(|ratio| ratio > RATIO_AIM),
            (mine, other) => mine.is_none() && other.is_some(),
        };
        let not_met = if a.solved < b.solved || slower { "not met" } else { "" };
        println!(
            "| {name} | {n} | {} | {} | {} | {} | {} | {} | {} | {not_met} |",
            a.solved,
            b.solved,
            show(a.median.map(|count| count as f64), 0),
            show(b.median.map(|count| count as f64), 0),
            show(ratio, 2),
            show(a.expected, 0),
            show(b.expected, 0),
        );
    }
    Ok(())
}
