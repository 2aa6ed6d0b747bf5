//! Checked claims in words and as JSON, the same for every command that prints some.

use std::fmt::Write as _;

use certune::dynamics::Robot;
use certune::verify::{Assumption, Certificate, Checked, Claim, Evidence, Figure, Grade, Verdict};
use certune::{Growth, StabilityError, growth};
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
    /// For a refusal that names an arm and configuration: the nonlinear loop, let go there.
    pub simulated: Option<GrowthSummary>,
    pub inequalities: Vec<InequalitySummary>,
}

/// One figure for `--json`.
#[derive(Debug, Serialize)]
pub struct FigureSummary {
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
}

/// What a refusal looks like in time, for `--json`.
#[derive(Debug, Serialize)]
pub struct GrowthSummary {
    pub after_s: f64,
    pub from_rad: f64,
    pub to_rad: f64,
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

/// Simulates the refusals of a certificate, entry by entry.
pub fn growths<const N: usize>(
    robot: &Robot,
    certificate: &Certificate,
) -> Result<Vec<Option<Growth>>, StabilityError> {
    let document = certificate.document();
    let of = |claim: &Claim| match claim {
        Claim::Refused(refused) => growth::<N>(robot, document, refused),
        _ => Ok(None),
    };
    document.claims.iter().map(|entry| of(&entry.claim)).collect()
}

/// What a simulated refusal shows.
pub fn growth_in_words(growth: &Growth) -> String {
    let Growth { after_s, from_rad, to_rad } = growth;
    let short = |x: f64| format!("{x:.1e}").parse().unwrap_or(x);
    let seen = if to_rad > from_rad {
        format!("has grown from {from_rad} to {} rad", short(*to_rad))
    } else {
        format!("is still {} rad, from {from_rad} rad at the start: the instability is slow", short(*to_rad))
    };
    format!("Simulated there, in the nonlinear loop: after {after_s} s the deviation {seen}.")
}

/// A figure with its unit.
pub fn figure_in_words(figure: &Figure) -> String {
    match figure.unit {
        "1" => format!("{} {}", figure.name, figure.value),
        "1/s" => format!("{} {} /s", figure.name, figure.value),
        unit => format!("{} {} {unit}", figure.name, figure.value),
    }
}

/// Every claim of a certificate; `growth` is what [`growths`] found, or nothing.
pub fn summaries(certificate: &Certificate, growth: &[Option<Growth>]) -> Vec<ClaimSummary> {
    let claims = certificate.document().claims.iter().zip(certificate.checked()).enumerate();
    claims
        .map(|(index, (entry, checked))| summary(&entry.claim, checked, growth.get(index).copied().flatten()))
        .collect()
}

fn summary(claim: &Claim, checked: &Checked, growth: Option<Growth>) -> ClaimSummary {
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
        simulated: growth.map(|Growth { after_s, from_rad, to_rad }| GrowthSummary { after_s, from_rad, to_rad }),
        inequalities: inequalities.collect(),
    }
}

/// What the claims are about, short of the constants' values.
fn without_constants(about: &str, certificate: &Certificate) -> String {
    let (mark, rest) = match &certificate.document().constants.evidence {
        Evidence::Sampled { .. } => (
            " The condition: ",
            "The constants that bound the arm were sampled, so every claim is conditional; -v shows them.",
        ),
        Evidence::Proved { .. } => {
            (" The constants are proved", "The constants that bound the arm are proved; -v shows them.")
        }
    };
    about.split_once(mark).map_or_else(|| about.to_owned(), |(head, _)| format!("{head} {rest}"))
}

/// The claims for a person: verdict and statement, then, if asked for, what they rest on and how far the inequalities are from failing.
pub fn claims_in_words(certificate: &Certificate, growth: &[Option<Growth>], in_detail: bool) -> String {
    let about = &certificate.document().about;
    let mut text = if in_detail { wrapped(about, 0) } else { wrapped(&without_constants(about, certificate), 0) };
    let claims = certificate.document().claims.iter().zip(summaries(certificate, growth));
    for (index, (entry, claim)) in claims.enumerate() {
        text.push('\n');
        let _ = write!(text, "{}. {}: {}", index + 1, claim.kind, claim.verdict);
        if let Some(grade) = claim.grade {
            let _ = write!(text, " ({grade})");
        }
        for figure in entry.claim.figures() {
            let _ = write!(text, ", {}", figure_in_words(&figure));
        }
        let _ = writeln!(text);
        text.push_str(&wrapped(&claim.statement, 2));
        if let Some(growth) = growth.get(index).and_then(Option::as_ref) {
            text.push_str(&wrapped(&growth_in_words(growth), 2));
        }
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
