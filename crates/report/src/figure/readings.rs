//! Values that a script shows when a reader points at a figure over time.
//!
//! They stand beside the drawing as JSON, and the drawing is complete without them.

use serde::Serialize;

use super::{Geometry, Ink};
use crate::error::ReportError;

/// Values a series keeps.
const MOST: usize = 160;

/// Digits of a value: one more than a reader is shown.
const DIGITS: usize = 4;

/// What can be read off one figure.
pub(crate) struct Readings {
    /// Times, rising.
    pub(crate) time_s: Vec<f64>,
    /// Unit of the values, empty when they have none.
    pub(crate) unit: String,
    /// The series, in the order of the legend.
    pub(crate) series: Vec<Reading>,
}

/// One series; every list has the length of the times, or is empty.
pub(crate) struct Reading {
    /// How it is called.
    pub(crate) name: String,
    /// Its colour.
    pub(crate) ink: Ink,
    /// Values.
    pub(crate) value: Vec<f64>,
    /// Ends of its band.
    pub(crate) band: Option<(Vec<f64>, Vec<f64>)>,
}

#[derive(Serialize)]
struct Embedded<'a> {
    #[serde(flatten)]
    geometry: Geometry,
    unit: &'a str,
    time_s: Vec<Option<f64>>,
    series: Vec<EmbeddedSeries<'a>>,
}

#[derive(Serialize)]
struct EmbeddedSeries<'a> {
    name: &'a str,
    ink: String,
    value: Vec<Option<f64>>,
    lower: Vec<Option<f64>>,
    upper: Vec<Option<f64>>,
}

impl Readings {
    /// For a `<script type="application/json">`: the recorded values at evenly chosen samples.
    ///
    /// # Errors
    /// [`ReportError::Json`].
    pub(super) fn json(&self, geometry: Geometry) -> Result<String, ReportError> {
        let stride = self.time_s.len().div_ceil(MOST).max(1);
        let chosen = |values: &[f64]| values.iter().step_by(stride).map(|value| short(*value)).collect();
        let series = |one: &'_ Reading| {
            let (lower, upper) = one.band.as_ref().map_or((&[][..], &[][..]), |(lower, upper)| (lower, upper));
            (chosen(&one.value), chosen(lower), chosen(upper))
        };
        let series = self.series.iter().map(|one| {
            let (value, lower, upper) = series(one);
            EmbeddedSeries { name: &one.name, ink: one.ink.sentinel(), value, lower, upper }
        });
        embedded(&Embedded { geometry, unit: &self.unit, time_s: chosen(&self.time_s), series: series.collect() })
    }
}

/// JSON that may stand inside a `<script>`: no letter of it can end the element or start a comment.
///
/// # Errors
/// [`ReportError::Json`].
pub(crate) fn embedded(data: &impl Serialize) -> Result<String, ReportError> {
    let json = serde_json::to_string(data)?;
    Ok(json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026"))
}

fn short(value: f64) -> Option<f64> {
    let value = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn embedded_text_cannot_end_the_script_and_reads_back_the_same() {
        let evil = "</script><!-- <b> & \u{2028}";
        let json = embedded(&evil).unwrap();
        assert!(!json.contains(['<', '>', '&']), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), evil);
    }

    #[test]
    fn values_keep_four_digits_and_gaps_are_null() {
        assert_eq!([short(1.23456), short(-0.000_123_456), short(f64::NAN)], [Some(1.235), Some(-0.000_123_5), None]);
    }
}
