//! Quantiles over arms of which some did not finish.

/// The smallest value that the given part of the arms does not exceed; a run that did not finish exceeds every value.
pub(crate) fn quantile(values: &[Option<f64>], part: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().map(|value| value.unwrap_or(f64::INFINITY)).collect();
    sorted.sort_by(f64::total_cmp);
    let rank = (part * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied().filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diverged_arm_is_worse_than_every_cost() {
        let costs = [Some(3.0), None, Some(1.0), Some(2.0)];
        assert_eq!(quantile(&costs, 0.0), Some(1.0));
        assert_eq!(quantile(&costs, 0.5), Some(2.0));
        assert_eq!(quantile(&costs, 1.0), None);
        assert_eq!(quantile(&[], 0.5), None);
    }
}
