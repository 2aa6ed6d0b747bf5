//! Lyapunov matrices for linear loops and polytopes of loops.
//!
//! Statement and inequalities as in `certune_verify`'s `lyapunov`. States are first balanced by powers of two (Osborne), `A -> T^-1 A T`, `P -> T^-1 P T^-1`.
//! One matrix and one half plane: the Lyapunov equation `(A + rate)'P + P(A + rate) = -I` by the doubling iteration of its Cayley transform,
//!
//! ```text
//! P_0 = 2p (pI - A)^-T (pI - A)^-1,  E_0 = (pI + A)(pI - A)^-1,   P_(k+1) = P_k + E_k'P_k E_k,   E_(k+1) = E_k^2,
//! ```
//!
//! about 20 products of order n; a disk about 0 starts from `P_0 = I, E_0 = A/radius`. Everything else is a semidefinite program, minimise trace P subject to
//! `P >= I, F <= -I`, quick up to order 10 or so. What comes out is rounded to dyadics and decided by the checker.
//!
//! Source: R. A. Smith, "Matrix equation XA + BX = C", SIAM J. Appl. Math. 16 (1968), for the doubling.

use certune_verify::{Inequality, LyapunovClaim, LyapunovRefusedClaim, LyapunovWitness, Number, PlaneRegion, Polytope};
use nalgebra::DMatrix;

use crate::lmi::{Affine, Program, SolveError};

/// A linear loop, or the hull of several.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearFamily {
    /// One square matrix, or the vertices of a polytope of them.
    pub vertices: Vec<DMatrix<f64>>,
    /// The configuration whose linearised loop it is, rad; for the words of the claim.
    pub configuration_rad: Option<Vec<f64>>,
}

/// Which Lyapunov matrix is sought for a polytope.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LyapunovMatrix {
    /// One for all: holds even when the loop moves in the polytope with time.
    #[default]
    Common,
    /// One for each vertex, interpolated: for loops that stay where they are.
    Affine,
}

/// Why there is no Lyapunov claim.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LyapunovFailure {
    /// A number is not finite, or the matrices are not square or of different orders.
    #[error("the matrices are not finite, not square, or of different orders")]
    Matrices,
    /// A matrix of the family has an eigenvalue that is not in the region: decided exactly.
    #[error("a matrix of the family has an eigenvalue outside the region")]
    Refused(Box<LyapunovRefusedClaim>),
    /// The solver found no matrix of the kind sought; in floating point, which proves nothing.
    #[error("no Lyapunov matrix was found: {0}")]
    NotFound(SolveError),
    /// What was found did not pass the exact check.
    #[error("the Lyapunov matrix that was found did not pass the exact check")]
    CandidateFailed,
}

/// Points per vertex pair when an unstable matrix is looked for inside a polytope.
const GRID: u32 = 16;

/// The claim that every matrix of the family has its eigenvalues in all of the regions, checked.
///
/// # Errors
/// [`LyapunovFailure`]; a refusal names a matrix and is exact, up to order 12.
pub fn lyapunov(
    family: &LinearFamily,
    regions: &[PlaneRegion],
    matrix: LyapunovMatrix,
) -> Result<LyapunovClaim, LyapunovFailure> {
    let order = family.vertices.first().map_or(0, DMatrix::nrows);
    let square = |a: &DMatrix<f64>| a.nrows() == order && a.ncols() == order && a.iter().all(|x| x.is_finite());
    if order == 0 || regions.is_empty() || !family.vertices.iter().all(square) {
        return Err(LyapunovFailure::Matrices);
    }
    let polytope = polytope(&family.vertices).ok_or(LyapunovFailure::Matrices)?;
    let configuration_rad = match &family.configuration_rad {
        Some(q) => Some(q.iter().map(|&x| Number::decimal(x)).collect::<Option<_>>().ok_or(LyapunovFailure::Matrices)?),
        None => None,
    };
    if let Some(refused) = refusal(&polytope, regions) {
        return Err(LyapunovFailure::Refused(Box::new(refused)));
    }
    let scale = balance(&family.vertices);
    let scaled: Vec<DMatrix<f64>> = family
        .vertices
        .iter()
        .map(|a| DMatrix::from_fn(order, order, |i, j| a[(i, j)] * scale[j] / scale[i]))
        .collect();
    let found = match (direct(&scaled, regions), matrix) {
        (Some(p), _) => Ok(vec![p]),
        (None, LyapunovMatrix::Common) => program(&scaled, regions, 1),
        (None, LyapunovMatrix::Affine) => program(&scaled, regions, scaled.len()),
    };
    let triangle = |p: &DMatrix<f64>| -> Option<Vec<Number>> {
        let entries = (0..order).flat_map(|i| (i..order).map(move |j| (i, j)));
        entries.map(|(i, j)| Number::dyadic(p[(i, j)] / (scale[i] * scale[j]))).collect()
    };
    let p = found.map_err(LyapunovFailure::NotFound)?;
    let p = p.iter().map(triangle).collect::<Option<Vec<_>>>().ok_or(LyapunovFailure::CandidateFailed)?;
    let witness = match <[Vec<Number>; 1]>::try_from(p) {
        Ok([p]) => LyapunovWitness::Common { p },
        Err(p) => LyapunovWitness::Affine { p },
    };
    let claim = LyapunovClaim { configuration_rad, polytope, regions: regions.to_vec(), witness };
    let holds = |all: Vec<Inequality>| all.iter().all(|inequality| inequality.smallest_pivot.is_some());
    if claim.inequalities().is_ok_and(holds) { Ok(claim) } else { Err(LyapunovFailure::CandidateFailed) }
}

/// The fastest decay in steps of 1/1000 per s, up to 1000 per s, that [`lyapunov`] proves for the family, with its claim.
///
/// # Errors
/// As [`lyapunov`] for the rate 0.
pub fn fastest_decay(family: &LinearFamily, matrix: LyapunovMatrix) -> Result<LyapunovClaim, LyapunovFailure> {
    const STEPS_PER_UNIT: u32 = 1000;
    let at = |steps: u32| {
        let text = format!("{}.{:03}", steps / STEPS_PER_UNIT, steps % STEPS_PER_UNIT);
        let rate_per_s = text.parse().unwrap_or_else(|_| Number::zero());
        lyapunov(family, &[PlaneRegion::HalfPlane { rate_per_s }], matrix)
    };
    let mut best = at(0)?;
    let (mut certified, mut refused) = (0, 1000 * STEPS_PER_UNIT);
    while refused - certified > 1 {
        let middle = certified.midpoint(refused);
        match at(middle) {
            Ok(claim) => (certified, best) = (middle, claim),
            Err(_) => refused = middle,
        }
    }
    Ok(best)
}

fn polytope(vertices: &[DMatrix<f64>]) -> Option<Polytope> {
    let row =
        |a: &DMatrix<f64>, i: usize| (0..a.ncols()).map(|j| Number::dyadic(a[(i, j)])).collect::<Option<Vec<_>>>();
    let matrix = |a: &DMatrix<f64>| (0..a.nrows()).map(|i| row(a, i)).collect::<Option<Vec<_>>>();
    Some(Polytope { vertices: vertices.iter().map(matrix).collect::<Option<Vec<_>>>()? })
}

/// A matrix of the polytope with an eigenvalue outside: the vertices, then points between two of them.
fn refusal(polytope: &Polytope, regions: &[PlaneRegion]) -> Option<LyapunovRefusedClaim> {
    let count = polytope.vertices.len();
    let pairs = (0..count).flat_map(|i| (i..count).map(move |j| (i, j)));
    let points = pairs.flat_map(|(i, j)| (0..if i == j { 1 } else { GRID }).map(move |step| (i, j, step)));
    for (i, j, step) in points {
        let share = f64::from(step) / f64::from(GRID);
        let mut weights = vec![0.0; count];
        weights[j] += share;
        weights[i] += 1.0 - share;
        let weights: Vec<Number> = weights.into_iter().map(Number::decimal).collect::<Option<_>>()?;
        for region in regions {
            let claim =
                LyapunovRefusedClaim { polytope: polytope.clone(), region: region.clone(), weights: weights.clone() };
            if claim.check().is_ok() {
                return Some(claim);
            }
        }
    }
    None
}

/// Powers of two that bring the rows and columns of `sum |A_k|` to equal size.
fn balance(vertices: &[DMatrix<f64>]) -> Vec<f64> {
    let order = vertices[0].nrows();
    let size = vertices.iter().fold(DMatrix::zeros(order, order), |sum, a| sum + a.abs());
    let mut scale = vec![1.0_f64; order];
    for _ in 0..20 {
        for k in 0..order {
            let others = (0..order).filter(|&i| i != k);
            let row: f64 = others.clone().map(|j| size[(k, j)] * scale[j] / scale[k]).sum();
            let column: f64 = others.map(|i| size[(i, k)] * scale[k] / scale[i]).sum();
            if row > 0.0 && column > 0.0 {
                scale[k] *= (0.5 * (row / column).log2()).round().clamp(-20.0, 20.0).exp2();
            }
        }
    }
    scale
}

/// The Lyapunov equation of a single matrix in a half plane, or in a disk about 0.
fn direct(vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> Option<DMatrix<f64>> {
    let ([a], [region]) = (vertices, regions) else { return None };
    let order = a.nrows();
    let identity = DMatrix::<f64>::identity(order, order);
    let (mut p, mut e) = match region {
        PlaneRegion::HalfPlane { rate_per_s } => {
            let shifted = a + &identity * rate_per_s.to_f64();
            // Between the slowest and the fastest mode.
            let slowest = shifted.clone().lu().try_inverse()?.norm().recip();
            let pole = (slowest * shifted.norm()).sqrt();
            let inverse = (&identity * pole - &shifted).try_inverse()?;
            (inverse.transpose() * &inverse * (2.0 * pole), (&identity * pole + &shifted) * &inverse)
        }
        PlaneRegion::Disk { centre, radius } => {
            if centre.to_f64().abs() > 0.0 {
                return None;
            }
            (identity.clone(), a / radius.to_f64())
        }
        PlaneRegion::Sector { .. } => return None,
    };
    for _ in 0..60 {
        let step = e.transpose() * &p * &e;
        let done = step.norm() <= 1e-17 * p.norm();
        p += step;
        p = (&p + p.transpose()) * 0.5;
        e = &e * &e;
        if done {
            break;
        }
        if !p.iter().chain(e.iter()).all(|x| x.is_finite()) {
            return None;
        }
    }
    Some(p)
}

/// `L (x) P + M (x) (P A) + M' (x) (A'P)`.
fn form(region: &PlaneRegion, p: &DMatrix<f64>, a: &DMatrix<f64>) -> DMatrix<f64> {
    let (l, m) = match region {
        PlaneRegion::HalfPlane { rate_per_s } => {
            (DMatrix::from_element(1, 1, 2.0 * rate_per_s.to_f64()), DMatrix::from_element(1, 1, 1.0))
        }
        PlaneRegion::Disk { centre, radius } => {
            let (c, r) = (-centre.to_f64(), -radius.to_f64());
            (DMatrix::from_row_slice(2, 2, &[r, c, c, r]), DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]))
        }
        PlaneRegion::Sector { slope } => {
            let k = slope.to_f64();
            (DMatrix::zeros(2, 2), DMatrix::from_row_slice(2, 2, &[k, 1.0, -1.0, k]))
        }
    };
    let product = p * a;
    l.kronecker(p) + m.kronecker(&product) + m.transpose().kronecker(&product.transpose())
}

/// `count` Lyapunov matrices by a semidefinite program: one for all vertices, or one for each.
fn program(vertices: &[DMatrix<f64>], regions: &[PlaneRegion], count: usize) -> Result<Vec<DMatrix<f64>>, SolveError> {
    let order = vertices[0].nrows();
    let length = order * (order + 1) / 2;
    let matrix = |x: &[f64], which: usize| {
        let mut p = DMatrix::zeros(order, order);
        let mut k = which * length;
        for i in 0..order {
            for j in i..order {
                p[(i, j)] = x[k];
                p[(j, i)] = x[k];
                k += 1;
            }
        }
        p
    };
    let below = |form: DMatrix<f64>, margin: f64| {
        let size = form.nrows();
        -form - DMatrix::identity(size, size) * margin
    };
    let mut cost = vec![0.0; count * length];
    let mut blocks: Vec<Affine<'_>> = Vec::new();
    for which in 0..count {
        let mut k = which * length;
        for i in 0..order {
            cost[k] = 1.0;
            k += order - i;
        }
        blocks.push(Box::new(move |x| below(-matrix(x, which), 1.0)));
    }
    for region in regions {
        for (i, a) in vertices.iter().enumerate() {
            let own = if count == 1 { 0 } else { i };
            // F <= -I in units of the loop's own speed.
            let margin = 1e-3 * a.norm().max(f64::MIN_POSITIVE);
            blocks.push(Box::new(move |x| below(form(region, &matrix(x, own), a), margin)));
            for (j, b) in vertices.iter().enumerate().skip(i + 1).filter(|_| count > 1) {
                blocks.push(Box::new(move |x| {
                    below(form(region, &matrix(x, i), b) + form(region, &matrix(x, j), a), 2.0 * margin)
                }));
            }
        }
    }
    let x = Program { cost, nonnegative: Vec::new(), blocks }.solve()?.x;
    Ok((0..count).map(|which| matrix(&x, which)).collect())
}
