//! How many corners and angles each joint gets, and the weights of the diagonal bound.
//!
//! A polygon of half angle h loses about `w_j h_j^2 / 2`, `w_j` what the bound gains per unit of the radius of joint j at its maximum; with a given
//! number of corners altogether the loss is least when all `w_j h_j^2` are equal. Weights and maxima come from a sample: they decide how tight a
//! bound is, never whether it holds.
//!
//! The weights of `M <= t diag(w)` make the product of the diagonal small: at each step the w of the joints that carry the worst
//! direction grow, by a subgradient of `log t + mean log w`.

use std::f64::consts::{PI, TAU};

use certune_linsys::JointMatrix;
use serde::{Deserialize, Serialize};

use crate::arm_box::ArmBox;
use crate::eigen::symmetric_eigen;
use crate::error::BoundsError;
use crate::rigorous::AngleSet;
use crate::rigorous::angle::Span;
use crate::rigorous::chain::Chain;
use crate::rigorous::gravity::{first_joint, stiffness_at, torque_at};
use crate::rigorous::inertia::inertia_at;
use crate::sequence::Kronecker;

/// Configurations sampled for a plan.
const SAMPLES: usize = 2_000;
/// Matrices kept for the weights of the diagonal bound.
const KEPT: usize = 300;
/// Steps towards those weights.
const STEPS: u32 = 400;
/// Most pieces of one polygon.
const MOST_PIECES: usize = 96;

/// How much time is spent on tightness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Seconds; for a first look and for tests.
    Quick,
    /// A minute or two for seven joints.
    Standard,
    /// Several minutes; for records that are kept.
    Thorough,
}

impl Effort {
    /// Corners of all joints but the innermost, times the same for the angles of k_c.
    fn budgets(self) -> Budgets {
        match self {
            Self::Quick => Budgets { inertia: 4e4, gravity: 4e4, part: 2e3, torque: 4e4, grid: 6e4, part_grid: 1e5 },
            Self::Standard => Budgets { inertia: 3e6, gravity: 6e6, part: 2e5, torque: 6e6, grid: 3e6, part_grid: 5e5 },
            Self::Thorough => Budgets { inertia: 1e7, gravity: 2e7, part: 2e6, torque: 2e7, grid: 1e7, part_grid: 4e6 },
        }
    }
}

struct Budgets {
    inertia: f64,
    gravity: f64,
    part: f64,
    torque: f64,
    grid: f64,
    part_grid: f64,
}

/// Corners, grids and weights: with them the bounds can be derived again. Entries are per joint, base to tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolygonPlan {
    /// Pieces of each joint's polygon for m_hi; nothing depends on the first joint.
    pub inertia_pieces: Vec<usize>,
    /// The diagonal bound is the smallest proved multiple of these.
    pub diagonal_weights: Vec<f64>,
    /// Pieces for the diagonal bound.
    pub diagonal_pieces: Vec<usize>,
    /// Pieces for k_g.
    pub gravity_pieces: Vec<usize>,
    /// The same for single links, where masses are uncertain.
    pub gravity_part_pieces: Vec<usize>,
    /// Pieces for the gravity torques, of the whole arm and of single links.
    pub torque_pieces: Vec<usize>,
    /// Equispaced angles for k_c.
    pub coriolis_grid: Vec<usize>,
    /// The same for single links, and for what the last link lacks of its mean about its own joint.
    pub coriolis_part_grid: Vec<usize>,
}

impl PolygonPlan {
    /// A plan for these arms.
    ///
    /// # Errors
    /// As [`crate::rigorous::polygon_bounds`].
    pub fn new<const N: usize>(arms: &ArmBox<N>, set: &AngleSet<N>, effort: Effort) -> Result<Self, BoundsError> {
        let spans = set.spans()?;
        let budgets = effort.budgets();
        let chain = Chain::new(&arms.upper_model());
        let [_, rotor] = arms.rotor_inertia_kg_m2();
        let inertia = |corners: &[[f64; 2]; N]| {
            let mut m = JointMatrix::<N>::from_fn(|a, b| inertia_at(&chain, corners)[a][b]);
            for j in 0..N {
                m[(j, j)] += rotor[j];
            }
            m
        };
        let stiffness = |corners: &[[f64; 2]; N]| {
            let g = stiffness_at(&chain, corners);
            JointMatrix::<N>::from_fn(|a, b| g[a][b])
        };
        let samples = sample(&spans);
        let largest = |m: &JointMatrix<N>| symmetric_eigen(m).largest().0;
        let inertia_weights = sensitivities(&samples, |at| largest(&inertia(at)));
        let gravity_weights = sensitivities(&samples, |at| symmetric_eigen(&stiffness(at)).dominant().0.abs());
        let matrices: Vec<JointMatrix<N>> = samples.iter().map(inertia).collect();
        let diagonal_weights = diagonal_weights(&matrices);
        let roots: Vec<f64> = diagonal_weights.iter().map(|w| w.sqrt()).collect();
        let scaled = |at: &[[f64; 2]; N]| {
            let m = inertia(at);
            largest(&JointMatrix::<N>::from_fn(|a, b| m[(a, b)] / (roots[a] * roots[b])))
        };
        let diagonal_sensitivities = sensitivities(&samples, scaled);
        // Every torque counts alike.
        let mut torque_weights = [0.0; N];
        for j in 0..N {
            let one = sensitivities(&samples, |at| torque_at(&chain, at)[j].abs());
            for (sum, weight) in torque_weights.iter_mut().zip(one) {
                *sum += weight;
            }
        }
        let first = first_joint(&chain);
        Ok(Self {
            inertia_pieces: pieces(&spans, &inertia_weights, 1, budgets.inertia),
            diagonal_pieces: pieces(&spans, &diagonal_sensitivities, 1, budgets.inertia),
            diagonal_weights,
            gravity_pieces: pieces(&spans, &gravity_weights, first, budgets.gravity),
            gravity_part_pieces: pieces(&spans, &gravity_weights, first, budgets.part),
            torque_pieces: pieces(&spans, &torque_weights, first, budgets.torque),
            coriolis_grid: grid::<N>(budgets.grid, N.saturating_sub(3), 2.0),
            coriolis_part_grid: grid::<N>(budgets.part_grid, N.saturating_sub(2), 1.5),
        })
    }

    /// Whether it is for `joints` joints.
    pub(crate) fn check(&self, joints: usize) -> Result<(), BoundsError> {
        let lists = [
            self.inertia_pieces.len(),
            self.diagonal_weights.len(),
            self.diagonal_pieces.len(),
            self.torque_pieces.len(),
            self.gravity_pieces.len(),
            self.gravity_part_pieces.len(),
            self.coriolis_grid.len(),
            self.coriolis_part_grid.len(),
        ];
        if let Some(given) = lists.into_iter().find(|given| *given != joints) {
            return Err(BoundsError::Length { given, expected: joints });
        }
        if let Some(weight) = self.diagonal_weights.iter().find(|w| !(**w > 0.0 && w.is_finite())) {
            return Err(BoundsError::Weight { value: *weight });
        }
        // Degree 2 needs more than four points.
        let grids = self.coriolis_grid.iter().chain(&self.coriolis_part_grid);
        if let Some(given) = grids.copied().find(|count| *count < 5) {
            return Err(BoundsError::Pieces { given, least: 5 });
        }
        Ok(())
    }
}

/// Points of the unit circles, evenly over the spans.
fn sample<const N: usize>(spans: &[Span; N]) -> Vec<[[f64; 2]; N]> {
    let sequence = Kronecker::new(N);
    (0..SAMPLES)
        .map(|k| {
            let mut at = [[1.0, 0.0]; N];
            for ((point, share), span) in at.iter_mut().zip(sequence.point(k)).zip(spans) {
                let angle = match span {
                    Span::Circle => TAU * share - PI,
                    Span::Arc(lower, upper) => lower + share * (upper - lower),
                };
                *point = [angle.cos(), angle.sin()];
            }
            at
        })
        .collect()
}

/// What `value` gains per unit of each joint's radius, at its largest sample.
fn sensitivities<const N: usize>(samples: &[[[f64; 2]; N]], value: impl Fn(&[[f64; 2]; N]) -> f64) -> [f64; N] {
    const STRETCH: f64 = 0.02;
    let mut best = (f64::NEG_INFINITY, [[1.0, 0.0]; N]);
    for at in samples {
        let here = value(at);
        if here > best.0 {
            best = (here, *at);
        }
    }
    std::array::from_fn(|j| {
        let mut stretched = best.1;
        stretched[j] = stretched[j].map(|x| x * (1.0 + STRETCH));
        if best.0 > 0.0 { ((value(&stretched) - best.0) / (STRETCH * best.0)).max(0.0) } else { 0.0 }
    })
}

/// Pieces for each joint: `inner` is cheap, those before it are not needed, the others have `budget` corners altogether.
fn pieces<const N: usize>(spans: &[Span; N], weights: &[f64; N], inner: usize, budget: f64) -> Vec<usize> {
    let top = weights.iter().fold(1e-3_f64, |top, w| top.max(*w));
    let at = |h: f64, j: usize, spare: f64| {
        let half = h / (weights[j] / top).max(0.01).sqrt();
        let wanted = (spare * spans[j].width_rad() / (2.0 * half)).ceil();
        (wanted as usize).clamp(spans[j].fewest_pieces(), MOST_PIECES)
    };
    let cost = |h: f64| -> f64 { (inner + 1..N).map(|j| spans[j].corner_count(at(h, j, 1.0)) as f64).product() };
    let (mut fine, mut coarse) = (1e-3_f64, 4.0_f64);
    for _ in 0..60 {
        let middle = (fine * coarse).sqrt();
        if cost(middle) > budget {
            fine = middle;
        } else {
            coarse = middle;
        }
    }
    (0..N)
        .map(|j| match j.cmp(&inner) {
            std::cmp::Ordering::Less => spans[j].fewest_pieces(),
            std::cmp::Ordering::Equal => at(coarse, j, 1.5),
            std::cmp::Ordering::Greater => at(coarse, j, 1.0),
        })
        .collect()
}

/// Equispaced angles: `outer` joints share the budget, joint 1 gets `spare` times as many as each of them.
fn grid<const N: usize>(budget: f64, outer: usize, spare: f64) -> Vec<usize> {
    let each = if outer == 0 { MOST_PIECES } else { budget.powf(1.0 / outer as f64) as usize };
    let each = each.clamp(8, MOST_PIECES);
    (0..N).map(|j| if j == 1 { (spare * each as f64) as usize } else { each }).collect()
}

/// Weights w for which `M <= t diag(w)` with a small product of the `t w_j`.
fn diagonal_weights<const N: usize>(matrices: &[JointMatrix<N>]) -> Vec<f64> {
    let mut logs = [f64::NEG_INFINITY; N];
    for m in matrices {
        for j in 0..N {
            logs[j] = logs[j].max(m[(j, j)].max(f64::MIN_POSITIVE).ln());
        }
    }
    let value = |logs: &[f64; N], m: &JointMatrix<N>| {
        let roots = logs.map(|x| (-0.5 * x).exp());
        let scaled = JointMatrix::<N>::from_fn(|a, b| m[(a, b)] * roots[a] * roots[b]);
        symmetric_eigen(&scaled).largest()
    };
    // The matrices that matter are large in the first scaling already.
    let mut ranked: Vec<(f64, usize)> = matrices.iter().enumerate().map(|(k, m)| (value(&logs, m).0, k)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let kept: Vec<&JointMatrix<N>> = ranked.iter().take(KEPT).map(|(_, k)| &matrices[*k]).collect();
    let mut best = (f64::INFINITY, logs);
    for step in 0..STEPS {
        let worst = kept.iter().map(|m| value(&logs, m)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((t, direction)) = worst else { break };
        let score = t.max(f64::MIN_POSITIVE).ln() + logs.iter().sum::<f64>() / N as f64;
        if score < best.0 {
            best = (score, logs);
        }
        let stride = 1.0 / (1.0 + 0.1 * f64::from(step));
        for j in 0..N {
            logs[j] += stride * (direction[j] * direction[j] - 1.0 / N as f64);
        }
    }
    // Four digits: a record holds them as they are.
    best.1.iter().map(|log| four_digits(log.exp())).collect()
}

fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(1.0)
}
