//! Contract: whatever a file holds, reading it gives a value or one error that points into the file; it never panics.

use std::path::Path;

use certune_closed_loop::{FileError, GainsFile, PlantBox, Scenario};
use certune_dynamics::Robot;
use proptest::prelude::*;

const GAINS: [&str; 3] = [
    include_str!("../../../tuning/presets/pezzato2020-robot.toml"),
    include_str!("../../../tuning/presets/pezzato2020-mrac-robot.toml"),
    include_str!("../../../tuning/presets/pezzato2020-simulation.toml"),
];
const SCENARIOS: [&str; 3] = [
    include_str!("../../../tuning/scenarios/payload-swap.toml"),
    include_str!("../../../tuning/scenarios/push.toml"),
    include_str!("../../../tuning/scenarios/hold.toml"),
];

/// The error's place lies in the text, and its message is one line.
fn points_into(text: &str, error: &FileError) -> bool {
    let Some((line, column)) = error.location.line_column else { return false };
    let lines = text.split('\n').collect::<Vec<_>>();
    let width = lines.get(line - 1).map_or(0, |line| line.chars().count());
    (1..=lines.len().max(1)).contains(&line) && (1..=width + 1).contains(&column) && !error.to_string().contains('\n')
}

fn judged(text: &str) -> Result<(), TestCaseError> {
    let file = Path::new("edited.toml");
    if let Err(error) = GainsFile::parse(file, text) {
        prop_assert!(points_into(text, &error), "{}", error);
    }
    match Scenario::parse(file, text) {
        // What is accepted can be bound, or is refused by a key: never a panic.
        Ok(scenario) => drop(scenario.bind::<7>(&Robot::panda())),
        Err(error) => prop_assert!(points_into(text, &error), "{}", error),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn any_text(text in "\\PC*") {
        judged(&text)?;
    }

    #[test]
    fn any_text_of_toml_shape(text in "(schema = 1\n)?([a-z_]{1,8} = (-?[0-9.e]{1,6}|\\[[0-9, ]{0,9}\\]|\"[a-z]{0,5}\"|true|nan)\n|\\[[a-z.-]{1,9}\\]\n){0,12}") {
        judged(&text)?;
    }

    /// A valid file with one stretch removed, replaced or doubled.
    #[test]
    fn mutated_valid_files(
        which in 0..6_usize,
        at in 0.0..1.0_f64,
        length in 0..40_usize,
        insert in "(|[0-9]{1,20}|-|nan|inf|\\[|\\]|\"|\n|=|#|é|1e999|\\[\\[segments\\]\\]\n)",
        doubled: bool,
    ) {
        let text = if which < 3 { GAINS[which] } else { SCENARIOS[which - 3] };
        let symbols = text.chars().collect::<Vec<_>>();
        let from = (at * symbols.len() as f64) as usize;
        let until = (from + length).min(symbols.len());
        let mut edited = symbols[..if doubled { until } else { from }].iter().collect::<String>();
        edited.push_str(&insert);
        edited.extend(&symbols[if doubled { from } else { until }..]);
        judged(&edited)?;
    }
}

#[test]
fn what_is_written_by_serde_is_a_scenario_again() {
    // The generic task of an arm can be saved, edited and read back.
    let scenario = Scenario::generic(&Robot::panda(), PlantBox::nominal(false));
    let text = format!("schema = 1\n{}", toml::to_string(&scenario).unwrap());
    assert_eq!(Scenario::parse(Path::new("generic.toml"), &text).unwrap(), scenario);
}

#[test]
fn messages_say_where_what_and_what_to_do() {
    let edited = GAINS[2].replacen("kappa_a", "kapa_a", 1);
    let message = GainsFile::parse(Path::new("my.toml"), &edited).unwrap_err().to_string();
    let line = edited.lines().position(|line| line.starts_with("kapa_a")).unwrap() + 1;
    let expected = format!(
        "my.toml:{line}:1: key `aic.kapa_a`: unknown key, did you mean `kappa_a`?; valid keys are `kappa_mu`, `kappa_a`, "
    );
    assert!(message.starts_with(&expected), "{message}");
}
