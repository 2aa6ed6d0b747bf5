//! Model reference adaptive control (MRAC): the gains of a feedback and a feed-forward grow with the tracking error.
//!
//! With the modified error `q_e = P₂ (q_r − q) + P₃ (q̇_r − q̇)` the torque is
//!
//! ```text
//! u  = K₀ q + K₁ q̇ + Q₀ q_r + Q₁ q̇_r + f
//! f  = α₁ q_e     + α₂ ∫ q_e dt     + α₃ d/dt q_e
//! K₀ = e₀₁ q_e qᵀ   + e₀₂ ∫ q_e qᵀ dt   + e₀₃ d/dt (q_e qᵀ)
//! K₁ = e₁₁ q_e q̇ᵀ   + e₁₂ ∫ q_e q̇ᵀ dt   + e₁₃ d/dt (q_e q̇ᵀ)
//! Q₀ = f₀₁ q_e q_rᵀ + f₀₂ ∫ q_e q_rᵀ dt + f₀₃ d/dt (q_e q_rᵀ)
//! Q₁ = f₁₁ q_e q̇_rᵀ + f₁₂ ∫ q_e q̇_rᵀ dt + f₁₃ d/dt (q_e q̇_rᵀ)
//! ```
//!
//! with every α, e and f a diagonal matrix over the joints, and `P₂ = l₁/(2ω²)`, `P₃ = l₂/(4ζω) + l₁/(4ζω³)` from the Lyapunov equation
//! of the reference model `d/dt (q_r, q̇_r) = (q̇_r, ω² (goal − q_r) − 2ζω q̇_r)` with `Q = diag(l₁, l₂)`. All integrals start at zero.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | q_r, q̇_r | `q_ref`, `dq_ref` | reference position and velocity | rad, rad/s |
//! | q_e    | `q_e` | modified error | rad s² for l₁, l₂ in s⁰, s² |
//! | ω, ζ   | `omega_rad_per_s`, `zeta` | frequency and damping of the reference model | rad/s, 1 |
//! | l₁, l₂ | `l1`, `l2` | weights of the Lyapunov equation | given as plain numbers |
//! | αₖ, e₀ₖ, e₁ₖ, f₀ₖ, f₁ₖ | `alpha[k-1]`, `e0[k-1]`, ... | proportional (k = 1), integral (2) and derivative (3) gains | given as plain numbers |
//! | K₀, K₁, Q₀, Q₁ | `K0`, `K1`, `Q0`, `Q1` | adaptive gains | N m/rad, N m s/rad |
//!
//! **Three named laws** ([`MracLaw`]), because the published figures belong to only one of them:
//!
//! - [`ReferenceModel`](MracLaw::ReferenceModel), the paper's equations: q_r is the output of the reference model, driven by the goal and started
//!   at the measured position at rest.
//! - [`RawGoal`](MracLaw::RawGoal), the same equations with q_r = goal and q̇_r = 0.
//! - [`ReleasedCode`](MracLaw::ReleasedCode), what the authors released and ran: the raw goal; the integrals of the four outer products are plain sums
//!   over the samples, without the step h, so that at 1 kHz their gains act 1000 times stronger than written; and K₁'s integral term reads
//!   K₀'s sum (`Σ q_e qᵀ` up to *and including* the present sample) in place of `Σ q_e q̇ᵀ`. There are no derivative terms.
//!
//! **Sampling.** Integrals are forward Euler sums that a step reads before it adds to them (but for the one exception above). Derivatives are
//! the difference quotients of the products between two samples, zero at the first. The reference model advances by semi-implicit Euler at the
//! end of a step: the first step sees `q_r = q`.
//!
//! Sources: Pezzato, Ferrari, Hernández Corbato, *A Novel Adaptive Controller for Robot Manipulators Based on Active Inference*, IEEE Robotics and
//! Automation Letters 5(2), 2020, for the equations; after Tarokh, *Decentralized digital adaptive control of robot motion*, and Horowitz and
//! Tomizuka, *An adaptive control scheme for mechanical manipulators*; the authors' repositories `cpezzato/panda_simulation` and
//! `cpezzato/active_inference` for the deviations of the released code.
//!
//! Limits: the integrals never leak, so the adaptive gains drift with every change of goal; a goal that jumps makes the derivative terms of the two raw-goal
//! laws jump by `1/h`.

mod law;
pub mod linear;
mod params;

pub use law::{AdaptiveGains, Mrac, MracState, Products, Signals};
pub use linear::{ErrorWeights, FrozenGainLoop};
pub use params::{MracGains, MracLaw, MracParams};
