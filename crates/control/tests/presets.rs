//! The published presets are valid gains of the controllers they name, and hold the published numbers.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a preset that cannot be read is a failed test")]

use certune_control::aic::{AicGains, AicParams};
use certune_control::mrac::{MracGains, MracLaw, MracParams};
use toml::{Table, Value};

const STEP_S: f64 = 1e-3;

fn read(name: &str) -> Table {
    let path = format!("{}/../../tuning/presets/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}")).parse().unwrap()
}

/// A number for all joints or a list of seven.
fn row(table: &Table, key: &str) -> [f64; 7] {
    match &table[key] {
        Value::Float(x) => [*x; 7],
        Value::Array(list) => std::array::from_fn(|i| {
            assert_eq!(list.len(), 7, "{key}");
            list[i].as_float().unwrap()
        }),
        other => panic!("{key} is {other}"),
    }
}

fn header(preset: &Table, controller: &str) {
    assert_eq!(preset["schema"].as_integer(), Some(1));
    assert_eq!(preset["controller"].as_str(), Some(controller));
    assert!(preset["source"].as_str().unwrap().contains("Active Inference"));
    assert_eq!(preset.len(), 4);
}

fn aic(name: &str) -> AicGains<7> {
    let preset = read(name);
    header(&preset, "aic");
    let table = preset["aic"].as_table().unwrap();
    assert_eq!(table.len(), 7);
    let gains = AicGains {
        kappa_mu: row(table, "kappa_mu"),
        kappa_a: row(table, "kappa_a"),
        sigma_q: row(table, "sigma_q"),
        sigma_dq: row(table, "sigma_dq"),
        sigma_mu: row(table, "sigma_mu"),
        sigma_dmu: row(table, "sigma_dmu"),
        reference_time_constant_s: row(table, "reference_time_constant_s"),
    };
    AicParams::new(&gains, STEP_S).unwrap();
    gains
}

fn mrac(name: &str) -> MracGains<7> {
    let preset = read(name);
    header(&preset, "mrac");
    let table = preset["mrac"].as_table().unwrap();
    assert_eq!(table.len(), 20);
    let family = |prefix: &str| [1, 2, 3].map(|k| row(table, &format!("{prefix}{k}")));
    let gains = MracGains {
        law: MracLaw::from_name(table["law"].as_str().unwrap()).unwrap(),
        omega_rad_per_s: row(table, "omega_rad_per_s"),
        zeta: row(table, "zeta"),
        l1: row(table, "l1"),
        l2: row(table, "l2"),
        alpha: family("alpha"),
        e0: family("e0"),
        e1: family("e1"),
        f0: family("f0"),
        f1: family("f1"),
    };
    MracParams::new(&gains, STEP_S).unwrap();
    gains
}

#[test]
fn active_inference_presets() {
    let shared = |kappa_a| AicGains {
        kappa_mu: [11.67],
        kappa_a: [kappa_a],
        sigma_q: [1.0],
        sigma_dq: [1.0],
        sigma_mu: [5.0],
        sigma_dmu: [10.0],
        reference_time_constant_s: [1.0],
    };
    assert_eq!(aic("pezzato2020-simulation").shared(), Some(shared(700.0)));
    assert_eq!(aic("pezzato2020-libfranka").shared(), Some(shared(200.0)));
    let wrist = [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0];
    let robot = AicGains {
        sigma_q: wrist,
        sigma_dq: wrist,
        sigma_mu: [15.0; 7],
        sigma_dmu: [30.0; 7],
        ..shared(200.0).on_every_joint()
    };
    assert_eq!(aic("pezzato2020-robot"), robot);
}

fn alternating(odd: f64, even: f64) -> [f64; 7] {
    [odd, even, odd, even, odd, even, odd]
}

/// One number for the first four joints, another for the last three.
fn wrist(arm: f64, wrist: f64) -> [f64; 7] {
    [arm, arm, arm, arm, wrist, wrist, wrist]
}

#[test]
fn mrac_presets() {
    let none = [0.0; 7];
    let simulation = MracGains {
        law: MracLaw::ReleasedCode,
        omega_rad_per_s: [2.0; 7],
        zeta: [1.0; 7],
        l1: [1.0; 7],
        l2: [1.0; 7],
        alpha: [[40.0, 200.0, 40.0, 200.0, 200.0, 200.0, 40.0], [4.0; 7], none],
        e0: [alternating(20.0, 40.0), alternating(2.0, 4.0), none],
        e1: [alternating(10.0, 20.0), alternating(1.0, 2.0), none],
        f0: [wrist(10.0, 50.0), [1.0; 7], none],
        f1: [[1.0; 7], wrist(1.0, 10.0), none],
    };
    let robot = MracGains {
        alpha: [[2.0, 10.0, 2.0, 10.0, 10.0, 10.0, 2.0], [0.2; 7], none],
        e0: [alternating(1.0, 2.0), alternating(0.1, 0.2), none],
        e1: [alternating(1.0, 2.0), alternating(0.1, 0.2), none],
        f0: [wrist(1.0, 5.0), [0.1; 7], none],
        f1: [[0.1; 7], wrist(0.1, 1.0), none],
        ..simulation
    };
    assert_eq!(mrac("pezzato2020-mrac-simulation"), simulation);
    assert_eq!(mrac("pezzato2020-mrac-robot"), robot);
}
