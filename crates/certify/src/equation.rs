//! The Lyapunov equation of one matrix, and whether its solution serves a family.
//!
//! `(A + rate)'P + P(A + rate) = -I` by the doubling iteration of its Cayley transform,
//!
//! ```text
//! P_0 = 2p (pI - A)^-T (pI - A)^-1,  E_0 = (pI + A)(pI - A)^-1,   P_(k+1) = P_k + E_k'P_k E_k,   E_(k+1) = E_k^2,
//! ```
//!
//! about 20 products of order n; a disk starts from `P_0 = I, E_0 = (A - centre)/radius`, a sector is begun as the half plane around it. A family is
//! tried with the solutions of its mean and of its vertices: what serves all of them needs no program. Everything is in floating point and proves nothing.
//!
//! Source: R. A. Smith, "Matrix equation XA + BX = C", SIAM J. Appl. Math. 16 (1968), for the doubling.

use certune_verify::PlaneRegion;
use nalgebra::{DMatrix, Schur};

/// Powers of two that bring the rows and columns of `sum |A_k|` to equal size.
pub(crate) fn balance(vertices: &[DMatrix<f64>]) -> Vec<f64> {
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

/// The solution for one matrix; `None` when the iteration runs away, as it does for an eigenvalue outside.
pub(crate) fn solution(a: &DMatrix<f64>, region: &PlaneRegion) -> Option<DMatrix<f64>> {
    let order = a.nrows();
    let identity = DMatrix::<f64>::identity(order, order);
    let half_plane = |rate: f64| {
        let shifted = a + &identity * rate;
        // Between the slowest and the fastest mode.
        let slowest = shifted.clone().lu().try_inverse()?.norm().recip();
        let pole = (slowest * shifted.norm()).sqrt();
        let inverse = (&identity * pole - &shifted).try_inverse()?;
        Some((inverse.transpose() * &inverse * (2.0 * pole), (&identity * pole + &shifted) * &inverse))
    };
    let (mut p, mut e) = match region {
        PlaneRegion::HalfPlane { rate_per_s } => half_plane(rate_per_s.to_f64())?,
        PlaneRegion::Disk { centre, radius } => (identity.clone(), (a - &identity * centre.to_f64()) / radius.to_f64()),
        PlaneRegion::Sector { .. } => half_plane(0.0)?,
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

/// The least decay of an eigenvalue of a matrix of the list, negative when one grows; `None` when the iteration does not settle.
pub(crate) fn slowest_decay(vertices: &[DMatrix<f64>]) -> Option<f64> {
    const MOST_SWEEPS: usize = 10_000;
    let scale = balance(vertices);
    let decay = |a: &DMatrix<f64>| {
        let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[j] / scale[i]);
        let schur = Schur::try_new(scaled, f64::EPSILON, MOST_SWEEPS)?;
        Some(-schur.complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max))
    };
    vertices.iter().map(decay).try_fold(f64::INFINITY, |least, decay| Some(least.min(decay?)))
}

/// The mean of the matrices.
pub(crate) fn mean(vertices: &[DMatrix<f64>]) -> DMatrix<f64> {
    let order = vertices[0].nrows();
    vertices.iter().fold(DMatrix::zeros(order, order), |sum, a| sum + a) / vertices.len() as f64
}

/// A solution for the mean or for one vertex that serves all vertices and regions.
pub(crate) fn shared_solution(vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> Option<DMatrix<f64>> {
    let mean = mean(vertices);
    let bases = std::iter::once(&mean).chain(vertices.iter().filter(|_| vertices.len() > 1));
    let mut solutions = bases.flat_map(|a| regions.iter().filter_map(move |region| solution(a, region)));
    solutions.find(|p| serves(p, vertices, regions))
}

/// Each vertex's own solution, if interpolating them serves: `F(P_i, A_j) + F(P_j, A_i) < 0` for every two.
pub(crate) fn own_solutions(vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> Option<Vec<DMatrix<f64>>> {
    let own = |region| vertices.iter().map(|a| solution(a, region)).collect::<Option<Vec<_>>>();
    let mixed = |p: &[DMatrix<f64>], i: usize, j: usize, region: &PlaneRegion| {
        definite(&-(form(region, &p[i], &vertices[j]) + form(region, &p[j], &vertices[i])))
    };
    let serve = |p: &Vec<DMatrix<f64>>| {
        (0..p.len())
            .all(|i| definite(&p[i]) && regions.iter().all(|region| (i..p.len()).all(|j| mixed(p, i, j, region))))
    };
    regions.iter().filter_map(own).find(serve)
}

/// Whether `P > 0` and `F(P, A) < 0` everywhere, clear of rounding.
pub(crate) fn serves(p: &DMatrix<f64>, vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> bool {
    definite(p) && vertices.iter().all(|a| regions.iter().all(|region| definite(&-form(region, p, a))))
}

/// Positive definite after scaling to a unit diagonal, with a margin.
fn definite(matrix: &DMatrix<f64>) -> bool {
    const MARGIN: f64 = 1e-11;
    let size: Vec<f64> = matrix.diagonal().iter().map(|x| x.sqrt()).collect();
    // NaN where an entry of the diagonal is negative.
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] / (size[i] * size[j]) - if i == j { MARGIN } else { 0.0 }
    });
    scaled.iter().all(|x| x.is_finite()) && scaled.cholesky().is_some()
}

/// L and M of a region.
pub(crate) fn parts(region: &PlaneRegion) -> [DMatrix<f64>; 2] {
    match region {
        PlaneRegion::HalfPlane { rate_per_s } => {
            [DMatrix::from_element(1, 1, 2.0 * rate_per_s.to_f64()), DMatrix::from_element(1, 1, 1.0)]
        }
        PlaneRegion::Disk { centre, radius } => {
            let (c, r) = (-centre.to_f64(), -radius.to_f64());
            [DMatrix::from_row_slice(2, 2, &[r, c, c, r]), DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0])]
        }
        PlaneRegion::Sector { slope } => {
            let k = slope.to_f64();
            [DMatrix::zeros(2, 2), DMatrix::from_row_slice(2, 2, &[k, 1.0, -1.0, k])]
        }
    }
}

/// `F(P, A) = L (x) P + M (x) (P A) + M' (x) (A'P)`.
pub(crate) fn form(region: &PlaneRegion, p: &DMatrix<f64>, a: &DMatrix<f64>) -> DMatrix<f64> {
    let [l, m] = parts(region);
    let product = product(p, a);
    l.kronecker(p) + m.kronecker(&product) + m.transpose().kronecker(&product.transpose())
}

/// `P A`. A program reads its coefficients off at matrices with an entry or two, for which the dense product would be nearly all of its assembly.
fn product(p: &DMatrix<f64>, a: &DMatrix<f64>) -> DMatrix<f64> {
    let nonzero = || p.iter().enumerate().filter(|(_, x)| **x != 0.0);
    let rows = p.nrows();
    if nonzero().nth(rows).is_some() {
        return p * a;
    }
    let mut product = DMatrix::zeros(rows, a.ncols());
    for (index, &x) in nonzero() {
        let (row, k) = (index % rows, index / rows);
        for j in 0..a.ncols() {
            product[(row, j)] += x * a[(k, j)];
        }
    }
    product
}
