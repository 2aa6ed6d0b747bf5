//! Exact linear algebra and polynomials over the rationals.
//!
//! Hurwitz determinants run over the integers (Bareiss), where no fraction has to be reduced at every step.
//!
//! Sources: characteristic polynomial and adjugate by Faddeev and LeVerrier; stability of a polynomial by Hurwitz determinants
//! (Gantmacher, *Theory of Matrices*, vol. 2, ch. XV); definiteness by LDL'.

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

/// A dense square matrix, row by row.
pub(crate) type Matrix = Vec<Vec<BigRational>>;

pub(crate) fn zeros(order: usize) -> Matrix {
    vec![vec![BigRational::zero(); order]; order]
}

/// The pivots of `L D L'`, or `None` at the first that is not positive: then the matrix is not positive definite.
///
/// The matrix must be symmetric; an asymmetric one is answered with `None`.
pub(crate) fn positive_definite_pivots(matrix: &Matrix) -> Option<Vec<BigRational>> {
    let order = matrix.len();
    if order == 0 || matrix.iter().any(|row| row.len() != order) {
        return None;
    }
    if (0..order).any(|i| (0..i).any(|j| matrix[i][j] != matrix[j][i])) {
        return None;
    }
    let mut rest = matrix.clone();
    let mut pivots = Vec::with_capacity(order);
    for k in 0..order {
        let pivot = rest[k][k].clone();
        if !pivot.is_positive() {
            return None;
        }
        for i in k + 1..order {
            if rest[i][k].is_zero() {
                continue;
            }
            let factor = &rest[i][k] / &pivot;
            for j in i..order {
                let change = &factor * &rest[j][k];
                rest[j][i] -= &change;
            }
        }
        pivots.push(pivot);
    }
    Some(pivots)
}

/// `det(s I - A)`, coefficients from the highest power down, the first being 1.
pub(crate) fn characteristic_polynomial(a: &Matrix) -> Vec<BigRational> {
    resolvent(a).0
}

/// `det(s I - A)` and the adjugate of `s I - A`, both by powers of s, the highest first.
pub(crate) fn resolvent(a: &Matrix) -> (Vec<BigRational>, Vec<Matrix>) {
    let order = a.len();
    let mut coefficients = vec![BigRational::one()];
    let mut adjugate: Vec<Matrix> = Vec::with_capacity(order);
    // Faddeev-LeVerrier: N_0 = I, c_k = -tr(A N_{k-1})/k, N_k = A N_{k-1} + c_k I.
    let mut next = zeros(order);
    for k in 1..=order {
        for (i, row) in next.iter_mut().enumerate() {
            row[i] += &coefficients[k - 1];
        }
        let product = multiply(a, &next);
        let trace: BigRational = (0..order).map(|i| product[i][i].clone()).sum();
        coefficients.push(-trace / BigRational::from_integer(k.into()));
        adjugate.push(next);
        next = product;
    }
    (coefficients, adjugate)
}

fn multiply(x: &Matrix, y: &Matrix) -> Matrix {
    let order = x.len();
    let mut product = zeros(order);
    for i in 0..order {
        for k in 0..order {
            if x[i][k].is_zero() {
                continue;
            }
            for j in 0..order {
                product[i][j] += &x[i][k] * &y[k][j];
            }
        }
    }
    product
}

/// The coefficients times their common denominator: integers in the same proportions, for polynomials that must keep theirs.
pub(crate) fn common_integers(polynomials: &[Vec<BigRational>]) -> Vec<Vec<BigInt>> {
    let denominator = polynomials.iter().flatten().fold(BigInt::one(), |lcm, c| lcm.lcm(c.denom()));
    let whole = |c: &BigRational| c.numer() * (&denominator / c.denom());
    polynomials.iter().map(|p| p.iter().map(whole).collect()).collect()
}

/// Whether every root of `p` (coefficients from the highest power down) has a negative real part.
///
/// Exact: the leading minors of the Hurwitz matrix, which are the pivots of Bareiss's elimination without exchange of rows, must be
/// positive. A polynomial of degree 0 or with a leading coefficient that is not positive is answered with `false`: an empty
/// set of roots would be vacuously stable.
pub(crate) fn is_hurwitz(p: &[BigInt]) -> bool {
    let Some(degree) = p.len().checked_sub(1).filter(|&degree| degree > 0) else { return false };
    if !p[0].is_positive() {
        return false;
    }
    let mut matrix = vec![vec![BigInt::zero(); degree]; degree];
    for (row, entries) in matrix.iter_mut().enumerate() {
        for (column, entry) in entries.iter_mut().enumerate() {
            // Entry (i, j), counted from 1, is the coefficient a_{2j - i}.
            let index = (2 * (column + 1)).checked_sub(row + 1);
            if let Some(coefficient) = index.and_then(|k| p.get(k)) {
                entry.clone_from(coefficient);
            }
        }
    }
    let mut previous = BigInt::one();
    for k in 0..degree {
        let pivot = matrix[k][k].clone();
        if !pivot.is_positive() {
            return false;
        }
        for i in k + 1..degree {
            for j in k + 1..degree {
                matrix[i][j] = (&pivot * &matrix[i][j] - &matrix[i][k] * &matrix[k][j]) / &previous;
            }
        }
        previous = pivot;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::ratio;
    use proptest::prelude::*;

    fn rationals(values: &[i64]) -> Vec<BigRational> {
        values.iter().map(|&v| ratio(v, 1)).collect()
    }

    fn integers(values: &[i64]) -> Vec<BigInt> {
        values.iter().map(|&v| v.into()).collect()
    }

    fn one_in_integers(p: Vec<BigRational>) -> Vec<BigInt> {
        common_integers(&[p]).remove(0)
    }

    fn matrix(rows: &[&[i64]]) -> Matrix {
        rows.iter().map(|row| rationals(row)).collect()
    }

    /// Coefficients from the highest power down of the product of `(s - root)`.
    fn with_roots(roots: &[BigRational]) -> Vec<BigRational> {
        let mut p = vec![BigRational::one()];
        for root in roots {
            let mut next = p.clone();
            next.push(BigRational::zero());
            for (k, c) in p.iter().enumerate() {
                next[k + 1] -= c * root;
            }
            p = next;
        }
        p
    }

    #[test]
    fn definiteness_of_textbook_matrices() {
        assert!(positive_definite_pivots(&matrix(&[&[2, 1], &[1, 2]])).is_some());
        assert!(positive_definite_pivots(&matrix(&[&[1, 1], &[1, 1]])).is_none(), "singular");
        assert!(positive_definite_pivots(&matrix(&[&[1, 2], &[2, 1]])).is_none(), "indefinite");
        assert!(positive_definite_pivots(&matrix(&[&[1, 1], &[0, 1]])).is_none(), "not symmetric");
        assert!(positive_definite_pivots(&Vec::new()).is_none(), "empty");
    }

    #[test]
    fn the_characteristic_polynomial_of_a_companion_matrix_is_its_last_row() {
        let a = matrix(&[&[0, 1, 0], &[0, 0, 1], &[-6, -11, -6]]);
        assert_eq!(characteristic_polynomial(&a), rationals(&[1, 6, 11, 6]));
    }

    #[test]
    fn hurwitz_knows_the_routh_boundary() {
        // s^3 + s^2 + k s + 1 is stable exactly for k > 1.
        assert!(is_hurwitz(&integers(&[1000, 1000, 1001, 1000])));
        assert!(!is_hurwitz(&integers(&[1, 1, 1, 1])));
        assert!(!is_hurwitz(&integers(&[1])), "vacuous");
        assert!(!is_hurwitz(&integers(&[-1, -1])), "negative leading coefficient");
        assert!(!is_hurwitz(&integers(&[1, 1, 0])), "root at zero");
    }

    #[test]
    fn the_adjugate_times_the_matrix_is_the_determinant() {
        let a = matrix(&[&[1, 2, 3], &[-1, 0, 2], &[4, 1, -5]]);
        let (determinant, adjugate) = resolvent(&a);
        let value = |x: i64| {
            let at = |k: usize| ratio(x.pow((2 - k).try_into().unwrap()), 1);
            let mut adj = zeros(3);
            for (k, part) in adjugate.iter().enumerate() {
                for i in 0..3 {
                    for j in 0..3 {
                        adj[i][j] += at(k) * &part[i][j];
                    }
                }
            }
            adj
        };
        for x in 2..5 {
            let mut shifted = a.clone();
            for (i, row) in shifted.iter_mut().enumerate() {
                for entry in row.iter_mut() {
                    *entry = -entry.clone();
                }
                row[i] += ratio(x, 1);
            }
            let d = determinant.iter().fold(ratio(0, 1), |sum, c| sum * ratio(x, 1) + c);
            let product = multiply(&shifted, &value(x));
            for (i, row) in product.iter().enumerate() {
                for (j, entry) in row.iter().enumerate() {
                    assert_eq!(*entry, if i == j { d.clone() } else { ratio(0, 1) });
                }
            }
        }
    }

    proptest! {
        #[test]
        fn pivots_exist_exactly_for_gram_matrices_of_full_rank(entries in prop::collection::vec(-9_i64..9, 16), shift in 0_i64..2) {
            // G = X'X + shift I is positive definite iff shift > 0 or X has full rank; compare with the leading minors.
            let mut g = zeros(4);
            for i in 0..4 { for j in 0..4 { for k in 0..4 {
                g[i][j] += ratio(entries[4 * k + i] * entries[4 * k + j], 1);
            }} g[i][i] += ratio(shift, 1); }
            let minors_positive = (1..=4).all(|n| {
                let leading: Matrix = g[..n].iter().map(|row| row[..n].to_vec()).collect();
                let determinant = characteristic_polynomial(&leading).pop().unwrap();
                (if n % 2 == 0 { determinant } else { -determinant }).is_positive()
            });
            prop_assert_eq!(positive_definite_pivots(&g).is_some(), minors_positive);
        }

        #[test]
        fn hurwitz_agrees_with_chosen_roots(real in prop::collection::vec(-30_i64..10, 1..5), pair in (-30_i64..10, 1_i64..40)) {
            let mut p = with_roots(&real.iter().map(|&r| ratio(r, 10)).collect::<Vec<_>>());
            // Times s^2 - 2 x s + x^2 + y^2: the pair x +- i y.
            let (x, y) = (ratio(pair.0, 10), ratio(pair.1, 10));
            let quadratic = [BigRational::one(), ratio(-2, 1) * &x, &x * &x + &y * &y];
            let mut product = vec![BigRational::zero(); p.len() + 2];
            for (i, c) in p.iter().enumerate() { for (j, d) in quadratic.iter().enumerate() { product[i + j] += c * d; } }
            p = product;
            prop_assert_eq!(is_hurwitz(&one_in_integers(p)), real.iter().all(|&r| r < 0) && pair.0 < 0);
        }
    }
}
