//! Robot descriptions, rigid-body algorithms and the Panda.
//!
//! An arm with `N` revolute joints on a fixed base obeys
//!
//! ```text
//! M(q) ddq + C(q, dq) dq + g(q) + d dq + f_c tanh(dq / 0.01 rad/s) = tau
//! ```
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | q, dq, ddq | [`State`], [`Joints`] | N | rad, rad/s, rad/s^2 |
//! | tau | [`Joints`] | N | N m |
//! | M (with rotor inertia on the diagonal) | [`mass_matrix`] | N x N | kg m^2 |
//! | C, Christoffel form: `dM/dt = C + C'` | [`coriolis_matrix`] | N x N | kg m^2/s |
//! | g | [`gravity_torque`] | N | N m |
//! | dg/dq, symmetric | [`gravity_jacobian`] | N x N | N m/rad |
//! | dM/dq_j | [`mass_matrix_derivatives`] | N of N x N | kg m^2/rad |
//!
//! A [`Robot`] is data, checked once when it is made (from numbers, from a URDF file, or built in); a [`Model`] is the same arm
//! compiled, with its number of joints in the type; every function of a state takes a model and cannot fail, allocate or
//! panic. All are generic in the scalar [`Real`], so that several arms can run side by side in lanes.
//!
//! ```
//! use certune_dynamics::{Joints, Model, Robot, State, forward_dynamics, gravity_torque};
//!
//! let panda: Model<7> = Model::new(&Robot::panda())?;
//! let at = State::at_rest(Joints::<7>::from([0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0]));
//! let holding = gravity_torque(&panda, &at.q);
//! // A torque that balances gravity leaves the arm at rest.
//! assert!(forward_dynamics(&panda, &at, &holding).amax() < 1e-12);
//! # Ok::<(), certune_dynamics::RobotError>(())
//! ```
//!
//! Source of the algorithms: Featherstone, *Rigid Body Dynamics Algorithms* (2008); each module names its own. Limits: fixed base, one chain,
//! revolute joints, rigid links.
#![forbid(unsafe_code)]

mod base;
mod builtin;
mod coriolis;
mod dispatch;
mod energy;
mod error;
mod flange;
mod folded;
mod forward;
mod friction;
mod gravity;
mod inverse;
mod linearise;
mod local;
mod mass;
mod model;
mod posture;
mod robot;
mod spatial;
mod urdf;

pub use builtin::BUILT_IN;
pub use certune_linsys::{JointMatrix, Joints, Real};
pub use coriolis::{coriolis_matrix, coriolis_torque, mass_matrix_derivatives};
pub use dispatch::MOST_JOINTS;
pub use energy::{kinetic_energy, potential_energy};
pub use error::RobotError;
pub use flange::{flange_jacobian, flange_pose, joint_origins};
pub use forward::{forward_dynamics, forward_dynamics_with_armature};
pub use friction::{COULOMB_SPEED_RAD_PER_S, friction_slope, friction_torque};
pub use gravity::{gravity_jacobian, gravity_torque};
pub use inverse::inverse_dynamics;
pub use linearise::{Linearisation, TorqueDerivatives, inverse_dynamics_derivatives, linearise};
pub use mass::{mass_matrix, mass_matrix_as_described};
pub use model::{LinkConstants, Model, State};
pub use posture::Posture;
pub use robot::{Frame, GRASP_BEYOND_FLANGE_M, GRAVITY_M_PER_S2, Inertia, JointLimits, Link, Payload, Robot};
