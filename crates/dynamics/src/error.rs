//! What can be wrong with a robot's description.

use std::path::PathBuf;

/// Why a description is no arm this crate can move. The message names the link or joint and the numbers.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// No movable joint.
    #[error("the arm has no movable joint; at least one is needed")]
    NoJoint,
    /// Gravity is not finite.
    #[error("gravity is {gravity_m_per_s2:?} m/s^2, expected three finite numbers")]
    Gravity {
        /// The vector given, m/s^2.
        gravity_m_per_s2: [f64; 3],
    },
    /// A mass is not positive and finite.
    #[error("link `{link}`: the mass is {mass_kg} kg, expected a positive finite number")]
    Mass {
        /// The link.
        link: String,
        /// The mass, kg.
        mass_kg: f64,
    },
    /// A body without mass has a rotational inertia.
    #[error("link `{link}`: the mass is 0 but the inertia has an entry of {entry_kg_m2} kg m^2; no body is like that")]
    InertiaWithoutMass {
        /// The link.
        link: String,
        /// The largest entry, kg m^2.
        entry_kg_m2: f64,
    },
    /// A centre of mass is not finite.
    #[error("link `{link}`: the centre of mass is {com_m:?} m, expected three finite numbers")]
    CentreOfMass {
        /// The link.
        link: String,
        /// The point given, m.
        com_m: [f64; 3],
    },
    /// An inertia entry is not finite.
    #[error("link `{link}`: an entry of the inertia is {entry_kg_m2} kg m^2, expected a finite number")]
    InertiaNotFinite {
        /// The link.
        link: String,
        /// The entry, kg m^2.
        entry_kg_m2: f64,
    },
    /// A principal moment is negative, or zero on a moving link.
    #[error(
        "link `{link}`: the inertia about the centre of mass is not positive definite; its principal moments are {principal_kg_m2:?} kg m^2"
    )]
    NotPositiveDefinite {
        /// The link.
        link: String,
        /// Smallest to largest principal moment, kg m^2.
        principal_kg_m2: [f64; 3],
    },
    /// The largest principal moment exceeds the sum of the others.
    #[error(
        "link `{link}`: no body has the principal moments {principal_kg_m2:?} kg m^2: the largest exceeds the sum of the others by {excess_kg_m2:e}"
    )]
    TriangleInequality {
        /// The link.
        link: String,
        /// Smallest to largest principal moment, kg m^2.
        principal_kg_m2: [f64; 3],
        /// Largest moment less the sum of the others, kg m^2.
        excess_kg_m2: f64,
    },
    /// A frame has an entry that is not finite.
    #[error("link `{link}`: its frame has the entry {value}, expected a finite number")]
    FrameNotFinite {
        /// The link.
        link: String,
        /// The entry.
        value: f64,
    },
    /// A frame's matrix is not a rotation.
    #[error("link `{link}`: its frame is no rotation: R'R differs from 1 by {deviation:e}, det R = {determinant}")]
    NotARotation {
        /// The link.
        link: String,
        /// Largest entry of `R'R - 1`.
        deviation: f64,
        /// Determinant of R.
        determinant: f64,
    },
    /// The joint's range is empty or not a number.
    #[error("link `{link}`: the joint's range is [{lower_rad}, {upper_rad}] rad, expected lower < upper")]
    Range {
        /// The link.
        link: String,
        /// Lower end, rad.
        lower_rad: f64,
        /// Upper end, rad.
        upper_rad: f64,
    },
    /// A limit is not positive.
    #[error("link `{link}`: the {quantity} is {value}, expected a positive number")]
    NotPositive {
        /// The link.
        link: String,
        /// Which limit.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// A quantity is negative or not finite.
    #[error("link `{link}`: the {quantity} is {value}, expected a finite number that is at least 0")]
    Negative {
        /// The link.
        link: String,
        /// Which quantity.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// The arm has another number of joints than the model's type.
    #[error("robot `{robot}` has {joints} joints, expected {expected}")]
    JointCount {
        /// The robot.
        robot: String,
        /// Joints of the robot.
        joints: usize,
        /// Joints of the type.
        expected: usize,
    },
    /// More joints than the crate is compiled for.
    #[error("robot `{robot}` has {joints} movable joints; from 1 to {most} are supported")]
    TooManyJoints {
        /// The robot.
        robot: String,
        /// Joints of the robot.
        joints: usize,
        /// The largest number supported.
        most: usize,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is no URDF.
    #[error("not a readable URDF: {source}")]
    Parse {
        /// What the parser says.
        source: urdf_rs::UrdfError,
    },
    /// A joint of a kind that is not supported moves the arm.
    #[error(
        "joint `{joint}` is {kind}, which is not supported: only revolute and continuous joints may move; lock it by naming it finger or gripper, or make it fixed"
    )]
    JointKind {
        /// The joint.
        joint: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A joint's axis is zero or not finite.
    #[error("joint `{joint}`: the axis is {axis:?}, expected a direction")]
    Axis {
        /// The joint.
        joint: String,
        /// The axis given.
        axis: [f64; 3],
    },
    /// A joint refers to a link that does not exist.
    #[error("joint `{joint}` refers to the link `{link}`, which does not exist")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The missing link.
        link: String,
    },
    /// The tip asked for does not exist.
    #[error("there is no link `{tip}` to be the tip; the tree ends in: {}", .candidates.join(", "))]
    UnknownTip {
        /// The tip asked for.
        tip: String,
        /// Links without children.
        candidates: Vec<String>,
    },
    /// Two elements share a name.
    #[error("the {element} name `{name}` occurs twice")]
    Duplicate {
        /// `link` or `joint`.
        element: &'static str,
        /// The name.
        name: String,
    },
    /// A link hangs on two joints.
    #[error("the link `{link}` is the child of two joints; the links must form a tree")]
    TwoParents {
        /// The link.
        link: String,
    },
    /// No link, or more than one, hangs on nothing.
    #[error("the links must form one tree with one root; links that hang on nothing: [{}]", .roots.join(", "))]
    Roots {
        /// The links that are no joint's child.
        roots: Vec<String>,
    },
    /// Joints form a loop.
    #[error("the link `{link}` cannot be reached from the root: its joints form a loop")]
    Loop {
        /// A link in the loop.
        link: String,
    },
    /// Several movable branches: which one is the arm?
    #[error("the robot branches; name the arm's last link with --tip LINK, one of: {}", .candidates.join(", "))]
    Branches {
        /// The last moving link of each branch.
        candidates: Vec<String>,
    },
    /// No movable joint lies between the root and the tip.
    #[error("no movable joint lies between `{root}` and the tip `{tip}`")]
    RigidTip {
        /// Root link.
        root: String,
        /// The tip.
        tip: String,
    },
}
