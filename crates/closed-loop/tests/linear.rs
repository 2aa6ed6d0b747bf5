//! Contract: the linearised loops are the derivatives of what the simulation does.

use std::path::Path;

use certune_closed_loop::{
    Gains, GainsFile, NoiseStream, Plant, PlantSetting, Scenario, Simulation, linearise_aic, linearise_aic_sampled,
    linearise_mrac, linearise_mrac_sampled,
};
use certune_control::aic::{Aic, AicGains, AicParams, AicState};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams, MracState};
use certune_control::{Controller, Measurement};
use certune_dynamics::{Robot, State, forward_dynamics, gravity_torque};
use certune_linsys::Joints;
use nalgebra::{DMatrix, DVector};

const STEP_S: f64 = 1e-3;
/// Central differences over 2e-4: their error is about this squared times third derivatives, which are of the order of the entries.
const DIFFERENCE: f64 = 1e-4;
const DIFFERENCE_RTOL: f64 = 1e-6;

/// Gains that differ from joint to joint, so that a swapped index shows; a reference slower than the paper's on one joint.
fn params() -> AicParams<7> {
    let text = include_str!("../../../tuning/presets/pezzato2020-robot.toml");
    let file = GainsFile::parse(Path::new("preset"), text).expect("a preset");
    let Gains::Aic(table) = file.gains else { unreachable!("an AIC preset") };
    let gains: AicGains<7> = table.bind().expect("seven joints");
    let gains = AicGains {
        kappa_a: [700.0, 650.0, 600.0, 550.0, 500.0, 450.0, 400.0],
        reference_time_constant_s: [1.0, 1.0, 2.0, 1.0, 0.5, 1.0, 1.0],
        ..gains
    };
    AicParams::new(&gains, STEP_S).expect("valid gains")
}

fn pose() -> Joints<7> {
    Joints::from([0.4, -0.3, 0.7, -1.6, 0.5, 1.9, -0.6])
}

fn setting(robot: &Robot, gravity_compensation: bool, coulomb_n_m: f64) -> PlantSetting {
    let mut setting = PlantSetting::nominal(robot, gravity_compensation).with_friction(1.0).with_payload(0.7);
    setting.rotor_inertia_kg_m2 = vec![0.1, 0.09, 0.08, 0.07, 0.06, 0.05, 0.04];
    setting.link_mass_scale = vec![0.8, 1.2, 0.9, 1.1, 1.0, 0.85, 1.15];
    setting.coulomb_n_m.fill(coulomb_n_m);
    setting
}

fn hold(robot: &Robot) -> Scenario {
    let mut scenario = Scenario::generic(robot, certune_closed_loop::PlantBox::nominal(true));
    scenario.start_rad = pose().as_slice().to_vec();
    scenario.segments.truncate(1);
    scenario.segments[0].goal_rad = scenario.start_rad.clone();
    scenario.torque_limits = false;
    scenario
}

/// Block `index` of seven of a state in the order e, dq, m, mu', mu'', u~.
fn block(x: &DVector<f64>, index: usize) -> Joints<7> {
    Joints::from_fn(|joint, _| x[7 * index + joint])
}

fn physical(x: &DVector<f64>, torque_at_rest: &Joints<7>) -> (State<7>, AicState<7>) {
    let arm = State { q: pose() + block(x, 0), dq: block(x, 1) };
    let mu = pose() + block(x, 2);
    (arm, AicState { mu, dmu: block(x, 3), ddmu: block(x, 4), u: torque_at_rest + block(x, 5) })
}

fn stacked(arm: &State<7>, aic: &AicState<7>, torque_at_rest: &Joints<7>) -> DVector<f64> {
    let blocks = [arm.q - pose(), arm.dq, aic.mu - pose(), aic.dmu, aic.ddmu, aic.u - torque_at_rest];
    DVector::from_iterator(42, blocks.iter().flat_map(|block| block.iter().copied()))
}

/// The Jacobian at zero of `f`, by central differences.
fn differences(order: usize, f: impl Fn(&DVector<f64>) -> DVector<f64>) -> DMatrix<f64> {
    let column = |index: usize| {
        let mut x = DVector::zeros(order);
        x[index] = DIFFERENCE;
        (f(&x) - f(&-x)) / (2.0 * DIFFERENCE)
    };
    DMatrix::from_columns(&(0..order).map(column).collect::<Vec<_>>())
}

#[test]
fn the_continuous_loop_is_the_derivative_of_the_nonlinear_one() {
    let robot = Robot::panda();
    let params = params();
    let aic = Aic::<7>::new(&params);
    let gains = *params.gains();
    for compensated in [false, true] {
        let model = setting(&robot, compensated, 0.0).model::<7>(&robot).unwrap();
        let gravity = |q: &Joints<7>| if compensated { gravity_torque(&model, q) } else { Joints::zeros() };
        let at_rest = if compensated { Joints::zeros() } else { gravity_torque(&model, &pose()) };
        let field = |x: &DVector<f64>| {
            let (arm, beliefs) = physical(x, &at_rest);
            let ddq = forward_dynamics(&model, &arm, &(beliefs.u + gravity(&arm.q)));
            let measurement = Measurement { q: arm.q, dq: arm.dq };
            let gradient = aic.free_energy_gradient(&beliefs, &measurement, &pose());
            let kappa_mu = Joints::from(gains.kappa_mu);
            let surprise = |joint: usize| {
                (arm.q - beliefs.mu)[joint] / gains.sigma_q[joint]
                    + (arm.dq - beliefs.dmu)[joint] / gains.sigma_dq[joint]
            };
            let rates = [
                arm.dq,
                ddq,
                beliefs.dmu - kappa_mu.component_mul(&gradient.mu),
                beliefs.ddmu - kappa_mu.component_mul(&gradient.dmu),
                -kappa_mu.component_mul(&gradient.ddmu),
                Joints::from_fn(|joint, _| -gains.kappa_a[joint] * surprise(joint)),
            ];
            DVector::from_iterator(42, rates.iter().flat_map(|rate| rate.iter().copied()))
        };
        let exact = linearise_aic(&model, &pose(), &params, compensated).unwrap();
        let numeric = differences(42, field);
        let error = (exact.matrix() - &numeric).amax() / numeric.amax();
        assert!(error < DIFFERENCE_RTOL, "compensated {compensated}: relative error {error:e}");
    }
}

#[test]
fn the_sampled_loop_is_the_derivative_of_one_step_of_the_simulation() {
    let robot = Robot::panda();
    let params = params();
    let aic = Aic::<7>::new(&params);
    let task = hold(&robot).bind::<7>(&robot).unwrap();
    for compensated in [false, true] {
        let plant = Plant::<7>::new(&robot, &setting(&robot, compensated, 0.0)).unwrap();
        let at_rest = if compensated { Joints::zeros() } else { gravity_torque(plant.model(), &pose()) };
        let step = |x: &DVector<f64>| {
            let (arm, beliefs) = physical(x, &at_rest);
            let mut run = Simulation::new(&plant, &task, &aic, NoiseStream::default());
            run.set_state(arm);
            run.set_controller_state(beliefs);
            run.advance(&mut ());
            stacked(run.state(), run.controller_state(), &at_rest)
        };
        let exact = linearise_aic_sampled(plant.model(), &pose(), &params, compensated, 0).unwrap();
        let numeric = differences(42, step);
        let error = (exact.matrix() - &numeric).amax() / numeric.amax();
        assert!(error < DIFFERENCE_RTOL, "compensated {compensated}: relative error {error:e}");
    }
}

#[test]
fn delay_and_coulomb_friction_are_those_of_the_simulation() {
    let robot = Robot::panda();
    let params = params();
    let aic = Aic::<7>::new(&params);
    let task = hold(&robot).bind::<7>(&robot).unwrap();
    // Small against the 0.01 rad/s over which Coulomb friction is linear.
    const SIZE: f64 = 1e-6;
    for coulomb_n_m in [0.0, 0.3] {
        for delay in 0..4 {
            let plant = Plant::<7>::new(&robot, &setting(&robot, true, coulomb_n_m).with_delay(delay)).unwrap();
            let sampled = linearise_aic_sampled(plant.model(), &pose(), &params, true, delay).unwrap();
            let order = 42 + 7 * delay.saturating_sub(1);
            assert_eq!(sampled.order(), order);
            // Earlier torques are zero, as before a run.
            let start = DVector::from_fn(42, |index, _| SIZE * (1.0 + index as f64).sin());
            let mut x = start.clone().resize_vertically(order, 0.0);
            x.rows_mut(35, 7).fill(0.0);
            let (arm, beliefs) = physical(&x, &Joints::zeros());
            let mut run = Simulation::new(&plant, &task, &aic, NoiseStream::default());
            run.set_state(arm);
            run.set_controller_state(beliefs);
            for step in 1..=25 {
                run.advance(&mut ());
                x = sampled.matrix() * x;
                let simulated = stacked(run.state(), run.controller_state(), &Joints::zeros());
                let error = (simulated - x.rows(0, 42)).amax();
                // What is neglected is of second order in the size, times gains of a few hundred.
                assert!(
                    error < 1e-4 * SIZE.max(x.amax()),
                    "delay {delay}, Coulomb {coulomb_n_m}, step {step}: {error:e}"
                );
            }
        }
    }
}

#[test]
fn the_sampled_loop_tends_to_the_continuous_one() {
    let robot = Robot::panda();
    let model = setting(&robot, false, 0.0).model::<7>(&robot).unwrap();
    let gains = *params().gains();
    let continuous = linearise_aic(&model, &pose(), &params(), false).unwrap();
    let distance = |step_s: f64| {
        let params = AicParams::new(&gains, step_s).unwrap();
        let sampled = linearise_aic_sampled(&model, &pose(), &params, false, 0).unwrap();
        ((sampled.matrix() - DMatrix::identity(42, 42)) / step_s - continuous.matrix()).amax()
    };
    let (coarse, fine) = (distance(1e-5), distance(5e-6));
    // First order in the step: half the step, half the distance.
    assert!((coarse / fine - 2.0).abs() < 0.02, "{coarse:e} and {fine:e}");
}

#[test]
fn published_stability_facts_are_reproduced() {
    // kappa_a = 200 without compensation is unstable in about a fifth of the joint range, 700 nowhere in it.
    let robot = Robot::panda();
    let model = PlantSetting::nominal(&robot, false).model::<7>(&robot).unwrap();
    let text = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
    let Gains::Aic(table) = GainsFile::parse(Path::new("preset"), text).unwrap().gains else { panic!("an AIC preset") };
    let published: AicGains<7> = table.bind().unwrap();
    // An additive recurrence fills the joint range evenly; its steps are powers of the root of x^8 = x + 1.
    let steps = (1..=7).map(|power| 1.096_981_557_f64.powi(-power)).collect::<Vec<_>>();
    let configuration = |index: i32| {
        Joints::<7>::from_fn(|joint, _| {
            let limits = &robot.links()[joint].limits;
            limits.lower_rad + (0.5 + f64::from(index) * steps[joint]).fract() * (limits.upper_rad - limits.lower_rad)
        })
    };
    let unstable = |kappa_a: f64| {
        let params = AicParams::new(&AicGains { kappa_a: [kappa_a; 7], ..published }, STEP_S).unwrap();
        let abscissa = |q| linearise_aic(&model, &q, &params, false).unwrap().spectral_abscissa_per_s();
        (0..500).filter(|&index| !(abscissa(configuration(index)) < 0.0)).count()
    };
    assert_eq!(unstable(700.0), 0);
    let share = unstable(200.0);
    // 18 to 24 % are stated.
    assert!((90..=120).contains(&share), "{share} of 500 configurations");
}

/// Published gains under the paper's equations, with derivative terms none and numbers that differ from joint to joint.
fn adaptive_params() -> MracParams<7> {
    let text = include_str!("../../../tuning/presets/pezzato2020-mrac-robot.toml");
    let file = GainsFile::parse(Path::new("preset"), text).expect("a preset");
    let Gains::Mrac(table) = file.gains else { unreachable!("an MRAC preset") };
    let gains: MracGains<7> = table.bind().expect("seven joints");
    let omega_rad_per_s = [2.0, 2.5, 3.0, 3.5, 2.2, 2.4, 2.6];
    MracParams::new(&MracGains { law: MracLaw::ReferenceModel, omega_rad_per_s, ..gains }, STEP_S).expect("valid gains")
}

/// The controller at rest at the goal with `w` accumulated, as its integrals hold it: each of the error times what it multiplies there.
fn accumulated(params: &MracParams<7>, controller: &Mrac<7>, w: &Joints<7>) -> MracState<7> {
    let at = Measurement { q: pose(), dq: Joints::zeros() };
    let mut state = controller.start(&at);
    let of_error = Joints::from_fn(|joint, _| -params.error_weights()[joint].p3 * w[joint]);
    state.integral.q_e = of_error;
    state.integral.q = of_error * pose().transpose();
    state.integral.q_ref = state.integral.q;
    state
}

/// What the integrals hold, as `w`.
fn read(params: &MracParams<7>, state: &MracState<7>) -> Joints<7> {
    Joints::from_fn(|joint, _| -state.integral.q_e[joint] / params.error_weights()[joint].p3)
}

#[test]
fn the_adaptive_loops_are_the_derivatives_of_one_step_and_of_each_other() {
    let robot = Robot::panda();
    let params = adaptive_params();
    let controller = Mrac::<7>::new(&params);
    for compensated in [false, true] {
        let model = setting(&robot, compensated, 0.0).model::<7>(&robot).unwrap();
        // Without compensation the arm is held by a constant torque: what the integrals would hold is not about this point.
        let gravity = |q: &Joints<7>| gravity_torque(&model, &if compensated { *q } else { pose() });
        for delay in [0, 1, 2] {
            let step = |x: &DVector<f64>| {
                let (q, dq) = (pose() + block(x, 0), block(x, 1));
                let state = accumulated(&params, &controller, &block(x, 2));
                let (next, u) = controller.step(&state, &Measurement { q, dq }, &pose());
                let acting = if delay == 0 { u } else { block(x, 2 + delay) };
                let ddq = forward_dynamics(&model, &State { q, dq }, &(acting + gravity(&q)));
                let dq = dq + ddq * STEP_S;
                let mut blocks = vec![q + dq * STEP_S - pose(), dq, read(&params, &next)];
                blocks.extend((0..delay).map(|age| if age == 0 { u } else { block(x, 2 + age) }));
                DVector::from_iterator(7 * blocks.len(), blocks.iter().flat_map(|block| block.iter().copied()))
            };
            let exact = linearise_mrac_sampled(&model, &pose(), &params, compensated, delay).unwrap();
            let numeric = differences(7 * (3 + delay), step);
            let error = (exact.matrix() - &numeric).amax() / numeric.amax();
            assert!(error < DIFFERENCE_RTOL, "compensated {compensated}, delay {delay}: relative error {error:e}");
        }
        // A step is the identity and h times the field, up to h²: positions move with the new velocity.
        let field = linearise_mrac(&model, &pose(), &params, compensated).unwrap();
        let sampled = linearise_mrac_sampled(&model, &pose(), &params, compensated, 0).unwrap();
        let mut euler = DMatrix::identity(21, 21) + field.matrix() * STEP_S;
        let moved = euler.rows(7, 7) * STEP_S;
        euler.rows_mut(0, 7).copy_from(&moved);
        for joint in 0..7 {
            euler[(joint, joint)] += 1.0;
        }
        assert!((sampled.matrix() - euler).amax() < 1e-12);
    }
}
