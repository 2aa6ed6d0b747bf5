//! Contract: a limited goal never moves faster than allowed, keeps to the straight line, arrives to the bit, and no input moves it astray.

use certune_control::{GoalRateLimiter, ParamError};
use certune_linsys::Joints;
use proptest::prelude::*;

fn pose(range: f64) -> impl Strategy<Value = Joints<7>> {
    prop::array::uniform7(-range..range).prop_map(Joints::from)
}

#[test]
fn speeds_and_steps_that_are_none_are_refused() {
    for bad in [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, 1e-322] {
        assert!(matches!(
            GoalRateLimiter::new(bad, 1e-3),
            Err(ParamError::Shared { parameter: "goal_speed_rad_per_s", .. })
        ));
        if bad.is_nan() || bad <= 0.0 || bad.is_infinite() {
            assert!(matches!(GoalRateLimiter::new(0.1, bad), Err(ParamError::Shared { parameter: "step_s", .. })));
        }
    }
}

#[test]
fn a_goal_that_is_no_number_holds_the_goal_where_it_is() {
    let limiter = GoalRateLimiter::new(0.3, 1e-3).unwrap();
    let at = Joints::<3>::new(0.1, -0.2, 0.3);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
        for joint in 0..3 {
            let mut goal = Joints::<3>::new(1.0, 2.0, 3.0);
            goal[joint] = bad;
            assert_eq!(limiter.step(&at, &goal), at, "{bad} in joint {joint}");
        }
    }
    assert_ne!(limiter.step(&at, &Joints::<3>::new(1.0, 2.0, 3.0)), at);
}

proptest! {
    #[test]
    fn never_faster_always_straight_and_exact_at_the_end(
        start in pose(3.0), goals in prop::collection::vec(pose(3.0), 1..4), speed in 0.05..20.0_f64,
    ) {
        let step_s = 1e-3;
        let limiter = GoalRateLimiter::new(speed, step_s).unwrap();
        let mut at = start;
        for goal in goals {
            let (from, length) = (at, (goal - at).norm());
            let most = (length / (speed * step_s)).ceil() as usize + 1;
            let mut samples = 0;
            while at != goal {
                let next = limiter.step(&at, &goal);
                prop_assert!((next - at).norm() <= speed * step_s);
                // Off the line by the roundings of some 1e5 steps at most.
                let along = (next - from).dot(&(goal - from)) / (length * length);
                prop_assert!((next - from - (goal - from) * along).norm() < 1e-10);
                prop_assert!((0.0..=1.0 + 1e-12).contains(&along));
                at = next;
                samples += 1;
                prop_assert!(samples <= most, "{samples} samples for {length} rad at {speed} rad/s");
            }
            prop_assert_eq!(limiter.step(&at, &goal), goal, "it stays");
        }
    }

    #[test]
    fn any_numbers_at_all_keep_a_finite_goal_finite(
        at in pose(1e3), goal in prop::array::uniform7(any::<f64>()), speed in 1e-6..1e3_f64,
    ) {
        let limiter = GoalRateLimiter::new(speed, 1e-3).unwrap();
        let next = limiter.step(&at, &Joints::from(goal));
        prop_assert!(next.iter().all(|x| x.is_finite()));
    }
}
