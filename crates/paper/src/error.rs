//! Why there is no comparison.

use certune_closed_loop::{KeyError, PlantError};
use certune_control::ParamError;
use certune_dynamics::RobotError;
use certune_tune::{BatchError, SearchError, SpaceError};

/// Why there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The goals and gains of the paper are those of an arm with seven joints.
    #[error(
        "robot {robot} has {joints} joints, expected the 7 of the Panda: the paper's goals and gains are for no other arm"
    )]
    Joints {
        /// Its name.
        robot: String,
        /// Its joints.
        joints: usize,
    },
    /// Seven joints, but not the Panda's.
    #[error(
        "the joint before {link} of robot {robot} is not where the Panda has it: the paper's goals and gains are for no other arm"
    )]
    Geometry {
        /// The robot's name.
        robot: String,
        /// The link behind the joint.
        link: String,
    },
    /// A comparison needs arms.
    #[error("a comparison needs at least 1 arm, got 0")]
    NoArms,
    /// Gains of the other controller.
    #[error("the gains of {contender} are for the controller `{found}`, expected `{expected}`")]
    Controller {
        /// For whom they were given.
        contender: &'static str,
        /// What they are for.
        found: &'static str,
        /// What they should be for.
        expected: &'static str,
    },
    /// A scenario without what its experiment needs.
    #[error("scenario {scenario} has {found} {what}, expected at least {expected}")]
    Scenario {
        /// Its name.
        scenario: String,
        /// What is missing.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many are needed.
        expected: usize,
    },
    /// A scenario or gains that do not fit the arm.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// Gains that make no controller.
    #[error(transparent)]
    Gains(#[from] ParamError),
    /// An arm that cannot be simulated.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// An arm that is none.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A search space that does not fit the arm.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// A search that cannot run.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// A search without plants.
    #[error(transparent)]
    Batch(#[from] BatchError),
}
