//! Colours that the style sheet replaces.

use plotters::style::RGBColor;

/// What a stroke or a fill means; `src/templates/style.css` holds the colour of each, by the same number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    /// The tuned gains.
    Tuned = 1,
    /// The published gains.
    Published = 2,
    /// The goal, and other quiet references; dashed.
    Goal = 3,
    /// Words.
    Text = 4,
    /// Grid lines.
    Grid = 5,
    /// Ticks and their labels.
    Axis = 6,
    /// What is certified.
    Certified = 7,
    /// What failed, or lies outside.
    Outside = 8,
    /// One candidate among many.
    Candidate = 9,
}

impl Ink {
    /// The sentinel.
    pub(super) const fn color(self) -> RGBColor {
        let level = self as u8;
        RGBColor(level, level, level)
    }
}
