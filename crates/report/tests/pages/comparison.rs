//! The page of a comparison: complete, linked, escaped, and refused where a record does not hold together.

use std::collections::BTreeSet;

use certune_report::*;
use proptest::prelude::*;

use crate::markup::{balanced, colours_have_rules, keep_for_a_look, words};
use crate::synthetic::comparison::comparison;

fn page(record: &ComparisonReport) -> String {
    let html = comparison_report(record).unwrap();
    assert_eq!(balanced(&html).map(|count| count > 20), Ok(true));
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
    html
}

/// What stands between double quotes after `open`, each time.
fn quoted<'a>(html: &'a str, open: &str) -> Vec<&'a str> {
    html.split(open).skip(1).map(|rest| rest.split_once('"').unwrap().0).collect()
}

#[test]
fn the_page_is_complete_and_loads_nothing() {
    let record = comparison();
    let html = page(&record);
    keep_for_a_look(&html, "comparison");
    assert!(html.starts_with("<!doctype html>") && html.matches("<h1>").count() == 1);
    for outside in ["http", "src=", "<link", "<img", "url(", "@import", "fetch", "import("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(colours_have_rules(&html) > 20);
    let text = words(&html);
    for statement in &record.statements {
        assert!(html.contains(&format!("<tr id=\"statement-{}\">", statement.number)));
    }
    for experiment in &record.experiments {
        assert!(text.contains(&experiment.title) && text.contains(&experiment.question));
        assert!(experiment.figures.iter().all(|figure| text.contains(&figure.title)));
    }
    assert!(html.len() < 1_500_000, "{} bytes", html.len());
}

#[test]
fn the_first_screen_says_what_was_decided_and_what_it_is_worth() {
    let record = comparison();
    let html = page(&record);
    let first = html.split_once("id=\"controllers\"").unwrap().0;
    for expected in record.answer.iter().chain(&record.assumptions).chain([&record.headline]) {
        assert!(first.contains(expected.as_str()), "{expected}");
    }
    assert!(first.contains("Measured in simulation, not proved."));
    let tally = words(first.split_once("class=\"tiles tally\"").unwrap().1.split_once("</dl>").unwrap().0);
    let tally: Vec<&str> = tally.split_whitespace().collect();
    assert_eq!(
        tally.join(" "),
        "✓ agree 7 of 14 statements ◐ agree on a condition 4 of 14 statements ✗ do not agree 3 of 14 statements"
    );
}

#[test]
fn names_in_the_page_are_there_once_and_every_link_leads_somewhere() {
    let html = page(&comparison());
    let ids = quoted(&html, " id=\"");
    let unique: BTreeSet<_> = ids.iter().collect();
    assert_eq!(ids.len(), unique.len());
    let links: BTreeSet<_> = quoted(&html, "href=\"#").into_iter().collect();
    assert!(links.contains("figure-transfer") && links.contains("experiment-steps"));
    for link in links {
        assert!(unique.contains(&link), "#{link} leads nowhere");
    }
    let labels: BTreeSet<_> = quoted(&html, "aria-labelledby=\"").into_iter().collect();
    assert!(labels.iter().all(|label| unique.contains(label)));
}

#[test]
fn every_figure_has_a_title_and_says_what_is_to_be_seen() {
    let html = page(&comparison());
    // Two figures of seven panels; three of spread; two wide ones, twice each; three arms. Samples of a legend are not figures.
    let figures = 2 * 7 + 3 + 2 * 2 + 3;
    assert_eq!(html.matches("role=\"img\" aria-label=\"").count(), figures);
    assert_eq!(html.matches("<svg ").count(), figures + html.matches("aria-hidden=\"true\"><polyline").count());
    let titled = |piece: &&str| piece.contains("<title>") && !piece.contains("<title></title>");
    let described = |piece: &&str| {
        piece.split_once("<desc>").is_some_and(|(_, text)| !text.starts_with("</desc>") && !text.starts_with(".<"))
    };
    let drawings: Vec<&str> = html.split("role=\"img\"").skip(1).collect();
    assert!(drawings.iter().all(|piece| titled(piece) && described(piece)));
    assert!(html.contains("AIC tuned: median 3.01\u{a0}s"), "a description holds figures");
}

#[test]
fn verdicts_and_outcomes_read_without_colour() {
    let text = words(&page(&comparison()));
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for expected in [
        "✓ agrees",
        "◐ agrees only if the integral terms are those of the released code",
        "✗ does not agree",
        "■ safety stop joint 2 overspeeds at 0.25 s",
        "≈ worked, with jitter",
        "✗ missed the goal 667 mrad",
        "– not run",
        "12 of 200 not finished",
    ] {
        assert!(text.contains(expected), "{expected}");
    }
}

/// Every text of a JSON value, replaced; keys and names that link are left alone.
fn poisoned(value: &mut serde_json::Value, evil: &str) {
    match value {
        serde_json::Value::String(text) => evil.clone_into(text),
        serde_json::Value::Array(items) => items.iter_mut().for_each(|item| poisoned(item, evil)),
        serde_json::Value::Object(fields) => {
            let linking = ["id", "ink", "controller", "figure", "agreement", "outcome", "condition"];
            for (key, field) in fields {
                if !linking.contains(&key.as_str()) {
                    poisoned(field, evil);
                }
            }
        }
        serde_json::Value::Null | serde_json::Value::Bool(_) | serde_json::Value::Number(_) => {}
    }
}

#[test]
fn every_text_of_the_record_is_text_and_never_markup() {
    let evil = "</script></style><!--<b onclick='x'>\"&";
    let mut json = serde_json::to_value(comparison()).unwrap();
    poisoned(&mut json, evil);
    let mut record: ComparisonReport = serde_json::from_value(json).unwrap();
    for statement in &mut record.statements {
        if !statement.condition.is_empty() {
            evil.clone_into(&mut statement.condition);
        }
    }
    let html = page(&record);
    assert!(!html.contains("<b onclick") && !html.contains("<!--"));
    assert!(html.contains("&lt;b onclick") && html.contains("\\u003cb onclick"));
    let clean = page(&comparison());
    for tag in ["</script>", "</style>"] {
        assert_eq!(html.matches(tag).count(), clean.matches(tag).count(), "{tag}");
    }
}

#[test]
fn a_record_travels_through_json_and_refuses_unknown_keys() {
    let mut record = comparison();
    let gap = |record: &mut ComparisonReport| match &mut record.experiments[0].figures[2].drawing {
        Drawing::Spread(spread) => spread.panels[0].rows[4].values.drain(..12).count(),
        Drawing::Responses(_) | Drawing::Lines(_) | Drawing::Grid(_) => 0,
    };
    assert_eq!(gap(&mut record), 12, "runs without a value are NaN, which equals nothing");
    let text = serde_json::to_string(&record).unwrap();
    assert_eq!(serde_json::from_str::<ComparisonReport>(&text).unwrap(), record);
    assert!(serde_json::from_str::<ComparisonReport>(&text.replacen("\"headline\"", "\"head\"", 1)).is_err());
    let text = serde_json::to_string(&comparison()).unwrap();
    assert!(text.contains("null") && page(&serde_json::from_str(&text).unwrap()) == page(&comparison()));
}

fn refusal(change: impl FnOnce(&mut ComparisonReport)) -> String {
    let mut record = comparison();
    change(&mut record);
    comparison_report(&record).unwrap_err().to_string()
}

fn responses(record: &mut ComparisonReport) -> &mut Responses {
    match &mut record.experiments[0].figures[0].drawing {
        Drawing::Responses(responses) => responses,
        other => unreachable!("{other:?}"),
    }
}

#[test]
fn a_record_that_does_not_hold_together_is_refused() {
    let cases = [
        (refusal(|r| r.controllers[1].id = "aic-published".to_owned()), "`aic-published` is no name for a controller"),
        (refusal(|r| r.experiments[1].figures[0].id = "Payload error".to_owned()), "no name for a figure"),
        (refusal(|r| r.controllers[1].ink = ControllerInk::MracCode), "a colour that no other controller has"),
        (
            refusal(|r| r.statements[0].figure = Some("lost".to_owned())),
            "statement 1 names `lost`, which is not a figure",
        ),
        (refusal(|r| r.statements[3].number = 1), "a number that no other statement has"),
        (refusal(|r| r.statements[1].condition.clear()), "statement 2: expected a condition"),
        (refusal(|r| r.statements[0].condition = "it rains".to_owned()), "statement 1: expected a condition"),
        (
            refusal(|r| responses(r).panels[2].curves[0].controller = "pid".to_owned()),
            "names `pid`, which is not a controller",
        ),
        (refusal(|r| responses(r).panels[2].curves[1].value.truncate(7)), "value: expected 1500 entries, found 7"),
        (refusal(|r| responses(r).panels[0].goal.truncate(7)), "goal: expected 1500 entries, found 7"),
        (refusal(|r| responses(r).panels[0].curves[0].upper.clear()), "upper: expected 1500 entries, found 0"),
        (refusal(|r| responses(r).time_s[4] = f64::NAN), "finite times that rise"),
        (refusal(|r| responses(r).time_s.swap(0, 1)), "finite times that rise"),
        (
            refusal(|r| r.experiments[0].tables[0].rows[0].cells.truncate(4)),
            "cells of a table: expected 5 entries, found 4",
        ),
        (refusal(|r| r.replay.as_mut().unwrap().step_s = 0.0), "a positive time between frames"),
        (refusal(|r| r.replay.as_mut().unwrap().runs[1].frames_m[3][2][0] = f64::NAN), "finite positions in m"),
        (
            refusal(|r| r.replay.as_mut().unwrap().runs[1].frames_m[3].truncate(4)),
            "points of a frame: expected 5 entries, found 4",
        ),
        (refusal(|r| r.replay.as_mut().unwrap().runs.clear()), "at least one run"),
        (refusal(|r| r.headline = "Proved: the arm is stable".to_owned()), "the headline says `proved`"),
        (refusal(|r| r.findings[0].text = "This was proven.".to_owned()), "a finding says `proved`"),
    ];
    for (error, expected) in cases {
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn an_empty_record_makes_a_page() {
    let html = page(&ComparisonReport { headline: "Nothing was compared".to_owned(), ..ComparisonReport::default() });
    assert!(html.contains("No command was recorded") && !html.contains("id=\"replay\""));
}

#[test]
fn runs_that_stop_or_diverge_leave_gaps_not_nonsense() {
    let mut record = comparison();
    for panel in &mut responses(&mut record).panels {
        let value = &mut panel.curves[2].value;
        for k in 400..1500 {
            value[k] = if k < 500 { 10_f64.powi(k as i32 - 400) } else { f64::NAN };
        }
        panel.curves[3].value.fill(f64::NAN);
    }
    let text = words(&page(&record));
    assert!(!text.split_whitespace().any(|word| matches!(word, "NaN" | "inf" | "-inf")));
    assert!(!page(&record).contains("2147483647"));
}

/// Numbers of every size, and none.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -10.0..10.0, 2 => any::<f64>(), 1 => Just(0.0), 1 => Just(f64::NAN), 1 => Just(f64::MAX), 1 => Just(f64::MIN)]
}

fn series(length: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(number(), length)
}

prop_compose! {
    /// A record of one experiment with a figure of each kind, its numbers at random.
    fn random()(length in 0_usize..40)(
        length in Just(length),
        value in series(length), lower in series(length), upper in series(length), goal in series(length), limit in number(),
        moment in number(), log in any::<bool>(), labelled in any::<bool>(),
    ) -> ComparisonReport {
        let mut record = comparison();
        let base = record.experiments[0].clone();
        let controller = "aic-tuned".to_owned();
        let x: Vec<f64> = (0..length).map(|k| k as f64).collect();
        let limits = vec![Limit { name: "limit".to_owned(), value: limit }];
        let quantity = Quantity { name: "cost".to_owned(), unit: "s".to_owned(), log };
        let panel = ResponsePanel {
            name: "joint".to_owned(),
            goal,
            limits: limits.clone(),
            curves: vec![ResponseCurve { controller: controller.clone(), value: value.clone(), lower: lower.clone(), upper: upper.clone() }],
        };
        let drawings = [
            Drawing::Responses(Responses {
                time_s: x.clone(),
                moments: vec![Moment { name: "now".to_owned(), time_s: moment }],
                panels: vec![panel; if labelled { 1 } else { 2 }],
                ..Responses::default()
            }),
            Drawing::Spread(Spread {
                panels: vec![SpreadPanel {
                    quantity: quantity.clone(),
                    rows: vec![SpreadRow { controller: controller.clone(), category: "all".to_owned(), values: value.clone() }],
                }],
            }),
            Drawing::Lines(Lines {
                x: Quantity { log, ..Quantity::default() },
                y: quantity,
                limits,
                series: vec![LineSeries { controller, name: String::new(), x, y: value, lower, upper }],
            }),
        ];
        let figure = |(index, drawing)| ExperimentFigure { id: format!("f{index}"), title: "Figure".to_owned(), caption: String::new(), drawing };
        let figures = drawings.into_iter().enumerate().map(figure).collect();
        record.experiments = vec![Experiment { figures, tables: Vec::new(), ..base }];
        record.statements.clear();
        record.replay = None;
        record
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn no_series_of_numbers_breaks_the_page(record in random()) {
        let html = comparison_report(&record).unwrap();
        prop_assert!(balanced(&html).is_ok());
        prop_assert!(!words(&html).contains("NaN"));
        for coordinate in ["2147483647", "-2147483648"] {
            prop_assert!(!html.contains(coordinate));
        }
    }
}
