//! Whether a large symmetric matrix is positive definite, decided by integers.
//!
//! A matrix S is known as whole numbers, up to a positive factor. Powers of two `d_i` bring its diagonal near 1 (a congruence: definiteness stays), and in
//! units of `2^-2K` its entries are rounded down,
//!
//! ```text
//! 2^2K d_i d_j s_ij = n_ij + f_ij,    n_ij whole,  0 <= f_ij < 1,
//! ```
//!
//! f symmetric with entries in [0, 1), so `f >= -n I`, n the order. Two unlike tests follow; either alone is a proof, and only integers are used in both.
//!
//! **A factor and its remainder.** Cholesky's recursion in whole numbers, every division rounded down, from the diagonal lowered by a shift:
//!
//! ```text
//! l_ij = floor((n_ij - sum_k<j l_ik l_jk) / l_jj),    l_jj = floor(sqrt(n_jj - shift - sum_k<j l_jk^2))
//! ```
//!
//! What the divisions leave over, `r = N - L L'`, is an integer matrix known without error. If `r_ii - n > sum_j |r_ij|` in each row then `r - n I` is positive
//! definite (Gershgorin), so `2^2K D S D = L L' + (r - n I) + (f + n I)` is. How L was found does not enter. The k-th pivot of LDL' is the least of `x' S x` over x with
//! `x_k = 1` and nothing after, where `|L'x|^2 >= l_kk^2`: each pivot of D S D is at least `2^-2K l_kk^2`. Off the diagonal `0 <= r_ij < l_jj < 2^(K+1)`, so the shift
//! `(n + 1) 2^(K+1)` always suffices: definiteness by about `n 2^-(K-2)` is recognised.
//!
//! | number | bound, enforced by comparison | bits |
//! |---|---|---|
//! | n | [`MOST`] | 8 |
//! | `n_ij` | `2^(2K+2)` | 2K + 2 |
//! | `l_ij` | `2^(K+1)` | K + 1 |
//! | `sum_k l_ik l_jk` | `n 2^(2K+2)` | 2K + 10 |
//!
//! With K = 58 no sum leaves the 127 bits of an `i128`, and a row sum of remainders has at most K + 9 bits.
//!
//! **Leading minors.** What the first test does not recognise is decided with K = 32 by Bareiss's elimination of `N - n I` in big integers: its pivots are the leading
//! minors. Definiteness by about `n 2^-64` is recognised, at a hundred times the cost.
//!
//! Sources: S. M. Rump, "Verification of positive definiteness", BIT 46 (2006), for a factor with a remainder; E. Bareiss, Math. Comp. 22 (1968).

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

/// A dense square matrix of whole numbers, row by row.
pub(crate) type Integers = Vec<Vec<BigInt>>;

/// Bits of a factor's entry behind the point.
const K: u32 = 58;
/// Orders beyond this are left to Bareiss.
const MOST: usize = 256;
/// Bits behind the point for Bareiss.
const BAREISS: u32 = 64;

/// A positive number no larger than the pivots of LDL' of the matrix with its diagonal scaled near 1; `None` when the matrix is not recognised as positive definite.
///
/// The matrix must be symmetric; an asymmetric one is answered with `None`.
pub(crate) fn least_pivot(matrix: &Integers) -> Option<BigRational> {
    let order = matrix.len();
    let symmetric =
        matrix.iter().all(|row| row.len() == order) && (0..order).all(|i| (0..i).all(|j| matrix[i][j] == matrix[j][i]));
    if order == 0 || !symmetric || !(0..order).all(|i| matrix[i][i].is_positive()) {
        return None;
    }
    by_remainder(matrix).or_else(|| by_minors(matrix))
}

/// Half the binary exponent of each entry of the diagonal: `1/2 <= 4^-half s_ii < 2`.
fn halves(matrix: &Integers) -> Vec<i64> {
    (0..matrix.len()).map(|i| i64::try_from(matrix[i][i].bits() / 2).unwrap_or(i64::MAX)).collect()
}

/// `2^bits 2^-shift x` rounded down.
fn scaled(x: &BigInt, bits: u32, shift: i64) -> BigInt {
    let power = i64::from(bits) - shift;
    // A shift of a big integer to the right rounds down, of negative ones too.
    if power >= 0 { x << power.unsigned_abs() } else { x >> power.unsigned_abs() }
}

/// The first test. Every sum below stays within 127 bits by the module's table, so wrapping never happens; the operators that check for it cost a call each.
fn by_remainder(matrix: &Integers) -> Option<BigRational> {
    let order = matrix.len();
    if order > MOST {
        return None;
    }
    let half = halves(matrix);
    let most = 1_i128 << (2 * K + 2);
    let whole = |i: usize, j: usize| {
        let entry = scaled(&matrix[i][j], 2 * K, half[i].checked_add(half[j])?).to_i128()?;
        (-most..=most).contains(&entry).then_some(entry)
    };
    let order_wide = i128::try_from(order).ok()?;
    let shift = (order_wide + 1) << (K + 1);
    let largest = 1_i64 << (K + 1);
    let mut factor: Vec<Vec<i64>> = Vec::with_capacity(order);
    // Sums of |r_ij| over j != i, and r_ii.
    let mut off_diagonal = vec![0_i128; order];
    let mut diagonal = Vec::with_capacity(order);
    for i in 0..order {
        let mut row: Vec<i64> = Vec::with_capacity(i + 1);
        for j in 0..i {
            let left = whole(i, j)?.wrapping_sub(product(&row, &factor[j]));
            let pivot = i128::from(*factor[j].last()?);
            let entry = i64::try_from(left.div_euclid(pivot)).ok().filter(|l| (-largest..=largest).contains(l))?;
            let remainder = left - i128::from(entry) * pivot;
            off_diagonal[i] += remainder;
            off_diagonal[j] += remainder;
            row.push(entry);
        }
        let left = whole(i, i)?.wrapping_sub(product(&row, &row));
        let root = i64::try_from((left - shift).checked_isqrt()?).ok().filter(|l| (1..=largest).contains(l))?;
        row.push(root);
        diagonal.push(left - i128::from(root) * i128::from(root));
        factor.push(row);
    }
    if !diagonal.iter().zip(&off_diagonal).all(|(r, others)| *r - order_wide > *others) {
        return None;
    }
    let least = factor.iter().filter_map(|row| row.last()).min()?;
    Some(BigRational::new(BigInt::from(*least) * least, BigInt::one() << (2 * K)))
}

/// `sum_k x_k y_k` over the shorter of the two.
fn product(x: &[i64], y: &[i64]) -> i128 {
    x.iter().zip(y).fold(0, |sum: i128, (&x, &y)| sum.wrapping_add(i128::from(x).wrapping_mul(i128::from(y))))
}

/// The second test.
fn by_minors(matrix: &Integers) -> Option<BigRational> {
    let order = matrix.len();
    let half = halves(matrix);
    let mut whole = vec![vec![BigInt::zero(); order]; order];
    for i in 0..order {
        for j in 0..order {
            whole[i][j] = scaled(&matrix[i][j], BAREISS, half[i].checked_add(half[j])?);
        }
        whole[i][i] -= BigInt::from(order);
    }
    let unit = BigInt::one() << BAREISS;
    let mut previous = BigInt::one();
    let mut least: Option<BigRational> = None;
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
        let of_ldl = BigRational::new(pivot.clone(), &previous * &unit);
        least = Some(least.map_or(of_ldl.clone(), |least| least.min(of_ldl)));
        previous = pivot;
    }
    least
}

/// Matrices times one common positive whole number, so that they are whole. All share it, so that sums of their entries keep their proportions.
pub(crate) fn whole<'a>(matrices: &[Vec<Vec<&'a BigRational>>]) -> (Vec<Integers>, BigInt) {
    let entries = || matrices.iter().flatten().flatten();
    // Nearly all denominators are powers of two, whose common multiple needs no greatest common divisor.
    let parts = |x: &'a BigRational| {
        let twos = x.denom().trailing_zeros().unwrap_or(0);
        (twos, x.denom().bits() == twos + 1)
    };
    let twos = entries().map(|x| parts(x).0).max().unwrap_or(0);
    let odd = entries().fold(BigInt::one(), |odd, x| {
        let (twos, power_of_two) = parts(x);
        if power_of_two { odd } else { odd.lcm(&(x.denom() >> twos)) }
    });
    let entry = |x: &&'a BigRational| {
        let (own, power_of_two) = parts(x);
        let shifted = x.numer() << (twos - own);
        match (odd.is_one(), power_of_two) {
            (true, _) => shifted,
            (false, true) => shifted * &odd,
            (false, false) => shifted * (&odd / (x.denom() >> own)),
        }
    };
    let whole = matrices.iter().map(|a| a.iter().map(|row| row.iter().map(entry).collect()).collect()).collect();
    (whole, odd << twos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::{Matrix, positive_definite_pivots};
    use crate::number::ratio;
    use proptest::prelude::*;

    fn integers(rows: &[&[i64]]) -> Integers {
        rows.iter().map(|row| row.iter().map(|&x| x.into()).collect()).collect()
    }

    /// Rational LDL', which knows no rounding.
    fn exact(matrix: &Integers) -> Option<Vec<BigRational>> {
        let matrix: Matrix =
            matrix.iter().map(|row| row.iter().map(|x| BigRational::from_integer(x.clone())).collect()).collect();
        positive_definite_pivots(&matrix)
    }

    #[test]
    fn textbook_matrices() {
        let tests: [fn(&Integers) -> Option<BigRational>; 3] = [by_remainder, by_minors, least_pivot];
        for test in tests {
            assert!(test(&integers(&[&[2, 1], &[1, 2]])).is_some());
            assert!(test(&integers(&[&[1, 1], &[1, 1]])).is_none(), "singular");
            assert!(test(&integers(&[&[1, 2], &[2, 1]])).is_none(), "indefinite");
            assert!(test(&integers(&[&[1, 0, 0], &[0, 1, 7], &[0, 7, 1]])).is_none(), "indefinite at the end");
        }
        assert!(least_pivot(&integers(&[&[1, 1], &[0, 1]])).is_none(), "not symmetric");
        assert!(least_pivot(&integers(&[&[1, 0], &[0, 0]])).is_none(), "a zero on the diagonal");
        assert!(least_pivot(&integers(&[&[-1]])).is_none(), "negative");
        assert!(least_pivot(&Vec::new()).is_none(), "empty");
    }

    #[test]
    fn orders_beyond_the_bound_of_the_sums_are_left_to_the_minors() {
        let identity = |order: usize| -> Integers {
            (0..order).map(|i| (0..order).map(|j| BigInt::from(u8::from(i == j))).collect()).collect()
        };
        assert!(by_remainder(&identity(MOST)).is_some());
        assert!(by_remainder(&identity(MOST + 1)).is_none());
    }

    #[test]
    fn the_sums_stay_within_their_bound_at_the_largest_order() {
        // All entries equal but for a larger diagonal: the products in a row all have one sign and add up.
        let matrix: Integers = (0..MOST)
            .map(|i| (0..MOST).map(|j| (BigInt::one() << 80) - BigInt::from(1_i64 << 62) * i64::from(i != j)).collect())
            .collect();
        assert!(by_remainder(&matrix).is_some());
    }

    #[test]
    fn definiteness_is_recognised_down_to_the_promised_margin() {
        // [[1, 1 - t], [1 - t, 1]] has the eigenvalue t.
        let near = |exponent: u32| {
            let one = BigInt::one() << 200_u32;
            let other = &one - (BigInt::one() << (200 - exponent));
            vec![vec![one.clone(), other.clone()], vec![other, one]]
        };
        assert!(by_remainder(&near(K - 5)).is_some() && by_remainder(&near(K + 3)).is_none());
        assert!(by_minors(&near(62)).is_some() && by_minors(&near(66)).is_none());
        assert!(least_pivot(&near(62)).is_some() && exact(&near(66)).is_some());
    }

    #[test]
    fn the_common_unit_is_common() {
        let numbers = [ratio(1, 3), ratio(-5, 8), ratio(7, 1), ratio(1, 24)];
        let rows: Vec<Vec<Vec<_>>> = vec![vec![vec![&numbers[0]]], vec![numbers[1..].iter().collect()]];
        let (whole, unit) = whole(&rows);
        for (row, whole) in rows.iter().flatten().zip(whole.iter().flatten()) {
            for (x, whole) in row.iter().zip(whole) {
                assert_eq!(*x * &unit, BigRational::from_integer(whole.clone()));
            }
        }
        assert!(unit.is_positive());
    }

    /// `2^60 (X'X/scale + t I)` in coordinates of unlike sizes, X of small integers and `t = tenths/10 2^-exponent` of either sign.
    fn near_the_boundary(
        order: usize,
        rank: usize,
        entries: &[i64],
        tenths: i64,
        exponent: u32,
        sizes: &[u32],
    ) -> Integers {
        let unit = BigInt::one() << 120_u32;
        let shift: BigInt = (&unit >> exponent) * tenths / 10;
        let mut matrix = vec![vec![BigInt::zero(); order]; order];
        for i in 0..order {
            for j in 0..order {
                let gram: i64 = (0..rank).map(|k| entries[24 * k + i] * entries[24 * k + j]).sum();
                let entry = &unit * gram / 64 + if i == j { shift.clone() } else { BigInt::zero() };
                matrix[i][j] = entry << (sizes[i] + sizes[j]);
            }
        }
        matrix
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]
        /// Rational LDL' rounds nothing and bounds nothing: what either test accepts it accepts, and no reported pivot is too large.
        #[test]
        fn nothing_is_accepted_that_rational_elimination_rejects(
            order in 1_usize..16,
            defect in 0_usize..3,
            entries in prop::collection::vec(-9_i64..9, 24 * 24),
            tenths in -30_i64..30,
            exponent in 40_u32..72,
            sizes in prop::collection::vec(0_u32..40, 24),
        ) {
            let matrix = near_the_boundary(order, order.saturating_sub(defect), &entries, tenths, exponent, &sizes);
            let exact = exact(&matrix);
            for accepted in [by_remainder(&matrix), by_minors(&matrix)].into_iter().flatten() {
                prop_assert!(exact.is_some());
                // In the scaled matrix the pivots are divided by 4^half.
                let size = |half: i64| BigRational::from_integer(BigInt::one() << (2 * half));
                let pivots = exact.iter().flatten().zip(halves(&matrix));
                let least = pivots.map(|(pivot, half)| pivot / size(half)).min();
                prop_assert!(least.is_some_and(|least| accepted <= least));
            }
            // And what is definite by more than the margin is recognised.
            if defect == 0 && exponent < 44 && tenths > 9 {
                prop_assert!(by_remainder(&matrix).is_some());
            }
        }

        /// Whatever the order: `|y|^4 S - (y'S y + d) y y'` with `d >= 0` has `-d |y|^4` along y, in whole numbers, and no elimination is asked.
        #[test]
        fn a_direction_without_a_positive_value_is_never_overlooked(
            order in 13_usize..48,
            entries in prop::collection::vec(-9_i64..9, 48),
            y in prop::collection::vec(-9_i64..9, 48),
            lowered in 0_u8..2,
            sizes in prop::collection::vec(0_u32..40, 48),
        ) {
            let y: Vec<BigInt> = y[..order].iter().map(|&x| x.into()).collect();
            // Positive definite: the identity and a product of a vector with itself.
            let start = |i: usize, j: usize| BigInt::from(entries[i] * entries[j] + i64::from(i == j));
            let along = (0..order).flat_map(|i| (0..order).map(move |j| (i, j)));
            let value = along.map(|(i, j)| &y[i] * &y[j] * start(i, j)).sum::<BigInt>() + lowered;
            let square: BigInt = y.iter().map(|y| y * y).sum();
            let matrix: Integers = (0..order)
                .map(|i| {
                    let entry = |j: usize| &square * &square * start(i, j) - &value * &y[i] * &y[j];
                    (0..order).map(|j| entry(j) << (sizes[i] + sizes[j])).collect()
                })
                .collect();
            prop_assert!(by_remainder(&matrix).is_none() && by_minors(&matrix).is_none());
        }

        /// One entry moved: a definite matrix that stops being one is noticed.
        #[test]
        fn moved_entries_change_both_verdicts_alike(
            entries in prop::collection::vec(-9_i64..9, 24 * 24),
            (i, j) in (0_usize..16, 0_usize..16),
            by in -40_i64..40,
        ) {
            let mut matrix = near_the_boundary(16, 16, &entries, 10, 4, &[0; 24]);
            let change = (BigInt::one() << 120_u32) * by / 8;
            matrix[i][j] += &change;
            if i != j {
                matrix[j][i] += &change;
            }
            prop_assert_eq!(least_pivot(&matrix).is_some(), exact(&matrix).is_some());
        }
    }
}
