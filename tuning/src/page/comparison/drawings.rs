//! Experiments and traces of the record as figures.

use certune::report::{
    Cell, Column, Drawing, ExperimentFigure, FigureTable, Limit, LineSeries, Quantity, ResponseCurve, ResponsePanel,
    Responses, Spread, SpreadPanel, SpreadRow, TableRow,
};
use certune_paper::Comparison;
use certune_paper::record::{Arms, Experiment, Trace};

use super::SHOWN;

/// A figure of merit: key in the record, name, unit, factor from the record's unit, equal ratios.
pub type Merit = (&'static str, &'static str, &'static str, f64, bool);

pub fn shown(name: &str) -> bool {
    SHOWN.iter().any(|(id, ..)| *id == name)
}

pub fn quantity(name: &str, unit: &str, log: bool) -> Quantity {
    Quantity { name: name.to_owned(), unit: unit.to_owned(), log }
}

pub fn figure(id: &str, title: &str, caption: &str, drawing: Drawing) -> ExperimentFigure {
    ExperimentFigure { id: id.to_owned(), title: title.to_owned(), caption: caption.to_owned(), drawing }
}

/// Every arm a dot, one panel a figure of merit.
pub fn spread(experiment: &Experiment, merits: &[Merit]) -> Drawing {
    let row = |arms: &Arms, key: &str, factor: f64| {
        let values = arms.figures.get(key)?.values.iter().map(|value| value.map_or(f64::NAN, |value| factor * value));
        Some(SpreadRow { controller: arms.contender.clone(), category: String::new(), values: values.collect() })
    };
    let panel = |&(key, name, unit, factor, log): &Merit| SpreadPanel {
        quantity: quantity(name, unit, log),
        rows: experiment
            .results
            .iter()
            .filter(|arms| shown(&arms.contender))
            .filter_map(|arms| row(arms, key, factor))
            .collect(),
    };
    Drawing::Spread(Spread { panels: merits.iter().map(panel).collect() })
}

/// Medians of all controllers, those without a colour included.
pub fn medians(found: &Comparison, experiment: &Experiment, caption: &str, merits: &[Merit]) -> FigureTable {
    let row = |arms: &Arms| {
        let contender = found.contenders.iter().find(|contender| contender.name == arms.contender);
        let mut cells: Vec<Cell> = merits
            .iter()
            .map(|&(key, _, _, factor, _)| Cell::Number(arms.median(key).map(|value| factor * value)))
            .collect();
        cells.push(Cell::Number(Some(arms.diverged as f64)));
        let is_shown = shown(&arms.contender);
        let name = if is_shown { String::new() } else { contender.map_or_else(String::new, |one| one.title.clone()) };
        TableRow { controller: is_shown.then(|| arms.contender.clone()), name, cells }
    };
    let column = |name: &str, unit: &str| Column { name: name.to_owned(), unit: unit.to_owned() };
    let mut columns: Vec<Column> = merits.iter().map(|&(_, name, unit, ..)| column(name, unit)).collect();
    columns.push(column("arms that ran away", ""));
    FigureTable {
        caption: caption.to_owned(),
        row_name: "controller, medians over the arms".to_owned(),
        columns,
        rows: experiment.results.iter().map(row).collect(),
    }
}

/// What of a trace is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    Angles,
    Torques,
}

/// The traces of an experiment, one panel a joint; none when there are none.
pub fn responses(
    found: &Comparison,
    experiment: &str,
    of: &[&str],
    shown: Shown,
    limits_n_m: &[f64],
) -> Option<Drawing> {
    let chosen = |trace: &&Trace| trace.experiment == experiment && of.contains(&trace.contender.as_str());
    let traces: Vec<&Trace> = found.traces.iter().filter(chosen).collect();
    let first = traces.first()?;
    let rows = traces.iter().map(|trace| trace.q_rad.len()).max()?;
    let values = |trace: &Trace, joint: usize| {
        let all = if shown == Shown::Angles { &trace.q_rad } else { &trace.tau_n_m };
        let column = all.iter().filter_map(|row| row.get(joint).copied());
        // A run that ended earlier leaves a gap.
        column.chain(std::iter::repeat(f64::NAN)).take(rows).collect::<Vec<f64>>()
    };
    let goal = |joint: usize| {
        let at = |row: usize| {
            first.goals.iter().rev().find(|(from, _)| *from <= row).and_then(|(_, goal)| goal.get(joint).copied())
        };
        (0..rows).map(|row| at(row).unwrap_or(f64::NAN)).collect()
    };
    let curve = |trace: &&Trace, joint: usize| ResponseCurve {
        controller: trace.contender.clone(),
        value: values(trace, joint),
        lower: Vec::new(),
        upper: Vec::new(),
    };
    let limit = |joint: usize| {
        let limit = limits_n_m.get(joint).copied().unwrap_or(f64::NAN);
        [-limit, limit].map(|value| Limit { name: "torque limit".to_owned(), value }).to_vec()
    };
    let panel = |joint: usize| ResponsePanel {
        name: format!("joint {}", joint + 1),
        goal: if shown == Shown::Angles { goal(joint) } else { Vec::new() },
        limits: if shown == Shown::Torques { limit(joint) } else { Vec::new() },
        curves: traces.iter().map(|trace| curve(trace, joint)).collect(),
    };
    let (name, unit) = if shown == Shown::Angles { ("angle", "rad") } else { ("torque", "N m") };
    Some(Drawing::Responses(Responses {
        time_s: (0..rows).map(|row| row as f64 * first.row_s).collect(),
        quantity: name.to_owned(),
        unit: unit.to_owned(),
        band: String::new(),
        moments: Vec::new(),
        panels: (0..first.q_rad.first().map_or(0, Vec::len)).map(panel).collect(),
    }))
}

/// A curve from points.
pub fn series(controller: &str, name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> LineSeries {
    let (x, y) = points.into_iter().unzip();
    LineSeries { controller: controller.to_owned(), name: name.to_owned(), x, y, lower: Vec::new(), upper: Vec::new() }
}
