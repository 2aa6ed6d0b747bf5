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
//! dID_i/dq_j = S_i . (I_l^C Q_j + 2 B_l^C P_j [+ S_j x* f_j^C  if i < j])
//! ```
//!
//! `2 B` of one body at velocity v = (w; u) with momentum (n; f) acts on the angular part alone:
//! `2 B (a; b) = (-2 (w^ S + h^ u^) a; -2 f x a)`, S = tr(I)/2 1 - I its second moments, so a subtree's B is a 3x3 block and a vector.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | v_i, a_i | `velocity`, `acceleration` (gravity as -a_g of the base) | 6 | rad/s, rad/s^2, .. |
//! | I^C, f^C | `composite`, `force` | ten numbers, 6 | kg, .. ; N m, N |
//! | B^C | `Bias` | 3x3 and 3 | kg m^2/s, kg m/s |
//!
//! Source: Singh, Russell & Wensing, "Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra" (2022);
//! Carpentier & Mansard, "Analytical derivatives of rigid body dynamics algorithms" (2018). Limits: O(N^3); M must be positive definite.

use certune_linsys::{JointMatrix, Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::base::Base;
use crate::coriolis::coriolis_matrix;
use crate::forward::forward_dynamics;
use crate::friction::friction_slope;
use crate::mass::mass_matrix;
use crate::model::{Model, State};
use crate::spatial::{BodyInertia, Twist, Wrench, apply, cross, product};

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

/// `2 B` of a body or a subtree, as in the module's text: a 3x3 block for the moment and `-2 f` for the force.
#[derive(Clone, Copy)]
struct Bias<T: Real> {
    block: Matrix3<T>,
    momentum: Vector3<T>,
}

impl<T: Real> Bias<T> {
    fn of(body: &BodyInertia<T>, velocity: &Twist<T>) -> Self {
        let half_trace = body.about_origin.trace() * T::from_f64(0.5);
        let mut second = body.about_origin.scaled(-T::one());
        second.xx += half_trace;
        second.yy += half_trace;
        second.zz += half_trace;
        let o = T::zero();
        let skew = |a: &Vector3<T>| Matrix3::new(o, -a.z, a.y, a.z, o, -a.x, -a.y, a.x, o);
        let block = product(&skew(&velocity.angular), &second.to_matrix())
            + product(&skew(&body.first_moment), &skew(&velocity.linear));
        Self { block: block * T::from_f64(-2.0), momentum: body.apply(velocity).force * T::from_f64(-2.0) }
    }

    fn apply(&self, b: &Twist<T>) -> Wrench<T> {
        Wrench { moment: apply(&self.block, &b.angular), force: cross(&self.momentum, &b.angular) }
    }
}

/// `d ID / d q` at `(q, dq, ddq)`, N m/rad.
fn inverse_dynamics_dq<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    ddq: &Joints<N, T>,
) -> JointMatrix<N, T> {
    let base = Base::at(model, &at.q);
    let mut composite = base.inertias(model);
    let mut bias = [Bias { block: Matrix3::zeros(), momentum: Vector3::zeros() }; N];
    let mut force = [Wrench::zero(); N];
    let mut first = [Twist::zero(); N];
    let mut second = [Twist::zero(); N];
    let (mut v, mut a) = (Twist::zero(), Twist { angular: Vector3::zeros(), linear: -model.gravity });
    for i in 0..N {
        let axis = &base.axis[i];
        first[i] = v.carry(axis);
        second[i] = a.carry(axis).plus(&v.carry(&first[i]));
        a = a.plus(&axis.scaled(ddq[i])).plus(&first[i].scaled(at.dq[i]));
        v = v.plus(&axis.scaled(at.dq[i]));
        bias[i] = Bias::of(&composite[i], &v);
        force[i] = composite[i].apply(&a).plus(&v.carry_wrench(&composite[i].apply(&v)));
    }
    for i in (1..N).rev() {
        composite[i - 1] = composite[i - 1].plus(&composite[i]);
        bias[i - 1].block += bias[i].block;
        bias[i - 1].momentum += bias[i].momentum;
        force[i - 1] = force[i - 1].plus(&force[i]);
    }
    let mut derivative = JointMatrix::<N, T>::zeros();
    for j in 0..N {
        let carried = base.axis[j].carry_wrench(&force[j]);
        let own = composite[j].apply(&second[j]).plus(&bias[j].apply(&first[j]));
        let above = own.plus(&carried);
        for i in 0..j {
            derivative[(i, j)] = base.axis[i].power(&above);
        }
        derivative[(j, j)] = base.axis[j].power(&own);
        for i in j + 1..N {
            let below = composite[i].apply(&second[j]).plus(&bias[i].apply(&first[j]));
            derivative[(i, j)] = base.axis[i].power(&below);
        }
    }
    derivative
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

/// How the acceleration changes with position, velocity and torque at `at` under `tau` (N m). O(N^3), no heap.
pub fn linearise<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
) -> Linearisation<N, T> {
    let ddq = forward_dynamics(model, at, tau);
    let inverse = inverse_of_positive(&mass_matrix(model, &at.q));
    let by_position = inverse_dynamics_dq(model, at, &ddq);
    let mut by_velocity = coriolis_matrix(model, at) * T::from_f64(2.0);
    let slope = friction_slope(model, &at.dq);
    for i in 0..N {
        by_velocity[(i, i)] += slope[i];
    }
    Linearisation { ddq, ddq_dq: -(inverse * by_position), ddq_ddq: -(inverse * by_velocity), ddq_dtau: inverse }
}
