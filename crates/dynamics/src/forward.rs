//! Articulated-body algorithm: the acceleration that a torque produces, in O(N) and without M.
//!
//! Everything is written in each link's own folded axes about its origin, so that the joint axis is `(z; 0)` and `IA (z; 0)` is a column of IA. With p from
//! the parent's origin to the link's, `(w; .)` the angular velocity, `(a; b)` the angular acceleration and the acceleration of the origin:
//!
//! ```text
//! outward   w = R' w_p + z dq,   c = (w x z dq; R' (w_p x (w_p x p))),   f = (w x I w; w x (w x h))
//! inward    U = IA (z; 0),  D = z . U_n + I_r,  u = tau - friction - z . f_n
//!           Ia = IA - U U'/D,  fa = f + Ia c + U u/D,   parent += X' Ia X, X' fa
//! outward   A' = X A_p + c,  ddq = (u - U . A')/D,  A = A' + (z; 0) ddq
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | R | [`Passage`], `Rx(tilt) Rz(q + offset)` | 1 |
//! | IA = [I H; H' M] | `Articulated`: 21 numbers | kg m^2, kg m, kg |
//! | D | `1 / inverse` | kg m^2 |
//! | I_r (+ extra) | rotor inertia, `armature` | kg m^2 |
//!
//! Source: Featherstone 2008, ch. 7; the diagonal term is his sec. 9.6 on rotor inertia. Limits: fixed base, revolute joints; N divisions by D, which is
//! positive for every valid arm.

use certune_linsys::{Joints, Real};

use crate::friction::joint_friction;
use crate::local::{Body, M3, Passage, V3, apply, less_outer, sum};
use crate::model::{Model, State};
use crate::posture::Posture;
use crate::spatial::Sym3;

/// Joint accelerations under `tau`: `M(q)^-1 (tau - C(q, dq) dq - g(q) - friction(dq))`, rotor inertia included in M.
///
/// `tau` in N m, base to tip; returns rad/s^2, same order. O(N), no heap.
#[inline(always)]
pub fn forward_dynamics<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
) -> Joints<N, T> {
    let mut posture = Posture::at(model, &at.q);
    posture.forward_dynamics(model, &at.dq, tau, &model.rotor_inertia)
}

/// [`forward_dynamics`] with `M + diag(extra)` in place of M; `extra` in kg m^2, at least 0.
///
/// With `extra = h d` and the friction torque of the old speed this is the step that treats viscous friction implicitly.
#[inline(always)]
pub fn forward_dynamics_with_armature<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
    extra_kg_m2: &Joints<N, T>,
) -> Joints<N, T> {
    let mut armature = model.rotor_inertia;
    for i in 0..N {
        armature[i] += extra_kg_m2[i];
    }
    let mut posture = Posture::at(model, &at.q);
    posture.forward_dynamics(model, &at.dq, tau, &armature)
}

/// A symmetric 6x6 inertia in blocks: moment = I a + H b, force = H' a + M b.
#[derive(Clone, Copy)]
struct Articulated<T: Real> {
    rotational: Sym3<T>,
    coupling: M3<T>,
    translational: Sym3<T>,
}

/// Moment about the link's origin and force.
#[derive(Clone, Copy)]
struct Wrench<T: Real> {
    moment: V3<T>,
    force: V3<T>,
}

/// What a joint leaves behind on the way out and in, for the way back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointShare<T: Real> {
    /// w, in the link's axes.
    velocity: V3<T>,
    /// The linear part of c.
    bias_linear: V3<T>,
    u_moment: V3<T>,
    u_force: V3<T>,
    inverse: T,
    torque: T,
}

impl<T: Real> JointShare<T> {
    /// A place for what is not yet known.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let (o, zero) = (T::zero(), V3::zero());
        Self { velocity: zero, bias_linear: zero, u_moment: zero, u_force: zero, inverse: o, torque: o }
    }

    /// The angular part of c, x and y; its z is 0.
    #[inline(always)]
    fn bias(&self, dq: T) -> [T; 2] {
        [self.velocity.y * dq, -(self.velocity.x * dq)]
    }

    /// f: what turns with w needs of the joint, were it to keep its speed.
    #[inline(always)]
    fn wrench(&self, body: &Body<T>) -> Wrench<T> {
        let w = &self.velocity;
        Wrench { moment: w.cross(&apply(&body.about_origin, w)), force: w.cross(&w.cross(&body.first_moment)) }
    }
}

impl<T: Real> Articulated<T> {
    /// Of a rigid body.
    #[inline(always)]
    fn rigid(body: &Body<T>) -> Self {
        let (m, o) = (body.mass, T::zero());
        Self {
            rotational: body.about_origin,
            coupling: M3::skew(&body.first_moment),
            translational: Sym3 { xx: m, yy: m, zz: m, xy: o, xz: o, yz: o },
        }
    }

    /// With a rigid body added.
    #[inline(always)]
    fn plus_rigid(&self, body: &Body<T>) -> Self {
        let (h, m, t) = (&body.first_moment, body.mass, &self.translational);
        let [x, y, z] = &self.coupling.rows;
        Self {
            rotational: sum(&self.rotational, &body.about_origin),
            coupling: M3 {
                rows: [
                    V3 { x: x.x, y: x.y - h.z, z: x.z + h.y },
                    V3 { x: y.x + h.z, y: y.y, z: y.z - h.x },
                    V3 { x: z.x - h.y, y: z.y + h.x, z: z.z },
                ],
            },
            translational: Sym3 { xx: t.xx + m, yy: t.yy + m, zz: t.zz + m, ..*t },
        }
    }

    /// `self - s (n; f)(n; f)'`.
    #[inline(always)]
    fn less_outer(&self, n: &V3<T>, f: &V3<T>, s: T) -> Self {
        let (sn, sf) = (*n * s, *f * s);
        Self {
            rotational: less_outer(&self.rotational, n, &sn),
            coupling: self.coupling.less_outer(n, &sf),
            translational: less_outer(&self.translational, f, &sf),
        }
    }

    /// The wrench of an acceleration whose angular part has no z.
    #[inline(always)]
    fn apply(&self, [x, y]: [T; 2], linear: &V3<T>) -> Wrench<T> {
        let angular = V3 { x, y, z: T::zero() };
        let (i, [row_x, row_y, _]) = (&self.rotational, &self.coupling.rows);
        let column = |a: T, b: T| a.mul_add(x, b * y);
        let turned = V3 { x: column(i.xx, i.xy), y: column(i.xy, i.yy), z: column(i.xz, i.yz) };
        let pushed = row_x.scaled_plus(angular.x, &(*row_y * angular.y));
        Wrench { moment: turned + self.coupling.apply(linear), force: pushed + apply(&self.translational, linear) }
    }

    /// In the parent's axes, about the parent's origin, from which this one's is reached by `p`.
    ///
    /// `H' = H + p^ M`, `I' = I + Y + Y'` with `Y = p^ (H + p^ M / 2)'`.
    #[inline(always)]
    fn to_parent(self, passage: Passage<T>, p: &V3<T>) -> Self {
        let i = passage.symmetric_to_parent(&self.rotational);
        let m = passage.symmetric_to_parent(&self.translational);
        let h = passage.matrix_to_parent(&self.coupling);
        // Columns of p^ M are p x (columns of M), M being symmetric.
        let (a, b, c) = (
            p.cross(&V3 { x: m.xx, y: m.xy, z: m.xz }),
            p.cross(&V3 { x: m.xy, y: m.yy, z: m.yz }),
            p.cross(&V3 { x: m.xz, y: m.yz, z: m.zz }),
        );
        let added =
            M3 { rows: [V3 { x: a.x, y: b.x, z: c.x }, V3 { x: a.y, y: b.y, z: c.y }, V3 { x: a.z, y: b.z, z: c.z }] };
        let half = T::from_f64(0.5);
        // Columns of Y are p x (rows of H + p^ M / 2).
        let row_x = p.cross(&added.rows[0].scaled_plus(half, &h.rows[0]));
        let row_y = p.cross(&added.rows[1].scaled_plus(half, &h.rows[1]));
        let row_z = p.cross(&added.rows[2].scaled_plus(half, &h.rows[2]));
        Self {
            rotational: Sym3 {
                xx: i.xx + (row_x.x + row_x.x),
                yy: i.yy + (row_y.y + row_y.y),
                zz: i.zz + (row_z.z + row_z.z),
                xy: i.xy + (row_y.x + row_x.y),
                xz: i.xz + (row_z.x + row_x.z),
                yz: i.yz + (row_z.y + row_y.z),
            },
            coupling: h.plus(&added),
            translational: m,
        }
    }
}

impl<const N: usize, T: Real> Posture<N, T> {
    /// [`forward_dynamics`] in this posture, with `armature` (kg m^2) on the diagonal of M in place of the rotor inertia. No heap.
    #[inline(always)]
    pub fn forward_dynamics(
        &mut self,
        model: &Model<N, T>,
        dq: &Joints<N, T>,
        tau: &Joints<N, T>,
        armature_kg_m2: &Joints<N, T>,
    ) -> Joints<N, T> {
        let mut w = V3::zero();
        for i in 0..N {
            let (passage, p) = (self.passage(model, i), V3::of(&model.chain[i].position));
            let share = &mut self.shares[i];
            share.bias_linear = passage.to_child(&w.cross(&w.cross(&p)));
            w = passage.to_child(&w);
            w.z += dq[i];
            share.velocity = w;
        }

        // What hangs on the joint at hand.
        let mut beyond: Option<(Articulated<T>, Wrench<T>)> = None;
        for i in (0..N).rev() {
            let passage = self.passage(model, i);
            let hinge = &model.chain[i];
            let body = Body::of(&hinge.body);
            let share = &mut self.shares[i];
            let own = share.wrench(&body);
            let (inertia, force) = match &beyond {
                None => (Articulated::rigid(&body), own),
                Some((inertia, more)) => (
                    inertia.plus_rigid(&body),
                    Wrench { moment: own.moment + more.moment, force: own.force + more.force },
                ),
            };
            let turned = &inertia.rotational;
            let u_moment = V3 { x: turned.xz, y: turned.yz, z: turned.zz };
            let u_force = inertia.coupling.rows[2];
            let inverse = T::one() / (turned.zz + armature_kg_m2[i]);
            let torque = tau[i] - joint_friction(model, i, dq[i]) - force.moment.z;
            (share.u_moment, share.u_force, share.inverse, share.torque) = (u_moment, u_force, inverse, torque);
            if i > 0 {
                let p = V3::of(&hinge.position);
                let rest = inertia.less_outer(&u_moment, &u_force, inverse);
                let push = rest.apply(share.bias(dq[i]), &share.bias_linear);
                let gain = torque * inverse;
                let moment = u_moment.scaled_plus(gain, &(force.moment + push.moment));
                let passed = passage.to_parent(&u_force.scaled_plus(gain, &(force.force + push.force)));
                let moment = passage.to_parent(&moment) + p.cross(&passed);
                beyond = Some((rest.to_parent(passage, &p), Wrench { moment, force: passed }));
            }
        }

        let mut ddq = *tau;
        let (mut dw, mut a) = (V3::zero(), -V3::of(&model.folded_gravity));
        for i in 0..N {
            let (passage, share) = (self.passage(model, i), &self.shares[i]);
            let p = V3::of(&model.chain[i].position);
            a = passage.to_child(&(a + dw.cross(&p))) + share.bias_linear;
            dw = passage.to_child(&dw);
            let [x, y] = share.bias(dq[i]);
            dw.x += x;
            dw.y += y;
            ddq[i] = (share.torque - share.u_moment.dot(&dw) - share.u_force.dot(&a)) * share.inverse;
            dw.z += ddq[i];
        }
        ddq
    }
}
