//! Lyapunov matrices for linear loops and polytopes of loops.
//!
//! Statement and inequalities as in `certune_verify`'s `lyapunov`. States are first balanced by powers of two (Osborne), `A -> T^-1 A T`, `P -> T^-1 P T^-1`.
//! Looked for in turn:
//!
//! | what | of which family | file |
//! |---|---|---|
//! | the solution of one Lyapunov equation | one matrix and one half plane or disk: always there; any other: where one serves all | `equation` |
//! | the solutions of the vertices' equations, interpolated | where a matrix for each vertex is asked for and they serve | `equation` |
//! | a common matrix, by Newton's method | order above 12 | `common_matrix` |
//! | a semidefinite program, minimise trace P subject to `P >= I, F <= -I` | the rest | `lmi` |
//!
//! What comes out is rounded to dyadics and decided by the checker.

use certune_verify::{Inequality, LyapunovClaim, LyapunovRefusedClaim, LyapunovWitness, Number, PlaneRegion, Polytope};
use nalgebra::DMatrix;

use crate::common_matrix::common_matrix;
use crate::equation::{balance, form, own_solutions, shared_solution, slowest_decay, solution};
use crate::lmi::{Affine, Program, SolveError};

/// A linear loop, or the hull of several.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearFamily {
    /// One square matrix, or the vertices of a polytope of them.
    pub vertices: Vec<DMatrix<f64>>,
    /// The configuration whose linearised loop it is, rad; for the words of the claim.
    pub configuration_rad: Option<Vec<f64>>,
}

impl LinearFamily {
    /// The common order of the matrices, if they are square, finite and of one.
    fn order(&self) -> Option<usize> {
        let order = self.vertices.first().map(DMatrix::nrows).filter(|&order| order > 0)?;
        let fits = |a: &DMatrix<f64>| a.nrows() == order && a.ncols() == order && a.iter().all(|x| x.is_finite());
        self.vertices.iter().all(fits).then_some(order)
    }
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

/// A common matrix of a larger order comes from Newton's method in its own entries, not from a general program.
const LARGEST_PROGRAM_ORDER: usize = 12;

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
    let order = family.order().filter(|_| !regions.is_empty()).ok_or(LyapunovFailure::Matrices)?;
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
        (None, LyapunovMatrix::Common) if order > LARGEST_PROGRAM_ORDER => {
            common_matrix(&scaled, regions).map(|p| vec![p])
        }
        (None, LyapunovMatrix::Common) => program(&scaled, regions, 1),
        (None, LyapunovMatrix::Affine) => match own_solutions(&scaled, regions) {
            Some(own) => Ok(own),
            None => program(&scaled, regions, scaled.len()),
        },
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

/// The fastest decay in steps of 1/1000 per s, up to 1000 per s, that [`lyapunov`] proves for the family, with its claim: the next step is not proved.
///
/// The eigenvalues say where to look; from there the search gallops to the edge of what is proved and halves the rest. One matrix takes about four checks.
///
/// # Errors
/// As [`lyapunov`] for the rate 0.
pub fn fastest_decay(family: &LinearFamily, matrix: LyapunovMatrix) -> Result<LyapunovClaim, LyapunovFailure> {
    const STEPS_PER_UNIT: u32 = 1000;
    const END: u32 = 1000 * STEPS_PER_UNIT;
    let at = |steps: u32| {
        let text = format!("{}.{:03}", steps / STEPS_PER_UNIT, steps % STEPS_PER_UNIT);
        let rate_per_s = text.parse().unwrap_or_else(|_| Number::zero());
        lyapunov(family, &[PlaneRegion::HalfPlane { rate_per_s }], matrix)
    };
    let decay = family.order().and_then(|_| slowest_decay(&family.vertices)).unwrap_or(0.0);
    let guess = (decay * f64::from(STEPS_PER_UNIT)).clamp(0.0, f64::from(END - 1)) as u32;
    // A common matrix of several may stop far short of the slowest of their eigenvalues.
    let mut stride = if family.vertices.len() == 1 { 1 } else { guess / 16 + 1 };
    let (mut certified, mut refused, mut best) = match at(guess) {
        Ok(claim) => {
            let (mut certified, mut best) = (guess, claim);
            let refused = loop {
                let next = certified.saturating_add(stride).min(END);
                match if next < END { at(next) } else { break END } {
                    Ok(claim) => (certified, best) = (next, claim),
                    Err(_) => break next,
                }
                stride = stride.saturating_mul(2);
            };
            (certified, refused, best)
        }
        Err(failure) if guess == 0 => return Err(failure),
        Err(_) => {
            let mut refused = guess;
            loop {
                let next = refused.saturating_sub(stride);
                match at(next) {
                    Ok(claim) => break (next, refused, claim),
                    Err(failure) if next == 0 => return Err(failure),
                    Err(_) => refused = next,
                }
                stride = stride.saturating_mul(2);
            }
        }
    };
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
    if polytope.vertices[0].len() > LyapunovRefusedClaim::LARGEST_ORDER {
        return None;
    }
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

/// Without a program: the Lyapunov equation of a single matrix and region, or one whose solution serves all.
fn direct(vertices: &[DMatrix<f64>], regions: &[PlaneRegion]) -> Option<DMatrix<f64>> {
    match (vertices, regions) {
        ([a], [region @ (PlaneRegion::HalfPlane { .. } | PlaneRegion::Disk { .. })]) => solution(a, region),
        _ => shared_solution(vertices, regions),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equation::serves;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]
        /// Two unlike methods: Newton's in the entries of P finds a common matrix where the general program does, and none where that finds none.
        #[test]
        fn newton_and_the_general_program_agree(
            order in 1_usize..6,
            seed in prop::collection::vec(-1.0..1.0_f64, 75),
            spread in 0.0..2.0_f64,
            which in 0_usize..4,
        ) {
            let number = |x: f64| Number::decimal(x).unwrap();
            let half_plane = PlaneRegion::HalfPlane { rate_per_s: number(0.1) };
            let regions = match which {
                0 => vec![half_plane],
                1 => vec![PlaneRegion::Disk { centre: number(-1.0), radius: number(2.5) }],
                2 => vec![PlaneRegion::Sector { slope: number(1.5) }],
                _ => vec![half_plane, PlaneRegion::Disk { centre: number(0.0), radius: number(4.0) }],
            };
            let vertex = |k: usize| DMatrix::from_fn(order, order, |i, j| {
                seed[5 * i + j] + spread * seed[25 * k + 5 * i + j] - if i == j { 1.5 } else { 0.0 }
            });
            let vertices = [vertex(1), vertex(2)];
            let newton = common_matrix(&vertices, &regions);
            match program(&vertices, &regions, 1) {
                // The program asks for a margin of a thousandth.
                Ok(p) if serves(&p[0], &vertices, &regions) => prop_assert!(newton.is_ok(), "{newton:?}"),
                Err(SolveError::Infeasible) => prop_assert!(newton.is_err()),
                _ => {}
            }
        }
    }
}
