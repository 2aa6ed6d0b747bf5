//! A chain's constant rotations folded away, once, when a model is compiled.
//!
//! Every rotation is `Rz(b) Rx(a) Rz(c)`. The first factor turns the frame of the parent, whose own choice of x axis is free, and the last adds to the
//! joint's angle, so that only the tilt `a` between successive axes is left:
//!
//! ```text
//! R0_i = Rz(b_i) Rx(tilt_i) Rz(c_i)
//! parent's axes turned by Rz(b_i):   p_i' = Rz(-b_i) p_i,   the parent's body likewise
//! from the link to its parent:       Rx(tilt_i) Rz(q_i + offset_i),   offset_i = c_i + b_(i+1)
//! ```
//!
//! The last link keeps its axes (`b_(N+1) = 0`), so that a payload's place and the flange are the same in both. Where the tilt's sine vanishes, b is taken as 0.
//! Folding rounds: the last digits of the recursions that read a [`Hinge`] are those of an arm whose numbers are off by some 1e-16 of their size.

use certune_linsys::Real;
use nalgebra::{Matrix3, Vector3};

use crate::local::{Passage, Turn};
use crate::model::CompiledLink;
use crate::spatial::BodyInertia;

/// A link in folded axes, and the way to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hinge<T: Real> {
    /// Sine and cosine of the tilt.
    pub tilt: [T; 2],
    /// What is added to the joint's angle, rad.
    pub offset: T,
    /// The link's origin in the parent's folded axes, m.
    pub position: Vector3<T>,
    /// The body in the link's folded axes, about its origin.
    pub body: BodyInertia<T>,
}

impl<T: Real> Hinge<T> {
    /// The way to the parent at the joint's angle, rad.
    #[inline(always)]
    pub(crate) fn passage(&self, q: T) -> Passage<T> {
        self.turned(self.turn(q))
    }

    /// The turn about the joint's axis at its angle, rad.
    #[inline(always)]
    pub(crate) fn turn(&self, q: T) -> Turn<T> {
        let (sin, cos) = (q + self.offset).sin_cos();
        Turn { sin, cos }
    }

    /// The way to the parent when the joint is turned like this.
    #[inline(always)]
    pub(crate) fn turned(&self, turn: Turn<T>) -> Passage<T> {
        Passage { tilt: Turn { sin: self.tilt[0], cos: self.tilt[1] }, turn }
    }
}

/// Below this the axes count as parallel.
const PARALLEL: f64 = 1e-12;

/// `Rz` of an angle with this sine and cosine.
fn about_z(sin: f64, cos: f64) -> Matrix3<f64> {
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

/// Sine and cosine of b, for a tilt between -π and π and b between -π/2 and π/2: quarter turns stay quarter turns.
fn first_turn(rotation: &Matrix3<f64>) -> [f64; 2] {
    // The third column is (sin b sin a, -cos b sin a, cos a).
    let (x, y) = (rotation.m13, -rotation.m23);
    let size = x.hypot(y);
    if size < PARALLEL {
        return [0.0, 1.0];
    }
    let sign = if y < 0.0 { -1.0 } else { 1.0 };
    [sign * x / size, sign * y / size]
}

/// The folded chain of some links.
pub(crate) fn folded<const N: usize>(links: &[CompiledLink<f64>; N]) -> [Hinge<f64>; N] {
    let firsts = links.each_ref().map(|link| first_turn(&link.rotation));
    core::array::from_fn(|i| {
        let [sin, cos] = firsts[i];
        let back = about_z(-sin, cos);
        // Rx(a) Rz(c): its first row is (cos c, -sin c, 0), its last column (0, -sin a, cos a).
        let rest = back * links[i].rotation;
        let next = firsts.get(i + 1).copied().unwrap_or([0.0, 1.0]);
        let [next_sin, next_cos] = next;
        let size = rest.m23.hypot(rest.m33);
        Hinge {
            tilt: [-rest.m23 / size, rest.m33 / size],
            offset: (-rest.m12).atan2(rest.m11) + next_sin.atan2(next_cos),
            position: back * links[i].position,
            body: turned(&links[i].body, &about_z(-next_sin, next_cos)),
        }
    })
}

/// A vector of the base in the base's folded axes.
pub(crate) fn folded_base<const N: usize>(links: &[CompiledLink<f64>; N], vector: &Vector3<f64>) -> Vector3<f64> {
    let [sin, cos] = links.first().map_or([0.0, 1.0], |link| first_turn(&link.rotation));
    about_z(-sin, cos) * vector
}

/// A body in turned axes; the same numbers where nothing turns.
fn turned(body: &BodyInertia<f64>, rotation: &Matrix3<f64>) -> BodyInertia<f64> {
    BodyInertia {
        mass: body.mass,
        first_moment: rotation * body.first_moment,
        about_origin: body.about_origin.rotated(rotation),
    }
}
