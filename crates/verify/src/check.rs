//! How a document is sealed, and how it is checked.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use sha2::{Digest, Sha256};

use crate::aic::SharedGains;
use crate::document::{Attained, BoxPoint, Claim, Document, Evidence, Grade, RegionClaim};
use crate::error::{Rejection, VerifyError};
use crate::exponential::{LoopBox, LoopFamily};
use crate::number::{Number, positive, unit_interval};
use crate::region::{ArmConstants, Inequality, Witness, inequalities};
use crate::statement::{Assumption, about, assumptions, statement};

const SCHEMA: u32 = 1;
const MOST_BYTES: usize = 1 << 20;
const MOST_CLAIMS: usize = 8;

/// What became of one entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The claim holds, with its grade.
    Holds,
    /// The claim is refused and the counterexample stands.
    Refused,
    /// The entry itself says that nothing was proved.
    NotProved,
}

/// A checked entry.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// `exponential` or `region`.
    pub kind: &'static str,
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
    }
}

/// Completes a document: derives the statement and grade of each claim, the schema, and the hash.
#[must_use]
pub fn seal(mut document: Document) -> Document {
    document.schema = SCHEMA;
    document.about = about(&document);
    let statements: Vec<String> = document.claims.iter().map(|claim| statement(&document, claim)).collect();
    let (allowed, _) = allowed_grade(&document.constants.evidence);
    for (claim, derived) in document.claims.iter_mut().zip(statements) {
        match claim {
            Claim::Exponential(c) => (c.statement, c.grade) = (derived, allowed),
            Claim::Region(c) => (c.statement, c.grade) = (derived, allowed),
            Claim::Refused(c) => c.statement = derived,
            Claim::NotProved(c) => c.statement = derived,
        }
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
/// reason to reject it. An entry that records a refusal is checked too: its counterexample must stand.
///
/// # Errors
/// [`VerifyError`] when the text cannot be read.
pub fn verify(text: &str) -> Result<Result<Certificate, Rejection>, VerifyError> {
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
    Ok(check(document))
}

fn check(document: Document) -> Result<Certificate, Rejection> {
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
    check_quantities(&document)?;
    let derived = about(&document);
    if document.about != derived {
        return Err(Rejection::About { derived });
    }
    let checked = document
        .claims
        .iter()
        .enumerate()
        .map(|(position, claim)| check_claim(&document, position + 1, claim))
        .collect::<Result<_, _>>()?;
    Ok(Certificate { document, checked })
}

fn require(quantity: &'static str, number: &Number, holds: bool, expected: &'static str) -> Result<(), Rejection> {
    if holds { Ok(()) } else { Err(Rejection::Quantity { quantity, value: number.to_string(), expected }) }
}

/// A number that stands in a statement: a decimal, and 0 or of a size that someone could mean.
fn require_plain(quantity: &'static str, number: &Number) -> Result<(), Rejection> {
    let size = number.value().abs();
    let thousand_billions = BigRational::from_integer(1_000_000_000_000_i64.into());
    let sensible = size.is_zero() || (size <= thousand_billions && size >= thousand_billions.recip());
    require(quantity, number, number.is_decimal() && sensible, "a decimal that is 0 or between 1e-12 and 1e12 in size")
}

fn require_positive(quantity: &'static str, number: &Number) -> Result<(), Rejection> {
    require_plain(quantity, number)?;
    require(quantity, number, positive(number.value()), "a positive number")
}

fn require_at_least_zero(quantity: &'static str, number: &Number) -> Result<(), Rejection> {
    require_plain(quantity, number)?;
    require(quantity, number, !number.value().is_negative(), "a number of at least 0")
}

fn require_interval(quantity: &'static str, [lower, upper]: &[Number; 2]) -> Result<(), Rejection> {
    require_at_least_zero(quantity, lower)?;
    require_plain(quantity, upper)?;
    require(quantity, upper, lower.value() <= upper.value(), "a largest value no smaller than the least")
}

/// Within the interval, to the rounding of a floating-point search.
fn require_within(quantity: &'static str, number: &Number, [lower, upper]: [&BigRational; 2]) -> Result<(), Rejection> {
    require_plain(quantity, number)?;
    let rounding = BigRational::new(1.into(), 1_000_000_000_i64.into());
    let within = &(lower - &rounding) <= number.value() && number.value() <= &(upper + &rounding);
    require(quantity, number, within, "a number within the family's interval")
}

/// What every claim needs: gains and family that exist, constants of a family that is not empty.
fn check_quantities(document: &Document) -> Result<(), Rejection> {
    let Document { arm, gains, family, constants, .. } = document;
    if arm.joints == 0 {
        return Err(Rejection::Length { quantity: "joints", found: 0, expected: 1 });
    }
    let refused = |quantity: &'static str, value: &str, expected: &'static str| {
        Err(Rejection::Quantity { quantity, value: value.chars().take(64).collect(), expected })
    };
    // What stands in the statement must not be able to say anything.
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if arm.name.is_empty() || arm.name.len() > 64 || !arm.name.chars().all(plain) {
        return refused("arm name", &arm.name, "letters, digits, - _ . (at most 64)");
    }
    if arm.sha256.len() != 64 || !arm.sha256.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f')) {
        return refused("arm sha256", &arm.sha256, "64 lower-case hexadecimal digits");
    }
    for (gain, list) in gains.named() {
        if list.len() != arm.joints {
            return Err(Rejection::Length { quantity: gain, found: list.len(), expected: arm.joints });
        }
        for number in list {
            require_positive(gain, number)?;
        }
    }
    require_interval("friction_n_m_s_per_rad", &family.friction_n_m_s_per_rad)?;
    require_interval("payload_kg", &family.payload_kg)?;
    require_interval("rotor_inertia_kg_m2", &family.rotor_inertia_kg_m2)?;
    for coordinate in &family.payload_com_m {
        require_plain("payload_com_m", coordinate)?;
    }
    let one = BigRational::from_integer(1.into());
    let share = &family.mass_uncertainty;
    require_at_least_zero("mass_uncertainty", share)?;
    require("mass_uncertainty", share, *share.value() < one, "a share in [0, 1)")?;
    let [least, largest] = [&constants.m_lo_kg_m2, &constants.m_hi_kg_m2];
    require_positive("m_lo_kg_m2", least)?;
    require_plain("m_hi_kg_m2", largest)?;
    require("m_hi_kg_m2", largest, least.value() <= largest.value(), "a number no smaller than m_lo_kg_m2")?;
    // M(q) is at least the rotor inertia: smaller constants would describe no arm at all, and every claim would hold of it.
    let rotor = family.rotor_inertia_kg_m2[1].value();
    require("m_hi_kg_m2", largest, rotor <= largest.value(), "a number no smaller than the largest rotor inertia")?;
    require_at_least_zero("k_g_n_m_per_rad", &constants.k_g_n_m_per_rad)?;
    require_at_least_zero("k_c_kg_m2", &constants.k_c_kg_m2)?;
    require_at_least_zero("k_r", &constants.k_r)?;
    let Evidence::Sampled { margin, samples, .. } = &constants.evidence;
    require_at_least_zero("margin", margin)?;
    require("margin", margin, *margin.value() <= one, "a share in [0, 1]")?;
    if *samples == 0 { refused("samples", "0", "at least 1 sample") } else { Ok(()) }
}

/// An arm that a refusal names must at least be a member of the family; its eigenvalue is not checked.
fn check_attained(document: &Document, point: &BoxPoint, rate: &Number, attained: &Attained) -> Result<(), Rejection> {
    let Document { arm, family, .. } = document;
    for (quantity, list) in [("q_rad", &attained.q_rad), ("link_mass_scale", &attained.link_mass_scale)] {
        if list.len() != arm.joints {
            return Err(Rejection::Length { quantity, found: list.len(), expected: arm.joints });
        }
    }
    for angle in &attained.q_rad {
        require_plain("q_rad", angle)?;
    }
    let one = BigRational::from_integer(1.into());
    let share = family.mass_uncertainty.value();
    for scale in &attained.link_mass_scale {
        require_within("link_mass_scale", scale, [&(&one - share), &(&one + share)])?;
    }
    let ends = |interval: &'_ [Number; 2]| [interval[0].value().clone(), interval[1].value().clone()];
    for (quantity, number, interval) in [
        ("payload_kg", &attained.payload_kg, &family.payload_kg),
        ("rotor_inertia_kg_m2", &attained.rotor_inertia_kg_m2, &family.rotor_inertia_kg_m2),
        ("friction_n_m_s_per_rad", &attained.friction_n_m_s_per_rad, &family.friction_n_m_s_per_rad),
    ] {
        let [lower, upper] = ends(interval);
        require_within(quantity, number, [&lower, &upper])?;
    }
    let same = attained.friction_n_m_s_per_rad.value() == point.friction_n_m_s_per_rad.value();
    require("friction_n_m_s_per_rad", &attained.friction_n_m_s_per_rad, same, "the friction of the point")?;
    let [real, imaginary] = &attained.eigenvalue_per_s;
    require_plain("eigenvalue_per_s", imaginary)?;
    require_plain("eigenvalue_per_s", real)?;
    require("eigenvalue_per_s", real, *real.value() >= -rate.value(), "a real part of at least minus the rate")
}

/// The box of linearised loops that the family's constants span.
pub fn family_box(document: &Document) -> LoopBox {
    let Document { family, constants, .. } = document;
    let stiffness = if family.gravity_compensation { Number::zero() } else { constants.k_g_n_m_per_rad.clone() };
    LoopBox {
        inertia: [constants.m_lo_kg_m2.clone(), constants.m_hi_kg_m2.clone()],
        friction: family.friction_n_m_s_per_rad.clone(),
        stiffness: [stiffness.negated(), stiffness],
    }
}

pub(crate) fn region_parts(
    document: &Document,
    claim: &RegionClaim,
) -> Result<(SharedGains, ArmConstants, Witness), Rejection> {
    check_quantities(document)?;
    let gains = document.gains.shared(document.arm.joints)?;
    let constants = &document.constants;
    let LoopBox { inertia, friction, stiffness: [_, stiffness] } = family_box(document);
    let values = |interval: [Number; 2]| interval.map(|end| end.value().clone());
    let arm = ArmConstants {
        inertia: values(inertia),
        friction: values(friction),
        stiffness: stiffness.value().clone(),
        coriolis: constants.k_c_kg_m2.value().clone(),
        coriolis_relative: constants.k_r.value().clone(),
    };
    let witness = &claim.witness;
    require_positive("radius_rad", &claim.radius_rad)?;
    require_positive("rate_per_s", &claim.rate_per_s)?;
    // A witness is only ever computed with: dyadics of any size will do.
    require("p", &witness.p, positive(witness.p.value()), "a positive number")?;
    require("rho", &witness.rho, positive(witness.rho.value()), "a positive number")?;
    require("theta", &witness.theta, unit_interval(witness.theta.value()), "a share in [0, 1]")?;
    for (name, multiplier) in [
        ("friction_multiplier", &witness.friction_multiplier),
        ("gravity_multiplier", &witness.gravity_multiplier),
        ("start_multiplier", &witness.start_multiplier),
    ] {
        require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
    }
    if witness.s.len() != 15 {
        return Err(Rejection::Length { quantity: "s", found: witness.s.len(), expected: 15 });
    }
    let mut s = crate::algebra::zeros(5);
    let mut entries = witness.s.iter();
    for (i, j) in (0..5).flat_map(|i| (i..5).map(move |j| (i, j))) {
        if let Some(entry) = entries.next() {
            s[i][j].clone_from(entry.value());
            s[j][i].clone_from(entry.value());
        }
    }
    let witness = Witness {
        p: witness.p.value().clone(),
        b: witness.b.clone().map(|x| x.value().clone()),
        s,
        rho: witness.rho.value().clone(),
        theta: witness.theta.value().clone(),
        friction_multiplier: witness.friction_multiplier.value().clone(),
        gravity_multiplier: witness.gravity_multiplier.value().clone(),
        start_multiplier: witness.start_multiplier.value().clone(),
        rate: claim.rate_per_s.value().clone(),
        radius: claim.radius_rad.value().clone(),
    };
    Ok((gains, arm, witness))
}

fn check_claim(document: &Document, index: usize, claim: &Claim) -> Result<Checked, Rejection> {
    let derived = statement(document, claim);
    let (written, graded) = match claim {
        Claim::Exponential(c) => (&c.statement, Some(c.grade)),
        Claim::Region(c) => (&c.statement, Some(c.grade)),
        Claim::Refused(c) => (&c.statement, None),
        Claim::NotProved(c) => (&c.statement, None),
    };
    if *written != derived {
        return Err(Rejection::Statement { index, derived });
    }
    let (grade, allowed) = allowed_grade(&document.constants.evidence);
    if graded.is_some_and(|written| written != grade) {
        return Err(Rejection::Grade { index, allowed });
    }
    let mut checked = Checked {
        kind: "exponential",
        verdict: Verdict::Holds,
        grade: graded,
        statement: derived,
        inequalities: Vec::new(),
    };
    match claim {
        Claim::Exponential(c) => {
            require_positive("rate_per_s", &c.rate_per_s)?;
            LoopFamily::new(&document.gains)?
                .decays_on(&family_box(document), c.rate_per_s.value())
                .map_err(|reason| Rejection::Polynomial { index, reason })?;
        }
        Claim::Region(c) => {
            let (gains, arm, witness) = region_parts(document, c)?;
            checked.kind = "region";
            checked.inequalities = inequalities(&gains, &arm, &witness);
            if let Some(failed) = checked.inequalities.iter().find(|x| x.smallest_pivot.is_none()) {
                return Err(Rejection::Inequality { index, inequality: failed.name.clone() });
            }
        }
        Claim::Refused(c) => {
            let [m, d, g] = [&c.point.inertia_kg_m2, &c.point.friction_n_m_s_per_rad, &c.point.stiffness_n_m_per_rad]
                .map(Number::value);
            require_at_least_zero("rate_per_s", &c.rate_per_s)?;
            for number in [&c.point.inertia_kg_m2, &c.point.friction_n_m_s_per_rad, &c.point.stiffness_n_m_per_rad] {
                require_plain("point", number)?;
            }
            if !family_box(document).contains([m, d, g]) {
                return Err(Rejection::Counterexample { index, reason: "the point lies outside the family's box" });
            }
            if LoopFamily::new(&document.gains)?.is_stable_at([m, d, g], c.rate_per_s.value()) {
                return Err(Rejection::Counterexample { index, reason: "the loop at the point decays at the rate" });
            }
            if let Some(attained) = &c.attained {
                check_attained(document, &c.point, &c.rate_per_s, attained)?;
            }
            checked.verdict = Verdict::Refused;
        }
        Claim::NotProved(c) => {
            if let Some(distance) = &c.distance {
                require_plain("distance", distance)?;
            }
            checked.verdict = Verdict::NotProved;
            checked.kind = c.of.kind();
        }
    }
    Ok(checked)
}
