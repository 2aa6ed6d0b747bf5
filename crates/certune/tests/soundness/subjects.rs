//! Whom the hunt questions: an arm, a family of plants and gains.

use std::fs;
use std::path::Path;

use certune::bounds::SearchOptions;
use certune::certify::{Options, RegionOptions, SampledOptions, SampledRegionOptions};
use certune::closed_loop::PlantBox;
use certune::dynamics::Robot;
use certune::verify::{Number, Record};
use certune::{ArmCertifier, Effort, Over, family_of};
use certune_testkit::serial_arm;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::RngCore;

use super::chance::{pick, short, stream, uniform};

/// An arm with a family of plants, its constants found.
pub struct Subject<const N: usize> {
    pub name: String,
    pub robot: Robot,
    pub plant_box: PlantBox,
    pub certifier: ArmCertifier<N>,
}

/// Less effort finds smaller regions and fewer attainable points; what it claims must be as true.
pub fn effort(delay_samples: usize) -> Effort {
    Effort {
        proofs: Options {
            region: RegionOptions { coarse: 4, refinements: 0, ..RegionOptions::default() },
            sampled: SampledOptions { delay_samples, ..SampledOptions::default() },
            sampled_region: SampledRegionOptions { delay_samples, ..SampledRegionOptions::default() },
            ..Options::default()
        },
        counterexample: SearchOptions { samples: 64, local_starts: 0, enough: 0.0, ..SearchOptions::default() },
    }
}

fn family(rng: &mut ChaCha8Rng, gravity_compensation: bool) -> PlantBox {
    let friction = pick(rng, &[[0.0, 0.0], [1.0, 3.0], [0.5, 2.0], [0.2, 0.2]]);
    let rotor = pick(rng, &[[0.0, 0.0], [0.1, 0.1], [0.0, 0.1]]);
    PlantBox {
        friction_n_m_s_per_rad: friction,
        rotor_inertia_kg_m2: rotor,
        mass_uncertainty: pick(rng, &[0.0, 0.1, 0.2]),
        payload_kg: [0.0, pick(rng, &[0.0, 0.7, 3.0])],
        ..PlantBox::nominal(gravity_compensation)
    }
}

impl<const N: usize> Subject<N> {
    fn new(name: String, robot: Robot, plant_box: PlantBox) -> Self {
        let certifier = ArmCertifier::new(&robot, &family_of(&plant_box).unwrap()).unwrap();
        Self { name, robot, plant_box, certifier }
    }

    /// An arm nobody has built, with sampled constants.
    pub fn serial(seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, index);
        let mut bytes = [0; 32];
        rng.fill_bytes(&mut bytes);
        let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &bytes));
        let robot = serial_arm::<N>().new_tree(&mut runner).unwrap().current();
        let compensated = uniform(&mut rng, 0.0, 1.0) < 0.6;
        let plant_box =
            PlantBox { payload_kg: [0.0, short(uniform(&mut rng, 0.0, 1.0))], ..family(&mut rng, compensated) };
        Self::new(format!("serial arm {index} of {N} joints"), robot, plant_box)
    }
}

/// The proved constants of the Panda that are stored.
fn records() -> Vec<Record> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tuning/constants");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| Record::parse(&fs::read_to_string(path).unwrap()).unwrap().unwrap()).collect()
}

impl Subject<7> {
    /// The Panda with hand: a family of a stored record with its proved constants, or any family with sampled ones.
    pub fn panda(seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, index);
        let compensated = uniform(&mut rng, 0.0, 1.0) < 0.6;
        let mut plant_box = family(&mut rng, compensated);
        let records = records();
        let record = &records[(rng.next_u64() % records.len() as u64) as usize];
        let proved = uniform(&mut rng, 0.0, 1.0) < 0.7;
        if proved {
            let ends = |interval: &[Number; 2]| [interval[0].to_f64(), interval[1].to_f64()];
            plant_box.mass_uncertainty = record.arms.mass_uncertainty.to_f64();
            plant_box.payload_kg = ends(&record.arms.payload_kg);
            plant_box.rotor_inertia_kg_m2 = ends(&record.arms.rotor_inertia_kg_m2);
        }
        let mut subject = Self::new(format!("panda {index}"), Robot::panda(), plant_box);
        if proved {
            subject.certifier = subject.certifier.with_records(&records, &Over::AllAngles).unwrap();
            assert!(subject.certifier.record().is_some(), "no record covers its own family");
        }
        subject
    }
}
