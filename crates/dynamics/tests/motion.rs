//! Laws of motion: ABA undoes RNEA, gravity's Jacobian and the linearisation are derivatives, the flange moves as its Jacobian says.

mod common;

use certune_dynamics::{
    JointMatrix, Joints, Model, State, coriolis_matrix, flange_jacobian, flange_pose, forward_dynamics,
    forward_dynamics_with_armature, friction_slope, friction_torque, gravity_jacobian, gravity_torque,
    inverse_dynamics, inverse_dynamics_derivatives, joint_origins, linearise, mass_matrix,
};
use common::{N, joints, robot, state};
use proptest::prelude::*;

const STEP: f64 = 1e-6;

/// The condition number of M times a few roundings: what solving with M can cost.
fn solve_rtol(arm: &Model<N>, q: &Joints<N>) -> f64 {
    let eigenvalues = mass_matrix(arm, q).symmetric_eigenvalues();
    1000.0 * f64::EPSILON * eigenvalues.max() / eigenvalues.min()
}

proptest! {
    #[test]
    fn forward_dynamics_undoes_inverse_dynamics(robot in robot(), at in state(), ddq in joints(5.0)) {
        let arm = Model::<N>::new(&robot?)?;
        let tau = inverse_dynamics(&arm, &at, &ddq);
        let again = forward_dynamics(&arm, &at, &tau);
        let size = (tau.amax() / mass_matrix(&arm, &at.q).amax()).max(5.0);
        prop_assert!((again - ddq).amax() <= solve_rtol(&arm, &at.q) * size, "{}", (again - ddq).amax());
    }

    #[test]
    fn an_armature_is_a_rotor(robot in robot(), at in state(), tau in joints(5.0), extra in [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0]) {
        let arm = Model::<N>::new(&robot?)?;
        let extra = Joints::<N>::from(extra);
        let heavier = arm.with_rotor_inertia(&(arm.rotor_inertia_kg_m2() + extra));
        prop_assert_eq!(forward_dynamics_with_armature(&arm, &at, &tau, &extra), forward_dynamics(&heavier, &at, &tau));
        let difference = mass_matrix(&heavier, &at.q) - mass_matrix(&arm, &at.q);
        prop_assert!((difference - JointMatrix::from_diagonal(&extra)).amax() <= 1e-14 * (1.0 + mass_matrix(&arm, &at.q).amax()));
    }

    #[test]
    fn inverse_dynamics_is_mass_coriolis_gravity_and_friction(robot in robot(), at in state(), ddq in joints(5.0)) {
        let arm = Model::<N>::new(&robot?)?;
        let parts = mass_matrix(&arm, &at.q) * ddq
            + certune_dynamics::coriolis_matrix(&arm, &at) * at.dq
            + gravity_torque(&arm, &at.q)
            + friction_torque(&arm, &at.dq);
        let tau = inverse_dynamics(&arm, &at, &ddq);
        prop_assert!((tau - parts).amax() <= 1e-12 * (1.0 + tau.amax() + mass_matrix(&arm, &at.q).amax()));
    }

    #[test]
    fn the_gravity_jacobian_is_symmetric_and_the_difference_of_the_torque(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let jacobian = gravity_jacobian(&arm, &at.q);
        prop_assert_eq!(jacobian, jacobian.transpose());
        for j in 0..N {
            let mut shift = Joints::<N>::zeros();
            shift[j] = STEP;
            let slope = (gravity_torque(&arm, &(at.q + shift)) - gravity_torque(&arm, &(at.q - shift))) / (2.0 * STEP);
            prop_assert!((slope - jacobian.column(j)).amax() <= 1e-8 * (1.0 + jacobian.amax()), "joint {}", j);
        }
    }

    #[test]
    fn the_linearisation_is_the_difference_of_the_acceleration(robot in robot(), at in state(), tau in joints(5.0)) {
        // Coulomb friction turns over within 0.01 rad/s: its slope has its own test below, with a step to match.
        let arm = Model::<N>::new(&robot?)?;
        let arm = arm.with_friction(arm.viscous_n_m_s_per_rad(), &Joints::zeros());
        let linear = linearise(&arm, &at, &tau);
        // Two unlike algorithms: M inverted, and the articulated body.
        let articulated = forward_dynamics(&arm, &at, &tau);
        prop_assert!((linear.ddq - articulated).amax() <= solve_rtol(&arm, &at.q) * (1.0 + articulated.amax()));
        let by = inverse_dynamics_derivatives(&arm, &at, &linear.ddq);
        let twice_coriolis = coriolis_matrix(&arm, &at) * 2.0 + JointMatrix::from_diagonal(arm.viscous_n_m_s_per_rad());
        prop_assert!((by.ddq - twice_coriolis).amax() <= 1e-12 * (1.0 + twice_coriolis.amax()));
        let scale = 1e-7 * (1.0 + linear.ddq_dq.amax() + linear.ddq_ddq.amax() + linear.ddq_dtau.amax() + linear.ddq.amax());
        for j in 0..N {
            let mut shift = Joints::<N>::zeros();
            shift[j] = STEP;
            let slope = |f: &dyn Fn(f64) -> Joints<N>| (f(1.0) - f(-1.0)) / (2.0 * STEP);
            let by_q = slope(&|s| forward_dynamics(&arm, &State { q: at.q + shift * s, dq: at.dq }, &tau));
            let by_dq = slope(&|s| forward_dynamics(&arm, &State { q: at.q, dq: at.dq + shift * s }, &tau));
            let by_tau = slope(&|s| forward_dynamics(&arm, &at, &(tau + shift * s)));
            prop_assert!((by_q - linear.ddq_dq.column(j)).amax() <= scale, "q{}: {}", j, (by_q - linear.ddq_dq.column(j)).amax() / scale);
            prop_assert!((by_dq - linear.ddq_ddq.column(j)).amax() <= scale, "dq{}", j);
            prop_assert!((by_tau - linear.ddq_dtau.column(j)).amax() <= scale, "tau{}", j);
        }
    }

    #[test]
    fn the_friction_slope_is_the_difference_of_the_torque(robot in robot(), dq in joints(0.03)) {
        let arm = Model::<N>::new(&robot?)?;
        let step = Joints::<N>::repeat(STEP);
        let slope = (friction_torque(&arm, &(dq + step)) - friction_torque(&arm, &(dq - step))) / (2.0 * STEP);
        // The third derivative of the tangent is at most 2 / 0.01^3.
        prop_assert!((slope - friction_slope(&arm, &dq)).amax() <= 1e-4);
    }

    #[test]
    fn the_flange_moves_as_its_jacobian_says(robot in robot(), at in state(), dq in joints(1.0)) {
        let robot = robot?.with_flange(certune_dynamics::Frame::from_rpy([0.1, -0.2, 0.3], [0.4, 0.5, 0.6]))?;
        let arm = Model::<N>::new(&robot)?;
        let twist = flange_jacobian(&arm, &at.q) * dq;
        let ((x1, r1), (x0, r0)) = (flange_pose(&arm, &(at.q + dq * STEP)), flange_pose(&arm, &(at.q - dq * STEP)));
        let velocity = (x1 - x0) / (2.0 * STEP);
        // (dR/dt) R' is the skew matrix of the angular velocity.
        let spin = (r1 - r0) / (2.0 * STEP) * flange_pose(&arm, &at.q).1.transpose();
        for i in 0..3 {
            prop_assert!((velocity[i] - twist[i]).abs() <= 1e-8);
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            prop_assert!((spin[(k, j)] - twist[i + 3]).abs() <= 1e-8);
        }
    }
    #[test]
    fn joint_origins_keep_their_distances_and_end_at_the_flange(robot in robot(), at in state()) {
        let robot = robot?.with_flange(certune_dynamics::Frame::IDENTITY)?;
        let arm = Model::<N>::new(&robot)?;
        let origins = joint_origins(&arm, &at.q);
        let mut before = origins[0] * 0.0;
        for (origin, link) in origins.iter().zip(robot.links()) {
            prop_assert!(((origin - before).norm() - link.frame.position().norm()).abs() <= 1e-12);
            before = *origin;
        }
        prop_assert!((before - flange_pose(&arm, &at.q).0).norm() <= 1e-12);
    }
}
