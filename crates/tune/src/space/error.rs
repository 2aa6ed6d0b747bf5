//! Why a search space was refused.

use certune_closed_loop::file::{FileError, Location};

use crate::goals::GoalError;

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
    /// Goals that make no sense.
    #[error(transparent)]
    Goals(#[from] GoalError),
    /// A law where the controller has none to choose, or none where it has.
    #[error("{}", if *.wanted { "the adaptive controller has several laws: add law = \"reference-model\"" } else { "only controller = \"mrac\" has laws to choose from: remove the key" })]
    Law {
        /// Whether the controller needs one.
        wanted: bool,
    },
    /// A row is neither fixed nor free.
    #[error("{row} is missing: give it a value in [fixed] or bounds in [gains.{row}]")]
    Missing {
        /// The row.
        row: &'static str,
    },
    /// A joint of a row that nobody sets.
    #[error("{row} of joint {joint} is missing: no knob with that row lists the joint")]
    MissingJoint {
        /// The row.
        row: &'static str,
        /// The joint, from 1.
        joint: usize,
    },
    /// A row is both fixed and free.
    #[error("{row} is in [fixed] and in [gains.{knob}]: keep one of the two")]
    Twice {
        /// The row.
        row: &'static str,
        /// The knob that moves it.
        knob: String,
    },
    /// Two knobs move the same number.
    #[error(
        "gains.{knob} moves {row}, and so does gains.{other}: leave the row to one of them, or give them different joints"
    )]
    Shared {
        /// The row.
        row: &'static str,
        /// The knob.
        knob: String,
        /// The other knob.
        other: String,
    },
    /// A list without entries, or with a joint that the arm has not.
    #[error("gains.{knob}: joint {joint} is not one of the arm's joints 1 to {joints}")]
    Joint {
        /// The knob.
        knob: String,
        /// The joint given.
        joint: usize,
        /// The arm's joints.
        joints: usize,
    },
    /// A list that moves nothing.
    #[error("gains.{knob}: an empty list moves nothing; name at least one entry, or remove the key")]
    Empty {
        /// The knob.
        knob: String,
    },
    /// Nothing is left to search.
    #[error("every gain is fixed: give at least one of them bounds in [gains.<name>]")]
    NothingFree,
    /// Every gain of a redundant direction is free.
    #[error("{}", match *.controller {
        "mrac" => "l1, l2 and all gains are free, but multiplying l1 and l2 by a number and dividing the gains by it changes nothing: fix one of them, for instance l1 = 1.0",
        _ => "both kappas and all four sigmas are free, but multiplying all six by one number changes nothing: fix one of them, for instance sigma_q = 1.0",
    })]
    Redundant {
        /// The controller.
        controller: &'static str,
    },
    /// A fixed gain is not a positive number.
    #[error("{row} = {value}, expected a positive finite number")]
    Fixed {
        /// The row.
        row: &'static str,
        /// The value given.
        value: f64,
    },
    /// A bound is not a positive number; every gain of the controllers is one.
    #[error("gains.{knob}: the bounds are {lower} and {upper}, expected positive finite numbers")]
    Bounds {
        /// The knob.
        knob: String,
        /// The lower bound given.
        lower: f64,
        /// The upper bound given.
        upper: f64,
    },
    /// An empty or inverted range.
    #[error("gains.{knob}: lower = {lower} is not below upper = {upper}")]
    Inverted {
        /// The knob.
        knob: String,
        /// The lower bound given.
        lower: f64,
        /// The upper bound given.
        upper: f64,
    },
    /// A tie that needs to know the arm.
    #[error(
        "gains.{knob} sets gains joint by joint, which needs an arm: name the robot, or leave the knob to all joints alike"
    )]
    NeedsArm {
        /// The knob.
        knob: String,
    },
    /// A tie that needs to know the start.
    #[error("gains.{knob} scales the start's rows, but the search has no start: add `start` to [search]")]
    NeedsStart {
        /// The knob.
        knob: String,
    },
    /// A start of another controller.
    #[error("the search cannot start at gains for \"{found}\": the space is for \"{expected}\"")]
    StartController {
        /// The controller of the start.
        found: &'static str,
        /// That of the space.
        expected: &'static str,
    },
    /// A list that does not fit the arm.
    #[error("{row} has {found} numbers, but the arm has {joints} joints")]
    Length {
        /// The row.
        row: &'static str,
        /// The numbers given.
        found: usize,
        /// The arm's joints.
        joints: usize,
    },
    /// A start that does not fit the arm.
    #[error("the search cannot start there: {0}")]
    Start(Box<SpaceError>),
    /// A start outside the bounds.
    #[error("the search cannot start at {knob} = {value}, which is outside its bounds {lower} to {upper}")]
    StartOutside {
        /// The knob.
        knob: String,
        /// Its value at the start.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start that disagrees with a fixed gain.
    #[error("the search cannot start at {row} = {value}: the space fixes it at {fixed}")]
    StartNotFixed {
        /// The row.
        row: &'static str,
        /// Its value at the start, after scaling the start to the space's `sigma_q`.
        value: f64,
        /// The value that the space fixes.
        fixed: f64,
    },
}

impl SpaceError {
    /// The key of the file that the error speaks of, by its path from the top; empty for the file as a whole.
    pub(super) fn key(&self) -> String {
        match self {
            Self::File(FileError { location, .. }) | Self::At { location, .. } => location.key.clone(),
            Self::Goals(error) => error.key(),
            Self::Law { wanted: true } => "controller".to_owned(),
            Self::Law { wanted: false } => "law".to_owned(),
            Self::Fixed { row, .. } | Self::Length { row, .. } => format!("fixed.{row}"),
            Self::Twice { knob, .. }
            | Self::Shared { knob, .. }
            | Self::Joint { knob, .. }
            | Self::Empty { knob }
            | Self::Bounds { knob, .. }
            | Self::Inverted { knob, .. }
            | Self::NeedsArm { knob }
            | Self::NeedsStart { knob } => format!("gains.{knob}"),
            Self::NothingFree => "fixed".to_owned(),
            Self::Redundant { .. } | Self::Missing { .. } | Self::MissingJoint { .. } => "gains".to_owned(),
            Self::Start(_) | Self::StartController { .. } | Self::StartOutside { .. } | Self::StartNotFixed { .. } => {
                "search.start".to_owned()
            }
        }
    }
}
