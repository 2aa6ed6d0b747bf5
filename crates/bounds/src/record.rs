//! Proved bounds as a record that certificates refer to, and the record derived again.
//!
//! A record holds decimals of five digits, upper bounds rounded up and lower ones down, and with each the parameters of its proof: corners,
//! angles, weights and candidates. [`recheck`] proves every bound again from the robot with those parameters and accepts a record
//! that claims no more than what comes out.
//!
//! | bound | method | parameters |
//! |-------|--------|------------|
//! | `m_hi_kg_m2` | `polygons` | `pieces` |
//! | `diagonal_kg_m2`, upper | `polygons` | `pieces`, `weights` |
//! | `k_g_n_m_per_rad` | `polygons` | `pieces`, `part_pieces` |
//! | `gravity_torque_n_m` | `polygons` | `pieces` |
//! | `k_c_kg_m2` | `equispaced-angles` | `angles`, `part_angles` |
//! | `m_lo_kg_m2`, `diagonal_kg_m2` lower, `k_r`, `k_m` | `riccati` | `candidate`, `metric` for k_m, `boxes` |
//!
//! Limits: no enclosure of the inertia matrix entry by entry (such a record is refused); one interval of rotor inertia for all joints, as in [`Ranges`].

use std::collections::BTreeMap;

use certune_dynamics::{Model, Robot, RobotError};
use certune_verify::{Arm, ArmRanges, BoundProof, Bounds, ConfigurationSet, Number, Record};

use crate::arm_box::{ArmBox, Ranges};
use crate::error::BoundsError;
use crate::riccati::{RiccatiBounds, RiccatiPlan, riccati_bounds_with};
use crate::rigorous::{AngleSet, PolygonBounds, PolygonPlan, polygon_bounds_with};

const POLYGONS: &str = "polygons";
const ANGLES: &str = "equispaced-angles";
const RICCATI: &str = "riccati";

/// Why bounds make no record, or a record does not hold.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The robot is not the one of the record.
    #[error("the record is about arm {recorded} (sha256), the robot given is {given}")]
    OtherArm {
        /// Hash in the record.
        recorded: String,
        /// Hash of the robot.
        given: String,
    },
    /// The robot cannot be compiled for that many joints.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// A range, a set or a plan that cannot be followed, or a candidate that fails.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// A number that no decimal of a record can express.
    #[error("{quantity} is {value}: no decimal between 1e-12 and 1e12 in size")]
    Number {
        /// Which.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// A proof, or a parameter of one, is missing or malformed.
    #[error("the record says nothing usable about `{parameter}` of {bound} by {method}")]
    Parameter {
        /// Bound.
        bound: &'static str,
        /// Method.
        method: &'static str,
        /// Parameter.
        parameter: &'static str,
    },
    /// A bound that this derivation knows nothing about.
    #[error("the record claims {bound}, which is not derived here")]
    NotDerived {
        /// Bound.
        bound: &'static str,
    },
    /// A bound of the record is tighter than what its own proof gives.
    #[error("the record claims {bound} = {recorded}, its proof gives {derived}")]
    Tighter {
        /// Bound.
        bound: &'static str,
        /// What the record says.
        recorded: String,
        /// What was derived.
        derived: f64,
    },
}

/// The record of bounds that were proved for the arms of `ranges` around `robot` over `set`.
///
/// # Errors
/// A robot of another number of joints, or numbers of a size that no record holds.
pub fn record<const N: usize>(
    robot: &Robot,
    ranges: &Ranges,
    set: &AngleSet<N>,
    polygons: &PolygonBounds,
    riccati: &RiccatiBounds,
) -> Result<Record, RecordError> {
    Model::<N>::new(robot)?;
    let (plan, candidates) = (&polygons.plan, &riccati.plan);
    let boxes = ("boxes", vec![exact("boxes", candidates.budget as f64)?]);
    let metric = ("metric", exacts("metric", &candidates.metric_kg_m2)?);
    let proofs = vec![
        proof("m_lo_kg_m2", RICCATI, [("candidate", exacts("m_lo", &[candidates.m_lo_kg_m2])?), boxes.clone()]),
        proof("m_hi_kg_m2", POLYGONS, [("pieces", counts(&plan.inertia_pieces)?)]),
        proof(
            "k_g_n_m_per_rad",
            POLYGONS,
            [("pieces", counts(&plan.gravity_pieces)?), ("part_pieces", counts(&plan.gravity_part_pieces)?)],
        ),
        proof(
            "k_c_kg_m2",
            ANGLES,
            [("angles", counts(&plan.coriolis_grid)?), ("part_angles", counts(&plan.coriolis_part_grid)?)],
        ),
        proof("k_r", RICCATI, [("candidate", exacts("k_r", &candidates.k_joint)?), boxes.clone()]),
        proof("k_m", RICCATI, [("candidate", exacts("k_m", &candidates.k_joint)?), metric, boxes.clone()]),
        proof("diagonal_kg_m2", RICCATI, [("candidate", exacts("diagonal", &candidates.diagonal_lower_kg_m2)?), boxes]),
        proof(
            "diagonal_kg_m2",
            POLYGONS,
            [("pieces", counts(&plan.diagonal_pieces)?), ("weights", exacts("weights", &plan.diagonal_weights)?)],
        ),
        proof("gravity_torque_n_m", POLYGONS, [("pieces", counts(&plan.torque_pieces)?)]),
    ];
    let bounds = Bounds {
        m_lo_kg_m2: below("m_lo_kg_m2", riccati.m_lo_kg_m2)?,
        m_hi_kg_m2: above("m_hi_kg_m2", polygons.m_hi_kg_m2)?,
        k_g_n_m_per_rad: above("k_g_n_m_per_rad", polygons.k_g_n_m_per_rad)?,
        k_c_kg_m2: above("k_c_kg_m2", polygons.k_c_kg_m2)?,
        k_r: Some(above("k_r", riccati.k_r)?),
        k_m: Some(above("k_m", riccati.k_m)?),
        diagonal_kg_m2: Some([
            all("diagonal_kg_m2", &riccati.diagonal_lower_kg_m2, below)?,
            all("diagonal_kg_m2", &polygons.diagonal_upper_kg_m2, above)?,
        ]),
        gravity_torque_n_m: Some(all("gravity_torque_n_m", &polygons.gravity_torque_n_m, above)?),
        inertia: None,
    };
    let [payload_lower, payload_upper] = ranges.payload_kg;
    let [rotor_lower, rotor_upper] = ranges.rotor_inertia_kg_m2;
    let [x, y, z] = ranges.payload_com_m;
    let arms = ArmRanges {
        mass_uncertainty: exact("mass_uncertainty", ranges.mass_uncertainty)?,
        payload_kg: [exact("payload_kg", payload_lower)?, exact("payload_kg", payload_upper)?],
        payload_com_m: [exact("payload_com_m", x)?, exact("payload_com_m", y)?, exact("payload_com_m", z)?],
        rotor_inertia_kg_m2: [exact("rotor_inertia_kg_m2", rotor_lower)?, exact("rotor_inertia_kg_m2", rotor_upper)?],
    };
    let over = match set {
        AngleSet::AllAngles => ConfigurationSet::AllAngles,
        AngleSet::Box { lower_rad, upper_rad } => ConfigurationSet::Box {
            lower_rad: exacts("lower_rad", lower_rad)?,
            upper_rad: exacts("upper_rad", upper_rad)?,
        },
    };
    let arm = Arm { name: robot.name().to_owned(), joints: N, sha256: robot.sha256() };
    Ok(Record { schema: 0, arm, arms, over, bounds, proofs, sha256: String::new() }.sealed())
}

/// Proves every bound of a record again, with the parameters written in it.
///
/// # Errors
/// [`RecordError::Tighter`] when a bound does not follow from its proof; the other variants when there is none to follow.
pub fn recheck<const N: usize>(
    record: &Record,
    robot: &Robot,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(), RecordError> {
    let given = robot.sha256();
    if record.arm.sha256 != given || record.arm.joints != N {
        return Err(RecordError::OtherArm { recorded: record.arm.sha256.clone(), given });
    }
    if record.bounds.inertia.is_some() {
        return Err(RecordError::NotDerived { bound: "inertia" });
    }
    let arms = ArmBox::<N>::new(&Model::new(robot)?, &ranges(&record.arms))?;
    let set = angle_set(&record.over)?;
    let polygons = polygon_bounds_with(&arms, &set, &polygon_plan(record)?, &|share| progress(0.3 * share))?;
    let riccati = riccati_bounds_with(&arms, &set, &riccati_plan(record)?, &|share| progress(0.3 + 0.7 * share))?;
    let bounds = &record.bounds;
    no_smaller("m_hi_kg_m2", &bounds.m_hi_kg_m2, polygons.m_hi_kg_m2)?;
    no_smaller("k_g_n_m_per_rad", &bounds.k_g_n_m_per_rad, polygons.k_g_n_m_per_rad)?;
    no_smaller("k_c_kg_m2", &bounds.k_c_kg_m2, polygons.k_c_kg_m2)?;
    no_larger("m_lo_kg_m2", &bounds.m_lo_kg_m2, riccati.m_lo_kg_m2)?;
    if let Some(k_r) = &bounds.k_r {
        no_smaller("k_r", k_r, riccati.k_r)?;
    }
    if let Some(k_m) = &bounds.k_m {
        no_smaller("k_m", k_m, riccati.k_m)?;
    }
    if let Some([lower, upper]) = &bounds.diagonal_kg_m2 {
        each("diagonal_kg_m2", lower, &riccati.diagonal_lower_kg_m2, no_larger)?;
        each("diagonal_kg_m2", upper, &polygons.diagonal_upper_kg_m2, no_smaller)?;
    }
    if let Some(torque) = &bounds.gravity_torque_n_m {
        each("gravity_torque_n_m", torque, &polygons.gravity_torque_n_m, no_smaller)?;
    }
    Ok(())
}

fn proof<const K: usize>(bound: &str, method: &str, parameters: [(&str, Vec<Number>); K]) -> BoundProof {
    let parameters: BTreeMap<_, _> = parameters.into_iter().map(|(name, numbers)| (name.to_owned(), numbers)).collect();
    BoundProof { bound: bound.to_owned(), method: method.to_owned(), parameters }
}

/// The shortest decimal that reads back as `value`.
fn exact(quantity: &'static str, value: f64) -> Result<Number, RecordError> {
    Number::decimal(value).ok_or(RecordError::Number { quantity, value })
}

fn exacts(quantity: &'static str, values: &[f64]) -> Result<Vec<Number>, RecordError> {
    values.iter().map(|value| exact(quantity, *value)).collect()
}

fn counts(values: &[usize]) -> Result<Vec<Number>, RecordError> {
    values.iter().map(|value| exact("pieces", *value as f64)).collect()
}

/// A decimal of five digits, or a few more units in the last, on the side of `value` that `holds` accepts.
fn rounded(
    quantity: &'static str,
    value: f64,
    towards: i64,
    holds: impl Fn(&Number, &Number) -> bool,
) -> Result<Number, RecordError> {
    let refused = RecordError::Number { quantity, value };
    let (Some(itself), text) = (Number::dyadic(value), format!("{value:.4e}")) else { return Err(refused) };
    let Some((mantissa, exponent)) = text.split_once('e') else { return Err(refused) };
    let (Ok(digits), Ok(exponent)) = (mantissa.replace('.', "").parse::<i64>(), exponent.parse::<i64>()) else {
        return Err(refused);
    };
    for more in 0..3 {
        let decimal = format!("{}e{}", digits + towards * more, exponent - 4).parse::<f64>().ok();
        if let Some(number) = decimal.and_then(Number::decimal).filter(|number| holds(number, &itself)) {
            return Ok(number);
        }
    }
    Err(refused)
}

fn above(quantity: &'static str, value: f64) -> Result<Number, RecordError> {
    rounded(quantity, value, 1, |number, itself| number.value() >= itself.value())
}

fn below(quantity: &'static str, value: f64) -> Result<Number, RecordError> {
    rounded(quantity, value, -1, |number, itself| number.value() <= itself.value())
}

fn all(
    quantity: &'static str,
    values: &[f64],
    round: impl Fn(&'static str, f64) -> Result<Number, RecordError>,
) -> Result<Vec<Number>, RecordError> {
    values.iter().map(|value| round(quantity, *value)).collect()
}

fn no_smaller(bound: &'static str, recorded: &Number, derived: f64) -> Result<(), RecordError> {
    let holds = Number::dyadic(derived).is_some_and(|derived| recorded.value() >= derived.value());
    if holds { Ok(()) } else { Err(RecordError::Tighter { bound, recorded: recorded.to_string(), derived }) }
}

fn no_larger(bound: &'static str, recorded: &Number, derived: f64) -> Result<(), RecordError> {
    let holds = Number::dyadic(derived).is_some_and(|derived| recorded.value() <= derived.value());
    if holds { Ok(()) } else { Err(RecordError::Tighter { bound, recorded: recorded.to_string(), derived }) }
}

fn each(
    bound: &'static str,
    recorded: &[Number],
    derived: &[f64],
    holds: impl Fn(&'static str, &Number, f64) -> Result<(), RecordError>,
) -> Result<(), RecordError> {
    if recorded.len() != derived.len() {
        return Err(BoundsError::Length { given: recorded.len(), expected: derived.len() }.into());
    }
    recorded.iter().zip(derived).try_for_each(|(recorded, derived)| holds(bound, recorded, *derived))
}

/// The ranges as numbers of the machine; the proofs pay for what that rounds.
fn ranges(arms: &ArmRanges) -> Ranges {
    let [x, y, z] = &arms.payload_com_m;
    let both = |[lower, upper]: &[Number; 2]| [lower.to_f64(), upper.to_f64()];
    Ranges {
        mass_uncertainty: arms.mass_uncertainty.to_f64(),
        payload_kg: both(&arms.payload_kg),
        payload_com_m: [x.to_f64(), y.to_f64(), z.to_f64()],
        rotor_inertia_kg_m2: both(&arms.rotor_inertia_kg_m2),
    }
}

fn angle_set<const N: usize>(over: &ConfigurationSet) -> Result<AngleSet<N>, RecordError> {
    let joints = |numbers: &[Number]| -> Result<[f64; N], RecordError> {
        let floats: Vec<f64> = numbers.iter().map(Number::to_f64).collect();
        floats.try_into().map_err(|_| BoundsError::Length { given: numbers.len(), expected: N }.into())
    };
    match over {
        ConfigurationSet::AllAngles => Ok(AngleSet::AllAngles),
        ConfigurationSet::Box { lower_rad, upper_rad } => {
            Ok(AngleSet::Box { lower_rad: joints(lower_rad)?, upper_rad: joints(upper_rad)? })
        }
    }
}

/// A parameter of a proof, as it was when it was written: the shortest decimal reads back as the same number.
fn parameter(
    record: &Record,
    bound: &'static str,
    method: &'static str,
    parameter: &'static str,
) -> Result<Vec<f64>, RecordError> {
    record
        .proofs
        .iter()
        .find(|proof| proof.bound == bound && proof.method == method)
        .and_then(|proof| proof.parameters.get(parameter))
        .and_then(|numbers| numbers.iter().map(|number| number.to_string().parse().ok()).collect())
        .ok_or(RecordError::Parameter { bound, method, parameter })
}

/// A parameter that counts something: whole numbers below a million.
fn whole(
    record: &Record,
    bound: &'static str,
    method: &'static str,
    name: &'static str,
) -> Result<Vec<usize>, RecordError> {
    let numbers = parameter(record, bound, method, name)?;
    let count = |x: &f64| (0.0..1e6).contains(x).then_some(*x as usize);
    numbers.iter().map(count).collect::<Option<_>>().ok_or(RecordError::Parameter { bound, method, parameter: name })
}

fn polygon_plan(record: &Record) -> Result<PolygonPlan, RecordError> {
    Ok(PolygonPlan {
        inertia_pieces: whole(record, "m_hi_kg_m2", POLYGONS, "pieces")?,
        diagonal_pieces: whole(record, "diagonal_kg_m2", POLYGONS, "pieces")?,
        diagonal_weights: parameter(record, "diagonal_kg_m2", POLYGONS, "weights")?,
        gravity_pieces: whole(record, "k_g_n_m_per_rad", POLYGONS, "pieces")?,
        gravity_part_pieces: whole(record, "k_g_n_m_per_rad", POLYGONS, "part_pieces")?,
        torque_pieces: whole(record, "gravity_torque_n_m", POLYGONS, "pieces")?,
        coriolis_grid: whole(record, "k_c_kg_m2", ANGLES, "angles")?,
        coriolis_part_grid: whole(record, "k_c_kg_m2", ANGLES, "part_angles")?,
    })
}

fn riccati_plan(record: &Record) -> Result<RiccatiPlan, RecordError> {
    let one = |bound: &'static str, name: &'static str| -> Result<f64, RecordError> {
        let numbers = parameter(record, bound, RICCATI, name)?;
        numbers.first().copied().ok_or(RecordError::Parameter { bound, method: RICCATI, parameter: name })
    };
    Ok(RiccatiPlan {
        m_lo_kg_m2: one("m_lo_kg_m2", "candidate")?,
        diagonal_lower_kg_m2: parameter(record, "diagonal_kg_m2", RICCATI, "candidate")?,
        k_joint: parameter(record, "k_r", RICCATI, "candidate")?,
        metric_kg_m2: parameter(record, "k_m", RICCATI, "metric")?,
        budget: one("m_lo_kg_m2", "boxes")?.clamp(0.0, 1e15) as u64,
    })
}
