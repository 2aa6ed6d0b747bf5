//! What the bounds are likely to be, by sampling: candidates for the proofs, never part of them.
//!
//! Diagonals below M are looked for by multiplicative steps. In coordinates scaled by `sqrt(d_i)`, let u be the unit eigenvector
//! of the smallest eigenvalue over all sampled M. `d_i <- d_i exp(-eta (u_i² - p_i))` has as fixed points the d that are best
//! for the objective: `p_i = 1/N` for the largest `sum log d_i`, `p_i ~ k_i²/d_i` for the least `sum k_i²/d_i`.

use certune_dynamics::{Model, mass_matrix_as_described, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints};

use crate::eigen::symmetric_eigen;
use crate::sequence::Kronecker;

/// Configurations sampled.
const SAMPLES: usize = 3_000;
/// Climbs per number, and steps of each.
const CLIMBS: usize = 4;
const STEPS: usize = 300;
/// Matrices kept for the diagonals, and steps towards them.
const KEPT: usize = 400;
const DIAGONAL_STEPS: u32 = 400;

/// Sampled extremes.
pub(crate) struct Guess<const N: usize> {
    /// Least eigenvalue of M, kg m².
    pub m_lo: f64,
    /// Largest `½ |v'(∂M/∂q_j)v| / v'Mv` of each joint.
    pub k: [f64; N],
    kept: Vec<JointMatrix<N>>,
}

/// The largest modulus of an eigenvalue of `½ L^-1 D L'^-1`, `M = L L'`.
fn relative<const N: usize>(m: &JointMatrix<N>, d: &JointMatrix<N>) -> f64 {
    let eigen = symmetric_eigen(m);
    let root: JointMatrix<N> = JointMatrix::from_fn(|i, j| eigen.vectors[(i, j)] / eigen.values[j].max(1e-300).sqrt());
    let scaled: JointMatrix<N> = root.transpose() * d * root;
    0.5 * symmetric_eigen(&scaled).values.amax()
}

fn least<const N: usize>(m: &JointMatrix<N>) -> f64 {
    symmetric_eigen(m).values.min()
}

/// Number `which` at a configuration: the inertia's negative for 0, the k of a joint otherwise.
fn score<const N: usize>(model: &Model<N>, q: &Joints<N>, which: usize) -> f64 {
    let m = mass_matrix_as_described(model, q);
    if which == 0 { -least(&m) } else { relative(&m, &mass_matrix_derivatives(model, q)[which]) }
}

impl<const N: usize> Guess<N> {
    /// Samples one arm over intervals of angles.
    pub fn new(model: &Model<N>, intervals: &[[f64; 2]; N]) -> Self {
        let sequence = Kronecker::new(N);
        let place = |fractions: &[f64]| {
            Joints::from_fn(|i, _| intervals[i][0] + (intervals[i][1] - intervals[i][0]) * fractions[i])
        };
        let mut best: Vec<Vec<(f64, Joints<N>)>> = vec![Vec::new(); N];
        let mut kept = Vec::new();
        for index in 0..SAMPLES {
            let mut fractions: Vec<f64> = sequence.point(index).collect();
            if index % 3 == 0 {
                // Boxes attain much at their ends.
                for x in &mut fractions {
                    *x = if *x < 0.3 {
                        0.0
                    } else if *x > 0.7 {
                        1.0
                    } else {
                        *x
                    };
                }
            }
            let q = place(&fractions);
            let m = mass_matrix_as_described(model, &q);
            let derivatives = mass_matrix_derivatives(model, &q);
            for (which, list) in best.iter_mut().enumerate() {
                let value = if which == 0 { -least(&m) } else { relative(&m, &derivatives[which]) };
                list.push((value, q));
                if list.len() > 4 * CLIMBS {
                    list.sort_by(|a, b| b.0.total_cmp(&a.0));
                    list.truncate(CLIMBS);
                }
            }
            if index < KEPT {
                kept.push(m);
            }
        }
        let mut top = [0.0; N];
        let mut lowest = Joints::zeros();
        for (which, list) in best.iter_mut().enumerate() {
            list.sort_by(|a, b| b.0.total_cmp(&a.0));
            list.truncate(CLIMBS);
            top[which] = f64::NEG_INFINITY;
            for (mut value, mut q) in list.drain(..) {
                let mut width = 0.3;
                for step in 0..STEPS {
                    let fractions: Vec<f64> = sequence.point(step + 1).collect();
                    let trial = Joints::from_fn(|i, _| {
                        (q[i] + width * (2.0 * fractions[i] - 1.0)).clamp(intervals[i][0], intervals[i][1])
                    });
                    let found = score(model, &trial, which);
                    if found > value {
                        (value, q) = (found, trial);
                    } else {
                        width *= 0.985;
                    }
                }
                if value > top[which] {
                    top[which] = value;
                    if which == 0 {
                        lowest = q;
                    }
                }
            }
        }
        kept.push(mass_matrix_as_described(model, &lowest));
        let m_lo = -top[0];
        top[0] = 0.0;
        Self { m_lo, k: top, kept }
    }

    /// A diagonal below every sampled M: the best for `sum k_i²/d_i`, or for `sum log d_i` if no k is given.
    pub fn diagonal(&self, k: Option<&[f64; N]>) -> [f64; N] {
        let wanted = |i: usize| k.is_none_or(|k| k[i] > 0.0);
        let mut d: [f64; N] = std::array::from_fn(|i| if wanted(i) { self.m_lo.max(1e-9) } else { 0.0 });
        let mut best = (f64::INFINITY, d);
        for step in 0..DIAGONAL_STEPS {
            let (mut low, mut direction) = (f64::INFINITY, Joints::zeros());
            for m in &self.kept {
                // Joints that are not wanted are free: their coordinates keep the scale of M.
                let scale = Joints::<N>::from_fn(|i, _| if d[i] > 0.0 { d[i].sqrt().recip() } else { 1e4 });
                let scaled: JointMatrix<N> = JointMatrix::from_fn(|i, j| m[(i, j)] * scale[i] * scale[j]);
                let (value, vector) = symmetric_eigen(&scaled).smallest();
                if value < low {
                    (low, direction) = (value, vector);
                }
            }
            let feasible = d.map(|x| x * low);
            let cost: f64 = (0..N)
                .filter(|&i| wanted(i))
                .map(|i| k.map_or_else(|| -feasible[i].ln(), |k| k[i] * k[i] / feasible[i]))
                .sum();
            if cost < best.0 {
                best = (cost, feasible);
            }
            let shares: [f64; N] = std::array::from_fn(|i| match k {
                _ if !wanted(i) => 0.0,
                None => 1.0,
                Some(k) => k[i] * k[i] / d[i],
            });
            let total: f64 = shares.iter().sum();
            let rate = 1.0 / (1.0 + 0.05 * f64::from(step));
            for i in 0..N {
                if wanted(i) {
                    d[i] *= (-rate * (direction[i] * direction[i] - shares[i] / total)).exp();
                }
            }
        }
        best.1
    }
}
