//! Gains of either controller as checked parameters.

use certune_closed_loop::Gains;
use certune_control::aic::AicParams;
use certune_control::mrac::MracParams;

/// Checked parameters of either controller.
pub(crate) enum Checked<const N: usize> {
    Aic(AicParams<N>),
    Mrac(Box<MracParams<N>>),
}

impl<const N: usize> Checked<N> {
    /// The controller of these gains, if they make one for `N` joints at this step.
    pub(crate) fn new(gains: &Gains, step_s: f64) -> Option<Self> {
        match gains {
            Gains::Aic(table) => AicParams::new(&table.bind().ok()?, step_s).ok().map(Self::Aic),
            Gains::Mrac(table) => {
                MracParams::new(&table.bind().ok()?, step_s).ok().map(|params| Self::Mrac(Box::new(params)))
            }
        }
    }
}
