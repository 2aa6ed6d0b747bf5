//! Laws of the active inference controller: what its equations promise, tried on random gains, states and goals.
#![expect(clippy::unwrap_used, reason = "a strategy draws only valid gains; a failure is a failed test")]

use certune_control::aic::{Aic, AicGains, AicParams, AicState};
use certune_control::{Controller, Measurement};
use certune_linsys::Joints;
use proptest::prelude::*;

const N: usize = 3;
const STEP_S: f64 = 1e-3;
/// Some forty roundings of sums and products in one step, none of which cancels by more than the terms it adds.
const STEP_RTOL: f64 = 100.0 * f64::EPSILON;

fn joints(scale: f64) -> impl Strategy<Value = Joints<N>> {
    prop::array::uniform3(-scale..scale).prop_map(Joints::<N>::from)
}

/// Positive numbers over `decades` powers of ten around `centre`.
fn around(centre: f64, decades: f64) -> impl Strategy<Value = [f64; N]> {
    prop::array::uniform3(-0.5 * decades..0.5 * decades).prop_map(move |x| x.map(|x| centre * 10f64.powf(x)))
}

fn gains() -> impl Strategy<Value = AicGains<N>> {
    let sigmas = (around(1.0, 2.0), around(1.0, 2.0), around(5.0, 2.0), around(10.0, 2.0));
    (around(12.0, 2.0), around(500.0, 2.0), sigmas, around(1.0, 1.0)).prop_map(
        |(kappa_mu, kappa_a, (sigma_q, sigma_dq, sigma_mu, sigma_dmu), reference_time_constant_s)| AicGains {
            kappa_mu,
            kappa_a,
            sigma_q,
            sigma_dq,
            sigma_mu,
            sigma_dmu,
            reference_time_constant_s,
        },
    )
}

fn state() -> impl Strategy<Value = AicState<N>> {
    (joints(3.0), joints(2.0), joints(5.0), joints(60.0)).prop_map(|(mu, dmu, ddmu, u)| AicState { mu, dmu, ddmu, u })
}

fn measurement() -> impl Strategy<Value = Measurement<N>> {
    (joints(3.0), joints(2.0)).prop_map(|(q, dq)| Measurement { q, dq })
}

fn params(gains: &AicGains<N>) -> AicParams<N> {
    AicParams::new(gains, STEP_S).unwrap()
}

fn controller(gains: &AicGains<N>) -> Aic<N> {
    Aic::new(&params(gains))
}

/// Every number of the state, joint by joint.
fn numbers(state: &AicState<N>) -> impl Iterator<Item = f64> {
    [state.mu, state.dmu, state.ddmu, state.u].into_iter().flat_map(|x| x.iter().copied().collect::<Vec<_>>())
}

fn scaled(gains: &AicGains<N>, by: f64) -> AicGains<N> {
    let times = |x: [f64; N]| x.map(|x| x * by);
    AicGains {
        kappa_mu: times(gains.kappa_mu),
        kappa_a: times(gains.kappa_a),
        sigma_q: times(gains.sigma_q),
        sigma_dq: times(gains.sigma_dq),
        sigma_mu: times(gains.sigma_mu),
        sigma_dmu: times(gains.sigma_dmu),
        reference_time_constant_s: gains.reference_time_constant_s,
    }
}

proptest! {
    #[test]
    fn at_rest_in_the_goal_any_torque_is_kept(gains in gains(), goal in joints(3.0), u in joints(80.0)) {
        let rest = AicState { mu: goal, dmu: Joints::<N>::zeros(), ddmu: Joints::<N>::zeros(), u };
        let (next, torque) = controller(&gains).step(&rest, &Measurement { q: goal, dq: rest.dmu }, &goal);
        prop_assert_eq!(next, rest);
        prop_assert_eq!(torque, u);
    }

    #[test]
    fn a_run_starts_from_the_measurement_without_torque(gains in gains(), at in measurement()) {
        let start = controller(&gains).start(&at);
        let zeros = Joints::<N>::zeros();
        prop_assert_eq!(start, AicState { mu: at.q, dmu: at.dq, ddmu: zeros, u: zeros });
    }

    #[test]
    fn the_free_energy_is_zero_only_where_everything_agrees(
        gains in gains(), state in state(), at in measurement(), goal in joints(3.0),
    ) {
        let aic = controller(&gains);
        prop_assert!(aic.free_energy(&state, &at, &goal) > 0.0);
        let agreed = AicState { mu: goal, dmu: Joints::<N>::zeros(), ddmu: Joints::<N>::zeros(), u: state.u };
        let at_goal = aic.free_energy(&agreed, &Measurement { q: goal, dq: agreed.dmu }, &goal);
        prop_assert_eq!(at_goal.to_bits(), 0.0_f64.to_bits());
    }

    /// F is quadratic, so a central difference of any width is its derivative up to rounding.
    #[test]
    fn the_gradient_is_the_slope_of_the_free_energy(
        gains in gains(), state in state(), at in measurement(), goal in joints(3.0),
        along in (joints(1.0), joints(1.0), joints(1.0)),
    ) {
        let aic = controller(&gains);
        let gradient = aic.free_energy_gradient(&state, &at, &goal);
        let slope = gradient.mu.dot(&along.0) + gradient.dmu.dot(&along.1) + gradient.ddmu.dot(&along.2);
        let moved = |by: f64| AicState {
            mu: state.mu + along.0 * by,
            dmu: state.dmu + along.1 * by,
            ddmu: state.ddmu + along.2 * by,
            u: state.u,
        };
        let [ahead, behind] = [1.0, -1.0].map(|by| aic.free_energy(&moved(by), &at, &goal));
        prop_assert!((0.5 * (ahead - behind) - slope).abs() <= STEP_RTOL * (ahead + behind));
    }

    /// The belief dynamics are a shift (mu, mu', mu'') -> (mu', mu'', 0) plus a descent. The descent alone lowers F as long as it is shorter than
    /// 2/L, L the largest curvature; the trace of the Hessian bounds L. (With the shift F may rise: the beliefs move.)
    #[test]
    fn the_descent_part_of_a_belief_step_lowers_the_free_energy(
        gains in gains(), state in state(), at in measurement(), goal in joints(3.0), fraction in 0.01..1.0_f64,
    ) {
        let aic = controller(&gains);
        let curvature = (0..N).map(|i| {
            let rate = gains.reference_time_constant_s[i].recip();
            let models = gains.sigma_mu[i].recip() + gains.sigma_dmu[i].recip();
            gains.sigma_q[i].recip() + gains.sigma_dq[i].recip() + models * (1.0 + rate * rate)
        }).fold(0.0, f64::max);
        let gradient = aic.free_energy_gradient(&state, &at, &goal);
        let length = fraction / curvature;
        let moved = AicState {
            mu: state.mu - gradient.mu * length,
            dmu: state.dmu - gradient.dmu * length,
            ddmu: state.ddmu - gradient.ddmu * length,
            u: state.u,
        };
        let before = aic.free_energy(&state, &at, &goal);
        let squared = gradient.mu.norm_squared() + gradient.dmu.norm_squared() + gradient.ddmu.norm_squared();
        // The descent lemma: the drop is at least length (1 - length L / 2) |grad|^2.
        let drop = before - aic.free_energy(&moved, &at, &goal);
        prop_assert!(drop >= 0.5 * length * squared - STEP_RTOL * before);
    }

    /// What the step adds to the beliefs is the shift minus kappa_mu times the gradient.
    #[test]
    fn a_belief_step_is_the_shift_and_the_descent(
        gains in gains(), state in state(), at in measurement(), goal in joints(3.0),
    ) {
        let aic = controller(&gains);
        let gradient = aic.free_energy_gradient(&state, &at, &goal);
        let (next, _) = aic.step(&state, &at, &goal);
        for i in 0..N {
            let expected = [
                state.mu[i] + STEP_S * (state.dmu[i] - gains.kappa_mu[i] * gradient.mu[i]),
                state.dmu[i] + STEP_S * (state.ddmu[i] - gains.kappa_mu[i] * gradient.dmu[i]),
                state.ddmu[i] - STEP_S * gains.kappa_mu[i] * gradient.ddmu[i],
            ];
            for (is, should) in [next.mu[i], next.dmu[i], next.ddmu[i]].into_iter().zip(expected) {
                prop_assert!((is - should).abs() <= STEP_RTOL * (1.0 + should.abs()));
            }
        }
    }

    /// Six gains are five degrees of freedom: F falls by the factor by which the learning rates rise.
    #[test]
    fn a_common_factor_of_learning_rates_and_variances_changes_nothing(
        gains in gains(), start in state(), at in measurement(), goal in joints(3.0), exponent in -8..=8_i32, factor in 0.1..10.0_f64,
    ) {
        let reference = controller(&gains).step(&start, &at, &goal).0;
        // A power of two changes no mantissa, so nothing changes at all.
        let exact = controller(&scaled(&gains, 2f64.powi(exponent))).step(&start, &at, &goal).0;
        prop_assert_eq!(exact, reference);
        let rounded = controller(&scaled(&gains, factor)).step(&start, &at, &goal).0;
        let travel: f64 = numbers(&reference).zip(numbers(&start)).map(|(to, from)| (to - from).abs()).sum();
        for (is, should) in numbers(&rounded).zip(numbers(&reference)) {
            prop_assert!((is - should).abs() <= STEP_RTOL * (should.abs() + travel + 1.0));
        }
    }

    #[test]
    fn the_sampled_linear_map_is_the_step(
        gains in gains(), state in state(), at in measurement(), goal in joints(3.0), offset in joints(50.0),
    ) {
        let params = params(&gains);
        let (next, torque) = Aic::new(&params).step(&state, &at, &goal);
        prop_assert_eq!(torque, next.u);
        for i in 0..N {
            let map = params.sampled_joint(i);
            let x = nalgebra::vector![state.mu[i] - goal[i], state.dmu[i], state.ddmu[i], state.u[i] - offset[i]];
            let y = nalgebra::vector![at.q[i] - goal[i], at.dq[i]];
            let mapped = map.F * x + map.G * y;
            let stepped = [next.mu[i] - goal[i], next.dmu[i], next.ddmu[i], next.u[i] - offset[i]];
            let scale = map.F.abs() * x.abs() + map.G.abs() * y.abs();
            for row in 0..4 {
                let tolerance = STEP_RTOL * (scale[row] + goal[i].abs() + offset[i].abs());
                prop_assert!((mapped[row] - stepped[row]).abs() <= tolerance, "row {row}: {} {}", mapped[row], stepped[row]);
            }
        }
    }

    /// The sampled map is the Euler step of the continuous one, but for the torque's new beliefs, which are of second order in h.
    #[test]
    fn the_continuous_system_is_the_limit_of_the_sampled_one(
        gains in gains(), z in prop::array::uniform5(-1.0..1.0_f64), dq in -2.0..2.0_f64,
    ) {
        for i in 0..N {
            let system = params(&gains).continuous_joint(i);
            let z = nalgebra::Vector5::from(z);
            let rate = system.A * z + system.b * dq;
            prop_assert!((rate[0] - dq).abs() <= f64::EPSILON);
            // The difference between the quotient and the rate shrinks with h.
            let error = |step_s: f64| {
                let map = AicParams::new(&gains, step_s).unwrap().sampled_joint(i);
                let x = z.fixed_rows::<4>(1).into_owned();
                let quotient = (map.F * x + map.G * nalgebra::vector![z[0], dq] - x) / step_s;
                (quotient - rate.fixed_rows::<4>(1)).amax()
            };
            let scale = system.A.amax() * (1.0 + system.A.amax());
            prop_assert!(error(1e-6) <= 1e-4 * scale);
            prop_assert!(error(1e-8) <= 1e-6 * scale);
        }
    }

    /// z = 0 is the only equilibrium with dq = 0 and the torque stationary: A has rank 4 there, its null vector being the torque.
    #[test]
    fn only_the_torque_is_free_at_rest(gains in gains()) {
        for i in 0..N {
            let system = params(&gains).continuous_joint(i);
            prop_assert!(system.A.column(4).iter().all(|entry| entry.to_bits() == 0));
            let rows = system.A.fixed_view::<4, 4>(1, 0).into_owned();
            // Scaled row by row: the gains span decades.
            let scaled = nalgebra::Matrix4::from_fn(|r, c| rows[(r, c)] / rows.row(r).amax());
            prop_assert!(scaled.determinant().abs() > 1e-9);
        }
    }
}

/// The paper's own numbers at T = 1 s: the lines of the released code, worked by hand for one joint.
#[test]
fn one_step_of_the_published_gains_worked_by_hand() {
    let gains = AicGains {
        kappa_mu: [10.0],
        kappa_a: [100.0],
        sigma_q: [1.0],
        sigma_dq: [2.0],
        sigma_mu: [5.0],
        sigma_dmu: [10.0],
        reference_time_constant_s: [1.0],
    };
    let aic = Aic::<1>::new(&AicParams::new(&gains, 0.01).unwrap());
    let one = Joints::<1>::new;
    let state = AicState { mu: one(1.0), dmu: one(2.0), ddmu: one(3.0), u: one(4.0) };
    let (next, u) = aic.step(&state, &Measurement { q: one(1.5), dq: one(1.0) }, &one(0.5));
    // Errors: q 0.5, dq -1, model 2 + 0.5 = 2.5, its rate 3 + 2 = 5.
    // dmu/dt  = 2 - 10 (-0.5 + 0.5) = 2;  dmu'/dt = 3 - 10 (0.5 + 0.5 + 0.5) = -12;  dmu''/dt = -10 * 0.5 = -5.
    // New: mu 1.02, mu' 1.88, mu'' 2.95; u = 4 - 0.01 * 100 (0.48 - 0.88 / 2) = 3.96.
    for (is, should) in [(next.mu[0], 1.02), (next.dmu[0], 1.88), (next.ddmu[0], 2.95), (u[0], 3.96)] {
        assert!((is - should).abs() < 1e-12, "{is} is not {should}");
    }
    // F = 1/2 (0.25 + 1/2 + 6.25/5 + 25/10).
    let at = Measurement { q: one(1.5), dq: one(1.0) };
    assert!((aic.free_energy(&state, &at, &one(0.5)) - 2.25).abs() < 1e-12);
}
