//! Gains in and figures out: the search's own objective for anybody.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::common::{SHORT, autotune};

const RECORD: &str = include_str!("../../results/panda-aic-1/run.json");

fn answers(arguments: &str, input: &[u8], code: i32) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.toml"), SHORT).unwrap();
    let mut command = autotune(folder.path());
    let assert = command.arg("evaluate").args(arguments.split_whitespace()).write_stdin(input).assert().code(code);
    let said = String::from_utf8(assert.get_output().stdout.clone()).unwrap();
    said.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Other arithmetic, or other plants, would show in the last digit.
#[test]
fn recorded_candidates_cost_what_they_cost_in_the_run_to_the_bit() {
    let record: Value = serde_json::from_str(RECORD).unwrap();
    let evaluations = record["evaluations"].as_array().unwrap();
    let winner = record["winner"].as_u64().unwrap() as usize;
    let unstable = evaluations.iter().filter(|one| one["outcome"]["rank"] == "unstable").take(3);
    // A winner of a later round has met more plants.
    let winner = Some(&evaluations[winner]).filter(|winner| winner["round"] == 0);
    let chosen: Vec<&Value> = evaluations[..16].iter().chain(winner).chain(unstable).collect();
    let input: String = chosen.iter().map(|one| format!("{}\n", json!({"gains": one["gains"]}))).collect();
    let found = answers("--robot panda", input.as_bytes(), 0);
    assert_eq!(found.len(), chosen.len());
    let mut ranks = std::collections::BTreeSet::new();
    for (found, recorded) in found.iter().zip(chosen) {
        let outcome = &recorded["outcome"];
        ranks.insert(outcome["rank"].as_str().unwrap());
        match outcome["rank"].as_str().unwrap() {
            "simulated" | "violates" => assert_eq!(&found["outcome"], outcome),
            "certified" => assert_eq!(found["cost"], outcome["cost"]),
            // The search gave it up there.
            "stopped" => {
                assert!(found["cost"].is_null() || found["cost"].as_f64() > outcome["cost_above"].as_f64());
            }
            "unstable" => {
                assert_eq!(&found["outcome"], outcome);
                assert!(found["cost"].is_null() && found["figures"].is_null());
            }
            other => panic!("{other}"),
        }
        assert_eq!(found["figures"]["plants"].as_u64().unwrap_or(8), 8);
    }
    assert!(ranks.len() >= 3, "{ranks:?}");
    let score = |line: &Value| line["score"].as_f64().unwrap();
    assert!(score(&found[0]) < score(&found[found.len() - 1]));
}

#[test]
fn a_bad_line_is_answered_in_its_place_and_loses_nothing() {
    let good = r#"{"gains":{"kappa_mu":11.67,"kappa_a":700,"sigma_q":1,"sigma_dq":1,"sigma_mu":5,"sigma_dmu":10,"reference_time_constant_s":1}}"#;
    let arguments = "--robot panda --scenario short.toml --plants 2";
    let expected = answers(arguments, format!("{good}\n").as_bytes(), 0).remove(0);
    assert!(expected["figures"]["overshoot"].is_number() && expected["cost"].is_number());
    let bad: [(&[u8], &str); 8] = [
        (b"hello", "expected {\"gains\""),
        (b"\xff\xfe", "expected {\"gains\""),
        (b"{}", "missing field `gains`"),
        (b"[1, 2]", "expected {\"gains\""),
        (br#"{"gains":{"kappa_mu":1}}"#, "missing field `kappa_a`"),
        (br#"{"gains":{"kapa_mu":1}}"#, "unknown field `kapa_mu`"),
        (
            br#"{"gains":{"kappa_mu":1e999,"kappa_a":700,"sigma_q":1,"sigma_dq":1,"sigma_mu":5,"sigma_dmu":10,"reference_time_constant_s":1}}"#,
            "number out of range",
        ),
        (
            br#"{"gains":{"kappa_mu":-1,"kappa_a":700,"sigma_q":1,"sigma_dq":1,"sigma_mu":5,"sigma_dmu":10,"reference_time_constant_s":1}}"#,
            "kappa_mu",
        ),
    ];
    let mut input = Vec::new();
    for (line, _) in bad {
        input.extend([good.as_bytes(), b"\n\n", line, b"\n"].concat());
    }
    // The last line need not end.
    input.extend(good.as_bytes());
    let found = answers(arguments, &input, 1);
    assert_eq!(found.len(), 2 * bad.len() + 1);
    for (index, (_, words)) in bad.iter().enumerate() {
        assert_eq!(found[2 * index], expected);
        let error = &found[2 * index + 1]["error"];
        assert_eq!(error["line"], 3 * index + 3);
        assert!(error["message"].as_str().unwrap().contains(words), "{error} should say {words}");
    }
    assert_eq!(found[2 * bad.len()], expected);
}

#[test]
fn each_answer_comes_at_once_so_that_the_next_question_may_depend_on_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.toml"), SHORT).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_autotune"))
        .current_dir(folder.path())
        .args("evaluate --robot panda --scenario short.toml --plants 1".split(' '))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut kappa_mu = 11.67;
    for _ in 0..3 {
        let gains = json!({"kappa_mu": kappa_mu, "kappa_a": 700, "sigma_q": 1, "sigma_dq": 1, "sigma_mu": 5, "sigma_dmu": 10, "reference_time_constant_s": 1});
        writeln!(input, "{}", json!({"gains": gains})).unwrap();
        let found: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        kappa_mu += found["score"].as_f64().unwrap();
    }
    drop(input);
    assert!(lines.next().is_none() && child.wait().unwrap().success());
}
