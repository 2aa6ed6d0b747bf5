//! Claims in the words of the page: what holds, how well, and resting on what.
//!
//! A claim is worth no more than the weakest of its own grade and its assumptions' grades, those that have one. The word "proved" is written
//! for a claim that holds and is worth that much; the only other use is the verdict "not proved".

use std::collections::BTreeSet;

use serde::Serialize;

use crate::record::{Assumption, CertificateRecord, Claim, Grade, Margin, Verdict};

/// A claim as the page shows it.
#[derive(Debug, Serialize)]
pub(crate) struct ClaimView<'a> {
    kind: &'a str,
    tone: Tone,
    /// The verdict with its grade.
    badge: &'static str,
    statement: &'a str,
    counterexample: &'a [String],
    assumptions: Vec<AssumptionView<'a>>,
    margins: &'a [Margin],
}

/// Colour of a verdict; its words say the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Tone {
    Exact,
    Conditional,
    Failed,
    Open,
}

/// An assumption as the page shows it.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) struct AssumptionView<'a> {
    text: &'a str,
    grade: &'static str,
}

/// Grade of a claim: the weakest link.
pub(crate) fn worth(claim: &Claim) -> Grade {
    claim.assumptions.iter().filter_map(|assumption| assumption.grade).fold(claim.grade, Grade::min)
}

/// Every claim, for the page.
pub(crate) fn views(certificate: &CertificateRecord) -> Vec<ClaimView<'_>> {
    certificate.claims.iter().map(view).collect()
}

/// What the claims that hold rest on, each once.
pub(crate) fn assumptions(certificate: &CertificateRecord) -> Vec<AssumptionView<'_>> {
    let holding = certificate.claims.iter().filter(|claim| claim.verdict == Verdict::Holds);
    let distinct: BTreeSet<_> = holding.flat_map(|claim| claim.assumptions.iter().map(assumption)).collect();
    distinct.into_iter().collect()
}

/// One line on stability for a reader in a hurry.
pub(crate) fn in_one_line(certificate: &CertificateRecord) -> (Tone, String) {
    let claims = &certificate.claims;
    let count = |verdict: Verdict| claims.iter().filter(|claim| claim.verdict == verdict).count();
    let (held, refused, open) = (count(Verdict::Holds), count(Verdict::Refused), count(Verdict::NotProved));
    if claims.is_empty() {
        return (Tone::Open, "no claim was examined".to_owned());
    }
    if refused > 0 {
        let shown = claims.iter().any(|claim| claim.verdict == Verdict::Refused && !claim.counterexample.is_empty());
        let how = if shown { ", with a counterexample" } else { "" };
        return (Tone::Failed, format!("{} refused{how}", of(refused, claims.len())));
    }
    if open > 0 {
        return (Tone::Open, format!("{} not proved and not refuted", of(open, claims.len())));
    }
    let weakest = claims.iter().map(worth).min().unwrap_or(Grade::Sampled);
    let all = match held {
        1 => "the claim".to_owned(),
        2 => "both claims".to_owned(),
        _ => format!("all {held} claims"),
    };
    match weakest {
        Grade::Proved => (Tone::Exact, format!("{all} proved")),
        Grade::Conditional => (Tone::Conditional, "conditional: holds if the sampled constants hold".to_owned()),
        Grade::Sampled => (Tone::Open, format!("{all} seen to hold in samples only")),
    }
}

fn of(part: usize, whole: usize) -> String {
    match (part, whole) {
        (1, 1) => "the claim is".to_owned(),
        (1, _) => format!("1 of {whole} claims is"),
        _ => format!("{part} of {whole} claims are"),
    }
}

fn view(claim: &Claim) -> ClaimView<'_> {
    let (tone, badge) = match (claim.verdict, worth(claim)) {
        (Verdict::Holds, Grade::Proved) => (Tone::Exact, "Proved"),
        (Verdict::Holds, Grade::Conditional) => (Tone::Conditional, "Conditional: holds if the sampled constants hold"),
        (Verdict::Holds, Grade::Sampled) => (Tone::Open, "Sampled: seen to hold, no certificate"),
        (Verdict::Refused, Grade::Sampled | Grade::Conditional | Grade::Proved) => (Tone::Failed, "Refused"),
        (Verdict::NotProved, Grade::Sampled | Grade::Conditional | Grade::Proved) => (Tone::Open, "Not proved"),
    };
    ClaimView {
        kind: &claim.kind,
        tone,
        badge,
        statement: &claim.statement,
        counterexample: &claim.counterexample,
        assumptions: claim.assumptions.iter().map(assumption).collect(),
        margins: &claim.margins,
    }
}

fn assumption(assumption: &Assumption) -> AssumptionView<'_> {
    let grade = match assumption.grade {
        Some(Grade::Sampled) => "sampled",
        Some(Grade::Conditional) => "conditional",
        Some(Grade::Proved) => "exact",
        None => "model",
    };
    AssumptionView { text: &assumption.text, grade }
}
