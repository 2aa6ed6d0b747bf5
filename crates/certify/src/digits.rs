//! Figures as a person reads them, rounded to the side that is safe.

use certune_verify::Number;

/// A rate of three digits, so that it can be read.
pub(crate) fn readable(rate: f64) -> f64 {
    format!("{rate:.2e}").parse().unwrap_or(rate)
}

/// Four digits, rounded down.
pub(crate) fn down(x: f64) -> Option<Number> {
    digits(x, f64::floor)
}

/// Four digits, rounded up.
pub(crate) fn above(x: f64) -> Option<Number> {
    digits(x, f64::ceil)
}

fn digits(x: f64, round: fn(f64) -> f64) -> Option<Number> {
    if !(x > 0.0 && x.is_finite()) {
        return None;
    }
    let decade = x.log10().floor() as i32 - 3;
    let text = format!("{:.0}e{decade}", round(x / 10_f64.powi(decade)));
    Number::decimal(text.parse().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_rounded_to_their_side() {
        assert_eq!(down(0.123_456).map(|x| x.to_string()), Some("0.1234".to_owned()));
        assert_eq!(above(0.123_456).map(|x| x.to_string()), Some("0.1235".to_owned()));
        assert_eq!(above(98_765.4).map(|x| x.to_string()), Some("98770".to_owned()));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(down(bad), None);
        }
    }
}
