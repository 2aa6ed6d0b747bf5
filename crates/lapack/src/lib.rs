//! The BLAS and LAPACK symbols that clarabel's semidefinite cone links against, answered by faer.
//!
//! clarabel 0.11 (features `sdp`, `blas-src`, `lapack-src`) calls Fortran symbols that some library has to provide.
//! The usual providers are system packages or need a Fortran compiler; this crate provides exactly the symbols clarabel
//! calls, in Rust. There is no Rust API. One line in any crate of the program is enough to link them:
//!
//! ```
//! use certune_lapack as _;
//! ```
//!
//! # Symbols
//!
//! Each exists for `f32` (`s…`) and `f64` (`d…`); integers are 32 bits wide, matrices column-major.
//!
//! | symbol   | computes                                            | options                                             |
//! |----------|-----------------------------------------------------|-----------------------------------------------------|
//! | `?gemm_` | `C = alpha op(A) op(B) + beta C`                    | `N`, `T`, `C` (= `T`) for both                      |
//! | `?gemv_` | `y = alpha op(A) x + beta y`                        | `N`, `T`, `C`; increments of any sign               |
//! | `?symv_` | `y = alpha A x + beta y`, `A = Aᵀ`                  | either triangle; increments of any sign             |
//! | `?syrk_` | `C = alpha A Aᵀ + beta C` or `alpha Aᵀ A + beta C`  | either triangle; `N`, `T`, `C`                      |
//! | `?syr2k_`| `C = alpha (A Bᵀ + B Aᵀ) + beta C` or its transpose | either triangle; `N`, `T`, `C`                      |
//! | `?potrf_`| `A = L Lᵀ` or `Uᵀ U`                                | either triangle                                     |
//! | `?potrs_`| `A X = B` from the factor of `?potrf_`              | either triangle                                     |
//! | `?gesv_` | `A X = B` by `P L U` with partial pivoting          |                                                     |
//! | `?syevr_`| `A = V diag(w) Vᵀ`, `w` ascending                   | `N`, `V`; range `A`, `V`, `I`; either triangle      |
//! | `?gesdd_`| `A = U diag(s) Vᵀ`, `s` descending                  | `N`, `S`, `A`                                       |
//! | `?gesvd_`| as `?gesdd_`                                        | `N`, `S`, `A` for `U` and `Vᵀ` each                 |
//!
//! Letters may be of either case. A workspace query (`lwork = -1`) answers the smallest size that LAPACK documents; no
//! workspace is used, but a smaller one is refused as in LAPACK. `abstol` of `?syevr_` is not used: the accuracy does
//! not depend on it.
//!
//! # Failures
//!
//! - LAPACK: `info = -i` when argument `i` is illegal or not in the table above (job `O`). `info > 0` is LAPACK's
//!   meaning: the order of the first leading minor that is not positive definite (`?potrf_`), the first column without
//!   a usable pivot (`?gesv_`), no convergence (`?syevr_`, `?gesdd_`, `?gesvd_`). Beyond LAPACK, a matrix to be
//!   factored that holds NaN or infinity gives `info > 0` too, and so does a factor that overflows. `info = i32::MAX`
//!   is an internal failure (a panic that was caught). Where `info != 0` the outputs are unspecified; `?gesv_` leaves
//!   its arguments as they were.
//! - BLAS has no `info`: an illegal argument is reported on standard error by name and position and nothing is
//!   written, as OpenBLAS does; an internal failure fills the result with NaN, so that it cannot pass unseen.
//!
//! # Numerics
//!
//! Products, Cholesky and LU are faer's. The spectral routines scale by a power of two so that the largest entry is
//! near one, run faer's tridiagonal or bidiagonal QR iteration, and scale back; so no intermediate overflows and the
//! scaling itself rounds nothing that matters. Errors are normwise, as LAPACK's: of order `n eps ‖A‖`. An entry that a
//! routine documents as not referenced (the other triangle, `C` when `beta = 0`, `A` when `alpha = 0`) is not read.
//!
//! Every operand is copied into aligned memory first and one thread does the work, so a result depends neither on
//! where the caller's arrays lie nor on the number of threads: on one machine, same input, same bits. Processors with
//! other vector widths round differently.
//!
//! # Safety argument
//!
//! Calling any symbol is `unsafe` by nature: the caller promises, as with any BLAS, that each array is as large as its
//! sizes say and that outputs overlap nothing. Given that promise this crate adds nothing unsafe: sizes, leading
//! dimensions and null pointers are checked before memory is touched, module `memory` is the only one that
//! dereferences, it copies whole regions in and out and never forms a reference to the caller's arrays, and everything
//! between is safe Rust on faer's own matrices. Panics are caught before they reach an `extern "C"` boundary.
//!
//! # Limits
//!
//! Do not link a second provider (`sdp-openblas`, `sdp-mkl`, …): the symbols would be defined twice. Meant for orders
//! up to a few hundred.
//!
//! Source: the reference BLAS and LAPACK 3.12 documentation, <https://netlib.org/lapack/explore-html/>.

mod cholesky;
mod eigen;
mod lu;
mod memory;
mod product;
mod scalar;
mod svd;
mod symbols;
