//! Eigenvalues and eigenvectors of a symmetric matrix, `A = V diag(w) Vᵀ`.
//!
//! The matrix is scaled by a power of two, reduced to tridiagonal form and diagonalised by implicit QR steps with
//! Wilkinson's shift, at every order: faer's divide and conquer (from order 128) is not used, so one algorithm serves
//! all sizes and its number of steps is bounded. Source: Golub and Van Loan, *Matrix Computations* (2013), sec. 8.3.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, SelfAdjointEvdParams, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{Auto, Col, Mat, MatRef, Par, Spec};

use crate::scalar::Scalar;

/// The input or the result is not finite, or the iteration did not end in its bound.
pub(crate) struct NoConvergence;

pub(crate) struct Eigen<T> {
    /// Ascending.
    pub(crate) values: Vec<T>,
    /// One column for each value, orthonormal.
    pub(crate) vectors: Option<Mat<T>>,
}

/// Scales `a` so that its largest entry is near one; returns the factor that undoes it.
///
/// # Errors
/// [`NoConvergence`] when an entry is not finite.
pub(crate) fn balance<T: Scalar>(a: &mut Mat<T>) -> Result<T, NoConvergence> {
    let mut largest = T::ZERO;
    for j in 0..a.ncols() {
        for &x in a.col_as_slice(j) {
            if !x.is_finite() {
                return Err(NoConvergence);
            }
            if x.abs() > largest {
                largest = x.abs();
            }
        }
    }
    let (down, up) = largest.power_of_two_scale();
    for j in 0..a.ncols() {
        for x in a.col_as_slice_mut(j) {
            *x = *x * down;
        }
    }
    Ok(up)
}

pub(crate) fn is_finite<T: Scalar>(a: MatRef<'_, T>) -> bool {
    (0..a.ncols()).all(|j| (0..a.nrows()).all(|i| a[(i, j)].is_finite()))
}

/// Reads the lower triangle of `a`; the upper one must be finite, for instance zero.
///
/// # Errors
/// [`NoConvergence`], see there.
pub(crate) fn eigen<T: Scalar>(mut a: Mat<T>, with_vectors: bool) -> Result<Eigen<T>, NoConvergence> {
    let n = a.nrows();
    let undo = balance(&mut a)?;
    let mut params = <SelfAdjointEvdParams as Auto<T>>::auto();
    params.recursion_threshold = usize::MAX;
    let params = Spec::<SelfAdjointEvdParams, T>::new(params);
    let job = if with_vectors { ComputeEigenvectors::Yes } else { ComputeEigenvectors::No };
    let mut memory = MemBuffer::new(self_adjoint_evd_scratch::<T>(n, job, Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    let mut values = Col::<T>::zeros(n);
    let mut vectors = with_vectors.then(|| Mat::<T>::zeros(n, n));
    let diagonal = values.as_mut().as_diagonal_mut();
    self_adjoint_evd(a.as_ref(), diagonal, vectors.as_mut().map(Mat::as_mut), Par::Seq, stack, params)
        .map_err(|_| NoConvergence)?;
    let values: Vec<T> = (0..n).map(|i| values[i] * undo).collect();
    let finite = values.iter().all(|x| x.is_finite()) && vectors.as_ref().is_none_or(|v| is_finite(v.as_ref()));
    if finite { Ok(Eigen { values, vectors }) } else { Err(NoConvergence) }
}
