//! What became of a candidate, and which of two fates is better.
//!
//! ```text
//! Certified(cost) < Simulated(cost) < Stopped(cost) < Violates(excess) < Uncertified(cost) < Unstable(abscissa) < Diverged(time)
//! ```
//!
//! The order is total: within a rank a lower cost, a smaller abscissa or a *later* divergence is better, and every number is
//! [`Finite`], so that no comparison meets NaN. A failure is never a cost with a penalty added, since a penalty has a size that somebody must
//! choose and a good candidate can be beaten by it.
//!
//! A solver of argmin compares `f64`. [`Outcome::score`] embeds the order in the interval `[0, 7)`: rank `r` occupies `[r, r + 1)`,
//! and inside a rank the 64 bits of a finite number, read as an integer that increases with the number, are divided by 2^64. That
//! scale is piecewise logarithmic, one octave per 2^-12, so it separates costs by their ratio:
//! - it never reverses the order of two outcomes;
//! - it separates two outcomes of different rank, and two numbers whose ratio differs from 1 by more than 1e-11.
//!
//! Records keep the [`Outcome`]; the score exists only while a solver runs.

use core::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::goals::Goal;

/// A number that is neither NaN nor infinite, hence totally ordered.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Finite(f64);

/// A number that is not finite where only a finite one has a rank.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("got {value}, expected a finite number")]
pub struct NotFinite {
    /// The number given.
    pub value: f64,
}

impl Finite {
    /// The number `value`; minus zero becomes zero.
    ///
    /// # Errors
    /// [`NotFinite`] for NaN and the infinities.
    pub fn new(value: f64) -> Result<Self, NotFinite> {
        if value.is_finite() { Ok(Self(value + 0.0)) } else { Err(NotFinite { value }) }
    }

    /// The number `value`, where the worst of its kind is the largest: NaN and infinity become the largest finite number.
    pub fn saturating(value: f64) -> Self {
        if value == f64::NEG_INFINITY { Self(f64::MIN) } else { Self::new(value).unwrap_or(Self(f64::MAX)) }
    }

    /// The number.
    pub const fn get(self) -> f64 {
        self.0
    }

    /// An integer that increases with the number.
    const fn key(self) -> u64 {
        let bits = self.0.to_bits();
        if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
    }
}

impl Finite {
    /// The number with that key.
    fn from_key(key: u64) -> Option<Self> {
        let bits = if key >> 63 == 1 { key & !(1 << 63) } else { !key };
        Self::new(f64::from_bits(bits)).ok()
    }
}

impl TryFrom<f64> for Finite {
    type Error = NotFinite;
    fn try_from(value: f64) -> Result<Self, NotFinite> {
        Self::new(value)
    }
}

impl From<Finite> for f64 {
    fn from(number: Finite) -> Self {
        number.0
    }
}

impl PartialEq for Finite {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Finite {}

impl PartialOrd for Finite {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Finite {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

/// What became of a candidate; `a < b` reads "a is better than b", except that a stopped candidate was worse than its number, and by how much nobody knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "rank", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Outcome {
    /// A certificate holds (and it was simulated on every plant of the batch, when the objective or a limit is about runs).
    Certified {
        /// Cost, in the unit of the run's objective: s for the settling cost.
        cost: Finite,
    },
    /// Simulated on every plant of the batch; nobody has tried to certify it.
    Simulated {
        /// Cost, in the unit of the run's objective: s for the settling cost.
        cost: Finite,
    },
    /// Given up as soon as it was known to be no better than this: what it would have cost, or how it would have failed, could not change the search.
    Stopped {
        /// The batch costs more than this, or has none.
        cost_above: Finite,
    },
    /// Beyond a limit of [`Goals`](crate::goals::Goals).
    Violates {
        /// By how much: the sum over the limits of the share by which they are passed.
        excess: Finite,
        /// The limit that is passed the furthest.
        limit: Goal,
    },
    /// Finished the task, or stable in the sample, but the certificate was refused.
    Uncertified {
        /// Cost as before; when the objective is a certified figure, the time constant of the slowest sampled mode, s.
        cost: Finite,
    },
    /// Not simulated: a linearised loop of the sample grows.
    Unstable {
        /// The fastest growth found, 1/s.
        abscissa_per_s: Finite,
    },
    /// A simulated arm ran away.
    Diverged {
        /// When the first arm of the batch did, s.
        at_s: Finite,
    },
}

impl Outcome {
    /// The rank, 0 the best.
    const fn rank(self) -> u8 {
        match self {
            Self::Certified { .. } => 0,
            Self::Simulated { .. } => 1,
            Self::Stopped { .. } => 2,
            Self::Violates { .. } => 3,
            Self::Uncertified { .. } => 4,
            Self::Unstable { .. } => 5,
            Self::Diverged { .. } => 6,
        }
    }

    /// An integer that increases as outcomes of one rank get worse.
    const fn key(self) -> u64 {
        match self {
            Self::Certified { cost } | Self::Simulated { cost } | Self::Uncertified { cost } => cost.key(),
            Self::Stopped { cost_above } => cost_above.key(),
            Self::Violates { excess, .. } => excess.key(),
            Self::Unstable { abscissa_per_s } => abscissa_per_s.key(),
            Self::Diverged { at_s } => !at_s.key(),
        }
    }

    /// The place of the outcome on a line, in `[0, 7)`, lower is better: see the [module](self).
    pub fn score(self) -> f64 {
        f64::from(self.rank()) + self.key() as f64 * KEY_UNIT
    }

    /// The cost above which a simulated candidate scores at least `score`, to the resolution of scores; none when `score` is that of no simulated candidate.
    pub(crate) fn cost_at_score(score: f64) -> Option<Finite> {
        if !(1.0..2.0).contains(&score) {
            return None;
        }
        // Exact: a score below 2 has bits down to 2^-52.
        let key = ((score - 1.0) / KEY_UNIT) as u64;
        Finite::from_key(key)
    }

    /// The cost, for an outcome that has one.
    pub const fn cost(self) -> Option<f64> {
        match self {
            Self::Certified { cost } | Self::Simulated { cost } | Self::Uncertified { cost } => Some(cost.get()),
            Self::Stopped { .. } | Self::Violates { .. } | Self::Unstable { .. } | Self::Diverged { .. } => None,
        }
    }
}

/// 2^-64.
const KEY_UNIT: f64 = 1.0 / 18_446_744_073_709_551_616.0;

/// How far [`Outcome::score`] moves when a number of that rank changes by the small fraction `relative` (at least: the scale is linear within an
/// octave, and an octave spans 2^-12).
pub(crate) const fn score_of_ratio(relative: f64) -> f64 {
    relative / 4096.0
}

impl PartialOrd for Outcome {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Outcome {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank().cmp(&other.rank()).then(self.key().cmp(&other.key()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = Finite> {
        prop_oneof![
            any::<f64>().prop_filter_map("finite", |x| Finite::new(x).ok()),
            (-1e3..1e3).prop_filter_map("finite", |x: f64| Finite::new(x).ok()),
        ]
    }

    fn outcome() -> impl Strategy<Value = Outcome> {
        (0..7, number()).prop_map(|(rank, x)| match rank {
            0 => Outcome::Certified { cost: x },
            1 => Outcome::Simulated { cost: x },
            2 => Outcome::Stopped { cost_above: x },
            3 => Outcome::Violates { excess: x, limit: Goal::Overshoot },
            4 => Outcome::Uncertified { cost: x },
            5 => Outcome::Unstable { abscissa_per_s: x },
            _ => Outcome::Diverged { at_s: x },
        })
    }

    proptest! {
        #[test]
        fn the_order_of_numbers_is_the_order_of_reals(a in number(), b in number()) {
            prop_assert_eq!(Some(a.cmp(&b)), a.get().partial_cmp(&b.get()));
        }

        #[test]
        fn the_order_is_total(a in outcome(), b in outcome(), c in outcome()) {
            prop_assert_eq!(a.cmp(&b), b.cmp(&a).reverse());
            prop_assert_eq!(a.cmp(&b) == Ordering::Equal, a == b);
            if a <= b && b <= c {
                prop_assert!(a <= c);
            }
        }

        #[test]
        fn the_score_never_reverses_the_order(a in outcome(), b in outcome()) {
            prop_assert!((0.0..7.0).contains(&a.score()));
            if a < b {
                prop_assert!(a.score() <= b.score(), "{a:?} {b:?}");
            }
            if a.rank() < b.rank() {
                prop_assert!(a.score() < b.score());
            }
        }

        #[test]
        fn what_costs_more_than_the_cost_at_a_score_scores_no_less(a in number(), b in number()) {
            let [first, second] = [a, b].map(|cost| Outcome::Simulated { cost }.score());
            let at = Outcome::cost_at_score(first).unwrap();
            prop_assert!(second >= first || b <= at);
            let stopped = Outcome::Stopped { cost_above: at };
            prop_assert!(stopped.score() >= first);
        }

        #[test]
        fn the_score_separates_close_costs(x in 1e-12..1e12_f64, ratio in 1e-11..1.0_f64) {
            let near = Finite::new(x).unwrap();
            let far = Finite::new(x * (1.0 + ratio)).unwrap();
            let pairs = [
                [Outcome::Simulated { cost: near }, Outcome::Simulated { cost: far }],
                [Outcome::Unstable { abscissa_per_s: near }, Outcome::Unstable { abscissa_per_s: far }],
                [Outcome::Diverged { at_s: far }, Outcome::Diverged { at_s: near }],
            ];
            for [better, worse] in pairs {
                prop_assert!(better.score() < worse.score(), "{better:?} {worse:?}");
            }
        }
    }

    #[test]
    fn a_later_divergence_is_better_and_any_divergence_is_the_worst() {
        let at = |at_s| Outcome::Diverged { at_s: Finite::new(at_s).unwrap() };
        assert!(at(3.0) < at(1.0));
        assert!(Outcome::Unstable { abscissa_per_s: Finite::saturating(f64::NAN) } < at(30.0));
        assert!(
            Outcome::Uncertified { cost: Finite::saturating(f64::INFINITY) }
                < Outcome::Unstable { abscissa_per_s: Finite::saturating(1e-9) }
        );
    }

    #[test]
    fn what_is_not_finite_has_no_rank() {
        assert!(Finite::new(f64::NAN).is_err());
        assert_eq!(Finite::new(-0.0).unwrap(), Finite::new(0.0).unwrap());
        assert!(serde_json::from_str::<Finite>("null").is_err());
        let text = serde_json::to_string(&Outcome::Diverged { at_s: Finite::new(2.5).unwrap() }).unwrap();
        assert_eq!(text, r#"{"rank":"diverged","at_s":2.5}"#);
        assert_eq!(
            serde_json::from_str::<Outcome>(&text).unwrap(),
            Outcome::Diverged { at_s: Finite::new(2.5).unwrap() }
        );
    }
}
