//! The arm laid out in the base frame: one sweep that the closed-form matrices share.
//!
//! All six-vectors and inertias refer to the base frame and its origin, so a subtree's inertia is a plain sum and a body that is
//! carried along by joint j changes by `S_j x`.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | R_i, o_i | `rotation`, `origin` | link frame in the base | 1, m |
//! | S_i | `axis` | joint axis as a twist `(z_i; o_i x z_i)` | 1, m |
//! | I_i | `inertia` | link i's ten numbers | kg, kg m, kg m^2 |
//! | I_i^C | `composite` | sum of I_k over k >= i | same |
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms* (2008), ch. 2 and 6. Limits: moments refer to the base origin, so a result that
//! is small beside `m |o|^2` carries that rounding (1e-16 of it).

use certune_linsys::{Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::model::Model;
use crate::spatial::{BodyInertia, Twist, apply, cross, product, turn_about_z};

/// Poses, axes and inertias of all links in the base frame.
pub(crate) struct Base<const N: usize, T: Real> {
    pub rotation: [Matrix3<T>; N],
    pub origin: [Vector3<T>; N],
    pub axis: [Twist<T>; N],
}

impl<const N: usize, T: Real> Base<N, T> {
    /// Where the links are at `q`.
    #[inline]
    pub(crate) fn at(model: &Model<N, T>, q: &Joints<N, T>) -> Self {
        let mut base =
            Self { rotation: [Matrix3::zeros(); N], origin: [Vector3::zeros(); N], axis: [Twist::zero(); N] };
        let mut rotation = Matrix3::identity();
        let mut origin = Vector3::zeros();
        for i in 0..N {
            let link = &model.links[i];
            let (sin, cos) = q[i].sin_cos();
            origin += apply(&rotation, &link.position);
            rotation = turn_about_z(&product(&rotation, &link.rotation), sin, cos);
            let z = Vector3::new(rotation.m13, rotation.m23, rotation.m33);
            base.rotation[i] = rotation;
            base.origin[i] = origin;
            base.axis[i] = Twist { angular: z, linear: cross(&origin, &z) };
        }
        base
    }

    /// Each link's inertia about the base origin.
    #[inline]
    pub(crate) fn inertias(&self, model: &Model<N, T>) -> [BodyInertia<T>; N] {
        core::array::from_fn(|i| model.links[i].body.seen_from(&self.rotation[i], &self.origin[i]))
    }

    /// Inertia of each link together with all that hangs on it.
    #[inline]
    pub(crate) fn composites(&self, model: &Model<N, T>) -> [BodyInertia<T>; N] {
        let mut composite = self.inertias(model);
        for i in (1..N).rev() {
            composite[i - 1] = composite[i - 1].plus(&composite[i]);
        }
        composite
    }
}
