//! The controllers run on any scalar: two arms side by side in one bundle of lanes move as each of them alone, to the bit.

use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use certune_control::aic::{Aic, AicGains, AicParams};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams};
use certune_control::{Controller, GoalRateLimiter, Measurement};
use certune_linsys::{Joints, Real};
use num_traits::{One, Zero};

/// Two numbers that take every operation together.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair([f64; 2]);

macro_rules! lanewise {
    ($($operator:ident $method:ident $assign:ident $assign_method:ident),*) => {$(
        impl $operator for Pair {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self([self.0[0].$method(other.0[0]), self.0[1].$method(other.0[1])])
            }
        }
        impl $assign for Pair {
            fn $assign_method(&mut self, other: Self) {
                *self = (*self).$method(other);
            }
        }
    )*};
}
lanewise!(Add add AddAssign add_assign, Sub sub SubAssign sub_assign, Mul mul MulAssign mul_assign, Div div DivAssign div_assign);

impl Neg for Pair {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl Zero for Pair {
    fn zero() -> Self {
        Self([0.0; 2])
    }
    fn is_zero(&self) -> bool {
        self.0.iter().all(Zero::is_zero)
    }
}

impl One for Pair {
    fn one() -> Self {
        Self([1.0; 2])
    }
}

impl Real for Pair {
    fn from_f64(x: f64) -> Self {
        Self([x; 2])
    }
    fn sin_cos(self) -> (Self, Self) {
        let [a, b] = self.0.map(Real::sin_cos);
        (Self([a.0, b.0]), Self([a.1, b.1]))
    }
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let lane = |k: usize| self.0[k].choose(bound.0[k], then.0[k], otherwise.0[k]);
        Self([lane(0), lane(1)])
    }
    fn clamp_symmetric(self, limit: Self) -> Self {
        Self([self.0[0].clamp_symmetric(limit.0[0]), self.0[1].clamp_symmetric(limit.0[1])])
    }
    fn tanh(self) -> Self {
        Self(self.0.map(f64::tanh))
    }
}

/// Some motion of arm 0 or 1.
fn motion(arm: usize, step: i32) -> Measurement<2> {
    let phase = 0.01 * f64::from(step) + if arm == 0 { 0.0 } else { 0.7 };
    Measurement {
        q: Joints::<2>::new(phase.sin(), 0.5 * phase.cos()),
        dq: Joints::<2>::new(phase.cos(), -0.5 * phase.sin()),
    }
}

fn bundle(arms: [Joints<2>; 2]) -> Joints<2, Pair> {
    Joints::<2, Pair>::from_fn(|i, _| Pair([arms[0][i], arms[1][i]]))
}

fn assert_lanes_run_alone<C: Controller<2>, L: Controller<2, Pair>>(alone: &C, lanes: &L) {
    let goals = [Joints::<2>::new(0.3, -0.4), Joints::<2>::new(-0.8, 0.1)];
    let both = |step| {
        let [a, b] = [motion(0, step), motion(1, step)];
        Measurement { q: bundle([a.q, b.q]), dq: bundle([a.dq, b.dq]) }
    };
    let mut states = [alone.start(&motion(0, 0)), alone.start(&motion(1, 0))];
    let mut lane_state = lanes.start(&both(0));
    for step in 0..200 {
        let torques = [0, 1].map(|arm| {
            let (next, u) = alone.step(&states[arm], &motion(arm, step), &goals[arm]);
            states[arm] = next;
            u
        });
        let (next, u) = lanes.step(&lane_state, &both(step), &bundle(goals));
        lane_state = next;
        assert_eq!(u, bundle(torques), "step {step}");
    }
}

#[test]
fn active_inference_in_lanes() {
    let gains = AicGains {
        kappa_mu: [11.67, 9.0],
        kappa_a: [700.0, 300.0],
        sigma_q: [1.0, 2.0],
        sigma_dq: [1.0, 0.7],
        sigma_mu: [5.0, 4.0],
        sigma_dmu: [10.0, 13.0],
        reference_time_constant_s: [1.0, 0.6],
    };
    let params = AicParams::new(&gains, 1e-3).unwrap();
    assert_lanes_run_alone(&Aic::<2>::new(&params), &Aic::<2, Pair>::new(&params));
}

#[test]
fn mrac_in_lanes() {
    for law in MracLaw::ALL {
        let derivative = if law == MracLaw::ReleasedCode { [0.0; 2] } else { [0.01, 0.02] };
        let family = [[40.0, 200.0], [4.0, 3.0], derivative];
        let gains = MracGains {
            law,
            omega_rad_per_s: [2.0, 3.0],
            zeta: [1.0, 0.8],
            l1: [1.0, 1.2],
            l2: [1.0, 0.7],
            alpha: family,
            e0: family,
            e1: family,
            f0: family,
            f1: family,
        };
        let params = MracParams::new(&gains, 1e-3).unwrap();
        assert_lanes_run_alone(&Mrac::<2>::new(&params), &Mrac::<2, Pair>::new(&params));
    }
}

#[test]
fn a_limited_goal_in_lanes() {
    let limiter = GoalRateLimiter::new(0.3, 1e-3).unwrap();
    // One lane arrives, the other is on its way, then holds.
    let goals = [Joints::<2>::new(0.01, -0.02), Joints::<2>::new(-0.8, 0.1)];
    let lost = Joints::<2>::new(f64::NAN, 0.0);
    let mut alone = [Joints::<2>::zeros(); 2];
    let mut lanes = bundle(alone);
    for step in 0..200 {
        let goals = if step < 150 { goals } else { [goals[0], lost] };
        alone = [0, 1].map(|arm| limiter.step(&alone[arm], &goals[arm]));
        lanes = limiter.step(&lanes, &bundle(goals));
        assert_eq!(lanes, bundle(alone), "step {step}");
    }
}
