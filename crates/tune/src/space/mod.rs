//! The search space: what moves which gains, between which bounds, on which scale, and where the search starts.
//!
//! A point is a vector `x` of one coordinate per *knob*, each in `[0, 1]`. With bounds `lo < hi` a coordinate means
//!
//! ```text
//! value = exp(ln lo + x (ln hi - ln lo))     scale = "log"
//! value = lo + x (hi - lo)                   scale = "linear"
//! ```
//!
//! and a knob sets numbers of the gains' table, its rows by its joints, from its value:
//!
//! ```text
//! tie = "shared"     number = value                                      every joint the same; the default
//! tie = "start"      number = value x what the start has there           the start's pattern over rows and joints stays
//! tie = "inertia"    number = value x M_jj of its joint, kg m²           M at the scenario's start, nominal arm
//! ```
//!
//! Values and numbers are rounded to five significant decimal digits, so that the number that is simulated is the decimal number that is written to the gains file and
//! proved by the certificate. A solver may ask for any real `x`: it is folded back into `[0, 1]` as between two mirrors, which keeps the
//! objective continuous and, unlike clamping, leaves no direction in which it is flat.
//!
//! The file is TOML. A knob moves the row of its name on all joints unless `rows` or `joints` (counted from 1) say otherwise:
//!
//! ```toml
//! schema = 1
//! controller = "aic"                  # or "mrac", with its law = "reference-model"
//!
//! [search]
//! method = "schedule"                 # or "cma-es", "nelder-mead", "particle-swarm"
//! start = "pezzato2020-simulation"    # optional: a preset, or "cold", no gains at all
//! objective = "settling-cost"         # optional, see `goals`
//! cvar = 0.9                          # optional, see `goals`
//!
//! [limits]                            # optional, see `goals`
//! overshoot = 0.02
//!
//! [fixed]                             # a number for all joints, or a list of one for each
//! sigma_q = 1.0
//! sigma_dq = 1.0
//! reference_time_constant_s = 1.0
//!
//! [gains.kappa_mu]
//! lower = 2.0
//! upper = 60.0
//! scale = "log"
//!
//! [gains.sigmas]                      # one factor for two rows
//! rows = ["sigma_mu", "sigma_dmu"]
//! tie = "start"
//! lower = 0.1
//! upper = 10.0
//! scale = "log"
//!
//! [gains.arm]                         # one row, a knob for some joints each
//! rows = ["kappa_a"]
//! joints = [1, 2, 3, 4]
//! tie = "inertia"
//! lower = 50.0
//! upper = 20000.0
//! scale = "log"
//!
//! [gains.wrist]
//! rows = ["kappa_a"]
//! joints = [5, 6, 7]
//! lower = 5.0
//! upper = 2000.0
//! scale = "log"
//! ```
//!
//! Objective and limits are explained in [`goals`](crate::goals).
//!
//! Every number of every row is either fixed or moved by exactly one knob. Multiplying the AIC's kappas and sigmas by one number, or the MRAC's l₁ and l₂ by one and its gains by the
//! inverse, changes nothing ([`Space::written`]), so at least one of those rows must be fixed.
//!
//! A start must lie in the space, but for two liberties: it takes the space's law, and numbers that a knob moves together may differ there as no value of the knob makes them. It is
//! evaluated as it is, and the search goes on from the nearest point, in the mean of the logarithms.

mod error;
mod file;

use std::collections::BTreeMap;

use certune_closed_loop::{Gains, PerJoint};
use serde::{Deserialize, Serialize};

use crate::goals::Goals;

pub use error::SpaceError;
pub use file::{SPACE_SCHEMA, Setting, SpaceFile, Tie};

/// Significant decimal digits of a gain that the search proposes.
const DIGITS: usize = 5;

/// Numbers closer than this, as a fraction, differ by their rounding.
const ROUNDING: f64 = 1e-4;

/// How a search proceeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Nelder-Mead from the start, CMA-ES over the whole space, Nelder-Mead around the best.
    Schedule,
    /// CMA-ES with restarts.
    CmaEs,
    /// Nelder-Mead from the start, with restarts.
    NelderMead,
    /// A particle swarm over the whole box: a cold start.
    ParticleSwarm,
}

/// On which scale a knob moves evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Equal steps multiply the value by equal factors.
    Log,
    /// Equal steps add equal amounts.
    Linear,
}

/// Bounds and scale of a knob.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The smallest value, in the knob's unit.
    pub lower: f64,
    /// The largest value, in the knob's unit.
    pub upper: f64,
    /// The scale.
    pub scale: Scale,
}

impl Range {
    /// The value at a coordinate, which is folded back into `[0, 1]`; rounded to five significant digits.
    pub fn decode(&self, x: f64) -> f64 {
        let x = folded(x);
        let value = match self.scale {
            Scale::Log => (self.lower.ln() + x * (self.upper.ln() - self.lower.ln())).exp(),
            Scale::Linear => self.lower + x * (self.upper - self.lower),
        };
        rounded(value).clamp(self.lower, self.upper)
    }

    fn encode(&self, value: f64) -> f64 {
        let x = match self.scale {
            Scale::Log => (value.ln() - self.lower.ln()) / (self.upper.ln() - self.lower.ln()),
            Scale::Linear => (value - self.lower) / (self.upper - self.lower),
        };
        x.clamp(0.0, 1.0)
    }
}

/// `x` reflected at 0 and 1 until it lies between them.
fn folded(x: f64) -> f64 {
    let wave = x.rem_euclid(2.0);
    if wave <= 1.0 { wave } else { 2.0 - wave }
}

/// The nearest number with five significant decimal digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// A coordinate of the space, and the numbers that it sets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Knob {
    /// Its name in the file.
    pub name: String,
    /// Its bounds and scale.
    #[serde(flatten)]
    pub range: Range,
    /// How it sets its numbers.
    pub tie: Tie,
    /// What one unit of it puts on the joints of each of its rows; zero where another knob sets the number.
    pub per_unit: BTreeMap<String, PerJoint>,
}

impl Knob {
    fn new(name: &str, range: Range, tie: Tie) -> Self {
        Self { name: name.to_owned(), range, tie, per_unit: BTreeMap::new() }
    }

    /// The numbers of `gains` that the knob sets, each over what one unit puts there.
    fn values(&self, gains: &Gains) -> Vec<f64> {
        let mut values = Vec::new();
        for (row, per_unit) in &self.per_unit {
            let Some(numbers) = gains.row(row) else { continue };
            let places = per_unit.values().len().max(numbers.values().len());
            let pairs = (0..places).filter_map(|joint| Some((numbers.of(joint)?, per_unit.of(joint)?)));
            values.extend(pairs.filter(|(_, unit)| *unit > 0.0).map(|(number, unit)| number / unit));
        }
        values
    }

    /// The value at which the knob is nearest to `gains`: exactly theirs when all numbers agree, the mean of their logarithms otherwise.
    pub fn value(&self, gains: &Gains) -> f64 {
        let values = self.values(gains);
        match values.split_first() {
            Some((first, rest)) if rest.iter().all(|value| value.to_bits() == first.to_bits()) => *first,
            _ => (values.iter().map(|value| value.ln()).sum::<f64>() / values.len() as f64).exp(),
        }
    }

    /// The coordinate at which the knob is nearest to `gains`.
    pub(crate) fn place(&self, gains: &Gains) -> f64 {
        self.range.encode(self.value(gains))
    }

    /// `gains` with every number of the knob as its `value` has it.
    #[must_use]
    pub fn at(&self, gains: Gains, value: f64) -> Gains {
        // A bound may have more digits, and stays what it is.
        self.set(gains, |_, unit| if (unit - 1.0).abs() > 0.0 { rounded(value * unit) } else { value })
    }

    /// `gains` with every number of the knob set anew, from the old number and what one unit puts there.
    fn set(&self, mut gains: Gains, number: impl Fn(f64, f64) -> f64) -> Gains {
        for (row, per_unit) in &self.per_unit {
            let Some(numbers) = gains.row(row).cloned() else { continue };
            let at = |joint: usize| {
                let (old, unit) = (numbers.of(joint).unwrap_or(0.0), per_unit.of(joint).unwrap_or(0.0));
                if unit > 0.0 { number(old, unit) } else { old }
            };
            let joints = numbers.values().len().max(per_unit.values().len());
            let list = matches!((&numbers, per_unit), (PerJoint::Each(_), _) | (_, PerJoint::Each(_)));
            let set = if list { PerJoint::Each((0..joints).map(at).collect()) } else { PerJoint::Shared(at(0)) };
            gains = gains.with(row, set);
        }
        gains
    }

    /// `gains` with every number of the knob times `factor`.
    #[must_use]
    pub fn scaled(&self, gains: &Gains, factor: f64) -> Gains {
        self.set(gains.clone(), |old, _| old * factor)
    }
}

/// A validated search space on an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    method: Method,
    goals: Goals,
    /// The fixed rows; the numbers of the others mean nothing.
    fixed: Gains,
    knobs: Vec<Knob>,
}

impl Space {
    /// Every number of a row that is not fixed is set by exactly one knob.
    fn set_each_number_once(&self, joints: usize) -> Result<(), SpaceError> {
        for (row, _) in self.fixed.rows() {
            let users = || self.knobs.iter().filter_map(|knob| Some((knob, knob.per_unit.get(row)?)));
            if users().next().is_none() {
                continue;
            }
            for joint in 0..joints {
                let mut setting = users().filter(|(_, per_unit)| per_unit.of(joint).is_some_and(|unit| unit > 0.0));
                match (setting.next(), setting.next()) {
                    (None, _) => return Err(SpaceError::MissingJoint { row, joint: joint + 1 }),
                    (Some((one, _)), Some((other, _))) => {
                        return Err(SpaceError::Shared { row, knob: one.name.clone(), other: other.name.clone() });
                    }
                    (Some(_), None) => {}
                }
            }
        }
        Ok(())
    }

    /// The method that the file asks for.
    pub const fn method(&self) -> Method {
        self.method
    }

    /// The same space searched by another method.
    #[must_use]
    pub fn with_method(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// What the search is after and what it must keep; the settling cost and no limits unless the file says otherwise.
    pub const fn goals(&self) -> &Goals {
        &self.goals
    }

    /// The knobs, in the order of the coordinates.
    pub fn knobs(&self) -> &[Knob] {
        &self.knobs
    }

    /// The fixed rows with their keys, in the order of a gains file.
    pub fn fixed(&self) -> impl Iterator<Item = (&'static str, &PerJoint)> {
        let is_free = |row: &str| self.knobs.iter().any(|knob| knob.per_unit.contains_key(row));
        self.fixed.rows().into_iter().filter(move |(row, _)| !is_free(row))
    }

    /// The number of coordinates, at least 1.
    pub fn dimension(&self) -> usize {
        self.knobs.len()
    }

    /// The gains at a point. Total: a coordinate outside `[0, 1]` is folded back, a missing one counts as 0.
    pub fn decode(&self, point: &[f64]) -> Gains {
        let mut coordinates = point.iter().copied();
        self.knobs.iter().fold(self.fixed.clone(), |gains, knob| {
            knob.at(gains, knob.range.decode(coordinates.next().unwrap_or(0.0)))
        })
    }

    /// The nearest point to `gains`; for those of the space the inverse of [`Space::decode`] up to the rounding of the gains.
    pub fn encode(&self, gains: &Gains) -> Vec<f64> {
        self.knobs.iter().map(|knob| knob.place(gains)).collect()
    }

    /// `gains` as the space writes them: the same control law of an AIC in the scale of the fixed `sigma_q`, the gains of an MRAC under the space's law.
    ///
    /// # Errors
    /// [`SpaceError::StartController`] for gains of another controller.
    pub fn written(&self, gains: &Gains) -> Result<Gains, SpaceError> {
        match (&self.fixed, gains) {
            (Gains::Aic(fixed), Gains::Aic(table)) => {
                let is_fixed = self.fixed().any(|(row, _)| row == "sigma_q");
                let [wanted, found] = [&fixed.sigma_q, &table.sigma_q].map(PerJoint::shared);
                Ok(match (wanted.filter(|_| is_fixed), found) {
                    (Some(wanted), Some(found)) if (wanted - found).abs() > 0.0 => rescaled(gains, wanted, found),
                    _ => gains.clone(),
                })
            }
            (Gains::Mrac(fixed), Gains::Mrac(table)) => {
                let mut table = table.clone();
                table.law = fixed.law;
                Ok(Gains::Mrac(table))
            }
            (fixed, gains) => {
                Err(SpaceError::StartController { found: gains.controller(), expected: fixed.controller() })
            }
        }
    }

    /// `gains` as the space writes them, checked to be a start of a search in it.
    ///
    /// # Errors
    /// [`SpaceError`] with the first number that does not fit.
    pub fn admit(&self, gains: &Gains) -> Result<Gains, SpaceError> {
        let admitted = self.written(gains)?;
        for (row, fixed) in self.fixed() {
            let Some(numbers) = admitted.row(row) else { continue };
            for joint in 0..numbers.values().len().max(fixed.values().len()) {
                let (value, fixed) = (numbers.of(joint).unwrap_or(f64::NAN), fixed.of(joint).unwrap_or(f64::NAN));
                if !((value - fixed).abs() <= fixed * f64::EPSILON) {
                    return Err(SpaceError::StartNotFixed { row, value, fixed });
                }
            }
        }
        for knob in &self.knobs {
            let (value, Range { lower, upper, .. }) = (knob.value(&admitted), knob.range);
            let values = knob.values(&admitted);
            let follows = values.iter().all(|other| (other - value).abs() <= ROUNDING * value);
            // A value to the bit has no rounding.
            let slack = if values.iter().all(|other| other.to_bits() == value.to_bits()) { 0.0 } else { ROUNDING };
            let inside = value >= lower * (1.0 - slack) && value <= upper * (1.0 + slack);
            if follows && !inside {
                return Err(SpaceError::StartOutside { knob: knob.name.clone(), value, lower, upper });
            }
        }
        Ok(admitted)
    }
}

/// The same control law with `sigma_q = wanted`: the kappas and the sigmas times `wanted / found`.
fn rescaled(gains: &Gains, wanted: f64, found: f64) -> Gains {
    let factor = wanted / found;
    let scaled = |numbers: &PerJoint| match numbers {
        PerJoint::Shared(value) => PerJoint::Shared(value * factor),
        PerJoint::Each(list) => PerJoint::Each(list.iter().map(|value| value * factor).collect()),
    };
    let mut written = gains.clone();
    for (row, numbers) in gains.rows() {
        if row == "sigma_q" {
            written = written.with(row, PerJoint::Shared(wanted));
        } else if row != "reference_time_constant_s" {
            written = written.with(row, scaled(numbers));
        }
    }
    written
}

#[cfg(test)]
mod tests;
