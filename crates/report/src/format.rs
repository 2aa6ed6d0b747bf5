//! Numbers as a reader wants them: three significant digits, a real minus sign, no `e-05`.

/// What stands for a number that does not exist.
pub(crate) const MISSING: &str = "–";

const DIGITS: i32 = 3;

/// A chosen number is shown as written up to this many letters.
const LONGEST_CHOSEN: usize = 5;

/// Three significant digits; scientific notation below a thousandth and from a hundred thousand on.
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() {
        return MISSING.to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    // One rounding, done by the formatter in base ten: 9.996 becomes 1.00e1, never "10.00".
    let scientific = format!("{value:.*e}", (DIGITS - 1) as usize);
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let Ok(exponent) = exponent.parse::<i32>() else { return scientific };
    if value.abs() < f64::MIN_POSITIVE {
        return "0".to_owned();
    }
    if (-3..5).contains(&exponent) {
        let decimals = (DIGITS - 1 - exponent).max(0) as usize;
        // Digits beyond the third become zeros: 12345 is 12300.
        let rounded: f64 = scientific.parse().unwrap_or(value);
        return minus(&format!("{rounded:.decimals$}"));
    }
    format!("{} × 10{}", minus(mantissa), superscript(exponent))
}

/// [`number`], or a dash.
pub(crate) fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| MISSING.to_owned(), number)
}

/// A number with its unit, which may be empty; the space between does not break.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() || value.is_nan() { number(value) } else { format!("{}\u{a0}{unit}", number(value)) }
}

/// The largest number of three significant digits that is not above a positive `value`; other numbers as they are.
pub(crate) fn rounded_down(value: f64) -> f64 {
    if !(value > 0.0 && value.is_finite()) {
        return value;
    }
    // The exponent of the value, not of its neighbour above: 0.9999 is 9.999e-1.
    let exact = format!("{value:e}");
    let exponent = exact.split_once('e').and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    let nearest = format!("{value:.*e}", (DIGITS - 1) as usize).parse::<f64>();
    match (nearest, exponent) {
        (Ok(above), Some(exponent)) if above > value => above - 10_f64.powi(exponent - DIGITS + 1),
        (Ok(below), _) => below,
        (Err(_), _) => value,
    }
}

/// A certified number with its unit, rounded down: the figure above it would be a claim that nobody has proved.
pub(crate) fn certified(value: f64, unit: &str) -> String {
    with_unit(rounded_down(value), unit)
}

/// Label of a tick: as many decimals as the distance to the next tick needs.
pub(crate) fn tick(value: f64, step: f64) -> String {
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".to_owned() } else { minus(&text) }
}

/// A power of ten.
pub(crate) fn decade(exponent: i32) -> String {
    if exponent == 0 { "1".to_owned() } else { format!("10{}", superscript(exponent)) }
}

/// A number that somebody chose: as it was written when that is short, otherwise [`number`].
pub(crate) fn chosen(value: f64) -> String {
    let written = format!("{value}");
    if value.is_finite() && written.len() <= LONGEST_CHOSEN { minus(&written) } else { number(value) }
}

/// The first letter as a capital.
pub(crate) fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

fn minus(text: &str) -> String {
    text.replacen('-', "−", 1)
}

fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '0' => '⁰',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            other => other,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certified_number_is_never_rounded_up() {
        for (value, shown) in
            [(0.2625, "0.262"), (0.58, "0.580"), (1.0, "1.00"), (0.9999, "0.999"), (12.345, "12.3"), (1999.6, "1990")]
        {
            assert_eq!(number(rounded_down(value)), shown);
            assert!(rounded_down(value) <= value * (1.0 + f64::EPSILON));
        }
    }

    #[test]
    fn numbers_carry_three_significant_digits() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (std::f64::consts::PI, "3.14"),
            (-2.2, "−2.20"),
            (700.0, "700"),
            (12345.0, "12300"),
            (9.996, "10.0"),
            (99_960.0, "1.00 × 10⁵"),
            (0.00123, "0.00123"),
            (0.000_999_6, "0.00100"),
            (4.4e-5, "4.40 × 10⁻⁵"),
            (-1.5e12, "−1.50 × 10¹²"),
            (f64::NAN, "–"),
            (f64::INFINITY, "∞"),
            (f64::NEG_INFINITY, "−∞"),
        ] {
            assert_eq!(number(value), text, "{value:e}");
        }
        assert_eq!(optional(None), "–");
        assert_eq!(chosen(11.67), "11.67");
        assert_eq!(chosen(0.05), "0.05");
        assert_eq!(chosen(-2.0), "−2");
        assert_eq!(chosen(23.414_2), "23.4");
        assert_eq!(chosen(f64::NAN), "–");
        assert_eq!(with_unit(3.1, "s"), "3.10\u{a0}s");
        assert_eq!(with_unit(f64::NAN, "s"), "–");
    }

    #[test]
    fn ticks_carry_the_decimals_of_their_distance() {
        assert_eq!(tick(0.5, 0.5), "0.5");
        assert_eq!(tick(1.0, 0.5), "1.0");
        assert_eq!(tick(0.0, 0.5), "0");
        assert_eq!(tick(-1e-17, 0.2), "0");
        assert_eq!(tick(-20.0, 10.0), "−20");
        assert_eq!(tick(0.001, 0.001), "0.001");
        assert_eq!(tick(1000.0, 1000.0), "1000");
        assert_eq!(decade(-5), "10⁻⁵");
    }
}
