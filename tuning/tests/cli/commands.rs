//! What each command prints, and its exit code, when nothing is wrong.

use crate::common::{TWO_LINKS, autotune, json, stdout, urdf};
use certune::verify::{Document, Record};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The figure of that name.
fn figure(claim: &Value, name: &str) -> f64 {
    let figures = claim["figures"].as_array().unwrap();
    let found = figures.iter().find(|figure| figure["name"] == name);
    found.unwrap_or_else(|| panic!("no figure `{name}` in {claim}"))["value"].as_f64().unwrap()
}

#[test]
fn help_and_version_exit_with_0() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in ["--help", "-h", "tune --help", "certify --help", "verify --help", "inspect --help", "--version"] {
        assert!(stdout(folder.path(), arguments, 0).contains("autotune"), "{arguments}");
    }
    assert!(stdout(folder.path(), "--help", 0).contains("Exit codes"));
}

#[test]
fn no_argument_prints_the_help_and_fails() {
    let folder = tempfile::tempdir().unwrap();
    let output = autotune(folder.path()).assert().code(1).get_output().clone();
    assert!(String::from_utf8_lossy(&output.stderr).contains("Usage"));
}

#[test]
fn inspect_gives_the_dynamics_under_the_promised_keys() {
    let folder = tempfile::tempdir().unwrap();
    let at = "inspect --robot panda --q=0,0.2,0,-1,0,1.2,0 --dq 0.1,0,0,-0.2,0,0,0";
    let found = json(folder.path(), at, 0);
    for key in ["mass_matrix_kg_m2", "gravity_jacobian_n_m_per_rad"] {
        let rows = found[key].as_array().unwrap();
        assert_eq!(rows.len(), 7);
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in numbers(row).into_iter().enumerate() {
                assert!((value - numbers(&rows[j])[i]).abs() < 1e-12, "{key} is symmetric");
            }
        }
    }
    for key in ["coriolis_torque_n_m", "gravity_torque_n_m", "ddq_rad_per_s2"] {
        assert_eq!(numbers(&found[key]).len(), 7, "{key}");
    }
    // Negative first numbers, with and without an equals sign, mean the same.
    let one = stdout(folder.path(), "inspect --robot panda --q=-1,0.2,0,-1,0,1.2,0", 0);
    assert_eq!(one, stdout(folder.path(), "inspect --robot panda --q -1,0.2,0,-1,0,1.2,0", 0));
    assert!(one.contains("mass matrix") && one.contains("panda_joint7"));
}

#[test]
fn holding_torque_leaves_the_arm_at_rest() {
    let folder = tempfile::tempdir().unwrap();
    let gravity = json(folder.path(), "inspect --robot panda-bare --q 0.3,0.2,0.1,-1,0.5,1.2,0", 0);
    let tau: Vec<String> = numbers(&gravity["gravity_torque_n_m"]).iter().map(f64::to_string).collect();
    let held = json(
        folder.path(),
        &format!("inspect --robot panda-bare --q 0.3,0.2,0.1,-1,0.5,1.2,0 --tau={}", tau.join(",")),
        0,
    );
    assert!(numbers(&held["ddq_rad_per_s2"]).iter().all(|ddq| ddq.abs() < 1e-9));
}

#[test]
fn simulate_reproduces_the_published_behaviour_and_writes_csv() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "simulate --robot panda --gains pezzato2020-simulation --scenario pick-and-place-paper --csv run.csv";
    let run = json(folder.path(), arguments, 0);
    assert!(run["diverged_at_s"].is_null());
    let segments = run["segments"].as_array().unwrap();
    assert_eq!(segments.len(), 5);
    for key in ["goal_rad", "final_error_rad", "settling_time_s", "overshoot", "peak_torque_n_m", "saturated_steps"] {
        assert_eq!(segments[0][key].as_array().unwrap().len(), 7, "{key}");
    }
    // The reference, B to A, joints 1 2 3 4 6, in mrad.
    let errors = numbers(&segments[0]["final_error_rad"]);
    for (joint, mrad) in [(0, -2.20), (1, -0.89), (2, -0.15), (3, 2.84), (5, -2.71)] {
        assert!((1e3 * errors[joint] - mrad).abs() < 0.02, "joint {joint}: {} rad", errors[joint]);
    }
    let csv = std::fs::read_to_string(folder.path().join("run.csv")).unwrap();
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.len() == 3001 && columns.iter().all(|count| *count == 29), "a header, and 30 s each 10 ms");
}

#[test]
fn simulate_runs_every_preset_and_another_arm() {
    let folder = tempfile::tempdir().unwrap();
    let presets = json(folder.path(), "presets", 0);
    let names: Vec<&str> = presets.as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 5);
    for name in names {
        let arguments = format!("simulate --robot panda --gains {name} --rotor-inertia 0.1 --scenario push");
        assert!(json(folder.path(), &arguments, 0)["diverged_at_s"].is_null(), "{name}");
    }
    let ur5 = urdf("ur5.urdf");
    let arguments = format!("simulate --robot {} --gains pezzato2020-simulation --friction 1", ur5.display());
    let run = json(folder.path(), &arguments, 0);
    assert_eq!(run["segments"][0]["goal_rad"].as_array().unwrap().len(), 6);
}

#[test]
fn a_run_that_diverges_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let preset = include_str!("../../presets/pezzato2020-simulation.toml").replace("sigma_dq = 1.0", "sigma_dq = 5.0");
    std::fs::write(folder.path().join("fast.toml"), preset).unwrap();
    let arguments = "simulate --robot panda --gains fast.toml --scenario pick-and-place-paper";
    assert!(json(folder.path(), arguments, 0)["diverged_at_s"].as_f64().is_some_and(|at_s| at_s > 0.0));
    assert!(stdout(folder.path(), arguments, 0).contains("DIVERGED"));
}

#[test]
fn what_certify_writes_verify_accepts() {
    let folder = tempfile::tempdir().unwrap();
    let exponential = "certify --robot panda --gains pezzato2020-simulation --claim exponential --out a.json";
    let made = json(folder.path(), exponential, 0);
    assert!(figure(&made["claims"][0], "rate") >= 0.7);
    assert_eq!(made["claims"][0]["grade"], "proved");
    let region =
        "certify --robot panda --gains pezzato2020-simulation --claim region --gravity-compensation on --out b.json";
    let without = json(folder.path(), region, 0);
    assert!(figure(&without["claims"][0], "radius") >= 0.20);
    let with = json(folder.path(), &format!("{region} --friction 1..3"), 0);
    assert!(figure(&with["claims"][0], "radius") >= 0.65);
    let checked = json(folder.path(), "verify a.json b.json", 0);
    assert_eq!(checked[0]["verdict"], "holds");
    assert_eq!(checked[0]["sha256"], made["sha256"]);
    assert!(checked[1]["claims"][0]["inequalities"][0]["smallest_pivot"].as_f64().unwrap() > 0.0);
    let words = stdout(folder.path(), "verify b.json", 0);
    assert!(words.contains("region: holds (proved)") && words.contains("assumptions") && words.contains("pivot"));
}

#[test]
fn a_refusal_exits_with_2_and_verifies_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let refused = "certify --robot panda --gains pezzato2020-libfranka --claim exponential --out refused.json";
    let words = stdout(folder.path(), refused, 2);
    assert!(words.contains("eigenvalue") && words.contains("the deviation has grown from 0.001"), "{words}");
    let simulated = &json(folder.path(), refused, 2)["claims"][0]["simulated"];
    assert!(simulated["to_rad"].as_f64().unwrap() > 2.0 * simulated["from_rad"].as_f64().unwrap());
    let checked = json(folder.path(), "verify refused.json", 2);
    assert_eq!(checked[0]["claims"][0]["verdict"], "refused");
}

#[test]
fn torque_limits_and_a_moving_goal_are_respected_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let plant = "certify --robot panda --gains pezzato2020-simulation --gravity-compensation on --friction 1..3 --rotor-inertia 0.1";
    let free = json(folder.path(), &format!("{plant} --claim region"), 0);
    let norm = json(folder.path(), &format!("{plant} --claim region --torque-limits 87"), 0);
    // Without a value, and with another option right behind it.
    let motors = json(folder.path(), &format!("{plant} --torque-limits --claim region,moving-goal --out m.json"), 0);
    let radius = |made: &Value| figure(&made["claims"][0], "radius");
    assert!(radius(&free) > radius(&norm) && radius(&norm) > radius(&motors) && radius(&motors) > 0.05);
    assert!((figure(&norm["claims"][0], "controller torque") - 87.0).abs() < 1e-9);
    let moving = motors["claims"].as_array().unwrap().last().unwrap();
    assert!(moving["kind"] == "moving-goal" && figure(moving, "goal speed") > 0.01);
    stdout(folder.path(), "verify m.json", 0);
}

#[test]
fn gains_of_each_joint_and_adaptive_gains_have_claims_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = |made: &Value| {
        let claims = made["claims"].as_array().unwrap();
        claims.iter().map(|claim| claim["kind"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let joints = "certify --robot panda --gains pezzato2020-robot --gravity-compensation on --friction 1..3 --claim joint-region";
    let made = json(folder.path(), joints, 0);
    assert_eq!(kinds(&made), ["joint-region"]);
    assert_eq!(made["claims"][0]["grade"], "proved");

    let adaptive = "certify --robot panda --gains pezzato2020-mrac-simulation --gravity-compensation on";
    let released = json(folder.path(), adaptive, 2);
    assert!(kinds(&released).contains(&"adaptive-convergence".to_owned()));
    assert!(stdout(folder.path(), adaptive, 2).contains("law = \"reference-model\""));
    let preset = include_str!("../../presets/pezzato2020-mrac-simulation.toml");
    let equations = preset.replace("released-code", "reference-model");
    assert_ne!(equations, preset);
    std::fs::write(folder.path().join("equations.toml"), equations).unwrap();
    let line = "certify --robot panda --gains equations.toml --gravity-compensation on --claim adaptive-convergence --out e.json";
    let made = json(folder.path(), line, 0);
    assert_eq!((&made["claims"][0]["verdict"], &made["claims"][0]["grade"]), (&"holds".into(), &"proved".into()));
    // The enclosure over the goal's box is no built-in constant: its record is written beside the certificate, and looked for there.
    stdout(folder.path(), "verify e.json", 0);
    std::fs::rename(folder.path().join("e.constants.json"), folder.path().join("moved.json")).unwrap();
    stdout(folder.path(), "verify e.json", 2);
    stdout(folder.path(), "verify e.json --constants moved.json", 0);
}

#[test]
fn a_scenario_gives_certify_its_family() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "certify --robot panda --gains pezzato2020-simulation --scenario pick-and-place --claim exponential";
    let made = json(folder.path(), arguments, 0);
    assert_eq!(made["family"]["payload_kg"][1], 0.7);
    assert!(made["about"].as_str().unwrap().contains("0.7 kg"));
}

#[test]
fn lists_name_what_is_built_in() {
    let folder = tempfile::tempdir().unwrap();
    for (command, name) in [("robots", "panda-cuboid"), ("presets", "pezzato2020-robot"), ("scenarios", "payload-swap")]
    {
        assert!(stdout(folder.path(), command, 0).contains(name));
        let entries = json(folder.path(), command, 0);
        let entries = entries.as_array().unwrap();
        assert!(entries.iter().any(|entry| entry["name"] == name));
        assert!(entries.iter().all(|entry| !entry["description"].as_str().unwrap().is_empty()));
    }
}

/// A record that holds what `document` says of its arm, without the proofs that would make it follow.
fn unproved_record(document: &Document) -> Record {
    Record {
        schema: 0,
        arm: document.arm.clone(),
        arms: document.family.arms.clone(),
        over: document.constants.over.clone(),
        bounds: document.constants.bounds.clone(),
        proofs: Vec::new(),
        sha256: String::new(),
    }
    .sealed()
}

/// Claims that rest on a record are called proved, the checker asks for the record, and does not believe it when it is derived again.
#[test]
fn claims_rest_on_a_record_that_must_be_at_hand_and_follow_from_its_proofs() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two.urdf"), TWO_LINKS).unwrap();
    let claims = "--gravity-compensation on --friction 1..3 --claim exponential,region --out c.json";
    let certify = format!("certify --robot two.urdf --gains pezzato2020-simulation {claims}");
    assert_eq!(json(folder.path(), &certify, 0)["claims"][1]["grade"], "conditional");
    let sampled = std::fs::read_to_string(folder.path().join("c.json")).unwrap();
    let record = unproved_record(&serde_json::from_str(&sampled).unwrap());
    std::fs::write(folder.path().join("r.json"), serde_json::to_string(&record).unwrap()).unwrap();

    // A payload that the record does not hold.
    let heavier = json(folder.path(), &format!("{certify} --constants r.json --payload 1"), 0);
    assert_eq!(heavier["claims"][0]["grade"], "conditional");
    let made = json(folder.path(), &format!("{certify} --constants r.json"), 0);
    assert_eq!(made["constants_sha256"], record.sha256.as_str());
    assert!(made["claims"].as_array().unwrap().iter().all(|claim| claim["grade"] == "proved"));
    stdout(folder.path(), "verify c.json", 0);
    let full = json(folder.path(), "verify --full c.json --robot two.urdf", 2);
    assert_eq!(full["constants"][0]["derived_again"], false);
    // Not a built-in robot: its file is asked for.
    stdout(folder.path(), "verify --full c.json", 1);
}

/// The recorded result of the main job is still accepted.
#[test]
fn the_recorded_certificate_verifies() {
    let folder = tempfile::tempdir().unwrap();
    let recorded = concat!(env!("CARGO_MANIFEST_DIR"), "/results/panda-aic-1/certificate.json");
    let checked = stdout(folder.path(), &format!("verify {recorded}"), 0);
    assert!(checked.contains("exponential: holds (proved)") && checked.contains("region: holds (proved)"));
}
