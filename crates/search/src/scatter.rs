//! Points drawn evenly over the box, to begin with.
//!
//! A population that starts in one place learns the slope there before it has seen anything else. Some dozens of points in all of the box tell in which basin to start.
//!
//! The optimum often lies on a bound, where a density has no weight: coordinates are drawn from a box that is wider by 0.15 on each side, and clipped, so that about a
//! quarter of them lie on a bound.

use rand::Rng;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::{Deserialize, Serialize};

use crate::search::{Best, Ending, Search, SetupError, TellError, check_scores};

/// Points asked at a time: enough to keep the threads of a machine busy.
const BLOCK: usize = 8;

/// How far beyond a bound coordinates are drawn before they are clipped.
const BEYOND: f64 = 0.15;

/// A given number of points, drawn evenly and independently.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    dimension: usize,
    points: usize,
    generator: ChaCha8Rng,
    asked: Vec<Vec<f64>>,
    best: Option<Best>,
    told: usize,
}

impl Scatter {
    /// `points` points in `dimension` dimensions.
    pub fn new(dimension: usize, points: usize, seed: u64) -> Result<Scatter, SetupError> {
        if dimension == 0 {
            return Err(SetupError::NoDimension);
        }
        let generator = ChaCha8Rng::seed_from_u64(seed);
        Ok(Scatter { dimension, points, generator, asked: Vec::new(), best: None, told: 0 })
    }
}

impl Search for Scatter {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        if self.asked.is_empty() {
            let (count, dimension) = (BLOCK.min(self.points - self.told), self.dimension);
            let generator = &mut self.generator;
            let mut coordinate = || ((1.0 + 2.0 * BEYOND) * generator.random::<f64>() - BEYOND).clamp(0.0, 1.0);
            let mut point = || (0..dimension).map(|_| coordinate()).collect();
            self.asked = (0..count).map(|_| point()).collect();
        }
        self.asked.clone()
    }

    fn tell(&mut self, scores: &[f64]) -> Result<(), TellError> {
        check_scores(self.asked.len(), scores)?;
        let asked = std::mem::take(&mut self.asked);
        for (point, &score) in asked.iter().zip(scores) {
            Best::keep(&mut self.best, point, score);
        }
        self.told += scores.len();
        Ok(())
    }

    /// The best score so far: only the best point of all is of any use.
    fn enough(&self) -> Option<f64> {
        self.best.as_ref().map(|best| best.score)
    }

    fn ended(&self) -> Option<Ending> {
        (self.told >= self.points).then_some(Ending::MaxIter)
    }

    fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    fn evaluations(&self) -> u64 {
        self.told as u64
    }
}
