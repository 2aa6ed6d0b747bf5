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
    pub rate_per_s: Option<f64>,
    pub radius_rad: Option<f64>,
    pub statement: String,
    pub inequalities: Vec<InequalitySummary>,
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
    claims.map(|(claim, checked)| summary(claim, checked)).collect()
}

fn summary(claim: &Claim, checked: &Checked) -> ClaimSummary {
    let (rate_per_s, radius_rad) = match claim {
        Claim::Exponential(claim) => (Some(claim.rate_per_s.to_f64()), None),
        Claim::Region(claim) => (Some(claim.rate_per_s.to_f64()), Some(claim.radius_rad.to_f64())),
        Claim::Refused(_) | Claim::NotProved(_) => (None, None),
    };
    let inequalities = checked.inequalities.iter().map(|inequality| InequalitySummary {
        name: inequality.name.clone(),
        order: inequality.order,
        smallest_pivot: inequality.smallest_pivot.as_ref().and_then(ToPrimitive::to_f64),
    });
    ClaimSummary {
        kind: checked.kind,
        verdict: verdict_word(checked.verdict),
        grade: checked.grade.map(grade_word),
        rate_per_s,
        radius_rad,
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
        if let Some(radius) = claim.radius_rad {
            let _ = write!(text, ", radius {radius} rad");
        } else if let Some(rate) = claim.rate_per_s {
            let _ = write!(text, ", rate {rate} /s");
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
