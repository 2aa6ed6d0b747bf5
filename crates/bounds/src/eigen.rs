//! Eigenvalues of small symmetric matrices by cyclic Jacobi rotations.
//!
//! `A = V diag(λ) V'`. Jacobi's method is chosen for its relative accuracy (the smallest inertia of an arm is a thousandth of
//! its largest) and because it works on fixed-size arrays without a heap. Source: Golub and Van Loan, *Matrix Computations*
//! (4th ed.), sec. 8.5. Limits: symmetric input; only the upper triangle and the diagonal are read.

use certune_linsys::{JointMatrix, Joints};

/// Eigenvalues in no particular order, eigenvectors as the matching columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eigen<const N: usize> {
    pub(crate) values: Joints<N>,
    pub(crate) vectors: JointMatrix<N>,
}

/// Sweeps after which the loop gives up; six or seven suffice for order 10.
const SWEEPS: usize = 40;

/// All eigenpairs of a symmetric matrix. O(N³), no heap; entries that are not finite give values that are not finite.
pub(crate) fn symmetric_eigen<const N: usize>(matrix: &JointMatrix<N>) -> Eigen<N> {
    let mut a = *matrix;
    let mut vectors = JointMatrix::<N>::identity();
    let scale = a.norm();
    for _ in 0..SWEEPS {
        let mut off = 0.0_f64;
        for p in 0..N {
            for r in p + 1..N {
                off = off.max(a[(p, r)].abs());
            }
        }
        if off <= 1e-17 * scale || scale.is_nan() {
            break;
        }
        for p in 0..N {
            for r in p + 1..N {
                rotate(&mut a, &mut vectors, p, r);
            }
        }
    }
    Eigen { values: a.diagonal(), vectors }
}

/// One rotation in the plane `(p, r)`, `p < r`, that annihilates `a[(p, r)]`; the upper triangle is kept current.
#[inline]
fn rotate<const N: usize>(a: &mut JointMatrix<N>, vectors: &mut JointMatrix<N>, p: usize, r: usize) {
    let apr = a[(p, r)];
    if apr.abs() < f64::MIN_POSITIVE {
        return;
    }
    let theta = (a[(r, r)] - a[(p, p)]) / (2.0 * apr);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = (t * t + 1.0).sqrt().recip();
    let s = t * c;
    a[(p, p)] -= t * apr;
    a[(r, r)] += t * apr;
    a[(p, r)] = 0.0;
    let mut turn = |i: (usize, usize), j: (usize, usize)| {
        let (x, y) = (a[i], a[j]);
        a[i] = c * x - s * y;
        a[j] = s * x + c * y;
    };
    for k in 0..p {
        turn((k, p), (k, r));
    }
    for k in p + 1..r {
        turn((p, k), (k, r));
    }
    for k in r + 1..N {
        turn((p, k), (r, k));
    }
    for k in 0..N {
        let (x, y) = (vectors[(k, p)], vectors[(k, r)]);
        vectors[(k, p)] = c * x - s * y;
        vectors[(k, r)] = s * x + c * y;
    }
}

impl<const N: usize> Eigen<N> {
    /// The pair for which `key(value)` is largest (the first of equals); `N >= 1`.
    fn best_by(&self, key: impl Fn(f64) -> f64) -> (f64, Joints<N>) {
        let mut best = 0;
        for i in 1..N {
            if key(self.values[i]) > key(self.values[best]) {
                best = i;
            }
        }
        (self.values[best], self.vectors.column(best).into_owned())
    }

    /// The largest eigenvalue and its unit eigenvector.
    pub(crate) fn largest(&self) -> (f64, Joints<N>) {
        self.best_by(|x| x)
    }

    /// The smallest eigenvalue and its unit eigenvector.
    pub(crate) fn smallest(&self) -> (f64, Joints<N>) {
        self.best_by(|x| -x)
    }

    /// The eigenvalue of largest modulus, with its sign, and its unit eigenvector.
    pub(crate) fn dominant(&self) -> (f64, Joints<N>) {
        self.best_by(f64::abs)
    }
}

#[cfg(test)]
mod tests {
    use certune_linsys::JointMatrix;
    use proptest::prelude::*;

    use super::symmetric_eigen;

    /// Ten roundings for each of a few hundred rotations, of a matrix with entries of order 1.
    const TOLERANCE: f64 = 1e-13;

    proptest! {
        #[test]
        fn agrees_with_the_tridiagonal_algorithm_of_nalgebra(entries in proptest::array::uniform32(-1.0..1.0_f64)) {
            let a = JointMatrix::<5>::from_fn(|i, j| entries[5 * i.min(j) + i.max(j)]);
            let eigen = symmetric_eigen(&a);
            let rebuilt = eigen.vectors * JointMatrix::from_diagonal(&eigen.values) * eigen.vectors.transpose();
            prop_assert!((rebuilt - a).amax() <= TOLERANCE);
            prop_assert!((eigen.vectors.transpose() * eigen.vectors - JointMatrix::identity()).amax() <= TOLERANCE);
            let mut ours: Vec<f64> = eigen.values.iter().copied().collect();
            let mut theirs: Vec<f64> = a.symmetric_eigenvalues().iter().copied().collect();
            ours.sort_by(f64::total_cmp);
            theirs.sort_by(f64::total_cmp);
            for (x, y) in ours.iter().zip(&theirs) {
                prop_assert!((x - y).abs() <= TOLERANCE);
            }
            let modulus = theirs.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            prop_assert!((eigen.dominant().0.abs() - modulus).abs() <= TOLERANCE);
            prop_assert!((eigen.smallest().0 - theirs[0]).abs() <= TOLERANCE);
            prop_assert!((eigen.largest().0 - theirs[4]).abs() <= TOLERANCE);
        }
    }

    #[test]
    fn degenerate_inputs_end() {
        assert!(symmetric_eigen(&JointMatrix::<4>::zeros()).values.amax() < f64::MIN_POSITIVE);
        assert!((symmetric_eigen(&JointMatrix::<1>::new(-3.0)).dominant().0 + 3.0).abs() < f64::EPSILON);
        let repeated = JointMatrix::<3>::from_element(1.0);
        assert!((symmetric_eigen(&repeated).largest().0 - 3.0).abs() < TOLERANCE);
        assert!(symmetric_eigen(&JointMatrix::<3>::from_element(f64::NAN)).values.iter().all(|x| x.is_nan()));
    }
}
