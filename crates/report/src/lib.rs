//! Records of a run to one self-contained page.
//!
//! [`tuning_report`] takes a [`TuningReport`], plain data, and returns one HTML document; so do [`front_report`] and
//! [`comparison_report`] with their records. Style sheet, figures and scripts are inside, nothing is loaded. It reads on a
//! desk and on a phone, light and dark, and prints.
//!
//! Two scripts of our own run, both without a library: `templates/readings.js` shows the values of a figure over time
//! under the pointer or, with the arrow keys, for a figure that has the focus; `templates/replay.js` moves the stick
//! figures of a comparison. Without scripts every figure is there, and the stick figures show start and end.
//!
//! | module       | what it holds                                                              |
//! |--------------|----------------------------------------------------------------------------|
//! | `record`     | the data the pages are made of                                             |
//! | `check`      | what a record must satisfy before it is shown                              |
//! | `answer`     | the first screen in words                                                  |
//! | `claims`     | claims, verdicts and grades in words                                       |
//! | `learnt`     | what the candidates say together, in words                                 |
//! | `panels`     | one figure after the other                                                 |
//! | `figure`     | axes, marks, labels and values to read, over plotters' SVG backend         |
//! | `front`      | the page of a front of several goals                                       |
//! | `comparison` | the page of a comparison of controllers: check, figures, replay            |
//! | `page`       | a template into `templates/base.html` with `templates/style.css`           |
//!
//! Limits: the crate draws and does not compute; it sorts, counts and takes maxima and quantiles over arms, but means,
//! quantiles over time, poles, radii and verdicts come with the record. Curves are thinned to a few hundred points (peaks
//! stay), values to read to evenly chosen samples, pole maps to one dot a pixel.

#![forbid(unsafe_code)]

mod answer;
mod check;
mod claims;
mod comparison;
mod error;
mod figure;
mod format;
mod front;
mod learnt;
mod page;
mod panels;
mod quantile;
mod record;

pub use comparison::comparison_report;
pub use error::ReportError;
pub use front::{FrontGoal, FrontPoint, FrontReport, front_report};
pub use record::*;

/// The page of one tuning run: a complete HTML document.
///
/// ```
/// # let record: certune_report::TuningReport =
/// #     serde_json::from_str(include_str!("../tests/smallest.json")).expect("a valid record");
/// let page = certune_report::tuning_report(&record)?;
/// assert!(page.starts_with("<!doctype html>"));
/// # Ok::<(), certune_report::ReportError>(())
/// ```
///
/// # Errors
/// - [`ReportError::Length`]: two series of the record that belong together differ in length;
/// - [`ReportError::Overclaim`]: a statement says "proved" though its grade, or an assumption's, is lower;
/// - [`ReportError::Draw`], [`ReportError::Template`]: the libraries beneath failed.
pub fn tuning_report(record: &TuningReport) -> Result<String, ReportError> {
    check::check(record)?;
    page::render(record)
}
