//! One Lyapunov matrix for all matrices of a polytope, by Newton's method.
//!
//! ```text
//! maximise t   subject to   G_b(P) - t I > 0 for every block b,   sum_b tr G_b(P) = sum_b order_b
//! ```
//!
//! with a block for each vertex and region, `G_b(P) = -F(P, A)/|A| = sum_s U_s' P V_s`. A positive t is a common matrix, and the search ends at the first that
//! serves; the normalisation makes t at most 1. The path of the barrier `-w t - sum_b log det(G_b - t I)` is followed from the solution of the mean's Lyapunov
//! equation: w grows tenfold whenever Newton's decrement is small. Near the path the best t is at most t + (sum_b order_b)/w away, which ends the search for a
//! family without a common matrix.
//!
//! A general solver carries each block's `n(n+1)/2` rows through its factorisation. Here the Hessian over the `n(n+1)/2` entries of P is formed from products of
//! order n, `sum_st (U_t W U_s') E (V_s W V_t')` for a direction E, with `W = (G_b - t I)^-1`, and factored once a step: at order 42 a twentieth of a second.
//! Floating point, a proposal like any other.
//!
//! Source: S. Boyd, L. El Ghaoui, "Method of centers for minimizing generalized eigenvalues", Linear Algebra and its Applications 188 (1993); S. Boyd,
//! L. Vandenberghe, *Convex Optimization* (2004), ch. 11. Limits: one P; memory `n^4/4` numbers.

use certune_verify::PlaneRegion;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltRegularization, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::default;
use faer::{Mat, Par};
use nalgebra::{DMatrix, DVector};

use crate::equation::{mean, parts, serves, solution};
use crate::lmi::SolveError;

const MOST_STEPS: usize = 120;
/// A predicted descent of the barrier that rounding may hide.
const SETTLED: f64 = 1e-8;

/// `G(P) = sum_s U_s' P V_s`, symmetric for symmetric P: with (U, V) the list holds (V, U).
struct Block {
    terms: Vec<[DMatrix<f64>; 2]>,
}

impl Block {
    fn new(a: &DMatrix<f64>, region: &PlaneRegion) -> Self {
        let [l, m] = parts(region);
        let (n, copies) = (a.nrows(), l.nrows());
        let size = -a.norm().max(f64::MIN_POSITIVE).recip();
        let mut terms = Vec::with_capacity(2 * copies);
        for r in 0..copies {
            // Row r of L/2 (x) I + M (x) A, and the r-th copy of the state.
            let mut row = DMatrix::zeros(n, copies * n);
            let mut copy = row.clone();
            for c in 0..copies {
                let part = DMatrix::identity(n, n) * (0.5 * l[(r, c)]) + a * m[(r, c)];
                row.columns_mut(c * n, n).copy_from(&(part * size));
            }
            copy.columns_mut(r * n, n).fill_with_identity();
            terms.push([copy.clone(), row.clone()]);
            terms.push([row, copy]);
        }
        Self { terms }
    }

    fn order(&self) -> usize {
        self.terms[0][0].ncols()
    }

    fn at(&self, p: &DMatrix<f64>) -> DMatrix<f64> {
        let order = self.order();
        self.terms.iter().fold(DMatrix::zeros(order, order), |sum, [u, v]| sum + u.transpose() * p * v)
    }

    /// The matrix K with `tr X G(P) = tr K P` for symmetric X.
    fn adjoint(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.terms[0][0].nrows();
        self.terms.iter().fold(DMatrix::zeros(n, n), |sum, [u, v]| sum + u * x * v.transpose())
    }
}

/// Entries of the upper triangle, row by row: of a symmetric matrix.
fn entries(order: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..order).flat_map(move |i| (i..order).map(move |j| (i, j)))
}

fn symmetric(order: usize, x: &DVector<f64>) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(order, order);
    for ((i, j), &x) in entries(order).zip(x.iter()) {
        (matrix[(i, j)], matrix[(j, i)]) = (x, x);
    }
    matrix
}

/// Derivatives of `tr K P` by the entries of P.
fn slopes(k: &DMatrix<f64>) -> DVector<f64> {
    let order = k.nrows();
    DVector::from_iterator(
        order * (order + 1) / 2,
        entries(order).map(|(i, j)| if i == j { k[(i, i)] } else { k[(i, j)] + k[(j, i)] }),
    )
}

/// The matrix, or why none was found.
pub(crate) fn common_matrix(vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> Result<DMatrix<f64>, SolveError> {
    let order = vertices[0].nrows();
    let blocks: Vec<Block> =
        vertices.iter().flat_map(|a| regions.iter().map(move |region| Block::new(a, region))).collect();
    let total = blocks.iter().map(Block::order).sum::<usize>() as f64;
    // The mean is a member: where its equation has no solution there is no common matrix.
    let p = solution(&mean(vertices), &regions[0]).ok_or(SolveError::Infeasible)?;
    let trace: f64 = blocks.iter().map(|block| block.at(&p).trace()).sum();
    if !(trace > 0.0) {
        return Err(SolveError::Stopped("no start"));
    }
    let mut path = Path { order, blocks, p: p * (total / trace), t: 0.0, weight: 0.0 };
    let least = path.blocks.iter().map(|block| block.at(&path.p).symmetric_eigenvalues().min());
    let least = least.fold(f64::INFINITY, f64::min);
    path.t = least - 0.1 * least.abs().max(1e-3);
    let inverses = path.inverses(&path.p, path.t).ok_or(SolveError::Stopped("no start"))?.0;
    path.weight = inverses.iter().map(DMatrix::trace).sum();
    for _ in 0..MOST_STEPS {
        if path.t > 0.0 && serves(&path.p, vertices, regions) {
            return Ok(path.p);
        }
        let decrement = path.step()?;
        if decrement < 1.0 {
            if path.t + 2.0 * total / path.weight < 0.0 {
                return Err(SolveError::Infeasible);
            }
            path.weight *= 10.0;
        }
    }
    Err(SolveError::Stopped("iteration limit"))
}

struct Path {
    order: usize,
    blocks: Vec<Block>,
    p: DMatrix<f64>,
    t: f64,
    weight: f64,
}

impl Path {
    /// `(G_b - t I)^-1` and the barrier's value, `None` outside.
    fn inverses(&self, p: &DMatrix<f64>, t: f64) -> Option<(Vec<DMatrix<f64>>, f64)> {
        let mut value = -self.weight * t;
        let mut inverses = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let factor = (block.at(p) - DMatrix::identity(block.order(), block.order()) * t).cholesky()?;
            value -= 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
            inverses.push(factor.inverse());
        }
        value.is_finite().then_some((inverses, value))
    }

    /// One step; the decrement before it.
    fn step(&mut self) -> Result<f64, SolveError> {
        let unknowns = self.order * (self.order + 1) / 2;
        let (inverses, value) = self.inverses(&self.p, self.t).ok_or(SolveError::Stopped("left the domain"))?;
        let mut hessian = Mat::<f64>::zeros(unknowns + 1, unknowns + 1);
        let mut gradient = DVector::zeros(unknowns + 1);
        let mut normalisation = DVector::zeros(unknowns + 1);
        gradient[unknowns] = -self.weight;
        for (block, w) in self.blocks.iter().zip(&inverses) {
            let square = w * w;
            let (by_p, mixed) = (slopes(&block.adjoint(w)), slopes(&block.adjoint(&square)));
            let trace = slopes(&block.adjoint(&DMatrix::identity(w.nrows(), w.nrows())));
            for k in 0..unknowns {
                gradient[k] -= by_p[k];
                normalisation[k] += trace[k];
                hessian[(unknowns, k)] -= mixed[k];
            }
            gradient[unknowns] += w.trace();
            hessian[(unknowns, unknowns)] += square.trace();
            add_curvature(&mut hessian, block, w);
        }
        let [newton, along] = solved(hessian, [&gradient, &normalisation]).ok_or(SolveError::Stopped("singular"))?;
        // Along the normalisation: a'd = 0.
        let share = normalisation.dot(&newton) / normalisation.dot(&along);
        let direction = along * share - newton;
        let slope = gradient.dot(&direction);
        if !slope.is_finite() {
            return Err(SolveError::Stopped("singular"));
        }
        if slope > -SETTLED {
            return Ok(0.0);
        }
        let step = symmetric(self.order, &direction.rows(0, unknowns).into_owned());
        let at = |length: f64| (&self.p + &step * length, self.t + direction[unknowns] * length);
        let drop = |length: f64| {
            let (p, t) = at(length);
            self.inverses(&p, t).map_or(f64::NEG_INFINITY, |(_, new)| value - new)
        };
        let mut length = 1.0;
        let mut gain = drop(length);
        while gain < 1e-2 * length * -slope {
            length *= 0.5;
            if length < 1e-9 {
                return Err(SolveError::Stopped("no descent"));
            }
            gain = drop(length);
        }
        // Far from the path Newton's step is short.
        while length >= 1.0 && drop(2.0 * length) > gain {
            length *= 2.0;
            gain = drop(length);
        }
        (self.p, self.t) = at(length);
        Ok((-slope).sqrt())
    }
}

/// Adds `tr E W G(E') W` over pairs of unit directions to the lower triangle.
fn add_curvature(hessian: &mut Mat<f64>, block: &Block, w: &DMatrix<f64>) {
    let order = block.terms[0][0].nrows();
    let mut pairs = Vec::new();
    for [u_s, v_s] in &block.terms {
        for [u_t, v_t] in &block.terms {
            // Transposed, so that rows are contiguous columns.
            pairs.push(((u_t * w * u_s.transpose()).transpose(), v_s * w * v_t.transpose()));
        }
    }
    for (x, y) in &pairs {
        let column = |m: &DMatrix<f64>, j: usize| m.column(j).iter().copied().collect::<Vec<f64>>();
        let (x, y): (Vec<_>, Vec<_>) = (0..order).map(|i| (column(x, i), column(y, i))).unzip();
        for (row, (i, j)) in entries(order).enumerate() {
            let weight = if i == j { 0.5 } else { 1.0 };
            let target = hessian.col_as_slice_mut(row);
            // The Hessian is symmetric: the directions (k, l) from (i, j) on fill the column below the diagonal.
            let mut first = row + i - j;
            for k in i..order {
                let from = if k == i { j } else { k };
                let [x_ik, x_jk, y_ik, y_jk] = [x[i][k], x[j][k], y[i][k], y[j][k]].map(|entry| entry * weight);
                let rows = x[i][from..].iter().zip(&x[j][from..]).zip(y[i][from..].iter().zip(&y[j][from..]));
                let own = target[first + from - k..].first().copied();
                for (entry, ((x_il, x_jl), (y_il, y_jl))) in target[first + from - k..].iter_mut().zip(rows) {
                    *entry += x_ik * y_jl + x_il * y_jk + x_jk * y_il + x_jl * y_ik;
                }
                // Of a diagonal direction, half.
                if let (true, Some(own)) = (from == k, own) {
                    let entry = &mut target[first];
                    *entry = 0.5 * (*entry + own);
                }
                first += order - k;
            }
        }
    }
}

/// Solutions of `H x = b` for two b, H given by its lower triangle.
fn solved(mut hessian: Mat<f64>, sides: [&DVector<f64>; 2]) -> Option<[DVector<f64>; 2]> {
    let order = hessian.nrows();
    let scale: Vec<f64> = (0..order).map(|k| hessian[(k, k)].sqrt().recip()).collect();
    for j in 0..order {
        for i in j..order {
            hessian[(i, j)] *= scale[i] * scale[j];
        }
        hessian[(j, j)] += 1e-14;
    }
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(order, Par::Seq, default()));
    let stack = MemStack::new(&mut memory);
    cholesky_in_place(hessian.as_mut(), LltRegularization::default(), Par::Seq, stack, default()).ok()?;
    let mut x = Mat::from_fn(order, 2, |i, k| sides[k][i] * scale[i]);
    solve_lower_triangular_in_place(hessian.as_ref(), x.as_mut(), Par::Seq);
    solve_upper_triangular_in_place(hessian.transpose(), x.as_mut(), Par::Seq);
    let solution = |k: usize| DVector::from_fn(order, |i, _| x[(i, k)] * scale[i]);
    let both = [solution(0), solution(1)];
    both.iter().all(|x| x.iter().all(|x| x.is_finite())).then_some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use certune_verify::Number;
    use proptest::prelude::*;

    fn regions() -> [PlaneRegion; 3] {
        let number = |x: f64| Number::decimal(x).unwrap();
        [
            PlaneRegion::HalfPlane { rate_per_s: number(0.2) },
            PlaneRegion::Disk { centre: number(-1.0), radius: number(4.0) },
            PlaneRegion::Sector { slope: number(2.0) },
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]
        /// `tr E W G(E') W` from the definition against the Hessian's entries.
        #[test]
        fn the_curvature_is_that_of_the_definition(seed in prop::collection::vec(-1.0..1.0_f64, 80), which in 0_usize..3) {
            let a = DMatrix::from_fn(4, 4, |i, j| seed[4 * i + j]);
            let block = Block::new(&a, &regions()[which]);
            let size = block.order();
            let root = DMatrix::from_fn(size, size, |i, j| seed[16 + size * i + j]);
            let w = &root * root.transpose();
            let mut hessian = Mat::zeros(11, 11);
            add_curvature(&mut hessian, &block, &w);
            let unit = |k: usize| symmetric(4, &DVector::from_fn(10, |i, _| if i == k { 1.0 } else { 0.0 }));
            for column in 0..10 {
                for row in column..10 {
                    let expected = (block.at(&unit(row)) * &w * block.at(&unit(column)) * &w).trace();
                    // Some hundred products of numbers of order 1.
                    prop_assert!((hessian[(row, column)] - expected).abs() < 1e-11, "{row} {column}");
                }
            }
        }
    }
}
