//! A small plotting layer over plotters' SVG backend.
//!
//! Plotters writes the SVG; axes, ticks and labels are placed here, because its mesh offers no direct labels and rounds
//! coordinates to whole pixels. So a figure is drawn on a canvas [`plot::SCALE`] times its nominal size.
//!
//! Colours are sentinels ([`ink::Ink`]): the style sheet maps `#010101` and so on to variables, so that one drawing
//! serves light and dark screens and paper.

mod axis;
mod ink;
mod plot;
mod readings;
mod thin;

pub(crate) use axis::{Axis, row_at};
pub(crate) use ink::Ink;
pub(crate) use plot::{Anchor, Geometry, Mark, Plot};
pub(crate) use readings::{Reading, Readings, embedded};
pub(crate) use thin::{corners, finite_runs, on_grid, thin};

/// How strongly one of several bands over each other is drawn: the more there are, the paler.
pub(crate) fn band_opacity(bands: usize) -> f64 {
    (0.44 / bands.max(1) as f64).clamp(0.12, 0.22)
}

/// Smallest and largest finite value.
pub(crate) fn span(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |span, value| match span {
        None => Some((value, value)),
        Some((lower, upper)) => Some((lower.min(value), upper.max(value))),
    })
}
