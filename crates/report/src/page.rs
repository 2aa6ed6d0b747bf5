//! Everything into the template.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior, Value};
use serde::Serialize;

use crate::answer::{self, Answer, SummaryRow};
use crate::claims::{self, AssumptionView, ClaimView};
use crate::error::ReportError;
use crate::format;
use crate::learnt::{self, LearntView};
use crate::panels::Panels;
use crate::record::{Asked, CommandLine, Evaluation, GainRow, Pair, PlantRow, SegmentRow, TuningReport, Version};

/// The page that all others fill in, and what several of them use.
const BASE: &str = include_str!("templates/base.html");
const MACROS: &str = include_str!("templates/macros.html");
const TEMPLATE: &str = include_str!("templates/report.html");
const STYLE: &str = include_str!("templates/style.css");
const READINGS: &str = include_str!("templates/readings.js");

/// What the template sees; a name it does not find here is an error, not a blank.
#[derive(Serialize)]
struct Page<'a> {
    panels: Panels,
    asked: &'a Asked,
    answer: Answer,
    gains: Vec<GainView<'a>>,
    segments: &'a [SegmentRow],
    diverged_at_s: Pair<Option<f64>>,
    plants: &'a [PlantRow],
    summary: Vec<SummaryRow>,
    outcomes: Vec<OutcomeCount<'a>>,
    learnt: LearntView,
    certificate: Certificate<'a>,
    recheck: &'a [CommandLine],
    method: &'a [String],
    versions: &'a [Version],
}

#[derive(Serialize)]
struct Certificate<'a> {
    file_name: &'a str,
    sha256: &'a str,
    claims: Vec<ClaimView<'a>>,
    assumptions: Vec<AssumptionView<'a>>,
    configurations: Option<u64>,
}

/// A gain, and where its values lie in the range of the search, in percent of a logarithmic scale.
#[derive(Debug, Serialize)]
struct GainView<'a> {
    #[serde(flatten)]
    row: &'a GainRow,
    place_published: Option<f64>,
    place_tuned: Option<f64>,
}

/// How often the search met an outcome.
#[derive(Debug, Serialize)]
struct OutcomeCount<'a> {
    outcome: &'a str,
    count: usize,
}

/// A complete page: the template, which fills in `base.html`, with what it shows.
///
/// # Errors
/// [`ReportError::Template`].
pub(crate) fn html(template: &'static str, page: &impl Serialize) -> Result<String, ReportError> {
    let mut environment = environment()?;
    environment.add_template("base.html", BASE)?;
    environment.add_template("macros.html", MACROS)?;
    environment.add_template("page.html", template)?;
    environment.add_global("style", STYLE);
    environment.add_global("readings_script", READINGS);
    let html = environment.get_template("page.html")?.render(Value::from(Serde(page)))?;
    // The macros at the head of the template leave blank lines.
    Ok(html.trim_start().to_owned())
}

/// What every page's template is rendered with.
fn environment() -> Result<Environment<'static>, ReportError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("num", |value: Option<f64>| format::optional(value));
    environment.add_filter("milli", |value: Option<f64>| format::optional(value.map(|value| 1e3 * value)));
    environment.add_filter("percent", |value: Option<f64>| format::optional(value.map(|value| 100.0 * value)));
    environment.add_filter("chosen", format::chosen);
    // Margins are figures of a claim: never above what was found.
    environment.add_filter("rounded_down", |value: Option<f64>| value.map(format::rounded_down));
    environment.add_filter("exact", |value: f64| format!("{value}"));
    environment.add_filter("sentence", |text: String| format::sentence(&text));
    Ok(environment)
}

/// Renders the page of a record that has been checked.
///
/// # Errors
/// [`ReportError::Draw`] and [`ReportError::Template`].
pub(crate) fn render(record: &TuningReport) -> Result<String, ReportError> {
    let page = Page {
        panels: Panels::new(record)?,
        asked: &record.asked,
        answer: answer::answer(record),
        gains: record.gains.iter().map(gain).collect(),
        segments: &record.segments,
        diverged_at_s: Pair {
            published: record.response.runs.published.diverged_at_s,
            tuned: record.response.runs.tuned.diverged_at_s,
        },
        plants: &record.held_out.plants,
        summary: answer::summary(&record.held_out.plants),
        outcomes: outcomes(&record.search.evaluations),
        learnt: learnt::learnt(record),
        certificate: Certificate {
            file_name: &record.certificate.file_name,
            sha256: &record.certificate.sha256,
            claims: claims::views(&record.certificate),
            assumptions: claims::assumptions(&record.certificate),
            configurations: record.certificate.pole_map.as_ref().map(|map| map.configurations),
        },
        recheck: &record.recheck,
        method: &record.method,
        versions: &record.versions,
    };
    html(TEMPLATE, &page)
}

fn gain(row: &GainRow) -> GainView<'_> {
    let place = |value: f64| {
        let bounds = row.bounds.as_ref()?;
        let (lower, upper) = (bounds.lower, bounds.upper);
        let fraction =
            if lower > 0.0 { (value / lower).ln() / (upper / lower).ln() } else { (value - lower) / (upper - lower) };
        fraction.is_finite().then(|| (1000.0 * fraction.clamp(0.0, 1.0)).round() / 10.0)
    };
    GainView { row, place_published: place(row.published), place_tuned: place(row.tuned) }
}

/// Outcomes in the order in which they first appear.
fn outcomes(evaluations: &[Evaluation]) -> Vec<OutcomeCount<'_>> {
    let mut counts: Vec<OutcomeCount<'_>> = Vec::new();
    for Evaluation { outcome, .. } in evaluations {
        match counts.iter_mut().find(|entry| entry.outcome == outcome) {
            Some(entry) => entry.count += 1,
            None => counts.push(OutcomeCount { outcome, count: 1 }),
        }
    }
    counts
}
