//! Every constant stored with the tool, attacked: a million random arms and configurations, directions that climb, and a local search from a
//! hundred starts. `verify --full` proves the records again; this asks whether any arm disagrees.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::f64::consts::PI;
use std::path::Path;

use certune_bounds::{ArmBox, Ranges, SamplingOptions, sampled_constants};
use certune_dynamics::{Model, Robot, gravity_jacobian, gravity_torque, mass_matrix, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints};
use certune_verify::{ConfigurationSet, Number, Record};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;

const ATTACKS: u64 = 1_000_000;
const STARTS: usize = 100;
const SEED: u64 = 0xB0B5;

/// Plain floating point on the attacker's side, as a share of what is compared.
const ROUNDING: f64 = 1e-12;

type Matrix = JointMatrix<7>;
type Vector = Joints<7>;

struct Stored {
    name: String,
    record: Record,
    arms: ArmBox<7>,
}

fn stored() -> Vec<Stored> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tuning/constants");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let read = |path: std::path::PathBuf| {
        let record = Record::parse(&std::fs::read_to_string(&path).unwrap()).unwrap().unwrap();
        let pair = |numbers: &[Number; 2]| [numbers[0].to_f64(), numbers[1].to_f64()];
        let ranges = Ranges {
            mass_uncertainty: record.arms.mass_uncertainty.to_f64(),
            payload_kg: pair(&record.arms.payload_kg),
            payload_com_m: [0, 1, 2].map(|axis| record.arms.payload_com_m[axis].to_f64()),
            rotor_inertia_kg_m2: pair(&record.arms.rotor_inertia_kg_m2),
        };
        assert_eq!(record.arm.name, "panda");
        let arms = ArmBox::new(&Model::new(&Robot::panda()).unwrap(), &ranges).unwrap();
        Stored { name: path.file_stem().unwrap().to_string_lossy().into_owned(), record, arms }
    };
    files.into_iter().map(read).collect()
}

/// The numbers of a record, widened by the attacker's rounding.
struct Limits {
    m: [f64; 2],
    k_g: f64,
    k_c: f64,
    k_r: Option<f64>,
    k_m: Option<f64>,
    diagonal: Option<[Matrix; 2]>,
    torque: Option<Vector>,
}

impl Limits {
    fn of(record: &Record) -> Self {
        let bounds = &record.bounds;
        let up = |number: &Number| number.to_f64() * (1.0 + ROUNDING);
        let down = |number: &Number| number.to_f64() * (1.0 - ROUNDING);
        let vector = |numbers: &[Number], to: &dyn Fn(&Number) -> f64| Vector::from_fn(|j, _| to(&numbers[j]));
        Self {
            m: [down(&bounds.m_lo_kg_m2), up(&bounds.m_hi_kg_m2)],
            k_g: up(&bounds.k_g_n_m_per_rad),
            k_c: up(&bounds.k_c_kg_m2),
            k_r: bounds.k_r.as_ref().map(up),
            k_m: bounds.k_m.as_ref().map(up),
            diagonal: bounds.diagonal_kg_m2.as_ref().map(|[lower, upper]| {
                [Matrix::from_diagonal(&vector(lower, &down)), Matrix::from_diagonal(&vector(upper, &up))]
            }),
            torque: bounds.gravity_torque_n_m.as_ref().map(|torque| vector(torque, &up)),
        }
    }
}

/// A number in `[0, 1)`.
fn share(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53)
}

/// An end of the interval as often as any point of it: the worst masses are at ends.
fn between(rng: &mut ChaCha8Rng, [lower, upper]: [f64; 2]) -> f64 {
    match rng.next_u32() % 4 {
        0 => lower,
        1 => upper,
        _ => lower + share(rng) * (upper - lower),
    }
}

fn unit(rng: &mut ChaCha8Rng) -> Vector {
    Vector::from_fn(|_, _| share(rng) + share(rng) + share(rng) - 1.5).normalize()
}

/// No eigenvalue below zero, but for rounding of the size of `scale`.
fn not_negative(form: &Matrix, scale: f64) -> bool {
    (form + Matrix::identity() * (ROUNDING * scale)).cholesky().is_some()
}

/// A direction in which the Coriolis form is large: alternating between y and its worst v, in the metric of M or in the plain one.
fn climbed(slopes: &[Matrix; 7], metric: Option<&Matrix>, y: Vector) -> Option<Vector> {
    let along = slopes.iter().zip(y.iter()).fold(Matrix::zeros(), |sum, (slope, yj)| sum + slope * *yj);
    let eigen = match metric {
        None => along.symmetric_eigen(),
        Some(m) => {
            let root = m.cholesky()?.l();
            let half = root.solve_lower_triangular(&along)?;
            root.solve_lower_triangular(&half.transpose())?.symmetric_eigen()
        }
    };
    let worst = eigen.eigenvectors.column(eigen.eigenvalues.iamax()).into_owned();
    let v = match metric {
        None => worst,
        Some(m) => m.cholesky()?.l().tr_solve_lower_triangular(&worst)?,
    };
    Vector::from_fn(|j, _| v.dot(&(slopes[j] * v))).try_normalize(1e-12)
}

/// One random member against every bound.
fn attack(stored: &Stored, limits: &Limits, index: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(index);
    let arms = &stored.arms;
    let q = Vector::from_fn(|_, _| PI * (2.0 * share(&mut rng) - 1.0));
    let scales: Vec<f64> = arms.groups().iter().map(|group| between(&mut rng, group.scale)).collect();
    let [rotor_lower, rotor_upper] = arms.rotor_inertia_kg_m2();
    let rotor = Vector::from_fn(|j, _| between(&mut rng, [rotor_lower[j], rotor_upper[j]]));
    let model = arms.model(&scales, &rotor).unwrap();
    let m = mass_matrix(&model, &q);
    let holds =
        |bound: &str, is_so: bool| assert!(is_so, "{}: {bound} fails at {q:?}, {scales:?}, {rotor:?}", stored.name);
    let identity = Matrix::identity();
    let size = limits.m[1];
    holds("m_lo", not_negative(&(m - identity * limits.m[0]), size));
    holds("m_hi", not_negative(&(identity * limits.m[1] - m), size));
    if let Some([lower, upper]) = &limits.diagonal {
        holds("diagonal below M", not_negative(&(m - lower), size));
        holds("diagonal above M", not_negative(&(upper - m), upper.max()));
    }
    let stiffness = gravity_jacobian(&model, &q);
    holds("k_g", not_negative(&(identity * limits.k_g - stiffness), limits.k_g));
    holds("k_g", not_negative(&(identity * limits.k_g + stiffness), limits.k_g));
    if let Some(torque) = &limits.torque {
        let asked = gravity_torque(&model, &q);
        holds("gravity torque", asked.iter().zip(torque).all(|(asked, most)| asked.abs() <= most + 1e-12));
    }
    let slopes = mass_matrix_derivatives(&model, &q);
    // Every eighth member is climbed on, once in each metric.
    let metric = [None, Some(&m)][(index / 8 % 2) as usize];
    let mut y = unit(&mut rng);
    for _ in 0..if index.is_multiple_of(8) { 6 } else { 1 } {
        let form = slopes.iter().zip(y.iter()).fold(Matrix::zeros(), |sum, (slope, yj)| sum + slope * (0.5 * yj));
        for signed in [form, -form] {
            holds("k_c", not_negative(&(identity * limits.k_c + signed), limits.k_c));
            if let Some(k_r) = limits.k_r {
                holds("k_r", not_negative(&(m * k_r + signed), k_r * size));
            }
            if let Some(k_m) = limits.k_m {
                let length = y.dot(&(m * y)).sqrt();
                holds("k_m", not_negative(&(m * (k_m * length) + signed), k_m * length * size));
            }
        }
        match climbed(&slopes, metric, y) {
            Some(next) => y = next,
            None => break,
        }
    }
}

#[test]
fn no_arm_in_a_million_contradicts_a_stored_constant() {
    for stored in stored() {
        assert_eq!(stored.record.over, ConfigurationSet::AllAngles, "{}", stored.name);
        let limits = Limits::of(&stored.record);
        (0..ATTACKS).into_par_iter().for_each(|index| attack(&stored, &limits, index));
        println!("{}: {ATTACKS} members attacked", stored.name);
    }
}

/// Largest acceptable multiples of the truth: m_hi, k_g, k_c, k_r.
const TIGHT: [f64; 4] = [1.10, 1.05, 1.25, 2.0];

#[test]
fn a_hundred_climbs_end_below_every_stored_constant_and_not_far_below() {
    for stored in stored() {
        let found = sampled_constants(&stored.arms, &SamplingOptions::new(2_000, STARTS, 0.0).unwrap());
        let (raw, limits) = (found.raw, Limits::of(&stored.record));
        assert!(raw.m_lo_kg_m2 >= limits.m[0], "{}", stored.name);
        let k_r = limits.k_r.unwrap_or(f64::INFINITY);
        let pairs = [
            (limits.m[1], raw.m_hi_kg_m2),
            (limits.k_g, raw.k_g_n_m_per_rad),
            (limits.k_c, raw.k_c_kg_m2),
            (k_r, raw.k_r),
        ];
        let ratios = pairs.map(|(bound, found)| bound / found);
        println!("{}: m_hi, k_g, k_c, k_r over what {STARTS} climbs found: {ratios:.3?}", stored.name);
        assert!(ratios.iter().all(|ratio| *ratio >= 1.0 - ROUNDING), "{}: {ratios:?}", stored.name);
        for (asked, bound) in found.raw_gravity_torque_n_m.iter().zip(limits.torque.iter().flatten()) {
            assert!(*asked <= bound + 1e-12, "{}: gravity torque {asked} against {bound}", stored.name);
        }
        // Of one arm the truth is known; a family of masses pays for what cancels between links.
        let one_arm = stored.record.arms.mass_uncertainty.to_f64() <= 0.0;
        let tight = ratios.iter().zip(TIGHT).all(|(ratio, most)| *ratio <= most);
        assert!(!one_arm || tight, "{}: {ratios:.3?} against {TIGHT:?}", stored.name);
    }
}
