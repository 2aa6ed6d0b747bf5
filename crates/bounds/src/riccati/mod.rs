//! Proved lower bounds of the inertia and proved Coriolis constants relative to it, by branch and bound over the angles.
//!
//! For every arm of an [`ArmBox`] and every configuration of an [`AngleSet`]:
//!
//! ```text
//! M(q) >= m_lo I,   M(q) >= diag(D)
//! ½ |v' (d_y M) v| <= k_j |v|_M²          for y the j-th unit vector, |x|_M² = x'M x
//! ½ |v' (d_y M) v| <= k_r |y| |v|_M²      k_r² = sum_j k_j²
//! ½ |v' (d_y M) v| <= k_m |y|_M |v|_M²    k_m² = sum_j k_j² / E_j  with  M >= diag(E), proved likewise
//! ```
//!
//! The last two are Cauchy's inequality: `|sum_j y_j x_j| <= sum_j |y_j| k_j |v|_M²`, and `sum_j E_j y_j² <= |y|_M²`. Nothing depends on the
//! first joint, so `k_1 = 0` and `E_1` may be 0. For the Panda the true k_r is 0.85 times the root of the sum of the true k_j².
//!
//! # The proof, and where it is
//! | step | where |
//! |------|-------|
//! | positive definite over a box of angles and all masses <= a recursion of 6x6 Loewner bounds, one angle at a time | `forms.rs` |
//! | a matrix below a form over an arc: five control matrices, no remainder | `turn.rs` |
//! | which arm is meant; velocities a link can have at all | `chain.rs` |
//! | every set of angles is covered by the parts of its intervals | `angle.rs`, `cover.rs` |
//! | rounding: matrices with a rigorous radius; definiteness by Cholesky with the a-priori error bound | `ball.rs` |
//! | candidates, from sampling; nothing rests on them | `guess.rs` |
//!
//! A plan ([`RiccatiPlan`]) lists the numbers claimed; [`riccati_bounds_with`] proves them again and gives the same result to the bit for
//! any number of threads, since the tree of boxes depends on the arm, the set and the plan alone.
//!
//! Limits: at least the least masses of the box must make M positive definite; link masses that are uncertain by a share x cost up to
//! `sqrt((1+x)/(1-x))` in k (see `forms.rs`); the proof takes 10 to 100 microseconds times the boxes, whose number grows steeply
//! as a candidate nears the truth.

mod angle;
mod ball;
mod chain;
mod cover;
mod forms;
mod guess;
mod plan;
#[cfg(test)]
mod tests;
mod turn;

use serde::{Deserialize, Serialize};

pub use plan::RiccatiPlan;
use plan::{Ladder, Proving, intervals};

use crate::arm_box::ArmBox;
use crate::error::BoundsError;
use crate::rigorous::{AngleSet, Effort};

/// Proved bounds, and the plan that gives them again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RiccatiBounds {
    /// `M >= m_lo I`, kg m².
    pub m_lo_kg_m2: f64,
    /// `M >= diag(..)`, kg m².
    pub diagonal_lower_kg_m2: Vec<f64>,
    /// `½ |v'(∂M/∂q_j)v| <= k_j v'Mv` of each joint, per rad; empty when it was not proved for every joint.
    pub k_joint: Vec<f64>,
    /// `½ |v'(d_y M)v| <= k_r |y| v'Mv`, per rad, when every k_j was proved.
    pub k_r: Option<f64>,
    /// `½ |v'(d_y M)v| <= k_m |y|_M |v|_M²`, 1/sqrt(kg m²), likewise.
    pub k_m: Option<f64>,
    /// What was proved: the numbers above follow from it.
    pub plan: RiccatiPlan,
    /// How large each proof was.
    pub covers: Vec<CoverSize>,
}

/// One inequality that was proved over the whole set, and the size of its proof.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoverSize {
    /// The inequality.
    pub inequality: Inequality,
    /// Which end of the payload's mass: 0 the least, 1 the greatest.
    pub payload_end: usize,
    /// Boxes of angles tested.
    pub boxes: u64,
    /// Most cuts of one angle's interval: the smallest box is `2^-cuts` of it.
    pub cuts: u32,
}

/// An inequality over a set of configurations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Inequality {
    /// `M >= diag(kg_m2)`.
    Inertia {
        /// The diagonal, kg m².
        kg_m2: Vec<f64>,
    },
    /// `½ |v'(∂M/∂q_joint)v| <= k v'Mv`.
    Coriolis {
        /// Joint, counted from 1 at the base.
        joint: usize,
        /// k, per rad.
        k: f64,
    },
}

/// Proved bounds of every arm of `arms` over `set`.
///
/// Candidates are taken from a sample and tightened until a proof would take more boxes than `effort` allows. `progress` hears the
/// share that is done, from any thread; it starts afresh with every candidate. Deterministic; runs on the current rayon pool.
/// Cost for seven joints: seconds for a box of some tenths of a radian, up to two minutes of a core for all angles (`Quick`), ten times that
/// (`Standard`), a hundred times (`Thorough`).
///
/// # Errors
/// An interval of angles that is none; [`BoundsError::NotProved`] when even a thirtieth of the sampled m_lo fails; a k that fails is left out instead.
pub fn riccati_bounds<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    effort: Effort,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<RiccatiBounds, BoundsError> {
    Proving::new(arms, &intervals(set)?, progress).search(Ladder::of(effort))
}

/// The bounds of a plan, proved again: the same numbers to the bit.
///
/// # Errors
/// An interval of angles that is none; a plan for another number of joints; [`BoundsError::NotProved`] where the plan claims what cannot be shown.
pub fn riccati_bounds_with<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    plan: &RiccatiPlan,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<RiccatiBounds, BoundsError> {
    Proving::new(arms, &intervals(set)?, progress).follow(plan)
}
