//! Several `f64` side by side in the registers of the machine at hand, as one scalar of the recursions.
//!
//! A computation that is generic in [`Lanes`] is a [`Kernel`]; [`run`] runs it on the widest instruction set of the machine, found at run time, so that one
//! binary serves all.
//!
//! | instruction set | lanes | `mul_add` |
//! |---|---|---|
//! | AVX-512 | 8 | one rounding |
//! | AVX2 with FMA | 4 | one rounding |
//! | NEON | 2 | one rounding |
//! | plain | 1 | two roundings |
//!
//! On one instruction set the result of a lane does not depend on what the others hold, nor on which lane it is. Between
//! instruction sets with and without a fused `mul_add` results differ by rounding.
//!
//! ```
//! use certune_simd::{Kernel, Lanes, run};
//!
//! /// The sum of squares of up to eight numbers.
//! struct Squares<'a>(&'a [f64]);
//!
//! impl Kernel for Squares<'_> {
//!     type Output = f64;
//!     #[inline(always)]
//!     fn run<T: Lanes>(self) -> f64 {
//!         let chunks = self.0.chunks(T::LANES).map(|chunk| T::from_lanes(|lane| chunk.get(lane).copied().unwrap_or(0.0)));
//!         let squares = chunks.fold(T::zero(), |sum, x| x.mul_add(x, sum));
//!         (0..T::LANES).map(|lane| squares.lane(lane)).sum()
//!     }
//! }
//!
//! assert_eq!(run(Squares(&[1.0, 2.0, 3.0])), 14.0);
//! ```
//!
//! Everything that a kernel calls on its way must be inlined into it (`#[inline(always)]`), or its instructions are those of the plain set; the
//! results are the same either way.
//!
//! `unsafe` is allowed in `pack.rs` alone, for one line that is argued there.

mod pack;

use std::sync::LazyLock;

pub use certune_linsys::{Lanes, Real};
use pulp::{Simd, WithSimd};

use pack::Pack;

/// A computation that is generic in how many numbers it works on at once.
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Does it, `T::LANES` at a time. Mark it `#[inline(always)]`.
    fn run<T: Lanes>(self) -> Self::Output;
}

/// The instructions that a kernel runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// 8 lanes.
    Avx512,
    /// 4 lanes, with fused multiply-add.
    Avx2,
    /// 2 lanes, with fused multiply-add.
    Neon,
    /// What every machine of the architecture has: 1 lane.
    Plain,
}

impl InstructionSet {
    /// Those of this machine, the widest first; never empty.
    pub fn available() -> Vec<Self> {
        let mut found = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if pulp::x86::V4::try_new().is_some() {
                found.push(Self::Avx512);
            }
            if pulp::x86::V3::try_new().is_some() {
                found.push(Self::Avx2);
            }
        }
        #[cfg(target_arch = "aarch64")]
        if pulp::aarch64::Neon::try_new().is_some() {
            found.push(Self::Neon);
        }
        found.push(Self::Plain);
        found
    }

    /// The widest of this machine.
    pub fn widest() -> Self {
        static WIDEST: LazyLock<InstructionSet> = LazyLock::new(|| InstructionSet::available()[0]);
        *WIDEST
    }

    /// Numbers side by side.
    pub const fn lanes(self) -> usize {
        match self {
            Self::Avx512 => 8,
            Self::Avx2 => 4,
            Self::Neon => 2,
            Self::Plain => 1,
        }
    }

    /// Runs `kernel` on this set; on the plain one if the machine lacks it.
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => match pulp::x86::V4::try_new() {
                Some(simd) => Simd::vectorize(simd, OnLanes(kernel)),
                None => kernel.run::<f64>(),
            },
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => match pulp::x86::V3::try_new() {
                Some(simd) => Simd::vectorize(simd, OnLanes(kernel)),
                None => kernel.run::<f64>(),
            },
            #[cfg(target_arch = "aarch64")]
            Self::Neon => match pulp::aarch64::Neon::try_new() {
                Some(simd) => Simd::vectorize(simd, OnLanes(kernel)),
                None => kernel.run::<f64>(),
            },
            _ => kernel.run::<f64>(),
        }
    }
}

/// Runs `kernel` on the widest instruction set of this machine.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    InstructionSet::widest().run(kernel)
}

/// A kernel as pulp runs it.
struct OnLanes<K>(K);

impl<K: Kernel> WithSimd for OnLanes<K> {
    type Output = K::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run::<Pack<S>>()
    }
}
