//! Recursive Newton-Euler: the torque that produces a given acceleration.
//!
//! Outward, in each link's own frame, with E = (R0 Rz(q))' and the acceleration a of the link's origin (gravity enters as `a_0 = -a_g`):
//!
//! ```text
//! w_i  = E w + z dq_i
//! dw_i = E dw + (E w) x z dq_i + z ddq_i
//! a_i  = E (a + dw x p + w x (w x p))
//! f_i  = m a_i + dw_i x h + w_i x (w_i x h)
//! n_i  = I dw_i + h x a_i + w_i x I w_i
//! ```
//!
//! then inward `tau_i = z . n_i` and `(n; f)` passed on to the parent.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | w, dw, a | `velocity`, `acceleration` | rad/s, rad/s^2, m/s^2 |
//! | m, h, I | `body` | kg, kg m, kg m^2 |
//! | n, f | [`Wrench`] about the link's origin | N m, N |
//!
//! Source: Luh, Walker & Paul (1980); Featherstone 2008, ch. 5. Limits: fixed base, revolute joints.

use certune_linsys::{Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::friction::friction_torque;
use crate::model::{Model, State};
use crate::spatial::{Wrench, apply, apply_transposed, cross, turn_about_z};

/// Joint torques that produce `ddq`: `tau = M(q) ddq + C(q, dq) dq + g(q) + friction(dq)`, rotor inertia included.
///
/// `ddq` in rad/s^2, base to tip; returns `tau` in N m, same order. Cannot fail: a `Model` is valid by construction. O(N), no heap.
pub fn inverse_dynamics<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    ddq: &Joints<N, T>,
) -> Joints<N, T> {
    let mut tau = newton_euler(model, &at.q, &at.dq, ddq, &-model.gravity);
    let friction = friction_torque(model, &at.dq);
    for i in 0..N {
        tau[i] += model.rotor_inertia[i] * ddq[i] + friction[i];
    }
    tau
}

/// The rigid links' share: neither rotors nor friction; `upward` is the acceleration of the base.
pub(crate) fn newton_euler<const N: usize, T: Real>(
    model: &Model<N, T>,
    q: &Joints<N, T>,
    dq: &Joints<N, T>,
    ddq: &Joints<N, T>,
    upward: &Vector3<T>,
) -> Joints<N, T> {
    let mut rotation = [Matrix3::zeros(); N];
    let mut wrench = [Wrench::zero(); N];
    let (mut w, mut dw, mut a) = (Vector3::zeros(), Vector3::zeros(), *upward);
    for (i, link) in model.links.iter().enumerate() {
        let (sin, cos) = q[i].sin_cos();
        let r = turn_about_z(&link.rotation, sin, cos);
        let p = &link.position;
        a = apply_transposed(&r, &(a + cross(&dw, p) + cross(&w, &cross(&w, p))));
        w = apply_transposed(&r, &w);
        dw = apply_transposed(&r, &dw);
        // (E w) x z dq
        dw.x += w.y * dq[i];
        dw.y -= w.x * dq[i];
        dw.z += ddq[i];
        w.z += dq[i];
        let (h, inertia) = (&link.body.first_moment, &link.body.about_origin);
        wrench[i] = Wrench {
            moment: inertia.apply(&dw) + cross(h, &a) + cross(&w, &inertia.apply(&w)),
            force: a * link.body.mass + cross(&dw, h) + cross(&w, &cross(&w, h)),
        };
        rotation[i] = r;
    }
    let mut tau = Joints::<N, T>::zeros();
    for i in (0..N).rev() {
        tau[i] = wrench[i].moment.z;
        if i > 0 {
            let force = apply(&rotation[i], &wrench[i].force);
            let moment = apply(&rotation[i], &wrench[i].moment) + cross(&model.links[i].position, &force);
            wrench[i - 1] = wrench[i - 1].plus(&Wrench { moment, force });
        }
    }
    tau
}
