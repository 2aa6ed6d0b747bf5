//! Cholesky and LU: backward errors, the index of what fails, and what must not be touched.

mod common;

use common::{Matrix, Real, numbers, product_gap, square};
use proptest::prelude::*;

fn factor<T: Real>(a: &Matrix<T>, uplo: u8) -> (Matrix<T>, i32) {
    let (mut factor, mut info) = (a.clone(), 0);
    T::potrf(uplo, a.rows as i32, &mut factor.data, a.ld as i32, &mut info);
    (factor, info)
}

/// Entry (i, j) of the lower factor, from either triangle.
fn lower<T: Real>(factor: &Matrix<T>, uplo: u8, i: usize, j: usize) -> f64 {
    if i < j {
        0.0
    } else if uplo == b'L' {
        factor.at(i, j)
    } else {
        factor.at(j, i)
    }
}

/// `G Gᵀ + shift I`.
fn gram(n: usize, g: &[f64], shift: f64) -> impl Fn(usize, usize) -> f64 {
    move |i, j| (0..n).map(|l| g[i + l * n] * g[j + l * n]).sum::<f64>() + if i == j { shift } else { 0.0 }
}

/// Factors, then compares `L Lᵀ` with `A`: |gap(i,j)| <= 2 (n + 2) eps sqrt(a_ii a_jj), Higham 2002, theorem 10.3.
fn check_factor<T: Real>(whole: &Matrix<T>, uplo: u8) -> Matrix<T> {
    let n = whole.rows;
    let mut given = whole.clone();
    given.spoil_other_triangle(uplo, f64::NAN);
    let (l, info) = factor(&given, uplo);
    assert_eq!(info, 0);
    for (i, j) in whole.entries() {
        let sum: f64 = (0..n).map(|k| lower(&l, uplo, i, k) * lower(&l, uplo, j, k)).sum();
        let bound = 2.0 * (n as f64 + 2.0) * T::EPS * whole.at(i, i).sqrt() * whole.at(j, j).sqrt();
        assert!((sum - whole.at(i, j)).abs() <= bound, "({i}, {j}): {sum} for {}", whole.at(i, j));
        if (uplo == b'L' && i < j) || (uplo == b'U' && i > j) {
            assert!(l.at(i, j).is_nan(), "the other triangle is written");
        }
    }
    assert!((0..n).all(|i| l.at(i, i) > 0.0) && l.padding_is_intact());
    l
}

fn check_cholesky_solve<T: Real>(n: usize, g: &[f64], rhs: &[f64], uplo: u8, extra: usize) {
    let a = Matrix::<T>::from_fn(n, n, extra, gram(n, g, 0.5));
    let l = check_factor(&a, uplo);
    let b = Matrix::<T>::from_fn(n, 3, extra + 1, |i, j| rhs[(i + j * n) % rhs.len()]);
    let (mut x, mut info) = (b.clone(), 0);
    T::potrs(uplo, n as i32, 3, &l.data, l.ld as i32, &mut x.data, x.ld as i32, &mut info);
    assert_eq!(info, 0);
    let gap = product_gap((n, n, 3), |i, k| a.at(i, k), |k, j| x.at(k, j), |i, j| b.at(i, j));
    // Higham 2002, theorem 10.4: the residual is of order n² eps ‖A‖ ‖x‖ in the largest entry.
    assert!(gap <= 4.0 * (n * n) as f64 * T::EPS * a.max_abs() * x.max_abs(), "residual {gap}");
    assert!(x.padding_is_intact());
}

/// Solves, then compares `A x` with `b` and `P A` with `L U`.
fn check_lu<T: Real>(a: &Matrix<T>, rhs: &[f64]) {
    let n = a.rows;
    let b = Matrix::<T>::from_fn(n, 2, 1, |i, j| rhs[(i + j * n) % rhs.len()]);
    let (mut lu, mut x, mut pivots, mut info) = (a.clone(), b.clone(), vec![0; n], 0);
    T::gesv(n as i32, 2, &mut lu.data, a.ld as i32, &mut pivots, &mut x.data, b.ld as i32, &mut info);
    assert_eq!(info, 0);
    let growth = lu.max_abs().max(a.max_abs());
    let gap = product_gap((n, n, 2), |i, k| a.at(i, k), |k, j| x.at(k, j), |i, j| b.at(i, j));
    // Higham 2002, theorem 9.4, with the growth that was seen in place of its bound.
    assert!(gap <= 8.0 * (n * n) as f64 * T::EPS * (growth * x.max_abs() + b.max_abs()), "residual {gap}");
    let mut rows: Vec<usize> = (0..n).collect();
    for (i, &pivot) in pivots.iter().enumerate() {
        assert!(pivot as usize > i && pivot as usize <= n, "exchanges only look down");
        rows.swap(i, pivot as usize - 1);
    }
    let unit_lower = |i: usize, k: usize| {
        if i == k {
            1.0
        } else if i > k {
            lu.at(i, k)
        } else {
            0.0
        }
    };
    let upper = |k: usize, j: usize| if k <= j { lu.at(k, j) } else { 0.0 };
    let gap = product_gap((n, n, n), unit_lower, upper, |i, j| a.at(rows[i], j));
    assert!(gap <= 4.0 * n as f64 * T::EPS * growth, "P A - L U: {gap}");
    assert!(lu.entries().all(|(i, j)| i <= j || lu.at(i, j).abs() <= 1.0), "partial pivoting bounds L");
    assert!(lu.padding_is_intact() && x.padding_is_intact());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn cholesky_reconstructs_and_solves((n, g) in square(1..31), rhs in numbers(30, 3), extra in 0..3_usize) {
        for uplo in *b"ULul" {
            let uplo = uplo.to_ascii_uppercase();
            check_cholesky_solve::<f64>(n, &g, &rhs, uplo, extra);
            check_cholesky_solve::<f32>(n, &g, &rhs, uplo, extra);
        }
    }

    #[test]
    fn cholesky_names_the_first_minor_that_is_not_positive((n, g) in square(1..31), place in 0.0..1.0_f64) {
        // L D Lᵀ with unit lower L: the leading minors have the signs of the products of D.
        let bad = ((n as f64 * place) as usize).min(n - 1);
        let l = |i: usize, k: usize| if i == k { 1.0 } else if i > k { 0.3 * g[i + k * n] } else { 0.0 };
        let d = |k: usize| if k == bad { -0.5 } else { 1.0 };
        let a = Matrix::<f64>::from_fn(n, n, 0, |i, j| (0..n).map(|k| l(i, k) * d(k) * l(j, k)).sum());
        prop_assert_eq!(factor(&a, b'L').1, bad as i32 + 1);
        prop_assert_eq!(factor(&a, b'U').1, bad as i32 + 1);
    }

    #[test]
    fn cholesky_refuses_nan_and_infinity(
        (n, g) in square(1..31), at in (0.0..1.0_f64, 0.0..1.0_f64), value in prop_oneof![Just(f64::NAN), Just(f64::INFINITY)]
    ) {
        let mut a = Matrix::<f64>::from_fn(n, n, 0, gram(n, &g, 0.5));
        let (i, j) = ((n as f64 * at.0) as usize, (n as f64 * at.1) as usize);
        a.set(i, j, value);
        a.set(j, i, value);
        prop_assert_eq!(factor(&a, b'L').1, i.max(j) as i32 + 1);
        prop_assert_eq!(factor(&a, b'U').1, i.max(j) as i32 + 1);
    }

    #[test]
    fn lu_reconstructs_and_solves((n, entries) in square(1..31), rhs in numbers(30, 2), extra in 0..3_usize) {
        check_lu(&Matrix::<f64>::from_fn(n, n, extra, |i, j| entries[i + j * n]), &rhs);
        check_lu(&Matrix::<f32>::from_fn(n, n, extra, |i, j| entries[i + j * n]), &rhs);
    }

    #[test]
    fn lu_refuses_nan_and_leaves_its_arguments((n, mut entries) in square(1..31), at in 0.0..1.0_f64) {
        let at = (at * entries.len() as f64) as usize;
        entries[at] = f64::NAN;
        let (mut a, mut b, mut pivots, mut info) = (entries.clone(), vec![1.0; n], vec![0; n], 0);
        f64::gesv(n as i32, 1, &mut a, n as i32, &mut pivots, &mut b, n as i32, &mut info);
        prop_assert!(info > 0 && info as usize <= n);
        prop_assert_eq!(b, vec![1.0; n]);
        prop_assert_eq!(pivots, vec![0; n]);
    }
}

#[test]
fn orders_beyond_the_blocks_of_the_kernels() {
    for n in [63, 64, 65, 128, 150] {
        let g: Vec<f64> = (0..n * n).map(|i| (i as f64 * 0.7).sin()).collect();
        check_cholesky_solve::<f64>(n, &g, &g, b'L', 1);
        check_cholesky_solve::<f32>(n, &g, &g, b'U', 0);
        check_lu(&Matrix::<f64>::from_fn(n, n, 1, |i, j| ((i * i + 3 * j) as f64).cos() + g[i + j * n]), &g);
    }
}

#[test]
fn cholesky_of_nearly_singular_matrices() {
    // Hilbert: condition 1e13 at order 10. Its smallest eigenvalue is far below the rounding of the largest entry.
    for n in [4, 8, 10] {
        for uplo in *b"UL" {
            check_factor(&Matrix::<f64>::from_fn(n, n, 0, |i, j| 1.0 / (i + j + 1) as f64), uplo);
        }
    }
    // A diagonal over 300 decades, and numbers near both ends of the range.
    let graded = Matrix::<f64>::from_fn(7, 7, 0, |i, j| if i == j { 10.0_f64.powi(50 * i as i32 - 150) } else { 0.0 });
    check_factor(&graded, b'L');
    check_factor(&Matrix::<f64>::from_fn(5, 5, 0, |i, j| if i == j { 4e-300 } else { 1e-300 }), b'U');
    check_factor(&Matrix::<f64>::from_fn(5, 5, 0, |i, j| if i == j { 4e300 } else { 1e300 }), b'U');
}

#[test]
fn cholesky_of_singular_matrices_names_the_minor() {
    assert_eq!(factor(&Matrix::<f64>::filled(5, 5, 0, 0.0), b'L').1, 1);
    assert_eq!(factor(&Matrix::<f64>::filled(5, 5, 0, 1.0), b'L').1, 2, "rank one");
    assert_eq!(factor(&Matrix::<f32>::filled(1, 1, 0, -1.0), b'U').1, 1);
    let mut last = Matrix::<f64>::from_fn(100, 100, 0, common::identity);
    last.set(99, 99, -1e-30);
    assert_eq!(factor(&last, b'U').1, 100);
}

#[test]
fn lu_of_singular_matrices_names_the_column() {
    let solve = |n: usize, entry: fn(usize, usize) -> f64| {
        let mut a = Matrix::<f64>::from_fn(n, n, 0, entry);
        let (mut b, mut pivots, mut info) = (vec![1.0; n], vec![0; n], 0);
        f64::gesv(n as i32, 1, &mut a.data, n as i32, &mut pivots, &mut b, n as i32, &mut info);
        (info, b)
    };
    assert_eq!(solve(4, |_, _| 0.0), (1, vec![1.0; 4]));
    assert_eq!(solve(4, |_, _| 1.0), (2, vec![1.0; 4]));
    assert_eq!(solve(30, |i, j| if i == j && i != 20 { 1.0 } else { 0.0 }), (21, vec![1.0; 30]));
    assert_eq!(solve(3, |i, j| if i + j == 2 { 2.0 } else { 0.0 }), (0, vec![0.5; 3]), "needs every exchange");
}

#[test]
fn lu_of_an_ill_conditioned_matrix_has_a_small_residual() {
    // Hilbert at order 12 has condition 1e16: the solution is lost, the residual is not.
    check_lu(&Matrix::<f64>::from_fn(12, 12, 0, |i, j| 1.0 / (i + j + 1) as f64), &[1.0, -1.0, 0.5]);
    // Wilkinson's matrix: the pivots double at each step.
    let wilkinson = |i: usize, j: usize| {
        if i == j || j == 19 {
            1.0
        } else if i > j {
            -1.0
        } else {
            0.0
        }
    };
    check_lu(&Matrix::<f64>::from_fn(20, 20, 0, wilkinson), &[1.0, 2.0, -3.0]);
}

#[test]
fn illegal_arguments_have_their_position() {
    let (mut a, mut b, mut pivots) = ([4.0; 9], [1.0; 3], [0; 3]);
    let mut potrf = |uplo, n, lda| {
        let mut info = 0;
        f64::potrf(uplo, n, &mut a, lda, &mut info);
        info
    };
    assert_eq!((potrf(b'X', 3, 3), potrf(b'U', -1, 3), potrf(b'L', 3, 2), potrf(b'L', 0, 0)), (-1, -2, -4, -4));
    assert_eq!(potrf(b'L', 0, 1), 0);
    let mut potrs = |uplo, n, nrhs, lda, ldb| {
        let mut info = 0;
        f64::potrs(uplo, n, nrhs, &[4.0; 9], lda, &mut b, ldb, &mut info);
        info
    };
    assert_eq!((potrs(b'X', 3, 1, 3, 3), potrs(b'U', -1, 1, 3, 3), potrs(b'U', 3, -1, 3, 3)), (-1, -2, -3));
    assert_eq!((potrs(b'U', 3, 1, 2, 3), potrs(b'U', 3, 1, 3, 2), potrs(b'U', 3, 0, 3, 3)), (-5, -7, 0));
    let mut gesv = |n, nrhs, lda, ldb| {
        let mut info = 0;
        f64::gesv(n, nrhs, &mut [4.0; 9], lda, &mut pivots, &mut [1.0; 3], ldb, &mut info);
        info
    };
    assert_eq!((gesv(-1, 1, 3, 3), gesv(3, -1, 3, 3), gesv(3, 1, 2, 3), gesv(3, 1, 3, 2)), (-1, -2, -4, -7));
    assert_eq!(gesv(0, 1, 1, 1), 0);
}

#[test]
fn a_result_does_not_depend_on_where_the_arrays_lie() {
    let n = 42_usize;
    let entry = |i: usize, j: usize| ((i * j) as f64).sin() + ((j * i) as f64).cos() + if i == j { 90.0 } else { 0.0 };
    let source: Vec<f64> = (0..n * n).map(|at| entry(at % n, at / n)).collect();
    let bits = |shift: usize| {
        let (mut a, mut b, mut pivots, mut info) = (vec![0.0; shift], vec![1.0; shift + n], vec![0; n], 0);
        a.extend(&source);
        let mut l = a.clone();
        f64::potrf(b'L', n as i32, &mut l[shift..], n as i32, &mut info);
        assert_eq!(info, 0);
        f64::gesv(n as i32, 1, &mut a[shift..], n as i32, &mut pivots, &mut b[shift..], n as i32, &mut info);
        l[shift..].iter().chain(&b[shift..]).map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert!((1..8).all(|shift| bits(shift) == bits(0)));
}
