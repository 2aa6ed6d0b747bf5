//! Plant, controller and task in time.
//!
//! One sample of length h, from `(q, dq)` at its start:
//!
//! ```text
//! measure     y   = (q + noise, dq + noise)
//! goal        r_k = the task's goal, or r_{k-1} moved towards it at the task's goal speed; r_{-1} is the start
//! control     u_k = controller(y, r_k)
//! delay       u   = u_{k-d}, zero before the run
//! compensate  tau = u + g(q)                        if the arm compensates its gravity
//! limit       tau = clamp(tau, -limit, limit)       if the task asks for limits
//! plant       ddq = M(q)⁻¹ (tau + pushes - C dq - g - friction(dq)),   dq += h ddq,   q += h dq
//! ```
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | tau    | [`Sample::tau`] | torque the motor gives, held over the sample | N m |
//! | u      | [`Sample::u`] | torque the controller asks for, before delay | N m |
//! | d      | `delay_samples` | whole samples from command to torque | 1 |
//!
//! **Gravity compensation** is the arm's inner loop: g(q) of the plant's *true* model, its constant payload included, at the true position and
//! without delay. A load that the task attaches during the run is not known to it: finding that out is the controller's business.
//!
//! **Friction.** Viscous friction is explicit. Coulomb friction `f_c tanh(dq/ε)` is far too stiff for that, so the step takes
//! `c dq⁺` with the secant slope `c = f_c tanh(dq/ε)/dq` at the old velocity: `(M + h diag c) ddq = tau - C dq - g - friction(dq)`. It never
//! reverses a velocity by itself, whatever h and f_c are.
//!
//! **Sub-steps** divide the sample of the plant; torque and pushes are held. Limits of the model: no joint stops, no sensor
//! delay, torque exact once it is given. A run stops as diverged when a joint leaves ±20 rad or ±1000 rad/s, or is no number.
//!
//! Nothing in the loop over samples allocates.

use certune_control::{Controller, Measurement};
use certune_dynamics::{
    COULOMB_SPEED_RAD_PER_S, Model, Robot, State, flange_jacobian, forward_dynamics, forward_dynamics_with_armature,
    gravity_torque,
};
use certune_linsys::{Joints, Real};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::metrics::{Contribution, Meter, Metrics};
use crate::plant_box::{PlantError, PlantSetting};
use crate::scenario::{Integrator, Method};
use crate::task::{Interval, Load, Task};

/// The longest actuation delay, samples.
pub const MAX_DELAY_SAMPLES: usize = 16;
/// A joint beyond this has diverged, rad.
pub const DIVERGED_RAD: f64 = 20.0;
/// A joint faster than this has diverged, rad/s.
pub const DIVERGED_RAD_PER_S: f64 = 1e3;

/// An arm as a controller meets it: model, motors, delay.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant<const N: usize> {
    model: Model<N>,
    torque_limit_n_m: Joints<N>,
    gravity_compensation: bool,
    delay_samples: usize,
}

impl<const N: usize> Plant<N> {
    /// The plant of `robot` with `setting`.
    ///
    /// # Errors
    /// [`PlantError`] when a list of the setting has not `N` entries, a number is out of its range, the delay is above
    /// [`MAX_DELAY_SAMPLES`], or the robot has not `N` joints.
    pub fn new(robot: &Robot, setting: &PlantSetting) -> Result<Self, PlantError> {
        let model = setting.model(robot)?;
        if setting.delay_samples > MAX_DELAY_SAMPLES {
            let expected = format!("at most {MAX_DELAY_SAMPLES}");
            return Err(crate::file::KeyError::out_of_range("delay_samples", setting.delay_samples, &expected).into());
        }
        Ok(Self {
            model,
            torque_limit_n_m: Joints::from_fn(|joint, _| robot.links()[joint].limits.torque_n_m),
            gravity_compensation: setting.gravity_compensation,
            delay_samples: setting.delay_samples,
        })
    }

    /// The arm's model, without the loads of a task.
    pub fn model(&self) -> &Model<N> {
        &self.model
    }

    /// The motors' torque limits, N m.
    pub fn torque_limit_n_m(&self) -> &Joints<N> {
        &self.torque_limit_n_m
    }

    /// Whether the arm compensates its own gravity.
    pub fn gravity_compensation(&self) -> bool {
        self.gravity_compensation
    }

    /// Whole samples from command to torque.
    pub fn delay_samples(&self) -> usize {
        self.delay_samples
    }
}

/// Names one stream of sensor noise. Streams of different indices, and those of [`PlantBox::draw`](crate::PlantBox::draw) with the same
/// seed, are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoiseStream {
    /// The seed.
    pub seed: u64,
    /// The stream of that seed.
    pub index: u64,
}

/// One sample, as a [`Recorder`] sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a, const N: usize, S> {
    /// Number of the sample, from 0.
    pub step: u64,
    /// Its start, s.
    pub t_s: f64,
    /// True positions and velocities at its start.
    pub at: State<N>,
    /// What the controller was told.
    pub measurement: Measurement<N>,
    /// The goal the controller was given, rad: on its way to the task's when the task limits its speed.
    pub goal: Joints<N>,
    /// The torque the controller asks for, before delay, N m.
    pub u: Joints<N>,
    /// The torque the motor gives during the sample, N m.
    pub tau: Joints<N>,
    /// The controller's state after its step.
    pub state: &'a S,
}

/// Looks at every sample of a run. `()` looks away.
pub trait Recorder<const N: usize, S> {
    /// Called once per sample, after the controller and before the plant moves.
    fn sample(&mut self, sample: &Sample<'_, N, S>);
}

impl<const N: usize, S> Recorder<N, S> for () {
    #[inline]
    fn sample(&mut self, _: &Sample<'_, N, S>) {}
}

/// What a step of a [`Simulation`] left behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// There are samples left.
    Running,
    /// The last goal's time is over.
    Finished,
    /// The run diverged at this time, s.
    Diverged(f64),
}

/// A run in progress. [`simulate`] is the usual way; this one can be stopped, looked at and forked.
#[derive(Debug)]
pub struct Simulation<'a, const N: usize, C: Controller<N>> {
    plant: &'a Plant<N>,
    task: &'a Task<N>,
    controller: &'a C,
    /// The arm with the loads attached now.
    model: Model<N>,
    coulomb: bool,
    state: State<N>,
    controller_state: C::State,
    commands: [Joints<N>; MAX_DELAY_SAMPLES + 1],
    given: Option<Joints<N>>,
    /// The goal the controller was given last.
    goal: Joints<N>,
    noise: Option<ChaCha8Rng>,
    step: u64,
    segment: usize,
    segment_end: u64,
    meters: Vec<Meter<N>>,
    progress: Progress,
}

impl<'a, const N: usize, C: Controller<N>> Simulation<'a, N, C> {
    /// A run about to begin: the arm rests at the task's start, the controller's beliefs are at the first measurement.
    pub fn new(plant: &'a Plant<N>, task: &'a Task<N>, controller: &'a C, noise: NoiseStream) -> Self {
        let state = State::at_rest(task.start);
        let noise = (task.noise.q_rad > 0.0 || task.noise.dq_rad_per_s > 0.0).then(|| {
            let mut rng = ChaCha8Rng::seed_from_u64(noise.seed);
            rng.set_stream(!noise.index); // plants count from 0 upwards, noise from the other end
            rng
        });
        let mut meters = Vec::with_capacity(task.segments.len());
        if let Some(first) = task.segments.first() {
            meters.push(Meter::new(0, &state.q, &task.start, &first.goal));
        }
        // The controller starts from the first measurement, which is as noisy as any other: a copy of the stream gives it early.
        let first = measure(&state, task, &mut noise.clone());
        Self {
            plant,
            task,
            controller,
            model: plant.model.clone(),
            coulomb: plant.model.coulomb_n_m().iter().any(|friction| *friction > 0.0),
            state,
            controller_state: controller.start(&first),
            commands: [Joints::zeros(); MAX_DELAY_SAMPLES + 1],
            given: None,
            goal: task.start,
            noise,
            step: 0,
            segment: 0,
            segment_end: task.segments.first().map_or(0, |first| first.steps),
            meters,
            progress: if task.segments.is_empty() { Progress::Finished } else { Progress::Running },
        }
    }

    /// Where the arm is.
    pub fn state(&self) -> &State<N> {
        &self.state
    }

    /// Puts the arm somewhere else; for tests and what-if questions.
    pub fn set_state(&mut self, state: State<N>) {
        self.state = state;
    }

    /// The controller's state.
    pub fn controller_state(&self) -> &C::State {
        &self.controller_state
    }

    /// Replaces the controller's state; for tests and what-if questions.
    pub fn set_controller_state(&mut self, state: C::State) {
        self.controller_state = state;
    }

    /// Whether the run goes on.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// Attaches and releases loads whose time has come.
    fn change_loads(&mut self) {
        let changes = |during: &Interval| during.from == self.step || during.until == self.step;
        if self.task.payloads.iter().any(|load| changes(&load.during)) {
            self.model = self.plant.model.clone();
            for load in self.task.payloads.iter().filter(|load| load.during.contains(self.step)) {
                self.model = self.model.with_payload(&load.payload);
            }
        }
    }

    fn pushes(&self) -> Option<Joints<N>> {
        let mut acting = self.task.pushes.iter().filter(|push| push.during.contains(self.step)).peekable();
        acting.peek()?;
        Some(acting.fold(Joints::zeros(), |sum, push| match push.load {
            Load::Torque(torque) => sum + torque,
            Load::FlangeForce(force) => {
                sum + flange_jacobian(&self.model, &self.state.q).fixed_rows::<3>(0).transpose() * force
            }
        }))
    }

    /// One sample. Does nothing once the run is over. No heap.
    pub fn advance<R: Recorder<N, C::State>>(&mut self, recorder: &mut R) -> Progress {
        let Progress::Running = self.progress else { return self.progress };
        let (plant, task) = (self.plant, self.task);
        let ordered = task.segments[self.segment].goal;
        self.goal = task.goal_limiter.map_or(ordered, |limiter| limiter.step(&self.goal, &ordered));
        let goal = self.goal;
        self.change_loads();
        let measurement = measure(&self.state, task, &mut self.noise);
        let (controller_state, u) = self.controller.step(&self.controller_state, &measurement, &goal);
        self.controller_state = controller_state;

        let ring = plant.delay_samples + 1;
        let slot = (self.step % ring as u64) as usize;
        self.commands[slot] = u;
        let delayed = self.commands[(slot + 1) % ring];
        let asked =
            if plant.gravity_compensation { delayed + gravity_torque(&plant.model, &self.state.q) } else { delayed };
        let given = if task.torque_limits {
            asked.zip_map(&plant.torque_limit_n_m, |torque, limit| torque.clamp_symmetric(limit))
        } else {
            asked
        };
        let t_s = self.step as f64 * task.step_s;
        let (step, at, state) = (self.step, self.state, &self.controller_state);
        recorder.sample(&Sample { step, t_s, at, measurement, goal, u, tau: given, state });

        let torque = self.pushes().map_or(given, |push| given + push);
        let next = integrate(&self.model, self.coulomb, self.state, &torque, &task.integrator, task.step_s);
        self.step += 1;
        let inside = |values: &Joints<N>, bound: f64| values.iter().all(|value| value.abs() <= bound);
        if !(inside(&next.q, DIVERGED_RAD) && inside(&next.dq, DIVERGED_RAD_PER_S)) {
            self.progress = Progress::Diverged(self.step as f64 * task.step_s);
            return self.progress;
        }
        self.state = next;
        if let Some(meter) = self.meters.last_mut() {
            let sample = Contribution { q: next.q, dq: next.dq, asked, given };
            meter.add(&sample, self.given.as_ref(), &plant.torque_limit_n_m);
        }
        self.given = Some(given);
        if self.step == self.segment_end {
            self.next_segment();
        }
        self.progress
    }

    fn next_segment(&mut self) {
        let previous = self.task.segments[self.segment].goal;
        self.segment += 1;
        match self.task.segments.get(self.segment) {
            Some(segment) => {
                self.segment_end += segment.steps;
                self.meters.push(Meter::new(self.step, &self.state.q, &previous, &segment.goal));
            }
            None => self.progress = Progress::Finished,
        }
    }

    /// The figures so far.
    pub fn metrics(&self) -> Metrics {
        let diverged_at_s = match self.progress {
            Progress::Diverged(t_s) => Some(t_s),
            Progress::Running | Progress::Finished => None,
        };
        let segment = |(index, meter): (usize, &Meter<N>)| {
            meter.finish(self.task.step_s, diverged_at_s.is_some() && index + 1 == self.meters.len())
        };
        Metrics { segments: self.meters.iter().enumerate().map(segment).collect(), diverged_at_s }
    }
}

/// Runs the whole task and returns its figures.
///
/// `recorder` sees every sample (`&mut ()` for none). A task without noise ignores `noise`. Cannot fail: a run that diverges says so
/// in [`Metrics::diverged_at_s`]. The same arguments give the same figures to the bit.
pub fn simulate<const N: usize, C: Controller<N>, R: Recorder<N, C::State>>(
    plant: &Plant<N>,
    task: &Task<N>,
    controller: &C,
    noise: NoiseStream,
    recorder: &mut R,
) -> Metrics {
    let mut simulation = Simulation::new(plant, task, controller, noise);
    while simulation.advance(recorder) == Progress::Running {}
    simulation.metrics()
}

/// What the sensors say about `at`.
fn measure<const N: usize>(at: &State<N>, task: &Task<N>, noise: &mut Option<ChaCha8Rng>) -> Measurement<N> {
    let State { q, dq } = *at;
    let Some(rng) = noise else { return Measurement { q, dq } };
    let mut noisy = |clean: Joints<N>, deviation: f64| clean.map(|value| value + deviation * gaussian(rng));
    let q = noisy(q, task.noise.q_rad);
    Measurement { q, dq: noisy(dq, task.noise.dq_rad_per_s) }
}

/// A standard normal number by Box and Muller's transform; the second of each pair is not used, so that every number takes two draws.
fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    let mut unit = || (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    let radius = (-2.0 * (1.0 - unit()).ln()).sqrt(); // 1 - [0, 1) is never 0
    radius * (2.0 * std::f64::consts::PI * unit()).cos()
}

/// The state one sample later, `torque` held.
pub(crate) fn integrate<const N: usize>(
    model: &Model<N>,
    coulomb: bool,
    mut state: State<N>,
    torque: &Joints<N>,
    integrator: &Integrator,
    step_s: f64,
) -> State<N> {
    let h = step_s / f64::from(integrator.substeps);
    for _ in 0..integrator.substeps {
        state = match integrator.method {
            Method::SemiImplicitEuler => {
                let ddq = if coulomb {
                    let slope = model.coulomb_n_m().zip_map(&state.dq, |friction, speed| friction * secant(speed) * h);
                    forward_dynamics_with_armature(model, &state, torque, &slope)
                } else {
                    forward_dynamics(model, &state, torque)
                };
                let dq = state.dq + ddq * h;
                State { q: state.q + dq * h, dq }
            }
            Method::RungeKutta4 => {
                let rate = |at: &State<N>| State { q: at.dq, dq: forward_dynamics(model, at, torque) };
                let along = |rate: &State<N>, t: f64| State { q: state.q + rate.q * t, dq: state.dq + rate.dq * t };
                let k1 = rate(&state);
                let k2 = rate(&along(&k1, 0.5 * h));
                let k3 = rate(&along(&k2, 0.5 * h));
                let k4 = rate(&along(&k3, h));
                State {
                    q: state.q + (k1.q + (k2.q + k3.q) * 2.0 + k4.q) * (h / 6.0),
                    dq: state.dq + (k1.dq + (k2.dq + k3.dq) * 2.0 + k4.dq) * (h / 6.0),
                }
            }
        };
    }
    state
}

/// `tanh(dq/ε)/dq`, s/rad: `1/ε` at rest.
pub(crate) fn secant(speed: f64) -> f64 {
    let ratio = speed / COULOMB_SPEED_RAD_PER_S;
    // Below 1e-4 the series 1 - x²/3 is 1 to four parts in 1e9, and 0/0 is avoided.
    if ratio.abs() < 1e-4 { COULOMB_SPEED_RAD_PER_S.recip() } else { ratio.tanh() / speed }
}
