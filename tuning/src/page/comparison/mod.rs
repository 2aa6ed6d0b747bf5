//! The record of a comparison into the data of its page.
//!
//! The page has seven colours, so seven of those compared are in its figures; the others are rows of tables.

mod drawings;
mod experiments;

use certune::report::{
    Agreement, CommandLine, ComparisonReport, Controller, ControllerInk, Finding, Replay, ReplayRun, Statement,
    Version, comparison_report,
};
use certune_paper::Comparison;
use certune_paper::names;
use certune_paper::record::Trace;
use certune_paper::statements::{Statement as Judged, Verdict};

use crate::error::Error;
use crate::versions::versions;

/// Those in figures: name in the record, short name, colour.
const SHOWN: [(&str, &str, ControllerInk); 7] = [
    (names::AIC, "AIC published", ControllerInk::AicPublished),
    (names::AIC_TUNED, "AIC tuned", ControllerInk::AicTuned),
    (names::AIC_ROBOT, "AIC robot gains", ControllerInk::AicOther),
    (names::MRAC, "MRAC released", ControllerInk::MracCode),
    (names::MRAC_MODEL, "MRAC equations", ControllerInk::MracPaper),
    (names::MRAC_MATCHED, "MRAC tuned", ControllerInk::MracTuned),
    (names::MRAC_ROBOT, "MRAC robot gains", ControllerInk::Baseline),
];

/// The page. `command` repeats the comparison.
pub fn comparison_page(found: &Comparison, command: &str) -> Result<String, Error> {
    Ok(comparison_report(&report(found, command))?)
}

fn report(found: &Comparison, command: &str) -> ComparisonReport {
    let question = &found.question;
    ComparisonReport {
        about: format!(
            "Pezzato, Ferrari, Hernandez Corbato, \"A Novel Adaptive Controller for Robot Manipulators Based on Active Inference\", RA-L 2020, run again on {}, seed {}",
            question.robot, question.seed
        ),
        headline: headline(found),
        answer: answer(found),
        assumptions: vec![
            format!("{} arms, the mass of every link within {} % of nominal; every controller meets the same arms.", question.arms, 100.0 * question.mass_uncertainty),
            "A step of 1 ms, semi-implicit Euler, rigid joints and links. The arm that compensates its gravity knows its own masses and not its load's.".to_owned(),
            "Everything is simulated, and nothing here is proved: our plants are not the laboratory's robot.".to_owned(),
        ],
        controllers: found.contenders.iter().filter_map(controller).collect(),
        statements: statements(found, command),
        findings: found.findings.iter().map(|one| Finding { title: one.title.clone(), text: one.text.clone() }).collect(),
        experiments: experiments::experiments(found, command),
        replay: replay(found),
        commands: vec![line(command, "all of this page, and compare.json")],
        method: method(),
        versions: versions().into_iter().map(|(name, version)| Version { name, version }).collect(),
    }
}

fn line(command: &str, shows: &str) -> CommandLine {
    CommandLine { command: command.to_owned(), shows: shows.to_owned() }
}

fn controller(contender: &certune_paper::record::Contender) -> Option<Controller> {
    let (id, name, ink) = SHOWN.into_iter().find(|(id, ..)| *id == contender.name)?;
    Some(Controller { id: id.to_owned(), name: name.to_owned(), in_words: contender.title.clone(), ink })
}

fn count(found: &Comparison, verdict: Verdict) -> usize {
    found.statements.iter().filter(|statement| statement.verdict == verdict).count()
}

fn headline(found: &Comparison) -> String {
    let [agree, only_if, differ] =
        [Verdict::Agrees, Verdict::AgreesOnlyIf, Verdict::DoesNotAgree].map(|verdict| count(found, verdict));
    let of = agree + only_if + differ;
    format!(
        "Of {of} statements of the paper our measurements agree with {agree}, with {only_if} on a condition, and with {differ} they do not"
    )
}

/// The statements that a reader looks for first.
const FIRST: [&str; 5] = ["adaptability", "aic-transfers", "mrac-stops", "same-tuning", "smooth-return"];

fn answer(found: &Comparison) -> Vec<String> {
    let judged = FIRST.iter().filter_map(|name| found.statements.iter().find(|statement| statement.name == *name));
    let said = |statement: &Judged| {
        let verdict = match statement.verdict {
            Verdict::Agrees => "agrees".to_owned(),
            Verdict::AgreesOnlyIf => format!("agrees only if {}", statement.condition),
            Verdict::DoesNotAgree => "does not agree".to_owned(),
            Verdict::NotTested => "not tested".to_owned(),
        };
        format!("{} What we measured {verdict}.", statement.statement)
    };
    judged.map(said).collect()
}

fn statements(found: &Comparison, command: &str) -> Vec<Statement> {
    let mut number = 0;
    let convert = |judged: &Judged| {
        let agreement = match judged.verdict {
            Verdict::Agrees => Agreement::Agrees,
            Verdict::AgreesOnlyIf => Agreement::AgreesOnlyIf,
            Verdict::DoesNotAgree => Agreement::DoesNotAgree,
            Verdict::NotTested => return None,
        };
        number += 1;
        Some(Statement {
            number,
            section: judged.section.clone(),
            statement: judged.statement.clone(),
            measured: format!("{}. Rule: {}.", judged.measured, judged.rule),
            agreement,
            condition: judged.condition.clone(),
            figure: experiments::is_drawn(found, &judged.figure).then(|| judged.figure.clone()),
            command: if judged.command == certune_paper::statements::COMPARE {
                command.to_owned()
            } else {
                judged.command.clone()
            },
        })
    };
    found.statements.iter().filter_map(convert).collect()
}

fn replay(found: &Comparison) -> Option<Replay> {
    let replayed = |trace: &&Trace| trace.experiment == "approximated" && !trace.points_m.is_empty();
    let traces: Vec<&Trace> = found.traces.iter().filter(replayed).collect();
    let step_s = traces.first()?.row_s;
    let run = |trace: &&Trace| ReplayRun {
        controller: trace.contender.clone(),
        end: String::new(),
        frames_m: trace.points_m.clone(),
    };
    Some(Replay {
        caption: "Pick and place on the approximated model, gravity not compensated, gains as published: the goals A, B, C, B, A, one each 6 s.".to_owned(),
        step_s,
        runs: traces.iter().map(run).collect(),
    })
}

fn method() -> Vec<String> {
    [
        "The arms are drawn from a named seed, one stream an arm. Every figure of merit is kept for every arm; a dot in a figure is an arm.",
        "Where a statement says that one controller does better than the other, both have met the same arms and an exact two-sided sign test decides; an arm on which a controller has no figure (it did not settle, it ran away) counts as lost. Each statement carries its rule, with thresholds chosen by us and not by the paper.",
        "Both controllers are tuned by the same search with the same plants, budget and objective and no limits, on the approximated model, where the paper tuned them too. The AIC's reference is a first-order lag of 1 s; the reference of the tuned MRAC in the figures is critically damped and settles at the same time.",
        "The safety monitor stops on joint range, speed, torque, and torque rate of the command that reaches the robot, before the motors' own limits.",
    ]
    .map(str::to_owned)
    .to_vec()
}
