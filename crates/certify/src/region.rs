//! The largest ball of starts for which the nonlinear loop is certified.
//!
//! Notation and derivation as in `certune_verify`'s `region` and `proofs/claims/region.md`. For a fixed bound `rho` on `|y|` the search is
//! a semidefinite program in `p, b, S, theta` and three multipliers that minimises `V` at the start; `rho` is found by a line search.
//! The matrices are assembled here a second time, by another route than the checker's: every quantity is a row of coefficients over
//! the coordinates `(dq, z, f, w)`, and `dV/dt` is a sum of products of rows. Coordinates are scaled (`dq` by `1/sqrt m`, `u~` by
//! the torque's own size), without which the solver loses digits.

use certune_verify::{Claim, ClaimKind, Document, Number, Reason, RegionClaim, RegionWitness, region_inequalities};
use nalgebra::{DMatrix, DVector, RowDVector};

use crate::lmi::{Affine, Program, SolveError};
use crate::problem::Problem;

/// How a region is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionOptions {
    /// The decay rate that the region must have, 1/s; a larger one shrinks the ball.
    pub rate_per_s: f64,
    /// Points of the line search's coarse grid, at least 1.
    pub coarse: usize,
    /// Evaluations of the line search after that.
    pub refinements: usize,
}

impl Default for RegionOptions {
    /// A rate of 0.01 per s, 9 points and 8 refinements.
    fn default() -> Self {
        Self { rate_per_s: 0.01, coarse: 9, refinements: 8 }
    }
}

const STATES: usize = 5;
/// Variables of the program: p, b, S, theta, the three multipliers, and V at the start.
const P: usize = 0;
const B: usize = 1;
const S: usize = B + STATES;
const THETA: usize = S + 15;
const FRICTION: usize = THETA + 1;
const GRAVITY: usize = FRICTION + 1;
const START: usize = GRAVITY + 1;
const OBJECTIVE: usize = START + 1;
const VARIABLES: usize = OBJECTIVE + 1;

/// The document's numbers as floating point.
struct Numbers {
    /// z' = a z + b dq in scaled coordinates.
    a: DMatrix<f64>,
    b: DVector<f64>,
    /// Torque per unit of the scaled last state.
    torque_unit: f64,
    inertia: [f64; 2],
    friction: [f64; 2],
    stiffness: f64,
    coriolis: f64,
    /// `None`: the cubic term must rest on the absolute bound alone.
    coriolis_relative: Option<f64>,
}

impl Numbers {
    fn new(document: &Document) -> Option<Self> {
        let g = document.gains.aic().ok()?;
        let [kappa_mu, kappa_a, sq, sdq, smu, sdmu, t] =
            [&g.kappa_mu, &g.kappa_a, &g.sigma_q, &g.sigma_dq, &g.sigma_mu, &g.sigma_dmu, &g.reference_time_constant_s]
                .map(|list| list.first().map_or(f64::NAN, Number::to_f64));
        let (a, av, b, c) = (kappa_mu / sq, kappa_mu / sdq, kappa_mu / smu, kappa_mu / sdmu);
        let torque_unit = 5.0 * kappa_a.sqrt();
        let mut matrix = DMatrix::zeros(STATES, STATES);
        let mut input = DVector::zeros(STATES);
        // Each prediction error is a row over z and a weight on dq; each belief follows the errors it appears in.
        let row = |entries: [f64; STATES]| RowDVector::from_row_slice(&entries);
        let position = row([1.0, -1.0, 0.0, 0.0, 0.0]);
        let velocity = row([0.0, 0.0, -1.0, 0.0, 0.0]);
        let first = row([0.0, 1.0 / t, 1.0, 0.0, 0.0]);
        let second = row([0.0, 0.0, 1.0 / t, 1.0, 0.0]);
        input[0] = 1.0;
        matrix.set_row(1, &(row([0.0, 0.0, 1.0, 0.0, 0.0]) + &position * a - &first * (b / t)));
        matrix.set_row(2, &(row([0.0, 0.0, 0.0, 1.0, 0.0]) + &velocity * av - &first * b - &second * (c / t)));
        input[2] = av;
        matrix.set_row(3, &(&second * -c));
        matrix.set_row(4, &((&position / sq + &velocity / sdq) * (-kappa_a / torque_unit)));
        input[4] = -kappa_a / sdq / torque_unit;
        let k = &document.constants.bounds;
        let numbers = Self {
            a: matrix,
            b: input,
            torque_unit,
            inertia: [k.m_lo_kg_m2.to_f64(), k.m_hi_kg_m2.to_f64()],
            friction: document.family.friction_hull().map(|x| x.to_f64()),
            stiffness: if document.family.gravity_compensation { 0.0 } else { k.k_g_n_m_per_rad.to_f64() },
            coriolis: k.k_c_kg_m2.to_f64(),
            coriolis_relative: k.k_r.as_ref().map(Number::to_f64),
        };
        numbers.a.iter().chain(numbers.b.iter()).all(|x| x.is_finite()).then_some(numbers)
    }

    fn has_friction(&self) -> bool {
        self.friction[1] > self.friction[0]
    }

    fn has_gravity(&self) -> bool {
        self.stiffness > 0.0
    }

    /// Minus `dV/dt + 2 rate V` with its multipliers, at inertia `m`.
    fn decay(&self, x: &[f64], m: f64, rho: f64, rate: f64) -> DMatrix<f64> {
        let order = 1 + STATES + usize::from(self.has_friction()) + usize::from(self.has_gravity());
        let unit = |k: usize, scale: f64| {
            let mut row = RowDVector::zeros(order);
            row[k] = scale;
            row
        };
        let [d0, d1] = self.friction;
        let dq = unit(0, m.sqrt().recip());
        let z: Vec<_> = (0..STATES).map(|k| unit(1 + k, 1.0)).collect();
        let none = RowDVector::zeros(order);
        let f = if self.has_friction() { unit(1 + STATES, (d1 - d0) / m.sqrt()) } else { none.clone() };
        let w = if self.has_gravity() { unit(order - 1, self.stiffness) } else { none };
        let torque = &z[4] * self.torque_unit;
        let z_dot: Vec<_> =
            (0..STATES).map(|i| (0..STATES).fold(&dq * self.b[i], |sum, k| sum + &z[k] * self.a[(i, k)])).collect();
        let b = &x[B..B + STATES];
        let combine = |rows: &[RowDVector<f64>]| (0..STATES).fold(&dq * 0.0, |sum, k| sum + &rows[k] * b[k]);
        let (y, y_dot) = (combine(&z), combine(&z_dot));
        let potential_free = &torque - &dq * d0 - &f;
        let force = &potential_free - &w;
        // 2 l r for rows l, r is the form l'r + r'l.
        let twice = |left: &RowDVector<f64>, right: &RowDVector<f64>| {
            let product = left.transpose() * right;
            &product + product.transpose()
        };
        let mut form = twice(&dq, &potential_free) * x[P] + twice(&y, &force) + twice(&dq, &y_dot) * m;
        for (i, j, s) in entries(x) {
            form += twice(&z[i], &z_dot[j]) * s;
        }
        let cubic = match self.coriolis_relative {
            Some(relative) => rho * (x[THETA] * self.coriolis + (1.0 - x[THETA]) * relative * m),
            None => rho * self.coriolis,
        };
        form += twice(&dq, &dq) * cubic;
        let mut value = twice(&dq, &dq) * (0.5 * m * x[P]) + twice(&dq, &y) * m;
        for (i, j, s) in entries(x) {
            value += twice(&z[i], &z[j]) * (0.5 * s);
        }
        value += twice(&z[0], &z[0]) * (0.5 * x[P] * self.stiffness);
        form += value * (2.0 * rate);
        form += twice(&f, &(&dq * (d1 - d0) - &f)) * (0.5 * x[FRICTION]);
        form += (twice(&z[0], &z[0]) * self.stiffness.powi(2) - twice(&w, &w)) * (0.5 * x[GRAVITY]);
        -form
    }

    /// `[[P(m) - p k_g e e', beta], [beta', rho^2]]`, positive semidefinite where `V <= 1` implies `|y| <= rho`.
    fn containment(&self, x: &[f64], m: f64, rho: f64) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(2 + STATES, 2 + STATES);
        matrix[(0, 0)] = x[P];
        matrix[(6, 6)] = rho * rho;
        for k in 0..STATES {
            let b = x[B + k];
            matrix[(0, 1 + k)] = m.sqrt() * b;
            matrix[(1 + k, 0)] = m.sqrt() * b;
            matrix[(6, 1 + k)] = b;
            matrix[(1 + k, 6)] = b;
        }
        for (i, j, s) in entries(x) {
            matrix[(1 + i, 1 + j)] += s;
        }
        matrix[(1, 1)] -= x[P] * self.stiffness;
        matrix
    }

    /// V at the start is at most `objective |e0|^2`.
    fn start(&self, x: &[f64]) -> DMatrix<f64> {
        let s = |i: usize, j: usize| x[S + triangle(i, j)];
        let position = x[OBJECTIVE] - s(0, 0) - 2.0 * s(0, 1) - s(1, 1) - x[P] * self.stiffness;
        if !self.has_gravity() {
            return DMatrix::from_element(1, 1, position);
        }
        // |u~| <= k_g |e0|, in units of k_g on the torque coordinate.
        let k = self.stiffness / self.torque_unit;
        let cross = -k * (s(0, 4) + s(1, 4));
        DMatrix::from_row_slice(2, 2, &[position - x[START], cross, cross, x[START] - k * k * s(4, 4)])
    }

    fn solve(&self, rho: f64, rate: f64, strictness: f64) -> Result<Vec<f64>, SolveError> {
        let mut cost = vec![0.0; VARIABLES];
        cost[OBJECTIVE] = 1.0;
        let strict = |matrix: DMatrix<f64>| {
            let order = matrix.nrows();
            matrix - DMatrix::identity(order, order) * strictness
        };
        let mut blocks: Vec<Affine<'_>> = vec![Box::new(|x| self.start(x))];
        for m in self.inertia {
            blocks.push(Box::new(move |x| strict(self.containment(x, m, rho))));
            blocks.push(Box::new(move |x| strict(self.decay(x, m, rho, rate))));
        }
        // theta in [0, 1].
        blocks.push(Box::new(|x| DMatrix::from_element(1, 1, 1.0 - x[THETA])));
        let mut nonnegative = vec![P, THETA, FRICTION, GRAVITY, START];
        // A multiplier that appears nowhere would leave the program without a unique answer: pin it at zero.
        let unused = [
            (!self.has_friction()).then_some(FRICTION),
            (!self.has_gravity()).then_some(GRAVITY),
            (!self.has_gravity()).then_some(START),
            self.coriolis_relative.is_none().then_some(THETA),
        ];
        for k in unused.into_iter().flatten() {
            blocks.push(Box::new(move |x| DMatrix::from_element(1, 1, -x[k])));
        }
        nonnegative.sort_unstable();
        Program { cost, nonnegative, blocks }.solve().map(|solution| solution.x)
    }
}

/// Index of S's entry in its upper triangle, row by row.
fn triangle(i: usize, j: usize) -> usize {
    let (i, j) = (i.min(j), i.max(j));
    i * STATES - i * (i + 1) / 2 + j
}

/// Every entry (i, j, S_ij) of the symmetric matrix, both triangles.
fn entries(x: &[f64]) -> impl Iterator<Item = (usize, usize, f64)> {
    (0..STATES).flat_map(move |i| (0..STATES).map(move |j| (i, j, x[S + triangle(i, j)])))
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
    let Some(numbers) = Numbers::new(document) else {
        return not_proved(Reason::OutOfRange, None);
    };
    let rate = options.rate_per_s;
    let radius = |rho: f64| match numbers.solve(rho, rate, STRICTNESS[0]) {
        Ok(x) if x[OBJECTIVE] > 0.0 => x[OBJECTIVE].sqrt().recip(),
        Ok(_) | Err(SolveError::Infeasible | SolveError::Unbounded | SolveError::Stopped(_)) => 0.0,
    };
    let Some(rho) = best_rho(radius, options) else {
        return not_proved(Reason::Infeasible, numbers.distance(rate));
    };
    // The optimum lies on the boundary of the inequalities: back off until the exact check passes.
    for strictness in STRICTNESS {
        let Ok(x) = numbers.solve(rho, rate, strictness) else { continue };
        for shrink in [1e-4, 1e-3, 1e-2] {
            let Some(claim) = candidate(&numbers, &x, rho, rate, shrink) else { continue };
            if region_inequalities(document, &claim).is_ok_and(|all| all.iter().all(|i| i.smallest_pivot.is_some())) {
                return Claim::Region(Box::new(claim));
            }
        }
    }
    not_proved(Reason::CandidateFailed, numbers.distance(rate))
}

/// Margins by which the inequalities are tightened, in turn.
const STRICTNESS: [f64; 4] = [1e-7, 1e-6, 1e-5, 1e-4];
/// Where the bound on |y| is searched.
const RHO: [f64; 2] = [0.003, 5.0];

/// A coarse geometric grid, then golden sections in log rho around its best point. `None` when no point is feasible.
fn best_rho(radius: impl Fn(f64) -> f64, options: &RegionOptions) -> Option<f64> {
    let [first, last] = RHO.map(f64::ln);
    let spacing = (last - first) / options.coarse.max(1) as f64;
    let grid: Vec<f64> = (0..options.coarse.max(1)).map(|k| first + spacing * (k as f64 + 0.5)).collect();
    let values: Vec<f64> = grid.iter().map(|log| radius(log.exp())).collect();
    let best = (0..grid.len()).max_by(|&i, &j| values[i].total_cmp(&values[j]))?;
    if values[best] <= 0.0 {
        return None;
    }
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let mut incumbent = (values[best], grid[best].exp());
    if options.refinements == 0 {
        return Some(incumbent.1);
    }
    let (mut low, mut high) = (grid[best] - spacing, grid[best] + spacing);
    let inner = |low: f64, high: f64| (high - golden * (high - low), low + golden * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (radius(left.exp()), radius(right.exp()));
    for _ in 0..options.refinements {
        for (value, at) in [(at_left, left), (at_right, right)] {
            if value > incumbent.0 {
                incumbent = (value, at.exp());
            }
        }
        if at_left >= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = inner(low, high).0;
            at_left = radius(left.exp());
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = inner(low, high).1;
            at_right = radius(right.exp());
        }
    }
    Some(incumbent.1)
}

/// The solver's point as exact numbers, with a radius a little smaller than the solver's.
fn candidate(numbers: &Numbers, x: &[f64], rho: f64, rate: f64, shrink: f64) -> Option<RegionClaim> {
    let unit = numbers.torque_unit;
    let scale = |k: usize| if k == STATES - 1 { unit.recip() } else { 1.0 };
    let b: Vec<Number> = (0..STATES).map(|k| Number::dyadic(x[B + k] * scale(k))).collect::<Option<_>>()?;
    let s: Vec<Number> = (0..STATES)
        .flat_map(|i| (i..STATES).map(move |j| (i, j)))
        .map(|(i, j)| Number::dyadic(x[S + triangle(i, j)] * scale(i) * scale(j)))
        .collect::<Option<_>>()?;
    let k_g = numbers.stiffness;
    let multiplier = |k: usize, unit: f64| Number::dyadic((x[k] * unit).max(0.0));
    let radius = (1.0 - shrink) / x[OBJECTIVE].sqrt();
    Some(RegionClaim {
        radius_rad: Number::decimal((radius * 1e4).floor() / 1e4)?,
        rate_per_s: Number::decimal(rate)?,
        witness: RegionWitness {
            p: Number::dyadic(x[P])?,
            b: b.try_into().ok()?,
            s,
            rho: Number::dyadic(rho)?,
            theta: Number::dyadic(if numbers.coriolis_relative.is_some() { x[THETA].clamp(0.0, 1.0) } else { 1.0 })?,
            friction_multiplier: multiplier(FRICTION, 1.0)?,
            gravity_multiplier: multiplier(GRAVITY, 1.0)?,
            // The start was scaled to torques in units of k_g.
            start_multiplier: if k_g > 0.0 { multiplier(START, (k_g * k_g).recip())? } else { Number::zero() },
        },
    })
}

fn not_proved(reason: Reason, distance: Option<f64>) -> Claim {
    crate::not_proved(ClaimKind::Region, reason, distance)
}

impl Numbers {
    /// How far the inequalities are from feasible: the least `t` such that every matrix of the proof plus `t I` is
    /// positive semidefinite, with V normalised to have trace 1 at the largest inertia. Positive: infeasible.
    fn distance(&self, rate: f64) -> Option<f64> {
        let t = OBJECTIVE;
        let rho = RHO[0];
        let mut cost = vec![0.0; VARIABLES];
        cost[t] = 1.0;
        let relaxed = |matrix: DMatrix<f64>, slack: f64| {
            let order = matrix.nrows();
            matrix + DMatrix::identity(order, order) * slack
        };
        let quadratic = |x: &[f64], m: f64| self.containment(x, m, 1.0).view((0, 0), (6, 6)).into_owned();
        let mut blocks: Vec<Affine<'_>> = Vec::new();
        for m in self.inertia {
            blocks.push(Box::new(move |x| relaxed(quadratic(x, m), x[t])));
            blocks.push(Box::new(move |x| relaxed(self.decay(x, m, rho, rate), x[t])));
        }
        blocks.push(Box::new(|x| DMatrix::from_element(1, 1, 1.0 - x[THETA])));
        let largest = self.inertia[1];
        for sign in [1.0, -1.0] {
            blocks.push(Box::new(move |x| {
                DMatrix::from_element(1, 1, sign * (self.containment(x, largest, 0.0).trace() - 1.0))
            }));
        }
        for k in [FRICTION, GRAVITY, START] {
            let used = match k {
                FRICTION => self.has_friction(),
                GRAVITY => self.has_gravity(),
                _ => false,
            };
            if !used {
                blocks.push(Box::new(move |x| DMatrix::from_element(1, 1, -x[k])));
            }
        }
        let program = Program { cost, nonnegative: vec![P, THETA, FRICTION, GRAVITY, START], blocks };
        // Two significant digits: the figure is a hint, not evidence.
        let x = program.solve().ok()?.x;
        format!("{:.1e}", x[t]).parse().ok()
    }
}
