//! Records of a run to one self-contained page.
//!
//! [`tuning_report`] takes a [`TuningReport`], plain data, and returns one HTML document: style sheet and figures are
//! inside, nothing is loaded, no script runs. It reads on a desk and on a phone, light and dark, and prints.
//!
//! | module    | what it holds                                                    |
//! |-----------|------------------------------------------------------------------|
//! | `record`  | the data the page is made of                                     |
//! | `check`   | what a record must satisfy before it is shown                    |
//! | `answer`  | the first screen in words                                        |
//! | `claims`  | claims, verdicts and grades in words                             |
//! | `learnt`  | what the candidates say together, in words                       |
//! | `panels`  | one figure after the other                                       |
//! | `figure`  | axes, marks and labels over plotters' SVG backend                |
//! | `front`   | the page of a front of several goals                             |
//! | `page`    | all of it into `templates/report.html` and `templates/style.css` |
//!
//! Limits: the crate draws and does not compute; it sorts, counts and takes maxima, but means, quantiles over time,
//! poles, radii and verdicts come with the record. Curves are thinned to a few hundred points (peaks stay), pole maps to
//! one dot a pixel.

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
