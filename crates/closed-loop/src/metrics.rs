//! What a run was worth: figures per goal and joint, accumulated sample by sample without storing the run.
//!
//! With `e(t) = q(t) - goal`, t from the moment the goal is set, `s` the commanded step (goal less the goal before it; for the
//! first, less the start) and h the sampling step:
//!
//! | figure | code | definition | unit |
//! |--------|------|------------|------|
//! | final error | `final_error_rad` | e at the segment's end, signed | rad |
//! | settling | `settling_time_s` | end of the last sample with `\|e\| > 0.02 \|s\|`; none if that is the segment's last | s |
//! | overshoot | `overshoot` | largest `sign(s) e / \|s\|`, at least 0: a fraction of the step | 1 |
//! | peak torque | `peak_torque_n_m` | largest `\|tau\|` asked of the motor, before its limit | N m |
//! | saturation | `saturated_steps` | samples in which that exceeds the motor's limit | 1 |
//! | jitter | `torque_rate_rms_n_m_per_s` | root mean square of `(tau_k - tau_{k-1})/h`, of the torque the motor gives | N m/s |
//! | ITAE | `itae_rad_s2` | `sum h t \|e\|` | rad s² |
//! | energy | `energy_j` | `sum h \|tau dq\|` of the torque the motor gives: the mechanical work it does and takes | J |
//!
//! The goal is the task's, also where the controller's goal is still on its way there.
//! The torque asked of the motor is the controller's, delayed, plus the gravity compensation. Saturation is counted whether or not
//! the limit is applied. A joint with `|s| < 1e-3 rad` has neither settling time nor overshoot. The run's first sample has no torque rate.
//!
//! Limits: a run that diverges ends there; its last segment is judged on the samples before, with no settling times.

use certune_linsys::{Joints, Lanes, Real};
use serde::{Deserialize, Serialize};

/// Fraction of the step within which a joint counts as settled.
pub const SETTLING_BAND: f64 = 0.02;
/// Below this a joint is not asked to move, rad.
pub const LEAST_STEP_RAD: f64 = 1e-3;

/// Figures of one goal; lists run base to tip. Definitions in [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// When the goal is set, s.
    pub from_s: f64,
    /// How long it stood, s; shorter than asked for when the run diverged.
    pub duration_s: f64,
    /// The goal, rad.
    pub goal_rad: Vec<f64>,
    /// Position less goal at the end, rad.
    pub final_error_rad: Vec<f64>,
    /// 2 % settling time, s; none for a joint that did not settle or was not asked to move.
    pub settling_time_s: Vec<Option<f64>>,
    /// Overshoot as a fraction of the step; none for a joint that was not asked to move.
    pub overshoot: Vec<Option<f64>>,
    /// Largest torque asked of the motor, N m.
    pub peak_torque_n_m: Vec<f64>,
    /// Samples in which more than the motor's limit was asked for.
    pub saturated_steps: Vec<u64>,
    /// Root mean square of the torque's rate, N m/s.
    pub torque_rate_rms_n_m_per_s: Vec<f64>,
    /// Integral of time times absolute error, rad s².
    pub itae_rad_s2: Vec<f64>,
    /// Integral of the absolute mechanical power of the motor, J.
    pub energy_j: Vec<f64>,
    /// Largest joint speed, rad/s.
    pub peak_speed_rad_per_s: Vec<f64>,
}

/// Figures of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// One entry per goal that was set.
    pub segments: Vec<Segment>,
    /// When the run diverged, s.
    pub diverged_at_s: Option<f64>,
}

impl Segment {
    /// The largest final error of any joint, rad.
    pub fn worst_final_error_rad(&self) -> f64 {
        largest(self.final_error_rad.iter().map(|error| error.abs()))
    }

    /// The longest settling time over the joints asked to move, s; none when one of them did not settle, or none was asked to move.
    pub fn slowest_settling_time_s(&self) -> Option<f64> {
        // Overshoot exists exactly for the joints that were asked to move.
        let moving = self.overshoot.iter().zip(&self.settling_time_s).filter(|(moved, _)| moved.is_some());
        moving.map(|(_, settled)| *settled).collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::max)
    }

    /// The largest overshoot of any joint, as a fraction of its step; 0 when none was asked to move.
    pub fn worst_overshoot(&self) -> f64 {
        largest(self.overshoot.iter().flatten().copied())
    }
}

impl Metrics {
    /// The largest final error of any joint in any segment, rad.
    pub fn worst_final_error_rad(&self) -> f64 {
        largest(self.segments.iter().map(Segment::worst_final_error_rad))
    }

    /// Samples, summed over segments and joints, in which more than a motor's limit was asked for.
    pub fn saturated_steps(&self) -> u64 {
        self.segments.iter().flat_map(|segment| &segment.saturated_steps).sum()
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// What one sample contributes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contribution<'a, const N: usize, T: Real = f64> {
    /// Position at the end of the sample, rad.
    pub q: &'a Joints<N, T>,
    /// Velocity at the end of the sample, rad/s.
    pub dq: &'a Joints<N, T>,
    /// Torque asked of the motor, N m.
    pub asked: &'a Joints<N, T>,
    /// Torque the motor gives, N m.
    pub given: &'a Joints<N, T>,
}

/// Accumulates one segment in every lane. `Copy`, no heap; counts are whole numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meter<const N: usize, T: Real = f64> {
    from_step: T,
    samples: T,
    goal: Joints<N, T>,
    commanded: Joints<N, T>,
    error: Joints<N, T>,
    last_outside: Joints<N, T>,
    overshoot: Joints<N, T>,
    peak_torque: Joints<N, T>,
    peak_speed: Joints<N, T>,
    saturated: Joints<N, T>,
    rate_squares: Joints<N, T>,
    rates: T,
    /// Sum of sample number times |e|.
    itae: Joints<N, T>,
    /// Sum of |tau dq|.
    power: Joints<N, T>,
}

impl<const N: usize> Meter<N> {
    pub fn new(from_step: u64, q: &Joints<N>, previous_goal: &Joints<N>, goal: &Joints<N>) -> Self {
        Self {
            from_step: from_step as f64,
            samples: 0.0,
            goal: *goal,
            commanded: goal - previous_goal,
            error: q - goal,
            last_outside: Joints::zeros(),
            overshoot: Joints::zeros(),
            peak_torque: Joints::zeros(),
            peak_speed: Joints::zeros(),
            saturated: Joints::zeros(),
            rate_squares: Joints::zeros(),
            rates: 0.0,
            itae: Joints::zeros(),
            power: Joints::zeros(),
        }
    }
}

impl<const N: usize, T: Lanes> Meter<N, T> {
    /// The meters of all lanes side by side.
    pub fn pack(of: impl Fn(usize) -> Meter<N>) -> Self {
        let number = |get: fn(&Meter<N>) -> f64| T::from_lanes(|lane| get(&of(lane)));
        let joints =
            |get: fn(&Meter<N>) -> &Joints<N>| Joints::from_fn(|joint, _| T::from_lanes(|lane| get(&of(lane))[joint]));
        Self {
            from_step: number(|m| m.from_step),
            samples: number(|m| m.samples),
            goal: joints(|m| &m.goal),
            commanded: joints(|m| &m.commanded),
            error: joints(|m| &m.error),
            last_outside: joints(|m| &m.last_outside),
            overshoot: joints(|m| &m.overshoot),
            peak_torque: joints(|m| &m.peak_torque),
            peak_speed: joints(|m| &m.peak_speed),
            saturated: joints(|m| &m.saturated),
            rate_squares: joints(|m| &m.rate_squares),
            rates: number(|m| m.rates),
            itae: joints(|m| &m.itae),
            power: joints(|m| &m.power),
        }
    }

    /// The meter of one lane.
    pub fn lane(&self, lane: usize) -> Meter<N> {
        let joints = |of: &Joints<N, T>| Joints::from_fn(|joint, _| of[joint].lane(lane));
        Meter {
            from_step: self.from_step.lane(lane),
            samples: self.samples.lane(lane),
            goal: joints(&self.goal),
            commanded: joints(&self.commanded),
            error: joints(&self.error),
            last_outside: joints(&self.last_outside),
            overshoot: joints(&self.overshoot),
            peak_torque: joints(&self.peak_torque),
            peak_speed: joints(&self.peak_speed),
            saturated: joints(&self.saturated),
            rate_squares: joints(&self.rate_squares),
            rates: self.rates.lane(lane),
            itae: joints(&self.itae),
            power: joints(&self.power),
        }
    }

    /// One sample more; `previously_given` from the run's second sample on.
    #[inline(always)]
    pub fn add(
        &mut self,
        sample: &Contribution<'_, N, T>,
        previously_given: Option<&Joints<N, T>>,
        limit: &Joints<N, T>,
    ) {
        let (zero, one) = (T::zero(), T::one());
        self.samples += one;
        if previously_given.is_some() {
            self.rates += one;
        }
        for joint in 0..N {
            let (error, step) = (sample.q[joint] - self.goal[joint], self.commanded[joint]);
            let (size, asked, speed) = (error.abs(), sample.asked[joint].abs(), sample.dq[joint].abs());
            let largest = |a: T, b: T| a.choose(b, b, a);
            self.error[joint] = error;
            let band = step.abs() * T::from_f64(SETTLING_BAND);
            self.last_outside[joint] = size.choose(band, self.last_outside[joint], self.samples);
            // Past the goal in the direction of the step.
            let past = zero.choose(step, error, -error);
            self.overshoot[joint] = largest(self.overshoot[joint], past);
            self.peak_torque[joint] = largest(self.peak_torque[joint], asked);
            self.peak_speed[joint] = largest(self.peak_speed[joint], speed);
            self.saturated[joint] += asked.choose(limit[joint], zero, one);
            self.itae[joint] = self.samples.mul_add(size, self.itae[joint]);
            self.power[joint] = sample.given[joint].abs().mul_add(speed, self.power[joint]);
            if let Some(before) = previously_given {
                let change = sample.given[joint] - before[joint];
                self.rate_squares[joint] = change.mul_add(change, self.rate_squares[joint]);
            }
        }
    }
}

impl<const N: usize> Meter<N> {
    pub fn finish(&self, step_s: f64, diverged: bool) -> Segment {
        let each = |value: &dyn Fn(usize) -> f64| (0..N).map(value).collect::<Vec<f64>>();
        let moves = |joint: usize| self.commanded[joint].abs() >= LEAST_STEP_RAD;
        let settled = |joint: usize| {
            let inside_at_end = self.last_outside[joint] < self.samples;
            (moves(joint) && inside_at_end && !diverged).then(|| self.last_outside[joint] * step_s)
        };
        Segment {
            from_s: self.from_step * step_s,
            duration_s: self.samples * step_s,
            goal_rad: each(&|joint| self.goal[joint]),
            final_error_rad: each(&|joint| self.error[joint]),
            settling_time_s: (0..N).map(settled).collect(),
            overshoot: (0..N)
                .map(|joint| moves(joint).then(|| self.overshoot[joint] / self.commanded[joint].abs()))
                .collect(),
            peak_torque_n_m: each(&|joint| self.peak_torque[joint]),
            // A whole number below 2^53.
            saturated_steps: self.saturated.iter().map(|count| *count as u64).collect(),
            torque_rate_rms_n_m_per_s: each(&|joint| (self.rate_squares[joint] / self.rates.max(1.0)).sqrt() / step_s),
            itae_rad_s2: each(&|joint| self.itae[joint] * step_s * step_s),
            energy_j: each(&|joint| self.power[joint] * step_s),
            peak_speed_rad_per_s: each(&|joint| self.peak_speed[joint]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1e-3;

    /// A first-order approach `e = -s exp(-t/T)` of joint 0, a ringing joint 1, a joint 2 that is not asked to move.
    fn measured(duration_s: f64) -> Segment {
        let goal = Joints::<3>::new(2.0, -1.0, 0.5);
        let start = Joints::<3>::new(1.0, 0.0, 0.5);
        let mut meter = Meter::new(0, &start, &start, &goal);
        let mut before: Option<Joints<3>> = None;
        for k in 1..=(duration_s / STEP_S).round() as u64 {
            let t = k as f64 * STEP_S;
            let q = Joints::<3>::new(2.0 - (-t / 0.5).exp(), -1.0 + (-t / 0.5).exp() * (8.0 * t).cos(), 0.5 + 0.01 * t);
            let given = Joints::<3>::new(30.0 * t, 5.0, -8.0 * t);
            let dq = Joints::<3>::new(0.0, -2.0, 0.0);
            let sample = Contribution { q: &q, dq: &dq, asked: &given, given: &given };
            meter.add(&sample, before.as_ref(), &Joints::<3>::new(60.0, 10.0, 1e9));
            before = Some(given);
        }
        meter.finish(STEP_S, false)
    }

    #[test]
    fn figures_of_known_signals() {
        let segment = measured(3.0);
        assert!((segment.final_error_rad[0] + (-6.0_f64).exp()).abs() < 1e-12);
        // exp(-t/T) = 0.02 at t = T ln 50.
        assert!((segment.settling_time_s[0].unwrap() - 0.5 * 50.0_f64.ln()).abs() < 2.0 * STEP_S);
        assert_eq!(segment.overshoot[0], Some(0.0));
        // The first swing past the goal, where d/dt (exp(-2t) cos 8t) = 0: tan 8t = -1/4, t = (pi - atan 0.25)/8.
        let t = (std::f64::consts::PI - 0.25_f64.atan()) / 8.0;
        assert!((segment.overshoot[1].unwrap() + (-2.0 * t).exp() * (8.0 * t).cos()).abs() < 1e-4);
        assert_eq!((segment.settling_time_s[2], segment.overshoot[2]), (None, None));
        assert!((segment.peak_torque_n_m[0] - 90.0).abs() < 1e-9);
        assert_eq!(segment.saturated_steps, [1000, 0, 0]);
        assert!((segment.torque_rate_rms_n_m_per_s[0] - 30.0).abs() < 1e-6);
        assert!((segment.torque_rate_rms_n_m_per_s[2] - 8.0).abs() < 1e-6);
        assert!(segment.torque_rate_rms_n_m_per_s[1].abs() < 1e-12);
        // 5 N m at 2 rad/s for 3 s.
        assert!((segment.energy_j[1] - 30.0).abs() < 1e-9);
        // Integral of t exp(-2t) from 0 to 3 is (1 - 7 exp(-6))/4; the sum is off by at most one step.
        assert!((segment.itae_rad_s2[0] - 0.25 * (1.0 - 7.0 * (-6.0_f64).exp())).abs() < STEP_S);
    }

    #[test]
    fn a_joint_still_outside_at_the_end_has_not_settled() {
        let segment = measured(1.0);
        assert_eq!(segment.settling_time_s[0], None);
        assert_eq!(segment.slowest_settling_time_s(), None);
        let settled = measured(3.0);
        let slowest = settled.settling_time_s.iter().flatten().copied().fold(0.0, f64::max);
        assert_eq!(settled.slowest_settling_time_s(), Some(slowest));
    }
}
