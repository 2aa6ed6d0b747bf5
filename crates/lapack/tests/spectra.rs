//! Eigenvalues and singular values: residuals, orthogonality, order, known spectra, and what must not be touched.

mod common;

use common::{Matrix, Real, Wanted, eigen, identity, numbers, orthogonal, orthogonality_gap, product_gap, square, svd};
use proptest::prelude::*;

/// How many `n eps ‖A‖` a backward-stable spectral routine may lose; a wrong vector loses 1 / (n eps).
const SLACK: f64 = 10.0;

fn bound<T: Real>(size: usize) -> f64 {
    SLACK * size as f64 * T::EPS
}

/// `Q diag(spectrum) Qᵀ`, symmetric to the bit.
fn symmetric<T: Real>(spectrum: &[f64], draws: &[f64], extra: usize) -> Matrix<T> {
    let n = spectrum.len();
    let q = orthogonal(n, draws);
    Matrix::from_fn(n, n, extra, |i, j| {
        let (i, j) = (i.min(j), i.max(j));
        (0..n).map(|k| q[i + k * n] * spectrum[k] * q[j + k * n]).sum()
    })
}

/// Decomposes with and without vectors and from both triangles, and checks everything that defines the result.
fn check_eigen<T: Real>(a: &Matrix<T>, extra: usize) -> Vec<f64> {
    let n = a.rows;
    let norm = a.max_abs();
    let mut values = Vec::new();
    for uplo in *b"UL" {
        let mut given = a.clone();
        given.spoil_other_triangle(uplo, f64::NAN);
        let found = eigen(&given, b'V', uplo, Wanted::All, extra);
        assert_eq!((found.info, found.count), (0, n));
        values = found.values.iter().map(|w| w.wide()).collect();
        assert!(values.is_sorted(), "ascending: {values:?}");
        let v = &found.vectors;
        assert!(orthogonality_gap(v) <= bound::<T>(n), "orthogonality {}", orthogonality_gap(v));
        // ‖A V - V W‖ in the largest entry, against n max|a| >= ‖A‖.
        let gap = product_gap((n, n, n), |i, k| a.at(i, k), |k, j| v.at(k, j), |i, j| v.at(i, j) * values[j]);
        assert!(gap <= bound::<T>(n) * n as f64 * norm, "residual {gap} at norm {norm}");
        assert!(v.padding_is_intact());
        assert_eq!(found.support, [1, n as i32].repeat(n));
        let alone = eigen(&given, b'N', uplo, Wanted::All, extra);
        assert_eq!((alone.info, alone.count), (0, n));
        for (with, without) in values.iter().zip(&alone.values) {
            assert!((with - without.wide()).abs() <= bound::<T>(n) * n as f64 * norm);
        }
        assert!(alone.vectors.data.iter().all(|x| x.wide().is_nan()), "job N writes no vector");
    }
    values
}

fn check_known_spectrum<T: Real>(spectrum: &[f64], draws: &[f64], extra: usize) {
    let mut sorted = spectrum.to_vec();
    sorted.sort_by(f64::total_cmp);
    let largest = sorted.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let found = check_eigen(&symmetric::<T>(spectrum, draws, extra), extra);
    for (found, expected) in found.iter().zip(&sorted) {
        // Weyl: an eigenvalue moves by no more than the norm of the error.
        assert!((found - expected).abs() <= bound::<T>(sorted.len()) * largest, "{found} for {expected}");
    }
}

/// Checks the decomposition that `jobs` asks for: shapes, orthogonality, order, and `U S Vᵀ` where both are there.
fn check_svd<T: Real>(a: &Matrix<T>, jobs: (u8, u8), by_qr: bool, extra: usize) -> Vec<f64> {
    let (m, n) = (a.rows, a.cols);
    let (count, most) = (m.min(n), m.max(n));
    let found = svd(a, jobs, by_qr, extra);
    assert_eq!(found.info, 0);
    let s: Vec<f64> = found.values.iter().map(|s| s.wide()).collect();
    assert!(s.is_sorted_by(|x, y| x >= y) && s.iter().all(|&x| x >= 0.0), "descending, not negative: {s:?}");
    let (u, v) = (&found.u, found.vt.transposed(0));
    assert!(orthogonality_gap(u) <= bound::<T>(most) && orthogonality_gap(&v) <= bound::<T>(most));
    if jobs.0 != b'N' && jobs.1 != b'N' {
        let gap = product_gap((m, count, n), |i, k| u.at(i, k) * s[k], |k, j| v.at(j, k), |i, j| a.at(i, j));
        assert!(gap <= bound::<T>(most) * s[0], "reconstruction {gap} at norm {}", s[0]);
    }
    let squares: f64 = a.entries().map(|(i, j)| a.at(i, j) / a.max_abs().max(1e-300)).map(|x| x * x).sum();
    let from_values = s.iter().map(|s| s / a.max_abs().max(1e-300)).map(|x| x * x).sum::<f64>();
    assert!((squares - from_values).abs() <= bound::<T>(most) * squares.max(1e-300), "Frobenius norm");
    assert!(found.u.padding_is_intact() && found.vt.padding_is_intact());
    s
}

const JOBS: [(u8, u8); 9] = [
    (b'S', b'S'),
    (b'A', b'A'),
    (b'N', b'N'),
    (b'S', b'N'),
    (b'N', b'S'),
    (b'A', b'S'),
    (b'S', b'A'),
    (b'A', b'N'),
    (b'N', b'A'),
];

fn check_every_svd<T: Real>(a: &Matrix<T>, extra: usize) -> Vec<f64> {
    let first = check_svd(a, JOBS[0], false, extra);
    for jobs in JOBS {
        for by_qr in [false, true] {
            for (x, y) in check_svd(a, jobs, by_qr, extra).iter().zip(&first) {
                assert!((x - y).abs() <= bound::<T>(a.rows.max(a.cols)) * first[0]);
            }
        }
    }
    first
}

/// `U diag(s) Vᵀ` of shape n x n.
fn with_singular_values<T: Real>(s: &[f64], left: &[f64], right: &[f64]) -> Matrix<T> {
    let n = s.len();
    let (u, v) = (orthogonal(n, left), orthogonal(n, right));
    Matrix::from_fn(n, n, 0, |i, j| (0..n).map(|k| u[i + k * n] * s[k] * v[j + k * n]).sum())
}

fn check_known_singular_values<T: Real>(s: &[f64], left: &[f64], right: &[f64]) {
    let mut sorted = s.to_vec();
    sorted.sort_by(|x, y| y.total_cmp(x));
    for (found, expected) in check_every_svd(&with_singular_values::<T>(s, left, right), 0).iter().zip(&sorted) {
        assert!((found - expected).abs() <= bound::<T>(s.len()) * sorted[0], "{found} for {expected}");
    }
}

/// Spectra that are hard: clustered, repeated, graded over 24 decades, of low rank.
fn hard_spectrum(n: usize, kind: u8, noise: &[f64]) -> Vec<f64> {
    (0..n)
        .map(|k| match kind {
            0 => 1.0 + 1e-13 * noise[k],
            1 => [1.0, -1.0, 2.0][k % 3],
            2 => 10.0_f64.powf(-12.0 + 24.0 * k as f64 / n.max(2) as f64) * noise[k].signum(),
            3 => {
                if k < n.div_ceil(4) {
                    noise[k]
                } else {
                    0.0
                }
            }
            4 => {
                if k == 0 {
                    1.0
                } else {
                    1e-15 * noise[k]
                }
            }
            _ => noise[k],
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn eigen_of_random_matrices((n, entries) in square(1..31), extra in 0..3_usize) {
        let entry = |i: usize, j: usize| entries[i.min(j) + i.max(j) * n];
        check_eigen(&Matrix::<f64>::from_fn(n, n, extra, entry), extra);
        check_eigen(&Matrix::<f32>::from_fn(n, n, extra, entry), extra);
    }

    #[test]
    fn eigen_of_hard_spectra((n, draws) in square(1..31), noise in numbers(30, 1), kind in 0..6_u8) {
        let spectrum = hard_spectrum(n, kind, &noise);
        check_known_spectrum::<f64>(&spectrum, &draws, 0);
        check_known_spectrum::<f32>(&spectrum, &draws, 1);
    }

    #[test]
    fn eigen_of_a_part_of_the_spectrum((n, entries) in square(1..31), ends in (0.0..1.0_f64, 0.0..1.0_f64)) {
        let a = Matrix::<f64>::from_fn(n, n, 0, |i, j| entries[i.min(j) + i.max(j) * n]);
        let all = eigen(&a, b'V', b'U', Wanted::All, 0);
        let place = |end: f64| ((n as f64 * end) as usize).min(n - 1);
        let (first, last) = (place(ends.0).min(place(ends.1)), place(ends.0).max(place(ends.1)));
        let parts = [
            (Wanted::Places(first as i32 + 1, last as i32 + 1), first..last + 1),
            // Half open: the lower end is left out, the upper one is in.
            (Wanted::Values(all.values[first] - 1e-9, all.values[last]), first..last + 1),
            (Wanted::Values(all.values[first], all.values[last] + 1e-9), first + 1..last + 1),
            (Wanted::Values(10.0 * n as f64, 11.0 * n as f64), 0..0),
        ];
        // Random values are further apart than the margin of 1e-9, except by a chance that is left out here.
        prop_assume!(all.values.windows(2).all(|pair| pair[1] - pair[0] > 1e-8));
        for (wanted, expected) in parts {
            let part = eigen(&a, b'V', b'U', wanted, 0);
            prop_assert_eq!((part.info, part.count), (0, expected.len()));
            prop_assert_eq!(&part.values[..part.count], &all.values[expected.clone()]);
            prop_assert_eq!(&part.vectors.data[..n * part.count], &all.vectors.data[n * expected.start..n * expected.end]);
            prop_assert!(part.values[part.count..].iter().all(|x| x.is_nan()), "no more is written");
        }
    }

    #[test]
    fn svd_of_random_matrices(
        (m, n) in (1..31_usize, 1..31_usize), entries in numbers(30, 30), extra in 0..3_usize
    ) {
        check_every_svd(&Matrix::<f64>::from_fn(m, n, extra, |i, j| entries[i + j * m]), extra);
        check_every_svd(&Matrix::<f32>::from_fn(m, n, extra, |i, j| entries[i + j * m]), extra);
    }

    #[test]
    fn svd_of_hard_spectra((n, left) in square(1..31), right in numbers(30, 30), noise in numbers(30, 1), kind in 0..6_u8) {
        let s: Vec<f64> = hard_spectrum(n, kind, &noise).iter().map(|s| s.abs()).collect();
        check_known_singular_values::<f64>(&s, &left, &right);
        check_known_singular_values::<f32>(&s, &left, &right);
    }

    #[test]
    fn nan_and_infinity_are_an_error(
        (n, mut entries) in square(1..31), at in 0.0..1.0_f64, value in prop_oneof![Just(f64::NAN), Just(-f64::INFINITY)]
    ) {
        let at = (at * entries.len() as f64) as usize;
        entries[at] = value;
        let a = Matrix::<f64>::from_fn(n, n, 0, |i, j| entries[i + j * n]);
        let uplo = if at % n >= at / n { b'L' } else { b'U' };
        prop_assert!(eigen(&a, b'V', uplo, Wanted::All, 0).info > 0);
        prop_assert!(eigen(&a, b'N', uplo, Wanted::All, 0).info > 0);
        prop_assert!(svd(&a, (b'S', b'S'), false, 0).info > 0);
        prop_assert!(svd(&a, (b'N', b'N'), true, 0).info > 0);
    }
}

#[test]
fn matrices_with_exact_answers() {
    for n in [1, 2, 3, 4, 17, 42] {
        let zero = Matrix::<f64>::filled(n, n, 0, 0.0);
        assert_eq!(check_eigen(&zero, 0), vec![0.0; n]);
        assert_eq!(check_every_svd(&zero, 0), vec![0.0; n]);
        let one = Matrix::<f64>::from_fn(n, n, 0, identity);
        assert_eq!(check_eigen(&one, 0), vec![1.0; n]);
        assert_eq!(check_every_svd(&one, 0), vec![1.0; n]);
        let down = Matrix::<f64>::from_fn(n, n, 0, |i, j| if i == j { (n - i) as f64 - 2.0 } else { 0.0 });
        for (k, found) in check_eigen(&down, 0).iter().enumerate() {
            assert!((found - (k as f64 - 1.0)).abs() <= 2.0 * f64::EPSILON * n as f64, "{found}");
        }
    }
    let scalar = Matrix::<f64>::filled(1, 1, 0, -3.0);
    assert_eq!((check_eigen(&scalar, 0), check_every_svd(&scalar, 0)), (vec![-3.0], vec![3.0]));
}

#[test]
fn known_spectra_of_textbook_matrices() {
    // Second difference: 2 - 2 cos(k pi / (n + 1)).
    for n in [5, 42, 90] {
        let a = Matrix::<f64>::from_fn(n, n, 0, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        for (k, found) in check_eigen(&a, 0).iter().enumerate() {
            let expected = 2.0 - 2.0 * ((k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64).cos();
            assert!((found - expected).abs() <= bound::<f64>(n) * 4.0);
        }
    }
    // Wilkinson's W21+: pairs that agree to fourteen digits.
    let wilkinson = Matrix::<f64>::from_fn(21, 21, 0, |i, j| match i.abs_diff(j) {
        0 => (i as f64 - 10.0).abs(),
        1 => 1.0,
        _ => 0.0,
    });
    let values = check_eigen(&wilkinson, 0);
    assert!((values[20] - 10.746_194_182_903_393).abs() < 1e-13 && values[20] - values[19] < 1e-13);
    // Hilbert and Kahan: tiny singular values beside large ones.
    check_every_svd(&Matrix::<f64>::from_fn(20, 20, 0, |i, j| 1.0 / (i + j + 1) as f64), 0);
    let kahan = |i: usize, j: usize| match i.cmp(&j) {
        std::cmp::Ordering::Greater => 0.0,
        order => 0.3_f64.powi(i as i32) * if order.is_eq() { 1.0 } else { -(0.91_f64.sqrt()) },
    };
    check_every_svd(&Matrix::<f64>::from_fn(30, 30, 0, kahan), 0);
}

#[test]
fn numbers_near_both_ends_of_the_range() {
    for scale in [1e-300, 1e-150, 1e150, 1e300] {
        let entry = |i: usize, j: usize| scale * (((i * j) as f64 + 0.3).sin() + ((i + j) as f64).cos());
        let a = Matrix::<f64>::from_fn(13, 13, 0, entry);
        check_eigen(&a, 0);
        check_svd(&a, (b'S', b'S'), false, 0);
    }
    let a = Matrix::<f32>::from_fn(9, 9, 0, |i, j| 1e37 * ((i + j) as f64).cos());
    check_eigen(&a, 0);
    // The largest eigenvalue would be 1.7e308 * 4: it cannot be said, so it is not.
    assert!(eigen(&Matrix::<f64>::filled(4, 4, 0, 1.7e308), b'V', b'U', Wanted::All, 0).info > 0);
}

#[test]
fn orders_beyond_the_blocks_of_the_kernels() {
    for n in [42, 64, 65, 129] {
        let entry = |i: usize, j: usize| ((i * i * j + j * j * i) as f64).sin();
        check_eigen(&Matrix::<f64>::from_fn(n, n, 0, entry), 1);
        check_eigen(&Matrix::<f32>::from_fn(n, n, 0, entry), 0);
        check_svd(&Matrix::<f64>::from_fn(n, n, 0, entry), (b'S', b'S'), false, 0);
    }
    for n in [42, 65] {
        let entry = |i: usize, j: usize| ((i * i * j + j * j * i) as f64).sin();
        check_svd(&Matrix::<f64>::from_fn(n, 2 * n + 1, 0, entry), (b'S', b'S'), true, 0);
        check_svd(&Matrix::<f64>::from_fn(2 * n, n, 0, entry), (b'A', b'A'), false, 0);
    }
}

#[test]
fn illegal_arguments_have_their_position() {
    let syevr = |jobz, range, uplo, n, lda, (vl, vu), (il, iu), ldz, lwork, liwork| {
        let (mut w, mut z, mut work, mut info, mut m) = ([0.0; 4], [0.0; 16], [0.0; 104], 0, 0);
        f64::syevr(
            jobz,
            range,
            uplo,
            n,
            &mut [1.0; 16],
            lda,
            vl,
            vu,
            il,
            iu,
            -1.0,
            &mut m,
            &mut w,
            &mut z,
            ldz,
            &mut [0; 8],
            &mut work,
            lwork,
            &mut [0; 40],
            liwork,
            &mut info,
        );
        info
    };
    let (v, i) = ((0.0, 1.0), (1, 4));
    assert_eq!(syevr(b'V', b'A', b'U', 4, 4, v, i, 4, 104, 40), 0);
    assert_eq!(syevr(b'X', b'A', b'U', 4, 4, v, i, 4, 104, 40), -1);
    assert_eq!(syevr(b'V', b'X', b'U', 4, 4, v, i, 4, 104, 40), -2);
    assert_eq!(syevr(b'V', b'A', b'X', 4, 4, v, i, 4, 104, 40), -3);
    assert_eq!(syevr(b'V', b'A', b'U', -4, 4, v, i, 4, 104, 40), -4);
    assert_eq!(syevr(b'V', b'A', b'U', 4, 3, v, i, 4, 104, 40), -6);
    assert_eq!(syevr(b'V', b'V', b'U', 4, 4, (1.0, 1.0), i, 4, 104, 40), -8);
    assert_eq!(syevr(b'V', b'V', b'U', 4, 4, (f64::NAN, 1.0), i, 4, 104, 40), -8);
    assert_eq!(syevr(b'V', b'I', b'U', 4, 4, v, (0, 4), 4, 104, 40), -9);
    assert_eq!(syevr(b'V', b'I', b'U', 4, 4, v, (3, 2), 4, 104, 40), -10);
    assert_eq!(syevr(b'V', b'I', b'U', 4, 4, v, (1, 5), 4, 104, 40), -10);
    assert_eq!(syevr(b'V', b'A', b'U', 4, 4, v, i, 3, 104, 40), -15);
    assert_eq!(syevr(b'N', b'A', b'U', 4, 4, v, i, 1, 104, 40), 0);
    assert_eq!(syevr(b'V', b'A', b'U', 4, 4, v, i, 4, 103, 40), -18);
    assert_eq!(syevr(b'V', b'A', b'U', 4, 4, v, i, 4, 104, 39), -20);
    assert_eq!(syevr(b'V', b'I', b'U', 0, 1, v, (1, 0), 1, 1, 1), 0);

    let gesdd = |jobz, m, n, lda, ldu, ldvt, lwork| {
        let (mut s, mut u, mut vt, mut info) = ([0.0; 4], [0.0; 16], [0.0; 16], 0);
        let mut work = [0.0; 120];
        f64::gesdd(
            jobz,
            m,
            n,
            &mut [1.0; 16],
            lda,
            &mut s,
            &mut u,
            ldu,
            &mut vt,
            ldvt,
            &mut work,
            lwork,
            &mut [0; 32],
            &mut info,
        );
        info
    };
    assert_eq!(gesdd(b'S', 4, 3, 4, 4, 3, 120), 0);
    assert_eq!(gesdd(b'O', 4, 3, 4, 4, 3, 120), -1, "job O is not supported, and says so");
    assert_eq!((gesdd(b'S', -4, 3, 4, 4, 3, 120), gesdd(b'S', 4, -3, 4, 4, 3, 120)), (-2, -3));
    assert_eq!((gesdd(b'S', 4, 3, 3, 4, 3, 120), gesdd(b'S', 4, 3, 4, 3, 3, 120)), (-5, -8));
    assert_eq!((gesdd(b'S', 4, 3, 4, 4, 2, 120), gesdd(b'A', 3, 4, 3, 3, 3, 120)), (-10, -10));
    assert_eq!((gesdd(b'S', 4, 3, 4, 4, 3, 5), gesdd(b'S', 0, 3, 1, 1, 1, 1)), (-12, 0));

    let gesvd = |jobu, jobvt, m, lda, ldu, ldvt, lwork| {
        let (mut s, mut u, mut vt, mut info) = ([0.0; 4], [0.0; 16], [0.0; 16], 0);
        let mut work = [0.0; 120];
        f64::gesvd(
            jobu,
            jobvt,
            m,
            3,
            &mut [1.0; 16],
            lda,
            &mut s,
            &mut u,
            ldu,
            &mut vt,
            ldvt,
            &mut work,
            lwork,
            &mut info,
        );
        info
    };
    assert_eq!(gesvd(b'S', b'A', 4, 4, 4, 3, 120), 0);
    assert_eq!((gesvd(b'O', b'S', 4, 4, 4, 3, 120), gesvd(b'S', b'O', 4, 4, 4, 3, 120)), (-1, -2));
    assert_eq!((gesvd(b'S', b'S', -4, 4, 4, 3, 120), gesvd(b'S', b'S', 4, 3, 4, 3, 120)), (-3, -6));
    assert_eq!((gesvd(b'S', b'S', 4, 4, 3, 3, 120), gesvd(b'S', b'S', 4, 4, 4, 2, 120)), (-9, -11));
    assert_eq!(gesvd(b'S', b'S', 4, 4, 4, 3, 14), -13);
}

#[test]
fn a_result_does_not_depend_on_where_the_arrays_lie() {
    let n = 42_usize;
    let source: Vec<f64> = (0..n * n).map(|at| ((at % n) as f64 * (at / n) as f64).sin()).collect();
    let bits = |shift: usize| {
        let (mut a, mut iwork, mut count, mut info) = (vec![0.0; shift], vec![0; 10 * n], 0, 0);
        a.extend(&source);
        let (mut w, mut z, mut u) = (vec![0.0; shift + n], vec![0.0; shift + n * n], vec![0.0; shift + n * n]);
        let mut work = vec![0.0; 4 * n * n + 26 * n];
        let (order, room) = (n as i32, work.len() as i32);
        let integers = iwork.len() as i32;
        f64::syevr(
            b'V',
            b'A',
            b'U',
            order,
            &mut a.clone()[shift..],
            order,
            0.0,
            0.0,
            0,
            0,
            -1.0,
            &mut count,
            &mut w[shift..],
            &mut z[shift..],
            order,
            &mut vec![0; 2 * n],
            &mut work,
            room,
            &mut iwork,
            integers,
            &mut info,
        );
        assert_eq!(info, 0);
        let mut seen: Vec<u64> = w[shift..].iter().chain(&z[shift..]).map(|x| x.to_bits()).collect();
        f64::gesdd(
            b'S',
            order,
            order,
            &mut a[shift..],
            order,
            &mut w[shift..],
            &mut u[shift..],
            order,
            &mut z[shift..],
            order,
            &mut work,
            room,
            &mut iwork,
            &mut info,
        );
        assert_eq!(info, 0);
        seen.extend(w[shift..].iter().chain(&z[shift..]).chain(&u[shift..]).map(|x| x.to_bits()));
        seen
    };
    assert!((1..8).all(|shift| bits(shift) == bits(0)));
}
