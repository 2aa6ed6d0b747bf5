//! Numbered stories of the workspace, each asserting its result.
//!
//! | story | what it tells |
//! |-------|---------------|
//! | `01_simulate` | the published gains take the Panda through its pick-and-place task |
//! | `02_certify` | the same gains with a certificate, which anybody can check and nobody can edit |
//! | `03_lose_stability` | where they stop being stable, and the arm that runs away there |
//! | `04_tune` | better gains, certified as well |
//! | `05_payload_swap` | two bottles that the controller was not told about |
//! | `06_your_own_arm` | an arm in code: checked, simulated, certified |
//! | `07_your_own_controller` | a controller behind the trait, beside the published one |
//! | `08_property_test` | gains as a property that one's own CI tests |
//! | `09_ask_tell.py` | our search for a simulator that is a script |
//!
//! `cargo run --release -p examples --example 01_simulate`; `cargo test --release -p examples` runs them all, and `cargo test --release -p autotune` the
//! one in Python, which needs the program.
#![forbid(unsafe_code)]
