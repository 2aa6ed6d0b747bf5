//! A claim that a point of the family's box contradicts.

use std::fmt::Write as _;

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use serde::{Deserialize, Serialize};

use super::sampled::{LoopTiming, milliseconds};
use super::variation::{Variation, varied, would_be_stable};
use super::{ClaimKind, Inequality, LoopBox, LoopFamily, Provable, family_box};
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::number::Number;
use crate::quantity::{require, require_at_least_zero, require_length, require_plain, require_within};
use crate::sampled_loops::SampledFamily;

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
    /// Which claim is refused: `exponential` or `sampled`.
    pub of: ClaimKind,
    /// How the refused loop is sampled, with the very delay at which it fails, a whole number of samples; none in continuous time.
    pub sampling: Option<LoopTiming>,
    /// The rate that was asked for, 1/s; 0 asks for stability alone.
    pub rate_per_s: Number,
    /// The loop at this point does not decay at that rate; exact.
    pub point: BoxPoint,
    /// An arm and configuration at that point, when one was found.
    pub attained: Option<Attained>,
    /// Changes of the family with which every linearised loop is stable, each checked exactly.
    pub remedies: Vec<Variation>,
}

impl Provable for RefusedClaim {
    fn kind(&self) -> ClaimKind {
        self.of
    }

    fn sentence(&self, document: &Document) -> String {
        let wanted = if self.rate_per_s.value().is_positive() {
            format!("does not decay faster than exp(-{} t), t in s", self.rate_per_s)
        } else {
            "is not asymptotically stable".to_owned()
        };
        let sampled = self
            .sampling
            .as_ref()
            .map(|s| format!(", {} and a delay of {} ms,", s.in_words(), milliseconds(&s.delay_s)))
            .unwrap_or_default();
        let mut text = format!(
            "Refused: the linearised loop{sampled} with inertia {} kg m^2, friction {} N m s/rad and gravity stiffness {} N m/rad {wanted}.",
            self.point.inertia_kg_m2, self.point.friction_n_m_s_per_rad, self.point.stiffness_n_m_per_rad
        );
        match &self.attained {
            Some(a) => {
                let list: Vec<String> = a.q_rad.iter().map(Number::to_string).collect();
                let [real, imaginary] = &a.eigenvalue_per_s;
                let _ = write!(
                    text,
                    " The point is attainable if the file's floating-point search is right (not checked exactly): an arm of the family at \
                     q = [{}] rad with eigenvalue {real} {}i per s.",
                    list.join(", "),
                    signed(imaginary),
                );
            }
            None => text.push_str(
                " The point lies in the box of the stated constants but is not shown attainable by an arm of the family.",
            ),
        }
        text.push_str(&would_be_stable(document, &self.remedies, self.sampling.as_ref()));
        text
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        let coordinates =
            [&self.point.inertia_kg_m2, &self.point.friction_n_m_s_per_rad, &self.point.stiffness_n_m_per_rad];
        require_at_least_zero("rate_per_s", &self.rate_per_s)?;
        for number in coordinates {
            require_plain("point", number)?;
        }
        let values = coordinates.map(Number::value);
        if !family_box(document).contains(values) {
            return Err(Flaw::Counterexample { reason: "the point lies outside the family's box" });
        }
        if !linearised_loop(document, self.of, self.sampling.as_ref())?.fails_at(values, self.rate_per_s.value())? {
            return Err(Flaw::Counterexample { reason: "the loop at the point is not shown to miss the rate" });
        }
        check_remedies(document, self.of, self.sampling.as_ref(), &self.remedies)?;
        if let Some(attained) = &self.attained {
            check_attained(document, &self.point, &self.rate_per_s, attained)?;
        }
        Ok(Vec::new())
    }
}

/// The linearised loops that a claim is about.
pub(crate) enum LinearisedLoop<'a> {
    Continuous(LoopFamily),
    Sampled(SampledFamily, &'a LoopTiming),
}

pub(crate) fn linearised_loop<'a>(
    document: &Document,
    of: ClaimKind,
    sampling: Option<&'a LoopTiming>,
) -> Result<LinearisedLoop<'a>, Flaw> {
    match (of, sampling) {
        (ClaimKind::Exponential, None) => Ok(LinearisedLoop::Continuous(LoopFamily::new(document.gains.aic()?)?)),
        (ClaimKind::Sampled, Some(sampling)) => {
            sampling.check()?;
            Ok(LinearisedLoop::Sampled(SampledFamily::new(document.gains.aic()?, &sampling.period_s)?, sampling))
        }
        _ => Err(Flaw::Counterexample { reason: "no claim of this kind speaks of linearised loops of the box" }),
    }
}

impl LinearisedLoop<'_> {
    fn fails_at(&self, point: [&BigRational; 3], rate: &BigRational) -> Result<bool, Flaw> {
        match self {
            Self::Continuous(loops) => Ok(!loops.is_stable_at(point, rate)),
            Self::Sampled(loops, sampling) => {
                if !rate.is_zero() {
                    return Err(Flaw::Counterexample { reason: "a sampled loop is refused at rate 0 only" });
                }
                let Some(samples) = sampling.whole_samples() else {
                    return Err(Flaw::Counterexample { reason: "the delay is not a whole number of samples" });
                };
                Ok(loops.fails_at(sampling.plant, point, samples, rate))
            }
        }
    }

    pub(crate) fn stable_on(&self, range: &LoopBox) -> Result<(), Flaw> {
        let zero = BigRational::zero();
        match self {
            Self::Continuous(loops) => loops.decays_on(range, &zero),
            Self::Sampled(loops, sampling) => loops.decays_on(sampling.plant, range, &sampling.delay_samples(), &zero),
        }
        .map_err(|reason| Flaw::Polynomial { reason })
    }
}

/// Every remedy makes every linearised loop stable.
pub(crate) fn check_remedies(
    document: &Document,
    of: ClaimKind,
    sampling: Option<&LoopTiming>,
    remedies: &[Variation],
) -> Result<(), Flaw> {
    if remedies.is_empty() {
        return Ok(());
    }
    let loops = linearised_loop(document, of, sampling)?;
    varied(document, remedies, &|range| loops.stable_on(range))
}

fn signed(x: &Number) -> String {
    if x.value().is_negative() { format!("- {}", x.to_string().trim_start_matches('-')) } else { format!("+ {x}") }
}

/// An arm that a refusal names must at least be a member of the family; its eigenvalue is not checked.
fn check_attained(document: &Document, point: &BoxPoint, rate: &Number, attained: &Attained) -> Result<(), Flaw> {
    let Document { arm, family, .. } = document;
    for (quantity, list) in [("q_rad", &attained.q_rad), ("link_mass_scale", &attained.link_mass_scale)] {
        require_length(quantity, list.len(), arm.joints)?;
    }
    for angle in &attained.q_rad {
        require_plain("q_rad", angle)?;
    }
    if let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over {
        for ((angle, lower), upper) in attained.q_rad.iter().zip(lower_rad).zip(upper_rad) {
            require_within("q_rad", angle, [lower.value(), upper.value()])?;
        }
    }
    let one = BigRational::from_integer(1.into());
    let share = family.arms.mass_uncertainty.value();
    for scale in &attained.link_mass_scale {
        require_within("link_mass_scale", scale, [&(&one - share), &(&one + share)])?;
    }
    for (quantity, number, interval) in [
        ("payload_kg", &attained.payload_kg, &family.arms.payload_kg),
        ("rotor_inertia_kg_m2", &attained.rotor_inertia_kg_m2, &family.arms.rotor_inertia_kg_m2),
        ("friction_n_m_s_per_rad", &attained.friction_n_m_s_per_rad, &family.friction_hull()),
    ] {
        require_within(quantity, number, [interval[0].value(), interval[1].value()])?;
    }
    let same = attained.friction_n_m_s_per_rad.value() == point.friction_n_m_s_per_rad.value();
    require("friction_n_m_s_per_rad", &attained.friction_n_m_s_per_rad, same, "the friction of the point")?;
    let [real, imaginary] = &attained.eigenvalue_per_s;
    require_plain("eigenvalue_per_s", imaginary)?;
    require_plain("eigenvalue_per_s", real)?;
    require("eigenvalue_per_s", real, *real.value() >= -rate.value(), "a real part of at least minus the rate")
}
