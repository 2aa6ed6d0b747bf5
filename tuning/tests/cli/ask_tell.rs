//! A search whose scores come from elsewhere, through the two streams.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

const SPACE: &str = include_str!("../../spaces/panda-aic.toml");

/// Something that is said now and then beside the answers: it is refused, and changes nothing.
const NOISE: [&str; 5] = ["{", "{\"tell\":{\"id\":100000,\"score\":1}}", "{\"tell\":{\"id\":0}}", "", "\u{1}\u{2}"];

fn start(options: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_autotune"))
        .arg("ask-tell")
        .args(options.split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts")
}

/// A bowl around gains far from the published ones.
fn score(gains: &Value) -> f64 {
    let aims = [("kappa_mu", 20.0), ("kappa_a", 2000.0), ("sigma_dq", 0.5), ("sigma_mu", 2.0), ("sigma_dmu", 30.0)];
    1.0 + aims.iter().map(|(name, at)| (gains[name].as_f64().expect("a gain") / at).ln().powi(2)).sum::<f64>()
}

/// Answers until the search is done: what was asked, the last line, and the errors that were heard.
fn converse(options: &str, noisy: bool, fails: impl Fn(&Value) -> bool) -> (Vec<Value>, Value, usize) {
    let mut child = start(options);
    let mut input = child.stdin.take().expect("piped");
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let (mut asked, mut errors, mut done) = (Vec::new(), 0, Value::Null);
    for line in lines {
        let line: Value = serde_json::from_str(&line.expect("text")).expect("JSON");
        if let Some(ask) = line.get("ask") {
            if noisy {
                writeln!(input, "{}", NOISE[asked.len() % NOISE.len()]).expect("an open pipe");
            }
            assert_eq!(ask["id"], asked.len());
            let (id, gains) = (&ask["id"], &ask["gains"]);
            let tell =
                if fails(gains) { json!({"id": id, "failed": true}) } else { json!({"id": id, "score": score(gains)}) };
            writeln!(input, "{}", json!({"tell": tell})).expect("an open pipe");
            asked.push(gains.clone());
        } else if line.get("error").is_some() {
            errors += 1;
        } else {
            done = line["done"].clone();
        }
    }
    drop(input);
    assert!(child.wait().expect("it ends").success());
    assert!(done.is_object(), "the search ended without a last line");
    (asked, done, errors)
}

#[test]
fn the_search_finds_what_only_the_caller_knows_and_noise_changes_nothing() {
    let (asked, done, errors) = converse("--budget 150 --seed 4", false, |_| false);
    assert_eq!((asked.len(), errors), (150, 0));
    assert_eq!((&done["reason"], &done["evaluations"]), (&json!("budget-spent"), &json!(150)));
    let best = done["best"]["score"].as_f64().expect("a score");
    assert!(best < 1.05, "{best}");
    assert_eq!(done["best"]["gains"], asked[done["best"]["id"].as_u64().expect("an id") as usize]);
    let (again, done_again, errors) = converse("--budget 150 --seed 4", true, |_| false);
    assert!(errors > 50);
    assert_eq!((asked, done), (again, done_again));
}

#[test]
fn failures_are_told_and_avoided_and_a_known_robot_keeps_unstable_gains_back() {
    let (_, done, _) = converse("--budget 80", false, |gains| gains["kappa_a"].as_f64().expect("a gain") > 1500.0);
    assert!(done["best"]["gains"]["kappa_a"].as_f64().expect("a gain") <= 1500.0);
    let (asked, done, _) = converse("--budget 80 --robot panda", false, |_| false);
    assert!(asked.len() < 80, "the schedule scatters over gains of which some are unstable");
    assert_eq!(done["evaluations"], 80);
    assert_eq!(done["best"]["gains"], asked[done["best"]["id"].as_u64().expect("an id") as usize]);
}

#[test]
fn a_cold_start_knows_no_gains_and_finds_the_bowl_all_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cold.toml");
    let text = SPACE.replace("start = \"pezzato2020-simulation\"", "start = \"cold\"");
    assert_ne!(text, SPACE);
    std::fs::write(&file, text).expect("a file");
    let (warm, ..) = converse("--budget 5", false, |_| false);
    let (asked, done, _) = converse(&format!("--budget 300 --space {}", file.display()), false, |_| false);
    assert!(!asked.contains(&warm[0]), "the published gains were asked for");
    assert!(done["best"]["score"].as_f64().expect("a score") < 1.05, "{done}");
}

#[test]
fn an_input_that_ends_is_said_and_exits_with_1() {
    let mut child = start("--budget 9");
    let mut input = child.stdin.take().expect("piped");
    writeln!(input, "{}", json!({"tell": {"id": 0, "score": 2.0}})).expect("an open pipe");
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stdout).expect("text");
    let last: Value = serde_json::from_str(said.lines().last().expect("a line")).expect("JSON");
    assert_eq!(last["done"]["reason"], "input-ended");
    assert_eq!((last["done"]["evaluations"].as_u64(), last["done"]["best"]["score"].as_f64()), (Some(1), Some(2.0)));
    assert_eq!(output.status.code(), Some(1));
}
