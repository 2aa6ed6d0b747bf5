//! Composite-rigid-body algorithm: the joint-space inertia matrix, `T(q, dq) = 1/2 dq' M(q) dq`.
//!
//! `M_ij = S_i . I_j^C S_j` for i <= j, in the base frame; the rotor inertia is added to the diagonal.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | M | [`mass_matrix`] | N x N | kg m^2 |
//! | S_i | `axis` | 6 | 1, m |
//! | I_j^C | `composites` | ten numbers | kg, kg m, kg m^2 |
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms* (2008), ch. 6. Limits: fixed base, revolute joints.

use certune_linsys::{JointMatrix, Joints, Real};

use crate::base::Base;
use crate::model::Model;

/// Joint-space inertia `M(q)`, rotor inertia included, kg m^2, base to tip.
///
/// Symmetric to the bit and positive definite for every valid arm. O(N^2), no heap.
pub fn mass_matrix<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> JointMatrix<N, T> {
    let base = Base::at(model, q);
    let composite = base.composites(model);
    let mut mass = JointMatrix::<N, T>::zeros();
    for j in 0..N {
        let momentum = composite[j].apply(&base.axis[j]);
        for i in 0..=j {
            let entry = base.axis[i].power(&momentum);
            mass[(i, j)] = entry;
            mass[(j, i)] = entry;
        }
        mass[(j, j)] += model.rotor_inertia[j];
    }
    mass
}
