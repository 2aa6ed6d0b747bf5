//! The experiments, one after the other.

use certune::report::{
    Cell, Column, Drawing, Experiment, FigureTable, GridCell, GridRow, Limit, Lines, Outcome, OutcomeGrid, TableRow,
};
use certune_paper::record::{Cell as GridPoint, CellResult, Effects, StepCost, StepTime, Trace};
use certune_paper::statements::DONE_RAD;
use certune_paper::{Comparison, names};

use super::drawings::{Merit, Shown, figure, medians, quantity, responses, series, shown, spread};
use super::line;

/// The Panda's torque limits, N m.
const LIMITS_N_M: [f64; 7] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
/// Above this a joint counts as jittering once it has settled, rad/s².
const JITTER_RAD_PER_S2: f64 = 1.0;
/// What a step may take, ns.
const BUDGET_NS: f64 = 3e5;

const MOTION: [Merit; 7] = [
    ("settling_time_s", "settling time", "s", 1.0, false),
    ("final_error_rad", "error after a move", "mrad", 1e3, true),
    ("overshoot", "overshoot", "%", 100.0, false),
    ("itae_rad_s2", "time-weighted error", "rad s²", 1.0, false),
    ("reversals", "joints turn back", "", 1.0, false),
    ("torque_rate_rms_n_m_per_s", "torque rate, rms", "N m/s", 1.0, true),
    ("peak_torque_n_m", "peak torque asked for", "N m", 1.0, false),
];
const SATURATION: [Merit; 3] = [
    ("saturated_samples", "saturated samples", "", 1.0, false),
    ("saturated_after_goal", "of these within 0.25 s of a goal", "", 1.0, false),
    ("peak_torque_n_m", "peak torque asked for", "N m", 1.0, false),
];
const PAYLOADS: [Merit; 5] = [
    ("lift_deviation_rad", "deviation on lifting", "mrad", 1e3, true),
    ("carry_deviation_rad", "deviation on carrying", "mrad", 1e3, true),
    ("release_deviation_rad", "deviation on releasing", "mrad", 1e3, true),
    ("final_error_rad", "largest error after a move, full bottle", "mrad", 1e3, true),
    ("ripple_rad_per_s2", "ripple of the motion, full bottle", "rad/s²", 1.0, true),
];
const PUSH: [Merit; 6] = [
    ("peak_deviation_rad", "largest deviation", "mrad", 1e3, true),
    ("peak_flange_m", "the flange gives way by", "mm", 1e3, true),
    ("recovery_s", "back to a tenth after", "s", 1.0, false),
    ("rebound", "rebound", "%", 100.0, false),
    ("swings", "changes of side", "", 1.0, false),
    ("final_error_rad", "error at the end", "mrad", 1e3, true),
];

pub fn experiments(found: &Comparison, command: &str) -> Vec<Experiment> {
    let mut all = vec![approximated(found), transfer(found), payloads(found), push(found), cost(found), effort(found)];
    for experiment in &mut all {
        experiment.commands.push(line(command, "all experiments"));
    }
    all
}

/// Whether a figure of that name is on the page.
pub fn is_drawn(found: &Comparison, id: &str) -> bool {
    experiments(found, "").iter().flat_map(|experiment| &experiment.figures).any(|figure| figure.id == id)
}

fn statement(found: &Comparison, name: &str) -> String {
    found
        .statements
        .iter()
        .find(|statement| statement.name == name)
        .map_or_else(String::new, |one| one.measured.clone())
}

fn begun(id: &str, title: &str, question: &str, answer: String, method: &[&str]) -> Experiment {
    Experiment {
        id: id.to_owned(),
        title: title.to_owned(),
        question: question.to_owned(),
        answer,
        method: method.iter().map(|text| (*text).to_owned()).collect(),
        ..Experiment::default()
    }
}

fn approximated(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "approximated-model",
        "Pick and place on an approximated model",
        "How well do both controllers cope with an arm that is not the one they were tuned for?",
        statement(found, "adaptability"),
        &[
            &found.approximated.conditions,
            "Goals A, B, C, B, A, one each 6 s, from rest in B. Curves are those of the nominal arm, each 50 ms, so that what is shorter does not show.",
        ],
    );
    let of = [names::AIC, names::AIC_TUNED, names::MRAC, names::MRAC_MODEL, names::MRAC_MATCHED];
    if let Some(drawing) = responses(found, "approximated", &of, Shown::Angles, &[]) {
        experiment.figures.push(figure("approximated-angles", "Joint angles", "", drawing));
    }
    let of = [names::AIC, names::MRAC, names::MRAC_MATCHED];
    if let Some(drawing) = responses(found, "approximated", &of, Shown::Torques, &LIMITS_N_M) {
        experiment.figures.push(figure("approximated-torques", "Torques", "", drawing));
    }
    let caption = "A dot an arm; lower is better.";
    experiment.figures.push(figure("approximated-spread", "Every arm", caption, spread(&found.approximated, &MOTION)));
    experiment.tables.push(medians(found, &found.approximated, "All controllers on the approximated model", &MOTION));
    experiment.tables.push(medians(
        found,
        &found.approximated,
        "Saturation with 87 N m on joints 1 to 4 and 12 N m on 5 to 7",
        &SATURATION,
    ));
    experiment.tables.push(medians(
        found,
        &found.paper_limit,
        "Saturation with the paper's 85 N m on every joint",
        &SATURATION,
    ));
    experiment.commands.push(line(
        "autotune simulate --robot panda-cuboid --gains pezzato2020-simulation --scenario pick-and-place-paper --csv aic.csv",
        "the nominal run of the AIC, row by row",
    ));
    experiment
}

fn transfer(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "transfer",
        "The gains of the simulation on the robot",
        "Which controller survives the step from the simulation to the arm, and what of the arm decides it?",
        format!("{}. {}", statement(found, "aic-transfers"), statement(found, "mrac-stops")),
        &[
            &found.transfer.conditions,
            "A cell tells what became of most arms: whether range, speed or torque would have stopped them, and how much joints jitter once they have settled.",
        ],
    );
    let caption = "Noise on; the limiter lets a command change by at most 1 N m a millisecond.";
    for (id, title, friction) in [
        ("transfer-grid", "With a friction of 1 N m s/rad", 1.0),
        ("transfer-grid-without-friction", "Without friction", 0.0),
    ] {
        let chosen =
            |cell: &&GridPoint| cell.effects.noise && (cell.effects.friction_n_m_s_per_rad - friction).abs() < 1e-9;
        let cells: Vec<&GridPoint> = found.transfer.cells.iter().filter(chosen).collect();
        experiment.figures.push(figure(id, title, caption, grid(found, &cells)));
    }
    let of = [names::AIC, names::AIC_ROBOT, names::MRAC, names::MRAC_ROBOT, names::MRAC_MATCHED];
    if let Some(drawing) = responses(found, "transfer", &of, Shown::Angles, &[]) {
        let caption = "Nominal arm with noise, delay and limiter; a run that ran away ends.";
        experiment.figures.push(figure("transfer-angles", "Joint angles on the robot", caption, drawing));
    }
    experiment.figures.push(figure(
        "transfer-jitter",
        "Jitter by joint",
        "With noise, friction, rotor inertia, one sample of delay and the limiter, once settled; median over the arms.",
        jitter(found),
    ));
    experiment.figures.push(figure(
        "transfer-spread",
        "Every arm, with noise, delay and limiter",
        "A dot an arm; lower is better.",
        spread(&found.transfer.robot, &MOTION),
    ));
    experiment.tables.push(medians(found, &found.transfer.ideal, "Without noise, delay and limiter", &MOTION));
    experiment.tables.push(medians(found, &found.transfer.robot, "With noise, delay and limiter", &MOTION));
    experiment
}

fn is_real(effects: &Effects) -> bool {
    let Effects { friction_n_m_s_per_rad, rotor_inertia_kg_m2, noise, delay_samples, torque_rate_limited } = *effects;
    friction_n_m_s_per_rad > 0.0 && rotor_inertia_kg_m2 > 0.0 && noise && delay_samples == 1 && torque_rate_limited
}

fn jitter(found: &Comparison) -> Drawing {
    let real = found.transfer.cells.iter().find(|cell| is_real(&cell.effects));
    let of = |result: &CellResult| {
        let rates = result.acceleration_rad_per_s2.iter().enumerate();
        series(&result.contender, "", rates.map(|(joint, rate)| ((joint + 1) as f64, rate.unwrap_or(f64::NAN))))
    };
    Drawing::Lines(Lines {
        x: quantity("joint", "", false),
        y: quantity("acceleration that turns round each sample, rms", "rad/s²", true),
        limits: Vec::new(),
        series: real.iter().flat_map(|cell| &cell.results).filter(|result| shown(&result.contender)).map(of).collect(),
    })
}

fn grid(found: &Comparison, cells: &[&GridPoint]) -> Drawing {
    let column = |effects: &Effects| {
        let rotor = if effects.rotor_inertia_kg_m2 > 0.0 { "rotor 0.1" } else { "bare" };
        let limiter = if effects.torque_rate_limited { ", limiter" } else { "" };
        format!("{rotor}, delay {}{limiter}", effects.delay_samples)
    };
    let arms = found.question.grid_arms;
    let cell = |result: &CellResult| {
        let worst = |values: &[Option<f64>]| values.iter().flatten().copied().fold(0.0, f64::max);
        let jitter = worst(&result.acceleration_rad_per_s2);
        let (outcome, detail) = if 2 * result.stopped_rate_apart > arms {
            let joint = result.stop_joint.map_or_else(String::new, |joint| format!("joint {joint} "));
            let kind = result.stop_for.map_or("", |kind| match kind {
                certune::closed_loop::Guarded::Range => "range",
                certune::closed_loop::Guarded::Speed => "speed",
                certune::closed_loop::Guarded::Torque => "torque",
                certune::closed_loop::Guarded::TorqueRate => "torque rate",
            });
            (Outcome::SafetyStop, format!("{joint}{kind}, {:.3} s", result.stop_s.unwrap_or(0.0)))
        } else {
            match result.worst_error_rad {
                Some(error) if error < DONE_RAD && jitter < JITTER_RAD_PER_S2 => (Outcome::Worked, String::new()),
                Some(error) if error < DONE_RAD => (Outcome::WorkedWithJitter, format!("{jitter:.0} rad/s²")),
                Some(error) => (Outcome::Missed, format!("{:.0} mrad off", 1e3 * error)),
                None => (Outcome::Missed, "ran away".to_owned()),
            }
        };
        GridCell { outcome, detail }
    };
    let names: Vec<&str> = cells
        .first()
        .map(|cell| cell.results.iter().map(|result| result.contender.as_str()).collect())
        .unwrap_or_default();
    let row = |name: &&str| GridRow {
        controller: Some((*name).to_owned()),
        name: String::new(),
        cells: cells
            .iter()
            .filter_map(|point| point.results.iter().find(|result| result.contender == **name))
            .map(cell)
            .collect(),
    };
    Drawing::Grid(OutcomeGrid {
        row_name: "controller".to_owned(),
        columns: cells.iter().map(|cell| column(&cell.effects)).collect(),
        rows: names.iter().filter(|name| shown(name)).map(row).collect(),
    })
}

fn payloads(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "payloads",
        "An empty and a full bottle",
        "How differently does the arm move with 0.1 and with 0.7 kg in its hand?",
        statement(found, "compliance-to-payloads"),
        &[
            &found.payloads.conditions,
            "From rest in \"grab\" the bottle is attached after 2 s, carried from 7 s on over \"centre\" to \"release\" and released at 17 s.",
        ],
    );
    let traced = |contender: &str| -> Vec<&Trace> {
        found.traces.iter().filter(|trace| trace.experiment == "payloads" && trace.contender == contender).collect()
    };
    let apart = |contender: &&str| {
        let [light, full] = traced(contender)[..] else { return None };
        let rows = light.q_rad.iter().zip(&full.q_rad).enumerate();
        let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        Some(series(contender, "", rows.map(|(row, (a, b))| (row as f64 * light.row_s, 1e3 * largest(a, b)))))
    };
    let drawing = Drawing::Lines(Lines {
        x: quantity("time", "s", false),
        y: quantity("largest difference of a joint", "mrad", false),
        limits: Vec::new(),
        series: [names::AIC_ROBOT, names::MRAC_ROBOT].iter().filter_map(apart).collect(),
    });
    experiment.figures.push(figure(
        "payload-difference",
        "Difference between the trajectories with either bottle",
        "Nominal arm, gains of the robot.",
        drawing,
    ));
    experiment.figures.push(figure(
        "payload-spread",
        "Every arm",
        "A dot an arm; lower is better.",
        spread(&found.payloads, &PAYLOADS),
    ));
    experiment.tables.push(medians(found, &found.payloads, "All controllers", &PAYLOADS));
    experiment
}

fn push(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "push",
        "A push at the flange",
        "How far does the arm give way, and how does it come back?",
        format!("{}. {}", statement(found, "smooth-return"), statement(found, "compliance-to-pushes")),
        &[&found.push.conditions],
    );
    let of = [names::AIC, names::AIC_ROBOT, names::MRAC, names::MRAC_ROBOT, names::MRAC_MATCHED];
    if let Some(drawing) = responses(found, "push", &of, Shown::Angles, &[]) {
        experiment.figures.push(figure("push-responses", "Joint angles of the nominal arm", "", drawing));
    }
    experiment.figures.push(figure("push-spread", "Every arm", "A dot an arm.", spread(&found.push, &PUSH)));
    experiment.tables.push(medians(found, &found.push, "All controllers", &PUSH));
    experiment
}

fn cost(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "cost",
        "What a step costs",
        "How do operations and time grow with the number of joints?",
        format!("{}. {}", statement(found, "linear-complexity"), statement(found, "fast-loop")),
        &[
            "Operations are counted on a number type that counts them, in the same source that controls the arm. Times were measured when this page was made and differ from run to run.",
        ],
    );
    let controllers =
        [(names::AIC, "aic"), (names::MRAC, "mrac-released-code"), (names::MRAC_MODEL, "mrac-reference-model")];
    let operations = controllers.map(|(id, name)| {
        let of = found.cost.iter().filter(|cost| cost.controller == name);
        series(id, "", of.map(|cost: &StepCost| (cost.joints as f64, cost.total() as f64)))
    });
    let times = controllers.map(|(id, name)| {
        let of = found.measured_times.iter().filter(|time| time.controller == name);
        series(id, "", of.map(|time: &StepTime| (time.joints as f64, time.median_ns)))
    });
    let lines =
        |y, limits, series: Vec<_>| Drawing::Lines(Lines { x: quantity("joints", "", true), y, limits, series });
    let drawing = lines(quantity("operations of a step", "", true), Vec::new(), operations.to_vec());
    experiment.figures.push(figure("cost-operations", "Operations", "", drawing));
    let budget = Limit { name: "300 us".to_owned(), value: BUDGET_NS };
    let drawing = lines(quantity("time of a step", "ns", true), vec![budget], times.to_vec());
    experiment.figures.push(figure("cost-times", "Time on the machine that made this page", "", drawing));
    experiment
}

fn effort(found: &Comparison) -> Experiment {
    let mut experiment = begun(
        "tuning",
        "What tuning takes",
        "How good do gains become with how many candidates?",
        statement(found, "tuning-effort"),
        &[
            "The same plants, objective and budget for all searches: the settling cost, which counts lag, jitter, overshoot and saturation together.",
        ],
    );
    if found.effort.searches.is_empty() {
        return experiment;
    }
    let curve = |search: &certune_paper::record::Search| {
        let (id, name) = match search.contender.as_str() {
            names::MRAC_FREE => (names::MRAC_MATCHED, "reference free"),
            other => (other, ""),
        };
        series(id, name, search.best_so_far.iter().map(|(candidates, cost)| (*candidates as f64, *cost)))
    };
    let drawing = Drawing::Lines(Lines {
        x: quantity("candidates", "", true),
        y: quantity("best settling cost so far", "s", true),
        limits: Vec::new(),
        series: found.effort.searches.iter().map(curve).collect(),
    });
    experiment.figures.push(figure("effort", "Best cost so far", "", drawing));
    let name = |contender: &str| {
        found.contenders.iter().find(|one| one.name == contender).map_or_else(String::new, |one| one.title.clone())
    };
    let column = |cost_s: f64| Column { name: format!("candidates to {cost_s:.3} s"), unit: String::new() };
    let row = |search: &certune_paper::record::Search| TableRow {
        controller: shown(&search.contender).then(|| search.contender.clone()),
        name: if shown(&search.contender) { String::new() } else { name(&search.contender) },
        cells: found
            .effort
            .reached
            .iter()
            .map(|reached| {
                let candidates = reached.candidates.get(&search.contender).copied().flatten();
                Cell::Number(candidates.map(|candidates| candidates as f64))
            })
            .collect(),
    };
    experiment.tables.push(FigureTable {
        caption: "How many candidates each search took".to_owned(),
        row_name: "search".to_owned(),
        columns: found.effort.reached.iter().map(|reached| column(reached.cost_s)).collect(),
        rows: found.effort.searches.iter().map(row).collect(),
    });
    experiment
}
