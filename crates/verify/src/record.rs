//! Proved constants of one arm, stored once and referred to by their hash.
//!
//! Proving the constants of an arm takes minutes; a certificate names the record that holds them. A checker that knows the record compares
//! the numbers; whoever distrusts the record derives it again from the arm (`autotune verify --full`), with the parameters written in it.

use std::collections::BTreeMap;

use num_rational::BigRational;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::check::{check_arm, check_bounds, check_ranges};
use crate::document::{Arm, ArmRanges, Bounds, ConfigurationSet, Document};
use crate::error::{Rejection, VerifyError};
use crate::number::Number;

const SCHEMA: u32 = 1;

/// Constants that were proved for every arm of a range, over a set of configurations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Version of the format.
    pub schema: u32,
    /// Which arm.
    pub arm: Arm,
    /// Which masses, payloads and rotor inertias.
    pub arms: ArmRanges,
    /// Which configurations.
    pub over: ConfigurationSet,
    /// The numbers.
    pub bounds: Bounds,
    /// How each was obtained.
    pub proofs: Vec<BoundProof>,
    /// SHA-256 of the canonical content with this field empty, lower-case hexadecimal.
    pub sha256: String,
}

/// How one bound was obtained: enough to obtain it again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundProof {
    /// Which bound, by its name in [`Bounds`].
    pub bound: String,
    /// Which method.
    pub method: String,
    /// Its parameters: numbers of corners, grid points, candidate values.
    pub parameters: BTreeMap<String, Vec<Number>>,
}

impl Record {
    /// Reads a record and checks its hash and that its numbers can be those of an arm.
    ///
    /// # Errors
    /// The outer error says that the text is no record, the inner one that it was edited or contradicts itself.
    pub fn parse(text: &str) -> Result<Result<Self, Rejection>, VerifyError> {
        let record: Self = serde_json::from_str(text)?;
        if record.schema != SCHEMA {
            return Err(VerifyError::Schema { found: record.schema, expected: SCHEMA });
        }
        // One record, one text, as for a document.
        let written: serde_json::Value = serde_json::from_str(text)?;
        if serde_json::to_value(&record)? != written {
            return Ok(Err(Rejection::Form));
        }
        let computed = record.hash();
        if computed != record.sha256 {
            return Ok(Err(Rejection::Hash { computed, written: record.sha256 }));
        }
        let checked = check_arm(&record.arm)
            .and_then(|()| check_ranges(&record.arms))
            .and_then(|()| check_bounds(&record.arm, &record.arms, &record.over, &record.bounds));
        Ok(checked.map(|()| record).map_err(Rejection::from))
    }

    /// Completes a record: schema and hash.
    #[must_use]
    pub fn sealed(mut self) -> Self {
        self.schema = SCHEMA;
        self.sha256 = self.hash();
        self
    }

    fn hash(&self) -> String {
        let unsealed = Self { sha256: String::new(), ..self.clone() };
        // Plain structs of texts and integers always serialise; an empty digest would still be compared with the file's.
        let canonical = serde_json::to_vec(&unsealed).unwrap_or_default();
        Sha256::digest(&canonical).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Whether every arm of the ranges is an arm of this record.
    pub fn covers(&self, arm: &Arm, ranges: &ArmRanges) -> Result<(), &'static str> {
        let inside = |inner: &[Number; 2], outer: &[Number; 2]| {
            outer[0].value() <= inner[0].value() && inner[1].value() <= outer[1].value()
        };
        let no_payload = *ranges.payload_kg[1].value() == BigRational::from_integer(0.into());
        if self.arm != *arm {
            Err("it is about another arm")
        } else if ranges.mass_uncertainty.value() > self.arms.mass_uncertainty.value() {
            Err("its mass uncertainty is smaller")
        } else if !inside(&ranges.payload_kg, &self.arms.payload_kg) {
            Err("its payloads are fewer")
        } else if !no_payload
            && ranges.payload_com_m.iter().zip(&self.arms.payload_com_m).any(|(a, b)| a.value() != b.value())
        {
            Err("its payload sits elsewhere")
        } else if !inside(&ranges.rotor_inertia_kg_m2, &self.arms.rotor_inertia_kg_m2) {
            Err("its rotor inertias are fewer")
        } else {
            Ok(())
        }
    }

    /// Whether the document's constants follow from this record.
    pub(crate) fn supports(&self, document: &Document) -> Result<(), &'static str> {
        self.covers(&document.arm, &document.family.arms)?;
        if document.constants.over != self.over {
            return Err("it is about other configurations");
        }
        let (ours, theirs) = (&document.constants.bounds, &self.bounds);
        let at_least = |ours: &Number, theirs: &Number| ours.value() >= theirs.value();
        let optional = |ours: &Option<Number>, theirs: &Option<Number>| match (ours, theirs) {
            (None, _) => true,
            (Some(_), None) => false,
            (Some(ours), Some(theirs)) => at_least(ours, theirs),
        };
        let every = |ours: &[Number], theirs: &[Number]| {
            ours.len() == theirs.len() && ours.iter().zip(theirs).all(|(a, b)| at_least(a, b))
        };
        let diagonal = match (&ours.diagonal_kg_m2, &theirs.diagonal_kg_m2) {
            (None, _) => true,
            (Some(_), None) => false,
            (Some([lower, upper]), Some([lower_proved, upper_proved])) => {
                every(lower_proved, lower) && every(upper, upper_proved)
            }
        };
        let torque = match (&ours.gravity_torque_n_m, &theirs.gravity_torque_n_m) {
            (None, _) => true,
            (Some(_), None) => false,
            (Some(ours), Some(theirs)) => every(ours, theirs),
        };
        let inertia = match (&ours.inertia, &theirs.inertia) {
            (None, _) => true,
            (Some(ours), theirs) => theirs.as_ref().is_some_and(|theirs| ours == theirs),
        };
        let all = at_least(&theirs.m_lo_kg_m2, &ours.m_lo_kg_m2)
            && at_least(&ours.m_hi_kg_m2, &theirs.m_hi_kg_m2)
            && at_least(&ours.k_g_n_m_per_rad, &theirs.k_g_n_m_per_rad)
            && at_least(&ours.k_c_kg_m2, &theirs.k_c_kg_m2)
            && optional(&ours.k_r, &theirs.k_r)
            && optional(&ours.k_m, &theirs.k_m)
            && diagonal
            && torque
            && inertia;
        if all { Ok(()) } else { Err("a constant is tighter than what was proved") }
    }
}
