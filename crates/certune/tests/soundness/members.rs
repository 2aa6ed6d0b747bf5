//! Random members of a family against the constants that every certificate about it rests on.

use certune::ArmCertifier;
use certune::bounds::{ArmBox, Ranges};
use certune::certify::FamilyValues;
use certune::dynamics::{Model, Payload, Robot, gravity_torque, mass_matrix};
use certune::linsys::Joints;

use super::chance::{direction, stream, uniform};

const N: usize = 7;

/// The constants are assumptions of every certificate; random members of a family must respect them.
#[test]
fn random_members_respect_the_constants() {
    let family = FamilyValues {
        gravity_compensation: false,
        friction_n_m_s_per_rad: [0.0, 0.0],
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    let robot = Robot::panda();
    let certifier = ArmCertifier::<N>::new(&robot, &family).unwrap();
    let constants = &certifier.constants().constants;
    let ranges = Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        payload_com_m: Payload::at_grasp(&robot, 1.0).unwrap().com_m,
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    let members = ArmBox::new(&Model::<N>::new(&robot).unwrap(), &ranges).unwrap();
    let mut rng = stream(0xCE27, 0);
    for _ in 0..2_000 {
        let scales: Vec<f64> = members.groups().iter().map(|g| uniform(&mut rng, g.scale[0], g.scale[1])).collect();
        let rotor = Joints::from_fn(|_, _| uniform(&mut rng, 0.0, 0.1));
        let model = members.model(&scales, &rotor).unwrap();
        let q = Joints::from_fn(|_, _| uniform(&mut rng, -3.2, 3.2));
        let eigenvalues = mass_matrix(&model, &q).symmetric_eigenvalues();
        assert!(eigenvalues.min() >= constants.m_lo_kg_m2 && eigenvalues.max() <= constants.m_hi_kg_m2);
        let other = Joints::from_fn(|_, _| uniform(&mut rng, -3.2, 3.2));
        let change = (gravity_torque(&model, &q) - gravity_torque(&model, &other)).norm();
        assert!(change <= constants.k_g_n_m_per_rad * (q - other).norm());
        let (y, dq) = (direction::<N>(&mut rng), direction::<N>(&mut rng));
        let slopes = certune::dynamics::mass_matrix_derivatives(&model, &q);
        let slope = (0..N).map(|j| y[j] * dq.dot(&(slopes[j] * dq))).sum::<f64>();
        assert!(0.5 * slope.abs() <= constants.k_c_kg_m2);
        assert!(0.5 * slope.abs() <= constants.k_r * dq.dot(&(mass_matrix(&model, &q) * dq)));
    }
}
