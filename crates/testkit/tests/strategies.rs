//! Contract: what a strategy draws is valid, the ends of its ranges are drawn, and a failure shrinks to the simplest arm that fails.
#![expect(clippy::float_cmp, reason = "the ends of a range are met to the bit")]

use std::f64::consts::PI;
use std::fmt::Debug;

use certune_closed_loop::PlantSetting;
use certune_control::aic::AicParams;
use certune_dynamics::{JointLimits, Model, Payload, Robot, mass_matrix};
use certune_testkit::{
    AicRanges, FASTEST_RAD_PER_S, PANDA_PAYLOAD_KG, PUBLISHED, PlantRanges, aic_gains, configuration,
    configuration_within, joint_state, joints_within, link_scales, log_within, panda_with_masses, payload,
    plant_numbers, serial_arm, shared_aic_gains, within,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Draws enough that an event of probability 1/12 is missed once in 1e15 times; the runner is seeded, so no run differs from another.
const DRAWS: usize = 400;

fn draws<S: Strategy>(strategy: &S) -> Vec<S::Value> {
    let mut runner = TestRunner::deterministic();
    let tree = |_| strategy.new_tree(&mut runner).expect("a draw").current();
    (0..DRAWS).map(tree).collect()
}

/// The value left when everything fails.
fn simplest<S: Strategy>(strategy: &S) -> S::Value {
    smallest_failure(strategy, |_| true)
}

/// The value to which proptest shrinks the first draw that fails.
fn smallest_failure<S: Strategy>(strategy: &S, fails: impl Fn(&S::Value) -> bool) -> S::Value {
    let mut runner = TestRunner::deterministic();
    let mut tree = strategy.new_tree(&mut runner).expect("a draw");
    while !fails(&tree.current()) {
        tree = strategy.new_tree(&mut runner).expect("a draw");
    }
    let mut smallest = tree.current();
    let mut steps = 0;
    let mut more = tree.simplify();
    while more && steps < 100_000 {
        steps += 1;
        more = if fails(&tree.current()) {
            smallest = tree.current();
            tree.simplify()
        } else {
            tree.complicate()
        };
    }
    smallest
}

/// Equal to the resolution of a draw.
fn assert_near(value: f64, expected: f64) {
    assert!((value - expected).abs() <= 1e-6 * (1.0 + expected.abs()), "{value}, expected {expected}");
}

/// Both ends are met exactly, often, and each quarter between them too.
fn assert_covers(values: &[f64], low: f64, high: f64, coordinate: fn(f64) -> f64) {
    let count = |holds: &dyn Fn(f64) -> bool| values.iter().filter(|x| holds(**x)).count();
    assert!(values.iter().all(|x| (low..=high).contains(x)));
    assert!(count(&|x| x == low) > values.len() / 25, "{low} drawn {} times", count(&|x| x == low));
    assert!(count(&|x| x == high) > values.len() / 25, "{high} drawn {} times", count(&|x| x == high));
    for quarter in 0..4 {
        let part = |x| 4.0 * (coordinate(x) - coordinate(low)) / (coordinate(high) - coordinate(low));
        let inside = count(&|x| x > low && x < high && (part(x) as usize) == quarter);
        assert!(inside > values.len() / 10, "quarter {quarter}: {inside}");
    }
}

#[test]
fn a_range_is_covered_from_end_to_end() {
    assert_covers(&draws(&within(0.8..=1.2, 1.0)), 0.8, 1.2, |x| x);
    assert_covers(&draws(&within(-3.0..=-1.0, 0.0)), -3.0, -1.0, |x| x);
    assert_covers(&draws(&log_within(50.0..=20_000.0, 700.0)), 50.0, 20_000.0, f64::ln);
    assert_eq!(draws(&within(0.3..=0.3, 0.0)), [0.3; DRAWS]);
    assert_eq!(draws(&log_within(7.0..=7.0, 1.0)), [7.0; DRAWS]);
}

#[test]
fn a_number_shrinks_to_the_simplest_or_what_is_nearest_to_it() {
    assert_eq!(simplest(&within(0.8..=1.2, 1.0)), 1.0);
    assert_eq!(simplest(&within(1.1..=1.3, 1.0)), 1.1);
    assert_eq!(simplest(&within(-3.0..=-1.0, 0.0)), -1.0);
    assert_eq!(simplest(&log_within(50.0..=20_000.0, 700.0)), 700.0);
    assert_eq!(simplest(&log_within(1e3..=1e4, 700.0)), 1e3);
    // Not further than the failure allows, and not stuck at the end where it was found.
    assert_near(smallest_failure(&within(0.8..=1.2, 1.0), |x| *x >= 1.15), 1.15);
    assert_near(smallest_failure(&within(0.8..=1.2, 1.0), |x| *x == 0.8), 0.8);
}

fn refused<T: Debug>(make: impl FnOnce() -> T + std::panic::UnwindSafe) {
    assert!(std::panic::catch_unwind(make).is_err());
}

#[test]
fn what_is_no_range_is_refused_when_the_strategy_is_made() {
    refused(|| draws(&within(1.0..=0.0, 0.0)));
    refused(|| draws(&within(0.0..=f64::NAN, 0.0)));
    refused(|| draws(&within(0.0..=f64::INFINITY, 0.0)));
    refused(|| draws(&within(0.0..=1.0, f64::NAN)));
    refused(|| draws(&log_within(0.0..=1.0, 1.0)));
    refused(|| draws(&log_within(1.0..=2.0, 0.0)));
    refused(|| draws(&link_scales::<7>(-0.1..=1.0)));
    refused(|| draws(&payload(-1.0..=1.0)));
    refused(|| draws(&configuration_within::<6>(&Robot::panda())));
    refused(|| draws(&serial_arm::<0>()));
}

#[test]
fn configurations_meet_every_limit_of_the_panda_and_the_whole_torus() {
    let robot = Robot::panda();
    let inside = draws(&configuration_within::<7>(&robot));
    let anywhere = draws(&configuration::<7>());
    for (joint, link) in robot.links().iter().enumerate() {
        let JointLimits { lower_rad, upper_rad, .. } = link.limits;
        assert_covers(&inside.iter().map(|q| q[joint]).collect::<Vec<_>>(), lower_rad, upper_rad, |x| x);
        assert_covers(&anywhere.iter().map(|q| q[joint]).collect::<Vec<_>>(), -PI, PI, |x| x);
    }
    // The zero pose violates joint 4 of the Panda, and only that one.
    let q = simplest(&configuration_within::<7>(&robot));
    assert_near(q[3], robot.links()[3].limits.upper_rad);
    assert!((0..7).all(|joint| joint == 3 || q[joint].abs() < 1e-9), "{q}");
}

#[test]
fn joints_with_one_end_stop_or_none_are_drawn_over_a_turn() {
    let robot = Robot::panda();
    let mut links = robot.links().to_vec();
    links[0].limits.lower_rad = f64::NEG_INFINITY;
    links[1].limits.upper_rad = f64::INFINITY;
    links[2].limits = JointLimits::NONE;
    let robot = Robot::new("open", robot.gravity_m_per_s2(), links).unwrap();
    let drawn = draws(&configuration_within::<7>(&robot));
    let limits = |joint: usize| robot.links()[joint].limits;
    let (upper, lower) = (limits(0).upper_rad, limits(1).lower_rad);
    for (joint, low, high) in [(0, upper - 2.0 * PI, upper), (1, lower, lower + 2.0 * PI), (2, -PI, PI)] {
        assert_covers(&drawn.iter().map(|q| q[joint]).collect::<Vec<_>>(), low, high, |x| x);
    }
}

#[test]
fn states_move_either_way_and_shrink_to_rest() {
    let drawn = draws(&joint_state::<3>());
    let fastest = FASTEST_RAD_PER_S;
    assert_covers(&drawn.iter().map(|at| at.dq[2]).collect::<Vec<_>>(), -fastest, fastest, |x| x);
    let at = simplest(&joint_state::<3>());
    assert!(at.q.amax() < 1e-9 && at.dq.amax() < 1e-9, "{at:?}");
    assert_covers(&draws(&joints_within::<2>(5.0)).iter().map(|tau| tau[0]).collect::<Vec<_>>(), -5.0, 5.0, |x| x);
}

#[test]
fn link_scales_reach_the_lightest_and_the_heaviest_arm_link_by_link() {
    let drawn = draws(&link_scales::<7>(0.8..=1.2));
    for link in 0..7 {
        assert_covers(&drawn.iter().map(|scales| scales[link]).collect::<Vec<_>>(), 0.8, 1.2, |x| x);
    }
    assert!(simplest(&link_scales::<7>(0.8..=1.2)).iter().all(|scale| (scale - 1.0).abs() < 1e-9));
}

#[test]
fn a_panda_weighs_what_was_asked_for_and_shrinks_to_the_one_described() {
    let described = Model::<7>::new(&Robot::panda()).unwrap();
    let masses = described.link_masses_kg();
    let strategy = panda_with_masses(0.8..=1.2);
    let drawn = draws(&strategy);
    let ratio: Vec<f64> = drawn.iter().map(|panda| panda.link_masses_kg()[1] / masses[1]).collect();
    assert!(ratio.iter().all(|x| (0.8 - 1e-12..=1.2 + 1e-12).contains(x)));
    let tip: Vec<f64> = drawn.iter().map(|panda| panda.link_masses_kg()[6]).collect();
    assert!(tip.iter().any(|mass| (mass - 0.8 * masses[6]).abs() < 0.05));
    assert!(tip.iter().any(|mass| (mass - 1.2 * masses[6] - PANDA_PAYLOAD_KG).abs() < 0.05));
    let smallest = simplest(&strategy).link_masses_kg();
    assert!(smallest.iter().zip(masses).all(|(a, b)| (a - b).abs() < 1e-9), "{smallest:?}");
    // Only what makes the arm fail stays: here a heavy link 2.
    let heavy = |panda: &Model<7>| panda.link_masses_kg()[1] > 1.1 * masses[1];
    let smallest = smallest_failure(&strategy, heavy).link_masses_kg();
    assert_near(smallest[1], 1.1 * masses[1]);
    assert!((0..7).all(|link| link == 1 || (smallest[link] - masses[link]).abs() < 1e-9), "{smallest:?}");
}

#[test]
fn the_default_ranges_of_gains_are_those_of_the_shipped_search_space() {
    let space: toml::Table = toml::from_str(include_str!("../../../tuning/spaces/panda-aic.toml")).unwrap();
    let AicRanges { kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s } =
        AicRanges::default();
    let free = [
        ("kappa_mu", kappa_mu),
        ("kappa_a", kappa_a),
        ("sigma_dq", sigma_dq),
        ("sigma_mu", sigma_mu),
        ("sigma_dmu", sigma_dmu),
    ];
    assert_eq!(space["gains"].as_table().unwrap().len(), free.len());
    for (gain, range) in free {
        let row = &space["gains"][gain];
        let (lower, upper) = (row["lower"].as_float().unwrap(), row["upper"].as_float().unwrap());
        assert_eq!((lower, upper), (*range.start(), *range.end()), "{gain}");
    }
    for (gain, range) in [("sigma_q", sigma_q), ("reference_time_constant_s", reference_time_constant_s)] {
        let fixed = space["fixed"][gain].as_float().unwrap();
        assert_eq!((fixed, fixed), (*range.start(), *range.end()), "{gain}");
    }
}

#[test]
fn gains_cover_their_ranges_and_shrink_to_the_published_ones() {
    let ranges = AicRanges::default();
    let drawn = draws(&aic_gains::<3>(&ranges));
    assert_covers(&drawn.iter().map(|gains| gains.kappa_a[2]).collect::<Vec<_>>(), 50.0, 20_000.0, f64::ln);
    assert_covers(&drawn.iter().map(|gains| gains.sigma_dmu[0]).collect::<Vec<_>>(), 0.5, 100.0, f64::ln);
    assert!(drawn.iter().any(|gains| gains.shared().is_none()));
    assert!(draws(&shared_aic_gains::<3>(&ranges)).iter().all(|gains| gains.shared().is_some()));
    let smallest = simplest(&aic_gains::<2>(&ranges));
    for (gain, published) in [
        (smallest.kappa_mu, PUBLISHED.kappa_mu),
        (smallest.kappa_a, PUBLISHED.kappa_a),
        (smallest.sigma_q, PUBLISHED.sigma_q),
        (smallest.sigma_dq, PUBLISHED.sigma_dq),
        (smallest.sigma_mu, PUBLISHED.sigma_mu),
        (smallest.sigma_dmu, PUBLISHED.sigma_dmu),
    ] {
        assert_near(gain[0], published[0]);
        assert_near(gain[1], published[0]);
    }
}

#[test]
fn a_serial_arm_shrinks_to_cubes_on_one_axis() {
    let robot = simplest(&serial_arm::<2>());
    for link in robot.links() {
        assert!(link.frame.position().amax() < 1e-9 && link.limits == JointLimits::NONE, "{link:?}");
        assert!((link.frame.rotation_matrix() - nalgebra::Matrix3::identity()).amax() < 1e-9);
        assert_near(link.inertia.mass_kg, 1.0);
        assert!(link.inertia.principal_moments_kg_m2().iter().all(|moment| (moment - 1.0 / 600.0).abs() < 1e-9));
    }
}

#[test]
fn serial_arms_are_of_many_kinds() {
    let drawn = draws(&serial_arm::<2>());
    let count = |holds: fn(&Robot) -> bool| drawn.iter().filter(|robot| holds(robot)).count();
    let quarter = |robot: &Robot| {
        robot.links()[1].frame.rotation.iter().flatten().all(|entry| entry.abs() == 0.0 || entry.abs() == 1.0)
    };
    for (kind, some) in [
        ("with quarter turns", count(quarter)),
        ("with limits", count(|robot| robot.links()[0].limits != JointLimits::NONE)),
        ("that cannot reach 0", count(|robot| robot.links()[0].limits.lower_rad > 0.0)),
        ("with rotors", count(|robot| robot.links()[0].rotor_inertia_kg_m2 > 0.0)),
        ("without friction", count(|robot| robot.links()[0].viscous_n_m_s_per_rad == 0.0)),
        ("lighter at the base", count(|robot| robot.links()[0].inertia.mass_kg < robot.links()[1].inertia.mass_kg)),
    ] {
        assert!(some > DRAWS / 20 && some < DRAWS - DRAWS / 20, "{some} arms {kind}");
    }
}

proptest! {
    #[test]
    fn every_serial_arm_is_accepted_with_a_positive_definite_inertia(robot in serial_arm::<5>(), q in configuration::<5>()) {
        Robot::new(robot.name(), robot.gravity_m_per_s2(), robot.links().to_vec())?;
        let mass = mass_matrix(&Model::<5>::new(&robot)?, &q);
        prop_assert_eq!(mass, mass.transpose());
        prop_assert!(mass.cholesky().is_some());
    }

    #[test]
    fn every_configuration_within_a_random_arm_is_within(
        (robot, q) in serial_arm::<4>().prop_flat_map(|robot| { let q = configuration_within::<4>(&robot); (Just(robot), q) })
    ) {
        for (link, q) in robot.links().iter().zip(&q) {
            prop_assert!((link.limits.lower_rad..=link.limits.upper_rad).contains(q));
        }
    }

    #[test]
    fn every_payload_is_a_body_or_an_empty_hand(held in payload(0.0..=3.0)) {
        prop_assert_eq!(Payload::new(held.mass_kg, held.com_m, held.about_com_kg_m2)?, held);
        let [least, ..] = held.inertia().principal_moments_kg_m2();
        prop_assert_eq!(held.mass_kg > 0.0, least > 0.0);
    }

    #[test]
    fn every_draw_of_gains_makes_a_controller(gains in aic_gains::<7>(&AicRanges::default())) {
        AicParams::new(&gains, 1e-3)?;
    }

    #[test]
    fn plant_numbers_are_the_plant_that_a_simulation_makes_of_them(numbers in plant_numbers::<7>(&PlantRanges {
        coulomb_n_m: 0.0..=1.0,
        delay_samples: 0..=3,
        ..PlantRanges::pick_and_place()
    })) {
        let robot = Robot::panda();
        let setting = PlantSetting {
            link_mass_scale: numbers.link_mass_scale.to_vec(),
            payload_kg: numbers.payload_kg,
            viscous_n_m_s_per_rad: numbers.viscous_n_m_s_per_rad.to_vec(),
            coulomb_n_m: numbers.coulomb_n_m.to_vec(),
            rotor_inertia_kg_m2: numbers.rotor_inertia_kg_m2.to_vec(),
            delay_samples: numbers.delay_samples,
            gravity_compensation: true,
        };
        prop_assert_eq!(numbers.model(&robot)?, setting.model::<7>(&robot)?);
        prop_assert!(numbers.delay_samples <= 3);
    }
}
