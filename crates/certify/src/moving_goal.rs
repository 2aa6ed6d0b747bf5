//! The fastest goal that a region allows, and the region that allows the fastest goal.
//!
//! A region of radius R that decays at rate alpha allows a goal speed of `alpha R`. A larger rate shrinks the ball, so the product has a
//! maximum between; a line search over the rate finds it. For a list of goals that stand for a while the best rate is another one:
//! a short move is nearly a jump, which only the radius limits.

use certune_verify::{
    Claim, ClaimKind, Document, GoalList, ListedGoal, MovingGoalClaim, Number, Reason, RegionClaim,
    moving_goal_inequalities,
};

use crate::not_proved;
use crate::problem::Problem;
use crate::region::{RegionOptions, region};

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
    /// How each region is searched; its rate is not used.
    pub region: RegionOptions,
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
            region: RegionOptions::default(),
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
    let lists_fit = |list: &GoalListValues| {
        let joints = document.arm.joints;
        list.start_rad.len() == joints
            && !list.goals.is_empty()
            && list.goals.iter().all(|(goal, duration)| goal.len() == joints && *duration > 0.0)
    };
    if !options.list.as_ref().is_none_or(lists_fit) || !(options.dwell_s > 0.0) {
        return refused(Reason::OutOfRange);
    }
    let at_rate = |rate: f64| match region(problem, &RegionOptions { rate_per_s: rate, ..options.region.clone() }) {
        Claim::Region(claim) => Ok(claim),
        other => Err(other),
    };
    let speed = |rate: f64| at_rate(rate).map_or(0.0, |claim| Ramp::of(&claim).speed(options.list.as_ref()));
    let Some(rate) = best_rate(speed, options) else {
        // The reason is the region's own, at the least rate.
        let reason = match at_rate(options.rates_per_s[0]) {
            Err(Claim::NotProved(claim)) => claim.reason,
            _ => Reason::Infeasible,
        };
        return refused(reason);
    };
    let Ok(region) = at_rate(rate) else { return refused(Reason::CandidateFailed) };
    let ramp = Ramp::of(&region);
    let mut with_region = document.clone();
    with_region.claims.push(Claim::Region(region.clone()).into());
    let position = with_region.claims.len();
    // Rounded to four digits the figures may lie on the boundary: back off until the exact check passes.
    for shrink in [0.0, 1e-4, 1e-3, 1e-2] {
        let Some(claim) = candidate(&with_region, &ramp, options, shrink) else { continue };
        let holds = moving_goal_inequalities(&with_region, position, &claim);
        if holds.is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some())) {
            return vec![Claim::Region(region), Claim::MovingGoal(Box::new(claim))];
        }
    }
    refused(Reason::CandidateFailed)
}

/// A rate of three digits, so that it can be read.
fn readable(rate: f64) -> f64 {
    format!("{rate:.2e}").parse().unwrap_or(rate)
}

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
    /// The largest jump from rest, rad.
    radius: f64,
}

impl Ramp {
    fn of(claim: &RegionClaim) -> Self {
        let s: Vec<f64> = claim.witness.s.iter().map(Number::to_f64).collect();
        let weight = match s.as_slice() {
            [s_00, s_01, _, _, _, s_11, ..] => s_00 + 2.0 * s_01 + s_11,
            _ => f64::NAN,
        };
        Self { rate: claim.rate_per_s.to_f64(), radius: weight.sqrt().recip() }
    }

    /// The fastest goal along the list, or for ever.
    fn speed(&self, list: Option<&GoalListValues>) -> f64 {
        let for_ever = self.rate * self.radius;
        let Some(list) = list else { return for_ever };
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
            let length = distance(from, goal);
            let reach = speed / (self.rate * self.radius);
            let kept = (-self.rate * length / speed).exp();
            norm = reach + (norm - reach) * kept;
            if !(norm < 1.0) {
                return false;
            }
            norm *= (-self.rate * (duration - length / speed).max(0.0)).exp();
            from = goal;
        }
        true
    }
}

/// Faster than any joint: a list that is covered at this speed is covered as jumps.
const FASTEST_RAD_PER_S: f64 = 100.0;

fn distance(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt()
}

/// Four digits, rounded down.
fn down(x: f64) -> Option<Number> {
    digits(x, f64::floor)
}

/// Four digits, rounded up.
fn above(x: f64) -> Option<Number> {
    digits(x, f64::ceil)
}

fn digits(x: f64, round: fn(f64) -> f64) -> Option<Number> {
    if !(x > 0.0 && x.is_finite()) {
        return None;
    }
    let decade = x.log10().floor() as i32 - 3;
    let text = format!("{:.0}e{decade}", round(x / 10_f64.powi(decade)));
    Number::decimal(text.parse().ok()?)
}

fn candidate(document: &Document, ramp: &Ramp, options: &MovingGoalOptions, shrink: f64) -> Option<MovingGoalClaim> {
    let smaller = 1.0 - shrink;
    let numbers = |values: &[f64]| values.iter().map(|&x| Number::decimal(x)).collect::<Option<Vec<_>>>();
    let list = match &options.list {
        None => None,
        Some(list) => {
            let speed = down(ramp.speed(Some(list)) * smaller)?;
            let mut from = &list.start_rad;
            let mut goals = Vec::with_capacity(list.goals.len());
            for (goal, duration) in &list.goals {
                // To the next hundredth of a second, and past the rounding of the length.
                let arrival = (distance(from, goal) / speed.to_f64() * (1.0 + 1e-6) * 100.0).ceil() / 100.0;
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
    let region = document.claims.last().map(|entry| &entry.claim)?;
    let Claim::Region(claim) = region else { return None };
    Some(MovingGoalClaim {
        region: document.claims.len(),
        goal_speed_rad_per_s: down(ramp.rate * ramp.radius * smaller)?,
        jump_rad: down(ramp.radius * (1.0 - (-ramp.rate * options.dwell_s).exp()) * smaller)?,
        dwell_s: Number::decimal(options.dwell_s)?,
        distance_rad: above(largest_error(document, claim)? / smaller)?,
        list,
    })
}

/// The largest `|e|` where `V <= 1`: the root of the first entry of the inverse of `P(m)`, at the worse end.
fn largest_error(document: &Document, claim: &RegionClaim) -> Option<f64> {
    let witness = &claim.witness;
    let bounds = &document.constants.bounds;
    let mut worst: f64 = 0.0;
    for m in [&bounds.m_lo_kg_m2, &bounds.m_hi_kg_m2] {
        let m = m.to_f64();
        // dq scaled by 1/sqrt m; the rest is left as it is.
        let mut form = nalgebra::DMatrix::zeros(6, 6);
        form[(0, 0)] = witness.p.to_f64();
        for (k, b) in witness.b.iter().enumerate() {
            form[(0, 1 + k)] = m.sqrt() * b.to_f64();
            form[(1 + k, 0)] = form[(0, 1 + k)];
        }
        let places = (0..5).flat_map(|i| (i..5).map(move |j| (i, j)));
        for ((i, j), s) in places.zip(&witness.s) {
            form[(1 + i, 1 + j)] = s.to_f64();
            form[(1 + j, 1 + i)] = s.to_f64();
        }
        worst = worst.max(form.try_inverse()?[(1, 1)]);
    }
    Some(worst.sqrt() * (1.0 + 1e-9))
}
