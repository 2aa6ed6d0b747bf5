//! When the arm's own protection would have stopped a run.
//!
//! | guarded | code | condition of a stop |
//! |---------|------|---------------------|
//! | joint range | [`Guarded::Range`] | `q` outside `[lower, upper]`, rad |
//! | speed | [`Guarded::Speed`] | `\|dq\|` above the joint's limit, rad/s |
//! | torque | [`Guarded::Torque`] | `\|c\|` above the motor's limit, N m, where c is the command that reaches the robot |
//! | torque rate | [`Guarded::TorqueRate`] | `\|c_k - c_{k-1}\|/h` above the limit, N m/s; `c_{-1} = 0` |
//!
//! The command is judged as it was logged: before the motor's own clamp, and without what the robot adds against its gravity. A torque that the run's task limits in its rate
//! is therefore never too fast, which is what such a limiter is for. Source of limits and conditions: the maker's control-parameter sheet of the Panda, which asks for commanded torques without
//! gravity; its least torque rate is 1000 N m/s.
//!
//! The monitor watches and does not act: the run goes on, and of each kind the first violation is kept. Limits: the true positions and velocities are judged, not measured ones.

use certune_dynamics::Robot;
use certune_linsys::Joints;
use serde::{Deserialize, Serialize};

use crate::simulate::{Recorder, Sample};

/// A torque that changes by exactly the limit is none too fast, however the difference is rounded.
const RATE_ROUNDING: f64 = 1.0 + 1e-9;

/// What is guarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Guarded {
    /// The joint's range.
    Range,
    /// The joint's speed.
    Speed,
    /// The torque.
    Torque,
    /// The torque's rate.
    TorqueRate,
}

impl Guarded {
    /// Every kind, in the order in which a sample is judged.
    pub const ALL: [Self; 4] = [Self::Range, Self::Speed, Self::Torque, Self::TorqueRate];
}

/// Where a robot stops itself.
#[derive(Clone, Debug, PartialEq)]
pub struct SafetyLimits<const N: usize> {
    /// Least positions, rad.
    pub lower_rad: Joints<N>,
    /// Largest positions, rad.
    pub upper_rad: Joints<N>,
    /// Largest speeds, rad/s.
    pub speed_rad_per_s: Joints<N>,
    /// Largest torques, N m.
    pub torque_n_m: Joints<N>,
    /// Largest rate of a torque, N m/s.
    pub torque_rate_n_m_per_s: f64,
}

impl<const N: usize> SafetyLimits<N> {
    /// The limits in a robot's description, which has none for the torque's rate. Joints beyond the description's are free.
    pub fn of(robot: &Robot, torque_rate_n_m_per_s: f64) -> Self {
        let each = |of: fn(&certune_dynamics::JointLimits) -> f64, free: f64| {
            Joints::from_fn(|joint, _| robot.links().get(joint).map_or(free, |link| of(&link.limits)))
        };
        Self {
            lower_rad: each(|limits| limits.lower_rad, f64::NEG_INFINITY),
            upper_rad: each(|limits| limits.upper_rad, f64::INFINITY),
            speed_rad_per_s: each(|limits| limits.speed_rad_per_s, f64::INFINITY),
            torque_n_m: each(|limits| limits.torque_n_m, f64::INFINITY),
            torque_rate_n_m_per_s,
        }
    }
}

/// What a stop would have been for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Violation {
    /// Which limit.
    pub guarded: Guarded,
    /// The joint, counted from 1.
    pub joint: usize,
    /// When, s.
    pub t_s: f64,
    /// The number beyond the limit, in the unit of what is guarded.
    pub value: f64,
}

/// Keeps the first violation of each kind.
#[derive(Clone, Debug)]
pub struct SafetyMonitor<const N: usize> {
    limits: SafetyLimits<N>,
    samples_per_s: f64,
    before: Joints<N>,
    found: [Option<Violation>; 4],
}

impl<const N: usize> SafetyMonitor<N> {
    /// A monitor for a run sampled each `step_s` seconds, before its first sample.
    pub fn new(limits: SafetyLimits<N>, step_s: f64) -> Self {
        Self { limits, samples_per_s: step_s.recip(), before: Joints::zeros(), found: [None; 4] }
    }

    /// The first violation of that kind.
    pub const fn first_of(&self, guarded: Guarded) -> Option<Violation> {
        self.found[guarded as usize]
    }

    /// What would have stopped the robot: the earliest violation, of those in one sample the first in the order of [`Guarded::ALL`].
    pub fn first(&self) -> Option<Violation> {
        self.first_of_any(&Guarded::ALL)
    }

    /// The earliest violation of these kinds, of those in one sample the first of the list.
    pub fn first_of_any(&self, kinds: &[Guarded]) -> Option<Violation> {
        kinds.iter().filter_map(|kind| self.first_of(*kind)).reduce(|a, b| if b.t_s < a.t_s { b } else { a })
    }
}

/// Keeps the first joint beyond a limit, of the first sample that has one.
fn judge<const N: usize>(
    found: &mut [Option<Violation>; 4],
    t_s: f64,
    guarded: Guarded,
    beyond: impl Fn(usize) -> Option<f64>,
) {
    let found = &mut found[guarded as usize];
    if found.is_none() {
        let first = (0..N).find_map(|joint| Some((joint, beyond(joint)?)));
        *found = first.map(|(joint, value)| Violation { guarded, joint: joint + 1, t_s, value });
    }
}

/// The value, when it is not within the limit; what is no number is within none.
fn beyond(value: f64, within: bool) -> Option<f64> {
    (!within).then_some(value)
}

impl<const N: usize, S> Recorder<N, S> for SafetyMonitor<N> {
    fn sample(&mut self, sample: &Sample<'_, N, S>) {
        let Self { limits, samples_per_s, before, found } = self;
        let (at, command, t_s) = (&sample.at, &sample.command, sample.t_s);
        judge::<N>(found, t_s, Guarded::Range, |joint| {
            beyond(at.q[joint], (limits.lower_rad[joint]..=limits.upper_rad[joint]).contains(&at.q[joint]))
        });
        judge::<N>(found, t_s, Guarded::Speed, |joint| {
            beyond(at.dq[joint], at.dq[joint].abs() <= limits.speed_rad_per_s[joint])
        });
        judge::<N>(found, t_s, Guarded::Torque, |joint| {
            beyond(command[joint], command[joint].abs() <= limits.torque_n_m[joint])
        });
        let rate = (command - *before) * *samples_per_s;
        judge::<N>(found, t_s, Guarded::TorqueRate, |joint| {
            beyond(rate[joint], rate[joint].abs() <= limits.torque_rate_n_m_per_s * RATE_ROUNDING)
        });
        *before = *command;
    }
}
