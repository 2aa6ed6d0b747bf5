//! The paper's statements in our words, each with what was measured and a verdict that code draws from the record.
//!
//! A statement keeps the numbers that its verdict rests on and the rule with its thresholds, so that a reader can disagree with the rule and not only with the verdict. Where the section of
//! the paper is not certain, the part is named (abstract, experiments, discussion).

mod findings;
mod motion;
mod theory;
mod transfer;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::record::{Arms, Comparison};

pub(crate) use findings::findings;

/// Below this a sign test is taken for evidence.
pub const SIGNIFICANT: f64 = 0.01;
/// The share of arms that counts as nearly all.
pub const NEARLY_ALL: f64 = 0.95;
/// The share of arms that counts as hardly any.
pub const HARDLY_ANY: f64 = 0.05;
/// The largest error at the end of a move with which the task counts as done, rad.
pub const DONE_RAD: f64 = 0.05;

/// Whether measurements agree with a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// They do.
    Agrees,
    /// They do under a condition that the statement does not name.
    AgreesOnlyIf,
    /// They do not.
    DoesNotAgree,
    /// Nothing was run that could tell.
    NotTested,
}

/// A statement of the paper and what is left of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statement {
    /// Small letters and hyphens.
    pub name: String,
    /// Where the paper says it.
    pub section: String,
    /// What it says, in our words.
    pub statement: String,
    /// What was measured.
    pub measured: String,
    /// The numbers that the verdict rests on, by names that end in their units.
    pub readings: BTreeMap<String, f64>,
    /// When the statement counts as agreed with.
    pub rule: String,
    /// What follows.
    pub verdict: Verdict,
    /// What must hold, for [`Verdict::AgreesOnlyIf`].
    pub condition: String,
    /// The figure that shows it.
    pub figure: String,
    /// The command that measures it.
    pub command: String,
}

/// Something found beside the statements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    /// In a few words.
    pub title: String,
    /// What it is and what it changes.
    pub text: String,
    /// The numbers in the text.
    pub readings: BTreeMap<String, f64>,
}

/// All statements, in the order of the paper.
pub(crate) fn statements(found: &Comparison) -> Vec<Statement> {
    let all: [fn(&Comparison) -> Statement; 21] = [
        theory::fewer_parameters,
        theory::linear_complexity,
        theory::operations,
        theory::budget,
        theory::no_dynamic_model,
        motion::adaptability,
        motion::same_tuning,
        motion::mrac_saturates,
        motion::mrac_saturates_at_the_papers_limit,
        motion::aic_does_not_saturate,
        motion::smoother,
        motion::steady_state,
        transfer::aic_transfers,
        transfer::jitter_at_joint_6,
        transfer::mrac_stops,
        transfer::mrac_returned_works,
        motion::bottles,
        motion::compliance_to_payloads,
        motion::push_is_recovered_smoothly,
        motion::push_is_given_way_to,
        theory::tuning_effort,
    ];
    all.into_iter().map(|statement| statement(found)).collect()
}

/// A statement in the making: readings are named once, and the text is made of them.
pub(crate) struct Draft {
    readings: BTreeMap<String, f64>,
    missing: bool,
}

impl Draft {
    pub fn new() -> Self {
        Self { readings: BTreeMap::new(), missing: false }
    }

    /// Keeps a number under a name; a number that does not exist makes the statement untested.
    pub fn read(&mut self, name: &str, value: impl Into<Option<f64>>) -> f64 {
        match value.into() {
            Some(value) => {
                self.readings.insert(name.to_owned(), value);
                value
            }
            None => {
                self.missing = true;
                f64::NAN
            }
        }
    }

    pub fn readings(self) -> BTreeMap<String, f64> {
        self.readings
    }

    /// The statement, untested if a number was missing.
    pub fn state(self, words: Words<'_>, measured: String, ruling: Ruling) -> Statement {
        let (verdict, condition) = match ruling {
            _ if self.missing => (Verdict::NotTested, String::new()),
            Ruling::Agrees => (Verdict::Agrees, String::new()),
            Ruling::OnlyIf(condition) => (Verdict::AgreesOnlyIf, condition),
            Ruling::DoesNotAgree => (Verdict::DoesNotAgree, String::new()),
        };
        let measured = if self.missing { "not run, or no run has the figure".to_owned() } else { measured };
        Statement {
            name: words.name.to_owned(),
            section: words.section.to_owned(),
            statement: words.statement.to_owned(),
            measured,
            readings: self.readings,
            rule: words.rule.to_owned(),
            verdict,
            condition,
            figure: words.figure.to_owned(),
            command: words.command.to_owned(),
        }
    }
}

/// The words of a statement that do not depend on what was measured.
pub(crate) struct Words<'a> {
    pub name: &'a str,
    pub section: &'a str,
    pub statement: &'a str,
    pub rule: &'a str,
    pub figure: &'a str,
    pub command: &'a str,
}

/// What a rule says.
pub(crate) enum Ruling {
    Agrees,
    OnlyIf(String),
    DoesNotAgree,
}

impl Ruling {
    pub fn of(agrees: bool) -> Self {
        if agrees { Self::Agrees } else { Self::DoesNotAgree }
    }
}

/// The command that repeats everything.
pub const COMPARE: &str = "autotune compare --robot panda";

/// The share of arms whose figure is there and passes.
pub(crate) fn share(arms: &Arms, figure: &str, passes: impl Fn(f64) -> bool) -> Option<f64> {
    let values = &arms.figures.get(figure)?.values;
    let passing = values.iter().flatten().filter(|value| passes(**value)).count();
    (!values.is_empty()).then(|| passing as f64 / values.len() as f64)
}

/// `5.3 (4.9 to 6.0)`: median, and the quantiles of a tenth and nine tenths, times `scale`.
pub(crate) fn spread(arms: Option<&Arms>, figure: &str, scale: f64) -> String {
    let of = |share| arms.and_then(|arms| arms.quantile(figure, share)).map(|value| value * scale);
    match (of(0.5), of(0.1), of(0.9)) {
        (Some(median), Some(low), Some(high)) => format!("{} ({} to {})", short(median), short(low), short(high)),
        _ => "none".to_owned(),
    }
}

/// Three significant digits.
pub(crate) fn short(value: f64) -> String {
    if value.abs() < f64::MIN_POSITIVE {
        return "0".to_owned();
    }
    let size = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&size) {
        return format!("{value:.2e}");
    }
    let digits = (2.0 - size).max(0.0) as usize;
    format!("{value:.digits$}")
}

/// A p-value in words.
pub(crate) fn chance(p_value: f64) -> String {
    if p_value < 1e-6 { "p < 1e-6".to_owned() } else { format!("p = {}", short(p_value)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let cases =
            [(0.0, "0"), (123.4, "123"), (0.012345, "0.0123"), (4.0, "4.00"), (1.5e7, "1.50e7"), (999_999.0, "999999")];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn a_missing_number_makes_a_statement_untested() {
        let words = Words { name: "n", section: "s", statement: "", rule: "", figure: "", command: "" };
        let mut draft = Draft::new();
        assert!(draft.read("a", Some(1.0)).is_finite() && draft.read("b", None::<f64>).is_nan());
        assert_eq!(draft.state(words, String::new(), Ruling::Agrees).verdict, Verdict::NotTested);
    }
}
