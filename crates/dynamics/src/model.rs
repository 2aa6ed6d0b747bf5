//! An arm compiled for the recursions: the number of joints is a type, every joint turns about z, constants are folded.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | R0, p  | `rotation`, `position` | joint frame in the parent link at q = 0 | 1, m |
//! | m, h, I | `body` | mass, first moment `m c`, inertia about the link's origin | kg, kg m, kg m^2 |
//! | I_r    | `rotor_inertia` | rotor inertia on the diagonal of M | kg m^2 |
//! | d, f_c | `viscous`, `coulomb` | friction `d dq + f_c tanh(dq / 0.01)` | N m s/rad, N m |
//!
//! A link's ten numbers enter M, C and g linearly, which is why scaling and payloads are exact here.

use certune_linsys::{Joints, Real};
use nalgebra::{Matrix3, Vector3};

use crate::error::RobotError;
use crate::folded::{Hinge, folded, folded_base};
use crate::robot::{Payload, Robot};
use crate::spatial::{BodyInertia, Sym3};

/// A link as the recursions see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CompiledLink<T: Real> {
    /// R0: the joint frame's axes in the parent frame at q = 0.
    pub rotation: Matrix3<T>,
    /// p: the joint frame's origin in the parent frame.
    pub position: Vector3<T>,
    /// The body in the link's frame, about its origin.
    pub body: BodyInertia<T>,
}

/// An arm with `N` joints, ready for the recursions; immutable, no heap, valid by construction.
///
/// `T` is the scalar: `f64` for one arm, a bundle of lanes for several arms side by side ([`Model::pack`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Model<const N: usize, T: Real = f64> {
    pub(crate) links: [CompiledLink<T>; N],
    /// The same links with the constant rotations folded away; what the O(N) recursions read.
    pub(crate) chain: [Hinge<T>; N],
    pub(crate) gravity: Vector3<T>,
    /// Gravity in the base's folded axes.
    pub(crate) folded_gravity: Vector3<T>,
    pub(crate) rotor_inertia: Joints<N, T>,
    pub(crate) viscous: Joints<N, T>,
    pub(crate) coulomb: Joints<N, T>,
    /// Whether any lane of any joint has Coulomb friction.
    pub(crate) has_coulomb_friction: bool,
    pub(crate) flange_rotation: Matrix3<T>,
    pub(crate) flange_position: Vector3<T>,
}

/// The numbers of one link that enter the recursions, for methods that need them one by one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkConstants {
    /// Joint frame in the parent link at q = 0: row-major rotation, columns are the frame's axes.
    pub rotation: [[f64; 3]; 3],
    /// Joint frame in the parent link at q = 0: origin, m.
    pub position_m: [f64; 3],
    /// Mass, kg.
    pub mass_kg: f64,
    /// Mass times centre of mass, in the link's frame, kg m.
    pub first_moment_kg_m: [f64; 3],
    /// Inertia about the origin of the link's frame: xx, yy, zz, xy, xz, yz, kg m^2.
    pub about_origin_kg_m2: [f64; 6],
}

/// Joint positions in rad and velocities in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<const N: usize, T: Real = f64> {
    /// Joint positions, rad.
    pub q: Joints<N, T>,
    /// Joint velocities, rad/s.
    pub dq: Joints<N, T>,
}

impl<const N: usize, T: Real> State<N, T> {
    /// At rest in `q`.
    pub fn at_rest(q: Joints<N, T>) -> Self {
        Self { q, dq: Joints::zeros() }
    }
}

impl<const N: usize> Model<N> {
    /// Compiles `robot`.
    ///
    /// # Errors
    /// [`RobotError::JointCount`] when the robot has not `N` joints.
    pub fn new(robot: &Robot) -> Result<Self, RobotError> {
        let data: &[_; N] = robot.links().try_into().map_err(|_| RobotError::JointCount {
            robot: robot.name().into(),
            joints: robot.joints(),
            expected: N,
        })?;
        let links = core::array::from_fn(|i| CompiledLink {
            rotation: data[i].frame.rotation_matrix(),
            position: data[i].frame.position(),
            body: data[i].inertia.compiled(),
        });
        Ok(Self {
            chain: folded(&links),
            gravity: robot.gravity_m_per_s2().into(),
            folded_gravity: folded_base(&links, &robot.gravity_m_per_s2().into()),
            links,
            rotor_inertia: Joints::from_fn(|i, _| data[i].rotor_inertia_kg_m2),
            viscous: Joints::from_fn(|i, _| data[i].viscous_n_m_s_per_rad),
            coulomb: Joints::from_fn(|i, _| data[i].coulomb_n_m),
            has_coulomb_friction: data.iter().any(|link| link.coulomb_n_m > 0.0),
            flange_rotation: robot.flange().rotation_matrix(),
            flange_position: robot.flange().position(),
        })
    }

    /// The same arm with each link's mass and inertia multiplied by a factor of at least 0; the centre of mass stays.
    ///
    /// A payload attached before is part of the last link and is scaled with it: scale first, attach after. A factor 0 removes the link's body:
    /// M, C and g stay defined (each is affine in the factors), while the forward dynamics needs the remaining M to be positive definite.
    #[must_use]
    pub fn with_link_scales(&self, scales: &[f64; N]) -> Self {
        let mut scaled = self.clone();
        for (link, &s) in scaled.links.iter_mut().zip(scales) {
            let body = link.body;
            link.body = BodyInertia {
                mass: body.mass * s,
                first_moment: body.first_moment * s,
                about_origin: body.about_origin.scaled(s),
            };
        }
        scaled.chain = folded(&scaled.links);
        scaled
    }

    /// The same arm with `payload` welded to the last link.
    #[must_use]
    pub fn with_payload(&self, payload: &Payload) -> Self {
        let mut loaded = self.clone();
        if let Some(last) = loaded.links.last_mut() {
            last.body = last.body.plus(&payload.inertia().compiled());
        }
        loaded.chain = folded(&loaded.links);
        loaded
    }

    /// The same arm with these rotor inertias, kg m^2, each finite and at least 0 (the robot's own are replaced).
    #[must_use]
    pub fn with_rotor_inertia(&self, rotor_inertia_kg_m2: &Joints<N>) -> Self {
        Self { rotor_inertia: *rotor_inertia_kg_m2, ..self.clone() }
    }

    /// The same arm with this friction, N m s/rad and N m, each finite and at least 0 (the robot's own is replaced).
    #[must_use]
    pub fn with_friction(&self, viscous_n_m_s_per_rad: &Joints<N>, coulomb_n_m: &Joints<N>) -> Self {
        let has_coulomb_friction = coulomb_n_m.iter().any(|friction| *friction > 0.0);
        Self { viscous: *viscous_n_m_s_per_rad, coulomb: *coulomb_n_m, has_coulomb_friction, ..self.clone() }
    }

    /// The same arm under another gravity, m/s^2 in the base frame.
    #[must_use]
    pub fn with_gravity(&self, gravity_m_per_s2: [f64; 3]) -> Self {
        let gravity = gravity_m_per_s2.into();
        Self { gravity, folded_gravity: folded_base(&self.links, &gravity), ..self.clone() }
    }

    /// Mass of each link, payload included, kg.
    pub fn link_masses_kg(&self) -> [f64; N] {
        core::array::from_fn(|i| self.links[i].body.mass)
    }

    /// Frames and bodies of all links, base to tip.
    pub fn link_constants(&self) -> [LinkConstants; N] {
        core::array::from_fn(|i| {
            let CompiledLink { rotation: r, position, body } = self.links[i];
            let inertia = body.about_origin;
            LinkConstants {
                rotation: core::array::from_fn(|a| core::array::from_fn(|b| r[(a, b)])),
                position_m: position.into(),
                mass_kg: body.mass,
                first_moment_kg_m: body.first_moment.into(),
                about_origin_kg_m2: [inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz],
            }
        })
    }

    /// Acceleration of a falling body in the base frame, m/s^2.
    pub fn gravity_m_per_s2(&self) -> [f64; 3] {
        self.gravity.into()
    }

    /// The same arm in every lane of another scalar.
    pub fn splat<T: Real>(&self) -> Model<N, T> {
        Model::pack(&[self], |[x]| T::from_f64(x))
    }
}

impl<const N: usize, T: Real> Model<N, T> {
    /// `L` arms side by side: `lanes` makes one scalar of the arms' `L` numbers.
    pub fn pack<const L: usize>(arms: &[&Model<N>; L], lanes: impl Fn([f64; L]) -> T) -> Self {
        let number = |get: &dyn Fn(&Model<N>) -> f64| lanes(arms.map(get));
        let vector = |get: &dyn Fn(&Model<N>) -> Vector3<f64>| Vector3::from_fn(|r, _| number(&|arm| get(arm)[r]));
        let matrix = |get: &dyn Fn(&Model<N>) -> Matrix3<f64>| Matrix3::from_fn(|r, c| number(&|arm| get(arm)[(r, c)]));
        let joints = |get: &dyn Fn(&Model<N>) -> Joints<N>| Joints::from_fn(|r, _| number(&|arm| get(arm)[r]));
        let body = |get: &dyn Fn(&Model<N>) -> BodyInertia<f64>| BodyInertia {
            mass: number(&|arm| get(arm).mass),
            first_moment: vector(&|arm| get(arm).first_moment),
            about_origin: Sym3 {
                xx: number(&|arm| get(arm).about_origin.xx),
                yy: number(&|arm| get(arm).about_origin.yy),
                zz: number(&|arm| get(arm).about_origin.zz),
                xy: number(&|arm| get(arm).about_origin.xy),
                xz: number(&|arm| get(arm).about_origin.xz),
                yz: number(&|arm| get(arm).about_origin.yz),
            },
        };
        Self {
            chain: core::array::from_fn(|i| Hinge {
                tilt: [0, 1].map(|k| number(&|arm| arm.chain[i].tilt[k])),
                offset: number(&|arm| arm.chain[i].offset),
                position: vector(&|arm| arm.chain[i].position),
                body: body(&|arm| arm.chain[i].body),
            }),
            links: core::array::from_fn(|i| CompiledLink {
                rotation: matrix(&|arm| arm.links[i].rotation),
                position: vector(&|arm| arm.links[i].position),
                body: body(&|arm| arm.links[i].body),
            }),
            gravity: vector(&|arm| arm.gravity),
            folded_gravity: vector(&|arm| arm.folded_gravity),
            rotor_inertia: joints(&|arm| arm.rotor_inertia),
            viscous: joints(&|arm| arm.viscous),
            coulomb: joints(&|arm| arm.coulomb),
            has_coulomb_friction: arms.iter().any(|arm| arm.has_coulomb_friction),
            flange_rotation: matrix(&|arm| arm.flange_rotation),
            flange_position: vector(&|arm| arm.flange_position),
        }
    }

    /// Rotor inertia of each joint, kg m^2.
    pub fn rotor_inertia_kg_m2(&self) -> &Joints<N, T> {
        &self.rotor_inertia
    }

    /// Viscous friction of each joint, N m s/rad.
    pub fn viscous_n_m_s_per_rad(&self) -> &Joints<N, T> {
        &self.viscous
    }

    /// Coulomb friction of each joint, N m.
    pub fn coulomb_n_m(&self) -> &Joints<N, T> {
        &self.coulomb
    }
}
