//! Figures and tables as the template sees them.

use serde::Serialize;

use super::cast::{Cast, Player};
use super::{lines, responses, spread};
use crate::error::ReportError;
use crate::format;
use crate::panels::TwoWidths;
use crate::record::{Cell, Column, Drawing, ExperimentFigure, FigureTable, Outcome, OutcomeGrid, Spread};

/// What was drawn: one figure in both widths, small multiples, figures half as wide as the page, or a table of words.
#[derive(Debug, Default, Serialize)]
pub(super) struct Drawn<'a> {
    pub(super) wide: Option<TwoWidths>,
    pub(super) small: Vec<String>,
    pub(super) halves: Vec<String>,
    pub(super) grid: Option<GridView<'a>>,
}

/// A figure of an experiment.
#[derive(Debug, Serialize)]
pub(super) struct FigureView<'a> {
    id: &'a str,
    title: &'a str,
    caption: &'a str,
    /// Legend; empty where each curve carries its name. A wide figure has names in it, and needs none on a desk.
    key: Vec<Player<'a>>,
    has_goal: bool,
    /// What the bands are.
    band: &'a str,
    #[serde(flatten)]
    drawn: Drawn<'a>,
}

#[derive(Debug, Serialize)]
pub(super) struct GridView<'a> {
    row_name: &'a str,
    columns: &'a [String],
    rows: Vec<RowView<'a, GridCellView<'a>>>,
}

#[derive(Debug, Serialize)]
struct GridCellView<'a> {
    class: &'static str,
    symbol: &'static str,
    outcome: &'static str,
    detail: &'a str,
}

#[derive(Debug, Serialize)]
pub(super) struct TableView<'a> {
    caption: &'a str,
    row_name: &'a str,
    columns: Vec<ColumnView<'a>>,
    rows: Vec<RowView<'a, CellView>>,
}

#[derive(Debug, Serialize)]
struct ColumnView<'a> {
    #[serde(flatten)]
    column: &'a Column,
    has_numbers: bool,
}

#[derive(Debug, Serialize)]
struct CellView {
    text: String,
    is_number: bool,
}

#[derive(Debug, Serialize)]
struct RowView<'a, C> {
    player: Option<Player<'a>>,
    name: &'a str,
    cells: Vec<C>,
}

/// # Errors
/// [`ReportError::Draw`] and [`ReportError::Json`].
pub(super) fn figure<'a>(figure: &'a ExperimentFigure, cast: Cast<'a>) -> Result<FigureView<'a>, ReportError> {
    let ExperimentFigure { id, title, caption, drawing } = figure;
    let mut view =
        FigureView { id, title, caption, key: Vec::new(), has_goal: false, band: "", drawn: Drawn::default() };
    match drawing {
        Drawing::Responses(responses) => {
            let curves = responses.panels.iter().flat_map(|panel| &panel.curves);
            view.key = cast.players(curves.map(|curve| &curve.controller));
            view.has_goal = responses.panels.iter().any(|panel| !panel.goal.is_empty());
            view.band = &responses.band;
            view.drawn = responses::draw(responses, cast)?;
        }
        Drawing::Spread(Spread { panels }) => {
            view.drawn.halves = panels.iter().map(|panel| spread::draw(panel, cast)).collect::<Result<_, _>>()?;
        }
        Drawing::Lines(lines) => view.drawn = lines::draw(title, lines, cast)?,
        Drawing::Grid(grid) => view.drawn.grid = Some(grid_view(grid, cast)),
    }
    Ok(view)
}

fn grid_view<'a>(grid: &'a OutcomeGrid, cast: Cast<'a>) -> GridView<'a> {
    let rows = grid.rows.iter().map(|row| {
        let cells = row.cells.iter().map(|cell| {
            // Each symbol has a shape of its own, so that the table reads without colour.
            let (class, symbol, outcome) = match cell.outcome {
                Outcome::Worked => ("worked", "✓", "worked"),
                Outcome::WorkedWithJitter => ("jitter", "≈", "worked, with jitter"),
                Outcome::Missed => ("missed", "✗", "missed the goal"),
                Outcome::SafetyStop => ("stopped", "■", "safety stop"),
                Outcome::NotRun => ("muted", "–", "not run"),
            };
            GridCellView { class, symbol, outcome, detail: &cell.detail }
        });
        RowView { player: player(row.controller.as_ref(), cast), name: &row.name, cells: cells.collect() }
    });
    GridView { row_name: &grid.row_name, columns: &grid.columns, rows: rows.collect() }
}

pub(super) fn table<'a>(table: &'a FigureTable, cast: Cast<'a>) -> TableView<'a> {
    let rows = table.rows.iter().map(|row| {
        let cells = row.cells.iter().map(|cell| match cell {
            Cell::Number(value) => CellView { text: format::optional(*value), is_number: true },
            Cell::Text(text) => CellView { text: text.clone(), is_number: false },
        });
        RowView { player: player(row.controller.as_ref(), cast), name: &row.name, cells: cells.collect() }
    });
    let columns = table.columns.iter().enumerate().map(|(at, column)| {
        let cells = table.rows.iter().filter_map(|row| row.cells.get(at));
        ColumnView { column, has_numbers: cells.into_iter().any(|cell| matches!(cell, Cell::Number(_))) }
    });
    TableView { caption: &table.caption, row_name: &table.row_name, columns: columns.collect(), rows: rows.collect() }
}

fn player<'a>(id: Option<&String>, cast: Cast<'a>) -> Option<Player<'a>> {
    id.and_then(|id| cast.player(id))
}
