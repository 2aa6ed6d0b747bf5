//! Proportional-derivative control on top of the model's gravity torque.

use certune_linsys::{Joints, Real};

use super::InverseDynamics;
use crate::controller::{Controller, Measurement};
use crate::param::{self, ParamError};

/// Gains per joint: plain numbers, unchecked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdGains<const N: usize> {
    /// Torque per position error, N m/rad.
    pub stiffness_n_m_per_rad: [f64; N],
    /// Torque against velocity, N m s/rad.
    pub damping_n_m_s_per_rad: [f64; N],
}

/// `u = k_p (goal − q) − k_d q̇ + g(q)`, ready to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityCompensatedPd<const N: usize, D, T: Real = f64> {
    stiffness: Joints<N, T>,
    damping: Joints<N, T>,
    model: D,
}

impl<const N: usize, D: InverseDynamics<N, T>, T: Real> GravityCompensatedPd<N, D, T> {
    /// The controller with checked gains over the caller's model.
    ///
    /// # Errors
    /// [`ParamError::Gain`] for the first gain that is not positive and finite.
    pub fn new(gains: &PdGains<N>, model: D) -> Result<Self, ParamError> {
        for joint in 0..N {
            param::positive("stiffness_n_m_per_rad", joint, gains.stiffness_n_m_per_rad[joint])?;
            param::positive("damping_n_m_s_per_rad", joint, gains.damping_n_m_s_per_rad[joint])?;
        }
        let splat = |values: &[f64; N]| Joints::<N, T>::from_fn(|joint, _| T::from_f64(values[joint]));
        Ok(Self { stiffness: splat(&gains.stiffness_n_m_per_rad), damping: splat(&gains.damping_n_m_s_per_rad), model })
    }
}

impl<const N: usize, D: InverseDynamics<N, T>, T: Real> Controller<N, T> for GravityCompensatedPd<N, D, T> {
    type State = ();

    fn start(&self, _at: &Measurement<N, T>) {}

    fn step(&self, _state: &(), measurement: &Measurement<N, T>, goal: &Joints<N, T>) -> ((), Joints<N, T>) {
        let pull = self.stiffness.component_mul(&(goal - measurement.q));
        let drag = self.damping.component_mul(&measurement.dq);
        ((), pull - drag + self.model.gravity_torque(&measurement.q))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Pendulum, run};
    use super::*;

    const GAINS: PdGains<1> = PdGains { stiffness_n_m_per_rad: [50.0], damping_n_m_s_per_rad: [20.0] };

    #[test]
    fn it_holds_the_goal_with_the_gravity_torque_alone() {
        let controller = GravityCompensatedPd::<1, _>::new(&GAINS, &Pendulum).expect("valid gains");
        let goal = Joints::<1>::new(1.2);
        let ((), u) = controller.step(&(), &Measurement { q: goal, dq: Joints::<1>::zeros() }, &goal);
        assert_eq!(u, Pendulum.gravity_torque(&goal));
        assert!((run(&controller, 1.2, 6000).q[0] - 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_bad_gain_is_named() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let gains = PdGains { damping_n_m_s_per_rad: [bad], ..GAINS };
            let error = GravityCompensatedPd::<1, _>::new(&gains, &Pendulum).map(|_| ());
            assert!(matches!(error, Err(ParamError::Gain { gain: "damping_n_m_s_per_rad", joint: 0, .. })));
        }
    }
}
