//! Square roots and exponentials, rounded to the side that is safe.
//!
//! A proof compares squares where it can. Where sums of roots or of exponentials stand, each is replaced by a rational on the safe
//! side, close by some `2^-60` of its size.

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};

/// Bits behind the point of what is rounded.
const BITS: u32 = 128;
/// Beyond this `exp(-x)` is not told from `exp(-64)`, which is `2e-28`.
const FAR: i64 = 64;

/// A number no smaller than `x` with [`BITS`] bits behind the point, so that a recursion does not grow digits.
pub(crate) fn up(x: &BigRational) -> BigRational {
    let scale = BigInt::one() << BITS;
    BigRational::new((x.numer() * &scale).div_ceil(x.denom()), scale)
}

/// A number no smaller than the square root of `x`, which must not be negative.
pub(crate) fn sqrt_up(x: &BigRational) -> BigRational {
    if !x.is_positive() {
        return BigRational::zero();
    }
    // sqrt(n/d) <= (1 + floor(sqrt(floor(4^k n/d)))) / 2^k, with k such that the root has some 64 bits.
    let k = (u64::from(BITS) + x.denom().bits()).saturating_sub(x.numer().bits()).div_ceil(2);
    let root = ((x.numer() << (2 * k)) / x.denom()).sqrt() + BigInt::one();
    BigRational::new(root, BigInt::one() << k)
}

/// Numbers `[lower, upper]` with `lower <= exp(-x) <= upper`, for `x >= 0`.
///
/// The partial sums of the series of `exp(x)`, each term rounded to the side of its sum; past term `k >= 2x` the terms at least halve, so
/// the tail is at most the last term.
pub(crate) fn decay(x: &BigRational) -> [BigRational; 2] {
    let far = BigRational::from_integer(FAR.into());
    if *x > far {
        let [_, upper] = decay(&far);
        return [BigRational::zero(), upper];
    }
    let one = BigInt::one() << BITS;
    let (mut below, mut above) = (one.clone(), one.clone());
    let (mut least, mut largest) = (one.clone(), one.clone());
    for k in 1..=4 * FAR {
        let divisor = x.denom() * k;
        least = (least * x.numer()).div_floor(&divisor);
        largest = (largest * x.numer()).div_ceil(&divisor);
        below += &least;
        above += &largest;
    }
    above += largest;
    [BigRational::new(one.clone(), above), BigRational::new(one, below)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::ratio;
    use num_traits::ToPrimitive;
    use proptest::prelude::*;

    fn close(bound: &BigRational, value: f64) -> bool {
        (bound.to_f64().unwrap() - value).abs() <= 1e-13 * value
    }

    #[test]
    fn the_ends() {
        assert_eq!(sqrt_up(&BigRational::zero()), BigRational::zero());
        assert_eq!(decay(&BigRational::zero())[0], BigRational::one());
        let [lower, upper] = decay(&ratio(1_000_000, 1));
        assert!(lower.is_zero() && upper < ratio(1, 1_000_000_000));
        // e = 2.71828182845904523536028747135..
        let [lower, upper] = decay(&ratio(1, 1));
        assert!(lower.recip() > ratio(271_828_182_845_904_523, 100_000_000_000_000_000));
        assert!(upper.recip() < ratio(271_828_182_845_904_524, 100_000_000_000_000_000));
    }

    proptest! {
        #[test]
        fn roots_are_above_and_close(n in 1_i64..i64::MAX, d in 1_i64..i64::MAX) {
            let x = ratio(n, d);
            let root = sqrt_up(&x);
            prop_assert!(&root * &root >= x);
            prop_assert!(close(&root, (n as f64 / d as f64).sqrt()));
            prop_assert!(up(&root) >= root);
        }

        #[test]
        fn exponentials_enclose_and_are_close(n in 0_i64..64_000, m in 0_i64..64_000) {
            let (x, y) = (ratio(n, 1000), ratio(m, 1000));
            let [lower, upper] = decay(&x);
            prop_assert!(lower <= upper && close(&lower, (-(n as f64) / 1000.0).exp()) && close(&upper, (-(n as f64) / 1000.0).exp()));
            // exp(-x) exp(-y) = exp(-x - y), which no rounding to the wrong side survives everywhere.
            if n + m <= 64_000 {
                let [a, b] = decay(&y);
                let [product_lower, product_upper] = decay(&(&x + &y));
                prop_assert!(&lower * &a <= product_upper && &upper * &b >= product_lower);
            }
        }
    }
}
