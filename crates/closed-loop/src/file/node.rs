//! TOML values as `serde` visits them, and the error on its way up from where it was noticed.

use std::ops::Range;

use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeSeed, IntoDeserializer, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use toml::Spanned;
use toml::de::DeValue;

use super::{Problem, nearest};

/// An error on its way up: its place is completed by the containers it passes.
#[derive(Debug)]
pub(super) struct Fault {
    pub span: Option<Range<usize>>,
    pub key: String,
    pub problem: Problem,
}

impl Fault {
    fn of(problem: Problem) -> Self {
        Self { span: None, key: String::new(), problem }
    }

    /// The same fault, seen from the container that holds it under `step` (a key, or `[index]`).
    pub fn under(self, step: &str, span: Range<usize>) -> Self {
        let separator = if self.key.is_empty() || self.key.starts_with('[') { "" } else { "." };
        Self { span: self.span.or(Some(span)), key: format!("{step}{separator}{}", self.key), problem: self.problem }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.key, self.problem)
    }
}

impl std::error::Error for Fault {}

impl de::Error for Fault {
    fn custom<T: std::fmt::Display>(reason: T) -> Self {
        Self::of(Problem::Rejected { reason: reason.to_string() })
    }
    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::of(Problem::WrongType { found: found.to_string(), expected: expected.to_string() })
    }
    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::of(Problem::OutOfRange { found: found.to_string(), expected: expected.to_string() })
    }
    fn invalid_length(found: usize, expected: &dyn de::Expected) -> Self {
        Self::of(Problem::Length { found, expected: expected.to_string() })
    }
    fn unknown_variant(found: &str, expected: &'static [&'static str]) -> Self {
        let nearest = nearest(found, expected.iter().copied()).map(str::to_owned);
        let expected = expected.iter().map(|&word| word.to_owned()).collect();
        Self::of(Problem::UnknownName { found: found.to_owned(), nearest, expected })
    }
    fn unknown_field(found: &str, expected: &'static [&'static str]) -> Self {
        let nearest = nearest(found, expected.iter().copied()).map(str::to_owned);
        let expected = expected.iter().map(|&word| word.to_owned()).collect();
        Self { span: None, key: found.to_owned(), problem: Problem::UnknownKey { nearest, expected } }
    }
    fn missing_field(field: &'static str) -> Self {
        Self { span: None, key: field.to_owned(), problem: Problem::MissingKey }
    }
    fn duplicate_field(field: &'static str) -> Self {
        Self { span: None, key: field.to_owned(), problem: Problem::DuplicateKey }
    }
}

/// One value of the file together with its place, as `serde` visits it.
pub(super) struct Node<'t, 'i> {
    pub value: &'t DeValue<'i>,
    pub span: Range<usize>,
}

impl<'de, 't, 'i> de::Deserializer<'de> for Node<'t, 'i> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        let result = match self.value {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(digits) => match i64::from_str_radix(digits.as_str(), digits.radix()) {
                Ok(number) => visitor.visit_i64(number),
                Err(_) => Err(de::Error::invalid_value(Unexpected::Other(digits.as_str()), &"an integer of 64 bits")),
            },
            DeValue::Float(decimal) => match decimal.as_str().parse::<f64>() {
                Ok(number) => visitor.visit_f64(number),
                Err(_) => Err(de::Error::invalid_value(Unexpected::Other(decimal.as_str()), &"a number")),
            },
            DeValue::Boolean(flag) => visitor.visit_bool(*flag),
            DeValue::Datetime(_) => Err(de::Error::invalid_type(Unexpected::Other("a datetime"), &visitor)),
            DeValue::Array(entries) => visitor.visit_seq(Entries { entries: entries.iter().enumerate() }),
            DeValue::Table(table) => visitor.visit_map(Keys { keys: table.iter(), value: None }),
        };
        result.map_err(|fault| Fault { span: fault.span.or(Some(self.span)), ..fault })
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_some(self) // TOML has no null: a key that is there has a value
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let span = self.span;
        match self.value {
            DeValue::String(text) => {
                let word: StrDeserializer<'_, Fault> = text.as_ref().into_deserializer();
                visitor.visit_enum(word).map_err(|fault| Fault { span: fault.span.or(Some(span)), ..fault })
            }
            other => {
                let fault: Fault = de::Error::invalid_type(Unexpected::Other(other.type_str()), &visitor);
                Err(Fault { span: Some(span), ..fault })
            }
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

struct Entries<'t, 'i> {
    entries: std::iter::Enumerate<std::slice::Iter<'t, Spanned<DeValue<'i>>>>,
}

impl<'de> SeqAccess<'de> for Entries<'_, '_> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Fault> {
        let Some((index, entry)) = self.entries.next() else { return Ok(None) };
        seed.deserialize(Node { value: entry.get_ref(), span: entry.span() })
            .map(Some)
            .map_err(|fault| fault.under(&format!("[{index}]"), entry.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.entries.len())
    }
}

struct Keys<'t, 'i, I: Iterator<Item = (&'t Spanned<toml::de::DeString<'i>>, &'t Spanned<DeValue<'i>>)>>
where
    'i: 't,
{
    keys: I,
    value: Option<(&'t Spanned<toml::de::DeString<'i>>, &'t Spanned<DeValue<'i>>)>,
}

impl<'de, 't, 'i: 't, I> MapAccess<'de> for Keys<'t, 'i, I>
where
    I: Iterator<Item = (&'t Spanned<toml::de::DeString<'i>>, &'t Spanned<DeValue<'i>>)>,
{
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Fault> {
        let Some((key, value)) = self.keys.next() else { return Ok(None) };
        self.value = Some((key, value));
        let word: StrDeserializer<'_, Fault> = key.get_ref().as_ref().into_deserializer();
        seed.deserialize(word).map(Some).map_err(|fault| Fault { span: Some(key.span()), ..fault })
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        match self.value.take() {
            Some((key, value)) => seed
                .deserialize(Node { value: value.get_ref(), span: value.span() })
                .map_err(|fault| fault.under(key.get_ref(), value.span())),
            // A visitor that asks for a value before its key: serde's derived ones never do.
            None => Err(de::Error::custom("a value was asked for before its key")),
        }
    }
}
