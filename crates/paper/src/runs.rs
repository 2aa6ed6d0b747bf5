//! Controllers on many arms, and on one.

use std::collections::BTreeMap;

use certune_closed_loop::{
    Gains, Metrics, NoiseStream, Plant, PlantBox, Recorder, Run, Sample, Scenario, Task, Trajectory,
    simulate_many_recorded,
};
use certune_control::aic::AicParams;
use certune_control::mrac::MracParams;
use certune_dynamics::{Model, Robot, flange_pose, joint_origins};
use certune_linsys::Joints;
use rayon::prelude::*;

use crate::error::CompareError;
use crate::record::{Arms, Figure, Trace, fixed, rounded};

/// The Panda's.
pub(crate) const JOINTS: usize = 7;
/// Arms that one thread takes at a time: as many as the widest register has lanes.
const AT_ONCE: usize = 8;
/// Samples between two rows of a trace: 50 ms at 1 kHz.
pub(crate) const TRACE_EVERY: u64 = 50;

/// A controller's checked parameters.
pub(crate) enum Law {
    Aic(Box<AicParams<JOINTS>>),
    Mrac(Box<MracParams<JOINTS>>),
}

impl Law {
    pub fn new(gains: &Gains, step_s: f64) -> Result<Self, CompareError> {
        Ok(match gains {
            Gains::Aic(table) => Self::Aic(Box::new(AicParams::new(&table.bind()?, step_s)?)),
            Gains::Mrac(table) => Self::Mrac(Box::new(MracParams::new(&table.bind()?, step_s)?)),
        })
    }

    fn run<R: Recorder<JOINTS, ()>>(&self, runs: &[Run<'_, JOINTS>], recorders: &mut [R]) -> Vec<Metrics> {
        match self {
            Self::Aic(params) => simulate_many_recorded(&with(runs, &**params), recorders),
            Self::Mrac(params) => simulate_many_recorded(&with(runs, &**params), recorders),
        }
    }
}

fn with<'b, P>(runs: &[Run<'b, JOINTS>], params: &'b P) -> Vec<(Run<'b, JOINTS>, &'b P)> {
    runs.iter().map(|run| (*run, params)).collect()
}

/// Arms and what they are asked to do.
pub(crate) struct Stand {
    pub plants: Vec<Plant<JOINTS>>,
    pub task: Task<JOINTS>,
    pub seed: u64,
}

impl Stand {
    /// `arms` arms of `robot`, drawn from the scenario's box.
    pub fn new(robot: &Robot, scenario: &Scenario, seed: u64, arms: usize) -> Result<Self, CompareError> {
        let draw = |index: usize| Plant::new(robot, &scenario.plant_box.draw(JOINTS, seed, index as u64));
        let plants = (0..arms).map(draw).collect::<Result<_, _>>()?;
        Ok(Self { plants, task: scenario.bind(robot)?, seed })
    }

    /// The arm in the middle of the scenario's box, by itself.
    pub fn nominal(robot: &Robot, scenario: &Scenario, seed: u64) -> Result<Self, CompareError> {
        let middle = vec![0.5; scenario.plant_box.dimension(JOINTS)];
        let plant = Plant::new(robot, &scenario.plant_box.at(JOINTS, &middle))?;
        Ok(Self { plants: vec![plant], task: scenario.bind(robot)?, seed })
    }

    /// Runs the controller on every arm, each run before a recorder of its own; what `digest` makes of them comes back in the order of the arms.
    pub fn run<R: Recorder<JOINTS, ()> + Send, D: Send>(
        &self,
        law: &Law,
        recorder: impl Fn() -> R + Sync,
        digest: impl Fn(Metrics, R) -> D + Sync,
    ) -> Vec<D> {
        let bundles = self.plants.par_chunks(AT_ONCE).enumerate().map(|(bundle, plants)| {
            let run = |(index, plant)| {
                let noise = NoiseStream { seed: self.seed, index: (bundle * AT_ONCE + index) as u64 };
                Run { plant, task: &self.task, noise }
            };
            let runs: Vec<_> = plants.iter().enumerate().map(run).collect();
            let mut recorders: Vec<R> = plants.iter().map(|_| recorder()).collect();
            let metrics = law.run(&runs, &mut recorders);
            metrics.into_iter().zip(recorders).map(|(metrics, seen)| digest(metrics, seen)).collect::<Vec<D>>()
        });
        bundles.collect::<Vec<_>>().into_iter().flatten().collect()
    }
}

/// A box that is one plant but for the masses.
pub(crate) fn masses_only(
    mass_uncertainty: f64,
    friction: f64,
    rotor: f64,
    delay: usize,
    compensated: bool,
) -> PlantBox {
    PlantBox {
        mass_uncertainty,
        payload_kg: [0.0; 2],
        friction_n_m_s_per_rad: [friction; 2],
        rotor_inertia_kg_m2: [rotor; 2],
        delay_samples: [delay; 2],
        gravity_compensation: compensated,
    }
}

/// The figures of all arms, by name; `names` in the order of each arm's figures.
pub(crate) fn arms(contender: &str, names: &[&str], runs: &[Vec<Option<f64>>], diverged: usize) -> Arms {
    let column = |place: usize| {
        let values = runs.iter().map(|run| run.get(place).copied().flatten().and_then(rounded)).collect();
        Figure { values }
    };
    let figures: BTreeMap<_, _> =
        names.iter().enumerate().map(|(place, name)| ((*name).to_owned(), column(place))).collect();
    Arms { contender: contender.to_owned(), diverged, figures, nominal: None }
}

/// A recorder of positions, torques and goals each `every` samples.
pub(crate) type Rows = Trajectory<JOINTS, (), fn(&Sample<'_, JOINTS, ()>)>;

pub(crate) fn rows(every: u64) -> Rows {
    fn nothing(_: &Sample<'_, JOINTS, ()>) {}
    Trajectory::new(every, nothing)
}

/// Who a trace is of.
pub(crate) struct Title<'a> {
    pub experiment: &'a str,
    pub contender: &'a str,
    pub case: &'a str,
}

/// The trace of a run on the arm of `model`; with the arm's points, when it is to be replayed.
pub(crate) fn trace(
    title: &Title<'_>,
    rows: &Rows,
    row_s: f64,
    model: Option<&Model<JOINTS>>,
    stop_s: Option<f64>,
) -> Trace {
    let numbers =
        |joints: &Joints<JOINTS>, digits| joints.iter().map(|value| fixed(*value, digits)).collect::<Vec<_>>();
    let mut goals: Vec<(usize, Vec<f64>)> = Vec::new();
    for (place, row) in rows.rows().iter().enumerate() {
        let goal = numbers(&row.goal, 4);
        if goals.last().is_none_or(|(_, last)| *last != goal) {
            goals.push((place, goal));
        }
    }
    let points = |q: &Joints<JOINTS>| {
        let Some(model) = model else { return Vec::new() };
        let flange = flange_pose(model, q).0;
        let points = joint_origins(model, q).into_iter().chain([flange]);
        points.map(|point| [fixed(point.x, 3), fixed(point.y, 3), fixed(point.z, 3)]).collect()
    };
    Trace {
        experiment: title.experiment.to_owned(),
        contender: title.contender.to_owned(),
        case: title.case.to_owned(),
        row_s,
        goals,
        q_rad: rows.rows().iter().map(|row| numbers(&row.q, 4)).collect(),
        tau_n_m: rows.rows().iter().map(|row| numbers(&row.tau, 2)).collect(),
        points_m: model.map_or_else(Vec::new, |_| rows.rows().iter().map(|row| points(&row.q)).collect()),
        stop_s,
    }
}

/// Both recorders see the run.
pub(crate) struct Both<A, B>(pub A, pub B);

impl<S, A: Recorder<JOINTS, S>, B: Recorder<JOINTS, S>> Recorder<JOINTS, S> for Both<A, B> {
    fn sample(&mut self, sample: &Sample<'_, JOINTS, S>) {
        self.0.sample(sample);
        self.1.sample(sample);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use certune_closed_loop::GainsFile;

    use super::*;

    /// Joints that are asked to move.
    const MOVING: [usize; 5] = [0, 1, 2, 3, 5];

    #[test]
    fn the_published_aic_behaves_as_two_independent_simulators_say() {
        // Pinocchio and MuJoCo, arm with hand, no friction, no rotor inertia, gravity not compensated: errors after 6 s in mrad.
        let printed_mrad =
            [[-2.20, -0.89, -0.15, 2.84, -2.71], [2.17, -0.60, 0.11, -1.25, 2.68], [2.20, -0.02, 0.09, 0.27, -0.83]];
        let text = include_str!("../../../tuning/scenarios/pick-and-place-paper.toml");
        let mut scenario = Scenario::parse(Path::new("scenario"), text).unwrap();
        scenario.plant_box = masses_only(0.0, 0.0, 0.0, 0, false);
        scenario.segments.truncate(3);
        let text = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
        let gains = GainsFile::parse(Path::new("gains"), text).unwrap().gains;
        let law = Law::new(&gains, scenario.step_s).unwrap();
        // Ten arms, so that there is more than one bundle, all alike.
        let stand = Stand::new(&Robot::panda(), &scenario, 1, 10).unwrap();
        let found = stand.run(&law, || rows(10), |metrics, rows| (metrics, rows.into_rows()));
        assert_eq!(found.len(), 10);
        for (metrics, rows) in found {
            assert_eq!((metrics.saturated_steps(), metrics.diverged_at_s, rows.len()), (0, None, 1800));
            for (segment, expected) in metrics.segments.iter().zip(printed_mrad) {
                for (joint, expected) in MOVING.into_iter().zip(expected) {
                    let error = segment.final_error_rad[joint] * 1e3;
                    assert!((error - expected).abs() <= 0.02, "joint {}: {error} mrad, printed {expected}", joint + 1);
                }
                assert!(segment.settling_time_s[0].is_some_and(|settled| (settled - 4.05).abs() < 0.01));
            }
            let peak = |joint: usize| metrics.segments.iter().map(|s| s.peak_torque_n_m[joint]).fold(0.0, f64::max);
            assert!(peak(1) < 56.7 && peak(3) < 28.8, "{} {}", peak(1), peak(3));
        }
    }
}
