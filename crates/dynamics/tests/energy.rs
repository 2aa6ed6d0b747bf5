//! Laws: energy is what M and g say it is, and changes by the power of the torques alone.

mod common;

use certune_dynamics::{
    Joints, Model, State, forward_dynamics, gravity_torque, kinetic_energy, mass_matrix, potential_energy,
};
use common::{N, joints, robot, state};
use proptest::prelude::*;

/// Ten roundings a joint and a body or two of cancellation.
const RTOL: f64 = 400.0 * f64::EPSILON;
/// Central differences with a step of 1e-5 lose ten digits of the value and keep the second order of the step.
const STEP: f64 = 1e-5;
const DIFFERENCE_TOL: f64 = 1e-7;

proptest! {
    #[test]
    fn kinetic_energy_is_the_quadratic_form_of_the_mass_matrix(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let mass = mass_matrix(&arm, &at.q);
        let from_matrix = 0.5 * at.dq.dot(&(mass * at.dq));
        prop_assert!((from_matrix - kinetic_energy(&arm, &at)).abs() <= RTOL * mass.amax() * at.dq.norm_squared());
    }

    #[test]
    fn gravity_torque_is_the_gradient_of_the_potential(robot in robot(), at in state()) {
        let arm = Model::<N>::new(&robot?)?;
        let g = gravity_torque(&arm, &at.q);
        for j in 0..N {
            let mut shift = Joints::<N>::zeros();
            shift[j] = STEP;
            let slope = (potential_energy(&arm, &(at.q + shift)) - potential_energy(&arm, &(at.q - shift))) / (2.0 * STEP);
            prop_assert!((slope - g[j]).abs() <= DIFFERENCE_TOL * (1.0 + g.amax()), "{} {}", slope, g[j]);
        }
    }

    #[test]
    fn without_friction_energy_changes_by_the_power_of_the_torque(robot in robot(), at in state(), tau in joints(5.0)) {
        let arm = Model::<N>::new(&robot?)?.with_friction(&Joints::zeros(), &Joints::zeros());
        let ddq = forward_dynamics(&arm, &at, &tau);
        let energy = |t: f64| {
            let then = State { q: at.q + at.dq * t + ddq * (0.5 * t * t), dq: at.dq + ddq * t };
            kinetic_energy(&arm, &then) + potential_energy(&arm, &then.q)
        };
        // Small against the fastest motion, so that the third derivative of the energy does not count.
        let step_s = STEP / (1.0 + ddq.amax());
        let rate = (energy(step_s) - energy(-step_s)) / (2.0 * step_s);
        let power = at.dq.dot(&tau);
        let scale = (1.0 + ddq.amax()) * (kinetic_energy(&arm, &at) + potential_energy(&arm, &at.q).abs() + 1.0);
        prop_assert!((rate - power).abs() <= DIFFERENCE_TOL * scale, "{rate} {power} {scale}");
    }

    #[test]
    fn friction_only_takes_energy(robot in robot(), dq in joints(2.0)) {
        let arm = Model::<N>::new(&robot?)?;
        prop_assert!(dq.dot(&certune_dynamics::friction_torque(&arm, &dq)) >= 0.0);
    }
}
