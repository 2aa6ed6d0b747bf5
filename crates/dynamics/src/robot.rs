//! A serial arm as data: what a maker or a URDF file states, checked once.
//!
//! | quantity | code | unit |
//! |----------|------|------|
//! | joint frame in the parent link at q = 0 | [`Frame`] | m, 1 |
//! | m, c, inertia about the com | [`Inertia`] | kg, m, kg m^2 |
//! | range, speed and torque limits | [`JointLimits`] | rad, rad/s, N m |
//! | rotor inertia seen at the joint | `rotor_inertia_kg_m2` | kg m^2 |
//! | friction `d dq + f_c tanh(dq / 0.01)` | `viscous_n_m_s_per_rad`, `coulomb_n_m` | N m s/rad, N m |
//!
//! A rigid body's inertia `J` about its centre of mass is physical when its second moments `S = tr(J)/2 1 - J` are
//! positive semidefinite: that is the triangle inequality of the principal moments. A moving link also needs `J` positive definite.
//! Both are tested on eigenvalues with a tolerance of a few roundings of `tr J`, so that a flat plate passes and an
//! inertia that misses by 1e-6 does not. Limits: fixed base, revolute joints, one chain.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::error::RobotError;
use crate::spatial::{BodyInertia, Sym3};

/// A frame in its parent: where its origin is and how its axes are turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Frame {
    /// Position of the origin in the parent frame, m.
    pub xyz_m: [f64; 3],
    /// Row-major rotation whose columns are the frame's axes in the parent frame.
    pub rotation: [[f64; 3]; 3],
}

/// Sine and cosine; exact at multiples of a quarter turn, as far as the angle can express one.
fn exact_sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = angle_rad / core::f64::consts::FRAC_PI_2;
    if quarters.abs() < 1e6 && (quarters - quarters.round()).abs() <= 2.0 * f64::EPSILON * quarters.abs() {
        // In range of i64 by the test above.
        #[expect(clippy::cast_possible_truncation, reason = "|quarters| < 1e6")]
        let turn = (quarters.round() as i64).rem_euclid(4);
        return [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][usize::try_from(turn).unwrap_or(0)];
    }
    angle_rad.sin_cos()
}

impl Frame {
    /// The parent frame itself.
    pub const IDENTITY: Self = Self { xyz_m: [0.0; 3], rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// A frame at `xyz_m`, turned by roll, pitch, yaw about the fixed x, y, z axes in this order, as URDF does.
    ///
    /// A multiple of a quarter turn gives entries that are exactly 0 or +-1.
    pub fn from_rpy(xyz_m: [f64; 3], rpy_rad: [f64; 3]) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = rpy_rad.map(exact_sin_cos);
        Self {
            xyz_m,
            rotation: [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ],
        }
    }

    /// The frame `inner`, given in this frame, expressed in this frame's parent.
    pub fn then(&self, inner: &Frame) -> Frame {
        let r = self.rotation_matrix();
        Frame::from_parts(self.position() + r * inner.position(), r * inner.rotation_matrix())
    }

    /// The position as a vector, m.
    pub fn position(&self) -> Vector3<f64> {
        Vector3::from(self.xyz_m)
    }

    /// The rotation as a matrix.
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        let [x, y, z] = self.rotation;
        Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2])
    }

    pub(crate) fn from_parts(position: Vector3<f64>, rotation: Matrix3<f64>) -> Self {
        let row = |i: usize| [rotation[(i, 0)], rotation[(i, 1)], rotation[(i, 2)]];
        Self { xyz_m: position.into(), rotation: [row(0), row(1), row(2)] }
    }
}

/// Mass, centre of mass and rotational inertia of a rigid body in a frame fixed to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Inertia {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz, kg m^2 (products with the sign of the matrix entry).
    pub about_com_kg_m2: [f64; 6],
}

impl Inertia {
    /// No body at all.
    pub const NONE: Self = Self { mass_kg: 0.0, com_m: [0.0; 3], about_com_kg_m2: [0.0; 6] };

    /// Smallest to largest principal moment about the centre of mass, kg m^2.
    pub fn principal_moments_kg_m2(&self) -> [f64; 3] {
        let [xx, yy, zz, xy, xz, yz] = self.about_com_kg_m2;
        let moments = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)).eigenvalues;
        let mut sorted = [moments[0], moments[1], moments[2]];
        sorted.sort_by(f64::total_cmp);
        sorted
    }

    /// This body and another one, given in the same frame, welded together.
    pub fn merged(&self, other: &Inertia) -> Inertia {
        if other.mass_kg <= 0.0 {
            return *self;
        }
        if self.mass_kg <= 0.0 {
            return *other;
        }
        let mass_kg = self.mass_kg + other.mass_kg;
        let (a, b) = (Vector3::from(self.com_m), Vector3::from(other.com_m));
        let com = (a * self.mass_kg + b * other.mass_kg) / mass_kg;
        // Two points of reduced mass mu at distance d add mu (d.d 1 - d d') about their common centre.
        let reduced_kg = self.mass_kg * other.mass_kg / mass_kg;
        let d = b - a;
        let mut sum = self.about_com_kg_m2;
        let pair =
            [d.y * d.y + d.z * d.z, d.x * d.x + d.z * d.z, d.x * d.x + d.y * d.y, -d.x * d.y, -d.x * d.z, -d.y * d.z];
        for ((s, o), p) in sum.iter_mut().zip(other.about_com_kg_m2).zip(pair) {
            *s += o + reduced_kg * p;
        }
        Inertia { mass_kg, com_m: com.into(), about_com_kg_m2: sum }
    }

    /// The same body, given in `frame`, expressed in the frame's parent.
    pub fn in_parent(&self, frame: &Frame) -> Inertia {
        let r = frame.rotation_matrix();
        let [xx, yy, zz, xy, xz, yz] = self.about_com_kg_m2;
        let turned = Sym3 { xx, yy, zz, xy, xz, yz }.rotated(&r);
        Inertia {
            mass_kg: self.mass_kg,
            com_m: (frame.position() + r * Vector3::from(self.com_m)).into(),
            about_com_kg_m2: [turned.xx, turned.yy, turned.zz, turned.xy, turned.xz, turned.yz],
        }
    }

    pub(crate) fn compiled(&self) -> BodyInertia<f64> {
        let [xx, yy, zz, xy, xz, yz] = self.about_com_kg_m2;
        let c = Vector3::from(self.com_m);
        let central = BodyInertia {
            mass: self.mass_kg,
            first_moment: Vector3::zeros(),
            about_origin: Sym3 { xx, yy, zz, xy, xz, yz },
        };
        central.seen_from(&Matrix3::identity(), &c)
    }

    /// A body that may exist: finite, positive mass, second moments at least zero.
    pub(crate) fn check_physical(&self, link: &str) -> Result<(), RobotError> {
        if !(self.mass_kg > 0.0 && self.mass_kg.is_finite()) {
            return Err(RobotError::Mass { link: link.into(), mass_kg: self.mass_kg });
        }
        if !self.com_m.iter().all(|x| x.is_finite()) {
            return Err(RobotError::CentreOfMass { link: link.into(), com_m: self.com_m });
        }
        if let Some(&entry_kg_m2) = self.about_com_kg_m2.iter().find(|x| !x.is_finite()) {
            return Err(RobotError::InertiaNotFinite { link: link.into(), entry_kg_m2 });
        }
        let [a, b, c] = self.principal_moments_kg_m2();
        // Eigenvalues carry a few roundings of the largest entry.
        let slack = 64.0 * f64::EPSILON * (a.abs() + b.abs() + c.abs());
        if a < -slack {
            return Err(RobotError::NotPositiveDefinite { link: link.into(), principal_kg_m2: [a, b, c] });
        }
        if a + b < c - slack {
            return Err(RobotError::TriangleInequality {
                link: link.into(),
                principal_kg_m2: [a, b, c],
                excess_kg_m2: c - a - b,
            });
        }
        Ok(())
    }
}

/// What a joint may do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JointLimits {
    /// Lower end of the range, rad; minus infinity for a joint without end stops.
    pub lower_rad: f64,
    /// Upper end of the range, rad; infinity for a joint without end stops.
    pub upper_rad: f64,
    /// Largest speed, rad/s; infinity when nothing is stated.
    pub speed_rad_per_s: f64,
    /// Largest torque, N m; infinity when nothing is stated.
    pub torque_n_m: f64,
}

impl JointLimits {
    /// No limit at all.
    pub const NONE: Self = Self {
        lower_rad: f64::NEG_INFINITY,
        upper_rad: f64::INFINITY,
        speed_rad_per_s: f64::INFINITY,
        torque_n_m: f64::INFINITY,
    };
}

/// A link and the revolute joint, about +z of its frame, that carries it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Link {
    /// Name of the link.
    pub name: String,
    /// Name of its joint.
    pub joint_name: String,
    /// The link's frame in the parent link at q = 0; the joint turns about its z.
    pub frame: Frame,
    /// The link's body in its own frame.
    pub inertia: Inertia,
    /// The joint's limits.
    pub limits: JointLimits,
    /// Inertia of the motor as felt at the joint, kg m^2; enters the diagonal of M.
    pub rotor_inertia_kg_m2: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_n_m_s_per_rad: f64,
    /// Coulomb friction, N m.
    pub coulomb_n_m: f64,
}

/// A serial arm on a fixed base, validated; the number of joints is known at run time.
///
/// [`crate::Model`] is the same arm compiled for the recursions, with the number of joints in its type.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robot {
    name: String,
    gravity_m_per_s2: [f64; 3],
    links: Vec<Link>,
    flange: Frame,
}

/// Standard gravity as the field's descriptions use it, along -z of the base, m/s^2.
pub const GRAVITY_M_PER_S2: [f64; 3] = [0.0, 0.0, -9.81];

/// Rotations read from decimal files are orthonormal to about their printed digits.
const ROTATION_TOLERANCE: f64 = 1e-9;

fn check_frame(link: &str, frame: &Frame) -> Result<(), RobotError> {
    if let Some(&value) = frame.xyz_m.iter().chain(frame.rotation.iter().flatten()).find(|x| !x.is_finite()) {
        return Err(RobotError::FrameNotFinite { link: link.into(), value });
    }
    let r = frame.rotation_matrix();
    let deviation = (r.transpose() * r - Matrix3::identity()).amax();
    let determinant = r.determinant();
    if deviation > ROTATION_TOLERANCE || determinant < 0.0 {
        return Err(RobotError::NotARotation { link: link.into(), deviation, determinant });
    }
    Ok(())
}

fn check_limits(link: &str, limits: &JointLimits) -> Result<(), RobotError> {
    let JointLimits { lower_rad, upper_rad, speed_rad_per_s, torque_n_m } = *limits;
    if !(lower_rad < upper_rad && lower_rad < f64::INFINITY && upper_rad > f64::NEG_INFINITY) {
        return Err(RobotError::Range { link: link.into(), lower_rad, upper_rad });
    }
    for (quantity, value) in [("speed limit in rad/s", speed_rad_per_s), ("torque limit in N m", torque_n_m)] {
        if !(value > 0.0) {
            return Err(RobotError::NotPositive { link: link.into(), quantity, value });
        }
    }
    Ok(())
}

impl Robot {
    /// An arm from its links, base to tip; the flange is the last link's frame.
    ///
    /// `gravity_m_per_s2` is the acceleration of a falling body in the base frame.
    ///
    /// # Errors
    /// [`RobotError`] names the link and the numbers: no link, a mass that is not positive, an inertia no body can have, a frame
    /// that is not finite or not a rotation, limits out of order, a negative rotor inertia or friction.
    pub fn new(name: &str, gravity_m_per_s2: [f64; 3], links: Vec<Link>) -> Result<Self, RobotError> {
        if links.is_empty() {
            return Err(RobotError::NoJoint);
        }
        if !gravity_m_per_s2.iter().all(|x| x.is_finite()) {
            return Err(RobotError::Gravity { gravity_m_per_s2 });
        }
        for link in &links {
            check_frame(&link.name, &link.frame)?;
            link.inertia.check_physical(&link.name)?;
            let principal_kg_m2 = link.inertia.principal_moments_kg_m2();
            if !(principal_kg_m2[0] > 0.0) {
                return Err(RobotError::NotPositiveDefinite { link: link.name.clone(), principal_kg_m2 });
            }
            check_limits(&link.name, &link.limits)?;
            for (quantity, value) in [
                ("rotor inertia in kg m^2", link.rotor_inertia_kg_m2),
                ("viscous friction in N m s/rad", link.viscous_n_m_s_per_rad),
                ("Coulomb friction in N m", link.coulomb_n_m),
            ] {
                if !(value >= 0.0 && value.is_finite()) {
                    return Err(RobotError::Negative { link: link.name.clone(), quantity, value });
                }
            }
        }
        Ok(Self { name: name.into(), gravity_m_per_s2, links, flange: Frame::IDENTITY })
    }

    /// An arm from this crate's own tables, whose validity a test establishes.
    pub(crate) fn from_table(name: &str, links: Vec<Link>, flange: Frame) -> Self {
        Self { name: name.into(), gravity_m_per_s2: GRAVITY_M_PER_S2, links, flange }
    }

    /// The same arm with its flange at `flange`, given in the last link's frame.
    ///
    /// # Errors
    /// [`RobotError::FrameNotFinite`] or [`RobotError::NotARotation`].
    pub fn with_flange(mut self, flange: Frame) -> Result<Self, RobotError> {
        check_frame("flange", &flange)?;
        self.flange = flange;
        Ok(self)
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.links.len()
    }

    /// The arm's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The links, base to tip.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Acceleration of a falling body in the base frame, m/s^2.
    pub fn gravity_m_per_s2(&self) -> [f64; 3] {
        self.gravity_m_per_s2
    }

    /// The flange in the last link's frame.
    pub fn flange(&self) -> Frame {
        self.flange
    }

    /// SHA-256, in lower-case hex, of the arm's canonical text: compact JSON, fields in the order of their declaration, numbers in
    /// their shortest round-trip form, an infinite limit as `null`.
    pub fn sha256(&self) -> String {
        // Maps with string keys and finite depth always serialise.
        let text = serde_json::to_vec(self).unwrap_or_default();
        Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// A body held at the flange: rigidly part of the last link while it is attached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Payload {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the last link's frame, m.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz, kg m^2.
    pub about_com_kg_m2: [f64; 6],
}

/// How far beyond the flange a payload given by its mass alone is held, m.
pub const GRASP_BEYOND_FLANGE_M: f64 = 0.2;

impl Payload {
    /// Nothing held.
    pub const NONE: Self = Self { mass_kg: 0.0, com_m: [0.0; 3], about_com_kg_m2: [0.0; 6] };

    /// A body by mass, centre of mass and inertia; mass 0 (with inertia 0) is an empty hand.
    ///
    /// # Errors
    /// [`RobotError`] when the mass is negative or the inertia is none a body can have.
    pub fn new(mass_kg: f64, com_m: [f64; 3], about_com_kg_m2: [f64; 6]) -> Result<Self, RobotError> {
        let body = Inertia { mass_kg, com_m, about_com_kg_m2 };
        let empty = mass_kg.abs() <= 0.0 && about_com_kg_m2.iter().all(|x| x.abs() <= 0.0);
        if !(empty && com_m.iter().all(|x| x.is_finite())) {
            body.check_physical("payload")?;
        }
        Ok(Self { mass_kg, com_m, about_com_kg_m2 })
    }

    /// A point mass at `com_m` of the last link's frame.
    ///
    /// # Errors
    /// [`RobotError::Mass`] unless the mass is finite and at least zero; [`RobotError::CentreOfMass`] when a coordinate is not finite.
    pub fn point(mass_kg: f64, com_m: [f64; 3]) -> Result<Self, RobotError> {
        Self::new(mass_kg, com_m, [0.0; 6])
    }

    /// A point mass held [`GRASP_BEYOND_FLANGE_M`] beyond the flange, along its z: for the Panda at z = 0.307 m of link 7.
    ///
    /// # Errors
    /// [`RobotError::Mass`] unless the mass is finite and at least zero.
    pub fn at_grasp(robot: &Robot, mass_kg: f64) -> Result<Self, RobotError> {
        let flange = robot.flange();
        let com = flange.position() + flange.rotation_matrix().column(2) * GRASP_BEYOND_FLANGE_M;
        Self::point(mass_kg, com.into())
    }

    /// The same as an [`Inertia`] in the last link's frame.
    pub fn inertia(&self) -> Inertia {
        Inertia { mass_kg: self.mass_kg, com_m: self.com_m, about_com_kg_m2: self.about_com_kg_m2 }
    }
}
