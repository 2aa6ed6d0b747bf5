//! What the recursions compute with: `f64`, and a majorant that bounds what `f64` gets wrong.
//!
//! A recursion here is straight-line code over `+ - *`, generic in [`Scalar`]. Run over `f64` it gives a computed value; run once over
//! [`Majorant`], from bounds of its inputs, it gives for *every* input within those bounds
//!
//! | symbol | code | meaning |
//! |--------|------|---------|
//! | s | [`Majorant::size`] | `max(|x|, |x^|)`, x the exact and x^ the computed value |
//! | e | [`Majorant::error`] | bound of `|x^ - x|` |
//! | u | [`UNIT`] | unit roundoff of `f64`, 2^-53 |
//!
//! ```text
//! x + y:  s = s_x + s_y,   e = e_x + e_y + u s
//! x y:    s = s_x s_y,     e = s_x e_y + s_y e_x + u s + tiny
//! ```
//!
//! Proof. `|fl(x^ + y^) - (x + y)| <= e_x + e_y + u |x^ + y^|`; `|x^ y^ - x y| <= |x^| |y^ - y| + |y| |x^ - x|`, rounding adds
//! `u |x^ y^|`, or at most 2^-1075 when the product underflows. The sizes grow by `1 + u` and the majorants themselves are computed in
//! `f64` from numbers that are not negative, so both are low by a factor of at most `(1 + u)^k` after k operations in sequence;
//! [`Majorant::bound`] multiplies by 1.01, which covers k up to 10^13. Source: Higham, *Accuracy and Stability of Numerical
//! Algorithms* (2nd ed., 2002), ch. 3. Limits: round to nearest, no fused or extended operations: Rust guarantees both.

use std::ops::{Add, Mul, Neg, Sub};

/// Unit roundoff of `f64`.
pub(crate) const UNIT: f64 = f64::EPSILON / 2.0;

/// The larger of two upper bounds; infinite when one of them is not a number, which `f64::max` would drop.
#[inline]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) }
}

/// A number that the recursions can run over.
pub(crate) trait Scalar:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// 0, without error.
    fn zero() -> Self;
    /// 1, without error.
    fn one() -> Self;
    /// Half the number: without error in binary.
    fn half(self) -> Self;
}

impl Scalar for f64 {
    #[inline]
    fn zero() -> Self {
        0.0
    }
    #[inline]
    fn one() -> Self {
        1.0
    }
    #[inline]
    fn half(self) -> Self {
        0.5 * self
    }
}

/// Bounds of an intermediate result over all inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Majorant {
    size: f64,
    error: f64,
}

impl Majorant {
    /// An input that is `f64` number `x` (or smaller in size) and off by at most `error`.
    pub(crate) fn input(x: f64, error: f64) -> Self {
        Self { size: x.abs() + error, error }
    }

    /// Upper bound of `|x^ - x|`.
    pub(crate) fn bound(self) -> f64 {
        1.01 * self.error
    }

    /// Upper bound of `|x|` and `|x^|`.
    pub(crate) fn magnitude(self) -> f64 {
        1.01 * self.size
    }
}

impl Add for Majorant {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let size = self.size + other.size;
        Self { size, error: self.error + other.error + UNIT * size }
    }
}

impl Sub for Majorant {
    type Output = Self;
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the bounds of a difference are those of a sum")]
    fn sub(self, other: Self) -> Self {
        self + other
    }
}

impl Mul for Majorant {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let size = self.size * other.size;
        let error = self.size * other.error + other.size * self.error + UNIT * size + f64::MIN_POSITIVE;
        Self { size, error }
    }
}

impl Neg for Majorant {
    type Output = Self;
    fn neg(self) -> Self {
        self
    }
}

impl Scalar for Majorant {
    fn zero() -> Self {
        Self { size: 0.0, error: 0.0 }
    }
    fn one() -> Self {
        Self { size: 1.0, error: 0.0 }
    }
    fn half(self) -> Self {
        Self { size: 0.5 * self.size, error: 0.5 * self.error + f64::MIN_POSITIVE }
    }
}

/// Upper bound of the spectral norm of every matrix whose entries are at most those of `bounds`: its Frobenius norm.
pub(crate) fn frobenius<const N: usize>(bounds: &[[f64; N]; N]) -> f64 {
    1.01 * bounds.iter().flatten().map(|x| x * x).sum::<f64>().sqrt() + f64::MIN_POSITIVE.sqrt()
}
