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
    /// AIC with published gains, in a comparison.
    AicPublished = 0x10,
    /// AIC with tuned gains, in a comparison.
    AicTuned = 0x11,
    /// A further AIC, in a comparison.
    AicOther = 0x12,
    /// MRAC as its released code has it.
    MracCode = 0x13,
    /// MRAC as the equations of its paper have it.
    MracPaper = 0x14,
    /// MRAC with tuned gains.
    MracTuned = 0x15,
    /// A controller of another kind.
    Baseline = 0x16,
}

impl Ink {
    /// The sentinel as an attribute of a drawing holds it.
    pub(crate) fn sentinel(self) -> String {
        let level = self as u8;
        format!("#{level:02X}{level:02X}{level:02X}")
    }

    /// The sentinel.
    pub(super) const fn color(self) -> RGBColor {
        let level = self as u8;
        RGBColor(level, level, level)
    }
}
