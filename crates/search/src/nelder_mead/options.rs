//! The coefficients of the moves and the other choices.

use serde::{Deserialize, Serialize};

/// The coefficients of the moves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coefficients {
    /// α > 0, of the reflection.
    pub alpha: f64,
    /// β > 1, of the expansion.
    pub beta: f64,
    /// γ in (0, 1), of the contractions.
    pub gamma: f64,
    /// δ in (0, 1), of the shrink.
    pub delta: f64,
}

impl Coefficients {
    /// Those of Nelder & Mead: 1, 2, ½, ½.
    pub fn classic() -> Coefficients {
        Coefficients { alpha: 1.0, beta: 2.0, gamma: 0.5, delta: 0.5 }
    }

    /// Those of Gao & Han, milder in more dimensions, where the classic moves
    /// deform the simplex until it no longer descends. In two dimensions, and
    /// here in one, they are the classic ones.
    pub fn adaptive(n: usize) -> Coefficients {
        let n = n.max(2) as f64;
        Coefficients { alpha: 1.0, beta: 1.0 + 2.0 / n, gamma: 0.75 - 0.5 / n, delta: 1.0 - 1.0 / n }
    }
}

/// What may be chosen about a simplex search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NelderMeadOptions {
    /// The coefficients; `None` for the adaptive ones.
    pub coefficients: Option<Coefficients>,
    /// The simplex converges when its scores differ by no more than this …
    pub tol_fun: f64,
    /// … and its vertices are no farther than this from the best.
    pub tol_x: f64,
    /// The times a converged simplex is set up anew around its best vertex,
    /// as long as that gains more than `tol_fun`. A simplex may collapse short
    /// of the optimum, on a bound for one; a fresh one gets away from there.
    pub restarts: u32,
}

impl Default for NelderMeadOptions {
    fn default() -> NelderMeadOptions {
        NelderMeadOptions { coefficients: None, tol_fun: 1e-12, tol_x: 1e-9, restarts: 3 }
    }
}
