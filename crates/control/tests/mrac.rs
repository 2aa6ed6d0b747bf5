//! Laws of the adaptive controllers beyond their equations: starts, reference, where the three differ and where they may not.
#![expect(clippy::unwrap_used, reason = "the gains are constants; a failure is a failed test")]

use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams};
use certune_control::{Controller, Measurement};
use certune_linsys::Joints;

const GAINS: MracGains<2> = MracGains {
    law: MracLaw::ReferenceModel,
    omega_rad_per_s: [2.0, 3.0],
    zeta: [1.0, 1.0],
    l1: [1.0, 1.0],
    l2: [1.0, 1.0],
    alpha: [[40.0, 200.0], [4.0, 4.0], [0.0, 0.0]],
    e0: [[20.0, 40.0], [2.0, 4.0], [0.0, 0.0]],
    e1: [[10.0, 20.0], [1.0, 2.0], [0.0, 0.0]],
    f0: [[10.0, 10.0], [1.0, 1.0], [0.0, 0.0]],
    f1: [[1.0, 1.0], [1.0, 1.0], [0.0, 0.0]],
};

fn mrac(law: MracLaw) -> Mrac<2> {
    Mrac::new(&MracParams::new(&MracGains { law, ..GAINS }, 1e-3).unwrap())
}

fn at_rest(q: Joints<2>) -> Measurement<2> {
    Measurement { q, dq: Joints::<2>::zeros() }
}

#[test]
fn at_rest_in_the_goal_nothing_moves_and_no_torque_is_asked() {
    let goal = Joints::<2>::new(0.4, -1.1);
    for law in MracLaw::ALL {
        let controller = mrac(law);
        let mut state = controller.start(&at_rest(goal));
        for _ in 0..5 {
            let (next, u) = controller.step(&state, &at_rest(goal), &goal);
            assert_eq!(u, Joints::<2>::zeros(), "{law}");
            assert_eq!((next.q_ref, next.dq_ref, next.integral), (state.q_ref, state.dq_ref, state.integral), "{law}");
            state = next;
        }
    }
}

#[test]
fn the_reference_model_starts_at_the_measurement_and_reaches_the_goal_without_overshoot() {
    let controller = mrac(MracLaw::ReferenceModel);
    let (from, goal) = (Joints::<2>::new(0.2, 0.3), Joints::<2>::new(1.2, -0.7));
    let mut at = at_rest(from);
    at.dq[0] = 0.5;
    let mut state = controller.start(&at);
    // A measured velocity does not enter the reference; the first step sees it in the error alone.
    assert_eq!((state.q_ref, state.dq_ref), (from, Joints::<2>::zeros()));
    for step in 1..=8000 {
        state = controller.step(&state, &at, &goal).0;
        for i in 0..2 {
            let (t, w) = (f64::from(step) * 1e-3, GAINS.omega_rad_per_s[i]);
            let fraction = (state.q_ref[i] - from[i]) / (goal[i] - from[i]);
            let exact = 1.0 - (1.0 + w * t) * (-w * t).exp();
            assert!((fraction - exact).abs() < 2e-3, "joint {i} at {t} s: {fraction}, exactly {exact}");
            assert!(fraction <= 1.0);
        }
    }
}

#[test]
fn the_first_step_of_both_raw_goal_laws_differs_by_the_sum_of_k1_alone() {
    let goal = Joints::<2>::new(1.0, 0.5);
    let mut at = at_rest(Joints::<2>::new(0.1, -0.2));
    let first = |law: MracLaw, at: &Measurement<2>| {
        let controller = mrac(law);
        controller.step(&controller.start(at), at, &goal).1
    };
    // At rest K1 meets a zero velocity.
    assert_eq!(first(MracLaw::RawGoal, &at), first(MracLaw::ReleasedCode, &at));
    at.dq = Joints::<2>::new(0.3, 0.0);
    let q_e = mrac(MracLaw::RawGoal).signals(&mrac(MracLaw::RawGoal).start(&at), &at, &goal).q_e;
    let difference = first(MracLaw::ReleasedCode, &at) - first(MracLaw::RawGoal, &at);
    for i in 0..2 {
        let expected = GAINS.e1[1][i] * q_e[i] * at.q.dot(&at.dq);
        assert!((difference[i] - expected).abs() < 1e-12);
    }
}

#[test]
fn the_adaptive_gains_shown_are_those_that_made_the_torque() {
    let goal = Joints::<2>::new(1.0, 0.5);
    for law in MracLaw::ALL {
        let controller = mrac(law);
        let mut at = at_rest(Joints::<2>::new(0.1, -0.2));
        let mut state = controller.start(&at);
        for _ in 0..50 {
            at.dq += Joints::<2>::new(0.01, -0.02);
            at.q += at.dq * 1e-3;
            let gains = controller.adaptive_gains(&state, &at, &goal);
            let seen = controller.signals(&state, &at, &goal);
            let (next, u) = controller.step(&state, &at, &goal);
            let rebuilt = gains.K0 * at.q + gains.K1 * at.dq + gains.Q0 * seen.q_ref + gains.Q1 * seen.dq_ref + gains.f;
            assert!((u - rebuilt).amax() <= 1e-12 * u.amax().max(1.0), "{law}");
            state = next;
        }
    }
}
