//! The Lyapunov function of the nonlinear claims, joint by joint.
//!
//! With `pi = M dq`, `z = (e, m, mu', mu'', u~)` and `y = b'z` the sum over joints (or over eigenvectors of M) of
//!
//! ```text
//! V = p dq pi + 2 pi y + z'S z
//! ```
//!
//! changes along the loop, where `pi' = C'dq + force` and `2 y'C'dq = dq'(sum_j y_j dM/dq_j) dq` is the cubic term, as the sum of
//!
//! ```text
//! dV/dt = 2 p dq force_p + 2 y force + 2 pi b'z' + 2 z'S z' + cubic term,     z' = A z + B dq
//! ```
//!
//! `force_p` is the force without what the potential in V cancels. Without gravity compensation V has the potential
//! `2p (U(q) - U(goal) - g(goal)'e)` besides, between `-p k_g |e|^2` and `p k_g |e|^2`. The forms are over any coordinates in which these
//! quantities are linear, and over any field. [`region`](super::region) and [`joint_region`](super::joint_region) say which
//! coordinates they take and what follows.

use num_rational::BigRational;
use num_traits::{One, Zero};

use super::{LoopBox, family_box};
use crate::aic::{Controller, STATES};
use crate::document::Document;
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::number::{Number, positive, unit_interval};
use crate::quantity::require;

/// Entries of the upper triangle of S.
pub const TRIANGLE: usize = STATES * (STATES + 1) / 2;

/// Index of `S[i][j]` in its upper triangle, row by row.
#[must_use]
pub fn triangle(i: usize, j: usize) -> usize {
    let (i, j) = (i.min(j), i.max(j));
    i * STATES - i * (i + 1) / 2 + j
}

/// `p`, `b` and `S`: the weights of V in one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Energy<T> {
    /// Weight of the kinetic energy.
    pub p: T,
    /// Weights of the cross terms.
    pub b: [T; STATES],
    /// Upper triangle of S, row by row.
    pub s: [T; TRIANGLE],
}

/// The quantities of one joint as linear forms of a proof's coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Quantities<T> {
    pub(crate) order: usize,
    pub(crate) dq: Row<T>,
    /// `M dq`.
    pub(crate) pi: Row<T>,
    pub(crate) z: Vec<Row<T>>,
}

impl<T: Field> Energy<T> {
    fn s(&self, i: usize, j: usize) -> &T {
        &self.s[triangle(i, j)]
    }

    pub(crate) fn y(&self, at: &Quantities<T>) -> Row<T> {
        Row::combination(at.order, &self.b, &at.z)
    }

    /// `z'S r` for a list of rows r.
    pub(crate) fn add_weighted(&self, form: &mut Form<T>, scale: &T, at: &Quantities<T>, rows: &[Row<T>]) {
        for i in 0..STATES {
            let weights: Vec<T> = (0..STATES).map(|j| self.s(i, j).clone()).collect();
            form.add(scale, &at.z[i], &Row::combination(at.order, &weights, rows));
        }
    }

    /// V without its potential.
    pub(crate) fn value(&self, at: &Quantities<T>) -> Form<T> {
        let mut form = Form::zero(at.order);
        form.add(&self.p, &at.dq, &at.pi);
        form.add(&T::fraction(2, 1), &at.pi, &self.y(at));
        self.add_weighted(&mut form, &T::one(), at, &at.z);
        form
    }

    /// dV/dt without the cubic term. `force` acts on the joint; `powered` is the force without what V's potential cancels.
    pub(crate) fn change(
        &self,
        at: &Quantities<T>,
        controller: &Controller<T>,
        force: &Row<T>,
        powered: &Row<T>,
    ) -> Form<T> {
        let two = T::fraction(2, 1);
        let z_dot: Vec<Row<T>> = (0..STATES)
            .map(|i| Row::combination(at.order, &controller.a[i], &at.z).plus(&controller.b[i], &at.dq))
            .collect();
        let mut form = Form::zero(at.order);
        form.add(&(two.clone() * &self.p), &at.dq, powered);
        form.add(&two, &self.y(at), force);
        form.add(&two, &at.pi, &Row::combination(at.order, &self.b, &z_dot));
        self.add_weighted(&mut form, &two, at, &z_dot);
        form
    }

    /// `V = s e0^2` at rest at distance e0 from the goal, beliefs at the measurement and `u~ = 0`, without the potential.
    pub(crate) fn start_weight(&self) -> T {
        self.s(0, 0).clone() + self.s(0, 1) + self.s(0, 1) + self.s(1, 1)
    }
}

impl Energy<BigRational> {
    /// A witness's weights as numbers.
    pub(crate) fn of(p: &Number, b: &[Number; STATES], s: &[Number]) -> Result<Self, Flaw> {
        let s: &[Number; TRIANGLE] =
            s.try_into().map_err(|_| Flaw::Length { quantity: "s", found: s.len(), expected: TRIANGLE })?;
        require("p", p, positive(p.value()), "a positive number")?;
        let value = |x: &Number| x.value().clone();
        Ok(Self { p: value(p), b: b.each_ref().map(value), s: s.each_ref().map(value) })
    }
}

/// A state that a region bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// `e`.
    Position,
    /// `u~`.
    Torque,
}

impl State {
    fn index(self) -> usize {
        match self {
            Self::Position => 0,
            Self::Torque => STATES - 1,
        }
    }
}

/// A point of the search: weights, bounds and multipliers.
#[derive(Clone, Debug)]
pub struct Point<T> {
    /// `p, b, S`.
    pub energy: Energy<T>,
    /// `rho^2`: `|y| <= rho` where `V <= 1`.
    pub rho_squared: T,
    /// `rho theta`, the share of `rho` on which the cubic term is bounded by `k_c`.
    pub absolute: T,
    /// `rho (1 - theta)`, the share on which it is bounded by `k_r`.
    pub relative: T,
    /// Multiplier of what is known between bounds: the friction in `region`, the inertia matrix in `joint-region`.
    pub interval_multiplier: T,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: T,
    /// Multiplier of the torque at the start.
    pub start_multiplier: T,
}

/// A joint's controller, and the constants that hold for all joints.
#[derive(Clone, Debug)]
pub struct Plant<T> {
    /// The controller.
    pub controller: Controller<T>,
    /// Largest gravity stiffness, zero when gravity is compensated.
    pub stiffness: T,
    /// Whether gravity acts.
    pub has_gravity: bool,
    /// `k_c`.
    pub coriolis: T,
    /// `k_r`, when it is known.
    pub coriolis_relative: Option<T>,
}

impl Plant<BigRational> {
    pub(crate) fn new(document: &Document, controller: Controller<BigRational>) -> Self {
        let bounds = &document.constants.bounds;
        let LoopBox { stiffness: [_, stiffness], .. } = family_box(document);
        Self {
            controller,
            has_gravity: !stiffness.value().is_zero(),
            stiffness: stiffness.value().clone(),
            coriolis: bounds.k_c_kg_m2.value().clone(),
            coriolis_relative: bounds.k_r.as_ref().map(|k_r| k_r.value().clone()),
        }
    }

    pub(crate) fn map<T>(&self, convert: impl Fn(&BigRational) -> T) -> Plant<T> {
        Plant {
            controller: self.controller.map(&convert),
            stiffness: convert(&self.stiffness),
            has_gravity: self.has_gravity,
            coriolis: convert(&self.coriolis),
            coriolis_relative: self.coriolis_relative.as_ref().map(&convert),
        }
    }

    /// The shares of `rho` that the two bounds of the cubic term take: without the relative one the absolute takes all.
    pub(crate) fn shares(&self, rho: &Number, theta: &Number) -> Result<[BigRational; 2], Flaw> {
        require("rho", rho, positive(rho.value()), "a positive number")?;
        require("theta", theta, unit_interval(theta.value()), "a share in [0, 1]")?;
        if self.coriolis_relative.is_none() && !theta.value().is_one() {
            return Err(Flaw::Missing { constant: "k_r" });
        }
        let absolute = theta.value() * rho.value();
        Ok([absolute.clone(), rho.value() - absolute])
    }
}

impl<T: Field> Plant<T> {
    /// A lower bound of V: its potential is at least `-p k_g |e|^2`.
    fn least_value(&self, point: &Point<T>, at: &Quantities<T>) -> Form<T> {
        let mut form = point.energy.value(at);
        form.add(&-(point.energy.p.clone() * &self.stiffness), &at.z[0], &at.z[0]);
        form
    }

    /// `V + 2 y c + rho^2 c^2` with the last coordinate c: positive definite where `|y| < rho sqrt V`.
    pub(crate) fn containment(&self, point: &Point<T>, at: &Quantities<T>) -> Form<T> {
        let mut form = self.least_value(point, at);
        let last = Row::coordinate(at.order, at.order - 1, T::one());
        form.add(&T::fraction(2, 1), &point.energy.y(at), &last);
        form.add(&point.rho_squared, &last, &last);
        form
    }

    /// V less `inverse_square` times the square of a state.
    pub(crate) fn within(&self, point: &Point<T>, at: &Quantities<T>, state: State, inverse_square: &T) -> Form<T> {
        let mut form = self.least_value(point, at);
        let state = &at.z[state.index()];
        form.add(&-inverse_square.clone(), state, state);
        form
    }

    /// `dV/dt + 2 rate V` with the bound of the cubic term and the gravity residue's multiplier. The joint feels `friction dq + f` and w.
    pub(crate) fn change(
        &self,
        point: &Point<T>,
        at: &Quantities<T>,
        [friction, rate]: [&T; 2],
        [f, w]: [&Row<T>; 2],
    ) -> Form<T> {
        let minus = -T::one();
        let powered = at.z[STATES - 1].plus(&-friction.clone(), &at.dq).plus(&minus, f);
        let mut form = point.energy.change(at, &self.controller, &powered.plus(&minus, w), &powered);
        // The cubic term is at most 2 rho (theta k_c |dq|^2 + (1 - theta) k_r dq'M dq).
        let two = T::fraction(2, 1);
        form.add(&(two.clone() * &point.absolute * &self.coriolis), &at.dq, &at.dq);
        if let Some(k_r) = &self.coriolis_relative {
            form.add(&(two.clone() * &point.relative * k_r), &at.dq, &at.pi);
        }
        // V's potential is at most p k_g |e|^2.
        let twice_rate = two * rate;
        form.add_form(&twice_rate, &point.energy.value(at));
        form.add(&(twice_rate * &point.energy.p * &self.stiffness), &at.z[0], &at.z[0]);
        // k_g^2 |e|^2 - |w|^2 >= 0.
        let squared = self.stiffness.clone() * &self.stiffness * &point.gravity_multiplier;
        form.add(&squared, &at.z[0], &at.z[0]);
        form.add(&-point.gravity_multiplier.clone(), w, w);
        form
    }

    /// Over (e0, u~0), the latter where gravity acts: `e = m = e0`, the rest zero, `|u~0| <= k_g |e0|`; positive definite when
    /// `V < inverse_square |e0|^2`.
    pub fn start(&self, point: &Point<T>, inverse_square: &T) -> Form<T> {
        let Energy { p, .. } = &point.energy;
        let bound = inverse_square.clone() - &point.energy.start_weight() - &(p.clone() * &self.stiffness);
        if !self.has_gravity {
            return Form(vec![vec![bound]]);
        }
        let multiplier = &point.start_multiplier;
        let bound = bound - &(self.stiffness.clone() * &self.stiffness * multiplier);
        let cross = -(point.energy.s(0, 4).clone() + point.energy.s(1, 4));
        Form(vec![vec![bound, cross.clone()], vec![cross, multiplier.clone() - point.energy.s(4, 4)]])
    }
}
