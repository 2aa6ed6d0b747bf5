use std::path::Path;

use super::*;
use crate::goals::{Bound, Goal, Reference};
use certune_closed_loop::{GainsFile, Problem};
use proptest::prelude::*;

const SHIPPED: &str = include_str!("../../../../tuning/spaces/panda-aic.toml");
const MRAC: &str = include_str!("../../../../tuning/spaces/panda-mrac.toml");
const MRAC_PRESET: &str = include_str!("../../../../tuning/presets/pezzato2020-mrac-simulation.toml");
const PRESET: &str = include_str!("../../../../tuning/presets/pezzato2020-simulation.toml");
/// An arm of seven joints.
const INERTIA_KG_M2: [f64; 7] = [0.9, 1.2, 0.7, 0.45, 0.02, 0.04, 0.003];

/// One knob of each kind, for some joints each: a per-joint space of the AIC.
const PER_JOINT: &str = r#"
schema = 1
controller = "aic"
[search]
method = "schedule"
[fixed]
sigma_q = 1.0
sigma_dq = [1, 1, 1, 1, 2, 2, 2]
reference_time_constant_s = 1.0
[gains.kappa_mu]
lower = 2.0
upper = 60.0
scale = "linear"
[gains.sigmas]
rows = ["sigma_mu", "sigma_dmu"]
tie = "start"
lower = 0.1
upper = 10.0
scale = "log"
[gains.arm]
rows = ["kappa_a"]
joints = [1, 2, 3, 4]
tie = "inertia"
lower = 50.0
upper = 20000.0
scale = "log"
[gains.wrist]
rows = ["kappa_a"]
joints = [5, 6, 7]
lower = 5.0
upper = 2000.0
scale = "log"
"#;

fn preset(text: &str) -> Gains {
    GainsFile::parse(Path::new("preset.toml"), text).unwrap().gains
}

fn published() -> Gains {
    preset(PRESET)
}

fn holding(row: &str, value: f64) -> Gains {
    published().with(row, PerJoint::Shared(value))
}

fn on_arm(text: &str, start: &Gains) -> Result<Space, SpaceError> {
    let setting = Setting { start: Some(start), inertia_kg_m2: Some(&INERTIA_KG_M2) };
    SpaceFile::parse(Path::new("space.toml"), text)?.on(setting)
}

fn shipped() -> Space {
    SpaceFile::parse(Path::new("space.toml"), SHIPPED).unwrap().on(Setting::default()).unwrap()
}

fn per_joint_start() -> Gains {
    published().with("sigma_dq", PerJoint::Each(vec![1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0]))
}

/// A file with one piece of text replaced, on the arm; its error without the place, which must have a line.
fn edited(text: &str, from: &str, to: &str, start: &Gains) -> Result<Space, SpaceError> {
    assert!(text.contains(from), "{from:?} is not in the file");
    match on_arm(&text.replacen(from, to, 1), start) {
        Err(SpaceError::At { location, problem }) => {
            assert!(location.line_column.is_some(), "{problem} has no line");
            Err(*problem)
        }
        other => other,
    }
}

#[test]
fn the_shipped_space_has_five_degrees_of_freedom_and_holds_the_published_gains() {
    let space = shipped();
    let order: Vec<&str> = space.knobs().iter().map(|knob| knob.name.as_str()).collect();
    assert_eq!(order, ["kappa_mu", "kappa_a", "sigma_dq", "sigma_mu", "sigma_dmu"]);
    assert_eq!(space.method(), Method::Schedule);
    assert_eq!(space.admit(&published()).unwrap(), published());
    assert_eq!(space.decode(&space.encode(&published())), published());
}

#[test]
fn the_shipped_spaces_say_what_they_are_after() {
    let [aic, mrac] =
        [SHIPPED, MRAC].map(|text| SpaceFile::parse(Path::new("space.toml"), text).unwrap().goals().clone());
    let limits: Vec<(Goal, Bound)> = aic.limits.iter().map(|limit| (limit.goal, limit.bound)).collect();
    assert_eq!(aic.objective, Goal::SettlingTime);
    assert_eq!(limits, [(Goal::Overshoot, Bound::At(0.02)), (Goal::Jitter, Bound::Of(Reference::Start))]);
    assert!(mrac.objective == Goal::SettlingCost && mrac.limits.is_empty());
}

#[test]
fn goals_out_of_range_are_refused_with_their_line() {
    let start = published();
    let refused = |from: &str, to: &str| edited(SHIPPED, from, to, &start).unwrap_err().to_string();
    assert!(refused("overshoot = 0.02", "overshoot = -1").contains("overshoot = -1, expected a positive"));
    assert!(refused("objective =", "cvar = 1.0\nobjective =").contains("cvar = 1, expected"));
    let unknown = on_arm(&SHIPPED.replace("overshoot = 0.02", "overshot = 0.02"), &start).unwrap_err().to_string();
    assert!(unknown.contains("overshot") && unknown.contains("overshoot"), "{unknown}");
    let word = on_arm(&SHIPPED.replace("overshoot = 0.02", "overshoot = \"low\""), &start).unwrap_err().to_string();
    assert!(word.contains("limits.overshoot") || word.contains("overshoot"), "{word}");
}

#[test]
fn a_cold_start_is_no_preset() {
    let from = |start: &str| {
        let text = SHIPPED.replace("start = \"pezzato2020-simulation\"\n", start);
        SpaceFile::parse(Path::new("space.toml"), &text).unwrap()
    };
    let published = "start = \"pezzato2020-simulation\"\n";
    let (cold, preset, silent) = (from("start = \"cold\"\n"), from(published), from(""));
    assert_eq!((cold.is_cold(), cold.start()), (true, None));
    assert_eq!((preset.is_cold(), preset.start()), (false, Some("pezzato2020-simulation")));
    assert_eq!((silent.is_cold(), silent.start()), (false, None));
}

#[test]
fn every_corner_of_the_shipped_space_is_slow_enough_for_euler_at_1_khz() {
    let space = shipped();
    let corner = |end| space.decode(&vec![end; space.dimension()]);
    let number = |gains: &Gains, row| gains.row(row).and_then(PerJoint::shared).unwrap();
    let (lower, upper) = (corner(0.0), corner(1.0));
    let sigmas = ["sigma_q", "sigma_dq", "sigma_mu", "sigma_dmu"];
    let leak_per_s = number(&upper, "kappa_mu") * sigmas.map(|row| 1.0 / number(&lower, row)).iter().sum::<f64>();
    assert!(leak_per_s * 1e-3 < 0.75, "the beliefs leak at {leak_per_s} /s");
}

#[test]
fn a_start_is_scaled_to_the_fixed_variance() {
    let space = shipped();
    assert_eq!(space.admit(&rescaled(&published(), 4.0, 1.0)).unwrap(), published());
    let outside = space.admit(&holding("kappa_a", 1e6)).unwrap_err();
    assert!(matches!(&outside, SpaceError::StartOutside { knob, value: 1e6, .. } if knob == "kappa_a"), "{outside}");
    assert!(matches!(
        space.admit(&holding("reference_time_constant_s", 0.5)),
        Err(SpaceError::StartNotFixed { row: "reference_time_constant_s", .. })
    ));
    assert!(matches!(
        space.admit(&preset(MRAC_PRESET)),
        Err(SpaceError::StartController { found: "mrac", expected: "aic" })
    ));
}

#[test]
fn bad_files_are_refused_with_the_gain_and_the_numbers() {
    let range = "[gains.kappa_mu]\nlower = 2.0\nupper = 60.0";
    let edited = |from: &str, to: &str| edited(SHIPPED, from, to, &published());
    let replaced = |with| edited(range, &format!("[gains.kappa_mu]\n{with}"));
    let inverted = replaced("lower = 60.0\nupper = 2.0").unwrap_err();
    assert_eq!(inverted, SpaceError::Inverted { knob: "kappa_mu".to_owned(), lower: 60.0, upper: 2.0 });
    assert!(matches!(replaced("lower = 2.0\nupper = 2.0"), Err(SpaceError::Inverted { .. })));
    assert!(matches!(replaced("lower = 0.0\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = -1.0\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = nan\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = 1.0\nupper = inf"), Err(SpaceError::Bounds { .. })));
    let file = |error: SpaceError| match error {
        SpaceError::File(error) => *error.problem,
        other => panic!("{other}"),
    };
    assert_eq!(file(edited("schema = 1", "schema = 2").unwrap_err()), Problem::Schema { found: 2, expected: 1 });
    assert_eq!(edited("\"aic\"", "\"mrac\"").unwrap_err(), SpaceError::Law { wanted: true });
    let law = "\"aic\"\nlaw = \"raw-goal\"";
    assert_eq!(edited("\"aic\"", law).unwrap_err(), SpaceError::Law { wanted: false });
    assert!(matches!(file(edited("\"aic\"", "\"pid\"").unwrap_err()), Problem::UnknownName { .. }));
    assert!(matches!(file(edited("method = \"schedule\"", "").unwrap_err()), Problem::MissingKey));
    assert!(matches!(file(edited("lower = 2.0", "lower = \"two\"").unwrap_err()), Problem::WrongType { .. }));
    assert!(matches!(file(edited("schema = 1", "schema = 1\nschema = 1").unwrap_err()), Problem::Syntax { .. }));
    assert_eq!(edited("sigma_q = 1.0", "").unwrap_err(), SpaceError::Missing { row: "sigma_q" });
    assert_eq!(
        edited("sigma_q = 1.0", "sigma_q = -1.0").unwrap_err(),
        SpaceError::Fixed { row: "sigma_q", value: -1.0 }
    );
    assert!(matches!(
        edited("sigma_q = 1.0", "sigma_q = 1.0\nkappa_mu = 1.0"),
        Err(SpaceError::Twice { row: "kappa_mu", .. })
    ));
    let freed = "\n[gains.sigma_q]\nlower = 0.1\nupper = 2.0\nscale = \"log\"\n";
    let both = "sigma_q = 1.0\nreference_time_constant_s = 1.0\n";
    let error = edited(both, &format!("reference_time_constant_s = 1.0\n{freed}")).unwrap_err();
    assert_eq!(error, SpaceError::Redundant { controller: "aic" });
    let head = SHIPPED.split("[fixed]").next().unwrap();
    let rows: String = published().rows().iter().map(|(row, _)| format!("{row} = 1.0\n")).collect();
    let fixed = format!("{head}[fixed]\n{rows}[gains]\n");
    assert!(
        matches!(on_arm(&fixed, &published()), Err(SpaceError::At { problem, .. }) if *problem == SpaceError::NothingFree)
    );
}

#[test]
fn ties_that_make_no_table_are_refused() {
    let start = per_joint_start();
    let edited = |from: &str, to: &str| edited(PER_JOINT, from, to, &start).unwrap_err();
    let (arm, wrist) = ("joints = [1, 2, 3, 4]", "joints = [5, 6, 7]");
    assert_eq!(edited(wrist, "joints = [5, 6]"), SpaceError::MissingJoint { row: "kappa_a", joint: 7 });
    assert!(matches!(edited(wrist, "joints = [4, 5, 6, 7]"), SpaceError::Shared { row: "kappa_a", .. }));
    assert!(matches!(edited(wrist, "joints = [5, 6, 8]"), SpaceError::Joint { joint: 8, joints: 7, .. }));
    assert!(matches!(edited(arm, "joints = [0, 1, 2]"), SpaceError::Joint { joint: 0, joints: 7, .. }));
    assert!(matches!(edited(arm, "joints = []"), SpaceError::Empty { .. }));
    assert!(matches!(edited("rows = [\"sigma_mu\", \"sigma_dmu\"]", "rows = []"), SpaceError::Missing { .. }));
    assert!(matches!(
        edited("[1, 1, 1, 1, 2, 2, 2]", "[1, 1]"),
        SpaceError::Length { row: "sigma_dq", found: 2, joints: 7 }
    ));
    let text = edited("\"sigma_dmu\"]", "\"sigma_dnu\"]").to_string();
    assert!(text.contains("gains.sigmas.rows[1]") && text.contains("did you mean `sigma_dmu`"), "{text}");
    let bare = SpaceFile::parse(Path::new("space.toml"), PER_JOINT).unwrap();
    let problem = |setting| match bare.on(setting) {
        Err(SpaceError::At { problem, .. }) => *problem,
        other => panic!("{other:?}"),
    };
    assert!(matches!(problem(Setting { start: Some(&start), inertia_kg_m2: None }), SpaceError::NeedsArm { .. }));
    let inertia_kg_m2 = Some(&INERTIA_KG_M2[..]);
    assert!(matches!(problem(Setting { start: None, inertia_kg_m2 }), SpaceError::NeedsStart { .. }));
}

#[test]
fn a_misspelt_key_is_named_with_its_line() {
    for (from, to, key) in [
        ("[gains.kappa_mu]", "[gains.kapa_mu]", "gains.kapa_mu"),
        ("[fixed]", "[fixed]\nkapa_mu = 1.0", "fixed.kapa_mu"),
    ] {
        let error = edited(SHIPPED, from, to, &published()).unwrap_err().to_string();
        let line = 1 + SHIPPED.split(from).next().unwrap().matches('\n').count() + to.matches('\n').count();
        assert!(error.starts_with(&format!("space.toml:{line}:")), "{error}");
        assert!(error.contains(key) && error.contains("did you mean `kappa_mu`"), "{error}");
    }
}

#[test]
fn each_tie_sets_its_numbers() {
    let space = on_arm(PER_JOINT, &per_joint_start()).unwrap();
    // kappa_mu, then kappa_a of arm and wrist, then the sigmas: the order of a gains file.
    let order: Vec<&str> = space.knobs().iter().map(|knob| knob.name.as_str()).collect();
    assert_eq!(order, ["kappa_mu", "arm", "wrist", "sigmas"]);
    let gains = space.decode(&[0.5, 1.0, 0.0, 1.0]);
    let values = |row: &str| gains.row(row).unwrap().values().to_vec();
    assert_eq!(values("kappa_mu"), [31.0]);
    assert_eq!(values("kappa_a"), [18000.0, 24000.0, 14000.0, 9000.0, 5.0, 5.0, 5.0]);
    assert_eq!((values("sigma_mu"), values("sigma_dmu")), (vec![50.0], vec![100.0]));
    assert_eq!(values("sigma_dq"), [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
    let knob = &space.knobs()[2];
    assert_eq!(knob.scaled(&gains, 1.1).row("kappa_a").unwrap().of(3), Some(9000.0));
    assert_eq!(knob.scaled(&gains, 2.0).row("kappa_a").unwrap().of(4), Some(10.0));
}

#[test]
fn the_adaptive_start_takes_the_law_of_the_space_and_keeps_its_pattern() {
    let start = preset(MRAC_PRESET);
    let space = on_arm(MRAC, &start).unwrap();
    let admitted = space.admit(&start).unwrap();
    assert_ne!(admitted, start);
    assert!(start.rows().iter().zip(admitted.rows()).all(|(a, b)| *a == b), "only the law is another");
    let knob = |name: &str| space.knobs().iter().find(|knob| knob.name == name).unwrap();
    assert!((knob("adaptation").value(&admitted) - 1.0).abs() < 1e-15);
    // 40, 200, .. over the inertias, which no value of the knob makes: the mean of their logarithms.
    let alpha1 = [40.0, 200.0, 40.0, 200.0, 200.0, 200.0, 40.0];
    let mean = alpha1.iter().zip(INERTIA_KG_M2).take(4).map(|(a, m): (&f64, f64)| (a / m).ln()).sum::<f64>() / 4.0;
    assert!((knob("alpha1_arm").value(&admitted) / mean.exp() - 1.0).abs() < 1e-12);
    assert!(matches!(
        edited(MRAC, "l1 = 1.0\n", "l1 = 2.0\n", &start),
        Err(SpaceError::StartNotFixed { row: "l1", value: 1.0, fixed: 2.0 })
    ));
    // A derivative gain of zero holds no scale.
    let freed = "\n[gains.l1]\nlower = 0.1\nupper = 10.0\nscale = \"log\"\n";
    let text = MRAC.replacen("l1 = 1.0\n", "", 1) + freed;
    let error = on_arm(&text, &start).unwrap_err();
    assert!(
        matches!(error, SpaceError::At { problem, .. } if *problem == SpaceError::Redundant { controller: "mrac" })
    );
}

/// Whether every number of both tables is the same up to the rounding of its digits.
fn are_near(a: &Gains, b: &Gains) -> bool {
    a.rows().iter().zip(b.rows()).all(|((_, a), (_, b))| {
        a.values().len() == b.values().len()
            && a.values().iter().zip(b.values()).all(|(a, b)| (a - b).abs() <= 1e-4 * b.abs())
    })
}

proptest! {
    #[test]
    fn decoding_stays_in_the_box_and_is_undone_by_encoding(point in proptest::collection::vec(-3.0..4.0_f64, 5)) {
        let space = shipped();
        let gains = space.decode(&point);
        prop_assert_eq!(&space.admit(&gains).unwrap(), &gains);
        prop_assert_eq!(space.decode(&space.encode(&gains)), gains);
    }

    #[test]
    fn tied_gains_decode_to_short_decimals_and_encode_to_their_point(point in proptest::collection::vec(0.0..1.0_f64, 8), mrac: bool) {
        let space = if mrac { on_arm(MRAC, &preset(MRAC_PRESET)) } else { on_arm(PER_JOINT, &per_joint_start()) }.unwrap();
        let gains = space.decode(&point);
        prop_assert_eq!(&space.admit(&gains).unwrap(), &gains);
        prop_assert!(are_near(&space.decode(&space.encode(&gains)), &gains));
        for (a, b) in space.encode(&gains).iter().zip(&point) {
            prop_assert!((a - b).abs() < 1e-4, "{a} for {b}");
        }
        for value in gains.rows().iter().flat_map(|(_, numbers)| numbers.values()) {
            prop_assert_eq!(rounded(*value).to_bits(), value.to_bits());
        }
    }

    #[test]
    fn folding_is_continuous(x in -5.0..5.0_f64) {
        prop_assert!((folded(x) - folded(x + 1e-9)).abs() < 2e-9);
        prop_assert!((0.0..=1.0).contains(&folded(x)));
    }
}
