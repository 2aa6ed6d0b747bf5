//! CMA-ES with restarts in two regimes.
//!
//! N. Hansen, "Benchmarking a BI-population CMA-ES on the BBOB-2009 function
//! testbed", GECCO 2009 workshops. Large populations, doubled at each restart,
//! see the global structure through many local optima; small ones with a
//! random, mostly smaller spread find what only a local search finds. The
//! regime that has spent fewer evaluations so far gets the next run.

use rand::Rng;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::{Deserialize, Serialize};

use crate::cma::{Cma, Options, Parameters};
use crate::search::{Best, Ending, Search, SetupError, TellError, check_spread};

/// What may be chosen about a search with restarts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BipopOptions {
    /// Those of the first run; its λ is the λ_default of the restarts, and
    /// `max_iterations` holds for the first and the large runs.
    pub run: Options,
    /// σ at the start of the large restarts.
    pub sigma: f64,
    /// The times the population is doubled, after which the search ends.
    pub max_restarts: u32,
}

impl Default for BipopOptions {
    fn default() -> BipopOptions {
        BipopOptions { run: Options::default(), sigma: 0.2, max_restarts: 9 }
    }
}

/// The population of the present run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Regime {
    Small,
    Large,
}

/// CMA-ES with restarts, large and small.
///
/// The first run starts where it is told to; all others at a random point of
/// the box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bipop {
    options: BipopOptions,
    lambda_default: usize,
    generator: ChaCha8Rng,
    run: Cma,
    regime: Regime,
    /// The runs begun, less one.
    restarts: u32,
    /// The large runs begun.
    doublings: u32,
    /// The evaluations of the finished runs of either regime. The first run
    /// counts as a small one, so that the first restart is a large one.
    spent_small: u64,
    spent_large: u64,
    /// The evaluations of the last large run.
    last_large: u64,
    evaluations: u64,
    best: Option<Best>,
    ended: Option<Ending>,
}

impl Bipop {
    /// A search whose first run starts at `start` with the spread `sigma`: at
    /// what is known to work and with the spread that leaves it standing.
    pub fn new(start: &[f64], sigma: f64, seed: u64, options: BipopOptions) -> Result<Bipop, SetupError> {
        check_spread(options.sigma)?;
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        let run = Cma::new(start, sigma, generator.random(), options.run)?;
        Ok(Bipop {
            options,
            lambda_default: run.parameters().lambda,
            generator,
            run,
            regime: Regime::Small,
            restarts: 0,
            doublings: 0,
            spent_small: 0,
            spent_large: 0,
            last_large: 0,
            evaluations: 0,
            best: None,
            ended: None,
        })
    }

    /// How often the search has begun again.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// The run under way.
    pub fn run(&self) -> &Cma {
        &self.run
    }

    /// Accounts for the run that is over and begins the next one.
    fn restart(&mut self) {
        let spent = self.run.evaluations();
        match self.regime {
            Regime::Small => self.spent_small += spent,
            Regime::Large => {
                self.spent_large += spent;
                self.last_large = spent;
            }
        }
        self.regime = if self.spent_small < self.spent_large { Regime::Small } else { Regime::Large };
        if self.regime == Regime::Large {
            if self.doublings >= self.options.max_restarts {
                self.ended = Some(Ending::MaxRestarts);
                return;
            }
            self.doublings += 1;
        }

        let (lambda, sigma, max_iterations) = match self.regime {
            Regime::Large => (self.lambda_large(), self.options.sigma, self.options.run.max_iterations),
            Regime::Small => self.draw_small(),
        };
        let start: Vec<f64> = self.run.mean().iter().map(|_| self.generator.random()).collect();
        let options = Options { lambda: Some(lambda), max_iterations, ..self.options.run };
        match Cma::new(&start, sigma, self.generator.random(), options) {
            Ok(run) => {
                self.run = run;
                self.restarts += 1;
            }
            // Not reached: the start is in the box, and λ and σ are in order.
            Err(_) => self.ended = Some(Ending::MaxRestarts),
        }
    }

    /// λ_ℓ = 2^k λ_default in the k-th large run.
    fn lambda_large(&self) -> usize {
        let factor = 1_usize.checked_shl(self.doublings).unwrap_or(usize::MAX);
        self.lambda_default.saturating_mul(factor)
    }

    /// λ_s = ⌊λ_default (½ λ_ℓ / λ_default)^(U²)⌋ and σ = σ_0 10^(−2 U'), with
    /// no more than half the evaluations of the last large run.
    fn draw_small(&mut self) -> (usize, f64, Option<u64>) {
        let default = self.lambda_default as f64;
        let ratio = (0.5 * self.lambda_large() as f64 / default).max(1.0);
        let power = self.generator.random::<f64>().powi(2);
        let lambda = (default * ratio.powf(power)).floor().max(default);
        let sigma = self.options.sigma * 10_f64.powf(-2.0 * self.generator.random::<f64>());
        let default_limit = || Parameters::max_iterations(self.run.mean().len(), lambda as usize);
        let limit = self.options.run.max_iterations.unwrap_or_else(default_limit);
        let half = self.last_large / (2 * lambda as u64);
        (lambda as usize, sigma, Some(limit.min(half).max(1)))
    }
}

impl Search for Bipop {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        if self.ended.is_some() { Vec::new() } else { self.run.ask() }
    }

    fn tell(&mut self, scores: &[f64]) -> Result<(), TellError> {
        if self.ended.is_some() {
            return Err(TellError::Count { asked: 0, told: scores.len() });
        }
        self.run.tell(scores)?;
        self.evaluations += scores.len() as u64;
        if let Some(best) = self.run.best() {
            Best::keep(&mut self.best, &best.point, best.score);
        }
        if self.run.ended().is_some() {
            self.restart();
        }
        Ok(())
    }

    /// As of [`Cma`]: always `None`.
    fn enough(&self) -> Option<f64> {
        self.run.enough()
    }

    fn ended(&self) -> Option<Ending> {
        self.ended
    }

    fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}
