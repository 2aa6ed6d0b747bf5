//! A scalar that counts its operations.
//!
//! An addition, subtraction, multiplication, division or square root counts 1, a fused multiply-add 2; signs, sizes and choices are free. Sines, cosines and tangents
//! count what their series take. Counts are kept by thread.

use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use std::cell::Cell;

use num_traits::{One, Zero};

use crate::scalar::{Lanes, Real};
use crate::{hyperbolic, trig};

/// Operations by their kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// Additions and subtractions, those of fused multiply-adds included.
    pub additions: u64,
    /// Multiplications, those of fused multiply-adds included.
    pub multiplications: u64,
    /// Divisions and square roots.
    pub others: u64,
}

impl Operations {
    /// All together.
    pub const fn total(self) -> u64 {
        self.additions + self.multiplications + self.others
    }

    const fn plus(self, more: Self) -> Self {
        Self {
            additions: self.additions + more.additions,
            multiplications: self.multiplications + more.multiplications,
            others: self.others + more.others,
        }
    }
}

const ADDITION: Operations = Operations { additions: 1, multiplications: 0, others: 0 };
const MULTIPLICATION: Operations = Operations { additions: 0, multiplications: 1, others: 0 };
const OTHER: Operations = Operations { additions: 0, multiplications: 0, others: 1 };

thread_local! {
    static DONE: Cell<Operations> = const { Cell::new(Operations { additions: 0, multiplications: 0, others: 0 }) };
}

fn did(operations: Operations) {
    DONE.with(|done| done.set(done.get().plus(operations)));
}

/// Floating-point operations of `work` on this thread, as far as it runs on [`Counted`].
///
/// ```
/// use certune_linsys::{Counted, operations_by_kind};
///
/// let x = Counted(2.0);
/// let done = operations_by_kind(|| x * x + x);
/// assert_eq!((done.additions, done.multiplications, done.others), (1, 1, 0));
/// ```
pub fn operations_by_kind<R>(work: impl FnOnce() -> R) -> Operations {
    let before = DONE.with(Cell::get);
    std::hint::black_box(work());
    let after = DONE.with(Cell::get);
    Operations {
        additions: after.additions - before.additions,
        multiplications: after.multiplications - before.multiplications,
        others: after.others - before.others,
    }
}

/// [`operations_by_kind`], all together.
pub fn operations<R>(work: impl FnOnce() -> R) -> u64 {
    operations_by_kind(work).total()
}

/// A number whose operations are counted, see [`operations`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted(pub f64);

macro_rules! counted {
    ($($operator:ident $function:ident $assign:ident $assign_function:ident $kind:ident),*) => {$(
        impl $operator for Counted {
            type Output = Self;
            fn $function(self, other: Self) -> Self {
                did($kind);
                Self(self.0.$function(other.0))
            }
        }
        impl $assign for Counted {
            fn $assign_function(&mut self, other: Self) {
                *self = (*self).$function(other);
            }
        }
    )*};
}
counted!(
    Add add AddAssign add_assign ADDITION,
    Sub sub SubAssign sub_assign ADDITION,
    Mul mul MulAssign mul_assign MULTIPLICATION,
    Div div DivAssign div_assign OTHER
);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Zero for Counted {
    fn zero() -> Self {
        Self(0.0)
    }
    fn is_zero(&self) -> bool {
        self.0.is_zero()
    }
}

impl One for Counted {
    fn one() -> Self {
        Self(1.0)
    }
}

impl Real for Counted {
    fn from_f64(x: f64) -> Self {
        Self(x)
    }
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        did(ADDITION);
        did(MULTIPLICATION);
        Self(Real::mul_add(self.0, factor.0, addend.0))
    }
    fn sin_cos(self) -> (Self, Self) {
        trig::sin_cos(self)
    }
    fn sqrt(self) -> Self {
        did(OTHER);
        Self(self.0.sqrt())
    }
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    fn clamp_symmetric(self, limit: Self) -> Self {
        Self(self.0.clamp_symmetric(limit.0))
    }
    fn tanh(self) -> Self {
        hyperbolic::tanh(self)
    }
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        Self(self.0.choose(bound.0, then.0, otherwise.0))
    }
}

impl Lanes for Counted {
    const LANES: usize = 1;
    fn from_lanes(mut of: impl FnMut(usize) -> f64) -> Self {
        Self(of(0))
    }
    fn lane(&self, _: usize) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_count_and_decisions_are_free() {
        let (a, b) = (Counted(3.0), Counted(-2.0));
        assert_eq!(operations(|| a.mul_add(b, a)), 2);
        assert_eq!(operations(|| (-a).abs().choose(b, a.clamp_symmetric(b), b)), 0);
        assert_eq!(operations(|| (a / b - a).sqrt()), 3);
    }
}
