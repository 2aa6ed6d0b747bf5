//! Random arms of four joints: any frames, any physical bodies, rotors, friction. All chance enters through these strategies.

use certune_dynamics::{Frame, GRAVITY_M_PER_S2, Inertia, JointLimits, Joints, Link, Robot, RobotError, State};
use proptest::array::uniform3;
use proptest::collection::vec;
use proptest::prelude::*;

/// Joints of the random arms.
pub const N: usize = 4;

fn frame() -> impl Strategy<Value = Frame> {
    (uniform3(-0.4..0.4), uniform3(-3.0..3.0)).prop_map(|(xyz_m, rpy_rad)| Frame::from_rpy(xyz_m, rpy_rad))
}

/// A uniform box of 4 to 40 cm, anywhere and any way round.
fn body() -> impl Strategy<Value = Inertia> {
    (0.1..5.0, uniform3(0.04..0.4), frame()).prop_map(|(mass_kg, side_m, frame): (f64, [f64; 3], Frame)| {
        let [a, b, c] = side_m.map(|x| mass_kg * x * x / 12.0);
        let own = Inertia { mass_kg, com_m: [0.0; 3], about_com_kg_m2: [b + c, a + c, a + b, 0.0, 0.0, 0.0] };
        own.in_parent(&frame)
    })
}

/// Rotor inertia, viscous and Coulomb friction of a link, zero included.
fn drive() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![Just([0.0; 3]), [0.0..0.2, 0.0..2.0, 0.0..1.0]]
}

/// An arm with `N` links.
pub fn robot() -> impl Strategy<Value = Result<Robot, RobotError>> {
    vec((frame(), body(), drive()), N).prop_map(|rows| {
        let links = rows.into_iter().enumerate().map(|(i, (frame, inertia, drive))| Link {
            name: format!("link{i}"),
            joint_name: format!("joint{i}"),
            frame,
            inertia,
            limits: JointLimits::NONE,
            rotor_inertia_kg_m2: drive[0],
            viscous_n_m_s_per_rad: drive[1],
            coulomb_n_m: drive[2],
        });
        Robot::new("random", GRAVITY_M_PER_S2, links.collect())
    })
}

/// One number per joint within `+-bound`.
pub fn joints(bound: f64) -> impl Strategy<Value = Joints<N>> {
    [-bound..bound, -bound..bound, -bound..bound, -bound..bound].prop_map(Joints::from)
}

/// Any configuration, up to 2 rad/s.
pub fn state() -> impl Strategy<Value = State<N>> {
    (joints(3.1), joints(2.0)).prop_map(|(q, dq)| State { q, dq })
}
