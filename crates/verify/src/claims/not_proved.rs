//! A claim that was neither proved nor refuted.

use serde::{Deserialize, Serialize};

use super::refused::{check_remedies, linearised_loop};
use super::sampled::{LoopTiming, milliseconds};
use super::variation::{Variation, would_be_stable};
use super::{ClaimKind, Inequality, Provable, family_box};
use crate::document::Document;
use crate::error::Flaw;
use crate::gains::{Gains, MracLaw};
use crate::number::Number;
use crate::quantity::require_plain;

/// A claim that was neither proved nor refuted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotProvedClaim {
    /// Which claim was attempted.
    pub of: ClaimKind,
    /// How the loop was to be sampled, when the claim was `sampled`.
    pub sampling: Option<LoopTiming>,
    /// How far the inequalities are from feasible in the solver's units; positive is infeasible.
    pub distance: Option<Number>,
    /// Why no proof was attempted or found.
    pub reason: Reason,
    /// Changes of the family with which every linearised loop is stable, each checked exactly.
    pub remedies: Vec<Variation>,
}

/// Why there is neither a proof nor a counterexample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The proof needs the same gains on every joint.
    UnequalGains,
    /// The claim is about the other controller.
    OtherController,
    /// The proof needs a constant that is not known for this family.
    ConstantMissing,
    /// The released code's adaptation is not the one of the equations.
    ReleasedCode,
    /// The proof does not cover families of this kind.
    FamilyNotCovered,
    /// Stable, but too slowly for the rates that are tried.
    TooSlow,
    /// The box is not shown stable, and no unstable point of it was found.
    NoPointFound,
    /// The solver found no Lyapunov function.
    Infeasible,
    /// What the solver found did not pass the exact check.
    CandidateFailed,
    /// An arm of the family was found outside the stated constants.
    ConstantsContradicted,
    /// A number of the problem is too large or too small to work with.
    OutOfRange,
}

impl Reason {
    /// In words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::UnequalGains => "this claim needs the same gains on every joint",
            Self::OtherController => "this claim is about the other controller",
            Self::ConstantMissing => "the proof needs a constant that is not known for this family",
            Self::ReleasedCode => {
                "in the released code the integrals of the adaptation lack the step and K1 reads the sum of K0: the adaptive blocks are not lossless, \
                 and the proof does not apply"
            }
            Self::FamilyNotCovered => "the proof does not cover families of this kind",
            Self::TooSlow => {
                "the loops of the box of the stated constants are stable, but no rate of at least 0.001 per s was certified"
            }
            Self::NoPointFound => "the box was not shown stable, and no unstable point of it was found",
            Self::Infeasible => {
                "no Lyapunov function of the claim's form was found, and no counterexample was searched"
            }
            Self::CandidateFailed => "the solver's candidates did not pass the exact check",
            Self::ConstantsContradicted => {
                "a search in floating point, which is not checked, reported an arm of the family outside the stated constants: nothing is claimed"
            }
            Self::OutOfRange => "a number of the problem is too large or too small to be worked with",
        }
    }
}

impl NotProvedClaim {
    /// What a reason says of the loops or the gains is checked; the others speak of a search that led nowhere.
    fn check_reason(&self, document: &Document) -> Result<(), Flaw> {
        let of_adaptive =
            matches!(self.of, ClaimKind::AdaptiveConvergence | ClaimKind::PiExponential | ClaimKind::AdaptiveSampled);
        let borne_out = match (self.reason, &document.gains) {
            (Reason::TooSlow, _) => {
                return linearised_loop(document, self.of, self.sampling.as_ref())?.stable_on(&family_box(document));
            }
            (Reason::OtherController, Gains::Aic(_)) => of_adaptive,
            (Reason::OtherController, Gains::Mrac(_)) => !of_adaptive,
            (Reason::UnequalGains, Gains::Aic(gains)) => gains.shared_by_all().is_err(),
            (Reason::UnequalGains, Gains::Mrac(_)) | (Reason::ReleasedCode, Gains::Aic(_)) => false,
            (Reason::ReleasedCode, Gains::Mrac(gains)) => gains.law == MracLaw::ReleasedCode,
            (
                Reason::ConstantMissing
                | Reason::FamilyNotCovered
                | Reason::NoPointFound
                | Reason::Infeasible
                | Reason::CandidateFailed
                | Reason::ConstantsContradicted
                | Reason::OutOfRange,
                _,
            ) => true,
        };
        if borne_out {
            Ok(())
        } else {
            Err(Flaw::quantity("reason", self.reason.in_words(), "one that the gains bear out"))
        }
    }
}

impl Provable for NotProvedClaim {
    fn kind(&self) -> ClaimKind {
        self.of
    }

    fn sentence(&self, document: &Document) -> String {
        let distance = self
            .distance
            .as_ref()
            .map(|d| format!(" Distance to feasibility as the solver reported it: {d} in its units."))
            .unwrap_or_default();
        let sampled = self
            .sampling
            .as_ref()
            .map(|s| format!(", {}, with delays up to {} ms", s.in_words(), milliseconds(&s.delay_s)))
            .unwrap_or_default();
        let remedies = would_be_stable(document, &self.remedies, self.sampling.as_ref());
        format!("Not proved ({}{sampled}): {}.{distance}{remedies}", self.of.name(), self.reason.in_words())
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        if let Some(sampling) = &self.sampling {
            sampling.check()?;
        }
        self.check_reason(document)?;
        check_remedies(document, self.of, self.sampling.as_ref(), &self.remedies)?;
        if let Some(distance) = &self.distance {
            require_plain("distance", distance)?;
        }
        Ok(Vec::new())
    }
}
