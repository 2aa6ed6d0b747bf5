//! Numbers as they are written in a certificate, and the rationals they are.
//!
//! Two spellings: a decimal as a person writes it (`11.67`, `-2.5e-3`), and, for the numbers of a proof only, a dyadic
//! `mantissa p exponent` meaning `mantissa * 2^exponent` (`-4503599627370497p-52`), which is what a floating-point number is exactly. A
//! decimal is canonical (no leading zeros, no `-0`, no plus sign). Digits and exponents are bounded, so that a hostile file can ask neither for a
//! number that fills the memory nor for one that a reader mistakes.

use core::fmt;
use core::str::FromStr;

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::float::FloatCore;
use num_traits::{One, Pow, ToPrimitive, Zero};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

const MAX_CHARS: usize = 48;
const MAX_DIGITS: usize = 20;
const MAX_DECIMAL_EXPONENT: i32 = 30;
/// The least positive `f64` is 2^-1074.
const MAX_DYADIC_EXPONENT: i32 = 1100;

/// Why a text is no number of a certificate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is no exact number: expected a decimal such as 11.67 or a dyadic such as -3p-4")]
pub struct NumberError {
    /// The text, shortened when it is long.
    pub text: String,
}

/// An exact rational number that remembers how it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Number {
    text: String,
    value: BigRational,
}

impl Number {
    /// The shortest decimal that reads back as `x`, taken as exact. `None` unless `x` is 0 or of a size from 1e-30 to 1e30.
    ///
    /// For a number a person wrote with at most 15 digits this is the number they wrote.
    pub fn decimal(x: f64) -> Option<Self> {
        let size = x.abs();
        if size == 0.0 {
            return Some(Self::zero());
        }
        let text = if (1e-6..1e15).contains(&size) { format!("{x}") } else { format!("{x:e}") };
        text.parse().ok()
    }

    /// `x` itself, as a dyadic rational. `None` unless `x` is finite.
    pub fn dyadic(x: f64) -> Option<Self> {
        if !x.is_finite() {
            return None;
        }
        let (mantissa, exponent, sign) = x.integer_decode();
        let twos = mantissa.trailing_zeros().min(63);
        let mantissa = i64::try_from(mantissa >> twos).ok()? * i64::from(sign);
        let power = if mantissa == 0 { 0 } else { i32::from(exponent) + i32::try_from(twos).ok()? };
        Some(Self { text: format!("{mantissa}p{power}"), value: scaled_by_twos(mantissa.into(), power) })
    }

    /// The decimal of a rational. `None` when it has none that fits a certificate.
    pub fn decimal_of(value: BigRational) -> Option<Self> {
        Self::exact(value).text.parse().ok()
    }

    /// 0.
    pub fn zero() -> Self {
        Self { text: "0".to_owned(), value: BigRational::zero() }
    }

    /// A number derived from others, written as a decimal when it has a finite one and as a fraction for the eye when not: such a number is computed
    /// with and printed, never read.
    pub(crate) fn exact(value: BigRational) -> Self {
        let mut scaled = value.clone();
        let mut places = 0;
        while !scaled.is_integer() && places < MAX_CHARS {
            scaled *= BigRational::from_integer(10.into());
            places += 1;
        }
        let text = if scaled.is_integer() {
            let digits = format!("{:0>width$}", scaled.numer().magnitude(), width = places + 1);
            let (whole, fraction) = digits.split_at(digits.len() - places);
            let sign = if value < BigRational::zero() { "-" } else { "" };
            let point = if fraction.is_empty() { "" } else { "." };
            format!("{sign}{whole}{point}{fraction}")
        } else {
            value.to_string()
        };
        Self { text, value }
    }

    /// The number with the other sign.
    pub(crate) fn negated(&self) -> Self {
        if self.value.is_zero() {
            return Self::zero();
        }
        let text = match self.text.strip_prefix('-') {
            Some(positive) => positive.to_owned(),
            None => format!("-{}", self.text),
        };
        Self { text, value: -self.value.clone() }
    }

    /// Whether it is spelled as a decimal.
    pub(crate) fn is_decimal(&self) -> bool {
        !self.text.contains('p')
    }

    /// The value.
    pub fn value(&self) -> &BigRational {
        &self.value
    }

    /// The nearest `f64`, for printing and plotting only.
    pub fn to_f64(&self) -> f64 {
        self.value.to_f64().unwrap_or(f64::NAN)
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Digits with an optional leading minus; no plus, no blanks, no empty text.
fn integer(text: &str) -> Option<BigInt> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    if digits.is_empty() || !digits.bytes().all(|c| c.is_ascii_digit()) {
        return None;
    }
    text.parse().ok()
}

fn exponent(text: &str, most: i32) -> Option<i32> {
    let e = integer(text)?.to_i32()?;
    (e.unsigned_abs() <= most.unsigned_abs()).then_some(e)
}

fn scaled_by_tens(mantissa: BigInt, exponent: i32) -> BigRational {
    let power = Pow::pow(BigInt::from(10), exponent.unsigned_abs());
    if exponent >= 0 { BigRational::from_integer(mantissa * power) } else { BigRational::new(mantissa, power) }
}

/// `mantissa * 2^exponent` without a search for common factors, which can only be twos.
fn scaled_by_twos(mantissa: BigInt, exponent: i32) -> BigRational {
    if exponent >= 0 {
        return BigRational::from_integer(mantissa << exponent.unsigned_abs());
    }
    let common = mantissa
        .trailing_zeros()
        .map_or(exponent.unsigned_abs(), |twos| exponent.unsigned_abs().min(u32::try_from(twos).unwrap_or(u32::MAX)));
    BigRational::new_raw(mantissa >> common, BigInt::one() << (exponent.unsigned_abs() - common))
}

fn parse(text: &str) -> Option<BigRational> {
    if text.len() > MAX_CHARS {
        return None;
    }
    if let Some((mantissa, power)) = text.split_once('p') {
        return Some(scaled_by_twos(integer(mantissa)?, exponent(power, MAX_DYADIC_EXPONENT)?));
    }
    let (mantissa, power) = match text.split_once('e') {
        Some((mantissa, power)) => (mantissa, exponent(power, MAX_DECIMAL_EXPONENT)?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, "0"));
    let unsigned = whole.strip_prefix('-').unwrap_or(whole);
    let leading_zero = unsigned.len() > 1 && unsigned.starts_with('0');
    if leading_zero || fraction.is_empty() || !fraction.bytes().all(|c| c.is_ascii_digit()) {
        return None;
    }
    integer(whole)?;
    let digits = integer(&format!("{whole}{fraction}"))?;
    let significant = digits.to_string().trim_start_matches('-').trim_end_matches('0').len();
    if significant > MAX_DIGITS || (digits.is_zero() && text.starts_with('-')) {
        return None;
    }
    Some(scaled_by_tens(digits, power - i32::try_from(fraction.len()).ok()?))
}

impl FromStr for Number {
    type Err = NumberError;

    fn from_str(text: &str) -> Result<Self, NumberError> {
        match parse(text) {
            Some(value) => Ok(Self { text: text.to_owned(), value }),
            None => Err(NumberError { text: text.chars().take(40).collect() }),
        }
    }
}

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// The rational `numerator / denominator` of two small integers.
pub(crate) fn ratio(numerator: i64, denominator: i64) -> BigRational {
    BigRational::new(numerator.into(), denominator.into())
}

/// `0 < x`, spelled for rationals.
pub(crate) fn positive(x: &BigRational) -> bool {
    x > &BigRational::zero()
}

/// `x` in `[0, 1]`.
pub(crate) fn unit_interval(x: &BigRational) -> bool {
    *x >= BigRational::zero() && *x <= BigRational::one()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str) -> BigRational {
        text.parse::<Number>().unwrap().value().clone()
    }

    #[test]
    fn decimals_are_exact() {
        assert_eq!(value("0.1"), ratio(1, 10));
        assert_eq!(value("-2.50e-1"), ratio(-1, 4));
        assert_eq!(value("-0.5"), ratio(-1, 2));
        assert_eq!(value("11.67"), ratio(1167, 100));
        assert_eq!(value("3e2"), ratio(300, 1));
        assert_eq!(value("-3p-4"), ratio(-3, 16));
    }

    #[test]
    fn what_is_no_number_is_refused() {
        let long = "1".repeat(500);
        let refused = "- .5 5. 1e 1e31 1e99999 1e-2147483648 1p-2147483648 1e+3 1e+-3 0x1 NaN inf +1 1p --1 1.-5 1.5p3 1e2e3 007 -0 -0.0 00.5 1E5";
        for text in refused.split(' ').chain(["", "1 ", "0.1234567890123456789012", &long]) {
            assert!(text.parse::<Number>().is_err(), "{text}");
        }
    }

    proptest! {
        #[test]
        fn a_dyadic_is_the_float_itself(x in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            let n = Number::dyadic(x).unwrap();
            prop_assert_eq!(n.value().clone(), BigRational::from_float(x).unwrap());
            prop_assert_eq!(n.to_string().parse::<Number>().unwrap(), n);
        }

        #[test]
        fn a_dyadic_is_in_lowest_terms(mantissa in any::<i64>(), twos in 0_u32..40, power in -1100_i32..1100) {
            let mantissa = mantissa >> twos << twos;
            let n = format!("{mantissa}p{power}").parse::<Number>().unwrap();
            let two = BigRational::from_integer(2.into());
            let expected = BigRational::from_integer(mantissa.into()) * two.pow(power);
            // Equality alone would cancel first.
            prop_assert_eq!((n.value().numer(), n.value().denom()), (expected.numer(), expected.denom()));
        }

        #[test]
        fn the_shortest_decimal_reads_back(x in -1e9..1e9_f64) {
            prop_assert_eq!(Number::decimal(x).unwrap().to_f64().to_bits(), x.to_bits());
        }

        #[test]
        fn no_text_panics(text in ".{0,40}") {
            let _ = text.parse::<Number>();
        }
    }
}
