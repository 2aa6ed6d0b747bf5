//! Contract: one sample does what the module says, in that order; disturbances act when and as they should.

use certune_closed_loop::scenario::{Integrator, Method, Noise, PayloadEvent, Push};
use certune_closed_loop::{
    KnownModel, Metrics, NoiseStream, Plant, PlantBox, PlantSetting, Progress, Row, Sample, Scenario, Simulation,
    Trajectory, simulate,
};
use certune_control::baseline::{ComputedTorque, ComputedTorqueGains};
use certune_control::{Controller, Measurement};
use certune_dynamics::{
    Model, Payload, Robot, State, flange_jacobian, gravity_torque, kinetic_energy, mass_matrix, potential_energy,
};
use certune_linsys::Joints;

/// Asks for the same torque at every sample, whatever it is told.
struct Constant(Joints<7>);

impl Controller<7> for Constant {
    type State = u32;
    fn start(&self, _: &Measurement<7>) -> u32 {
        0
    }
    fn step(&self, samples: &u32, _: &Measurement<7>, _: &Joints<7>) -> (u32, Joints<7>) {
        (samples + 1, self.0)
    }
}

fn pose() -> Joints<7> {
    Joints::from([0.3, 0.4, -0.2, -1.5, 0.6, 1.8, 0.1])
}

/// One goal, where the arm already is, for `duration_s`.
fn hold(duration_s: f64) -> Scenario {
    let mut scenario = Scenario::generic(&Robot::panda(), PlantBox::nominal(true));
    scenario.start_rad = pose().as_slice().to_vec();
    scenario.segments.truncate(1);
    scenario.segments[0].goal_rad = scenario.start_rad.clone();
    scenario.segments[0].duration_s = duration_s;
    scenario
}

fn plant(setting: &PlantSetting) -> Plant<7> {
    Plant::new(&Robot::panda(), setting).expect("a plant")
}

fn nominal(gravity_compensation: bool) -> PlantSetting {
    PlantSetting::nominal(&Robot::panda(), gravity_compensation)
}

fn recorded<C: Controller<7>>(
    setting: &PlantSetting,
    scenario: &Scenario,
    controller: &C,
) -> (Metrics, Vec<Row<7, Joints<7>>>) {
    let task = scenario.bind::<7>(&Robot::panda()).expect("a task");
    let mut trajectory = Trajectory::new(1, |sample: &Sample<'_, 7, C::State>| sample.u);
    let metrics = simulate(&plant(setting), &task, controller, NoiseStream::default(), &mut trajectory);
    (metrics, trajectory.into_rows())
}

/// The arm's state after the whole scenario.
fn final_state<C: Controller<7>>(setting: &PlantSetting, scenario: &Scenario, controller: &C) -> State<7> {
    let task = scenario.bind::<7>(&Robot::panda()).expect("a task");
    let plant = plant(setting);
    let mut run = Simulation::new(&plant, &task, controller, NoiseStream::default());
    while run.advance(&mut ()) == Progress::Running {}
    assert_eq!(run.progress(), Progress::Finished);
    *run.state()
}

#[test]
fn the_torque_arrives_after_the_delay_and_within_the_limits() {
    for delay in [0, 1, 3, 16] {
        let (metrics, rows) = recorded(&nominal(true).with_delay(delay), &hold(0.03), &Constant(Joints::repeat(20.0)));
        let gravity = gravity_torque(plant(&nominal(true)).model(), &pose());
        for (k, row) in rows.iter().enumerate() {
            let limit = Joints::from([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0]);
            let asked = gravity_torque(plant(&nominal(true)).model(), &row.q)
                + Joints::repeat(if k >= delay { 20.0 } else { 0.0 });
            let expected = asked.zip_map(&limit, |torque, limit| torque.clamp(-limit, limit));
            assert!((row.tau - expected).amax() < 1e-12, "delay {delay}, sample {k}");
        }
        let segment = &metrics.segments[0];
        // Joint 5 is asked for about 20 N m and gives 12; joint 1 gives what it is asked for.
        assert_eq!(segment.saturated_steps[4], 30 - delay as u64);
        assert_eq!(segment.saturated_steps[0], 0);
        assert!((segment.peak_torque_n_m[0] - (20.0 + gravity[0])).abs() < 0.1);
        assert!(segment.peak_torque_n_m[4] > 19.0);
    }
}

#[test]
fn without_limits_the_motor_gives_what_it_is_asked_for() {
    let mut scenario = hold(0.01);
    scenario.torque_limits = false;
    let (metrics, rows) = recorded(&nominal(false), &scenario, &Constant(Joints::repeat(30.0)));
    assert!(rows.iter().all(|row| (row.tau - Joints::repeat(30.0)).amax() < 1e-15));
    // Still counted: the limit is a property of the arm.
    assert_eq!(metrics.segments[0].saturated_steps, [0, 0, 0, 0, 10, 10, 10]);
}

#[test]
fn a_compensated_arm_at_rest_stays_at_rest() {
    let state = final_state(&nominal(true).with_payload(0.7), &hold(1.0), &Constant(Joints::zeros()));
    // Roundings of torques of some 50 N m on inertias down to 0.005 kg m² over a second.
    assert!((state.q - pose()).amax() < 1e-10, "{:e}", (state.q - pose()).amax());
}

#[test]
fn a_load_pulls_exactly_while_it_is_attached() {
    let mut scenario = hold(0.03);
    let event =
        PayloadEvent { mass_kg: 0.7, com_m: None, about_com_kg_m2: [0.0; 6], attach_s: 0.01, release_s: Some(0.02) };
    scenario.payloads = vec![event];
    let (_, rows) = recorded(&nominal(true), &scenario, &Constant(Joints::zeros()));
    let speed = |step: usize| rows[step].dq;
    assert!(speed(10).amax() < 1e-12, "at rest before");
    let arm = plant(&nominal(true));
    let loaded = arm.model().with_payload(&Payload::at_grasp(&Robot::panda(), 0.7).unwrap());
    // The first sample with the load: its weight is what the arm's compensation does not know.
    let weight = gravity_torque(&loaded, &pose()) - gravity_torque(arm.model(), &pose());
    let expected = mass_matrix(&loaded, &pose()).lu().solve(&-weight).unwrap() * 1e-3;
    assert!((speed(11) - expected).amax() < 1e-10 * expected.amax().max(1.0));
    // After the release nothing but the Coriolis terms, quadratic in some 0.1 rad/s, changes the speed.
    let during = (speed(15) - speed(14)).amax();
    let after = (speed(25) - speed(24)).amax();
    assert!(after < 0.05 * during, "{after:e} against {during:e}");
}

#[test]
fn pushes_act_in_their_interval_and_a_flange_force_is_its_torques() {
    let force = nalgebra::Vector3::new(3.0, -20.0, 5.0);
    let arm = plant(&nominal(true));
    let torque = flange_jacobian(arm.model(), &pose()).fixed_rows::<3>(0).transpose() * force;
    let pushed = |torque_n_m: Option<Vec<f64>>, flange_force_n: Option<[f64; 3]>| {
        let mut scenario = hold(0.004);
        scenario.pushes = vec![Push { from_s: 0.002, until_s: 0.003, torque_n_m, flange_force_n }];
        let (_, rows) = recorded(&nominal(true), &scenario, &Constant(Joints::zeros()));
        (rows[2].dq, rows[3].dq)
    };
    let (before, after) = pushed(None, Some(force.into()));
    assert!(before.amax() < 1e-12);
    let expected = mass_matrix(arm.model(), &pose()).lu().solve(&torque).unwrap() * 1e-3;
    assert!((after - expected).amax() < 1e-10 * expected.amax());
    let (_, by_torque) = pushed(Some(torque.as_slice().to_vec()), None);
    assert!((after - by_torque).amax() < 1e-12 * after.amax());
}

/// Energy of the passive arm (no torque, no friction) after half a second of falling, relative to what it turned into motion.
fn energy_drift(integrator: Integrator) -> f64 {
    let mut scenario = hold(0.5);
    scenario.integrator = integrator;
    let setting = nominal(false).with_rotor_inertia(0.1);
    let model = plant(&setting).model().clone();
    let energy = |state: &State<7>| kinetic_energy(&model, state) + potential_energy(&model, &state.q);
    let end = final_state(&setting, &scenario, &Constant(Joints::zeros()));
    let kinetic = kinetic_energy(&model, &end);
    assert!(kinetic > 1.0, "it did fall");
    (energy(&end) - energy(&State::at_rest(pose()))).abs() / kinetic
}

#[test]
fn the_integrators_have_their_orders() {
    let euler = |substeps| energy_drift(Integrator { method: Method::SemiImplicitEuler, substeps });
    let kutta = |substeps| energy_drift(Integrator { method: Method::RungeKutta4, substeps });
    let ratio = euler(4) / euler(8);
    assert!((ratio - 2.0).abs() < 0.1, "first order: {ratio}");
    assert!(euler(1) < 2e-2);
    assert!(kutta(1) < 1e-9 && kutta(4) < 1e-11, "{:e}, {:e}", kutta(1), kutta(4));
}

#[test]
fn substeps_converge_to_the_exact_motion() {
    let end = |method, substeps| {
        let mut scenario = hold(0.3);
        scenario.integrator = Integrator { method, substeps };
        final_state(
            &nominal(false).with_friction(1.0).with_rotor_inertia(0.1),
            &scenario,
            &Constant(Joints::repeat(2.0)),
        )
        .q
    };
    let exact = end(Method::RungeKutta4, 4);
    let error = |substeps| (end(Method::SemiImplicitEuler, substeps) - exact).amax();
    let ratio = error(2) / error(4);
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
}

#[test]
fn coulomb_friction_holds_an_arm_and_never_reverses_it() {
    // 5 N m on every joint is far beyond what an explicit step of 1 ms bears: 5/0.01/0.005 = 1e5 /s.
    let mut setting = nominal(true);
    setting.coulomb_n_m.fill(5.0);
    let mut scenario = hold(1.0);
    scenario.pushes = vec![Push { from_s: 0.0, until_s: 1.0, torque_n_m: Some(vec![2.0; 7]), flange_force_n: None }];
    let held = final_state(&setting, &scenario, &Constant(Joints::zeros()));
    // Less than the friction: creep along tanh(dq/0.01) = 2/5 at most, 4.2e-3 rad/s.
    assert!(held.dq.amax() < 6e-3 && (held.q - pose()).amax() < 6e-3, "{held:?}");

    let plant = plant(&setting);
    let scenario = hold(1.0);
    let task = scenario.bind::<7>(&Robot::panda()).unwrap();
    let controller = Constant(Joints::zeros());
    let mut run = Simulation::new(&plant, &task, &controller, NoiseStream::default());
    run.set_state(State { q: pose(), dq: Joints::repeat(0.5) });
    let mut energy = kinetic_energy(plant.model(), run.state());
    while run.advance(&mut ()) == Progress::Running {
        let now = kinetic_energy(plant.model(), run.state());
        assert!(now <= energy * (1.0 + 1e-9) + 1e-15, "friction never adds energy: {energy:e} to {now:e}");
        energy = now;
    }
    assert!(energy < 1e-8);
}

#[test]
fn noise_has_its_deviation_and_its_seed() {
    let mut scenario = hold(5.0);
    scenario.noise = Noise { q_rad: 1e-3, dq_rad_per_s: 0.02 };
    let task = scenario.bind::<7>(&Robot::panda()).unwrap();
    let setting = nominal(true);
    let noise = |seed, index| {
        let mut trajectory = Trajectory::new(1, |sample: &Sample<'_, 7, u32>| {
            (sample.measurement.q - sample.at.q, sample.measurement.dq - sample.at.dq)
        });
        simulate(&plant(&setting), &task, &Constant(Joints::zeros()), NoiseStream { seed, index }, &mut trajectory);
        trajectory.into_rows().into_iter().map(|row| row.diagnostics).collect::<Vec<_>>()
    };
    let one = noise(7, 0);
    let count = (one.len() * 7) as f64;
    let moments = |of: fn(&(Joints<7>, Joints<7>)) -> Joints<7>| {
        let mean = one.iter().map(|pair| of(pair).sum()).sum::<f64>() / count;
        let square = one.iter().map(|pair| of(pair).norm_squared()).sum::<f64>() / count;
        (mean, square.sqrt())
    };
    // 35,000 numbers: the mean within 5 sigma of zero, the deviation within 2 %.
    for ((mean, measured), deviation) in [(moments(|pair| pair.0), 1e-3), (moments(|pair| pair.1), 0.02)] {
        assert!(mean.abs() < 5.0 * deviation / count.sqrt(), "mean {mean}");
        assert!((measured / deviation - 1.0).abs() < 0.02, "deviation {measured}");
    }
    assert_eq!(one, noise(7, 0));
    assert_ne!(one, noise(7, 1));
    assert_ne!(one, noise(8, 0));
}

#[test]
fn a_run_away_stops_and_says_when() {
    let mut scenario = hold(10.0);
    scenario.torque_limits = false;
    let (metrics, rows) = recorded(&nominal(true), &scenario, &Constant(Joints::repeat(50.0)));
    let t_s = metrics.diverged_at_s.expect("50 N m without end diverge");
    assert!((t_s - rows.len() as f64 * 1e-3).abs() < 1e-9 && t_s < 10.0);
    let segment = &metrics.segments[0];
    assert!(segment.final_error_rad.iter().all(|error| error.is_finite()));
    assert!(segment.settling_time_s.iter().all(Option::is_none));
}

#[test]
fn the_same_run_twice_is_the_same_to_the_bit_and_segments_follow_each_other() {
    let robot = Robot::panda();
    let scenario = Scenario::generic(&robot, PlantBox::nominal(false));
    let arm = plant(&nominal(false).with_rotor_inertia(0.1));
    let gains = ComputedTorqueGains { omega_rad_per_s: [3.0; 7], zeta: [1.0; 7] };
    let controller = ComputedTorque::new(&gains, KnownModel(arm.model().clone())).unwrap();
    let setting = nominal(false).with_rotor_inertia(0.1);
    let (metrics, rows) = recorded(&setting, &scenario, &controller);
    assert_eq!((metrics.clone(), rows.clone()), recorded(&setting, &scenario, &controller));
    assert_eq!((metrics.segments.len(), rows.len()), (3, 18_000));
    assert_eq!(metrics.segments.iter().map(|segment| segment.from_s).collect::<Vec<_>>(), [0.0, 6.0, 12.0]);
    for segment in &metrics.segments {
        // A critically damped oscillator of 3 rad/s: exp(-18) (1 + 18) of the step is left, 2 % is reached at w t = 5.834.
        assert!(segment.worst_final_error_rad() < 1e-6);
        for settled in &segment.settling_time_s {
            assert!((settled.expect("every joint moves") - 5.834 / 3.0).abs() < 0.01, "{settled:?}");
        }
        assert!(segment.worst_overshoot() < 1e-6);
    }
}

#[test]
fn any_arm_has_a_generic_task() {
    let robot = Robot::panda();
    let six = Robot::new("six", robot.gravity_m_per_s2(), robot.links()[..6].to_vec()).unwrap();
    let scenario = Scenario::generic(&six, PlantBox::nominal(true));
    scenario.validate().unwrap();
    assert_eq!(scenario.joints(), 6);
    for segment in &scenario.segments {
        for (link, goal) in six.links().iter().zip(&segment.goal_rad) {
            assert!(link.limits.lower_rad < *goal && *goal < link.limits.upper_rad);
        }
    }
    assert!(scenario.bind::<6>(&six).is_ok());
    assert_eq!(scenario.bind::<7>(&robot).unwrap_err().key, "start_rad");
    let wrong: Result<Model<7>, _> = Model::new(&six);
    assert!(wrong.is_err());
}

#[test]
fn a_limited_goal_moves_at_its_speed_from_the_start_and_the_figures_keep_the_tasks_goal() {
    let speed = 0.4;
    let (step_s, mut scenario) = (1e-3, hold(1.0));
    let mut away = pose();
    away[0] += 0.3;
    away[3] -= 0.4; // half a radian: not reached within a second at 0.4 rad/s
    let mut back = scenario.segments[0].clone();
    scenario.segments[0].goal_rad = away.as_slice().to_vec();
    back.duration_s = 2.0;
    scenario.segments.push(back);
    scenario.goal_speed_rad_per_s = Some(speed);
    let (metrics, rows) = recorded(&nominal(true), &scenario, &Constant(Joints::zeros()));
    assert_eq!(rows.len(), 3000);
    let mut before = pose();
    for (k, row) in rows.iter().enumerate() {
        assert!((row.goal - before).norm() <= speed * step_s, "sample {k}");
        before = row.goal;
    }
    // It moves from the first sample on, turns where it is when the next goal is set, and arrives to the bit.
    assert!(((rows[0].goal - pose()).norm() - speed * step_s).abs() < 1e-10);
    assert!(((rows[999].goal - pose()).norm() - 0.4).abs() < 1e-8);
    assert!(((rows[1499].goal - pose()).norm() - 0.2).abs() < 1e-8);
    assert_eq!(rows[2100].goal, pose());
    assert_eq!(metrics.segments[0].goal_rad, away.as_slice());
    // The arm rested at the start throughout: the error is the whole step, and ITAE that of a step (h^2 sum k, at each sample's end).
    assert!((metrics.segments[0].final_error_rad[0] + 0.3).abs() < 1e-9);
    assert!((metrics.segments[0].itae_rad_s2[0] - 0.15).abs() < 1e-3);
}
