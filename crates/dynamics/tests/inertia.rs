//! Laws of M(q), its derivatives and the Coriolis matrix.

mod common;

use certune_dynamics::{
    Frame, JointMatrix, Joints, Model, Payload, Robot, State, coriolis_matrix, coriolis_torque, gravity_jacobian,
    gravity_torque, inverse_dynamics, mass_matrix, mass_matrix_as_described, mass_matrix_derivatives,
};
use common::{N, joints, robot, state};
use proptest::prelude::*;

/// Ten roundings a joint and a body or two of cancellation.
const RTOL: f64 = 400.0 * f64::EPSILON;
const STEP: f64 = 1e-5;
const DIFFERENCE_TOL: f64 = 1e-8;

fn still(arm: &Model<N>) -> Model<N> {
    arm.with_friction(&Joints::zeros(), &Joints::zeros())
}

proptest! {
    #[test]
    fn the_mass_matrix_is_symmetric_and_positive_definite(robot in robot(), at in state()) {
        let mass = mass_matrix(&Model::<N>::new(&robot?)?, &at.q);
        prop_assert_eq!(mass, mass.transpose());
        prop_assert!(mass.symmetric_eigenvalues().min() > 0.0);
    }

    #[test]
    fn the_derivatives_of_the_mass_matrix_are_its_differences(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let size = mass_matrix(&arm, &at.q).amax();
        for (j, derivative) in mass_matrix_derivatives(&arm, &at.q).iter().enumerate() {
            let mut shift = Joints::<N>::zeros();
            shift[j] = STEP;
            let difference = (mass_matrix(&arm, &(at.q + shift)) - mass_matrix(&arm, &(at.q - shift))) / (2.0 * STEP);
            prop_assert!((difference - derivative).amax() <= DIFFERENCE_TOL * size, "joint {}", j);
        }
    }

    #[test]
    fn the_mass_matrix_changes_at_twice_the_symmetric_part_of_c(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let c = coriolis_matrix(&arm, &at);
        let mut rate = JointMatrix::<N>::zeros();
        for (derivative, speed) in mass_matrix_derivatives(&arm, &at.q).iter().zip(&at.dq) {
            rate += derivative * *speed;
        }
        let skew = rate - c * 2.0;
        prop_assert!((skew + skew.transpose()).amax() <= RTOL * (1.0 + rate.amax()));
        // And that rate is the one along the motion.
        let step_s = STEP;
        let along = (mass_matrix(&arm, &(at.q + at.dq * step_s)) - mass_matrix(&arm, &(at.q - at.dq * step_s))) / (2.0 * step_s);
        prop_assert!((along - c - c.transpose()).amax() <= 10.0 * DIFFERENCE_TOL * mass_matrix(&arm, &at.q).amax());
    }

    #[test]
    fn coriolis_torque_is_what_newton_and_euler_say(robot in robot(), at in state()) {
        let arm = still(&Model::<N>::new(&robot?)?);
        let c = coriolis_matrix(&arm, &at);
        let rest = inverse_dynamics(&arm, &at, &Joints::zeros()) - gravity_torque(&arm, &at.q);
        let scale = RTOL * (1.0 + c.amax() * at.dq.amax() + gravity_torque(&arm, &at.q).amax());
        prop_assert!((c * at.dq - rest).amax() <= scale);
        prop_assert!((coriolis_torque(&arm, &at) - rest).amax() <= scale);
    }

    #[test]
    fn the_christoffel_form_is_symmetric_in_the_two_velocities(robot in robot(), at in state(), other in joints(2.0)) {
        let arm = Model::<N>::new(&robot?)?;
        let c = coriolis_matrix(&arm, &at);
        let swapped = coriolis_matrix(&arm, &State { q: at.q, dq: other }) * at.dq;
        prop_assert!((c * other - swapped).amax() <= RTOL * (1.0 + swapped.amax() + c.amax()));
    }

    #[test]
    fn inertia_and_gravity_are_affine_in_the_link_masses(robot in robot(), at in state(), scales in [0.0..2.0, 0.5..1.5, 0.8..1.2, 0.0..1.0]) {
        let arm = Model::<N>::new(&robot?)?;
        let rotors = JointMatrix::from_diagonal(arm.rotor_inertia_kg_m2());
        let (mut mass, mut g, mut hessian) = (rotors, Joints::<N>::zeros(), JointMatrix::<N>::zeros());
        for i in 0..N {
            let mut only = [0.0; N];
            only[i] = 1.0;
            let alone = arm.with_link_scales(&only);
            mass += (mass_matrix(&alone, &at.q) - rotors) * scales[i];
            g += gravity_torque(&alone, &at.q) * scales[i];
            hessian += gravity_jacobian(&alone, &at.q) * scales[i];
        }
        let scaled = arm.with_link_scales(&scales);
        let size = RTOL * (1.0 + mass.amax() + g.amax());
        prop_assert!((mass_matrix(&scaled, &at.q) - mass).amax() <= size);
        prop_assert!((gravity_torque(&scaled, &at.q) - g).amax() <= size);
        prop_assert!((gravity_jacobian(&scaled, &at.q) - hessian).amax() <= size);
    }

    #[test]
    fn a_payload_is_a_body_merged_into_the_last_link(robot in robot(), at in state(), mass_kg in 0.0..3.0, z_m in -0.5..0.5) {
        let robot = robot?;
        let about_com_kg_m2 = [mass_kg * 0.01, mass_kg * 0.012, mass_kg * 0.008, 0.0, mass_kg * 0.001, 0.0];
        let payload = Payload::new(mass_kg, [0.1, -0.2, z_m], about_com_kg_m2)?;
        let mut links = robot.links().to_vec();
        links[N - 1].inertia = links[N - 1].inertia.merged(&payload.inertia());
        let welded = Model::<N>::new(&Robot::new("welded", robot.gravity_m_per_s2(), links)?)?;
        let held = Model::<N>::new(&robot)?.with_payload(&payload);
        let size = 1.0 + mass_matrix(&welded, &at.q).amax();
        prop_assert!((mass_matrix(&welded, &at.q) - mass_matrix(&held, &at.q)).amax() <= RTOL * size);
        let (a, b) = (gravity_torque(&welded, &at.q), gravity_torque(&held, &at.q));
        prop_assert!((a - b).amax() <= RTOL * (1.0 + a.amax()));
        let (a, b) = (coriolis_torque(&welded, &at), coriolis_torque(&held, &at));
        prop_assert!((a - b).amax() <= RTOL * (size + a.amax()));
    }

    #[test]
    fn where_the_base_frame_of_a_link_sits_changes_nothing(robot in robot(), at in state(), twist in 0.1..3.0) {
        // Turning a link's frame about its joint axis by an angle and the joint back by the same one is the same arm.
        let robot = robot?;
        let mut links = robot.links().to_vec();
        let turn = Frame::from_rpy([0.0; 3], [0.0, 0.0, twist]);
        links[1].frame = links[1].frame.then(&turn);
        let turned = Model::<N>::new(&Robot::new("turned", robot.gravity_m_per_s2(), links)?)?;
        let arm = Model::<N>::new(&robot)?;
        let mut q = at.q;
        q[1] -= twist;
        let (a, b) = (mass_matrix(&arm, &at.q), mass_matrix(&turned, &q));
        prop_assert!((a - b).amax() <= RTOL * (1.0 + a.amax()));
    }
}

proptest! {
    /// Two unlike algorithms: link frames from the tip, and scalar products in the base's axes.
    #[test]
    fn folded_and_described_frames_have_the_same_inertia(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let (folded, described) = (mass_matrix(&arm, &at.q), mass_matrix_as_described(&arm, &at.q));
        prop_assert!((folded - described).norm() <= RTOL * described.norm(), "{folded} {described}");
    }
}
