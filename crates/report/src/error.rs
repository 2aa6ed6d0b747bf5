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
    /// A comparison says `proved`, though it only measures.
    #[error("{place} says `proved`, but a comparison measures: reword `{text}`")]
    ClaimsProof {
        /// Where it says so.
        place: String,
        /// What it says.
        text: String,
    },
    /// A name that nothing on the page has.
    #[error("{place} names `{id}`, which is not {kind}")]
    Unknown {
        /// Who names it.
        place: String,
        /// What is named.
        id: String,
        /// What it should be.
        kind: &'static str,
    },
    /// A name that cannot be linked to, or is taken.
    #[error("`{id}` is no name for {kind}: expected small letters, digits and hyphens, and each name once")]
    Id {
        /// The name.
        id: String,
        /// What is named.
        kind: &'static str,
    },
    /// A value that cannot be shown.
    #[error("{place}: expected {expected}")]
    Value {
        /// Where it stands.
        place: String,
        /// What must hold.
        expected: &'static str,
    },
    /// A figure could not be drawn.
    #[error("cannot draw the figure `{figure}`")]
    Draw {
        /// Title of the figure.
        figure: String,
        /// What the drawing library said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The values of a figure could not be written for the scripts of the page.
    #[error("cannot write the values of a figure")]
    Json(#[from] serde_json::Error),
    /// The template could not be rendered.
    #[error("cannot render the page")]
    Template(#[from] minijinja::Error),
}
