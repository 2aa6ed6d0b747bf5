//! The constants as records, with what attains them and the options of the search.

use serde::{Deserialize, Serialize};

use crate::error::BoundsError;

/// The five numbers through which a certificate sees an arm; the inequalities are at the head of the crate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constants {
    /// Lower bound of the eigenvalues of `M(q)`, kg m².
    pub m_lo_kg_m2: f64,
    /// Upper bound of the eigenvalues of `M(q)`, kg m².
    pub m_hi_kg_m2: f64,
    /// Upper bound of the modulus of the eigenvalues of `∂g/∂q`, N m/rad.
    pub k_g_n_m_per_rad: f64,
    /// `½ |dq' (d_y M) dq| <= k_c |y| |dq|²`, kg m² per rad.
    pub k_c_kg_m2: f64,
    /// `½ |dq' (d_y M) dq| <= k_r |y| dq' M dq`; dimensionless (per rad).
    pub k_r: f64,
}

impl Constants {
    /// The constants made safer by a factor: `m_lo` divided by `1 + margin`, the others multiplied.
    #[must_use]
    pub fn widened(&self, margin: f64) -> Self {
        let factor = 1.0 + margin;
        Self {
            m_lo_kg_m2: self.m_lo_kg_m2 / factor,
            m_hi_kg_m2: self.m_hi_kg_m2 * factor,
            k_g_n_m_per_rad: self.k_g_n_m_per_rad * factor,
            k_c_kg_m2: self.k_c_kg_m2 * factor,
            k_r: self.k_r * factor,
        }
    }
}

/// The arm, the configuration and the directions that attain a constant, so that it can be re-evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attained {
    /// Joint positions, rad, in `[-π, π)`.
    pub q_rad: Vec<f64>,
    /// One scale per group of [`crate::ArmBox::groups`].
    pub scales: Vec<f64>,
    /// Rotor inertia of each joint, kg m²; the lower end where it does not enter (k_g, k_c, gravity torque).
    pub rotor_inertia_kg_m2: Vec<f64>,
    /// Unit vector over the joints: the eigenvector, or `dq` of the Coriolis form; zeros for a gravity torque.
    pub direction: Vec<f64>,
    /// Unit vector `y` of the Coriolis form; zeros for the other constants and where the form vanishes.
    pub slope_direction: Vec<f64>,
}

/// Where each constant is attained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Extremes {
    /// The smallest inertia.
    pub m_lo: Attained,
    /// The largest inertia.
    pub m_hi: Attained,
    /// The largest gravity stiffness.
    pub k_g: Attained,
    /// The largest Coriolis form.
    pub k_c: Attained,
    /// The largest Coriolis form relative to the kinetic energy.
    pub k_r: Attained,
    /// The largest gravity torque of each joint, base to tip.
    pub gravity_torque: Vec<Attained>,
}

/// Constants found by sampling all angles and maximising locally, then widened by a margin.
///
/// They are evidence of the weakest kind, *sampled*: the truth may be worse than `raw` by what the search missed, and the margin
/// is a guess at that, not a bound. A certificate that uses them is **conditional** ("if these constants hold").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledConstants {
    /// What a certificate may assume: `raw` widened by `margin`.
    pub constants: Constants,
    /// What the search attained.
    pub raw: Constants,
    /// Largest `|g_i|` of each joint over the same box, widened by `margin`, N m.
    pub gravity_torque_n_m: Vec<f64>,
    /// Largest `|g_i|` of each joint as attained, N m.
    pub raw_gravity_torque_n_m: Vec<f64>,
    /// The margin as a fraction; 0.05 is 5 %.
    pub margin: f64,
    /// Configurations sampled.
    pub samples: usize,
    /// Local maximisations per constant.
    pub local_starts: usize,
    /// The set of configurations, in words.
    pub over: String,
    /// What attains each raw value.
    pub attained: Extremes,
}

/// How hard [`crate::sampled_constants`] searches, and how much it adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplingOptions {
    samples: usize,
    local_starts: usize,
    margin: f64,
}

impl SamplingOptions {
    /// `samples` configurations, `local_starts` climbs per constant from the best of them, a margin as a fraction.
    ///
    /// With `local_starts` 0 the best sample stands.
    ///
    /// # Errors
    /// [`BoundsError::Samples`] for 0 samples, [`BoundsError::Margin`] unless the margin is finite and not negative.
    pub fn new(samples: usize, local_starts: usize, margin: f64) -> Result<Self, BoundsError> {
        if samples == 0 {
            return Err(BoundsError::Samples);
        }
        if !(0.0..f64::INFINITY).contains(&margin) {
            return Err(BoundsError::Margin { value: margin });
        }
        Ok(Self { samples, local_starts, margin })
    }

    /// Configurations sampled.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Local maximisations per constant.
    #[must_use]
    pub fn local_starts(&self) -> usize {
        self.local_starts
    }

    /// The margin as a fraction.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }
}

impl Default for SamplingOptions {
    /// 2,000 samples, 32 starts per constant, 5 %: under a second for the Panda on two cores.
    fn default() -> Self {
        Self { samples: 2_000, local_starts: 32, margin: 0.05 }
    }
}
