//! The largest certified ellipsoid of starts when every joint has its own gains, friction and motor limit.
//!
//! Notation and derivation as in `certune_verify`'s `joint_region` and `proofs/claims/joint-region.md`. One semidefinite program in all
//! joints, made linear in `rho` as in [`crate::region`]. The matrices are the checker's, over floating point, in scaled coordinates.

use certune_verify::{
    Claim, ClaimKind, CoveredSteps, Document, Energy, JointProblem, JointRegionClaim, JointRegionWitness, JointWeights,
    Number, Point, Reason, STATES, State, TRIANGLE, joint_region_inequalities, triangle,
};
use nalgebra::DMatrix;
use num_traits::ToPrimitive;

use crate::lmi::{Affine, Program};
use crate::problem::Problem;
use crate::region::{STRICTNESS, WORTHWHILE, down, dyadics, left_by_gravity, scalar, scaled, strict, tangent, widths};

/// How a region with gains, frictions and limits of each joint is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct JointRegionOptions {
    /// The decay rate that the region must have, 1/s; a larger one shrinks the region.
    pub rate_per_s: f64,
    /// Motor limits to respect, gravity's share included, one per joint, N m; none: no limits.
    pub motor_limits_n_m: Option<Vec<f64>>,
    /// Distance from its goal that each joint must keep, rad. Constants over a box of angles need one: without it, a quarter of each width.
    pub distances_rad: Option<Vec<f64>>,
    /// Goal steps, one number per joint, rad: the share of them that is covered is made as large as it can be. None: the least radius is.
    pub steps_rad: Vec<Vec<f64>>,
    /// Most solutions of the program, each from the `rho` of the one before.
    pub refinements: usize,
}

impl Default for JointRegionOptions {
    /// A rate of 0.001 per s, no limits, no steps, at most 10 refinements.
    fn default() -> Self {
        Self { rate_per_s: 0.001, motor_limits_n_m: None, distances_rad: None, steps_rad: Vec::new(), refinements: 10 }
    }
}

/// Variables that all joints share.
const P: usize = 0;
const RHO_SQUARED: usize = 1;
const ABSOLUTE: usize = 2;
const RELATIVE: usize = 3;
const INERTIA: usize = 4;
const GRAVITY: usize = 5;
const START: usize = 6;
const OBJECTIVE: usize = 7;
const SHARED: usize = 8;
/// Variables of one joint, after the shared ones: V at its start, b, S at the least friction, S at the largest.
const WEIGHT: usize = 0;
const B: usize = 1;
const S: usize = B + STATES;

/// How much the joints that no step moves count beside those that are moved.
const IDLE: f64 = 1e-3;
/// Where the search of rho starts: a larger one is feasible whenever a smaller one is, with a smaller region.
const FIRST_RHO: [f64; 4] = [1.0, 8.0, 64.0, 512.0];

/// One joint of the program.
struct Joint {
    problem: JointProblem<f64>,
    /// N m per unit of the scaled last state.
    torque_unit: f64,
    torque: Option<f64>,
    distance: Option<f64>,
    /// Index of its first variable.
    first: usize,
}

struct Search {
    joints: Vec<Joint>,
    steps: Vec<Vec<f64>>,
    variables: usize,
}

impl Joint {
    fn variables(&self) -> usize {
        S + TRIANGLE * self.problem.friction.len()
    }

    fn unit(&self, state: usize) -> f64 {
        if state == STATES - 1 { self.torque_unit } else { 1.0 }
    }

    fn stiffness_unit(&self) -> f64 {
        if self.problem.plant.has_gravity { self.problem.plant.stiffness } else { 1.0 }
    }

    /// The program's point in the checker's units, at one end of the friction.
    fn point(&self, x: &[f64], end: usize) -> Point<f64> {
        let own = &x[self.first..self.first + self.variables()];
        let mut s = [0.0; TRIANGLE];
        for i in 0..STATES {
            for j in i..STATES {
                let k = triangle(i, j);
                s[k] = own[S + TRIANGLE * end + k] / (self.unit(i) * self.unit(j));
            }
        }
        Point {
            energy: Energy { p: x[P], b: std::array::from_fn(|k| own[B + k] / self.unit(k)), s },
            rho_squared: x[RHO_SQUARED],
            absolute: x[ABSOLUTE],
            relative: x[RELATIVE],
            interval_multiplier: x[INERTIA],
            gravity_multiplier: x[GRAVITY],
            start_multiplier: x[START] / self.stiffness_unit().powi(2),
        }
    }

    /// Units of z after those of the coordinates before it.
    fn units(&self, before: &[f64], after: &[f64]) -> Vec<f64> {
        let mut units = before.to_vec();
        units.extend((0..STATES).map(|k| self.unit(k)));
        units.extend_from_slice(after);
        units
    }

    fn containment(&self, x: &[f64], end: usize) -> DMatrix<f64> {
        let units = self.units(&[self.problem.diagonal[1].sqrt()], &[1.0]);
        scaled(&self.problem.containment(&self.point(x, end)), &units)
    }

    fn within(&self, x: &[f64], end: usize, state: State, inverse_square: f64) -> DMatrix<f64> {
        let units = self.units(&[self.problem.diagonal[1].sqrt()], &[]);
        scaled(&self.problem.within(&self.point(x, end), state, &inverse_square), &units)
    }

    fn decay(&self, x: &[f64], end: usize, rate: f64) -> DMatrix<f64> {
        let [lower, upper] = self.problem.diagonal;
        let middle = (lower * upper).powf(0.25);
        let gravity = [self.problem.plant.stiffness];
        let units = self.units(&[middle.recip(), middle], if self.problem.plant.has_gravity { &gravity } else { &[] });
        scaled(&self.problem.decay(&self.point(x, end), &rate, &self.problem.friction[end]), &units)
    }

    fn start(&self, x: &[f64], end: usize) -> DMatrix<f64> {
        let form = self.problem.plant.start(&self.point(x, end), &x[self.first + WEIGHT]);
        let units = [1.0, self.stiffness_unit()];
        scaled(&form, &units[..form.0.len()])
    }

    /// A block that depends on the shared variables and this joint's own: where all of them vanish it is its value at the origin.
    fn block<'a>(&'a self, variables: usize, matrix: impl Fn(&[f64]) -> DMatrix<f64> + 'a) -> Affine<'a> {
        let origin = matrix(&vec![0.0; variables]);
        Box::new(move |x| {
            let mut seen = x[..SHARED].iter().chain(&x[self.first..self.first + self.variables()]);
            if seen.all(|entry| entry.abs() <= 0.0) { origin.clone() } else { matrix(x) }
        })
    }
}

impl Search {
    fn new(document: &Document, options: &JointRegionOptions) -> Result<Self, Reason> {
        let count = document.arm.joints;
        let gains = document.gains.aic().map_err(|_| Reason::OtherController)?;
        if document.constants.bounds.diagonal_kg_m2.is_none() {
            return Err(Reason::ConstantMissing);
        }
        let fits = |list: &Vec<f64>| list.len() == count && list.iter().all(|x| x.is_finite());
        let torques = options.motor_limits_n_m.as_ref().map(|limits| left_by_gravity(document, limits)).transpose()?;
        let narrow = || widths(document).map(|widths| widths.into_iter().map(|width| width / 4.0).collect());
        let distances = options.distances_rad.clone().or_else(narrow);
        if !options.steps_rad.iter().chain(&distances).all(fits) {
            return Err(Reason::OutOfRange);
        }
        let mut joints: Vec<Joint> = Vec::new();
        let mut first = SHARED;
        for index in 0..count {
            let problem = JointProblem::new(document, index).map_err(|_| Reason::OutOfRange)?;
            let problem = problem.map(|x| x.to_f64().unwrap_or(f64::NAN));
            let gain = |list: &[Number]| list.get(index).map_or(f64::NAN, Number::to_f64);
            let natural = 5.0 * (gain(&gains.kappa_a) / gain(&gains.sigma_dq)).sqrt();
            let torque = torques.as_ref().map(|torques| torques[index]);
            let joint = Joint {
                problem,
                torque_unit: natural.min(torque.unwrap_or(f64::INFINITY)),
                torque,
                distance: distances.as_ref().map(|distances: &Vec<f64>| distances[index]),
                first,
            };
            let controller = &joint.problem.plant.controller;
            if !controller.a.iter().flatten().chain(&controller.b).chain([&joint.torque_unit]).all(|x| x.is_finite()) {
                return Err(Reason::OutOfRange);
            }
            first += joint.variables();
            joints.push(joint);
        }
        Ok(Self { joints, steps: options.steps_rad.clone(), variables: first })
    }

    /// Every joint at every end of its friction.
    fn ends(&self) -> impl Iterator<Item = (&Joint, usize)> {
        self.joints.iter().flat_map(|joint| (0..joint.problem.friction.len()).map(move |end| (joint, end)))
    }

    fn nonnegative() -> Vec<usize> {
        vec![P, RHO_SQUARED, ABSOLUTE, RELATIVE, INERTIA, GRAVITY, START]
    }

    /// The largest region whose `rho` is bounded by its tangent at `rho_0`.
    fn solve(&self, rho_0: f64, rate: f64, strictness: f64) -> Option<Vec<f64>> {
        let mut cost = vec![0.0; self.variables];
        cost[OBJECTIVE] = 1.0;
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for (joint, end) in self.ends() {
            let all = self.variables;
            blocks.push(joint.block(all, move |x| strict(joint.containment(x, end), strictness)));
            blocks.push(joint.block(all, move |x| strict(joint.decay(x, end, rate), strictness)));
            for (state, most) in [(State::Torque, joint.torque), (State::Position, joint.distance)] {
                if let Some(most) = most {
                    let inverse_square = most.powi(-2);
                    let matrix = move |x: &[f64]| strict(joint.within(x, end, state, inverse_square), strictness);
                    blocks.push(joint.block(all, matrix));
                }
            }
            blocks.push(joint.block(all, move |x| joint.start(x, end)));
        }
        for joint in &self.joints {
            cost[joint.first + WEIGHT] = IDLE;
            if self.steps.is_empty() {
                blocks.push(Box::new(move |x| scalar(x[OBJECTIVE] - x[joint.first + WEIGHT])));
            }
        }
        for step in &self.steps {
            blocks.push(Box::new(move |x| {
                let value: f64 = self.joints.iter().zip(step).map(|(joint, e)| e * e * x[joint.first + WEIGHT]).sum();
                scalar(x[OBJECTIVE] - value)
            }));
        }
        blocks.push(Box::new(move |x| scalar(x[ABSOLUTE] + x[RELATIVE] - tangent(x[RHO_SQUARED], rho_0))));
        blocks.extend(self.pinned());
        let x = Program { cost, nonnegative: Self::nonnegative(), blocks }.solve().ok()?.x;
        let weights = self.joints.iter().all(|joint| x[joint.first + WEIGHT] > 0.0);
        (weights && x[OBJECTIVE] > 0.0 && x[RHO_SQUARED] > 0.0).then_some(x)
    }

    /// Without the relative bound its share is zero; a multiplier that appears nowhere would leave the program without a unique answer.
    fn pinned(&self) -> Vec<Affine<'static>> {
        let Some(Joint { problem, .. }) = self.joints.first() else { return Vec::new() };
        let plant = &problem.plant;
        let unused = [
            plant.coriolis_relative.is_none().then_some(RELATIVE),
            (!plant.has_gravity).then_some(GRAVITY),
            (!plant.has_gravity).then_some(START),
        ];
        unused.into_iter().flatten().map(|k| -> Affine<'static> { Box::new(move |x| scalar(-x[k])) }).collect()
    }

    /// The solution from the best `rho_0` found.
    fn best(&self, options: &JointRegionOptions) -> Option<(f64, Vec<f64>)> {
        let solve = |rho_0| self.solve(rho_0, options.rate_per_s, STRICTNESS[0]);
        let (mut rho_0, mut x) = FIRST_RHO.into_iter().find_map(|rho_0| Some((rho_0, solve(rho_0)?)))?;
        for _ in 0..options.refinements {
            let next = x[RHO_SQUARED].sqrt();
            let Some(found) = solve(next).filter(|found| found[OBJECTIVE] < x[OBJECTIVE]) else { break };
            let gain = 1.0 - found[OBJECTIVE] / x[OBJECTIVE];
            (rho_0, x) = (next, found);
            if gain < WORTHWHILE {
                break;
            }
        }
        Some((rho_0, x))
    }

    /// The solver's point as exact numbers, with radii a little smaller than the solver's.
    fn candidate(&self, x: &[f64], options: &JointRegionOptions, shrink: f64) -> Option<JointRegionClaim> {
        let radii: Vec<Number> = self
            .joints
            .iter()
            .map(|joint| down((1.0 - shrink) / x[joint.first + WEIGHT].sqrt()))
            .collect::<Option<_>>()?;
        let steps_rad: Vec<Vec<Number>> = self
            .steps
            .iter()
            .map(|step| step.iter().map(|&e| Number::decimal(e)).collect::<Option<_>>())
            .collect::<Option<_>>()?;
        let lengths = self
            .steps
            .iter()
            .map(|step| step.iter().zip(&radii).map(|(e, radius)| (e / radius.to_f64()).powi(2)).sum::<f64>().sqrt());
        let longest = lengths.fold(1.0, f64::max);
        let steps = if steps_rad.is_empty() {
            None
        } else {
            Some(CoveredSteps { steps_rad, covered_share: down((1.0 - 1e-9) / longest)? })
        };
        let decimals = |list: &Vec<f64>| list.iter().map(|&limit| Number::decimal(limit)).collect::<Option<Vec<_>>>();
        let distances: Option<Vec<f64>> = self.joints.iter().map(|joint| joint.distance).collect();
        let shared = self.joints.first()?.point(x, 0);
        let rho = shared.absolute + shared.relative;
        let relative = self.joints.first()?.problem.plant.coriolis_relative.is_some();
        let multiplier = |x: f64| Number::dyadic(x.max(0.0));
        let weights = |joint: &Joint| {
            let s = (0..joint.problem.friction.len()).map(|end| dyadics(joint.point(x, end).energy.s));
            Some(JointWeights {
                b: dyadics(joint.point(x, 0).energy.b)?.try_into().ok()?,
                s: s.collect::<Option<_>>()?,
            })
        };
        Some(JointRegionClaim {
            radii_rad: radii,
            rate_per_s: Number::decimal(options.rate_per_s)?,
            motor_limits_n_m: match &options.motor_limits_n_m {
                Some(limits) => Some(decimals(limits)?),
                None => None,
            },
            distances_rad: match &distances {
                Some(distances) => Some(decimals(distances)?),
                None => None,
            },
            steps,
            witness: JointRegionWitness {
                p: Number::dyadic(shared.energy.p)?,
                rho: Number::dyadic(rho)?,
                theta: Number::dyadic(if relative { (shared.absolute / rho).clamp(0.0, 1.0) } else { 1.0 })?,
                inertia_multiplier: multiplier(shared.interval_multiplier)?,
                gravity_multiplier: multiplier(shared.gravity_multiplier)?,
                start_multiplier: multiplier(shared.start_multiplier)?,
                joints: self.joints.iter().map(weights).collect::<Option<_>>()?,
            },
        })
    }

    /// How far the inequalities are from feasible: the least `t` such that every matrix of the proof plus `t I` is positive semidefinite at
    /// a vanishing `rho`, with the least values of V normalised to have trace 1 in all. Positive: infeasible.
    fn distance(&self, rate: f64) -> Option<f64> {
        let t = OBJECTIVE;
        let mut cost = vec![0.0; self.variables];
        cost[t] = 1.0;
        let value = |joint: &Joint, x: &[f64], end: usize| joint.within(x, end, State::Position, 0.0);
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for (joint, end) in self.ends() {
            blocks.push(joint.block(self.variables, move |x| strict(value(joint, x, end), -x[t])));
            blocks.push(joint.block(self.variables, move |x| strict(joint.decay(x, end, rate), -x[t])));
        }
        let trace = |x: &[f64]| self.ends().map(|(joint, end)| value(joint, x, end).trace()).sum::<f64>();
        for sign in [1.0, -1.0] {
            blocks.push(Box::new(move |x| scalar(sign * (trace(x) - 1.0))));
            for k in [RHO_SQUARED, ABSOLUTE, RELATIVE, START] {
                blocks.push(Box::new(move |x| scalar(sign * x[k])));
            }
            for joint in &self.joints {
                blocks.push(Box::new(move |x| scalar(sign * x[joint.first + WEIGHT])));
            }
        }
        blocks.extend(self.pinned());
        let x = Program { cost, nonnegative: Self::nonnegative(), blocks }.solve().ok()?.x;
        // Two significant digits: the figure is a hint, not evidence.
        format!("{:.1e}", x[t]).parse().ok()
    }
}

/// The claim `joint-region` with the largest ellipsoid found, or "not proved".
pub fn joint_region(problem: &Problem, options: &JointRegionOptions) -> Claim {
    let not_proved = |reason, distance| crate::not_proved(ClaimKind::JointRegion, reason, distance);
    let document = problem.document();
    let search = match Search::new(document, options) {
        Ok(search) => search,
        Err(reason) => return not_proved(reason, None),
    };
    let rate = options.rate_per_s;
    let Some((rho_0, best)) = search.best(options) else {
        return not_proved(Reason::Infeasible, search.distance(rate));
    };
    // The optimum lies on the boundary of the inequalities: back off until the exact check passes.
    for (attempt, strictness) in STRICTNESS.into_iter().enumerate() {
        let solution = if attempt == 0 { Some(best.clone()) } else { search.solve(rho_0, rate, strictness) };
        let Some(x) = solution else { continue };
        for shrink in [1e-4, 1e-3, 1e-2] {
            let Some(claim) = search.candidate(&x, options, shrink) else { continue };
            let checked = joint_region_inequalities(document, &claim);
            if checked.is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some())) {
                return Claim::JointRegion(Box::new(claim));
            }
        }
    }
    not_proved(Reason::CandidateFailed, search.distance(rate))
}
