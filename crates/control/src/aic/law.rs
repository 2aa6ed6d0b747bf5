//! The controller's sampling step, its free energy and the gradient it descends.

use certune_linsys::{Joints, Real};

use super::params::AicParams;
use crate::controller::{Controller, Measurement};
use crate::param::Precision;

/// The active inference controller, ready to step. Equations in [the module](super).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aic<const N: usize, T: Real = f64> {
    step_s: T,
    kappa_mu: Joints<N, T>,
    kappa_a: Joints<N, T>,
    precision_q: Joints<N, T>,
    precision_dq: Joints<N, T>,
    precision_mu: Joints<N, T>,
    precision_dmu: Joints<N, T>,
    /// 1/T, 1/s.
    rate_per_s: Joints<N, T>,
}

/// Beliefs and torque between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AicState<const N: usize, T: Real = f64> {
    /// Belief about the positions, rad.
    pub mu: Joints<N, T>,
    /// Belief about the velocities, rad/s.
    pub dmu: Joints<N, T>,
    /// Belief about the accelerations, rad/s².
    pub ddmu: Joints<N, T>,
    /// The torques of the last step, N m.
    pub u: Joints<N, T>,
}

/// The gradient of the free energy with respect to the beliefs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeliefGradient<const N: usize, T: Real = f64> {
    /// ∂F/∂μ.
    pub mu: Joints<N, T>,
    /// ∂F/∂μ′.
    pub dmu: Joints<N, T>,
    /// ∂F/∂μ″.
    pub ddmu: Joints<N, T>,
}

/// What the beliefs leave unexplained: two measurement errors and two model errors.
struct PredictionErrors<const N: usize, T: Real> {
    q: Joints<N, T>,
    dq: Joints<N, T>,
    mu: Joints<N, T>,
    dmu: Joints<N, T>,
}

impl<const N: usize, T: Real> Aic<N, T> {
    /// The controller with checked parameters, the same in every lane of `T`.
    pub fn new(params: &AicParams<N>) -> Self {
        let gains = params.gains();
        let splat = |values: &[f64; N]| Joints::<N, T>::from_fn(|joint, _| T::from_f64(values[joint]));
        let precision = |of: fn(&super::params::JointPrecisions) -> Precision| {
            Joints::from_fn(|i, _| of(&params.precision[i]).splat())
        };
        Self {
            step_s: T::from_f64(params.step_s()),
            kappa_mu: splat(&gains.kappa_mu),
            kappa_a: splat(&gains.kappa_a),
            precision_q: precision(|p| p.q),
            precision_dq: precision(|p| p.dq),
            precision_mu: precision(|p| p.mu),
            precision_dmu: precision(|p| p.dmu),
            rate_per_s: splat(&gains.reference_time_constant_s.map(f64::recip)),
        }
    }

    /// The free energy of the beliefs in `state`, without unit: zero exactly when measurement, beliefs and reference agree.
    ///
    /// A diagnostic; the step does not use it. O(N).
    pub fn free_energy(&self, state: &AicState<N, T>, measurement: &Measurement<N, T>, goal: &Joints<N, T>) -> T {
        let error = self.prediction_errors(state, measurement, goal);
        let weighted = |error: &Joints<N, T>, precision: &Joints<N, T>| square(error).component_mul(precision).sum();
        let sum = weighted(&error.q, &self.precision_q)
            + weighted(&error.dq, &self.precision_dq)
            + weighted(&error.mu, &self.precision_mu)
            + weighted(&error.dmu, &self.precision_dmu);
        T::from_f64(0.5) * sum
    }

    /// The gradient of [`Aic::free_energy`] with respect to the beliefs in `state`. O(N).
    pub fn free_energy_gradient(
        &self,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> BeliefGradient<N, T> {
        let error = self.prediction_errors(state, measurement, goal);
        let model_mu = error.mu.component_mul(&self.precision_mu);
        let model_dmu = error.dmu.component_mul(&self.precision_dmu);
        BeliefGradient {
            mu: model_mu.component_mul(&self.rate_per_s) - error.q.component_mul(&self.precision_q),
            dmu: model_mu + model_dmu.component_mul(&self.rate_per_s) - error.dq.component_mul(&self.precision_dq),
            ddmu: model_dmu,
        }
    }

    fn prediction_errors(
        &self,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> PredictionErrors<N, T> {
        PredictionErrors {
            q: measurement.q - state.mu,
            dq: measurement.dq - state.dmu,
            mu: state.dmu + (state.mu - goal).component_mul(&self.rate_per_s),
            dmu: state.ddmu + state.dmu.component_mul(&self.rate_per_s),
        }
    }
}

fn square<const N: usize, T: Real>(x: &Joints<N, T>) -> Joints<N, T> {
    x.component_mul(x)
}

impl<const N: usize, T: Real> Controller<N, T> for Aic<N, T> {
    type State = AicState<N, T>;

    fn start(&self, at: &Measurement<N, T>) -> AicState<N, T> {
        AicState { mu: at.q, dmu: at.dq, ddmu: Joints::zeros(), u: Joints::zeros() }
    }

    fn step(
        &self,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> (AicState<N, T>, Joints<N, T>) {
        let gradient = self.free_energy_gradient(state, measurement, goal);
        let mu = state.mu + (state.dmu - self.kappa_mu.component_mul(&gradient.mu)) * self.step_s;
        let dmu = state.dmu + (state.ddmu - self.kappa_mu.component_mul(&gradient.dmu)) * self.step_s;
        let ddmu = state.ddmu - self.kappa_mu.component_mul(&gradient.ddmu) * self.step_s;
        // The authors' order: the torque descends with the beliefs just updated.
        let surprise = (measurement.q - mu).component_mul(&self.precision_q)
            + (measurement.dq - dmu).component_mul(&self.precision_dq);
        let u = state.u - self.kappa_a.component_mul(&surprise) * self.step_s;
        (AicState { mu, dmu, ddmu, u }, u)
    }
}
