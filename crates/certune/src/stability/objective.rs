//! A certified figure of the active inference controller as the objective of a search.
//!
//! A candidate goes through the stability filter first (linearised loops, continuous and sampled, on a fixed sample), so that a search for the best
//! continuous-time figure does not end at gains that no sampled controller can have. What passes is certified; the cost is the inverse of the
//! certified figure. The figure is the checked one: slack that a solver leaves in its answer is worth nothing here.

use certune_closed_loop::{Gains, Scenario};
use certune_control::aic::AicParams;
use certune_dynamics::Robot;
use certune_tune::{BatchError, Finite, Objective, ObjectiveName, Outcome, StabilityFilter};
use certune_verify::{Certificate, ClaimKind, Verdict};

use super::arm::ArmCertifier;

/// The largest certified rate or radius, as an objective. The adaptive controller has neither: its gains count as no controller.
#[derive(Debug)]
pub struct CertifiedObjective<'a, const N: usize> {
    certifier: &'a ArmCertifier<N>,
    filter: StabilityFilter<N>,
    step_s: f64,
    claim: ClaimKind,
    figure: &'static str,
}

impl<'a, const N: usize> CertifiedObjective<'a, N> {
    /// The objective of that name, on the certifier's family; `None` for the settling cost, which is simulated.
    ///
    /// # Errors
    /// [`BatchError`] when robot and scenario do not fit each other or `N`.
    pub fn new(
        name: ObjectiveName,
        certifier: &'a ArmCertifier<N>,
        (robot, scenario): (&Robot, &Scenario),
        seed: u64,
        filter_samples: usize,
    ) -> Result<Option<Self>, BatchError> {
        let (claim, figure) = match name {
            ObjectiveName::SettlingCost => return Ok(None),
            ObjectiveName::CertifiedRate => (ClaimKind::Exponential, "rate"),
            ObjectiveName::CertifiedRadius => (ClaimKind::Region, "radius"),
        };
        let task = scenario.bind(robot)?;
        let filter = StabilityFilter::new(robot, scenario, &task, seed, filter_samples)?;
        Ok(Some(Self { certifier, filter, step_s: task.step_s, claim, figure }))
    }

    /// The certified figure, if the claim holds.
    fn certified(&self, certificate: &Certificate) -> Option<f64> {
        let entries = certificate.document().claims.iter().zip(certificate.checked());
        let holding = |verdict| verdict == Verdict::Holds;
        let found = entries.filter(|(entry, checked)| holding(checked.verdict) && entry.claim.kind() == self.claim);
        let mut figures = found.flat_map(|(entry, _)| entry.claim.figures());
        figures.find(|figure| figure.name == self.figure).map(|figure| figure.value.to_f64())
    }
}

impl<const N: usize> Objective for CertifiedObjective<'_, N> {
    // A certificate is all or nothing: it cannot be given up half way.
    fn evaluate(&self, gains: &Gains, _: Option<Finite>) -> Outcome {
        let bound = match gains {
            Gains::Aic(table) => table.bind().ok(),
            Gains::Mrac(_) => None,
        };
        let Some((gains, params)) = bound.and_then(|gains| Some((gains, AicParams::new(&gains, self.step_s).ok()?)))
        else {
            return Outcome::Diverged { at_s: Finite::saturating(0.0) };
        };
        let growth_per_s = self.filter.growth_per_s(&params);
        if growth_per_s.get() >= 0.0 {
            return Outcome::Unstable { abscissa_per_s: growth_per_s };
        }
        let certificate = self.certifier.certify(&gains, &[self.claim]);
        match certificate.ok().and_then(|certificate| self.certified(&certificate)) {
            Some(figure) => Outcome::Certified { cost: Finite::saturating(figure.recip()) },
            None => Outcome::Uncertified { cost: Finite::saturating(-growth_per_s.get().recip()) },
        }
    }
}
