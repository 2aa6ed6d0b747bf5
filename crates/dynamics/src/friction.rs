//! Friction at the joints: viscous, and Coulomb with a smooth reversal.
//!
//! `f_i = d_i dq_i + f_c,i tanh(dq_i / w)`, w = 0.01 rad/s.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | d | viscous friction of the model | N m s/rad |
//! | f_c | Coulomb friction of the model | N m |
//! | w | [`COULOMB_SPEED_RAD_PER_S`] | rad/s |
//!
//! The tangent makes the right side smooth, so that the arm has a linearisation everywhere; at 0.02 rad/s it is within 4 % of the sign. Limits: no stiction
//! (an arm creeps at up to w under loads below f_c), no dependence on load or temperature.

use certune_linsys::{Joints, Real};

use crate::model::Model;

/// Speed over which Coulomb friction reverses, rad/s.
pub const COULOMB_SPEED_RAD_PER_S: f64 = 0.01;

/// Friction torque `d dq + f_c tanh(dq / 0.01)`, N m, for `dq` in rad/s; it opposes `dq` when subtracted from the motor's torque.
#[inline(always)]
pub fn friction_torque<const N: usize, T: Real>(model: &Model<N, T>, dq: &Joints<N, T>) -> Joints<N, T> {
    let mut torque = *dq;
    for i in 0..N {
        torque[i] = joint_friction(model, i, dq[i]);
    }
    torque
}

/// [`friction_torque`] of one joint.
#[inline(always)]
pub(crate) fn joint_friction<const N: usize, T: Real>(model: &Model<N, T>, joint: usize, dq: T) -> T {
    let mut torque = model.viscous[joint] * dq;
    // An arm without Coulomb friction shall not pay for N hyperbolic tangents in each step.
    if model.has_coulomb_friction {
        torque += model.coulomb[joint] * (dq * T::from_f64(COULOMB_SPEED_RAD_PER_S.recip())).tanh();
    }
    torque
}

/// Slope of [`friction_torque`]: `d + f_c (1 - tanh^2(dq / 0.01)) / 0.01` per joint, N m s/rad.
pub fn friction_slope<const N: usize, T: Real>(model: &Model<N, T>, dq: &Joints<N, T>) -> Joints<N, T> {
    let per_speed = T::from_f64(COULOMB_SPEED_RAD_PER_S.recip());
    Joints::from_fn(|i, _| {
        let tanh = (dq[i] * per_speed).tanh();
        model.viscous[i] + model.coulomb[i] * per_speed * (T::one() - tanh * tanh)
    })
}
