//! LAPACK: factorisations and solves. See the crate's page for the table of symbols and the meaning of `info`.
//!
//! # Safety
//! Every function here is unsafe for one reason, LAPACK's own contract: each pointer is null or valid, each array is as
//! large as its sizes and leading dimension say, and no output overlaps another argument.
#![expect(unsafe_code, reason = "Fortran symbols take raw pointers; the contract is in the module's page")]

use core::ffi::{c_char, c_int};

use super::{BadArgument, guarded, leading, require, size, triangle};
use crate::eigen::{NoConvergence, eigen};
use crate::memory::{Part, Region, integer, letter, load, number, put, store, store_slice};
use crate::scalar::Scalar;
use crate::svd::{Vectors, svd};
use crate::{cholesky, lu};

/// Why a routine has no result.
enum Failure {
    Argument(BadArgument),
    /// The numbers do not admit one; holds LAPACK's positive `info`.
    Breakdown(usize),
}

impl From<BadArgument> for Failure {
    fn from(bad: BadArgument) -> Self {
        Failure::Argument(bad)
    }
}

impl From<NoConvergence> for Failure {
    fn from(NoConvergence: NoConvergence) -> Self {
        Failure::Breakdown(1)
    }
}

type Outcome = Result<(), Failure>;

/// `info` of an internal failure.
const INTERNAL: c_int = c_int::MAX;

/// Runs a routine and writes its `info`.
unsafe fn answer(info: *mut c_int, routine: impl FnOnce() -> Outcome) {
    let code = match guarded(routine) {
        Some(Ok(())) => 0,
        Some(Err(Failure::Argument(BadArgument(position)))) => -position,
        Some(Err(Failure::Breakdown(index))) => c_int::try_from(index).unwrap_or(INTERNAL),
        None => INTERNAL,
    };
    // SAFETY: the module's contract.
    unsafe { put(info, code) }
}

fn square(n: usize, lda: c_int, position: c_int, part: Part) -> Result<Region, BadArgument> {
    Ok(Region { rows: n, cols: n, ld: leading(lda, n, position)?, part })
}

fn block(rows: usize, cols: usize, ld: c_int, position: c_int) -> Result<Region, BadArgument> {
    Ok(Region { rows, cols, ld: leading(ld, rows, position)?, part: Part::All })
}

unsafe fn potrf<T: Scalar>(uplo: *const c_char, n: *const c_int, a: *mut T, lda: *const c_int) -> Outcome {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let part = triangle(letter(uplo), 1)?;
        let n = size(integer(n), 2)?;
        let region = square(n, integer(lda), 4, part)?;
        if n == 0 {
            return Ok(());
        }
        require(!a.is_null(), 3)?;
        let given = load(a, region);
        let mut factor = if part == Part::Upper { given.transpose().to_owned() } else { given };
        cholesky::factor(&mut factor).map_err(Failure::Breakdown)?;
        store(a, region, if part == Part::Upper { factor.transpose() } else { factor.as_ref() });
    }
    Ok(())
}

unsafe fn potrs<T: Scalar>(
    uplo: *const c_char,
    n: *const c_int,
    nrhs: *const c_int,
    a: *const T,
    lda: *const c_int,
    b: *mut T,
    ldb: *const c_int,
) -> Outcome {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let part = triangle(letter(uplo), 1)?;
        let (n, nrhs) = (size(integer(n), 2)?, size(integer(nrhs), 3)?);
        let a_region = square(n, integer(lda), 5, part)?;
        let b_region = block(n, nrhs, integer(ldb), 7)?;
        if b_region.is_empty() {
            return Ok(());
        }
        require(!a.is_null(), 4)?;
        require(!b.is_null(), 6)?;
        let given = load(a, a_region);
        let factor = if part == Part::Upper { given.transpose().to_owned() } else { given };
        let mut x = load(b, b_region);
        cholesky::solve(&factor, &mut x);
        store(b, b_region, x.as_ref());
    }
    Ok(())
}

unsafe fn gesv<T: Scalar>(
    n: *const c_int,
    nrhs: *const c_int,
    a: *mut T,
    lda: *const c_int,
    ipiv: *mut c_int,
    b: *mut T,
    ldb: *const c_int,
) -> Outcome {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let (n, nrhs) = (size(integer(n), 1)?, size(integer(nrhs), 2)?);
        let a_region = square(n, integer(lda), 4, Part::All)?;
        let b_region = block(n, nrhs, integer(ldb), 7)?;
        if n == 0 {
            return Ok(());
        }
        require(!a.is_null(), 3)?;
        require(!ipiv.is_null(), 5)?;
        require(nrhs == 0 || !b.is_null(), 6)?;
        let factors = lu::factor(load(a, a_region)).map_err(Failure::Breakdown)?;
        let x = factors.solve(&load(b, b_region));
        store(a, a_region, factors.factors.as_ref());
        store_slice(ipiv, &factors.exchanges());
        store(b, b_region, x.as_ref());
    }
    Ok(())
}

/// Which eigenvalues are wanted.
enum Range<T> {
    All,
    /// Those in the half-open interval (lower, upper].
    Values {
        lower: T,
        upper: T,
    },
    /// Those with these places in ascending order, from 0.
    Places(core::ops::Range<usize>),
}

#[expect(clippy::too_many_arguments, reason = "the list is LAPACK's")]
unsafe fn syevr<T: Scalar>(
    jobz: *const c_char,
    range: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut T,
    lda: *const c_int,
    vl: *const T,
    vu: *const T,
    il: *const c_int,
    iu: *const c_int,
    m: *mut c_int,
    w: *mut T,
    z: *mut T,
    ldz: *const c_int,
    isuppz: *mut c_int,
    work: *mut T,
    lwork: *const c_int,
    iwork: *mut c_int,
    liwork: *const c_int,
) -> Outcome {
    // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
    unsafe {
        let with_vectors = match letter(jobz) {
            b'N' => false,
            b'V' => true,
            _ => return Err(BadArgument(1).into()),
        };
        let range = letter(range);
        require(matches!(range, b'A' | b'V' | b'I'), 2)?;
        let part = triangle(letter(uplo), 3)?;
        let order = integer(n);
        let n = size(order, 4)?;
        let region = square(n, integer(lda), 6, part)?;
        let wanted = match range {
            b'V' => {
                let (lower, upper) = (number(vl), number(vu));
                require(n == 0 || upper > lower, 8)?;
                Range::Values { lower, upper }
            }
            b'I' => {
                let (first, last) = (integer(il), integer(iu));
                require(first >= 1 && first <= order.max(1), 9)?;
                require(last >= first.min(order) && last <= order, 10)?;
                // Both are positive, or the range is empty because the order is zero.
                Range::Places(first as usize - 1..last as usize)
            }
            _ => Range::All,
        };
        let ldz = leading(integer(ldz), if with_vectors { n } else { 0 }, 15)?;
        let (lwork, liwork) = (integer(lwork), integer(liwork));
        let (least, least_integers) = ((26 * n).max(1), (10 * n).max(1));
        if lwork == -1 || liwork == -1 {
            put(work, T::from_count(least as u64));
            put(iwork, c_int::try_from(least_integers).unwrap_or(c_int::MAX));
            return Ok(());
        }
        require(size(lwork, 18)? >= least, 18)?;
        require(size(liwork, 20)? >= least_integers, 20)?;
        require(!m.is_null(), 12)?;
        put(m, 0);
        if n == 0 {
            return Ok(());
        }
        require(!a.is_null(), 5)?;
        require(!w.is_null(), 13)?;
        require(!with_vectors || !z.is_null(), 14)?;
        require(!with_vectors || !isuppz.is_null(), 16)?;

        let given = load(a, region);
        let lower = if part == Part::Upper { given.transpose().to_owned() } else { given };
        let found = eigen(lower, with_vectors)?;
        let chosen = match wanted {
            Range::All => 0..n,
            Range::Places(places) => places,
            Range::Values { lower, upper } => {
                found.values.partition_point(|&x| x <= lower)..found.values.partition_point(|&x| x <= upper)
            }
        };
        // Not above the order, which came in as a `c_int`.
        let count = chosen.len();
        put(m, count as c_int);
        store_slice(w, &found.values[chosen.clone()]);
        if let Some(vectors) = found.vectors {
            let z_region = Region { rows: n, cols: count, ld: ldz, part: Part::All };
            store(z, z_region, vectors.as_ref().subcols(chosen.start, count));
            // Each vector may be nonzero everywhere.
            store_slice(isuppz, &[1, order].repeat(count));
        }
    }
    Ok(())
}

fn wanted(job: u8, position: c_int) -> Result<Vectors, BadArgument> {
    match job {
        b'N' => Ok(Vectors::None),
        b'S' => Ok(Vectors::Thin),
        b'A' => Ok(Vectors::Full),
        _ => Err(BadArgument(position)),
    }
}

/// What `?gesdd_` and `?gesvd_` share: the decomposition itself, with `left` and `right` already read.
struct SvdCall<T> {
    left: Vectors,
    right: Vectors,
    m: *const c_int,
    n: *const c_int,
    a: *mut T,
    lda: *const c_int,
    s: *mut T,
    u: *mut T,
    ldu: *const c_int,
    vt: *mut T,
    ldvt: *const c_int,
    work: *mut T,
    lwork: *const c_int,
}

impl<T: Scalar> SvdCall<T> {
    /// `first` is the position of `m`; the other arguments follow in the same order in both routines.
    /// `least` gives, from (smaller side, larger side), the smallest legal workspace and the one to answer a query with.
    unsafe fn run(self, first: c_int, least: impl FnOnce(u64, u64) -> (u64, u64)) -> Outcome {
        // SAFETY: the module's contract; nothing is read or written before all sizes are checked.
        unsafe {
            let (m, n) = (size(integer(self.m), first)?, size(integer(self.n), first + 1)?);
            let count = m.min(n);
            let region = block(m, n, integer(self.lda), first + 3)?;
            let (u_cols, vt_rows) = (self.left.count(m, count), self.right.count(n, count));
            let u_rows = if self.left == Vectors::None { 0 } else { m };
            let vt_cols = if self.right == Vectors::None { 0 } else { n };
            let u_region = block(u_rows, u_cols, integer(self.ldu), first + 6)?;
            let vt_region = block(vt_rows, vt_cols, integer(self.ldvt), first + 8)?;
            let (smallest, answer) = least(count as u64, m.max(n) as u64);
            let lwork = integer(self.lwork);
            if lwork == -1 {
                put(self.work, T::from_count(answer.max(1)));
                return Ok(());
            }
            require(size(lwork, first + 10)? as u64 >= smallest.max(1), first + 10)?;
            if count == 0 && u_region.is_empty() && vt_region.is_empty() {
                return Ok(());
            }
            require(region.is_empty() || !self.a.is_null(), first + 2)?;
            require(count == 0 || !self.s.is_null(), first + 4)?;
            require(u_region.is_empty() || !self.u.is_null(), first + 5)?;
            require(vt_region.is_empty() || !self.vt.is_null(), first + 7)?;

            let found = svd(load(self.a, region), self.left, self.right)?;
            store_slice(self.s, &found.values);
            if let Some(u) = found.u {
                store(self.u, u_region, u.as_ref());
            }
            if let Some(v) = found.v {
                store(self.vt, vt_region, v.transpose());
            }
        }
        Ok(())
    }
}

macro_rules! export {
    ($float:ty: $potrf:ident $potrs:ident $gesv:ident $syevr:ident $gesdd:ident $gesvd:ident) => {
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $potrf(
            uplo: *const c_char,
            n: *const c_int,
            a: *mut $float,
            lda: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe { answer(info, || potrf(uplo, n, a, lda)) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $potrs(
            uplo: *const c_char,
            n: *const c_int,
            nrhs: *const c_int,
            a: *const $float,
            lda: *const c_int,
            b: *mut $float,
            ldb: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe { answer(info, || potrs(uplo, n, nrhs, a, lda, b, ldb)) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $gesv(
            n: *const c_int,
            nrhs: *const c_int,
            a: *mut $float,
            lda: *const c_int,
            ipiv: *mut c_int,
            b: *mut $float,
            ldb: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe { answer(info, || gesv(n, nrhs, a, lda, ipiv, b, ldb)) }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $syevr(
            jobz: *const c_char,
            range: *const c_char,
            uplo: *const c_char,
            n: *const c_int,
            a: *mut $float,
            lda: *const c_int,
            vl: *const $float,
            vu: *const $float,
            il: *const c_int,
            iu: *const c_int,
            _abstol: *const $float,
            m: *mut c_int,
            w: *mut $float,
            z: *mut $float,
            ldz: *const c_int,
            isuppz: *mut c_int,
            work: *mut $float,
            lwork: *const c_int,
            iwork: *mut c_int,
            liwork: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe {
                answer(info, || {
                    syevr(
                        jobz, range, uplo, n, a, lda, vl, vu, il, iu, m, w, z, ldz, isuppz, work, lwork, iwork, liwork,
                    )
                })
            }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $gesdd(
            jobz: *const c_char,
            m: *const c_int,
            n: *const c_int,
            a: *mut $float,
            lda: *const c_int,
            s: *mut $float,
            u: *mut $float,
            ldu: *const c_int,
            vt: *mut $float,
            ldvt: *const c_int,
            work: *mut $float,
            lwork: *const c_int,
            _iwork: *mut c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe {
                answer(info, || {
                    let vectors = wanted(letter(jobz), 1)?;
                    let call =
                        SvdCall { left: vectors, right: vectors, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork };
                    call.run(2, |small, large| {
                        let least = match vectors {
                            Vectors::None => 3 * small + large.max(7 * small),
                            Vectors::Thin => 4 * small * small + 7 * small,
                            Vectors::Full => 4 * small * small + 6 * small + large,
                        };
                        (least, least)
                    })
                })
            }
        }

        #[unsafe(no_mangle)]
        unsafe extern "C" fn $gesvd(
            jobu: *const c_char,
            jobvt: *const c_char,
            m: *const c_int,
            n: *const c_int,
            a: *mut $float,
            lda: *const c_int,
            s: *mut $float,
            u: *mut $float,
            ldu: *const c_int,
            vt: *mut $float,
            ldvt: *const c_int,
            work: *mut $float,
            lwork: *const c_int,
            info: *mut c_int,
        ) {
            // SAFETY: the same contract.
            unsafe {
                answer(info, || {
                    let (left, right) = (wanted(letter(jobu), 1)?, wanted(letter(jobvt), 2)?);
                    let call = SvdCall { left, right, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork };
                    call.run(3, |small, large| (5 * small, (3 * small + large).max(5 * small)))
                })
            }
        }
    };
}

export!(f32: spotrf_ spotrs_ sgesv_ ssyevr_ sgesdd_ sgesvd_);
export!(f64: dpotrf_ dpotrs_ dgesv_ dsyevr_ dgesdd_ dgesvd_);

#[cfg(test)]
mod tests {
    use core::ptr::{null, null_mut};

    use super::*;

    #[test]
    fn a_panic_stops_at_the_boundary_and_becomes_an_info() {
        let mut info = 0;
        // SAFETY: `info` is valid.
        unsafe { answer(&mut info, || panic!("on purpose")) };
        assert_eq!(info, INTERNAL);
        // SAFETY: a null `info` is allowed.
        unsafe { answer(null_mut(), || Ok(())) };
    }

    #[test]
    fn null_pointers_are_illegal_arguments() {
        let (uplo, n, mut info) = (b'U' as c_char, 2, 0);
        let mut a = [1.0; 4];
        // SAFETY: every pointer is null or valid.
        unsafe {
            dpotrf_(null(), &n, a.as_mut_ptr(), &n, &mut info);
            assert_eq!(info, -1);
            dpotrf_(&uplo, null(), a.as_mut_ptr(), &n, &mut info);
            assert_eq!(info, -2);
            dpotrf_(&uplo, &n, null_mut(), &n, &mut info);
            assert_eq!(info, -3);
            dpotrf_(&uplo, &n, a.as_mut_ptr(), null(), &mut info);
            assert_eq!(info, -4);
        }
    }
}
