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
//! `force_p` is the force without what the potential in V cancels. The forms are over any coordinates in which these quantities are
//! linear, and over any field.

use crate::aic::{Controller, STATES};
use crate::form::{Field, Form, Row};

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
    fn add_weighted(&self, form: &mut Form<T>, scale: &T, at: &Quantities<T>, rows: &[Row<T>]) {
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

    /// Minus V's potential-free part at the start, over `(e0, u~0)`, beside a bound: `[[bound - s, -c], [-c, torque - S_uu]]`.
    pub(crate) fn start_excess(&self, bound: T, torque: T) -> Form<T> {
        let cross = -(self.s(0, 4).clone() + self.s(1, 4));
        Form(vec![vec![bound - &self.start_weight(), cross.clone()], vec![cross, torque - self.s(4, 4)]])
    }
}
