//! Recursive Newton-Euler: the torque that produces a given acceleration.
//!
//! Outward, in each link's own folded axes, with E = (Rx(tilt) Rz(q + offset))' and the acceleration a of the link's origin (gravity enters as `a_0 = -a_g`):
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
//! | n, f | `wrench` about the link's origin | N m, N |
//!
//! Source: Luh, Walker & Paul (1980); Featherstone 2008, ch. 5. Limits: fixed base, revolute joints.

use certune_linsys::{Joints, Real};
use nalgebra::Vector3;

use crate::friction::friction_torque;
use crate::local::{Body, Passage, V3, apply};
use crate::model::{Model, State};

/// Joint torques that produce `ddq`: `tau = M(q) ddq + C(q, dq) dq + g(q) + friction(dq)`, rotor inertia included.
///
/// `ddq` in rad/s^2, base to tip; returns `tau` in N m, same order. Cannot fail: a `Model` is valid by construction. O(N), no heap.
#[inline(always)]
pub fn inverse_dynamics<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    ddq: &Joints<N, T>,
) -> Joints<N, T> {
    let mut tau = newton_euler(model, &at.q, &at.dq, ddq, &-model.folded_gravity);
    let friction = friction_torque(model, &at.dq);
    for i in 0..N {
        tau[i] += model.rotor_inertia[i] * ddq[i] + friction[i];
    }
    tau
}

/// The rigid links' share: neither rotors nor friction; `upward` is the acceleration of the base in its folded axes.
#[inline(always)]
pub(crate) fn newton_euler<const N: usize, T: Real>(
    model: &Model<N, T>,
    q: &Joints<N, T>,
    dq: &Joints<N, T>,
    ddq: &Joints<N, T>,
    upward: &Vector3<T>,
) -> Joints<N, T> {
    let zero = V3::zero();
    let mut passage = [Passage::zero(); N];
    let mut wrench = [[zero; 2]; N];
    let (mut w, mut dw, mut a) = (zero, zero, V3::of(upward));
    for i in 0..N {
        let hinge = &model.chain[i];
        let (here, p) = (hinge.passage(q[i]), V3::of(&hinge.position));
        a = here.to_child(&(a + dw.cross(&p) + w.cross(&w.cross(&p))));
        w = here.to_child(&w);
        dw = here.to_child(&dw);
        // (E w) x z dq
        dw.x = w.y.mul_add(dq[i], dw.x);
        dw.y = (-w.x).mul_add(dq[i], dw.y);
        dw.z += ddq[i];
        w.z += dq[i];
        let Body { mass, first_moment: h, about_origin: inertia } = Body::of(&hinge.body);
        let moment = apply(&inertia, &dw) + h.cross(&a) + w.cross(&apply(&inertia, &w));
        let force = a.scaled_plus(mass, &(dw.cross(&h) + w.cross(&w.cross(&h))));
        wrench[i] = [moment, force];
        passage[i] = here;
    }
    let mut tau = Joints::<N, T>::zeros();
    for i in (0..N).rev() {
        let [moment, force] = wrench[i];
        tau[i] = moment.z;
        if i > 0 {
            let force = passage[i].to_parent(&force);
            let moment = passage[i].to_parent(&moment) + V3::of(&model.chain[i].position).cross(&force);
            let [sum_moment, sum_force] = &mut wrench[i - 1];
            (*sum_moment, *sum_force) = (*sum_moment + moment, *sum_force + force);
        }
    }
    tau
}
