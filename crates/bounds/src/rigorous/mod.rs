//! Constants of a box of arms that are proved: by corners of polygons, and by equispaced angles.
//!
//! | bound | how | over |
//! |-------|-----|------|
//! | m_hi, `M <= m_hi I` | convexity in each `(cos q_j, sin q_j)`: corners of circumscribed polygons (module `inertia`) | all angles or a box |
//! | D_h, `M <= diag(D_h)` | the same with fixed weights w: `D_h = t w` | same |
//! | k_g, `|dg/dq| <= k_g`; largest `|g_i|` | affine in each pair: corners (module `gravity`) | same |
//! | k_c | degree 2 in each angle: equispaced angles, Ehlich-Zeller (module `coriolis`) | all angles |
//!
//! # Masses
//! M is affine in the masses and increases with each (every link's share is positive semidefinite), so m_hi and D_h are those of the arm
//! with every mass, the payload and the rotor inertia at its upper end. dg/dq and dM/dq_j are affine in the masses, so k_g, k_c and the
//! torques are convex in them. With link masses `s_i = 1 + d_i`, `|d_i| <= x`, and the payload p in an interval,
//!
//! ```text
//! k(s, p) <= max(k(1, p_lo), k(1, p_hi)) + x sum_i k_i,      k_i the bound of link i alone
//! ```
//!
//! Rotor inertia is added to the diagonal of M and enters nothing else.
//!
//! # Rounding
//! All numbers come from `f64` operations rounded to nearest, without library functions. Three things make them bounds:
//! 1. the corners span polygons that provably contain the circle or arc (module `angle`); the equispaced angles are known to 2^-42;
//! 2. one run of each recursion over majorants (module `scalar`) bounds what any entry at any corner can be off by, the roundings of the
//!    arm's own numbers included (module `chain`);
//! 3. `t diag(w) - M >= 0` is decided by a Cholesky factorisation of the computed matrix less a shift that covers both the entries'
//!    errors and those of the factorisation (module `definite`).
//!
//! Eigenvalues from Jacobi rotations only suggest the next t to try.
//!
//! The bounds depend on the [`PolygonPlan`] alone: with the same plan they come out the same to the bit, for any number of threads.

mod angle;
mod chain;
mod coriolis;
mod definite;
mod gravity;
mod inertia;
mod plan;
mod scalar;
mod sweep;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use crate::arm_box::ArmBox;
use crate::error::BoundsError;
use crate::rigorous::angle::{Points, Span, nodes};
use crate::rigorous::chain::Chain;
use crate::rigorous::coriolis::CoriolisSweep;
use crate::rigorous::gravity::{GravitySweep, Wanted, first_joint};
use crate::rigorous::inertia::InertiaSweep;
use crate::rigorous::scalar::UNIT;
pub(crate) use crate::rigorous::scalar::larger;
use crate::rigorous::sweep::{Progress, maxima};

pub use plan::{Effort, PolygonPlan};

/// The configurations that bounds are wanted for.
#[derive(Clone, Debug, PartialEq)]
pub enum AngleSet<const N: usize> {
    /// Every angle of every joint.
    AllAngles,
    /// Joint i between `lower_rad[i]` and `upper_rad[i]`; an infinite end, or an interval of nearly a turn, means every angle.
    Box {
        /// Lower ends, rad.
        lower_rad: [f64; N],
        /// Upper ends, rad.
        upper_rad: [f64; N],
    },
}

impl<const N: usize> AngleSet<N> {
    pub(crate) fn spans(&self) -> Result<[Span; N], BoundsError> {
        let mut spans = [Span::Circle; N];
        if let Self::Box { lower_rad, upper_rad } = self {
            for j in 0..N {
                spans[j] = Span::between(j, lower_rad[j], upper_rad[j])?;
            }
        }
        Ok(spans)
    }
}

/// Proved upper bounds of a box of arms, and the plan that gives them again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolygonBounds {
    /// `M <= m_hi I`, kg m².
    pub m_hi_kg_m2: f64,
    /// `|dg/dq| <= k_g`, N m/rad.
    pub k_g_n_m_per_rad: f64,
    /// `1/2 |v'(d_y M) v| <= k_c |y| |v|²`, kg m²; over all angles, whatever the set.
    pub k_c_kg_m2: f64,
    /// Largest gravity torque of each joint, N m.
    pub gravity_torque_n_m: Vec<f64>,
    /// `M <= diag(..)`, kg m².
    pub diagonal_upper_kg_m2: Vec<f64>,
    /// How: corners, grids and weights.
    pub plan: PolygonPlan,
    /// What rounding cost: added to m_hi, k_g and k_c, in their units.
    pub rounding: [f64; 3],
}

/// Proved bounds of every arm of `arms` over `set`.
///
/// `progress` hears the share that is done, from any thread. Deterministic; runs on the current rayon pool.
///
/// # Errors
/// A body that cannot exist, an interval of angles that is none, angles beyond 15 rad.
pub fn polygon_bounds<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    effort: Effort,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<PolygonBounds, BoundsError> {
    let plan = PolygonPlan::new(arms, set, effort)?;
    polygon_bounds_with(arms, set, &plan, progress)
}

/// [`polygon_bounds`] with a plan from before: the same numbers again, to the bit.
///
/// # Errors
/// As [`polygon_bounds`]; a plan that is not for `N` joints, or with fewer corners than make a polygon.
pub fn polygon_bounds_with<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    plan: &PolygonPlan,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<PolygonBounds, BoundsError> {
    plan.check(N)?;
    let spans = set.spans()?;
    let all = Progress { report: progress, from: 0.0, to: 1.0 };
    let inertia = inertia_bounds(arms, &spans, plan, all.part(0.0, 0.35))?;
    let gravity = gravity_bounds(arms, &spans, plan, all.part(0.35, 0.55))?;
    let coriolis = coriolis_bound(arms, plan, all.part(0.55, 1.0))?;
    progress(1.0);
    Ok(PolygonBounds {
        m_hi_kg_m2: inertia.m_hi,
        k_g_n_m_per_rad: gravity.stiffness,
        k_c_kg_m2: coriolis.0,
        gravity_torque_n_m: gravity.torque,
        diagonal_upper_kg_m2: inertia.diagonal,
        plan: plan.clone(),
        rounding: [inertia.rounding, gravity.rounding, coriolis.1],
    })
}

/// One rounding up, and a few to spare.
fn up(x: f64) -> f64 {
    x * (1.0 + 8.0 * UNIT)
}

fn polygons<const N: usize>(spans: &[Span; N], pieces: &[usize]) -> Result<Vec<Points>, BoundsError> {
    spans.iter().zip(pieces).map(|(span, pieces)| span.corners(*pieces)).collect()
}

fn outer_corners(points: &[Points], first: usize) -> Vec<Vec<[f64; 2]>> {
    points.iter().skip(first).map(|points| points.at.clone()).collect()
}

struct InertiaBounds {
    m_hi: f64,
    diagonal: Vec<f64>,
    rounding: f64,
}

fn inertia_bounds<const N: usize>(
    arms: &ArmBox<N>,
    spans: &[Span; N],
    plan: &PolygonPlan,
    progress: Progress,
) -> Result<InertiaBounds, BoundsError> {
    let chain = Chain::new(&arms.upper_model());
    let [_, rotor] = arms.rotor_inertia_kg_m2();
    let rotor: [f64; N] = std::array::from_fn(|j| rotor[j]);
    let mut weights = [1.0; N];
    for (weight, given) in weights.iter_mut().zip(&plan.diagonal_weights) {
        *weight = *given;
    }
    if N == 1 {
        let chain = chain.physical()?;
        let inertia = chain.second_moments(0);
        let bounds = chain.majorant().second_moments(0);
        let rounding = (bounds[0][0] + bounds[1][1]).bound() + rotor[0] / (1_u64 << 48) as f64;
        let m_hi = up(inertia[0][0] + inertia[1][1] + rotor[0] + rounding);
        return Ok(InertiaBounds { m_hi, diagonal: vec![m_hi], rounding });
    }
    let least = |weights: [f64; N], pieces: &[usize], progress: Progress| {
        let corners = polygons(spans, pieces)?;
        let sweep = InertiaSweep::new(&chain, rotor, weights, &corners)?;
        let found = maxima(&sweep, 2, &outer_corners(&corners, 2), progress);
        Ok::<_, BoundsError>((found[0], sweep.allowance()))
    };
    let (m_hi, rounding) = least([1.0; N], &plan.inertia_pieces, progress.part(0.0, 0.5))?;
    let (multiple, _) = least(weights, &plan.diagonal_pieces, progress.part(0.5, 1.0))?;
    Ok(InertiaBounds { m_hi: up(m_hi), diagonal: weights.iter().map(|w| up(w * multiple)).collect(), rounding })
}

struct GravityBounds {
    stiffness: f64,
    torque: Vec<f64>,
    rounding: f64,
}

fn gravity_bounds<const N: usize>(
    arms: &ArmBox<N>,
    spans: &[Span; N],
    plan: &PolygonPlan,
    progress: Progress,
) -> Result<GravityBounds, BoundsError> {
    let mut total = GravityBounds { stiffness: 0.0, torque: vec![0.0; N], rounding: 0.0 };
    let one = |chain: &Chain<N, f64>, wanted: Wanted, pieces: &[usize], moving: usize, progress: Progress| {
        let first = first_joint(chain);
        if first >= N {
            return Ok((vec![0.0; N + 1], 0.0));
        }
        let points = polygons(spans, pieces)?;
        let sweep = GravitySweep::new(chain, spans, &points, wanted);
        let mut corners = outer_corners(&points, first + 1);
        // Joints beyond the only body turn nothing.
        for list in corners.iter_mut().skip(moving.saturating_sub(first)) {
            list.truncate(1);
        }
        Ok::<_, BoundsError>((maxima(&sweep, first + 1, &corners, progress), sweep.allowance()))
    };
    // Stiffness, then torques, and what rounding cost the stiffness.
    let both = |chain: &Chain<N, f64>, pieces: &[usize], moving: usize, progress: Progress| {
        let (mut found, rounding) = one(chain, Wanted::Stiffness, pieces, moving, progress.part(0.0, 0.5))?;
        let (torques, _) = one(chain, Wanted::Torque, &plan.torque_pieces, moving, progress.part(0.5, 1.0))?;
        found[1..].copy_from_slice(&torques[1..]);
        Ok::<_, BoundsError>((found, rounding))
    };
    let nominal = arms.nominal_models();
    for (k, model) in nominal.iter().enumerate() {
        let share = 0.7 / nominal.len() as f64;
        let part = progress.part(k as f64 * share, (k + 1) as f64 * share);
        let (found, rounding) = both(&Chain::new(model), &plan.gravity_pieces, N, part)?;
        total.stiffness = larger(total.stiffness, found[0]);
        for (torque, found) in total.torque.iter_mut().zip(&found[1..]) {
            *torque = larger(*torque, *found);
        }
        total.rounding = total.rounding.max(rounding);
    }
    for (link, (group, uncertainty)) in arms.uncertain_links().enumerate() {
        if uncertainty <= 0.0 {
            continue;
        }
        let part = progress.part(0.7 + 0.3 * link as f64 / N as f64, 0.7 + 0.3 * (link + 1) as f64 / N as f64);
        let (found, rounding) = both(&Chain::new(&group.model), &plan.gravity_part_pieces, link, part)?;
        total.stiffness = up(total.stiffness + up(uncertainty * found[0]));
        for (torque, found) in total.torque.iter_mut().zip(&found[1..]) {
            *torque = up(*torque + up(uncertainty * found));
        }
        total.rounding += uncertainty * rounding;
    }
    Ok(total)
}

fn coriolis_bound<const N: usize>(
    arms: &ArmBox<N>,
    plan: &PolygonPlan,
    progress: Progress,
) -> Result<(f64, f64), BoundsError> {
    if N < 2 {
        return Ok((0.0, 0.0));
    }
    let one = |chain: &Chain<N, f64>, whole: &Chain<N, f64>, counts: &[usize], progress: Progress| {
        let grid = counts.iter().map(|count| nodes(*count)).collect::<Result<Vec<_>, _>>()?;
        let sweep = CoriolisSweep::new(chain, whole, &grid);
        let found = maxima(&sweep, 2, &outer_corners(&grid, 2), progress);
        Ok::<_, BoundsError>((sweep.bound(found[0]), sweep.allowance()))
    };
    // Joints beyond `moving` turn nothing: one angle stands for all.
    let counts = |grid: &[usize], moving: usize| -> Vec<usize> {
        grid.iter().enumerate().map(|(j, count)| if j == 0 || j > moving { 1 } else { *count }).collect()
    };
    let whole = |chain: &Chain<N, f64>, progress: Progress| {
        if N == 2 {
            return one(chain, chain, &counts(&plan.coriolis_grid, 1), progress);
        }
        let [mean, rest] = chain.split_tip();
        let body = one(&mean, chain, &counts(&plan.coriolis_grid, N - 2), progress.part(0.0, 0.8))?;
        let tool = one(&rest, chain, &counts(&plan.coriolis_part_grid, N - 1), progress.part(0.8, 1.0))?;
        Ok((up(body.0 + tool.0), body.1 + tool.1))
    };
    let (mut total, mut rounding) = (0.0_f64, 0.0_f64);
    let nominal = arms.nominal_models();
    for (k, model) in nominal.iter().enumerate() {
        let share = 0.8 / nominal.len() as f64;
        let found = whole(&Chain::new(model), progress.part(k as f64 * share, (k + 1) as f64 * share))?;
        total = larger(total, found.0);
        rounding = rounding.max(found.1);
    }
    for (link, (group, uncertainty)) in arms.uncertain_links().enumerate() {
        // Link 0 turns about one fixed axis: its inertia is constant.
        if uncertainty <= 0.0 || link == 0 {
            continue;
        }
        let share = progress.part(0.8 + 0.2 * link as f64 / N as f64, 0.8 + 0.2 * (link + 1) as f64 / N as f64);
        let chain = Chain::new(&group.model);
        let found = if link + 1 == N && N > 2 {
            let [mean, rest] = chain.split_tip();
            let body = one(&mean, &chain, &counts(&plan.coriolis_part_grid, N - 2), share.part(0.0, 0.5))?;
            let tool = one(&rest, &chain, &counts(&plan.coriolis_part_grid, N - 1), share.part(0.5, 1.0))?;
            (body.0 + tool.0, body.1 + tool.1)
        } else {
            one(&chain, &chain, &counts(&plan.coriolis_part_grid, link), share)?
        };
        total = up(total + up(uncertainty * up(found.0)));
        rounding += uncertainty * found.1;
    }
    Ok((total, rounding))
}
