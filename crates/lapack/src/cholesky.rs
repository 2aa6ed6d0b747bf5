//! Cholesky factor of a symmetric positive definite matrix, `A = L Lᵀ`, and the solve with it.
//!
//! An upper factor is the transpose of the lower one: `A = Uᵀ U` with `U = Lᵀ`, so callers transpose and this module knows
//! one triangle only. Source: Golub and Van Loan, *Matrix Computations* (2013), sec. 4.2.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::default;
use faer::{Mat, Par};

use crate::scalar::Scalar;

/// Overwrites the lower triangle of `a` by `L`; the upper one is not read.
///
/// # Errors
/// The order (from 1) of the first leading minor that is not positive definite, or not finite.
pub(crate) fn factor<T: Scalar>(a: &mut Mat<T>) -> Result<(), usize> {
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<T>(a.nrows(), Par::Seq, default()));
    let stack = MemStack::new(&mut memory);
    match cholesky_in_place(a.as_mut(), LltRegularization::default(), Par::Seq, stack, default()) {
        Ok(_) => Ok(()),
        Err(LltError::NonPositivePivot { index }) => Err(index + 1),
    }
}

/// Overwrites `b` by the solution of `L Lᵀ x = b`.
pub(crate) fn solve<T: Scalar>(l: &Mat<T>, b: &mut Mat<T>) {
    solve_lower_triangular_in_place(l.as_ref(), b.as_mut(), Par::Seq);
    solve_upper_triangular_in_place(l.transpose(), b.as_mut(), Par::Seq);
}
