//! Gains, family and constants of an arm, as the head of a document.
//!
//! Gains are the decimals a person wrote: the shortest decimal of an `f64` is that text whenever it has at most 15 digits. Constants are
//! rounded outward to four significant digits, so that the document is readable and no weaker assumption is stated than was sampled.

use std::collections::BTreeMap;

use certune_verify::{
    AicGains, Arm, ArmRanges, BoundProof, Bounds, ConfigurationSet, Constants, Document, Evidence, Family, Gains,
    InertiaEnclosure, MracGains, MracLaw, Number, Record,
};

/// Gains of the AIC, one number per joint.
#[derive(Clone, Debug, PartialEq)]
pub struct AicGainValues {
    /// Learning rate of the beliefs.
    pub kappa_mu: Vec<f64>,
    /// Learning rate of the torque.
    pub kappa_a: Vec<f64>,
    /// Variance of the position sensor.
    pub sigma_q: Vec<f64>,
    /// Variance of the velocity sensor.
    pub sigma_dq: Vec<f64>,
    /// Variance of the model of mu'.
    pub sigma_mu: Vec<f64>,
    /// Variance of the model of mu''.
    pub sigma_dmu: Vec<f64>,
    /// Time constant of the reference model, s.
    pub reference_time_constant_s: Vec<f64>,
}

/// Which arm a problem is about.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmValues {
    /// Its name; characters other than letters, digits, `-`, `_` and `.` are written as `_`.
    pub name: String,
    /// Number of joints.
    pub joints: usize,
    /// SHA-256 of its description.
    pub sha256: String,
    /// Where a payload sits in the frame of the last link, m.
    pub payload_com_m: [f64; 3],
}

/// Which plants a problem is about.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyValues {
    /// Whether the robot adds `g(q)` to the controller's torque.
    pub gravity_compensation: bool,
    /// Viscous friction of each joint, `[least, largest]`, N m s/rad.
    pub friction_n_m_s_per_rad: [f64; 2],
    /// Share by which link masses may differ from nominal.
    pub mass_uncertainty: f64,
    /// Payload, a point mass, `[least, largest]`, kg.
    pub payload_kg: [f64; 2],
    /// Rotor inertia of each joint, `[least, largest]`, kg m^2.
    pub rotor_inertia_kg_m2: [f64; 2],
}

/// Constants of the family found by sampling, the margin included.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledConstantValues {
    /// Smallest inertia eigenvalue, kg m^2.
    pub m_lo_kg_m2: f64,
    /// Largest inertia eigenvalue, kg m^2.
    pub m_hi_kg_m2: f64,
    /// Largest gravity stiffness, N m/rad.
    pub k_g_n_m_per_rad: f64,
    /// Coriolis constant against `|dq|^2`, kg m^2.
    pub k_c_kg_m2: f64,
    /// Coriolis constant against `dq'M dq`.
    pub k_r: f64,
    /// Coriolis constant in the metric of M, 1/sqrt(kg m^2), when it was sampled.
    pub k_m: Option<f64>,
    /// Diagonals between which M lies, kg m^2, when they were sampled.
    pub diagonal_kg_m2: Option<[Vec<f64>; 2]>,
    /// Largest gravity torque of each joint, N m, when it was sampled.
    pub gravity_torque_n_m: Option<Vec<f64>>,
    /// Share by which the constants were widened.
    pub margin: f64,
    /// Configurations sampled.
    pub samples: usize,
    /// Local maximisations.
    pub local_starts: usize,
}

/// The constants that a problem rests on.
#[derive(Clone, Debug, PartialEq)]
pub enum ConstantValues {
    /// Sampled: claims are conditional.
    Sampled(SampledConstantValues),
    /// Proved, in a record that covers the family.
    Proved(Box<Record>),
}

impl AicGainValues {
    /// The gains as they are written in a document.
    ///
    /// # Errors
    /// [`ProblemError`] when a number cannot be written.
    pub fn written(&self) -> Result<Gains, ProblemError> {
        Ok(Gains::Aic(AicGains {
            kappa_mu: numbers("kappa_mu", &self.kappa_mu)?,
            kappa_a: numbers("kappa_a", &self.kappa_a)?,
            sigma_q: numbers("sigma_q", &self.sigma_q)?,
            sigma_dq: numbers("sigma_dq", &self.sigma_dq)?,
            sigma_mu: numbers("sigma_mu", &self.sigma_mu)?,
            sigma_dmu: numbers("sigma_dmu", &self.sigma_dmu)?,
            reference_time_constant_s: numbers("reference_time_constant_s", &self.reference_time_constant_s)?,
        }))
    }
}

/// Gains of the MRAC, one number per joint; symbols as in [`MracGains`].
#[derive(Clone, Debug, PartialEq)]
pub struct MracGainValues {
    /// Which form.
    pub law: MracLaw,
    /// Natural frequency of the reference model, rad/s.
    pub omega_rad_per_s: Vec<f64>,
    /// Its damping ratio.
    pub zeta: Vec<f64>,
    /// Weight of the position error.
    pub l1: Vec<f64>,
    /// Weight of the velocity error.
    pub l2: Vec<f64>,
    /// Proportional, integral and derivative weights of the feed-forward term.
    pub alpha: [Vec<f64>; 3],
    /// The same for the gain on q.
    pub e0: [Vec<f64>; 3],
    /// The same for the gain on dq.
    pub e1: [Vec<f64>; 3],
    /// The same for the gain on the reference position.
    pub f0: [Vec<f64>; 3],
    /// The same for the gain on the reference velocity.
    pub f1: [Vec<f64>; 3],
}

impl MracGainValues {
    /// The gains as they are written in a document.
    ///
    /// # Errors
    /// [`ProblemError`] when a number cannot be written.
    pub fn written(&self) -> Result<Gains, ProblemError> {
        let three = |quantity, [first, second, third]: &[Vec<f64>; 3]| {
            Ok([numbers(quantity, first)?, numbers(quantity, second)?, numbers(quantity, third)?])
        };
        Ok(Gains::Mrac(Box::new(MracGains {
            law: self.law,
            omega_rad_per_s: numbers("omega_rad_per_s", &self.omega_rad_per_s)?,
            zeta: numbers("zeta", &self.zeta)?,
            l1: numbers("l1", &self.l1)?,
            l2: numbers("l2", &self.l2)?,
            alpha: three("alpha", &self.alpha)?,
            e0: three("e0", &self.e0)?,
            e1: three("e1", &self.e1)?,
            f0: three("f0", &self.f0)?,
            f1: three("f1", &self.f1)?,
        })))
    }
}

/// M and the Coriolis form over a box of configurations, proved; four decimals, rounded outward.
#[derive(Clone, Debug, PartialEq)]
pub struct EnclosureValues {
    /// Lower ends of the box, rad.
    pub lower_rad: Vec<f64>,
    /// Upper ends, rad.
    pub upper_rad: Vec<f64>,
    /// Midpoint of every entry of M, kg m^2.
    pub midpoint_kg_m2: Vec<Vec<f64>>,
    /// Radius of every entry, kg m^2.
    pub radius_kg_m2: Vec<Vec<f64>>,
    /// Bound of the Coriolis form, kg m^2.
    pub coriolis_kg_m2: f64,
    /// How often the box was halved along each joint.
    pub halvings: u32,
}

impl SampledConstantValues {
    fn written(&self) -> Result<Constants, ProblemError> {
        let list = |quantity, values: &[f64], outward| {
            values.iter().map(|&value| rounded(quantity, value, outward)).collect::<Result<Vec<_>, _>>()
        };
        let diagonal = |[lower, upper]: &[Vec<f64>; 2]| {
            Ok([list("diagonal_kg_m2", lower, -1.0)?, list("diagonal_kg_m2", upper, 1.0)?])
        };
        Ok(Constants {
            over: ConfigurationSet::AllAngles,
            bounds: Bounds {
                m_lo_kg_m2: rounded("m_lo_kg_m2", self.m_lo_kg_m2, -1.0)?,
                m_hi_kg_m2: rounded("m_hi_kg_m2", self.m_hi_kg_m2, 1.0)?,
                k_g_n_m_per_rad: rounded("k_g_n_m_per_rad", self.k_g_n_m_per_rad, 1.0)?,
                k_c_kg_m2: rounded("k_c_kg_m2", self.k_c_kg_m2, 1.0)?,
                k_r: Some(rounded("k_r", self.k_r, 1.0)?),
                k_m: self.k_m.map(|value| rounded("k_m", value, 1.0)).transpose()?,
                diagonal_kg_m2: self.diagonal_kg_m2.as_ref().map(diagonal).transpose()?,
                gravity_torque_n_m: self
                    .gravity_torque_n_m
                    .as_deref()
                    .map(|values| list("gravity_torque_n_m", values, 1.0))
                    .transpose()?,
                inertia: None,
            },
            evidence: Evidence::Sampled {
                margin: number("margin", self.margin)?,
                samples: self.samples,
                local_starts: self.local_starts,
            },
        })
    }
}

/// Why numbers make no problem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A number is NaN, infinite, or far too large or small.
    #[error("{quantity} is {value}, expected a number that is 0 or between 1e-12 and 1e12 in size")]
    NotRepresentable {
        /// Name of the quantity.
        quantity: &'static str,
        /// The number.
        value: f64,
    },
    /// The constants are not known on the whole of a smaller box.
    #[error("joint {joint} leaves the configurations that the constants are about")]
    OutsideConstants {
        /// Joint, counted from 1 at the base.
        joint: usize,
    },
}

/// The bound of a record that holds over a box alone.
const INERTIA: &str = "inertia";

/// A document without claims.
#[derive(Clone, Debug)]
pub struct Problem {
    document: Document,
    records: Vec<Record>,
}

/// Masses, payloads and rotor inertias of a family, as they are written in documents and records.
///
/// # Errors
/// [`ProblemError`] when a number cannot be written.
pub fn arm_ranges(arm: &ArmValues, family: &FamilyValues) -> Result<ArmRanges, ProblemError> {
    Ok(ArmRanges {
        mass_uncertainty: number("mass_uncertainty", family.mass_uncertainty)?,
        payload_kg: interval("payload_kg", family.payload_kg)?,
        payload_com_m: coordinates(arm.payload_com_m)?,
        rotor_inertia_kg_m2: interval("rotor_inertia_kg_m2", family.rotor_inertia_kg_m2)?,
    })
}

fn number(quantity: &'static str, value: f64) -> Result<Number, ProblemError> {
    let sensible = value.abs() <= 0.0 || (1e-12..=1e12).contains(&value.abs());
    sensible.then(|| Number::decimal(value)).flatten().ok_or(ProblemError::NotRepresentable { quantity, value })
}

fn numbers(quantity: &'static str, values: &[f64]) -> Result<Vec<Number>, ProblemError> {
    values.iter().map(|&value| number(quantity, value)).collect()
}

fn interval(quantity: &'static str, [lower, upper]: [f64; 2]) -> Result<[Number; 2], ProblemError> {
    Ok([number(quantity, lower)?, number(quantity, upper)?])
}

fn coordinates([x, y, z]: [f64; 3]) -> Result<[Number; 3], ProblemError> {
    let coordinate = |value| number("payload_com_m", value);
    Ok([coordinate(x)?, coordinate(y)?, coordinate(z)?])
}

/// Four significant digits, moved up (`outward = 1`) or down (`outward = -1`) by one unit of the fourth.
fn rounded(quantity: &'static str, value: f64, outward: f64) -> Result<Number, ProblemError> {
    if value <= 0.0 {
        return number(quantity, value);
    }
    let decade = value.log10().floor() as i32 - 3;
    let unit = 10_f64.powi(decade);
    let digits = usize::try_from(-decade).unwrap_or(0);
    let text = format!("{:.digits$}", (value / unit + outward).round() * unit);
    text.parse().map_err(|_| ProblemError::NotRepresentable { quantity, value })
}

impl Problem {
    /// A problem from plain numbers.
    ///
    /// # Errors
    /// [`ProblemError`] when a number cannot be written. Whether gains are positive, intervals ordered, lists of the
    /// right length and the family inside the record is for the checker to say.
    pub fn new(
        arm: &ArmValues,
        gains: Gains,
        family: &FamilyValues,
        constants: &ConstantValues,
    ) -> Result<Self, ProblemError> {
        let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
        let friction = interval("friction_n_m_s_per_rad", family.friction_n_m_s_per_rad)?;
        let document = Document {
            schema: 0,
            arm: Arm {
                name: arm.name.chars().map(plain).take(64).collect(),
                joints: arm.joints,
                sha256: arm.sha256.clone(),
            },
            gains,
            family: Family {
                gravity_compensation: family.gravity_compensation,
                friction_n_m_s_per_rad: vec![friction; arm.joints],
                arms: arm_ranges(arm, family)?,
            },
            constants: match constants {
                ConstantValues::Sampled(values) => values.written()?,
                ConstantValues::Proved(record) => Constants {
                    over: record.over.clone(),
                    bounds: record.bounds.clone(),
                    evidence: Evidence::Proved { record_sha256: record.sha256.clone() },
                },
            },
            about: String::new(),
            claims: Vec::new(),
            sha256: String::new(),
        };
        let records = match constants {
            ConstantValues::Sampled(_) => Vec::new(),
            ConstantValues::Proved(record) => vec![record.as_ref().clone()],
        };
        Ok(Self { document, records })
    }

    /// The same problem with an interval of viscous friction for each joint, `[least, largest]`, N m s/rad.
    ///
    /// # Errors
    /// [`ProblemError`] when a number cannot be written.
    pub fn with_friction_of_joints(mut self, friction_n_m_s_per_rad: &[[f64; 2]]) -> Result<Self, ProblemError> {
        self.document.family.friction_n_m_s_per_rad = friction_n_m_s_per_rad
            .iter()
            .map(|&ends| interval("friction_n_m_s_per_rad", ends))
            .collect::<Result<_, _>>()?;
        Ok(self)
    }

    /// The same problem over a box of configurations where M is enclosed: what was known over all angles holds there too.
    ///
    /// The values must have been computed for the family's arms. Proved constants become a record of the box and of those arms that holds the
    /// enclosure as well.
    ///
    /// # Errors
    /// [`ProblemError`] when a number cannot be written.
    pub fn over_box(mut self, values: &EnclosureValues) -> Result<Self, ProblemError> {
        let matrix = |quantity, rows: &[Vec<f64>]| {
            rows.iter().map(|row| numbers(quantity, row)).collect::<Result<Vec<_>, ProblemError>>()
        };
        let constants = &mut self.document.constants;
        let (lower_rad, upper_rad) =
            (numbers("lower_rad", &values.lower_rad)?, numbers("upper_rad", &values.upper_rad)?);
        if let ConfigurationSet::Box { lower_rad: known_lower, upper_rad: known_upper } = &constants.over {
            for joint in 0..lower_rad.len() {
                let inside = |lower: &Number, upper: &Number| {
                    lower.value() <= lower_rad[joint].value() && upper_rad[joint].value() <= upper.value()
                };
                if !known_lower.get(joint).zip(known_upper.get(joint)).is_some_and(|(l, u)| inside(l, u)) {
                    return Err(ProblemError::OutsideConstants { joint: joint + 1 });
                }
            }
        }
        let before = std::mem::replace(&mut constants.over, ConfigurationSet::Box { lower_rad, upper_rad });
        constants.bounds.inertia = Some(InertiaEnclosure {
            midpoint_kg_m2: matrix("midpoint_kg_m2", &values.midpoint_kg_m2)?,
            radius_kg_m2: matrix("radius_kg_m2", &values.radius_kg_m2)?,
            coriolis_kg_m2: number("coriolis_kg_m2", values.coriolis_kg_m2)?,
        });
        let halvings = vec![number("halvings", f64::from(values.halvings))?];
        for record in &mut self.records {
            let (earlier, mut proofs): (Vec<_>, Vec<_>) =
                record.proofs.iter().cloned().partition(|proof| proof.bound == INERTIA);
            // Every other bound is proved over the set it came from; nothing more is said when that is all angles.
            let mut parameters = match (earlier.into_iter().next(), &before) {
                (Some(proof), _) => proof.parameters,
                (None, ConfigurationSet::AllAngles) => BTreeMap::new(),
                (None, ConfigurationSet::Box { lower_rad, upper_rad }) => BTreeMap::from([
                    ("others_lower_rad".to_owned(), lower_rad.clone()),
                    ("others_upper_rad".to_owned(), upper_rad.clone()),
                ]),
            };
            parameters.insert("halvings".to_owned(), halvings.clone());
            proofs.push(BoundProof { bound: INERTIA.to_owned(), method: "enclosure".to_owned(), parameters });
            // The arms are the family's: M was enclosed for those, and the record may know more of them.
            let arms = self.document.family.arms.clone();
            let (over, bounds) = (constants.over.clone(), constants.bounds.clone());
            *record = Record { arms, over, bounds, proofs, ..record.clone() }.sealed();
            constants.evidence = Evidence::Proved { record_sha256: record.sha256.clone() };
        }
        Ok(self)
    }

    /// The records that the document's constants rest on; none when they were sampled.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The document without claims.
    pub fn document(&self) -> &Document {
        &self.document
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_rounded_outward() {
        for value in [0.0044, 4.659, 69.28, 1.0, 9.9999, 123_456.0] {
            assert!(rounded("x", value, 1.0).unwrap().to_f64() > value);
            assert!(rounded("x", value, -1.0).unwrap().to_f64() < value);
            assert!((rounded("x", value, 1.0).unwrap().to_f64() / value - 1.0).abs() < 3e-3);
        }
    }

    #[test]
    fn gains_keep_their_decimals() {
        assert_eq!(number("kappa_mu", 11.67).unwrap().to_string(), "11.67");
    }
}
