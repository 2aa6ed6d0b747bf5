//! Laws of rigid bodies on arms of one to seven joints that nobody has built.

use certune_dynamics::{
    JointMatrix, Joints, Model, coriolis_matrix, forward_dynamics, gravity_torque, inverse_dynamics, kinetic_energy,
    mass_matrix, mass_matrix_derivatives, potential_energy,
};
use certune_testkit::tolerance::{
    central_difference_rtol, close, gravity_scale_n_m, inertia_scale_kg_m2, recursion_rtol, solve_rtol,
};
use certune_testkit::{joint_state, joints_within, link_scales, payload, serial_arm};
use proptest::prelude::*;

/// Accelerations, rad/s².
const FAST: f64 = 20.0;
/// Torques, N m.
const STRONG: f64 = 50.0;
/// Steps of differences, rad.
const STEP: f64 = 2e-5;
/// The largest speed of `joint_state`, squared and summed over two joints, rad²/s².
const SQUARED_SPEED: f64 = 14.0;

macro_rules! laws {
    ($name:ident, $n:literal) => {
        mod $name {
            use super::*;
            const N: usize = $n;

            proptest! {
                #[test]
                fn the_torque_of_a_motion_moves_the_arm_that_way(
                    robot in serial_arm::<N>(), at in joint_state::<N>(), ddq in joints_within::<N>(FAST)
                ) {
                    let arm = Model::<N>::new(&robot)?;
                    let again = forward_dynamics(&arm, &at, &inverse_dynamics(&arm, &at, &ddq));
                    let eigenvalues = mass_matrix(&arm, &at.q).symmetric_eigenvalues();
                    // Torques of this size, known to their roundings, divided by the smallest inertia.
                    let torque = inertia_scale_kg_m2(&robot) * (FAST + N as f64 * SQUARED_SPEED) + gravity_scale_n_m(&robot) + 10.0;
                    close(again.as_slice(), ddq.as_slice(), torque, solve_rtol(N, eigenvalues.min().recip()))?;
                }

                #[test]
                fn the_motion_of_a_torque_takes_that_torque(
                    robot in serial_arm::<N>(), at in joint_state::<N>(), tau in joints_within::<N>(STRONG)
                ) {
                    let arm = Model::<N>::new(&robot)?;
                    let ddq = forward_dynamics(&arm, &at, &tau);
                    let inertia = inertia_scale_kg_m2(&robot);
                    let torque = inertia * (N as f64 * ddq.amax() + N as f64 * SQUARED_SPEED) + gravity_scale_n_m(&robot) + STRONG;
                    close(inverse_dynamics(&arm, &at, &ddq).as_slice(), tau.as_slice(), torque, recursion_rtol(N))?;
                }

                #[test]
                fn kinetic_energy_is_the_quadratic_form_of_the_mass_matrix(robot in serial_arm::<N>(), at in joint_state::<N>()) {
                    let arm = Model::<N>::new(&robot)?;
                    let from_matrix = 0.5 * at.dq.dot(&(mass_matrix(&arm, &at.q) * at.dq));
                    let rotor = 0.5 * at.dq.dot(&arm.rotor_inertia_kg_m2().component_mul(&at.dq));
                    let energy = kinetic_energy(&arm, &at);
                    prop_assert!(energy >= rotor, "{energy} without the rotors' {rotor}");
                    close(&[from_matrix], &[energy], N as f64 * inertia_scale_kg_m2(&robot) * at.dq.norm_squared(), recursion_rtol(N))?;
                }

                #[test]
                fn the_rate_of_the_mass_matrix_less_twice_c_is_skew(robot in serial_arm::<N>(), at in joint_state::<N>()) {
                    let arm = Model::<N>::new(&robot)?;
                    let c = coriolis_matrix(&arm, &at);
                    let by_joint = mass_matrix_derivatives(&arm, &at.q);
                    let rate = by_joint.iter().zip(&at.dq).fold(JointMatrix::<N>::zeros(), |sum, (d, dq)| sum + d * *dq);
                    let skew = rate - c * 2.0;
                    let scale = N as f64 * inertia_scale_kg_m2(&robot) * (1.0 + at.dq.amax());
                    close((skew + skew.transpose()).as_slice(), JointMatrix::<N>::zeros().as_slice(), scale, recursion_rtol(N))?;
                    // The rate is the one along the motion, so the law is not one of C with itself.
                    let moved = |t: f64| mass_matrix(&arm, &(at.q + at.dq * t));
                    let difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                    let rtol = central_difference_rtol(STEP, 100.0);
                    // A third derivative by time is as large as the cube of all speeds together.
                    let speed = 1.0 + at.dq.lp_norm(1);
                    close(difference.as_slice(), rate.as_slice(), inertia_scale_kg_m2(&robot) * speed.powi(3), rtol)?;
                }

                #[test]
                fn gravity_torque_is_the_gradient_of_the_potential(robot in serial_arm::<N>(), at in joint_state::<N>()) {
                    let arm = Model::<N>::new(&robot)?;
                    let slope = Joints::<N>::from_fn(|joint, _| {
                        let mut shift = Joints::<N>::zeros();
                        shift[joint] = STEP;
                        (potential_energy(&arm, &(at.q + shift)) - potential_energy(&arm, &(at.q - shift))) / (2.0 * STEP)
                    });
                    let rtol = central_difference_rtol(STEP, 100.0);
                    close(slope.as_slice(), gravity_torque(&arm, &at.q).as_slice(), gravity_scale_n_m(&robot), rtol)?;
                }

                #[test]
                fn no_entry_of_m_or_g_exceeds_its_scale(robot in serial_arm::<N>(), at in joint_state::<N>()) {
                    let arm = Model::<N>::new(&robot)?;
                    prop_assert!(mass_matrix(&arm, &at.q).amax() <= inertia_scale_kg_m2(&robot));
                    prop_assert!(gravity_torque(&arm, &at.q).amax() <= gravity_scale_n_m(&robot));
                }

                #[test]
                fn heavier_links_and_a_payload_only_add_inertia(
                    robot in serial_arm::<N>(), at in joint_state::<N>(), scales in link_scales::<N>(1.0..=1.5), held in payload(0.0..=2.0)
                ) {
                    let arm = Model::<N>::new(&robot)?;
                    let more = mass_matrix(&arm.with_link_scales(&scales).with_payload(&held), &at.q) - mass_matrix(&arm, &at.q);
                    // The payload adds at most its mass a hand's length beyond the stretched arm.
                    let scale = N as f64 * (1.5 * inertia_scale_kg_m2(&robot) + 2.0 * (N as f64).powi(2));
                    prop_assert!(more.symmetric_eigenvalues().min() >= -recursion_rtol(N) * scale);
                }
            }
        }
    };
}

laws!(one_joint, 1);
laws!(two_joints, 2);
laws!(three_joints, 3);
laws!(four_joints, 4);
laws!(five_joints, 5);
laws!(six_joints, 6);
laws!(seven_joints, 7);
