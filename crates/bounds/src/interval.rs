//! Outward-rounded intervals, and sines without a mathematics library.
//!
//! Every operation rounds to nearest and then moves each end one floating-point number outward, which is at least the rounding
//! error, underflow included. A result that would be NaN becomes the whole line.
//!
//! Source: R. E. Moore, *Interval Analysis*, 1966. Limits: an operand that occurs twice is treated as two.

use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use certune_linsys::Real;
use num_traits::{One, Zero};

/// All reals between two ends, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    lower: f64,
    upper: f64,
}

const WHOLE: Interval = Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
const UNIT: Interval = Interval { lower: -1.0, upper: 1.0 };
/// Beyond this, in rad, sine and cosine are answered with [-1, 1].
const LARGEST_ANGLE_RAD: f64 = 16.0;
/// Terms of Taylor's series in the square, taken at no more than 1 rad (to rounding); an angle beyond is halved before and doubled after.
const TERMS: u32 = 11;
/// The sums alternate: what is left out is below the next term, `1/24!`.
const REMAINDER: f64 = 1e-21;

impl Interval {
    /// `lower` to `upper`, exactly; the whole line unless `lower <= upper`.
    pub(crate) fn new(lower: f64, upper: f64) -> Self {
        if lower <= upper { Self { lower, upper } } else { WHOLE }
    }

    /// The two ends moved outward by one floating-point number.
    fn outward(lower: f64, upper: f64) -> Self {
        Self::new(lower.next_down(), upper.next_up())
    }

    pub(crate) fn lower(self) -> f64 {
        self.lower
    }

    pub(crate) fn upper(self) -> f64 {
        self.upper
    }

    /// A point inside (up to rounding).
    pub(crate) fn middle(self) -> f64 {
        0.5 * self.lower + 0.5 * self.upper
    }

    /// An upper bound of the distance from `x` to any point of the interval.
    pub(crate) fn distance_from(self, x: f64) -> f64 {
        (self.upper - x).max(x - self.lower).max(0.0).next_up()
    }

    /// The largest absolute value.
    pub(crate) fn magnitude(self) -> f64 {
        self.lower.abs().max(self.upper.abs())
    }

    pub(crate) fn hull(self, other: Self) -> Self {
        Self::new(self.lower.min(other.lower), self.upper.max(other.upper))
    }

    /// An upper bound of the distance of its ends.
    pub(crate) fn width(self) -> f64 {
        (self.upper - self.lower).next_up()
    }

    /// Enclosures of cosine and sine; tight for a narrow interval within [`LARGEST_ANGLE_RAD`] of 0, `[-1, 1]` beyond.
    pub(crate) fn cos_sin(self) -> [Self; 2] {
        let size = self.magnitude();
        if !(size <= LARGEST_ANGLE_RAD) {
            return [UNIT, UNIT];
        }
        let mut doublings = 0;
        let mut divisor = 1.0;
        while size > divisor {
            doublings += 1;
            divisor *= 2.0;
        }
        let two = Self::from_f64(2.0);
        let y = self / Self::from_f64(divisor);
        let square = y * y;
        let (mut cos, mut sin) = (Self::one(), Self::one());
        for k in (1..=TERMS).rev() {
            let k = f64::from(k);
            cos = Self::one() - square * cos / Self::from_f64(2.0 * k * (2.0 * k - 1.0));
            sin = Self::one() - square * sin / Self::from_f64(2.0 * k * (2.0 * k + 1.0));
        }
        let remainder = Self::new(-REMAINDER, REMAINDER);
        cos += remainder;
        sin = sin * y + remainder;
        for _ in 0..doublings {
            (cos, sin) = (two * cos * cos - Self::one(), two * sin * cos);
        }
        [cos.within_unit(), sin.within_unit()]
    }

    fn within_unit(self) -> Self {
        Self::new(self.lower.max(-1.0), self.upper.min(1.0))
    }
}

impl Zero for Interval {
    fn zero() -> Self {
        Self { lower: 0.0, upper: 0.0 }
    }

    fn is_zero(&self) -> bool {
        self.lower == 0.0 && self.upper == 0.0
    }
}

impl One for Interval {
    fn one() -> Self {
        Self { lower: 1.0, upper: 1.0 }
    }
}

impl Neg for Interval {
    type Output = Self;

    fn neg(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::outward(self.lower + other.lower, self.upper + other.upper)
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let products =
            [self.lower * other.lower, self.lower * other.upper, self.upper * other.lower, self.upper * other.upper];
        if products.iter().any(|x| x.is_nan()) {
            return WHOLE;
        }
        let [lower, upper] =
            products.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, u], &x| [l.min(x), u.max(x)]);
        Self::outward(lower, upper)
    }
}

impl Div for Interval {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        if other.lower <= 0.0 && other.upper >= 0.0 {
            return WHOLE;
        }
        self * Self::outward(other.upper.recip(), other.lower.recip())
    }
}

impl AddAssign for Interval {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Interval {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl MulAssign for Interval {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl DivAssign for Interval {
    fn div_assign(&mut self, other: Self) {
        *self = *self / other;
    }
}

impl Real for Interval {
    fn from_f64(x: f64) -> Self {
        Self::new(x, x)
    }

    fn sin_cos(self) -> (Self, Self) {
        let [cos, sin] = self.cos_sin();
        (sin, cos)
    }

    fn sqrt(self) -> Self {
        Self::outward(self.lower.max(0.0).sqrt(), self.upper.max(0.0).sqrt())
    }

    fn abs(self) -> Self {
        let magnitude = self.magnitude();
        if self.lower > 0.0 || self.upper < 0.0 {
            Self::new(self.lower.abs().min(self.upper.abs()), magnitude)
        } else {
            Self::new(0.0, magnitude)
        }
    }

    fn clamp_symmetric(self, limit: Self) -> Self {
        // Between 0 and the argument, and never beyond the widest limit.
        let most = limit.magnitude();
        Self::new(self.lower.clamp(-most, most).min(0.0), self.upper.clamp(-most, most).max(0.0))
    }

    fn tanh(self) -> Self {
        // Between 0 and the argument, and within [-1, 1]; the recursions used here take no tanh.
        Self::new(self.lower.clamp(-1.0, 0.0), self.upper.clamp(0.0, 1.0))
    }

    fn choose(self, _: Self, then: Self, otherwise: Self) -> Self {
        // Either may be taken.
        Self::new(then.lower.min(otherwise.lower), then.upper.max(otherwise.upper))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn contains(outer: Interval, x: f64) -> bool {
        outer.lower <= x && x <= outer.upper
    }

    #[test]
    fn sines_are_tight_and_hold_known_values() {
        // sin(pi/6) with pi as a floating-point number: off by less than 1e-16.
        let (sin, cos) = Interval::from_f64(std::f64::consts::FRAC_PI_6).sin_cos();
        assert!(contains(sin, 0.499_999_999_999_999_94) && sin.upper - sin.lower < 1e-12);
        assert!(contains(cos, 0.866_025_403_784_438_6) && cos.upper - cos.lower < 1e-12);
    }

    proptest! {
        #[test]
        fn sines_are_tight_and_agree_with_the_library(x in -16.0..16.0_f64) {
            let (sin, cos) = Interval::from_f64(x).sin_cos();
            // The library's value is rounded.
            let near = |set: Interval, y: f64| contains(Interval::new(set.lower - 1e-15, set.upper + 1e-15), y) && set.upper - set.lower < 1e-10;
            prop_assert!(near(sin, x.sin()) && near(cos, x.cos()));
        }

        #[test]
        fn operations_hold_the_results_on_points(a in -3.0..3.0_f64, b in -3.0..3.0_f64, wa in 0.0..1.0_f64, wb in 0.0..1.0_f64, s in 0.0..1.0_f64, t in 0.0..1.0_f64) {
            let (x, y) = (Interval::new(a, a + wa), Interval::new(b, b + wb));
            let (u, v) = ((a + s * wa).min(x.upper), (b + t * wb).min(y.upper));
            prop_assert!(contains(x + y, u + v) && contains(x - y, u - v) && contains(x * y, u * v));
            prop_assert!(v == 0.0 || contains(x / y, u / v));
            prop_assert!(contains(x.abs(), u.abs()));
        }
    }
}
