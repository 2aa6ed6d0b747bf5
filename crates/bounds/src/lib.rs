//! Constants of an arm that the certificates rest on.
//!
//! A certificate of the nonlinear loop sees the arm only through five numbers, each of which must hold for every joint
//! position `q`, every link mass, every payload and every rotor inertia of a box ([`ArmBox`]):
//!
//! ```text
//! m_lo I <= M(q) <= m_hi I                                         inertia
//! ½ |dq' (Σ_j y_j ∂M/∂q_j) dq| <= k_c |y| |dq|²                    Coriolis term, in absolute size
//! ½ |dq' (Σ_j y_j ∂M/∂q_j) dq| <= k_r |y| dq' M(q) dq              the same, relative to the kinetic energy
//! |∂g/∂q| <= k_g                                                   gravity stiffness (spectral norm; symmetric)
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | m_lo, m_hi | [`Constants::m_lo_kg_m2`], [`Constants::m_hi_kg_m2`] | kg m² |
//! | k_g | [`Constants::k_g_n_m_per_rad`] | N m/rad |
//! | k_c | [`Constants::k_c_kg_m2`] | kg m² (per rad) |
//! | k_r | [`Constants::k_r`] | 1 (per rad) |
//! | M = Σ_i s_i M_i(q) + diag(r) | [`ArmBox`], [`MassGroup`] | kg m² |
//! | s_i in `[lo_i, hi_i]` | [`MassGroup::scale`] | 1; kg for the payload |
//! | r_j in `[r_lo, r_hi]` | rotor inertia of joint j, seen at the joint | kg m² |
//!
//! The inertia matrix, the gravity torque and their derivatives are affine in the scales `s_i`, because a link's inertia
//! tensor scales with its mass. For a fixed configuration and fixed directions the worst masses are therefore at corners
//! of the box, found by the sign of each link's share: no mass is ever sampled.
//!
//! # What these numbers are worth
//! [`sampled_constants`] looks for the extremes over *all* angles by a low-discrepancy sample and a local maximisation from
//! the best points, then widens the result by a stated margin. **These constants are sampled, not proved**: a search can only
//! show that a constant is at least as bad as what it found. Whatever rests on them is at most *conditional* evidence, a
//! statement of the form "if these constants hold", and must say so; it never counts as proved. The
//! configuration that attains each constant is part of the result, so that anyone can re-evaluate it.
//!
//! Proved constants come from [`rigorous`] (upper bounds: polygons around circles, equispaced angles) and [`riccati`] (lower bounds and
//! the relative Coriolis constants: branch and bound), and [`record()`] stores them with what proves them.
//!
//! [`maximise`] is the same kind of search for any score over a box, such as the spectral abscissa of a linearised loop:
//! what it finds is a counterexample that can be checked; what it does not find proves nothing.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms* (2008), for M and its derivatives; the bounds are classical, e.g.
//! Ghorbel, Srinivasan and Spong, *On the uniform boundedness of the inertia matrix of serial robot manipulators* (1998).
//! Limits: serial arms with revolute joints on a fixed base; inertias proportional to mass with a fixed centre of mass.
#![forbid(unsafe_code)]

mod arm_box;
mod ascent;
mod constants;
mod eigen;
mod enclosure;
mod error;
mod interval;
mod maximise;
mod quantity;
mod record;
pub mod riccati;
pub mod rigorous;
mod sampled;
mod sequence;

pub use arm_box::{ArmBox, MassGroup, Member, Ranges};
pub use constants::{Attained, Constants, Extremes, SampledConstants, SamplingOptions};
pub use enclosure::{Enclosure, enclosure};
pub use error::BoundsError;
pub use maximise::{Axis, Maximum, SearchOptions, maximise};
pub use record::{RecordError, recheck, record};
pub use sampled::sampled_constants;
