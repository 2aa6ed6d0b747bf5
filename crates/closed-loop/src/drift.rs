//! How far the adaptive gains drift while an arm goes round its goals.
//!
//! The integrals of the adaptive controller never leak: every change of goal moves them, and nothing brings them back. Proofs about the frozen loop hold up to some accumulated
//! gain; this says, by simulation of one arm, when it is reached. The arm compensates its gravity exactly, the torque is held for one sample and not limited, joint friction
//! is the model's. Semi-implicit Euler at the controller's step.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | \|K0\|, \|K1\|, \|Q0\|, \|Q1\| | Frobenius norms of the adaptive gains | N m/rad, N m s/rad |
//! | \|f\| | norm of the feed-forward | N m |
//!
//! Limits: one arm and one order of goals, a simulation: evidence, not a bound.

use certune_control::mrac::{AdaptiveGains, Mrac, MracParams};
use certune_control::{Controller, Measurement};
use certune_dynamics::{Model, State, forward_dynamics};
use certune_linsys::Joints;

/// The adaptive gains at the end of one stay at a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainDrift {
    /// Time since the start, s.
    pub time_s: f64,
    /// Distance from the goal, rad.
    pub error_rad: f64,
    /// |K0|, N m/rad.
    pub k0: f64,
    /// |K1|, N m s/rad.
    pub k1: f64,
    /// |Q0|, N m/rad.
    pub q0: f64,
    /// |Q1|, N m s/rad.
    pub q1: f64,
    /// |f|, N m.
    pub f: f64,
}

/// Visits `goals` in turn, `stay_s` each, until `stays` of them are done; starts at rest in the last goal. One entry for each stay, fewer if the state leaves the numbers.
pub fn gain_drift<const N: usize>(
    model: &Model<N>,
    params: &MracParams<N>,
    goals: &[Joints<N>],
    stay_s: f64,
    stays: usize,
) -> Vec<GainDrift> {
    let Some(&last) = goals.last() else { return Vec::new() };
    let model = model.with_gravity([0.0; 3]);
    let controller = Mrac::<N>::new(params);
    let step_s = params.step_s();
    let samples = (stay_s / step_s).round().max(1.0) as usize;
    let mut at = State::at_rest(last);
    let seen = |at: &State<N>| Measurement { q: at.q, dq: at.dq };
    let mut memory = controller.start(&seen(&at));
    let mut drift = Vec::with_capacity(stays);
    for (stay, goal) in goals.iter().cycle().take(stays).enumerate() {
        for _ in 0..samples {
            let torque = controller.advance(&mut memory, &seen(&at), goal);
            at.dq += forward_dynamics(&model, &at, &torque) * step_s;
            at.q += at.dq * step_s;
        }
        if !at.q.iter().chain(at.dq.iter()).all(|x| x.is_finite()) {
            break;
        }
        let AdaptiveGains { K0: k0, K1: k1, Q0: q0, Q1: q1, f } = controller.adaptive_gains(&memory, &seen(&at), goal);
        drift.push(GainDrift {
            time_s: step_s * (samples * (stay + 1)) as f64,
            error_rad: (at.q - goal).norm(),
            k0: k0.norm(),
            k1: k1.norm(),
            q0: q0.norm(),
            q1: q1.norm(),
            f: f.norm(),
        });
    }
    drift
}
