//! Pick and place: on the approximated model, and with the same gains on the identified arm over a grid of plant effects.

use std::collections::BTreeMap;

use certune_closed_loop::scenario::Noise;
use certune_closed_loop::{Guarded, Metrics, Plant, SafetyLimits, Scenario, Violation};
use certune_dynamics::Robot;

use crate::error::CompareError;
use crate::inputs::{FRICTION_N_M_S_PER_RAD, Inputs, MASS_UNCERTAINTY, ROTOR_KG_M2, TORQUE_RATE_N_M_PER_S, names};
use crate::record::{Arms, Cell, CellResult, Contender, Effects, Experiment, Trace, Transfer, rounded};
use crate::runs::{self, Both, JOINTS, Law, Stand, TRACE_EVERY, Title, arms, masses_only, rows};
use crate::statistics::quantile;
use crate::watch::{FIGURES, Watch, of_run};

/// Pairs that are tested against each other.
pub(crate) const PAIRS: [(&str, &str); 8] = [
    (names::AIC, names::MRAC),
    (names::AIC, names::MRAC_MODEL),
    (names::AIC, names::MRAC_GOAL),
    (names::AIC, names::MRAC_ROBOT),
    (names::AIC_ROBOT, names::MRAC_ROBOT),
    (names::AIC_TUNED, names::MRAC_MATCHED),
    (names::MRAC, names::MRAC_GOAL),
    (names::MRAC, names::MRAC_GOAL_SCALED),
];

/// Contenders by name, in the order of the names; who is not there is left out.
pub(crate) fn chosen<'a>(contenders: &'a [Contender], names: &[&str]) -> Vec<&'a Contender> {
    names.iter().filter_map(|name| contenders.iter().find(|contender| contender.name == *name)).collect()
}

/// Runs a task on the arms of a stand and on the nominal one.
struct PickAndPlace<'a> {
    robot: &'a Robot,
    scenario: Scenario,
    inputs: &'a Inputs,
}

impl PickAndPlace<'_> {
    fn limits(&self) -> SafetyLimits<JOINTS> {
        SafetyLimits::of(self.robot, TORQUE_RATE_N_M_PER_S)
    }

    /// The experiment's results, each with the nominal run.
    fn results(&self, contenders: &[&Contender]) -> Result<Vec<Arms>, CompareError> {
        let size = self.inputs.size;
        let stand = Stand::new(self.robot, &self.scenario, size.seed, size.arms)?;
        let limits = self.limits();
        let step_s = self.scenario.step_s;
        let mut results = Vec::new();
        for contender in contenders {
            let law = Law::new(&contender.gains, step_s)?;
            let found = stand.run(
                &law,
                || Watch::new(&limits, step_s),
                |metrics, watch| {
                    let mut figures = of_run(&metrics, &watch);
                    figures.extend(
                        [watch.monitor.first(), rate_apart(&watch), motion(&watch)]
                            .map(|stop| stop.map(|stop| stop.t_s)),
                    );
                    (figures, metrics.diverged_at_s.is_some())
                },
            );
            let diverged = found.iter().filter(|(_, diverged)| *diverged).count();
            let figures: Vec<Vec<Option<f64>>> = found.into_iter().map(|(figures, _)| figures).collect();
            let names: Vec<&str> = FIGURES
                .into_iter()
                .chain(["safety_stop_s", "safety_stop_rate_apart_s", "safety_stop_motion_s"])
                .collect();
            results.push(arms(&contender.name, &names, &figures, diverged));
        }
        Ok(results)
    }

    /// The run on the nominal arm: its figures and its trace.
    fn nominal(
        &self,
        contender: &Contender,
        title: &Title<'_>,
        replay: bool,
    ) -> Result<(Metrics, Trace), CompareError> {
        let stand = Stand::nominal(self.robot, &self.scenario, self.inputs.size.seed)?;
        let law = Law::new(&contender.gains, self.scenario.step_s)?;
        let limits = self.limits();
        let model = stand.plants.first().map(Plant::model).filter(|_| replay);
        let row_s = TRACE_EVERY as f64 * self.scenario.step_s;
        let recorder = || Both(Watch::new(&limits, self.scenario.step_s), rows(TRACE_EVERY));
        let mut found = stand.run(&law, recorder, |metrics, Both(watch, rows)| {
            let stop_s = watch.monitor.first().map(|stop| stop.t_s);
            (metrics, runs::trace(title, &rows, row_s, model, stop_s))
        });
        found.pop().ok_or(CompareError::NoArms)
    }
}

/// Pick and place on the approximated model.
pub(crate) fn approximated(
    inputs: &Inputs,
    contenders: &[Contender],
    traces: &mut Vec<Trace>,
) -> Result<Experiment, CompareError> {
    let task = on_boxes(inputs, &inputs.approximated);
    let those = chosen(
        contenders,
        &[
            names::AIC,
            names::AIC_TUNED,
            names::MRAC,
            names::MRAC_MODEL,
            names::MRAC_GOAL,
            names::MRAC_GOAL_SCALED,
            names::MRAC_MATCHED,
            names::MRAC_FREE,
        ],
    );
    let mut results = task.results(&those)?;
    for (contender, result) in those.iter().zip(&mut results) {
        let title = Title { experiment: "approximated", contender: &contender.name, case: "" };
        let replay = [names::AIC, names::MRAC].contains(&contender.name.as_str());
        let (metrics, trace) = task.nominal(contender, &title, replay)?;
        result.nominal = Some(metrics);
        if [names::AIC, names::AIC_TUNED, names::MRAC, names::MRAC_MODEL, names::MRAC_MATCHED]
            .contains(&contender.name.as_str())
        {
            traces.push(trace);
        }
    }
    let conditions = "links as uniform boxes, masses uncertain by 20 %, rotor inertia 0.1 kg m², no friction, gravity not compensated, torque limits 87 N m on joints 1 to 4 and 12 N m on 5 to 7";
    let experiment =
        Experiment { name: "approximated".to_owned(), conditions: conditions.to_owned(), results, tests: Vec::new() };
    Ok(experiment.with_tests(&PAIRS))
}

/// The same with the paper's limit on every joint.
pub(crate) fn paper_limit(inputs: &Inputs, contenders: &[Contender]) -> Result<Experiment, CompareError> {
    let robot = inputs.paper_limited()?;
    let task = on_boxes(inputs, &robot);
    let those = chosen(contenders, &[names::AIC, names::MRAC, names::MRAC_MODEL]);
    let results = task.results(&those)?;
    let conditions = "as above, with 85 N m on every joint, as in the paper";
    let experiment =
        Experiment { name: "paper-limit".to_owned(), conditions: conditions.to_owned(), results, tests: Vec::new() };
    Ok(experiment.with_tests(&PAIRS))
}

fn on_boxes<'a>(inputs: &'a Inputs, robot: &'a Robot) -> PickAndPlace<'a> {
    let mut scenario = inputs.scenarios.pick_and_place.clone();
    scenario.plant_box = masses_only(MASS_UNCERTAINTY, 0.0, ROTOR_KG_M2, 0, false);
    scenario.noise = Noise::default();
    scenario.torque_limits = true;
    PickAndPlace { robot, scenario, inputs }
}

/// The identified arm with some plant effects, gravity compensated; the first two goals.
fn on_robot(inputs: &Inputs, effects: Effects) -> PickAndPlace<'_> {
    let mut scenario = inputs.scenarios.pick_and_place.clone();
    scenario.segments.truncate(2);
    let Effects {
        friction_n_m_s_per_rad: friction,
        rotor_inertia_kg_m2: rotor,
        noise,
        delay_samples,
        torque_rate_limited,
    } = effects;
    scenario.plant_box = masses_only(MASS_UNCERTAINTY, friction, rotor, delay_samples, true);
    scenario.noise = if noise { inputs.scenarios.noise.noise } else { Noise::default() };
    scenario.torque_limits = true;
    scenario.torque_rate_limit_n_m_per_s = torque_rate_limited.then_some(TORQUE_RATE_N_M_PER_S);
    PickAndPlace { robot: &inputs.robot, scenario, inputs }
}

const CONTENDERS: [&str; 7] = [
    names::AIC,
    names::AIC_ROBOT,
    names::AIC_TUNED,
    names::MRAC,
    names::MRAC_MODEL,
    names::MRAC_ROBOT,
    names::MRAC_MATCHED,
];

/// The gains of the simulation on the identified arm.
pub(crate) fn transfer(
    inputs: &Inputs,
    contenders: &[Contender],
    traces: &mut Vec<Trace>,
) -> Result<Transfer, CompareError> {
    let those = chosen(contenders, &CONTENDERS);
    let mut cells = Vec::new();
    let frictions: &[f64] = if inputs.size.grid_arms > 0 { &[0.0, FRICTION_N_M_S_PER_RAD] } else { &[] };
    for &friction_n_m_s_per_rad in frictions {
        for rotor_inertia_kg_m2 in [0.0, ROTOR_KG_M2] {
            for noise in [false, true] {
                for delay_samples in 0..=2 {
                    for torque_rate_limited in [false, true] {
                        let effects = Effects {
                            friction_n_m_s_per_rad,
                            rotor_inertia_kg_m2,
                            noise,
                            delay_samples,
                            torque_rate_limited,
                        };
                        cells.push(cell(inputs, effects, &those)?);
                    }
                }
            }
        }
    }
    let ideal = Effects {
        friction_n_m_s_per_rad: FRICTION_N_M_S_PER_RAD,
        rotor_inertia_kg_m2: ROTOR_KG_M2,
        noise: false,
        delay_samples: 0,
        torque_rate_limited: false,
    };
    let real = Effects { noise: true, delay_samples: 1, torque_rate_limited: true, ..ideal };
    let experiment = |name: &str, conditions: &str, effects| -> Result<Experiment, CompareError> {
        let results = on_robot(inputs, effects).results(&those)?;
        let experiment =
            Experiment { name: name.to_owned(), conditions: conditions.to_owned(), results, tests: Vec::new() };
        Ok(experiment.with_tests(&PAIRS))
    };
    for contender in
        chosen(contenders, &[names::AIC, names::AIC_ROBOT, names::MRAC, names::MRAC_ROBOT, names::MRAC_MATCHED])
    {
        let title = Title {
            experiment: "transfer",
            contender: &contender.name,
            case: "noise, one sample of delay, limited torque rate",
        };
        traces.push(on_robot(inputs, real).nominal(contender, &title, false)?.1);
    }
    Ok(Transfer {
        conditions: "identified arm with hand, masses uncertain by 20 %, gravity compensated by the robot, goals A and B for 6 s each".to_owned(),
        cells,
        ideal: experiment("transfer-ideal", "friction 1 N m s/rad, rotor inertia 0.1 kg m², neither noise nor delay nor limiter", ideal)?,
        robot: experiment("transfer-robot", "the same with sensor noise, one sample of delay and the torque's rate limited to 1000 N m/s", real)?,
    })
}

/// The first stop for anything but a torque that is too fast: without a limiter, every jump of a torque is.
fn rate_apart(watch: &Watch) -> Option<Violation> {
    watch.monitor.first_of_any(&[Guarded::Range, Guarded::Speed, Guarded::Torque])
}

/// The first stop for what the arm does, not for what it is told to.
fn motion(watch: &Watch) -> Option<Violation> {
    watch.monitor.first_of_any(&[Guarded::Range, Guarded::Speed])
}

/// What is kept of a run in a cell.
struct Seen {
    stop: Option<Violation>,
    stop_rate_apart: Option<Violation>,
    stop_motion: bool,
    worst_error_rad: Option<f64>,
    torque_rate: [Option<f64>; JOINTS],
    acceleration: [Option<f64>; JOINTS],
}

fn cell(inputs: &Inputs, effects: Effects, contenders: &[&Contender]) -> Result<Cell, CompareError> {
    let task = on_robot(inputs, effects);
    let size = inputs.size;
    let stand = Stand::new(task.robot, &task.scenario, size.seed, size.grid_arms)?;
    let (limits, step_s) = (task.limits(), task.scenario.step_s);
    let mut results = Vec::new();
    for contender in contenders {
        let law = Law::new(&contender.gains, step_s)?;
        let seen = stand.run(
            &law,
            || Watch::new(&limits, step_s),
            |metrics, watch| {
                let ran = metrics.diverged_at_s.is_none();
                Seen {
                    stop: watch.monitor.first(),
                    stop_rate_apart: rate_apart(&watch),
                    stop_motion: motion(&watch).is_some(),
                    worst_error_rad: ran.then(|| metrics.worst_final_error_rad()),
                    torque_rate: watch.torque_rate().map(|rate| rate.filter(|_| ran)),
                    acceleration: watch.acceleration().map(|rate| rate.filter(|_| ran)),
                }
            },
        );
        results.push(summary(&contender.name, &seen));
    }
    Ok(Cell { effects, results })
}

fn summary(contender: &str, seen: &[Seen]) -> CellResult {
    let median = |values: &mut dyn Iterator<Item = Option<f64>>| {
        quantile(&values.flatten().collect::<Vec<_>>(), 0.5).and_then(rounded)
    };
    let stops: Vec<Violation> = seen.iter().filter_map(|seen| seen.stop_rate_apart).collect();
    CellResult {
        contender: contender.to_owned(),
        stopped: seen.iter().filter(|seen| seen.stop.is_some()).count(),
        stopped_rate_apart: stops.len(),
        stopped_motion: seen.iter().filter(|seen| seen.stop_motion).count(),
        stop_s: median(&mut stops.iter().map(|stop| Some(stop.t_s))),
        stop_for: most(stops.iter().map(|stop| stop.guarded as usize)).map(|kind| Guarded::ALL[kind]),
        stop_joint: most(stops.iter().map(|stop| stop.joint)),
        worst_error_rad: median(&mut seen.iter().map(|seen| seen.worst_error_rad)),
        torque_rate_n_m_per_s: (0..JOINTS)
            .map(|joint| median(&mut seen.iter().map(|seen| seen.torque_rate[joint])))
            .collect(),
        acceleration_rad_per_s2: (0..JOINTS)
            .map(|joint| median(&mut seen.iter().map(|seen| seen.acceleration[joint])))
            .collect(),
    }
}

/// What occurs most often, of equals the least.
fn most(values: impl Iterator<Item = usize>) -> Option<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    values.for_each(|value| *counts.entry(value).or_default() += 1);
    let mut best: Option<(usize, usize)> = None;
    for (value, count) in counts {
        if best.is_none_or(|(_, most)| count > most) {
            best = Some((value, count));
        }
    }
    best.map(|(value, _)| value)
}
