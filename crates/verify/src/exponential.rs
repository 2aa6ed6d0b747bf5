//! Claim `exponential`: every linearised loop whose inertia, friction and gravity stiffness lie in a box decays at a rate.
//!
//! Linearised at rest the loop of an n-joint arm has eigenpairs `(s, v)`; projected on its own joint vector `v` each of them
//! is an eigenpair of the one-joint loop `A6(m, d, g)` with the real numbers `m = v*Mv, d = v*Dv, g = v*Gv` (`|v| = 1`). So it is enough that
//!
//! ```text
//! p(s; m, d, g) = m det(s I - A6(m, d, g)),   degree 6, affine in (m, d, g)
//! ```
//!
//! has all roots left of `-rate` on the whole box. By the edge theorem (Bartlett, Hollot, Huang 1988) the twelve edges of the box
//! settle that. On an edge, from one stable end, a root can only cross the imaginary axis (after the shift `s -> s - rate`) where the
//! constant coefficient or the Hurwitz determinant of order 5 vanishes: the first is affine, the second a polynomial of degree
//! at most 5 in the edge's parameter, whose roots in [0, 1] a Sturm sequence counts. The full derivation, with the case `v = 0`, is in
//! `proofs/claims/exponential.md`.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Signed;

use crate::aic::SharedGains;
use crate::algebra::{Polynomial, characteristic_polynomial, common_integers, hurwitz_determinant, is_hurwitz, zeros};
use crate::number::{Number, positive};

const DEGREE: usize = 6;

/// Ranges of inertia (kg m^2), viscous friction (N m s/rad) and gravity stiffness (N m/rad), each `[lower, upper]`.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopBox {
    /// Eigenvalues of the joint-space inertia, kg m^2.
    pub inertia: [Number; 2],
    /// Viscous friction, N m s/rad.
    pub friction: [Number; 2],
    /// Eigenvalues of the gravity stiffness, N m/rad.
    pub stiffness: [Number; 2],
}

impl LoopBox {
    /// Whether the box holds the point (inertia, friction, stiffness).
    pub fn contains(&self, [m, d, g]: [&BigRational; 3]) -> bool {
        let within = |range: &[Number; 2], x: &BigRational| range[0].value() <= x && x <= range[1].value();
        within(&self.inertia, m) && within(&self.friction, d) && within(&self.stiffness, g)
    }
}

/// Coefficients of `p(s - rate; m, d, g)` from the highest power down; the first is `m`.
fn shifted_polynomial(gains: &SharedGains, [m, d, g]: [&BigRational; 3], rate: &BigRational) -> Vec<BigRational> {
    let controller = gains.matrices();
    // States e, dq, m, mu', mu'', u~: the controller's five with dq inserted after e.
    let place = |k: usize| if k == 0 { 0 } else { k + 1 };
    let mut a = zeros(DEGREE);
    for (i, row) in controller.a.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            a[place(i)][place(j)].clone_from(entry);
        }
        a[place(i)][1].clone_from(&controller.b[i]);
    }
    a[1][0] = -g / m;
    a[1][1] = -d / m;
    a[1][5] = m.recip();
    for (k, row) in a.iter_mut().enumerate() {
        row[k] += rate;
    }
    characteristic_polynomial(&a).into_iter().map(|c| c * m).collect()
}

/// Whether the one-joint loop at `(m, d, g)` decays faster than `exp(-rate t)`. Exact; `m` must be positive.
pub fn is_stable_at(gains: &crate::AicGains, [m, d, g]: [&BigRational; 3], rate: &BigRational) -> bool {
    positive(m)
        && gains.shared(gains.kappa_mu.len()).is_ok_and(|shared| {
            let polynomial = common_integers(&[shifted_polynomial(&shared, [m, d, g], rate)]);
            polynomial.iter().all(|p| is_hurwitz(p))
        })
}

/// Whether every linearised loop of the document's family decays faster than `exp(-rate t)`, by exact arithmetic.
///
/// # Errors
/// Where the proof stops, in words.
pub fn loop_box_decays(document: &crate::Document, rate: &BigRational) -> Result<(), String> {
    let shared = document.gains.shared(document.arm.joints).map_err(|e| e.to_string())?;
    decays(&shared, &crate::check::family_box(document), rate)
}

pub(crate) fn decays(gains: &SharedGains, range: &LoopBox, rate: &BigRational) -> Result<(), String> {
    let axes = [&range.inertia, &range.friction, &range.stiffness];
    if axes.iter().any(|[lower, upper]| lower.value() > upper.value()) {
        return Err("the box is empty".to_owned());
    }
    if !positive(range.inertia[0].value()) {
        return Err("the box reaches inertia 0, where the degree drops".to_owned());
    }
    // Corner k has bit j set where axis j is at its upper end.
    let corners: Vec<_> = (0..8_usize)
        .map(|k| shifted_polynomial(gains, [0, 1, 2].map(|j| axes[j][(k >> j) & 1].value()), rate))
        .collect();
    // One factor for all corners: edges join polynomials in their true proportions.
    let corners = common_integers(&corners);
    if !is_hurwitz(&corners[0]) {
        return Err("the loop of the least inertia, friction and stiffness does not decay at this rate".to_owned());
    }
    for from in 0..8_usize {
        for (j, axis) in axes.iter().enumerate() {
            if from >> j & 1 == 1 || axis[0].value() == axis[1].value() {
                continue;
            }
            let to = from | 1 << j;
            if !edge_is_stable(&corners[from], &corners[to]) {
                let name = ["inertia", "friction", "stiffness"][j];
                return Err(format!("a root reaches the boundary along an edge of the box in {name}"));
            }
        }
    }
    Ok(())
}

/// Whether no polynomial between two of equal positive leading sign has a root on the imaginary axis.
fn edge_is_stable(from: &[BigInt], to: &[BigInt]) -> bool {
    let both_positive = |index: usize| from[index].is_positive() && to[index].is_positive();
    if !both_positive(0) || !both_positive(DEGREE) {
        return false;
    }
    let values: Vec<BigInt> = (0..DEGREE)
        .map(|node| {
            let p: Vec<BigInt> = from.iter().zip(to).map(|(a, b)| a + (b - a) * node).collect();
            hurwitz_determinant(&p, DEGREE - 1)
        })
        .collect();
    Polynomial::through(&values).has_no_root_in_unit_interval()
}
