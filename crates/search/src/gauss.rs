//! Normal deviates.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rand::Rng;

/// A vector of `n` independent standard normal deviates.
///
/// Box & Muller (1958), two at a time. Nothing is carried over to the next
/// vector, so the generator alone is the state.
pub(crate) fn vector(generator: &mut impl Rng, n: usize) -> DVector<f64> {
    let mut pairs = std::iter::repeat_with(|| {
        // 1 - [0, 1) = (0, 1], whose logarithm is finite.
        let radius = (-2.0 * (1.0 - generator.random::<f64>()).ln()).sqrt();
        let (sine, cosine) = (TAU * generator.random::<f64>()).sin_cos();
        [radius * cosine, radius * sine]
    });
    let deviates = pairs.by_ref().take(n.div_ceil(2)).flatten().take(n);
    DVector::from_iterator(n, deviates)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    #[test]
    fn the_first_four_moments_are_those_of_a_normal() {
        let mut generator = ChaCha8Rng::seed_from_u64(7);
        let n = 200_001;
        let z = vector(&mut generator, n);
        let moment = |k| z.iter().map(|z| z.powi(k)).sum::<f64>() / n as f64;
        assert!(moment(1).abs() < 0.01);
        assert!((moment(2) - 1.0).abs() < 0.015);
        assert!(moment(3).abs() < 0.04);
        assert!((moment(4) - 3.0).abs() < 0.1);
    }
}
