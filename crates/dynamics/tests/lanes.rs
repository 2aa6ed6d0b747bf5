//! Contract: a bundle of lanes gives, in each lane, the numbers of the scalar path.

use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use certune_dynamics::{
    Joints, Model, Payload, Real, Robot, RobotError, State, coriolis_matrix, flange_jacobian, forward_dynamics,
    gravity_jacobian, inverse_dynamics, kinetic_energy, linearise, mass_matrix, potential_energy,
};
use num_traits::{One, Zero};

/// Two numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair([f64; 2]);

impl Pair {
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

macro_rules! lane_by_lane {
    ($($operator:ident $function:ident $assign:ident $assign_function:ident $symbol:tt),*) => {$(
        impl $operator for Pair {
            type Output = Self;
            fn $function(self, other: Self) -> Self {
                self.zip(other, |a, b| a $symbol b)
            }
        }
        impl $assign for Pair {
            fn $assign_function(&mut self, other: Self) {
                *self = *self $symbol other;
            }
        }
    )*};
}
lane_by_lane!(Add add AddAssign add_assign +, Sub sub SubAssign sub_assign -, Mul mul MulAssign mul_assign *, Div div DivAssign div_assign /);

impl Neg for Pair {
    type Output = Self;
    fn neg(self) -> Self {
        self.map(|a| -a)
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
        self.map(f64::sqrt)
    }
    fn abs(self) -> Self {
        self.map(f64::abs)
    }
    fn clamp_symmetric(self, limit: Self) -> Self {
        self.zip(limit, Real::clamp_symmetric)
    }
    fn tanh(self) -> Self {
        self.map(f64::tanh)
    }
    fn choose(self, bound: Self, then: Self, otherwise: Self) -> Self {
        let lane = |k: usize| self.0[k].choose(bound.0[k], then.0[k], otherwise.0[k]);
        Self([lane(0), lane(1)])
    }
}

fn pair(a: &Joints<7>, b: &Joints<7>) -> Joints<7, Pair> {
    a.zip_map(b, |x, y| Pair([x, y]))
}

#[test]
fn every_lane_is_the_arm_it_was_packed_from() -> Result<(), RobotError> {
    let light = Model::<7>::new(&Robot::panda_bare())?;
    let heavy = Model::<7>::new(&Robot::panda_cuboid())?
        .with_payload(&Payload::point(0.7, [0.0, 0.0, 0.307])?)
        .with_friction(&Joints::repeat(1.5), &Joints::repeat(0.2));
    let arms = [&light, &heavy];
    let both = Model::<7, Pair>::pack(&arms, Pair);
    let q = [Joints::from([0.1, -0.4, 0.3, -1.8, 0.2, 1.9, -0.7]), Joints::from([1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0])];
    let dq = [Joints::from([0.5, -0.2, 0.8, 0.4, -1.0, 0.3, 1.2]), Joints::from([0.0, 0.1, -0.3, 0.9, 0.2, -0.4, 0.0])];
    let tau = [Joints::from([1.0, -20.0, 3.0, 15.0, 0.5, 2.0, 0.1]), Joints::repeat(2.0)];
    let at = State { q: pair(&q[0], &q[1]), dq: pair(&dq[0], &dq[1]) };
    let torque = pair(&tau[0], &tau[1]);
    let linear = linearise(&both, &at, &torque);
    for lane in 0..2 {
        let (arm, one) = (arms[lane], State { q: q[lane], dq: dq[lane] });
        let pick = |x: Pair| x.0[lane];
        assert_eq!(mass_matrix(&both, &at.q).map(pick), mass_matrix(arm, &one.q));
        assert_eq!(coriolis_matrix(&both, &at).map(pick), coriolis_matrix(arm, &one));
        assert_eq!(gravity_jacobian(&both, &at.q).map(pick), gravity_jacobian(arm, &one.q));
        assert_eq!(flange_jacobian(&both, &at.q).map(pick), flange_jacobian(arm, &one.q));
        assert_eq!(inverse_dynamics(&both, &at, &torque).map(pick), inverse_dynamics(arm, &one, &tau[lane]));
        assert_eq!(forward_dynamics(&both, &at, &torque).map(pick), forward_dynamics(arm, &one, &tau[lane]));
        assert_eq!(linear.ddq_dq.map(pick), linearise(arm, &one, &tau[lane]).ddq_dq);
        assert_eq!(pick(kinetic_energy(&both, &at)).to_bits(), kinetic_energy(arm, &one).to_bits());
        assert_eq!(pick(potential_energy(&both, &at.q)).to_bits(), potential_energy(arm, &one.q).to_bits());
    }
    Ok(())
}

#[test]
fn splat_repeats_one_arm() -> Result<(), RobotError> {
    let arm = Model::<7>::new(&Robot::panda())?;
    let q = Joints::from([1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0]);
    let both = mass_matrix(&arm.splat::<Pair>(), &pair(&q, &q));
    assert_eq!(both.map(|x| x.0[0]), mass_matrix(&arm, &q));
    assert_eq!(both.map(|x| x.0[0]), both.map(|x| x.0[1]));
    Ok(())
}
