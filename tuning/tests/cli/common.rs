//! Running the program in a folder of its own.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

/// The program, in `folder`.
pub fn autotune(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_autotune"));
    command.current_dir(folder);
    command
}

/// Runs a command line (split at blanks) that must exit with `code`, and returns its stdout.
pub fn stdout(folder: &Path, arguments: &str, code: i32) -> String {
    let assert = autotune(folder).args(arguments.split_whitespace()).assert().code(code);
    String::from_utf8(assert.get_output().stdout.clone()).unwrap()
}

/// The same for a command line with `--json`.
pub fn json(folder: &Path, arguments: &str, code: i32) -> Value {
    serde_json::from_str(&stdout(folder, &format!("{arguments} --json"), code)).unwrap()
}

/// A robot description of the library's tests.
pub fn urdf(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/dynamics/tests/golden").join(name).canonicalize().unwrap()
}

/// Two short moves on plants like those of pick-and-place: cheap to tune for.
pub const SHORT: &str = r#"
schema = 1
name = "short"
description = "Two short moves."
step_s = 0.001
start_rad = [0, 0.2, 0, -1, 0, 1.2, 0]
[[segments]]
goal_rad = [0.3, 0.4, 0, -1.2, 0, 1.5, 0]
duration_s = 1
[[segments]]
goal_rad = [0, 0.2, 0, -1, 0, 1.2, 0]
duration_s = 1
[plant-box]
mass_uncertainty = 0.2
payload_kg = [0, 0.7]
friction_n_m_s_per_rad = [0.5, 2]
rotor_inertia_kg_m2 = [0, 0.1]
gravity_compensation = true
"#;

/// Two links in a plane.
pub const TWO_LINKS: &str = r#"<robot name="two-links"><link name="base"/>
<link name="upper"><inertial><mass value="2"/><origin xyz="0.15 0 0"/>
<inertia ixx="0.002" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><origin xyz="0.1 0 0"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin rpy="1.5707963 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="60" velocity="2"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="30" velocity="2"/></joint></robot>"#;

/// Two short moves of theirs.
pub const TWO_LINKS_MOVE: &str = r#"
schema = 1
name = "two"
description = "Two short moves."
step_s = 0.001
start_rad = [0.2, -1]
[[segments]]
goal_rad = [0.4, -1.2]
duration_s = 0.5
[[segments]]
goal_rad = [0.2, -1]
duration_s = 0.5
[plant-box]
mass_uncertainty = 0.2
payload_kg = [0, 0.7]
friction_n_m_s_per_rad = [0.5, 2]
rotor_inertia_kg_m2 = [0, 0.1]
gravity_compensation = true
"#;
