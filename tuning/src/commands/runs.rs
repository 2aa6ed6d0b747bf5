//! `autotune runs`: the runs in a folder, finished or not.

use std::path::{Path, PathBuf};

use certune::tune::Question;
use serde::Serialize;

use crate::cli::{Context, Exit, RunsArgs};
use crate::error::Error;
use crate::journal::Journal;
use crate::output::{self, number, table};
use crate::run::{Folder, RunFile};

/// Where `tune` puts its runs.
const DEFAULT_DIR: &str = "runs";

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
enum State {
    Certified,
    NotCertified,
    Running,
    /// `autotune resume` finishes it.
    Unfinished,
}

impl State {
    fn in_words(self) -> &'static str {
        match self {
            Self::Certified => "certified",
            Self::NotCertified => "not certified",
            Self::Running => "running",
            Self::Unfinished => "UNFINISHED",
        }
    }
}

#[derive(Debug, Serialize)]
struct Row {
    name: String,
    robot: String,
    controller: String,
    objective: &'static str,
    seed: u64,
    /// Evaluated so far, of the budget.
    candidates: usize,
    budget: usize,
    /// The tuned gains on held-out plants, s.
    held_out_cost: Option<f64>,
    state: State,
}

pub fn run(args: &RunsArgs, context: Context) -> Result<Exit, Error> {
    let dir = args.dir.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_DIR));
    let mut exit = Exit::Holds;
    let mut rows = Vec::new();
    for folder in folders(&dir).map_err(output::cannot("list", &dir))? {
        match row(&folder) {
            Ok(row) => rows.extend(row),
            Err(error) => {
                output::say(&error.in_full());
                exit = Exit::Unreadable;
            }
        }
    }
    if context.json {
        output::print_json(&rows)?;
    } else {
        output::print(&in_words(&rows))?;
    }
    Ok(exit)
}

/// The folders in `dir`, by name.
fn folders(dir: &Path) -> std::io::Result<Vec<Folder>> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(dir)? {
        let path = entry?.path();
        if path.is_dir() {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths.into_iter().map(|path| Folder { path }).collect())
}

/// The run in a folder; none when there is none.
fn row(folder: &Folder) -> Result<Option<Row>, Error> {
    let row = |controller: String, question: &Question, candidates, held_out_cost, state| Row {
        name: folder.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        robot: question.robot.clone(),
        controller,
        objective: question.goals.objective.name(),
        seed: question.search.seed,
        candidates,
        budget: question.search.evaluations,
        held_out_cost,
        state,
    };
    if folder.journal().exists() {
        let glance = Journal::glance(folder)?;
        let state = if glance.in_use { State::Running } else { State::Unfinished };
        return Ok(Some(row(glance.header.controller, &glance.header.question, glance.candidates, None, state)));
    }
    let path = folder.record();
    if !path.exists() {
        return Ok(None);
    }
    let RunFile { controller, record, .. } = RunFile::parse(&path, &output::read_file(&path)?)?;
    let state = if record.winner.is_some() { State::Certified } else { State::NotCertified };
    let cost = record.held_out.tuned.as_ref().and_then(|tuned| tuned.outcome.cost());
    Ok(Some(row(controller, &record.question, record.evaluations.len(), cost, state)))
}

fn in_words(rows: &[Row]) -> String {
    let header = ["run", "robot", "controller", "objective", "seed", "candidates", "held-out cost, s", "state"];
    let cells = |row: &Row| {
        let candidates = match row.state {
            State::Certified | State::NotCertified => row.candidates.to_string(),
            State::Running | State::Unfinished => format!("{} of {}", row.candidates, row.budget),
        };
        vec![
            row.name.clone(),
            row.robot.clone(),
            row.controller.clone(),
            row.objective.to_owned(),
            row.seed.to_string(),
            candidates,
            number(row.held_out_cost, 4),
            row.state.in_words().to_owned(),
        ]
    };
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>())
}
