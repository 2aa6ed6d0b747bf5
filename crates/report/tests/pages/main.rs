//! The pages of synthetic records: complete, self-contained, well-formed, and never bolder than their evidence.

#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod comparison;
mod markup;
mod style;
mod synthetic;
mod tuning;
