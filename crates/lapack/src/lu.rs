//! LU factors with partial pivoting, `P A = L U`, and the solve with them.
//!
//! Source: Golub and Van Loan, *Matrix Computations* (2013), sec. 3.4.

use core::ffi::c_int;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::triangular_solve::{solve_unit_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::default;
use faer::{Mat, Par};

use crate::scalar::Scalar;

/// `L` (unit, below the diagonal) and `U` in one matrix, with the rows of `A` in the order of `rows`.
pub(crate) struct Lu<T> {
    pub(crate) factors: Mat<T>,
    rows: Vec<usize>,
}

/// # Errors
/// The first column (from 1) whose pivot is zero, or in which the factors are not finite: NaN or infinity in `a`, or
/// overflow.
pub(crate) fn factor<T: Scalar>(a: Mat<T>) -> Result<Lu<T>, usize> {
    let n = a.nrows();
    let mut factors = a;
    let (mut rows, mut inverse) = (vec![0_usize; n], vec![0_usize; n]);
    let mut memory = MemBuffer::new(lu_in_place_scratch::<usize, T>(n, n, Par::Seq, default()));
    lu_in_place(factors.as_mut(), &mut rows, &mut inverse, Par::Seq, MemStack::new(&mut memory), default());
    let broken = |j: &usize| {
        let column = factors.col_as_slice(*j);
        column[*j] == T::ZERO || !column.iter().all(|x| x.is_finite())
    };
    match (0..n).find(broken) {
        Some(j) => Err(j + 1),
        None => Ok(Lu { factors, rows }),
    }
}

impl<T: Scalar> Lu<T> {
    /// The solution of `A x = b`.
    pub(crate) fn solve(&self, b: &Mat<T>) -> Mat<T> {
        let mut x = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(self.rows[i], j)]);
        solve_unit_lower_triangular_in_place(self.factors.as_ref(), x.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.factors.as_ref(), x.as_mut(), Par::Seq);
        x
    }

    /// The order of rows as LAPACK's exchanges: step `i` swapped row `i` with row `ipiv[i]`, both counted from 1.
    pub(crate) fn exchanges(&self) -> Vec<c_int> {
        let n = self.rows.len();
        let mut row_at: Vec<usize> = (0..n).collect();
        let mut place_of: Vec<usize> = (0..n).collect();
        self.rows
            .iter()
            .enumerate()
            .map(|(i, &wanted)| {
                let j = place_of[wanted];
                let displaced = row_at[i];
                row_at.swap(i, j);
                place_of[displaced] = j;
                place_of[wanted] = i;
                // The order came in as a `c_int`.
                (j + 1) as c_int
            })
            .collect()
    }
}
