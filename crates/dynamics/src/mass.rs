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
use crate::spatial::{Twist, Wrench};

/// Joint-space inertia `M(q)`, rotor inertia included, kg m^2, base to tip.
///
/// Symmetric to the bit and positive definite for every valid arm. O(N^2), no heap.
pub fn mass_matrix<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> JointMatrix<N, T> {
    let base = Base::at(model, q);
    let composite = base.composites(model);
    from_momenta(model, &base.axis, &core::array::from_fn(|j| composite[j].apply(&base.axis[j])))
}

/// M from the joint axes S_j and the momenta `I_j^C S_j`.
#[inline]
pub(crate) fn from_momenta<const N: usize, T: Real>(
    model: &Model<N, T>,
    axis: &[Twist<T>; N],
    momenta: &[Wrench<T>; N],
) -> JointMatrix<N, T> {
    let mut mass = JointMatrix::<N, T>::zeros();
    for j in 0..N {
        for i in 0..=j {
            let entry = axis[i].power(&momenta[j]);
            mass[(i, j)] = entry;
            mass[(j, i)] = entry;
        }
        mass[(j, j)] += model.rotor_inertia[j];
    }
    mass
}
