//! `README.md`'s list of certificates is the one read from them.

use std::path::{Path, PathBuf};

use proofs::index::{INDEX, table};
use proofs::kept;

const BEFORE: &str = "<!-- certificates, written by `cargo xtask claims` -->\n";
const AFTER: &str = "<!-- end of certificates -->\n";

fn at(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

#[test]
fn the_page_says_what_the_certificates_say() {
    let page = std::fs::read_to_string(at("README.md")).unwrap();
    let (head, rest) = page.split_once(BEFORE).unwrap();
    let (listed, tail) = rest.split_once(AFTER).unwrap();
    let table = table().unwrap();
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        std::fs::write(at("README.md"), format!("{head}{BEFORE}{table}{AFTER}{tail}")).unwrap();
    } else {
        assert_eq!(listed, table, "write it again with `cargo xtask claims`");
    }
}

#[test]
fn every_certificate_is_listed_once() {
    let mut files: Vec<String> = std::fs::read_dir(at("certificates"))
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let mut listed = INDEX.map(|(name, _)| name.to_owned()).to_vec();
    files.sort();
    listed.sort();
    assert_eq!(files, listed);
    assert!(INDEX.len() >= 10);
}

/// `[0.74 /s](certificates/exponential.json)`: the number is a figure of that certificate, cut off after a few digits.
#[test]
fn the_numbers_of_the_text_are_those_of_the_certificates() {
    let page = std::fs::read_to_string(at("README.md")).unwrap();
    let mut found = 0;
    for (before, link) in page.match_indices("](certificates/").map(|(place, _)| page.split_at(place)) {
        let words = before.rsplit('[').next().unwrap();
        let Some(stated) = words.split(' ').next().and_then(|word| word.parse::<f64>().ok()) else { continue };
        let name = link["](certificates/".len()..].split(".json").next().unwrap();
        let certificate = kept(name).unwrap();
        let figures = certificate.document().claims.iter().flat_map(|entry| entry.claim.figures());
        let close = |value: f64| stated <= value && value - stated <= 0.01 * value;
        assert!(figures.into_iter().any(|figure| close(figure.value.to_f64())), "[{words}] is no figure of {name}");
        found += 1;
    }
    assert!(found >= 8, "{found}");
}
