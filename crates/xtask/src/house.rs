//! The house's rules that no compiler checks: who may import whom, and that every claim is complete.

use std::fs;
use std::path::Path;

/// Crate, the crates of ours it may import, and outside crates it must never import.
const IMPORTS: [(&str, &[&str], &[&str]); 12] = [
    ("linsys", &[], &["clarabel", "argmin", "rand"]),
    ("dynamics", &["linsys"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("control", &["linsys"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("closed-loop", &["linsys", "dynamics", "control"], &["clarabel", "argmin"]),
    ("verify", &[], &["clarabel", "argmin", "nalgebra", "rand", "faer"]),
    ("bounds", &["linsys", "dynamics", "verify"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("certify", &["linsys", "verify", "lapack"], &["argmin", "rand"]),
    ("tune", &["linsys", "dynamics", "control", "closed-loop", "certify"], &["minijinja", "plotters", "clap"]),
    ("report", &[], &["nalgebra", "clarabel", "argmin"]),
    ("lapack", &[], &["clarabel", "nalgebra"]),
    ("testkit", &["linsys", "dynamics", "control"], &["clarabel", "argmin"]),
    (
        "certune",
        &["linsys", "dynamics", "control", "closed-loop", "bounds", "certify", "verify", "tune", "report"],
        &["clap", "clarabel"],
    ),
];

/// Checks every rule.
///
/// # Errors
/// The first rule that is broken, in words.
pub fn check(root: &Path) -> Result<(), String> {
    for (room, ours, never) in IMPORTS {
        let file = root.join("crates").join(room).join("Cargo.toml");
        let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        for name in normal_dependencies(&text) {
            if never.contains(&name) {
                return Err(format!("crates/{room} must never import {name}"));
            }
            let friend = name.strip_prefix("certune-");
            if let Some(friend) = friend.filter(|friend| !ours.contains(friend)) {
                return Err(format!("crates/{room} may not import certune-{friend}"));
            }
        }
    }
    complete_claims(root)
}

/// Names under `[dependencies]`, and no other table.
fn normal_dependencies(manifest: &str) -> impl Iterator<Item = &str> {
    manifest
        .lines()
        .skip_while(|line| line.trim() != "[dependencies]")
        .skip(1)
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| line.split(['=', '.', ' ']).next())
        .filter(|name| !name.is_empty() && !name.starts_with('#'))
}

/// Every claim has a statement, a test and a stored certificate.
fn complete_claims(root: &Path) -> Result<(), String> {
    let proofs = root.join("proofs");
    let stems = |folder: &str, extension: &str| -> Result<Vec<String>, String> {
        let path = proofs.join(folder);
        let entries = fs::read_dir(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut names: Vec<String> = entries
            .filter_map(Result::ok)
            .map(|entry| entry.path())
            .filter(|file| file.extension().is_some_and(|e| e == extension))
            .filter_map(|file| Some(file.file_stem()?.to_str()?.to_owned()))
            .collect();
        names.sort();
        Ok(names)
    };
    let claims = stems("claims", "md")?;
    if claims.is_empty() {
        return Err("proofs/claims holds no claim".to_owned());
    }
    for (folder, extension) in [("tests", "rs"), ("certificates", "json")] {
        let found = stems(folder, extension)?;
        if found != claims {
            return Err(format!(
                "proofs/{folder} holds {found:?}, proofs/claims holds {claims:?}: one of each is owed"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_normal_dependencies_count() {
        let manifest = "[package]\nname = \"x\"\n[dependencies]\n# why\nserde.workspace = true\nrand = \"0.9\"\n\n[dev-dependencies]\nproptest = \"1\"\n";
        assert_eq!(normal_dependencies(manifest).collect::<Vec<_>>(), ["serde", "rand"]);
    }
}
