//! A number shared by all joints, or one for each.

use serde::de::{self, Deserializer, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::file::KeyError;

/// A number for every joint, or one that all joints share. Finite by construction of the reader.
#[derive(Clone, Debug, PartialEq)]
pub enum PerJoint {
    /// One number for all joints.
    Shared(f64),
    /// One number per joint, base to tip.
    Each(Vec<f64>),
}

impl PerJoint {
    /// One number per joint; `key` names the list in the error.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self, key: &str) -> Result<[f64; N], KeyError> {
        match self {
            Self::Shared(value) => Ok([*value; N]),
            Self::Each(values) => values.as_slice().try_into().map_err(|_| KeyError::per_joint(key, values.len(), N)),
        }
    }

    /// The numbers as written: one when shared.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Shared(value) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }

    /// The number that all joints share, also when it was written as a list of equal numbers.
    pub fn shared(&self) -> Option<f64> {
        let (first, rest) = self.values().split_first()?;
        rest.iter().all(|value| value.to_bits() == first.to_bits()).then_some(*first)
    }

    /// The number of a joint, counted from 0; none beyond the end of a list.
    pub fn of(&self, joint: usize) -> Option<f64> {
        match self {
            Self::Shared(value) => Some(*value),
            Self::Each(values) => values.get(joint).copied(),
        }
    }

    /// Every number as the shortest decimal that reads back as the same `f64`; see the module's text.
    pub fn decimals(&self) -> Vec<String> {
        self.values().iter().copied().map(decimal).collect()
    }
}

impl<const N: usize> From<[f64; N]> for PerJoint {
    /// Shared when all entries are equal to the bit.
    fn from(values: [f64; N]) -> Self {
        let each = Self::Each(values.to_vec());
        each.shared().map_or(each, Self::Shared)
    }
}

/// The shortest decimal, without an exponent, that reads back as `value`.
pub fn decimal(value: f64) -> String {
    format!("{value}")
}

impl Serialize for PerJoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Shared(value) => serializer.serialize_f64(*value),
            Self::Each(values) => values.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for PerJoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrList;
        impl<'de> Visitor<'de> for NumberOrList {
            type Value = PerJoint;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or a list of numbers, one per joint")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<PerJoint, E> {
                Finite::checked(value).map(|finite| PerJoint::Shared(finite.0))
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<PerJoint, E> {
                self.visit_f64(value as f64)
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<PerJoint, E> {
                self.visit_f64(value as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<PerJoint, A::Error> {
                let mut values = Vec::new();
                while let Some(Finite(value)) = entries.next_element()? {
                    values.push(value);
                }
                if values.is_empty() { Err(de::Error::invalid_length(0, &self)) } else { Ok(PerJoint::Each(values)) }
            }
        }
        deserializer.deserialize_any(NumberOrList)
    }
}

/// A number that is neither NaN nor infinite: TOML has words for both.
#[derive(Clone, Copy, Debug)]
struct Finite(f64);

impl Finite {
    fn checked<E: de::Error>(value: f64) -> Result<Self, E> {
        let refuse = || E::invalid_value(Unexpected::Float(value), &"a finite number");
        value.is_finite().then_some(Self(value)).ok_or_else(refuse)
    }
}

impl<'de> Deserialize<'de> for Finite {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        f64::deserialize(deserializer).and_then(Self::checked)
    }
}

pub(super) fn positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PerJoint, D::Error> {
    let numbers = PerJoint::deserialize(deserializer)?;
    match numbers.values().iter().find(|value| !(**value > 0.0)) {
        None => Ok(numbers),
        Some(value) => Err(de::Error::invalid_value(Unexpected::Float(*value), &"a positive number")),
    }
}

pub(super) fn non_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PerJoint, D::Error> {
    let numbers = PerJoint::deserialize(deserializer)?;
    match numbers.values().iter().find(|value| !(**value >= 0.0)) {
        None => Ok(numbers),
        Some(value) => Err(de::Error::invalid_value(Unexpected::Float(*value), &"a number, zero or above")),
    }
}
