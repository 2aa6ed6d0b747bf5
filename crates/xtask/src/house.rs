//! The house's rules that no compiler checks: who may import whom, and that every claim and every story is complete.

use std::fs;
use std::path::Path;

/// Crate, the crates of ours it may import, and outside crates it must never import.
const IMPORTS: [(&str, &[&str], &[&str]); 15] = [
    ("linsys", &[], &["clarabel", "argmin", "rand"]),
    ("simd", &["linsys"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("dynamics", &["linsys"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("control", &["linsys"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("closed-loop", &["linsys", "simd", "dynamics", "control"], &["clarabel", "argmin"]),
    ("verify", &[], &["clarabel", "argmin", "nalgebra", "rand", "faer"]),
    ("bounds", &["linsys", "dynamics", "verify"], &["clarabel", "argmin", "rand", "rand_chacha"]),
    ("certify", &["linsys", "verify", "lapack"], &["argmin", "rand"]),
    ("search", &[], &["argmin", "clarabel"]),
    (
        "tune",
        &["linsys", "simd", "search", "dynamics", "control", "closed-loop", "certify"],
        &["minijinja", "plotters", "clap"],
    ),
    (
        "paper",
        &["linsys", "dynamics", "control", "closed-loop", "tune"],
        &["minijinja", "plotters", "clap", "clarabel"],
    ),
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
    complete_claims(root)?;
    complete_stories(root)
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

/// Tests of `proofs/README.md`, and the program that holds them all: about no single claim.
const PAGE_TESTS: [&str; 3] = ["answer", "index", "main"];

/// Every claim has a statement, a test and a stored certificate; every certificate belongs to a claim, and the page names them all.
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
    let page = proofs.join("README.md");
    let page = fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    claims_match(&stems("claims", "md")?, stems("tests", "rs")?, &stems("certificates", "json")?, &page)
}

/// The rule itself: `<claim>--<variant>` is a further certificate of a claim.
fn claims_match(claims: &[String], mut tests: Vec<String>, certificates: &[String], page: &str) -> Result<(), String> {
    if claims.is_empty() {
        return Err("proofs/claims holds no claim".to_owned());
    }
    tests.retain(|name| !PAGE_TESTS.contains(&name.as_str()));
    if tests != claims {
        return Err(format!("proofs/tests holds {tests:?}, proofs/claims holds {claims:?}: one of each is owed"));
    }
    let own: Vec<&String> = certificates.iter().filter(|name| !name.contains("--")).collect();
    if own != claims.iter().collect::<Vec<_>>() {
        return Err(format!("proofs/certificates holds {own:?}, proofs/claims holds {claims:?}: one of each is owed"));
    }
    for name in certificates {
        let stem = name.split("--").next().unwrap_or_default();
        if !claims.iter().any(|claim| claim == stem) {
            return Err(format!("proofs/certificates/{name}.json belongs to no claim"));
        }
        if !page.contains(&format!("(certificates/{name}.json)")) {
            return Err(format!("proofs/README.md does not link certificates/{name}.json"));
        }
    }
    Ok(())
}

/// The longest story, lines.
const STORY_LINES: usize = 80;

/// Every story is short, numbered without a gap, in the table of `examples/src/lib.rs`, and built as an example unless it is no Rust.
fn complete_stories(root: &Path) -> Result<(), String> {
    let folder = root.join("examples");
    let read = |file: &Path| fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()));
    let (table, manifest) = (read(&folder.join("src/lib.rs"))?, read(&folder.join("Cargo.toml"))?);
    let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut names: Vec<String> = entries
        .filter_map(Result::ok)
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| name.starts_with(|first: char| first.is_ascii_digit()))
        .collect();
    names.sort();
    for (number, name) in (1..).zip(&names) {
        let lines = read(&folder.join(name))?.lines().count();
        story_is_kept(number, name, lines, &table, &manifest)?;
    }
    Ok(())
}

fn story_is_kept(number: usize, name: &str, lines: usize, table: &str, manifest: &str) -> Result<(), String> {
    if !name.starts_with(&format!("{number:02}_")) {
        return Err(format!("examples/{name}: story {number:02} is missing, or there are two"));
    }
    if lines >= STORY_LINES {
        return Err(format!("examples/{name} has {lines} lines, a story has less than {STORY_LINES}"));
    }
    let rust = name.strip_suffix(".rs");
    if !table.contains(&format!("| `{}` |", rust.unwrap_or(name))) {
        return Err(format!("examples/src/lib.rs does not list {name}"));
    }
    if rust.is_some() && !manifest.contains(&format!("path = \"{name}\"\ntest = true\nharness = false")) {
        return Err(format!("examples/Cargo.toml does not run {name} as a test"));
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

    #[test]
    fn a_claim_without_its_files_is_noticed() {
        let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let page = "(certificates/a.json) (certificates/a--more.json) (certificates/b.json)";
        let check = |claims: &[&str], tests: &[&str], certificates: &[&str]| {
            claims_match(&list(claims), list(tests), &list(certificates), page)
        };
        assert!(check(&["a", "b"], &["a", "answer", "b"], &["a", "a--more", "b"]).is_ok());
        assert!(check(&["a", "b"], &["a", "b", "other"], &["a", "b"]).is_err());
        assert!(check(&["a", "b"], &["a"], &["a", "b"]).is_err());
        assert!(check(&["a", "b"], &["a", "b"], &["a", "a--more"]).is_err());
        assert!(check(&["a", "b"], &["a", "b"], &["a", "b", "c--more"]).is_err());
        assert!(check(&["a", "b"], &["a", "b"], &["a", "a--unlisted", "b"]).is_err());
        assert!(check(&[], &[], &[]).is_err());
    }

    #[test]
    fn a_story_that_is_long_unlisted_or_never_run_is_noticed() {
        let table = "| `01_a` | .. |\n| `02_b.py` | .. |";
        let manifest = "path = \"01_a.rs\"\ntest = true\nharness = false\n";
        let check = |number, name, lines| story_is_kept(number, name, lines, table, manifest).is_ok();
        assert!(check(1, "01_a.rs", 79) && check(2, "02_b.py", 79));
        assert!(!check(1, "01_a.rs", 80) && !check(2, "01_a.rs", 9) && !check(1, "01_c.rs", 9));
        assert!(story_is_kept(1, "01_a.rs", 9, table, "path = \"01_a.rs\"").is_err());
    }
}
