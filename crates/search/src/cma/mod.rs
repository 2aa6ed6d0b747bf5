//! One run of CMA-ES.
//!
//! N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772 (2016),
//! to which all equation numbers refer: figure 6 with active update of the
//! covariance (negative weights), cumulative step-size adaptation with the
//! stall h_σ, the default parameters of table 1, the postponed
//! eigendecomposition of section B.2 and the termination criteria of B.3.

mod basis;
mod history;
mod options;
mod parameters;

use nalgebra::{DMatrix, DVector};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use crate::bounds::{fold, unfold};
use crate::search::{Best, Ending, Search, SetupError, TellError, check_scores, check_start};
use crate::{gauss, plain};
use basis::Basis;
use history::History;
pub use options::Options;
pub use parameters::Parameters;

/// A covariance matrix with a greater condition number is taken for singular.
const CONDITION_COV: f64 = 1e14;

/// One run of CMA-ES.
///
/// The state lives in an unbounded space that is folded onto the unit box (see
/// the source of `bounds`); away from the bounds the two coincide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct Cma {
    parameters: Parameters,
    tol_fun: f64,
    tol_x: f64,
    max_iterations: u64,
    generator: ChaCha8Rng,
    /// g, the number of generations told.
    generation: u64,
    /// m, the mean of the distribution.
    #[serde(with = "plain::vector")]
    mean: DVector<f64>,
    /// σ, the step size.
    sigma: f64,
    /// σ at the start.
    sigma_0: f64,
    /// p_σ, the evolution path of the step size.
    #[serde(with = "plain::vector")]
    path_sigma: DVector<f64>,
    /// p_c, the evolution path of the covariance.
    #[serde(with = "plain::vector")]
    path_c: DVector<f64>,
    /// C, the covariance matrix.
    #[serde(with = "plain::matrix")]
    covariance: DMatrix<f64>,
    /// B and D of C as it was in the generation `decomposed`.
    basis: Basis,
    decomposed: u64,
    /// The z_k of the generation asked and not told yet; empty if none is.
    #[serde(with = "plain::vectors")]
    asked: Vec<DVector<f64>>,
    history: History,
    best: Option<Best>,
    ended: Option<Ending>,
}

impl Cma {
    /// A run from the point `start` of the unit box, with the initial standard
    /// deviation `sigma` in every coordinate.
    pub fn new(start: &[f64], sigma: f64, seed: u64, options: Options) -> Result<Cma, SetupError> {
        check_start(start, sigma)?;
        let n = start.len();
        let lambda = options.lambda.unwrap_or_else(|| Parameters::default_lambda(n));
        if lambda < 2 {
            return Err(SetupError::Population);
        }
        let default_limit = || Parameters::max_iterations(n, lambda);
        let max_iterations = options.max_iterations.unwrap_or_else(default_limit);
        Ok(Cma {
            parameters: Parameters::new(n, lambda),
            tol_fun: options.tol_fun,
            tol_x: options.tol_x,
            max_iterations,
            generator: ChaCha8Rng::seed_from_u64(seed),
            generation: 0,
            mean: DVector::from_iterator(n, start.iter().copied().map(unfold)),
            sigma,
            sigma_0: sigma,
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            covariance: DMatrix::identity(n, n),
            basis: Basis::identity(n),
            decomposed: 0,
            asked: Vec::new(),
            history: History::default(),
            best: None,
            ended: None,
        })
    }

    /// The strategy parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The mean of the distribution, as a point of the box.
    ///
    /// Of a noisy objective the mean is a better estimate of the optimum than
    /// the best point, whose score was lucky.
    pub fn mean(&self) -> Vec<f64> {
        self.mean.iter().copied().map(fold).collect()
    }

    /// The standard deviation in each coordinate, σ √C_ii.
    pub fn deviations(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|c| self.sigma * c.sqrt()).collect()
    }

    /// Equations (41) to (47), given the z_k of the generation from best to worst.
    fn update(&mut self, z: &[&DVector<f64>]) {
        let Parameters { mu, mu_eff, c_m, c_sigma, d_sigma, c_c, c_1, c_mu, chi_n, .. } = self.parameters;
        let weights = &self.parameters.weights;
        let n = self.mean.len() as f64;

        // ⟨y⟩_w = B D ⟨z⟩_w  (41); C^(−1/2) ⟨y⟩_w = B ⟨z⟩_w, as C^(−1/2) = B D⁻¹ Bᵀ.
        let mut z_w = DVector::zeros(self.mean.len());
        for (&w, z) in weights.iter().zip(z).take(mu) {
            z_w.axpy(w, z, 1.0);
        }
        let y_w = self.basis.shape(&z_w);

        // (42)
        self.mean.axpy(c_m * self.sigma, &y_w, 1.0);

        // (43), (44)
        let gain = (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        self.path_sigma *= 1.0 - c_sigma;
        self.path_sigma.axpy(gain, &(&self.basis.axes * z_w), 1.0);
        let length = self.path_sigma.norm();
        self.sigma *= (c_sigma / d_sigma * (length / chi_n - 1.0)).exp();

        // (45): h_σ stalls the path while p_σ is long, that is σ still too small.
        let age = 2.0 * self.generation as f64;
        let settled = (1.0 - (1.0 - c_sigma).powf(age)).sqrt();
        let h_sigma = length / settled < (1.4 + 2.0 / (n + 1.0)) * chi_n;
        self.path_c *= 1.0 - c_c;
        if h_sigma {
            self.path_c.axpy((c_c * (2.0 - c_c) * mu_eff).sqrt(), &y_w, 1.0);
        }

        // (47), with the negative weights of (46): w° = w n / ‖C^(−1/2) y‖², where
        // the norm is that of z.
        let delta = if h_sigma { 0.0 } else { c_c * (2.0 - c_c) };
        let sum: f64 = weights.iter().sum();
        self.covariance *= 1.0 + c_1 * delta - c_1 - c_mu * sum;
        self.covariance.ger(c_1, &self.path_c, &self.path_c, 1.0);
        for (&w, z) in weights.iter().zip(z) {
            let w = if w < 0.0 { w * n / z.norm_squared().max(f64::EPSILON) } else { w };
            let y = self.basis.shape(z);
            self.covariance.ger(c_mu * w, &y, &y, 1.0);
        }
    }

    /// Decomposes C if its turn has come: every 1 / (10 n (c_1 + c_μ))
    /// generations (section B.2), as it costs O(n³).
    fn decompose(&mut self) -> Option<Ending> {
        let Parameters { c_1, c_mu, .. } = self.parameters;
        let interval = 1.0 / (10.0 * self.mean.len() as f64 * (c_1 + c_mu));
        if ((self.generation - self.decomposed) as f64) < interval.floor() {
            return None;
        }
        self.decomposed = self.generation;
        match Basis::of(&self.covariance) {
            Some(basis) if basis.condition() <= CONDITION_COV => {
                self.basis = basis;
                None
            }
            _ => Some(Ending::ConditionCov),
        }
    }

    /// The termination criteria of section B.3 that depend on the distribution.
    fn exhausted(&self) -> Option<Ending> {
        let Basis { axes, lengths } = &self.basis;
        let unmoved = |step: DVector<f64>| &self.mean + step == self.mean;
        let deviations = || self.covariance.diagonal().map(|c| self.sigma * c.sqrt());
        let small = |x: &f64| x.abs() < self.tol_x * self.sigma_0;
        let axis = (self.generation % lengths.len() as u64) as usize;
        if deviations().iter().all(small) && self.path_c.iter().all(|p| small(&(self.sigma * p))) {
            Some(Ending::TolX)
        } else if self.sigma * lengths.max() > 1e4 * self.sigma_0 {
            Some(Ending::TolXUp)
        } else if unmoved(axes.column(axis) * (0.1 * self.sigma * lengths[axis])) {
            Some(Ending::NoEffectAxis)
        } else if deviations().iter().zip(&self.mean).any(|(d, m)| (m + 0.2 * d).total_cmp(m).is_eq()) {
            Some(Ending::NoEffectCoord)
        } else if self.generation >= self.max_iterations {
            Some(Ending::MaxIter)
        } else {
            None
        }
    }

    /// Whether all parts of a state that was read fit together.
    fn sound(&self) -> bool {
        let n = self.mean.len();
        let vectors = [&self.mean, &self.path_sigma, &self.path_c];
        n > 0
            && self.parameters.lambda >= 2
            && self.parameters.mu <= self.parameters.lambda
            && self.parameters.weights.len() == self.parameters.lambda
            && vectors.into_iter().chain(&self.asked).all(|v| v.len() == n)
            && (self.asked.is_empty() || self.asked.len() == self.parameters.lambda)
            && self.covariance.shape() == (n, n)
            && self.basis.sound(n)
            && self.decomposed <= self.generation
            && self.history.sound()
    }
}

impl Search for Cma {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        if self.ended.is_some() {
            return Vec::new();
        }
        let n = self.mean.len();
        if self.asked.is_empty() {
            let draw = || gauss::vector(&mut self.generator, n);
            self.asked = std::iter::repeat_with(draw).take(self.parameters.lambda).collect();
        }
        // x_k = m + σ B D z_k  (38), (39), (40)
        let point = |z| &self.mean + self.basis.shape(z) * self.sigma;
        self.asked.iter().map(|z| point(z).iter().copied().map(fold).collect()).collect()
    }

    fn tell(&mut self, scores: &[f64]) -> Result<(), TellError> {
        check_scores(self.asked.len(), scores)?;
        let points = self.ask();
        for (point, &score) in points.iter().zip(scores) {
            Best::keep(&mut self.best, point, score);
        }

        let asked = std::mem::take(&mut self.asked);
        let mut ranking: Vec<(f64, &DVector<f64>)> = scores.iter().copied().zip(&asked).collect();
        ranking.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (sorted, z): (Vec<f64>, Vec<&DVector<f64>>) = ranking.into_iter().unzip();

        self.generation += 1;
        self.update(&z);
        let per_point = 30.0 * self.mean.len() as f64 / self.parameters.lambda as f64;
        let (short, long) = (10 + per_point.ceil() as usize, 120 + per_point.ceil() as usize);
        self.history.note(self.generation, long, &sorted);
        self.ended = self
            .decompose()
            .or_else(|| self.history.flat(short, &sorted, self.tol_fun))
            .or_else(|| self.exhausted())
            .or_else(|| self.history.stagnates(long).then_some(Ending::Stagnation));
        Ok(())
    }

    /// Always `None`: with active update the worst points repel as the best
    /// attract, so every rank counts, the last one too; which of two bad
    /// points is the worse can not be told from scores cut off at a threshold.
    fn enough(&self) -> Option<f64> {
        None
    }

    fn ended(&self) -> Option<Ending> {
        self.ended
    }

    fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    fn evaluations(&self) -> u64 {
        self.generation * self.parameters.lambda as u64
    }
}

impl Serialize for Cma {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        Cma::serialize(self, to)
    }
}

impl<'de> Deserialize<'de> for Cma {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Cma, D::Error> {
        let run = Cma::deserialize(from)?;
        if run.sound() { Ok(run) } else { Err(D::Error::custom("not the state of a run")) }
    }
}
