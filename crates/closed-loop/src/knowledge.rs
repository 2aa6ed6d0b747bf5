//! The arm's model in the hands of a controller: for the baselines, which are allowed to know it.

use certune_control::Measurement;
use certune_control::baseline::InverseDynamics;
use certune_dynamics::{Model, State, gravity_torque, inverse_dynamics};
use certune_linsys::{Joints, Real};

/// A model that answers what a baseline controller asks. It need not be the plant's: a wrong model is a fair question too.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownModel<const N: usize, T: Real = f64>(pub Model<N, T>);

impl<const N: usize, T: Real> InverseDynamics<N, T> for KnownModel<N, T> {
    fn inverse_dynamics(&self, at: &Measurement<N, T>, ddq: &Joints<N, T>) -> Joints<N, T> {
        inverse_dynamics(&self.0, &State { q: at.q, dq: at.dq }, ddq)
    }

    fn gravity_torque(&self, q: &Joints<N, T>) -> Joints<N, T> {
        gravity_torque(&self.0, q)
    }
}
