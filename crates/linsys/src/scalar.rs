//! The scalar of the recursions and the vectors that carry it.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use nalgebra::{SMatrix, SVector};
use num_traits::{Float, One, Zero};

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

impl Real for f64 {
    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        Float::sin_cos(self)
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
