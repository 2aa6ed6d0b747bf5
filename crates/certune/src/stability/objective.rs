//! Certified figures as goals of a search.
//!
//! The figure is the checked one: slack that a solver leaves in its answer is worth nothing here.

use certune_closed_loop::Gains;
use certune_tune::{Goal, Prover};
use certune_verify::{Certificate, ClaimKind, Verdict};

use super::arm::ArmCertifier;

/// The claim that proves a goal, and the name of the figure in it; none for a goal that is not proved.
const fn claim_of(goal: Goal) -> Option<(ClaimKind, &'static str)> {
    match goal {
        Goal::CertifiedRate => Some((ClaimKind::Exponential, "rate")),
        Goal::CertifiedRadius => Some((ClaimKind::Region, "radius")),
        _ => None,
    }
}

/// The figure of that name in a claim that holds.
fn figure(certificate: &Certificate, (claim, name): (ClaimKind, &'static str)) -> Option<f64> {
    let entries = certificate.document().claims.iter().zip(certificate.checked());
    let found = entries.filter(|(entry, checked)| checked.verdict == Verdict::Holds && entry.claim.kind() == claim);
    let mut figures = found.flat_map(|(entry, _)| entry.claim.figures());
    figures.find(|figure| figure.name == name).map(|figure| figure.value.to_f64())
}

/// Figures of the active inference controller; the adaptive one has neither.
impl<const N: usize> Prover for ArmCertifier<N> {
    fn figures(&self, gains: &Gains, goals: &[Goal]) -> Option<Vec<f64>> {
        let claims: Vec<(ClaimKind, &'static str)> = goals.iter().map(|goal| claim_of(*goal)).collect::<Option<_>>()?;
        let mut kinds: Vec<ClaimKind> = claims.iter().map(|(kind, _)| *kind).collect();
        kinds.dedup();
        let Gains::Aic(table) = gains else { return None };
        let certificate = self.certify(&table.bind().ok()?, &kinds).ok()?;
        claims.into_iter().map(|claim| figure(&certificate, claim)).collect()
    }
}
