//! Sine and cosine together, from the operations of [`Real`] alone: one source for a number and for lanes of numbers.
//!
//! ```text
//! k = round(2x/π),  r = x - k π/2 (π/2 in three parts of 33, 33 and 53 bits),  |r| <= π/4
//! sin r = r + r³ (S1 + r² (S2 + ... S6)),   cos r = 1 - r²/2 + r⁴ (C1 + r² (C2 + ... C6))
//! ```
//!
//! then the quarter turn k mod 4 says which of ±sin r, ±cos r is which. Nothing branches.
//!
//! **Error.** For `|x| <= ` [`LIMIT_RAD`] both results are within [`ERROR`] of the truth. k is below 2^20 in size, so `k` times a part of 33 bits is exact and the
//! parts leave out `k 2^-119`; the reduction and the last operations round to half a unit of results of at most 1 in size; the polynomials err by
//! less than 2^-57. Beyond the limit the caller takes another way.
//!
//! Source: the coefficients and the reduction are those of FreeBSD's msun (`k_sin.c`, `k_cos.c`, `e_rem_pio2.c`; Sun Microsystems, 1993).

use crate::Real;

/// Largest argument of the fast way, rad.
pub const LIMIT_RAD: f64 = 1e5;
/// Bound of the absolute error up to [`LIMIT_RAD`].
pub const ERROR: f64 = 1.0 / (1_u64 << 52) as f64;

/// Adding and taking it away again rounds to an integer.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52
/// π/2 in three parts, the first two with 33 bits.
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_7e-21];
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// `c_1 + z (c_2 + z (..))`.
#[inline(always)]
fn series<T: Real>(z: T, [c1, c2, c3, c4, c5, c6]: [f64; 6]) -> T {
    let upper = z.mul_add(T::from_f64(c6), T::from_f64(c5)).mul_add(z, T::from_f64(c4));
    upper.mul_add(z, T::from_f64(c3)).mul_add(z, T::from_f64(c2)).mul_add(z, T::from_f64(c1))
}

#[inline(always)]
fn round<T: Real>(x: T) -> T {
    (x + T::from_f64(ROUND)) - T::from_f64(ROUND)
}

/// `(sin x, cos x)`, |x| at most [`LIMIT_RAD`].
#[inline(always)]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    let k = round(x * T::from_f64(core::f64::consts::FRAC_2_PI));
    let [first, second, third] = HALF_PI;
    let r = x - k * T::from_f64(first) - k * T::from_f64(second) - k * T::from_f64(third);
    let z = r * r;
    let sine = (z * r).mul_add(series(z, SINE), r);
    // 1 - z/2 loses up to half a unit, which is given back.
    let half = z * T::from_f64(0.5);
    let rounded = T::one() - half;
    let cosine = rounded + (z * z).mul_add(series(z, COSINE), (T::one() - rounded) - half);
    // The quarter turn in -2..=2; 2 and -2 are the same.
    let quarter = k - round(k * T::from_f64(0.25)) * T::from_f64(4.0);
    // Of an odd quarter turn the sine is the cosine.
    let even = (quarter.abs() - T::one()).abs();
    let (s, c) = (even.choose(T::from_f64(0.5), cosine, sine), even.choose(T::from_f64(0.5), sine, cosine));
    let side = T::from_f64(0.5);
    let reach = T::from_f64(0.75);
    ((quarter - side).abs().choose(reach, s, -s), (quarter + side).abs().choose(reach, c, -c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_within_their_bound() {
        // The library's own error is below one unit of the last place.
        const LIBRARY: f64 = f64::EPSILON / 2.0;
        let mut worst = 0.0_f64;
        let mut compare = |x: f64| {
            let (sine, cosine) = sin_cos(x);
            worst = worst.max((sine - x.sin()).abs()).max((cosine - x.cos()).abs());
        };
        for i in 0..10_000_000_u32 {
            // A golden-ratio sequence: small arguments as often as large ones.
            let share = (f64::from(i) * 0.618_033_988_749_894_9).fract();
            let size = [1.0, 4.0, 30.0, LIMIT_RAD][(i % 4) as usize];
            compare(size * (2.0 * share - 1.0));
        }
        for quarter in -60_000..60_000 {
            let x = f64::from(quarter) * core::f64::consts::FRAC_PI_2;
            for near in [x.next_down(), x, x.next_up()] {
                compare(near);
            }
        }
        assert!(worst <= ERROR + LIBRARY, "{worst:e}");
        assert!(worst > 0.1 * ERROR, "a comparison of the function with itself");
    }

    #[test]
    fn the_sine_of_a_small_angle_keeps_its_digits() {
        for exponent in 1..300 {
            let x = 0.7 * 10.0_f64.powi(-exponent);
            assert!((sin_cos(x).0 - x.sin()).abs() <= 2.0 * f64::EPSILON * x);
        }
        assert_eq!(sin_cos(0.0).0.to_bits(), 0.0_f64.to_bits());
    }
}
