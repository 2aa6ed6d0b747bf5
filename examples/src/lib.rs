//! Numbered stories of the workspace, each asserting its result.
//!
//! | story | what it tells |
//! |-------|---------------|
//! | `01_simulate` | the published gains take the Panda through its pick-and-place task |
//! | `02_certify` | the same gains with a certificate, which anybody can check and nobody can edit |
//! | `03_tune` | better gains, certified as well |
//!
//! `cargo run --release -p examples --example 01_simulate`; `cargo test --release -p examples` runs them all.
#![forbid(unsafe_code)]
