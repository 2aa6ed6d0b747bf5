//! Claim `moving-goal`: the state stays in a proved region while the goal moves.
//!
//! On the region `{V <= 1}` of an earlier entry `N = sqrt V` is a norm of the state, a goal moved by `delta` moves the state by at most
//! `|delta|_s`, the root of `sum_i s_i delta_i^2`, and N shrinks as `exp(-alpha t)`, or by `kappa = 1 - alpha h` each sample:
//!
//! ```text
//! D+ N <= -alpha N + |goal'|_s            continuous
//! N_k  <= kappa N_{k-1} + |delta_k|_s     sampled: N after the goal has moved by delta_k, before the controller's step
//! ```
//!
//! | inequality | says |
//! |---|---|
//! | speed | a goal of speed v for ever: `v^2 max s < alpha^2` |
//! | jumps | jumps of J, T apart, for ever: `J^2 max s < (1 - exp(-alpha T))^2` |
//! | goal k | a list of goals at speed v: with `a = v \|delta\|_s / (alpha \|delta\|)`, `x = exp(-alpha \|delta\| / v)`, N at arrival `a (1 - x) + x N < 1` |
//! | arrival k | `v` times the time stated is at least `\|delta\|` |
//! | distance | `V <= 1` implies `\|e\| <= E` |
//!
//! The derivation is in `proofs/claims/moving-goal.md`.

use std::fmt::Write as _;

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use serde::{Deserialize, Serialize};

use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::normed::{Norm, region_before};
use crate::number::{Number, ratio};
use crate::outward::{decay, sqrt_up, up};
use crate::quantity::{require, require_length, require_plain, require_positive};

/// The state stays in the region of an earlier entry while the goal moves.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovingGoalClaim {
    /// The entry that proves the region, counted from 1.
    pub region: usize,
    /// A goal no faster than this (2-norm over the joints) never takes the state out of the region, rad/s.
    pub goal_speed_rad_per_s: Number,
    /// Nor do jumps no longer than this (2-norm over the joints), rad,
    pub jump_rad: Number,
    /// that leave each other at least this long, s.
    pub dwell_s: Number,
    /// While the state is in the region the arm is no further than this from the goal (2-norm over the joints), rad.
    pub distance_rad: Number,
    /// A list of goals, one after the other.
    pub list: Option<GoalList>,
}

/// Goals that follow each other, each approached in a straight line at one speed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalList {
    /// Where the arm rests and the goal stands at the start, rad.
    pub start_rad: Vec<Number>,
    /// Speed of the goal on its way (2-norm over the joints), rad/s.
    pub speed_rad_per_s: Number,
    /// The goals.
    pub goals: Vec<ListedGoal>,
}

/// One goal of a list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedGoal {
    /// The goal, rad.
    pub goal_rad: Vec<Number>,
    /// How long it was meant to stand, s.
    pub duration_s: Number,
    /// When the moving goal has reached it, after it was set, s; it stands until the later of the two.
    pub arrival_s: Number,
}

/// Longest list that is checked.
const MOST_GOALS: usize = 64;

impl Provable for MovingGoalClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::MovingGoal
    }

    fn sentence(&self, document: &Document) -> String {
        let period = region_before(document, document.claims.len(), self.region)
            .and_then(|region| region.norm(document))
            .ok()
            .and_then(|norm| norm.period);
        let (instants, changes) = match period {
            Some(_) => (" at every sample", ", which changes at sample instants alone, before the controller's step"),
            None => ("", ""),
        };
        let step = |speed: &Number| {
            let most = period.as_ref().map(|period| Number::exact(speed.value() * period));
            most.map(|most| format!(" and by no more than {most} rad at a sample")).unwrap_or_default()
        };
        let mut text = format!(
            "started at rest at the goal, beliefs at the measurement and zero controller torque, the state stays in the set V <= 1 of claim {}, \
             so that every limit stated there is kept, and the arm{instants} within {} rad of the goal{changes}, as long as the goal moves at no \
             more than {} rad/s{} (2-norm over the joints, along any path); or, with the goal standing still between jumps, as long as it jumps by no \
             more than {} rad at a time, at least {} s apart",
            self.region,
            self.distance_rad,
            self.goal_speed_rad_per_s,
            step(&self.goal_speed_rad_per_s),
            self.jump_rad,
            self.dwell_s
        );
        if let ConfigurationSet::Box { .. } = document.constants.over {
            text.push_str(
                ", the goal being all the while as far inside the angles the constants hold for as that claim asks",
            );
        }
        if let Some(list) = &self.list {
            let late = list.goals.iter().filter(|goal| goal.arrival_s.value() > goal.duration_s.value()).count();
            let _ = write!(
                text,
                "; or, started at rest at {} rad, as long as it goes through the {} goals of the list, each approached in a straight line at {} rad/s{} from the moment it is set \
                 and left no sooner than planned and no sooner than reached:",
                vector(&list.start_rad),
                list.goals.len(),
                list.speed_rad_per_s,
                step(&list.speed_rad_per_s)
            );
            for goal in &list.goals {
                let _ = write!(
                    text,
                    " {} rad, planned for {} s, reached within {} s;",
                    vector(&goal.goal_rad),
                    goal.duration_s,
                    goal.arrival_s
                );
            }
            let _ = match late {
                0 => write!(text, " every goal is reached within its time"),
                _ => write!(text, " {late} of them need longer than planned"),
            };
            if let Ok(covered) = self.covered_jumps(document) {
                let _ = write!(text, "; as jumps, the first {covered} of these goals are covered");
            }
        }
        text
    }

    fn scope(&self, document: &Document) -> String {
        let region = self.region.checked_sub(1).and_then(|index| document.claims.get(index));
        // Only a region has a norm: the proof refuses anything else, another moving goal included.
        region
            .map(|entry| &entry.claim)
            .filter(|claim| claim.kind() != ClaimKind::MovingGoal)
            .map_or_else(String::new, |claim| format!("as claim {}: {}", self.region, claim.provable().scope(document)))
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |name, value: &Number, unit| Figure { name, value: value.clone(), unit };
        let mut all = vec![figure("goal speed", &self.goal_speed_rad_per_s, "rad/s")];
        if let Some(list) = &self.list {
            all.push(figure("goal speed along the list", &list.speed_rad_per_s, "rad/s"));
        }
        all.push(figure("jump", &self.jump_rad, "rad"));
        all.push(figure("dwell", &self.dwell_s, "s"));
        all.push(figure("distance", &self.distance_rad, "rad"));
        all
    }

    fn prove(&self, document: &Document, position: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(moving_goal_inequalities(document, position, self)?)
    }
}

fn vector(numbers: &[Number]) -> String {
    format!("[{}]", numbers.iter().map(Number::to_string).collect::<Vec<_>>().join(", "))
}

/// The inequalities of a moving-goal claim that would stand at `position` (counted from 0) in `document`, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn moving_goal_inequalities(
    document: &Document,
    position: usize,
    claim: &MovingGoalClaim,
) -> Result<Vec<Inequality>, Flaw> {
    let region = region_before(document, position, claim.region)?;
    let motion = Motion::new(region.norm(document)?)?;
    require_positive("goal_speed_rad_per_s", &claim.goal_speed_rad_per_s)?;
    require_positive("jump_rad", &claim.jump_rad)?;
    require_positive("dwell_s", &claim.dwell_s)?;
    require_positive("distance_rad", &claim.distance_rad)?;
    motion.require_samples("dwell_s", &claim.dwell_s)?;
    let square = |x: &BigRational| x * x;
    let speed = square(&motion.rate) - square(claim.goal_speed_rad_per_s.value()) * &motion.largest_weight;
    let [_, left] = decay(&(&motion.rate * claim.dwell_s.value()));
    let jumps = square(&(BigRational::one() - left)) - square(claim.jump_rad.value()) * &motion.largest_weight;
    let mut all = vec![positive("speed".to_owned(), speed), positive("jumps".to_owned(), jumps)];
    if let Some(list) = &claim.list {
        motion.require_inside(document, list)?;
        all.extend(motion.along(document.arm.joints, list)?);
    }
    all.extend(region.error_within(document, claim.distance_rad.value())?);
    Ok(all)
}

/// `margin > 0` as an inequality of order 1.
fn positive(name: String, margin: BigRational) -> Inequality {
    Inequality::decide(name, &vec![vec![margin]])
}

/// How the norm answers to a goal.
struct Motion {
    weights: Vec<BigRational>,
    largest_weight: BigRational,
    rate: BigRational,
    /// `kappa^(t/h) >= exp(-fastest t)`: the rate itself in continuous time, `rate / (1 - rate h)` when sampled.
    fastest: BigRational,
    /// The sampling step, 0 in continuous time.
    period: BigRational,
    /// How close each joint stays to its goal.
    kept: Option<Vec<Number>>,
}

/// What the norm is at most, on the way to a goal and when it is reached.
struct Leg {
    arrival: BigRational,
    peak: BigRational,
}

impl Motion {
    fn new(norm: Norm) -> Result<Self, Flaw> {
        let Norm { shift_weights: weights, rate, period, kept } = norm;
        let zero = BigRational::zero();
        let period = period.unwrap_or_else(BigRational::zero);
        let left = BigRational::one() - &rate * &period;
        if !rate.is_positive() || !left.is_positive() {
            return Err(Flaw::NotCovered { what: "a region without a positive rate below one per sample" });
        }
        let largest_weight = weights.iter().max().cloned().unwrap_or(zero);
        if !weights.iter().all(Signed::is_positive) {
            return Err(Flaw::NotCovered { what: "a region whose norm does not see the goal" });
        }
        let fastest = &rate / left;
        Ok(Self { weights, largest_weight, rate, fastest, period, kept })
    }

    /// Constants over a box of angles hold along the way when every goal is inside by as much as its joint may stray: the box is convex.
    fn require_inside(&self, document: &Document, list: &GoalList) -> Result<(), Flaw> {
        let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over else { return Ok(()) };
        let Some(kept) = &self.kept else {
            return Err(Flaw::NotCovered { what: "a motion that may leave the angles the constants hold for" });
        };
        for goal in core::iter::once(&list.start_rad).chain(list.goals.iter().map(|goal| &goal.goal_rad)) {
            for (((angle, kept), lower), upper) in goal.iter().zip(kept).zip(lower_rad).zip(upper_rad) {
                let (low, high) = (lower.value() + kept.value(), upper.value() - kept.value());
                let inside = low <= *angle.value() && *angle.value() <= high;
                require("goal_rad", angle, inside, "an angle inside those the constants hold for")?;
            }
        }
        Ok(())
    }

    /// Between jumps of a sampled loop lies a whole number of samples.
    fn require_samples(&self, quantity: &'static str, time: &Number) -> Result<(), Flaw> {
        let whole = self.period.is_zero() || (time.value() / &self.period).is_integer();
        require(quantity, time, whole, "a whole number of sampling steps")
    }

    /// The square of `|delta|_s` and the square of `|delta|`.
    fn lengths(&self, from: &[Number], to: &[Number]) -> [BigRational; 2] {
        let mut sums = [BigRational::zero(), BigRational::zero()];
        for ((a, b), weight) in from.iter().zip(to).zip(&self.weights) {
            let step = b.value() - a.value();
            let square = &step * &step;
            sums[0] += weight * &square;
            sums[1] += square;
        }
        sums
    }

    /// The norm along `delta` at speed `v`, from `before`: `a (1 - x) + x before` at arrival.
    fn leg(&self, before: &BigRational, [weighted, plain]: &[BigRational; 2], speed: &BigRational) -> Leg {
        if plain.is_zero() {
            return Leg { arrival: before.clone(), peak: before.clone() };
        }
        let reach = speed * sqrt_up(&(weighted / plain)) / &self.rate;
        let time = sqrt_up(plain) / speed;
        let rising = reach >= *before;
        // Between `before` and `a`, so that x counts from below on the way up and from above on the way down.
        let share = if rising {
            decay(&(&self.fastest * &time))[0].clone()
        } else {
            // The root is rounded up: the time is at least this.
            let least = sqrt_up(&plain.recip()).recip() / speed;
            decay(&(&self.rate * least))[1].clone()
        };
        let arrival = up(&(&reach + (before - &reach) * share));
        let peak = if rising { arrival.clone() } else { before.clone() };
        Leg { arrival, peak }
    }

    fn along(&self, joints: usize, list: &GoalList) -> Result<Vec<Inequality>, Flaw> {
        check_list(self, joints, list)?;
        let speed = list.speed_rad_per_s.value();
        let mut all = Vec::with_capacity(2 * list.goals.len());
        let mut norm = BigRational::zero();
        let mut from = &list.start_rad;
        for (index, goal) in list.goals.iter().enumerate() {
            let lengths = self.lengths(from, &goal.goal_rad);
            let leg = self.leg(&norm, &lengths, speed);
            all.push(positive(format!("goal {}", index + 1), BigRational::one() - &leg.peak));
            // A limiter's rounding, and the samples in which it begins and ends.
            let length = sqrt_up(&lengths[1]) * (BigRational::one() + ratio(1, 100_000_000));
            let arrival = goal.arrival_s.value();
            let reached = (arrival - ratio(2, 1) * &self.period) * speed - length;
            // A goal that does not move is there at once; a margin of 0 would not do for the others.
            if !lengths[1].is_zero() {
                all.push(positive(format!("arrival {}", index + 1), reached));
            }
            let rest = goal.duration_s.value() - arrival;
            norm = leg.arrival;
            if rest.is_positive() {
                norm = up(&(norm * &decay(&(&self.rate * rest))[1]));
            }
            from = &goal.goal_rad;
        }
        Ok(all)
    }
}

fn check_list(motion: &Motion, joints: usize, list: &GoalList) -> Result<(), Flaw> {
    require_positive("speed_rad_per_s", &list.speed_rad_per_s)?;
    require_length("start_rad", list.start_rad.len(), joints)?;
    if list.goals.is_empty() || list.goals.len() > MOST_GOALS {
        return Err(Flaw::quantity("goals", &list.goals.len().to_string(), "between 1 and 64 goals"));
    }
    for goal in &list.goals {
        require_length("goal_rad", goal.goal_rad.len(), joints)?;
        require_positive("duration_s", &goal.duration_s)?;
        crate::quantity::require_at_least_zero("arrival_s", &goal.arrival_s)?;
        motion.require_samples("duration_s", &goal.duration_s)?;
        motion.require_samples("arrival_s", &goal.arrival_s)?;
    }
    for angle in list.start_rad.iter().chain(list.goals.iter().flat_map(|goal| &goal.goal_rad)) {
        require_plain("goal_rad", angle)?;
    }
    Ok(())
}

impl MovingGoalClaim {
    /// How many goals of the list, from the first, keep the state in the region when the goal jumps to each at once.
    ///
    /// # Errors
    /// [`Flaw`] when there is no list, or the region has no norm.
    pub fn covered_jumps(&self, document: &Document) -> Result<usize, Flaw> {
        let list = self.list.as_ref().ok_or_else(|| Flaw::quantity("list", "absent", "a list of goals"))?;
        let region = region_before(document, document.claims.len(), self.region)?;
        let motion = Motion::new(region.norm(document)?)?;
        check_list(&motion, document.arm.joints, list)?;
        let mut norm = BigRational::zero();
        let mut from = &list.start_rad;
        for (index, goal) in list.goals.iter().enumerate() {
            norm += sqrt_up(&motion.lengths(from, &goal.goal_rad)[0]);
            if norm > BigRational::one() {
                return Ok(index);
            }
            norm = up(&(norm * &decay(&(&motion.rate * goal.duration_s.value()))[1]));
            from = &goal.goal_rad;
        }
        Ok(list.goals.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_traits::ToPrimitive;
    use proptest::prelude::*;

    proptest! {
        /// The bound of a leg against the recursion it bounds: full steps from the first sample on, in a norm of two weights.
        #[test]
        fn a_leg_bounds_the_recursion_and_little_more(
            rate in 1_i64..300, speed in 1_i64..200, steps in (-200_i64..200, -200_i64..200), before in 0_i64..100, sampled: bool,
        ) {
            prop_assume!(steps != (0, 0));
            let h = 1e-3;
            let period = if sampled { Some(ratio(1, 1000)) } else { None };
            let norm = Norm { shift_weights: vec![ratio(2, 1), ratio(1, 3)], rate: ratio(rate, 100), period, kept: None };
            let motion = Motion::new(norm).unwrap();
            let number = |x: i64| Number::decimal(x as f64 / 100.0).unwrap();
            let lengths = motion.lengths(&[number(0), number(0)], &[number(steps.0), number(steps.1)]);
            let leg = motion.leg(&ratio(before, 100), &lengths, &ratio(speed, 100));
            let [weighted, plain] = lengths.map(|x| x.to_f64().unwrap().sqrt());
            let (rate, speed) = (rate as f64 / 100.0, speed as f64 / 100.0);
            let samples = (plain / (speed * h)).floor() as usize;
            prop_assume!(samples > 20);
            let kept = if sampled { 1.0 - rate * h } else { (-rate * h).exp() };
            // In continuous time a sample's way adds at most its length, and at least that much decayed over the sample.
            let added = speed * h * weighted / plain * if sampled { 1.0 } else { kept };
            let (mut norm, mut peak) = (before as f64 / 100.0, before as f64 / 100.0);
            for _ in 0..samples {
                norm = kept * norm + added;
                peak = peak.max(norm);
            }
            let [arrival_bound, peak_bound] = [&leg.arrival, &leg.peak].map(|x| x.to_f64().unwrap());
            prop_assert!(peak <= peak_bound * (1.0 + 1e-9), "{peak} {peak_bound}");
            // The way left of the last, cut step changes the norm by a few steps at most.
            prop_assert!(norm <= arrival_bound + 2.0 * rate * h * norm.max(1.0), "{norm} {arrival_bound}");
            prop_assert!(arrival_bound <= norm + 0.02 * norm.max(1.0) + 3.0 * added, "{arrival_bound} {norm}");
        }
    }
}
