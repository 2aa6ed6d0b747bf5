//! Claim `sampled`: every linearised loop of the family decays when the controller runs as it is coded, in steps, with a delayed torque.
//!
//! The loops are those of [`sampled_loops`](crate::sampled_loops); the box is the one of `exponential`. Derivation: `proofs/claims/sampled.md`.

use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};
use serde::{Deserialize, Serialize};

use super::variation::{Variation, stays_stable, varied};
use super::{ClaimKind, Figure, Inequality, LoopBox, Provable, family_box};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::{Number, ratio};
use crate::quantity::{require, require_at_least_zero, require_positive};
use crate::sampled_loops::{PlantStep, SampledFamily};
use crate::statement::any_configuration;

/// How often the controller runs, and how late its torque acts on which plant.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopTiming {
    /// How the arm moves between two samples.
    pub plant: PlantStep,
    /// Time between two samples, s.
    pub period_s: Number,
    /// Time from a sample to the moment its torque acts: constant, and anything up to this, s.
    pub delay_s: Number,
}

impl LoopTiming {
    /// The delay in samples.
    pub fn delay_samples(&self) -> BigRational {
        if self.period_s.value().is_zero() { BigRational::zero() } else { self.delay_s.value() / self.period_s.value() }
    }

    pub(crate) fn check(&self) -> Result<(), Flaw> {
        require_positive("period_s", &self.period_s)?;
        require_at_least_zero("delay_s", &self.delay_s)
    }

    /// `sampled every 1 ms, ...`.
    pub(crate) fn in_words(&self) -> String {
        let plant = match self.plant {
            PlantStep::SemiImplicit => "the arm advanced by the simulator's semi-implicit step",
            PlantStep::ZeroOrderHold => "the arm moving in continuous time, its friction the same on every joint",
        };
        format!("sampled every {} ms with a held torque, {plant}", milliseconds(&self.period_s))
    }

    /// The constant delays up to one, as they are checked.
    pub(crate) fn delays(&self, longest_s: &Number) -> String {
        let longest = milliseconds(longest_s);
        match self.plant {
            PlantStep::SemiImplicit => format!("a delay of any whole number of samples up to {longest} ms"),
            PlantStep::ZeroOrderHold => format!("any constant delay up to {longest} ms"),
        }
    }

    /// The whole number of samples that the delay is, if it is.
    pub(crate) fn whole_samples(&self) -> Option<usize> {
        let samples = self.delay_samples();
        samples.is_integer().then(|| samples.to_usize()).flatten()
    }
}

pub(crate) fn milliseconds(seconds: &Number) -> Number {
    Number::exact(seconds.value() * ratio(1000, 1))
}

/// Every linearised loop of the family decays at a rate when the controller is sampled and delayed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledClaim {
    /// How it is sampled, and up to which delay it decays at the rate.
    pub sampling: LoopTiming,
    /// Certified decay rate at every such delay, 1/s.
    pub rate_per_s: Number,
    /// Up to this delay, s, it is still stable.
    pub delay_margin_s: Number,
    /// How far single bounds of the family may be moved, at the delays of `sampling`, before stability is no longer certified.
    pub margins: Vec<Variation>,
}

impl Provable for SampledClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Sampled
    }

    fn sentence(&self, document: &Document) -> String {
        let delays = self.sampling.delays(&self.sampling.delay_s);
        format!(
            "linearised at rest at {} and {}, the loop is exponentially stable with {delays}, every mode decaying faster than exp(-{} t), t in s; and \
             stable with {}{}",
            any_configuration(document),
            self.sampling.in_words(),
            self.rate_per_s,
            self.sampling.delays(&self.delay_margin_s),
            stays_stable(document, &self.margins, Some(&delays))
        )
    }

    fn scope(&self, _: &Document) -> String {
        "the controller's own Euler step, no torque limit, no delay that changes from sample to sample, no noise, no Coulomb friction, joint \
         limits not modelled"
            .to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        let own = [
            Figure { name: "delay margin", value: milliseconds(&self.delay_margin_s), unit: "ms" },
            Figure { name: "rate", value: self.rate_per_s.clone(), unit: "1/s" },
        ];
        own.into_iter().chain(self.margins.iter().map(Variation::figure)).collect()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        self.sampling.check()?;
        require_positive("rate_per_s", &self.rate_per_s)?;
        require_at_least_zero("delay_margin_s", &self.delay_margin_s)?;
        let wider = self.delay_margin_s.value() >= self.sampling.delay_s.value();
        require("delay_margin_s", &self.delay_margin_s, wider, "a number no smaller than delay_s")?;
        let loops = SampledFamily::new(document.gains.aic()?, &self.sampling.period_s)?;
        let decays = |range: &LoopBox, delay: &BigRational, rate: &BigRational| {
            loops.decays_on(self.sampling.plant, range, delay, rate).map_err(|reason| Flaw::Polynomial { reason })
        };
        let (delay, at_rest) = (self.sampling.delay_samples(), BigRational::zero());
        let margin = LoopTiming { delay_s: self.delay_margin_s.clone(), ..self.sampling.clone() }.delay_samples();
        decays(&family_box(document), &delay, self.rate_per_s.value())?;
        decays(&family_box(document), &margin, &at_rest)?;
        varied(document, &self.margins, &|range| decays(range, &delay, &at_rest))?;
        Ok(Vec::new())
    }
}
