//! What may be chosen about a run.

use serde::{Deserialize, Serialize};

/// What may be chosen about a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// λ, the points in a generation; `None` for 4 + ⌊3 ln n⌋.
    pub lambda: Option<usize>,
    /// Ends the run when the scores of late differ by no more. The one option
    /// that depends on the scale of the scores; 0 makes the run depend on
    /// their order alone.
    pub tol_fun: f64,
    /// Ends the run when all standard deviations are less than this share of
    /// the initial one.
    pub tol_x: f64,
    /// Ends the run after so many generations; `None` for
    /// 100 + 50 (n + 3)² / √λ (Hansen 2009, the BIPOP paper).
    pub max_iterations: Option<u64>,
}

impl Default for Options {
    fn default() -> Options {
        Options { lambda: None, tol_fun: 1e-12, tol_x: 1e-12, max_iterations: None }
    }
}
