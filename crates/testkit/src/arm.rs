//! Arms nobody has built, and things for them to hold.
//!
//! A body is a uniform box of mass m and sides a, b, c, anywhere and any way round:
//!
//! ```text
//! principal moments   m/12 (b² + c²),  m/12 (a² + c²),  m/12 (a² + b²)
//! ```
//!
//! so that its inertia is positive definite and meets the triangle inequality by construction, for any positive sides.
//!
//! | symbol | range | unit |
//! |--------|-------|------|
//! | mass of a link | 0.05 to 10, log-uniform, simplest 1 | kg |
//! | sides | 0.02 to 0.4, log-uniform, simplest 0.1 | m |
//! | centre of mass in the link | ±0.3 each way | m |
//! | joint frame in its parent | ±0.4 each way; quarter turns as often as any turn | m, rad |
//! | rotor inertia, viscous and Coulomb friction | none, or up to 0.2, 2, 1 | kg m², N m s/rad, N m |
//!
//! Quarter turns are drawn on purpose: real arms have little else, and parallel or meeting axes are where a recursion
//! that is wrong by a term goes unnoticed or a division by zero hides.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::RangeInclusive;

use certune_dynamics::{Frame, GRAVITY_M_PER_S2, Inertia, JointLimits, Link, Payload, Robot, RobotError};
use proptest::array::uniform;
use proptest::prelude::*;

use crate::draw::{log_within, within};

/// Roll, pitch and yaw, rad: quarter turns or any.
fn turns() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        uniform::<_, 3>(-1..=2_i8).prop_map(|quarters| quarters.map(|n| f64::from(n) * FRAC_PI_2)),
        uniform::<_, 3>(within(-PI..=PI, 0.0)),
    ]
}

/// A frame whose origin lies within `±reach_m` each way.
fn frame(reach_m: f64) -> impl Strategy<Value = Frame> {
    (uniform::<_, 3>(within(-reach_m..=reach_m, 0.0)), turns()).prop_map(|(xyz_m, rpy)| Frame::from_rpy(xyz_m, rpy))
}

/// A box of `mass_kg` with these sides, centred in `frame`, seen from the parent of `frame`.
fn cuboid(mass_kg: f64, sides_m: [f64; 3], frame: &Frame) -> Inertia {
    let [a, b, c] = sides_m.map(|side| mass_kg * side * side / 12.0);
    Inertia { mass_kg, com_m: [0.0; 3], about_com_kg_m2: [b + c, a + c, a + b, 0.0, 0.0, 0.0] }.in_parent(frame)
}

fn sides() -> impl Strategy<Value = [f64; 3]> {
    uniform::<_, 3>(log_within(0.02..=0.4, 0.1))
}

fn body() -> impl Strategy<Value = Inertia> {
    (log_within(0.05..=10.0, 1.0), sides(), frame(0.3))
        .prop_map(|(mass_kg, sides_m, frame)| cuboid(mass_kg, sides_m, &frame))
}

/// Rotor inertia, viscous and Coulomb friction; none of them in half of the draws.
fn drive() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![Just([0.0; 3]), [within(0.0..=0.2, 0.0), within(0.0..=2.0, 0.0), within(0.0..=1.0, 0.0)]]
}

/// No limits, or a range that may lie to either side of 0.
fn limits() -> impl Strategy<Value = JointLimits> {
    let stops = (within(-PI..=3.0, -PI), log_within(0.1..=2.0 * PI, 2.0 * PI));
    let motor = (log_within(0.5..=10.0, 2.0), log_within(5.0..=200.0, 50.0));
    let limited = (stops, motor).prop_map(|((lower_rad, width), (speed_rad_per_s, torque_n_m))| JointLimits {
        lower_rad,
        upper_rad: lower_rad + width,
        speed_rad_per_s,
        torque_n_m,
    });
    prop_oneof![Just(JointLimits::NONE), limited]
}

/// The links of an arm and its flange, still to be judged by [`Robot::new`].
fn parts<const N: usize>() -> impl Strategy<Value = (Vec<Link>, Frame)> {
    let rows = uniform::<_, N>((frame(0.4), body(), limits(), drive()));
    (rows, frame(0.2)).prop_map(|(rows, flange)| {
        let links = rows.into_iter().enumerate().map(|(i, (frame, inertia, limits, drive))| {
            let [rotor_inertia_kg_m2, viscous_n_m_s_per_rad, coulomb_n_m] = drive;
            Link {
                name: format!("link{}", i + 1),
                joint_name: format!("joint{}", i + 1),
                frame,
                inertia,
                limits,
                rotor_inertia_kg_m2,
                viscous_n_m_s_per_rad,
                coulomb_n_m,
            }
        });
        (links.collect(), flange)
    })
}

fn assembled((links, flange): (Vec<Link>, Frame)) -> Result<Robot, RobotError> {
    Robot::new("random", GRAVITY_M_PER_S2, links)?.with_flange(flange)
}

/// A valid serial arm of `N` joints: any frames, bodies, limits and drives.
///
/// Each link is a uniform box of 0.05 to 10 kg with sides of 2 to 40 cm, centred within 0.3 m of its joint's frame each
/// way; that frame is within 0.4 m of its parent each way, turned by quarter turns or by any angles; there are arms
/// with and without limits, rotor inertia (up to 0.2 kg m²), viscous (up to 2 N m s/rad) and Coulomb friction (up to 1
/// N m). Shrinks towards cubes of 1 kg and 10 cm without limits or friction, all on one vertical axis.
///
/// ```
/// use certune_dynamics::{Model, mass_matrix};
/// use certune_testkit::{configuration, serial_arm};
/// use proptest::prelude::*;
///
/// proptest!(|(robot in serial_arm::<3>(), q in configuration::<3>())| {
///     let inertia = mass_matrix(&Model::<3>::new(&robot)?, &q);
///     prop_assert!(inertia.symmetric_eigenvalues().min() > 0.0);
/// });
/// ```
///
/// # Panics
/// For `N` = 0: an arm has a joint.
pub fn serial_arm<const N: usize>() -> impl Strategy<Value = Robot> {
    parts::<N>().prop_map(|parts| assembled(parts).expect("an arm that is valid by construction"))
}

/// A uniform box of 2 to 40 cm in the hand: its centre within 10 cm of the last link's axis and up to 30 cm out along
/// it, any way round. A mass of 0 is an empty hand. Shrinks to the lightest box of `mass_kg`.
///
/// For a payload known by its mass alone, see [`Payload::at_grasp`].
///
/// # Panics
/// Unless `mass_kg` is a range of finite numbers of at least 0.
pub fn payload(mass_kg: RangeInclusive<f64>) -> impl Strategy<Value = Payload> {
    assert!(*mass_kg.start() >= 0.0, "no mass of a payload: {} kg", mass_kg.start());
    let aside = || within(-0.1..=0.1, 0.0);
    let place = (aside(), aside(), within(0.0..=0.3, 0.0), turns());
    (within(mass_kg, 0.0), sides(), place).prop_map(|(mass_kg, sides_m, (x, y, z, rpy))| {
        let body = cuboid(mass_kg, sides_m, &Frame::from_rpy([x, y, z], rpy));
        Payload { mass_kg, com_m: body.com_m, about_com_kg_m2: body.about_com_kg_m2 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_draw_is_an_arm<const N: usize>() {
        proptest!(|(parts in parts::<N>())| {
            let robot = assembled(parts)?;
            prop_assert_eq!(robot.joints(), N);
        });
    }

    /// Without the `expect` of [`serial_arm`], which would hide the numbers.
    #[test]
    fn every_draw_is_accepted_by_the_door_of_robot() {
        every_draw_is_an_arm::<1>();
        every_draw_is_an_arm::<2>();
        every_draw_is_an_arm::<7>();
        every_draw_is_an_arm::<10>();
    }

    proptest! {
        #[test]
        fn a_body_meets_the_triangle_inequality_with_room(body in body()) {
            let [a, b, c] = body.principal_moments_kg_m2();
            // The thinnest of the boxes leaves 2 a² of a + b - c.
            let least = 2.0 * body.mass_kg * 0.02 * 0.02 / 12.0;
            prop_assert!(a > 0.0 && a + b - c > 0.99 * least, "{a} {b} {c}");
        }
    }
}
