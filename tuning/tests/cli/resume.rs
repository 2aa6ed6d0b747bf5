//! A run that is cut off anywhere and finished later leaves the files of one that never was.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::common::{SHORT, TWO_LINKS, TWO_LINKS_MOVE, autotune, json, stdout};

/// A search of a second or two, for what must happen while it goes on.
const TUNE: &str = "--robot panda --scenario short.toml --budget 40 --plants 1 --out run";
/// One that is over at once, on a robot that is a file.
const QUICK: &str = "--robot two.urdf --scenario two.toml --budget 40 --plants 1 --out run";
const KILLS: usize = 30;

type Files = BTreeMap<String, Vec<u8>>;

/// A folder to run in. Reports name the run's folder, so that is the same everywhere.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let files = [("short.toml", SHORT), ("two.urdf", TWO_LINKS), ("two.toml", TWO_LINKS_MOVE)];
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn files(folder: &Path) -> Files {
    let entries = std::fs::read_dir(folder.join("run")).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())).collect()
}

fn assert_same(found: &Files, expected: &Files, when: &str) {
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{when}");
    for (name, content) in expected {
        assert!(found[name] == *content, "{name} differs {when}");
    }
}

fn whole(command: &str, threads: usize) -> Files {
    let folder = place();
    stdout(folder.path(), &format!("{command} --threads {threads}"), 0);
    files(folder.path())
}

fn spawn(folder: &Path, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_autotune"))
        .current_dir(folder)
        .args(arguments.split(' '))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn journal_lines(folder: &Path) -> usize {
    std::fs::read(folder.join("run/journal.jsonl"))
        .map_or(0, |bytes| bytes.iter().filter(|byte| **byte == b'\n').count())
}

/// A run that has found something and goes on.
fn under_way(folder: &Path, arguments: &str) -> Child {
    let child = spawn(folder, arguments);
    let began = Instant::now();
    while journal_lines(folder) < 4 {
        assert!(began.elapsed() < Duration::from_secs(60), "no generation in a minute");
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

#[test]
fn killed_at_any_moment_and_resumed_it_ends_the_same_to_the_byte() {
    let expected = whole(QUICK, 1);
    assert_eq!(expected.keys().collect::<Vec<_>>(), ["certificate.json", "gains.toml", "report.html", "run.json"]);
    for threads in [2, 4] {
        assert_same(&whole(QUICK, threads), &expected, &format!("with {threads} threads"));
    }
    let mut chance = ChaCha8Rng::seed_from_u64(1);
    let mut below = |end: u32| chance.next_u32() % end;
    let mut journals = BTreeSet::new();
    for kill in 0..KILLS {
        let folder = place();
        let mut child = spawn(folder.path(), QUICK);
        // How fast the machine is does not matter: so many generations, and a while.
        let (generations, while_us) = (below(40) as usize, u64::from(below(20_000)));
        while journal_lines(folder.path()) < generations && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        std::thread::sleep(Duration::from_micros(while_us));
        child.kill().unwrap();
        child.wait().unwrap();
        let lines = journal_lines(folder.path());
        if lines > 0 {
            journals.insert(lines);
            stdout(folder.path(), &format!("resume run --threads {}", 1 + kill % 2), 0);
        } else if !folder.path().join("run/run.json").exists() {
            // Killed before anything was begun.
            stdout(folder.path(), "resume run", 1);
            stdout(folder.path(), QUICK, 0);
        }
        let when = format!("after a kill at {generations} generations and {while_us} us, with {lines} lines");
        assert_same(&files(folder.path()), &expected, &when);
    }
    assert!(journals.len() > KILLS / 3, "the kills left journals of {journals:?} lines");
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_a_report_and_a_run_that_ends_the_same() {
    let expected = whole(TUNE, 2);
    let folder = place();
    let mut child = under_way(folder.path(), TUNE);
    // While it runs nobody else may work on it.
    for arguments in ["resume run", TUNE] {
        let assert = autotune(folder.path()).args(arguments.split(' ')).assert().code(1);
        let said = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
        assert!(said.contains("another process is at work"), "{said}");
    }
    assert_eq!(json(folder.path(), "runs .", 0)[0]["state"], "running");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let record: serde_json::Value = serde_json::from_slice(&files(folder.path())["run.json"]).unwrap();
    assert_eq!(record["termination"]["reason"], "interrupted");
    let made = record["evaluations"].as_array().unwrap().len();
    assert!((1..40).contains(&made));
    let listed = json(folder.path(), "runs .", 0);
    assert_eq!((&listed[0]["name"], &listed[0]["state"]), (&"run".into(), &"unfinished".into()));
    assert_eq!(listed[0]["candidates"], made);
    let assert = autotune(folder.path()).args(TUNE.split(' ')).assert().code(1);
    let said = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
    assert!(said.contains("unfinished run") && said.contains("autotune resume run"), "{said}");
    stdout(folder.path(), "resume run/", 0);
    assert_same(&files(folder.path()), &expected, "after Ctrl-C");
    assert_eq!(json(folder.path(), "runs .", 0)[0]["state"], "certified");
}

/// A limit on the size of files is a disk that is full, for the journal.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_keeps_what_is_there() {
    let expected = whole(TUNE, 2);
    let folder = place();
    let limited = |arguments: &str| {
        let script = format!("trap '' XFSZ; ulimit -f 10; exec {} {arguments}", env!("CARGO_BIN_EXE_autotune"));
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &script]).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, said) = limited(TUNE);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot append to the journal in run") && said.contains("autotune resume run"), "{said}");
    assert_eq!(files(folder.path()).keys().collect::<Vec<_>>(), ["journal.jsonl"]);
    let lines = journal_lines(folder.path());
    assert!(lines > 2, "{lines}");
    assert_eq!(limited("resume run").0, Some(1));
    assert_eq!(journal_lines(folder.path()), lines);
    stdout(folder.path(), "resume run", 0);
    assert_same(&files(folder.path()), &expected, "after a full disk");
}

#[cfg(unix)]
#[test]
fn a_folder_that_is_removed_is_an_error_and_not_made_again() {
    let folder = place();
    let child = under_way(folder.path(), TUNE);
    std::fs::remove_dir_all(folder.path().join("run")).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(!folder.path().join("run").exists());
}

#[test]
fn what_is_no_unfinished_run_is_refused_with_a_reason() {
    let folder = place();
    let refused = |arguments: &str, words: &[&str]| {
        let assert = autotune(folder.path()).args(arguments.split(' ')).assert().code(1);
        let said = String::from_utf8(assert.get_output().stderr.clone()).unwrap();
        assert!(words.iter().all(|word| said.contains(word)), "{said} should say {words:?}");
    };
    refused("resume nowhere", &["nowhere holds no unfinished run"]);
    refused("runs nowhere", &["cannot list nowhere"]);
    refused("diff nowhere run", &["nowhere/run.json"]);
    refused("diff nowhere", &["2 values"]);
    let mut child = under_way(folder.path(), TUNE);
    child.kill().unwrap();
    child.wait().unwrap();
    let path = folder.path().join("run/journal.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    let edited = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    };
    edited("\"robot\":\"panda\"", "\"robot\":\"panda-bare\"");
    refused("resume run", &["the robot's description has changed"]);
    edited("\"nalgebra\":\"", "\"nalgebra\":\"1.");
    refused("resume run", &["was begun with", "nalgebra 1."]);
    edited("{\"asked\"", "{\"asekd\"");
    refused("resume run", &["journal.jsonl, line 2", "asekd"]);
    edited("\"seed\":1", "\"seed\":1.5");
    refused("resume run", &["journal.jsonl, line 1"]);
    std::fs::write(&path, "").unwrap();
    refused("resume run", &["journal.jsonl, line 1"]);
    refused("runs .", &["journal.jsonl, line 1"]);
}

#[test]
fn runs_are_listed_and_compared() {
    let folder = place();
    for (seed, out) in [(1, "list/one"), (2, "list/two")] {
        let line = format!("--robot panda --scenario short.toml --budget 5 --plants 1 --seed {seed} --out {out}");
        stdout(folder.path(), &line, 0);
    }
    std::fs::create_dir(folder.path().join("list/empty")).unwrap();
    let listed = json(folder.path(), "runs list", 0);
    let names: Vec<&str> = listed.as_array().unwrap().iter().map(|run| run["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["one", "two"]);
    assert_eq!((&listed[1]["seed"], &listed[1]["candidates"]), (&2.into(), &5.into()));
    assert!(stdout(folder.path(), "runs list", 0).contains("certified"));

    let compared = json(folder.path(), "diff list/one list/two", 0);
    // With the plants, what the start reaches on them differs, and with it the limit on jitter.
    let asked = compared["asked"].as_object().unwrap();
    let keys: Vec<&str> = asked.keys().map(String::as_str).collect();
    assert_eq!(keys, ["question.goals.limits.1.bound", "question.search.seed"]);
    assert_eq!(asked["question.search.seed"], serde_json::json!([1, 2]));
    let record: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("list/two/run.json")).unwrap()).unwrap();
    let winner = record["winner"].as_u64().unwrap() as usize;
    assert_eq!(compared["gains"]["kappa_a"][1], record["evaluations"][winner]["gains"]["kappa_a"]);
    assert_eq!(compared["held_out"][1]["cost"], listed[1]["held_out_cost"]);
    let text = stdout(folder.path(), "diff list/one list/two", 0);
    assert!(text.contains("question.search.seed") && text.contains("kappa_a") && text.contains("overshoot"), "{text}");
    assert!(stdout(folder.path(), "diff list/one list/one", 0).contains("the same was asked"));
}
