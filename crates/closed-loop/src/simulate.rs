//! Plant, controller and task in time.
//!
//! One sample of length h, from `(q, dq)` at its start:
//!
//! ```text
//! measure     y   = (q + noise, dq + noise)
//! goal        r_k = the task's goal, or r_{k-1} moved towards it at the task's goal speed; r_{-1} is the start
//! control     u_k = controller(y, r_k)
//! delay       u   = u_{k-d}, zero before the run
//! rate        c_k = c_{k-1} + clamp(u - c_{k-1}, rate h), c_{-1} = 0   if the task limits the torque's rate; else c_k = u
//! compensate  tau = c + g(q)                        if the arm compensates its gravity
//! limit       tau = clamp(tau, -limit, limit)       if the task asks for limits
//! plant       ddq = M(q)⁻¹ (tau + pushes - C dq - g - friction(dq)),   dq += h ddq,   q += h dq
//! ```
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | tau    | [`Sample::tau`] | torque the motor gives, held over the sample | N m |
//! | u      | [`Sample::u`] | torque the controller asks for, before delay | N m |
//! | c      | [`Sample::command`] | what of it reaches the motor: delayed, its rate limited | N m |
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
//! **Lanes.** A [`Bundle`] runs as many plants side by side as its scalar has lanes; a [`Simulation`] is a bundle of one. Lanes may differ in plant, delay,
//! start, goals, loads, pushes, noise and gains, and a lane that diverges or has finished keeps the figures that it had. [`simulate_many`]
//! fills the registers of the machine at hand.
//!
//! Nothing in the loop over samples allocates.

use certune_control::{Controller, Measurement};
use certune_dynamics::{COULOMB_SPEED_RAD_PER_S, Model, Posture, Robot, State, flange_jacobian};
use certune_linsys::{Joints, Lanes, Real};
use certune_simd::{InstructionSet, Kernel};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::metrics::{Contribution, Meter, Metrics};
use crate::parameters::Parameters;
use crate::plant_box::{PlantError, PlantSetting};
use crate::scenario::{Integrator, Method};
use crate::task::{Interval, Load, Task};

/// The longest actuation delay, samples.
pub const MAX_DELAY_SAMPLES: usize = 16;
/// Commands that are remembered.
const RING: usize = MAX_DELAY_SAMPLES + 1;
/// No register has more lanes.
const MOST_LANES: usize = 8;
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
pub struct Sample<'a, const N: usize, S, T: Real = f64> {
    /// Number of the sample, from 0.
    pub step: u64,
    /// Its start, s.
    pub t_s: f64,
    /// True positions and velocities at its start.
    pub at: State<N, T>,
    /// What the controller was told.
    pub measurement: Measurement<N, T>,
    /// The goal the controller was given, rad: on its way to the task's when the task limits its speed.
    pub goal: Joints<N, T>,
    /// The torque the controller asks for, before delay, N m.
    pub u: Joints<N, T>,
    /// What of the controller's torque reaches the motor: delayed and limited in its rate, before gravity compensation and the motor's limit, N m.
    pub command: Joints<N, T>,
    /// The torque the motor gives during the sample, N m.
    pub tau: Joints<N, T>,
    /// The controller's state after its step.
    pub state: &'a S,
}

/// Looks at every sample of a run. `()` looks away.
pub trait Recorder<const N: usize, S, T: Real = f64> {
    /// Called once per sample, after the controller and before the plant moves.
    fn sample(&mut self, sample: &Sample<'_, N, S, T>);
}

impl<const N: usize, S, T: Real> Recorder<N, S, T> for () {
    #[inline(always)]
    fn sample(&mut self, _: &Sample<'_, N, S, T>) {}
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

/// A plant, its task and its noise: one lane of a [`Bundle`].
#[derive(Clone, Copy, Debug)]
pub struct Run<'a, const N: usize> {
    /// The arm.
    pub plant: &'a Plant<N>,
    /// What it is to do.
    pub task: &'a Task<N>,
    /// Which noise its sensors have; a task without noise ignores it.
    pub noise: NoiseStream,
}

/// What changes seldom in a lane, and what is kept of it.
#[derive(Debug)]
struct Lane<'a, const N: usize> {
    plant: &'a Plant<N>,
    task: &'a Task<N>,
    /// The arm with the loads attached now.
    model: Model<N>,
    noise: Option<ChaCha8Rng>,
    segment: usize,
    segment_end: u64,
    /// Meters of the segments behind.
    meters: Vec<Meter<N>>,
    progress: Progress,
}

impl<const N: usize> Lane<'_, N> {
    fn runs(&self) -> bool {
        self.progress == Progress::Running
    }

    /// The task's goal; the last one when the task is over.
    fn goal(&self) -> Joints<N> {
        self.task.segments.get(self.segment).or(self.task.segments.last()).map_or(self.task.start, |s| s.goal)
    }
}

/// Runs side by side, one in each lane of T. [`simulate`] and [`simulate_many`] are the usual way; this one can be stopped, looked at and changed.
#[derive(Debug)]
pub struct Bundle<'a, const N: usize, C: Controller<N, T>, T: Lanes> {
    lanes: Vec<Lane<'a, N>>,
    controller: &'a C,
    step_s: f64,
    integrator: Integrator,
    /// The arms with the loads attached now, and without.
    model: Model<N, T>,
    nominal: Model<N, T>,
    coulomb: bool,
    state: State<N, T>,
    /// The arms in that state; loads do not change their geometry.
    posture: Posture<N, T>,
    /// Scratch of the method of fourth order: where the sub-step began, and the weighted sum of its slopes.
    runge_kutta: [State<N, T>; 2],
    controller_state: C::State,
    commands: [Joints<N, T>; RING],
    /// What reached the motors last; only kept where the torque's rate is limited.
    command: Joints<N, T>,
    /// The most that may change from one sample to the next, N m, where the tasks limit the torque's rate.
    most_change: Option<T>,
    given: Joints<N, T>,
    /// The goals of the tasks, and those the controller was given last.
    ordered: Joints<N, T>,
    goal: Joints<N, T>,
    /// 1 where the arm compensates its gravity.
    compensated: T,
    motor_limit: Joints<N, T>,
    /// The motor's limit where the task asks for limits, infinite elsewhere.
    clamp: Joints<N, T>,
    features: Features,
    meter: Meter<N, T>,
    step: u64,
    /// The next step at which some lane has another goal.
    next_goal: u64,
    /// Lanes whose runs go on.
    running: usize,
}

/// What some lane of a bundle needs.
#[derive(Clone, Copy, Debug)]
struct Features {
    noise: bool,
    loads: bool,
    pushes: bool,
    compensation: bool,
    /// Every lane's delay, when it is the same.
    delay: Option<usize>,
}

/// A run in progress, of one plant.
pub type Simulation<'a, const N: usize, C> = Bundle<'a, N, C, f64>;

impl<'a, const N: usize, C: Controller<N>> Simulation<'a, N, C> {
    /// A run about to begin: the arm rests at the task's start, the controller's beliefs are at the first measurement.
    pub fn new(plant: &'a Plant<N>, task: &'a Task<N>, controller: &'a C, noise: NoiseStream) -> Self {
        Self::side_by_side(&[Run { plant, task, noise }], controller)
    }

    /// The figures so far.
    pub fn metrics(&self) -> Metrics {
        self.metrics_of(0)
    }
}

/// The models of some lanes.
fn pack<const N: usize, T: Lanes>(of: impl Fn(usize) -> Model<N>) -> Model<N, T> {
    let models: [Model<N>; MOST_LANES] = core::array::from_fn(|lane| of(lane.min(T::LANES - 1)));
    Model::pack(&models.each_ref(), |numbers| T::from_lanes(|lane| numbers[lane]))
}

fn pack_joints<const N: usize, T: Lanes>(of: impl Fn(usize) -> Joints<N>) -> Joints<N, T> {
    Joints::from_fn(|joint, _| T::from_lanes(|lane| of(lane)[joint]))
}

impl<'a, const N: usize, C: Controller<N, T>, T: Lanes> Bundle<'a, N, C, T> {
    /// Runs about to begin: each arm rests at its task's start, the controller's beliefs are at the first measurement.
    ///
    /// Sampling step, integrator, goal limiter and torque-rate limit are those of the first run's task, see [`Task::steps_alike`]. With fewer runs than lanes
    /// the first one is repeated in the others, whose figures nobody asks for; more runs than lanes are left out, and no run at all is none to be had:
    /// `runs` must not be empty.
    pub fn side_by_side(runs: &[Run<'a, N>], controller: &'a C) -> Self {
        let run_of = |lane: usize| runs.get(lane).unwrap_or(&runs[0]);
        let lane = |index: usize| {
            let Run { plant, task, noise } = *run_of(index);
            let noise = (task.noise.q_rad > 0.0 || task.noise.dq_rad_per_s > 0.0).then(|| {
                let mut rng = ChaCha8Rng::seed_from_u64(noise.seed);
                rng.set_stream(!noise.index); // plants count from 0 upwards, noise from the other end
                rng
            });
            let absent = index >= runs.len() || task.segments.is_empty();
            Lane {
                plant,
                task,
                model: plant.model.clone(),
                noise,
                segment: 0,
                segment_end: task.segments.first().map_or(0, |first| first.steps),
                meters: Vec::with_capacity(task.segments.len()),
                progress: if absent { Progress::Finished } else { Progress::Running },
            }
        };
        let mut lanes: Vec<Lane<'a, N>> = (0..T::LANES).map(lane).collect();
        let nominal = pack(|lane| lanes[lane].plant.model.clone());
        let state = State::at_rest(pack_joints(|lane| lanes[lane].task.start));
        let meter = |lane: &Lane<'_, N>| Meter::new(0, &lane.task.start, &lane.task.start, &lane.goal());
        let delay = lanes[0].plant.delay_samples;
        let features = Features {
            noise: lanes.iter().any(|lane| lane.noise.is_some()),
            loads: lanes.iter().any(|lane| !lane.task.payloads.is_empty()),
            pushes: lanes.iter().any(|lane| !lane.task.pushes.is_empty()),
            compensation: lanes.iter().any(|lane| lane.plant.gravity_compensation),
            delay: lanes.iter().all(|lane| lane.plant.delay_samples == delay).then_some(delay),
        };
        // The controller starts from the first measurement, which is as noisy as any other: a copy of the stream gives it early.
        let noise: Vec<Option<ChaCha8Rng>> = lanes.iter().map(|lane| lane.noise.clone()).collect();
        let first = measure(&state, &mut lanes, features.noise);
        lanes.iter_mut().zip(noise).for_each(|(lane, noise)| lane.noise = noise);
        let limit = |lane: usize, always: bool| {
            let Lane { plant, task, .. } = &lanes[lane];
            if always || task.torque_limits { plant.torque_limit_n_m } else { Joints::repeat(f64::INFINITY) }
        };
        let task = lanes[0].task;
        Self {
            controller,
            step_s: task.step_s,
            integrator: task.integrator,
            coulomb: lanes.iter().any(|lane| lane.plant.model.coulomb_n_m().iter().any(|friction| *friction > 0.0)),
            model: nominal.clone(),
            posture: Posture::at(&nominal, &state.q),
            runge_kutta: [state; 2],
            nominal,
            controller_state: controller.start(&first),
            commands: [Joints::zeros(); RING],
            command: Joints::zeros(),
            most_change: task.torque_rate_limit_n_m_per_s.map(|rate| T::from_f64(rate * task.step_s)),
            given: Joints::zeros(),
            ordered: pack_joints(|lane| lanes[lane].goal()),
            goal: state.q,
            state,
            compensated: T::from_lanes(|lane| f64::from(u8::from(lanes[lane].plant.gravity_compensation))),
            motor_limit: pack_joints(|lane| limit(lane, true)),
            clamp: pack_joints(|lane| limit(lane, false)),
            features,
            meter: Meter::pack(|lane| meter(&lanes[lane])),
            step: 0,
            running: lanes.iter().filter(|lane| lane.runs()).count(),
            next_goal: lanes.iter().filter(|lane| lane.runs()).map(|lane| lane.segment_end).min().unwrap_or(u64::MAX),
            lanes,
        }
    }

    /// Where the arms are.
    pub fn state(&self) -> &State<N, T> {
        &self.state
    }

    /// Puts the arms somewhere else; for tests and what-if questions.
    pub fn set_state(&mut self, state: State<N, T>) {
        self.state = state;
        self.posture.move_to(&self.model, &state.q);
    }

    /// The controller's state.
    pub fn controller_state(&self) -> &C::State {
        &self.controller_state
    }

    /// Replaces the controller's state; for tests and what-if questions.
    pub fn set_controller_state(&mut self, state: C::State) {
        self.controller_state = state;
    }

    /// Whether the runs go on: running while any lane is, then how the first one ended.
    #[inline]
    pub fn progress(&self) -> Progress {
        if self.running > 0 { Progress::Running } else { self.lanes[0].progress }
    }

    /// Whether the run in a lane goes on.
    pub fn runs(&self, lane: usize) -> bool {
        self.lanes[lane].runs()
    }

    /// Ends the run in a lane before its time; its figures are those so far.
    pub fn stop(&mut self, lane: usize) {
        if self.lanes[lane].runs() {
            self.end(lane, Progress::Finished);
        }
    }

    /// Attaches and releases loads whose time has come.
    fn change_loads(&mut self) {
        let step = self.step;
        let changes = |during: &Interval| during.from == step || during.until == step;
        let mut changed = false;
        for lane in &mut self.lanes {
            if lane.task.payloads.iter().any(|load| changes(&load.during)) {
                changed = true;
                lane.model = lane.plant.model.clone();
                for load in lane.task.payloads.iter().filter(|load| load.during.contains(step)) {
                    lane.model = lane.model.with_payload(&load.payload);
                }
            }
        }
        if changed {
            self.model = pack(|lane| self.lanes[lane].model.clone());
        }
    }

    /// What pushes the arms now, added to the motors' torque; a lane that nothing pushes keeps its torque to the bit.
    fn pushed(&self, given: &Joints<N, T>) -> Joints<N, T> {
        let mut torque = [Joints::<N>::zeros(); MOST_LANES];
        let mut force = [Vector3::<f64>::zeros(); MOST_LANES];
        let mut acts = [0.0; MOST_LANES];
        let mut any_force = false;
        for (index, lane) in self.lanes.iter().enumerate() {
            for push in lane.task.pushes.iter().filter(|push| push.during.contains(self.step)) {
                acts[index] = 1.0;
                match push.load {
                    Load::Torque(more) => torque[index] += more,
                    Load::FlangeForce(more) => {
                        any_force = true;
                        force[index] += more;
                    }
                }
            }
        }
        if acts.iter().all(|acts| *acts <= 0.0) {
            return *given;
        }
        let mut push = pack_joints::<N, T>(|lane| torque[lane]);
        if any_force {
            let force = Vector3::from_fn(|axis, _| T::from_lanes(|lane| force[lane][axis]));
            push += flange_jacobian(&self.model, &self.state.q).fixed_rows::<3>(0).transpose() * force;
        }
        let acts = T::from_lanes(|lane| acts[lane]);
        Joints::from_fn(|joint, _| acts.choose(T::zero(), given[joint], given[joint] + push[joint]))
    }

    /// The commands that reach the motors in this sample.
    #[inline(always)]
    fn delayed(&self) -> Joints<N, T> {
        let slot = |delay: usize| (self.step as usize + RING - delay) % RING;
        match self.features.delay {
            Some(delay) => self.commands[slot(delay)],
            None => Joints::from_fn(|joint, _| {
                T::from_lanes(|lane| self.commands[slot(self.lanes[lane].plant.delay_samples)][joint].lane(lane))
            }),
        }
    }

    /// One sample. Does nothing once the runs are over. No heap.
    #[inline(always)]
    pub fn advance<R: Recorder<N, C::State, T>>(&mut self, recorder: &mut R) -> Progress {
        if self.progress() != Progress::Running {
            return self.progress();
        }
        self.goal =
            self.lanes[0].task.goal_limiter.map_or(self.ordered, |limiter| limiter.step(&self.goal, &self.ordered));
        let goal = self.goal;
        if self.features.loads {
            self.change_loads();
        }
        let measurement = measure(&self.state, &mut self.lanes, self.features.noise);
        let u = self.controller.advance(&mut self.controller_state, &measurement, &goal);

        self.commands[self.step as usize % RING] = u;
        let mut asked = self.delayed();
        if let Some(most) = self.most_change {
            for joint in 0..N {
                let (from, to) = (self.command[joint], asked[joint]);
                let change = to - from;
                asked[joint] = change.abs().choose(most, to, from + change.clamp_symmetric(most));
            }
            self.command = asked;
        }
        let command = asked;
        if self.features.compensation {
            let gravity = if T::LANES == 1 {
                gravity_single(&self.posture, &self.nominal)
            } else {
                self.posture.gravity_torque(&self.nominal)
            };
            for joint in 0..N {
                let with = asked[joint] + gravity[joint];
                asked[joint] = self.compensated.choose(T::zero(), asked[joint], with);
            }
        }
        let mut given = asked;
        for joint in 0..N {
            given[joint] = asked[joint].clamp_symmetric(self.clamp[joint]);
        }
        let t_s = self.step as f64 * self.step_s;
        let (step, at, state) = (self.step, self.state, &self.controller_state);
        recorder.sample(&Sample { step, t_s, at, measurement, goal, u, command, tau: given, state });

        let torque = if self.features.pushes { self.pushed(&given) } else { given };
        let mut next = self.state;
        let plant = (&self.model, self.coulomb);
        let (posture, scratch) = (&mut self.posture, &mut self.runge_kutta);
        if T::LANES == 1 {
            integrate_single(posture, scratch, plant, &mut next, &torque, &self.integrator, self.step_s);
        } else {
            integrate(posture, scratch, plant, &mut next, &torque, &self.integrator, self.step_s);
        }
        self.step += 1;
        // 0 where every joint is in its place.
        let (zero, one) = (T::zero(), T::one());
        let mut outside = zero;
        for joint in 0..N {
            outside += next.q[joint].abs().choose(T::from_f64(DIVERGED_RAD), zero, one);
            outside += next.dq[joint].abs().choose(T::from_f64(DIVERGED_RAD_PER_S), zero, one);
        }
        if !outside.is_zero() {
            self.diverge(&outside);
            if self.progress() != Progress::Running {
                return self.progress();
            }
        }
        self.state = next;
        let before = (step > 0).then_some(&self.given);
        self.meter.add(
            &Contribution { q: &next.q, dq: &next.dq, asked: &asked, given: &given },
            before,
            &self.motor_limit,
        );
        self.given = given;
        if self.step == self.next_goal {
            self.next_goals();
        }
        self.progress()
    }

    /// Ends the runs of the lanes that are outside, on the figures before this sample.
    fn diverge(&mut self, outside: &T) {
        for lane in 0..T::LANES {
            if self.lanes[lane].runs() && outside.lane(lane) > 0.0 {
                self.end(lane, Progress::Diverged(self.step as f64 * self.step_s));
            }
        }
    }

    /// Keeps the meter of a lane and ends its run.
    fn end(&mut self, lane: usize, progress: Progress) {
        let meter = self.meter.lane(lane);
        let lane = &mut self.lanes[lane];
        lane.meters.push(meter);
        lane.progress = progress;
        self.running -= 1;
    }

    /// The lanes whose goal's time is over get the next, or end.
    fn next_goals(&mut self) {
        let step = self.step;
        for index in 0..T::LANES {
            if !self.lanes[index].runs() || self.lanes[index].segment_end != step {
                continue;
            }
            let previous = self.lanes[index].goal();
            if self.lanes[index].segment + 1 == self.lanes[index].task.segments.len() {
                self.end(index, Progress::Finished);
                continue;
            }
            let meter = self.meter.lane(index);
            let q = self.state.q;
            let lane = &mut self.lanes[index];
            lane.meters.push(meter);
            lane.segment += 1;
            lane.segment_end += lane.task.segments[lane.segment].steps;
            let goal = lane.goal();
            let fresh = Meter::new(step, &Joints::from_fn(|joint, _| q[joint].lane(index)), &previous, &goal);
            let meter = &self.meter;
            self.meter = Meter::pack(|lane| if lane == index { fresh } else { meter.lane(lane) });
        }
        self.ordered = pack_joints(|lane| self.lanes[lane].goal());
        let ends = self.lanes.iter().filter(|lane| lane.runs()).map(|lane| lane.segment_end);
        self.next_goal = ends.min().unwrap_or(u64::MAX);
    }

    /// The figures of the first `runs` lanes so far.
    fn figures(&self, runs: usize) -> Vec<Metrics> {
        (0..runs).map(|lane| self.metrics_of(lane)).collect()
    }

    /// The figures of a lane so far.
    pub fn metrics_of(&self, lane: usize) -> Metrics {
        let current = self.meter.lane(lane);
        let lane = &self.lanes[lane];
        let diverged_at_s = match lane.progress {
            Progress::Diverged(t_s) => Some(t_s),
            Progress::Running | Progress::Finished => None,
        };
        let meters: Vec<&Meter<N>> = lane.meters.iter().chain(lane.runs().then_some(&current)).collect();
        let segment = |(index, meter): (usize, &&Meter<N>)| {
            meter.finish(self.step_s, diverged_at_s.is_some() && index + 1 == meters.len())
        };
        Metrics { segments: meters.iter().enumerate().map(segment).collect(), diverged_at_s }
    }
}

/// Runs tasks under a controller, as many side by side as this machine's registers hold, and returns their figures in the same order.
///
/// Each run has its own gains. Runs of tasks that do not step alike ([`Task::steps_alike`]), or of parameters that cannot share lanes, do not share a bundle. On one instruction set the figures of a
/// run are the same to the bit whatever it is run beside; they are those of [`simulate`] up to rounding. Runs on the current thread.
pub fn simulate_many<const N: usize, P: Parameters<N>>(runs: &[(Run<'_, N>, &P)]) -> Vec<Metrics> {
    simulate_many_on(InstructionSet::widest(), runs)
}

/// [`simulate_many`] on an instruction set of one's choice.
pub fn simulate_many_on<const N: usize, P: Parameters<N>>(
    set: InstructionSet,
    runs: &[(Run<'_, N>, &P)],
) -> Vec<Metrics> {
    bundles(set, runs).flat_map(|runs| set.run(WholeTasks { runs, watch: None })).collect()
}

/// [`simulate_many`], looked at on the way: `go_on` is given the first of the runs of a bundle by its place in `runs`, and the figures so far of them all, every
/// `every` samples, and ends the bundle by `false`. The figures of an ended run are those up to there.
pub fn simulate_many_while<const N: usize, P: Parameters<N>>(
    runs: &[(Run<'_, N>, &P)],
    every: u64,
    go_on: &mut dyn FnMut(usize, &[Metrics]) -> bool,
) -> Vec<Metrics> {
    let set = InstructionSet::widest();
    let mut figures = Vec::with_capacity(runs.len());
    for runs in bundles(set, runs) {
        let first = figures.len();
        let mut look = |found: &[Metrics]| go_on(first, found);
        figures.extend(set.run(WholeTasks { runs, watch: Some(Watch { every, go_on: &mut look }) }));
    }
    figures
}

/// Neighbours that can share a bundle.
pub(crate) fn bundles<'a, 'b, const N: usize, P: Parameters<N>>(
    set: InstructionSet,
    runs: &'a [(Run<'b, N>, &'b P)],
) -> impl Iterator<Item = &'a [(Run<'b, N>, &'b P)]> {
    runs.chunk_by(|(a, of_a), (b, of_b)| a.task.steps_alike(b.task) && of_a.share_lanes(of_b))
        .flat_map(move |runs| runs.chunks(set.lanes()))
}

/// Who looks at a bundle, and after how many samples each time.
struct Watch<'a> {
    every: u64,
    go_on: &'a mut dyn FnMut(&[Metrics]) -> bool,
}

/// A bundle from its start to its end.
struct WholeTasks<'a, 'b, 'w, const N: usize, P> {
    runs: &'a [(Run<'b, N>, &'b P)],
    watch: Option<Watch<'w>>,
}

impl<const N: usize, P: Parameters<N>> Kernel for WholeTasks<'_, '_, '_, N, P> {
    type Output = Vec<Metrics>;
    #[inline(always)]
    fn run<T: Lanes>(self) -> Vec<Metrics> {
        let Some((_, first)) = self.runs.first() else { return Vec::new() };
        let runs: Vec<Run<'_, N>> = self.runs.iter().map(|(run, _)| *run).collect();
        let controller = P::pack::<T>(|lane| self.runs.get(lane).map_or(*first, |(_, params)| *params));
        let mut bundle = Bundle::side_by_side(&runs, &controller);
        let mut watch = self.watch;
        let mut look_at = watch.as_ref().map_or(u64::MAX, |watch| watch.every);
        while bundle.advance(&mut ()) == Progress::Running {
            if bundle.step < look_at {
                continue;
            }
            let Some(watch) = &mut watch else { continue };
            look_at = look_at.saturating_add(watch.every);
            if !(watch.go_on)(&bundle.figures(runs.len())) {
                break;
            }
        }
        bundle.figures(runs.len())
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
#[inline(always)]
fn measure<const N: usize, T: Lanes>(at: &State<N, T>, lanes: &mut [Lane<'_, N>], noise: bool) -> Measurement<N, T> {
    let clean = Measurement { q: at.q, dq: at.dq };
    if noise { noisy(&clean, lanes) } else { clean }
}

fn noisy<const N: usize, T: Lanes>(clean: &Measurement<N, T>, lanes: &mut [Lane<'_, N>]) -> Measurement<N, T> {
    let mut errors = [[Joints::<N>::zeros(); 2]; MOST_LANES];
    for (lane, [q, dq]) in lanes.iter_mut().zip(&mut errors) {
        if let Some(rng) = &mut lane.noise {
            q.apply(|error| *error = lane.task.noise.q_rad * gaussian(rng));
            dq.apply(|error| *error = lane.task.noise.dq_rad_per_s * gaussian(rng));
        }
    }
    let error = |which: usize| pack_joints::<N, T>(|lane| errors[lane][which]);
    Measurement { q: clean.q + error(0), dq: clean.dq + error(1) }
}

/// A standard normal number by Box and Muller's transform; the second of each pair is not used, so that every number takes two draws.
fn gaussian(rng: &mut ChaCha8Rng) -> f64 {
    let mut unit = || (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    let radius = (-2.0 * (1.0 - unit()).ln()).sqrt(); // 1 - [0, 1) is never 0
    radius * (2.0 * std::f64::consts::PI * unit()).cos()
}

/// Takes the state one sample further, `torque` held. The posture is the state's, before and after. `plant`: the model, and whether a lane has Coulomb friction.
///
/// One place calls the arm's dynamics, so that each instruction set holds them once.
#[inline(always)]
fn integrate<const N: usize, T: Lanes>(
    posture: &mut Posture<N, T>,
    [start, sum]: &mut [State<N, T>; 2],
    (model, coulomb): (&Model<N, T>, bool),
    at: &mut State<N, T>,
    torque: &Joints<N, T>,
    integrator: &Integrator,
    step_s: f64,
) {
    let h = T::from_f64(step_s / f64::from(integrator.substeps));
    let stages = match integrator.method {
        Method::SemiImplicitEuler => 1,
        Method::RungeKutta4 => RUNGE_KUTTA.len(),
    };
    let mut armature = *model.rotor_inertia_kg_m2();
    for _ in 0..integrator.substeps {
        for stage in 0..stages {
            if coulomb && stages == 1 {
                for joint in 0..N {
                    let slope = model.coulomb_n_m()[joint] * secant(at.dq[joint]) * h;
                    armature[joint] = model.rotor_inertia_kg_m2()[joint] + slope;
                }
            }
            let ddq = posture.forward_dynamics(model, &at.dq, torque, &armature);
            if stages == 1 {
                for joint in 0..N {
                    at.dq[joint] = ddq[joint].mul_add(h, at.dq[joint]);
                    at.q[joint] = at.dq[joint].mul_add(h, at.q[joint]);
                }
            } else {
                if stage == 0 {
                    (*start, *sum) = (*at, State::at_rest(Joints::zeros()));
                }
                let (weight, ahead) = RUNGE_KUTTA[stage];
                let (weight, ahead) = (T::from_f64(weight), h * T::from_f64(ahead));
                for joint in 0..N {
                    let speed = at.dq[joint];
                    sum.q[joint] = speed.mul_add(weight, sum.q[joint]);
                    sum.dq[joint] = ddq[joint].mul_add(weight, sum.dq[joint]);
                    at.q[joint] = speed.mul_add(ahead, start.q[joint]);
                    at.dq[joint] = ddq[joint].mul_add(ahead, start.dq[joint]);
                    if stage + 1 == stages {
                        at.q[joint] = sum.q[joint].mul_add(h, start.q[joint]);
                        at.dq[joint] = sum.dq[joint].mul_add(h, start.dq[joint]);
                    }
                }
            }
            posture.move_to(model, &at.q);
        }
    }
}

/// Weight of each stage of the classical method of order 4, and how far ahead of the start the next stage looks, in steps.
const RUNGE_KUTTA: [(f64, f64); 4] = [(1.0 / 6.0, 0.5), (1.0 / 3.0, 0.5), (1.0 / 3.0, 1.0), (1.0 / 6.0, 0.0)];

/// [`integrate`] for one arm, compiled once for all controllers; lanes must stay in the registers of the caller.
#[inline(never)]
fn integrate_single<const N: usize, T: Lanes>(
    posture: &mut Posture<N, T>,
    scratch: &mut [State<N, T>; 2],
    plant: (&Model<N, T>, bool),
    at: &mut State<N, T>,
    torque: &Joints<N, T>,
    integrator: &Integrator,
    step_s: f64,
) {
    integrate(posture, scratch, plant, at, torque, integrator, step_s);
}

/// The gravity torque for one arm, as [`integrate_single`].
#[inline(never)]
fn gravity_single<const N: usize, T: Lanes>(posture: &Posture<N, T>, model: &Model<N, T>) -> Joints<N, T> {
    posture.gravity_torque(model)
}

/// `tanh(dq/ε)/dq`, s/rad: `1/ε` at rest.
#[inline(always)]
pub(crate) fn secant<T: Real>(speed: T) -> T {
    let ratio = speed / T::from_f64(COULOMB_SPEED_RAD_PER_S);
    // Below 1e-4 the series 1 - x²/3 is 1 to four parts in 1e9, and 0/0 is avoided.
    ratio.abs().choose(T::from_f64(1e-4), T::from_f64(COULOMB_SPEED_RAD_PER_S.recip()), ratio.tanh() / speed)
}
