//! What a number must be before anything is derived from it.

use num_rational::BigRational;
use num_traits::{Signed, Zero};

use crate::error::Flaw;
use crate::number::{Number, positive};

pub(crate) fn require(
    quantity: &'static str,
    number: &Number,
    holds: bool,
    expected: &'static str,
) -> Result<(), Flaw> {
    if holds { Ok(()) } else { Err(Flaw::Quantity { quantity, value: number.to_string(), expected }) }
}

pub(crate) fn require_length(quantity: &'static str, found: usize, expected: usize) -> Result<(), Flaw> {
    if found == expected { Ok(()) } else { Err(Flaw::Length { quantity, found, expected }) }
}

/// A number that stands in a statement: a decimal, and 0 or of a size that someone could mean.
pub(crate) fn require_plain(quantity: &'static str, number: &Number) -> Result<(), Flaw> {
    let size = number.value().abs();
    let thousand_billions = BigRational::from_integer(1_000_000_000_000_i64.into());
    let sensible = size.is_zero() || (size <= thousand_billions && size >= thousand_billions.recip());
    require(quantity, number, number.is_decimal() && sensible, "a decimal that is 0 or between 1e-12 and 1e12 in size")
}

pub(crate) fn require_positive(quantity: &'static str, number: &Number) -> Result<(), Flaw> {
    require_plain(quantity, number)?;
    require(quantity, number, positive(number.value()), "a positive number")
}

pub(crate) fn require_at_least_zero(quantity: &'static str, number: &Number) -> Result<(), Flaw> {
    require_plain(quantity, number)?;
    require(quantity, number, !number.value().is_negative(), "a number of at least 0")
}

/// Plain, ordered, and not negative.
pub(crate) fn require_interval(quantity: &'static str, [lower, upper]: &[Number; 2]) -> Result<(), Flaw> {
    require_at_least_zero(quantity, lower)?;
    require_plain(quantity, upper)?;
    require(quantity, upper, lower.value() <= upper.value(), "a largest value no smaller than the least")
}

/// Within the interval, to the rounding of a floating-point search.
pub(crate) fn require_within(
    quantity: &'static str,
    number: &Number,
    [lower, upper]: [&BigRational; 2],
) -> Result<(), Flaw> {
    require_plain(quantity, number)?;
    let rounding = BigRational::new(1.into(), 1_000_000_000_i64.into());
    let within = &(lower - &rounding) <= number.value() && number.value() <= &(upper + &rounding);
    require(quantity, number, within, "a number within the family's interval")
}

/// Exactly that many lower-case hexadecimal digits of a SHA-256.
pub(crate) fn require_sha256(quantity: &'static str, text: &str) -> Result<(), Flaw> {
    if text.len() == 64 && text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f')) {
        Ok(())
    } else {
        Err(Flaw::quantity(quantity, text, "64 lower-case hexadecimal digits"))
    }
}
