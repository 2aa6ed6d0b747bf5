//! The controller as what it is: one linear system per joint.
//!
//! With `e = q − μ_d`, `m = μ − μ_d` and any offset of the torque, `ũ = u − u*`, the state of one joint and its controller is
//! `z = (e, m, μ′, μ″, ũ)`. In continuous time `dz/dt = A z + b q̇` with, per joint,
//!
//! ```text
//! a = κ_μ/σ_q    α = κ_μ/σ_q̇    β = κ_μ/σ_μ    γ = κ_μ/σ_μ′    r = 1/T
//!
//!     ⎡  0          0            0             0      0 ⎤        ⎡   1      ⎤
//!     ⎢  a      −a − β r²     1 − β r          0      0 ⎥        ⎢   0      ⎥
//! A = ⎢  0        −β r     −α − β − γ r²    1 − γ r   0 ⎥    b = ⎢   α      ⎥
//!     ⎢  0          0          −γ r           −γ      0 ⎥        ⎢   0      ⎥
//!     ⎣ −κ_a/σ_q  κ_a/σ_q     κ_a/σ_q̇          0      0 ⎦        ⎣ −κ_a/σ_q̇ ⎦
//! ```
//!
//! The sampled controller keeps `x = (m, μ′, μ″, ũ)` and reads `y = (e, q̇)`: `x⁺ = F x + G y`. Its first three rows are the Euler step of the
//! rows above; its last row uses the *new* m and μ′, as [the step](super::Aic) does.

use nalgebra::{SMatrix, SVector};

use super::params::AicParams;

/// One joint in continuous time: `dz/dt = A z + b q̇`, `z = (e, m, μ′, μ″, ũ)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(non_snake_case, reason = "A is written as in the formula")]
pub struct ContinuousJoint {
    /// The system matrix; rows and columns ordered as z.
    pub A: SMatrix<f64, 5, 5>,
    /// The input vector of the joint velocity, ordered as z.
    pub b: SVector<f64, 5>,
}

/// One joint's sampled controller: `x⁺ = F x + G y`, `x = (m, μ′, μ″, ũ)`, `y = (e, q̇)`; the torque held until the next sample is `ũ⁺`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(non_snake_case, reason = "F and G are written as in the formula")]
pub struct SampledJoint {
    /// The update of the controller's own state.
    pub F: SMatrix<f64, 4, 4>,
    /// The update by the measurement.
    pub G: SMatrix<f64, 4, 2>,
}

impl<const N: usize> AicParams<N> {
    /// The continuous-time linear system of one joint, counted from 0 at the base.
    ///
    /// # Panics
    /// If `joint >= N`.
    pub fn continuous_joint(&self, joint: usize) -> ContinuousJoint {
        let (gains, precision) = (self.gains(), &self.precision[joint]);
        let (kappa_mu, kappa_a) = (gains.kappa_mu[joint], gains.kappa_a[joint]);
        let rate = gains.reference_time_constant_s[joint].recip();
        let [a, alpha, beta, gamma] =
            [precision.q, precision.dq, precision.mu, precision.dmu].map(|p| kappa_mu * p.value());
        let [u_q, u_dq] = [precision.q, precision.dq].map(|p| kappa_a * p.value());
        #[rustfmt::skip]
        let system = SMatrix::<f64, 5, 5>::new(
            0.0,   0.0,                     0.0,                                  0.0,                0.0,
            a,     -a - beta * rate * rate, 1.0 - beta * rate,                    0.0,                0.0,
            0.0,   -beta * rate,            -alpha - beta - gamma * rate * rate,  1.0 - gamma * rate, 0.0,
            0.0,   0.0,                     -gamma * rate,                        -gamma,             0.0,
            -u_q,  u_q,                     u_dq,                                 0.0,                0.0,
        );
        ContinuousJoint { A: system, b: SVector::<f64, 5>::new(1.0, 0.0, alpha, 0.0, -u_dq) }
    }

    /// The sampled linear controller of one joint, counted from 0 at the base.
    ///
    /// # Panics
    /// If `joint >= N`.
    pub fn sampled_joint(&self, joint: usize) -> SampledJoint {
        let ContinuousJoint { A, b } = self.continuous_joint(joint);
        let h = self.step_s();
        // Rows and columns of m, mu', mu'' are 1 to 3 of z; e is column 0.
        let mut state = SMatrix::<f64, 4, 4>::identity();
        let mut input = SMatrix::<f64, 4, 2>::zeros();
        for row in 0..3 {
            for column in 0..3 {
                state[(row, column)] += h * A[(row + 1, column + 1)];
            }
            input[(row, 0)] = h * A[(row + 1, 0)];
            input[(row, 1)] = h * b[row + 1];
        }
        // u+ = u + h (A[4,0] e + A[4,1] m+ + A[4,2] mu'+ + b[4] dq).
        for column in 0..3 {
            state[(3, column)] = h * (A[(4, 1)] * state[(0, column)] + A[(4, 2)] * state[(1, column)]);
        }
        for column in 0..2 {
            input[(3, column)] = h * (A[(4, 1)] * input[(0, column)] + A[(4, 2)] * input[(1, column)]);
        }
        input[(3, 0)] += h * A[(4, 0)];
        input[(3, 1)] += h * b[4];
        SampledJoint { F: state, G: input }
    }
}
