//! Closed loops `x' = A x` and `x+ = A x`, told apart by their type, and where their eigenvalues lie.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | A      | `A`  | n x n | 1/s (continuous), 1 (discrete) |
//! | h      | `step_s` | scalar | s |
//!
//! Everything here is floating point: it filters and illustrates, it never proves.

use nalgebra::{Complex, DMatrix};

/// How time passes in a loop: [`Continuous`] or [`Discrete`].
pub trait TimeDomain: Clone + core::fmt::Debug {}

/// `x' = A x`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Continuous;

/// `x+ = A x`, one step each `step_s` seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete {
    step_s: f64,
}

impl TimeDomain for Continuous {}
impl TimeDomain for Discrete {}

/// Why a matrix is no loop.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LoopError {
    /// The system matrix is not square.
    #[error("a loop needs a square matrix, got {rows} x {columns}")]
    NotSquare {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// The system matrix is empty: an empty loop would be vacuously stable.
    #[error("a loop needs at least one state")]
    Empty,
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) of the loop is {value}, expected a finite number")]
    NotFinite {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The step is not a positive number of seconds.
    #[error("the step of a discrete loop is {step_s} s, expected a positive finite number")]
    Step {
        /// The step given, s.
        step_s: f64,
    },
}

/// An autonomous linear loop of run-time order.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop<D: TimeDomain> {
    a: DMatrix<f64>,
    domain: D,
}

fn checked(a: DMatrix<f64>) -> Result<DMatrix<f64>, LoopError> {
    if !a.is_square() {
        return Err(LoopError::NotSquare { rows: a.nrows(), columns: a.ncols() });
    }
    if a.is_empty() {
        return Err(LoopError::Empty);
    }
    for column in 0..a.ncols() {
        for row in 0..a.nrows() {
            let value = a[(row, column)];
            if !value.is_finite() {
                return Err(LoopError::NotFinite { row, column, value });
            }
        }
    }
    Ok(a)
}

impl<D: TimeDomain> Loop<D> {
    /// The system matrix.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.a
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// All eigenvalues, with multiplicity, in no particular order; NaN throughout when the QR iteration does not converge,
    /// which a comparison then counts as unstable.
    pub fn eigenvalues(&self) -> Vec<Complex<f64>> {
        let order = self.order();
        // faer bounds its number of iterations; nalgebra's Schur form does not, and loops for ever on some loops.
        let a = faer::Mat::from_fn(order, order, |row, column| self.a[(row, column)]);
        match a.eigenvalues_from_real() {
            Ok(values) => values.into_iter().map(|s| Complex::new(s.re, s.im)).collect(),
            Err(_) => vec![Complex::new(f64::NAN, f64::NAN); order],
        }
    }
}

impl Loop<Continuous> {
    /// The loop `x' = A x`.
    ///
    /// # Errors
    /// [`LoopError`] when `a` is not square, empty, or has an entry that is not finite.
    pub fn continuous(a: DMatrix<f64>) -> Result<Self, LoopError> {
        Ok(Self { a: checked(a)?, domain: Continuous })
    }

    /// The eigenvalue with the largest real part, in 1/s.
    pub fn rightmost_eigenvalue(&self) -> Complex<f64> {
        self.eigenvalues().into_iter().max_by(|x, y| x.re.total_cmp(&y.re)).unwrap_or(Complex::new(f64::NAN, f64::NAN))
    }

    /// The largest real part of an eigenvalue, in 1/s: negative exactly when the loop is exponentially stable.
    pub fn spectral_abscissa_per_s(&self) -> f64 {
        self.rightmost_eigenvalue().re
    }
}

impl Loop<Discrete> {
    /// The loop `x+ = A x` with one step each `step_s` seconds.
    ///
    /// # Errors
    /// [`LoopError`] when `a` is not square, empty, or not finite, or `step_s` is not positive.
    pub fn discrete(a: DMatrix<f64>, step_s: f64) -> Result<Self, LoopError> {
        if !(step_s > 0.0 && step_s.is_finite()) {
            return Err(LoopError::Step { step_s });
        }
        Ok(Self { a: checked(a)?, domain: Discrete { step_s } })
    }

    /// The step, s.
    pub fn step_s(&self) -> f64 {
        self.domain.step_s
    }

    /// The largest modulus of an eigenvalue: below 1 exactly when the loop is exponentially stable.
    pub fn spectral_radius(&self) -> f64 {
        self.eigenvalues()
            .into_iter()
            .map(|s| s.norm())
            .fold(0.0, |most, x| if x > most || x.is_nan() { x } else { most })
    }

    /// The decay rate `-ln(radius) / step`, in 1/s.
    pub fn decay_per_s(&self) -> f64 {
        -self.spectral_radius().ln() / self.domain.step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn a_damped_oscillator_decays_at_half_its_damping() {
        let a = dmatrix![0.0, 1.0; -4.0, -1.0];
        let oscillator = Loop::continuous(a).unwrap();
        assert!((oscillator.spectral_abscissa_per_s() + 0.5).abs() < 1e-12);
    }

    #[test]
    fn sampling_a_decay_keeps_its_rate() {
        let step_s: f64 = 0.01;
        let sampled = Loop::discrete(dmatrix![(-3.0 * step_s).exp()], step_s).unwrap();
        assert!((sampled.decay_per_s() - 3.0).abs() < 1e-10);
    }

    #[test]
    fn what_is_no_loop_is_refused_with_its_reason() {
        assert_eq!(Loop::continuous(DMatrix::zeros(2, 3)), Err(LoopError::NotSquare { rows: 2, columns: 3 }));
        assert_eq!(Loop::continuous(DMatrix::zeros(0, 0)), Err(LoopError::Empty));
        assert!(matches!(
            Loop::continuous(dmatrix![1.0, f64::NAN; 0.0, 1.0]),
            Err(LoopError::NotFinite { row: 0, column: 1, .. })
        ));
        assert!(matches!(Loop::discrete(dmatrix![0.5], 0.0), Err(LoopError::Step { .. })));
    }
}
