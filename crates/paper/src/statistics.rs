//! Quantiles, and a paired test that assumes nothing about the distribution.
//!
//! **Sign test.** The same arms meet two controllers; `better` of `n` untied arms favour the first. If neither were better, `better` would be binomial with 1/2, so
//!
//! ```text
//! p = min(1, 2 P(X <= min(better, worse))),   P(X <= k) = sum_{i <= k} C(n, i) / 2^n
//! ```
//!
//! is the chance of a result at least as lopsided, two-sided, exact up to rounding; ties do not count. An arm on which a controller has no figure (it did not settle, it ran away) is worse than any number, so
//! no arm is left out. Source: Conover, *Practical Nonparametric Statistics* (1999), ch. 3. Limits: the size of a difference does not matter, only its sign; beyond 1000 untied arms the sum starts below the least `f64`.

use core::cmp::Ordering;

/// The quantile `share` of numbers, interpolated between neighbours (Hyndman and Fan's type 7); none for no numbers.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    Some(low + (place - below as f64) * (high - low))
}

/// How many arms favour either side, and the exact p-value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignTest {
    /// Arms on which the first is lower.
    pub first: usize,
    /// Arms on which the second is lower.
    pub second: usize,
    /// Arms on which both are equal.
    pub ties: usize,
    /// Two-sided.
    pub p_value: f64,
}

/// Compares pairs; a missing number is above every number.
pub fn sign_test(pairs: impl IntoIterator<Item = (Option<f64>, Option<f64>)>) -> SignTest {
    let (mut first, mut second, mut ties) = (0, 0, 0);
    for (a, b) in pairs {
        match a.unwrap_or(f64::INFINITY).total_cmp(&b.unwrap_or(f64::INFINITY)) {
            Ordering::Less => first += 1,
            Ordering::Greater => second += 1,
            Ordering::Equal => ties += 1,
        }
    }
    SignTest { first, second, ties, p_value: p_value(first, second) }
}

fn p_value(first: usize, second: usize) -> f64 {
    let n = first + second;
    // C(n, 0) / 2^n, C(n, 1) / 2^n, ..: each from the one before.
    let mut term = 0.5_f64.powi(i32::try_from(n).unwrap_or(i32::MAX));
    let mut tail = 0.0;
    for i in 0..=first.min(second) {
        tail += term;
        term *= (n - i) as f64 / (i + 1) as f64;
    }
    (2.0 * tail).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn test(first: usize, second: usize) -> SignTest {
        let pairs = (0..first).map(|_| (Some(1.0), Some(2.0))).chain((0..second).map(|_| (Some(2.0), Some(1.0))));
        sign_test(pairs)
    }

    #[test]
    fn p_values_are_those_of_the_tables() {
        // Two-sided, from tables of the binomial distribution with 1/2.
        let known = [
            (9, 1, 22.0 / 1024.0),
            (8, 2, 112.0 / 1024.0),
            (5, 0, 0.0625),
            (6, 0, 0.03125),
            (15, 5, 0.041_389_465_332_031_25),
        ];
        for (first, second, p_value) in known {
            for found in [test(first, second), test(second, first)] {
                assert!((found.p_value - p_value).abs() < 1e-14, "{found:?}, expected {p_value}");
            }
        }
        assert!((test(4, 4).p_value - 1.0).abs() < 1e-15 && (test(0, 0).p_value - 1.0).abs() < 1e-15);
        assert!((test(200, 0).p_value - 2.0_f64.powi(-199)).abs() < 1e-70);
    }

    #[test]
    fn who_has_no_figure_has_lost_and_ties_do_not_count() {
        let found = sign_test([(Some(1e300), None), (None, None), (Some(1.0), Some(1.0)), (None, Some(0.0))]);
        assert_eq!((found.first, found.second, found.ties), (1, 1, 2));
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [4.0, 1.0, 3.0, 2.0];
        for (share, expected) in [(0.0, 1.0), (1.0, 4.0), (0.5, 2.5), (0.25, 1.75)] {
            assert!((quantile(&values, share).unwrap() - expected).abs() < 1e-15);
        }
        assert_eq!(quantile(&[], 0.5), None);
    }

    proptest! {
        #[test]
        fn the_test_is_symmetric_and_a_probability(first in 0_usize..300, second in 0_usize..300) {
            let (one, other) = (test(first, second), test(second, first));
            prop_assert_eq!(one.p_value.to_bits(), other.p_value.to_bits());
            prop_assert!((0.0..=1.0).contains(&one.p_value));
        }
    }
}
