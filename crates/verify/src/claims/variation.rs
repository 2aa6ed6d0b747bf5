//! One bound of a family moved, the rest unchanged: the margins of a claim that holds, the remedies of one that does not.

use num_traits::Zero;
use serde::{Deserialize, Serialize};

use super::{Figure, LoopBox, LoopTiming, family_box};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::Number;
use crate::quantity::{require_at_least_zero, require_length};
use crate::statement::range;

/// A bound of the family that a linearised loop's stability depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// The least viscous friction of every joint, N m s/rad.
    LeastFriction,
    /// The least rotor inertia of every joint, kg m^2.
    LeastRotorInertia,
    /// The largest eigenvalue of the inertia matrix, kg m^2.
    LargestInertia,
    /// The largest gravity stiffness, N m/rad.
    LargestStiffness,
}

/// A bound of the family with another value; the loops of the family so changed are stable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variation {
    /// Which bound.
    pub of: Quantity,
    /// Its new value.
    pub value: Number,
}

/// From the value to the largest there was, or the value alone when there was none as large.
fn from_value(value: &Number, largest: &Number) -> [Number; 2] {
    let upper = if value.value() < largest.value() { largest } else { value };
    [value.clone(), upper.clone()]
}

impl Variation {
    /// The box of linearised loops of the family so changed.
    ///
    /// With rotor inertias from v up, `M >= (m_lo - r0 + v) I`, r0 being the family's least; above the family's largest, r1, the largest
    /// eigenvalue grows by at most `v - r1`.
    pub fn applied(&self, document: &Document) -> LoopBox {
        let mut loops = family_box(document);
        let value = &self.value;
        match self.of {
            Quantity::LeastFriction => loops.friction = from_value(value, &loops.friction[1]),
            Quantity::LeastRotorInertia => {
                let [least, largest] = &document.family.arms.rotor_inertia_kg_m2;
                let zero = num_rational::BigRational::zero();
                let beyond = (value.value() - largest.value()).max(zero);
                let ends = [value.value() - least.value(), beyond];
                for (end, change) in loops.inertia.iter_mut().zip(ends) {
                    *end = Number::exact(end.value() + change);
                }
            }
            Quantity::LargestInertia => loops.inertia[1] = value.clone(),
            Quantity::LargestStiffness => loops.stiffness = [value.negated(), value.clone()],
        }
        loops
    }

    /// The interval that is checked, both ends: nothing is said beyond them.
    fn in_words(&self, document: &Document) -> String {
        let value = &self.value;
        match self.of {
            Quantity::LeastFriction => {
                let [_, largest] = document.family.friction_hull();
                format!("viscous friction of {} N m s/rad on every joint", range(&from_value(value, &largest)))
            }
            Quantity::LeastRotorInertia => {
                let [_, largest] = &document.family.arms.rotor_inertia_kg_m2;
                format!("rotor inertia of {} kg m^2 on every joint", range(&from_value(value, largest)))
            }
            Quantity::LargestInertia => {
                let least = document.constants.bounds.m_lo_kg_m2.clone();
                format!("inertia eigenvalues of {} kg m^2", range(&[least, value.clone()]))
            }
            Quantity::LargestStiffness => format!("gravity stiffness of at most {value} N m/rad"),
        }
    }

    pub(crate) fn figure(&self) -> Figure {
        let (name, unit) = match self.of {
            Quantity::LeastFriction => ("least friction", "N m s/rad"),
            Quantity::LeastRotorInertia => ("least rotor inertia", "kg m^2"),
            Quantity::LargestInertia => ("largest inertia", "kg m^2"),
            Quantity::LargestStiffness => ("largest gravity stiffness", "N m/rad"),
        };
        Figure { name, value: self.value.clone(), unit }
    }
}

fn alternatives(document: &Document, variations: &[Variation]) -> String {
    variations.iter().map(|variation| variation.in_words(document)).collect::<Vec<_>>().join("; or with ")
}

/// The margins of a claim that holds, at the delays stated, to be added to its sentence.
pub(crate) fn stays_stable(document: &Document, margins: &[Variation], delays: Option<&str>) -> String {
    if margins.is_empty() {
        return String::new();
    }
    let delays = delays.map(|delays| format!("with {delays} ")).unwrap_or_default();
    format!(
        "; {delays}it is still stable, at no certified rate, if one bound of the family is moved: with {}",
        alternatives(document, margins)
    )
}

/// The remedies of a claim that is not shown, at the delays of its sampling, to be added to its sentence.
pub(crate) fn would_be_stable(document: &Document, remedies: &[Variation], sampling: Option<&LoopTiming>) -> String {
    if remedies.is_empty() {
        return String::new();
    }
    let sampled = sampling.map(|s| format!(", so sampled and with {},", s.delays(&s.delay_s))).unwrap_or_default();
    format!(
        " If the stated constants hold, every linearised loop{sampled} would be stable, the rest of the family unchanged, with {}.",
        alternatives(document, remedies)
    )
}

/// Checks that the loops of every family so changed are stable.
pub(crate) fn varied(
    document: &Document,
    variations: &[Variation],
    stable: &dyn Fn(&LoopBox) -> Result<(), Flaw>,
) -> Result<(), Flaw> {
    const MOST: usize = 4;
    if variations.len() > MOST {
        return require_length("variations", variations.len(), MOST);
    }
    variations.iter().try_for_each(|variation| {
        require_at_least_zero("variation", &variation.value)?;
        stable(&variation.applied(document))
    })
}
