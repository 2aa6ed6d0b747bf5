//! Goals that move and disturbances that know the Lyapunov function, against what is certified about them.
//!
//! The nonlinear continuous-time loop is integrated (Runge and Kutta) on the Panda; at every step the goal moves, or the noise points, in the
//! direction in which V grows fastest.

use std::path::Path;

use certune::certify::{DisturbanceOptions, FamilyValues, GoalListValues, MovingGoalOptions, Options};
use certune::closed_loop::{NoiseStream, Plant, PlantSetting, Recorder, Sample, Scenario, simulate};
use certune::control::aic::{Aic, AicGains, AicParams, AicState};
use certune::dynamics::{Model, Robot, mass_matrix};
use certune::linsys::Joints;
use certune::verify::{Certificate, Claim, ClaimKind, Number, RegionClaim, RegionWitness, triangle};
use certune::{ArmCertifier, Effort};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::RngCore;

use super::chance::{stream, uniform};
use super::continuous::{Continuous, Loop};

const N: usize = 7;
const STEP_S: f64 = 1e-3;
/// A goal that moves in steps of a millisecond, and the roundings.
const V_SLACK: f64 = 2e-3;

fn gains(kappa_a: f64) -> AicGains<N> {
    AicGains {
        kappa_mu: [11.67; N],
        kappa_a: [kappa_a; N],
        sigma_q: [1.0; N],
        sigma_dq: [1.0; N],
        sigma_mu: [5.0; N],
        sigma_dmu: [10.0; N],
        reference_time_constant_s: [1.0; N],
    }
}

fn scenario() -> Scenario {
    let text = include_str!("../../../../tuning/scenarios/pick-and-place.toml");
    Scenario::parse(Path::new("pick-and-place.toml"), text).unwrap()
}

fn certificate(kappa_a: f64, claim: ClaimKind, proofs: Options) -> Certificate {
    let family = FamilyValues {
        gravity_compensation: true,
        friction_n_m_s_per_rad: [1.0, 3.0],
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let certifier = ArmCertifier::<N>::new(&Robot::panda(), &family).unwrap();
    let effort = Effort { proofs, ..Effort::default() };
    certifier.certify_with(&gains(kappa_a), &[claim], &effort).unwrap()
}

/// The Panda, each joint's friction at one of its ends.
fn arm(rng: &mut ChaCha8Rng) -> Model<N> {
    let friction = Joints::from_fn(|_, _| if rng.next_u64().is_multiple_of(2) { 1.0 } else { 3.0 });
    Model::<N>::new(&Robot::panda()).unwrap().with_friction(&friction, &Joints::zeros())
}

fn at_rest(q: Joints<N>) -> Continuous<N> {
    Continuous { q, dq: Joints::zeros(), beliefs: [q, Joints::zeros(), Joints::zeros()], u: Joints::zeros() }
}

/// Half the gradient of V with respect to z, row by row.
fn gradient(arm: &Loop<'_, N>, b: &[f64], s: &[f64], x: &Continuous<N>) -> [Joints<N>; 5] {
    let momentum = mass_matrix(&arm.model, &x.q) * x.dq;
    let z = arm.z(x);
    [0, 1, 2, 3, 4].map(|i| (0..5).fold(momentum * b[i], |sum, k| sum + z[k] * s[triangle(i, k)]))
}

fn floats(numbers: &[Number]) -> Vec<f64> {
    numbers.iter().map(Number::to_f64).collect()
}

fn along(direction: Joints<N>, length: f64) -> Joints<N> {
    let norm = direction.norm();
    if norm > 0.0 { direction * (length / norm) } else { Joints::repeat(length / (N as f64).sqrt()) }
}

#[test]
fn no_goal_at_the_certified_speed_takes_the_state_out_of_the_region() {
    let options = Options {
        moving_goal: MovingGoalOptions { coarse: 4, refinements: 2, ..Default::default() },
        ..Default::default()
    };
    let certificate = certificate(700.0, ClaimKind::MovingGoal, options);
    assert!(certificate.all_hold());
    let (Claim::Region(region), Claim::MovingGoal(claim)) =
        (&certificate.document().claims[0].claim, &certificate.document().claims[1].claim)
    else {
        panic!("a region and a moving goal")
    };
    let params = AicParams::new(&gains(700.0), STEP_S).unwrap();
    let (b, s) = (floats(&region.witness.b), floats(&region.witness.s));
    let speed = claim.goal_speed_rad_per_s.to_f64();
    let jump = claim.jump_rad.to_f64();
    let dwell_steps = (claim.dwell_s.to_f64() / STEP_S).round() as usize;
    let mut rng = stream(0xCE27, 0);
    let mut worst = [0.0_f64; 2];
    for attack in 0..8 {
        let q = Joints::from_fn(|_, _| uniform(&mut rng, -3.0, 3.0));
        let mut arm = Loop { model: arm(&mut rng), params: &params, goal: q, compensated: true };
        let mut x = at_rest(q);
        let jumps = attack % 2 == 1;
        let mut push = Joints::zeros();
        for step in 0..4 * dwell_steps {
            if !jumps || step % dwell_steps == 0 {
                // The goal flees: z falls by X delta, so V grows where the gradient points against it.
                let slope = gradient(&arm, &b, &s, &x);
                let uphill = -(slope[0] + slope[1]);
                if !jumps && attack % 4 == 2 && step % 500 == 0 {
                    push = Joints::from_fn(|_, _| uniform(&mut rng, -1.0, 1.0));
                }
                let direction = if attack % 4 == 2 && !jumps { push } else { uphill };
                arm.goal += along(direction, if jumps { jump } else { speed * STEP_S });
            }
            let v = arm.v(region, &x);
            assert!(v <= 1.0 + V_SLACK, "attack {attack}, step {step}: V = {v}");
            assert!((x.q - arm.goal).norm() <= claim.distance_rad.to_f64() * (1.0 + V_SLACK));
            worst[usize::from(jumps)] = worst[usize::from(jumps)].max(v);
            x = arm.step(&x, STEP_S);
        }
    }
    println!("V reached {worst:?} under ramps and jumps");
    // A jump at rest takes V to (1 - exp(-alpha T))^2 at once; a goal that flees gets a good part of the way.
    assert!(worst[1] > 0.7 && worst[0] > 0.1, "{worst:?}");
}

/// The largest V along a run of the sampled simulation.
struct LargestV<'a> {
    arm: Loop<'a, N>,
    region: &'a RegionClaim,
    largest: f64,
}

impl Recorder<N, AicState<N>> for LargestV<'_> {
    fn sample(&mut self, sample: &Sample<'_, N, AicState<N>>) {
        let AicState { mu, dmu, ddmu, u } = *sample.state;
        self.arm.goal = sample.goal;
        let x = Continuous { q: sample.at.q, dq: sample.at.dq, beliefs: [mu, dmu, ddmu], u };
        self.largest = self.largest.max(self.arm.v(self.region, &x));
    }
}

#[test]
fn the_ramped_pick_and_place_task_stays_in_the_region_and_arrives_in_time() {
    let mut scenario = scenario();
    let list = GoalListValues {
        start_rad: scenario.start_rad.clone(),
        goals: scenario.segments.iter().map(|goal| (goal.goal_rad.clone(), goal.duration_s)).collect(),
    };
    let moving_goal = MovingGoalOptions { coarse: 4, refinements: 2, list: Some(list), ..Default::default() };
    let certificate = certificate(2000.0, ClaimKind::MovingGoal, Options { moving_goal, ..Default::default() });
    let (Claim::Region(region), Claim::MovingGoal(claim)) =
        (&certificate.document().claims[0].claim, &certificate.document().claims[1].claim)
    else {
        panic!("a region and a moving goal")
    };
    let list = claim.list.as_ref().unwrap();
    println!("{}", certificate.checked()[1].statement);
    assert!(list.goals.iter().all(|goal| goal.arrival_s.value() <= goal.duration_s.value()));
    scenario.goal_speed_rad_per_s = Some(list.speed_rad_per_s.to_f64());
    let robot = Robot::panda();
    let params = AicParams::new(&gains(2000.0), STEP_S).unwrap();
    let task = scenario.bind::<N>(&robot).unwrap();
    for friction in [1.0, 3.0] {
        let setting = PlantSetting { viscous_n_m_s_per_rad: vec![friction; N], ..PlantSetting::nominal(&robot, true) };
        let plant = Plant::<N>::new(&robot, &setting).unwrap();
        let arm = Loop { model: plant.model().clone(), params: &params, goal: task.start, compensated: true };
        let mut recorder = LargestV { arm, region, largest: 0.0 };
        let metrics = simulate(&plant, &task, &Aic::new(&params), NoiseStream::default(), &mut recorder);
        println!(
            "friction {friction}: V at most {}, final error {}",
            recorder.largest,
            metrics.worst_final_error_rad()
        );
        // The simulation samples at 1 kHz, which the claim does not cover; a good margin below 1 is expected of it.
        assert!(recorder.largest < 0.9 && recorder.largest > 0.01);
        assert_eq!(metrics.saturated_steps(), 0);
    }
    // The same task with goals that jump starts outside.
    let (a, b) = (&task.segments[0].goal, &task.start);
    let weight: f64 =
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| region.witness.s[triangle(i, j)].to_f64()).iter().sum();
    assert!(weight * (a - b).norm_squared() > 1.0);
    assert_eq!(claim.covered_jumps(certificate.document()).unwrap(), 0);
}

/// The worst disturbances at x: in the direction of V's slope.
fn worst_disturbances(
    arm: &Loop<'_, N>,
    witness: &RegionWitness,
    bounds: [f64; 3],
    x: &Continuous<N>,
) -> [Joints<N>; 3] {
    let (b, s, p) = (floats(&witness.b), floats(&witness.s), witness.p.to_f64());
    let slope = gradient(arm, &b, &s, x);
    let z = arm.z(x);
    let y = (0..5).fold(Joints::<N>::zeros(), |sum, k| sum + z[k] * b[k]);
    let controller = arm.params.continuous_joint(0);
    let of = |weight: &dyn Fn(usize) -> f64| (1..5).fold(Joints::<N>::zeros(), |sum, k| sum + slope[k] * weight(k));
    [
        along(of(&|k| controller.A[(k, 0)]), bounds[0]),
        along(of(&|k| controller.b[k]), bounds[1]),
        along(x.dq * p + y, bounds[2]),
    ]
}

/// One step under disturbances held over it.
fn disturbed_step(arm: &Loop<'_, N>, x: &Continuous<N>, [n_q, n_v, w]: &[Joints<N>; 3]) -> Continuous<N> {
    let derivative = |x: &Continuous<N>| {
        let mut rate = arm.derivative(x);
        let controller = arm.params.continuous_joint(0);
        let noise = |k: usize| n_q * controller.A[(k, 0)] + n_v * controller.b[k];
        rate.beliefs = [0, 1, 2].map(|k| rate.beliefs[k] + noise(k + 1));
        rate.u += noise(4);
        if let Some(push) = mass_matrix(&arm.model, &x.q).cholesky().map(|factor| factor.solve(w)) {
            rate.dq += push;
        }
        rate
    };
    let k1 = derivative(x);
    let k2 = derivative(&x.plus(&k1, STEP_S / 2.0));
    let k3 = derivative(&x.plus(&k2, STEP_S / 2.0));
    let k4 = derivative(&x.plus(&k3, STEP_S));
    [(&k1, 1.0), (&k2, 2.0), (&k3, 2.0), (&k4, 1.0)]
        .into_iter()
        .fold(*x, |sum, (k, weight)| sum.plus(k, STEP_S * weight / 6.0))
}

#[test]
fn no_disturbance_within_its_bounds_exceeds_the_certified_error() {
    let noise = DisturbanceOptions::default();
    let cases = [
        noise,
        DisturbanceOptions { radius_rad: 0.2, ..noise },
        DisturbanceOptions { torque_n_m: 0.2, push_n_m: 2.0, ..noise },
        DisturbanceOptions { position_noise_rad: 0.0, velocity_noise_rad_per_s: 0.0, push_n_m: 5.0, ..noise },
    ];
    let params = AicParams::new(&gains(700.0), STEP_S).unwrap();
    let mut rng = stream(0xCE27, 0);
    for options in cases {
        let certificate =
            certificate(700.0, ClaimKind::Disturbance, Options { disturbance: options, ..Default::default() });
        let Claim::Disturbance(claim) = &certificate.document().claims[0].claim else {
            panic!("{options:?}: {}", certificate.checked()[0].statement)
        };
        println!("{}", certificate.checked()[0].statement);
        // V is read through a region with the same weights.
        let w = &claim.witness;
        let witness = RegionWitness {
            p: w.p.clone(),
            b: w.b.clone(),
            s: w.s.clone(),
            rho: w.rho.clone(),
            theta: w.theta.clone(),
            friction_multiplier: w.friction_multiplier.clone(),
            gravity_multiplier: Number::zero(),
            start_multiplier: Number::zero(),
        };
        let region = RegionClaim {
            radius_rad: claim.radius_rad.clone(),
            rate_per_s: claim.rate_per_s.clone(),
            controller_torque_n_m: None,
            motor_limits_n_m: None,
            distance_rad: None,
            witness,
        };
        let bounds = [options.position_noise_rad, options.velocity_noise_rad_per_s, options.torque_n_m];
        let (mut worst, mut worst_end) = (0.0_f64, 0.0_f64);
        for _ in 0..2 {
            let goal = Joints::from_fn(|_, _| uniform(&mut rng, -3.0, 3.0));
            let mut random = || Joints::<N>::from_fn(|_, _| uniform(&mut rng, -1.0, 1.0));
            let (away, push) = (along(random(), options.radius_rad), along(random(), options.push_n_m));
            let (first_q, first_v) = (along(random(), bounds[0]), along(random(), bounds[1]));
            let arm = Loop { model: arm(&mut rng), params: &params, goal, compensated: true };
            let mut x = at_rest(goal + away);
            x.beliefs = [x.q + first_q, first_v, Joints::zeros()];
            // With the push the equilibrium torque is its opposite: u~ is the push itself.
            x.u = push;
            let (steps, last) = (20_000, 19_000);
            for step in 0..steps {
                let acting = worst_disturbances(&arm, &region.witness, bounds, &x);
                let (v, error) = (arm.v(&region, &x), (x.q - goal).norm());
                assert!(v <= 1.0 + V_SLACK, "{options:?}, step {step}: V = {v}");
                assert!(error <= claim.excursion_rad.to_f64(), "{options:?}, step {step}: |e| = {error}");
                worst = worst.max(error);
                if step >= last {
                    worst_end = worst_end.max(error);
                }
                x = disturbed_step(&arm, &x, &acting);
            }
        }
        let ultimate = claim.ultimate_rad.to_f64();
        println!("|e| at most {worst} of {}, at the end {worst_end} of {ultimate}", claim.excursion_rad);
        assert!(worst_end <= ultimate.max(1e-4), "{options:?}: {worst_end}");
        // An attack that moves nothing would show nothing.
        assert!(worst > 0.02 * claim.excursion_rad.to_f64(), "{options:?}");
    }
}
