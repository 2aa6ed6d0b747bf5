//! `cargo xtask browser`: every kind of page in headless Chromium.
//!
//! The example `pages` of `certune-report` writes the pages, `crates/xtask/browser/check.py` opens them. Playwright drives Debian's Chromium, axe-core
//! judges names, headings and contrast, PDFium reads the print; all three come from PyPI into `target/browser/venv`. Pictures and prints stay in `target/browser`.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::{Outcome, cargo, root, run, venv};

/// Apache-2.0, MIT, and Apache-2.0 or BSD; axe-core, inside the second, MPL-2.0 and not shipped by us.
const PACKAGES: [&str; 3] = ["playwright==1.65.2", "axe-playwright-python==0.1.8", "pypdfium2==5.15.2"];

/// Names of the program, the first that is found is taken.
const CHROMIUM: [&str; 4] = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome"];

/// Writes the pages and opens them.
///
/// # Errors
/// Chromium or a package that cannot be had, or a fault of a page.
pub fn browser() -> Outcome {
    let out = root().join("target/browser");
    fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    let chromium = chromium()?;
    let pages = out.join("pages");
    let mut write = cargo(&["run", "--release", "--package", "certune-report", "--example", "pages", "--"]);
    write.arg(&pages);
    run("pages to open", write)?;
    let python = venv::python(&out, "venv", &PACKAGES)?;
    let mut check = Command::new(python);
    check.arg("crates/xtask/browser/check.py").args([&chromium, &pages, &out]);
    run("pages in the browser", check)
}

/// Chromium's path; installed with Debian's packages when it is not there and we may.
fn chromium() -> Result<PathBuf, String> {
    if let Some(found) = found() {
        return Ok(found);
    }
    // Refused at once for whoever is not root; the message below says what to do.
    for words in [&["update"][..], &["install", "--yes", "--no-install-recommends", "chromium"]] {
        let mut apt = Command::new("apt-get");
        apt.args(words).env("DEBIAN_FRONTEND", "noninteractive");
        run(&format!("apt-get {}", words.join(" ")), apt).map_err(|reason| {
            format!("no {} on the path, and {reason}: install Chromium, then try again", CHROMIUM.join(", "))
        })?;
    }
    found().ok_or_else(|| "apt-get installed chromium, but it is not on the path".to_owned())
}

fn found() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = env::split_paths(&env::var_os("PATH")?).collect();
    CHROMIUM.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|file| file.is_file())
}
