//! The few products of three-vectors and symmetric 3x3 matrices that the recursions are written in.
//!
//! | symbol | code | shape | meaning |
//! |--------|------|-------|---------|
//! | a x b  | [`cross`] | 3 | vector product |
//! | â      | `skew` in comments | 3x3 | the matrix with `â b = a x b` |
//! | I      | [`Sym3`] | six numbers | a symmetric matrix, e.g. a rotational inertia, kg m^2 |
//! | (n; f) | [`Wrench`] | 6 | moment about a point and force, N m and N |
//! | (w; v) | [`Twist`] | 6 | angular velocity and the velocity of the point at the origin, rad/s and m/s |
//!
//! Six-vectors follow Featherstone, *Rigid Body Dynamics Algorithms* (2008), ch. 2: angular part first. Every function is written
//! out, because the compiler then keeps all operands in registers, and is generic in [`Real`], so that lanes run the same source.

use certune_linsys::Real;
use nalgebra::{Matrix3, Vector3};

/// `a x b`.
#[inline]
pub(crate) fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// `a . b`.
#[inline]
pub(crate) fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// `A b`.
#[inline]
pub(crate) fn apply<T: Real>(a: &Matrix3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.m11 * b.x + a.m12 * b.y + a.m13 * b.z,
        a.m21 * b.x + a.m22 * b.y + a.m23 * b.z,
        a.m31 * b.x + a.m32 * b.y + a.m33 * b.z,
    )
}

/// `A' b`.
#[inline]
pub(crate) fn apply_transposed<T: Real>(a: &Matrix3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.m11 * b.x + a.m21 * b.y + a.m31 * b.z,
        a.m12 * b.x + a.m22 * b.y + a.m32 * b.z,
        a.m13 * b.x + a.m23 * b.y + a.m33 * b.z,
    )
}

/// `A B`.
#[inline]
pub(crate) fn product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let column = |x, y, z| apply(a, &Vector3::new(x, y, z));
    let (c1, c2, c3) = (column(b.m11, b.m21, b.m31), column(b.m12, b.m22, b.m32), column(b.m13, b.m23, b.m33));
    Matrix3::new(c1.x, c2.x, c3.x, c1.y, c2.y, c3.y, c1.z, c2.z, c3.z)
}

/// `A Rz`, the rotation of angle `q` about z applied first, from the sine and cosine of `q`.
#[inline]
pub(crate) fn turn_about_z<T: Real>(a: &Matrix3<T>, sin: T, cos: T) -> Matrix3<T> {
    Matrix3::new(
        a.m11 * cos + a.m12 * sin,
        a.m12 * cos - a.m11 * sin,
        a.m13,
        a.m21 * cos + a.m22 * sin,
        a.m22 * cos - a.m21 * sin,
        a.m23,
        a.m31 * cos + a.m32 * sin,
        a.m32 * cos - a.m31 * sin,
        a.m33,
    )
}

/// A symmetric 3x3 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sym3<T> {
    pub xx: T,
    pub yy: T,
    pub zz: T,
    pub xy: T,
    pub xz: T,
    pub yz: T,
}

impl<T: Real> Sym3<T> {
    #[inline]
    pub(crate) fn apply(&self, b: &Vector3<T>) -> Vector3<T> {
        Vector3::new(
            self.xx * b.x + self.xy * b.y + self.xz * b.z,
            self.xy * b.x + self.yy * b.y + self.yz * b.z,
            self.xz * b.x + self.yz * b.y + self.zz * b.z,
        )
    }

    #[inline]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        Self {
            xx: self.xx + b.xx,
            yy: self.yy + b.yy,
            zz: self.zz + b.zz,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yz: self.yz + b.yz,
        }
    }

    #[inline]
    pub(crate) fn scaled(&self, s: T) -> Self {
        Self { xx: self.xx * s, yy: self.yy * s, zz: self.zz * s, xy: self.xy * s, xz: self.xz * s, yz: self.yz * s }
    }

    #[inline]
    pub(crate) fn trace(&self) -> T {
        self.xx + self.yy + self.zz
    }

    #[inline]
    pub(crate) fn to_matrix(self) -> Matrix3<T> {
        Matrix3::new(self.xx, self.xy, self.xz, self.xy, self.yy, self.yz, self.xz, self.yz, self.zz)
    }

    /// `R self R'`.
    #[inline]
    pub(crate) fn rotated(&self, r: &Matrix3<T>) -> Self {
        let a = product(r, &self.to_matrix());
        Self {
            xx: a.m11 * r.m11 + a.m12 * r.m12 + a.m13 * r.m13,
            yy: a.m21 * r.m21 + a.m22 * r.m22 + a.m23 * r.m23,
            zz: a.m31 * r.m31 + a.m32 * r.m32 + a.m33 * r.m33,
            xy: a.m11 * r.m21 + a.m12 * r.m22 + a.m13 * r.m23,
            xz: a.m11 * r.m31 + a.m12 * r.m32 + a.m13 * r.m33,
            yz: a.m21 * r.m31 + a.m22 * r.m32 + a.m23 * r.m33,
        }
    }
}

/// Moment about a reference point and force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrench<T: Real> {
    pub moment: Vector3<T>,
    pub force: Vector3<T>,
}

/// Angular part and the linear part at a reference point: a velocity or an acceleration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Twist<T: Real> {
    pub angular: Vector3<T>,
    pub linear: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    #[inline]
    pub(crate) fn zero() -> Self {
        Self { moment: Vector3::zeros(), force: Vector3::zeros() }
    }
    #[inline]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        Self { moment: self.moment + b.moment, force: self.force + b.force }
    }
}

impl<T: Real> Twist<T> {
    #[inline]
    pub(crate) fn zero() -> Self {
        Self { angular: Vector3::zeros(), linear: Vector3::zeros() }
    }
    #[inline]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        Self { angular: self.angular + b.angular, linear: self.linear + b.linear }
    }
    /// `self s`.
    #[inline]
    pub(crate) fn scaled(&self, s: T) -> Self {
        Self { angular: self.angular * s, linear: self.linear * s }
    }
    /// The power `n . w + f . v`.
    #[inline]
    pub(crate) fn power(&self, b: &Wrench<T>) -> T {
        dot(&self.angular, &b.moment) + dot(&self.linear, &b.force)
    }
    /// The motion product `self x b`: how `b` changes when carried along by `self`.
    #[inline]
    pub(crate) fn carry(&self, b: &Self) -> Self {
        Self {
            angular: cross(&self.angular, &b.angular),
            linear: cross(&self.angular, &b.linear) + cross(&self.linear, &b.angular),
        }
    }
    /// The force product `self x* b`.
    #[inline]
    pub(crate) fn carry_wrench(&self, b: &Wrench<T>) -> Wrench<T> {
        Wrench {
            moment: cross(&self.angular, &b.moment) + cross(&self.linear, &b.force),
            force: cross(&self.angular, &b.force),
        }
    }
}

/// Ten numbers that are all of a rigid body: mass, first moment `m c` and rotational inertia about the reference point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyInertia<T: Real> {
    pub mass: T,
    pub first_moment: Vector3<T>,
    pub about_origin: Sym3<T>,
}

impl<T: Real> BodyInertia<T> {
    #[inline]
    pub(crate) fn plus(&self, b: &Self) -> Self {
        Self {
            mass: self.mass + b.mass,
            first_moment: self.first_moment + b.first_moment,
            about_origin: self.about_origin.plus(&b.about_origin),
        }
    }

    /// Momentum of a velocity, or the inertial wrench of an acceleration.
    #[inline]
    pub(crate) fn apply(&self, b: &Twist<T>) -> Wrench<T> {
        Wrench {
            moment: self.about_origin.apply(&b.angular) + cross(&self.first_moment, &b.linear),
            force: b.linear * self.mass + cross(&b.angular, &self.first_moment),
        }
    }

    /// The same body seen from a frame in which the body's own frame sits at `origin` with orientation `rotation`.
    ///
    /// `m' = m`, `h' = R h + m o`, `I' = R I R' - ô (R h)^ - (R h)^ ô - m ô ô`.
    #[inline]
    pub(crate) fn seen_from(&self, rotation: &Matrix3<T>, origin: &Vector3<T>) -> Self {
        let h = apply(rotation, &self.first_moment);
        // With k = R h + (m/2) o the three shifts are 2 (o . k) 1 - o k' - k o'.
        let half_mass = self.mass * T::from_f64(0.5);
        let k = h + origin * half_mass;
        let twice = dot(origin, &k) + dot(origin, &k);
        let o = origin;
        let shift = Sym3 {
            xx: twice - (o.x * k.x + o.x * k.x),
            yy: twice - (o.y * k.y + o.y * k.y),
            zz: twice - (o.z * k.z + o.z * k.z),
            xy: -(o.x * k.y + o.y * k.x),
            xz: -(o.x * k.z + o.z * k.x),
            yz: -(o.y * k.z + o.z * k.y),
        };
        Self {
            mass: self.mass,
            first_moment: h + origin * self.mass,
            about_origin: self.about_origin.rotated(rotation).plus(&shift),
        }
    }
}
