//! A run kept for plots: one row each `every` samples, with whatever else a hook reads off the controller.

use certune_control::aic::{Aic, AicState};
use certune_linsys::Joints;

use crate::simulate::{Recorder, Sample};

/// One row of a [`Trajectory`], at the start of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<const N: usize, D> {
    /// Time, s.
    pub t_s: f64,
    /// Positions, rad.
    pub q: Joints<N>,
    /// Velocities, rad/s.
    pub dq: Joints<N>,
    /// The goal, rad.
    pub goal: Joints<N>,
    /// Torque the motor gives, N m.
    pub tau: Joints<N>,
    /// What the hook read.
    pub diagnostics: D,
}

/// Records a row each `every` samples; `hook` turns a sample into the row's diagnostics.
///
/// ```
/// # use certune_closed_loop::Trajectory;
/// // Nothing but positions, velocities and torques, each 10 samples:
/// let recorder = Trajectory::<7, (), _>::new(10, |_: &certune_closed_loop::Sample<'_, 7, ()>| ());
/// assert!(recorder.rows().is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Trajectory<const N: usize, D, H> {
    every: u64,
    hook: H,
    rows: Vec<Row<N, D>>,
}

impl<const N: usize, D, H> Trajectory<N, D, H> {
    /// A recorder without rows; `every` = 0 counts as 1.
    pub fn new(every: u64, hook: H) -> Self {
        Self { every: every.max(1), hook, rows: Vec::new() }
    }

    /// The rows in their order.
    pub fn rows(&self) -> &[Row<N, D>] {
        &self.rows
    }

    /// The rows, handed over.
    pub fn into_rows(self) -> Vec<Row<N, D>> {
        self.rows
    }
}

impl<const N: usize, S, D, H: FnMut(&Sample<'_, N, S>) -> D> Recorder<N, S> for Trajectory<N, D, H> {
    fn sample(&mut self, sample: &Sample<'_, N, S>) {
        if sample.step.is_multiple_of(self.every) {
            let (t_s, q, dq, goal, tau) = (sample.t_s, sample.at.q, sample.at.dq, sample.goal, sample.tau);
            self.rows.push(Row { t_s, q, dq, goal, tau, diagnostics: (self.hook)(sample) });
        }
    }
}

/// What the active inference controller believes, and how much that leaves unexplained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AicDiagnostics<const N: usize> {
    /// Belief about the positions, rad.
    pub mu: Joints<N>,
    /// Belief about the velocities, rad/s.
    pub dmu: Joints<N>,
    /// Free energy of the updated beliefs at this sample's measurement.
    pub free_energy: f64,
}

/// The hook that reads [`AicDiagnostics`].
pub fn aic_diagnostics<const N: usize>(
    aic: &Aic<N>,
) -> impl Fn(&Sample<'_, N, AicState<N>>) -> AicDiagnostics<N> + use<'_, N> {
    |sample| AicDiagnostics {
        mu: sample.state.mu,
        dmu: sample.state.dmu,
        free_energy: aic.free_energy(sample.state, &sample.measurement, &sample.goal),
    }
}
