//! Checked claims in words and as JSON, the same for every command that prints some.

use std::fmt::Write as _;

use certune::verify::{Assumption, Certificate, Checked, Claim, Grade, Verdict};
use num_traits::ToPrimitive;
use serde::Serialize;

use crate::output::{table, wrapped};

/// One claim for `--json`.
#[derive(Debug, Serialize)]
pub struct ClaimSummary {
    pub kind: &'static str,
    pub verdict: &'static str,
    pub grade: Option<&'static str>,
    /// The claim's figures, the most telling first.
    pub figures: Vec<FigureSummary>,
    pub statement: String,
    pub inequalities: Vec<InequalitySummary>,
}

/// One figure for `--json`.
#[derive(Debug, Serialize)]
pub struct FigureSummary {
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
}

/// One matrix inequality for `--json`.
#[derive(Debug, Serialize)]
pub struct InequalitySummary {
    pub name: String,
    pub order: usize,
    pub smallest_pivot: Option<f64>,
}

/// One assumption for `--json`.
#[derive(Debug, Serialize)]
pub struct AssumptionSummary {
    pub grade: &'static str,
    pub text: String,
}

impl From<Assumption> for AssumptionSummary {
    fn from(assumption: Assumption) -> Self {
        Self { grade: grade_word(assumption.grade), text: assumption.text }
    }
}

pub fn grade_word(grade: Grade) -> &'static str {
    match grade {
        Grade::Conditional => "conditional",
        Grade::Proved => "proved",
    }
}

pub fn verdict_word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "holds",
        Verdict::Refused => "refused",
        Verdict::NotProved => "not proved",
    }
}

/// Every claim of a certificate.
pub fn summaries(certificate: &Certificate) -> Vec<ClaimSummary> {
    let claims = certificate.document().claims.iter().zip(certificate.checked());
    claims.map(|(entry, checked)| summary(&entry.claim, checked)).collect()
}

fn summary(claim: &Claim, checked: &Checked) -> ClaimSummary {
    let figures = claim.figures().into_iter().map(|figure| FigureSummary {
        name: figure.name,
        value: figure.value.to_f64(),
        unit: figure.unit,
    });
    let inequalities = checked.inequalities.iter().map(|inequality| InequalitySummary {
        name: inequality.name.clone(),
        order: inequality.order,
        smallest_pivot: inequality.smallest_pivot.as_ref().and_then(ToPrimitive::to_f64),
    });
    ClaimSummary {
        kind: checked.kind.name(),
        verdict: verdict_word(checked.verdict),
        grade: checked.grade.map(grade_word),
        figures: figures.collect(),
        statement: checked.statement.clone(),
        inequalities: inequalities.collect(),
    }
}

/// The claims for a person: verdict and statement, then, if asked for, what they rest on and how far the inequalities are from failing.
pub fn claims_in_words(certificate: &Certificate, in_detail: bool) -> String {
    let mut text = wrapped(&certificate.document().about, 0);
    for claim in summaries(certificate) {
        text.push('\n');
        let _ = write!(text, "{}: {}", claim.kind, claim.verdict);
        if let Some(grade) = claim.grade {
            let _ = write!(text, " ({grade})");
        }
        if let Some(figure) = claim.figures.first() {
            let _ = write!(text, ", {} {} {}", figure.name, figure.value, figure.unit);
        }
        let _ = writeln!(text);
        text.push_str(&wrapped(&claim.statement, 2));
        if in_detail && !claim.inequalities.is_empty() {
            let rows: Vec<_> = claim
                .inequalities
                .iter()
                .map(|row| {
                    let pivot = row.smallest_pivot.map_or_else(|| "none".to_owned(), |pivot| format!("{pivot:.3e}"));
                    vec![row.name.clone(), row.order.to_string(), pivot]
                })
                .collect();
            text.push_str(&table(&["exact matrix inequality", "order", "smallest pivot"], &rows));
        }
    }
    if in_detail {
        text.push_str("\nassumptions\n");
        for assumption in certificate.assumptions() {
            text.push_str(&wrapped(&format!("{}: {}", grade_word(assumption.grade), assumption.text), 2));
        }
    }
    text
}
