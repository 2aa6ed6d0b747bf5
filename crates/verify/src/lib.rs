//! Certificate file in, verdict out, by exact arithmetic.
