//! What every controller takes, returns and promises.

use core::fmt::Debug;

use certune_linsys::{Joints, Real};

/// What the joint sensors report at one sampling instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement<const N: usize, T: Real = f64> {
    /// Joint positions, rad, base to tip.
    pub q: Joints<N, T>,
    /// Joint velocities, rad/s, base to tip.
    pub dq: Joints<N, T>,
}

/// A sampled joint-space controller as a pure function.
///
/// All memory of a run is in [`Controller::State`]; the controller itself is immutable. The same inputs give the same
/// outputs to the bit, on any thread.
pub trait Controller<const N: usize, T: Real = f64> {
    /// What the controller remembers from one step to the next.
    type State: Copy + Debug;

    /// The state in which a run begins: beliefs and references at the measurement `at`, everything else at zero.
    fn start(&self, at: &Measurement<N, T>) -> Self::State;

    /// One sampling step: the next state, and the joint torques in N m to hold until the next sample.
    ///
    /// `goal` in rad, same order as the measurement. Cannot fail; no heap.
    fn step(
        &self,
        state: &Self::State,
        measurement: &Measurement<N, T>,
        goal: &Joints<N, T>,
    ) -> (Self::State, Joints<N, T>);

    /// [`Controller::step`] in place: `state` becomes the next one, to the bit; returns the torques. For loops that do not keep the old state.
    #[inline(always)]
    fn advance(&self, state: &mut Self::State, measurement: &Measurement<N, T>, goal: &Joints<N, T>) -> Joints<N, T> {
        let (next, u) = self.step(state, measurement, goal);
        *state = next;
        u
    }
}
