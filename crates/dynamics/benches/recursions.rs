//! Time per call of the recursions on the 7-joint Panda, scalar path.

use std::hint::black_box;

use certune_dynamics::{
    Joints, Model, Posture, Robot, RobotError, State, coriolis_matrix, coriolis_torque, flange_jacobian, flange_pose,
    forward_dynamics, friction_slope, friction_torque, gravity_jacobian, gravity_torque, inverse_dynamics,
    inverse_dynamics_derivatives, kinetic_energy, linearise, mass_matrix, mass_matrix_derivatives, potential_energy,
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
    let mut posture = Posture::at(&arm, &at.q);
    let armature = *arm.rotor_inertia_kg_m2();
    criterion.bench_function("posture move_to", |b| b.iter(|| posture.move_to(&arm, black_box(&at.q))));
    criterion.bench_function("posture forward_dynamics", |b| {
        b.iter(|| posture.forward_dynamics(&arm, black_box(&at.dq), black_box(&tau), &armature))
    });
    criterion.bench_function("posture gravity_torque", |b| b.iter(|| black_box(&posture).gravity_torque(&arm)));
    criterion.bench_function("coriolis_torque", |b| b.iter(|| coriolis_torque(&arm, black_box(&at))));
    criterion.bench_function("gravity_jacobian", |b| b.iter(|| gravity_jacobian(&arm, black_box(&at.q))));
    criterion.bench_function("mass_matrix_derivatives", |b| b.iter(|| mass_matrix_derivatives(&arm, black_box(&at.q))));
    criterion.bench_function("inverse_dynamics_derivatives", |b| {
        b.iter(|| inverse_dynamics_derivatives(&arm, black_box(&at), black_box(&tau)))
    });
    criterion.bench_function("flange_pose", |b| b.iter(|| flange_pose(&arm, black_box(&at.q))));
    criterion.bench_function("flange_jacobian", |b| b.iter(|| flange_jacobian(&arm, black_box(&at.q))));
    criterion.bench_function("kinetic_energy", |b| b.iter(|| kinetic_energy(&arm, black_box(&at))));
    criterion.bench_function("potential_energy", |b| b.iter(|| potential_energy(&arm, black_box(&at.q))));
    let rough = arm.with_friction(&Joints::repeat(1.0), &Joints::repeat(0.5));
    criterion.bench_function("friction_torque", |b| b.iter(|| friction_torque(&rough, black_box(&at.dq))));
    criterion.bench_function("friction_slope", |b| b.iter(|| friction_slope(&rough, black_box(&at.dq))));
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
