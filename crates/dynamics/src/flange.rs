//! Where joints and flange are, and how the flange moves.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | o_i | [`joint_origins`] | N x 3 | m |
//! | x, R | [`flange_pose`] | 3, 3x3 | m, 1 |
//! | J: `(v; w) = J dq` | [`flange_jacobian`] | 6 x N, linear rows first | m/rad, 1 |
//!
//! `J_i = (z_i x (x - o_i); z_i)` in base axes; a force f at the flange adds the joint torque `J' (f; 0)`. Source: Featherstone 2008, ch. 4.

use certune_linsys::{Joints, Real};
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::base::Base;
use crate::model::Model;
use crate::spatial::{apply, cross, product};

fn pose<const N: usize, T: Real>(model: &Model<N, T>, base: &Base<N, T>) -> (Vector3<T>, Matrix3<T>) {
    match (base.origin.last(), base.rotation.last()) {
        (Some(origin), Some(rotation)) => {
            (origin + apply(rotation, &model.flange_position), product(rotation, &model.flange_rotation))
        }
        _ => (model.flange_position, model.flange_rotation),
    }
}

/// Positions in m of the joint frames' origins in the base frame, base to tip, at `q` in rad: what a stick figure of the arm is drawn by. O(N), no heap.
pub fn joint_origins<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> [Vector3<T>; N] {
    Base::at(model, q).origin
}

/// Position in m and axes (columns) of the flange in the base frame, at `q` in rad.
pub fn flange_pose<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> (Vector3<T>, Matrix3<T>) {
    pose(model, &Base::at(model, q))
}

/// The flange's velocity per joint velocity: linear rows (m/rad) first, then angular, base axes. O(N), no heap.
pub fn flange_jacobian<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> SMatrix<T, 6, N> {
    let base = Base::at(model, q);
    let (position, _) = pose(model, &base);
    let mut jacobian = SMatrix::<T, 6, N>::zeros();
    for i in 0..N {
        let z = &base.axis[i].angular;
        let linear = cross(z, &(position - base.origin[i]));
        for r in 0..3 {
            jacobian[(r, i)] = linear[r];
            jacobian[(r + 3, i)] = z[r];
        }
    }
    jacobian
}
