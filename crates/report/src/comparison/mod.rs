//! The page of a comparison: what a paper says about controllers, and what was measured.

mod cast;
mod check;
mod figures;
mod lines;
mod replay;
mod responses;
mod spread;

use serde::Serialize;

use crate::error::ReportError;
use crate::page::html;
use crate::record::{Agreement, CommandLine, ComparisonReport, Experiment, Finding, Statement, Version};
use cast::{Cast, Player, player};
use figures::{FigureView, TableView};
use replay::ReplayView;

const TEMPLATE: &str = include_str!("../templates/comparison.html");
const REPLAY: &str = include_str!("../templates/replay.js");

#[derive(Serialize)]
struct Page<'a> {
    replay_script: &'static str,
    about: &'a str,
    headline: &'a str,
    answer: &'a [String],
    assumptions: &'a [String],
    tally: Vec<Tally>,
    controllers: Vec<ControllerView<'a>>,
    statements: Vec<StatementView<'a>>,
    findings: &'a [Finding],
    experiments: Vec<ExperimentView<'a>>,
    replay: Option<ReplayView<'a>>,
    commands: &'a [CommandLine],
    method: &'a [String],
    versions: &'a [Version],
}

#[derive(Serialize)]
struct ControllerView<'a> {
    player: Player<'a>,
    in_words: &'a str,
}

/// A verdict in words, with a symbol and a class of the style sheet.
#[derive(Clone, Copy, Debug, Serialize)]
struct Verdict {
    class: &'static str,
    symbol: &'static str,
    words: &'static str,
    words_of_many: &'static str,
}

/// How many statements have a verdict.
#[derive(Serialize)]
struct Tally {
    #[serde(flatten)]
    verdict: Verdict,
    count: usize,
}

#[derive(Serialize)]
struct StatementView<'a> {
    #[serde(flatten)]
    statement: &'a Statement,
    verdict: Verdict,
    /// Title of the figure that shows it.
    figure_title: Option<&'a str>,
}

#[derive(Serialize)]
struct ExperimentView<'a> {
    id: &'a str,
    title: &'a str,
    question: &'a str,
    answer: &'a str,
    method: &'a [String],
    figures: Vec<FigureView<'a>>,
    tables: Vec<TableView<'a>>,
    commands: &'a [CommandLine],
}

/// The page of a comparison of controllers: a complete HTML document.
///
/// # Errors
/// - [`ReportError::Length`]: two series of the record that belong together differ in length;
/// - [`ReportError::Id`], [`ReportError::Unknown`], [`ReportError::Value`]: a name or a value that cannot be shown;
/// - [`ReportError::ClaimsProof`]: a text says "proved", though a comparison only measures;
/// - [`ReportError::Draw`], [`ReportError::Template`], [`ReportError::Json`]: the libraries beneath failed.
pub fn comparison_report(record: &ComparisonReport) -> Result<String, ReportError> {
    check::check(record)?;
    let cast = Cast(&record.controllers);
    let controllers = record.controllers.iter();
    let page = Page {
        replay_script: REPLAY,
        about: &record.about,
        headline: &record.headline,
        answer: &record.answer,
        assumptions: &record.assumptions,
        tally: tally(&record.statements),
        controllers: controllers.map(|one| ControllerView { player: player(one), in_words: &one.in_words }).collect(),
        statements: record.statements.iter().map(|statement| statement_view(statement, record)).collect(),
        findings: &record.findings,
        experiments: record.experiments.iter().map(|one| experiment(one, cast)).collect::<Result<_, _>>()?,
        replay: record.replay.as_ref().map(|replay| replay::replay(replay, cast)).transpose()?,
        commands: &record.commands,
        method: &record.method,
        versions: &record.versions,
    };
    html(TEMPLATE, &page)
}

fn verdict(agreement: Agreement) -> Verdict {
    let (class, symbol, words, words_of_many) = match agreement {
        Agreement::Agrees => ("agrees", "✓", "agrees", "agree"),
        Agreement::AgreesOnlyIf => ("only-if", "◐", "agrees only if", "agree on a condition"),
        Agreement::DoesNotAgree => ("differs", "✗", "does not agree", "do not agree"),
    };
    Verdict { class, symbol, words, words_of_many }
}

fn tally(statements: &[Statement]) -> Vec<Tally> {
    let count = |agreement| statements.iter().filter(|statement| statement.agreement == agreement).count();
    [Agreement::Agrees, Agreement::AgreesOnlyIf, Agreement::DoesNotAgree]
        .into_iter()
        .map(|agreement| Tally { verdict: verdict(agreement), count: count(agreement) })
        .collect()
}

fn statement_view<'a>(statement: &'a Statement, record: &'a ComparisonReport) -> StatementView<'a> {
    let mut figures = record.experiments.iter().flat_map(|experiment| &experiment.figures);
    let figure = figures.find(|figure| Some(&figure.id) == statement.figure.as_ref());
    StatementView {
        statement,
        verdict: verdict(statement.agreement),
        figure_title: figure.map(|figure| figure.title.as_str()),
    }
}

fn experiment<'a>(experiment: &'a Experiment, cast: Cast<'a>) -> Result<ExperimentView<'a>, ReportError> {
    Ok(ExperimentView {
        id: &experiment.id,
        title: &experiment.title,
        question: &experiment.question,
        answer: &experiment.answer,
        method: &experiment.method,
        figures: experiment.figures.iter().map(|one| figures::figure(one, cast)).collect::<Result<_, _>>()?,
        tables: experiment.tables.iter().map(|table| figures::table(table, cast)).collect(),
        commands: &experiment.commands,
    })
}
