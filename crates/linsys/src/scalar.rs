//! The scalar of the recursions and the vectors that carry it.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use nalgebra::{SMatrix, SVector};
use num_traits::{Float, One, Zero};

use crate::trig;

/// A real number as the recursions see it: the four operations, a square root, an angle's sine and cosine.
///
/// `f64` is the scalar of a single arm. A bundle of lanes, or a scalar that counts its operations, implements the same
/// few functions and runs the same source: comparisons are therefore absent, and [`Real::clamp_symmetric`], [`Real::abs`] and [`Real::choose`] stand
/// for the only decisions a control loop takes.
pub trait Real:
    nalgebra::Scalar
    + Copy
    + Debug
    + Zero
    + One
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Send
    + Sync
{
    /// The number nearest to `x`, the same in every lane.
    fn from_f64(x: f64) -> Self;
    /// `self factor + addend`, in one rounding where the machine has an instruction for it.
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }
    /// `(sin x, cos x)`, x in rad.
    fn sin_cos(self) -> (Self, Self);
    /// The square root of a non-negative number.
    fn sqrt(self) -> Self;
    /// The absolute value.
    fn abs(self) -> Self;
    /// `self` moved into `[-limit, limit]`; NaN stays NaN.
    fn clamp_symmetric(self, limit: Self) -> Self;
    /// The hyperbolic tangent.
    fn tanh(self) -> Self;
    /// `then` where `self <= bound`, `otherwise` elsewhere; NaN on either side of the comparison gives `otherwise`.
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self;
}

/// Numbers side by side that are computed together, each as if it were alone.
pub trait Lanes: Real {
    /// How many.
    const LANES: usize;
    /// The numbers `of(0), of(1), ..`.
    fn from_lanes(of: impl FnMut(usize) -> f64) -> Self;
    /// The number in a lane, `lane < LANES`.
    fn lane(&self, lane: usize) -> f64;
}

impl Lanes for f64 {
    const LANES: usize = 1;
    #[inline(always)]
    fn from_lanes(mut of: impl FnMut(usize) -> f64) -> Self {
        of(0)
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
}

impl Real for f64 {
    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        if Float::abs(self) <= trig::LIMIT_RAD { trig::sin_cos(self) } else { Float::sin_cos(self) }
    }
    #[inline]
    fn sqrt(self) -> Self {
        Float::sqrt(self)
    }
    #[inline]
    fn abs(self) -> Self {
        Float::abs(self)
    }
    #[inline]
    fn clamp_symmetric(self, limit: Self) -> Self {
        if self > limit {
            limit
        } else if self < -limit {
            -limit
        } else {
            self
        }
    }
    #[inline]
    fn tanh(self) -> Self {
        Float::tanh(self)
    }
    #[inline]
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        if self <= bound { then } else { otherwise }
    }
}

/// One number per joint, base to tip: positions in rad, velocities in rad/s, torques in N m.
pub type Joints<const N: usize, T = f64> = SVector<T, N>;

/// An N x N matrix over the joints, such as the joint-space inertia in kg m^2.
pub type JointMatrix<const N: usize, T = f64> = SMatrix<T, N, N>;
