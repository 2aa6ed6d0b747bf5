//! Python environments with packages from PyPI, each of a stated version.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run;

/// The interpreter of the environment `folder/name`, which is set up unless it holds `packages` already.
///
/// # Errors
/// A step of the set-up that failed.
pub fn python(folder: &Path, name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    let venv = folder.join(name);
    let (python, ready, list) = (venv.join("bin/python"), venv.join("ready"), packages.join("\n"));
    // The mark names what is there: another list is fetched anew.
    if fs::read_to_string(&ready).ok().as_deref() != Some(&list) {
        let mut make = Command::new("python3");
        make.args(["-m", "venv"]).arg(&venv);
        run(&format!("a Python environment in {}", venv.display()), make)?;
        let mut install = Command::new(&python);
        install.args(["-m", "pip", "install", "--quiet", "--only-binary=:all:"]).args(packages);
        run("its packages from PyPI", install)?;
        fs::write(&ready, list).map_err(|e| format!("{}: {e}", ready.display()))?;
    }
    Ok(python)
}
