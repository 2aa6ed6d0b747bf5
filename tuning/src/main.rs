//! autotune.
fn main() {}
