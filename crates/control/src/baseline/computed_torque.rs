//! Feedback linearisation: the model turns each joint into a linear oscillator.

use certune_linsys::{Joints, Real};

use super::InverseDynamics;
use crate::controller::{Controller, Measurement};
use crate::param::{self, ParamError};

/// Gains per joint: plain numbers, unchecked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComputedTorqueGains<const N: usize> {
    /// Frequency of the closed loop, rad/s.
    pub omega_rad_per_s: [f64; N],
    /// Damping ratio of the closed loop; 1 is critical.
    pub zeta: [f64; N],
}

/// `u = M(q) (ω² (goal − q) − 2ζω q̇) + C(q, q̇) q̇ + g(q)`, ready to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComputedTorque<const N: usize, D, T: Real = f64> {
    omega_squared: Joints<N, T>,
    two_zeta_omega: Joints<N, T>,
    model: D,
}

impl<const N: usize, D: InverseDynamics<N, T>, T: Real> ComputedTorque<N, D, T> {
    /// The controller with checked gains over the caller's model.
    ///
    /// # Errors
    /// [`ParamError::Gain`] for the first gain that is not positive and finite.
    pub fn new(gains: &ComputedTorqueGains<N>, model: D) -> Result<Self, ParamError> {
        for joint in 0..N {
            param::positive("omega_rad_per_s", joint, gains.omega_rad_per_s[joint])?;
            param::positive("zeta", joint, gains.zeta[joint])?;
        }
        let splat = |values: &[f64; N]| Joints::<N, T>::from_fn(|joint, _| T::from_f64(values[joint]));
        let (omega, zeta) = (splat(&gains.omega_rad_per_s), splat(&gains.zeta));
        let two_zeta_omega = zeta.component_mul(&omega) * T::from_f64(2.0);
        Ok(Self { omega_squared: omega.component_mul(&omega), two_zeta_omega, model })
    }
}

impl<const N: usize, D: InverseDynamics<N, T>, T: Real> Controller<N, T> for ComputedTorque<N, D, T> {
    type State = ();

    fn start(&self, _at: &Measurement<N, T>) {}

    fn step(&self, _state: &(), measurement: &Measurement<N, T>, goal: &Joints<N, T>) -> ((), Joints<N, T>) {
        let pull = self.omega_squared.component_mul(&(goal - measurement.q));
        let ddq = pull - self.two_zeta_omega.component_mul(&measurement.dq);
        ((), self.model.inverse_dynamics(measurement, &ddq))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Pendulum, run};
    use super::*;

    #[test]
    fn the_pendulum_becomes_the_oscillator_asked_for() {
        let gains = ComputedTorqueGains { omega_rad_per_s: [3.0], zeta: [1.0] };
        let controller = ComputedTorque::<1, _>::new(&gains, Pendulum).expect("valid gains");
        // q = goal (1 - (1 + w t) exp(-w t)); the Euler steps of 1 ms leave an error of the order w h.
        for (steps, t) in [(200, 0.2_f64), (1000, 1.0), (2000, 2.0)] {
            let exact = 0.9 * (1.0 - (1.0 + 3.0 * t) * num_traits::Float::exp(-3.0 * t));
            let error = run(&controller, 0.9, steps).q[0] - exact;
            assert!(error.abs() < 3e-3, "off by {error} at {t} s");
        }
    }

    #[test]
    fn a_bad_gain_is_named() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let gains = ComputedTorqueGains { omega_rad_per_s: [bad], zeta: [1.0] };
            let error = ComputedTorque::<1, _>::new(&gains, Pendulum).map(|_| ());
            assert!(matches!(error, Err(ParamError::Gain { gain: "omega_rad_per_s", joint: 0, .. })));
        }
    }
}
