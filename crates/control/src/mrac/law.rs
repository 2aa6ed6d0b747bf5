//! The sampling step of the three adaptive laws.
//!
//! An adaptive gain is a sum of outer products with the signal that it multiplies, and `(a bᵀ) s = a (b . s)`: the step needs of the present and the last sample
//! two scalar products a signal, and passes once over each integral, which it reads and then adds to. [`Mrac::adaptive_gains`] writes the gains out.

use certune_linsys::{JointMatrix, Joints, Lanes, Real};

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
    /// Whether any derivative gain is above zero.
    derivatives: bool,
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
            derivatives: params.has_derivatives(),
        }
    }

    /// What the law sees: the measurement, the reference it tracks, and the modified error between them.
    #[inline(always)]
    pub fn signals(
        &self,
        state: &MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> Signals<N, T> {
        let Measurement { q, dq } = *measurement;
        let (q_ref, dq_ref) = match self.law {
            MracLaw::ReferenceModel => (state.q_ref, state.dq_ref),
            MracLaw::RawGoal | MracLaw::ReleasedCode => (*goal, Joints::zeros()),
        };
        let mut seen = Signals { q_e: q, q, dq, q_ref, dq_ref };
        for i in 0..N {
            seen.q_e[i] = self.p2[i] * (seen.q_ref[i] - q[i]) + self.p3[i] * (seen.dq_ref[i] - dq[i]);
        }
        seen
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

    /// `g₂ ∫ q_e sᵀ dt s` of the four signals and of the error itself; the integrals grow by the present sample once they are read.
    #[inline(always)]
    fn integral_terms(&self, integral: &mut Products<N, T>, seen: &Signals<N, T>) -> [T; N] {
        let o = T::zero();
        let mut growth = [o; N];
        for i in 0..N {
            growth[i] = seen.q_e[i] * self.product_step;
        }
        let (mut of_q, mut of_dq, mut of_q_ref, mut of_dq_ref) = ([o; N], [o; N], [o; N], [o; N]);
        read_and_grow(&mut integral.q, &seen.q, &growth, &mut of_q);
        read_and_grow(&mut integral.dq, &seen.dq, &growth, &mut of_dq);
        read_and_grow(&mut integral.q_ref, &seen.q_ref, &growth, &mut of_q_ref);
        match self.law {
            MracLaw::ReferenceModel => read_and_grow(&mut integral.dq_ref, &seen.dq_ref, &growth, &mut of_dq_ref),
            // q̇_r = 0.
            MracLaw::RawGoal => {}
            // K₁ reads K₀'s sum, after it has grown by the present sample.
            MracLaw::ReleasedCode => {
                of_dq = [o; N];
                read(&integral.q, &seen.dq, &mut of_dq);
            }
        }
        let mut torque = [o; N];
        for i in 0..N {
            torque[i] = self.e0[1][i] * of_q[i]
                + self.e1[1][i] * of_dq[i]
                + self.f0[1][i] * of_q_ref[i]
                + self.f1[1][i] * of_dq_ref[i]
                + self.alpha[1][i] * integral.q_e[i];
            integral.q_e[i] += seen.q_e[i] * self.step_s;
        }
        torque
    }

    /// The proportional terms, all in `q_e`: `(q_e sᵀ) s = q_e |s|²`.
    #[inline(always)]
    fn proportional_terms(&self, seen: &Signals<N, T>, torque: &mut [T; N]) {
        let [q, dq, q_ref, dq_ref] = along(seen, seen);
        for i in 0..N {
            let gain = self.e0[0][i] * q
                + self.e1[0][i] * dq
                + self.f0[0][i] * q_ref
                + self.f1[0][i] * dq_ref
                + self.alpha[0][i];
            torque[i] += gain * seen.q_e[i];
        }
    }

    /// The derivative terms: `((q_e sᵀ - q_e' s'ᵀ)/h) s`, the last sample's with a prime.
    #[inline(always)]
    fn derivative_terms(&self, seen: &Signals<N, T>, last: &Signals<N, T>, torque: &mut [T; N]) {
        let (now, before) = (along(seen, seen), along(last, seen));
        for i in 0..N {
            let change = |signal: usize| seen.q_e[i] * now[signal] - last.q_e[i] * before[signal];
            let changes = self.e0[2][i] * change(0)
                + self.e1[2][i] * change(1)
                + self.f0[2][i] * change(2)
                + self.f1[2][i] * change(3)
                + self.alpha[2][i] * (seen.q_e[i] - last.q_e[i]);
            torque[i] += changes * self.samples_per_s;
        }
    }

    /// Semi-implicit Euler of the reference model.
    #[inline(always)]
    fn advance_reference(&self, state: &mut MracState<N, T>, goal: &Joints<N, T>) {
        for i in 0..N {
            let pull = self.omega_squared[i] * (goal[i] - state.q_ref[i]);
            let ddq_ref = pull - self.two_zeta_omega[i] * state.dq_ref[i];
            state.dq_ref[i] += ddq_ref * self.step_s;
            state.q_ref[i] += state.dq_ref[i] * self.step_s;
        }
    }
}

impl<const N: usize, T: Lanes> Mrac<N, T> {
    /// Controllers side by side: the parameters of each lane. All follow the law of the first.
    pub fn pack<'a>(of: impl Fn(usize) -> &'a MracParams<N>) -> Self {
        let first = Mrac::<N>::new(of(0));
        let lanes = |get: &dyn Fn(&Mrac<N>) -> f64| T::from_lanes(|lane| get(&Mrac::new(of(lane))));
        let joints = |get: &dyn Fn(&Mrac<N>) -> Joints<N>| {
            Joints::from_fn(|joint, _| lanes(&|controller| get(controller)[joint]))
        };
        let rows = |get: fn(&Mrac<N>) -> &[Joints<N>; 3]| core::array::from_fn(|row| joints(&|c| get(c)[row]));
        Self {
            law: first.law,
            step_s: lanes(&|c| c.step_s),
            samples_per_s: lanes(&|c| c.samples_per_s),
            product_step: lanes(&|c| c.product_step),
            p2: joints(&|c| c.p2),
            p3: joints(&|c| c.p3),
            omega_squared: joints(&|c| c.omega_squared),
            two_zeta_omega: joints(&|c| c.two_zeta_omega),
            alpha: rows(|c| &c.alpha),
            e0: rows(|c| &c.e0),
            e1: rows(|c| &c.e1),
            f0: rows(|c| &c.f0),
            f1: rows(|c| &c.f1),
            derivatives: (0..T::LANES).any(|lane| of(lane).has_derivatives()),
        }
    }
}

/// `torque += integral signal`, then `integral += growth signalᵀ`, in one pass over the columns.
#[inline(always)]
fn read_and_grow<const N: usize, T: Real>(
    integral: &mut JointMatrix<N, T>,
    signal: &Joints<N, T>,
    growth: &[T; N],
    torque: &mut [T; N],
) {
    for j in 0..N {
        let (column, s) = (&mut integral.data.0[j], signal[j]);
        for i in 0..N {
            torque[i] = column[i].mul_add(s, torque[i]);
            column[i] = growth[i].mul_add(s, column[i]);
        }
    }
}

/// `torque += integral signal`.
#[inline(always)]
fn read<const N: usize, T: Real>(integral: &JointMatrix<N, T>, signal: &Joints<N, T>, torque: &mut [T; N]) {
    for j in 0..N {
        let (column, s) = (&integral.data.0[j], signal[j]);
        for i in 0..N {
            torque[i] = column[i].mul_add(s, torque[i]);
        }
    }
}

/// The scalar products of the four signals of two samples.
#[inline(always)]
fn along<const N: usize, T: Real>(a: &Signals<N, T>, b: &Signals<N, T>) -> [T; 4] {
    let mut sums = [T::zero(); 4];
    for i in 0..N {
        sums[0] = a.q[i].mul_add(b.q[i], sums[0]);
        sums[1] = a.dq[i].mul_add(b.dq[i], sums[1]);
        sums[2] = a.q_ref[i].mul_add(b.q_ref[i], sums[2]);
        sums[3] = a.dq_ref[i].mul_add(b.dq_ref[i], sums[3]);
    }
    sums
}

impl<const N: usize, T: Real> Controller<N, T> for Mrac<N, T> {
    type State = MracState<N, T>;

    /// The reference model rests at the measured position, whatever the measured velocity; all integrals are zero.
    fn start(&self, at: &Measurement<N, T>) -> MracState<N, T> {
        MracState { q_ref: at.q, dq_ref: Joints::zeros(), integral: Products::zeros(), last: None }
    }

    #[inline(always)]
    fn step(
        &self,
        state: &MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> (MracState<N, T>, Joints<N, T>) {
        let mut next = *state;
        let u = self.advance(&mut next, measurement, goal);
        (next, u)
    }

    /// The torque of [`AdaptiveGains`], without forming them: of each outer product only what it does to its own signal is needed.
    #[inline(always)]
    fn advance(
        &self,
        state: &mut MracState<N, T>,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> Joints<N, T> {
        let seen = self.signals(state, measurement, goal);
        let mut torque = self.integral_terms(&mut state.integral, &seen);
        self.proportional_terms(&seen, &mut torque);
        if let (true, Some(last)) = (self.derivatives, &state.last) {
            self.derivative_terms(&seen, last, &mut torque);
        }
        state.last = Some(seen);
        if self.law == MracLaw::ReferenceModel {
            self.advance_reference(state, goal);
        }
        Joints::from(torque)
    }
}
