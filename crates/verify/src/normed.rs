//! A proved region whose Lyapunov function is the square of a norm, for claims that rest on one.
//!
//! Where gravity is compensated, `V(q, dq, z)` is at every configuration `q` a positive definite quadratic form in `(dq, z)`, so `sqrt V` is a
//! norm there. A goal that moves by `delta` changes neither `q` nor `dq`, and `z` by `-X (x) delta` with `X = (1, 1, 0, 0, 0)` in
//! `(e, m, mu', mu'', u~)`; the length of that change is the root of `sum_i s_i delta_i^2`, `s_i = X'S_i X`.

use num_rational::BigRational;

use crate::claims::{Claim, Inequality};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::Number;

/// The norm of a region and how it shrinks.
#[derive(Clone, Debug)]
pub struct Norm {
    /// `s_i` of each joint, 1/rad^2: a goal moved by `delta` moves the state by at most the root of `sum_i s_i delta_i^2`.
    pub shift_weights: Vec<BigRational>,
    /// `sqrt V` shrinks at least as `exp(-rate t)`, or by `1 - rate h` each sample, 1/s.
    pub rate: BigRational,
    /// The sampling step h, s, where V is a function of the state at sample instants; none in continuous time.
    pub period: Option<BigRational>,
    /// Each joint stays this close to its goal, rad, when the claim says so.
    pub kept: Option<Vec<Number>>,
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
        Some(Claim::JointRegion(claim)) => Ok(claim.as_ref()),
        Some(Claim::SampledRegion(claim)) => Ok(claim.as_ref()),
        _ => Err(none()),
    }
}

/// The norm of the region that the entry `index` of a document, counted from 1, proves.
///
/// # Errors
/// [`Flaw`] when there is no such entry, it proves no region, or its V is no norm for every goal.
pub fn region_norm(document: &Document, index: usize) -> Result<Norm, Flaw> {
    region_before(document, document.claims.len(), index)?.norm(document)
}
