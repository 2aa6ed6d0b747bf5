//! The least bound on the error under bounded noise and pushes.
//!
//! For fixed rate, bound `rho` on `|y|` and level `sum t` the search is a semidefinite program in `p, b, S, theta`, the multiplier of friction and the
//! shares, which makes the excursion smallest on `{V <= 1}`; the three numbers are found by a pattern search. The matrices are the
//! checker's own, assembled in floating point and scaled by a congruence (`dq` and friction by `1/sqrt m`, the torque by its own size,
//! disturbances by their bounds).

use certune_verify::{
    Claim, ClaimKind, DisturbanceClaim, DisturbanceWitness, DisturbedArm, Document, Energy, Number, Point, Reason,
    STATES, State, TRIANGLE, disturbance_inequalities, triangle,
};
use nalgebra::DMatrix;
use num_traits::ToPrimitive;

use crate::digits::{above, readable};
use crate::lmi::{Affine, Program};
use crate::not_proved;
use crate::problem::Problem;
use crate::region::{STRICTNESS, scaled, strict};

/// What disturbs the loop, and where it starts. All norms are 2-norms over the joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisturbanceOptions {
    /// Bound on the error of the measured positions, rad.
    pub position_noise_rad: f64,
    /// Bound on the error of the measured velocities, rad/s.
    pub velocity_noise_rad_per_s: f64,
    /// Bound on a torque of any course in time, N m.
    pub torque_n_m: f64,
    /// Bound on a constant torque from the start on, N m.
    pub push_n_m: f64,
    /// Starts at rest within this distance of the goal, rad.
    pub radius_rad: f64,
}

impl Default for DisturbanceOptions {
    /// The noise of a good joint encoder on seven joints, 1e-4 rad and 2e-3 rad/s each, at rest at the goal.
    fn default() -> Self {
        Self {
            position_noise_rad: 2.7e-4,
            velocity_noise_rad_per_s: 5.3e-3,
            torque_n_m: 0.0,
            push_n_m: 0.0,
            radius_rad: 0.0,
        }
    }
}

const P: usize = 0;
const B: usize = 1;
const S: usize = B + STATES;
const THETA: usize = S + TRIANGLE;
const FRICTION: usize = THETA + 1;
const SHARES: usize = FRICTION + 1;
const START: usize = SHARES + 3;
const CLOSENESS: usize = START + 4;
const VARIABLES: usize = CLOSENESS + 1;

/// Where rate (1/s), rho and level are searched, with the points of the coarse grid.
const RATES: ([f64; 2], usize) = ([0.02, 2.0], 4);
const RHO: ([f64; 2], usize) = ([0.005, 10.0], 6);
const LEVELS: ([f64; 2], usize) = ([0.003, 1.0], 4);
/// The rate where nothing disturbs: any will do.
const SLOW_PER_S: f64 = 0.01;
/// A guess at the size of the set where the start does not tell, rad.
const FIRST_LENGTH_RAD: f64 = 0.03;
/// Halvings of the grid's spacing around the best point.
const REFINEMENTS: usize = 3;

/// The claim `disturbance` with the least bounds found, or "not proved".
pub fn disturbance(problem: &Problem, options: &DisturbanceOptions) -> Claim {
    let refused = |reason| not_proved(ClaimKind::Disturbance, reason, None);
    let document = problem.document();
    let Ok(gains) = document.gains.aic() else { return refused(Reason::OtherController) };
    if gains.shared_by_all().is_err() {
        return refused(Reason::UnequalGains);
    }
    let Some(mut search) = Search::new(document, options) else {
        let covered = document.family.gravity_compensation;
        return refused(if covered { Reason::OutOfRange } else { Reason::FamilyNotCovered });
    };
    let Some(best) = search.best() else { return refused(Reason::Infeasible) };
    // The last solution tells the size of the set: in units of it the solver keeps more digits.
    if let Some(x) = search.solve(best, STRICTNESS[0]) {
        search.length = search.excursion_rad(&x);
    }
    for strictness in STRICTNESS {
        let Some(x) = search.solve(best, strictness) else { continue };
        for shrink in [1e-4, 1e-3, 1e-2] {
            let Some(claim) = search.candidate(&x, best, shrink) else { continue };
            let holds = disturbance_inequalities(document, &claim);
            if holds.is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some())) {
                return Claim::Disturbance(Box::new(claim));
            }
        }
    }
    refused(Reason::CandidateFailed)
}

/// Rate, rho, level.
type Place = [f64; 3];

struct Search {
    arm: DisturbedArm<f64>,
    torque_unit: f64,
    /// The size of the set, rad: coordinates of the state are in units of it.
    length: f64,
    /// The claim without figures and witness.
    blank: DisturbanceClaim,
}

impl Search {
    fn new(document: &Document, options: &DisturbanceOptions) -> Option<Self> {
        let zero = Number::zero;
        let blank = DisturbanceClaim {
            position_noise_rad: Number::decimal(options.position_noise_rad)?,
            velocity_noise_rad_per_s: Number::decimal(options.velocity_noise_rad_per_s)?,
            torque_n_m: Number::decimal(options.torque_n_m)?,
            push_n_m: Number::decimal(options.push_n_m)?,
            radius_rad: Number::decimal(options.radius_rad)?,
            rate_per_s: zero(),
            excursion_rad: zero(),
            ultimate_rad: zero(),
            witness: DisturbanceWitness {
                p: zero(),
                b: core::array::from_fn(|_| zero()),
                s: vec![zero(); TRIANGLE],
                rho: zero(),
                theta: zero(),
                friction_multiplier: zero(),
                disturbance_shares: core::array::from_fn(|_| zero()),
                start_shares: core::array::from_fn(|_| zero()),
            },
        };
        let arm = DisturbedArm::new(document, &blank).ok()?.map(|x| x.to_f64().unwrap_or(f64::NAN));
        let controller = &arm.region.plant.controller;
        // The controller's largest weight on the torque sets its size.
        let torque_unit = 5.0 * controller.a[4][0].abs().max(controller.b[4].abs()).sqrt();
        let acts = arm.disturbances.iter().flatten().chain(arm.start.iter().flatten()).count() > 0;
        let sensible = arm.start.iter().chain(&arm.disturbances).flatten().all(|x| *x > 0.0);
        (acts && sensible && torque_unit > 0.0 && torque_unit.is_finite()).then_some(Self {
            arm,
            torque_unit,
            length: if options.radius_rad > 0.0 { options.radius_rad } else { FIRST_LENGTH_RAD },
            blank,
        })
    }

    fn disturbed(&self) -> bool {
        self.arm.disturbances.iter().any(Option::is_some)
    }

    /// Whether the start is a set of its own size, so that the level of the disturbances is free below it.
    fn starts_away(&self) -> bool {
        self.arm.start[0].is_some() || self.arm.start[3].is_some()
    }

    /// The torque's share of a scaled coordinate.
    fn scale(&self, k: usize) -> f64 {
        if k == STATES - 1 { self.torque_unit.recip() } else { 1.0 }
    }

    fn point(&self, x: &[f64], rho: f64) -> Point<f64> {
        let unit = self.length.powi(-2);
        let mut s = [0.0; TRIANGLE];
        for (i, j) in (0..STATES).flat_map(|i| (i..STATES).map(move |j| (i, j))) {
            s[triangle(i, j)] = x[S + triangle(i, j)] * self.scale(i) * self.scale(j) * unit;
        }
        let theta = self.theta(x);
        Point {
            energy: Energy { p: x[P] * unit, b: core::array::from_fn(|k| x[B + k] * self.scale(k) * unit), s },
            rho_squared: rho * rho,
            absolute: rho * theta,
            relative: rho * (1.0 - theta),
            interval_multiplier: x[FRICTION] * unit,
            gravity_multiplier: 0.0,
            start_multiplier: 0.0,
        }
    }

    fn theta(&self, x: &[f64]) -> f64 {
        if self.arm.region.plant.coriolis_relative.is_some() { x[THETA].clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Scales of (dq, z).
    fn state_scales(&self, m: f64) -> Vec<f64> {
        let scales = core::iter::once(m.sqrt().recip()).chain((0..STATES).map(|k| self.scale(k).recip()));
        scales.map(|scale| scale * self.length).collect()
    }

    fn containment(&self, x: &[f64], m: f64, rho: f64) -> DMatrix<f64> {
        let mut scales = self.state_scales(m);
        scales.push(self.length);
        scaled(&self.arm.region.containment(&self.point(x, rho), &m), &scales)
    }

    fn excursion(&self, x: &[f64], m: f64) -> DMatrix<f64> {
        let closeness = x[CLOSENESS] * self.length.powi(-2);
        scaled(&self.arm.region.within(&self.point(x, 1.0), &m, State::Position, &closeness), &self.state_scales(m))
    }

    fn decay(&self, x: &[f64], m: f64, [rate, rho, _]: Place) -> DMatrix<f64> {
        let mut scales = self.state_scales(m);
        if self.arm.region.has_friction {
            let [least, largest] = self.arm.region.friction;
            scales.push((largest - least) / m.sqrt() * self.length);
        }
        scales.extend(self.arm.disturbances.iter().flatten());
        let shares = core::array::from_fn(|k| x[SHARES + k]);
        scaled(&self.arm.decay(&self.point(x, rho), &shares, &rate, &m), &scales)
    }

    fn start(&self, x: &[f64]) -> DMatrix<f64> {
        let shares = [0, 1, 2, 3].map(|k| &x[START + k]);
        let scales: Vec<f64> = self.arm.start.iter().flatten().copied().collect();
        scaled(&self.arm.start(&self.point(x, 1.0), shares), &scales)
    }

    /// The point with the least excursion.
    fn solve(&self, place: Place, strictness: f64) -> Option<Vec<f64>> {
        let [_, rho, level] = place;
        let at_most = |most: f64, x: &[f64], first: usize, count: usize| {
            DMatrix::from_element(1, 1, most - x[first..first + count].iter().sum::<f64>())
        };
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for m in self.arm.region.inertia {
            blocks.push(Box::new(move |x| strict(self.containment(x, m, rho), strictness)));
            blocks.push(Box::new(move |x| strict(self.decay(x, m, place), strictness)));
            blocks.push(Box::new(move |x| strict(self.excursion(x, m), strictness)));
        }
        blocks.push(Box::new(move |x| at_most(1.0, x, THETA, 1)));
        // A little below, so that rounding keeps the sums.
        blocks.push(Box::new(move |x| at_most(level * (1.0 - 1e-9), x, SHARES, 3)));
        blocks.push(Box::new(move |x| at_most(1.0 - 1e-9, x, START, 4)));
        if self.arm.start.iter().any(Option::is_some) {
            blocks.push(Box::new(move |x| strict(self.start(x), strictness)));
        }
        let nonnegative = [P, THETA, FRICTION].into_iter().chain(SHARES..VARIABLES).collect();
        // A multiplier that appears nowhere would leave the program without a unique answer: pin it at zero.
        let mut unused = Vec::new();
        unused.extend((!self.arm.region.has_friction).then_some(FRICTION));
        unused.extend(self.arm.region.plant.coriolis_relative.is_none().then_some(THETA));
        unused.extend((0..3).filter(|&k| self.arm.disturbances[k].is_none()).map(|k| SHARES + k));
        unused.extend((0..4).filter(|&k| self.arm.start[k].is_none()).map(|k| START + k));
        for k in unused {
            blocks.push(Box::new(move |x| DMatrix::from_element(1, 1, -x[k])));
        }
        let mut cost = vec![0.0; VARIABLES];
        cost[CLOSENESS] = -1.0;
        let x = Program { cost, nonnegative, blocks }.solve().ok()?.x;
        (x[CLOSENESS] > 0.0).then_some(x)
    }

    fn excursion_rad(&self, x: &[f64]) -> f64 {
        self.length / x[CLOSENESS].sqrt()
    }

    /// What is to be small: the error in the end where something disturbs for ever, else the excursion.
    fn value(&self, place: Place) -> f64 {
        let level = if self.disturbed() { place[2] } else { 1.0 };
        self.solve(place, STRICTNESS[0]).map_or(f64::INFINITY, |x| self.excursion_rad(&x) * level.sqrt())
    }

    /// The best of a coarse grid, then of its neighbours at half the spacing, and so on.
    fn best(&self) -> Option<Place> {
        let axis = |searched: bool, (ends, points): ([f64; 2], usize), fixed: f64| {
            let [first, last] = ends.map(f64::ln);
            let spacing = (last - first) / points as f64;
            let grid: Vec<f64> = (0..points).map(|k| (first + spacing * (k as f64 + 0.5)).exp()).collect();
            if searched { (grid, spacing) } else { (vec![fixed], 0.0) }
        };
        let axes = [
            axis(self.disturbed(), RATES, SLOW_PER_S),
            axis(true, RHO, 1.0),
            axis(self.disturbed() && self.starts_away(), LEVELS, 1.0),
        ];
        let mut best = (f64::INFINITY, [0.0; 3]);
        let consider = |place: Place, best: &mut (f64, Place)| {
            let place = [readable(place[0]), place[1], place[2].min(1.0)];
            let value = self.value(place);
            if value < best.0 {
                *best = (value, place);
            }
        };
        for &rate in &axes[0].0 {
            for &rho in &axes[1].0 {
                for &level in &axes[2].0 {
                    consider([rate, rho, level], &mut best);
                }
            }
        }
        if !best.0.is_finite() {
            return None;
        }
        for halving in 1..=REFINEMENTS {
            for (k, (_, spacing)) in axes.iter().enumerate() {
                let factor = (spacing * 0.5_f64.powi(halving as i32)).exp();
                if factor > 1.0 {
                    let centre = best.1;
                    for scale in [factor, factor.recip()] {
                        let mut place = centre;
                        place[k] *= scale;
                        consider(place, &mut best);
                    }
                }
            }
        }
        Some(best.1)
    }

    /// The solver's point as exact numbers, with bounds a little larger than the solver's.
    fn candidate(&self, x: &[f64], [rate, rho, _]: Place, shrink: f64) -> Option<DisturbanceClaim> {
        let point = self.point(x, rho);
        let dyadics = |values: &[f64]| values.iter().map(|&x| Number::dyadic(x)).collect::<Option<Vec<_>>>();
        let share = |used: bool, value: f64| if used { Number::dyadic(value.max(0.0)) } else { Some(Number::zero()) };
        let disturbance_shares =
            (0..3).map(|k| share(self.arm.disturbances[k].is_some(), x[SHARES + k])).collect::<Option<Vec<_>>>()?;
        let start_shares =
            (0..4).map(|k| share(self.arm.start[k].is_some(), x[START + k])).collect::<Option<Vec<_>>>()?;
        let excursion = above((1.0 + shrink) * self.excursion_rad(x))?;
        let level: f64 = disturbance_shares.iter().map(Number::to_f64).sum();
        let ultimate = match above(excursion.to_f64() * level.sqrt() * (1.0 + 1e-9)) {
            None => Number::zero(),
            // Rounding up must not take it beyond the excursion, which is below it by the shares' own margin.
            Some(rounded) if rounded.value() > excursion.value() => excursion.clone(),
            Some(rounded) => rounded,
        };
        Some(DisturbanceClaim {
            rate_per_s: Number::decimal(rate)?,
            excursion_rad: excursion,
            ultimate_rad: ultimate,
            witness: DisturbanceWitness {
                p: Number::dyadic(point.energy.p)?,
                b: dyadics(&point.energy.b)?.try_into().ok()?,
                s: dyadics(&point.energy.s)?,
                rho: Number::dyadic(rho)?,
                theta: Number::dyadic(self.theta(x))?,
                friction_multiplier: Number::dyadic(point.interval_multiplier.max(0.0))?,
                disturbance_shares: disturbance_shares.try_into().ok()?,
                start_shares: start_shares.try_into().ok()?,
            },
            ..self.blank.clone()
        })
    }
}
