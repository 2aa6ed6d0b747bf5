//! Where the joints are and how they move.

use std::f64::consts::PI;

use certune_dynamics::{Joints, Robot, State};
use proptest::array::uniform;
use proptest::prelude::*;

use crate::draw::within;

/// The fastest joint of [`joint_state`], rad/s: what the Panda's fastest joint does.
pub const FASTEST_RAD_PER_S: f64 = 2.61;

/// One number per joint within `±bound`, in the unit of `bound`: velocities, accelerations, torques. Shrinks to 0.
///
/// # Panics
/// Unless `bound` is finite and at least 0.
pub fn joints_within<const N: usize>(bound: f64) -> impl Strategy<Value = Joints<N>> + Clone {
    uniform::<_, N>(within(-bound..=bound, 0.0)).prop_map(Joints::from)
}

/// Any configuration: every joint anywhere in `[-π, π]` rad. Shrinks to 0.
pub fn configuration<const N: usize>() -> impl Strategy<Value = Joints<N>> + Clone {
    joints_within(PI)
}

/// A configuration within the limits of `robot`, its ends included; a joint without limits counts as one with `[-π, π]`
/// rad. Shrinks to 0 or, where a joint cannot reach 0, to the end nearest to it.
///
/// # Panics
/// When the robot has not `N` joints.
pub fn configuration_within<const N: usize>(robot: &Robot) -> impl Strategy<Value = Joints<N>> + Clone + use<N> {
    assert!(robot.joints() == N, "{} has {} joints, asked for {N}", robot.name(), robot.joints());
    let ends: [_; N] = std::array::from_fn(|joint| {
        let limits = &robot.links()[joint].limits;
        // An end stop beyond half a turn on one side only: the other end follows a turn away.
        let (lower, upper) = match (limits.lower_rad.is_finite(), limits.upper_rad.is_finite()) {
            (true, true) => (limits.lower_rad, limits.upper_rad),
            (true, false) => (limits.lower_rad, limits.lower_rad.max(-PI) + 2.0 * PI),
            (false, true) => (limits.upper_rad.min(PI) - 2.0 * PI, limits.upper_rad),
            (false, false) => (-PI, PI),
        };
        within(lower..=upper, 0.0)
    });
    ends.prop_map(Joints::from)
}

/// Any configuration, every joint at up to [`FASTEST_RAD_PER_S`] either way. Shrinks to rest in 0.
pub fn joint_state<const N: usize>() -> impl Strategy<Value = State<N>> + Clone {
    (configuration(), joints_within(FASTEST_RAD_PER_S)).prop_map(|(q, dq)| State { q, dq })
}
