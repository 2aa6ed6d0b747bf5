//! Kinetic and potential energy, summed over the links.
//!
//! ```text
//! T = 1/2 sum_i (w . I w + m v . v + 2 v . (w x h)) + 1/2 sum_i I_r,i dq_i^2
//! U = - sum_i a_g . (m o_i + R_i h)
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | T, U | [`kinetic_energy`], [`potential_energy`] | J |
//! | w, v | velocity of link i and of its origin, in the link's axes | rad/s, m/s |
//! | m, h, I | `body` | kg, kg m, kg m^2 |
//!
//! Source: the definitions; neither uses M or g, so both check them. Limits: U is zero when all mass is at the base's origin.

use certune_linsys::{Joints, Real};
use nalgebra::Vector3;

use crate::base::Base;
use crate::model::{Model, State};
use crate::spatial::{apply, apply_transposed, cross, dot, turn_about_z};

/// Kinetic energy of links and rotors, J. O(N), no heap.
pub fn kinetic_energy<const N: usize, T: Real>(model: &Model<N, T>, at: &State<N, T>) -> T {
    let half = T::from_f64(0.5);
    let mut energy = T::zero();
    let (mut w, mut v) = (Vector3::zeros(), Vector3::zeros());
    for (i, link) in model.links.iter().enumerate() {
        let (sin, cos) = at.q[i].sin_cos();
        let rotation = turn_about_z(&link.rotation, sin, cos);
        v = apply_transposed(&rotation, &(v + cross(&w, &link.position)));
        w = apply_transposed(&rotation, &w);
        w.z += at.dq[i];
        let body = &link.body;
        let momentum = v * body.mass + cross(&w, &body.first_moment);
        let spin = body.about_origin.apply(&w) + cross(&body.first_moment, &v);
        energy += half * (dot(&w, &spin) + dot(&v, &momentum) + model.rotor_inertia[i] * at.dq[i] * at.dq[i]);
    }
    energy
}

/// Potential energy in the uniform field, J; zero when all mass is at the base's origin. O(N), no heap.
pub fn potential_energy<const N: usize, T: Real>(model: &Model<N, T>, q: &Joints<N, T>) -> T {
    let base = Base::at(model, q);
    let mut energy = T::zero();
    for (i, link) in model.links.iter().enumerate() {
        let moment = base.origin[i] * link.body.mass + apply(&base.rotation[i], &link.body.first_moment);
        energy -= dot(&model.gravity, &moment);
    }
    energy
}
