//! The sampling step of the three adaptive laws.

use certune_linsys::{JointMatrix, Joints, Real};

use super::params::{MracLaw, MracParams};
use crate::controller::{Controller, Measurement};

/// The adaptive controller, ready to step. Equations in [the module](super).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mrac<const N: usize, T: Real = f64> {
    law: MracLaw,
    step_s: T,
    /// 1/h; by this the difference of two samples becomes a rate.
    samples_per_s: T,
    /// What a sample adds to the integral of an outer product, per unit of the product: h, or 1 in the released code.
    product_step: T,
    p2: Joints<N, T>,
    p3: Joints<N, T>,
    omega_squared: Joints<N, T>,
    two_zeta_omega: Joints<N, T>,
    alpha: [Joints<N, T>; 3],
    e0: [Joints<N, T>; 3],
    e1: [Joints<N, T>; 3],
    f0: [Joints<N, T>; 3],
    f1: [Joints<N, T>; 3],
}

/// What the law sees at one sampling instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals<const N: usize, T: Real = f64> {
    /// The modified error `P₂ (q_r − q) + P₃ (q̇_r − q̇)`.
    pub q_e: Joints<N, T>,
    /// Measured positions, rad.
    pub q: Joints<N, T>,
    /// Measured velocities, rad/s.
    pub dq: Joints<N, T>,
    /// Reference positions, rad.
    pub q_ref: Joints<N, T>,
    /// Reference velocities, rad/s.
    pub dq_ref: Joints<N, T>,
}

/// The error and its outer products with the four signals, or their integrals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Products<const N: usize, T: Real = f64> {
    /// q_e.
    pub q_e: Joints<N, T>,
    /// q_e qᵀ.
    pub q: JointMatrix<N, T>,
    /// q_e q̇ᵀ.
    pub dq: JointMatrix<N, T>,
    /// q_e q_rᵀ.
    pub q_ref: JointMatrix<N, T>,
    /// q_e q̇_rᵀ.
    pub dq_ref: JointMatrix<N, T>,
}

/// Reference, integrals and the last sample, between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MracState<const N: usize, T: Real = f64> {
    /// Position of the reference model, rad; the laws on the raw goal leave it where it started.
    pub q_ref: Joints<N, T>,
    /// Velocity of the reference model, rad/s.
    pub dq_ref: Joints<N, T>,
    /// Integrals since the start; in the released code those of the outer products are plain sums over the samples.
    pub integral: Products<N, T>,
    /// The last sample, for the derivative terms; none before the first step.
    pub last: Option<Signals<N, T>>,
}

/// The adaptive gains and the feed-forward of one step: `u = K₀ q + K₁ q̇ + Q₀ q_r + Q₁ q̇_r + f`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(non_snake_case, reason = "K and Q are written as in the formula")]
pub struct AdaptiveGains<const N: usize, T: Real = f64> {
    /// Gain of the positions, N m/rad.
    pub K0: JointMatrix<N, T>,
    /// Gain of the velocities, N m s/rad.
    pub K1: JointMatrix<N, T>,
    /// Gain of the reference positions, N m/rad.
    pub Q0: JointMatrix<N, T>,
    /// Gain of the reference velocities, N m s/rad.
    pub Q1: JointMatrix<N, T>,
    /// The feed-forward, N m.
    pub f: Joints<N, T>,
}

impl<const N: usize, T: Real> Products<N, T> {
    fn zeros() -> Self {
        let zeros = JointMatrix::zeros();
        Self { q_e: Joints::zeros(), q: zeros, dq: zeros, q_ref: zeros, dq_ref: zeros }
    }

    fn of(signals: &Signals<N, T>) -> Self {
        let with = |signal: &Joints<N, T>| JointMatrix::from_fn(|i, j| signals.q_e[i] * signal[j]);
        Self {
            q_e: signals.q_e,
            q: with(&signals.q),
            dq: with(&signals.dq),
            q_ref: with(&signals.q_ref),
            dq_ref: with(&signals.dq_ref),
        }
    }
}

/// `diag(g₁) now + diag(g₂) integral + diag(g₃) derivative`.
fn pid<const N: usize, const C: usize, T: Real>(
    gains: &[Joints<N, T>; 3],
    now: &nalgebra::SMatrix<T, N, C>,
    integral: &nalgebra::SMatrix<T, N, C>,
    derivative: &nalgebra::SMatrix<T, N, C>,
) -> nalgebra::SMatrix<T, N, C> {
    nalgebra::SMatrix::from_fn(|i, j| {
        gains[0][i] * now[(i, j)] + gains[1][i] * integral[(i, j)] + gains[2][i] * derivative[(i, j)]
    })
}

impl<const N: usize, T: Real> Mrac<N, T> {
    /// The controller with checked parameters, the same in every lane of `T`.
    pub fn new(params: &MracParams<N>) -> Self {
        let (gains, step_s) = (params.gains(), params.step_s());
        let splat = |values: &[f64; N]| Joints::<N, T>::from_fn(|joint, _| T::from_f64(values[joint]));
        let splat3 = |rows: &[[f64; N]; 3]| [splat(&rows[0]), splat(&rows[1]), splat(&rows[2])];
        let omega = splat(&gains.omega_rad_per_s);
        let product_step = match gains.law {
            MracLaw::ReferenceModel | MracLaw::RawGoal => step_s,
            MracLaw::ReleasedCode => 1.0,
        };
        Self {
            law: gains.law,
            step_s: T::from_f64(step_s),
            samples_per_s: T::from_f64(step_s.recip()),
            product_step: T::from_f64(product_step),
            p2: splat(&params.error_weights().map(|weights| weights.p2)),
            p3: splat(&params.error_weights().map(|weights| weights.p3)),
            omega_squared: omega.component_mul(&omega),
            two_zeta_omega: splat(&gains.zeta).component_mul(&omega) * T::from_f64(2.0),
            alpha: splat3(&gains.alpha),
            e0: splat3(&gains.e0),
            e1: splat3(&gains.e1),
            f0: splat3(&gains.f0),
            f1: splat3(&gains.f1),
        }
    }

    /// What the law sees: the measurement, the reference it tracks, and the modified error between them.
    pub fn signals(
        &self,
        state: &MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> Signals<N, T> {
        let (q_ref, dq_ref) = match self.law {
            MracLaw::ReferenceModel => (state.q_ref, state.dq_ref),
            MracLaw::RawGoal | MracLaw::ReleasedCode => (*goal, Joints::zeros()),
        };
        let Measurement { q, dq } = *measurement;
        let q_e = self.p2.component_mul(&(q_ref - q)) + self.p3.component_mul(&(dq_ref - dq));
        Signals { q_e, q, dq, q_ref, dq_ref }
    }

    /// The adaptive gains that [`Controller::step`] uses on the same arguments: a diagnostic of their drift. O(N²).
    pub fn adaptive_gains(
        &self,
        state: &MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> AdaptiveGains<N, T> {
        self.gains_at(state, &Products::of(&self.signals(state, measurement, goal)))
    }

    fn gains_at(&self, state: &MracState<N, T>, now: &Products<N, T>) -> AdaptiveGains<N, T> {
        let integral = &state.integral;
        let rate = state.last.as_ref().map_or_else(Products::zeros, |last| {
            let before = Products::of(last);
            let per_s = self.samples_per_s;
            Products {
                q_e: (now.q_e - before.q_e) * per_s,
                q: (now.q - before.q) * per_s,
                dq: (now.dq - before.dq) * per_s,
                q_ref: (now.q_ref - before.q_ref) * per_s,
                dq_ref: (now.dq_ref - before.dq_ref) * per_s,
            }
        });
        // The released code reads K0's sum here, after it has grown by the present sample.
        let integral_of_k1 = match self.law {
            MracLaw::ReferenceModel | MracLaw::RawGoal => integral.dq,
            MracLaw::ReleasedCode => integral.q + now.q,
        };
        AdaptiveGains {
            K0: pid(&self.e0, &now.q, &integral.q, &rate.q),
            K1: pid(&self.e1, &now.dq, &integral_of_k1, &rate.dq),
            Q0: pid(&self.f0, &now.q_ref, &integral.q_ref, &rate.q_ref),
            Q1: pid(&self.f1, &now.dq_ref, &integral.dq_ref, &rate.dq_ref),
            f: pid(&self.alpha, &now.q_e, &integral.q_e, &rate.q_e),
        }
    }

    fn advance(
        &self,
        state: &MracState<N, T>,
        signals: Signals<N, T>,
        now: &Products<N, T>,
        goal: &Joints<N, T>,
    ) -> MracState<N, T> {
        let (q_ref, dq_ref) = match self.law {
            MracLaw::ReferenceModel => {
                let pull = self.omega_squared.component_mul(&(goal - state.q_ref));
                let ddq_ref = pull - self.two_zeta_omega.component_mul(&state.dq_ref);
                let dq_ref = state.dq_ref + ddq_ref * self.step_s;
                (state.q_ref + dq_ref * self.step_s, dq_ref)
            }
            MracLaw::RawGoal | MracLaw::ReleasedCode => (state.q_ref, state.dq_ref),
        };
        let integral = Products {
            q_e: state.integral.q_e + now.q_e * self.step_s,
            q: state.integral.q + now.q * self.product_step,
            dq: state.integral.dq + now.dq * self.product_step,
            q_ref: state.integral.q_ref + now.q_ref * self.product_step,
            dq_ref: state.integral.dq_ref + now.dq_ref * self.product_step,
        };
        MracState { q_ref, dq_ref, integral, last: Some(signals) }
    }
}

impl<const N: usize, T: Real> Controller<N, T> for Mrac<N, T> {
    type State = MracState<N, T>;

    /// The reference model rests at the measured position, whatever the measured velocity; all integrals are zero.
    fn start(&self, at: &Measurement<N, T>) -> MracState<N, T> {
        MracState { q_ref: at.q, dq_ref: Joints::zeros(), integral: Products::zeros(), last: None }
    }

    fn step(
        &self,
        state: &MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> (MracState<N, T>, Joints<N, T>) {
        let signals = self.signals(state, measurement, goal);
        let now = Products::of(&signals);
        let gains = self.gains_at(state, &now);
        let u = times(&gains.K0, &signals.q)
            + times(&gains.K1, &signals.dq)
            + times(&gains.Q0, &signals.q_ref)
            + times(&gains.Q1, &signals.dq_ref)
            + gains.f;
        (self.advance(state, signals, &now, goal), u)
    }
}

fn times<const N: usize, T: Real>(matrix: &JointMatrix<N, T>, vector: &Joints<N, T>) -> Joints<N, T> {
    matrix * vector
}
