//! What each search promises, and what none of them may do.
#![expect(clippy::unwrap_used, clippy::float_cmp, reason = "tests")]

mod bipop;
mod cma;
mod common;
mod nelder_mead;
mod scatter;
