//! How a document is sealed, and how it is checked.

use num_rational::BigRational;
use sha2::{Digest, Sha256};

use crate::claims::{Claim, ClaimKind, Inequality, Verdict};
use crate::document::{Arm, ArmRanges, Bounds, ConfigurationSet, Document, Entry, Evidence, Grade, InertiaEnclosure};
use crate::error::{Flaw, Rejection, VerifyError};
use crate::quantity::{
    require, require_at_least_zero, require_interval, require_length, require_plain, require_positive, require_sha256,
};
use crate::record::Record;
use crate::statement::{Assumption, about, assumptions, statement};

const SCHEMA: u32 = 2;
const MOST_BYTES: usize = 1 << 20;
const MOST_CLAIMS: usize = 16;

/// A checked entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// What was claimed, refused or attempted.
    pub kind: ClaimKind,
    /// What became of it.
    pub verdict: Verdict,
    /// How strong it is; `None` unless it holds.
    pub grade: Option<Grade>,
    /// In words, as derived from the numbers.
    pub statement: String,
    /// The matrix inequalities that were checked.
    pub inequalities: Vec<Inequality>,
}

/// A document whose every entry was checked by this crate. Only [`verify`] makes one.
#[derive(Clone, Debug)]
pub struct Certificate {
    document: Document,
    checked: Vec<Checked>,
}

impl Certificate {
    /// The document that was checked.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Every entry with its verdict, in the document's order.
    pub fn checked(&self) -> &[Checked] {
        &self.checked
    }

    /// Whether every entry is a claim that holds (a conditional one included).
    pub fn all_hold(&self) -> bool {
        self.checked.iter().all(|entry| entry.verdict == Verdict::Holds)
    }

    /// What the claims take for granted.
    pub fn assumptions(&self) -> Vec<Assumption> {
        assumptions(&self.document)
    }
}

/// What a claim may be graded when it rests on this evidence.
pub(crate) fn allowed_grade(evidence: &Evidence) -> (Grade, &'static str) {
    match evidence {
        Evidence::Sampled { .. } => (Grade::Conditional, "sampled"),
        Evidence::Proved { .. } => (Grade::Proved, "proved"),
    }
}

fn grade(document: &Document, entry: &Entry) -> Option<Grade> {
    (entry.claim.verdict() == Verdict::Holds).then(|| allowed_grade(&document.constants.evidence).0)
}

/// Completes a document: derives the statement and grade of each claim, the schema, and the hash.
#[must_use]
pub fn seal(mut document: Document) -> Document {
    document.schema = SCHEMA;
    document.about = about(&document);
    let derived: Vec<_> =
        document.claims.iter().map(|entry| (statement(&document, &entry.claim), grade(&document, entry))).collect();
    for (entry, (statement, grade)) in document.claims.iter_mut().zip(derived) {
        (entry.statement, entry.grade) = (statement, grade);
    }
    document.sha256 = hash(&document);
    document
}

fn hash(document: &Document) -> String {
    let unsealed = Document { sha256: String::new(), ..document.clone() };
    // Plain structs of texts and integers always serialise; an empty digest would still be compared with the file's.
    let canonical = serde_json::to_vec(&unsealed).unwrap_or_default();
    Sha256::digest(&canonical).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a certificate and checks every entry of it.
///
/// The outer error says that the text is no certificate; the inner result holds either the checked certificate or the first
/// reason to reject it. An entry that records a refusal is checked too: its counterexample must stand. Constants that the document calls
/// proved must be those of one of the `records`, or wider.
///
/// # Errors
/// [`VerifyError`] when the text cannot be read.
pub fn verify(text: &str, records: &[Record]) -> Result<Result<Certificate, Rejection>, VerifyError> {
    #[derive(serde::Deserialize)]
    struct Head {
        schema: u32,
    }
    if text.len() > MOST_BYTES {
        return Err(VerifyError::Length { found: text.len(), most: MOST_BYTES });
    }
    let head: Head = serde_json::from_str(text)?;
    if head.schema != SCHEMA {
        return Err(VerifyError::Schema { found: head.schema, expected: SCHEMA });
    }
    let document: Document = serde_json::from_str(text)?;
    // One document, one text (but for blanks and the order of fields): the reader is more tolerant than the format.
    let written: serde_json::Value = serde_json::from_str(text)?;
    if serde_json::to_value(&document)? != written {
        return Ok(Err(Rejection::Form));
    }
    Ok(check(document, records))
}

fn check(document: Document, records: &[Record]) -> Result<Certificate, Rejection> {
    let computed = hash(&document);
    if computed != document.sha256 {
        return Err(Rejection::Hash { computed, written: document.sha256 });
    }
    if document.claims.is_empty() {
        return Err(Rejection::Empty);
    }
    if document.claims.len() > MOST_CLAIMS {
        return Err(Rejection::Crowded { found: document.claims.len(), most: MOST_CLAIMS });
    }
    check_head(&document)?;
    check_evidence(&document, records)?;
    let derived = about(&document);
    if document.about != derived {
        return Err(Rejection::About { derived });
    }
    let checked = document
        .claims
        .iter()
        .enumerate()
        .map(|(position, entry)| check_entry(&document, position, entry))
        .collect::<Result<_, _>>()?;
    Ok(Certificate { document, checked })
}

/// What every claim needs: gains and family that exist, constants of a family that is not empty.
fn check_head(document: &Document) -> Result<(), Flaw> {
    let Document { arm, gains, family, constants, .. } = document;
    check_arm(arm)?;
    gains.check(arm.joints)?;
    require_length("friction_n_m_s_per_rad", family.friction_n_m_s_per_rad.len(), arm.joints)?;
    for interval in &family.friction_n_m_s_per_rad {
        require_interval("friction_n_m_s_per_rad", interval)?;
    }
    check_ranges(&family.arms)?;
    check_bounds(arm, &family.arms, &constants.over, &constants.bounds)
}

pub(crate) fn check_arm(arm: &Arm) -> Result<(), Flaw> {
    if arm.joints == 0 {
        return Err(Flaw::Length { quantity: "joints", found: 0, expected: 1 });
    }
    // What stands in the statement must not be able to say anything.
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if arm.name.is_empty() || arm.name.len() > 64 || !arm.name.chars().all(plain) {
        return Err(Flaw::quantity("arm name", &arm.name, "letters, digits, - _ . (at most 64)"));
    }
    require_sha256("arm sha256", &arm.sha256)
}

pub(crate) fn check_ranges(arms: &ArmRanges) -> Result<(), Flaw> {
    require_interval("payload_kg", &arms.payload_kg)?;
    require_interval("rotor_inertia_kg_m2", &arms.rotor_inertia_kg_m2)?;
    for coordinate in &arms.payload_com_m {
        require_plain("payload_com_m", coordinate)?;
    }
    let share = &arms.mass_uncertainty;
    require_at_least_zero("mass_uncertainty", share)?;
    require("mass_uncertainty", share, *share.value() < BigRational::from_integer(1.into()), "a share in [0, 1)")
}

pub(crate) fn check_bounds(arm: &Arm, arms: &ArmRanges, over: &ConfigurationSet, bounds: &Bounds) -> Result<(), Flaw> {
    if let ConfigurationSet::Box { lower_rad, upper_rad } = over {
        require_length("lower_rad", lower_rad.len(), arm.joints)?;
        require_length("upper_rad", upper_rad.len(), arm.joints)?;
        for (lower, upper) in lower_rad.iter().zip(upper_rad) {
            require_plain("lower_rad", lower)?;
            require_plain("upper_rad", upper)?;
            require("upper_rad", upper, lower.value() < upper.value(), "an upper end beyond the lower one")?;
        }
    }
    let [least, largest] = [&bounds.m_lo_kg_m2, &bounds.m_hi_kg_m2];
    require_positive("m_lo_kg_m2", least)?;
    require_plain("m_hi_kg_m2", largest)?;
    require("m_hi_kg_m2", largest, least.value() <= largest.value(), "a number no smaller than m_lo_kg_m2")?;
    // M(q) is at least the rotor inertia: smaller constants would describe no arm at all, and every claim would hold of it.
    let rotor = arms.rotor_inertia_kg_m2[1].value();
    let too_small = "a number no smaller than the largest rotor inertia";
    require("m_hi_kg_m2", largest, rotor <= largest.value(), too_small)?;
    require_at_least_zero("k_g_n_m_per_rad", &bounds.k_g_n_m_per_rad)?;
    require_at_least_zero("k_c_kg_m2", &bounds.k_c_kg_m2)?;
    for (quantity, number) in [("k_r", &bounds.k_r), ("k_m", &bounds.k_m)] {
        if let Some(number) = number {
            require_at_least_zero(quantity, number)?;
        }
    }
    if let Some([lower, upper]) = &bounds.diagonal_kg_m2 {
        for list in [lower, upper] {
            require_length("diagonal_kg_m2", list.len(), arm.joints)?;
        }
        for (lower, upper) in lower.iter().zip(upper) {
            require_positive("diagonal_kg_m2", lower)?;
            require_plain("diagonal_kg_m2", upper)?;
            require("diagonal_kg_m2", upper, lower.value() < upper.value(), "an upper bound beyond the lower one")?;
            require("diagonal_kg_m2", upper, rotor <= upper.value(), too_small)?;
            require("diagonal_kg_m2", upper, least.value() <= upper.value(), "a number no smaller than m_lo_kg_m2")?;
            require("diagonal_kg_m2", lower, lower.value() <= largest.value(), "a number no larger than m_hi_kg_m2")?;
        }
    }
    if let Some(inertia) = &bounds.inertia {
        check_inertia(arm, inertia, rotor, bounds)?;
    }
    if let Some(torques) = &bounds.gravity_torque_n_m {
        require_length("gravity_torque_n_m", torques.len(), arm.joints)?;
        for torque in torques {
            require_at_least_zero("gravity_torque_n_m", torque)?;
        }
    }
    Ok(())
}

/// Every diagonal entry of M lies between its least and largest eigenvalue: an enclosure that denies it would be of no arm, and anything would hold of it.
fn check_inertia(arm: &Arm, inertia: &InertiaEnclosure, rotor: &BigRational, bounds: &Bounds) -> Result<(), Flaw> {
    for matrix in [&inertia.midpoint_kg_m2, &inertia.radius_kg_m2] {
        require_length("inertia", matrix.len(), arm.joints)?;
        for row in matrix {
            require_length("inertia", row.len(), arm.joints)?;
        }
        for (i, row) in matrix.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                require_plain("inertia", entry)?;
                require("inertia", entry, entry.value() == matrix[j][i].value(), "a symmetric matrix")?;
            }
        }
    }
    for radius in inertia.radius_kg_m2.iter().flatten() {
        require_at_least_zero("radius_kg_m2", radius)?;
    }
    for joint in 0..arm.joints {
        let (middle, radius) = (&inertia.midpoint_kg_m2[joint][joint], &inertia.radius_kg_m2[joint][joint]);
        let [lower, upper] = [middle.value() - radius.value(), middle.value() + radius.value()];
        let diagonal = bounds.diagonal_kg_m2.as_ref().map(|ends| ends.each_ref().map(|list| list[joint].value()));
        let met = lower <= *bounds.m_hi_kg_m2.value()
            && *bounds.m_lo_kg_m2.value() <= upper
            && *rotor <= upper
            && diagonal.is_none_or(|[least, largest]| lower <= *largest && *least <= upper);
        require("midpoint_kg_m2", middle, met, "an enclosure that the other constants and the rotor inertia allow")?;
    }
    require_at_least_zero("coriolis_kg_m2", &inertia.coriolis_kg_m2)
}

fn check_evidence(document: &Document, records: &[Record]) -> Result<(), Rejection> {
    match &document.constants.evidence {
        Evidence::Sampled { margin, samples, .. } => {
            require_at_least_zero("margin", margin)?;
            require("margin", margin, *margin.value() <= BigRational::from_integer(1.into()), "a share in [0, 1]")?;
            if *samples == 0 { Err(Flaw::quantity("samples", "0", "at least 1 sample").into()) } else { Ok(()) }
        }
        Evidence::Proved { record_sha256 } => {
            let unknown = || Rejection::Record {
                reason: format!(
                    "no record with hash {} is at hand",
                    record_sha256.chars().take(64).collect::<String>()
                ),
            };
            let record = records.iter().find(|record| record.sha256 == *record_sha256).ok_or_else(unknown)?;
            record.supports(document).map_err(|reason| Rejection::Record { reason: reason.to_owned() })
        }
    }
}

/// Checks the proof of one claim about a document on its own: what a search asks before it writes the claim down.
///
/// Neither the document's head nor its evidence is checked; only [`verify`] makes a [`Certificate`].
///
/// # Errors
/// [`Flaw`] where the proof fails.
pub fn checked_alone(document: &Document, claim: &Claim) -> Result<Vec<Inequality>, Flaw> {
    claim.provable().prove(document, document.claims.len())
}

fn check_entry(document: &Document, position: usize, entry: &Entry) -> Result<Checked, Rejection> {
    let index = position + 1;
    let derived = statement(document, &entry.claim);
    if entry.statement != derived {
        return Err(Rejection::Statement { index, derived });
    }
    let grade = grade(document, entry);
    if entry.grade != grade {
        return Err(Rejection::Grade { index, allowed: allowed_grade(&document.constants.evidence).1 });
    }
    let inequalities =
        entry.claim.provable().prove(document, position).map_err(|flaw| Rejection::Claim { index, flaw })?;
    Ok(Checked { kind: entry.claim.kind(), verdict: entry.claim.verdict(), grade, statement: derived, inequalities })
}
