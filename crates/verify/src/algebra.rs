//! Exact linear algebra and polynomials over the rationals.
//!
//! Determinants and Sturm sequences run over the integers (Bareiss; primitive remainders), where no fraction has to be
//! reduced at every step.
//!
//! Sources: characteristic polynomial by Faddeev and LeVerrier; stability of a polynomial by Hurwitz determinants
//! (Gantmacher, *Theory of Matrices*, vol. 2, ch. XV); real roots in an interval by Sturm's theorem; definiteness by LDL'.

use num_bigint::{BigInt, Sign};
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

/// As [`positive_definite_pivots`] for large matrices: pivots of an equilibrated matrix that is smaller by a rounding.
///
/// With powers of two `d_i`, `d_i d_j a_ij = 2^-BITS (n_ij + f_ij)`, `n_ij` whole and `0 <= f_ij < 1`. A symmetric matrix with entries in [0, 1) is at least
/// `-n I`, so it is enough that the integers `n_ij`, less the order on the diagonal, are positive definite: Bareiss, whose pivots are the leading minors. A matrix
/// that is definite by less than about `n 2^-BITS` is not recognised.
pub(crate) fn positive_definite_rounded(matrix: &Matrix) -> Option<Vec<BigRational>> {
    const BITS: i64 = 64;
    let order = matrix.len();
    let symmetric =
        matrix.iter().all(|row| row.len() == order) && (0..order).all(|i| (0..i).all(|j| matrix[i][j] == matrix[j][i]));
    if order == 0 || !symmetric || !(0..order).all(|i| matrix[i][i].is_positive()) {
        return None;
    }
    // Half the binary exponent of the diagonal.
    let size =
        |x: &BigRational| i64::try_from(x.numer().bits()).unwrap_or(0) - i64::try_from(x.denom().bits()).unwrap_or(0);
    let half: Vec<i64> = (0..order).map(|i| size(&matrix[i][i]).div_euclid(2)).collect();
    let mut whole = vec![vec![BigInt::zero(); order]; order];
    for i in 0..order {
        for j in 0..order {
            let (entry, shift) = (&matrix[i][j], BITS - half[i] - half[j]);
            let power = shift.unsigned_abs();
            let (numerator, denominator) = if shift >= 0 {
                (entry.numer() << power, entry.denom().clone())
            } else {
                (entry.numer().clone(), entry.denom() << power)
            };
            whole[i][j] = numerator.div_floor(&denominator);
        }
        whole[i][i] -= BigInt::from(order);
    }
    let unit = BigInt::one() << BITS.unsigned_abs();
    let mut previous = BigInt::one();
    let mut pivots = Vec::with_capacity(order);
    for k in 0..order {
        let pivot = whole[k][k].clone();
        if !pivot.is_positive() {
            return None;
        }
        for i in k + 1..order {
            for j in i..order {
                let entry = (&pivot * &whole[i][j] - &whole[i][k] * &whole[k][j]) / &previous;
                whole[j][i].clone_from(&entry);
                whole[i][j] = entry;
            }
        }
        pivots.push(BigRational::new(pivot.clone(), &previous * &unit));
        previous = pivot;
    }
    Some(pivots)
}

/// `det(s I - A)`, coefficients from the highest power down, the first being 1.
pub(crate) fn characteristic_polynomial(a: &Matrix) -> Vec<BigRational> {
    let order = a.len();
    let mut coefficients = vec![BigRational::one()];
    // Faddeev-LeVerrier: M_1 = A, c_k = -tr(M_k)/k, M_{k+1} = A (M_k + c_k I).
    let mut product = a.clone();
    for k in 1..=order {
        let trace: BigRational = (0..order).map(|i| product[i][i].clone()).sum();
        let coefficient = -trace / BigRational::from_integer(k.into());
        for (i, row) in product.iter_mut().enumerate() {
            row[i] += &coefficient;
        }
        if k < order {
            product = multiply(a, &product);
        }
        coefficients.push(coefficient);
    }
    coefficients
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

/// Bareiss's elimination: every division is exact, and the last pivot is the determinant.
fn determinant(mut matrix: Vec<Vec<BigInt>>) -> BigInt {
    let order = matrix.len();
    let mut previous = BigInt::one();
    let mut negative = false;
    for k in 0..order {
        let Some(row) = (k..order).find(|&i| !matrix[i][k].is_zero()) else {
            return BigInt::zero();
        };
        if row != k {
            matrix.swap(row, k);
            negative = !negative;
        }
        let pivot = matrix[k][k].clone();
        for i in k + 1..order {
            for j in k + 1..order {
                matrix[i][j] = (&pivot * &matrix[i][j] - &matrix[i][k] * &matrix[k][j]) / &previous;
            }
        }
        previous = pivot;
    }
    if negative { -previous } else { previous }
}

/// The leading Hurwitz determinant of size `size` of `p`, coefficients from the highest power down.
pub(crate) fn hurwitz_determinant(p: &[BigInt], size: usize) -> BigInt {
    let mut matrix = vec![vec![BigInt::zero(); size]; size];
    for (row, entries) in matrix.iter_mut().enumerate() {
        for (column, entry) in entries.iter_mut().enumerate() {
            // Entry (i, j), counted from 1, is the coefficient a_{2j - i}.
            let index = (2 * (column + 1)).checked_sub(row + 1);
            if let Some(coefficient) = index.and_then(|k| p.get(k)) {
                entry.clone_from(coefficient);
            }
        }
    }
    determinant(matrix)
}

/// Whether every root of `p` (coefficients from the highest power down) has a negative real part.
///
/// Exact. A polynomial of degree 0 or with a leading coefficient that is not positive is answered with `false`: an empty
/// set of roots would be vacuously stable.
pub(crate) fn is_hurwitz(p: &[BigInt]) -> bool {
    p.len() >= 2 && p[0].is_positive() && (1..p.len()).all(|size| hurwitz_determinant(p, size).is_positive())
}

/// A polynomial in one variable with integer coefficients, from the constant up, without trailing zeros.
///
/// Only its roots matter here, so it may be multiplied by positive numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Polynomial(Vec<BigInt>);

impl Polynomial {
    /// The polynomial divided by the content of its coefficients, which is positive.
    pub(crate) fn new(mut coefficients: Vec<BigInt>) -> Self {
        while coefficients.last().is_some_and(Zero::is_zero) {
            coefficients.pop();
        }
        let content = coefficients.iter().fold(BigInt::zero(), |gcd, c| gcd.gcd(c));
        if content > BigInt::one() {
            for c in &mut coefficients {
                *c = &*c / &content;
            }
        }
        Self(coefficients)
    }

    /// A positive multiple of the polynomial of degree below `values.len()` that takes `values[k]` at `k = 0, 1, 2, ..`.
    ///
    /// Newton's form on the integers, `p(x) = sum_k D^k(0) x (x-1) .. (x-k+1) / k!`, times `n!`.
    pub(crate) fn through(values: &[BigInt]) -> Self {
        let mut differences = values.to_vec();
        for level in 1..values.len() {
            for k in (level..values.len()).rev() {
                differences[k] = &differences[k] - &differences[k - 1];
            }
        }
        // Horner: p = c_n; p = p (x - k) + c_k, with c_k = D^k(0) n! / k!.
        let mut weight = BigInt::one();
        let mut coefficients: Vec<BigInt> = Vec::new();
        for (k, difference) in differences.iter().enumerate().rev() {
            let node = BigInt::from(k);
            let mut next = vec![BigInt::zero(); coefficients.len() + 1];
            for (power, coefficient) in coefficients.iter().enumerate() {
                next[power + 1] += coefficient;
                next[power] -= coefficient * &node;
            }
            next[0] += difference * &weight;
            coefficients = next;
            weight *= node;
        }
        Self::new(coefficients)
    }

    /// Whether the value at `numerator / denominator`, `denominator > 0`, is negative, zero or positive.
    pub(crate) fn sign_at(&self, numerator: &BigInt, denominator: &BigInt) -> Sign {
        let mut value = BigInt::zero();
        let mut power = BigInt::one();
        for coefficient in self.0.iter().rev() {
            value = value * numerator + coefficient * &power;
            power *= denominator;
        }
        value.sign()
    }

    fn derivative(&self) -> Self {
        Self::new(self.0.iter().enumerate().skip(1).map(|(k, c)| c * BigInt::from(k)).collect())
    }

    /// Minus the remainder of `self / divisor`, times a positive number.
    fn negative_remainder(&self, divisor: &Self) -> Self {
        let mut rest = self.0.clone();
        let Some(lead) = divisor.0.last() else { return Self(Vec::new()) };
        while rest.len() >= divisor.0.len() {
            let Some(top) = rest.last().cloned() else { break };
            // |lead| rest - sign(lead) top x^shift divisor: the top cancels, and |lead| is positive.
            let top = if lead.is_negative() { -top } else { top };
            let shift = rest.len() - divisor.0.len();
            for c in &mut rest {
                *c *= lead.abs();
            }
            for (k, c) in divisor.0.iter().enumerate() {
                rest[shift + k] -= &top * c;
            }
            rest.pop();
        }
        Self::new(rest.into_iter().map(|c| -c).collect())
    }

    /// Whether the polynomial has no real root in the closed interval `[0, 1]`.
    ///
    /// Exact, by Sturm's theorem, which counts the distinct roots in `(0, 1]` when neither end is a root. The zero
    /// polynomial has roots everywhere.
    pub(crate) fn has_no_root_in_unit_interval(&self) -> bool {
        self.has_no_root_in([&BigInt::zero(), &BigInt::one()], &BigInt::one())
    }

    /// As above for `[lower / denominator, upper / denominator]`.
    fn has_no_root_in(&self, [lower, upper]: [&BigInt; 2], denominator: &BigInt) -> bool {
        let is_root = |x: &BigInt| self.sign_at(x, denominator) == Sign::NoSign;
        if self.0.is_empty() || is_root(lower) || is_root(upper) {
            return false;
        }
        let mut chain = vec![self.clone(), self.derivative()];
        while let [.., before, last] = &chain[..] {
            if last.0.is_empty() {
                break;
            }
            let next = before.negative_remainder(last);
            chain.push(next);
        }
        let changes = |x: &BigInt| {
            let signs: Vec<Sign> =
                chain.iter().map(|p| p.sign_at(x, denominator)).filter(|&sign| sign != Sign::NoSign).collect();
            signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        changes(lower) == changes(upper)
    }
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

    fn no_root(p: &Polynomial, lower: i64, upper: i64, denominator: i64) -> bool {
        p.has_no_root_in([&lower.into(), &upper.into()], &denominator.into())
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
    fn sturm_sees_double_roots_and_roots_at_the_ends() {
        let double = Polynomial::new(integers(&[1, -2, 1])); // (x - 1)^2
        assert!(!no_root(&double, 0, 2, 1));
        assert!(no_root(&double, 0, 9, 10));
        assert!(!double.has_no_root_in_unit_interval());
        assert!(Polynomial::new(integers(&[3])).has_no_root_in_unit_interval());
        assert!(!Polynomial::new(Vec::new()).has_no_root_in_unit_interval());
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
                let leading = g[..n].iter().map(|row| row[..n].iter().map(|x| x.numer().clone()).collect()).collect();
                determinant(leading).is_positive()
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

        #[test]
        fn sturm_agrees_with_chosen_roots(roots in prop::collection::vec(-20_i64..20, 1..6), interval in (-20_i64..20, 0_i64..15)) {
            let mut down = with_roots(&roots.iter().map(|&r| ratio(r, 4)).collect::<Vec<_>>());
            down.reverse();
            let p = Polynomial::new(one_in_integers(down));
            let free = !roots.iter().any(|&r| (interval.0..=interval.0 + interval.1).contains(&r));
            prop_assert_eq!(no_root(&p, interval.0, interval.0 + interval.1, 4), free);
        }

        #[test]
        fn interpolation_returns_the_polynomial(coefficients in prop::collection::vec(-9_i64..9, 1..7)) {
            let p = Polynomial::new(integers(&coefficients));
            let at = |x: i64| p.0.iter().rev().fold(BigInt::zero(), |sum, c| sum * x + c);
            let values: Vec<_> = (0..7).map(at).collect();
            prop_assert_eq!(Polynomial::through(&values), p);
        }
    }
}
