//! What a record must satisfy before it is shown.

use std::collections::HashSet;

use crate::check::length;
use crate::error::ReportError;
use crate::record::{
    Agreement, ComparisonReport, Drawing, Experiment, FigureTable, Lines, OutcomeGrid, Replay, Responses, Spread,
};

type Checked = Result<(), ReportError>;

/// Words that take a proof back when they stand shortly before it.
const DENIALS: [&str; 8] = ["not", "no", "nothing", "never", "neither", "nor", "without", "cannot"];
const SHORTLY: usize = 4;

/// # Errors
/// [`ReportError::Id`], [`ReportError::Unknown`], [`ReportError::Length`], [`ReportError::Value`] and
/// [`ReportError::ClaimsProof`].
pub(super) fn check(record: &ComparisonReport) -> Checked {
    let mut inks = HashSet::new();
    names(record.controllers.iter().map(|controller| &controller.id), "a controller")?;
    for controller in &record.controllers {
        let place = || format!("the colour of the controller `{}`", controller.id);
        holds(inks.insert(controller.ink as u8), place, "a colour that no other controller has")?;
    }
    let figures = record.experiments.iter().flat_map(|experiment| &experiment.figures);
    names(record.experiments.iter().map(|experiment| &experiment.id), "an experiment")?;
    names(figures.clone().map(|figure| &figure.id), "a figure")?;

    let known: HashSet<&str> = record.controllers.iter().map(|controller| controller.id.as_str()).collect();
    for experiment in &record.experiments {
        experiment_holds(experiment, &known)?;
    }
    if let Some(replay) = &record.replay {
        replay_holds(replay, &known)?;
    }

    let known: HashSet<&str> = figures.map(|figure| figure.id.as_str()).collect();
    let mut numbers = HashSet::new();
    for statement in &record.statements {
        let place = || format!("statement {}", statement.number);
        holds(numbers.insert(statement.number), place, "a number that no other statement has")?;
        let conditional = statement.agreement == Agreement::AgreesOnlyIf;
        let expected = "a condition exactly when it agrees only if one holds";
        holds(conditional != statement.condition.is_empty(), place, expected)?;
        if let Some(figure) = &statement.figure {
            is_known(figure, &known, place, "a figure")?;
        }
    }
    no_proof(record)
}

fn experiment_holds(experiment: &Experiment, known: &HashSet<&str>) -> Checked {
    for figure in &experiment.figures {
        let place = || format!("the figure `{}`", figure.id);
        let controllers: Vec<&String> = match &figure.drawing {
            Drawing::Responses(responses) => {
                responses_hold(responses, place)?;
                responses.panels.iter().flat_map(|panel| &panel.curves).map(|curve| &curve.controller).collect()
            }
            Drawing::Spread(Spread { panels }) => {
                panels.iter().flat_map(|panel| &panel.rows).map(|row| &row.controller).collect()
            }
            Drawing::Lines(lines) => {
                lines_hold(lines, place)?;
                lines.series.iter().map(|series| &series.controller).collect()
            }
            Drawing::Grid(OutcomeGrid { columns, rows, .. }) => {
                rows.iter().try_for_each(|row| length("cells of a grid", columns.len(), row.cells.len()))?;
                rows.iter().filter_map(|row| row.controller.as_ref()).collect()
            }
        };
        controllers.into_iter().try_for_each(|id| is_known(id, known, place, "a controller"))?;
    }
    for FigureTable { caption, columns, rows, .. } in &experiment.tables {
        for row in rows {
            length("cells of a table", columns.len(), row.cells.len())?;
            let id = row.controller.iter();
            id.into_iter()
                .try_for_each(|id| is_known(id, known, || format!("the table `{caption}`"), "a controller"))?;
        }
    }
    Ok(())
}

fn responses_hold(responses: &Responses, place: impl Fn() -> String) -> Checked {
    let samples = responses.time_s.len();
    holds(rising(&responses.time_s), &place, "finite times that rise")?;
    for panel in &responses.panels {
        or_empty("goal", samples, &panel.goal)?;
        let mut seen = HashSet::new();
        for curve in &panel.curves {
            length("value", samples, curve.value.len())?;
            or_empty("lower", samples, &curve.lower)?;
            length("upper", curve.lower.len(), curve.upper.len())?;
            holds(seen.insert(&curve.controller), &place, "at most one curve a controller in a panel")?;
        }
    }
    Ok(())
}

fn lines_hold(lines: &Lines, place: impl Fn() -> String) -> Checked {
    for series in &lines.series {
        let points = series.x.len();
        length("y", points, series.y.len())?;
        or_empty("lower", points, &series.lower)?;
        length("upper", series.lower.len(), series.upper.len())?;
        holds(rising(&series.x), &place, "finite horizontal coordinates that rise")?;
    }
    Ok(())
}

fn replay_holds(replay: &Replay, known: &HashSet<&str>) -> Checked {
    let place = || "the replay".to_owned();
    holds(replay.step_s > 0.0 && replay.step_s.is_finite(), place, "a positive time between frames")?;
    holds(!replay.runs.is_empty(), place, "at least one run")?;
    let points = replay.runs.iter().flat_map(|run| &run.frames_m).map(Vec::len).next().unwrap_or(0);
    for run in &replay.runs {
        is_known(&run.controller, known, place, "a controller")?;
        holds(!run.frames_m.is_empty() && points > 1, place, "a frame of two or more points in each run")?;
        for frame in &run.frames_m {
            length("points of a frame", points, frame.len())?;
            let reach = frame.iter().flatten().all(|coordinate| coordinate.abs() < 1e6);
            holds(reach, place, "finite positions in m")?;
        }
    }
    Ok(())
}

/// No string of the record claims a proof.
fn no_proof(record: &ComparisonReport) -> Checked {
    let refuse = |place: &str, text: &String| {
        let error = || ReportError::ClaimsProof { place: place.to_owned(), text: text.clone() };
        if claims_proof(text) { Err(error()) } else { Ok(()) }
    };
    refuse("the headline", &record.headline)?;
    record.answer.iter().try_for_each(|text| refuse("the answer", text))?;
    for statement in &record.statements {
        let place = format!("statement {}", statement.number);
        refuse(&place, &statement.measured)?;
        refuse(&place, &statement.condition)?;
    }
    for finding in &record.findings {
        refuse("a finding", &finding.title)?;
        refuse("a finding", &finding.text)?;
    }
    for experiment in &record.experiments {
        let place = format!("the experiment `{}`", experiment.id);
        refuse(&place, &experiment.title)?;
        refuse(&place, &experiment.answer)?;
        for figure in &experiment.figures {
            refuse(&place, &figure.title)?;
            refuse(&place, &figure.caption)?;
        }
    }
    Ok(())
}

/// Whether a text speaks of a proof without denying it.
fn claims_proof(text: &str) -> bool {
    let text = text.to_lowercase();
    let words: Vec<&str> =
        text.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    words.iter().enumerate().any(|(index, word)| {
        let before = &words[index.saturating_sub(SHORTLY)..index];
        matches!(*word, "proved" | "proven" | "proves") && !before.iter().any(|word| DENIALS.contains(word))
    })
}

/// Each name can stand in a link, and is there once.
fn names<'a>(ids: impl Iterator<Item = &'a String>, kind: &'static str) -> Checked {
    let mut seen = HashSet::new();
    for id in ids {
        let plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
        if id.is_empty() || !id.chars().all(plain) || !seen.insert(id) {
            return Err(ReportError::Id { id: id.clone(), kind });
        }
    }
    Ok(())
}

fn is_known(id: &str, known: &HashSet<&str>, place: impl Fn() -> String, kind: &'static str) -> Checked {
    let error = || ReportError::Unknown { place: place(), id: id.to_owned(), kind };
    if known.contains(id) { Ok(()) } else { Err(error()) }
}

fn holds(condition: bool, place: impl Fn() -> String, expected: &'static str) -> Checked {
    if condition { Ok(()) } else { Err(ReportError::Value { place: place(), expected }) }
}

fn or_empty(series: &'static str, samples: usize, values: &[f64]) -> Checked {
    if values.is_empty() { Ok(()) } else { length(series, samples, values.len()) }
}

fn rising(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite()) && values.windows(2).all(|pair| pair[0] < pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proof_may_be_denied_and_an_arm_improved_but_nothing_is_claimed() {
        for honest in ["Nothing here is proved.", "measured, not proved", "the tuned gains improved it", "no proof"] {
            assert!(!claims_proof(honest), "{honest}");
        }
        for bold in ["Proved stable.", "It is not slow; that it is stable was proven.", "which proves it"] {
            assert!(claims_proof(bold), "{bold}");
        }
    }
}
