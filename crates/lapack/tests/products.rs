//! BLAS: every option of every product against naive sums, and what must not be touched.

#![expect(clippy::float_cmp, reason = "what must not be touched, and sums of small integers, are exact")]

mod common;

use common::{Matrix, PADDING, Real, numbers};
use proptest::prelude::*;

/// Componentwise bound of a sum of `k` products and one more term, each rounded: `(k + 4) eps sum |terms|`, doubled.
fn is_close<T: Real>(found: f64, expected: f64, k: usize, terms: f64) -> bool {
    (found - expected).abs() <= 2.0 * (k as f64 + 4.0) * T::EPS * terms + f64::from(f32::MIN_POSITIVE)
}

/// `sum_l x(l) y(l)` and the sum of its absolute terms.
fn sums(k: usize, x: impl Fn(usize) -> f64, y: impl Fn(usize) -> f64) -> (f64, f64) {
    (0..k).map(|l| x(l) * y(l)).fold((0.0, 0.0), |(sum, size), term| (sum + term, size + term.abs()))
}

const FACTORS: [(f64, f64); 5] = [(1.0, 0.0), (1.0, 1.0), (-0.75, 0.5), (0.0, 2.0), (0.0, 0.0)];

#[derive(Debug)]
struct Case {
    m: usize,
    n: usize,
    k: usize,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    extra: usize,
}

fn case() -> impl Strategy<Value = Case> {
    (1..20_usize, 1..20_usize, 0..20_usize, 0..3_usize).prop_flat_map(|(m, n, k, extra)| {
        let side = m.max(n).max(k);
        (numbers(side, side), numbers(side, side), numbers(side, side)).prop_map(move |(a, b, c)| Case {
            m,
            n,
            k,
            a,
            b,
            c,
            extra,
        })
    })
}

/// `rows x cols` numbers, stored transposed when `trans` says so.
fn stored<T: Real>(from: &[f64], rows: usize, cols: usize, trans: u8, extra: usize) -> Matrix<T> {
    let logical = Matrix::from_fn(rows, cols, extra, |i, j| from[i + j * rows]);
    if trans == b'N' { logical } else { logical.transposed(extra) }
}

fn at<T: Real>(x: &Matrix<T>, trans: u8, i: usize, j: usize) -> f64 {
    if trans == b'N' { x.at(i, j) } else { x.at(j, i) }
}

fn old<T: Real>(beta: f64, c: f64) -> f64 {
    if beta == 0.0 { 0.0 } else { T::of(beta).wide() * c }
}

fn check_gemm<T: Real>(case: &Case) {
    let Case { m, n, k, extra, .. } = *case;
    for ta in *b"NTc" {
        for tb in *b"NtC" {
            for (alpha, beta) in FACTORS {
                let a = stored::<T>(&case.a, m, k, ta, extra);
                let b = stored::<T>(&case.b, k, n, if tb == b'N' { b'N' } else { b'T' }, extra + 1);
                let before =
                    Matrix::<T>::from_fn(m, n, extra, |i, j| if beta == 0.0 { f64::NAN } else { case.c[i + j * m] });
                let mut c = before.clone();
                let (lda, ldb, ldc) = (a.ld as i32, b.ld as i32, c.ld as i32);
                let (al, be) = (T::of(alpha), T::of(beta));
                T::gemm(ta, tb, m as i32, n as i32, k as i32, al, &a.data, lda, &b.data, ldb, be, &mut c.data, ldc);
                for (i, j) in c.entries() {
                    let (sum, size) = sums(k, |l| at(&a, ta, i, l), |l| at(&b, tb, l, j));
                    let expected = alpha * sum + old::<T>(beta, before.at(i, j));
                    let terms = alpha.abs() * size + old::<T>(beta, before.at(i, j)).abs();
                    assert!(is_close::<T>(c.at(i, j), expected, k, terms), "{ta} {tb} {alpha} {beta} ({i}, {j})");
                }
                assert!(c.padding_is_intact());
            }
        }
    }
}

/// A vector as BLAS stores it, with NaN in the gaps.
fn spread<T: Real>(values: &[f64], inc: i32) -> Vec<T> {
    let step = inc.unsigned_abs() as usize;
    let mut data = vec![T::of(PADDING); values.len().saturating_sub(1) * step + 1];
    for (i, &value) in values.iter().enumerate() {
        let place = if inc > 0 { i } else { values.len() - 1 - i };
        data[place * step] = T::of(value);
    }
    data
}

fn gathered<T: Real>(data: &[T], len: usize, inc: i32) -> Vec<f64> {
    let step = inc.unsigned_abs() as usize;
    (0..len).map(|i| data[if inc > 0 { i } else { len - 1 - i } * step].wide()).collect()
}

fn check_vector_products<T: Real>(case: &Case) {
    let Case { m, n, extra, .. } = *case;
    for (incx, incy) in [(1, 1), (2, -1), (-3, 2)] {
        for (alpha, beta) in FACTORS {
            let a = stored::<T>(&case.a, m, n, b'N', extra);
            for trans in *b"NTC" {
                let (x_len, y_len) = if trans == b'N' { (n, m) } else { (m, n) };
                let (x, y) = (spread::<T>(&case.b[..x_len], incx), &case.c[..y_len]);
                let mut out = spread::<T>(&if beta == 0.0 { vec![f64::NAN; y_len] } else { y.to_vec() }, incy);
                let before = gathered(&out, y_len, incy);
                let (al, be) = (T::of(alpha), T::of(beta));
                T::gemv(trans, m as i32, n as i32, al, &a.data, a.ld as i32, &x, incx, be, &mut out, incy);
                let x = gathered(&x, x_len, incx);
                for (i, found) in gathered(&out, y_len, incy).into_iter().enumerate() {
                    let (sum, size) = sums(x_len, |l| at(&a, trans, i, l), |l| x[l]);
                    let kept = old::<T>(beta, before[i]);
                    assert!(is_close::<T>(found, alpha * sum + kept, x_len, alpha.abs() * size + kept.abs()));
                }
                let gaps = out.iter().filter(|x| x.wide().is_nan()).count();
                assert_eq!(gaps, out.len() - y_len, "only the named elements are written");
            }
            for uplo in *b"ULl" {
                let mut a = Matrix::<T>::from_fn(n, n, extra, |i, j| case.a[i.min(j) + i.max(j) * n]);
                let whole = a.clone();
                a.spoil_other_triangle(uplo.to_ascii_uppercase(), f64::NAN);
                let x = spread::<T>(&case.b[..n], incx);
                let mut out = spread::<T>(&if beta == 0.0 { vec![f64::NAN; n] } else { case.c[..n].to_vec() }, incy);
                let before = gathered(&out, n, incy);
                T::symv(uplo, n as i32, T::of(alpha), &a.data, a.ld as i32, &x, incx, T::of(beta), &mut out, incy);
                let x = gathered(&x, n, incx);
                for (i, found) in gathered(&out, n, incy).into_iter().enumerate() {
                    let (sum, size) = sums(n, |l| whole.at(i, l), |l| x[l]);
                    let kept = old::<T>(beta, before[i]);
                    assert!(is_close::<T>(found, alpha * sum + kept, n, alpha.abs() * size + kept.abs()));
                }
            }
        }
    }
}

fn check_rank_updates<T: Real>(case: &Case) {
    let Case { n, k, extra, .. } = *case;
    for uplo in *b"UL" {
        for trans in *b"NTC" {
            for (alpha, beta) in FACTORS {
                let a = stored::<T>(&case.a, n, k, trans, extra);
                let b = stored::<T>(&case.b, n, k, trans, extra + 2);
                let mut before =
                    Matrix::<T>::from_fn(n, n, extra, |i, j| if beta == 0.0 { f64::NAN } else { case.c[i + j * n] });
                before.spoil_other_triangle(uplo, 77.0);
                let (al, be, order, width) = (T::of(alpha), T::of(beta), n as i32, k as i32);
                let (lda, ldb, ldc) = (a.ld as i32, b.ld as i32, before.ld as i32);
                let (mut once, mut twice) = (before.clone(), before.clone());
                T::syrk(uplo, trans, order, width, al, &a.data, lda, be, &mut once.data, ldc);
                T::syr2k(uplo, trans, order, width, al, &a.data, lda, &b.data, ldb, be, &mut twice.data, ldc);
                for (i, j) in before.entries() {
                    if (uplo == b'U' && i > j) || (uplo == b'L' && i < j) {
                        assert_eq!(once.at(i, j).to_bits(), 77.0_f64.to_bits(), "syrk wrote the other triangle");
                        assert_eq!(twice.at(i, j).to_bits(), 77.0_f64.to_bits(), "syr2k wrote the other triangle");
                        continue;
                    }
                    let kept = old::<T>(beta, before.at(i, j));
                    let (sum, size) = sums(k, |l| at(&a, trans, i, l), |l| at(&a, trans, j, l));
                    assert!(is_close::<T>(once.at(i, j), alpha * sum + kept, k, alpha.abs() * size + kept.abs()));
                    let (ab, ab_size) = sums(k, |l| at(&a, trans, i, l), |l| at(&b, trans, j, l));
                    let (ba, ba_size) = sums(k, |l| at(&b, trans, i, l), |l| at(&a, trans, j, l));
                    let size = alpha.abs() * (ab_size + ba_size) + kept.abs();
                    assert!(is_close::<T>(twice.at(i, j), alpha * (ab + ba) + kept, 2 * k, size));
                }
                assert!(once.padding_is_intact() && twice.padding_is_intact());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn gemm_is_the_sum_of_products(case in case()) {
        check_gemm::<f64>(&case);
        check_gemm::<f32>(&case);
    }

    #[test]
    fn gemv_and_symv_are_sums_of_products(case in case()) {
        check_vector_products::<f64>(&case);
        check_vector_products::<f32>(&case);
    }

    #[test]
    fn rank_updates_are_sums_of_products_in_one_triangle(case in case()) {
        check_rank_updates::<f64>(&case);
        check_rank_updates::<f32>(&case);
    }
}

#[test]
fn sizes_beyond_the_blocks_of_the_kernels() {
    for (m, n, k) in [(64, 65, 63), (97, 33, 128), (1, 130, 70), (130, 1, 70), (42, 42, 42)] {
        let side = 130 * 130;
        let wave = |shift: f64| (0..side).map(|i| (f64::from(i) * 0.7 + shift).sin()).collect::<Vec<_>>();
        let case = Case { m, n, k, a: wave(0.1), b: wave(0.2), c: wave(0.3), extra: 1 };
        check_gemm::<f64>(&case);
        check_gemm::<f32>(&case);
        check_vector_products::<f64>(&case);
        check_rank_updates::<f64>(&case);
    }
}

#[test]
fn alpha_zero_reads_neither_operand() {
    let nan = [f64::NAN; 9];
    let mut c = [1.0; 9];
    f64::gemm(b'N', b'N', 3, 3, 3, 0.0, &nan, 3, &nan, 3, 2.0, &mut c, 3);
    assert_eq!(c, [2.0; 9]);
    let mut c = [1.0; 9];
    f64::syr2k(b'U', b'N', 3, 3, 0.0, &nan, 3, &nan, 3, 0.0, &mut c, 3);
    assert_eq!(c, [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    let mut y = [1.0; 3];
    f64::gemv(b'N', 3, 3, 0.0, &nan, 3, &nan, 1, 0.0, &mut y, 1);
    assert_eq!(y, [0.0; 3]);
}

#[test]
fn nan_in_an_operand_reaches_the_result() {
    let mut a = [1.0; 16];
    a[5] = f64::NAN;
    let mut c = [0.0; 16];
    f64::gemm(b'N', b'N', 4, 4, 4, 1.0, &a, 4, &[1.0; 16], 4, 0.0, &mut c, 4);
    assert!((0..4).all(|j| c[1 + 4 * j].is_nan() && c[4 * j] == 4.0));
}

#[test]
fn illegal_arguments_leave_the_output_alone() {
    let a = [1.0; 9];
    let mut c = [5.0; 9];
    f64::gemm(b'X', b'N', 3, 3, 3, 1.0, &a, 3, &a, 3, 0.0, &mut c, 3);
    f64::gemm(b'N', b'?', 3, 3, 3, 1.0, &a, 3, &a, 3, 0.0, &mut c, 3);
    f64::gemm(b'N', b'N', -1, 3, 3, 1.0, &a, 3, &a, 3, 0.0, &mut c, 3);
    f64::gemm(b'N', b'N', 3, 3, 3, 1.0, &a, 2, &a, 3, 0.0, &mut c, 3);
    f64::gemm(b'N', b'N', 3, 3, 3, 1.0, &a, 3, &a, 2, 0.0, &mut c, 3);
    f64::gemm(b'N', b'N', 3, 3, 3, 1.0, &a, 3, &a, 3, 0.0, &mut c, 2);
    f64::syrk(b'N', b'N', 3, 3, 1.0, &a, 3, 0.0, &mut c, 3);
    f64::syrk(b'U', b'T', 3, 3, 1.0, &a, 2, 0.0, &mut c, 3);
    f64::syr2k(b'L', b'N', 3, -3, 1.0, &a, 3, &a, 3, 0.0, &mut c, 3);
    f64::gemv(b'N', 3, 3, 1.0, &a, 3, &a, 0, 0.0, &mut c, 1);
    f64::gemv(b'N', 3, 3, 1.0, &a, 3, &a, 1, 0.0, &mut c, i32::MIN);
    f64::symv(b'U', 3, 1.0, &a, 1, &a, 1, 0.0, &mut c, 1);
    assert_eq!(c, [5.0; 9]);
}

#[test]
fn a_result_does_not_depend_on_where_the_arrays_lie() {
    let n = 37;
    let source: Vec<f64> = (0..n * n).map(|i| f64::from(i).sin()).collect();
    let order = n as usize;
    let mut seen = Vec::new();
    for shift in 0..8 {
        let mut a = vec![0.0; shift];
        a.extend(&source);
        let mut c = vec![0.0; shift + order * order];
        let mut y = vec![0.0; shift + order];
        f64::gemm(b'T', b'N', n, n, n, 1.0, &a[shift..], n, &a[shift..], n, 0.0, &mut c[shift..], n);
        f64::gemv(b'N', n, n, 1.0, &a[shift..], n, &a[shift..], 1, 0.0, &mut y[shift..], 1);
        seen.push(c[shift..].iter().chain(&y[shift..]).map(|x| x.to_bits()).collect::<Vec<_>>());
    }
    assert!(seen.iter().all(|bits| *bits == seen[0]));
}
