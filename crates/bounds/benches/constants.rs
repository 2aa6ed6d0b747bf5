//! Time of one run of [`sampled_constants`] on the Panda, nominal and on the box of the default scenario.

use certune_bounds::{ArmBox, Ranges, SamplingOptions, sampled_constants};
use certune_dynamics::{Model, Robot};
use criterion::{Criterion, criterion_group, criterion_main};

fn constants(c: &mut Criterion) {
    let mut group = c.benchmark_group("sampled_constants");
    group.sample_size(10);
    let task = Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        payload_com_m: [0.0, 0.0, 0.307],
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    for (name, ranges) in [("nominal", Ranges::nominal()), ("task", task)] {
        let arm_box = Model::<7>::new(&Robot::panda())
            .ok()
            .and_then(|model| ArmBox::new(&model, &ranges).ok())
            .expect("the built-in arm and these ranges are valid");
        group.bench_function(name, |b| b.iter(|| sampled_constants(&arm_box, &SamplingOptions::default())));
    }
    group.finish();
}

criterion_group!(benches, constants);
criterion_main!(benches);
