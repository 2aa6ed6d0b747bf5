//! The arms that need no file: the Franka Emika Panda with its hand, without it, and as boxes.
//!
//! | robot | links | source |
//! |-------|-------|--------|
//! | `panda` | identified inertials; the hand, with both fingers at zero opening, is welded to link 7 | `franka_description` as shipped in example-robot-data 6 (`panda_description/urdf/panda.urdf`, Apache-2.0); the same numbers are in MuJoCo's public Panda model |
//! | `panda-bare` | the same without hand and fingers | same |
//! | `panda-cuboid` | arm with hand, merged first; then each link a uniform box along its frame's axes with the same mass, centre of mass and diagonal inertia; rotor inertia 0.1 kg m^2 | the approximated model of Pezzato, Ferrari & Hernandez Corbato, "A novel adaptive controller for robot manipulators based on active inference" (2020), rebuilt on the identified numbers |
//!
//! Identified inertials: Gaz, Cognetti, Oliva, Robuffo Giordano & De Luca, "Dynamic identification of the Franka Emika Panda robot with retrieval of feasible
//! parameters using penalty-based optimization" (2019). Ranges, speeds and torques: the maker's control-parameter sheet. Friction and rotor
//! inertia are 0 unless said otherwise: the measured ones depend on the robot and its temperature, so they belong to the task. The
//! boxes' masses are nominal; a spread of them enters through [`crate::Model::with_link_scales`].
//!
//! Units: m, kg, kg m^2, rad, rad/s, N m. Quarter turns are exact: every rotation entry is 0 or +-1 (the hand's eighth turn is not).

use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::robot::{Frame, Inertia, JointLimits, Link, Robot};

/// Names of the arms that need no file, as [`Robot::built_in`] takes them.
pub const BUILT_IN: [&str; 3] = ["panda", "panda-bare", "panda-cuboid"];

struct Row {
    xyz_m: [f64; 3],
    roll_rad: f64,
    range_rad: [f64; 2],
    speed_rad_per_s: f64,
    torque_n_m: f64,
    body: Inertia,
}

const fn body(mass_kg: f64, com_m: [f64; 3], about_com_kg_m2: [f64; 6]) -> Inertia {
    Inertia { mass_kg, com_m, about_com_kg_m2 }
}

/// Seven links: joint frame, limits, identified body (xx, yy, zz, xy, xz, yz).
const PANDA: [Row; 7] = [
    Row {
        xyz_m: [0.0, 0.0, 0.333],
        roll_rad: 0.0,
        range_rad: [-2.8973, 2.8973],
        speed_rad_per_s: 2.175,
        torque_n_m: 87.0,
        body: body(
            4.970684,
            [0.003875, 0.002081, -0.04762],
            [0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169],
        ),
    },
    Row {
        xyz_m: [0.0, 0.0, 0.0],
        roll_rad: -FRAC_PI_2,
        range_rad: [-1.7628, 1.7628],
        speed_rad_per_s: 2.175,
        torque_n_m: 87.0,
        body: body(
            0.646926,
            [-0.003141, -0.02872, 0.003495],
            [0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704],
        ),
    },
    Row {
        xyz_m: [0.0, -0.316, 0.0],
        roll_rad: FRAC_PI_2,
        range_rad: [-2.8973, 2.8973],
        speed_rad_per_s: 2.175,
        torque_n_m: 87.0,
        body: body(
            3.228604,
            [0.027518, 0.039252, -0.066502],
            [0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805],
        ),
    },
    Row {
        xyz_m: [0.0825, 0.0, 0.0],
        roll_rad: FRAC_PI_2,
        range_rad: [-3.0718, -0.0698],
        speed_rad_per_s: 2.175,
        torque_n_m: 87.0,
        body: body(
            3.587895,
            [-0.05317, 0.104419, 0.027454],
            [0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641],
        ),
    },
    Row {
        xyz_m: [-0.0825, 0.384, 0.0],
        roll_rad: -FRAC_PI_2,
        range_rad: [-2.8973, 2.8973],
        speed_rad_per_s: 2.61,
        torque_n_m: 12.0,
        body: body(
            1.225946,
            [-0.011953, 0.041065, -0.038437],
            [0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229],
        ),
    },
    Row {
        xyz_m: [0.0, 0.0, 0.0],
        roll_rad: FRAC_PI_2,
        range_rad: [-0.0175, 3.7525],
        speed_rad_per_s: 2.61,
        torque_n_m: 12.0,
        body: body(
            1.666555,
            [0.060149, -0.014117, -0.010517],
            [0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341],
        ),
    },
    Row {
        xyz_m: [0.088, 0.0, 0.0],
        roll_rad: FRAC_PI_2,
        range_rad: [-2.8973, 2.8973],
        speed_rad_per_s: 2.61,
        torque_n_m: 12.0,
        body: body(
            0.735522,
            [0.010517, -0.004252, 0.061597],
            [0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741],
        ),
    },
];

/// The flange in link 7.
const FLANGE_M: [f64; 3] = [0.0, 0.0, 0.107];
/// The hand in its own frame, which is the flange turned by -pi/4 about z.
const HAND: Inertia = body(0.73, [-0.01, 0.0, 0.03], [0.001, 0.0025, 0.0017, 0.0, 0.0, 0.0]);
/// One finger, and its frame in the hand at zero opening (the same for both).
const FINGER: Inertia = body(0.015, [0.0; 3], [2.3749999999999997e-06, 2.3749999999999997e-06, 7.5e-07, 0.0, 0.0, 0.0]);
const FINGER_M: [f64; 3] = [0.0, 0.0, 0.0584];
/// What MuJoCo's public Panda model takes on every joint, kg m^2.
const CUBOID_ROTOR_KG_M2: f64 = 0.1;

fn links() -> Vec<Link> {
    (1..)
        .zip(&PANDA)
        .map(|(number, row)| Link {
            name: format!("panda_link{number}"),
            joint_name: format!("panda_joint{number}"),
            frame: Frame::from_rpy(row.xyz_m, [row.roll_rad, 0.0, 0.0]),
            inertia: row.body,
            limits: JointLimits {
                lower_rad: row.range_rad[0],
                upper_rad: row.range_rad[1],
                speed_rad_per_s: row.speed_rad_per_s,
                torque_n_m: row.torque_n_m,
            },
            rotor_inertia_kg_m2: 0.0,
            viscous_n_m_s_per_rad: 0.0,
            coulomb_n_m: 0.0,
        })
        .collect()
}

fn links_with_hand() -> Vec<Link> {
    let mut links = links();
    let hand_frame = Frame::from_rpy(FLANGE_M, [0.0, 0.0, -FRAC_PI_4]);
    let finger = FINGER.in_parent(&Frame { xyz_m: FINGER_M, ..Frame::IDENTITY });
    let hand = HAND.merged(&finger).merged(&finger).in_parent(&hand_frame);
    if let Some(last) = links.last_mut() {
        last.inertia = last.inertia.merged(&hand);
    }
    links
}

fn flange() -> Frame {
    Frame { xyz_m: FLANGE_M, ..Frame::IDENTITY }
}

impl Robot {
    /// The Panda with its hand, fingers locked at zero opening and merged into link 7: 7 joints, identified inertials.
    pub fn panda() -> Self {
        Self::from_table("panda", links_with_hand(), flange())
    }

    /// The Panda without a hand.
    pub fn panda_bare() -> Self {
        Self::from_table("panda-bare", links(), flange())
    }

    /// The approximated Panda: each link of [`Robot::panda`] (hand merged) as a uniform axis-aligned box, rotor inertia 0.1 kg m^2.
    pub fn panda_cuboid() -> Self {
        let mut boxes = links_with_hand();
        for link in &mut boxes {
            let [xx, yy, zz, ..] = link.inertia.about_com_kg_m2;
            link.inertia.about_com_kg_m2 = [xx, yy, zz, 0.0, 0.0, 0.0];
            link.rotor_inertia_kg_m2 = CUBOID_ROTOR_KG_M2;
        }
        Self::from_table("panda-cuboid", boxes, flange())
    }

    /// The arm of that name in [`BUILT_IN`].
    pub fn built_in(name: &str) -> Option<Self> {
        match name {
            "panda" => Some(Self::panda()),
            "panda-bare" => Some(Self::panda_bare()),
            "panda-cuboid" => Some(Self::panda_cuboid()),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_arm_passes_the_door() {
        for name in BUILT_IN {
            let robot = Robot::built_in(name).unwrap();
            assert_eq!(robot.name(), name);
            let again = Robot::new(name, robot.gravity_m_per_s2(), robot.links().to_vec())
                .and_then(|arm| arm.with_flange(robot.flange()))
                .unwrap();
            assert_eq!(again, robot);
        }
        assert!(Robot::built_in("Panda").is_none());
    }

    #[test]
    fn arm_frames_are_exact() {
        for link in links() {
            for entry in link.frame.rotation.iter().flatten() {
                assert!([0.0, 1.0, -1.0].contains(entry), "{}: {entry}", link.name);
            }
        }
    }

    /// Exact integers, in 1e-6 kg m^2: twice the second moments of the identified links are positive definite.
    #[test]
    fn identified_inertias_meet_the_triangle_inequality_exactly() {
        for (row, name) in PANDA.iter().zip(1..) {
            let micro = row.body.about_com_kg_m2.map(|x| {
                let scaled = x * 1e6;
                assert!((scaled - scaled.round()).abs() < 1e-6, "six decimals");
                scaled.round() as i128
            });
            let [xx, yy, zz, xy, xz, yz] = micro;
            let trace = xx + yy + zz;
            let [a, b, c] = [trace - 2 * xx, trace - 2 * yy, trace - 2 * zz];
            let [d, e, f] = [-2 * xy, -2 * xz, -2 * yz];
            assert!(a > 0, "link {name}");
            assert!(a * b - d * d > 0, "link {name}");
            let determinant = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
            assert!(determinant > 0, "link {name}: {determinant}");
        }
        let [p, q, r] = PANDA[1].body.principal_moments_kg_m2();
        assert!((p + q - r - 1.7e-6).abs() < 0.1e-6, "link 2 is the near miss: {}", p + q - r);
    }

    #[test]
    fn the_hand_is_part_of_link_7() {
        let (with, bare) = (Robot::panda(), Robot::panda_bare());
        let gained = with.links()[6].inertia.mass_kg - bare.links()[6].inertia.mass_kg;
        assert!((gained - 0.76).abs() < 1e-12);
        assert_eq!(with.links()[..6], bare.links()[..6]);
    }
}
