//! A proved region whose Lyapunov function is the square of a norm, for claims that rest on one.
//!
//! Where gravity is compensated, `V(q, dq, z)` is at every configuration `q` a positive definite quadratic form in `(dq, z)`, so `sqrt V` is a
//! norm there. A goal that moves by `delta` changes neither `q` nor `dq`, and `z` by `-X (x) delta` with `X = (1, 1, 0, 0, 0)` in
//! `(e, m, mu', mu'', u~)`; the length of that change is the root of `sum_i s_i delta_i^2`, `s_i = X'S_i X`.

use num_rational::BigRational;

use crate::claims::{Claim, Inequality, RegionClaim, RegionProblem, State};
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;

/// The norm of a region and how it shrinks.
#[derive(Clone, Debug)]
pub(crate) struct Norm {
    /// `s_i` of each joint, 1/rad^2: a goal moved by `delta` moves the state by at most the root of `sum_i s_i delta_i^2`.
    pub(crate) shift_weights: Vec<BigRational>,
    /// `sqrt V` shrinks at least as `exp(-rate t)`, or by `1 - rate h` each sample, 1/s.
    pub(crate) rate: BigRational,
    /// The sampling step h, s, where V is a function of the state at sample instants; none in continuous time.
    pub(crate) period: Option<BigRational>,
}

/// A claim about the set `{V <= 1}` that holds for a constant goal and stays meaningful when the goal changes.
pub(crate) trait Normed {
    /// The norm, if the proof makes `sqrt V` one for every goal.
    ///
    /// # Errors
    /// [`Flaw`] where it does not.
    fn norm(&self, document: &Document) -> Result<Norm, Flaw>;

    /// What shows that `V <= 1` implies `|e| <= most` (2-norm over the joints).
    ///
    /// # Errors
    /// [`Flaw`] when the numbers are outside what the proof allows.
    fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw>;
}

/// The region that the entry `index`, counted from 1, proves; it must stand before the entry at `position`, counted from 0.
pub(crate) fn region_before(document: &Document, position: usize, index: usize) -> Result<&dyn Normed, Flaw> {
    let none = || Flaw::quantity("region", &index.to_string(), "the number of an earlier entry that proves a region");
    let earlier = document.claims.get(..position).unwrap_or_default();
    match index.checked_sub(1).and_then(|index| earlier.get(index)).map(|entry| &entry.claim) {
        Some(Claim::Region(claim)) => Ok(claim.as_ref()),
        _ => Err(none()),
    }
}

/// A region's V is a norm for every goal only where gravity is compensated and no set of configurations has to be kept.
pub(crate) fn require_norm(document: &Document) -> Result<(), Flaw> {
    if !document.family.gravity_compensation {
        return Err(Flaw::NotCovered { what: "an arm whose gravity is not compensated" });
    }
    match document.constants.over {
        ConfigurationSet::AllAngles => Ok(()),
        ConfigurationSet::Box { .. } => Err(Flaw::NotCovered { what: "constants that hold in a box only" }),
    }
}

impl Normed for RegionClaim {
    fn norm(&self, document: &Document) -> Result<Norm, Flaw> {
        require_norm(document)?;
        let weight = self.start_weight(document)?;
        let rate = self.rate_per_s.value().clone();
        Ok(Norm { shift_weights: vec![weight; document.arm.joints], rate, period: None })
    }

    fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw> {
        let problem = RegionProblem::new(document)?;
        let point = self.checked(document, &problem)?;
        let inverse_square = (most * most).recip();
        let ends = problem.inertia.iter().zip(["least", "largest"]);
        Ok(ends
            .map(|(m, end)| {
                let form = problem.within(&point, m, State::Position, &inverse_square);
                Inequality::decide(format!("distance at the {end} inertia"), &form.0)
            })
            .collect())
    }
}
