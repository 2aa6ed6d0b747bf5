//! Positive definiteness of small matrices by Cholesky in `f64`, with proved shifts.
//!
//! **Lemma.** Let A be the symmetric matrix of `f64` entries on which [`Factor`] runs, n its order. If all pivots come out positive, then
//! `A >= -c I` with `c = 4 (n + 8) u tr A`. Proof: the computed R satisfies `R'R = A + D`,
//! `|D_ij| <= g sum_k |r_ki| |r_kj|`, `g = (n+4) u/(1 - (n+4) u)`: each entry is an inner product of at most n terms, one subtraction, and one
//! product with a rounded reciprocal of a rounded root (Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed., theorem
//! 10.3; the root and the reciprocal count once each). For i = j this gives `sum_k r_ki^2 <= a_ii/(1 - g)`, so
//! `|D_ij| <= g/(1 - g) sqrt(a_ii a_jj)` and `|D|_2 <= g/(1 - g) tr A <= 4 (n + 8) u tr A`. Rump, *Verification of positive
//! definiteness*, BIT 46 (2006). Underflow adds less than 2^-1000, which the shifts below exceed.
//!
//! So if the entries of an exact matrix X are within those of a matrix E of the computed ones, and the pivots of the computed
//! `X^ - s I` are positive with `s = |E|_F + c` and the rounding of the diagonal, then `X >= 0`.

use crate::rigorous::scalar::{UNIT, frobenius};

/// The `c` of the lemma for a matrix of order `n` with this trace, doubled to pay for the rounding of the shifted diagonal.
pub(crate) fn cholesky_allowance(n: usize, trace: f64) -> f64 {
    8.0 * (n as f64 + 8.0) * UNIT * trace + f64::MIN_POSITIVE.sqrt()
}

/// A Cholesky factor, built row by row; the reciprocal of each diagonal entry is kept in its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Factor<const N: usize> {
    rows: [[f64; N]; N],
}

impl<const N: usize> Factor<N> {
    pub(crate) const EMPTY: Self = Self { rows: [[0.0; N]; N] };

    /// Solves for row `at` given the entries left of the diagonal; the return is `|row|^2`, to be taken from the diagonal entry.
    #[inline]
    pub(crate) fn row(&self, at: usize, left: &[f64; N], into: &mut [f64; N]) -> f64 {
        let mut square = 0.0;
        for j in 0..at {
            let mut sum = left[j];
            for k in 0..j {
                sum -= into[k] * self.rows[j][k];
            }
            into[j] = sum * self.rows[j][j];
            square += into[j] * into[j];
        }
        square
    }

    /// Adds row `at` of the matrix; false if its pivot is not positive.
    #[inline]
    pub(crate) fn push(&mut self, at: usize, left: &[f64; N], diagonal: f64) -> bool {
        let mut row = [0.0; N];
        let pivot = diagonal - self.row(at, left, &mut row);
        if !(pivot > 0.0) {
            return false;
        }
        row[at] = 1.0 / pivot.sqrt();
        self.rows[at] = row;
        true
    }
}

/// Whether every matrix whose entries are within `allowance` of those of `a` is positive definite.
pub(crate) fn exceeds<const N: usize>(a: &[[f64; N]; N], allowance: &[[f64; N]; N]) -> bool {
    let trace: f64 = (0..N).map(|i| a[i][i].abs()).sum();
    let shift = frobenius(allowance) + cholesky_allowance(N, trace);
    let mut factor = Factor::<N>::EMPTY;
    (0..N).all(|i| factor.push(i, &a[i], a[i][i] - shift))
}
