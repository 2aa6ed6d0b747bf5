//! Gravity torque and its Jacobian, the Hessian of the potential energy.
//!
//! With the subtree's mass `m_j`, first moment `h_j` and the joint's `z_j`, `o_j`, in the base frame:
//!
//! ```text
//! g_i      = -z_i . ((h_i - m_i o_i) x a_g)          = dU/dq_i
//! dg_i/dq_j = -z_i . ((z_j x (h_j - m_j o_j)) x a_g),  i <= j, and symmetric
//! ```
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | a_g | acceleration of a falling body | 3 | m/s^2 |
//! | g | [`gravity_torque`] | N | N m |
//! | dg/dq | [`gravity_jacobian`] | N x N | N m/rad |
//!
//! Source: `U = -sum_k a_g . (m_k o_k + R_k h_k)`, differentiated twice; turning joint j moves the subtree's first moment by `z_j x (h_j - m_j o_j)`.
//! Limits: a uniform field.

use certune_linsys::{JointMatrix, Joints, Real};
use nalgebra::Vector3;

use crate::base::Base;
use crate::local::V3;
use crate::model::Model;
use crate::posture::Posture;
use crate::spatial::{apply, cross, dot};

/// First moment of each subtree about its own joint's origin, in base axes.
#[inline]
fn moments<const N: usize, T: Real>(model: &Model<N, T>, base: &Base<N, T>) -> [Vector3<T>; N] {
    let mut about_joint = [Vector3::zeros(); N];
    let (mut mass, mut moment) = (T::zero(), Vector3::zeros());
    for i in (0..N).rev() {
        let body = &model.links[i].body;
        // `moment` refers to the child's origin until here.
        if i + 1 < N {
            moment += (base.origin[i + 1] - base.origin[i]) * mass;
        }
        moment += apply(&base.rotation[i], &body.first_moment);
        mass += body.mass;
        about_joint[i] = moment;
    }
    about_joint
}

/// Torque that holds the arm still in `q` (rad): `g(q)`, N m. O(N), no heap.
///
/// In link frames, where the joint's axis is z: `g_i = -(h x a_g)_z` with the subtree's first moment h about the joint's origin.
#[inline(always)]
pub fn gravity_torque<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> Joints<N, T> {
    Posture::at(model, q).gravity_torque(model)
}

impl<const N: usize, T: Real> Posture<N, T> {
    /// [`gravity_torque`] in this posture. No heap.
    #[inline(always)]
    pub fn gravity_torque(&self, model: &Model<N, T>) -> Joints<N, T> {
        let mut fall = [[T::zero(); 2]; N];
        let mut falling = V3::of(&model.folded_gravity);
        for i in 0..N {
            falling = self.passage(model, i).to_child(&falling);
            fall[i] = [falling.x, falling.y];
        }
        let mut torque = Joints::<N, T>::zeros();
        let (mut mass, mut moment) = (T::zero(), V3::zero());
        for i in (0..N).rev() {
            let hinge = &model.chain[i];
            moment = moment + V3::of(&hinge.body.first_moment);
            mass += hinge.body.mass;
            let [x, y] = fall[i];
            torque[i] = moment.y.mul_add(x, -(moment.x * y));
            moment = V3::of(&hinge.position).scaled_plus(mass, &self.passage(model, i).to_parent(&moment));
        }
        torque
    }
}

/// `dg/dq` at `q` (rad): symmetric to the bit, N m/rad. O(N^2), no heap.
pub fn gravity_jacobian<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> JointMatrix<N, T> {
    let base = Base::at(model, q);
    let moment = moments(model, &base);
    let mut hessian = JointMatrix::<N, T>::zeros();
    for j in 0..N {
        let moved = cross(&cross(&base.axis[j].angular, &moment[j]), &model.gravity);
        for i in 0..=j {
            let entry = -dot(&base.axis[i].angular, &moved);
            hessian[(i, j)] = entry;
            hessian[(j, i)] = entry;
        }
    }
    hessian
}
