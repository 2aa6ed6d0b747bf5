//! clarabel links and solves with nothing but this crate behind it. One line is what a user writes.

use certune_lapack as _;

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{PSDTriangleConeT, ZeroConeT};
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// Place of entry (i, j), i <= j, in clarabel's stacked upper triangle.
fn place(i: usize, j: usize) -> usize {
    j * (j + 1) / 2 + i
}

/// Off-diagonal entries count twice in an inner product, so each carries a root of two.
fn weight(i: usize, j: usize) -> f64 {
    if i == j { 1.0 } else { std::f64::consts::SQRT_2 }
}

fn stacked(n: usize, entry: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))).map(|(i, j)| weight(i, j) * entry(i, j)).collect()
}

fn solve(q: &[f64], a: &CscMatrix<f64>, b: &[f64], cones: &[SupportedConeT<f64>]) -> (SolverStatus, f64, Vec<f64>) {
    let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
    let p = CscMatrix::zeros((q.len(), q.len()));
    let mut solver = DefaultSolver::new(&p, q, a, b, cones, settings).expect("the problem is well formed");
    solver.solve();
    (solver.solution.status, solver.solution.obj_val, solver.solution.x.clone())
}

/// The smallest trace of X with X and X - B positive semidefinite is the sum of the positive eigenvalues of B; for the
/// path graph's B these are 2 cos(k pi / (n + 1)).
#[test]
fn the_least_trace_above_a_matrix_is_its_positive_part() {
    for n in [2, 3, 4, 7, 12] {
        let size = n * (n + 1) / 2;
        let path = |i: usize, j: usize| if i.abs_diff(j) == 1 { 1.0 } else { 0.0 };
        let q = stacked(n, |i, j| if i == j { 1.0 } else { 0.0 });
        // Rows: s = X, then s = X - B.
        let rows = (0..2 * size).collect();
        let cols = (0..2 * size).map(|row| row % size).collect();
        let a = CscMatrix::new_from_triplets(2 * size, size, rows, cols, vec![-1.0; 2 * size]);
        let mut b = vec![0.0; size];
        b.extend(stacked(n, |i, j| -path(i, j)));
        let (status, trace, x) = solve(&q, &a, &b, &[PSDTriangleConeT(n), PSDTriangleConeT(n)]);
        assert_eq!(status, SolverStatus::Solved);
        let angle = std::f64::consts::PI / (n + 1) as f64;
        let expected: f64 = (1..=n).map(|k| (2.0 * (k as f64 * angle).cos()).max(0.0)).sum();
        assert!((trace - expected).abs() < 1e-6 * expected, "order {n}: {trace} for {expected}");
        let diagonal: f64 = (0..n).map(|i| x[place(i, i)]).sum();
        assert!((diagonal - expected).abs() < 1e-6 * expected);
    }
}

/// A correlation matrix with an entry of 2 does not exist; with 0.5 it does.
#[test]
fn an_infeasible_problem_is_recognised() {
    let n = 6;
    let size = n * (n + 1) / 2;
    for (correlation, expected) in [(2.0, SolverStatus::PrimalInfeasible), (0.5, SolverStatus::Solved)] {
        let mut entries: Vec<(usize, usize, f64)> = (0..n).map(|i| (i, place(i, i), 1.0)).collect();
        entries.push((n, place(0, 1), 1.0));
        entries.extend((0..size).map(|at| (n + 1 + at, at, -1.0)));
        let rows = entries.iter().map(|entry| entry.0).collect();
        let cols = entries.iter().map(|entry| entry.1).collect();
        let values = entries.iter().map(|entry| entry.2).collect();
        let a = CscMatrix::new_from_triplets(n + 1 + size, size, rows, cols, values);
        let mut b = vec![1.0; n];
        b.push(std::f64::consts::SQRT_2 * correlation);
        b.resize(n + 1 + size, 0.0);
        let q = stacked(n, |i, j| if (i, j) == (2, 3) { 1.0 } else { 0.0 });
        let (status, value, _) = solve(&q, &a, &b, &[ZeroConeT(n + 1), PSDTriangleConeT(n)]);
        assert_eq!(status, expected);
        if expected == SolverStatus::Solved {
            // The free entry goes to -1; it counts twice.
            assert!((value + 2.0).abs() < 1e-6, "{value}");
        }
    }
}

#[test]
fn the_same_problem_gives_the_same_bits() {
    let n = 8;
    let size = n * (n + 1) / 2;
    let a = CscMatrix::new_from_triplets(size, size, (0..size).collect(), (0..size).collect(), vec![-1.0; size]);
    let b = stacked(n, |i, j| ((i * j) as f64).sin());
    let q = stacked(n, |i, j| if i == j { 1.0 + i as f64 } else { 0.0 });
    let run = || solve(&q, &a, &b, &[PSDTriangleConeT(n)]);
    let (status, _, first) = run();
    assert_eq!(status, SolverStatus::Solved);
    let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert!((0..5).all(|_| bits(&run().2) == bits(&first)));
}
