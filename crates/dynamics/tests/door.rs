//! Contract: a number that no arm can have is refused where it enters, by the link's name and with the number.

use certune_dynamics::{Frame, GRAVITY_M_PER_S2, Inertia, Link, Model, Payload, Robot, RobotError};

type Change<'a> = &'a dyn Fn(&mut Link);

/// The Panda with its fourth link changed.
fn altered(change: impl Fn(&mut Link)) -> Result<Robot, RobotError> {
    let mut links = Robot::panda().links().to_vec();
    change(&mut links[3]);
    Robot::new("altered", GRAVITY_M_PER_S2, links)
}

fn message(change: impl Fn(&mut Link)) -> String {
    match altered(change) {
        Ok(_) => String::from("accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn every_bad_number_is_named() {
    let cases: [(&str, Change); 20] = [
        ("the mass is 0 kg", &|l| l.inertia.mass_kg = 0.0),
        ("the mass is -1 kg", &|l| l.inertia.mass_kg = -1.0),
        ("the mass is NaN kg", &|l| l.inertia.mass_kg = f64::NAN),
        ("the mass is inf kg", &|l| l.inertia.mass_kg = f64::INFINITY),
        ("centre of mass is [NaN", &|l| l.inertia.com_m[0] = f64::NAN),
        ("an entry of the inertia is inf", &|l| l.inertia.about_com_kg_m2[4] = f64::INFINITY),
        ("not positive definite", &|l| l.inertia.about_com_kg_m2[3] = 0.1),
        ("not positive definite", &|l| l.inertia.about_com_kg_m2 = [0.0; 6]),
        ("exceeds the sum of the others by 1", &|l| l.inertia.about_com_kg_m2 = [1.0, 1.0, 3.0, 0.0, 0.0, 0.0]),
        ("its frame has the entry NaN", &|l| l.frame.xyz_m[2] = f64::NAN),
        ("its frame has the entry inf", &|l| l.frame.rotation[1][1] = f64::INFINITY),
        ("its frame is no rotation", &|l| l.frame.rotation[0][0] = 1.1),
        ("det R = -1", &|l| l.frame.rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
        ("range is [1, -1] rad", &|l| (l.limits.lower_rad, l.limits.upper_rad) = (1.0, -1.0)),
        ("range is [NaN", &|l| l.limits.lower_rad = f64::NAN),
        ("the torque limit in N m is 0", &|l| l.limits.torque_n_m = 0.0),
        ("the speed limit in rad/s is -2", &|l| l.limits.speed_rad_per_s = -2.0),
        ("the rotor inertia in kg m^2 is -0.1", &|l| l.rotor_inertia_kg_m2 = -0.1),
        ("the viscous friction in N m s/rad is NaN", &|l| l.viscous_n_m_s_per_rad = f64::NAN),
        ("the Coulomb friction in N m is inf", &|l| l.coulomb_n_m = f64::INFINITY),
    ];
    for (expected, change) in cases {
        let message = message(change);
        assert!(message.contains("link `panda_link4`") && message.contains(expected), "{expected}: {message}");
    }
}

#[test]
fn the_triangle_inequality_is_tested_to_its_last_digits() {
    // Principal moments 1, 2 and 3: a plate, physical. One part in 1e9 more: not.
    let turn = Frame::from_rpy([0.0; 3], [0.3, -1.1, 0.7]);
    let with_largest = |largest: f64| {
        let plate = Inertia { mass_kg: 1.0, com_m: [0.0; 3], about_com_kg_m2: [1.0, 2.0, largest, 0.0, 0.0, 0.0] };
        altered(|link| link.inertia = plate.in_parent(&turn))
    };
    assert!(with_largest(3.0).is_ok());
    assert!(with_largest(3.0 - 1e-9).is_ok());
    assert!(matches!(with_largest(3.0 + 1e-9), Err(RobotError::TriangleInequality { .. })));
    // The identified link 2 of the Panda meets it by 1.7e-6 kg m^2; 2e-6 more on the largest axis and it does not.
    let links = Robot::panda().links().to_vec();
    let [a, b, c] = links[1].inertia.principal_moments_kg_m2();
    assert!(a + b - c > 1.6e-6 && a + b - c < 1.8e-6);
}

#[test]
fn an_arm_needs_joints_gravity_and_the_right_size() {
    assert!(matches!(Robot::new("none", GRAVITY_M_PER_S2, vec![]), Err(RobotError::NoJoint)));
    let links = Robot::panda().links().to_vec();
    assert!(matches!(Robot::new("lost", [0.0, f64::NAN, 0.0], links), Err(RobotError::Gravity { .. })));
    assert!(matches!(Model::<6>::new(&Robot::panda()), Err(RobotError::JointCount { joints: 7, expected: 6, .. })));
    let bent = Frame { rotation: [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..Frame::IDENTITY };
    assert!(matches!(Robot::panda().with_flange(bent), Err(RobotError::NotARotation { .. })));
}

#[test]
fn a_payload_is_a_body_or_nothing() {
    assert_eq!(Payload::point(0.0, [0.0; 3]).unwrap(), Payload::NONE);
    assert!(Payload::point(-0.1, [0.0; 3]).is_err());
    assert!(Payload::point(f64::NAN, [0.0; 3]).is_err());
    assert!(Payload::point(0.0, [f64::NAN, 0.0, 0.0]).is_err());
    assert!(Payload::new(0.0, [0.0; 3], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).is_err());
    assert!(Payload::new(1.0, [0.0; 3], [1.0, 1.0, 3.0, 0.0, 0.0, 0.0]).is_err());
    let held = Payload::at_grasp(&Robot::panda(), 0.7).unwrap();
    assert!((held.com_m[2] - 0.307).abs() < 1e-15 && held.com_m[0].abs() <= 0.0 && held.com_m[1].abs() <= 0.0);
}

#[test]
fn the_hash_knows_every_number() {
    let panda = Robot::panda();
    assert_eq!(panda.sha256(), Robot::panda().sha256());
    assert_eq!(panda.sha256().len(), 64);
    let mut links = panda.links().to_vec();
    links[6].inertia.about_com_kg_m2[5] = f64::from_bits(links[6].inertia.about_com_kg_m2[5].to_bits() + 1);
    let nudged = Robot::new("panda", GRAVITY_M_PER_S2, links).unwrap().with_flange(panda.flange()).unwrap();
    assert_ne!(panda.sha256(), nudged.sha256());
    assert_ne!(panda.sha256(), Robot::panda_bare().sha256());
    assert_ne!(panda.sha256(), panda.clone().with_flange(Frame::IDENTITY).unwrap().sha256());
}
