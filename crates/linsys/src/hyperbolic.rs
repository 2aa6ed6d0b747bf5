//! The hyperbolic tangent from the operations of [`Real`] alone: one source for a number and for lanes of numbers.
//!
//! ```text
//! y = min(|x|, 20),  z = -2 y/2^8
//! p = e^z - 1 = z + z²/2! + ... + z^11/11!,   then eight times p <- p (p + 2), which doubles the exponent
//! tanh x = ±p/(p + 2)
//! ```
//!
//! Nothing branches. **Error.** At most [`ERROR`] of the result: the series leaves out less than 2^-58 of p for z in [-0.157, 0]; p is negative, so a doubling does not
//! enlarge the relative error that it finds, and adds three roundings; beyond 20 the result is 1 to the bit. The smallest numbers lose digits where z underflows.

use crate::Real;

/// Bound of the relative error for arguments of at least 1e-300 in size.
pub const ERROR: f64 = 30.0 * f64::EPSILON;

/// From here on the tangent is 1.
const SATURATED: f64 = 20.0;
/// How often the exponent is doubled.
const DOUBLINGS: i32 = 8;
/// 1/11!, 1/10!, ..., 1/2!, 1.
const SERIES: [f64; 11] = {
    let mut terms = [1.0; 11];
    let mut k = 10;
    while k > 0 {
        k -= 1;
        terms[k] = terms[k + 1] / (11 - k) as f64;
    }
    terms
};

/// `tanh x`; NaN stays NaN.
#[inline(always)]
pub fn tanh<T: Real>(x: T) -> T {
    let two = T::from_f64(2.0);
    let size = x.abs().clamp_symmetric(T::from_f64(SATURATED));
    let z = size * T::from_f64(-2.0 / (1_u32 << DOUBLINGS) as f64);
    let mut sum = T::from_f64(SERIES[0]);
    for k in 1..SERIES.len() {
        sum = sum.mul_add(z, T::from_f64(SERIES[k]));
    }
    let mut p = sum * z;
    for _ in 0..DOUBLINGS {
        p *= p + two;
    }
    let tangent = -p / (p + two);
    (-x).choose(T::zero(), tangent, -tangent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_within_their_bound() {
        let mut worst = 0.0_f64;
        for i in 0..2_000_000_u32 {
            let share = (f64::from(i) * 0.618_033_988_749_894_9).fract();
            let x = [1e-3, 1.0, 5.0, 25.0][(i % 4) as usize] * (2.0 * share - 1.0);
            worst = worst.max((tanh(x) / x.tanh() - 1.0).abs());
        }
        for exponent in -300..3 {
            let x = 0.7 * 10.0_f64.powi(exponent);
            worst = worst.max((tanh(x) / x.tanh() - 1.0).abs());
        }
        // The library's own error is below two units of the last place.
        assert!(worst <= ERROR + 2.0 * f64::EPSILON, "{worst:e}");
        assert!(worst > 0.01 * ERROR, "a comparison of the function with itself");
    }

    #[test]
    fn the_ends_are_exact() {
        for (x, exact) in [(0.0, 0.0), (20.0, 1.0), (f64::INFINITY, 1.0), (f64::NEG_INFINITY, -1.0), (-1e300, -1.0)] {
            assert_eq!(tanh(x).to_bits(), f64::to_bits(exact), "{x}");
        }
        assert!(tanh(f64::NAN).is_nan());
    }
}
