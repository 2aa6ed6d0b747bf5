//! Time per sampling step of the controllers on seven joints, scalar path; the baselines without the cost of their model.

use std::hint::black_box;

use certune_control::aic::{Aic, AicGains, AicParams};
use certune_control::baseline::{ComputedTorque, ComputedTorqueGains, GravityCompensatedPd, InverseDynamics, PdGains};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams};
use certune_control::{Controller, GoalRateLimiter, Measurement, ParamError};
use certune_linsys::Joints;
use criterion::{Criterion, criterion_group, criterion_main};

const STEP_S: f64 = 1e-3;

const AIC: AicGains<7> = AicGains {
    kappa_mu: [11.67; 7],
    kappa_a: [700.0; 7],
    sigma_q: [1.0; 7],
    sigma_dq: [1.0; 7],
    sigma_mu: [5.0; 7],
    sigma_dmu: [10.0; 7],
    reference_time_constant_s: [1.0; 7],
};

const MRAC: MracGains<7> = MracGains {
    law: MracLaw::ReferenceModel,
    omega_rad_per_s: [2.0; 7],
    zeta: [1.0; 7],
    l1: [1.0; 7],
    l2: [1.0; 7],
    alpha: [[40.0; 7], [4.0; 7], [0.0; 7]],
    e0: [[20.0; 7], [2.0; 7], [0.0; 7]],
    e1: [[10.0; 7], [1.0; 7], [0.0; 7]],
    f0: [[10.0; 7], [1.0; 7], [0.0; 7]],
    f1: [[1.0; 7], [1.0; 7], [0.0; 7]],
};

/// No arm at all: what is left is the controller's own work.
struct Nothing;

impl InverseDynamics<7> for Nothing {
    fn inverse_dynamics(&self, _: &Measurement<7>, ddq: &Joints<7>) -> Joints<7> {
        *ddq
    }
    fn gravity_torque(&self, q: &Joints<7>) -> Joints<7> {
        *q
    }
}

fn measurement() -> Measurement<7> {
    Measurement {
        q: Joints::from([0.1, -0.4, 0.3, -1.8, 0.2, 1.9, -0.7]),
        dq: Joints::from([0.01, 0.02, -0.03, 0.01, 0.0, 0.02, -0.01]),
    }
}

/// Steps that follow one another, each from the state that the last one left.
fn steps<C: Controller<7>>(criterion: &mut Criterion, name: &str, controller: &C) {
    let (at, goal) = (measurement(), Joints::repeat(0.3));
    let mut state = controller.start(&at);
    criterion.bench_function(name, |b| {
        b.iter(|| {
            let (next, u) = controller.step(&state, black_box(&at), black_box(&goal));
            state = next;
            u
        });
    });
}

fn controllers(criterion: &mut Criterion) -> Result<(), ParamError> {
    let (at, goal) = (measurement(), Joints::repeat(0.3));
    let aic = Aic::<7>::new(&AicParams::new(&AIC, STEP_S)?);
    steps(criterion, "aic", &aic);
    let state = aic.start(&at);
    criterion.bench_function("aic free energy", |b| b.iter(|| aic.free_energy(black_box(&state), &at, &goal)));
    for law in MracLaw::ALL {
        let mrac = Mrac::<7>::new(&MracParams::new(&MracGains { law, ..MRAC }, STEP_S)?);
        steps(criterion, &format!("mrac {law}"), &mrac);
    }
    let slopes = [0.01; 7];
    let mut gains = MRAC;
    for family in [&mut gains.alpha, &mut gains.e0, &mut gains.e1, &mut gains.f0, &mut gains.f1] {
        family[2] = slopes;
    }
    let mrac = Mrac::<7>::new(&MracParams::new(&gains, STEP_S)?);
    steps(criterion, "mrac reference-model with derivative terms", &mrac);
    let state = mrac.step(&mrac.start(&at), &at, &goal).0;
    criterion.bench_function("mrac adaptive gains", |b| b.iter(|| mrac.adaptive_gains(black_box(&state), &at, &goal)));
    let gains = PdGains { stiffness_n_m_per_rad: [50.0; 7], damping_n_m_s_per_rad: [20.0; 7] };
    steps(criterion, "pd", &GravityCompensatedPd::<7, _>::new(&gains, Nothing)?);
    let gains = ComputedTorqueGains { omega_rad_per_s: [3.0; 7], zeta: [1.0; 7] };
    steps(criterion, "computed torque", &ComputedTorque::<7, _>::new(&gains, Nothing)?);
    let limiter = GoalRateLimiter::new(0.5, STEP_S)?;
    criterion.bench_function("goal limiter", |b| b.iter(|| limiter.step(black_box(&at.q), black_box(&goal))));
    Ok(())
}

fn all(criterion: &mut Criterion) {
    if let Err(error) = controllers(criterion) {
        eprintln!("{error}");
    }
}

criterion_group!(benches, all);
criterion_main!(benches);
