//! Numbered stories; see the `examples` targets.
