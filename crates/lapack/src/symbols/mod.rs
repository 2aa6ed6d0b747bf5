//! The `extern "C"` functions. Each reads its scalars, checks them in LAPACK's order, and hands copies to the safe
//! modules.

mod blas;
mod lapack;

use core::ffi::c_int;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::memory::Part;

/// Position, from 1, of the first illegal argument.
#[derive(Clone, Copy, Debug)]
struct BadArgument(c_int);

fn require(legal: bool, position: c_int) -> Result<(), BadArgument> {
    if legal { Ok(()) } else { Err(BadArgument(position)) }
}

/// A size: not negative.
fn size(value: c_int, position: c_int) -> Result<usize, BadArgument> {
    usize::try_from(value).map_err(|_| BadArgument(position))
}

/// A leading dimension: at least the number of rows, and at least one.
fn leading(value: c_int, rows: usize, position: c_int) -> Result<usize, BadArgument> {
    let ld = size(value, position)?;
    require(ld >= rows.max(1), position)?;
    Ok(ld)
}

fn triangle(uplo: u8, position: c_int) -> Result<Part, BadArgument> {
    match uplo {
        b'L' => Ok(Part::Lower),
        b'U' => Ok(Part::Upper),
        _ => Err(BadArgument(position)),
    }
}

/// `true` for a transposed operand; for real numbers `C` is `T`.
fn transposed(trans: u8, position: c_int) -> Result<bool, BadArgument> {
    match trans {
        b'N' => Ok(false),
        b'T' | b'C' => Ok(true),
        _ => Err(BadArgument(position)),
    }
}

/// `None` instead of a panic: no panic may cross an `extern "C"` boundary.
fn guarded<R>(work: impl FnOnce() -> R) -> Option<R> {
    catch_unwind(AssertUnwindSafe(work)).ok()
}
