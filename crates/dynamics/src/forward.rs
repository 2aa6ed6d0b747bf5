//! Articulated-body algorithm: the acceleration that a torque produces, in O(N) and without M.
//!
//! Everything is written in base axes about each link's own origin, so that the joint axis has no linear part and an articulated inertia
//! moves to its parent by a shift alone. With `r` from the parent's origin to the link's, `(a; b)` the angular acceleration and the
//! acceleration of the origin:
//!
//! ```text
//! outward   z, w, I = R I R';  c = (w_p x z dq; w_p x (w_p x r));  p = (w x I w; w x (w x h))
//! inward    U = IA (z; 0),  D = z . U_n + I_r,  u = tau - friction - z . p_n
//!           Ia = IA - U U'/D,  pa = p + Ia c + U u/D,   parent += X' Ia X, X' pa
//! outward   A' = X A_p + c,  ddq = (u - U . A')/D,  A = A' + (z; 0) ddq
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | IA = [I H; H' M] | `Articulated`: 21 numbers | kg m^2, kg m, kg |
//! | D | `1 / inverse` | kg m^2 |
//! | I_r (+ extra) | rotor inertia, `armature` | kg m^2 |
//!
//! Source: Featherstone 2008, ch. 7; the diagonal term is his sec. 9.6 on rotor inertia. Limits: fixed base, revolute joints; N divisions by D, which is
//! positive for every valid arm.

use certune_linsys::{Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::friction::friction_torque;
use crate::model::{Model, State};
use crate::spatial::{Sym3, Twist, Wrench, apply, apply_transposed, cross, dot, product, turn_about_z};

/// Joint accelerations under `tau`: `M(q)^-1 (tau - C(q, dq) dq - g(q) - friction(dq))`, rotor inertia included in M.
///
/// `tau` in N m, base to tip; returns rad/s^2, same order. O(N), no heap.
#[inline]
pub fn forward_dynamics<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
) -> Joints<N, T> {
    articulated_body(model, at, tau, &model.rotor_inertia)
}

/// [`forward_dynamics`] with `M + diag(extra)` in place of M; `extra` in kg m^2, at least 0.
///
/// With `extra = h d` and the friction torque of the old speed this is the step that treats viscous friction implicitly.
#[inline]
pub fn forward_dynamics_with_armature<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
    extra_kg_m2: &Joints<N, T>,
) -> Joints<N, T> {
    articulated_body(model, at, tau, &(model.rotor_inertia + extra_kg_m2))
}

/// A symmetric 6x6 inertia in blocks: moment = I a + H b, force = H' a + M b.
#[derive(Clone, Copy)]
struct Articulated<T: Real> {
    rotational: Sym3<T>,
    coupling: Matrix3<T>,
    translational: Sym3<T>,
}

/// What a joint leaves behind on the way in, for the way out.
#[derive(Clone, Copy)]
struct JointShare<T: Real> {
    axis: Vector3<T>,
    shift: Vector3<T>,
    bias: Twist<T>,
    u_moment: Vector3<T>,
    u_force: Vector3<T>,
    inverse: T,
    torque: T,
}

/// `â S`: the vector product with each column of a symmetric matrix.
#[inline]
fn cross_sym<T: Real>(a: &Vector3<T>, s: &Sym3<T>) -> Matrix3<T> {
    Matrix3::new(
        a.y * s.xz - a.z * s.xy,
        a.y * s.yz - a.z * s.yy,
        a.y * s.zz - a.z * s.yz,
        a.z * s.xx - a.x * s.xz,
        a.z * s.xy - a.x * s.yz,
        a.z * s.xz - a.x * s.zz,
        a.x * s.xy - a.y * s.xx,
        a.x * s.yy - a.y * s.xy,
        a.x * s.yz - a.y * s.xz,
    )
}

impl<T: Real> Articulated<T> {
    #[inline]
    fn zero() -> Self {
        Self { rotational: Sym3::zero(), coupling: Matrix3::zeros(), translational: Sym3::zero() }
    }

    #[inline]
    fn plus(&self, b: &Self) -> Self {
        Self {
            rotational: self.rotational.plus(&b.rotational),
            coupling: self.coupling + b.coupling,
            translational: self.translational.plus(&b.translational),
        }
    }

    #[inline]
    fn apply(&self, b: &Twist<T>) -> Wrench<T> {
        Wrench {
            moment: self.rotational.apply(&b.angular) + apply(&self.coupling, &b.linear),
            force: apply_transposed(&self.coupling, &b.angular) + self.translational.apply(&b.linear),
        }
    }

    /// `self - s (n; f)(n; f)'`.
    #[inline]
    fn minus_outer(&self, n: &Vector3<T>, f: &Vector3<T>, s: T) -> Self {
        let g = f * s;
        let h = &self.coupling;
        Self {
            rotational: self.rotational.minus_outer(n, s),
            coupling: Matrix3::new(
                h.m11 - n.x * g.x,
                h.m12 - n.x * g.y,
                h.m13 - n.x * g.z,
                h.m21 - n.y * g.x,
                h.m22 - n.y * g.y,
                h.m23 - n.y * g.z,
                h.m31 - n.z * g.x,
                h.m32 - n.z * g.y,
                h.m33 - n.z * g.z,
            ),
            translational: self.translational.minus_outer(f, s),
        }
    }

    /// About a point from which this one's is reached by `r`.
    ///
    /// `H' = H + r̂ M`, `I' = I + Y + Y'` with `Y = r̂ (H + r̂ M / 2)'`.
    #[inline]
    fn shifted(&self, r: &Vector3<T>) -> Self {
        let added = cross_sym(r, &self.translational);
        let half = self.coupling + added * T::from_f64(0.5);
        // Columns of Y are r x (rows of `half`).
        let (y1, y2, y3) = (
            cross(r, &Vector3::new(half.m11, half.m12, half.m13)),
            cross(r, &Vector3::new(half.m21, half.m22, half.m23)),
            cross(r, &Vector3::new(half.m31, half.m32, half.m33)),
        );
        let i = &self.rotational;
        Self {
            rotational: Sym3 {
                xx: i.xx + y1.x + y1.x,
                yy: i.yy + y2.y + y2.y,
                zz: i.zz + y3.z + y3.z,
                xy: i.xy + y2.x + y1.y,
                xz: i.xz + y3.x + y1.z,
                yz: i.yz + y3.y + y2.z,
            },
            coupling: self.coupling + added,
            translational: self.translational,
        }
    }
}

fn articulated_body<const N: usize, T: Real>(
    model: &Model<N, T>,
    at: &State<N, T>,
    tau: &Joints<N, T>,
    armature: &Joints<N, T>,
) -> Joints<N, T> {
    let o = T::zero();
    let zero = Vector3::zeros();
    let friction = friction_torque(model, &at.dq);
    let mut inertia = [Articulated::zero(); N];
    let mut wrench = [Wrench::zero(); N];
    let mut joint = [JointShare {
        axis: zero,
        shift: zero,
        bias: Twist::zero(),
        u_moment: zero,
        u_force: zero,
        inverse: o,
        torque: o,
    }; N];

    let mut rotation = Matrix3::identity();
    let mut w = zero;
    for (i, link) in model.links.iter().enumerate() {
        let (sin, cos) = at.q[i].sin_cos();
        let r = apply(&rotation, &link.position);
        rotation = turn_about_z(&product(&rotation, &link.rotation), sin, cos);
        let z = Vector3::new(rotation.m13, rotation.m23, rotation.m33);
        let turn = z * at.dq[i];
        joint[i].axis = z;
        joint[i].shift = r;
        joint[i].bias = Twist { angular: cross(&w, &turn), linear: cross(&w, &cross(&w, &r)) };
        w += turn;
        let h = apply(&rotation, &link.body.first_moment);
        let rotational = link.body.about_origin.rotated(&rotation);
        wrench[i] = Wrench { moment: cross(&w, &rotational.apply(&w)), force: cross(&w, &cross(&w, &h)) };
        inertia[i] = Articulated {
            rotational,
            coupling: Matrix3::new(o, -h.z, h.y, h.z, o, -h.x, -h.y, h.x, o),
            translational: Sym3::from_diagonal(link.body.mass),
        };
    }

    for i in (0..N).rev() {
        let share = &mut joint[i];
        let z = &share.axis;
        let u_moment = inertia[i].rotational.apply(z);
        let u_force = apply_transposed(&inertia[i].coupling, z);
        let inverse = T::one() / (dot(z, &u_moment) + armature[i]);
        let torque = tau[i] - friction[i] - dot(z, &wrench[i].moment);
        (share.u_moment, share.u_force, share.inverse, share.torque) = (u_moment, u_force, inverse, torque);
        if i > 0 {
            let rest = inertia[i].minus_outer(&u_moment, &u_force, inverse);
            let push = rest.apply(&share.bias);
            let gain = torque * inverse;
            let force = wrench[i].force + push.force + u_force * gain;
            let moment = wrench[i].moment + push.moment + u_moment * gain + cross(&share.shift, &force);
            inertia[i - 1] = inertia[i - 1].plus(&rest.shifted(&share.shift));
            wrench[i - 1] = wrench[i - 1].plus(&Wrench { moment, force });
        }
    }

    let mut ddq = Joints::<N, T>::zeros();
    let (mut dw, mut a) = (zero, -model.gravity);
    for (i, share) in joint.iter().enumerate() {
        a += cross(&dw, &share.shift) + share.bias.linear;
        dw += share.bias.angular;
        ddq[i] = (share.torque - dot(&share.u_moment, &dw) - dot(&share.u_force, &a)) * share.inverse;
        dw += share.axis * ddq[i];
    }
    ddq
}
