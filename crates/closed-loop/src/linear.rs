//! Plant and controller linearised at rest in a configuration, in continuous time and sampled.
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
//! The adaptive controller is linearised with its adaptive gains frozen and nothing accumulated, the reference at rest at the goal. With `s = dq + lambda e` and
//! `w = int s dt` it is `u~ = -K s - K_I w`, so the state is (e, dq, w), then u~ of 1 .. k samples ago; sampled, `w⁺ = w + h s`. The reference model beside it
//! is stable by construction, and the adaptive gains are neutral directions that have no eigenvalue here.
//!
//! Source of the controllers' matrices: [`AicParams::continuous_joint`], [`AicParams::sampled_joint`] and [`MracParams::frozen_gain_loop`]. Limits: torque limits are taken as
//! inactive, and gravity compensation as exact.

use certune_control::aic::AicParams;
use certune_control::mrac::MracParams;
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

/// The arm as a step of h sees it: Coulomb's slope c = f_c/ε, implicit, is more inertia in the step and no other change.
fn implicit<const N: usize>(model: &Model<N>, h: f64) -> Model<N> {
    let coulomb = friction_slope(model, &Joints::zeros()) - model.viscous_n_m_s_per_rad();
    model.with_rotor_inertia(&(model.rotor_inertia_kg_m2() + coulomb * h))
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
    let arm = arm(&implicit(model, h), q, gravity_compensated);
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

/// Blocks of the adaptive loop's state: e, dq, w.
const ADAPTIVE_BLOCKS: usize = 3;
const W: usize = 2;

/// Rows of `u~ = -K s - K_I w` over the state, and of `s = dq + lambda e`.
fn frozen<const N: usize>(params: &MracParams<N>, q: &Joints<N>, order: usize) -> [DMatrix<f64>; 2] {
    let (mut torque, mut sliding) = (DMatrix::zeros(N, order), DMatrix::zeros(N, order));
    for joint in 0..N {
        let found = params.frozen_gain_loop(joint, q.norm_squared());
        sliding[(joint, E * N + joint)] = found.lambda_per_s;
        sliding[(joint, DQ * N + joint)] = 1.0;
        torque[(joint, E * N + joint)] = -found.damping_n_m_s_per_rad * found.lambda_per_s;
        torque[(joint, DQ * N + joint)] = -found.damping_n_m_s_per_rad;
        torque[(joint, W * N + joint)] = -found.stiffness_n_m_per_rad;
    }
    [torque, sliding]
}

/// The adaptive loop `x' = A x` of 3N states about rest in `q`, its adaptive gains frozen.
///
/// # Errors
/// [`LoopError::NotFinite`] when `q` is not finite.
pub fn linearise_mrac<const N: usize>(
    model: &Model<N>,
    q: &Joints<N>,
    params: &MracParams<N>,
    gravity_compensated: bool,
) -> Result<Loop<Continuous>, LoopError> {
    let arm = arm(model, q, gravity_compensated);
    let order = ADAPTIVE_BLOCKS * N;
    let [torque, sliding] = frozen(params, q, order);
    let mut a = DMatrix::zeros(order, order);
    a.rows_mut(DQ * N, N).copy_from(&accelerations(&arm, &torque));
    a.rows_mut(W * N, N).copy_from(&sliding);
    for joint in 0..N {
        a[(E * N + joint, DQ * N + joint)] = 1.0;
    }
    Loop::continuous(a)
}

/// The adaptive loop `x+ = A x` of `(3 + k) N` states about rest in `q`, its adaptive gains frozen, with the step of `params` and `delay_samples` = k.
///
/// # Errors
/// [`LoopError::NotFinite`] when `q` is not finite.
pub fn linearise_mrac_sampled<const N: usize>(
    model: &Model<N>,
    q: &Joints<N>,
    params: &MracParams<N>,
    gravity_compensated: bool,
    delay_samples: usize,
) -> Result<Loop<Discrete>, LoopError> {
    let h = params.step_s();
    let arm = arm(&implicit(model, h), q, gravity_compensated);
    let order = (ADAPTIVE_BLOCKS + delay_samples) * N;
    let [torque, sliding] = frozen(params, q, order);
    let mut a = DMatrix::zeros(order, order);
    let ago = |samples: usize, joint: usize| (ADAPTIVE_BLOCKS + samples - 1) * N + joint;
    let mut acting = torque.clone();
    if delay_samples > 0 {
        a.rows_mut(ago(1, 0), N).copy_from(&torque);
        acting.fill(0.0);
        for joint in 0..N {
            acting[(joint, ago(delay_samples, joint))] = 1.0;
            for samples in 2..=delay_samples {
                a[(ago(samples, joint), ago(samples - 1, joint))] = 1.0;
            }
        }
    }
    let mut velocity = accelerations(&arm, &acting) * h;
    for joint in 0..N {
        velocity[(joint, DQ * N + joint)] += 1.0;
    }
    a.rows_mut(E * N, N).copy_from(&(&velocity * h));
    a.rows_mut(DQ * N, N).copy_from(&velocity);
    a.rows_mut(W * N, N).copy_from(&(sliding * h));
    for joint in 0..N {
        a[(E * N + joint, E * N + joint)] += 1.0;
        a[(W * N + joint, W * N + joint)] += 1.0;
    }
    Loop::discrete(a, h)
}

/// Rows of ddq over the state, from the rows of the torque that acts.
fn accelerations<const N: usize>(arm: &Linearisation<N>, acting: &DMatrix<f64>) -> DMatrix<f64> {
    let by_torque = DMatrix::from_fn(N, N, |row, column| arm.ddq_dtau[(row, column)]);
    let mut rows = by_torque * acting;
    for row in 0..N {
        for column in 0..N {
            rows[(row, E * N + column)] += arm.ddq_dq[(row, column)];
            rows[(row, DQ * N + column)] += arm.ddq_ddq[(row, column)];
        }
    }
    rows
}
