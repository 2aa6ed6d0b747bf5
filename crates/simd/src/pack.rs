//! A register as a scalar.
//!
//! The operators of [`Real`] have no room for pulp's token, the value whose existence proves that the machine has the instructions. A token has no
//! size and no content, so [`token`] makes one. That is sound because a `Pack<S>` is only ever met inside a kernel that
//! runs on S: the type is private to this crate, no safe function outside [`crate::InstructionSet::run`] names it, and that one holds a true token.
#![expect(unsafe_code, reason = "one line, argued above")]

use core::fmt::{Debug, Formatter};
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use certune_linsys::{Lanes, Real, hyperbolic, trig};
use num_traits::{Float, One, Zero};
use pulp::{Simd, bytemuck};

/// More lanes than any register has.
const MOST_LANES: usize = 16;

/// The numbers of one register.
#[derive(Clone, Copy)]
pub(crate) struct Pack<S: Simd>(S::f64s);

#[inline(always)]
fn token<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0, "a token is empty") };
    // SAFETY: S has no bytes to be invalid, and the instructions that it stands for are there, see the module's text.
    unsafe { core::mem::zeroed() }
}

impl<S: Simd> Pack<S> {
    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        bytemuck::cast_slice(core::slice::from_ref(&self.0))
    }
}

impl<S: Simd> Debug for Pack<S> {
    fn fmt(&self, f: &mut Formatter<'_>) -> core::fmt::Result {
        self.numbers().fmt(f)
    }
}

impl<S: Simd> PartialEq for Pack<S> {
    fn eq(&self, other: &Self) -> bool {
        self.numbers() == other.numbers()
    }
}

macro_rules! operators {
    ($($operator:ident $function:ident $assign:ident $assign_function:ident $simd:ident),*) => {$(
        impl<S: Simd> $operator for Pack<S> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(token::<S>().$simd(self.0, other.0))
            }
        }
        impl<S: Simd> $assign for Pack<S> {
            #[inline(always)]
            fn $assign_function(&mut self, other: Self) {
                *self = Self(token::<S>().$simd(self.0, other.0));
            }
        }
    )*};
}
operators!(
    Add add AddAssign add_assign add_f64s,
    Sub sub SubAssign sub_assign sub_f64s,
    Mul mul MulAssign mul_assign mul_f64s,
    Div div DivAssign div_assign div_f64s
);

impl<S: Simd> Neg for Pack<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(token::<S>().neg_f64s(self.0))
    }
}

impl<S: Simd> Zero for Pack<S> {
    #[inline(always)]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }
    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.numbers().iter().all(Zero::is_zero)
    }
}

impl<S: Simd> One for Pack<S> {
    #[inline(always)]
    fn one() -> Self {
        Self::from_f64(1.0)
    }
}

impl<S: Simd> Real for Pack<S> {
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self(token::<S>().splat_f64s(x))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(token::<S>().mul_add_f64s(self.0, factor.0, addend.0))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = trig::sin_cos(self);
        let limit = Self::from_f64(trig::LIMIT_RAD);
        // A lane that the fast way does not serve goes alone.
        if self.abs().choose(limit, Self::zero(), Self::one()).is_zero() {
            return (sine, cosine);
        }
        let alone = |fast: Self, way: fn(f64) -> f64| {
            let lane = |lane: usize| {
                let x = self.lane(lane);
                if Float::abs(x) <= trig::LIMIT_RAD { fast.lane(lane) } else { way(x) }
            };
            Self::from_lanes(lane)
        };
        (alone(sine, Float::sin), alone(cosine, Float::cos))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(token::<S>().sqrt_f64s(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(token::<S>().abs_f64s(self.0))
    }
    #[inline(always)]
    fn clamp_symmetric(self, limit: Self) -> Self {
        let below = limit.choose(self, limit, self);
        below.choose(-limit, -limit, below)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        hyperbolic::tanh(self)
    }
    #[inline(always)]
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let simd = token::<S>();
        Self(simd.select_f64s(simd.less_than_or_equal_f64s(self.0, bound.0), then.0, otherwise.0))
    }
}

impl<S: Simd> Lanes for Pack<S> {
    const LANES: usize = S::F64_LANES;
    #[inline(always)]
    fn from_lanes(mut of: impl FnMut(usize) -> f64) -> Self {
        let mut numbers = [0.0; MOST_LANES];
        for (lane, number) in numbers.iter_mut().enumerate().take(S::F64_LANES) {
            *number = of(lane);
        }
        Self(token::<S>().partial_load_f64s(&numbers[..S::F64_LANES]))
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.numbers()[lane]
    }
}
