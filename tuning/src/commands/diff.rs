//! `autotune diff`: runs side by side: what was asked of them that differs, their gains, their figures on held-out plants.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::cli::{Context, DiffArgs, Exit};
use crate::error::Error;
use crate::output::{self, table};
use crate::page::{FIGURES, Spread, spread};
use crate::run::{Folder, RunFile};

/// A key with its value in each run; null where a run has none.
type Rows = BTreeMap<String, Vec<Value>>;

#[derive(Debug, Serialize)]
struct Comparison {
    runs: Vec<String>,
    /// Only what differs.
    asked: Rows,
    gains: Rows,
    held_out: Vec<Option<Spread>>,
}

pub fn run(args: &DiffArgs, context: Context) -> Result<Exit, Error> {
    let read = |path: &std::path::PathBuf| {
        let path = Folder { path: path.clone() }.record();
        let text = std::fs::read_to_string(&path).map_err(|source| Error::NoRun { path: path.clone(), source })?;
        RunFile::parse(&path, &text)
    };
    let files = args.run_dirs.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let mut asked = rows(files.iter().map(asked))?;
    asked.retain(|_, values| values.windows(2).any(|pair| pair[0] != pair[1]));
    let compared = Comparison {
        runs: args.run_dirs.iter().map(|path| path.display().to_string()).collect(),
        asked,
        gains: rows(files.iter().map(|file| Ok(serde_json::to_value(file.record.tuned())?)))?,
        held_out: files.iter().map(|file| file.record.held_out.tuned.as_ref().map(spread)).collect(),
    };
    if context.json {
        output::print_json(&compared)?;
    } else {
        output::print(&in_words(&compared))?;
    }
    Ok(Exit::Holds)
}

/// Everything in a record that is no result.
fn asked(file: &RunFile) -> Result<Value, Error> {
    let mut record = serde_json::to_value(file)?;
    if let Some(record) = record.as_object_mut() {
        const RESULTS: [&str; 7] =
            ["evaluations", "termination", "certification", "start", "winner", "held_out", "sensitivity"];
        record.retain(|key, _| !RESULTS.contains(&key.as_str()));
    }
    Ok(record)
}

/// The leaves of each value, by key.
fn rows(values: impl ExactSizeIterator<Item = Result<Value, Error>>) -> Result<Rows, Error> {
    let runs = values.len();
    let mut rows = Rows::new();
    for (run, value) in values.enumerate() {
        leaves(String::new(), &value?, &mut |key, leaf| {
            rows.entry(key).or_insert_with(|| vec![Value::Null; runs])[run] = leaf.clone();
        });
    }
    Ok(rows)
}

/// Calls `each` with the dotted key of every leaf. A row of the space is known by its gain, other entries of a list by their place.
fn leaves(key: String, value: &Value, each: &mut impl FnMut(String, &Value)) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        Value::Object(entries) => entries.iter().for_each(|(name, value)| leaves(below(name), value, each)),
        Value::Array(entries) => {
            for (place, value) in entries.iter().enumerate() {
                let name = value["gain"].as_str().map_or_else(|| place.to_string(), str::to_owned);
                leaves(below(&name), value, each);
            }
        }
        Value::Null if key.is_empty() => {} // a run without a winner has no gains
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => each(key, value),
    }
}

fn in_words(compared: &Comparison) -> String {
    let part = |name: &'static str, rows: &[Vec<String>]| {
        let header: Vec<&str> = std::iter::once(name).chain(compared.runs.iter().map(String::as_str)).collect();
        table(&header, rows)
    };
    let cell = |value: &Value| match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    let cells = |rows: &Rows| -> Vec<Vec<String>> {
        rows.iter().map(|(key, values)| std::iter::once(key.clone()).chain(values.iter().map(cell)).collect()).collect()
    };
    let asked = if compared.asked.is_empty() {
        "  the same was asked\n".to_owned()
    } else {
        part("asked", &cells(&compared.asked))
    };
    let figures = FIGURES.map(|figure| figure.row(&compared.held_out));
    format!("{asked}\n{}\n{}", part("tuned gains", &cells(&compared.gains)), part("held-out plants", &figures))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn leaves_are_named_by_their_way_and_missing_ones_are_null() {
        let one = json!({"space": [{"gain": "kappa_a", "freedom": {"lower": 1.0}}], "list": [1, 2]});
        let other = json!({"space": [{"gain": "kappa_a", "freedom": 3.0}], "list": [1]});
        let rows = rows([one, other].map(Ok).into_iter()).unwrap();
        let expected = [
            ("list.0", [json!(1), json!(1)]),
            ("list.1", [json!(2), Value::Null]),
            ("space.kappa_a.freedom", [Value::Null, json!(3.0)]),
            ("space.kappa_a.freedom.lower", [json!(1.0), Value::Null]),
            ("space.kappa_a.gain", [json!("kappa_a"), json!("kappa_a")]),
        ];
        let expected: Rows = expected.into_iter().map(|(key, values)| (key.to_owned(), values.to_vec())).collect();
        assert_eq!(rows, expected);
    }
}
