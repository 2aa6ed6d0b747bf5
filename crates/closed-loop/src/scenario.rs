//! Scenarios: what an arm is asked to do, under which disturbances, and on which family of plants.
//!
//! ```toml
//! schema = 1
//! name = "pick-and-place"
//! description = "one line"
//! step_s = 0.001
//! torque_limits = true                  # default true
//! torque_rate_limit_n_m_per_s = 1000    # optional: the motor follows the controller's torque no faster than this, gravity compensation apart
//! goal_speed_rad_per_s = 0.3            # optional: goals move this fast (2-norm over the joints) instead of jumping
//! start_rad = [0, 0.2, 0, -1, 0, 1.2, 0]
//! [[segments]]                          # goals, one after the other; each jumps at its start, or starts to move
//! goal_rad = [1, 0.5, 0, -2, 0, 2.5, 0]
//! duration_s = 6
//! [integrator]                          # optional
//! method = "semi-implicit-euler"        # or "runge-kutta-4"
//! substeps = 1
//! [noise]                               # optional, standard deviations
//! q_rad = 1e-4
//! dq_rad_per_s = 2e-3
//! [[payloads]]                          # optional; without com_m a point mass at the grasp point
//! mass_kg = 0.7
//! attach_s = 6
//! release_s = 24                        # optional
//! [[pushes]]                            # optional; torque_n_m per joint, or flange_force_n in world axes
//! from_s = 2
//! until_s = 3
//! flange_force_n = [0, 20, 0]
//! [plant-box]                           # see `PlantBox`
//! ```
//!
//! A [`Scenario`] is the file; a [`Task`] is the scenario bound to an arm of `N` joints, with times in whole steps (nearest).
//! Limits: the simulation has no joint stops, so goals are not compared with the joint range.

use std::path::Path;

use certune_control::GoalRateLimiter;
use certune_dynamics::{Payload, Robot, RobotError};
use certune_linsys::Joints;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::file::{FileError, KeyError, Problem, load, read_text};
use crate::plant_box::PlantBox;
use crate::task::{Interval, Load, Task, TaskPayload, TaskPush, TaskSegment};

/// The schema version of scenario files.
pub const SCENARIO_SCHEMA: i64 = 1;

/// Largest joint step of the generic task, rad.
const GENERIC_STEP_RAD: f64 = 0.5;
/// The longest scenario, in steps: beyond, a mistyped duration is likelier than a wish.
const MOST_STEPS: f64 = 1e9;

/// How a sample of the plant is integrated; torque is held over the sample either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// `dq += h ddq(q, dq)`, then `q += h dq`. Coulomb friction is implicit.
    SemiImplicitEuler,
    /// The classical scheme of fourth order. Coulomb friction is explicit: stiff, so it needs many sub-steps.
    #[serde(rename = "runge-kutta-4")]
    RungeKutta4,
}

/// Method and number of equal sub-steps per sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Integrator {
    /// The method of a sub-step.
    pub method: Method,
    /// Sub-steps per sample, at least 1.
    #[serde(default = "one_substep")]
    pub substeps: u32,
}

fn one_substep() -> u32 {
    1
}

impl Default for Integrator {
    /// One semi-implicit Euler step per sample.
    fn default() -> Self {
        Self { method: Method::SemiImplicitEuler, substeps: 1 }
    }
}

/// White Gaussian sensor noise, the same standard deviation on every joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation of the measured positions, rad.
    pub q_rad: f64,
    /// Standard deviation of the measured velocities, rad/s.
    pub dq_rad_per_s: f64,
}

/// A goal and how long it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Joint positions to reach, rad.
    pub goal_rad: Vec<f64>,
    /// How long the goal stands, s.
    pub duration_s: f64,
}

/// A load that is attached and released during the run, on top of the plant's own payload.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadEvent {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the frame of the last link, m; the grasp point unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub com_m: Option<[f64; 3]>,
    /// Inertia about the centre of mass, xx yy zz xy xz yz, kg m²; zero unless given.
    #[serde(default)]
    pub about_com_kg_m2: [f64; 6],
    /// When it is attached, s.
    pub attach_s: f64,
    /// When it is released, s; never unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub release_s: Option<f64>,
}

/// A disturbance over an interval: joint torques or a force at the flange, exactly one of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Push {
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub until_s: f64,
    /// Joint torques, N m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_n_m: Option<Vec<f64>>,
    /// Force at the flange's origin in world axes, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flange_force_n: Option<[f64; 3]>,
}

/// A scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The name, as on the command line.
    pub name: String,
    /// One line for a list of scenarios.
    pub description: String,
    /// Sampling step of the controller, s.
    pub step_s: f64,
    /// Where the arm rests at the start, rad.
    pub start_rad: Vec<f64>,
    /// Goals in their order.
    pub segments: Vec<Goal>,
    /// Whether motor torques are limited to the robot's limits.
    #[serde(default = "yes")]
    pub torque_limits: bool,
    /// The motor follows the controller's torque no faster than this, N m/s; at once unless given. What the arm adds against its own gravity is not limited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_rate_limit_n_m_per_s: Option<f64>,
    /// The controller's goal moves from one goal to the next at this speed, rad/s (2-norm over the joints); it jumps unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_speed_rad_per_s: Option<f64>,
    /// How the plant is integrated.
    #[serde(default)]
    pub integrator: Integrator,
    /// Sensor noise.
    #[serde(default)]
    pub noise: Noise,
    /// Loads attached and released.
    #[serde(default)]
    pub payloads: Vec<PayloadEvent>,
    /// Disturbances.
    #[serde(default)]
    pub pushes: Vec<Push>,
    /// The family of plants.
    #[serde(rename = "plant-box")]
    pub plant_box: PlantBox,
}

fn yes() -> bool {
    true
}

impl Scenario {
    /// Reads and validates a scenario; `file` names the text in errors.
    ///
    /// # Errors
    /// [`FileError`] with the line and the key.
    pub fn parse(file: &Path, text: &str) -> Result<Self, FileError> {
        let scenario: Self = read_text(file, text, SCENARIO_SCHEMA)?;
        scenario.validate().map_err(|error| error.locate(file, text))?;
        Ok(scenario)
    }

    /// A task for any arm: from the middle of every joint's range, out by a fifth of the range (at most 0.5 rad), neighbouring
    /// joints in opposite directions; to the mirror image; back. Three goals of 6 s on the plants of `plant_box`.
    ///
    /// A joint without limits counts as one with the range ±π.
    pub fn generic(robot: &Robot, plant_box: PlantBox) -> Self {
        use std::f64::consts::PI;
        let range = |joint: usize| {
            let limits = &robot.links()[joint].limits;
            if limits.lower_rad.is_finite() && limits.upper_rad.is_finite() {
                (limits.lower_rad, limits.upper_rad)
            } else {
                (-PI, PI)
            }
        };
        let pose = |direction: f64| -> Vec<f64> {
            let at = |joint| {
                let (lower, upper): (f64, f64) = range(joint);
                let reach = (0.2 * (upper - lower)).min(GENERIC_STEP_RAD);
                let sign = if joint % 2 == 0 { 1.0 } else { -1.0 };
                0.5 * (lower + upper) + direction * sign * reach
            };
            (0..robot.joints()).map(at).collect()
        };
        let goal = |direction| Goal { goal_rad: pose(direction), duration_s: 6.0 };
        Self {
            name: "generic".to_owned(),
            description: "Out from the middle of every joint's range, to the mirror image, and back.".to_owned(),
            step_s: 1e-3,
            start_rad: pose(0.0),
            segments: vec![goal(1.0), goal(-1.0), goal(0.0)],
            torque_limits: true,
            torque_rate_limit_n_m_per_s: None,
            goal_speed_rad_per_s: None,
            integrator: Integrator::default(),
            noise: Noise::default(),
            payloads: Vec::new(),
            pushes: Vec::new(),
            plant_box,
        }
    }

    /// Reads and validates the scenario at `path`.
    ///
    /// # Errors
    /// [`FileError`], as [`Scenario::parse`] or because the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::parse(path, &load(path)?)
    }

    /// Joints that the scenario is written for.
    pub fn joints(&self) -> usize {
        self.start_rad.len()
    }

    /// Length of the whole scenario, s.
    pub fn duration_s(&self) -> f64 {
        self.segments.iter().map(|segment| segment.duration_s).sum()
    }

    /// Checks what can be checked without an arm.
    ///
    /// # Errors
    /// [`KeyError`] for the first key that is out of its range or has not as many entries as `start_rad`.
    pub fn validate(&self) -> Result<(), KeyError> {
        positive("step_s", self.step_s)?;
        self.list("start_rad", &self.start_rad)?;
        if self.start_rad.is_empty() {
            return Err(KeyError::out_of_range("start_rad", "empty", "one number per joint"));
        }
        if self.segments.is_empty() {
            return Err(KeyError { key: "segments".to_owned(), problem: Problem::MissingKey });
        }
        for (index, segment) in self.segments.iter().enumerate() {
            self.list(&format!("segments[{index}].goal_rad"), &segment.goal_rad)?;
            let key = format!("segments[{index}].duration_s");
            let steps = segment.duration_s / self.step_s;
            if !(1.0..=MOST_STEPS).contains(&steps) {
                return Err(KeyError::out_of_range(&key, segment.duration_s, "between one and 1e9 steps of `step_s`"));
            }
        }
        if let Some(rate) = self.torque_rate_limit_n_m_per_s {
            positive("torque_rate_limit_n_m_per_s", rate)?;
        }
        self.goal_limiter()?;
        if self.integrator.substeps == 0 {
            return Err(KeyError::out_of_range("integrator.substeps", 0, "at least 1"));
        }
        non_negative("noise.q_rad", self.noise.q_rad)?;
        non_negative("noise.dq_rad_per_s", self.noise.dq_rad_per_s)?;
        for (index, payload) in self.payloads.iter().enumerate() {
            positive(&format!("payloads[{index}].mass_kg"), payload.mass_kg)?;
            let release_s = payload.release_s.unwrap_or(f64::MAX);
            self.interval(&format!("payloads[{index}]"), ["attach_s", "release_s"], [payload.attach_s, release_s])?;
            let numbers = payload.com_m.iter().flatten().chain(&payload.about_com_kg_m2);
            if let Some(value) = numbers.copied().find(|value| !value.is_finite()) {
                return Err(KeyError::out_of_range(&format!("payloads[{index}]"), value, "finite numbers"));
            }
        }
        for (index, push) in self.pushes.iter().enumerate() {
            self.interval(&format!("pushes[{index}]"), ["from_s", "until_s"], [push.from_s, push.until_s])?;
            match (&push.torque_n_m, &push.flange_force_n) {
                (Some(torque), None) => self.list(&format!("pushes[{index}].torque_n_m"), torque)?,
                (None, Some(force)) => finite(&format!("pushes[{index}].flange_force_n"), force)?,
                (None, None) | (Some(_), Some(_)) => {
                    let expected = "exactly one of `torque_n_m` and `flange_force_n`";
                    let found = if push.torque_n_m.is_some() { "both" } else { "neither" };
                    return Err(KeyError::out_of_range(&format!("pushes[{index}]"), found, expected));
                }
            }
        }
        self.plant_box.validate()
    }

    /// What moves the goal, when goals do not jump.
    fn goal_limiter(&self) -> Result<Option<GoalRateLimiter>, KeyError> {
        let Some(speed) = self.goal_speed_rad_per_s else { return Ok(None) };
        let key = "goal_speed_rad_per_s";
        positive(key, speed)?;
        let limiter = GoalRateLimiter::new(speed, self.step_s);
        limiter.map(Some).map_err(|_| KeyError::out_of_range(key, speed, "a speed with a finite way per step"))
    }

    fn list(&self, key: &str, values: &[f64]) -> Result<(), KeyError> {
        if values.len() != self.joints() {
            return Err(KeyError::per_joint(key, values.len(), self.joints()));
        }
        finite(key, values)
    }

    fn interval(&self, key: &str, [first, second]: [&str; 2], [from_s, until_s]: [f64; 2]) -> Result<(), KeyError> {
        if !(from_s >= 0.0 && from_s < self.duration_s()) {
            let expected = format!("between 0 and the scenario's end, {} s", self.duration_s());
            return Err(KeyError::out_of_range(&format!("{key}.{first}"), from_s, &expected));
        }
        if until_s > from_s {
            Ok(())
        } else {
            Err(KeyError::out_of_range(&format!("{key}.{second}"), until_s, &format!("above `{first}`, {from_s} s")))
        }
    }

    /// The task of an arm with `N` joints.
    ///
    /// # Errors
    /// [`KeyError`] as [`Scenario::validate`], and when the lists have not `N` entries or a payload is no rigid body.
    pub fn bind<const N: usize>(&self, robot: &Robot) -> Result<Task<N>, KeyError> {
        if self.joints() != N {
            return Err(KeyError::per_joint("start_rad", self.joints(), N));
        }
        self.validate()?;
        let step = |time_s: f64| (time_s / self.step_s).round() as u64;
        let joints = |key: &str, values: &[f64]| {
            <[f64; N]>::try_from(values).map(Joints::from).map_err(|_| KeyError::per_joint(key, values.len(), N))
        };
        let mut segments = Vec::with_capacity(self.segments.len());
        for (index, segment) in self.segments.iter().enumerate() {
            let goal = joints(&format!("segments[{index}].goal_rad"), &segment.goal_rad)?;
            segments.push(TaskSegment { goal, steps: step(segment.duration_s) });
        }
        let mut payloads = Vec::with_capacity(self.payloads.len());
        for (index, event) in self.payloads.iter().enumerate() {
            let body = |event: &PayloadEvent| {
                let com_m =
                    event.com_m.map_or_else(|| Payload::at_grasp(robot, event.mass_kg).map(|point| point.com_m), Ok)?;
                Payload::new(event.mass_kg, com_m, event.about_com_kg_m2)
            };
            let payload = body(event).map_err(|error: RobotError| KeyError {
                key: format!("payloads[{index}]"),
                problem: Problem::Rejected { reason: error.to_string() },
            })?;
            let during = Interval { from: step(event.attach_s), until: event.release_s.map_or(u64::MAX, step) };
            payloads.push(TaskPayload { during, payload });
        }
        let mut pushes = Vec::with_capacity(self.pushes.len());
        for (index, push) in self.pushes.iter().enumerate() {
            let load = match (&push.torque_n_m, push.flange_force_n) {
                (Some(torque), _) => Load::Torque(joints(&format!("pushes[{index}].torque_n_m"), torque)?),
                (None, force) => Load::FlangeForce(Vector3::from(force.unwrap_or_default())),
            };
            pushes.push(TaskPush { during: Interval { from: step(push.from_s), until: step(push.until_s) }, load });
        }
        Ok(Task {
            step_s: self.step_s,
            start: joints("start_rad", &self.start_rad)?,
            segments,
            torque_limits: self.torque_limits,
            torque_rate_limit_n_m_per_s: self.torque_rate_limit_n_m_per_s,
            goal_limiter: self.goal_limiter()?,
            integrator: self.integrator,
            noise: self.noise,
            payloads,
            pushes,
        })
    }
}

fn positive(key: &str, value: f64) -> Result<(), KeyError> {
    let good = value > 0.0 && value.is_finite();
    if good { Ok(()) } else { Err(KeyError::out_of_range(key, value, "a positive finite number")) }
}

fn non_negative(key: &str, value: f64) -> Result<(), KeyError> {
    let good = value >= 0.0 && value.is_finite();
    if good { Ok(()) } else { Err(KeyError::out_of_range(key, value, "a finite number, zero or above")) }
}

fn finite(key: &str, values: &[f64]) -> Result<(), KeyError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(KeyError::out_of_range(&format!("{key}[{index}]"), values[index], "a finite number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [(&str, &str); 6] = [
        ("pick-and-place", include_str!("../../../tuning/scenarios/pick-and-place.toml")),
        ("pick-and-place-paper", include_str!("../../../tuning/scenarios/pick-and-place-paper.toml")),
        ("hold", include_str!("../../../tuning/scenarios/hold.toml")),
        ("payload-swap", include_str!("../../../tuning/scenarios/payload-swap.toml")),
        ("push", include_str!("../../../tuning/scenarios/push.toml")),
        ("pick-and-place-ramped", include_str!("../../../tuning/scenarios/pick-and-place-ramped.toml")),
    ];

    fn refused(text: &str) -> (String, usize) {
        let error = Scenario::parse(Path::new("scenario.toml"), text).expect_err(text);
        (error.location.key, error.location.line_column.map_or(0, |(line, _)| line))
    }

    #[test]
    fn every_file_is_named_as_its_scenario_and_fits_the_panda() {
        let robot = Robot::panda();
        for (name, text) in FILES {
            let scenario = Scenario::parse(Path::new(name), text).unwrap();
            assert_eq!(scenario.name, name);
            let task = scenario.bind::<7>(&robot).unwrap();
            let steps: u64 = task.segments.iter().map(|segment| segment.steps).sum();
            assert_eq!(steps, (scenario.duration_s() * 1e3).round() as u64);
            for values in
                std::iter::once(&scenario.start_rad).chain(scenario.segments.iter().map(|goal| &goal.goal_rad))
            {
                for (value, link) in values.iter().zip(robot.links()) {
                    assert!(
                        (link.limits.lower_rad..=link.limits.upper_rad).contains(value),
                        "{name}: {value} rad at {}",
                        link.name
                    );
                }
            }
        }
    }

    #[test]
    fn the_published_tasks_differ_in_gravity_compensation_alone() {
        let [with, mut without] = [0, 1].map(|index| Scenario::parse(Path::new("s"), FILES[index].1).unwrap());
        assert!(with.plant_box.gravity_compensation && !without.plant_box.gravity_compensation);
        without.plant_box.gravity_compensation = true;
        without.name.clone_from(&with.name);
        without.description.clone_from(&with.description);
        assert_eq!(with, without);
    }

    #[test]
    fn times_become_steps() {
        let task = Scenario::parse(Path::new("s"), FILES[3].1).unwrap().bind::<7>(&Robot::panda()).unwrap();
        assert_eq!(task.payloads[1].during, Interval { from: 42_000, until: 54_000 });
        assert!(task.payloads[1].during.contains(42_000) && !task.payloads[1].during.contains(54_000));
        assert!((task.payloads[1].payload.com_m[2] - 0.307).abs() < 1e-12);
    }

    #[test]
    fn a_bad_scenario_is_refused_with_key_and_line() {
        let push = FILES[4].1;
        let edit = |from: &str, to: &str| refused(&push.replacen(from, to, 1));
        assert_eq!(edit("step_s = 0.001", "step_s = 0"), ("step_s".to_owned(), 5));
        assert_eq!(edit("start_rad = [0, ", "start_rad = [nan, ").0, "start_rad[0]");
        assert_eq!(edit("goal_rad = [0, ", "goal_rad = [").0, "segments[0].goal_rad");
        assert_eq!(edit("duration_s = 15", "duration_s = -15").0, "segments[0].duration_s");
        assert_eq!(edit("duration_s = 15", "duration_s = 0.0001").0, "segments[0].duration_s");
        assert_eq!(edit("from_s = 2", "from_s = 20").0, "pushes[0].from_s");
        assert_eq!(edit("until_s = 3", "until_s = 1").0, "pushes[0].until_s");
        assert_eq!(edit("flange_force_n = [0, 20, 0]", "").0, "pushes[0]");
        assert_eq!(edit("flange_force_n = [0, 20, 0]", "flange_force_n = [0, 20]").0, "pushes[0].flange_force_n");
        assert_eq!(edit("torque_n_m = [0, 0, 0, 5, 0, 0, 0]", "torque_n_m = [5]").0, "pushes[1].torque_n_m");
        assert_eq!(edit("mass_uncertainty = 0.2", "mass_uncertainty = 2").0, "plant-box.mass_uncertainty");
        assert_eq!(edit("gravity_compensation", "gravity_compensated").0, "plant-box.gravity_compensated");
        assert_eq!(edit("torque_limits = true", "torque_limits = 1").0, "torque_limits");
        for bad in ["0", "-0.1", "nan", "inf", "1e-322"] {
            let limited = format!("torque_limits = true\ngoal_speed_rad_per_s = {bad}");
            assert_eq!(edit("torque_limits = true", &limited), ("goal_speed_rad_per_s".to_owned(), 7), "{bad}");
        }
        for bad in ["0", "-1000", "nan", "inf"] {
            let limited = format!("torque_limits = true\ntorque_rate_limit_n_m_per_s = {bad}");
            assert_eq!(edit("torque_limits = true", &limited), ("torque_rate_limit_n_m_per_s".to_owned(), 7), "{bad}");
        }
        assert_eq!(edit("torque_limits = true", "goal_speed_rad_s = 1").0, "goal_speed_rad_s");
        let swap = FILES[3].1;
        assert_eq!(refused(&swap.replacen("release_s = 24", "release_s = 1", 1)).0, "payloads[0].release_s");
        assert_eq!(refused(&swap.replacen("mass_kg = 0.1", "mass_kg = -0.1", 1)).0, "payloads[0].mass_kg");
        let hold = FILES[2].1;
        assert_eq!(refused(&hold.replacen("q_rad = 3.3e-5", "q_rad = inf", 1)).0, "noise.q_rad");
        assert_eq!(refused(&format!("{hold}\n[integrator]\nmethod = 'euler'\n")).0, "integrator.method");
        assert_eq!(
            refused(&format!("{hold}\n[integrator]\nmethod = 'runge-kutta-4'\nsubsteps = 0\n")).0,
            "integrator.substeps"
        );
    }

    #[test]
    fn a_load_that_is_no_body_is_refused_when_bound() {
        let text = FILES[3].1.replacen("mass_kg = 0.1", "mass_kg = 0.1\nabout_com_kg_m2 = [1, 1, 3, 0, 0, 0]", 1);
        let scenario = Scenario::parse(Path::new("s"), &text).unwrap();
        assert_eq!(scenario.bind::<7>(&Robot::panda()).unwrap_err().key, "payloads[0]");
    }
}
