//! The file of a search space, before it meets an arm and a start.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use certune_closed_loop::file::{KeyError, Problem, nearest, read_text};
use certune_closed_loop::{AicTable, Gains, LawName, MracTable, PerJoint};
use serde::{Deserialize, Serialize};

use super::{Knob, Method, Range, Scale, Space, SpaceError};
use crate::goals::{Bound, Goal, Goals, Limit};

/// The version of the file that this crate reads.
pub const SPACE_SCHEMA: i64 = 1;

/// What `start` says when there are no gains to start from.
const COLD: &str = "cold";

/// Rows that may be zero: the adaptive controller's derivative gains.
const MAY_BE_ZERO: [&str; 5] = ["alpha3", "e03", "e13", "f03", "f13"];

/// How a knob sets the numbers that it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tie {
    /// All are the knob's value.
    #[default]
    Shared,
    /// Each is the knob's value times what the start has there.
    Start,
    /// Each is the knob's value times the inertia of its joint.
    Inertia,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FileController {
    Aic,
    Mrac,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSearch {
    method: Method,
    start: Option<String>,
    #[serde(default)]
    objective: Goal,
    cvar: Option<f64>,
}

/// [`Goal::key`] by [`Goal::key`], so that an unknown key is refused by its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileLimits {
    settling_cost_s: Option<Bound>,
    settling_time_s: Option<Bound>,
    final_error_rad: Option<Bound>,
    itae_rad_s2: Option<Bound>,
    overshoot: Option<Bound>,
    torque_rate_rms_n_m_per_s: Option<Bound>,
    peak_torque_n_m: Option<Bound>,
    energy_j: Option<Bound>,
    certified_rate_per_s: Option<Bound>,
    certified_radius_rad: Option<Bound>,
    delay_margin_s: Option<Bound>,
}

impl FileLimits {
    const fn get(&self, goal: Goal) -> Option<Bound> {
        match goal {
            Goal::SettlingCost => self.settling_cost_s,
            Goal::SettlingTime => self.settling_time_s,
            Goal::FinalError => self.final_error_rad,
            Goal::Itae => self.itae_rad_s2,
            Goal::Overshoot => self.overshoot,
            Goal::Jitter => self.torque_rate_rms_n_m_per_s,
            Goal::PeakTorque => self.peak_torque_n_m,
            Goal::Energy => self.energy_j,
            Goal::CertifiedRate => self.certified_rate_per_s,
            Goal::CertifiedRadius => self.certified_radius_rad,
            Goal::DelayMargin => self.delay_margin_s,
        }
    }

    fn all(&self) -> Vec<Limit> {
        Goal::ALL.into_iter().filter_map(|goal| Some(Limit { goal, bound: self.get(goal)? })).collect()
    }
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileKnob {
    lower: f64,
    upper: f64,
    scale: Scale,
    #[serde(default)]
    tie: Tie,
    rows: Option<Vec<String>>,
    joints: Option<Vec<usize>>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    controller: FileController,
    law: Option<LawName>,
    search: FileSearch,
    #[serde(default)]
    limits: FileLimits,
    fixed: BTreeMap<String, PerJoint>,
    gains: BTreeMap<String, FileKnob>,
}

/// A knob with the rows that it moves, in the order of a gains file.
#[derive(Clone, Debug, PartialEq)]
struct FreeRows {
    name: String,
    range: Range,
    tie: Tie,
    rows: Vec<&'static str>,
    /// Counted from 0; all of the arm's when absent.
    joints: Option<Vec<usize>>,
}

/// A search space as its file says it: [`SpaceFile::on`] makes it the space of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceFile {
    path: PathBuf,
    text: String,
    search: FileSearch,
    goals: Goals,
    /// The fixed rows; the numbers of the others mean nothing.
    fixed: Gains,
    knobs: Vec<FreeRows>,
}

/// An arm as a space sees it, and where its search begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct Setting<'a> {
    /// The gains at which the search begins.
    pub start: Option<&'a Gains>,
    /// The inertia about each joint: the diagonal of M at the scenario's start, nominal arm. Absent when no arm is known.
    pub inertia_kg_m2: Option<&'a [f64]>,
}

impl SpaceFile {
    /// Reads the text of a file; `path` names the text in errors.
    ///
    /// # Errors
    /// [`SpaceError::File`] or [`SpaceError::At`], with the line, the key and the numbers.
    pub fn parse(path: &Path, text: &str) -> Result<Self, SpaceError> {
        let File { controller, law, search, limits, fixed, gains } = read_text(path, text, SPACE_SCHEMA)?;
        let blank: Gains = match (controller, law) {
            (FileController::Aic, None) => AicTable::uniform(1.0).into(),
            (FileController::Mrac, Some(law)) => MracTable::uniform(law, 1.0).into(),
            (FileController::Aic, Some(_)) => return Err(located(path, text, SpaceError::Law { wanted: false })),
            (FileController::Mrac, None) => return Err(located(path, text, SpaceError::Law { wanted: true })),
        };
        let keys: Vec<&'static str> = blank.rows().into_iter().map(|(key, _)| key).collect();
        let known = |place: String, name: &str| match keys.iter().find(|key| **key == name) {
            Some(key) => Ok(*key),
            None => {
                let nearest = nearest(name, keys.iter().copied()).map(str::to_owned);
                let expected = keys.iter().map(|key| (*key).to_owned()).collect();
                Err(KeyError { key: place, problem: Problem::UnknownKey { nearest, expected } }.locate(path, text))
            }
        };
        let mut table = blank;
        let mut fixed_rows = Vec::new();
        for (name, numbers) in fixed {
            let row = known(format!("fixed.{name}"), &name)?;
            fixed_rows.push(row);
            table = table.with(row, numbers);
        }
        let mut knobs = Vec::new();
        for (name, FileKnob { lower, upper, scale, tie, rows, joints }) in gains {
            let place = format!("gains.{name}");
            let mut moved = match &rows {
                None => vec![known(place, &name)?],
                Some(rows) => {
                    let row = |(index, row): (usize, &String)| known(format!("{place}.rows[{index}]"), row);
                    rows.iter().enumerate().map(row).collect::<Result<_, _>>()?
                }
            };
            moved.sort_by_key(|row| keys.iter().position(|key| key == row));
            moved.dedup();
            let range = Range { lower, upper, scale };
            // Joint 0 becomes one that no arm has.
            let joints = joints.map(|list| list.into_iter().map(|joint| joint.wrapping_sub(1)).collect());
            knobs.push(FreeRows { name, range, tie, rows: moved, joints });
        }
        // In the order of a gains file; of the same row, that of the joints.
        let place = |knob: &FreeRows| {
            let row = knob.rows.first().and_then(|row| keys.iter().position(|key| key == row));
            (row, knob.joints.clone())
        };
        knobs.sort_by_key(place);
        let default = Goals::default();
        let goals =
            Goals { objective: search.objective, cvar: search.cvar.unwrap_or(default.cvar), limits: limits.all() };
        let file = Self { path: path.to_path_buf(), text: text.to_owned(), search, goals, fixed: table, knobs };
        file.check(&fixed_rows).map_err(|error| file.locate(error))?;
        Ok(file)
    }

    /// What can be wrong before an arm is known.
    fn check(&self, fixed: &[&'static str]) -> Result<(), SpaceError> {
        self.goals.validate()?;
        for (row, numbers) in self.fixed.rows() {
            let users = || self.knobs.iter().filter(move |knob| knob.rows.contains(&row));
            let is_fixed = fixed.contains(&row);
            match (is_fixed, users().next()) {
                (true, Some(knob)) => return Err(SpaceError::Twice { row, knob: knob.name.clone() }),
                (false, None) => return Err(SpaceError::Missing { row }),
                (true, None) | (false, Some(_)) => {}
            }
            let fits = |value: &&f64| **value > 0.0 || (**value >= 0.0 && MAY_BE_ZERO.contains(&row));
            if let Some(value) = numbers.values().iter().find(|value| !fits(value)) {
                return Err(SpaceError::Fixed { row, value: *value });
            }
        }
        for knob in &self.knobs {
            let (name, Range { lower, upper, .. }) = (&knob.name, knob.range);
            if !(lower > 0.0 && upper > 0.0 && lower.is_finite() && upper.is_finite()) {
                return Err(SpaceError::Bounds { knob: name.clone(), lower, upper });
            }
            if lower >= upper {
                return Err(SpaceError::Inverted { knob: name.clone(), lower, upper });
            }
            if knob.rows.is_empty() || knob.joints.as_ref().is_some_and(Vec::is_empty) {
                return Err(SpaceError::Empty { knob: name.clone() });
            }
        }
        if self.knobs.is_empty() {
            return Err(SpaceError::NothingFree);
        }
        // One direction of the gains changes nothing; a gain of zero does not hold it.
        let holds = |row: &&'static str| {
            let apart = ["reference_time_constant_s", "omega_rad_per_s", "zeta"].contains(row);
            let zero = self.fixed.row(row).is_some_and(|numbers| numbers.values().iter().all(|value| !(*value > 0.0)));
            !apart && !zero
        };
        if !fixed.iter().any(holds) {
            return Err(SpaceError::Redundant { controller: self.fixed.controller() });
        }
        Ok(())
    }

    /// The error with its place in the file.
    fn locate(&self, error: SpaceError) -> SpaceError {
        located(&self.path, &self.text, error)
    }

    /// The name of the preset at which the search starts; none when the file names none, or starts cold.
    pub fn start(&self) -> Option<&str> {
        self.search.start.as_deref().filter(|start| *start != COLD)
    }

    /// Whether the search starts from no gains: the file says `start = "cold"`.
    pub fn is_cold(&self) -> bool {
        self.search.start.as_deref() == Some(COLD)
    }

    /// What the search is after and what it must keep.
    pub const fn goals(&self) -> &Goals {
        &self.goals
    }

    /// The same space with a row held at one number on all joints. A knob that moved nothing else is gone; a row that no gains file has changes nothing.
    #[must_use]
    pub fn holding(mut self, row: &str, value: f64) -> Self {
        self.fixed = self.fixed.with(row, PerJoint::Shared(value));
        for knob in &mut self.knobs {
            knob.rows.retain(|moved| *moved != row);
        }
        self.knobs.retain(|knob| !knob.rows.is_empty());
        self
    }

    /// The controller whose gains the space holds.
    pub const fn controller(&self) -> &'static str {
        self.fixed.controller()
    }

    /// The space on an arm, and a start if it has one.
    ///
    /// # Errors
    /// [`SpaceError::At`] when the ties need what `setting` does not have, when the joints are not those of the arm, or the start does not lie in the space.
    pub fn on(&self, setting: Setting<'_>) -> Result<Space, SpaceError> {
        self.bound(setting).map_err(|error| self.locate(error))
    }

    fn bound(&self, Setting { start, inertia_kg_m2 }: Setting<'_>) -> Result<Space, SpaceError> {
        let joints = inertia_kg_m2.map(<[f64]>::len);
        for (row, numbers) in self.fixed.rows() {
            fits(row, numbers, joints)?;
        }
        let mut space = Space {
            method: self.search.method,
            goals: self.goals.clone(),
            fixed: self.fixed.clone(),
            knobs: self.knobs.iter().map(|FreeRows { name, range, tie, .. }| Knob::new(name, *range, *tie)).collect(),
        };
        let start = start.map(|gains| space.written(gains)).transpose()?;
        for (row, numbers) in start.iter().flat_map(Gains::rows) {
            fits(row, numbers, joints).map_err(|error| SpaceError::Start(Box::new(error)))?;
        }
        for (knob, found) in self.knobs.iter().zip(&mut space.knobs) {
            for row in &knob.rows {
                found.per_unit.insert((*row).to_owned(), knob.per_unit(row, start.as_ref(), inertia_kg_m2)?);
            }
        }
        space.set_each_number_once(joints.unwrap_or(1))?;
        if let Some(start) = &start {
            space.admit(start)?;
        }
        Ok(space)
    }
}

/// A list must have a number for every joint of the arm.
fn fits(row: &'static str, numbers: &PerJoint, joints: Option<usize>) -> Result<(), SpaceError> {
    match (numbers, joints) {
        (PerJoint::Each(list), Some(joints)) if list.len() != joints => {
            Err(SpaceError::Length { row, found: list.len(), joints })
        }
        _ => Ok(()),
    }
}

fn located(path: &Path, text: &str, error: SpaceError) -> SpaceError {
    let place = KeyError { key: error.key(), problem: Problem::MissingKey }.locate(path, text);
    SpaceError::At { location: place.location, problem: Box::new(error) }
}

impl FreeRows {
    /// What one unit of the knob puts on each joint of `row`; zero where another knob sets the number.
    fn per_unit(
        &self,
        row: &str,
        start: Option<&Gains>,
        inertia_kg_m2: Option<&[f64]>,
    ) -> Result<PerJoint, SpaceError> {
        let knob = || self.name.clone();
        let whole = match self.tie {
            Tie::Shared => PerJoint::Shared(1.0),
            Tie::Start => match start {
                None => return Err(SpaceError::NeedsStart { knob: knob() }),
                Some(start) => start.row(row).cloned().unwrap_or(PerJoint::Shared(1.0)),
            },
            Tie::Inertia => match inertia_kg_m2 {
                None => return Err(SpaceError::NeedsArm { knob: knob() }),
                Some(inertia_kg_m2) => PerJoint::Each(inertia_kg_m2.to_vec()),
            },
        };
        let Some(listed) = &self.joints else { return Ok(whole) };
        let Some(inertia_kg_m2) = inertia_kg_m2 else { return Err(SpaceError::NeedsArm { knob: knob() }) };
        let joints = inertia_kg_m2.len();
        if let Some(joint) = listed.iter().find(|joint| **joint >= joints) {
            return Err(SpaceError::Joint { knob: knob(), joint: joint.wrapping_add(1), joints });
        }
        let number = |joint| if listed.contains(&joint) { whole.of(joint).unwrap_or(0.0) } else { 0.0 };
        Ok(PerJoint::Each((0..joints).map(number).collect()))
    }
}
