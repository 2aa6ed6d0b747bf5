//! Plant and active inference controller linearised at rest in a configuration, in continuous time and sampled.
//!
//! The arm rests in q, which is also the goal; the controller holds what gravity asks of it. With `e = q - goal`, `m = mu - goal`,
//! `u~ = u - u*`, `G = dg/dq` at the goal (zero when the arm compensates its gravity) and D the friction's slope at rest:
//!
//! ```text
//! continuous   e' = dq     M dq' = -G e - D dq + u~                       controller: A, b of each joint
//! sampled      M_h (dq⁺ - dq)/h = -G e - D dq + v     e⁺ = e + h dq⁺      controller: F, G of each joint
//! ```
//!
//! The sampled loop is [`simulate`](mod@crate::simulate)'s own step: v is the torque u~⁺ of this sample (no delay) or of k samples ago, and `M_h = M + h diag c`
//! carries the implicit Coulomb friction of slope c. Without Coulomb friction `M_h = M`.
//!
//! | symbol | blocks of N, in this order | unit |
//! |--------|----------------------------|------|
//! | x (continuous) | e, dq, m, mu', mu'', u~ | rad, rad/s, rad, rad/s, rad/s², N m |
//! | x (sampled)    | the same, then u~ of 1 .. k-1 samples ago | the same |
//!
//! Source of the controller's matrices: [`AicParams::continuous_joint`] and [`AicParams::sampled_joint`]. Limits: torque limits are taken as
//! inactive, and gravity compensation as exact.

use certune_control::aic::AicParams;
use certune_dynamics::{Linearisation, Model, State, friction_slope, gravity_torque, linearise};
use certune_linsys::{Continuous, Discrete, Joints, Loop, LoopError};
use nalgebra::DMatrix;

/// Blocks of the continuous loop's state.
const BLOCKS: usize = 6;
const E: usize = 0;
const DQ: usize = 1;
const U: usize = 5;

/// The linearised arm about rest in `q`: `dq' = by_position e + by_velocity dq + by_torque u~`.
fn arm<const N: usize>(model: &Model<N>, q: &Joints<N>, gravity_compensated: bool) -> Linearisation<N> {
    let mut arm = linearise(model, &State::at_rest(*q), &gravity_torque(model, q));
    if gravity_compensated {
        arm.ddq_dq.fill(0.0); // the compensation's slope cancels gravity's
    }
    arm
}

/// The loop `x' = A x` of 6N states about rest in `q`.
///
/// # Errors
/// [`LoopError::NotFinite`] when `q` is not finite.
pub fn linearise_aic<const N: usize>(
    model: &Model<N>,
    q: &Joints<N>,
    params: &AicParams<N>,
    gravity_compensated: bool,
) -> Result<Loop<Continuous>, LoopError> {
    let arm = arm(model, q, gravity_compensated);
    let mut a = DMatrix::zeros(BLOCKS * N, BLOCKS * N);
    for joint in 0..N {
        a[(E * N + joint, DQ * N + joint)] = 1.0;
        for column in 0..N {
            a[(DQ * N + joint, E * N + column)] = arm.ddq_dq[(joint, column)];
            a[(DQ * N + joint, DQ * N + column)] = arm.ddq_ddq[(joint, column)];
            a[(DQ * N + joint, U * N + column)] = arm.ddq_dtau[(joint, column)];
        }
        // The joint's z = (e, m, mu', mu'', u~) is blocks 0, 2, 3, 4, 5; its first row is e' = dq, set above.
        let controller = params.continuous_joint(joint);
        let block = |z: usize| if z == 0 { E } else { z + 1 };
        for row in 1..5 {
            for column in 0..5 {
                a[(block(row) * N + joint, block(column) * N + joint)] = controller.A[(row, column)];
            }
            a[(block(row) * N + joint, DQ * N + joint)] = controller.b[row];
        }
    }
    Loop::continuous(a)
}

/// The loop `x+ = A x` of `6N + max(k - 1, 0) N` states about rest in `q`, with the step of `params` and `delay_samples` = k.
///
/// # Errors
/// [`LoopError::NotFinite`] when `q` is not finite.
pub fn linearise_aic_sampled<const N: usize>(
    model: &Model<N>,
    q: &Joints<N>,
    params: &AicParams<N>,
    gravity_compensated: bool,
    delay_samples: usize,
) -> Result<Loop<Discrete>, LoopError> {
    let h = params.step_s();
    // Coulomb's slope c = f_c/ε, implicit: more inertia in the step, no other change.
    let coulomb = friction_slope(model, &Joints::zeros()) - model.viscous_n_m_s_per_rad();
    let implicit = model.with_rotor_inertia(&(model.rotor_inertia_kg_m2() + coulomb * h));
    let arm = arm(&implicit, q, gravity_compensated);
    let older = delay_samples.saturating_sub(1);
    let order = (BLOCKS + older) * N;
    let mut a = DMatrix::zeros(order, order);
    for joint in 0..N {
        // The joint's x = (m, mu', mu'', u~) is blocks 2 to 5; it reads y = (e, dq), blocks 0 and 1.
        let controller = params.sampled_joint(joint);
        for row in 0..4 {
            for column in 0..4 {
                a[((row + 2) * N + joint, (column + 2) * N + joint)] = controller.F[(row, column)];
            }
            for column in 0..2 {
                a[((row + 2) * N + joint, column * N + joint)] = controller.G[(row, column)];
            }
        }
        for age in 1..=older {
            a[((U + age) * N + joint, (U + age - 1) * N + joint)] = 1.0;
        }
    }
    // The torque that acts, as rows over x: u~⁺ itself, or a block of the state.
    let acting = if delay_samples == 0 {
        a.rows(U * N, N).into_owned()
    } else {
        DMatrix::from_fn(N, order, |row, column| if column == (U + delay_samples - 1) * N + row { 1.0 } else { 0.0 })
    };
    let by_torque = DMatrix::from_fn(N, N, |row, column| arm.ddq_dtau[(row, column)]);
    let mut velocity = by_torque * acting * h;
    for row in 0..N {
        for column in 0..N {
            velocity[(row, E * N + column)] += h * arm.ddq_dq[(row, column)];
            velocity[(row, DQ * N + column)] += h * arm.ddq_ddq[(row, column)];
        }
        velocity[(row, DQ * N + row)] += 1.0;
    }
    a.rows_mut(DQ * N, N).copy_from(&velocity);
    a.rows_mut(E * N, N).copy_from(&(velocity * h));
    for joint in 0..N {
        a[(E * N + joint, E * N + joint)] += 1.0;
    }
    Loop::discrete(a, h)
}
