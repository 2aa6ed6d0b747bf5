//! BLAS: products. See the crate's page for the table of symbols.
//!
//! # Safety
//! Every function here is unsafe for one reason, BLAS's own contract: each pointer is null or valid, each array is as
//! large as its sizes, leading dimension and increment say, and the output overlaps no input.
#![expect(unsafe_code, reason = "Fortran symbols take raw pointers; the contract is in the module's page")]

use core::ffi::{c_char, c_int};
use std::io::Write;

use faer::{Mat, MatRef};

use super::{BadArgument, guarded, leading, require, size, transposed, triangle};
use crate::memory::{Part, Region, Strided, integer, letter, load, load_strided, number, poison, store, store_strided};
use crate::product::{add_product, add_triangle, mirrored, scaled};
use crate::scalar::Scalar;

/// BLAS has no `info`: what is wrong goes to standard error, as in OpenBLAS.
fn complain(symbol: &str, outcome: Result<(), BadArgument>) {
    if let Err(BadArgument(position)) = outcome {
        // Nothing can be done when standard error is closed.
        let _ = writeln!(std::io::stderr(), "certune-lapack: argument {position} of {symbol} is illegal");
    }
}

fn strided(len: usize, inc: c_int, position: c_int) -> Result<Strided, BadArgument> {
    require(inc != 0 && inc != c_int::MIN, position)?;
    Ok(Strided { len, inc: inc as isize })
}

/// The region of an operand that is stored as `rows x cols`, or the transpose of that.
fn operand(rows: usize, cols: usize, trans: bool, ld: c_int, position: c_int) -> Result<Region, BadArgument> {
    let (rows, cols) = if trans { (cols, rows) } else { (rows, cols) };
    Ok(Region { rows, cols, ld: leading(ld, rows, position)?, part: Part::All })
}

fn oriented<T: Scalar>(stored: &Mat<T>, trans: bool) -> MatRef<'_, T> {
    if trans { stored.transpose() } else { stored.as_ref() }
}

/// The old values of the output, or nothing where BLAS promises not to read them.
unsafe fn old<T: Scalar>(c: *const T, region: Region, beta: T) -> Option<Mat<T>> {
    // SAFETY: the module's contract.
    (beta != T::ZERO).then(|| unsafe { load(c, region) })
}

/// Writes the result, or NaN when the work failed.
unsafe fn deliver<T: Scalar>(c: *mut T, region: Region, result: Option<Mat<T>>) {
    // SAFETY: the module's contract.
    unsafe {
        match result {
            Some(values) => store(c, region, values.as_ref()),
            None => poison(c, region),
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "the list is BLAS's")]
unsafe fn gemm<T: Scalar>(
    transa: *const c_char,
    transb: *const c_char,
    m: *const c_int,
    n: *const c_int,
    k: *const c_int,
    alpha: *const T,
    a: *const T,
    lda: *const c_int,
    b: *const T,
    ldb: *const c_int,
    beta: *const T,
    c: *mut T,
    ldc: *const c_int,
) -> Result<(), BadArgument> {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let (ta, tb) = (transposed(letter(transa), 1)?, transposed(letter(transb), 2)?);
        let (m, n, k) = (size(integer(m), 3)?, size(integer(n), 4)?, size(integer(k), 5)?);
        let a_region = operand(m, k, ta, integer(lda), 8)?;
        let b_region = operand(k, n, tb, integer(ldb), 10)?;
        let c_region = operand(m, n, false, integer(ldc), 13)?;
        if c_region.is_empty() {
            return Ok(());
        }
        let (alpha, beta) = (number(alpha), number(beta));
        let is_used = alpha != T::ZERO && k > 0;
        require(!is_used || !a.is_null(), 7)?;
        require(!is_used || !b.is_null(), 9)?;
        require(!c.is_null(), 12)?;
        let result = guarded(|| {
            let mut result = scaled(beta, old(c, c_region, beta), m, n);
            if is_used {
                let (a, b) = (load(a, a_region), load(b, b_region));
                add_product(&mut result, alpha, oriented(&a, ta), oriented(&b, tb));
            }
            result
        });
        deliver(c, c_region, result);
    }
    Ok(())
}

#[expect(clippy::too_many_arguments, reason = "the list is BLAS's")]
unsafe fn gemv<T: Scalar>(
    trans: *const c_char,
    m: *const c_int,
    n: *const c_int,
    alpha: *const T,
    a: *const T,
    lda: *const c_int,
    x: *const T,
    incx: *const c_int,
    beta: *const T,
    y: *mut T,
    incy: *const c_int,
) -> Result<(), BadArgument> {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let trans = transposed(letter(trans), 1)?;
        let (m, n) = (size(integer(m), 2)?, size(integer(n), 3)?);
        let region = operand(m, n, false, integer(lda), 6)?;
        let (x_len, y_len) = if trans { (m, n) } else { (n, m) };
        let (x_shape, y_shape) = (strided(x_len, integer(incx), 8)?, strided(y_len, integer(incy), 11)?);
        // As in the reference BLAS, an empty matrix leaves y as it is, whatever beta.
        if region.is_empty() {
            return Ok(());
        }
        let (alpha, beta) = (number(alpha), number(beta));
        let is_used = alpha != T::ZERO;
        require(!is_used || !a.is_null(), 5)?;
        require(!is_used || !x.is_null(), 7)?;
        require(!y.is_null(), 10)?;
        let result = guarded(|| {
            let old = (beta != T::ZERO).then(|| load_strided(y, y_shape));
            let mut result = scaled(beta, old, y_len, 1);
            if is_used {
                let (a, x) = (load(a, region), load_strided(x, x_shape));
                add_product(&mut result, alpha, oriented(&a, trans), x.as_ref());
            }
            result
        });
        store_strided(y, y_shape, result.as_ref().map(Mat::as_ref));
    }
    Ok(())
}

#[expect(clippy::too_many_arguments, reason = "the list is BLAS's")]
unsafe fn symv<T: Scalar>(
    uplo: *const c_char,
    n: *const c_int,
    alpha: *const T,
    a: *const T,
    lda: *const c_int,
    x: *const T,
    incx: *const c_int,
    beta: *const T,
    y: *mut T,
    incy: *const c_int,
) -> Result<(), BadArgument> {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let part = triangle(letter(uplo), 1)?;
        let n = size(integer(n), 2)?;
        let region = Region { rows: n, cols: n, ld: leading(integer(lda), n, 5)?, part };
        let (x_shape, y_shape) = (strided(n, integer(incx), 7)?, strided(n, integer(incy), 10)?);
        if n == 0 {
            return Ok(());
        }
        let (alpha, beta) = (number(alpha), number(beta));
        let is_used = alpha != T::ZERO;
        require(!is_used || !a.is_null(), 4)?;
        require(!is_used || !x.is_null(), 6)?;
        require(!y.is_null(), 9)?;
        let result = guarded(|| {
            let old = (beta != T::ZERO).then(|| load_strided(y, y_shape));
            let mut result = scaled(beta, old, n, 1);
            if is_used {
                let (a, x) = (mirrored(&load(a, region), part), load_strided(x, x_shape));
                add_product(&mut result, alpha, a.as_ref(), x.as_ref());
            }
            result
        });
        store_strided(y, y_shape, result.as_ref().map(Mat::as_ref));
    }
    Ok(())
}

#[expect(clippy::too_many_arguments, reason = "the list is BLAS's")]
unsafe fn syrk<T: Scalar>(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const T,
    a: *const T,
    lda: *const c_int,
    beta: *const T,
    c: *mut T,
    ldc: *const c_int,
) -> Result<(), BadArgument> {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let (part, trans) = (triangle(letter(uplo), 1)?, transposed(letter(trans), 2)?);
        let (n, k) = (size(integer(n), 3)?, size(integer(k), 4)?);
        let a_region = operand(n, k, trans, integer(lda), 7)?;
        let c_region = Region { rows: n, cols: n, ld: leading(integer(ldc), n, 10)?, part };
        if n == 0 {
            return Ok(());
        }
        let (alpha, beta) = (number(alpha), number(beta));
        let is_used = alpha != T::ZERO && k > 0;
        require(!is_used || !a.is_null(), 6)?;
        require(!c.is_null(), 9)?;
        let result = guarded(|| {
            let mut result = scaled(beta, old(c, c_region, beta), n, n);
            if is_used {
                let a = load(a, a_region);
                let a = oriented(&a, trans);
                add_triangle(&mut result, part, alpha, a, a.transpose());
            }
            result
        });
        deliver(c, c_region, result);
    }
    Ok(())
}

#[expect(clippy::too_many_arguments, reason = "the list is BLAS's")]
unsafe fn syr2k<T: Scalar>(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const T,
    a: *const T,
    lda: *const c_int,
    b: *const T,
    ldb: *const c_int,
    beta: *const T,
    c: *mut T,
    ldc: *const c_int,
) -> Result<(), BadArgument> {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let (part, trans) = (triangle(letter(uplo), 1)?, transposed(letter(trans), 2)?);
        let (n, k) = (size(integer(n), 3)?, size(integer(k), 4)?);
        let a_region = operand(n, k, trans, integer(lda), 7)?;
        let b_region = operand(n, k, trans, integer(ldb), 9)?;
        let c_region = Region { rows: n, cols: n, ld: leading(integer(ldc), n, 12)?, part };
        if n == 0 {
            return Ok(());
        }
        let (alpha, beta) = (number(alpha), number(beta));
        let is_used = alpha != T::ZERO && k > 0;
        require(!is_used || !a.is_null(), 6)?;
        require(!is_used || !b.is_null(), 8)?;
        require(!c.is_null(), 11)?;
        let result = guarded(|| {
            let mut result = scaled(beta, old(c, c_region, beta), n, n);
            if is_used {
                let (a, b) = (load(a, a_region), load(b, b_region));
                let (a, b) = (oriented(&a, trans), oriented(&b, trans));
                add_triangle(&mut result, part, alpha, a, b.transpose());
                add_triangle(&mut result, part, alpha, b, a.transpose());
            }
            result
        });
        deliver(c, c_region, result);
    }
    Ok(())
}

macro_rules! export {
    ($float:ty: $gemm:ident $gemv:ident $symv:ident $syrk:ident $syr2k:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $gemm(
            transa: *const c_char,
            transb: *const c_char,
            m: *const c_int,
            n: *const c_int,
            k: *const c_int,
            alpha: *const $float,
            a: *const $float,
            lda: *const c_int,
            b: *const $float,
            ldb: *const c_int,
            beta: *const $float,
            c: *mut $float,
            ldc: *const c_int,
        ) {
            // SAFETY: the same contract.
            let outcome = unsafe { gemm(transa, transb, m, n, k, alpha, a, lda, b, ldb, beta, c, ldc) };
            complain(stringify!($gemm), outcome);
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $gemv(
            trans: *const c_char,
            m: *const c_int,
            n: *const c_int,
            alpha: *const $float,
            a: *const $float,
            lda: *const c_int,
            x: *const $float,
            incx: *const c_int,
            beta: *const $float,
            y: *mut $float,
            incy: *const c_int,
        ) {
            // SAFETY: the same contract.
            let outcome = unsafe { gemv(trans, m, n, alpha, a, lda, x, incx, beta, y, incy) };
            complain(stringify!($gemv), outcome);
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $symv(
            uplo: *const c_char,
            n: *const c_int,
            alpha: *const $float,
            a: *const $float,
            lda: *const c_int,
            x: *const $float,
            incx: *const c_int,
            beta: *const $float,
            y: *mut $float,
            incy: *const c_int,
        ) {
            // SAFETY: the same contract.
            let outcome = unsafe { symv(uplo, n, alpha, a, lda, x, incx, beta, y, incy) };
            complain(stringify!($symv), outcome);
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $syrk(
            uplo: *const c_char,
            trans: *const c_char,
            n: *const c_int,
            k: *const c_int,
            alpha: *const $float,
            a: *const $float,
            lda: *const c_int,
            beta: *const $float,
            c: *mut $float,
            ldc: *const c_int,
        ) {
            // SAFETY: the same contract.
            let outcome = unsafe { syrk(uplo, trans, n, k, alpha, a, lda, beta, c, ldc) };
            complain(stringify!($syrk), outcome);
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $syr2k(
            uplo: *const c_char,
            trans: *const c_char,
            n: *const c_int,
            k: *const c_int,
            alpha: *const $float,
            a: *const $float,
            lda: *const c_int,
            b: *const $float,
            ldb: *const c_int,
            beta: *const $float,
            c: *mut $float,
            ldc: *const c_int,
        ) {
            // SAFETY: the same contract.
            let outcome = unsafe { syr2k(uplo, trans, n, k, alpha, a, lda, b, ldb, beta, c, ldc) };
            complain(stringify!($syr2k), outcome);
        }
    };
}

export!(f32: sgemm_ sgemv_ ssymv_ ssyrk_ ssyr2k_);
export!(f64: dgemm_ dgemv_ dsymv_ dsyrk_ dsyr2k_);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_internal_failure_fills_the_result_with_nan() {
        let region = Region { rows: 2, cols: 2, ld: 3, part: Part::Upper };
        let mut c = [1.0_f64; 6];
        let result = guarded(|| -> Mat<f64> { panic!("on purpose") });
        // SAFETY: `c` is as large as the region says.
        unsafe { deliver(c.as_mut_ptr(), region, result) };
        let written: Vec<usize> = (0..6).filter(|&i| c[i].is_nan()).collect();
        assert_eq!(written, [0, 3, 4], "the named triangle, and nothing else");
    }
}
