//! The largest ball of starts for which the sampled nonlinear loop is certified.
//!
//! Notation and derivation as in `certune_verify`'s `SampledLoop` and `proofs/claims/sampled-region.md`; the matrices are the checker's own, assembled in
//! floating point. For fixed bounds `rho` on `|Y+|` and `speed` on the arm's speed, the search is a semidefinite program in `p, b, S, theta` and the multipliers
//! that minimises `V` at the start; the two bounds are found by a pattern search. Coordinates are changed (dq and the mean velocities' remainders in units of
//! `1/sqrt m`, torques in units of the torque's own size), without which the solver loses digits.

use certune_verify::{
    Claim, ClaimKind, Compensation, Corner, Document, Flaw, Number, Reach, Reason, SampledLoop, SampledRegionClaim,
    SampledRegionWitness, SampledUnknowns, Sampling, sampled_loop, sampled_region_inequalities,
};
use nalgebra::DMatrix;
use num_rational::BigRational;

use crate::lmi::{Affine, Program};
use crate::problem::Problem;
use crate::region::STRICTNESS;

/// How a sampled region is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledRegionOptions {
    /// The controller's period, s.
    pub step_s: f64,
    /// Samples between a measurement and the torque computed from it.
    pub delay_samples: usize,
    /// How the robot compensates its gravity.
    pub compensation: Compensation,
    /// The 2-norm over the joints that the controller's own torque must keep to, N m.
    pub torque_limit_n_m: Option<f64>,
    /// The decay rate that the region must have, 1/s; a larger one shrinks the ball.
    pub rate_per_s: f64,
    /// Pieces into which the inertia interval is cut, at least 1.
    pub pieces: usize,
}

impl Default for SampledRegionOptions {
    /// 1 ms, one sample of delay, compensation at every sample, no torque limit, a rate of 0.01 per s, 2 pieces.
    fn default() -> Self {
        Self {
            step_s: 1e-3,
            delay_samples: 1,
            compensation: Compensation::Held,
            torque_limit_n_m: None,
            rate_per_s: 0.01,
            pieces: 2,
        }
    }
}

/// Where `rho` and `speed` are searched first.
const RHO: [f64; 3] = [0.04, 0.12, 0.36];
const SPEED: [f64; 3] = [0.005, 0.01, 0.02];
/// Factors by which the pattern search moves, in turn.
const MOVES: [f64; 3] = [1.5, 1.2, 1.08];

/// The claim `sampled-region` with the largest radius found, or "not proved".
pub fn sampled_region(problem: &Problem, options: &SampledRegionOptions) -> Claim {
    match search(problem.document(), options) {
        Ok(claim) => Claim::SampledRegion(Box::new(claim)),
        Err(reason) => crate::not_proved(ClaimKind::SampledRegion, reason, None),
    }
}

fn search(document: &Document, options: &SampledRegionOptions) -> Result<SampledRegionClaim, Reason> {
    let sampling = options.written().ok_or(Reason::OutOfRange)?;
    // Ask once for what the claim cannot cover at all; later failures concern the bounds tried.
    let smallest = |values: &[f64]| values.first().copied().and_then(Number::decimal).ok_or(Reason::OutOfRange);
    sampled_loop(document, &sampling, &smallest(&RHO)?, &smallest(&SPEED)?).map_err(|flaw| reason(&flaw))?;
    let find = |bounds: [f64; 2], pieces: usize, strictness: f64| {
        Candidate::new(document, &sampling, bounds, pieces)?.solve(strictness)
    };
    let radius = |bounds: [f64; 2]| find(bounds, 1, STRICTNESS[0]).map_or(0.0, |found| found.radius());
    let bounds = best_bounds(radius).ok_or(Reason::Infeasible)?;
    // The optimum lies on the boundary of the inequalities: back off until the exact check passes.
    for strictness in STRICTNESS {
        let Some(found) = find(bounds, options.pieces, strictness) else { continue };
        for shrink in [1e-4, 1e-3, 1e-2] {
            let Some(claim) = found.claim(&sampling, shrink) else { continue };
            let holds = sampled_region_inequalities(document, &claim)
                .is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some()));
            if holds {
                return Ok(claim);
            }
        }
    }
    Err(Reason::CandidateFailed)
}

fn reason(flaw: &Flaw) -> Reason {
    match flaw {
        Flaw::UnequalGains { .. } => Reason::UnequalGains,
        Flaw::Controller { .. } => Reason::OtherController,
        Flaw::Missing { .. } => Reason::ConstantMissing,
        Flaw::NotCovered { .. } => Reason::FamilyNotCovered,
        Flaw::Quantity { .. }
        | Flaw::Length { .. }
        | Flaw::Inequality { .. }
        | Flaw::Polynomial { .. }
        | Flaw::Counterexample { .. } => Reason::OutOfRange,
    }
}

/// The best of a grid, then moves along each axis, by smaller and smaller factors. `None` when no point of the grid is feasible.
fn best_bounds(radius: impl Fn([f64; 2]) -> f64) -> Option<[f64; 2]> {
    let mut best = ([0.0; 2], 0.0);
    for rho in RHO {
        for speed in SPEED {
            let found = radius([rho, speed]);
            if found > best.1 {
                best = ([rho, speed], found);
            }
        }
    }
    if best.1 <= 0.0 {
        return None;
    }
    for factor in MOVES {
        // Each axis both ways; a way that helps is followed once more.
        for (axis, way) in [(0, factor), (0, factor.recip()), (1, factor), (1, factor.recip())] {
            for _ in 0..2 {
                let mut bounds = best.0;
                bounds[axis] *= way;
                let found = radius(bounds);
                if found <= best.1 {
                    break;
                }
                best = (bounds, found);
            }
        }
    }
    Some(best.0)
}

impl SampledRegionOptions {
    fn written(&self) -> Option<Sampling> {
        Some(Sampling {
            step_s: Number::decimal(self.step_s)?,
            delay_samples: self.delay_samples,
            compensation: self.compensation,
            torque_limit_n_m: match self.torque_limit_n_m {
                Some(limit) => Some(Number::decimal(limit)?),
                None => None,
            },
            rate_per_s: Number::decimal(self.rate_per_s)?,
        })
    }
}

/// A semidefinite program for given bounds.
struct Candidate {
    motion: SampledLoop<f64>,
    bounds: [f64; 2],
    /// Points inside the inertia interval, and the corners they make.
    points: Vec<Number>,
    corners: Vec<Corner<f64>>,
    /// Sizes of the states z.
    units: Vec<f64>,
    variables: usize,
}

/// A solution, in the checker's units.
struct Found {
    x: SampledUnknowns<f64>,
    bounds: [f64; 2],
    points: Vec<Number>,
}

impl Candidate {
    fn new(document: &Document, sampling: &Sampling, bounds: [f64; 2], pieces: usize) -> Option<Self> {
        let [rho, speed] = bounds.map(Number::dyadic);
        let motion = sampled_loop(document, sampling, &rho?, &speed?).ok()?.to_f64();
        let ends = &document.constants.bounds;
        let [least, largest] = [ends.m_lo_kg_m2.to_f64(), ends.m_hi_kg_m2.to_f64()];
        let inner = |k: usize| short(least * (largest / least).powf(k as f64 / pieces as f64));
        let points: Vec<Number> = (1..pieces.max(1)).map(inner).collect::<Option<_>>()?;
        let mut cut: Vec<BigRational> = vec![ends.m_lo_kg_m2.value().clone()];
        cut.extend(points.iter().map(|point| point.value().clone()));
        cut.push(ends.m_hi_kg_m2.value().clone());
        let corners: Vec<_> = Corner::cover(&cut).iter().map(Corner::to_f64).collect();
        let gains = document.gains.aic().ok()?;
        let [kappa_a, sigma_dq] =
            [&gains.kappa_a, &gains.sigma_dq].map(|list| list.first().map_or(1.0, Number::to_f64));
        let delay = motion.delay();
        let mut units = vec![1.0; 4];
        units.extend(vec![5.0 * (kappa_a / sigma_dq).sqrt(); 1 + delay]);
        units.push(5.0);
        let mut candidate = Self { motion, bounds, points, corners, units, variables: 0 };
        // Reading the unknowns from an endless list says how many there are.
        let mut count = 0;
        candidate.read(|_| {
            count += 1;
            0.0
        });
        candidate.variables = count;
        Some(candidate)
    }

    /// The unknowns from variables that are asked for one by one; the argument says whether one must not be negative.
    fn read(&self, mut next: impl FnMut(bool) -> f64) -> SampledUnknowns<f64> {
        let motion = &self.motion;
        let order = self.units.len();
        let rho = self.bounds[0];
        let has_friction = *motion.friction()[1] > 0.0;
        let is_held = *motion.stiffness() > 0.0;
        let p = next(true);
        let b = self.units.iter().map(|unit| rho * next(false) / unit).collect();
        let mut s = vec![vec![0.0; order]; order];
        for i in 0..order {
            for j in i..order {
                let entry = next(false) / (self.units[i] * self.units[j]);
                (s[i][j], s[j][i]) = (entry, entry);
            }
        }
        let mut multiplier = |used: bool, unit: f64| if used { next(true) * unit } else { 0.0 };
        let mean = motion.mean_bounds()[0][0].recip();
        let span = motion.friction()[1].max(1e-3).powi(-2);
        let mut four = || {
            [
                multiplier(true, mean),
                multiplier(true, mean),
                multiplier(has_friction, span),
                multiplier(has_friction, span),
            ]
        };
        let (decay, containment) = (four(), four());
        let growth = [multiplier(true, mean), multiplier(has_friction, span)];
        let limited = motion.is_limited();
        let torque = [multiplier(limited, mean), multiplier(limited && has_friction, span)];
        let held = multiplier(is_held, (motion.stiffness() * motion.step()).powi(-2));
        // 1 - theta is the variable: both shares must not be negative, one by its sign, one by a block.
        let theta = if motion.has_relative_bound() { 1.0 - next(true) } else { 1.0 };
        SampledUnknowns { p, b, s, theta, decay, containment, growth, torque, held }
    }

    fn unknowns(&self, x: &[f64]) -> SampledUnknowns<f64> {
        let mut values = x.iter();
        self.read(|_| values.next().copied().unwrap_or(0.0))
    }

    /// The original coordinates of an inequality in terms of scaled ones, as rows.
    fn change(&self, reach: Reach, at: &Corner<f64>) -> DMatrix<f64> {
        let motion = &self.motion;
        let c = motion.coordinates(reach);
        let [least, span] = motion.friction();
        let root = at.inertia.sqrt();
        let mut change = DMatrix::zeros(c.order, c.order);
        change[(0, 0)] = root.recip();
        for index in [c.friction, c.friction_behind].into_iter().flatten() {
            change[(index, index)] = span / root;
        }
        if let Some(index) = c.held {
            change[(index, index)] = motion.stiffness() * motion.step() / root;
        }
        for (index, unit) in (c.error..c.order).zip(&self.units) {
            change[(index, index)] = *unit;
        }
        if reach == Reach::Force {
            for index in c.error + 4..c.order {
                change[(index, index)] *= motion.step().sqrt();
            }
        }
        // vb (1 + d0 h/(2m)) = dq + w + (h/2m)(tau - f), and backwards in time.
        let lead = motion.step() / (2.0 * at.inertia);
        let torques = motion.held_torques(reach);
        let periods = [(c.mean, 1.0, c.friction), (Some(c.mean_behind), -1.0, c.friction_behind)];
        for ((mean, sign, friction), torque) in periods.into_iter().zip(torques) {
            let Some(mean) = mean else { continue };
            let scale = (1.0 + sign * least * lead).recip();
            let mut row = change.row(0).clone_owned();
            for (index, weight) in torque.0.iter().enumerate() {
                row += change.row(index) * (sign * lead * weight);
            }
            if let Some(friction) = friction {
                row -= change.row(friction) * (sign * lead);
            }
            row[mean] += motion.mean_bounds()[0][0].sqrt() / root;
            change.set_row(mean, &(row * scale));
        }
        change
    }

    fn solve(&self, strictness: f64) -> Option<Found> {
        let mut nonnegative = Vec::new();
        let mut index = 0;
        self.read(|sign| {
            if sign {
                nonnegative.push(index);
            }
            index += 1;
            0.0
        });
        let start = |x: &[f64]| {
            let s = self.unknowns(x).s;
            s[0][0] + s[0][1] + s[1][0] + s[1][1]
        };
        let unit = |k: usize| (0..self.variables).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<_>>();
        let cost = (0..self.variables).map(|k| start(&unit(k))).collect();
        let motion = &self.motion;
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for at in &self.corners {
            let [sample, period, force] =
                [Reach::Sample, Reach::Period, Reach::Force].map(|reach| self.change(reach, at));
            let order = period.nrows();
            let mut bordered = period.resize(order + 1, order + 1, 0.0);
            bordered[(order, order)] = self.bounds[0].recip();
            let sample_again = sample.clone();
            blocks.push(Box::new(move |x| congruent(motion.growth(&self.unknowns(x), at).0, &sample, strictness)));
            blocks
                .push(Box::new(move |x| congruent(motion.containment(&self.unknowns(x), at).0, &bordered, strictness)));
            blocks.push(Box::new(move |x| congruent(motion.decay(&self.unknowns(x), at).0, &force, strictness)));
            if motion.is_limited() {
                blocks.push(Box::new(move |x| match motion.torque(&self.unknowns(x), at) {
                    Some(form) => congruent(form.0, &sample_again, strictness),
                    None => DMatrix::identity(1, 1),
                }));
            }
        }
        blocks.push(Box::new(|x| DMatrix::from_element(1, 1, self.unknowns(x).theta)));
        let x = Program { cost, nonnegative, blocks }.solve().ok()?.x;
        let found = Found { x: self.unknowns(&x), bounds: self.bounds, points: self.points.clone() };
        (found.start() > 0.0).then_some(found)
    }
}

/// `change' form change - strictness I`.
fn congruent(form: Vec<Vec<f64>>, change: &DMatrix<f64>, strictness: f64) -> DMatrix<f64> {
    let order = form.len();
    let matrix = DMatrix::from_fn(order, order, |i, j| form[i][j]);
    let changed = change.transpose() * matrix * change;
    (&changed + changed.transpose()) * 0.5 - DMatrix::identity(order, order) * strictness
}

/// A dyadic of 36 significant bits: short numbers keep the exact elimination short.
fn short(x: f64) -> Option<Number> {
    let mask = !((1_u64 << 17) - 1);
    Number::dyadic(f64::from_bits(x.to_bits() & mask))
}

impl Found {
    /// V of a unit step at rest.
    fn start(&self) -> f64 {
        let s = &self.x.s;
        s[0][0] + s[0][1] + s[1][0] + s[1][1]
    }

    fn radius(&self) -> f64 {
        self.start().sqrt().recip()
    }

    /// The solver's point as exact numbers, with a radius a little smaller than the solver's.
    fn claim(&self, sampling: &Sampling, shrink: f64) -> Option<SampledRegionClaim> {
        let x = &self.x;
        let order = x.s.len();
        let list = |values: &[f64]| values.iter().map(|&value| short(value)).collect::<Option<Vec<_>>>();
        let multiplier = |value: &f64| short(value.max(0.0)).unwrap_or_else(Number::zero);
        let upper: Vec<f64> = (0..order).flat_map(|i| (i..order).map(move |j| x.s[i][j])).collect();
        Some(SampledRegionClaim {
            radius_rad: Number::decimal((self.radius() * (1.0 - shrink) * 1e4).floor() / 1e4)?,
            sampling: sampling.clone(),
            witness: SampledRegionWitness {
                p: short(x.p)?,
                b: list(&x.b)?,
                s: list(&upper)?,
                rho: Number::dyadic(self.bounds[0])?,
                speed: Number::dyadic(self.bounds[1])?,
                theta: short(x.theta.clamp(0.0, 1.0))?,
                decay: x.decay.each_ref().map(multiplier),
                containment: x.containment.each_ref().map(multiplier),
                growth: x.growth.each_ref().map(multiplier),
                torque: x.torque.each_ref().map(multiplier),
                held: multiplier(&x.held),
                inertia_kg_m2: self.points.clone(),
            },
        })
    }
}
