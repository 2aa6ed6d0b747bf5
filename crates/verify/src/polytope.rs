//! A box of polynomials, affine in its parameters: is every one of them stable?
//!
//! ```text
//! p(s; x) = p_0(s) + sum_j x_j p_j(s),    x_j in [lower_j, upper_j]
//! ```
//!
//! By the edge theorem (Bartlett, Hollot, Huang 1988) no polynomial of the box has a root on the imaginary axis if none of its edges
//! has one and the leading coefficient does not vanish; all then have as many roots on the right as one corner. An edge joins two corners
//! P and Q. `j w` is a root of one of its polynomials iff 0 lies on the segment from `P(jw)` to `Q(jw)`, that is
//!
//! ```text
//! Im P(jw) conj(Q(jw)) = 0    and    Re P(jw) conj(Q(jw)) <= 0,
//! ```
//!
//! the first `w` times a polynomial in `w^2`, the second a polynomial in `w^2`. That both never hold is shown interval by interval of `w^2` from the signs of
//! integer Bernstein coefficients: where all of one polynomial have one sign it has no root, and what is left is halved. Polynomials in z
//! are mapped by `z = (1 + w)/(1 - w)` first, a linear map of the coefficients. Proofs: `proofs/claims/exponential.md`, `sampled.md`.

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

use crate::algebra::{common_integers, is_hurwitz};

/// Where a proof about a box stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BoxFlaw {
    /// A range is empty.
    Empty,
    /// The polynomial at all lower ends is not stable.
    FirstCorner,
    /// The leading or the constant coefficient changes its sign or vanishes.
    Ends,
    /// A root reaches the boundary along an edge of this axis.
    Edge(usize),
}

/// The polynomials `parts[0] + sum_j x_j parts[j + 1]` times a positive number, coefficients from the highest power down, all of one length.
///
/// Integers, so that no fraction has to be reduced on the way to a verdict.
#[derive(Clone, Debug)]
pub(crate) struct AffineFamily(Vec<Vec<BigInt>>);

impl AffineFamily {
    /// The family of these parts.
    pub(crate) fn new(parts: &[Vec<BigRational>]) -> Self {
        Self(common_integers(parts))
    }

    /// The same family under a linear map of its polynomials.
    pub(crate) fn map(&self, f: impl Fn(&[BigInt]) -> Vec<BigInt>) -> Self {
        Self(self.0.iter().map(|part| f(part)).collect())
    }

    /// A positive multiple of the polynomial at a point: neither its roots nor where a segment to another one meets 0 depend on the multiple.
    pub(crate) fn at(&self, point: &[&BigRational]) -> Vec<BigInt> {
        let Some((constant, parts)) = self.0.split_first() else { return Vec::new() };
        let denominator = point.iter().fold(BigInt::one(), |lcm, x| lcm.lcm(x.denom()));
        let mut p: Vec<BigInt> = constant.iter().map(|c| c * &denominator).collect();
        for (part, &x) in parts.iter().zip(point) {
            let share = x.numer() * (&denominator / x.denom());
            for (sum, c) in p.iter_mut().zip(part) {
                *sum += c * &share;
            }
        }
        let content = p.iter().fold(BigInt::zero(), |gcd, c| gcd.gcd(c));
        if content > BigInt::one() {
            for c in &mut p {
                *c = &*c / &content;
            }
        }
        p
    }

    /// Whether the polynomial at a point is Hurwitz. Exact.
    pub(crate) fn is_hurwitz_at(&self, point: &[&BigRational]) -> bool {
        is_hurwitz(&self.at(point))
    }

    /// Whether every polynomial of the box is Hurwitz. Exact; the leading coefficient must be positive.
    pub(crate) fn is_hurwitz_on(&self, ranges: &[[BigRational; 2]]) -> Result<(), BoxFlaw> {
        let corners = self.corners(ranges)?;
        if corners.first().is_none_or(|first| !is_hurwitz(first)) {
            return Err(BoxFlaw::FirstCorner);
        }
        no_root_on_the_axis(&corners, ranges)
    }

    /// Whether no polynomial of the box is Hurwitz: one corner is not, and no root crosses the axis within the box. Exact.
    pub(crate) fn is_nowhere_hurwitz_on(&self, ranges: &[[BigRational; 2]]) -> bool {
        let Ok(corners) = self.corners(ranges) else { return false };
        let unstable = corners.first().is_some_and(|first| {
            let sign_fixed: Vec<BigInt> =
                if first[0].is_negative() { first.iter().map(|c| -c).collect() } else { first.clone() };
            !is_hurwitz(&sign_fixed)
        });
        unstable && no_root_on_the_axis(&corners, ranges).is_ok()
    }

    /// Corner k has bit j set where axis j is at its upper end.
    fn corners(&self, ranges: &[[BigRational; 2]]) -> Result<Vec<Vec<BigInt>>, BoxFlaw> {
        if ranges.iter().any(|[lower, upper]| lower > upper) {
            return Err(BoxFlaw::Empty);
        }
        let corner = |k: usize| {
            let point: Vec<&BigRational> = ranges.iter().enumerate().map(|(j, range)| &range[k >> j & 1]).collect();
            self.at(&point)
        };
        Ok((0..1_usize << ranges.len()).map(corner).collect())
    }
}

fn no_root_on_the_axis(corners: &[Vec<BigInt>], ranges: &[[BigRational; 2]]) -> Result<(), BoxFlaw> {
    // Affine, so the corners tell: the degree does not drop, and 0 is no root.
    for end in [<[BigInt]>::first, <[BigInt]>::last] {
        let mut signs = corners.iter().map(|p| end(p).map_or_else(BigInt::zero, BigInt::signum));
        let first = signs.next().unwrap_or_default();
        if first.is_zero() || signs.any(|sign| sign != first) {
            return Err(BoxFlaw::Ends);
        }
    }
    for (j, [lower, upper]) in ranges.iter().enumerate() {
        if lower == upper {
            continue;
        }
        // A flat axis has its two ends in one place: the edges at its lower end are all there are.
        let flat = |k: usize| ranges.iter().enumerate().any(|(i, [l, u])| k >> i & 1 == 1 && l == u);
        for from in (0..corners.len()).filter(|&k| k >> j & 1 == 0 && !flat(k)) {
            if !edge_avoids_the_axis(&corners[from], &corners[from | 1 << j]) {
                return Err(BoxFlaw::Edge(j));
            }
        }
    }
    Ok(())
}

/// Whether no polynomial between two has a root `j w`, `w != 0`.
fn edge_avoids_the_axis(from: &[BigInt], to: &[BigInt]) -> bool {
    // p(jw) = even(y) + j w odd(y), y = w^2, coefficients from the constant up.
    let part = |p: &[BigInt], parity: usize| -> Vec<BigInt> {
        let picked = p.iter().rev().skip(parity).step_by(2).enumerate();
        picked.map(|(k, c)| if k % 2 == 0 { c.clone() } else { -c }).collect()
    };
    let mut imaginary = vec![BigInt::zero(); from.len()];
    let mut real = imaginary.clone();
    // Im P conj(Q) = w (odd_P even_Q - even_P odd_Q),  Re = even_P even_Q + y odd_P odd_Q.
    for (i, x) in part(from, 0).iter().enumerate() {
        for (j, y) in part(to, 0).iter().enumerate() {
            real[i + j] += x * y;
        }
        for (j, y) in part(to, 1).iter().enumerate() {
            imaginary[i + j] -= x * y;
        }
    }
    for (i, x) in part(from, 1).iter().enumerate() {
        for (j, y) in part(to, 0).iter().enumerate() {
            imaginary[i + j] += x * y;
        }
        for (j, y) in part(to, 1).iter().enumerate() {
            real[i + j + 1] += x * y;
        }
    }
    positive_or_other_not_zero(bernstein(&real), bernstein(&imaginary))
}

/// The Bernstein coefficients on `t` in [0, 1] of a polynomial in `y = t/(1 - t)`, y >= 0, times a positive number.
fn bernstein(p: &[BigInt]) -> Vec<BigInt> {
    let mut factorials = vec![BigInt::one()];
    for k in 1..p.len() {
        factorials.push(&factorials[k - 1] * k);
    }
    p.iter().zip(factorials.iter().zip(factorials.iter().rev())).map(|(c, (low, high))| c * low * high).collect()
}

/// Whether at every t in [0, 1] the first polynomial is positive or the second is not 0, both by their Bernstein coefficients.
///
/// Coefficients of one sign leave no root; an interval without such a sign is halved. A `false` says only that this was not shown.
fn positive_or_other_not_zero(first: Vec<BigInt>, second: Vec<BigInt>) -> bool {
    const MOST_INTERVALS: usize = 4096;
    const MOST_HALVINGS: usize = 100;
    let mut open = vec![(0, first, second)];
    for _ in 0..MOST_INTERVALS {
        let Some((halvings, first, second)) = open.pop() else { return true };
        if first.iter().all(Signed::is_positive)
            || second.iter().all(Signed::is_positive)
            || second.iter().all(Signed::is_negative)
        {
            continue;
        }
        // At a common root, or where the first is not positive and the second 0, halving would never end.
        if halvings == MOST_HALVINGS {
            return false;
        }
        let ([first_left, first_right], [second_left, second_right]) = (halves(first), halves(second));
        open.push((halvings + 1, first_left, second_left));
        open.push((halvings + 1, first_right, second_right));
    }
    false
}

/// The Bernstein coefficients on the two halves of the interval, times a positive number: de Casteljau's scheme without its divisions.
fn halves(mut b: Vec<BigInt>) -> [Vec<BigInt>; 2] {
    let order = b.len().saturating_sub(1);
    let mut left = Vec::with_capacity(b.len());
    let mut right = Vec::with_capacity(b.len());
    for level in 0..=order {
        // After so many sums, the ends are 2^level times the coefficients.
        left.push(&b[0] << (order - level));
        right.push(&b[order - level] << (order - level));
        for k in 0..order - level {
            let (sums, rest) = b.split_at_mut(k + 1);
            sums[k] += &rest[0];
        }
    }
    right.reverse();
    [left, right].map(|mut half| {
        let twos = half.iter().filter_map(BigInt::trailing_zeros).min().unwrap_or(0);
        for c in &mut half {
            *c >>= twos;
        }
        half
    })
}

/// `(1 - w)^n p((1 + w)/(1 - w))` for p of degree n in z, coefficients from the highest power down: p has all roots inside the unit
/// circle iff the result, of degree n, is Hurwitz (or minus it is).
pub(crate) fn moebius(p: &[BigInt]) -> Vec<BigInt> {
    // Horner in z with the powers of (1 - w) carried along: r <- r (1 + w) + c (1 - w)^k.
    let mut result: Vec<BigInt> = Vec::new();
    let mut power = vec![BigInt::one()];
    let times = |q: &[BigInt], sign: bool| {
        // q (w + 1) or q (-w + 1), highest power first.
        let mut out = vec![BigInt::zero(); q.len() + 1];
        for (k, c) in q.iter().enumerate() {
            out[k + 1] += c;
            if sign { out[k] += c } else { out[k] -= c }
        }
        out
    };
    for c in p {
        result = if result.is_empty() { vec![BigInt::zero()] } else { times(&result, true) };
        for (sum, x) in result.iter_mut().zip(&power) {
            *sum += x * c;
        }
        power = times(&power, false);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::ratio;
    use proptest::prelude::*;

    fn poly(values: &[i64]) -> Vec<BigRational> {
        values.iter().map(|&v| ratio(v, 1)).collect()
    }

    fn whole(values: &[i64]) -> Vec<BigInt> {
        values.iter().map(|&v| v.into()).collect()
    }

    #[test]
    fn the_unit_circle_maps_to_the_axis() {
        // z - r goes to (1 + r) w + (1 - r).
        assert_eq!(moebius(&whole(&[2, -1])), whole(&[3, 1]));
        // z^2 + 1 has its roots on the circle: 2 w^2 + 2.
        assert_eq!(moebius(&whole(&[1, 0, 1])), whole(&[2, 0, 2]));
    }

    #[test]
    fn a_stable_pair_of_ends_does_not_make_a_stable_edge() {
        // s^3 + x s^2 + (3 - x) s + 1 is stable for x (3 - x) > 1: between 0.38 and 2.62, where both coefficients are positive.
        let family = AffineFamily::new(&[poly(&[1, 0, 3, 1]), poly(&[0, 1, -1, 0])]);
        assert_eq!(family.is_hurwitz_on(&[[ratio(1, 2), ratio(5, 2)]]), Ok(()));
        assert_eq!(family.is_hurwitz_on(&[[ratio(1, 2), ratio(27, 10)]]), Err(BoxFlaw::Edge(0)));
        assert_eq!(family.is_hurwitz_on(&[[ratio(1, 5), ratio(3, 10)]]), Err(BoxFlaw::FirstCorner));
        assert!(family.is_nowhere_hurwitz_on(&[[ratio(1, 5), ratio(3, 10)]]));
        assert!(!family.is_nowhere_hurwitz_on(&[[ratio(1, 5), ratio(1, 2)]]));
        // The box in between is unstable although both ends are stable: (s + 1)^3 against a far polynomial.
        let far = AffineFamily::new(&[poly(&[1, 10, 10, 1]), poly(&[0, -20, -20, 200])]);
        assert!(far.is_hurwitz_at(&[&ratio(0, 1)]));
        assert_ne!(far.is_hurwitz_on(&[[ratio(0, 1), ratio(1, 1)]]), Ok(()));
        // A real root through 0, and a degree that drops.
        let through_zero = AffineFamily::new(&[poly(&[1, 3, 1]), poly(&[0, 0, -2])]);
        assert_eq!(through_zero.is_hurwitz_on(&[[ratio(0, 1), ratio(1, 1)]]), Err(BoxFlaw::Ends));
        let drop = AffineFamily::new(&[poly(&[1, 3, 1]), poly(&[-1, 0, 0])]);
        assert_eq!(drop.is_hurwitz_on(&[[ratio(0, 1), ratio(1, 1)]]), Err(BoxFlaw::Ends));
        assert_eq!(drop.is_hurwitz_on(&[[ratio(1, 1), ratio(0, 1)]]), Err(BoxFlaw::Empty));
    }

    proptest! {
        /// An edge against a fine scan of it: a scan that finds an unstable polynomial must find the edge refused, and an edge refused
        /// must have a polynomial near the axis.
        #[test]
        fn edges_agree_with_a_scan(p in prop::collection::vec(1_i64..30, 6), q in prop::collection::vec(1_i64..30, 6)) {
            let difference: Vec<i64> = q.iter().zip(&p).map(|(q, p)| q - p).collect();
            let family = AffineFamily::new(&[poly(&p), poly(&difference)]);
            let stable = |k: i64| family.is_hurwitz_at(&[&ratio(k, 60)]);
            let whole = family.is_hurwitz_on(&[[ratio(0, 1), ratio(1, 1)]]).is_ok();
            let scan = (0..=60).all(stable);
            prop_assert!(!whole || scan);
            // Where two neighbours differ, the piece between them is refused and neither kind is certified on it.
            for k in 0..60 {
                let piece = [[ratio(k, 60), ratio(k + 1, 60)]];
                if stable(k) != stable(k + 1) {
                    prop_assert!(family.is_hurwitz_on(&piece).is_err() && !family.is_nowhere_hurwitz_on(&piece));
                }
            }
            if scan && !whole {
                // Pieces refused although both ends are stable: only where the roots come close to the axis.
                let refused = (0..60).filter(|&k| family.is_hurwitz_on(&[[ratio(k, 60), ratio(k + 1, 60)]]).is_err()).count();
                prop_assert!(refused <= 6, "{}", refused);
            }
        }
    }
}
