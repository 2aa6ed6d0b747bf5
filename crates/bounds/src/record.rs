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
//! | `inertia` | `enclosure` | `halvings`; `others_lower_rad`, `others_upper_rad` |
//! | `m_lo_kg_m2`, `diagonal_kg_m2` lower, `k_r`, `k_m` | `riccati` | `candidate`, `metric` for k_m, `boxes` |
//!
//! A record with an enclosure of the inertia matrix is about a box; its other bounds are proved over a set around it: all angles, or the box that
//! the enclosure's proof names.
//!
//! Limits: one interval of rotor inertia for all joints, as in [`Ranges`]; a record that was narrowed to fewer arms is derived for those, and
//! whether candidates made for more arms pass within the same boxes is seen only then.

use std::collections::BTreeMap;

use certune_dynamics::{Model, Robot, RobotError};
use certune_verify::{Arm, ArmRanges, BoundProof, Bounds, ConfigurationSet, InertiaEnclosure, Number, Record};
use num_traits::Signed;

use crate::arm_box::{ArmBox, Ranges};
use crate::enclosure::enclosure;
use crate::error::BoundsError;
use crate::riccati::{RiccatiBounds, RiccatiPlan, riccati_bounds_with};
use crate::rigorous::{AngleSet, PolygonBounds, PolygonPlan, polygon_bounds_with};

const POLYGONS: &str = "polygons";
const ANGLES: &str = "equispaced-angles";
const RICCATI: &str = "riccati";
const ENCLOSURE: &str = "enclosure";
const INERTIA: &str = "inertia";
const HALVINGS: &str = "halvings";
const OTHERS_LOWER: &str = "others_lower_rad";
const OTHERS_UPPER: &str = "others_upper_rad";
/// Pieces that an enclosure may take, as a power of 2.
const MOST_CUTS: usize = 24;

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
    let mut proofs = vec![
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
        proof(
            "diagonal_kg_m2",
            RICCATI,
            [("candidate", exacts("diagonal", &candidates.diagonal_lower_kg_m2)?), boxes.clone()],
        ),
        proof(
            "diagonal_kg_m2",
            POLYGONS,
            [("pieces", counts(&plan.diagonal_pieces)?), ("weights", exacts("weights", &plan.diagonal_weights)?)],
        ),
        proof("gravity_torque_n_m", POLYGONS, [("pieces", counts(&plan.torque_pieces)?)]),
    ];
    if !candidates.k_joint.is_empty() {
        let metric = ("metric", exacts("metric", &candidates.metric_kg_m2)?);
        let candidate = ("candidate", exacts("k_r", &candidates.k_joint)?);
        proofs.push(proof("k_r", RICCATI, [candidate.clone(), boxes.clone()]));
        proofs.push(proof("k_m", RICCATI, [candidate, metric, boxes]));
    }
    let bounds = Bounds {
        m_lo_kg_m2: below("m_lo_kg_m2", riccati.m_lo_kg_m2)?,
        m_hi_kg_m2: above("m_hi_kg_m2", polygons.m_hi_kg_m2)?,
        k_g_n_m_per_rad: above("k_g_n_m_per_rad", polygons.k_g_n_m_per_rad)?,
        k_c_kg_m2: above("k_c_kg_m2", polygons.k_c_kg_m2)?,
        k_r: riccati.k_r.map(|k_r| above("k_r", k_r)).transpose()?,
        k_m: riccati.k_m.map(|k_m| above("k_m", k_m)).transpose()?,
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
    let arms = ArmBox::<N>::new(&Model::new(robot)?, &ranges(&record.arms))?;
    let set = match &record.bounds.inertia {
        None => angle_set(&record.over)?,
        Some(recorded) => {
            encloses(record, &arms, recorded)?;
            set_of_the_others(record)?
        }
    };
    let polygons = polygon_bounds_with(&arms, &set, &polygon_plan(record)?, &|share| progress(0.3 * share))?;
    let riccati = riccati_bounds_with(&arms, &set, &riccati_plan(record)?, &|share| progress(0.3 + 0.7 * share))?;
    let bounds = &record.bounds;
    no_smaller("m_hi_kg_m2", &bounds.m_hi_kg_m2, polygons.m_hi_kg_m2)?;
    no_smaller("k_g_n_m_per_rad", &bounds.k_g_n_m_per_rad, polygons.k_g_n_m_per_rad)?;
    no_smaller("k_c_kg_m2", &bounds.k_c_kg_m2, polygons.k_c_kg_m2)?;
    no_larger("m_lo_kg_m2", &bounds.m_lo_kg_m2, riccati.m_lo_kg_m2)?;
    for (bound, recorded, derived) in [("k_r", &bounds.k_r, riccati.k_r), ("k_m", &bounds.k_m, riccati.k_m)] {
        if let Some(recorded) = recorded {
            no_smaller(bound, recorded, derived.ok_or(RecordError::NotDerived { bound })?)?;
        }
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

/// Whether the recorded enclosure holds every matrix of the one derived with the same halvings.
fn encloses<const N: usize>(record: &Record, arms: &ArmBox<N>, recorded: &InertiaEnclosure) -> Result<(), RecordError> {
    let AngleSet::Box { lower_rad, upper_rad } = angle_set::<N>(&record.over)? else {
        return Err(RecordError::NotDerived { bound: INERTIA });
    };
    let halvings = match whole(record, INERTIA, ENCLOSURE, HALVINGS)?.as_slice() {
        [halvings] if halvings * N <= MOST_CUTS => *halvings as u32,
        _ => return Err(RecordError::Parameter { bound: INERTIA, method: ENCLOSURE, parameter: HALVINGS }),
    };
    let derived = enclosure(arms, &lower_rad, &upper_rad, halvings)?;
    // What was derived holds for the shortest decimals of its numbers.
    let decimal = |value| exact(INERTIA, value);
    let length = |given: usize| BoundsError::Length { given, expected: N };
    let (middles, radii) = (&recorded.midpoint_kg_m2, &recorded.radius_kg_m2);
    for matrix in [middles, radii] {
        if matrix.len() != N || matrix.iter().any(|row| row.len() != N) {
            return Err(length(matrix.len()).into());
        }
    }
    for i in 0..N {
        for j in 0..N {
            let middle = decimal(derived.midpoint_kg_m2[i][j])?;
            let radius = decimal(derived.radius_kg_m2[i][j])?;
            let reach = (middles[i][j].value() - middle.value()).abs() + radius.value();
            if *radii[i][j].value() < reach {
                let recorded = format!("{} +- {} in row {i}, column {j}", middles[i][j], radii[i][j]);
                return Err(RecordError::Tighter { bound: INERTIA, recorded, derived: derived.midpoint_kg_m2[i][j] });
            }
        }
    }
    let coriolis = derived.coriolis_kg_m2;
    if recorded.coriolis_kg_m2.value() < decimal(coriolis)?.value() {
        let recorded = recorded.coriolis_kg_m2.to_string();
        return Err(RecordError::Tighter { bound: "coriolis_kg_m2", recorded, derived: coriolis });
    }
    Ok(())
}

/// The set that the bounds beside an enclosure are proved over, around the box of the record.
fn set_of_the_others<const N: usize>(record: &Record) -> Result<AngleSet<N>, RecordError> {
    let ends = |name: &str| {
        let proof = record.proofs.iter().find(|proof| proof.bound == INERTIA && proof.method == ENCLOSURE);
        proof.and_then(|proof| proof.parameters.get(name)).cloned()
    };
    let (lower_rad, upper_rad) = match [OTHERS_LOWER, OTHERS_UPPER].map(ends) {
        [None, None] => return Ok(AngleSet::AllAngles),
        [Some(lower), Some(upper)] => (lower, upper),
        _ => return Err(RecordError::Parameter { bound: INERTIA, method: ENCLOSURE, parameter: OTHERS_LOWER }),
    };
    let ConfigurationSet::Box { lower_rad: inner_lower, upper_rad: inner_upper } = &record.over else {
        return Err(RecordError::NotDerived { bound: INERTIA });
    };
    let at_most =
        |a: &[Number], b: &[Number]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.value() <= b.value());
    if !(at_most(&lower_rad, inner_lower) && at_most(inner_upper, &upper_rad)) {
        return Err(RecordError::Parameter { bound: INERTIA, method: ENCLOSURE, parameter: OTHERS_LOWER });
    }
    angle_set(&ConfigurationSet::Box { lower_rad, upper_rad })
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
    let relative = record.bounds.k_r.is_some() || record.bounds.k_m.is_some();
    let list = |bound: &'static str, name: &'static str| {
        if relative { parameter(record, bound, RICCATI, name) } else { Ok(Vec::new()) }
    };
    Ok(RiccatiPlan {
        m_lo_kg_m2: one("m_lo_kg_m2", "candidate")?,
        diagonal_lower_kg_m2: parameter(record, "diagonal_kg_m2", RICCATI, "candidate")?,
        k_joint: list("k_r", "candidate")?,
        metric_kg_m2: list("k_m", "metric")?,
        budget: one("m_lo_kg_m2", "boxes")?.clamp(0.0, 1e15) as u64,
    })
}
