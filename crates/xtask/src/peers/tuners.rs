//! `cargo xtask peers tuners` and `peers panda`: our search beside the tuners that a user would pick instead, on one objective each.
//!
//! | command | the objective | its program |
//! |---|---|---|
//! | `peers tuners` | one joint on eight masses, compiled Python, a millisecond a candidate | `crates/xtask/peers/tuners.py` |
//! | `peers panda` | ours: the built-in task on the Panda, through `autotune evaluate` | `crates/xtask/peers/panda_tuners.py` |
//!
//! Ours takes part through `autotune ask-tell`, as any objective would be tuned with it. Every method gets the same budgets of evaluations, exactly.

use std::process::Command;

use super::{built, folder};
use crate::venv::python;
use crate::{Outcome, root, run};

const PACKAGES: [&str; 7] = [
    "cma==4.5.0",
    "cmaes==0.13.1",
    "nevergrad==1.0.12",
    "numba==0.68.1",
    // Nevergrad's surrogate turns arrays of one element into numbers, which later ones refuse.
    "numpy==2.3.5",
    "optuna==5.0.0",
    "scipy==1.17.1",
];

/// Runs a comparison, whose program prints its table.
///
/// # Errors
/// A step of the set-up, or the program, that failed.
pub fn compare(script: &str) -> Outcome {
    let folder = folder()?;
    let python = python(&folder, "tuners", &PACKAGES)?;
    let mut command = Command::new(python);
    command.arg(root().join("crates/xtask/peers").join(script));
    command.env("AUTOTUNE", built(&["build", "--release", "--package", "autotune"], "autotune")?);
    // What Python and its compiler keep belongs with the other things that are built.
    command.env("PYTHONPYCACHEPREFIX", folder.join("python")).env("NUMBA_CACHE_DIR", folder.join("numba"));
    // The programs start two processes; each has one thread, and so has what it starts.
    for threads in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"] {
        command.env(threads, "1");
    }
    run(script, command)
}
