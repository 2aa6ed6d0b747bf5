//! The file: what it holds.
//!
//! Its canonical content is JSON with fields in the order of these types, no blanks, and numbers as the texts they were
//! written as. Statement and grade of each claim are derived from the numbers and must match the file's.

use serde::{Deserialize, Serialize};

use crate::aic::AicGains;
use crate::number::Number;

/// A certificate file's content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// Version of the format.
    pub schema: u32,
    /// Which arm.
    pub arm: Arm,
    /// Which gains.
    pub gains: AicGains,
    /// Which members of the family of arms.
    pub family: Family,
    /// The constants that stand for every member of the family.
    pub constants: Constants,
    /// Arm, gains, family, scope and constants in words: what every statement below is about.
    pub about: String,
    /// What is claimed, refused, or not proved.
    pub claims: Vec<Claim>,
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
    pub friction_n_m_s_per_rad: [Number; 2],
    /// Link masses (and inertias) may differ from the nominal by this share, 0.2 for +-20 %.
    pub mass_uncertainty: Number,
    /// Payload, a point mass, `[least, largest]`, kg.
    pub payload_kg: [Number; 2],
    /// Where the payload sits in the frame of the last link, m.
    pub payload_com_m: [Number; 3],
    /// Rotor inertia of each joint, `[least, largest]`, kg m^2.
    pub rotor_inertia_kg_m2: [Number; 2],
}

/// Constants of the family over all its configurations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constants {
    /// No eigenvalue of `M(q)` is smaller, kg m^2.
    pub m_lo_kg_m2: Number,
    /// No eigenvalue of `M(q)` is larger, kg m^2.
    pub m_hi_kg_m2: Number,
    /// No eigenvalue of `dg/dq` is larger in absolute value, N m/rad.
    pub k_g_n_m_per_rad: Number,
    /// `1/2 |dq'(sum_j y_j dM/dq_j) dq| <= |y| k_c |dq|^2`, kg m^2.
    pub k_c_kg_m2: Number,
    /// `1/2 |dq'(sum_j y_j dM/dq_j) dq| <= |y| k_r dq'M dq`, dimensionless.
    pub k_r: Number,
    /// What the constants rest on.
    pub evidence: Evidence,
}

/// What a set of constants rests on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Evidence {
    /// Sampling and local maximisation, widened by a margin: no proof.
    Sampled {
        /// Which configurations were sampled.
        over: SampledSet,
        /// The constants are this share larger (m_lo: smaller) than what was found.
        margin: Number,
        /// Configurations sampled for each constant.
        samples: usize,
        /// Local maximisations started from the best of them.
        local_starts: usize,
    },
}

/// Where constants were sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SampledSet {
    /// Every configuration, joint limits or not.
    AllAngles,
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
#[serde(tag = "claim", rename_all = "kebab-case")]
pub enum Claim {
    /// Every linearised loop of the family decays at a rate.
    Exponential(ExponentialClaim),
    /// The nonlinear loop decays from every start in a ball.
    Region(Box<RegionClaim>),
    /// A claim that does not hold for the family's box, with the point that breaks it.
    Refused(Box<RefusedClaim>),
    /// A claim for which no proof was found, and no counterexample either.
    NotProved(NotProvedClaim),
}

/// See the [`exponential`](crate::LoopFamily::decays_on) check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExponentialClaim {
    /// The claim in words.
    pub statement: String,
    /// How strong it is.
    pub grade: Grade,
    /// Certified decay rate, 1/s.
    pub rate_per_s: Number,
}

/// See the [`region`](crate::region_inequalities) check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionClaim {
    /// The claim in words.
    pub statement: String,
    /// How strong it is.
    pub grade: Grade,
    /// Every start at rest within this distance of the goal (2-norm over the joints) is covered, rad.
    pub radius_rad: Number,
    /// `sqrt V` decays at least as `exp(-rate t)`, 1/s.
    pub rate_per_s: Number,
    /// The numbers that prove it.
    pub witness: RegionWitness,
}

/// The Lyapunov function and multipliers of a region claim, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionWitness {
    /// Weight of the kinetic energy.
    pub p: Number,
    /// Cross terms of dq'M with (e, m, mu', mu'', u~).
    pub b: [Number; 5],
    /// Upper triangle of the symmetric 5 x 5 matrix S, row by row.
    pub s: Vec<Number>,
    /// `|y| <= rho` on the region.
    pub rho: Number,
    /// How the cubic term is shared between its two bounds, in [0, 1].
    pub theta: Number,
    /// Multiplier of the friction interval.
    pub friction_multiplier: Number,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: Number,
    /// Multiplier of the torque at the start.
    pub start_multiplier: Number,
}

/// A point of the family's box.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxPoint {
    /// kg m^2.
    pub inertia_kg_m2: Number,
    /// N m s/rad.
    pub friction_n_m_s_per_rad: Number,
    /// N m/rad.
    pub stiffness_n_m_per_rad: Number,
}

/// An arm of the family whose linearised loop is at the point, found by search in floating point.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attained {
    /// Configuration, rad.
    pub q_rad: Vec<Number>,
    /// Factor on each link's mass and inertia.
    pub link_mass_scale: Vec<Number>,
    /// Payload, kg.
    pub payload_kg: Number,
    /// Rotor inertia of every joint, kg m^2.
    pub rotor_inertia_kg_m2: Number,
    /// Viscous friction of every joint, N m s/rad.
    pub friction_n_m_s_per_rad: Number,
    /// Real and imaginary part of the unstable eigenvalue, 1/s.
    pub eigenvalue_per_s: [Number; 2],
}

/// A claim that a point of the box contradicts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RefusedClaim {
    /// The refusal in words.
    pub statement: String,
    /// The rate that was asked for, 1/s; 0 asks for stability alone.
    pub rate_per_s: Number,
    /// The loop at this point does not decay at that rate; exact.
    pub point: BoxPoint,
    /// An arm and configuration at that point, when one was found.
    pub attained: Option<Attained>,
}

/// The kinds of claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimKind {
    /// Every linearised loop of the family decays at a rate.
    Exponential,
    /// The nonlinear loop decays from every start in a ball.
    Region,
}

impl ClaimKind {
    /// The name as it is written in files and flags.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Exponential => "exponential",
            Self::Region => "region",
        }
    }
}

/// A claim that was neither proved nor refuted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotProvedClaim {
    /// What was found, in words.
    pub statement: String,
    /// Which claim was attempted.
    pub of: ClaimKind,
    /// How far the inequalities are from feasible in the solver's units; positive is infeasible.
    pub distance: Option<Number>,
    /// Why no proof was attempted or found.
    pub reason: Reason,
}

/// Why there is neither a proof nor a counterexample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The proof needs the same gains on every joint.
    UnequalGains,
    /// Stable, but too slowly for the rates that are tried.
    TooSlow,
    /// The box is not shown stable, and no unstable point of it was found.
    NoPointFound,
    /// The solver found no Lyapunov function.
    Infeasible,
    /// What the solver found did not pass the exact check.
    CandidateFailed,
    /// An arm of the family was found outside the stated constants.
    ConstantsContradicted,
    /// A number of the problem is too large or too small to work with.
    OutOfRange,
}

impl Reason {
    /// In words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::UnequalGains => "this claim needs the same gains on every joint",
            Self::TooSlow => "the loops of the box are stable, but at no rate of at least 0.001 per s",
            Self::NoPointFound => "the box is not shown stable, and no unstable point of it was found",
            Self::Infeasible => {
                "no Lyapunov function of the claim's form was found, and no counterexample was searched"
            }
            Self::CandidateFailed => "the solver's candidates did not pass the exact check",
            Self::ConstantsContradicted => {
                "a search found an arm of the family outside the stated constants: they do not hold, and nothing is claimed"
            }
            Self::OutOfRange => "a number of the problem is too large or too small to be worked with",
        }
    }
}
