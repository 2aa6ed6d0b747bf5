//! A goal that moves no faster than allowed.
//!
//! The goal handed to the controller follows the user's goal along the straight line in joint space, one sample at a time:
//!
//! ```text
//! d = goal - g,   g+ = goal                 if |d| <= v h
//!                 g+ = g + d v h / |d|      else
//! ```
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | g      | `at` | the goal handed on | rad |
//! | v      | `speed_rad_per_s` | speed of the goal, 2-norm over the joints | rad/s |
//! | h      | `step_s` | sampling step | s |
//!
//! Why: a Lyapunov function bounds how far from its goal an arm may start; a goal that moves slowly never leaves the arm that far behind.
//! The norm is the one in which such a speed is certified.

use certune_linsys::{Joints, Real};

use crate::param::{Expected, ParamError, positive_step};

/// Share by which a step stays below `v h`, so that the roundings of its coordinates (2e-16 of an angle) cannot carry it beyond.
const ROUNDING: f64 = 1e-9;

/// Moves a goal towards the user's goal at a bounded speed. Equations in the source's module.
///
/// It has no memory: the caller keeps the goal handed on last.
///
/// ```
/// use certune_control::GoalRateLimiter;
/// use certune_linsys::Joints;
///
/// let limiter = GoalRateLimiter::new(0.5, 1e-3)?;
/// let (goal, mut at) = (Joints::<2>::new(0.3, -0.4), Joints::<2>::zeros());
/// let mut samples = 0;
/// while at != goal {
///     at = limiter.step(&at, &goal);
///     samples += 1;
/// }
/// // Half a radian at half a radian per second.
/// assert_eq!(samples, 1001);
/// # Ok::<(), certune_control::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalRateLimiter {
    step_rad: f64,
}

impl GoalRateLimiter {
    /// A limiter for goals of at most `speed_rad_per_s` (2-norm over the joints), sampled each `step_s`.
    ///
    /// # Errors
    /// [`ParamError::Shared`] unless both are positive and finite, and so is the way of one sample.
    pub fn new(speed_rad_per_s: f64, step_s: f64) -> Result<Self, ParamError> {
        let step_rad = speed_rad_per_s * positive_step(step_s)? * (1.0 - ROUNDING);
        (speed_rad_per_s > 0.0 && step_rad > 0.0 && step_rad.is_finite()).then_some(Self { step_rad }).ok_or(
            ParamError::Shared {
                parameter: "goal_speed_rad_per_s",
                value: speed_rad_per_s,
                expected: Expected::Positive,
            },
        )
    }

    /// The goal for the next sample: from `at` towards `goal`, both in rad, base to tip.
    ///
    /// Arrives at `goal` to the bit. While `goal` holds a number that is not finite, or is so far away that its distance is not,
    /// `at` is returned. O(N), no heap.
    pub fn step<const N: usize, T: Real>(&self, at: &Joints<N, T>, goal: &Joints<N, T>) -> Joints<N, T> {
        let step = T::from_f64(self.step_rad);
        let way = goal - at;
        let distance = way.dot(&way).sqrt();
        let fraction = step / distance;
        Joints::from_fn(|joint, _| {
            let (at, goal) = (at[joint], goal[joint]);
            let nearer = distance.choose(T::from_f64(f64::MAX), at + way[joint] * fraction, at);
            distance.choose(step, goal, nearer)
        })
    }
}
