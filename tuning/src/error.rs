//! What can go wrong, and what to do about it: one message, and a line of advice.

use std::io;
use std::path::PathBuf;

use certune::StabilityError;
use certune::closed_loop::{FileError, KeyError, PlantError};
use certune::control::ParamError;
use certune::dynamics::RobotError;
use certune::report::ReportError;
use certune::tune::{BatchError, Goal, SearchError, SpaceError, TuneError};
use certune::verify::VerifyError;
use certune_paper::CompareError;

use crate::journal::JournalError;

/// What a name on the command line is the name of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Robot,
    Preset,
    Scenario,
    Space,
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Preset => "preset",
            Self::Scenario => "scenario",
            Self::Space => "search space",
        }
    }
}

/// Why a command came to no answer.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A name that is neither built in nor a file.
    #[error("unknown {} `{name}`: it is neither built in nor a file", kind.word())]
    Unknown { kind: Kind, name: String, nearest: Option<String>, known: Vec<&'static str> },
    /// A file that people edit.
    #[error(transparent)]
    File(#[from] FileError),
    /// A search space.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// A robot's description.
    #[error("{}{source}", file.as_ref().map(|file| format!("{}: ", file.display())).unwrap_or_default())]
    Robot { file: Option<PathBuf>, source: RobotError },
    /// More joints than any command is compiled for.
    #[error("robot `{robot}` has {joints} joints; from 1 to {most} are supported")]
    Joints { robot: String, joints: usize, most: usize },
    /// A scenario that does not fit the robot.
    #[error("scenario `{scenario}` does not fit robot `{robot}`: {source}")]
    ScenarioFit { scenario: String, robot: String, source: Box<KeyError> },
    /// A plant that cannot be built.
    #[error("the plant is not valid: {0}")]
    Plant(#[from] PlantError),
    /// Gains that make no controller.
    #[error("gains `{gains}`: {source}")]
    Gains { gains: String, source: ParamError },
    /// A search space of another controller than the one to be tuned.
    #[error("--controller {wanted}, but search space `{space}` holds gains for `{found}`")]
    OtherController { space: String, found: &'static str, wanted: &'static str },
    /// A figure that the controller's claims do not have.
    #[error("{goal} is no goal of a search for gains of `mrac`: no claim about it has this figure")]
    NoFigure { goal: Goal },
    /// A run that would have nothing to be compared with.
    #[error("search space `{space}` says start = \"cold\", but a run is reported beside the gains that it starts from")]
    ColdStart { space: String },
    /// A dashboard that nobody would see.
    #[error("--dashboard draws on a terminal, and stderr is none")]
    NoTerminal,
    /// A terminal that cannot be drawn on.
    #[error("cannot draw on the terminal: {0}")]
    Screen(#[source] io::Error),
    /// Goals that make no front.
    #[error(transparent)]
    Front(#[from] certune::tune::front::FrontError),
    /// A number that no point has.
    #[error("point {point}: the front has the points 1 to {most}")]
    NoPoint { point: usize, most: usize },
    /// A point that was certified once and is not now, which would be another version's doing.
    #[error("point {point} is not certified by this version; nothing was written")]
    PointRefused { point: usize },
    /// A list on the command line that does not fit the robot.
    #[error("{flag} has {found} numbers, but robot `{robot}` has {joints} joints")]
    ListLength { flag: &'static str, found: usize, robot: String, joints: usize },
    /// No certificate could be attempted.
    #[error("{0}")]
    Stability(#[from] StabilityError),
    /// The scenario gives no plants.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// The search was refused.
    #[error(transparent)]
    Tune(#[from] TuneError),
    /// No comparison can be made of this.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The page could not be made.
    #[error("the report could not be made: {0}")]
    Report(#[from] ReportError),
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// Ctrl-C cannot be listened to.
    #[error("cannot listen to Ctrl-C: {0}")]
    Signal(io::Error),
    /// Standard input cannot be read.
    #[error("cannot read standard input: {0}")]
    Stdin(io::Error),
    /// Standard output went away.
    #[error("cannot write to standard output: {0}")]
    Stdout(io::Error),
    /// A certificate that is none.
    #[error("{}: {source}", path.display())]
    Certificate { path: PathBuf, source: VerifyError },
    /// A readable certificate that a run cannot rest on.
    #[error("{}: the certificate is rejected: {source}", path.display())]
    Rejected { path: PathBuf, source: certune::verify::Rejection },
    /// A record of proved constants that is none.
    #[error("{}: not a record of proved constants: {source}", path.display())]
    Record { path: PathBuf, source: VerifyError },
    /// A readable record that contradicts itself or was edited.
    #[error("{}: the record of proved constants is rejected: {source}", path.display())]
    RecordRejected { path: PathBuf, source: certune::verify::Rejection },
    /// A record about a robot that is not built in.
    #[error("the record is about robot `{robot}` ({sha256}), which is not built in")]
    RobotOfRecord { robot: String, sha256: String },
    /// A folder without a file that every run has.
    #[error("cannot read {}: {source}", path.display())]
    NoRun { path: PathBuf, source: io::Error },
    /// A run's record that is none.
    #[error("{}: not the record of a run: {source}", path.display())]
    RunRecord { path: PathBuf, source: serde_json::Error },
    /// A record that speaks of things that are not in it.
    #[error("{}: not the record of a run: {what}", path.display())]
    RunInconsistent { path: PathBuf, what: &'static str },
    /// The robot at hand is not the one of the run.
    #[error("the run was made with another robot: its description hashes to {recorded}, this one to {found}")]
    OtherRobot { recorded: String, found: String },
    /// A run on a URDF file, whose path is in no record.
    #[error("the run's robot `{robot}` is not built in, and its file is not part of the record")]
    RobotOfRun { robot: String },
    /// The journal of a run that is not finished.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// Something does not serialise, which would be a defect.
    #[error("the result cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// The system gives no threads.
    #[error("cannot start {threads} threads: {source}")]
    Threads { threads: usize, source: rayon::ThreadPoolBuildError },
}

impl Error {
    /// The message as it is printed.
    pub fn in_full(&self) -> String {
        let message = format!("error: {self}");
        match self.advice() {
            Some(advice) => format!("{message}\n  try: {advice}"),
            None => message,
        }
    }

    /// What to do about it; `None` where the message itself says it.
    fn advice(&self) -> Option<String> {
        match self {
            Self::Unknown { kind, nearest, known, .. } => Some(unknown_advice(*kind, nearest.as_deref(), known)),
            Self::Robot { source, .. } => robot_advice(source),
            Self::ScenarioFit { .. } => Some(
                "--scenario with a file written for this robot; without --scenario, a URDF robot gets a generic one"
                    .to_owned(),
            ),
            Self::OtherController { found, .. } => Some(format!("--controller {found}, or another --space")),
            Self::NoFigure { .. } => Some("another --objective or limit, or --controller aic".to_owned()),
            Self::ColdStart { .. } => Some(
                "a preset as [search] start, see `autotune presets`; `autotune ask-tell` searches from no gains"
                    .to_owned(),
            ),
            Self::Front(certune::tune::front::FrontError::Goals { .. }) => {
                Some("--goals settling-time,jitter,certified-radius".to_owned())
            }
            Self::NoTerminal | Self::Screen(_) => Some("the same without --dashboard".to_owned()),
            Self::NoPoint { .. } => Some("a number of the table in the front's folder, front.html".to_owned()),
            Self::PointRefused { .. } => Some("the front made again with this version".to_owned()),
            Self::ListLength { joints, .. } => Some(format!("{joints} numbers separated by commas, base to tip")),
            Self::Stability(StabilityError::NoTorqueLimit { .. }) => {
                Some("--torque-limits with a number, or an `effort` for every joint in the URDF file".to_owned())
            }
            Self::Stability(StabilityError::Delay { .. }) => Some("a scenario without delay".to_owned()),
            Self::Tune(TuneError::Search(SearchError::NoBudget)) => Some("--budget 1 or more".to_owned()),
            Self::Tune(TuneError::Search(SearchError::Start(_))) => {
                Some("another `start` in the search space, or wider bounds".to_owned())
            }
            Self::Io { action: "create", .. } => Some("--out with a folder that you may write to".to_owned()),
            Self::Io { action: "list", .. } => Some("a folder that holds the folders of runs".to_owned()),
            Self::Io { action: "write", .. } => Some("another place that you may write to".to_owned()),
            Self::Certificate { .. } => Some("the certificate.json of a run, whole and unedited".to_owned()),
            Self::Rejected { .. } => Some("the certificate.json that the run wrote, or repeat the run".to_owned()),
            Self::Record { .. } | Self::RecordRejected { .. } => {
                Some("a file that `autotune constants` wrote, whole and unedited".to_owned())
            }
            Self::NoRun { .. } | Self::RunRecord { .. } | Self::RunInconsistent { .. } => {
                Some("a folder that `autotune tune` wrote".to_owned())
            }
            Self::RobotOfRecord { .. } => Some("--robot with its URDF file (and --tip, if it was named)".to_owned()),
            Self::OtherRobot { .. } | Self::RobotOfRun { .. } => {
                Some("--robot with the URDF file of that run (and --tip, if it was named)".to_owned())
            }
            Self::Compare(CompareError::Joints { .. } | CompareError::Geometry { .. }) => {
                Some("--robot panda, panda-bare or panda-cuboid, or a URDF file of the Panda".to_owned())
            }
            Self::Compare(CompareError::Controller { expected, .. }) => {
                Some(format!("gains of `{expected}`, see `autotune presets`"))
            }
            Self::Journal(error) => error.advice(),
            Self::Threads { .. } => Some("a smaller --threads".to_owned()),
            Self::File(error) if matches!(*error.problem, certune::closed_loop::Problem::Unreadable { .. }) => None,
            Self::Io { .. }
            | Self::File(_)
            | Self::Space(_)
            | Self::Joints { .. }
            | Self::Plant(_)
            | Self::Gains { .. }
            | Self::Stability(_)
            | Self::Compare(_)
            | Self::Batch(_)
            | Self::Front(_)
            | Self::Tune(_)
            | Self::Report(_)
            | Self::Signal(_)
            | Self::Stdin(_)
            | Self::Stdout(_)
            | Self::Json(_) => None,
        }
    }
}

fn unknown_advice(kind: Kind, nearest: Option<&str>, known: &[&str]) -> String {
    let list = match kind {
        Kind::Robot => "`autotune robots` lists them; a URDF file is given by its path",
        Kind::Preset => "`autotune presets` lists them; a gains file is given by its path",
        Kind::Scenario => "`autotune scenarios` lists them; a scenario file is given by its path",
        Kind::Space => "a search space file is given by its path",
    };
    match nearest {
        Some(nearest) => format!("`{nearest}`; {list}"),
        None => format!("one of {}; {list}", known.join(", ")),
    }
}

fn robot_advice(source: &RobotError) -> Option<String> {
    let advice = match source {
        RobotError::Read { .. } => "check the path; `autotune robots` lists the built-in robots",
        RobotError::Parse { .. } => "a URDF file; expand xacro first (`xacro arm.urdf.xacro > arm.urdf`)",
        RobotError::Mass { .. }
        | RobotError::InertiaWithoutMass { .. }
        | RobotError::InertiaNotFinite { .. }
        | RobotError::NotPositiveDefinite { .. }
        | RobotError::TriangleInequality { .. }
        | RobotError::CentreOfMass { .. } => {
            "correct this link's <inertial> in the file; it is never repaired silently"
        }
        RobotError::UnknownTip { .. } => "--tip with one of these links",
        RobotError::RigidTip { .. } => "--tip with a link further out",
        RobotError::TooManyJoints { .. } => "--tip with a link closer to the base",
        RobotError::NoJoint
        | RobotError::Gravity { .. }
        | RobotError::FrameNotFinite { .. }
        | RobotError::NotARotation { .. }
        | RobotError::Range { .. }
        | RobotError::NotPositive { .. }
        | RobotError::Negative { .. }
        | RobotError::JointCount { .. }
        | RobotError::JointKind { .. }
        | RobotError::Axis { .. }
        | RobotError::UnknownLink { .. }
        | RobotError::Duplicate { .. }
        | RobotError::TwoParents { .. }
        | RobotError::Roots { .. }
        | RobotError::Loop { .. }
        | RobotError::Branches { .. } => return None,
    };
    Some(advice.to_owned())
}
