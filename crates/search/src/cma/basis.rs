//! The eigendecomposition C = B D² Bᵀ.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use serde::{Deserialize, Serialize};

use crate::plain;

/// The QL iterations granted per decomposition; a few per dimension are usual.
const ITERATIONS: usize = 10_000;

/// C = B D² Bᵀ: the axes of the distribution and its lengths along them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Basis {
    /// B, whose columns are the eigenvectors of C.
    #[serde(with = "plain::matrix")]
    pub(crate) axes: DMatrix<f64>,
    /// The diagonal of D, the square roots of the eigenvalues, ascending.
    #[serde(with = "plain::vector")]
    pub(crate) lengths: DVector<f64>,
}

impl Basis {
    /// That of C = I.
    pub(crate) fn identity(n: usize) -> Basis {
        Basis { axes: DMatrix::identity(n, n), lengths: DVector::repeat(n, 1.0) }
    }

    /// That of `covariance`, unless it is not positive definite.
    ///
    /// Only the lower triangle is read: rounding may leave the two apart.
    /// An eigenvector is determined up to its sign; here its largest component
    /// is positive and the eigenvalues ascend, so that the result depends on
    /// the matrix alone and not on the path the iteration took.
    pub(crate) fn of(covariance: &DMatrix<f64>) -> Option<Basis> {
        if !covariance.iter().all(|c| c.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::try_new(covariance.clone(), f64::EPSILON, ITERATIONS)?;
        let mut pairs: Vec<(f64, DVector<f64>)> = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
            .map(|(&value, axis)| (value, if axis[axis.iamax()] < 0.0 { -axis } else { axis.into() }))
            .collect();
        pairs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (values, axes): (Vec<f64>, Vec<DVector<f64>>) = pairs.into_iter().unzip();
        values
            .iter()
            .all(|&value| value > 0.0)
            .then(|| Basis { axes: DMatrix::from_columns(&axes), lengths: DVector::from_vec(values).map(f64::sqrt) })
    }

    /// B D z, which is distributed as N(0, C) when z is as N(0, I).
    pub(crate) fn shape(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.axes * self.lengths.component_mul(z)
    }

    /// The condition number of C.
    pub(crate) fn condition(&self) -> f64 {
        (self.lengths.max() / self.lengths.min()).powi(2)
    }

    /// Whether this is a basis in `n` dimensions.
    pub(crate) fn sound(&self, n: usize) -> bool {
        self.axes.shape() == (n, n)
            && self.lengths.len() == n
            && self.axes.iter().all(|c| c.is_finite())
            && self.lengths.iter().all(|&c| c.is_finite() && c > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_parts_make_up_the_whole(
            (n, elements) in (1_usize..8)
                .prop_flat_map(|n| (Just(n), prop::collection::vec(-1.0..1.0, n * n)))
        ) {
            let root = DMatrix::from_vec(n, n, elements);
            let covariance = &root * root.transpose() + DMatrix::identity(n, n) * 1e-3;
            let basis = Basis::of(&covariance).unwrap();
            let d2 = DMatrix::from_diagonal(&basis.lengths.map(|d| d * d));
            let whole = &basis.axes * d2 * basis.axes.transpose();
            prop_assert!((whole - &covariance).norm() < 1e-12 * covariance.norm());
            prop_assert!(basis.sound(n));
            prop_assert!(basis.lengths.as_slice().is_sorted());
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_none() {
        assert!(Basis::of(&DMatrix::from_vec(2, 2, vec![1.0, 2.0, 2.0, 1.0])).is_none());
        assert!(Basis::of(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }
}
