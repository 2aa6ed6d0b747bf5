//! What is read off a run while it goes on, beside its [`Metrics`].
//!
//! | figure | code | definition | unit |
//! |--------|------|------------|------|
//! | saturation after a goal | `saturated_after_goal` | samples of the first 0.25 s of a goal, summed over joints, in which more than the motor's limit was asked for | 1 |
//! | reversals | `reversals` | changes of a joint's direction, counted between speeds above 0.02 rad/s either way, summed over joints | 1 |
//! | jitter of torque | `torque_rate` | root mean square of the given torque's rate from 4 s after a goal on | N m/s |
//! | jitter of motion | `acceleration` | root mean square of `(dq_k - 2 dq_{k-1} + dq_{k-2})/(2 h)` from 4 s after a goal on: the acceleration that turns round from sample to sample, without that of a smooth motion | rad/s² |

use certune_closed_loop::{Metrics, Recorder, SafetyLimits, SafetyMonitor, Sample, Segment};
use certune_linsys::Joints;

use crate::runs::JOINTS;

/// How long after a goal a saturation belongs to it, s.
const AFTER_GOAL_S: f64 = 0.25;
/// From when on a joint counts as settled, s after its goal.
const LATE_S: f64 = 4.0;
/// Slower than this a joint has no direction, rad/s.
const DIRECTION_RAD_PER_S: f64 = 0.02;

/// Watches one run.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    pub monitor: SafetyMonitor<JOINTS>,
    limit: Joints<JOINTS>,
    step_s: f64,
    goal: Option<Joints<JOINTS>>,
    goal_s: f64,
    /// Torque, velocity and the velocity before that.
    before: Option<[Joints<JOINTS>; 3]>,
    direction: [f64; JOINTS],
    rate_squares: Joints<JOINTS>,
    acceleration_squares: Joints<JOINTS>,
    late: u64,
    pub saturated_after_goal: u64,
    pub reversals: u64,
}

impl Watch {
    pub fn new(limits: &SafetyLimits<JOINTS>, step_s: f64) -> Self {
        Self {
            limit: limits.torque_n_m,
            monitor: SafetyMonitor::new(limits.clone(), step_s),
            step_s,
            goal: None,
            goal_s: 0.0,
            before: None,
            direction: [0.0; JOINTS],
            rate_squares: Joints::zeros(),
            acceleration_squares: Joints::zeros(),
            late: 0,
            saturated_after_goal: 0,
            reversals: 0,
        }
    }

    fn root_mean_square(&self, squares: &Joints<JOINTS>) -> [Option<f64>; JOINTS] {
        core::array::from_fn(|joint| (self.late > 0).then(|| (squares[joint] / self.late as f64).sqrt() / self.step_s))
    }

    /// Of each joint once it has settled, N m/s.
    pub fn torque_rate(&self) -> [Option<f64>; JOINTS] {
        self.root_mean_square(&self.rate_squares)
    }

    /// Of each joint once it has settled, rad/s².
    pub fn acceleration(&self) -> [Option<f64>; JOINTS] {
        self.root_mean_square(&self.acceleration_squares)
    }
}

impl<S> Recorder<JOINTS, S> for Watch {
    fn sample(&mut self, sample: &Sample<'_, JOINTS, S>) {
        self.monitor.sample(sample);
        if self.goal != Some(sample.goal) {
            (self.goal, self.goal_s) = (Some(sample.goal), sample.t_s);
        }
        let since_s = sample.t_s - self.goal_s;
        let (tau, dq) = (&sample.tau, &sample.at.dq);
        for joint in 0..JOINTS {
            if since_s < AFTER_GOAL_S && sample.command[joint].abs() > self.limit[joint] {
                self.saturated_after_goal += 1;
            }
            if dq[joint].abs() > DIRECTION_RAD_PER_S {
                let direction = dq[joint].signum();
                if direction * self.direction[joint] < 0.0 {
                    self.reversals += 1;
                }
                self.direction[joint] = direction;
            }
        }
        let [tau_before, dq_before, dq_earlier] = self.before.unwrap_or([*tau, *dq, *dq]);
        if since_s >= LATE_S {
            self.late += 1;
            self.rate_squares += (tau - tau_before).map(|change| change * change);
            let turn = (dq - dq_before * 2.0 + dq_earlier) * 0.5;
            self.acceleration_squares += turn.component_mul(&turn);
        }
        self.before = Some([*tau, *dq, dq_before]);
    }
}

/// The names of the figures of a run that [`of_run`] gives, in its order.
pub(crate) const FIGURES: [&str; 10] = [
    "settling_time_s",
    "final_error_rad",
    "overshoot",
    "itae_rad_s2",
    "reversals",
    "peak_torque_n_m",
    "torque_rate_rms_n_m_per_s",
    "settled_torque_rate_n_m_per_s",
    "saturated_samples",
    "saturated_after_goal",
];

/// The figures of a run; none of them for one that ran away.
pub(crate) fn of_run(metrics: &Metrics, watch: &Watch) -> Vec<Option<f64>> {
    if metrics.diverged_at_s.is_some() {
        return vec![None; FIGURES.len()];
    }
    let worst = |of: &dyn Fn(&Segment) -> f64| metrics.segments.iter().map(of).fold(0.0, f64::max);
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    let settled: Option<Vec<f64>> = metrics.segments.iter().map(Segment::slowest_settling_time_s).collect();
    let jitter: Option<Vec<f64>> = watch.torque_rate().into_iter().collect();
    vec![
        settled.map(|times| largest(&times)),
        Some(metrics.worst_final_error_rad()),
        Some(worst(&Segment::worst_overshoot)),
        Some(metrics.segments.iter().flat_map(|segment| &segment.itae_rad_s2).sum()),
        Some(watch.reversals as f64),
        Some(worst(&|segment| largest(&segment.peak_torque_n_m))),
        Some(worst(&|segment| largest(&segment.torque_rate_rms_n_m_per_s))),
        jitter.map(|rates| largest(&rates)),
        Some(metrics.saturated_steps() as f64),
        Some(watch.saturated_after_goal as f64),
    ]
}
