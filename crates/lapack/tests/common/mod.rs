//! Both precisions behind one trait, called through the declarations that clarabel uses, and naive references in `f64`.
#![allow(dead_code, clippy::allow_attributes, reason = "each test file uses a part of this one")]
#![expect(unsafe_code, reason = "Fortran symbols are called by pointer")]
#![expect(clippy::too_many_arguments, reason = "the lists are those of BLAS and LAPACK")]

use std::fmt::Debug;
use std::ops::Range;

use certune_lapack as _;
use proptest::prelude::*;

/// Fills what a routine must neither read nor write.
pub const PADDING: f64 = f64::NAN;

/// A column-major matrix with room between its columns.
#[derive(Clone, Debug)]
pub struct Matrix<T> {
    pub rows: usize,
    pub cols: usize,
    pub ld: usize,
    pub data: Vec<T>,
}

impl<T: Real> Matrix<T> {
    pub fn from_fn(rows: usize, cols: usize, extra: usize, value: impl Fn(usize, usize) -> f64) -> Self {
        let ld = rows.max(1) + extra;
        let mut data = vec![T::of(PADDING); ld * cols];
        for j in 0..cols {
            for i in 0..rows {
                data[i + j * ld] = T::of(value(i, j));
            }
        }
        Matrix { rows, cols, ld, data }
    }

    pub fn filled(rows: usize, cols: usize, extra: usize, value: f64) -> Self {
        Self::from_fn(rows, cols, extra, |_, _| value)
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.data[i + j * self.ld].wide()
    }

    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.data[i + j * self.ld] = T::of(value);
    }

    pub fn transposed(&self, extra: usize) -> Self {
        Self::from_fn(self.cols, self.rows, extra, |i, j| self.at(j, i))
    }

    /// The entries of the triangle that `uplo` does not name, replaced.
    pub fn spoil_other_triangle(&mut self, uplo: u8, value: f64) {
        for j in 0..self.cols {
            for i in 0..self.rows {
                if (uplo == b'U' && i > j) || (uplo == b'L' && i < j) {
                    self.set(i, j, value);
                }
            }
        }
    }

    pub fn max_abs(&self) -> f64 {
        self.entries().map(|(i, j)| self.at(i, j).abs()).fold(0.0, f64::max)
    }

    pub fn entries(&self) -> impl Iterator<Item = (usize, usize)> + use<T> {
        let (rows, cols) = (self.rows, self.cols);
        (0..cols).flat_map(move |j| (0..rows).map(move |i| (i, j)))
    }

    pub fn bits(&self) -> Vec<u64> {
        self.data.iter().map(|x| x.wide().to_bits()).collect()
    }

    /// Whether the space between the columns is as it was.
    pub fn padding_is_intact(&self) -> bool {
        (0..self.cols).all(|j| (self.rows..self.ld).all(|i| self.data[i + j * self.ld].wide().is_nan()))
    }
}

/// Largest entry of `sum_k x(i,k) y(k,j) - z(i,j)`; NaN counts as infinite.
pub fn product_gap(
    (m, k, n): (usize, usize, usize),
    x: impl Fn(usize, usize) -> f64,
    y: impl Fn(usize, usize) -> f64,
    z: impl Fn(usize, usize) -> f64,
) -> f64 {
    let mut worst = 0.0_f64;
    for j in 0..n {
        for i in 0..m {
            let gap = ((0..k).map(|l| x(i, l) * y(l, j)).sum::<f64>() - z(i, j)).abs();
            worst = if gap.is_nan() { f64::INFINITY } else { worst.max(gap) };
        }
    }
    worst
}

pub fn identity(i: usize, j: usize) -> f64 {
    if i == j { 1.0 } else { 0.0 }
}

/// Largest entry of `QᵀQ - I`.
pub fn orthogonality_gap<T: Real>(q: &Matrix<T>) -> f64 {
    product_gap((q.cols, q.rows, q.cols), |i, l| q.at(l, i), |l, j| q.at(l, j), identity)
}

/// An orthogonal matrix: a product of reflections, one for each row of numbers in `draws`.
pub fn orthogonal(n: usize, draws: &[f64]) -> Vec<f64> {
    let mut q: Vec<f64> = (0..n * n).map(|at| identity(at % n, at / n)).collect();
    for v in draws.chunks_exact(n).take(n) {
        let square: f64 = v.iter().map(|x| x * x).sum();
        if square < 1e-6 {
            continue;
        }
        for column in q.chunks_exact_mut(n) {
            let along = 2.0 * column.iter().zip(v).map(|(x, y)| x * y).sum::<f64>() / square;
            for (x, y) in column.iter_mut().zip(v) {
                *x -= along * y;
            }
        }
    }
    q
}

/// `rows * cols` numbers in [-1, 1).
pub fn numbers(rows: usize, cols: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0_f64, rows * cols)
}

/// A square matrix of the given orders, as its entries.
pub fn square(orders: Range<usize>) -> impl Strategy<Value = (usize, Vec<f64>)> {
    orders.prop_flat_map(|n| (Just(n), numbers(n, n)))
}

/// A result with the outputs of an eigenvalue call.
pub struct Eigen<T> {
    pub info: i32,
    pub count: usize,
    pub values: Vec<T>,
    pub vectors: Matrix<T>,
    pub support: Vec<i32>,
}

/// A result with the outputs of a singular value call.
pub struct Svd<T> {
    pub info: i32,
    pub values: Vec<T>,
    pub u: Matrix<T>,
    pub vt: Matrix<T>,
}

/// The part of the spectrum to compute.
#[derive(Clone, Copy)]
pub enum Wanted {
    All,
    Values(f64, f64),
    Places(i32, i32),
}

macro_rules! reals {
    ($($name:ident($($arg:ident: $type:ty),*) = $single:path, $double:path;)*) => {
        pub trait Real: Copy + Debug + PartialOrd + 'static {
            const EPS: f64;
            fn of(x: f64) -> Self;
            fn wide(self) -> f64;
            $(fn $name($($arg: $type),*);)*
        }
        impl Real for f32 {
            const EPS: f64 = f32::EPSILON as f64;
            fn of(x: f64) -> Self { x as f32 }
            fn wide(self) -> f64 { self.into() }
            // SAFETY: every test passes arrays of the size that its arguments say.
            $(fn $name($($arg: $type),*) { unsafe { $single($($arg),*) } })*
        }
        impl Real for f64 {
            const EPS: f64 = f64::EPSILON;
            fn of(x: f64) -> Self { x }
            fn wide(self) -> f64 { self }
            // SAFETY: every test passes arrays of the size that its arguments say.
            $(fn $name($($arg: $type),*) { unsafe { $double($($arg),*) } })*
        }
    };
}

reals! {
    gemm(ta: u8, tb: u8, m: i32, n: i32, k: i32, alpha: Self, a: &[Self], lda: i32, b: &[Self], ldb: i32, beta: Self,
         c: &mut [Self], ldc: i32) = blas::sgemm, blas::dgemm;
    gemv(trans: u8, m: i32, n: i32, alpha: Self, a: &[Self], lda: i32, x: &[Self], incx: i32, beta: Self, y: &mut [Self],
         incy: i32) = blas::sgemv, blas::dgemv;
    symv(uplo: u8, n: i32, alpha: Self, a: &[Self], lda: i32, x: &[Self], incx: i32, beta: Self, y: &mut [Self],
         incy: i32) = blas::ssymv, blas::dsymv;
    syrk(uplo: u8, trans: u8, n: i32, k: i32, alpha: Self, a: &[Self], lda: i32, beta: Self, c: &mut [Self],
         ldc: i32) = blas::ssyrk, blas::dsyrk;
    syr2k(uplo: u8, trans: u8, n: i32, k: i32, alpha: Self, a: &[Self], lda: i32, b: &[Self], ldb: i32, beta: Self,
          c: &mut [Self], ldc: i32) = blas::ssyr2k, blas::dsyr2k;
    potrf(uplo: u8, n: i32, a: &mut [Self], lda: i32, info: &mut i32) = lapack::spotrf, lapack::dpotrf;
    potrs(uplo: u8, n: i32, nrhs: i32, a: &[Self], lda: i32, b: &mut [Self], ldb: i32, info: &mut i32)
        = lapack::spotrs, lapack::dpotrs;
    gesv(n: i32, nrhs: i32, a: &mut [Self], lda: i32, ipiv: &mut [i32], b: &mut [Self], ldb: i32, info: &mut i32)
        = lapack::sgesv, lapack::dgesv;
    syevr(jobz: u8, range: u8, uplo: u8, n: i32, a: &mut [Self], lda: i32, vl: Self, vu: Self, il: i32, iu: i32,
          abstol: Self, m: &mut i32, w: &mut [Self], z: &mut [Self], ldz: i32, isuppz: &mut [i32], work: &mut [Self],
          lwork: i32, iwork: &mut [i32], liwork: i32, info: &mut i32) = lapack::ssyevr, lapack::dsyevr;
    gesdd(jobz: u8, m: i32, n: i32, a: &mut [Self], lda: i32, s: &mut [Self], u: &mut [Self], ldu: i32,
          vt: &mut [Self], ldvt: i32, work: &mut [Self], lwork: i32, iwork: &mut [i32], info: &mut i32)
        = lapack::sgesdd, lapack::dgesdd;
    gesvd(jobu: u8, jobvt: u8, m: i32, n: i32, a: &mut [Self], lda: i32, s: &mut [Self], u: &mut [Self], ldu: i32,
          vt: &mut [Self], ldvt: i32, work: &mut [Self], lwork: i32, info: &mut i32) = lapack::sgesvd, lapack::dgesvd;
}

/// Asks for the workspace, then decomposes, as clarabel does.
pub fn eigen<T: Real>(a: &Matrix<T>, jobz: u8, uplo: u8, wanted: Wanted, extra: usize) -> Eigen<T> {
    let n = a.rows;
    let (range, vl, vu, il, iu) = match wanted {
        Wanted::All => (b'A', 0.0, 0.0, 0, 0),
        Wanted::Values(vl, vu) => (b'V', vl, vu, 0, 0),
        Wanted::Places(il, iu) => (b'I', 0.0, 0.0, il, iu),
    };
    let mut a = a.clone();
    let mut values = vec![T::of(PADDING); n];
    let mut vectors = Matrix::filled(n, n, extra, PADDING);
    let mut support = vec![0; 2 * n];
    let (mut work, mut iwork) = (vec![T::of(0.0)], vec![0]);
    let (mut lwork, mut liwork, mut count, mut info) = (-1, -1, 0, 0);
    for _ in 0..2 {
        let (lda, ldz) = (a.ld as i32, vectors.ld as i32);
        T::syevr(
            jobz,
            range,
            uplo,
            n as i32,
            &mut a.data,
            lda,
            T::of(vl),
            T::of(vu),
            il,
            iu,
            T::of(-1.0),
            &mut count,
            &mut values,
            &mut vectors.data,
            ldz,
            &mut support,
            &mut work,
            lwork,
            &mut iwork,
            liwork,
            &mut info,
        );
        if info != 0 || lwork != -1 {
            break;
        }
        (lwork, liwork) = (work[0].wide() as i32, iwork[0]);
        work.resize(lwork as usize, T::of(0.0));
        iwork.resize(liwork as usize, 0);
    }
    Eigen { info, count: count as usize, values, vectors, support }
}

/// `?gesdd` when both jobs are the same and `by_qr` is false, else `?gesvd`.
pub fn svd<T: Real>(a: &Matrix<T>, (jobu, jobvt): (u8, u8), by_qr: bool, extra: usize) -> Svd<T> {
    let (m, n) = (a.rows, a.cols);
    let count = m.min(n);
    let mut a = a.clone();
    let of = |job: u8, side: usize| match job {
        b'N' => 0,
        b'S' => count,
        _ => side,
    };
    let mut values = vec![T::of(PADDING); count];
    let mut u = Matrix::filled(if jobu == b'N' { 0 } else { m }, of(jobu, m), extra, PADDING);
    let mut vt = Matrix::filled(of(jobvt, n), if jobvt == b'N' { 0 } else { n }, extra, PADDING);
    let (mut work, mut lwork, mut info) = (vec![T::of(0.0)], -1, 0);
    let mut iwork = vec![0; 8 * count];
    for _ in 0..2 {
        let (lda, ldu, ldvt) = (a.ld as i32, u.ld as i32, vt.ld as i32);
        let (m, n) = (m as i32, n as i32);
        if by_qr || jobu != jobvt {
            T::gesvd(
                jobu,
                jobvt,
                m,
                n,
                &mut a.data,
                lda,
                &mut values,
                &mut u.data,
                ldu,
                &mut vt.data,
                ldvt,
                &mut work,
                lwork,
                &mut info,
            );
        } else {
            T::gesdd(
                jobu,
                m,
                n,
                &mut a.data,
                lda,
                &mut values,
                &mut u.data,
                ldu,
                &mut vt.data,
                ldvt,
                &mut work,
                lwork,
                &mut iwork,
                &mut info,
            );
        }
        if info != 0 || lwork != -1 {
            break;
        }
        lwork = work[0].wide() as i32;
        work.resize(lwork as usize, T::of(0.0));
    }
    Svd { info, values, u, vt }
}
