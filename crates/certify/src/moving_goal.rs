//! The fastest goal that a region allows, and the region that allows the fastest goal.
//!
//! A region of radius R that decays at rate alpha allows a goal speed of `alpha R`. A larger rate shrinks the ball, so the product has a
//! maximum between; a line search over the rate finds it. For a list of goals that stand for a while the best rate is another one:
//! a short move is nearly a jump, which only the radius limits.

use certune_verify::{
    Claim, ClaimKind, Document, GoalList, ListedGoal, MovingGoalClaim, Norm, Number, Reason, moving_goal_inequalities,
    region_norm,
};
use num_rational::BigRational;
use num_traits::ToPrimitive;

use crate::digits::{above, down, readable};
use crate::joint_region::{JointRegionOptions, joint_region};
use crate::not_proved;
use crate::problem::Problem;
use crate::region::{RegionOptions, region};
use crate::sampled_region::{SampledRegionOptions, sampled_region};

/// Goals that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalListValues {
    /// Where the arm rests at the start, rad.
    pub start_rad: Vec<f64>,
    /// The goals, rad, and how long each stands, s.
    pub goals: Vec<(Vec<f64>, f64)>,
}

/// How the fastest goal is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingGoalOptions {
    /// Rates between which the region is searched, 1/s.
    pub rates_per_s: [f64; 2],
    /// Points of the coarse grid over the rate, at least 1.
    pub coarse: usize,
    /// Evaluations after that.
    pub refinements: usize,
    /// The region of the sampled loop, when that is the one to rest on; its rate is not used.
    pub sampled_region: Option<SampledRegionOptions>,
    /// The region where all joints have the same gains; its rate is not used.
    pub region: RegionOptions,
    /// The region where they differ; its rate is not used.
    pub joint_region: JointRegionOptions,
    /// The time for which jumps are certified to be apart, s.
    pub dwell_s: f64,
    /// Goals to cover.
    pub list: Option<GoalListValues>,
}

impl Default for MovingGoalOptions {
    /// Rates from 0.02 to 5 per s, 8 points and 6 refinements, jumps 6 s apart, no list.
    fn default() -> Self {
        Self {
            rates_per_s: [0.02, 5.0],
            coarse: 8,
            refinements: 6,
            sampled_region: None,
            region: RegionOptions::default(),
            joint_region: JointRegionOptions::default(),
            dwell_s: 6.0,
            list: None,
        }
    }
}

/// A region and the claim `moving-goal` that rests on it, to stand in this order after the entries that `document` has; or why not.
///
/// The region is the one whose rate allows the fastest goal: along the list when there is one, for ever otherwise.
pub fn moving_goal(problem: &Problem, document: &Document, options: &MovingGoalOptions) -> Vec<Claim> {
    let refused = |reason| vec![not_proved(ClaimKind::MovingGoal, reason, None)];
    if !document.family.gravity_compensation {
        return refused(Reason::FamilyNotCovered);
    }
    let index = document.claims.len() + 1;
    let Ok(gains) = document.gains.aic() else { return refused(Reason::OtherController) };
    let shared = gains.shared_by_all().is_ok();
    let with_region = |rate_per_s: f64| {
        let claim = match &options.sampled_region {
            Some(sampled) => sampled_region(problem, &SampledRegionOptions { rate_per_s, ..*sampled }),
            None if shared => region(problem, &RegionOptions { rate_per_s, ..options.region.clone() }),
            None => joint_region(problem, &JointRegionOptions { rate_per_s, ..options.joint_region.clone() }),
        };
        let mut extended = document.clone();
        extended.claims.push(claim.into());
        extended
    };
    let speed = |rate: f64| {
        let ramp = region_norm(&with_region(rate), index).ok().and_then(|norm| Ramp::new(&norm));
        ramp.map_or(0.0, |ramp| ramp.speed(options.list.as_ref()))
    };
    let Some(rate) = best_rate(speed, options) else {
        // The reason is the region's own, at the least rate.
        return refused(match with_region(options.rates_per_s[0]).claims.pop().map(|entry| entry.claim) {
            Some(Claim::NotProved(claim)) => claim.reason,
            _ => Reason::OutOfRange,
        });
    };
    let mut extended = with_region(rate);
    match (moving_goal_on(&extended, index, options), extended.claims.pop()) {
        (Some(claim), Some(entry)) => vec![entry.claim, Claim::MovingGoal(Box::new(claim))],
        _ => refused(Reason::CandidateFailed),
    }
}

/// The claim `moving-goal` that rests on the region which the entry `index` of `document`, counted from 1, proves. `None` when it has no
/// norm, when the list does not fit the arm, or when no figures pass the exact check.
pub fn moving_goal_on(document: &Document, index: usize, options: &MovingGoalOptions) -> Option<MovingGoalClaim> {
    let ramp = Ramp::new(&region_norm(document, index).ok()?)?;
    if !options.list.as_ref().is_none_or(|list| ramp.fits(list)) {
        return None;
    }
    let position = document.claims.len();
    let holds = |claim: &MovingGoalClaim| {
        moving_goal_inequalities(document, position, claim)
            .is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some()))
    };
    // Rounded to four digits the figures may lie on the boundary: back off until the exact check passes.
    [0.0, 1e-4, 1e-3, 1e-2].into_iter().find_map(|shrink| {
        let mut claim = candidate(index, &ramp, options, shrink)?;
        // The distance is found by asking the checker.
        let (mut too_small, mut enough) = (0.0, ramp.radius());
        for _ in 0..MOST_DOUBLINGS {
            claim.distance_rad = above(enough)?;
            if holds(&claim) {
                break;
            }
            (too_small, enough) = (enough, 2.0 * enough);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (too_small + enough);
            let tried = MovingGoalClaim { distance_rad: above(middle)?, ..claim.clone() };
            if holds(&tried) {
                (claim, enough) = (tried, middle);
            } else {
                too_small = middle;
            }
        }
        holds(&claim).then_some(claim)
    })
}

/// The distance that a region keeps is at most this many doublings of its radius, and is found to a share of `2^-10`.
const MOST_DOUBLINGS: usize = 8;
const HALVINGS: usize = 10;

/// A coarse geometric grid, then halvings of its spacing around the best point. `None` when no rate gives a speed.
fn best_rate(speed: impl Fn(f64) -> f64, options: &MovingGoalOptions) -> Option<f64> {
    let [first, last] = options.rates_per_s.map(f64::ln);
    let mut spacing = (last - first) / options.coarse.max(1) as f64;
    let mut best = (0.0, 0.0);
    let consider = |at: f64, best: &mut (f64, f64)| {
        let rate = readable(at.exp());
        let value = speed(rate);
        if value > best.0 {
            *best = (value, rate);
        }
    };
    for k in 0..options.coarse.max(1) {
        consider(first + spacing * (k as f64 + 0.5), &mut best);
    }
    if best.0 <= 0.0 {
        return None;
    }
    for _ in 0..options.refinements.div_ceil(2) {
        spacing *= 0.5;
        let centre = best.1.ln();
        consider(centre - spacing, &mut best);
        consider(centre + spacing, &mut best);
    }
    Some(best.1)
}

/// The figures of a region that a goal meets, in floating point.
struct Ramp {
    rate: f64,
    /// Weight of each joint's step, 1/rad^2.
    weights: Vec<f64>,
    period_s: f64,
}

impl Ramp {
    fn new(norm: &Norm) -> Option<Self> {
        let float = |x: &BigRational| x.to_f64().unwrap_or(f64::NAN);
        let weights: Vec<f64> = norm.shift_weights.iter().map(float).collect();
        let (rate, period_s) = (float(&norm.rate), norm.period.as_ref().map_or(0.0, float));
        let sensible = rate > 0.0 && !weights.is_empty() && weights.iter().all(|weight| *weight > 0.0);
        sensible.then_some(Self { rate, weights, period_s })
    }

    /// The largest jump from rest in the joint that bears least, rad.
    fn radius(&self) -> f64 {
        self.weights.iter().copied().fold(0.0, f64::max).sqrt().recip()
    }

    fn fits(&self, list: &GoalListValues) -> bool {
        let joints = self.weights.len();
        let fits = |goal: &[f64], duration: f64| goal.len() == joints && duration > 0.0;
        list.start_rad.len() == joints
            && !list.goals.is_empty()
            && list.goals.iter().all(|(goal, duration)| fits(goal, *duration))
    }

    /// The fastest goal along the list, or for ever.
    fn speed(&self, list: Option<&GoalListValues>) -> f64 {
        let for_ever = self.rate * self.radius();
        let Some(list) = list.filter(|list| self.fits(list)) else { return for_ever };
        let (mut covered, mut not) = (for_ever, 2.0 * for_ever);
        while self.covers(list, not) && not < FASTEST_RAD_PER_S {
            (covered, not) = (not, 2.0 * not);
        }
        for _ in 0..40 {
            let middle = 0.5 * (covered + not);
            if self.covers(list, middle) {
                covered = middle;
            } else {
                not = middle;
            }
        }
        covered
    }

    fn covers(&self, list: &GoalListValues, speed: f64) -> bool {
        let mut norm: f64 = 0.0;
        let mut from = &list.start_rad;
        for (goal, duration) in &list.goals {
            let time = distance(from, goal) / speed;
            if time > 0.0 {
                let weighted = goal.iter().zip(from).zip(&self.weights).map(|((a, b), s)| s * (a - b).powi(2));
                let reach = weighted.sum::<f64>().sqrt() / (self.rate * time);
                norm = reach + (norm - reach) * (-self.rate * time / (1.0 - self.rate * self.period_s)).exp();
            }
            if !(norm < 1.0) {
                return false;
            }
            norm *= (-self.rate * (duration - time - 2.0 * self.period_s).max(0.0)).exp();
            from = goal;
        }
        true
    }

    /// To the next hundredth of a second, past the rounding of the length; a whole number of samples where there are any.
    fn arrival_s(&self, from: &[f64], to: &[f64], speed: f64) -> f64 {
        let time = distance(from, to) / speed * (1.0 + 1e-6) + 2.0 * self.period_s;
        (time * 100.0).ceil() / 100.0
    }
}

/// Faster than any joint: a list that is covered at this speed is covered as jumps.
const FASTEST_RAD_PER_S: f64 = 100.0;

fn distance(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt()
}

/// The claim without its distance.
fn candidate(region: usize, ramp: &Ramp, options: &MovingGoalOptions, shrink: f64) -> Option<MovingGoalClaim> {
    let smaller = 1.0 - shrink;
    let numbers = |values: &[f64]| values.iter().map(|&x| Number::decimal(x)).collect::<Option<Vec<_>>>();
    let list = match &options.list {
        None => None,
        Some(list) => {
            let speed = down(ramp.speed(Some(list)) * smaller)?;
            let mut from = &list.start_rad;
            let mut goals = Vec::with_capacity(list.goals.len());
            for (goal, duration) in &list.goals {
                let arrival = ramp.arrival_s(from, goal, speed.to_f64());
                goals.push(ListedGoal {
                    goal_rad: numbers(goal)?,
                    duration_s: Number::decimal(*duration)?,
                    arrival_s: Number::decimal(arrival)?,
                });
                from = goal;
            }
            Some(GoalList { start_rad: numbers(&list.start_rad)?, speed_rad_per_s: speed, goals })
        }
    };
    let kept = (-ramp.rate * options.dwell_s).exp();
    Some(MovingGoalClaim {
        region,
        goal_speed_rad_per_s: down(ramp.rate * ramp.radius() * smaller)?,
        jump_rad: down(ramp.radius() * (1.0 - kept) * smaller)?,
        dwell_s: Number::decimal(options.dwell_s)?,
        distance_rad: Number::zero(),
        list,
    })
}
