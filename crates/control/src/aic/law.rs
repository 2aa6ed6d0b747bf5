//! The controller's sampling step, its free energy and the gradient it descends.

use certune_linsys::{Joints, Lanes, Real};

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

/// What the beliefs about a joint leave unexplained: two measurement errors and two model errors.
struct PredictionErrors<T> {
    q: T,
    dq: T,
    mu: T,
    dmu: T,
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
        let mut sum = PredictionErrors { q: T::zero(), dq: T::zero(), mu: T::zero(), dmu: T::zero() };
        for i in 0..N {
            let error = self.prediction_errors(i, state, measurement, goal);
            sum.q += error.q * error.q * self.precision_q[i];
            sum.dq += error.dq * error.dq * self.precision_dq[i];
            sum.mu += error.mu * error.mu * self.precision_mu[i];
            sum.dmu += error.dmu * error.dmu * self.precision_dmu[i];
        }
        T::from_f64(0.5) * (sum.q + sum.dq + sum.mu + sum.dmu)
    }

    /// The gradient of [`Aic::free_energy`] with respect to the beliefs in `state`. O(N).
    #[inline(always)]
    pub fn free_energy_gradient(
        &self,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> BeliefGradient<N, T> {
        let mut gradient = BeliefGradient { mu: *goal, dmu: *goal, ddmu: *goal };
        for i in 0..N {
            [gradient.mu[i], gradient.dmu[i], gradient.ddmu[i]] = self.joint_gradient(i, state, measurement, goal);
        }
        gradient
    }

    /// ∂F/∂μ, ∂F/∂μ′, ∂F/∂μ″ of one joint: no joint's beliefs enter those of another.
    #[inline(always)]
    fn joint_gradient(
        &self,
        i: usize,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> [T; 3] {
        let error = self.prediction_errors(i, state, measurement, goal);
        let model_mu = error.mu * self.precision_mu[i];
        let model_dmu = error.dmu * self.precision_dmu[i];
        [
            model_mu * self.rate_per_s[i] - error.q * self.precision_q[i],
            model_mu + model_dmu * self.rate_per_s[i] - error.dq * self.precision_dq[i],
            model_dmu,
        ]
    }

    #[inline(always)]
    fn prediction_errors(
        &self,
        i: usize,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> PredictionErrors<T> {
        PredictionErrors {
            q: measurement.q[i] - state.mu[i],
            dq: measurement.dq[i] - state.dmu[i],
            mu: (state.mu[i] - goal[i]).mul_add(self.rate_per_s[i], state.dmu[i]),
            dmu: state.dmu[i].mul_add(self.rate_per_s[i], state.ddmu[i]),
        }
    }
}

impl<const N: usize, T: Lanes> Aic<N, T> {
    /// Controllers side by side: the parameters of each lane.
    pub fn pack<'a>(of: impl Fn(usize) -> &'a AicParams<N>) -> Self {
        let lanes = |get: &dyn Fn(&Aic<N>) -> f64| T::from_lanes(|lane| get(&Aic::new(of(lane))));
        let joints =
            |get: fn(&Aic<N>) -> &Joints<N>| Joints::from_fn(|joint, _| lanes(&|controller| get(controller)[joint]));
        Self {
            step_s: lanes(&|controller| controller.step_s),
            kappa_mu: joints(|c| &c.kappa_mu),
            kappa_a: joints(|c| &c.kappa_a),
            precision_q: joints(|c| &c.precision_q),
            precision_dq: joints(|c| &c.precision_dq),
            precision_mu: joints(|c| &c.precision_mu),
            precision_dmu: joints(|c| &c.precision_dmu),
            rate_per_s: joints(|c| &c.rate_per_s),
        }
    }
}

impl<const N: usize, T: Real> Controller<N, T> for Aic<N, T> {
    type State = AicState<N, T>;

    fn start(&self, at: &Measurement<N, T>) -> AicState<N, T> {
        AicState { mu: at.q, dmu: at.dq, ddmu: Joints::zeros(), u: Joints::zeros() }
    }

    #[inline(always)]
    fn step(
        &self,
        state: &AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> (AicState<N, T>, Joints<N, T>) {
        let mut next = *state;
        let u = self.advance(&mut next, measurement, goal);
        (next, u)
    }

    #[inline(always)]
    fn advance(
        &self,
        state: &mut AicState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> Joints<N, T> {
        let gradient = self.free_energy_gradient(state, measurement, goal);
        let h = self.step_s;
        for i in 0..N {
            let kappa = self.kappa_mu[i];
            // μ reads μ′ and μ′ reads μ″ before they move on.
            state.mu[i] = (state.dmu[i] - kappa * gradient.mu[i]).mul_add(h, state.mu[i]);
            state.dmu[i] = (state.ddmu[i] - kappa * gradient.dmu[i]).mul_add(h, state.dmu[i]);
            state.ddmu[i] = (-(kappa * gradient.ddmu[i])).mul_add(h, state.ddmu[i]);
            // The authors' order: the torque descends with the beliefs just updated.
            let surprise = (measurement.q[i] - state.mu[i]) * self.precision_q[i]
                + (measurement.dq[i] - state.dmu[i]) * self.precision_dq[i];
            state.u[i] = (-(self.kappa_a[i] * surprise)).mul_add(h, state.u[i]);
        }
        state.u
    }
}
