//! Why a page cannot be made.

/// A record that cannot be shown, or a page that could not be rendered.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// Two series that belong together differ in length.
    #[error("{series}: expected {expected} entries, found {found}")]
    Length {
        /// The series at fault.
        series: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries present.
        found: usize,
    },
    /// A claim whose evidence does not reach so far speaks of a proof.
    #[error("claim {index} ({kind}) says `proved`, but its evidence is conditional or sampled: reword the statement")]
    Overclaim {
        /// Position in the list of claims, from 0.
        index: usize,
        /// Kind of the claim.
        kind: String,
    },
    /// A figure could not be drawn.
    #[error("cannot draw the figure `{figure}`")]
    Draw {
        /// Title of the figure.
        figure: String,
        /// What the drawing library said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The template could not be rendered.
    #[error("cannot render the page")]
    Template(#[from] minijinja::Error),
}
