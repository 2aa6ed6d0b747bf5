//! Matrix products, `C = alpha X Y + beta C` and its symmetric relatives.
//!
//! `C` is `None` where `beta = 0`: BLAS then promises that the old values, even NaN, have no influence. Source: Dongarra
//! et al., *A set of level 3 BLAS* (1990).

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::{Accum, Mat, MatRef, Par};

use crate::memory::Part;
use crate::scalar::Scalar;

/// `beta C`, in a matrix of the given shape.
pub(crate) fn scaled<T: Scalar>(beta: T, c: Option<Mat<T>>, rows: usize, cols: usize) -> Mat<T> {
    let Some(mut c) = c else { return Mat::zeros(rows, cols) };
    if beta != T::ONE {
        for j in 0..cols {
            for value in c.col_as_slice_mut(j) {
                *value = beta * *value;
            }
        }
    }
    c
}

/// `c + alpha x y`.
pub(crate) fn add_product<T: Scalar>(c: &mut Mat<T>, alpha: T, x: MatRef<'_, T>, y: MatRef<'_, T>) {
    matmul(c.as_mut(), Accum::Add, x, y, alpha, Par::Seq);
}

/// `c + alpha x y`, of which only the given triangle is computed.
pub(crate) fn add_triangle<T: Scalar>(c: &mut Mat<T>, part: Part, alpha: T, x: MatRef<'_, T>, y: MatRef<'_, T>) {
    let structure = match part {
        Part::All => BlockStructure::Rectangular,
        Part::Lower => BlockStructure::TriangularLower,
        Part::Upper => BlockStructure::TriangularUpper,
    };
    let whole = BlockStructure::Rectangular;
    triangular_matmul(c.as_mut(), structure, Accum::Add, x, whole, y, whole, alpha, Par::Seq);
}

/// The whole symmetric matrix from one of its triangles; the other one holds zeros.
pub(crate) fn mirrored<T: Scalar>(triangle: &Mat<T>, part: Part) -> Mat<T> {
    Mat::from_fn(triangle.nrows(), triangle.ncols(), |i, j| {
        let stored = match part {
            Part::All => true,
            Part::Lower => i >= j,
            Part::Upper => i <= j,
        };
        if stored { triangle[(i, j)] } else { triangle[(j, i)] }
    })
}
