//! The arm's linearisation about any state, in closed form.
//!
//! With `ID(q, dq, ddq)` the inverse dynamics, and ddq the acceleration that tau produces:
//!
//! ```text
//! d ddq/d q  = -M^-1 dID/dq,   d ddq/d dq = -M^-1 (2 C + friction slope),   d ddq/d tau = M^-1
//! ```
//!
//! and, in the base frame, for the column j of dID/dq and `l = max(i, j)`:
//!
//! ```text
//! P_j = v_(j-1) x S_j,   Q_j = a_(j-1) x S_j + v_(j-1) x P_j
//! dID_i/dq_j  = S_i . (I_l^C Q_j + 2 B_l^C P_j [+ S_j x* f_j^C  if i < j])
//! dID_i/ddq_j = S_i . (2 I_l^C P_j + 2 B_l^C S_j) = 2 C_ij
//! M_ij        = S_i . I_l^C S_j
//! ```
//!
//! Below the diagonal `S_i . I_i^C` and `S_i . 2 B_i^C` are formed once a row, so that an entry costs two scalar products.
//!
//! `2 B` of one body at velocity v = (w; u) with momentum (n; f) acts on the angular part alone:
//! `2 B (a; b) = (-2 (w^ S + h^ u^) a; -2 f x a)`, S = tr(I)/2 1 - I its second moments, so a subtree's B is a 3x3 block and a vector.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | v_i, a_i | `velocity`, `acceleration` (gravity as -a_g of the base) | 6 | rad/s, rad/s^2, .. |
//! | P_j, Q_j | `first`, `second` | 6 | |
//! | I^C, f^C | `composite`, `force` | ten numbers, 6 | kg, .. ; N m, N |
//! | B^C | `Bias` | 3x3 and 3 | kg m^2/s, kg m/s |
//!
//! Source: Singh, Russell & Wensing, "Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra" (2022);
//! Carpentier & Mansard, "Analytical derivatives of rigid body dynamics algorithms" (2018). The derivatives of the torque cost O(N^2), the inverse of
//! M and its two products O(N^3). Limits: M must be positive definite.

use certune_linsys::{JointMatrix, Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::base::Base;
use crate::friction::{friction_slope, friction_torque};
use crate::mass::from_momenta;
use crate::model::{Model, State};
use crate::spatial::{BodyInertia, Twist, Wrench, apply, apply_transposed, cross, dot, product};

/// Derivatives of the joint acceleration at one state and torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearisation<const N: usize, T: Real = f64> {
    /// The acceleration there, rad/s^2.
    pub ddq: Joints<N, T>,
    /// `d ddq / d q`, 1/s^2.
    pub ddq_dq: JointMatrix<N, T>,
    /// `d ddq / d dq`, 1/s.
    pub ddq_ddq: JointMatrix<N, T>,
    /// `d ddq / d tau`, the inverse of M, 1/(kg m^2).
    pub ddq_dtau: JointMatrix<N, T>,
}

/// Derivatives of the torque that produces an acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueDerivatives<const N: usize, T: Real = f64> {
    /// `d tau / d q`, N m/rad.
    pub dq: JointMatrix<N, T>,
    /// `d tau / d dq`: twice the Coriolis matrix and the slope of the friction on the diagonal, N m s/rad.
    pub ddq: JointMatrix<N, T>,
}

/// `2 B` of a body or a subtree, as in the module's text: a 3x3 block for the moment and `-2 f` for the force.
#[derive(Clone, Copy)]
struct Bias<T: Real> {
    block: Matrix3<T>,
    momentum: Vector3<T>,
}

impl<T: Real> Bias<T> {
    fn of(body: &BodyInertia<T>, velocity: &Twist<T>, force: &Vector3<T>) -> Self {
        let minus_two = T::from_f64(-2.0);
        let half_trace = body.about_origin.trace() * T::from_f64(0.5);
        let mut second = body.about_origin.scaled(-T::one());
        second.xx += half_trace;
        second.yy += half_trace;
        second.zz += half_trace;
        let o = T::zero();
        let skew = |a: &Vector3<T>| Matrix3::new(o, -a.z, a.y, a.z, o, -a.x, -a.y, a.x, o);
        let block = product(&skew(&velocity.angular), &second.to_matrix())
            + product(&skew(&body.first_moment), &skew(&velocity.linear));
        Self { block: block * minus_two, momentum: force * minus_two }
    }

    fn apply(&self, b: &Twist<T>) -> Wrench<T> {
        Wrench { moment: apply(&self.block, &b.angular), force: cross(&self.momentum, &b.angular) }
    }

    /// What gives `a . (2 B b)` when multiplied with the angular part of b.
    fn seen_by(&self, a: &Twist<T>) -> Vector3<T> {
        apply_transposed(&self.block, &a.angular) + cross(&a.linear, &self.momentum)
    }
}

/// One sweep at `(q, dq)`: what does not depend on the acceleration.
struct Sweep<const N: usize, T: Real> {
    axis: [Twist<T>; N],
    /// Each link's own inertia, and that of all that hangs on it.
    inertia: [BodyInertia<T>; N],
    composite: [BodyInertia<T>; N],
    bias: [Bias<T>; N],
    /// Velocity of the parent, P, and for ddq = 0 the parent's acceleration and the link's force.
    parent_velocity: [Twist<T>; N],
    first: [Twist<T>; N],
    parent_acceleration: [Twist<T>; N],
    force: [Wrench<T>; N],
}

impl<const N: usize, T: Real> Sweep<N, T> {
    fn new(model: &Model<N, T>, at: &State<N, T>) -> Self {
        let base = Base::at(model, &at.q);
        let inertia = base.inertias(model);
        let mut sweep = Self {
            axis: base.axis,
            inertia,
            composite: inertia,
            bias: [Bias { block: Matrix3::zeros(), momentum: Vector3::zeros() }; N],
            parent_velocity: [Twist::zero(); N],
            first: [Twist::zero(); N],
            parent_acceleration: [Twist::zero(); N],
            force: [Wrench::zero(); N],
        };
        let (mut v, mut a) = (Twist::zero(), Twist { angular: Vector3::zeros(), linear: -model.gravity });
        for i in 0..N {
            let axis = &base.axis[i];
            sweep.parent_velocity[i] = v;
            sweep.parent_acceleration[i] = a;
            sweep.first[i] = v.carry(axis);
            a = a.plus(&sweep.first[i].scaled(at.dq[i]));
            v = v.plus(&axis.scaled(at.dq[i]));
            let momentum = inertia[i].apply(&v);
            sweep.bias[i] = Bias::of(&inertia[i], &v, &momentum.force);
            sweep.force[i] = inertia[i].apply(&a).plus(&v.carry_wrench(&momentum));
        }
        for i in (1..N).rev() {
            sweep.composite[i - 1] = sweep.composite[i - 1].plus(&sweep.composite[i]);
            sweep.bias[i - 1].block += sweep.bias[i].block;
            sweep.bias[i - 1].momentum += sweep.bias[i].momentum;
        }
        sweep
    }

    /// The rigid links' torque for ddq = 0, N m.
    fn torque(&self) -> Joints<N, T> {
        let mut sum = Wrench::zero();
        let mut torque = Joints::zeros();
        for i in (0..N).rev() {
            sum = sum.plus(&self.force[i]);
            torque[i] = self.axis[i].power(&sum);
        }
        torque
    }

    /// `I_i^C S_i`.
    fn momenta(&self) -> [Wrench<T>; N] {
        core::array::from_fn(|i| self.composite[i].apply(&self.axis[i]))
    }

    /// The torque's derivatives at the acceleration `ddq`, friction included.
    fn derivatives(
        &self,
        model: &Model<N, T>,
        dq: &Joints<N, T>,
        ddq: &Joints<N, T>,
        momenta: &[Wrench<T>; N],
    ) -> TorqueDerivatives<N, T> {
        let two = T::from_f64(2.0);
        let axis = &self.axis;
        let mut force = self.force;
        let mut second = [Twist::zero(); N];
        // What ddq adds to the accelerations for ddq = 0.
        let mut added = Twist::zero();
        for i in 0..N {
            second[i] = self.parent_acceleration[i]
                .plus(&added)
                .carry(&axis[i])
                .plus(&self.parent_velocity[i].carry(&self.first[i]));
            added = added.plus(&axis[i].scaled(ddq[i]));
            force[i] = force[i].plus(&self.inertia[i].apply(&added));
        }
        for i in (1..N).rev() {
            force[i - 1] = force[i - 1].plus(&force[i]);
        }
        let seen: [Vector3<T>; N] = core::array::from_fn(|i| self.bias[i].seen_by(&axis[i]));
        let mut by = TorqueDerivatives { dq: JointMatrix::zeros(), ddq: JointMatrix::zeros() };
        for j in 0..N {
            let (first, second) = (&self.first[j], &second[j]);
            let own = self.composite[j].apply(second).plus(&self.bias[j].apply(first));
            let above = own.plus(&axis[j].carry_wrench(&force[j]));
            let moving = self.composite[j].apply(&first.scaled(two)).plus(&self.bias[j].apply(&axis[j]));
            for i in 0..j {
                by.dq[(i, j)] = axis[i].power(&above);
                by.ddq[(i, j)] = axis[i].power(&moving);
            }
            by.dq[(j, j)] = axis[j].power(&own);
            by.ddq[(j, j)] = axis[j].power(&moving);
            for i in j + 1..N {
                by.dq[(i, j)] = second.power(&momenta[i]) + dot(&first.angular, &seen[i]);
                by.ddq[(i, j)] = first.power(&momenta[i]) * two + dot(&axis[j].angular, &seen[i]);
            }
        }
        let slope = friction_slope(model, dq);
        for i in 0..N {
            by.ddq[(i, i)] += slope[i];
        }
        by
    }
}

/// How the torque that produces `ddq` changes with position and velocity, friction included. `ddq` in rad/s^2; O(N^2), no heap.
pub fn inverse_dynamics_derivatives<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    ddq: &Joints<N, T>,
) -> TorqueDerivatives<N, T> {
    let sweep = Sweep::new(model, at);
    sweep.derivatives(model, &at.dq, ddq, &sweep.momenta())
}

/// The inverse of a symmetric positive definite matrix, by `L D L'`; symmetric to the bit.
fn inverse_of_positive<const N: usize, T: Real>(matrix: &JointMatrix<N, T>) -> JointMatrix<N, T> {
    let mut lower = *matrix;
    let mut reciprocal = Joints::<N, T>::zeros();
    let mut pivot = Joints::<N, T>::zeros();
    for j in 0..N {
        for k in 0..j {
            let weight = lower[(j, k)] * pivot[k];
            for i in j..N {
                let term = lower[(i, k)] * weight;
                lower[(i, j)] -= term;
            }
        }
        pivot[j] = lower[(j, j)];
        reciprocal[j] = T::one() / pivot[j];
        for i in j + 1..N {
            lower[(i, j)] *= reciprocal[j];
        }
    }
    // Columns of L^-1, then M^-1 = L^-T D^-1 L^-1.
    let mut unit = JointMatrix::<N, T>::identity();
    for c in 0..N {
        for i in c + 1..N {
            let mut sum = T::zero();
            for k in c..i {
                sum += lower[(i, k)] * unit[(k, c)];
            }
            unit[(i, c)] = -sum;
        }
    }
    let mut inverse = JointMatrix::<N, T>::zeros();
    for r in 0..N {
        for c in 0..=r {
            let mut sum = T::zero();
            for k in r..N {
                sum += unit[(k, r)] * reciprocal[k] * unit[(k, c)];
            }
            inverse[(r, c)] = sum;
            inverse[(c, r)] = sum;
        }
    }
    inverse
}

/// How the acceleration changes with position, velocity and torque at `at` under `tau` (N m). No heap.
pub fn linearise<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
) -> Linearisation<N, T> {
    let sweep = Sweep::new(model, at);
    let momenta = sweep.momenta();
    let inverse = inverse_of_positive(&from_momenta(model, &sweep.axis, &momenta));
    let ddq = inverse * (tau - sweep.torque() - friction_torque(model, &at.dq));
    let by = sweep.derivatives(model, &at.dq, &ddq, &momenta);
    Linearisation { ddq, ddq_dq: -(inverse * by.dq), ddq_ddq: -(inverse * by.ddq), ddq_dtau: inverse }
}
