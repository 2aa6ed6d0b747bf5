//! Proved bounds attacked: by random members, by local maximisation, by dense grids, and by each other.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::f64::consts::{PI, TAU};
use std::sync::Mutex;

use certune_bounds::rigorous::{AngleSet, Effort, PolygonBounds, PolygonPlan, polygon_bounds, polygon_bounds_with};
use certune_bounds::{ArmBox, BoundsError, Ranges, SamplingOptions, sampled_constants};
use certune_dynamics::{Model, Robot, gravity_jacobian, gravity_torque, mass_matrix, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints};
use certune_testkit::serial_arm;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const GRASP_M: [f64; 3] = [0.0, 0.0, 0.307];

/// Plain floating point on the attacker's side.
const ROUNDING: f64 = 1.0 + 1e-12;

fn silent(_: f64) {}

fn nominal() -> Ranges {
    Ranges { payload_com_m: GRASP_M, ..Ranges::nominal() }
}

fn panda(ranges: &Ranges) -> ArmBox<7> {
    ArmBox::new(&Model::new(&Robot::panda()).unwrap(), ranges).unwrap()
}

/// The arm with hand; with rotor inertia; with 3 kg; with everything uncertain.
fn families() -> [Ranges; 4] {
    [
        nominal(),
        Ranges { rotor_inertia_kg_m2: [0.1, 0.1], ..nominal() },
        Ranges { payload_kg: [3.0, 3.0], ..nominal() },
        Ranges { mass_uncertainty: 0.2, payload_kg: [0.0, 0.7], rotor_inertia_kg_m2: [0.0, 0.1], ..nominal() },
    ]
}

/// A small stream of numbers in `[0, 1)`: SplitMix64.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, lower: f64, upper: f64) -> f64 {
        lower + self.next() * (upper - lower)
    }

    fn unit<const N: usize>(&mut self) -> Joints<N> {
        Joints::<N>::from_fn(|_, _| self.next() + self.next() + self.next() - 1.5).normalize()
    }

    /// An end of the interval as often as any point of it: the worst masses are at ends.
    fn scale(&mut self, [lower, upper]: [f64; 2]) -> f64 {
        match (4.0 * self.next()) as u8 {
            0 => lower,
            1 => upper,
            _ => self.within(lower, upper),
        }
    }
}

/// Eigenvalues, and eigenvectors as columns, of a matrix whose size is known late.
fn eigen<const N: usize>(matrix: &JointMatrix<N>) -> (DVector<f64>, DMatrix<f64>) {
    let eigen = DMatrix::from_fn(N, N, |a, b| matrix[(a, b)]).symmetric_eigen();
    (eigen.eigenvalues, eigen.eigenvectors)
}

fn largest<const N: usize>(matrix: &JointMatrix<N>) -> f64 {
    eigen(matrix).0.max()
}

fn dominant<const N: usize>(matrix: &JointMatrix<N>) -> f64 {
    eigen(matrix).0.amax()
}

/// `1/2 max |v'(d_y M) v|` at one configuration, from below: alternating between y and v.
fn coriolis<const N: usize>(slopes: &[JointMatrix<N>; N], mut y: Joints<N>, rounds: usize) -> f64 {
    let mut value = 0.0_f64;
    for _ in 0..rounds {
        let along = slopes.iter().zip(y.iter()).fold(JointMatrix::<N>::zeros(), |sum, (slope, yj)| sum + slope * *yj);
        let (values, vectors) = eigen(&along);
        let v = Joints::<N>::from_fn(|j, _| vectors[(j, values.iamax())]);
        let form = Joints::<N>::from_fn(|j, _| v.dot(&(slopes[j] * v)));
        value = value.max(0.5 * form.norm());
        match form.try_normalize(1e-12) {
            Some(next) => y = next,
            None => break,
        }
    }
    value
}

/// Random members and configurations of a box of angles: none exceeds a bound. Returns the largest shares of m_hi, k_g, k_c seen.
fn attack<const N: usize>(
    arms: &ArmBox<N>,
    bounds: &PolygonBounds,
    (lower, upper): ([f64; N], [f64; N]),
    tries: usize,
    seed: u64,
) -> [f64; 3] {
    let mut draws = Draws(seed);
    let mut most = [0.0_f64; 3];
    let [rotor_lower, rotor_upper] = arms.rotor_inertia_kg_m2();
    let roots = Joints::<N>::from_fn(|j, _| bounds.diagonal_upper_kg_m2[j].sqrt());
    for _ in 0..tries {
        let q = Joints::<N>::from_fn(|j, _| draws.within(lower[j], upper[j]));
        let scales: Vec<f64> = arms.groups().iter().map(|group| draws.scale(group.scale)).collect();
        let rotor = Joints::<N>::from_fn(|j, _| draws.scale([rotor_lower[j], rotor_upper[j]]));
        let model = arms.model(&scales, &rotor).unwrap();
        let inertia = mass_matrix(&model, &q);
        let m = largest(&inertia);
        assert!(m <= bounds.m_hi_kg_m2 * ROUNDING, "m_hi: {m} at {q:?}");
        let scaled = JointMatrix::<N>::from_fn(|a, b| inertia[(a, b)] / (roots[a] * roots[b]));
        let t = largest(&scaled);
        assert!(t <= ROUNDING, "diagonal: {t} at {q:?}");
        let g = dominant(&gravity_jacobian(&model, &q));
        assert!(g <= bounds.k_g_n_m_per_rad * ROUNDING, "k_g: {g} at {q:?}");
        for (torque, bound) in gravity_torque(&model, &q).iter().zip(&bounds.gravity_torque_n_m) {
            assert!(torque.abs() <= bound * ROUNDING + 1e-12, "torques: {torque} against {bound} at {q:?}");
        }
        let c = coriolis(&mass_matrix_derivatives(&model, &q), draws.unit(), 3);
        assert!(c <= bounds.k_c_kg_m2 * ROUNDING, "k_c: {c} at {q:?}");
        for (share, (value, bound)) in
            most.iter_mut().zip([(m, bounds.m_hi_kg_m2), (g, bounds.k_g_n_m_per_rad), (c, bounds.k_c_kg_m2)])
        {
            *share = share.max(value / bound);
        }
    }
    most
}

/// Local maximisation from many starts: below every bound, and not far below.
fn climb<const N: usize>(arms: &ArmBox<N>, bounds: &PolygonBounds, starts: usize) -> [f64; 3] {
    let raw = sampled_constants(arms, &SamplingOptions::new(2_000, starts, 0.0).unwrap());
    let found = raw.raw;
    assert!(found.m_hi_kg_m2 <= bounds.m_hi_kg_m2 * ROUNDING);
    assert!(found.k_g_n_m_per_rad <= bounds.k_g_n_m_per_rad * ROUNDING);
    assert!(found.k_c_kg_m2 <= bounds.k_c_kg_m2 * ROUNDING);
    for (torque, bound) in raw.raw_gravity_torque_n_m.iter().zip(&bounds.gravity_torque_n_m) {
        assert!(*torque <= bound * ROUNDING + 1e-12, "{torque} against {bound}");
    }
    [
        bounds.m_hi_kg_m2 / found.m_hi_kg_m2,
        bounds.k_g_n_m_per_rad / found.k_g_n_m_per_rad,
        bounds.k_c_kg_m2 / found.k_c_kg_m2,
    ]
}

const TORUS: ([f64; 7], [f64; 7]) = ([-PI; 7], [PI; 7]);

fn quick(ranges: &Ranges) -> (ArmBox<7>, PolygonBounds) {
    let arms = panda(ranges);
    let bounds = polygon_bounds(&arms, &AngleSet::AllAngles, Effort::Quick, &silent).unwrap();
    (arms, bounds)
}

// `cargo test --release -p certune-bounds -- --ignored` runs this and the other slow ones.
#[test]
#[ignore = "20 s of two cores; `any_arm_with_uncertain_masses_obeys_its_bounds` attacks smaller arms"]
fn no_member_of_a_family_exceeds_its_bounds() {
    for (ranges, seed) in families().iter().zip(1..) {
        let (arms, bounds) = quick(ranges);
        let most = attack(&arms, &bounds, TORUS, 3_000, seed);
        assert!(most.iter().all(|share| *share > 0.4), "the attack comes near: {most:?}");
        // The four are far from the targets of a stored record, yet no sham.
        let ratios = climb(&arms, &bounds, 32);
        assert!(ratios[0] < 1.15 && ratios[1] < 1.10 && ratios[2] < 2.0, "{ratios:?}");
    }
}

/// Tightness of the bounds that are stored, against maxima found by a separate program, and a million attacks. Takes minutes: run it by name.
#[test]
#[ignore = "minutes of computing"]
fn the_stored_bounds_are_tight_and_withstand_a_million_attacks() {
    // m_hi, k_g, k_c; rotor inertia adds its own amount to m_hi.
    let truths =
        [Some([4.6587, 69.2823, 2.2541]), Some([4.7587, 69.2823, 2.2541]), Some([9.4838, 116.9065, 4.6640]), None];
    for ((ranges, truth), seed) in families().iter().zip(truths).zip(100..) {
        let arms = panda(ranges);
        let bounds = polygon_bounds(&arms, &AngleSet::AllAngles, Effort::Standard, &silent).unwrap();
        let ratios = climb(&arms, &bounds, 100);
        println!("{ranges:?}\n{bounds:?}\nratios to local maxima {ratios:?}");
        if let Some([m_hi, k_g, k_c]) = truth {
            assert!(bounds.m_hi_kg_m2 <= 1.10 * m_hi);
            assert!(bounds.k_g_n_m_per_rad <= 1.05 * k_g);
            assert!(bounds.k_c_kg_m2 <= 1.25 * k_c);
        }
        attack(&arms, &bounds, TORUS, 1_000_000, seed);
    }
}

#[test]
fn a_box_is_bounded_by_arcs() {
    let lower = [-1.3, -0.1, -0.3, -2.3, -0.3, 0.9, -0.3];
    let upper = [1.3, 0.8, 0.3, -0.9, 0.3, 2.8, 0.3];
    let arms = panda(&nominal());
    let set = AngleSet::Box { lower_rad: lower, upper_rad: upper };
    let bounds = polygon_bounds(&arms, &set, Effort::Quick, &silent).unwrap();
    attack(&arms, &bounds, (lower, upper), 3_000, 7);
    // Maxima over this box from the separate program.
    assert!((4.529..1.03 * 4.530).contains(&bounds.m_hi_kg_m2), "{}", bounds.m_hi_kg_m2);
    assert!((64.08..1.02 * 64.09).contains(&bounds.k_g_n_m_per_rad), "{}", bounds.k_g_n_m_per_rad);
    // A point is a box too: the bounds are the values there, but for the widening of the arc.
    let point: [f64; 7] = [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0];
    let set = AngleSet::Box { lower_rad: point, upper_rad: point };
    let bounds = polygon_bounds(&arms, &set, Effort::Quick, &silent).unwrap();
    let model = Model::<7>::new(&Robot::panda()).unwrap();
    let m = largest(&mass_matrix(&model, &Joints::from(point)));
    assert!((m..1.01 * m).contains(&bounds.m_hi_kg_m2), "{m} {}", bounds.m_hi_kg_m2);
}

#[test]
fn the_same_bits_for_any_number_of_threads_and_from_the_stored_plan() {
    let arms = panda(&families()[3]);
    let mut plan = PolygonPlan::new(&arms, &AngleSet::AllAngles, Effort::Quick).unwrap();
    plan.coriolis_grid = vec![9; 7];
    plan.coriolis_part_grid = vec![7; 7];
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| polygon_bounds_with(&arms, &AngleSet::AllAngles, &plan, &silent).unwrap())
    };
    let one = run(1);
    assert_eq!(one, run(3));
    let text = serde_json::to_string(&one).unwrap();
    let read: PolygonBounds = serde_json::from_str(&text).unwrap();
    let shares = Mutex::new(Vec::new());
    let hear = |share: f64| shares.lock().unwrap().push(share);
    let again = polygon_bounds_with(&arms, &AngleSet::AllAngles, &read.plan, &hear).unwrap();
    assert_eq!(again, one);
    let heard = shares.into_inner().unwrap();
    assert!(heard.len() > 100 && heard.iter().all(|share| (0.0..=1.0).contains(share)));
    assert!((heard.last().unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let arms = panda(&nominal());
    let mut upper = [1.0; 7];
    upper[4] = -1.0;
    let reversed = AngleSet::Box { lower_rad: [0.0; 7], upper_rad: upper };
    let refused = polygon_bounds(&arms, &reversed, Effort::Quick, &silent).unwrap_err();
    assert_eq!(refused, BoundsError::Angles { joint: 5, lower: 0.0, upper: -1.0 });
    let far = AngleSet::Box { lower_rad: [100.0; 7], upper_rad: [101.0; 7] };
    assert!(matches!(polygon_bounds(&arms, &far, Effort::Quick, &silent), Err(BoundsError::Angles { joint: 1, .. })));
    let nan = AngleSet::Box { lower_rad: [f64::NAN; 7], upper_rad: [1.0; 7] };
    assert!(matches!(polygon_bounds(&arms, &nan, Effort::Quick, &silent), Err(BoundsError::Angles { joint: 1, .. })));

    let plan = PolygonPlan::new(&arms, &AngleSet::AllAngles, Effort::Quick).unwrap();
    let with = |edit: &dyn Fn(&mut PolygonPlan)| {
        let mut edited = plan.clone();
        edit(&mut edited);
        polygon_bounds_with(&arms, &AngleSet::AllAngles, &edited, &silent).unwrap_err()
    };
    assert_eq!(with(&|p| p.inertia_pieces[2] = 2), BoundsError::Pieces { given: 2, least: 4 });
    assert_eq!(with(&|p| p.coriolis_grid[3] = 4), BoundsError::Pieces { given: 4, least: 5 });
    assert_eq!(with(&|p| p.gravity_pieces.truncate(6)), BoundsError::Length { given: 6, expected: 7 });
    assert_eq!(with(&|p| p.diagonal_weights[0] = -1.0), BoundsError::Weight { value: -1.0 });
}

/// Largest values on a dense grid of the angles that matter.
fn dense<const N: usize>(model: &Model<N>, each: usize) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    for k in 0..each.pow(N as u32) {
        let q = Joints::<N>::from_fn(|j, _| TAU * ((k / each.pow(j as u32)) % each) as f64 / each as f64);
        most[0] = most[0].max(largest(&mass_matrix(model, &q)));
        most[1] = most[1].max(dominant(&gravity_jacobian(model, &q)));
        most[2] = most[2].max(coriolis(&mass_matrix_derivatives(model, &q), Joints::repeat(0.4), 4));
    }
    most
}

fn bounds_of<const N: usize>(robot: &Robot, ranges: &Ranges) -> (ArmBox<N>, PolygonBounds) {
    let arms = ArmBox::new(&Model::<N>::new(robot).unwrap(), ranges).unwrap();
    let bounds = polygon_bounds(&arms, &AngleSet::AllAngles, Effort::Quick, &silent).unwrap();
    (arms, bounds)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn small_arms_agree_with_a_dense_grid(two in serial_arm::<2>(), three in serial_arm::<3>()) {
        // One matrix dM/dq_1: its Frobenius norm stands for its spectral norm, a factor of sqrt 2 at most.
        let (arms, bounds) = bounds_of::<2>(&two, &Ranges::nominal());
        let most = dense(&arms.model(&[1.0; 2], &Joints::zeros()).unwrap(), 64);
        prop_assert!(most[0] <= bounds.m_hi_kg_m2 * ROUNDING && bounds.m_hi_kg_m2 <= 1.02 * most[0], "m_hi");
        prop_assert!(most[1] <= bounds.k_g_n_m_per_rad * ROUNDING && bounds.k_g_n_m_per_rad <= 1.02 * most[1] + 1e-9, "k_g");
        prop_assert!(most[2] <= bounds.k_c_kg_m2 * ROUNDING && bounds.k_c_kg_m2 <= 1.45 * most[2] + 1e-9, "k_c");

        let (arms, bounds) = bounds_of::<3>(&three, &Ranges::nominal());
        let most = dense(&arms.model(&[1.0; 3], &Joints::zeros()).unwrap(), 18);
        prop_assert!(most[0] <= bounds.m_hi_kg_m2 * ROUNDING && bounds.m_hi_kg_m2 <= 1.06 * most[0], "m_hi");
        prop_assert!(most[1] <= bounds.k_g_n_m_per_rad * ROUNDING && bounds.k_g_n_m_per_rad <= 1.06 * most[1] + 1e-9, "k_g");
        // The last link's share is split: norms add.
        prop_assert!(most[2] <= bounds.k_c_kg_m2 * ROUNDING && bounds.k_c_kg_m2 <= 3.0 * most[2] + 1e-9, "k_c");
    }

    #[test]
    fn any_arm_with_uncertain_masses_obeys_its_bounds(
        one in serial_arm::<1>(), four in serial_arm::<4>(), five in serial_arm::<5>(), seed in any::<u64>(),
    ) {
        let ranges = Ranges {
            mass_uncertainty: 0.3,
            payload_kg: [0.1, 1.0],
            payload_com_m: [0.05, -0.1, 0.2],
            rotor_inertia_kg_m2: [0.0, 0.2],
        };
        let (arms, bounds) = bounds_of::<1>(&one, &ranges);
        attack(&arms, &bounds, ([-PI; 1], [PI; 1]), 500, seed);
        let (arms, bounds) = bounds_of::<4>(&four, &ranges);
        attack(&arms, &bounds, ([-PI; 4], [PI; 4]), 500, seed);
        climb(&arms, &bounds, 4);
        let (arms, bounds) = bounds_of::<5>(&five, &ranges);
        attack(&arms, &bounds, ([-PI; 5], [PI; 5]), 500, seed);
    }
}
