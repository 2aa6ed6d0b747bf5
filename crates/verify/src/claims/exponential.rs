//! Claim `exponential`: every linearised loop whose inertia, friction and gravity stiffness lie in a box decays at a rate.
//!
//! Linearised at rest the loop of an n-joint arm has eigenpairs `(s, v)`; projected on its own joint vector `v` each of them
//! is an eigenpair of the one-joint loop `A6(m, d, g)` with the real numbers `m = v*Mv, d = v*Dv, g = v*Gv` (`|v| = 1`). So it is enough that
//!
//! ```text
//! p(s; m, d, g) = m det(s I - A6(m, d, g)),   degree 6, affine in (m, d, g)
//! ```
//!
//! has all roots left of `-rate` on the whole box, which [`polytope`](crate::polytope) decides from the twelve edges after the shift
//! `s -> s - rate`. The full derivation, with the case `v = 0`, is in `proofs/claims/exponential.md`.

use num_rational::BigRational;
use num_traits::Zero;
use serde::{Deserialize, Serialize};

use super::variation::{Variation, stays_stable, varied};
use super::{CONTINUOUS, ClaimKind, Figure, Inequality, Provable};
use crate::aic::{AicGains, SharedGains};
use crate::algebra::{characteristic_polynomial, zeros};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::{Number, positive};
use crate::polytope::{AffineFamily, BoxFlaw};
use crate::quantity::require_positive;
use crate::statement::any_configuration;

const DEGREE: usize = 6;

/// Every linearised loop of the family decays at a rate.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExponentialClaim {
    /// Certified decay rate, 1/s.
    pub rate_per_s: Number,
    /// How far single bounds of the family may be moved before stability is no longer certified.
    pub margins: Vec<Variation>,
}

impl Provable for ExponentialClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Exponential
    }

    fn sentence(&self, document: &Document) -> String {
        format!(
            "linearised at rest at {}, the loop is exponentially stable, every mode decaying faster than exp(-{} t), t in s{}",
            any_configuration(document),
            self.rate_per_s,
            stays_stable(document, &self.margins, None)
        )
    }

    fn scope(&self, _: &Document) -> String {
        CONTINUOUS.to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        let rate = Figure { name: "rate", value: self.rate_per_s.clone(), unit: "1/s" };
        std::iter::once(rate).chain(self.margins.iter().map(Variation::figure)).collect()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        require_positive("rate_per_s", &self.rate_per_s)?;
        let loops = LoopFamily::new(document.gains.aic()?)?;
        let decays = |range: &LoopBox, rate: &BigRational| {
            loops.decays_on(range, rate).map_err(|reason| Flaw::Polynomial { reason })
        };
        decays(&family_box(document), self.rate_per_s.value())?;
        varied(document, &self.margins, &|range| decays(range, &BigRational::zero()))?;
        Ok(Vec::new())
    }
}

/// The box of linearised loops that the family's constants span.
pub fn family_box(document: &Document) -> LoopBox {
    let bounds = &document.constants.bounds;
    let stiffness = if document.family.gravity_compensation { Number::zero() } else { bounds.k_g_n_m_per_rad.clone() };
    LoopBox {
        inertia: [bounds.m_lo_kg_m2.clone(), bounds.m_hi_kg_m2.clone()],
        friction: document.family.friction_hull(),
        stiffness: [stiffness.negated(), stiffness],
    }
}

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

/// The polynomials `p(s; m, d, g) = p_0(s) + m p_m(s) + d p_d(s) + g p_g(s)` of all one-joint loops of one set of gains.
#[derive(Clone, Debug)]
pub struct LoopFamily {
    /// p_0, p_m, p_d, p_g, coefficients from the highest power of s down.
    parts: Vec<Vec<BigRational>>,
}

impl LoopFamily {
    /// The loops of these gains.
    ///
    /// # Errors
    /// [`Flaw`] when a gain is missing, not positive, or not the same on every joint.
    pub fn new(gains: &AicGains) -> Result<Self, Flaw> {
        let shared = gains.shared(gains.kappa_mu.len())?;
        let at = |m: i64, d: i64, g: i64| polynomial(&shared, [m, d, g].map(|x| BigRational::from_integer(x.into())));
        let minus = |x: &[BigRational], y: &[BigRational]| x.iter().zip(y).map(|(x, y)| x - y).collect::<Vec<_>>();
        // Affine in (m, d, g), and m must not vanish: four points tell the four parts.
        let unit = at(1, 0, 0);
        let by_inertia = minus(&at(2, 0, 0), &unit);
        let (by_friction, by_stiffness) = (minus(&at(1, 1, 0), &unit), minus(&at(1, 0, 1), &unit));
        Ok(Self { parts: vec![minus(&unit, &by_inertia), by_inertia, by_friction, by_stiffness] })
    }

    /// The four parts after the substitution `s -> s - rate`.
    fn shifted(&self, rate: &BigRational) -> AffineFamily {
        let shift = |part: &Vec<BigRational>| {
            let mut p = part.clone();
            // Repeated synthetic division at -rate (Taylor shift).
            for last in (1..p.len()).rev() {
                for k in 1..=last {
                    let carried = &p[k - 1] * rate;
                    p[k] -= carried;
                }
            }
            p
        };
        AffineFamily::new(&self.parts.iter().map(shift).collect::<Vec<_>>())
    }

    /// Whether the one-joint loop at (inertia, friction, stiffness) decays faster than `exp(-rate t)`. Exact.
    pub fn is_stable_at(&self, point: [&BigRational; 3], rate: &BigRational) -> bool {
        positive(point[0]) && self.shifted(rate).is_hurwitz_at(&point)
    }

    /// Whether every loop of the box decays faster than `exp(-rate t)`, by exact arithmetic.
    ///
    /// # Errors
    /// Where the proof stops, in words.
    pub fn decays_on(&self, range: &LoopBox, rate: &BigRational) -> Result<(), String> {
        if !positive(range.inertia[0].value()) {
            return Err("the box reaches inertia 0, where the degree drops".to_owned());
        }
        let ranges =
            [&range.inertia, &range.friction, &range.stiffness].map(|ends| ends.each_ref().map(|x| x.value().clone()));
        self.shifted(rate).is_hurwitz_on(&ranges).map_err(|flaw| in_words(flaw, &["inertia", "friction", "stiffness"]))
    }
}

/// Where the proof about a box stops, in words.
pub(crate) fn in_words(flaw: BoxFlaw, axes: &[&str]) -> String {
    match flaw {
        BoxFlaw::Empty => "the box is empty".to_owned(),
        BoxFlaw::FirstCorner => {
            "the loop of the least inertia, friction and stiffness does not decay at this rate".to_owned()
        }
        BoxFlaw::Ends => "a root reaches the boundary on the real axis".to_owned(),
        BoxFlaw::Edge(axis) => {
            let name = axes.get(axis).copied().unwrap_or("a parameter");
            format!("a root reaches the boundary along an edge of the box in {name}")
        }
    }
}

/// Coefficients of `p(s; m, d, g) = m det(s I - A6)` from the highest power down; the first is `m`, which must not be 0.
fn polynomial(gains: &SharedGains, [m, d, g]: [BigRational; 3]) -> Vec<BigRational> {
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
    a[1][0] = -g / &m;
    a[1][1] = -d / &m;
    a[1][5] = m.recip();
    characteristic_polynomial(&a).into_iter().map(|c| c * &m).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::ratio;
    use proptest::prelude::*;

    fn gains(values: [u32; 7]) -> AicGains {
        let list = |k: usize| vec![format!("{}.{}", values[k] / 10, values[k] % 10).parse().unwrap()];
        AicGains {
            kappa_mu: list(0),
            kappa_a: list(1),
            sigma_q: list(2),
            sigma_dq: list(3),
            sigma_mu: list(4),
            sigma_dmu: list(5),
            reference_time_constant_s: list(6),
        }
    }

    proptest! {
        /// The parts and the shift against the determinant itself, at random points and rates.
        #[test]
        fn the_family_is_the_determinant(values in prop::array::uniform7(1_u32..300), point in (1_i64..90, 0_i64..90, -90_i64..90), rate in 0_i64..30) {
            let gains = gains(values);
            let shared = gains.shared(1).unwrap();
            let [m, d, g] = [point.0, point.1, point.2].map(|x| ratio(x, 7));
            let rate = ratio(rate, 11);
            let family = LoopFamily::new(&gains).unwrap();
            let shifted = family.shifted(&rate).at(&[&m, &d, &g]);
            let direct = polynomial(&shared, [m, d, g]);
            let value = |p: &[BigRational], s: &BigRational| p.iter().fold(ratio(0, 1), |sum, c| sum * s + c);
            let shifted: Vec<_> = shifted.into_iter().map(BigRational::from_integer).collect();
            let factor = &shifted[0] / &direct[0];
            prop_assert!(positive(&factor));
            for s in 0..8 {
                let s = ratio(s, 3);
                prop_assert_eq!(value(&shifted, &s), &factor * value(&direct, &(&s - &rate)));
            }
        }
    }
}
