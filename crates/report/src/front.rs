//! The page of a front: what two or three goals cost each other.

use serde::{Deserialize, Serialize};

use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, span};
use crate::page::html;
use crate::record::CommandLine;

const TEMPLATE: &str = include_str!("templates/front.html");

/// Nominal size of a figure.
const SIZE: (f64, f64) = (400.0, 330.0);

/// A goal of the front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrontGoal {
    /// What it is called.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Whether higher is better.
    pub is_at_least: bool,
    /// How its figures were found, in a word: simulated, proved or linearised.
    pub source: String,
}

/// A point that was certified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrontPoint {
    /// Its number, by which it is picked.
    pub number: usize,
    /// Its figures, in the order of the goals.
    pub figures: Vec<f64>,
    /// Its gains, with their names.
    pub gains: Vec<(String, String)>,
}

/// The data of the page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrontReport {
    /// Above the headline.
    pub about: String,
    /// What was done, in sentences.
    pub method: Vec<String>,
    /// Two or three goals.
    pub goals: Vec<FrontGoal>,
    /// The front, from the best in the first goal on.
    pub points: Vec<FrontPoint>,
    /// Figures of measured gains that are not on it.
    pub others: Vec<Vec<f64>>,
    /// Figures of the gains that the search started from, if they have any.
    pub published: Option<Vec<f64>>,
    /// What to do with it.
    pub commands: Vec<CommandLine>,
}

#[derive(Serialize)]
struct Page<'a> {
    headline: String,
    figures: Vec<String>,
    record: &'a FrontReport,
}

/// The page of a front: a complete HTML document.
///
/// # Errors
/// - [`ReportError::Length`]: a point has not a figure for each goal;
/// - [`ReportError::Draw`], [`ReportError::Template`]: the libraries beneath failed.
pub fn front_report(record: &FrontReport) -> Result<String, ReportError> {
    let expected = record.goals.len();
    let lengths = record.points.iter().map(|point| &point.figures).chain(&record.others).chain(&record.published);
    if let Some(found) = lengths.map(Vec::len).find(|found| *found != expected) {
        return Err(ReportError::Length { series: "figures of a point of the front", expected, found });
    }
    let pairs = (0..expected).flat_map(|first| (first + 1..expected).map(move |second| (first, second)));
    let names: Vec<&str> = record.goals.iter().map(|goal| goal.name.as_str()).collect();
    let page = Page {
        headline: format!("{} certified compromises between {}", record.points.len(), listed(&names)),
        figures: pairs.map(|pair| plot(record, pair).svg()).collect::<Result<_, _>>()?,
        record,
    };
    html(TEMPLATE, &page)
}

/// `a, b and c`.
fn listed(names: &[&str]) -> String {
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// Two goals against each other.
fn plot(record: &FrontReport, (first, second): (usize, usize)) -> Plot {
    let at = |figures: &Vec<f64>| (figures[first], figures[second]);
    let front: Vec<(f64, f64)> = record.points.iter().map(|point| at(&point.figures)).collect();
    let published: Vec<(f64, f64)> = record.published.iter().map(at).collect();
    let axis = |goal: usize, value: fn(&(f64, f64)) -> f64| {
        let FrontGoal { name, unit, is_at_least, .. } = &record.goals[goal];
        let shown = front.iter().chain(&published).map(value);
        let (low, high) = span(shown).unwrap_or((0.0, 1.0));
        let side = if *is_at_least { "higher is better" } else { "lower is better" };
        let unit = if unit == "1" { String::new() } else { format!(", {unit}") };
        // Far candidates must not squeeze the front.
        let room = 0.12 * (high - low).max(1e-9);
        Axis::padded(format!("{name}{unit} ({side})"), (low - room, high + room), 5)
    };
    let (x, y) = (axis(first, |point| point.0), axis(second, |point| point.1));
    let inside = |(a, b): &(f64, f64)| {
        let within = |value: f64, (low, high): (f64, f64)| value >= low && value <= high;
        within(*a, x.range()) && within(*b, y.range())
    };
    let others: Vec<(f64, f64)> = record.others.iter().map(at).filter(inside).collect();
    let mut marks = vec![
        Mark::Dots { ink: Ink::Candidate, radius: 1.6, opacity: 0.45, points: others },
        Mark::Dots { ink: Ink::Published, radius: 4.5, opacity: 1.0, points: published },
        Mark::Dots { ink: Ink::Tuned, radius: 4.0, opacity: 1.0, points: front.clone() },
    ];
    for (point, at) in record.points.iter().zip(&front) {
        let text = point.number.to_string();
        marks.push(Mark::Label { ink: Ink::Text, text, at: *at, shift: (6.0, -7.0), anchor: Anchor::Start });
    }
    let [a, b] = [first, second].map(|goal| record.goals[goal].name.clone());
    Plot {
        title: format!("{b} against {a}"),
        description: format!("{} numbered points of the front, and the published gains.", front.len()),
        size: SIZE,
        x,
        y,
        right: 14.0,
        marks,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> FrontReport {
        let goal = |name: &str, unit: &str, is_at_least| FrontGoal {
            name: name.to_owned(),
            unit: unit.to_owned(),
            is_at_least,
            source: "simulated".to_owned(),
        };
        FrontReport {
            about: "panda <aic>".to_owned(),
            method: vec!["Swept.".to_owned()],
            goals: vec![
                goal("settling time", "s", false),
                goal("jitter", "N m/s", false),
                goal("certified radius", "rad", true),
            ],
            points: (1..=12)
                .map(|number| FrontPoint {
                    number,
                    figures: vec![3.0 + 0.1 * number as f64, 20.0 / number as f64, 0.1 + 0.02 * number as f64],
                    gains: vec![("kappa_a".to_owned(), "700".to_owned())],
                })
                .collect(),
            others: vec![vec![9.0, 90.0, 0.01]],
            published: Some(vec![4.1, 18.0, 0.2]),
            commands: vec![CommandLine { command: "autotune pick".to_owned(), shows: "Writes them.".to_owned() }],
        }
    }

    #[test]
    fn the_page_has_every_point_and_a_figure_for_each_pair() {
        let page = front_report(&record()).unwrap();
        assert!(page.starts_with("<!doctype html>") && page.contains("12 certified compromises"));
        assert_eq!(page.matches("<svg").count(), 3);
        assert_eq!(page.matches("<tr id=\"point-").count(), 12);
        assert!(page.contains("panda &lt;aic&gt;") && !page.contains("panda <aic>"));
        assert!(!page.contains("<script") && !page.contains("http-equiv"));
    }

    #[test]
    fn a_point_without_a_figure_for_each_goal_is_refused() {
        let mut short = record();
        short.points[3].figures.pop();
        assert!(matches!(front_report(&short), Err(ReportError::Length { expected: 3, found: 2, .. })));
    }
}
