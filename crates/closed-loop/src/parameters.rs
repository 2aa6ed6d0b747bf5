//! What a controller's checked parameters can do for whoever closes its loop: run side by side with others, and be linearised.

use certune_control::Controller;
use certune_control::aic::{Aic, AicParams};
use certune_control::mrac::{Mrac, MracParams};
use certune_dynamics::Model;
use certune_linsys::{Continuous, Discrete, Joints, Lanes, Loop, LoopError};

use crate::linear::{linearise_aic, linearise_aic_sampled, linearise_mrac, linearise_mrac_sampled};

/// Parameters of a controller that is simulated in lanes and linearised.
pub trait Parameters<const N: usize>: Sync {
    /// The controller, its parameters in the lanes of `T`.
    type Controller<T: Lanes>: Controller<N, T>;

    /// Whether both can be lanes of one controller.
    fn share_lanes(&self, other: &Self) -> bool;

    /// Controllers side by side: the parameters of each lane.
    fn pack<'a, T: Lanes>(of: impl Fn(usize) -> &'a Self) -> Self::Controller<T>
    where
        Self: 'a;

    /// The loop in continuous time about rest in `q`.
    ///
    /// # Errors
    /// [`LoopError::NotFinite`] when `q` or an entry is not finite.
    fn linearised(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
    ) -> Result<Loop<Continuous>, LoopError>;

    /// The sampled loop about rest in `q`.
    ///
    /// # Errors
    /// As [`Parameters::linearised`].
    fn linearised_sampled(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
        delay_samples: usize,
    ) -> Result<Loop<Discrete>, LoopError>;
}

impl<const N: usize> Parameters<N> for AicParams<N> {
    type Controller<T: Lanes> = Aic<N, T>;

    fn share_lanes(&self, _: &Self) -> bool {
        true
    }

    fn pack<'a, T: Lanes>(of: impl Fn(usize) -> &'a Self) -> Aic<N, T> {
        Aic::pack(of)
    }

    fn linearised(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
    ) -> Result<Loop<Continuous>, LoopError> {
        linearise_aic(model, q, self, gravity_compensated)
    }

    fn linearised_sampled(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
        delay_samples: usize,
    ) -> Result<Loop<Discrete>, LoopError> {
        linearise_aic_sampled(model, q, self, gravity_compensated, delay_samples)
    }
}

impl<const N: usize> Parameters<N> for MracParams<N> {
    type Controller<T: Lanes> = Mrac<N, T>;

    /// A lane cannot have a law of its own; nor derivative terms, whose zeros would turn an infinity beside them into no number.
    fn share_lanes(&self, other: &Self) -> bool {
        self.gains().law == other.gains().law && self.has_derivatives() == other.has_derivatives()
    }

    fn pack<'a, T: Lanes>(of: impl Fn(usize) -> &'a Self) -> Mrac<N, T> {
        Mrac::pack(of)
    }

    fn linearised(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
    ) -> Result<Loop<Continuous>, LoopError> {
        linearise_mrac(model, q, self, gravity_compensated)
    }

    fn linearised_sampled(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        gravity_compensated: bool,
        delay_samples: usize,
    ) -> Result<Loop<Discrete>, LoopError> {
        linearise_mrac_sampled(model, q, self, gravity_compensated, delay_samples)
    }
}
