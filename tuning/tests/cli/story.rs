//! The story in Python: its own assertions decide.

use std::path::Path;
use std::process::Command;

#[test]
fn a_script_tunes_what_only_it_can_simulate() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/09_ask_tell.py");
    let output = Command::new("python3").arg(script).arg(env!("CARGO_BIN_EXE_autotune")).output();
    let output = output.expect("the story needs Python: python3 on the path");
    let (said, complaint) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}\n{complaint}");
    assert!(said.contains("80 candidates"), "{said}");
}
