//! First-order Taylor models with rigorous remainders, which run the recursions of `certune_dynamics` as they stand.
//!
//! ```text
//! x = c + sum_k a_k t_k + e,    |t_k| <= 1,  |e| <= r
//! ```
//!
//! with one unknown `t_k` per joint angle, shared by all numbers, so that first-order terms cancel where the formulas cancel. Sums are
//! exact but for rounding; a product puts what is of second order into r; sine and cosine are `sin c + cos c (x - c)` up to half the square
//! of the deviation. Every rounding error of c and of the a_k is added to r, and r is rounded upward. A result that would be NaN gets `r` infinite.
//! The recursions hold no comparison, so what they return encloses their value at every point of the box.
//!
//! Source: affine arithmetic, J. Stolfi and L. H. de Figueiredo (1997), in the form of M. Berz's Taylor models of order one.
//! Limits: second-order terms in the width of the box remain; halve the box when that loses too much.

use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use certune_linsys::Real;
use num_traits::{One, Zero};

use crate::interval::Interval;

/// A number over a box of `N` angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine<const N: usize> {
    centre: f64,
    slope: [f64; N],
    remainder: f64,
}

/// Bounds a sum of at most [`ROUNDINGS`] rounding errors of numbers whose absolute values sum to `size`.
fn slack(size: f64) -> f64 {
    (size * (ROUNDINGS * f64::EPSILON)).next_up() + f64::MIN_POSITIVE
}

/// No entry below takes more roundings than this; half of an epsilon each.
const ROUNDINGS: f64 = 4.0;

impl<const N: usize> Affine<N> {
    /// The angle of `joint`, between `lower` and `upper`.
    pub(crate) fn angle(joint: usize, lower: f64, upper: f64) -> Self {
        let centre = 0.5 * lower + 0.5 * upper;
        let mut angle = Self::from_f64(centre);
        angle.slope[joint] = (upper - centre).max(centre - lower).next_up();
        angle
    }

    /// Any number of the interval, without regard to the angles.
    pub(crate) fn from_interval(x: Interval) -> Self {
        let centre = x.middle();
        Self { centre, slope: [0.0; N], remainder: x.distance_from(centre) }.sound()
    }

    /// `x` up to `2^-45 (|x| + 1)`: covers the few roundings with which a model's numbers were made.
    pub(crate) fn widened(x: f64) -> Self {
        let remainder = ((x.abs() + 1.0) * 2.0_f64.powi(-45)).next_up();
        Self { remainder, ..Self::from_f64(x) }
    }

    /// Every value it takes over the box.
    pub(crate) fn range(self) -> Interval {
        let radius = self.deviation();
        Interval::from_f64(self.centre) + Interval::new(-radius, radius)
    }

    /// An upper bound of the distance from the centre.
    fn deviation(self) -> f64 {
        self.slope.iter().fold(self.remainder, |sum, a| (sum + a.abs()).next_up())
    }

    fn size(self) -> f64 {
        self.slope.iter().fold(self.centre.abs(), |sum, a| (sum + a.abs()).next_up())
    }

    /// Whatever is not a number may be any number.
    fn sound(self) -> Self {
        if self.size().is_finite() && self.remainder.is_finite() {
            self
        } else {
            Self { centre: 0.0, slope: [0.0; N], remainder: f64::INFINITY }
        }
    }

    /// `value + derivative (x - c)` up to `curvature / 2` times the squared deviation.
    fn first_order(self, value: Interval, derivative: Interval, curvature: f64) -> Self {
        let (centre, factor) = (value.middle(), derivative.middle());
        let slope = self.slope.map(|a| factor * a);
        let deviation = self.deviation();
        let mut remainder = value.distance_from(centre);
        for term in [
            (factor.abs() * self.remainder).next_up(),
            (derivative.distance_from(factor) * deviation).next_up(),
            (0.5 * curvature * (deviation * deviation).next_up()).next_up(),
            slack(slope.iter().fold(0.0, |sum: f64, a| (sum + a.abs()).next_up())),
        ] {
            remainder = (remainder + term).next_up();
        }
        Self { centre, slope, remainder }.sound()
    }
}

impl<const N: usize> Zero for Affine<N> {
    fn zero() -> Self {
        Self { centre: 0.0, slope: [0.0; N], remainder: 0.0 }
    }

    fn is_zero(&self) -> bool {
        self.size() == 0.0 && self.remainder == 0.0
    }
}

impl<const N: usize> One for Affine<N> {
    fn one() -> Self {
        Self::from_f64(1.0)
    }
}

impl<const N: usize> Neg for Affine<N> {
    type Output = Self;

    fn neg(self) -> Self {
        Self { centre: -self.centre, slope: self.slope.map(|a| -a), remainder: self.remainder }
    }
}

impl<const N: usize> Add for Affine<N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let sum = Self {
            centre: self.centre + other.centre,
            slope: core::array::from_fn(|k| self.slope[k] + other.slope[k]),
            remainder: (self.remainder + other.remainder).next_up(),
        };
        // Each rounding error is below half an epsilon of its own sum.
        Self { remainder: (sum.remainder + slack(sum.size())).next_up(), ..sum }.sound()
    }
}

impl<const N: usize> Sub for Affine<N> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const N: usize> Mul for Affine<N> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let centre = self.centre * other.centre;
        let slope = core::array::from_fn(|k| self.centre * other.slope[k] + other.centre * self.slope[k]);
        let mut remainder = 0.0_f64;
        for term in [
            (self.centre.abs() * other.remainder).next_up(),
            (other.centre.abs() * self.remainder).next_up(),
            (self.deviation() * other.deviation()).next_up(),
            // The slopes' two products and their sum; sizes before cancellation.
            slack((self.size() * other.size()).next_up()),
        ] {
            remainder = (remainder + term).next_up();
        }
        Self { centre, slope, remainder }.sound()
    }
}

impl<const N: usize> Div for Affine<N> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        // 1/x: derivative -1/x^2, second derivative at most 2/|x|^3.
        let (range, centre) = (other.range(), Interval::from_f64(other.centre));
        if range.lower() <= 0.0 && range.upper() >= 0.0 {
            return self * Self::from_interval(Interval::new(f64::NEG_INFINITY, f64::INFINITY));
        }
        let least = range.abs();
        let curvature = Interval::from_f64(2.0) / (least * least * least);
        let value = Interval::one() / centre;
        self * other.first_order(value, -(value * value), curvature.upper())
    }
}

impl<const N: usize> AddAssign for Affine<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Affine<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> MulAssign for Affine<N> {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const N: usize> DivAssign for Affine<N> {
    fn div_assign(&mut self, other: Self) {
        *self = *self / other;
    }
}

impl<const N: usize> Real for Affine<N> {
    fn from_f64(x: f64) -> Self {
        Self { centre: x, ..Self::zero() }.sound()
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = Interval::from_f64(self.centre).sin_cos();
        (self.first_order(sin, cos, 1.0), self.first_order(cos, -sin, 1.0))
    }

    // The recursions for M and its derivatives use none of the following; an interval is enough.

    fn sqrt(self) -> Self {
        Self::from_interval(self.range().sqrt())
    }

    fn abs(self) -> Self {
        Self::from_interval(self.range().abs())
    }

    fn clamp_symmetric(self, limit: Self) -> Self {
        Self::from_interval(self.range().clamp_symmetric(limit.range()))
    }

    fn tanh(self) -> Self {
        Self::from_interval(self.range().tanh())
    }

    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        Self::from_interval(self.range().choose(bound.range(), then.range(), otherwise.range()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A formula with cancellation, in any scalar.
    fn formula<T: Real>(x: T, y: T) -> T {
        let ((sx, cx), (sy, cy)) = (x.sin_cos(), y.sin_cos());
        (sx * cy - cx * sy) * (cx + T::from_f64(0.3)) - sy / (T::from_f64(3.0) + cx) + x * y
    }

    proptest! {
        #[test]
        fn the_range_holds_every_value(x in -4.0..4.0_f64, y in -4.0..4.0_f64, w in 0.0..0.4_f64, s in 0.0..1.0_f64, t in 0.0..1.0_f64) {
            let of = |joint, start: f64| Affine::<2>::angle(joint, start, start + w);
            let range = formula(of(0, x), of(1, y)).range();
            // The reference is rounded; the set's ends need not hold its last bits.
            let value = formula(x + s * w, y + t * w);
            prop_assert!(range.lower() - 1e-12 <= value && value <= range.upper() + 1e-12);
        }

        #[test]
        fn the_excess_is_of_second_order(x in -3.0..3.0_f64, y in -3.0..3.0_f64) {
            let excess = |w: f64| {
                let of = |joint, start: f64| Affine::<2>::angle(joint, start - w, start + w);
                formula(of(0, x), of(1, y)).remainder
            };
            prop_assert!(excess(0.01) <= 0.012 * excess(0.1) + 1e-13 && excess(0.1) < 0.5);
        }
    }
}
