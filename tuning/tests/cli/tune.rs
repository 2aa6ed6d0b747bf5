//! The main command: its four files, the same for any number of threads, and what it leaves when nothing is certified.

use std::path::Path;

use crate::common::{SHORT, json, stdout};

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = entries.collect();
    names.sort();
    names
}

const SPACE: &str = include_str!("../../spaces/panda-aic.toml");
const FILES: [&str; 4] = ["certificate.json", "gains.toml", "report.html", "run.json"];

#[test]
fn a_run_is_the_same_to_the_byte_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("short.toml"), SHORT).unwrap();
    let one =
        json(folder.path(), "tune --robot panda --scenario short.toml --budget 8 --seed 3 --threads 1 --out one", 0);
    // The default command is `tune`.
    let two = json(folder.path(), "--robot panda --scenario short.toml --budget 8 --seed 3 --threads 2 --out two", 0);
    assert_eq!(names(&at("one")), FILES);
    assert_eq!(names(&at("two")), FILES);
    for name in ["gains.toml", "run.json", "certificate.json"] {
        assert!(read(at("one").join(name)) == read(at("two").join(name)), "{name} differs");
    }
    assert_eq!(one["gains"], two["gains"]);
    assert_eq!(one["certified"], true);
    let cost = |side: &str| one["held_out"][side]["cost"].as_f64().unwrap();
    assert!(cost("tuned") <= cost("published"));

    let record = read(at("one").join("run.json"));
    for word in [folder.path().to_str().unwrap(), "elapsed", "threads", "short.toml"] {
        assert!(!record.contains(word), "run.json holds `{word}`");
    }
    let gains = read(at("one").join("gains.toml"));
    assert!(gains.contains("source = ") && gains.contains("seed 3") && gains.contains("scenario short"), "{gains}");

    stdout(folder.path(), "verify one/certificate.json two/certificate.json", 0);
    let simulate = "simulate --robot panda --gains one/gains.toml --scenario short.toml";
    assert!(json(folder.path(), simulate, 0)["diverged_at_s"].is_null());

    // The page can be made again from the folder alone.
    let page = read(at("one").join("report.html"));
    assert!(page.starts_with("<!doctype html>") && page.len() < 2_000_000);
    // Eight candidates are too few for a surface; the maps need none.
    let too_few = "candidates of one round have a cost, and a quadratic in 5 knobs needs at least 42";
    for expected in
        [too_few, "Stability over kappa_a and sigma_dq", "Stability over kappa_mu and sigma_mu", "certified on"]
    {
        assert!(page.contains(expected), "{expected}");
    }
    std::fs::remove_file(at("one").join("report.html")).unwrap();
    stdout(folder.path(), "report one", 0);
    assert!(read(at("one").join("report.html")) == page, "`report` makes another page than `tune`");
}

/// The search is after what the certificate says, so nothing that a solver lets through but the checker does not is worth anything.
#[test]
fn a_search_for_the_largest_radius_ends_with_a_certificate_that_has_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.toml"), SHORT).unwrap();
    let run = |objective: &str, out: &str| {
        let line = format!("--robot panda --scenario short.toml --objective {objective} --budget 20 --out {out}");
        json(folder.path(), &line, 0)
    };
    let figure = |run: &serde_json::Value, claim: usize, name: &str| {
        let figures = run["claims"][claim]["figures"].as_array().unwrap();
        figures.iter().find(|figure| figure["name"] == name).unwrap()["value"].as_f64().unwrap()
    };
    for (objective, claim, name) in [("certified-radius", 1, "radius"), ("certified-rate", 0, "rate")] {
        let made = run(objective, objective);
        let record: serde_json::Value =
            serde_json::from_str(&read(folder.path().join(objective).join("run.json"))).unwrap();
        assert_eq!(record["question"]["goals"]["objective"], objective);
        let evaluations = record["evaluations"].as_array().unwrap();
        let cost = |index: u64| evaluations[index as usize]["outcome"]["cost"].as_f64().unwrap();
        let winner = record["winner"].as_u64().unwrap();
        // No worse than the published gains, and exactly what the certificate says.
        assert!(cost(winner) <= cost(0), "{objective}: {} against {}", cost(winner), cost(0));
        assert!((cost(winner) * figure(&made, claim, name) - 1.0).abs() < 1e-12);
        for knob in record["space"]["knobs"].as_array().unwrap() {
            let found = evaluations[winner as usize]["gains"][knob["name"].as_str().unwrap()].as_f64().unwrap();
            let end = |key: &str| knob[key].as_f64().unwrap();
            assert!(end("lower") <= found && found <= end("upper"));
        }
        stdout(folder.path(), &format!("verify {objective}/certificate.json"), 0);
        assert!(
            read(folder.path().join(objective).join("report.html")).contains("The search was after the best certified")
        );
    }
}

/// The adaptive controller's claims are about one goal each, so there is a certificate for every goal of the scenario, and the files of an earlier run go.
#[test]
fn mrac_is_tuned_and_certified_at_every_goal() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join("out").join(name);
    // Claims about the adaptive controller end at light and frictionless arms.
    let scenario = SHORT
        .replace("mass_uncertainty = 0.2", "mass_uncertainty = 0")
        .replace("[0, 0.7]", "[0, 0]")
        .replace("[0.5, 2]", "[2, 3]")
        .replace("[0, 0.1]", "[0.1, 0.1]")
        .replace("duration_s = 1", "duration_s = 3");
    std::fs::write(folder.path().join("easy.toml"), scenario).unwrap();
    std::fs::create_dir(folder.path().join("out")).unwrap();
    std::fs::write(at("certificate.json"), "of an earlier run").unwrap();
    std::fs::write(at("certificate-3.json"), "of an earlier run").unwrap();
    std::fs::write(at("certificate-3.constants.json"), "of an earlier run").unwrap();
    std::fs::write(at("certificate-mine.json"), "mine").unwrap();
    let line = "--robot panda --controller mrac --scenario easy.toml --budget 100 --plants 4 --seed 3 --out out";
    let run = json(folder.path(), line, 0);
    let expected = [
        "certificate-1.constants.json",
        "certificate-1.json",
        "certificate-2.constants.json",
        "certificate-2.json",
        "certificate-mine.json",
        "gains.toml",
        "report.html",
        "run.json",
    ];
    assert_eq!(names(&folder.path().join("out")), expected);
    let cost = |side: &str| run["held_out"][side]["cost"].as_f64().unwrap();
    assert!(cost("tuned") < 0.7 * cost("published"), "{} against {}", cost("tuned"), cost("published"));
    let claims = run["claims"].as_array().unwrap();
    assert_eq!(claims.len(), 4);
    assert!(claims.iter().all(|claim| claim["verdict"] == "holds" && claim["grade"] == "proved"));
    assert_eq!(run["gains"]["law"], "reference-model");

    // These claims rest on constants around one goal, which no built-in record has: they stand beside.
    stdout(folder.path(), "verify out/certificate-1.json out/certificate-2.json", 0);
    let page = read(at("report.html"));
    stdout(folder.path(), "report out", 0);
    assert!(read(at("report.html")) == page, "`report` makes another page than `tune`");
    let simulate = "simulate --robot panda --gains out/gains.toml --scenario easy.toml --friction 2.5";
    assert!(json(folder.path(), simulate, 0)["diverged_at_s"].is_null());
    let page = read(at("report.html"));
    assert!(
        page.contains("What was learnt") && !page.contains("Stability over"),
        "MRAC has none of the gains of the maps"
    );
    assert!(!page.contains("Pole map") && page.contains("certificate-2.json"));
    // A winner without one of its certificates is no winner.
    std::fs::remove_file(at("certificate-2.json")).unwrap();
    stdout(folder.path(), "report out", 1);
}

/// A folder with an earlier run's gains and a file of the user's; a run in it that certifies nothing.
fn uncertified(payload_kg: &str, budget: usize) -> (tempfile::TempDir, serde_json::Value) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    // Gravity held by the controller, no friction, and loads of which the published gains know nothing.
    let scenario = SHORT
        .replace("gravity_compensation = true", "gravity_compensation = false")
        .replace("[0.5, 2]", "[0, 0]")
        .replace("[0, 0.7]", payload_kg);
    std::fs::write(folder.path().join("hard.toml"), scenario).unwrap();
    // A candidate beyond a limit would not come before the certifier.
    let limits = "overshoot = 0.02\ntorque_rate_rms_n_m_per_s = \"start\"\n";
    assert!(SPACE.contains(limits));
    std::fs::write(folder.path().join("space.toml"), SPACE.replace(limits, "")).unwrap();
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("gains.toml"), "of an earlier run").unwrap();
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    let line = format!("--robot panda --scenario hard.toml --space space.toml --budget {budget} --out out");
    let run = json(folder.path(), &line, 2);
    assert_eq!(run["certified"], false);
    assert!(run["gains"].is_null());
    assert_eq!(read(out.join("notes.txt")), "mine");
    assert!(read(out.join("report.html")).contains("No candidate was certified"));
    stdout(folder.path(), "report out", 2);
    (folder, run)
}

#[test]
fn without_a_certificate_there_are_no_gains() {
    let (folder, run) = uncertified("[0, 4]", 2);
    // An earlier run's gains would be taken for this one's.
    assert_eq!(names(&folder.path().join("out")), ["certificate.json", "notes.txt", "report.html", "run.json"]);
    assert_eq!(run["claims"][1]["verdict"], "not proved");
    // What the file says is checked, and is no success.
    stdout(folder.path(), "verify out/certificate.json", 2);
}

#[test]
fn without_a_stable_candidate_there_is_no_claim_either() {
    let (folder, run) = uncertified("[0, 20]", 1);
    assert_eq!(names(&folder.path().join("out")), ["notes.txt", "report.html", "run.json"]);
    assert_eq!(run["claims"].as_array().map(Vec::len), Some(0));
}
