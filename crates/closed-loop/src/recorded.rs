//! Many runs side by side, each with its own recorder.
//!
//! The recorder of a run sees its samples as those of a single arm, until the run is over or has diverged; of the controller it sees nothing but its torque. Taking the lanes apart
//! costs about as much as a step of the controller, so who needs the figures alone takes [`simulate_many`](crate::simulate_many).

use certune_control::Measurement;
use certune_dynamics::State;
use certune_linsys::{Joints, Lanes};
use certune_simd::{InstructionSet, Kernel};

use crate::metrics::Metrics;
use crate::parameters::Parameters;
use crate::simulate::{Bundle, Progress, Recorder, Run, Sample, bundles};

/// [`simulate_many`](crate::simulate_many), where the run at a place is seen by the recorder at that place; a run without a recorder is seen by nobody.
pub fn simulate_many_recorded<const N: usize, P: Parameters<N>, R: Recorder<N, ()>>(
    runs: &[(Run<'_, N>, &P)],
    recorders: &mut [R],
) -> Vec<Metrics> {
    let set = InstructionSet::widest();
    let mut figures = Vec::with_capacity(runs.len());
    let mut rest = recorders;
    for runs in bundles(set, runs) {
        let (these, others) = rest.split_at_mut(runs.len().min(rest.len()));
        figures.extend(set.run(Recorded { runs, recorders: these }));
        rest = others;
    }
    figures
}

/// A bundle from its start to its end, lane by lane before its recorders.
struct Recorded<'a, 'b, 'r, const N: usize, P, R> {
    runs: &'a [(Run<'b, N>, &'b P)],
    recorders: &'r mut [R],
}

impl<const N: usize, P: Parameters<N>, R: Recorder<N, ()>> Kernel for Recorded<'_, '_, '_, N, P, R> {
    type Output = Vec<Metrics>;
    #[inline(always)]
    fn run<T: Lanes>(self) -> Vec<Metrics> {
        let Some((_, first)) = self.runs.first() else { return Vec::new() };
        let runs: Vec<Run<'_, N>> = self.runs.iter().map(|(run, _)| *run).collect();
        let controller = P::pack::<T>(|lane| self.runs.get(lane).map_or(*first, |(_, params)| *params));
        let mut bundle = Bundle::side_by_side(&runs, &controller);
        let mut apart = Apart { recorders: self.recorders, runs: vec![true; runs.len()] };
        while bundle.progress() == Progress::Running {
            for (lane, runs) in apart.runs.iter_mut().enumerate() {
                *runs = bundle.runs(lane);
            }
            bundle.advance(&mut apart);
        }
        (0..runs.len()).map(|lane| bundle.metrics_of(lane)).collect()
    }
}

/// Hands each lane that still runs to its recorder.
struct Apart<'r, R> {
    recorders: &'r mut [R],
    runs: Vec<bool>,
}

impl<const N: usize, S, T: Lanes, R: Recorder<N, ()>> Recorder<N, S, T> for Apart<'_, R> {
    #[inline(always)]
    fn sample(&mut self, sample: &Sample<'_, N, S, T>) {
        for (lane, recorder) in self.recorders.iter_mut().enumerate().filter(|(lane, _)| self.runs[*lane]) {
            let of = |joints: &Joints<N, T>| Joints::from_fn(|joint, _| joints[joint].lane(lane));
            recorder.sample(&Sample {
                step: sample.step,
                t_s: sample.t_s,
                at: State { q: of(&sample.at.q), dq: of(&sample.at.dq) },
                measurement: Measurement { q: of(&sample.measurement.q), dq: of(&sample.measurement.dq) },
                goal: of(&sample.goal),
                u: of(&sample.u),
                command: of(&sample.command),
                tau: of(&sample.tau),
                state: &(),
            });
        }
    }
}
