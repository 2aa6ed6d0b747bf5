//! The Panda's constants against values found by another program, and every attained value evaluated again by other means.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use std::sync::LazyLock;

use certune_bounds::{
    ArmBox, Attained, Axis, Ranges, SampledConstants, SamplingOptions, SearchOptions, maximise, sampled_constants,
};
use certune_dynamics::{Model, Robot, gravity_jacobian, gravity_torque, mass_matrix, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints};

const GRASP_M: [f64; 3] = [0.0, 0.0, 0.307];

fn arm_box(ranges: &Ranges) -> ArmBox<7> {
    ArmBox::new(&Model::new(&Robot::panda()).unwrap(), ranges).unwrap()
}

fn nominal() -> Ranges {
    Ranges { payload_com_m: GRASP_M, ..Ranges::nominal() }
}

static NOMINAL: LazyLock<SampledConstants> =
    LazyLock::new(|| sampled_constants(&arm_box(&nominal()), &SamplingOptions::default()));

/// The box of the default scenario.
static TASK: LazyLock<(ArmBox<7>, SampledConstants)> = LazyLock::new(|| {
    let task = arm_box(&Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        rotor_inertia_kg_m2: [0.0, 0.1],
        ..nominal()
    });
    let constants = sampled_constants(&task, &SamplingOptions::default());
    (task, constants)
});

/// True maxima over all angles from a separate program (local maximisation, many starts), four digits. The search must come
/// within 1 % of them and cannot exceed them by more than their last digit; 0.5 % is allowed.
fn assert_near_truth(name: &str, found: f64, truth: f64) {
    assert!(found >= 0.99 * truth && found <= 1.005 * truth, "{name}: found {found}, true maximum {truth}");
}

#[test]
fn the_arm_with_hand_has_the_known_constants() {
    let raw = NOMINAL.raw;
    // The truth has two digits.
    assert!((raw.m_lo_kg_m2 - 0.0044).abs() <= 0.000_05, "m_lo {}", raw.m_lo_kg_m2);
    assert_near_truth("m_hi", raw.m_hi_kg_m2, 4.659);
    assert_near_truth("k_g", raw.k_g_n_m_per_rad, 69.28);
    assert_near_truth("k_c", raw.k_c_kg_m2, 2.254);
    assert_near_truth("k_r", raw.k_r, 4.962);
}

#[test]
fn rotor_inertia_shifts_the_spectrum_and_tames_the_relative_coriolis_form() {
    let raw = sampled_constants(
        &arm_box(&Ranges { rotor_inertia_kg_m2: [0.1, 0.1], ..nominal() }),
        &SamplingOptions::default(),
    )
    .raw;
    let bare = NOMINAL.raw;
    assert!((raw.m_lo_kg_m2 - bare.m_lo_kg_m2 - 0.1).abs() < 1e-6);
    assert!((raw.m_hi_kg_m2 - bare.m_hi_kg_m2 - 0.1).abs() < 1e-6);
    assert!((raw.k_g_n_m_per_rad - bare.k_g_n_m_per_rad).abs() < 1e-9);
    assert!((raw.k_c_kg_m2 - bare.k_c_kg_m2).abs() < 1e-9);
    assert_near_truth("k_r", raw.k_r, 2.39);
}

#[test]
fn a_heavy_payload_has_the_known_constants() {
    let loaded = Ranges { payload_kg: [3.0, 3.0], ..nominal() };
    let raw = sampled_constants(&arm_box(&loaded), &SamplingOptions::default()).raw;
    assert_near_truth("m_hi", raw.m_hi_kg_m2, 9.484);
    assert_near_truth("k_g", raw.k_g_n_m_per_rad, 116.9);
    assert_near_truth("k_c", raw.k_c_kg_m2, 4.66);
    assert_near_truth("k_r", raw.k_r, 6.77);
    let rotor = Ranges { rotor_inertia_kg_m2: [0.1, 0.1], ..loaded };
    let raw = sampled_constants(&arm_box(&rotor), &SamplingOptions::default()).raw;
    assert_near_truth("k_r with rotor inertia", raw.k_r, 3.45);
}

#[test]
fn gravity_torques_leave_the_known_reserve() {
    // 87 N m (joints 1 to 4) and 12 N m (5 to 7) less the reserves 87 30 56 64 8.9 9.1 12, which are rounded to the digits shown.
    let expected = [0.0, 57.0, 31.0, 23.0, 3.1, 2.9, 0.0];
    let rounding = [0.5, 0.5, 0.5, 0.5, 0.05, 0.05, 0.5];
    for joint in 0..7 {
        let found = NOMINAL.raw_gravity_torque_n_m[joint];
        assert!((found - expected[joint]).abs() <= rounding[joint], "joint {}: {found} N m", joint + 1);
    }
}

fn arm_of(task: &ArmBox<7>, at: &Attained) -> (Model<7>, Joints<7>) {
    let rotor = Joints::from_column_slice(&at.rotor_inertia_kg_m2);
    (task.model(&at.scales, &rotor).unwrap(), Joints::from_column_slice(&at.q_rad))
}

/// `½ x' (Σ_j y_j ∂M/∂q_j) x` from differences of the inertia matrix along y, fourth order.
fn coriolis_form(model: &Model<7>, q: &Joints<7>, x: &Joints<7>, y: &Joints<7>) -> f64 {
    let energy = |step: f64| 0.5 * x.dot(&(mass_matrix(model, &(q + y * step)) * x));
    let h = 1e-3;
    (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h)
}

/// Truncation of the differences: h^4 = 1e-12 times the fourth derivative (16 at most); rounding: 1e-16/1e-3.
const DIFFERENCE_RTOL: f64 = 1e-9;

#[test]
fn every_constant_is_attained_where_it_says() {
    let (task, found) = &*TASK;
    let (raw, at) = (&found.raw, &found.attained);
    let inertia = |at: &Attained| {
        let (model, q) = arm_of(task, at);
        mass_matrix(&model, &q).symmetric_eigenvalues()
    };
    // `mass_matrix` includes the rotor inertia of the model.
    assert!((inertia(&at.m_lo).min() - raw.m_lo_kg_m2).abs() <= 1e-9 * raw.m_hi_kg_m2);
    assert!((inertia(&at.m_hi).max() - raw.m_hi_kg_m2).abs() <= 1e-12 * raw.m_hi_kg_m2);

    let (model, q) = arm_of(task, &at.k_g);
    let stiffness = gravity_jacobian(&model, &q);
    assert!((stiffness.symmetric_eigenvalues().amax() - raw.k_g_n_m_per_rad).abs() <= 1e-12 * raw.k_g_n_m_per_rad);
    let by_differences = JointMatrix::<7>::from_columns(&std::array::from_fn::<_, 7, _>(|j| {
        let torque = |step: f64| gravity_torque(&model, &(q + Joints::ith(j, step)));
        (torque(1e-5) - torque(-1e-5)) / 2e-5
    }));
    assert!((stiffness - by_differences).amax() <= 1e-8 * raw.k_g_n_m_per_rad);

    for (name, value, at, relative) in [("k_c", raw.k_c_kg_m2, &at.k_c, false), ("k_r", raw.k_r, &at.k_r, true)] {
        let (model, q) = arm_of(task, at);
        let x: Joints<7> = Joints::from_column_slice(&at.direction);
        let y: Joints<7> = Joints::from_column_slice(&at.slope_direction);
        assert!((x.norm() - 1.0).abs() < 1e-12 && (y.norm() - 1.0).abs() < 1e-12, "{name}: unit directions");
        let energy = if relative { x.dot(&(mass_matrix(&model, &q) * x)) } else { 1.0 };
        let again = coriolis_form(&model, &q, &x, &y) / energy;
        assert!((again - value).abs() <= DIFFERENCE_RTOL * value, "{name}: {again} against {value}");
    }

    for (joint, at) in at.gravity_torque.iter().enumerate() {
        let (model, q) = arm_of(task, at);
        let again = gravity_torque(&model, &q)[joint].abs();
        assert!((again - found.raw_gravity_torque_n_m[joint]).abs() <= 1e-10, "joint {}", joint + 1);
    }
}

#[test]
fn an_attained_point_is_a_member_of_the_box() {
    let (task, found) = &*TASK;
    let [lower, upper] = task.rotor_inertia_kg_m2();
    let at = &found.attained;
    for attained in [&at.m_lo, &at.m_hi, &at.k_g, &at.k_c, &at.k_r].into_iter().chain(&at.gravity_torque) {
        assert!(attained.q_rad.iter().all(|angle| (-std::f64::consts::PI..std::f64::consts::PI).contains(angle)));
        for (scale, group) in attained.scales.iter().zip(task.groups()) {
            assert!((group.scale[0]..=group.scale[1]).contains(scale));
        }
        for (joint, rotor) in attained.rotor_inertia_kg_m2.iter().enumerate() {
            assert!((lower[joint]..=upper[joint]).contains(rotor));
        }
    }
}

/// Two unlike algorithms: the corner rule with a quasi-Newton climb against a pattern search over angles, masses and rotor inertia.
#[test]
fn a_search_over_every_axis_of_the_box_finds_no_worse_arm() {
    let (task, found) = &*TASK;
    let options = SearchOptions { local_starts: 6, resolution: 1e-4, ..SearchOptions::default() };
    let axes = task.axes();
    let inertia = maximise(&axes, &options, |at| {
        task.member(at).map_or(f64::NAN, |m| mass_matrix(&m.model, &m.q).symmetric_eigenvalues().max())
    })
    .unwrap();
    assert_near_truth("m_hi", inertia.value, found.raw.m_hi_kg_m2);
    let stiffness = maximise(&axes, &options, |at| {
        task.member(at).map_or(f64::NAN, |m| gravity_jacobian(&m.model, &m.q).symmetric_eigenvalues().amax())
    })
    .unwrap();
    assert_near_truth("k_g", stiffness.value, found.raw.k_g_n_m_per_rad);

    // The Coriolis forms: seven more axes for y; the direction x comes from the eigenvectors.
    let arms = axes.len();
    let more = std::iter::repeat_n(Axis::Interval { lower: -1.0, upper: 1.0 }, 7);
    let axes: Vec<Axis> = axes.into_iter().chain(more).collect();
    let forms = |at: &[f64]| {
        let member = task.member(&at[..arms]).ok()?;
        let y = Joints::<7>::from_column_slice(&at[arms..]).try_normalize(1e-3)?;
        let slopes = mass_matrix_derivatives(&member.model, &member.q);
        let along = slopes.iter().zip(&y).fold(JointMatrix::<7>::zeros(), |sum, (slope, yj)| sum + slope * (0.5 * *yj));
        Some((along, mass_matrix(&member.model, &member.q)))
    };
    let absolute =
        maximise(&axes, &options, |at| forms(at).map_or(f64::NAN, |(along, _)| along.symmetric_eigenvalues().amax()));
    assert_near_truth("k_c", absolute.unwrap().value, found.raw.k_c_kg_m2);
    let relative = maximise(&axes, &options, |at| {
        let whitened = forms(at).and_then(|(along, inertia)| {
            let inverse = inertia.cholesky()?.l().try_inverse()?;
            Some(inverse * along * inverse.transpose())
        });
        whitened.map_or(f64::NAN, |form| form.symmetric_eigenvalues().amax())
    });
    assert_near_truth("k_r", relative.unwrap().value, found.raw.k_r);
}

#[test]
fn a_larger_box_has_no_smaller_constants() {
    // Climbs from different samples may end on slightly different hills.
    const SLACK: f64 = 1e-3;
    let options = SamplingOptions::new(500, 8, 0.05).unwrap();
    let step = |mass_uncertainty: f64, payload: f64, rotor: [f64; 2]| {
        let ranges = Ranges { mass_uncertainty, payload_kg: [0.0, payload], rotor_inertia_kg_m2: rotor, ..nominal() };
        sampled_constants(&arm_box(&ranges), &options).raw
    };
    let nested = [step(0.0, 0.0, [0.05, 0.05]), step(0.1, 0.3, [0.02, 0.08]), step(0.2, 0.7, [0.0, 0.1])];
    for pair in nested.windows(2) {
        let (small, large) = (pair[0], pair[1]);
        assert!(large.m_lo_kg_m2 <= small.m_lo_kg_m2 * (1.0 + SLACK));
        assert!(large.m_hi_kg_m2 >= small.m_hi_kg_m2 * (1.0 - SLACK));
        assert!(large.k_g_n_m_per_rad >= small.k_g_n_m_per_rad * (1.0 - SLACK));
        assert!(large.k_c_kg_m2 >= small.k_c_kg_m2 * (1.0 - SLACK));
        assert!(large.k_r >= small.k_r * (1.0 - SLACK));
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads_and_through_json() {
    let task = arm_box(&Ranges { mass_uncertainty: 0.2, payload_kg: [0.0, 0.7], ..nominal() });
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sampled_constants(&task, &SamplingOptions::new(200, 4, 0.1).unwrap()))
    };
    let one = serde_json::to_string(&run(1)).unwrap();
    assert_eq!(one, serde_json::to_string(&run(3)).unwrap());
    let read: SampledConstants = serde_json::from_str(&one).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), one);
    assert_eq!((read.samples, read.local_starts, read.over.as_str()), (200, 4, "all angles"));
    assert!((read.constants.m_lo_kg_m2 * 1.1 - read.raw.m_lo_kg_m2).abs() < 1e-15);
    assert!((read.constants.k_r - 1.1 * read.raw.k_r).abs() < 1e-12);
}

mod members {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::FileFailurePersistence;

    /// Rounding of a quadratic form of order 7.
    const ROUNDING: f64 = 1e-12;

    fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = Joints<7>> {
        proptest::array::uniform7(range).prop_map(|entries| Joints::from_column_slice(&entries))
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 400,
            failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("proptest-regressions"))),
            ..ProptestConfig::default()
        })]
        #[test]
        fn every_member_obeys_the_constants_with_their_margin(
            q in vector(-3.2..3.2),
            fractions in proptest::array::uniform8(0.0..=1.0_f64),
            rotor in vector(0.0..0.1),
            x in vector(-1.0..1.0),
            y in vector(-1.0..1.0),
        ) {
            let (task, found) = &*TASK;
            let k = found.constants;
            let scales: Vec<f64> = task.groups().iter().zip(fractions)
                .map(|(group, f)| group.scale[0] + f * (group.scale[1] - group.scale[0])).collect();
            let model = task.model(&scales, &rotor).unwrap();

            let inertia = mass_matrix(&model, &q);
            let by_groups = task.groups().iter().zip(&scales)
                .fold(JointMatrix::from_diagonal(&rotor), |sum, (group, s)| sum + mass_matrix(&group.model, &q) * *s);
            prop_assert!((inertia - by_groups).amax() <= ROUNDING, "M is the sum of its groups");

            let eigenvalues = inertia.symmetric_eigenvalues();
            prop_assert!(eigenvalues.min() >= k.m_lo_kg_m2 && eigenvalues.max() <= k.m_hi_kg_m2);
            prop_assert!(gravity_jacobian(&model, &q).symmetric_eigenvalues().amax() <= k.k_g_n_m_per_rad);
            for (torque, bound) in gravity_torque(&model, &q).iter().zip(&found.gravity_torque_n_m) {
                prop_assert!(torque.abs() <= bound + ROUNDING);
            }
            let form = coriolis_form(&model, &q, &x, &y).abs();
            prop_assert!(form <= k.k_c_kg_m2 * y.norm() * x.norm_squared() + 1e-9);
            prop_assert!(form <= k.k_r * y.norm() * x.dot(&(inertia * x)) + 1e-9);
        }
    }
}
