//! The BLAS and LAPACK symbols clarabel's semidefinite cone links against, answered by faer.
