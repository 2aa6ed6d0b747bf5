//! Time per call of the recursions on the 7-joint Panda, scalar path.

use std::hint::black_box;

use certune_dynamics::{
    Joints, Model, Robot, RobotError, State, coriolis_matrix, forward_dynamics, gravity_torque, inverse_dynamics,
    linearise, mass_matrix,
};
use criterion::{Criterion, criterion_group, criterion_main};

fn recursions(criterion: &mut Criterion) -> Result<(), RobotError> {
    let arm = Model::<7>::new(&Robot::panda())?;
    let at = State {
        q: Joints::from([0.1, -0.4, 0.3, -1.8, 0.2, 1.9, -0.7]),
        dq: Joints::from([0.5, -0.2, 0.8, 0.4, -1.0, 0.3, 1.2]),
    };
    let tau = Joints::from([1.0, -20.0, 3.0, 15.0, 0.5, 2.0, 0.1]);
    criterion
        .bench_function("forward_dynamics", |b| b.iter(|| forward_dynamics(&arm, black_box(&at), black_box(&tau))));
    criterion
        .bench_function("inverse_dynamics", |b| b.iter(|| inverse_dynamics(&arm, black_box(&at), black_box(&tau))));
    criterion.bench_function("gravity_torque", |b| b.iter(|| gravity_torque(&arm, black_box(&at.q))));
    criterion.bench_function("mass_matrix", |b| b.iter(|| mass_matrix(&arm, black_box(&at.q))));
    criterion.bench_function("coriolis_matrix", |b| b.iter(|| coriolis_matrix(&arm, black_box(&at))));
    criterion.bench_function("linearise", |b| b.iter(|| linearise(&arm, black_box(&at), black_box(&tau))));
    Ok(())
}

fn all(criterion: &mut Criterion) {
    if let Err(error) = recursions(criterion) {
        eprintln!("{error}");
    }
}

criterion_group!(benches, all);
criterion_main!(benches);
