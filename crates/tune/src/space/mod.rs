//! The search space: which gains move, between which bounds, on which scale, and where the search starts.
//!
//! A point is a vector `x` of one coordinate per free gain, each in `[0, 1]`. With bounds `lo < hi` a coordinate means
//!
//! ```text
//! gain = exp(ln lo + x (ln hi - ln lo))     scale = "log"
//! gain = lo + x (hi - lo)                   scale = "linear"
//! ```
//!
//! rounded to five significant decimal digits, so that the number that is simulated is the decimal number that is written to the gains file and
//! proved by the certificate. A solver may ask for any real `x`: it is folded back into `[0, 1]` as between two mirrors, which keeps the
//! objective continuous and, unlike clamping, leaves no direction in which it is flat.
//!
//! The file is TOML:
//!
//! ```toml
//! schema = 1
//! controller = "aic"
//!
//! [search]
//! method = "schedule"                 # or "cma-es", "nelder-mead", "particle-swarm"
//! start = "pezzato2020-simulation"    # optional: a preset, or "cold", no gains at all
//! objective = "settling-cost"         # optional: or "certified-rate", "certified-radius"
//!
//! [fixed]
//! sigma_q = 1.0
//! reference_time_constant_s = 1.0
//! sigma_mu = 5.0
//! sigma_dmu = 10.0
//!
//! [gains.kappa_mu]
//! lower = 2.0
//! upper = 60.0
//! scale = "log"
//!
//! [gains.kappa_a]
//! lower = 50.0
//! upper = 20000.0
//! scale = "log"
//!
//! [gains.sigma_dq]
//! lower = 0.2
//! upper = 5.0
//! scale = "log"
//! ```
//!
//! Every gain is either fixed or free, never both, never neither. The kappas and sigmas have one redundant direction ([`Gains::rescaled`]), so at
//! least one of them must be fixed.

use std::path::Path;

use certune_closed_loop::file::{FileError, KeyError, Location, Problem, read_text};
use serde::{Deserialize, Serialize};

use crate::gains::{Gain, Gains};

/// The version of the file that this crate reads.
pub const SPACE_SCHEMA: i64 = 1;

/// What `start` says when there are no gains to start from.
const COLD: &str = "cold";

/// Significant decimal digits of a gain that the search proposes.
const DIGITS: usize = 5;

/// Why a search space was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpaceError {
    /// The text is not TOML, is of another schema, holds an unknown key, or lacks one.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file reads well, but what it says makes no space.
    #[error("{location}: {problem}")]
    At {
        /// Where in the file.
        location: Location,
        /// What is wrong there.
        problem: Box<SpaceError>,
    },
    /// A controller that this crate cannot tune yet.
    #[error(
        "controller = \"mrac\": gains of the model-reference controller can be simulated but not tuned yet; expected \"aic\""
    )]
    MracNotTunable,
    /// A gain is neither fixed nor free.
    #[error("{gain} is missing: give it a value in [fixed] or bounds in [gains.{gain}]")]
    Missing {
        /// The gain.
        gain: Gain,
    },
    /// A gain is both fixed and free.
    #[error("{gain} is in [fixed] and in [gains.{gain}]: keep one of the two")]
    Twice {
        /// The gain.
        gain: Gain,
    },
    /// Nothing is left to search.
    #[error("every gain is fixed: give at least one of them bounds in [gains.<name>]")]
    NothingFree,
    /// All six gains of the redundant direction are free.
    #[error(
        "both kappas and all four sigmas are free, but multiplying all six by one number changes nothing: fix one of them, for instance sigma_q = 1.0"
    )]
    Redundant,
    /// A fixed gain is not a positive number.
    #[error("{gain} = {value}, expected a positive finite number")]
    Fixed {
        /// The gain.
        gain: Gain,
        /// The value given.
        value: f64,
    },
    /// A bound is not a positive number; every gain of the controller is one.
    #[error("gains.{gain}: the bounds are {lower} and {upper}, expected positive finite numbers")]
    Bounds {
        /// The gain.
        gain: Gain,
        /// The lower bound given.
        lower: f64,
        /// The upper bound given.
        upper: f64,
    },
    /// An empty or inverted range.
    #[error("gains.{gain}: lower = {lower} is not below upper = {upper}")]
    Inverted {
        /// The gain.
        gain: Gain,
        /// The lower bound given.
        lower: f64,
        /// The upper bound given.
        upper: f64,
    },
    /// A start outside the bounds.
    #[error("the search cannot start at {gain} = {value}, which is outside its bounds {lower} to {upper}")]
    StartOutside {
        /// The gain.
        gain: Gain,
        /// Its value at the start.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start that disagrees with a fixed gain.
    #[error("the search cannot start at {gain} = {value}: the space fixes it at {fixed}")]
    StartNotFixed {
        /// The gain.
        gain: Gain,
        /// Its value at the start, after scaling the start to the space's `sigma_q`.
        value: f64,
        /// The value that the space fixes.
        fixed: f64,
    },
}

impl SpaceError {
    /// The key of the file that the error speaks of, by its path from the top; empty for the file as a whole.
    fn key(&self) -> String {
        match self {
            Self::File(FileError { location, .. }) | Self::At { location, .. } => location.key.clone(),
            Self::MracNotTunable => "controller".to_owned(),
            Self::Fixed { gain, .. } => format!("fixed.{gain}"),
            Self::Twice { gain } | Self::Bounds { gain, .. } | Self::Inverted { gain, .. } => format!("gains.{gain}"),
            Self::NothingFree => "fixed".to_owned(),
            Self::Redundant | Self::Missing { .. } => "gains".to_owned(),
            Self::StartOutside { .. } | Self::StartNotFixed { .. } => "search.start".to_owned(),
        }
    }
}

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

/// What a search is after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObjectiveName {
    /// The least settling cost over simulated plants; its unit is s.
    #[default]
    SettlingCost,
    /// The largest certified decay rate of the linearised loops; the cost is its inverse, s.
    CertifiedRate,
    /// The largest certified radius of the nonlinear loop; the cost is its inverse, 1/rad.
    CertifiedRadius,
}

impl ObjectiveName {
    /// Every objective.
    pub const ALL: [Self; 3] = [Self::SettlingCost, Self::CertifiedRate, Self::CertifiedRadius];

    /// The name as it is written in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SettlingCost => "settling-cost",
            Self::CertifiedRate => "certified-rate",
            Self::CertifiedRadius => "certified-radius",
        }
    }
}

/// On which scale a gain moves evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Equal steps multiply the gain by equal factors.
    Log,
    /// Equal steps add equal amounts.
    Linear,
}

/// Bounds and scale of one free gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The smallest value, in the gain's unit.
    pub lower: f64,
    /// The largest value, in the gain's unit.
    pub upper: f64,
    /// The scale.
    pub scale: Scale,
}

impl Range {
    fn decode(&self, x: f64) -> f64 {
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

/// One entry per gain, as a table of a file.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, bound = "T: Deserialize<'de>")]
struct PerGain<T> {
    kappa_mu: Option<T>,
    kappa_a: Option<T>,
    sigma_q: Option<T>,
    sigma_dq: Option<T>,
    sigma_mu: Option<T>,
    sigma_dmu: Option<T>,
    reference_time_constant_s: Option<T>,
}

impl<T: Copy> PerGain<T> {
    const fn get(&self, gain: Gain) -> Option<T> {
        match gain {
            Gain::KappaMu => self.kappa_mu,
            Gain::KappaA => self.kappa_a,
            Gain::SigmaQ => self.sigma_q,
            Gain::SigmaDq => self.sigma_dq,
            Gain::SigmaMu => self.sigma_mu,
            Gain::SigmaDmu => self.sigma_dmu,
            Gain::ReferenceTimeConstantS => self.reference_time_constant_s,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FileController {
    Aic,
    Mrac,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSearch {
    method: Method,
    start: Option<String>,
    #[serde(default)]
    objective: ObjectiveName,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    controller: FileController,
    search: FileSearch,
    fixed: PerGain<f64>,
    gains: PerGain<Range>,
}

/// What one gain may be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Freedom {
    /// It stays.
    Fixed(f64),
    /// It moves.
    Free(Range),
}

/// A validated search space of the active inference controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    method: Method,
    start: Option<String>,
    objective: ObjectiveName,
    /// In the order of [`Gain::ALL`].
    freedoms: [Freedom; 7],
}

impl Space {
    /// Reads a space from the text of a file; `file` names the text in errors.
    ///
    /// # Errors
    /// [`SpaceError::File`] or [`SpaceError::At`], with the line, the key and the numbers.
    pub fn parse(file: &Path, text: &str) -> Result<Self, SpaceError> {
        let read: File = read_text(file, text, SPACE_SCHEMA)?;
        Self::from_file(read).map_err(|error| {
            let place = KeyError { key: error.key(), problem: Problem::MissingKey }.locate(file, text);
            SpaceError::At { location: place.location, problem: Box::new(error) }
        })
    }

    fn from_file(file: File) -> Result<Self, SpaceError> {
        match file.controller {
            FileController::Aic => {}
            FileController::Mrac => return Err(SpaceError::MracNotTunable),
        }
        let mut freedoms = [Freedom::Fixed(1.0); 7];
        for (slot, gain) in freedoms.iter_mut().zip(Gain::ALL) {
            *slot = match (file.fixed.get(gain), file.gains.get(gain)) {
                (Some(value), None) => Freedom::Fixed(value),
                (None, Some(range)) => Freedom::Free(range),
                (Some(_), Some(_)) => return Err(SpaceError::Twice { gain }),
                (None, None) => return Err(SpaceError::Missing { gain }),
            };
        }
        let objective = file.search.objective;
        Self::new(file.search.method, file.search.start, freedoms).map(|space| Self { objective, ..space })
    }

    /// A space from its parts, `freedoms` in the order of [`Gain::ALL`].
    ///
    /// # Errors
    /// [`SpaceError`] with the gain and the numbers.
    pub fn new(method: Method, start: Option<String>, freedoms: [Freedom; 7]) -> Result<Self, SpaceError> {
        for (freedom, gain) in freedoms.into_iter().zip(Gain::ALL) {
            match freedom {
                Freedom::Fixed(value) if value > 0.0 && value.is_finite() => {}
                Freedom::Fixed(value) => return Err(SpaceError::Fixed { gain, value }),
                Freedom::Free(Range { lower, upper, .. }) => {
                    if !(lower > 0.0 && upper > 0.0 && lower.is_finite() && upper.is_finite()) {
                        return Err(SpaceError::Bounds { gain, lower, upper });
                    }
                    if lower >= upper {
                        return Err(SpaceError::Inverted { gain, lower, upper });
                    }
                }
            }
        }
        let free = |freedom: &Freedom| matches!(freedom, Freedom::Free(_));
        if !freedoms.iter().any(free) {
            return Err(SpaceError::NothingFree);
        }
        let scaled = Gain::ALL.iter().zip(&freedoms).filter(|(gain, _)| **gain != Gain::ReferenceTimeConstantS);
        if scaled.clone().all(|(_, freedom)| free(freedom)) {
            return Err(SpaceError::Redundant);
        }
        Ok(Self { method, start, objective: ObjectiveName::default(), freedoms })
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

    /// What the file asks the search to be after; the settling cost unless it says otherwise.
    pub const fn objective(&self) -> ObjectiveName {
        self.objective
    }

    /// The name of the preset at which the search starts; none when the file names none, or starts cold.
    pub fn start(&self) -> Option<&str> {
        self.start.as_deref().filter(|start| *start != COLD)
    }

    /// Whether the search starts from no gains: the file says `start = "cold"`.
    pub fn is_cold(&self) -> bool {
        self.start.as_deref() == Some(COLD)
    }

    /// Fixed value or range of `gain`.
    pub const fn freedom(&self, gain: Gain) -> Freedom {
        self.freedoms[gain as usize]
    }

    /// The free gains with their ranges, in the order of the coordinates.
    pub fn free(&self) -> impl Iterator<Item = (Gain, Range)> + '_ {
        Gain::ALL.into_iter().zip(&self.freedoms).filter_map(|(gain, freedom)| match freedom {
            Freedom::Free(range) => Some((gain, *range)),
            Freedom::Fixed(_) => None,
        })
    }

    /// The number of coordinates, at least 1.
    pub fn dimension(&self) -> usize {
        self.free().count()
    }

    /// The gains at a point. Total: a coordinate outside `[0, 1]` is folded back, a missing one counts as 0.
    pub fn decode(&self, point: &[f64]) -> Gains {
        let mut coordinates = point.iter().copied();
        let mut gains = Gains {
            kappa_mu: 1.0,
            kappa_a: 1.0,
            sigma_q: 1.0,
            sigma_dq: 1.0,
            sigma_mu: 1.0,
            sigma_dmu: 1.0,
            reference_time_constant_s: 1.0,
        };
        for gain in Gain::ALL {
            let value = match self.freedom(gain) {
                Freedom::Fixed(value) => value,
                Freedom::Free(range) => range.decode(coordinates.next().unwrap_or(0.0)),
            };
            gains = gains.with(gain, value);
        }
        gains
    }

    /// The point of `gains` that lie in the space; the inverse of [`Space::decode`] up to the rounding of the gains.
    pub fn encode(&self, gains: &Gains) -> Vec<f64> {
        self.free().map(|(gain, range)| range.encode(gains.get(gain))).collect()
    }

    /// The same control law as `gains`, written with the space's fixed `sigma_q` if it has one, and checked to lie in the space.
    ///
    /// # Errors
    /// [`SpaceError::StartOutside`] or [`SpaceError::StartNotFixed`] with the first gain that does not fit.
    pub fn admit(&self, gains: &Gains) -> Result<Gains, SpaceError> {
        let admitted = match self.freedom(Gain::SigmaQ) {
            Freedom::Fixed(sigma_q) if (sigma_q - gains.sigma_q).abs() > 0.0 => gains.rescaled(sigma_q),
            Freedom::Fixed(_) | Freedom::Free(_) => *gains,
        };
        for gain in Gain::ALL {
            let value = admitted.get(gain);
            match self.freedom(gain) {
                Freedom::Free(Range { lower, upper, .. }) if value >= lower && value <= upper => {}
                Freedom::Free(Range { lower, upper, .. }) => {
                    return Err(SpaceError::StartOutside { gain, value, lower, upper });
                }
                Freedom::Fixed(fixed) if (value - fixed).abs() <= fixed * f64::EPSILON => {}
                Freedom::Fixed(fixed) => return Err(SpaceError::StartNotFixed { gain, value, fixed }),
            }
        }
        Ok(admitted)
    }
}

#[cfg(test)]
mod tests;
