//! The strategy parameters, with their default values.
//!
//! Equation numbers are those of N. Hansen, "The CMA Evolution Strategy: A
//! Tutorial", arXiv:1604.00772, appendix A, table 1.

use serde::{Deserialize, Serialize};

/// The strategy parameters of a run in `n` dimensions with population `lambda`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// λ, the number of points in a generation (48).
    pub lambda: usize,
    /// μ = ⌊λ/2⌋, the number of points with positive weights.
    pub mu: usize,
    /// w₁ ≥ … ≥ w_λ, the recombination weights, negative after μ (53).
    pub weights: Vec<f64>,
    /// μ_eff, the variance effective selection mass of the positive weights.
    pub mu_eff: f64,
    /// c_m, the learning rate of the mean (54).
    pub c_m: f64,
    /// c_σ, the rate of the cumulation for the step size (55).
    pub c_sigma: f64,
    /// d_σ, the damping of the step size (55).
    pub d_sigma: f64,
    /// c_c, the rate of the cumulation for the rank-one update (56).
    pub c_c: f64,
    /// c_1, the learning rate of the rank-one update (57).
    pub c_1: f64,
    /// c_μ, the learning rate of the rank-μ update (58).
    pub c_mu: f64,
    /// E‖N(0, I)‖, the expected length of a standard normal vector.
    pub chi_n: f64,
}

impl Parameters {
    /// λ = 4 + ⌊3 ln n⌋ (48).
    pub fn default_lambda(n: usize) -> usize {
        4 + (3.0 * (n as f64).ln()).floor() as usize
    }

    /// The generations granted to a run: 100 + 50 (n + 3)² / √λ.
    ///
    /// N. Hansen, "Benchmarking a BI-population CMA-ES on the BBOB-2009
    /// function testbed", GECCO 2009 workshops.
    pub fn max_iterations(n: usize, lambda: usize) -> u64 {
        (100.0 + 50.0 * (n as f64 + 3.0).powi(2) / (lambda as f64).sqrt()) as u64
    }

    /// The default parameters; `n` is at least 1 and `lambda` at least 2.
    pub fn new(n: usize, lambda: usize) -> Parameters {
        let mu = lambda / 2;
        let n = n as f64;

        // w'_i = ln((λ + 1) / 2) − ln i  (49)
        let middle = (lambda as f64 + 1.0) / 2.0;
        let raw: Vec<f64> = (1..=lambda).map(|i| middle.ln() - (i as f64).ln()).collect();
        let (better, worse) = raw.split_at(mu);
        let mu_eff = selection_mass(better);
        let mu_eff_minus = selection_mass(worse);

        let alpha_cov = 2.0;
        // (57), (58)
        let c_1 = alpha_cov / ((n + 1.3).powi(2) + mu_eff);
        let c_mu = (alpha_cov * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((n + 2.0).powi(2) + alpha_cov * mu_eff / 2.0))
            .min(1.0 - c_1);

        // (50), (51), (52): what the negative weights may sum up to.
        let alpha_mu = 1.0 + c_1 / c_mu;
        let alpha_mu_eff = 1.0 + 2.0 * mu_eff_minus / (mu_eff + 2.0);
        let alpha_pos_def = (1.0 - c_1 - c_mu) / (n * c_mu);
        let alpha = alpha_mu.min(alpha_mu_eff).min(alpha_pos_def);

        // (53)
        let sum = |keep: fn(f64) -> bool| -> f64 { raw.iter().filter(|w| keep(**w)).map(|w| w.abs()).sum() };
        let positive = sum(|w| w > 0.0);
        let negative = sum(|w| w < 0.0);
        let weights = raw.iter().map(|&w| if w < 0.0 { alpha * w / negative } else { w / positive });

        // (55)
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let excess = ((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0;
        let d_sigma = 1.0 + 2.0 * excess.max(0.0) + c_sigma;

        Parameters {
            lambda,
            mu,
            weights: weights.collect(),
            mu_eff,
            c_m: 1.0,
            c_sigma,
            d_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu,
            chi_n: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

/// (Σ w)² / Σ w², the number of equal weights that would average as well.
fn selection_mass(weights: &[f64]) -> f64 {
    let sum: f64 = weights.iter().sum();
    let squares: f64 = weights.iter().map(|w| w * w).sum();
    sum * sum / squares
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_weights_are_as_the_tutorial_wants_them(n in 1_usize..60, lambda in 2_usize..400) {
            let p = Parameters::new(n, lambda);
            prop_assert_eq!(p.weights.len(), lambda);
            prop_assert!(p.weights.is_sorted_by(|a, b| a >= b));
            let (better, worse) = p.weights.split_at(p.mu);
            prop_assert!((better.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(worse.iter().all(|&w| w <= 0.0));
            prop_assert!(1.0 <= p.mu_eff && p.mu_eff <= p.mu as f64 + 1e-9);
            // What is left of the old C can not be outweighed: C stays positive definite.
            let negative: f64 = -worse.iter().sum::<f64>();
            prop_assert!(p.c_1 + p.c_mu <= 1.0);
            prop_assert!(p.c_mu * negative * n as f64 <= 1.0 - p.c_1 - p.c_mu + 1e-12);
        }
    }

    #[test]
    fn in_ten_dimensions_the_values_are_those_everybody_knows() {
        let p = Parameters::new(10, Parameters::default_lambda(10));
        assert_eq!((p.lambda, p.mu), (10, 5));
        assert!((p.mu_eff - 3.167).abs() < 1e-3);
        assert!((p.c_sigma - 0.2844).abs() < 1e-4);
        assert!((p.c_1 - 0.01528).abs() < 1e-5);
    }
}
