//! Why a certificate is unreadable, and why a readable one is rejected.

/// The text is no certificate at all.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// Not JSON of the certificate's shape: truncated, a field missing, unknown or of the wrong type.
    #[error("not a certificate: {0}")]
    Unreadable(#[from] serde_json::Error),
    /// Longer than any certificate.
    #[error("{found} bytes, a certificate has at most {most}")]
    Length {
        /// Bytes of the text.
        found: usize,
        /// Most that is read.
        most: usize,
    },
    /// Written by another version of the format.
    #[error("certificate schema {found}, this version reads schema {expected}")]
    Schema {
        /// The schema named in the file.
        found: u32,
        /// The schema this crate reads.
        expected: u32,
    },
}

/// A readable certificate that proves less than it says.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rejection {
    /// The content does not have the hash written beside it.
    #[error("the content hashes to {computed}, the file says {written}: it was edited after it was sealed")]
    Hash {
        /// SHA-256 of the canonical content.
        computed: String,
        /// The hash in the file.
        written: String,
    },
    /// A document without claims proves nothing.
    #[error("the document holds no claim")]
    Empty,
    /// More claims than a document can need.
    #[error("the document holds {found} claims, expected at most {most}")]
    Crowded {
        /// Claims in the file.
        found: usize,
        /// Most that are checked.
        most: usize,
    },
    /// The text is not the form in which a document is written.
    #[error(
        "the text is not in the form in which certificates are written: a field is missing or spelled in another way"
    )]
    Form,
    /// Gains, family or constants are none.
    #[error(transparent)]
    Head(#[from] Flaw),
    /// The constants are said to be proved, and the record that would prove them is unknown or says something else.
    #[error("the constants are not those of a known record: {reason}")]
    Record {
        /// What differs.
        reason: String,
    },
    /// The description is not that of the numbers.
    #[error("the description is not the one its numbers make; they say: {derived}")]
    About {
        /// The description derived from the numbers.
        derived: String,
    },
    /// The words are not those of the numbers.
    #[error("claim {index}: the statement is not the one its numbers make; they say: {derived}")]
    Statement {
        /// Position of the claim, from 1.
        index: usize,
        /// The statement derived from the numbers.
        derived: String,
    },
    /// The grade is not the one the evidence allows.
    #[error("claim {index}: the grade is not the one that {allowed} evidence allows")]
    Grade {
        /// Position of the claim, from 1.
        index: usize,
        /// What the constants rest on.
        allowed: &'static str,
    },
    /// The proof of a claim does not stand.
    #[error("claim {index}: {flaw}")]
    Claim {
        /// Position of the claim, from 1.
        index: usize,
        /// Where it fails.
        flaw: Flaw,
    },
}

/// What is wrong with a number, or with a proof.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// A quantity is outside what the claim's proof allows.
    #[error("{quantity} is {value}, expected {expected}")]
    Quantity {
        /// Name of the quantity, as in the file.
        quantity: &'static str,
        /// As written.
        value: String,
        /// What the proof needs.
        expected: &'static str,
    },
    /// A list has the wrong length.
    #[error("{quantity} has {found} entries, expected {expected}")]
    Length {
        /// Name of the list.
        quantity: &'static str,
        /// Entries in the file.
        found: usize,
        /// How many there must be: one per joint, or as many as a matrix has.
        expected: usize,
    },
    /// The claim's proof needs the same gains on every joint.
    #[error("{gain} differs between joints: this claim is proved only for equal gains on every joint")]
    UnequalGains {
        /// The gain that differs.
        gain: &'static str,
    },
    /// The claim is about the other controller.
    #[error("this claim is about {expected}")]
    Controller {
        /// The controller it is about.
        expected: &'static str,
    },
    /// The claim's proof needs a constant that the document does not give.
    #[error("the proof needs the constant {constant}, which the document does not give")]
    Missing {
        /// Its name.
        constant: &'static str,
    },
    /// The claim's proof does not cover the family or the set of configurations.
    #[error("the proof does not cover {what}")]
    NotCovered {
        /// What is outside.
        what: &'static str,
    },
    /// A matrix inequality of the proof is false.
    #[error("the inequality `{inequality}` does not hold")]
    Inequality {
        /// Name of the inequality.
        inequality: String,
    },
    /// A polynomial family is not shown stable.
    #[error("{reason}")]
    Polynomial {
        /// Where the proof stops.
        reason: String,
    },
    /// A refusal whose counterexample is none.
    #[error("the counterexample is no counterexample: {reason}")]
    Counterexample {
        /// Why.
        reason: &'static str,
    },
}

impl Flaw {
    pub(crate) fn quantity(quantity: &'static str, value: &str, expected: &'static str) -> Self {
        Self::Quantity { quantity, value: value.chars().take(64).collect(), expected }
    }
}
