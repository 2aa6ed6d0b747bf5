//! Figures of a set of gains over many plants.

use certune::tune::{Figures, Outcome, PlantResult, Verdict};
use serde::Serialize;

use crate::output::number;

/// The worst of each figure over the plants; a figure that a plant does not have is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Cost of all plants together, as in the search: the mean over the worst share of them.
    pub cost: Option<f64>,
    pub worst_cost: Option<f64>,
    pub settling_time_s: Option<f64>,
    pub final_error_rad: Option<f64>,
    pub overshoot: Option<f64>,
    pub peak_torque_n_m: Option<f64>,
    pub torque_rate_rms_n_m_per_s: Option<f64>,
    pub plants: usize,
    pub diverged: usize,
}

/// A row of a table of figures.
pub struct Figure {
    name: &'static str,
    digits: usize,
    /// From SI to the unit of the name.
    scale: f64,
    value: fn(&Spread) -> Option<f64>,
}

/// The rows, in the order of a table.
pub const FIGURES: [Figure; 7] = [
    Figure { name: "cost, tail of the plants", digits: 4, scale: 1.0, value: |spread| spread.cost },
    Figure { name: "cost, worst plant", digits: 4, scale: 1.0, value: |spread| spread.worst_cost },
    Figure { name: "slowest move settles in, s", digits: 3, scale: 1.0, value: |spread| spread.settling_time_s },
    Figure { name: "largest final error, mrad", digits: 3, scale: 1e3, value: |spread| spread.final_error_rad },
    Figure { name: "largest overshoot, %", digits: 2, scale: 1e2, value: |spread| spread.overshoot },
    Figure { name: "largest torque, N m", digits: 2, scale: 1.0, value: |spread| spread.peak_torque_n_m },
    Figure {
        name: "largest torque rate RMS, N m/s",
        digits: 1,
        scale: 1.0,
        value: |spread| spread.torque_rate_rms_n_m_per_s,
    },
];

impl Figure {
    /// The figure's name, and its value for each set of gains.
    pub fn row(&self, spreads: &[Option<Spread>]) -> Vec<String> {
        let cell = |spread: &Option<Spread>| {
            number(spread.as_ref().and_then(self.value).map(|value| self.scale * value), self.digits)
        };
        std::iter::once(self.name.to_owned()).chain(spreads.iter().map(cell)).collect()
    }
}

/// The figures of a verdict.
pub fn spread(verdict: &Verdict) -> Spread {
    let plants = &verdict.plants;
    let worst = |value: &dyn Fn(&PlantResult) -> Option<f64>| {
        let values: Option<Vec<f64>> = plants.iter().map(value).collect();
        values.filter(|values| !values.is_empty()).map(|values| values.into_iter().fold(0.0, f64::max))
    };
    let figure = |value: fn(&Figures) -> Option<f64>| worst(&|plant: &PlantResult| value(&plant.figures));
    Spread {
        cost: verdict.outcome.cost(),
        worst_cost: worst(&|plant| plant.outcome.cost()),
        settling_time_s: figure(|figures| figures.settling_time_s),
        final_error_rad: figure(|figures| figures.final_error_rad),
        overshoot: figure(|figures| figures.overshoot),
        peak_torque_n_m: figure(|figures| figures.peak_torque_n_m),
        torque_rate_rms_n_m_per_s: figure(|figures| figures.torque_rate_rms_n_m_per_s),
        plants: plants.len(),
        diverged: plants.iter().filter(|plant| matches!(plant.outcome, Outcome::Diverged { .. })).count(),
    }
}
