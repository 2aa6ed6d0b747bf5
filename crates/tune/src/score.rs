//! What a simulated run costs, in seconds: how slow the arm is, and what it did on the way that nobody wants.
//!
//! ```text
//! cost of a run     = mean over its goals of (lag + jitter + overshoot + saturation)
//! lag               = sqrt( sum_j ITAE_j / sum_j max(|s_j|, 0.05 rad) )
//! jitter            = max_j RMS(dtau_j/dt) / (1000 N m/s)      x 1 s
//! overshoot         = max_j overshoot_j                        x 1 s
//! saturation        = mean_j (time that the motor's limit was exceeded)
//! cost of a batch   = mean over the worse half of the plants
//! ```
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | ITAE_j | `itae_rad_s2` | integral of t times abs(q_j - goal_j) from the moment the goal is set | rad s² |
//! | s_j    | `step` | goal less the goal before it | rad |
//! | RMS    | `torque_rate_rms_n_m_per_s` | root mean square over the time of a goal | N m/s |
//!
//! **Why ITAE.** An arm that follows a step `s` as `s exp(-t/T)` has `ITAE = |s| T²`, so that the lag of such an arm *is* its time constant T and its 2 % settling time
//! is 3.9 T. Unlike a settling time, the lag changes smoothly with the gains, and the weight t makes late errors count: the slow tail that a settling time sees, and what
//! remains at the end. A joint that is not asked to move counts through its deviation; 0.05 rad keeps the quotient finite when none is.
//!
//! **Why these weights.** 1000 N m/s is the torque rate at which the Panda stops itself, so jitter of 100 N m/s weighs as much as 0.1 s of lag, and so does an overshoot of 10 %.
//!
//! **Why the worse half.** The mean alone would buy a fast average with one bad arm, the maximum follows a single plant and jumps from one to another.
//!
//! Limits: the cost says nothing about stability beyond the runs; that is the certificate's business. A run that diverges has no cost but a rank of its own ([`Outcome::Diverged`]).

use certune_closed_loop::{Metrics, Segment};

use crate::outcome::{Finite, Outcome};
use crate::record::Figures;

/// Steps below this count as this in the lag, rad.
pub const LEAST_STEP_RAD: f64 = 0.05;
/// The torque rate that weighs one second, N m/s.
pub const TORQUE_RATE_N_M_PER_S: f64 = 1000.0;
/// What an overshoot of 100 % weighs, s.
pub const OVERSHOOT_S: f64 = 1.0;

/// The parts of the cost of one goal, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// The equivalent time constant.
    pub lag_s: f64,
    /// The torque's unrest.
    pub jitter_s: f64,
    /// Running past the goal.
    pub overshoot_s: f64,
    /// Asking for more than the motor has.
    pub saturation_s: f64,
}

impl Parts {
    /// The parts for one goal that follows `previous_goal_rad` in a run with samples of `step_s`.
    pub fn of(segment: &Segment, previous_goal_rad: &[f64], step_s: f64) -> Self {
        let steps = segment.goal_rad.iter().zip(previous_goal_rad).map(|(goal, before)| (goal - before).abs());
        let asked: f64 = steps.map(|step| step.max(LEAST_STEP_RAD)).sum();
        let joints = segment.goal_rad.len() as f64;
        let saturated: u64 = segment.saturated_steps.iter().sum();
        Self {
            lag_s: (segment.itae_rad_s2.iter().sum::<f64>() / asked).sqrt(),
            jitter_s: largest(&segment.torque_rate_rms_n_m_per_s) / TORQUE_RATE_N_M_PER_S,
            overshoot_s: segment.worst_overshoot() * OVERSHOOT_S,
            saturation_s: saturated as f64 * step_s / joints,
        }
    }

    /// The cost of the goal, s.
    pub fn total_s(&self) -> f64 {
        self.lag_s + self.jitter_s + self.overshoot_s + self.saturation_s
    }
}

/// The outcome of one run that started at `start_rad`: its cost, or its divergence.
pub fn of_run(metrics: &Metrics, start_rad: &[f64], step_s: f64) -> Outcome {
    if let Some(at_s) = metrics.diverged_at_s {
        return Outcome::Diverged { at_s: Finite::saturating(at_s) };
    }
    let mut previous = start_rad;
    let mut sum_s = 0.0;
    for segment in &metrics.segments {
        sum_s += Parts::of(segment, previous, step_s).total_s();
        previous = &segment.goal_rad;
    }
    Outcome::Simulated { cost: Finite::saturating(sum_s / metrics.segments.len().max(1) as f64) }
}

/// A cost that the run cannot end below, s: that of its figures so far. `goal_steps` tells how long each goal of the task stands, in samples.
///
/// Lag, overshoot and saturation of a goal only grow while it stands; jitter is a mean square, which is spread over the goal's whole time here.
pub fn of_run_so_far_s(metrics: &Metrics, start_rad: &[f64], step_s: f64, goal_steps: &[u64]) -> f64 {
    let mut previous = start_rad;
    let mut sum_s = 0.0;
    for (segment, steps) in metrics.segments.iter().zip(goal_steps) {
        let parts = Parts::of(segment, previous, step_s);
        // One rate fewer than samples, as in a run's first goal: elsewhere that is below the true share.
        let rates = ((segment.duration_s / step_s).round() - 1.0).max(0.0);
        let share = (rates / (steps.saturating_sub(1).max(1)) as f64).min(1.0);
        sum_s += Parts { jitter_s: parts.jitter_s * share.sqrt(), ..parts }.total_s();
        previous = &segment.goal_rad;
    }
    // The last digits of the sums above are not those of the sums at the end.
    sum_s / goal_steps.len().max(1) as f64 * (1.0 - 1e-12)
}

/// A cost that a batch cannot end below, s, from such costs of its plants; 0 for a plant that nobody has seen yet.
pub fn of_batch_so_far_s(plants: &[f64]) -> f64 {
    let mut costs = plants.to_vec();
    costs.sort_unstable_by(|a, b| b.total_cmp(a));
    let half = costs.len().div_ceil(2);
    costs[..half].iter().sum::<f64>() / half.max(1) as f64 * (1.0 - 1e-12)
}

/// The outcome of a batch: the mean cost of its worse half, rounded up; the worst outcome if a plant has no cost.
///
/// The order of `plants` does not matter, to the bit. An empty batch proves nothing and counts as diverged at once.
pub fn of_batch(plants: impl IntoIterator<Item = Outcome>) -> Outcome {
    let mut outcomes: Vec<Outcome> = plants.into_iter().collect();
    outcomes.sort_unstable_by(|a, b| b.cmp(a));
    match outcomes.first() {
        None => Outcome::Diverged { at_s: Finite::saturating(0.0) },
        Some(worst) if worst.cost().is_none() => *worst,
        Some(_) => {
            let half = outcomes.len().div_ceil(2);
            let sum_s: f64 = outcomes[..half].iter().filter_map(|outcome| outcome.cost()).sum();
            Outcome::Simulated { cost: Finite::saturating(sum_s / half as f64) }
        }
    }
}

/// The figures of one run.
pub fn figures(metrics: &Metrics) -> Figures {
    let moving = |segment: &&Segment| segment.overshoot.iter().any(Option::is_some);
    let settled: Option<Vec<f64>> =
        metrics.segments.iter().filter(moving).map(Segment::slowest_settling_time_s).collect();
    let worst = |value: fn(&Segment) -> f64| {
        let values: Vec<f64> = metrics.segments.iter().map(value).collect();
        (!values.is_empty()).then(|| largest(&values)).filter(|value| value.is_finite())
    };
    Figures {
        settling_time_s: settled.filter(|times| !times.is_empty()).map(|times| largest(&times)),
        final_error_rad: worst(Segment::worst_final_error_rad),
        overshoot: worst(Segment::worst_overshoot),
        peak_torque_n_m: worst(|segment| largest(&segment.peak_torque_n_m)),
        torque_rate_rms_n_m_per_s: worst(|segment| largest(&segment.torque_rate_rms_n_m_per_s)),
        saturated_steps: metrics.saturated_steps(),
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// One joint that follows steps of 1 and 0.5 rad as first-order lags of `time_constant_s`, sampled finely.
    fn first_order(time_constant_s: f64) -> Metrics {
        let segment = |goal: f64, step: f64| Segment {
            from_s: 0.0,
            duration_s: 60.0,
            goal_rad: vec![goal],
            final_error_rad: vec![0.0],
            settling_time_s: vec![Some(time_constant_s * 50.0_f64.ln())],
            overshoot: vec![Some(0.0)],
            peak_torque_n_m: vec![10.0],
            saturated_steps: vec![0],
            torque_rate_rms_n_m_per_s: vec![0.0],
            itae_rad_s2: vec![step * time_constant_s.powi(2)],
            peak_speed_rad_per_s: vec![0.0],
        };
        Metrics { segments: vec![segment(1.0, 1.0), segment(0.5, 0.5)], diverged_at_s: None }
    }

    fn cost_s(metrics: &Metrics) -> f64 {
        of_run(metrics, &[0.0], 1e-3).cost().unwrap()
    }

    #[test]
    fn a_first_order_lag_costs_its_time_constant() {
        for time_constant_s in [0.3, 1.0, 2.0] {
            assert!((cost_s(&first_order(time_constant_s)) - time_constant_s).abs() < 1e-12);
        }
    }

    #[test]
    fn each_vice_costs_what_the_module_says() {
        let base = first_order(1.0);
        let with = |edit: fn(&mut Segment)| {
            let mut edited = base.clone();
            edit(&mut edited.segments[1]);
            2.0 * (cost_s(&edited) - cost_s(&base))
        };
        assert!((with(|segment| segment.torque_rate_rms_n_m_per_s[0] = 100.0) - 0.1).abs() < 1e-12);
        assert!((with(|segment| segment.overshoot[0] = Some(0.1)) - 0.1).abs() < 1e-12);
        assert!((with(|segment| segment.saturated_steps[0] = 250) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_diverged_run_has_a_rank_and_no_cost() {
        let run = Metrics { diverged_at_s: Some(2.5), ..first_order(1.0) };
        assert_eq!(of_run(&run, &[0.0], 1e-3), Outcome::Diverged { at_s: Finite::new(2.5).unwrap() });
    }

    #[test]
    fn a_hold_without_motion_has_a_finite_cost() {
        let mut still = first_order(1.0);
        still.segments.truncate(1);
        still.segments[0].overshoot[0] = None;
        let cost = of_run(&still, &[1.0], 1e-3).cost().unwrap();
        assert!((cost - (1.0_f64 / LEAST_STEP_RAD).sqrt()).abs() < 1e-12);
        assert_eq!(figures(&still).settling_time_s, None);
    }

    #[test]
    fn figures_are_the_worst_over_the_segments() {
        let mut run = first_order(1.0);
        run.segments[1].final_error_rad[0] = -0.02;
        run.segments[0].settling_time_s[0] = Some(9.0);
        let worst = figures(&run);
        assert_eq!((worst.final_error_rad, worst.settling_time_s), (Some(0.02), Some(9.0)));
        run.segments[1].settling_time_s[0] = None;
        assert_eq!(figures(&run).settling_time_s, None);
    }

    fn simulated(cost_s: f64) -> Outcome {
        Outcome::Simulated { cost: Finite::new(cost_s).unwrap() }
    }

    #[test]
    fn a_batch_costs_the_mean_of_its_worse_half() {
        assert_eq!(of_batch([1.0, 4.0, 2.0, 3.0].map(simulated)), simulated(3.5));
        assert_eq!(of_batch([1.0, 4.0, 2.0].map(simulated)), simulated(3.0));
        let diverged = |at_s: f64| Outcome::Diverged { at_s: Finite::new(at_s).unwrap() };
        assert_eq!(of_batch([simulated(1.0), diverged(3.0), diverged(2.0)]), diverged(2.0));
        assert_eq!(of_batch([]), diverged(0.0));
    }

    proptest! {
        #[test]
        fn a_batch_does_not_depend_on_the_order_of_its_plants(costs in proptest::collection::vec(0.0..10.0_f64, 1..12)) {
            let forward = of_batch(costs.iter().copied().map(simulated));
            let backward = of_batch(costs.iter().rev().copied().map(simulated));
            prop_assert_eq!(forward, backward);
            let mean = costs.iter().sum::<f64>() / costs.len() as f64;
            let worst = costs.iter().copied().fold(0.0, f64::max);
            let cost = forward.cost().unwrap();
            prop_assert!(cost >= mean - 1e-12 && cost <= worst + 1e-12);
        }
    }
}
