//! Eigenvalues of linearised loops on a sample of configurations and plants: a cheap look before any simulation.
//!
//! For each sample the largest growth rate of two loops about rest is computed,
//!
//! ```text
//! continuous   max Re s           over the eigenvalues s of A(q, plant)
//! sampled      ln(max |z|) / h    over the eigenvalues z of the loop with step h and the box's largest delay
//! ```
//!
//! and a set of gains whose largest growth is zero or more is not simulated. The sample is fixed by the seed: the scenario's start and goals and random
//! configurations within the joint limits, each with a plant. Every third plant is the lightest of the box, every third the heaviest, both with the least
//! friction (light arms lose stability to sampling and delay, heavy arms to slow integration), the others are drawn.
//!
//! Limits: a sample proves nothing between its points, and the adaptive controller's gains are taken as frozen with nothing accumulated. Cost: two eigenvalue problems of order 6N
//! each, 3N for the adaptive controller.

use certune_closed_loop::{Gains, MAX_DELAY_SAMPLES, Parameters, PlantBox, PlantError, PlantSetting, Scenario, Task};
use certune_dynamics::{Model, Robot};
use certune_linsys::Joints;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;

use crate::checked::Checked;
use crate::outcome::Finite;
use crate::streams;

/// Samples of a filter by default.
pub const DEFAULT_SAMPLES: usize = 24;

#[derive(Clone, Debug)]
struct FilterSample<const N: usize> {
    model: Model<N>,
    q: Joints<N>,
}

/// A fixed sample of configurations and plants.
#[derive(Clone, Debug)]
pub struct StabilityFilter<const N: usize> {
    samples: Vec<FilterSample<N>>,
    gravity_compensation: bool,
    delay_samples: usize,
}

impl<const N: usize> StabilityFilter<N> {
    /// A sample of `samples` pairs for the plant box of `scenario`, whose `task` is bound to `robot`. It begins with the task's start and goals.
    ///
    /// # Errors
    /// [`PlantError`] when the robot has not `N` joints or the box is out of range.
    pub fn new(
        robot: &Robot,
        scenario: &Scenario,
        task: &Task<N>,
        seed: u64,
        samples: usize,
    ) -> Result<Self, PlantError> {
        let family = &scenario.plant_box;
        family.validate()?;
        let mut visited = vec![task.start];
        for segment in &task.segments {
            if !visited.contains(&segment.goal) {
                visited.push(segment.goal);
            }
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(streams::FILTER_CONFIGURATIONS);
        let samples = (0..samples)
            .map(|index| {
                let setting = match index % 3 {
                    0 => corner(family, N, 0),
                    1 => corner(family, N, 1),
                    _ => family.draw(N, seed, streams::FIRST_FILTER_PLANT + index as u64),
                };
                let q = visited.get(index).copied().unwrap_or_else(|| within_limits(robot, &mut rng));
                Ok(FilterSample { model: setting.model(robot)?, q })
            })
            .collect::<Result<Vec<_>, PlantError>>()?;
        Ok(Self { samples, gravity_compensation: family.gravity_compensation, delay_samples: family.delay_samples[1] })
    }

    /// The number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether the sample is empty; then nothing is ever rejected.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The longest delay, in whole samples of the controller, up to which every sampled loop decays, s; from the box's largest delay on, 0 when it is not borne, and
    /// at most [`MAX_DELAY_SAMPLES`].
    pub fn delay_margin_s<P: Parameters<N>>(&self, params: &P, step_s: f64) -> f64 {
        let margin = |FilterSample { model, q }: &FilterSample<N>| {
            let decays = |delay: &usize| {
                params
                    .linearised_sampled(model, q, self.gravity_compensation, *delay)
                    .is_ok_and(|found| found.decay_per_s() > 0.0)
            };
            (self.delay_samples..=MAX_DELAY_SAMPLES).take_while(decays).last().unwrap_or(0)
        };
        self.samples.par_iter().map(margin).min().unwrap_or(MAX_DELAY_SAMPLES) as f64 * step_s
    }

    /// [`StabilityFilter::growth_per_s`] of a candidate; none when its gains make no controller.
    pub fn growth_of(&self, gains: &Gains, step_s: f64) -> Option<Finite> {
        Checked::new(gains, step_s).map(|checked| match checked {
            Checked::Aic(params) => self.growth_per_s(&params),
            Checked::Mrac(params) => self.growth_per_s(&*params),
        })
    }

    /// The largest growth rate over the sample, 1/s: negative when every loop decays. A loop that overflows grows as fast as a number can.
    pub fn growth_per_s<P: Parameters<N>>(&self, params: &P) -> Finite {
        let compensated = self.gravity_compensation;
        let growth = |FilterSample { model, q }: &FilterSample<N>| {
            let continuous =
                params.linearised(model, q, compensated).map_or(f64::INFINITY, |found| found.spectral_abscissa_per_s());
            let sampled = params
                .linearised_sampled(model, q, compensated, self.delay_samples)
                .map_or(f64::INFINITY, |found| -found.decay_per_s());
            Finite::saturating(continuous).max(Finite::saturating(sampled))
        };
        self.samples.par_iter().map(growth).max().unwrap_or(Finite::saturating(f64::NEG_INFINITY))
    }
}

/// The lightest (`end` = 0) or heaviest (1) plant of the box, with its least friction.
fn corner(family: &PlantBox, joints: usize, end: usize) -> PlantSetting {
    let scale = [1.0 - family.mass_uncertainty, 1.0 + family.mass_uncertainty][end];
    PlantSetting {
        link_mass_scale: vec![scale; joints],
        payload_kg: family.payload_kg[end],
        viscous_n_m_s_per_rad: vec![family.friction_n_m_s_per_rad[0]; joints],
        coulomb_n_m: vec![0.0; joints],
        rotor_inertia_kg_m2: vec![family.rotor_inertia_kg_m2[end]; joints],
        delay_samples: family.delay_samples[1],
        gravity_compensation: family.gravity_compensation,
    }
}

/// A configuration drawn evenly within the joint limits, ±π for a joint without.
fn within_limits<const N: usize>(robot: &Robot, rng: &mut ChaCha8Rng) -> Joints<N> {
    Joints::from_fn(|joint, _| {
        let limits = robot.links().get(joint).map(|link| [link.limits.lower_rad, link.limits.upper_rad]);
        let [lower, upper] = limits
            .filter(|ends| ends.iter().all(|end| end.is_finite()))
            .unwrap_or([-core::f64::consts::PI, core::f64::consts::PI]);
        let unit = (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
        lower + unit * (upper - lower)
    })
}
