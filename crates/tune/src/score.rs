//! What a simulated run costs, in seconds: how slow the arm is, and what it did on the way that nobody wants.
//!
//! ```text
//! cost of a run     = mean over its goals of (lag + jitter + overshoot + saturation)
//! lag               = sqrt( sum_j ITAE_j / sum_j max(|s_j|, 0.05 rad) )
//! jitter            = max_j RMS(dtau_j/dt) / (1000 N m/s)      x 1 s
//! overshoot         = max_j overshoot_j                        x 1 s
//! saturation        = mean_j (time that the motor's limit was exceeded)
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
//! **Other goals.** A run can be judged by any [`Goal`] that simulation answers, and by limits; the definitions are in [`goals`](crate::goals).
//!
//! **Why a tail.** A batch costs the mean over the worst of its plants, the conditional value at risk: the mean over all would buy a fast average with one bad arm.
//!
//! Limits: the cost says nothing about stability beyond the runs; that is the certificate's business. A run that diverges has no cost but a rank of its own ([`Outcome::Diverged`]).

use certune_closed_loop::{Metrics, Segment, Task};

use crate::goals::{Excess, Goal, Goals, Source};
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

/// How runs of one task are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Scoring {
    goals: Goals,
    start_rad: Vec<f64>,
    step_s: f64,
    /// How long each goal of the task stands, in samples.
    goal_steps: Vec<u64>,
}

impl Scoring {
    /// `goals`, for runs of `task`.
    pub fn new<const N: usize>(goals: Goals, task: &Task<N>) -> Self {
        let goal_steps = task.segments.iter().map(|segment| segment.steps).collect();
        Self { goals, start_rad: task.start.iter().copied().collect(), step_s: task.step_s, goal_steps }
    }

    /// What is sought and what is kept.
    pub const fn goals(&self) -> &Goals {
        &self.goals
    }

    /// The figure of a goal that simulation answers, of a whole run; of a run so far, a figure that it cannot end below.
    ///
    /// Everything that is counted only grows, except the error at the end of a move, which is 0 until there is one, and jitter: a mean square, spread over the goal's whole time here.
    /// A joint that has not settled when its goal's time is over counts as that time and the share of the step that is still missing. 0 for goals that no run answers.
    pub fn figure(&self, goal: Goal, metrics: &Metrics) -> f64 {
        let mut previous: &[f64] = &self.start_rad;
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        for (segment, steps) in metrics.segments.iter().zip(&self.goal_steps) {
            let samples = (segment.duration_s / self.step_s).round();
            let is_over = samples >= *steps as f64;
            // One rate fewer than samples, as in a run's first goal: elsewhere that is below the true share.
            let rates = (samples - 1.0).max(0.0);
            let share = (rates / (steps.saturating_sub(1).max(1)) as f64).min(1.0).sqrt();
            let (add, at_least) = match goal {
                Goal::SettlingCost => {
                    let parts = Parts::of(segment, previous, self.step_s);
                    (Parts { jitter_s: parts.jitter_s * share, ..parts }.total_s(), 0.0)
                }
                Goal::SettlingTime => (0.0, settling_time_s(segment, previous, is_over)),
                Goal::FinalError => (0.0, if is_over { segment.worst_final_error_rad() } else { 0.0 }),
                Goal::Itae => (segment.itae_rad_s2.iter().sum(), 0.0),
                Goal::Overshoot => (0.0, segment.worst_overshoot()),
                Goal::Jitter => (0.0, largest(&segment.torque_rate_rms_n_m_per_s) * share),
                Goal::PeakTorque => (0.0, largest(&segment.peak_torque_n_m)),
                Goal::Energy => (segment.energy_j.iter().sum(), 0.0),
                Goal::CertifiedRate | Goal::CertifiedRadius | Goal::DelayMargin => (0.0, 0.0),
            };
            sum += add;
            worst = worst.max(at_least);
            previous = &segment.goal_rad;
        }
        match goal {
            Goal::SettlingCost => sum / self.goal_steps.len().max(1) as f64,
            Goal::Itae | Goal::Energy => sum,
            _ => worst,
        }
    }

    /// By how much a run is beyond the limits.
    fn excess(&self, metrics: &Metrics) -> Excess {
        let mut excess = Excess::default();
        for (goal, bound) in self.goals.limits_from(Source::Simulated) {
            excess.add(goal, self.figure(goal, metrics), bound);
        }
        excess
    }

    /// The figures of one run.
    pub fn figures(&self, metrics: &Metrics) -> Figures {
        let moving = |segment: &&Segment| segment.overshoot.iter().any(Option::is_some);
        let settled: Option<Vec<f64>> =
            metrics.segments.iter().filter(moving).map(Segment::slowest_settling_time_s).collect();
        let worst = |value: fn(&Segment) -> f64| {
            let values: Vec<f64> = metrics.segments.iter().map(value).collect();
            (!values.is_empty()).then(|| largest(&values)).filter(|value| value.is_finite())
        };
        let sum = |value: fn(&Segment) -> f64| {
            Some(metrics.segments.iter().map(value).sum::<f64>()).filter(|value| value.is_finite())
        };
        Figures {
            settling_cost_s: Some(self.figure(Goal::SettlingCost, metrics))
                .filter(|cost| cost.is_finite() && metrics.diverged_at_s.is_none()),
            settling_time_s: settled.filter(|times| !times.is_empty()).map(|times| largest(&times)),
            final_error_rad: worst(Segment::worst_final_error_rad),
            overshoot: worst(Segment::worst_overshoot),
            peak_torque_n_m: worst(|segment| largest(&segment.peak_torque_n_m)),
            torque_rate_rms_n_m_per_s: worst(|segment| largest(&segment.torque_rate_rms_n_m_per_s)),
            itae_rad_s2: sum(|segment| segment.itae_rad_s2.iter().sum()),
            energy_j: sum(|segment| segment.energy_j.iter().sum()),
            saturated_steps: metrics.saturated_steps(),
        }
    }

    /// The outcome of a whole run: its cost, 0 when the objective is not simulated; its excess; or its divergence.
    pub fn of_run(&self, metrics: &Metrics) -> Outcome {
        if let Some(at_s) = metrics.diverged_at_s {
            return Outcome::Diverged { at_s: Finite::saturating(at_s) };
        }
        let cost = Finite::saturating(self.figure(self.goals.objective, metrics));
        self.excess(metrics).judge(Outcome::Simulated { cost })
    }

    /// A cost that a run cannot end below; none once it is known to fail, by divergence or beyond a limit.
    pub(crate) fn of_run_so_far(&self, metrics: &Metrics) -> Option<f64> {
        // The last digits of sums on the way are not those of the sums at the end.
        let below = |figure: f64| figure * (1.0 - 1e-12);
        let mut limits = self.goals.limits_from(Source::Simulated);
        let fails =
            metrics.diverged_at_s.is_some() || limits.any(|(goal, bound)| below(self.figure(goal, metrics)) > bound);
        (!fails).then(|| below(self.figure(self.goals.objective, metrics)))
    }

    /// A cost that a batch cannot end below, from such costs of its plants; 0 for a plant that nobody has seen yet.
    pub(crate) fn of_batch_so_far(&self, plants: &[f64]) -> f64 {
        self.tail(plants.iter().copied()) * (1.0 - 1e-12)
    }

    /// The conditional value at risk of figures.
    pub(crate) fn tail(&self, figures: impl Iterator<Item = f64>) -> f64 {
        let mut figures: Vec<f64> = figures.collect();
        figures.sort_unstable_by(|a, b| b.total_cmp(a));
        tail_mean(&figures, self.goals.cvar)
    }

    /// The outcome of a batch: the conditional value at risk of its costs; the worst outcome if a plant has no cost.
    ///
    /// The order of `plants` does not matter, to the bit. An empty batch proves nothing and counts as diverged at once.
    pub fn of_batch(&self, plants: impl IntoIterator<Item = Outcome>) -> Outcome {
        let mut outcomes: Vec<Outcome> = plants.into_iter().collect();
        outcomes.sort_unstable_by(|a, b| b.cmp(a));
        match outcomes.first() {
            None => Outcome::Diverged { at_s: Finite::saturating(0.0) },
            Some(worst) if worst.cost().is_none() => *worst,
            Some(_) => {
                let costs: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.cost()).collect();
                Outcome::Simulated { cost: Finite::saturating(tail_mean(&costs, self.goals.cvar)) }
            }
        }
    }
}

/// The longest time a joint takes to settle, s.
fn settling_time_s(segment: &Segment, previous_goal_rad: &[f64], is_over: bool) -> f64 {
    let steps = segment.goal_rad.iter().zip(previous_goal_rad).map(|(goal, before)| (goal - before).abs());
    let joints = steps.zip(&segment.final_error_rad).zip(&segment.settling_time_s).zip(&segment.overshoot);
    let times = joints.filter(|(_, moves)| moves.is_some()).map(|(((step, error), settled), _)| match settled {
        Some(time_s) => *time_s,
        None if is_over => segment.duration_s * (1.0 + (error.abs() / step).min(1.0)),
        None => segment.duration_s,
    });
    times.fold(0.0, f64::max)
}

/// The mean of the share `1 - cvar` of costs, from the worst on, of at least one; the last counts in part.
fn tail_mean(worst_first: &[f64], cvar: f64) -> f64 {
    let tail = ((1.0 - cvar) * worst_first.len() as f64).max(1.0);
    let weight = |place: usize| (tail - place as f64).clamp(0.0, 1.0);
    let sum: f64 = worst_first.iter().enumerate().map(|(place, cost)| weight(place) * cost).sum();
    sum / tail
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goals::{Bound, Limit};
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
            energy_j: vec![2.0 * step],
            peak_speed_rad_per_s: vec![0.0],
        };
        Metrics { segments: vec![segment(1.0, 1.0), segment(0.5, 0.5)], diverged_at_s: None }
    }

    fn scoring(goals: Goals) -> Scoring {
        Scoring { goals, start_rad: vec![0.0], step_s: 1e-3, goal_steps: vec![60_000, 60_000] }
    }

    fn with_limit(goal: Goal, bound: f64) -> Scoring {
        scoring(Goals { limits: vec![Limit { goal, bound: Bound::At(bound) }], ..Goals::default() })
    }

    fn cost_s(metrics: &Metrics) -> f64 {
        scoring(Goals::default()).of_run(metrics).cost().unwrap()
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
        let outcome = scoring(Goals::default()).of_run(&run);
        assert_eq!(outcome, Outcome::Diverged { at_s: Finite::new(2.5).unwrap() });
    }

    #[test]
    fn a_hold_without_motion_has_a_finite_cost() {
        let mut still = first_order(1.0);
        still.segments.truncate(1);
        still.segments[0].overshoot[0] = None;
        let hold = Scoring { start_rad: vec![1.0], goal_steps: vec![60_000], ..scoring(Goals::default()) };
        let cost = hold.of_run(&still).cost().unwrap();
        assert!((cost - (1.0_f64 / LEAST_STEP_RAD).sqrt()).abs() < 1e-12);
        assert_eq!(hold.figures(&still).settling_time_s, None);
        assert!(hold.figure(Goal::SettlingTime, &still).abs() < 1e-12);
    }

    #[test]
    fn every_simulated_goal_can_be_the_objective() {
        let mut run = first_order(1.0);
        run.segments[1].overshoot[0] = Some(0.03);
        run.segments[0].final_error_rad[0] = -0.01;
        run.segments[1].torque_rate_rms_n_m_per_s[0] = 7.0;
        let expected = [
            (Goal::SettlingTime, 50.0_f64.ln()),
            (Goal::FinalError, 0.01),
            (Goal::Itae, 1.5),
            (Goal::Overshoot, 0.03),
            (Goal::Jitter, 7.0),
            (Goal::PeakTorque, 10.0),
            (Goal::Energy, 3.0),
        ];
        for (goal, figure) in expected {
            let found = scoring(Goals { objective: goal, ..Goals::default() }).of_run(&run).cost().unwrap();
            assert!((found - figure).abs() < 1e-12, "{goal}: {found}");
        }
    }

    #[test]
    fn a_joint_that_does_not_settle_counts_by_what_is_missing() {
        let mut run = first_order(1.0);
        run.segments[1].settling_time_s[0] = None;
        run.segments[1].final_error_rad[0] = 0.125; // a quarter of the step
        let figure = |run: &Metrics| scoring(Goals::default()).figure(Goal::SettlingTime, run);
        assert!((figure(&run) - 75.0).abs() < 1e-9);
        run.segments[1].duration_s = 20.0; // not over yet
        assert!((figure(&run) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn a_run_beyond_its_limits_costs_nothing_and_says_by_how_much() {
        let mut run = first_order(1.0);
        run.segments[1].overshoot[0] = Some(0.03);
        let judged = with_limit(Goal::Overshoot, 0.02).of_run(&run);
        assert!(
            matches!(judged, Outcome::Violates { excess, limit: Goal::Overshoot } if (excess.get() - 0.5).abs() < 1e-12)
        );
        assert!(with_limit(Goal::Overshoot, 0.03).of_run(&run).cost().is_some());
        assert_eq!(with_limit(Goal::Overshoot, 0.02).of_run_so_far(&run), None);
        assert!(with_limit(Goal::Overshoot, 0.03).of_run_so_far(&run).is_some());
    }

    #[test]
    fn figures_are_the_worst_over_the_segments() {
        let mut run = first_order(1.0);
        run.segments[1].final_error_rad[0] = -0.02;
        run.segments[0].settling_time_s[0] = Some(9.0);
        let worst = scoring(Goals::default()).figures(&run);
        assert_eq!((worst.final_error_rad, worst.settling_time_s), (Some(0.02), Some(9.0)));
        assert_eq!((worst.itae_rad_s2, worst.energy_j), (Some(1.5), Some(3.0)));
        run.segments[1].settling_time_s[0] = None;
        assert_eq!(scoring(Goals::default()).figures(&run).settling_time_s, None);
    }

    fn simulated(cost_s: f64) -> Outcome {
        Outcome::Simulated { cost: Finite::new(cost_s).unwrap() }
    }

    #[test]
    fn a_batch_costs_the_mean_of_its_tail() {
        let batch = |cvar, costs: &[f64]| {
            let scoring = scoring(Goals { cvar, ..Goals::default() });
            scoring.of_batch(costs.iter().copied().map(simulated)).cost().unwrap()
        };
        assert!((batch(0.5, &[1.0, 4.0, 2.0, 3.0]) - 3.5).abs() < 1e-12);
        assert!((batch(0.5, &[1.0, 4.0, 2.0]) - 5.0 / 1.5).abs() < 1e-12);
        assert!((batch(0.0, &[1.0, 4.0, 2.0, 3.0]) - 2.5).abs() < 1e-12);
        assert!((batch(0.9, &[1.0, 4.0, 2.0, 3.0]) - 4.0).abs() < 1e-12);
        let diverged = |at_s: f64| Outcome::Diverged { at_s: Finite::new(at_s).unwrap() };
        let scoring = scoring(Goals::default());
        assert_eq!(scoring.of_batch([simulated(1.0), diverged(3.0), diverged(2.0)]), diverged(2.0));
        assert_eq!(scoring.of_batch([]), diverged(0.0));
    }

    proptest! {
        #[test]
        fn a_batch_does_not_depend_on_the_order_of_its_plants(
            costs in proptest::collection::vec(0.0..10.0_f64, 1..12),
            cvar in 0.0..0.99_f64,
        ) {
            let scoring = scoring(Goals { cvar, ..Goals::default() });
            let forward = scoring.of_batch(costs.iter().copied().map(simulated));
            let backward = scoring.of_batch(costs.iter().rev().copied().map(simulated));
            prop_assert_eq!(forward, backward);
            let mean = costs.iter().sum::<f64>() / costs.len() as f64;
            let worst = costs.iter().copied().fold(0.0, f64::max);
            let cost = forward.cost().unwrap();
            prop_assert!(cost >= mean - 1e-12 && cost <= worst + 1e-12);
            prop_assert!(scoring.of_batch_so_far(&costs) <= cost);
        }
    }
}
