//! The file: what it holds.
//!
//! Its canonical content is JSON with fields in the order of these types, no blanks, and numbers as the texts they were
//! written as. Statement and grade of each claim are derived from the numbers and must match the file's.

use serde::{Deserialize, Serialize};

use crate::claims::Claim;
use crate::gains::Gains;
use crate::number::Number;

/// A certificate file's content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// Version of the format.
    pub schema: u32,
    /// Which arm.
    pub arm: Arm,
    /// Which controller with which gains.
    pub gains: Gains,
    /// Which members of the family of arms.
    pub family: Family,
    /// The constants that stand for every member of the family.
    pub constants: Constants,
    /// Arm, gains, family and constants in words: what every statement below is about.
    pub about: String,
    /// What is claimed, refused, or not proved.
    pub claims: Vec<Entry>,
    /// SHA-256 of the canonical content with this field empty, lower-case hexadecimal.
    pub sha256: String,
}

/// The arm a document speaks of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// Its name.
    pub name: String,
    /// Number of joints.
    pub joints: usize,
    /// SHA-256 of its description.
    pub sha256: String,
}

/// The plants a document speaks of: everything between these ends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Family {
    /// Whether the robot adds `g(q)` to the controller's torque.
    pub gravity_compensation: bool,
    /// Viscous friction of each joint, `[least, largest]`, N m s/rad.
    pub friction_n_m_s_per_rad: Vec<[Number; 2]>,
    /// Masses and rotor inertias.
    pub arms: ArmRanges,
}

impl Family {
    /// How many joints the family gives numbers for. The number written beside the arm's name is compared with it before anything is
    /// proved; in a file that nothing has checked yet it could ask for any amount of memory.
    pub(crate) fn joints(&self) -> usize {
        self.friction_n_m_s_per_rad.len()
    }

    /// Least and largest viscous friction of any joint, N m s/rad; zero for a family without joints.
    pub fn friction_hull(&self) -> [Number; 2] {
        let joints = &self.friction_n_m_s_per_rad;
        let least = joints.iter().map(|[least, _]| least).min_by(|a, b| a.value().cmp(b.value()));
        let largest = joints.iter().map(|[_, largest]| largest).max_by(|a, b| a.value().cmp(b.value()));
        [least, largest].map(|end| end.cloned().unwrap_or_else(Number::zero))
    }
}

/// The arms of a family: every mass, payload and rotor inertia between these ends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmRanges {
    /// Link masses (and inertias) may differ from the nominal by this share, 0.2 for +-20 %.
    pub mass_uncertainty: Number,
    /// Payload, a point mass, `[least, largest]`, kg.
    pub payload_kg: [Number; 2],
    /// Where the payload sits in the frame of the last link, m.
    pub payload_com_m: [Number; 3],
    /// Rotor inertia of each joint, `[least, largest]`, kg m^2.
    pub rotor_inertia_kg_m2: [Number; 2],
}

/// Constants of the family, where they hold, and what they rest on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constants {
    /// The configurations they hold for.
    pub over: ConfigurationSet,
    /// The numbers.
    pub bounds: Bounds,
    /// What they rest on.
    pub evidence: Evidence,
}

/// A set of configurations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ConfigurationSet {
    /// Every configuration, joint limits or not.
    AllAngles,
    /// Every configuration between two ends, joint by joint.
    Box {
        /// Lower ends, rad.
        lower_rad: Vec<Number>,
        /// Upper ends, rad.
        upper_rad: Vec<Number>,
    },
}

impl ConfigurationSet {
    /// Whether the set holds a configuration.
    pub fn contains(&self, q_rad: &[Number]) -> bool {
        match self {
            Self::AllAngles => true,
            Self::Box { lower_rad, upper_rad } => q_rad
                .iter()
                .zip(lower_rad)
                .zip(upper_rad)
                .all(|((angle, lower), upper)| lower.value() <= angle.value() && angle.value() <= upper.value()),
        }
    }
}

/// Numbers that bound an arm, for all `y`, `v` and every configuration of a set. `|x|_M^2 = x'M x`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// No eigenvalue of `M(q)` is smaller, kg m^2.
    pub m_lo_kg_m2: Number,
    /// No eigenvalue of `M(q)` is larger, kg m^2.
    pub m_hi_kg_m2: Number,
    /// No eigenvalue of `dg/dq` is larger in absolute value, N m/rad.
    pub k_g_n_m_per_rad: Number,
    /// `1/2 |v'(sum_j y_j dM/dq_j) v| <= |y| k_c |v|^2`, kg m^2.
    pub k_c_kg_m2: Number,
    /// `1/2 |v'(sum_j y_j dM/dq_j) v| <= |y| k_r v'M v`, dimensionless.
    pub k_r: Option<Number>,
    /// `1/2 |v'(sum_j y_j dM/dq_j) v| <= k_m |y|_M |v|_M^2`, 1/sqrt(kg m^2).
    pub k_m: Option<Number>,
    /// `diag(lower) <= M(q) <= diag(upper)`, kg m^2.
    pub diagonal_kg_m2: Option<[Vec<Number>; 2]>,
    /// Largest gravity torque of each joint, N m.
    pub gravity_torque_n_m: Option<Vec<Number>>,
    /// The inertia matrix entry by entry, over a small box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<InertiaEnclosure>,
}

/// `|M_ij(q) - midpoint_ij| <= radius_ij`, and `|x'C(q, v) y| <= coriolis |x||v||y|` for the Coriolis matrix in Christoffel form.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InertiaEnclosure {
    /// Symmetric, kg m^2.
    pub midpoint_kg_m2: Vec<Vec<Number>>,
    /// Symmetric, not negative, kg m^2.
    pub radius_kg_m2: Vec<Vec<Number>>,
    /// kg m^2.
    pub coriolis_kg_m2: Number,
}

/// What a set of constants rests on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Evidence {
    /// Sampling and local maximisation, widened by a margin: no proof.
    Sampled {
        /// The constants are this share larger (lower bounds: smaller) than what was found.
        margin: Number,
        /// Configurations sampled for each constant.
        samples: usize,
        /// Local maximisations started from the best of them.
        local_starts: usize,
    },
    /// Outward-rounded arithmetic over the whole set: the constants of a [`Record`](crate::Record), or wider ones.
    Proved {
        /// The record's hash.
        record_sha256: String,
    },
}

/// How strong a claim is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// Exact arithmetic, if the stated constants hold.
    Conditional,
    /// Exact or outward-rounded arithmetic throughout.
    Proved,
}

/// One entry of a document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The claim in words.
    pub statement: String,
    /// How strong it is; none for what is refused or not proved.
    pub grade: Option<Grade>,
    /// The numbers.
    pub claim: Claim,
}

impl From<Claim> for Entry {
    /// An entry that [`seal`](crate::seal) still has to complete.
    fn from(claim: Claim) -> Self {
        Self { statement: String::new(), grade: None, claim }
    }
}
