//! The worst plant of a box for given gains, by search.
//!
//! Plants that are drawn rarely lie where gains fare worst: in a box of 23 numbers (the Panda's) hardly any draw comes near a corner. So once a search has a winner, CMA-ES looks for the
//! plant on which that winner fares worst; if it is worse than every plant of the batch, it joins the batch and the search goes on, as `systune` does with the plants of an uncertain model.
//!
//! Limits: a search proves nothing. That no worse plant was found is no claim; what is claimed for the whole box is the certificate.

use certune_closed_loop::{Gains, Plant, PlantSetting};
use certune_search::{Cma, Options, Search};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use crate::batch::Batch;
use crate::outcome::{Finite, Outcome};
use crate::streams;

/// Spread of the first population, a fraction of each range: it reaches the faces of the box.
const SIGMA: f64 = 0.4;
/// Generations of a search. Costs as many runs as a population has members, each: about 260 runs for the Panda.
const GENERATIONS: usize = 20;
/// A plant that costs this share more than the worst of the batch is worth adding.
pub const TOLERANCE: f64 = 0.01;

/// A plant that was found to be worse than those of the batch.
#[derive(Clone, Debug, PartialEq)]
pub struct WorsePlant {
    /// The plant.
    pub setting: PlantSetting,
    /// What became of the gains on it.
    pub outcome: Outcome,
}

/// Whether `outcome` is worse than `than` by more than the tolerance.
fn is_worse(outcome: Outcome, than: Outcome) -> bool {
    let bar = match than {
        Outcome::Simulated { cost } => {
            Outcome::Simulated { cost: Finite::saturating(cost.get() + TOLERANCE * cost.get().abs()) }
        }
        Outcome::Violates { excess, limit } => {
            Outcome::Violates { excess: Finite::saturating(excess.get() * (1.0 + TOLERANCE)), limit }
        }
        other => other,
    };
    outcome > bar
}

impl<const N: usize> Batch<N> {
    /// The worst plant for `gains` that is found, if it is worse than all of the batch. `round` numbers the searches with one seed. None for gains that make no controller.
    pub fn worse_plant(&self, gains: &Gains, round: u32) -> Option<WorsePlant> {
        let known = self.outcomes(gains, self.plants()).into_iter().max()?;
        let dimension = self.plant_box().dimension(N);
        let mut chance = ChaCha8Rng::seed_from_u64(self.seed());
        chance.set_stream(streams::WORST_PLANT);
        chance.set_word_pos(2 * u128::from(round));
        let mut search = Cma::new(&vec![0.5; dimension], SIGMA, chance.next_u64(), Options::default()).ok()?;
        let mut worst: Option<WorsePlant> = None;
        for _ in 0..GENERATIONS {
            let settings: Vec<PlantSetting> = search.ask().iter().map(|point| self.plant_box().at(N, point)).collect();
            let plants = settings.iter().map(|setting| self.plant(setting).ok());
            let plants: Vec<(u64, Plant<N>)> =
                plants.collect::<Option<Vec<_>>>()?.into_iter().map(|plant| (self.next_index(), plant)).collect();
            let outcomes = self.outcomes(gains, &plants);
            for (outcome, setting) in outcomes.iter().zip(settings) {
                if worst.as_ref().is_none_or(|worst| *outcome > worst.outcome) {
                    worst = Some(WorsePlant { setting, outcome: *outcome });
                }
            }
            // The worse the better.
            let scores: Vec<f64> = outcomes.iter().map(|outcome| -outcome.score()).collect();
            if search.tell(&scores).is_err() || search.ended().is_some() {
                break;
            }
        }
        worst.filter(|worst| is_worse(worst.outcome, known))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goals::Goal;

    #[test]
    fn a_plant_is_worse_by_more_than_the_tolerance() {
        let cost = |cost| Outcome::Simulated { cost: Finite::new(cost).unwrap() };
        let excess = |excess| Outcome::Violates { excess: Finite::new(excess).unwrap(), limit: Goal::Overshoot };
        assert!(is_worse(cost(1.02), cost(1.0)) && !is_worse(cost(1.005), cost(1.0)));
        assert!(is_worse(excess(0.001), cost(1.0)) && !is_worse(cost(9.0), excess(0.1)));
        assert!(is_worse(excess(0.2), excess(0.1)) && !is_worse(excess(0.1), excess(0.1)));
        let diverged = |at_s| Outcome::Diverged { at_s: Finite::new(at_s).unwrap() };
        assert!(is_worse(diverged(1.0), diverged(2.0)) && !is_worse(diverged(2.0), diverged(2.0)));
    }
}
