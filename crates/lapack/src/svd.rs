//! Singular value decomposition, `A = U diag(s) Vᵀ`.
//!
//! The matrix is scaled by a power of two, reduced to bidiagonal form and diagonalised by implicit QR steps, at every
//! order, for the same reason as in [`crate::eigen`]. Source: Golub and Van Loan, *Matrix Computations* (2013), sec. 8.6.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, SvdParams, svd as faer_svd, svd_scratch};
use faer::{Auto, Col, Mat, Par, Spec};

use crate::eigen::{NoConvergence, balance, is_finite};
use crate::scalar::Scalar;

/// How many singular vectors of one side are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Vectors {
    None,
    /// As many as there are singular values.
    Thin,
    /// A whole orthogonal matrix.
    Full,
}

impl Vectors {
    pub(crate) fn count(self, side: usize, values: usize) -> usize {
        match self {
            Vectors::None => 0,
            Vectors::Thin => values,
            Vectors::Full => side,
        }
    }

    fn job(self) -> ComputeSvdVectors {
        match self {
            Vectors::None => ComputeSvdVectors::No,
            Vectors::Thin => ComputeSvdVectors::Thin,
            Vectors::Full => ComputeSvdVectors::Full,
        }
    }
}

pub(crate) struct Svd<T> {
    /// Descending, not negative.
    pub(crate) values: Vec<T>,
    pub(crate) u: Option<Mat<T>>,
    /// V, not its transpose.
    pub(crate) v: Option<Mat<T>>,
}

/// # Errors
/// [`NoConvergence`], see there.
pub(crate) fn svd<T: Scalar>(mut a: Mat<T>, left: Vectors, right: Vectors) -> Result<Svd<T>, NoConvergence> {
    let (m, n) = a.shape();
    let count = m.min(n);
    let undo = balance(&mut a)?;
    let mut params = <SvdParams as Auto<T>>::auto();
    params.recursion_threshold = usize::MAX;
    let params = Spec::<SvdParams, T>::new(params);
    let mut memory = MemBuffer::new(svd_scratch::<T>(m, n, left.job(), right.job(), Par::Seq, params));
    let stack = MemStack::new(&mut memory);
    let side = |size: usize, wanted: Vectors| {
        (wanted != Vectors::None).then(|| Mat::<T>::zeros(size, wanted.count(size, count)))
    };
    let (mut u, mut v) = (side(m, left), side(n, right));
    let mut values = Col::<T>::zeros(count);
    let (u_out, v_out) = (u.as_mut().map(Mat::as_mut), v.as_mut().map(Mat::as_mut));
    let diagonal = values.as_mut().as_diagonal_mut();
    faer_svd(a.as_ref(), diagonal, u_out, v_out, Par::Seq, stack, params).map_err(|_| NoConvergence)?;
    let values: Vec<T> = (0..count).map(|i| values[i] * undo).collect();
    let finite = values.iter().all(|x| x.is_finite())
        && [&u, &v].into_iter().flatten().all(|vectors| is_finite(vectors.as_ref()));
    if finite { Ok(Svd { values, u, v }) } else { Err(NoConvergence) }
}
