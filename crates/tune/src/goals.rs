//! What a search is after, and what it must keep.
//!
//! | goal | key as a limit | definition, for one run | unit | better |
//! |------|----------------|-------------------------|------|--------|
//! | `settling-cost` | `settling_cost_s` | lag, jitter, overshoot and saturation together, see [`score`](crate::score) | s | lower |
//! | `settling-time` | `settling_time_s` | longest 2 % settling time of any joint in any move | s | lower |
//! | `final-error` | `final_error_rad` | largest error of any joint at the end of a move | rad | lower |
//! | `itae` | `itae_rad_s2` | integral of time times absolute error, over joints and moves | rad s² | lower |
//! | `overshoot` | `overshoot` | largest overshoot, as a fraction of the joint's step | 1 | lower |
//! | `jitter` | `torque_rate_rms_n_m_per_s` | largest root mean square of a torque's rate | N m/s | lower |
//! | `peak-torque` | `peak_torque_n_m` | largest torque asked of a motor | N m | lower |
//! | `energy` | `energy_j` | integral of the absolute mechanical power, over joints | J | lower |
//! | `certified-rate` | `certified_rate_per_s` | decay rate of claim `exponential`, proved for the whole plant box | 1/s | higher |
//! | `certified-radius` | `certified_radius_rad` | radius of claim `region`, proved for the whole plant box | rad | higher |
//! | `delay-margin` | `delay_margin_s` | delay, in whole samples, up to which every linearised loop of a sample stays stable | s | higher |
//!
//! One goal is the objective, any others may be limits:
//!
//! ```toml
//! [search]
//! objective = "settling-cost"       # the default
//! cvar = 0.9                        # the default
//!
//! [limits]
//! overshoot = 0.02
//! torque_rate_rms_n_m_per_s = "start"    # no higher than with the gains that the search starts from
//! certified_radius_rad = 0.8             # at least
//! ```
//!
//! A limit holds on every plant; the objective is the conditional value at risk of level `cvar`, the mean over the worst share `1 - cvar` of the plants (of at least one plant).
//! Candidates that keep every limit come before those that do not, and those are ordered by their excess, the sum over the limits of `value / limit - 1` (`limit / value - 1`
//! where higher is better) on the worst plant: no weights to choose, and no price at which a limit can be bought off.

use serde::{Deserialize, Serialize};

use crate::outcome::{Finite, Outcome};

/// Something that gains can be good at. Definitions in [the module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Goal {
    /// Lag, jitter, overshoot and saturation together.
    #[default]
    SettlingCost,
    /// The longest settling time.
    SettlingTime,
    /// The largest error at the end of a move.
    FinalError,
    /// The integral of time times absolute error.
    Itae,
    /// The largest overshoot.
    Overshoot,
    /// The largest torque rate.
    Jitter,
    /// The largest torque.
    PeakTorque,
    /// The mechanical work.
    Energy,
    /// The decay rate that is proved.
    CertifiedRate,
    /// The radius that is proved.
    CertifiedRadius,
    /// The delay that the sampled loops bear.
    DelayMargin,
}

/// How a figure is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// From runs on plants.
    Simulated,
    /// From a proof about the whole plant box.
    Proved,
    /// From linearised loops on a sample of configurations and plants.
    Linearised,
}

impl Goal {
    /// Every goal.
    pub const ALL: [Self; 11] = [
        Self::SettlingCost,
        Self::SettlingTime,
        Self::FinalError,
        Self::Itae,
        Self::Overshoot,
        Self::Jitter,
        Self::PeakTorque,
        Self::Energy,
        Self::CertifiedRate,
        Self::CertifiedRadius,
        Self::DelayMargin,
    ];

    /// Name, key as a limit and unit.
    const fn words(self) -> [&'static str; 3] {
        match self {
            Self::SettlingCost => ["settling-cost", "settling_cost_s", "s"],
            Self::SettlingTime => ["settling-time", "settling_time_s", "s"],
            Self::FinalError => ["final-error", "final_error_rad", "rad"],
            Self::Itae => ["itae", "itae_rad_s2", "rad s²"],
            Self::Overshoot => ["overshoot", "overshoot", "1"],
            Self::Jitter => ["jitter", "torque_rate_rms_n_m_per_s", "N m/s"],
            Self::PeakTorque => ["peak-torque", "peak_torque_n_m", "N m"],
            Self::Energy => ["energy", "energy_j", "J"],
            Self::CertifiedRate => ["certified-rate", "certified_rate_per_s", "/s"],
            Self::CertifiedRadius => ["certified-radius", "certified_radius_rad", "rad"],
            Self::DelayMargin => ["delay-margin", "delay_margin_s", "s"],
        }
    }

    /// The name as it is written in files and flags.
    pub const fn name(self) -> &'static str {
        self.words()[0]
    }

    /// The key under `[limits]`, with the unit in it.
    pub const fn key(self) -> &'static str {
        self.words()[1]
    }

    /// The unit.
    pub const fn unit(self) -> &'static str {
        self.words()[2]
    }

    /// The unit of the objective's cost: that of the figure, or of its inverse where higher is better.
    pub const fn cost_unit(self) -> &'static str {
        match self {
            Self::CertifiedRate => "s",
            Self::CertifiedRadius => "1/rad",
            Self::DelayMargin => "/s",
            _ => self.unit(),
        }
    }

    /// How its figure is found.
    pub const fn source(self) -> Source {
        match self {
            Self::CertifiedRate | Self::CertifiedRadius => Source::Proved,
            Self::DelayMargin => Source::Linearised,
            _ => Source::Simulated,
        }
    }

    /// Whether higher is better.
    pub const fn is_at_least(self) -> bool {
        matches!(self.source(), Source::Proved | Source::Linearised)
    }

    /// What a figure costs: itself, or its inverse where higher is better.
    pub fn cost(self, figure: f64) -> Finite {
        Finite::saturating(if self.is_at_least() { figure.recip() } else { figure })
    }

    /// The figure that has a cost.
    pub fn figure(self, cost: f64) -> f64 {
        if self.is_at_least() { cost.recip() } else { cost }
    }

    /// By which share a figure is beyond a bound; zero or less when it keeps it.
    pub fn excess(self, figure: f64, bound: f64) -> f64 {
        (if self.is_at_least() { bound / figure } else { figure / bound }) - 1.0
    }
}

impl core::fmt::Display for Limit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let name = self.goal.name().replace('-', " ");
        let side = if self.goal.is_at_least() { "at least" } else { "at most" };
        match self.bound {
            Bound::At(bound) if self.goal == Goal::Overshoot => write!(f, "{name} {side} {} %", short(100.0 * bound)),
            Bound::At(bound) => write!(f, "{name} {side} {} {}", short(bound), self.goal.unit()),
            Bound::Of(Reference::Start) => write!(f, "{name} {side} the start's"),
        }
    }
}

/// Four significant digits, without the zeros of a format.
fn short(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

impl core::fmt::Display for Goal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Where a limit lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Bound {
    /// At a number, in the goal's unit.
    At(f64),
    /// Where the gains are with which the search starts.
    Of(Reference),
}

/// Gains that others are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reference {
    /// Those that the search starts from.
    Start,
}

/// A goal that must be kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// The goal.
    pub goal: Goal,
    /// How far it may go.
    pub bound: Bound,
}

/// The level of the conditional value at risk when nothing else is said.
const CVAR: f64 = 0.9;

/// An objective and limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goals {
    /// What the search is after.
    pub objective: Goal,
    /// The level of the conditional value at risk, in `[0, 1)`: 0 is the mean over the plants, and towards 1 only the worst plant counts.
    pub cvar: f64,
    /// What it must keep.
    pub limits: Vec<Limit>,
}

impl Default for Goals {
    fn default() -> Self {
        Self { objective: Goal::default(), cvar: CVAR, limits: Vec::new() }
    }
}

/// Goals that make no sense.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GoalError {
    /// A level outside its range.
    #[error("cvar = {cvar}, expected a number of at least 0 and below 1")]
    Cvar {
        /// The level given.
        cvar: f64,
    },
    /// A limit that nothing keeps, or everything.
    #[error("{key} = {bound}, expected a positive finite number or \"start\"", key = goal.key())]
    Bound {
        /// The goal.
        goal: Goal,
        /// The number given.
        bound: f64,
    },
    /// A limit that would need the proof of the start.
    #[error(
        "{key} = \"start\": what is proved or linearised is not measured on the start; expected a positive finite number",
        key = goal.key()
    )]
    StartNotRun {
        /// The goal.
        goal: Goal,
    },
}

impl GoalError {
    /// The key of the file that the error speaks of, by its path from the top.
    pub(crate) fn key(&self) -> String {
        match self {
            Self::Cvar { .. } => "search.cvar".to_owned(),
            Self::Bound { goal, .. } | Self::StartNotRun { goal } => format!("limits.{}", goal.key()),
        }
    }
}

impl Goals {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`GoalError`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), GoalError> {
        if !(self.cvar >= 0.0 && self.cvar < 1.0) {
            return Err(GoalError::Cvar { cvar: self.cvar });
        }
        for Limit { goal, bound } in &self.limits {
            match bound {
                Bound::At(bound) if !(*bound > 0.0 && bound.is_finite()) => {
                    return Err(GoalError::Bound { goal: *goal, bound: *bound });
                }
                Bound::Of(Reference::Start) if goal.source() != Source::Simulated => {
                    return Err(GoalError::StartNotRun { goal: *goal });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// What two sets of gains are compared by on plants: no limits, and the settling cost in place of an objective that no run answers.
    #[must_use]
    pub fn for_comparison(&self) -> Self {
        let objective = match self.objective.source() {
            Source::Simulated => self.objective,
            Source::Proved | Source::Linearised => Goal::SettlingCost,
        };
        Self { objective, cvar: self.cvar, limits: Vec::new() }
    }

    /// The limits whose bounds are numbers, of figures that are found in that way.
    pub fn limits_from(&self, source: Source) -> impl Iterator<Item = (Goal, f64)> + '_ {
        let bound = |limit: &Limit| match limit.bound {
            Bound::At(bound) => Some((limit.goal, bound)),
            Bound::Of(Reference::Start) => None,
        };
        self.limits.iter().filter_map(bound).filter(move |(goal, _)| goal.source() == source)
    }

    /// The objective and the goals of the limits.
    pub fn all(&self) -> Vec<Goal> {
        let limits = self.limits.iter().map(|limit| limit.goal);
        core::iter::once(self.objective).chain(limits).collect()
    }

    /// Those whose figures are found in that way.
    pub fn from(&self, source: Source) -> Vec<Goal> {
        self.all().into_iter().filter(|goal| goal.source() == source).collect()
    }

    /// The same goals with bounds that are all numbers: what the start reaches, `figure`, where a limit says so.
    #[must_use]
    pub fn with_start(mut self, figure: impl Fn(Goal) -> f64) -> Self {
        for limit in &mut self.limits {
            if limit.bound == Bound::Of(Reference::Start) {
                limit.bound = Bound::At(figure(limit.goal));
            }
        }
        self
    }

    /// Whether a limit looks at the start.
    pub fn look_at_start(&self) -> bool {
        self.limits.iter().any(|limit| limit.bound == Bound::Of(Reference::Start))
    }
}

/// How far limits are gone beyond.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excess {
    sum: f64,
    largest: Option<(Goal, f64)>,
}

impl Excess {
    /// One more figure before its limit.
    pub fn add(&mut self, goal: Goal, figure: f64, bound: f64) {
        let by = goal.excess(figure, bound);
        // A figure that is no number keeps no limit.
        if by <= 0.0 {
            return;
        }
        let by = if by.is_nan() { f64::MAX } else { by };
        self.sum += by;
        if self.largest.is_none_or(|(_, before)| by > before) {
            self.largest = Some((goal, by));
        }
    }

    /// Whether any limit is gone beyond.
    pub const fn is_any(&self) -> bool {
        self.largest.is_some()
    }

    /// What that makes of a candidate that has been found good otherwise.
    pub fn judge(self, otherwise: Outcome) -> Outcome {
        let Some((limit, _)) = self.largest else { return otherwise };
        match otherwise {
            Outcome::Certified { .. } | Outcome::Simulated { .. } => {
                Outcome::Violates { excess: Finite::saturating(self.sum), limit }
            }
            Outcome::Violates { excess, limit: other } => {
                let sum = Finite::saturating(self.sum + excess.get());
                Outcome::Violates { excess: sum, limit: if self.sum >= excess.get() { limit } else { other } }
            }
            failed => failed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_goal_has_its_own_name_and_key() {
        for goal in Goal::ALL {
            assert_eq!(serde_json::to_value(goal).unwrap(), goal.name());
            let same = |other: &&Goal| other.name() == goal.name() || other.key() == goal.key();
            assert_eq!(Goal::ALL.iter().filter(same).count(), 1, "{goal}");
            assert!((goal.figure(goal.cost(0.25).get()) - 0.25).abs() < 1e-15);
        }
    }

    #[test]
    fn an_excess_is_a_share_of_the_limit_on_either_side() {
        assert!((Goal::Overshoot.excess(0.03, 0.02) - 0.5).abs() < 1e-12);
        assert!((Goal::CertifiedRadius.excess(0.4, 0.8) - 1.0).abs() < 1e-12);
        assert!(Goal::CertifiedRadius.excess(0.9, 0.8) < 0.0);
        let mut excess = Excess::default();
        let fine = Outcome::Simulated { cost: Finite::new(1.0).unwrap() };
        excess.add(Goal::Overshoot, 0.02, 0.02);
        assert!(!excess.is_any() && excess.judge(fine) == fine);
        excess.add(Goal::Overshoot, 0.03, 0.02);
        excess.add(Goal::CertifiedRadius, 0.4, 0.8);
        let expected = Outcome::Violates { excess: Finite::new(1.5).unwrap(), limit: Goal::CertifiedRadius };
        assert_eq!(excess.judge(fine), expected);
        let twice = Outcome::Violates { excess: Finite::new(3.0).unwrap(), limit: Goal::CertifiedRadius };
        assert_eq!(excess.judge(excess.judge(fine)), twice);
        excess.add(Goal::Jitter, f64::NAN, 1.0);
        assert!(excess.is_any());
    }

    #[test]
    fn goals_out_of_range_are_refused_with_their_key() {
        let key = |goals: Goals| goals.validate().unwrap_err().key();
        let limit = |goal, bound| Goals { limits: vec![Limit { goal, bound }], ..Goals::default() };
        assert_eq!(key(Goals { cvar: 1.0, ..Goals::default() }), "search.cvar");
        assert_eq!(key(Goals { cvar: f64::NAN, ..Goals::default() }), "search.cvar");
        assert_eq!(key(limit(Goal::Overshoot, Bound::At(0.0))), "limits.overshoot");
        assert_eq!(key(limit(Goal::DelayMargin, Bound::Of(Reference::Start))), "limits.delay_margin_s");
        assert!(limit(Goal::Jitter, Bound::Of(Reference::Start)).validate().is_ok());
    }

    #[test]
    fn limits_read_as_a_sentence_has_them() {
        let limit = |goal, bound| Limit { goal, bound }.to_string();
        assert_eq!(limit(Goal::Overshoot, Bound::At(0.02)), "overshoot at most 2 %");
        assert_eq!(limit(Goal::CertifiedRadius, Bound::At(0.8)), "certified radius at least 0.8 rad");
        assert_eq!(limit(Goal::Jitter, Bound::At(18.514_63)), "jitter at most 18.51 N m/s");
        assert_eq!(limit(Goal::Jitter, Bound::Of(Reference::Start)), "jitter at most the start's");
    }

    #[test]
    fn a_limit_of_the_start_becomes_a_number() {
        let limits = vec![Limit { goal: Goal::Jitter, bound: Bound::Of(Reference::Start) }];
        let goals = Goals { limits, ..Goals::default() };
        assert!(goals.look_at_start() && goals.limits_from(Source::Simulated).next().is_none());
        let goals = goals.with_start(|_| 18.5);
        assert_eq!(goals.limits_from(Source::Simulated).collect::<Vec<_>>(), [(Goal::Jitter, 18.5)]);
    }
}
