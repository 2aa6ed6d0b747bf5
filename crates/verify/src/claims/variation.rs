//! One bound of a family moved, the rest unchanged: the margins of a claim that holds, the remedies of one that does not.

use num_traits::Zero;
use serde::{Deserialize, Serialize};

use super::{Figure, LoopBox, family_box};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::Number;
use crate::quantity::{require_at_least_zero, require_length};

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

impl Variation {
    /// The box of linearised loops of the family so changed.
    ///
    /// With rotor inertias from v up, `M >= (m_lo - r0 + v) I`, r0 being the family's least; above the family's largest, r1, the largest
    /// eigenvalue grows by at most `v - r1`.
    pub fn applied(&self, document: &Document) -> LoopBox {
        let mut range = family_box(document);
        let larger = |a: &Number, b: &Number| if a.value() < b.value() { b.clone() } else { a.clone() };
        let value = &self.value;
        match self.of {
            Quantity::LeastFriction => range.friction = [value.clone(), larger(value, &range.friction[1])],
            Quantity::LeastRotorInertia => {
                let [least, largest] = &document.family.arms.rotor_inertia_kg_m2;
                let zero = num_rational::BigRational::zero();
                let beyond = (value.value() - largest.value()).max(zero);
                let ends = [value.value() - least.value(), beyond];
                for (end, change) in range.inertia.iter_mut().zip(ends) {
                    *end = Number::exact(end.value() + change);
                }
            }
            Quantity::LargestInertia => range.inertia[1] = value.clone(),
            Quantity::LargestStiffness => range.stiffness = [value.negated(), value.clone()],
        }
        range
    }

    fn in_words(&self) -> String {
        let value = &self.value;
        match self.of {
            Quantity::LeastFriction => format!("viscous friction of at least {value} N m s/rad on every joint"),
            Quantity::LeastRotorInertia => format!("rotor inertia of at least {value} kg m^2 on every joint"),
            Quantity::LargestInertia => format!("inertia eigenvalues of at most {value} kg m^2"),
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

fn alternatives(variations: &[Variation]) -> String {
    variations.iter().map(Variation::in_words).collect::<Vec<_>>().join("; or with ")
}

/// The margins of a claim that holds, to be added to its sentence.
pub(crate) fn stays_stable(margins: &[Variation]) -> String {
    if margins.is_empty() {
        return String::new();
    }
    format!(
        "; it is still stable, at no certified rate, if one bound of the family is moved: with {}",
        alternatives(margins)
    )
}

/// The remedies of a claim that is not shown, to be added to its sentence.
pub(crate) fn would_be_stable(remedies: &[Variation]) -> String {
    if remedies.is_empty() {
        return String::new();
    }
    format!(
        " If the stated constants hold, every linearised loop would be stable, the rest of the family unchanged, with {}.",
        alternatives(remedies)
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
