//! `autotune robots`, `presets`, `scenarios`: what is built in.

use certune::closed_loop::Gains;
use certune::dynamics::BUILT_IN;
use serde::Serialize;

use crate::catalogue::{self, GainsSource, PRESETS, SCENARIOS};
use crate::cli::{Context, Exit};
use crate::error::Error;
use crate::output;

#[derive(Debug, Serialize)]
struct Entry {
    name: &'static str,
    description: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    joints: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    controller: Option<&'static str>,
}

fn print(entries: &[Entry], hint: &str, context: Context) -> Result<Exit, Error> {
    if context.json {
        output::print_json(&entries)?;
    } else {
        let rows: Vec<_> = entries.iter().map(|entry| (entry.name.to_owned(), entry.description.clone())).collect();
        output::print(&format!("{}{hint}\n", output::list(&rows)))?;
    }
    Ok(Exit::Holds)
}

pub fn robots(context: Context) -> Result<Exit, Error> {
    let entry = |name: &&'static str| -> Result<Entry, Error> {
        let joints = Some(catalogue::robot(name, None)?.joints());
        Ok(Entry { name, description: catalogue::robot_in_words(name).to_owned(), joints, controller: None })
    };
    let entries = BUILT_IN.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    print(&entries, "Any other serial arm of up to 10 joints: --robot FILE.urdf", context)
}

pub fn presets(context: Context) -> Result<Exit, Error> {
    let entry = |(name, text): &(&'static str, &'static str)| -> Result<Entry, Error> {
        let controller = match GainsSource::find(name)?.gains.gains {
            Gains::Aic(_) => "aic",
            Gains::Mrac(_) => "mrac",
        };
        Ok(Entry { name, description: first_comment(text), joints: None, controller: Some(controller) })
    };
    let entries = PRESETS.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    print(&entries, "Gains of your own: --gains FILE.toml", context)
}

pub fn scenarios(context: Context) -> Result<Exit, Error> {
    let entry = |(name, _): &(&'static str, &'static str)| -> Result<Entry, Error> {
        let scenario = catalogue::scenario_file(name)?;
        let joints = Some(scenario.joints());
        Ok(Entry { name, description: scenario.description, joints, controller: None })
    };
    let entries = SCENARIOS.iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    print(&entries, "A scenario of your own: --scenario FILE.toml", context)
}

/// A preset says in its first line what it is.
fn first_comment(text: &str) -> String {
    text.lines().next().unwrap_or_default().trim_start_matches(['#', ' ']).to_owned()
}
