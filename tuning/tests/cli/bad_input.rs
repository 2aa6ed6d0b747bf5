//! Bad input: each exits with 1 or 2 and one clear message, and leaves nothing behind.

use std::path::Path;

use certune::verify::{Document, Evidence, seal};

use crate::common::{SHORT, autotune, stdout, urdf};

const PRESET: &str = include_str!("../../presets/pezzato2020-simulation.toml");
const SPACE: &str = include_str!("../../spaces/panda-aic.toml");

/// One moving link whose largest principal moment exceeds the sum of the others.
const NO_BODY: &str = r#"<robot name="stick"><link name="base"/>
<link name="upper_arm"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper_arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="10" velocity="1"/></joint></robot>"#;

/// A good link on a joint without an effort.
const NO_LIMIT: &str = r#"<robot name="stick"><link name="base"/>
<link name="upper_arm"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper_arm"/><axis xyz="0 0 1"/></joint></robot>"#;

/// Files that are wrong in one way each.
fn prepare(folder: &Path) {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("broken.toml", "schema = 1\ncontroller = \"aic\"\n[aic\n");
    write("unknown-key.toml", &PRESET.replace("kappa_mu", "kapa_mu"));
    write("missing-key.toml", &PRESET.replace("sigma_mu = 5.0\n", ""));
    write("length.toml", &PRESET.replace("sigma_q = 1.0", "sigma_q = [1, 2, 3]"));
    write("nan.toml", &PRESET.replace("kappa_a = 700.0", "kappa_a = nan"));
    write("negative.toml", &PRESET.replace("sigma_mu = 5.0", "sigma_mu = -5.0"));
    write("zero.toml", &PRESET.replace("kappa_mu = 11.67", "kappa_mu = 0"));
    write("word.toml", &PRESET.replace("kappa_mu = 11.67", "kappa_mu = \"fast\""));
    write("schema.toml", &PRESET.replace("schema = 1", "schema = 7"));
    write("controller.toml", &PRESET.replace("controller = \"aic\"", "controller = \"pid\""));
    write("empty.toml", "");
    std::fs::write(folder.join("bytes.toml"), [0xff, 0xfe, 0x00]).unwrap();
    write("hello.json", "hello");
    write("list.json", "[]");
    write("body.urdf", NO_BODY);
    write("text.urdf", "not xml at all");
    write("a-file", "");
    write("short.toml", SHORT);
    write("delay.toml", &SHORT.replace("gravity_comp", "delay_samples = [0, 2]\ngravity_comp"));
    write("backwards.toml", &SHORT.replace("payload_kg = [0, 0.7]", "payload_kg = [0.7, 0]"));
    write("space-twice.toml", &SPACE.replace("[fixed]", "[fixed]\nkappa_mu = 3.0"));
    write("space-start.toml", &SPACE.replace("lower = 50.0", "lower = 5000.0"));
    write("space-cold.toml", &SPACE.replace("start = \"pezzato2020-simulation\"", "start = \"cold\""));
    write("space-objective.toml", &SPACE.replace("objective = \"settling-time\"", "objective = \"fastest\""));
    write("nolimit.urdf", NO_LIMIT);
    write("space-preset.toml", &SPACE.replace("pezzato2020-simulation", "pezato2020-simulation"));
    std::fs::create_dir(folder.join("folder")).unwrap();
    std::fs::create_dir(folder.join("no-run")).unwrap();
    std::fs::write(folder.join("no-run/run.json"), "{\"schema\": 1}").unwrap();

    stdout(folder, "certify --robot panda --gains pezzato2020-simulation --claim exponential --out whole.json", 0);
    let whole = std::fs::read_to_string(folder.join("whole.json")).unwrap();
    write("truncated.json", &whole[..whole.len() / 2]);
    let edited = whole.replacen("\"11.67\"", "\"11.68\"", 1);
    assert_ne!(edited, whole);
    write("edited.json", &edited);
    write("unknown-record.json", &on_unknown_record(&whole));
}

/// The certificate resealed on constants that a record nobody has is said to prove.
fn on_unknown_record(whole: &str) -> String {
    let mut document: Document = serde_json::from_str(whole).unwrap();
    document.constants.evidence = Evidence::Proved { record_sha256: "0".repeat(64) };
    serde_json::to_string_pretty(&seal(document)).unwrap()
}

/// What stands in a folder, with sizes.
fn listing(folder: &Path) -> Vec<String> {
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        entries.push(format!("{} {}", entry.path().display(), entry.metadata().unwrap().len()));
        if entry.path().is_dir() {
            entries.extend(listing(&entry.path()));
        }
    }
    entries.sort();
    entries
}

/// Command line, exit code, and words that the message must hold.
const CASES: &[(&str, i32, &[&str])] = &[
    // The command line itself.
    ("--robot panda --budgt 3", 1, &["--budgt", "--budget"]),
    ("--robot panda stray", 1, &["stray"]),
    ("stray", 1, &["stray"]),
    ("tune", 1, &["--robot"]),
    ("--robot panda verify whole.json", 1, &["behind the command"]),
    ("--robot panda --budget 0", 1, &["budget", "--budget 1"]),
    ("--robot panda --budget many", 1, &["many", "--budget"]),
    ("--robot panda --seed -1", 1, &["-1"]),
    ("--robot panda --threads 0", 1, &["at least 1 thread"]),
    ("--robot panda --plants 0", 1, &["at least 1 plant"]),
    ("--robot panda --plants few", 1, &["few", "--plants"]),
    ("--robot panda --controller pid", 1, &["pid", "aic"]),
    ("--robot panda --controller mrac --space panda-aic", 1, &["--controller mrac", "holds gains for `aic`"]),
    (
        "--robot panda --controller mrac --objective certified-rate",
        1,
        &["certified-rate is no goal", "another --objective"],
    ),
    ("ask-tell --space panda-mrac", 1, &["panda-mrac", "gains.alpha1_arm", "name the robot"]),
    ("verify", 1, &["CERTIFICATE.json"]),
    ("certify --robot panda", 1, &["--gains"]),
    (
        "certify --robot panda --gains pezzato2020-simulation --claim stability",
        1,
        &["stability", "exponential", "region", "adaptive-convergence"],
    ),
    (
        "certify --robot panda --gains pezzato2020-simulation --claim region,exponental",
        1,
        &["exponental", "did you mean `exponential`?"],
    ),
    ("certify --robot panda --gains pezzato2020-simulation --delay 17", 1, &["17", "from 0 to 16"]),
    ("certify --robot panda --gains pezzato2020-simulation --delay 1.5", 1, &["1.5", "whole number of samples"]),
    ("certify --robot panda --gains pezzato2020-simulation --torque-limits lots", 1, &["lots", "N m"]),
    ("certify --robot panda --gains pezzato2020-simulation --torque-limits 0", 1, &["above zero"]),
    ("certify --robot panda --gains pezzato2020-simulation --over box", 1, &["box", "torus", "scenario"]),
    ("certify --robot panda --gains pezzato2020-mrac-simulation --at 0,0", 1, &["--at has 2 numbers", "7 joints"]),
    ("certify --robot panda --gains pezzato2020-simulation --constants missing.json", 1, &["cannot read missing.json"]),
    (
        "certify --robot panda --gains pezzato2020-simulation --constants hello.json",
        1,
        &["hello.json", "not a record of proved constants", "autotune constants"],
    ),
    (
        "certify --robot nolimit.urdf --gains pezzato2020-simulation --claim region --torque-limits",
        1,
        &["no torque limit", "shoulder", "--torque-limits with a number"],
    ),
    ("compare", 1, &["--robot"]),
    ("compare --robot nolimit.urdf", 1, &["has 1 joints", "7 of the Panda", "--robot panda"]),
    (
        "compare --robot panda --gains-aic pezzato2020-mrac-robot",
        1,
        &["aic-tuned", "for the controller `mrac`", "`autotune presets`"],
    ),
    ("compare --robot panda --gains-mrac pezato2020-mrac-robot", 1, &["pezzato2020-mrac-robot"]),
    ("evaluate", 1, &["--robot"]),
    ("evaluate --robot pnda", 1, &["unknown robot `pnda`", "try: `panda`"]),
    ("evaluate --robot panda --plants 0", 1, &["at least 1 plant"]),
    ("evaluate --robot panda --scenario backwards.toml", 1, &["backwards.toml:"]),
    ("resume", 1, &["RUN_DIR"]),
    ("resume no-run", 1, &["no-run holds no unfinished run", "autotune runs"]),
    ("resume a-file", 1, &["a-file holds no unfinished run"]),
    ("runs a-file", 1, &["cannot list a-file", "the folders of runs"]),
    ("diff no-run", 1, &["RUN_DIR"]),
    ("diff no-run folder", 1, &["no-run/run.json", "not the record of a run"]),
    ("constants --robot panda", 1, &["--out"]),
    ("constants --robot pnda --out x.json", 1, &["unknown robot `pnda`", "try: `panda`"]),
    ("constants --robot panda --out no/such/x.json", 1, &["cannot write no/such/x.json"]),
    ("constants --robot panda --payload -1 --out x.json", 1, &["zero or above"]),
    ("constants --robot panda --effort endless --out x.json", 1, &["endless", "quick", "thorough"]),
    ("verify whole.json --robot body.urdf", 1, &["--full"]),
    ("front --robot panda --goals jitter", 1, &["2 or 3 different goals, got 1", "try: --goals"]),
    ("front --robot panda --goals jitter,jitter", 1, &["2 or 3 different goals"]),
    ("front --robot panda --goals jitter,enrgy", 1, &["did you mean `energy`?"]),
    ("pick . --point 1", 1, &["front.json"]),
    ("--robot panda --objective certified-radus", 1, &["did you mean `certified-radius`?"]),
    ("--robot panda --space space-objective.toml", 1, &["space-objective.toml:", "fastest"]),
    ("certify --robot panda --gains pezzato2020-simulation --friction 3..1", 1, &["3 is above 1"]),
    ("certify --robot panda --gains pezzato2020-simulation --friction -1", 1, &["zero or above"]),
    ("certify --robot panda --gains pezzato2020-simulation --friction 1-3", 1, &["`1-3` is not a number"]),
    ("certify --robot panda --gains pezzato2020-simulation --payload nan", 1, &["not a finite number"]),
    ("certify --robot panda --gains pezzato2020-simulation --mass-uncertainty 1", 1, &["below 1"]),
    ("certify --robot panda --gains pezzato2020-simulation --gravity-compensation yes", 1, &["yes", "on", "off"]),
    ("certify --robot panda --gains pezzato2020-simulation --scenario hold --friction 1", 1, &["cannot be used with"]),
    // Robots.
    ("inspect --robot pnda --q 0", 1, &["unknown robot `pnda`", "try: `panda`"]),
    ("inspect --robot missing.urdf --q 0", 1, &["missing.urdf", "check the path"]),
    ("inspect --robot text.urdf --q 0", 1, &["text.urdf", "not a readable URDF"]),
    ("inspect --robot body.urdf --q 0", 1, &["body.urdf", "upper_arm", "principal moments", "<inertial>"]),
    ("inspect --robot folder --q 0", 1, &["folder"]),
    ("inspect --robot UR5 --tip nowhere --q 0", 1, &["nowhere"]),
    ("inspect --robot panda --q 0,0,0", 1, &["--q has 3 numbers", "7 joints"]),
    ("inspect --robot panda --q=0,0,0,0,0,0,0 --dq 1", 1, &["--dq has 1 numbers"]),
    ("inspect --robot panda --q 0,zero,0,0,0,0,0", 1, &["entry 2", "`zero`"]),
    // Gains.
    ("simulate --robot panda --gains pezzato2020-simulatoin", 1, &["unknown preset", "try: `pezzato2020-simulation`"]),
    ("simulate --robot panda --gains missing.toml", 1, &["missing.toml", "cannot be read"]),
    ("simulate --robot panda --gains folder", 1, &["folder"]),
    ("simulate --robot panda --gains broken.toml", 1, &["broken.toml:3", "not valid TOML"]),
    (
        "simulate --robot panda --gains unknown-key.toml",
        1,
        &["unknown-key.toml:8", "`aic.kapa_mu`", "did you mean `kappa_mu`"],
    ),
    ("simulate --robot panda --gains missing-key.toml", 1, &["`aic.sigma_mu`", "missing key"]),
    ("simulate --robot panda --gains length.toml", 1, &["length.toml:10", "3 entries", "7, one per joint"]),
    ("simulate --robot panda --gains nan.toml", 1, &["nan.toml:9", "finite"]),
    ("simulate --robot panda --gains negative.toml", 1, &["negative.toml:12", "`aic.sigma_mu`", "positive"]),
    ("certify --robot panda --gains zero.toml", 1, &["zero.toml:8", "`aic.kappa_mu`", "positive"]),
    ("simulate --robot panda --gains word.toml", 1, &["word.toml:8", "fast"]),
    ("simulate --robot panda --gains schema.toml", 1, &["schema version 7"]),
    ("simulate --robot panda --gains controller.toml", 1, &["`pid`", "`aic`"]),
    ("simulate --robot panda --gains empty.toml", 1, &["empty.toml", "schema"]),
    ("simulate --robot panda --gains bytes.toml", 1, &["bytes.toml"]),
    ("simulate --robot UR5 --gains pezzato2020-robot", 1, &["7 entries", "6, one per joint"]),
    // Scenarios and spaces.
    (
        "simulate --robot panda --gains pezzato2020-robot --scenario pick-and-plaice",
        1,
        &["unknown scenario", "try: `pick-and-place`"],
    ),
    (
        "simulate --robot UR5 --gains pezzato2020-simulation --scenario pick-and-place",
        1,
        &["does not fit", "7 entries"],
    ),
    (
        "simulate --robot panda --gains pezzato2020-robot --scenario backwards.toml",
        1,
        &["backwards.toml:", "payload_kg"],
    ),
    ("simulate --robot panda --gains pezzato2020-robot --delay 99", 1, &["99", "at most 16"]),
    ("--robot panda --scenario delay.toml", 1, &["delay of up to 2 samples"]),
    ("--robot panda --space space-twice.toml", 1, &["space-twice.toml:", "kappa_mu"]),
    ("--robot panda --space space-start.toml", 1, &["cannot start at kappa_a = 700"]),
    ("--robot panda --space space-preset.toml", 1, &["`pezato2020-simulation`", "try: `pezzato2020-simulation`"]),
    ("--robot panda --space space-cold.toml", 1, &["`space-cold` says start = \"cold\"", "try: a preset"]),
    // Places to write to.
    ("--robot panda --scenario short.toml --budget 1 --out a-file/sub", 1, &["cannot create a-file/sub"]),
    ("--robot panda --scenario short.toml --budget 1 --out a-file", 1, &["cannot create a-file"]),
    (
        "simulate --robot panda --gains pezzato2020-robot --scenario short.toml --csv a-file/x.csv",
        1,
        &["cannot write a-file/x.csv"],
    ),
    (
        "simulate --robot panda --gains pezzato2020-robot --scenario short.toml --csv folder",
        1,
        &["cannot write folder"],
    ),
    (
        "certify --robot panda --gains pezzato2020-simulation --claim exponential --out no/such/x.json",
        1,
        &["cannot write no/such/x.json"],
    ),
    // Certificates and runs.
    ("verify truncated.json", 1, &["truncated.json", "not a certificate"]),
    ("verify hello.json", 1, &["hello.json", "not a certificate"]),
    ("verify list.json", 1, &["list.json", "not a certificate"]),
    ("verify folder", 1, &["folder"]),
    ("verify missing.json", 1, &["cannot read missing.json"]),
    ("verify unknown-record.json", 2, &["unknown-record.json", "no record with hash", "--constants"]),
    ("verify whole.json --constants whole.json", 1, &["not a record of proved constants"]),
    ("verify edited.json", 2, &["edited.json", "edited after it was sealed"]),
    ("verify whole.json edited.json", 2, &["rejected: edited.json"]),
    ("verify edited.json truncated.json", 1, &["rejected: edited.json"]),
    ("report folder", 1, &["run.json", "try:"]),
    ("report no-run", 1, &["not the record of a run"]),
    ("report missing", 1, &["cannot read missing/run.json"]),
];

#[test]
fn each_ends_with_one_clear_message_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let before = listing(folder.path());
    let ur5 = urdf("ur5.urdf");
    assert!(CASES.len() >= 25);
    let mut wrong = Vec::new();
    for (line, code, words) in CASES {
        let arguments = line.split_whitespace().map(|word| if word == "UR5" { ur5.to_str().unwrap() } else { word });
        let output = autotune(folder.path()).args(arguments).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        let mut complain = |what: &str| wrong.push(format!("`{line}`: {what}\n{message}"));
        if output.status.code() != Some(*code) {
            complain(&format!("exit {:?}, expected {code}", output.status.code()));
        }
        if let Some(word) = words.iter().find(|word| !message.contains(**word)) {
            complain(&format!("the message does not say `{word}`"));
        }
        if message.contains("panicked") || message.trim().is_empty() || message.lines().count() > 8 {
            complain("the message is not one clear message");
        }
        if listing(folder.path()) != before {
            complain("something was left behind");
        }
    }
    if !wrong.is_empty() {
        panic!("{} of {} cases:\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
    }
}

#[test]
fn a_closed_stdout_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_autotune");
    let line = format!("{program} inspect --robot panda --q 0,0,0,0,0,0,0 | true");
    let output = std::process::Command::new("sh").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"));
}
