//! The controllers a user knows, as yardsticks: gravity-compensated PD and computed torque.
//!
//! ```text
//! gravity-compensated PD   u = k_p (goal − q) − k_d q̇ + g(q)
//! computed torque          u = M(q) v + C(q, q̇) q̇ + g(q),   v = ω² (goal − q) − 2ζω q̇
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | k_p, k_d | `stiffness_n_m_per_rad`, `damping_n_m_s_per_rad` | N m/rad, N m s/rad |
//! | ω, ζ   | `omega_rad_per_s`, `zeta` | rad/s, 1 |
//! | v      | commanded acceleration | rad/s² |
//!
//! Both need a model of the arm, which the caller hands in through [`InverseDynamics`]: what they show is how well a controller does that knows
//! what the adaptive ones have to find out. With the exact model and a goal at rest, PD converges from everywhere (the energy decays), and computed
//! torque makes every joint a linear oscillator of frequency ω and damping ζ.
//!
//! Source: Siciliano et al., *Robotics: Modelling, Planning and Control* (2009), sec. 8.5. Limits: no integral action, so a wrong model leaves
//! a steady error; both add g(q) themselves, so run them on an arm that does not.

mod computed_torque;
mod pd;

use certune_linsys::{Joints, Real};

pub use computed_torque::{ComputedTorque, ComputedTorqueGains};
pub use pd::{GravityCompensatedPd, PdGains};

use crate::controller::Measurement;

/// The model of an arm, as far as the baselines need one.
pub trait InverseDynamics<const N: usize, T: Real = f64> {
    /// Joint torques in N m that produce the accelerations `ddq`, rad/s², at the measured state: `M ddq + C q̇ + g`, friction included if
    /// the model has any.
    fn inverse_dynamics(&self, at: &Measurement<N, T>, ddq: &Joints<N, T>) -> Joints<N, T>;

    /// Joint torques in N m that hold the arm at rest in `q`, rad.
    fn gravity_torque(&self, q: &Joints<N, T>) -> Joints<N, T>;
}

impl<const N: usize, T: Real, D: InverseDynamics<N, T>> InverseDynamics<N, T> for &D {
    fn inverse_dynamics(&self, at: &Measurement<N, T>, ddq: &Joints<N, T>) -> Joints<N, T> {
        (**self).inverse_dynamics(at, ddq)
    }

    fn gravity_torque(&self, q: &Joints<N, T>) -> Joints<N, T> {
        (**self).gravity_torque(q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One link: m l² ddq + m g l sin q, with m l² = 2 and m g l = 5.
    pub(super) struct Pendulum;

    impl InverseDynamics<1> for Pendulum {
        fn inverse_dynamics(&self, at: &Measurement<1>, ddq: &Joints<1>) -> Joints<1> {
            ddq * 2.0 + self.gravity_torque(&at.q)
        }

        fn gravity_torque(&self, q: &Joints<1>) -> Joints<1> {
            Joints::<1>::new(5.0 * Real::sin_cos(q[0]).0)
        }
    }

    /// The pendulum's state after `steps` semi-implicit steps of 1 ms.
    pub(super) fn run(controller: &impl crate::Controller<1>, goal: f64, steps: usize) -> Measurement<1> {
        let mut at = Measurement { q: Joints::<1>::zeros(), dq: Joints::<1>::zeros() };
        let mut state = controller.start(&at);
        for _ in 0..steps {
            let (next, u) = controller.step(&state, &at, &Joints::<1>::new(goal));
            state = next;
            let ddq = (u - Pendulum.gravity_torque(&at.q)) / 2.0;
            at.dq += ddq * 1e-3;
            at.q += at.dq * 1e-3;
        }
        at
    }
}
