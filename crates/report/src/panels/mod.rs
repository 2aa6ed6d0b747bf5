//! The figures of the page, one module for each section that has any.
//!
//! A wide figure comes in two drawings, for a desk and for a phone; the style sheet shows the one that fits, so that
//! letters keep their size.

mod certificate;
mod held_out;
mod learnt;
pub(crate) mod over_time;
mod response;
mod search;
mod sensitivity;

use serde::Serialize;

use crate::error::ReportError;
use crate::figure::{Plot, Readings};
use crate::record::TuningReport;

/// Nominal sizes: three, two, or one figure a row; and the one of a phone.
pub(crate) const THIRD: (f64, f64) = (336.0, 190.0);
pub(crate) const HALF: (f64, f64) = (400.0, 270.0);
pub(crate) const WIDE: (f64, f64) = (840.0, 290.0);
pub(crate) const PHONE: (f64, f64) = (360.0, 270.0);

/// Points a curve keeps.
pub(crate) const CURVE_POINTS: usize = 320;

/// A figure in both widths.
#[derive(Debug, Serialize)]
pub(crate) struct TwoWidths {
    /// For a desk and for paper.
    wide: String,
    /// For a phone.
    narrow: String,
}

impl TwoWidths {
    pub(crate) fn new(plot: impl Fn((f64, f64)) -> Plot) -> Result<Self, ReportError> {
        Ok(Self { wide: plot(WIDE).svg()?, narrow: plot(PHONE).svg()? })
    }

    /// [`TwoWidths::new`] with values to read off.
    pub(crate) fn with(plot: impl Fn((f64, f64)) -> Plot, readings: &Readings) -> Result<Self, ReportError> {
        Ok(Self { wide: plot(WIDE).svg_with(readings)?, narrow: plot(PHONE).svg_with(readings)? })
    }
}

/// Every figure as SVG; `None` or empty where the record has no data for it.
#[derive(Debug, Serialize)]
pub(crate) struct Panels {
    /// Joint angles, one figure a joint.
    pub(crate) positions: Vec<String>,
    /// Torques, one figure a joint.
    pub(crate) torques: Vec<String>,
    /// Free energy.
    pub(crate) free_energy: Option<TwoWidths>,
    /// Error over time on the held-out plants.
    pub(crate) bands: Option<String>,
    /// Cost of each held-out plant.
    pub(crate) plants: Option<String>,
    /// Course of the search.
    pub(crate) search: Option<TwoWidths>,
    /// Cost against single gains.
    pub(crate) sensitivity: Option<String>,
    /// Share of each gain in the cost.
    pub(crate) shares: Option<String>,
    /// Where loops are stable.
    pub(crate) maps: Vec<String>,
    /// All poles, and those near the imaginary axis.
    pub(crate) poles: Vec<String>,
    /// Certified radius against the moves.
    pub(crate) region: Option<String>,
}

impl Panels {
    /// Draws them all.
    ///
    /// # Errors
    /// [`ReportError::Draw`] when the drawing library fails.
    pub(crate) fn new(record: &TuningReport) -> Result<Self, ReportError> {
        Ok(Self {
            positions: response::positions(&record.response)?,
            torques: response::torques(&record.response)?,
            free_energy: response::free_energy(&record.response)?,
            bands: held_out::bands(&record.held_out)?,
            plants: held_out::plants(record)?,
            search: search::convergence(record)?,
            sensitivity: sensitivity::bars(record)?,
            shares: learnt::shares(&record.learnt)?,
            maps: learnt::maps(&record.learnt)?,
            poles: certificate::poles(&record.certificate)?,
            region: certificate::region(&record.certificate)?,
        })
    }
}

/// Points of a curve from two series.
pub(crate) fn curve(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}
