//! The adaptive loop near a goal with its adaptive gains frozen: a PI controller in the sliding variable, and when it is stable.
//!
//! With `λ = P₂/P₃`, `e = q − goal` and `s = q̇ + λ e` the modified error near a goal at rest is `q_e = −P₃ s`. The terms of first order in the
//! error are `k_P q_e + k_I ∫ q_e dt` with
//!
//! ```text
//! k_P = α₁ + (e₀₁ + f₀₁) |q_r|²     k_I = α₂ + (e₀₂ + f₀₂) |q_r|²     K = P₃ k_P     K_I = P₃ k_I
//! ```
//!
//! so that one inertia `m` with gravity compensated, and with what K₀ and K₁ have accumulated (`K₀*`, `K₁*`), has the characteristic polynomial
//!
//! ```text
//! m s³ + (K − K₁*) s² + (λ K + K_I − K₀*) s + λ K_I
//! ```
//!
//! On `q_e = 0` the error decays at λ, whatever the other gains are. In the released code the sums lack the step, so there
//! `k_I = α₂ + (e₀₂ + f₀₂) |q_r|²/h`.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | P₂, P₃ | `p2`, `p3` | those of l₁/ω² and l₂/ω |
//! | λ      | `lambda_per_s` | 1/s |
//! | K, K_I | `damping_n_m_s_per_rad`, `stiffness_n_m_per_rad` | N m s/rad, N m/rad |
//! | m      | `inertia_kg_m2` | kg m² |
//!
//! Limits: continuous time, equal gains on the joints that share `m`, gravity compensated, adaptive gains constant. The adaptive loop itself has neutral directions
//! (its gains may rest anywhere) and no exponential rate.

use super::params::{MracLaw, MracParams};

/// Weights of position and velocity error in the modified error `q_e = P₂ (q_r − q) + P₃ (q̇_r − q̇)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorWeights {
    /// `l₁/(2ω²)`.
    pub p2: f64,
    /// `l₂/(4ζω) + l₁/(4ζω³)`.
    pub p3: f64,
}

impl ErrorWeights {
    /// The second row of P in `AᵀP + P A = −diag(l₁, l₂)`, A the reference model; `omega` in rad/s.
    pub(super) fn new(omega: f64, zeta: f64, l1: f64, l2: f64) -> Self {
        let p2 = l1 / (2.0 * omega * omega);
        let p3 = l2 / (4.0 * zeta * omega) + l1 / (4.0 * zeta * omega * omega * omega);
        Self { p2, p3 }
    }

    /// `λ = P₂/P₃`, 1/s: the rate at which the error decays while q_e = 0.
    pub fn lambda_per_s(&self) -> f64 {
        self.p2 / self.p3
    }
}

/// One joint's loop near a goal with frozen adaptive gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrozenGainLoop {
    /// λ, 1/s.
    pub lambda_per_s: f64,
    /// `K = P₃ k_P`, N m s/rad.
    pub damping_n_m_s_per_rad: f64,
    /// `K_I = P₃ k_I`, N m/rad.
    pub stiffness_n_m_per_rad: f64,
    /// `K₀*`, the accumulated gain of the position, N m/rad.
    pub accumulated_k0_n_m_per_rad: f64,
    /// `K₁*`, the accumulated gain of the velocity, N m s/rad.
    pub accumulated_k1_n_m_s_per_rad: f64,
}

impl<const N: usize> MracParams<N> {
    /// The loop of one joint, counted from 0 at the base, near a goal with `|q_r|² = goal_squared_rad2`; nothing accumulated yet.
    ///
    /// # Panics
    /// If `joint >= N`.
    pub fn frozen_gain_loop(&self, joint: usize, goal_squared_rad2: f64) -> FrozenGainLoop {
        let (gains, weights) = (self.gains(), self.error_weights()[joint]);
        let summed = match gains.law {
            MracLaw::ReferenceModel | MracLaw::RawGoal => goal_squared_rad2,
            MracLaw::ReleasedCode => goal_squared_rad2 / self.step_s(),
        };
        let k_p = gains.alpha[0][joint] + (gains.e0[0][joint] + gains.f0[0][joint]) * goal_squared_rad2;
        let k_i = gains.alpha[1][joint] + (gains.e0[1][joint] + gains.f0[1][joint]) * summed;
        FrozenGainLoop {
            lambda_per_s: weights.lambda_per_s(),
            damping_n_m_s_per_rad: weights.p3 * k_p,
            stiffness_n_m_per_rad: weights.p3 * k_i,
            accumulated_k0_n_m_per_rad: 0.0,
            accumulated_k1_n_m_s_per_rad: 0.0,
        }
    }
}

impl FrozenGainLoop {
    /// Coefficients of the characteristic polynomial, from s³ down to s⁰.
    pub fn characteristic(&self, inertia_kg_m2: f64) -> [f64; 4] {
        let lambda = self.lambda_per_s;
        [
            inertia_kg_m2,
            self.damping_n_m_s_per_rad - self.accumulated_k1_n_m_s_per_rad,
            lambda * self.damping_n_m_s_per_rad + self.stiffness_n_m_per_rad - self.accumulated_k0_n_m_per_rad,
            lambda * self.stiffness_n_m_per_rad,
        ]
    }

    /// Whether all roots of [`FrozenGainLoop::characteristic`] have negative real parts, by Hurwitz's conditions in floating point.
    pub fn is_stable(&self, inertia_kg_m2: f64) -> bool {
        let [c3, c2, c1, c0] = self.characteristic(inertia_kg_m2);
        c3 > 0.0 && c2 > 0.0 && c0 > 0.0 && c2 * c1 > c3 * c0
    }
}

#[cfg(test)]
mod tests {
    use super::super::params::tests::published;
    use super::*;

    #[test]
    fn the_weights_solve_the_lyapunov_equation() {
        let (omega, zeta, l1, l2) = (3.0, 0.7, 1.3, 0.4);
        let ErrorWeights { p2, p3 } = ErrorWeights::new(omega, zeta, l1, l2);
        // A'P + P A = -diag(l1, l2), A = [[0, 1], [-w^2, -2 zeta w]], P = [[p1, p2], [p2, p3]], entry by entry; (1, 2) fixes p1.
        assert!((-2.0 * omega * omega * p2 + l1).abs() < 1e-12);
        assert!((2.0 * p2 - 4.0 * zeta * omega * p3 + l2).abs() < 1e-12);
    }

    #[test]
    fn the_published_error_decays_at_four_fifths_per_second() {
        let params = MracParams::new(&published(MracLaw::RawGoal), 1e-3).expect("published gains");
        assert!((params.error_weights()[0].lambda_per_s() - 0.8).abs() < 1e-12);
    }

    #[test]
    fn hurwitz_agrees_with_a_factored_polynomial() {
        // m s^3 + ... = (s + 1)(s^2 + 2 d s + 4): stable exactly for d > 0. lambda = 1 turns the roots' sums into K and K_I.
        for d in [-0.4, -0.1, 0.1, 0.4] {
            let (c2, c1, c0) = (1.0 + 2.0 * d, 2.0 * d + 4.0, 4.0);
            let frozen = FrozenGainLoop {
                lambda_per_s: 1.0,
                stiffness_n_m_per_rad: c0,
                damping_n_m_s_per_rad: 3.0,
                accumulated_k1_n_m_s_per_rad: 3.0 - c2,
                accumulated_k0_n_m_per_rad: 3.0 + c0 - c1,
            };
            assert_eq!(frozen.is_stable(1.0), d > 0.0, "d = {d}");
        }
    }

    #[test]
    fn accumulated_stiffness_destabilises_the_published_gains() {
        let params = MracParams::new(&published(MracLaw::RawGoal), 1e-3).expect("published gains");
        let frozen = params.frozen_gain_loop(0, 1.0);
        // P3 = 0.15625, k_P = 70, k_I = 7: K (lambda K + K_I - K0*) > lambda K_I up to K0* = 9.76 at m = 1.
        for (accumulated_k0_n_m_per_rad, stable) in [(0.0, true), (9.7, true), (9.8, false)] {
            assert_eq!(FrozenGainLoop { accumulated_k0_n_m_per_rad, ..frozen }.is_stable(1.0), stable);
        }
    }

    #[test]
    fn the_released_sums_act_a_thousand_times_stronger() {
        let [paper, released] = [MracLaw::RawGoal, MracLaw::ReleasedCode]
            .map(|law| MracParams::new(&published(law), 1e-3).expect("published gains").frozen_gain_loop(0, 2.0));
        let alpha2 = 4.0 * 0.15625;
        let ratio = (released.stiffness_n_m_per_rad - alpha2) / (paper.stiffness_n_m_per_rad - alpha2);
        assert!((ratio - 1000.0).abs() < 1e-9);
    }
}
