//! Composite-rigid-body algorithm: the joint-space inertia matrix, `T(q, dq) = 1/2 dq' M(q) dq`.
//!
//! `M_ij = S_i . I_j^C S_j` for i <= j; the rotor inertia is added to the diagonal. In folded link frames S is z, so the momentum `I_j^C S_j` is a column, and an entry the z of
//! its moment on the way to the base. In the base's axes, from the description's own numbers, the same is a scalar product.
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | M | [`mass_matrix`] | N x N | kg m^2 |
//! | S_i | `axis` | 6 | 1, m |
//! | I_j^C | `composite` | ten numbers | kg, kg m, kg m^2 |
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms* (2008), ch. 6. Limits: fixed base, revolute joints.

use certune_linsys::{JointMatrix, Joints, Real};

use crate::base::Base;
use crate::local::{Body, Passage, V3};
use crate::model::Model;
use crate::spatial::{BodyInertia, Twist, Wrench};

/// Joint-space inertia `M(q)`, rotor inertia included, kg m^2, base to tip.
///
/// Symmetric to the bit and positive definite for every valid arm. O(N^2), no heap.
pub fn mass_matrix<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> JointMatrix<N, T> {
    let mut passages = [Passage::zero(); N];
    for i in 0..N {
        passages[i] = model.chain[i].passage(q[i]);
    }
    let mut mass = JointMatrix::<N, T>::zeros();
    let mut beyond: Option<Body<T>> = None;
    for j in (0..N).rev() {
        let own = Body::of(&model.chain[j].body);
        let composite = beyond.map_or(own, |beyond| own.plus(&beyond));
        let (inertia, h) = (&composite.about_origin, &composite.first_moment);
        // What joint j carries, turning at unit speed.
        let mut moment = V3 { x: inertia.xz, y: inertia.yz, z: inertia.zz };
        let mut force = V3 { x: -h.y, y: h.x, z: T::zero() };
        mass[(j, j)] = moment.z + model.rotor_inertia[j];
        for i in (0..j).rev() {
            let passage = passages[i + 1];
            force = passage.to_parent(&force);
            moment = passage.to_parent(&moment) + V3::of(&model.chain[i + 1].position).cross(&force);
            mass[(i, j)] = moment.z;
            mass[(j, i)] = moment.z;
        }
        beyond = Some(composite.to_parent(passages[j], &V3::of(&model.chain[j].position)));
    }
    mass
}

/// [`mass_matrix`] from the description's own numbers, in the base's axes: folding rounds, and an enclosure must enclose the arm that was described.
pub fn mass_matrix_as_described<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> JointMatrix<N, T> {
    let base = Base::at(model, q);
    let mut mass = JointMatrix::<N, T>::zeros();
    let mut beyond: Option<BodyInertia<T>> = None;
    for j in (0..N).rev() {
        let own = model.links[j].body.seen_from(&base.rotation[j], &base.origin[j]);
        let composite = beyond.map_or(own, |beyond| own.plus(&beyond));
        fill(&mut mass, j, &base.axis, &composite.apply(&base.axis[j]));
        mass[(j, j)] += model.rotor_inertia[j];
        beyond = Some(composite);
    }
    mass
}

/// Row and column j of M as far as the diagonal, from the momentum `I_j^C S_j`.
#[inline(always)]
fn fill<const N: usize, T: Real>(mass: &mut JointMatrix<N, T>, j: usize, axis: &[Twist<T>; N], momentum: &Wrench<T>) {
    for i in 0..=j {
        let entry = axis[i].power(momentum);
        mass[(i, j)] = entry;
        mass[(j, i)] = entry;
    }
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
        fill(&mut mass, j, axis, &momenta[j]);
        mass[(j, j)] += model.rotor_inertia[j];
    }
    mass
}
