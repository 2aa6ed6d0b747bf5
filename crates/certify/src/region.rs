//! The largest ball of starts for which the nonlinear loop is certified.
//!
//! Notation and derivation as in `certune_verify`'s `region` and `proofs/claims/region.md`. The search is a semidefinite program in
//! `p, b, S`, three multipliers, `rho^2` and the two shares of `rho` that minimises `V` at the start. It would be convex but for the square:
//! the shares must make up `rho`. As `rho <= rho_0/2 + rho^2/(2 rho_0)` for every `rho_0`, asking them for the right-hand side is enough, and
//! linear; solving again with the `rho` found as the next `rho_0` improves the radius every time. The first `rho_0` come from a coarse grid.
//! The matrices are the checker's, over floating point, in scaled coordinates (`dq` by `1/sqrt m`, `u~` by the torque's own size), without
//! which the solver loses digits.

use certune_verify::{
    Claim, ClaimKind, ConfigurationSet, Document, Energy, Form, Number, Point, Reason, RegionClaim, RegionProblem,
    RegionWitness, STATES, State, TRIANGLE, region_inequalities, triangle,
};
use nalgebra::DMatrix;
use num_traits::ToPrimitive;

use crate::lmi::{Affine, Program, SolveError};
use crate::problem::Problem;

/// How a region is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionOptions {
    /// The decay rate that the region must have, 1/s; a larger one shrinks the ball.
    pub rate_per_s: f64,
    /// Bound on the controller's torque (2-norm over the joints), N m; none: no limit.
    pub controller_torque_n_m: Option<f64>,
    /// Motor limits to respect, one per joint, N m. Gravity's share comes off first, and what the weakest joint has left bounds the
    /// controller's torque.
    pub motor_limits_n_m: Option<Vec<f64>>,
    /// Distance from the goal that the position must keep, rad. Constants over a box of angles need one: without it, a quarter of the
    /// narrowest joint's width.
    pub distance_rad: Option<f64>,
    /// Points of the coarse grid of `rho_0`, at least 1.
    pub coarse: usize,
    /// Most solutions after that, each from the `rho` of the one before.
    pub refinements: usize,
}

impl Default for RegionOptions {
    /// A rate of 0.001 per s, no limits, 6 points and at most 8 refinements.
    fn default() -> Self {
        Self {
            rate_per_s: 0.001,
            controller_torque_n_m: None,
            motor_limits_n_m: None,
            distance_rad: None,
            coarse: 6,
            refinements: 8,
        }
    }
}

/// Variables of the program: p, b, S, rho^2 and its root's two shares, the three multipliers, and V at the start.
const P: usize = 0;
const B: usize = 1;
const S: usize = B + STATES;
const RHO_SQUARED: usize = S + TRIANGLE;
const ABSOLUTE: usize = RHO_SQUARED + 1;
const RELATIVE: usize = ABSOLUTE + 1;
const FRICTION: usize = RELATIVE + 1;
const GRAVITY: usize = FRICTION + 1;
const START: usize = GRAVITY + 1;
const OBJECTIVE: usize = START + 1;
const VARIABLES: usize = OBJECTIVE + 1;

/// What the claim bounds beside the start.
#[derive(Clone, Debug, Default)]
struct Limits {
    controller_torque_n_m: Option<Number>,
    motor_limits_n_m: Option<Vec<Number>>,
    distance_rad: Option<Number>,
}

/// A number in a statement, of four significant digits, rounded down.
pub(crate) fn down(x: f64) -> Option<Number> {
    if !(x.is_finite() && x > 0.0) {
        return None;
    }
    let decade = x.log10().floor() as i32 - 3;
    let unit = 10_f64.powi(decade.abs());
    let digits = usize::try_from(-decade).unwrap_or(0);
    let floor = if decade < 0 { (x * unit).floor() / unit } else { (x / unit).floor() * unit };
    Number::decimal(format!("{floor:.digits$}").parse().ok()?)
}

/// What gravity leaves of each motor limit, N m. `Err` when the constants say nothing about gravity, or it leaves nothing.
pub(crate) fn left_by_gravity(document: &Document, limits: &[f64]) -> Result<Vec<f64>, Reason> {
    let gravity = document.constants.bounds.gravity_torque_n_m.as_ref().ok_or(Reason::ConstantMissing)?;
    let left: Vec<f64> = limits.iter().zip(gravity).map(|(limit, gravity)| limit - gravity.to_f64()).collect();
    if left.len() == document.arm.joints && left.iter().all(|x| *x > 0.0) { Ok(left) } else { Err(Reason::OutOfRange) }
}

/// Widths of the angles that the constants hold for; none when they hold for all.
pub(crate) fn widths(document: &Document) -> Option<Vec<f64>> {
    match &document.constants.over {
        ConfigurationSet::AllAngles => None,
        ConfigurationSet::Box { lower_rad, upper_rad } => {
            Some(lower_rad.iter().zip(upper_rad).map(|(lower, upper)| upper.to_f64() - lower.to_f64()).collect())
        }
    }
}

impl Limits {
    fn new(document: &Document, options: &RegionOptions) -> Result<Self, Reason> {
        let number = |x: f64| Number::decimal(x).ok_or(Reason::OutOfRange);
        let narrowest = widths(document).map(|all| all.into_iter().fold(f64::INFINITY, f64::min) / 4.0);
        let mut torque = options.controller_torque_n_m.map(number).transpose()?;
        if let Some(limits) = &options.motor_limits_n_m {
            let left = left_by_gravity(document, limits)?.into_iter().fold(f64::INFINITY, f64::min);
            if torque.as_ref().is_none_or(|most| most.to_f64() > left) {
                torque = Some(down(left).ok_or(Reason::OutOfRange)?);
            }
        }
        let distance = match (options.distance_rad, narrowest) {
            (Some(distance), _) => Some(number(distance)?),
            (None, Some(distance)) => Some(down(distance).ok_or(Reason::OutOfRange)?),
            (None, None) => None,
        };
        Ok(Self {
            controller_torque_n_m: torque,
            motor_limits_n_m: options
                .motor_limits_n_m
                .as_ref()
                .map(|limits| limits.iter().map(|&limit| number(limit)).collect())
                .transpose()?,
            distance_rad: distance,
        })
    }
}

/// The matrix of a form with each coordinate in its own unit.
pub(crate) fn scaled(form: &Form<f64>, units: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(units.len(), units.len(), |i, j| form.0[i][j] * units[i] * units[j])
}

/// Less `strictness` times the identity.
pub(crate) fn strict(matrix: DMatrix<f64>, strictness: f64) -> DMatrix<f64> {
    let order = matrix.nrows();
    matrix - DMatrix::identity(order, order) * strictness
}

/// The program's matrices in floating point.
struct Search {
    problem: RegionProblem<f64>,
    /// N m per unit of the scaled last state.
    torque_unit: f64,
    limits: Limits,
}

impl Search {
    fn new(document: &Document, limits: Limits) -> Option<Self> {
        let problem = RegionProblem::new(document).ok()?.map(|x| x.to_f64().unwrap_or(f64::NAN));
        let torque_unit = 5.0 * document.gains.aic().ok()?.kappa_a.first()?.to_f64().sqrt();
        let controller = &problem.plant.controller;
        let finite = controller.a.iter().flatten().chain(&controller.b).chain([&torque_unit]).all(|x| x.is_finite());
        finite.then_some(Self { problem, torque_unit, limits })
    }

    /// The unit of each state of z.
    fn unit(&self, state: usize) -> f64 {
        if state == STATES - 1 { self.torque_unit } else { 1.0 }
    }

    /// The program's point in the checker's units.
    fn point(&self, x: &[f64]) -> Point<f64> {
        let mut s = [0.0; TRIANGLE];
        for i in 0..STATES {
            for j in i..STATES {
                s[triangle(i, j)] = x[S + triangle(i, j)] / (self.unit(i) * self.unit(j));
            }
        }
        Point {
            energy: Energy { p: x[P], b: std::array::from_fn(|k| x[B + k] / self.unit(k)), s },
            rho_squared: x[RHO_SQUARED],
            absolute: x[ABSOLUTE],
            relative: x[RELATIVE],
            interval_multiplier: x[FRICTION],
            gravity_multiplier: x[GRAVITY],
            start_multiplier: x[START] / self.stiffness_unit().powi(2),
        }
    }

    fn stiffness_unit(&self) -> f64 {
        if self.problem.plant.has_gravity { self.problem.plant.stiffness } else { 1.0 }
    }

    /// Units of (dq, z).
    fn units(&self, m: f64) -> Vec<f64> {
        let mut units = vec![m.sqrt().recip()];
        units.extend((0..STATES).map(|k| self.unit(k)));
        units
    }

    fn containment(&self, x: &[f64], m: f64) -> DMatrix<f64> {
        let mut units = self.units(m);
        units.push(1.0);
        scaled(&self.problem.containment(&self.point(x), &m), &units)
    }

    fn decay(&self, x: &[f64], m: f64, rate: f64) -> DMatrix<f64> {
        let problem = &self.problem;
        let mut units = self.units(m);
        if problem.has_friction {
            units.push((problem.friction[1] - problem.friction[0]) / m.sqrt());
        }
        if problem.plant.has_gravity {
            units.push(problem.plant.stiffness);
        }
        scaled(&problem.decay(&self.point(x), &rate, &m), &units)
    }

    fn within(&self, x: &[f64], m: f64, state: State, inverse_square: f64) -> DMatrix<f64> {
        scaled(&self.problem.within(&self.point(x), &m, state, &inverse_square), &self.units(m))
    }

    /// V at the start is at most `objective |e0|^2`.
    fn start(&self, x: &[f64]) -> DMatrix<f64> {
        let form = self.problem.plant.start(&self.point(x), &x[OBJECTIVE]);
        let units = [1.0, self.stiffness_unit()];
        scaled(&form, &units[..form.0.len()])
    }

    /// The largest radius whose `rho` is bounded by its tangent at `rho_0`.
    fn solve(&self, rho_0: f64, rate: f64, strictness: f64) -> Result<Vec<f64>, SolveError> {
        let mut cost = vec![0.0; VARIABLES];
        cost[OBJECTIVE] = 1.0;
        let mut blocks: Vec<Affine<'_>> = vec![Box::new(|x| self.start(x))];
        for m in self.problem.inertia {
            blocks.push(Box::new(move |x| strict(self.containment(x, m), strictness)));
            blocks.push(Box::new(move |x| strict(self.decay(x, m, rate), strictness)));
            let bounds =
                [(State::Torque, &self.limits.controller_torque_n_m), (State::Position, &self.limits.distance_rad)];
            for (state, most) in bounds {
                if let Some(most) = most {
                    let inverse_square = most.to_f64().powi(-2);
                    blocks.push(Box::new(move |x| strict(self.within(x, m, state, inverse_square), strictness)));
                }
            }
        }
        blocks.push(Box::new(move |x| scalar(shares(x) - tangent(x[RHO_SQUARED], rho_0))));
        blocks.extend(self.pinned());
        Program { cost, nonnegative: nonnegative(), blocks }.solve().map(|solution| solution.x)
    }

    /// Without the relative bound its share is zero; a multiplier that appears nowhere would leave the program without a unique answer.
    fn pinned(&self) -> Vec<Affine<'static>> {
        let Self { problem, .. } = self;
        let unused = [
            problem.plant.coriolis_relative.is_none().then_some(RELATIVE),
            (!problem.has_friction).then_some(FRICTION),
            (!problem.plant.has_gravity).then_some(GRAVITY),
            (!problem.plant.has_gravity).then_some(START),
        ];
        unused.into_iter().flatten().map(|k| -> Affine<'static> { Box::new(move |x| scalar(-x[k])) }).collect()
    }
}

fn nonnegative() -> Vec<usize> {
    vec![P, RHO_SQUARED, ABSOLUTE, RELATIVE, FRICTION, GRAVITY, START]
}

fn shares(x: &[f64]) -> f64 {
    x[ABSOLUTE] + x[RELATIVE]
}

/// A bound of `rho`, linear in its square and sharp at `rho_0`.
pub(crate) fn tangent(rho_squared: f64, rho_0: f64) -> f64 {
    0.5 * (rho_0 + rho_squared / rho_0)
}

/// A matrix of order 1.
pub(crate) fn scalar(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

/// The claim `region` with the largest radius found, or "not proved".
pub fn region(problem: &Problem, options: &RegionOptions) -> Claim {
    let document = problem.document();
    let Ok(gains) = document.gains.aic() else {
        return not_proved(Reason::OtherController, None);
    };
    if gains.shared_by_all().is_err() {
        return not_proved(Reason::UnequalGains, None);
    }
    let limits = match Limits::new(document, options) {
        Ok(limits) => limits,
        Err(reason) => return not_proved(reason, None),
    };
    let Some(search) = Search::new(document, limits) else {
        return not_proved(Reason::OutOfRange, None);
    };
    let rate = options.rate_per_s;
    let solution = |rho_0: f64| {
        let x = search.solve(rho_0, rate, STRICTNESS[0]).ok().filter(|x| x[OBJECTIVE] > 0.0 && x[RHO_SQUARED] > 0.0)?;
        Some((x[OBJECTIVE], x[RHO_SQUARED].sqrt()))
    };
    let Some(rho_0) = best_rho(solution, options) else {
        return not_proved(Reason::Infeasible, search.distance(rate));
    };
    // The optimum lies on the boundary of the inequalities: back off until the exact check passes.
    for strictness in STRICTNESS {
        let Ok(x) = search.solve(rho_0, rate, strictness) else { continue };
        for shrink in [1e-4, 1e-3, 1e-2] {
            let Some(claim) = candidate(&search, &x, rate, shrink) else { continue };
            if region_inequalities(document, &claim).is_ok_and(|all| all.iter().all(|i| i.smallest_pivot.is_some())) {
                return Claim::Region(Box::new(claim));
            }
        }
    }
    not_proved(Reason::CandidateFailed, search.distance(rate))
}

/// Margins by which the inequalities are tightened, in turn.
pub(crate) const STRICTNESS: [f64; 4] = [1e-7, 1e-6, 1e-5, 1e-4];
/// Where the bound on |y| is searched.
const RHO: [f64; 2] = [0.003, 5.0];

/// The best of a coarse geometric grid, then its own `rho` again and again while that pays. `solution` answers a `rho_0` with the objective
/// and the `rho` found. `None` when no point is feasible.
fn best_rho(solution: impl Fn(f64) -> Option<(f64, f64)>, options: &RegionOptions) -> Option<f64> {
    let [first, last] = RHO.map(f64::ln);
    let points = options.coarse.max(1);
    let spacing = (last - first) / points as f64;
    let (mut objective, mut next, mut rho_0) = (0..points)
        .map(|k| (first + spacing * (k as f64 + 0.5)).exp())
        .filter_map(|rho_0| solution(rho_0).map(|(objective, rho)| (objective, rho, rho_0)))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    for _ in 0..options.refinements {
        let Some((found, rho)) = solution(next).filter(|(found, _)| *found < objective) else { break };
        let gain = 1.0 - found / objective;
        (objective, rho_0, next) = (found, next, rho);
        if gain < WORTHWHILE {
            break;
        }
    }
    Some(rho_0)
}

/// The least gain of V at the start for which another solution is sought: half of it in the radius.
pub(crate) const WORTHWHILE: f64 = 5e-4;

/// A floating-point number as the dyadic it is.
pub(crate) fn dyadics(values: impl IntoIterator<Item = f64>) -> Option<Vec<Number>> {
    values.into_iter().map(Number::dyadic).collect()
}

/// The solver's point as exact numbers, with a radius a little smaller than the solver's.
fn candidate(search: &Search, x: &[f64], rate: f64, shrink: f64) -> Option<RegionClaim> {
    let point = search.point(x);
    let rho = point.absolute + point.relative;
    let theta =
        if search.problem.plant.coriolis_relative.is_some() { (point.absolute / rho).clamp(0.0, 1.0) } else { 1.0 };
    let multiplier = |x: f64| Number::dyadic(x.max(0.0));
    let Limits { controller_torque_n_m, motor_limits_n_m, distance_rad } = search.limits.clone();
    Some(RegionClaim {
        radius_rad: down((1.0 - shrink) / x[OBJECTIVE].sqrt())?,
        rate_per_s: Number::decimal(rate)?,
        controller_torque_n_m,
        motor_limits_n_m,
        distance_rad,
        witness: RegionWitness {
            p: Number::dyadic(point.energy.p)?,
            b: dyadics(point.energy.b)?.try_into().ok()?,
            s: dyadics(point.energy.s)?,
            rho: Number::dyadic(rho)?,
            theta: Number::dyadic(theta)?,
            friction_multiplier: multiplier(point.interval_multiplier)?,
            gravity_multiplier: multiplier(point.gravity_multiplier)?,
            start_multiplier: multiplier(point.start_multiplier)?,
        },
    })
}

fn not_proved(reason: Reason, distance: Option<f64>) -> Claim {
    crate::not_proved(ClaimKind::Region, reason, distance)
}

impl Search {
    /// How far the inequalities are from feasible: the least `t` such that every matrix of the proof plus `t I` is
    /// positive semidefinite, with V normalised to have trace 1 at the largest inertia. Positive: infeasible.
    fn distance(&self, rate: f64) -> Option<f64> {
        let t = OBJECTIVE;
        let rho = RHO[0];
        let mut cost = vec![0.0; VARIABLES];
        cost[t] = 1.0;
        let value = |x: &[f64], m: f64| self.within(x, m, State::Position, 0.0);
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for m in self.problem.inertia {
            blocks.push(Box::new(move |x| strict(value(x, m), -x[t])));
            blocks.push(Box::new(move |x| strict(self.decay(x, m, rate), -x[t])));
        }
        let largest = self.problem.inertia[1];
        for sign in [1.0, -1.0] {
            blocks.push(Box::new(move |x| scalar(sign * (value(x, largest).trace() - 1.0))));
            blocks.push(Box::new(move |x| scalar(sign * (shares(x) - rho))));
            blocks.push(Box::new(move |x| scalar(sign * x[START])));
            blocks.push(Box::new(move |x| scalar(sign * x[RHO_SQUARED])));
        }
        blocks.extend(self.pinned());
        let x = Program { cost, nonnegative: nonnegative(), blocks }.solve().ok()?.x;
        // Two significant digits: the figure is a hint, not evidence.
        format!("{:.1e}", x[t]).parse().ok()
    }
}
