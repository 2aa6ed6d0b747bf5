//! Time of a claim, candidate and exact check: the arm's 42 states in one configuration, two such loops under one matrix, and the order-6 region of
//! the nonlinear loop. One thread.

use std::error::Error;
use std::hint::black_box;

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, LinearFamily, LyapunovMatrix, Problem, RegionOptions,
    SampledConstantValues, fastest_decay, lyapunov, region,
};
use certune_closed_loop::linearise_aic;
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::{Joints, Model, Robot};
use certune_verify::PlaneRegion;
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;

/// The authors' robot, joint by joint; the slowest eigenvalue decays at about 0.3227 per s.
const SIGMA: [f64; 7] = [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0];
const GOAL_RAD: [f64; 7] = [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0];

fn closed_loop(q_rad: [f64; 7]) -> Result<DMatrix<f64>, Box<dyn Error>> {
    let gains = AicGains {
        kappa_mu: [11.67; 7],
        kappa_a: [200.0; 7],
        sigma_q: SIGMA,
        sigma_dq: SIGMA,
        sigma_mu: [15.0; 7],
        sigma_dmu: [30.0; 7],
        reference_time_constant_s: [1.0; 7],
    };
    let arm = Model::<7>::new(&Robot::panda())?.with_friction(&Joints::repeat(1.0), &Joints::zeros());
    Ok(linearise_aic(&arm, &Joints::from(q_rad), &AicParams::new(&gains, 1e-3)?, true)?.matrix().clone())
}

/// The published simulation gains, gravity compensated.
fn problem() -> Result<Problem, Box<dyn Error>> {
    let all = |x: f64| vec![x; 7];
    let gains = AicGainValues {
        kappa_mu: all(11.67),
        kappa_a: all(700.0),
        sigma_q: all(1.0),
        sigma_dq: all(1.0),
        sigma_mu: all(5.0),
        sigma_dmu: all(10.0),
        reference_time_constant_s: all(1.0),
    };
    let family = FamilyValues {
        gravity_compensation: true,
        friction_n_m_s_per_rad: [1.0, 3.0],
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let constants = SampledConstantValues {
        m_lo_kg_m2: 0.0044,
        m_hi_kg_m2: 4.659,
        k_g_n_m_per_rad: 69.28,
        k_c_kg_m2: 2.254,
        k_r: 4.962,
        k_m: None,
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin: 0.1,
        samples: 1,
        local_starts: 1,
    };
    let arm =
        ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0, 0.0, 0.307] };
    Ok(Problem::new(&arm, gains.written()?, &family, &ConstantValues::Sampled(constants))?)
}

fn claims(criterion: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let common = LyapunovMatrix::Common;
    let half_plane = [PlaneRegion::HalfPlane { rate_per_s: "0.3".parse()? }];
    let single = LinearFamily { vertices: vec![closed_loop(GOAL_RAD)?], configuration_rad: Some(GOAL_RAD.to_vec()) };
    lyapunov(&single, &half_plane, common)?;
    criterion.bench_function("lyapunov_42", |b| b.iter(|| lyapunov(black_box(&single), &half_plane, common)));
    criterion.bench_function("fastest_decay_42", |b| b.iter(|| fastest_decay(black_box(&single), common)));

    let shifted = |by: f64| {
        let mut q_rad = GOAL_RAD;
        q_rad[1] += by;
        q_rad[3] -= by;
        closed_loop(q_rad)
    };
    let pair = LinearFamily { vertices: vec![shifted(-0.2)?, shifted(0.2)?], configuration_rad: None };
    lyapunov(&pair, &half_plane, common)?;
    let mut slow = criterion.benchmark_group("slow");
    slow.sample_size(10);
    slow.bench_function("common_matrix_42", |b| b.iter(|| lyapunov(black_box(&pair), &half_plane, common)));
    let problem = problem()?;
    let options = RegionOptions::default();
    slow.bench_function("region_order_6", |b| b.iter(|| region(black_box(&problem), &options)));
    slow.finish();
    Ok(())
}

fn all(criterion: &mut Criterion) {
    if let Err(error) = claims(criterion) {
        eprintln!("{error}");
    }
}

criterion_group!(benches, all);
criterion_main!(benches);
