//! The hot recursions' arithmetic: three-vectors and inertias in link frames, turned about x and z only.
//!
//! A chain of joints that turn about z needs no general rotation between links: every constant rotation is `Rz(b) Rx(a) Rz(c)`, the last factor adds to the joint
//! angle and the first one turns the parent's own frame, so from a link to its parent it is
//!
//! ```text
//! R = Rx(tilt) Rz(q + offset)          v_parent = R v
//! ```
//!
//! | what | products | in place of |
//! |------|----------|-------------|
//! | `R v` | 8 | 9, after 39 to build R |
//! | `R S R'`, S symmetric | 24 | 45 |
//! | `R H R'` | 48 | 54 |
//!
//! Everything is `#[inline(always)]`: lanes are registers only inside the function that knows the machine's instructions, so no call may stand between.
//! Sums of products use [`Real::mul_add`].
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms* (2008), ch. 2, for the six-vectors; the angular part comes first.

use core::ops::{Add, Mul, Neg, Sub};

use certune_linsys::Real;
use nalgebra::Vector3;

use crate::spatial::{BodyInertia, Sym3};

/// Three numbers in a link's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct V3<T> {
    pub x: T,
    pub y: T,
    pub z: T,
}

impl<T: Real> V3<T> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let o = T::zero();
        Self { x: o, y: o, z: o }
    }

    #[inline(always)]
    pub(crate) fn of(v: &Vector3<T>) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }

    #[inline(always)]
    pub(crate) fn cross(&self, b: &Self) -> Self {
        Self {
            x: self.y.mul_add(b.z, -(self.z * b.y)),
            y: self.z.mul_add(b.x, -(self.x * b.z)),
            z: self.x.mul_add(b.y, -(self.y * b.x)),
        }
    }

    #[inline(always)]
    pub(crate) fn dot(&self, b: &Self) -> T {
        self.x.mul_add(b.x, self.y.mul_add(b.y, self.z * b.z))
    }

    /// `self s + b`.
    #[inline(always)]
    pub(crate) fn scaled_plus(&self, s: T, b: &Self) -> Self {
        Self { x: self.x.mul_add(s, b.x), y: self.y.mul_add(s, b.y), z: self.z.mul_add(s, b.z) }
    }
}

impl<T: Real> Add for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl<T: Real> Sub for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl<T: Real> Mul<T> for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: T) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

impl<T: Real> Neg for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

/// `S b`.
#[inline(always)]
pub(crate) fn apply<T: Real>(s: &Sym3<T>, b: &V3<T>) -> V3<T> {
    let row = |x: T, y: T, z: T| V3 { x, y, z }.dot(b);
    V3 { x: row(s.xx, s.xy, s.xz), y: row(s.xy, s.yy, s.yz), z: row(s.xz, s.yz, s.zz) }
}

/// The sum of two symmetric matrices.
#[inline(always)]
pub(crate) fn sum<T: Real>(a: &Sym3<T>, b: &Sym3<T>) -> Sym3<T> {
    Sym3 { xx: a.xx + b.xx, yy: a.yy + b.yy, zz: a.zz + b.zz, xy: a.xy + b.xy, xz: a.xz + b.xz, yz: a.yz + b.yz }
}

/// `S - n g'` for `g` parallel to `n`.
#[inline(always)]
pub(crate) fn less_outer<T: Real>(s: &Sym3<T>, n: &V3<T>, g: &V3<T>) -> Sym3<T> {
    let less = |a: T, b: T, from: T| (-a).mul_add(b, from);
    Sym3 {
        xx: less(n.x, g.x, s.xx),
        yy: less(n.y, g.y, s.yy),
        zz: less(n.z, g.z, s.zz),
        xy: less(n.x, g.y, s.xy),
        xz: less(n.x, g.z, s.xz),
        yz: less(n.y, g.z, s.yz),
    }
}

/// A general 3x3 matrix by rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct M3<T> {
    pub rows: [V3<T>; 3],
}

impl<T: Real> M3<T> {
    /// `ĥ`.
    #[inline(always)]
    pub(crate) fn skew(h: &V3<T>) -> Self {
        let o = T::zero();
        Self { rows: [V3 { x: o, y: -h.z, z: h.y }, V3 { x: h.z, y: o, z: -h.x }, V3 { x: -h.y, y: h.x, z: o }] }
    }

    /// `H b`.
    #[inline(always)]
    pub(crate) fn apply(&self, b: &V3<T>) -> V3<T> {
        let [x, y, z] = &self.rows;
        V3 { x: x.dot(b), y: y.dot(b), z: z.dot(b) }
    }

    #[inline(always)]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        let ([x, y, z], [u, v, w]) = (&self.rows, &b.rows);
        Self { rows: [*x + *u, *y + *v, *z + *w] }
    }

    /// `H - n g'`.
    #[inline(always)]
    pub(crate) fn less_outer(&self, n: &V3<T>, g: &V3<T>) -> Self {
        let [x, y, z] = &self.rows;
        Self { rows: [g.scaled_plus(-n.x, x), g.scaled_plus(-n.y, y), g.scaled_plus(-n.z, z)] }
    }
}

/// A turn in a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<T> {
    pub sin: T,
    pub cos: T,
}

impl<T: Real> Turn<T> {
    /// `(a, b)` turned forward.
    #[inline(always)]
    fn forward(&self, a: T, b: T) -> (T, T) {
        (self.cos.mul_add(a, -(self.sin * b)), self.sin.mul_add(a, self.cos * b))
    }

    /// `(a, b)` turned back.
    #[inline(always)]
    fn back(&self, a: T, b: T) -> (T, T) {
        (self.cos.mul_add(a, self.sin * b), self.cos.mul_add(b, -(self.sin * a)))
    }

    /// The symmetric `[[aa, ab], [ab, bb]]` turned forward on both sides.
    #[inline(always)]
    fn both_sides(&self, aa: T, ab: T, bb: T) -> (T, T, T) {
        let t1 = self.cos.mul_add(aa, -(self.sin * ab));
        let t2 = self.cos.mul_add(ab, -(self.sin * bb));
        let (first, mixed) = self.forward(t1, t2);
        // The trace stays.
        (first, mixed, (aa + bb) - first)
    }
}

/// From a link's axes to its parent's: `Rx(tilt) Rz(turn)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage<T> {
    pub tilt: Turn<T>,
    pub turn: Turn<T>,
}

impl<T: Real> Passage<T> {
    /// A place for a passage that is not yet known.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let still = Turn { sin: T::zero(), cos: T::zero() };
        Self { tilt: still, turn: still }
    }

    /// `R v`.
    #[inline(always)]
    pub(crate) fn to_parent(self, v: &V3<T>) -> V3<T> {
        let (x, y) = self.turn.forward(v.x, v.y);
        let (y, z) = self.tilt.forward(y, v.z);
        V3 { x, y, z }
    }

    /// `R' v`.
    #[inline(always)]
    pub(crate) fn to_child(self, v: &V3<T>) -> V3<T> {
        let (y, z) = self.tilt.back(v.y, v.z);
        let (x, y) = self.turn.back(v.x, y);
        V3 { x, y, z }
    }

    /// `R S R'`.
    #[inline(always)]
    pub(crate) fn symmetric_to_parent(self, s: &Sym3<T>) -> Sym3<T> {
        let (xx, xy, yy) = self.turn.both_sides(s.xx, s.xy, s.yy);
        let (xz, yz) = self.turn.forward(s.xz, s.yz);
        let (yy, yz, zz) = self.tilt.both_sides(yy, yz, s.zz);
        let (xy, xz) = self.tilt.forward(xy, xz);
        Sym3 { xx, yy, zz, xy, xz, yz }
    }

    /// `R H R'`.
    #[inline(always)]
    pub(crate) fn matrix_to_parent(self, h: &M3<T>) -> M3<T> {
        // No closure over arrays here: the standard library's are not always inlined.
        let (x, y, z) = (self.to_parent(&h.rows[0]), self.to_parent(&h.rows[1]), self.to_parent(&h.rows[2]));
        let a = self.to_parent(&V3 { x: x.x, y: y.x, z: z.x });
        let b = self.to_parent(&V3 { x: x.y, y: y.y, z: z.y });
        let c = self.to_parent(&V3 { x: x.z, y: y.z, z: z.z });
        M3 { rows: [V3 { x: a.x, y: b.x, z: c.x }, V3 { x: a.y, y: b.y, z: c.y }, V3 { x: a.z, y: b.z, z: c.z }] }
    }
}

/// Mass, first moment and inertia about the origin of the link's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body<T> {
    pub mass: T,
    pub first_moment: V3<T>,
    pub about_origin: Sym3<T>,
}

impl<T: Real> Body<T> {
    #[inline(always)]
    pub(crate) fn of(body: &BodyInertia<T>) -> Self {
        Self { mass: body.mass, first_moment: V3::of(&body.first_moment), about_origin: body.about_origin }
    }

    /// Both bodies as one.
    #[inline(always)]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        Self {
            mass: self.mass + b.mass,
            first_moment: self.first_moment + b.first_moment,
            about_origin: sum(&self.about_origin, &b.about_origin),
        }
    }

    /// In the parent's axes, about the parent's origin, from which this one's is reached by `p`.
    ///
    /// With `k = R h + (m/2) p`: `h' = R h + m p`, `I' = R I R' + 2 (p . k) 1 - p k' - k p'`.
    #[inline(always)]
    pub(crate) fn to_parent(self, passage: Passage<T>, p: &V3<T>) -> Self {
        let (i, h) = (passage.symmetric_to_parent(&self.about_origin), passage.to_parent(&self.first_moment));
        let k = p.scaled_plus(self.mass * T::from_f64(0.5), &h);
        let (x, y, z) = (p.x * k.x, p.y * k.y, p.z * k.z);
        let mixed = |a: T, b: T, from: T| from - a - b;
        Self {
            mass: self.mass,
            first_moment: p.scaled_plus(self.mass, &h),
            about_origin: Sym3 {
                xx: i.xx + ((y + z) + (y + z)),
                yy: i.yy + ((x + z) + (x + z)),
                zz: i.zz + ((x + y) + (x + y)),
                xy: mixed(p.x * k.y, p.y * k.x, i.xy),
                xz: mixed(p.x * k.z, p.z * k.x, i.xz),
                yz: mixed(p.y * k.z, p.z * k.y, i.yz),
            },
        }
    }
}
