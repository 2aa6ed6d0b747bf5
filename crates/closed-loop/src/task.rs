//! A scenario bound to an arm of `N` joints: vectors in place of lists, whole steps in place of times.

use certune_control::GoalRateLimiter;
use certune_dynamics::Payload;
use certune_linsys::Joints;
use nalgebra::Vector3;

use crate::scenario::{Integrator, Noise};

/// Steps `from <= k < until`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interval {
    /// First step inside.
    pub from: u64,
    /// First step behind.
    pub until: u64,
}

impl Interval {
    /// Whether step `k` lies inside.
    pub fn contains(&self, k: u64) -> bool {
        self.from <= k && k < self.until
    }
}

/// A goal and the number of steps it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaskSegment<const N: usize> {
    /// The goal, rad.
    pub goal: Joints<N>,
    /// Steps until the next goal.
    pub steps: u64,
}

/// A load and when it is attached.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskPayload {
    /// When it is attached.
    pub during: Interval,
    /// The load.
    pub payload: Payload,
}

/// What pushes the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load<const N: usize> {
    /// Joint torques, N m.
    Torque(Joints<N>),
    /// A force at the flange's origin in world axes, N.
    FlangeForce(Vector3<f64>),
}

/// A disturbance and when it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaskPush<const N: usize> {
    /// When it acts.
    pub during: Interval,
    /// What acts.
    pub load: Load<N>,
}

/// A scenario bound to an arm of `N` joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Task<const N: usize> {
    /// Sampling step, s.
    pub step_s: f64,
    /// Where the arm rests at the start, rad.
    pub start: Joints<N>,
    /// Goals in their order.
    pub segments: Vec<TaskSegment<N>>,
    /// Whether motor torques are limited.
    pub torque_limits: bool,
    /// The fastest that the motor follows a command, N m/s; at once when there is none.
    pub torque_rate_limit_n_m_per_s: Option<f64>,
    /// Moves the controller's goal from one goal to the next; it jumps when there is none.
    pub goal_limiter: Option<GoalRateLimiter>,
    /// How the plant is integrated.
    pub integrator: Integrator,
    /// Sensor noise.
    pub noise: Noise,
    /// Loads.
    pub payloads: Vec<TaskPayload>,
    /// Disturbances.
    pub pushes: Vec<TaskPush<N>>,
}

impl<const N: usize> Task<N> {
    /// Whether runs of both can share a bundle: the same sampling step, integrator, goal limiter and torque-rate limit.
    #[expect(clippy::float_cmp, reason = "the same number is meant")]
    pub fn steps_alike(&self, other: &Self) -> bool {
        self.step_s == other.step_s
            && self.integrator == other.integrator
            && self.goal_limiter == other.goal_limiter
            && self.torque_rate_limit_n_m_per_s == other.torque_rate_limit_n_m_per_s
    }
}
