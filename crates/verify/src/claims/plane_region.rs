//! Regions of the complex plane, and the matrix inequality that keeps eigenvalues in one.
//!
//! A region is the set of z with `L + z M + conj(z) M' < 0` for real L = L', M. If P > 0 and, with (x) the Kronecker product,
//!
//! ```text
//! F(P, A) = L (x) P + M (x) (P A) + M' (x) (A'P) < 0
//! ```
//!
//! then an eigenpair `A v = z v` gives `(I (x) v)* F (I (x) v) = (v*Pv)(L + z M + conj(z) M') < 0`: z lies in the region.
//!
//! | region | L | M |
//! |---|---|---|
//! | half plane `Re z < -rate` | 2 rate | 1 |
//! | disk `\|z - centre\| < radius` | `[[-radius, -centre], [., -radius]]` | `[[0, 1], [0, 0]]` |
//! | sector `\|Im z\| < slope \|Re z\|, Re z < 0` | 0 | `[[slope, 1], [-1, slope]]` |
//!
//! Source: M. Chilali and P. Gahinet, "H-infinity design with pole placement constraints: an LMI approach", IEEE TAC 41(3), 1996.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Zero;
use serde::{Deserialize, Serialize};

use crate::algebra::{Matrix, zeros};
use crate::definite::{Integers, whole};
use crate::error::Flaw;
use crate::number::{Number, ratio};
use crate::quantity::{require_at_least_zero, require_plain, require_positive};

/// A part of the complex plane.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum PlaneRegion {
    /// `Re z < -rate`.
    HalfPlane {
        /// 1/s, at least 0.
        rate_per_s: Number,
    },
    /// `|z - centre| < radius`.
    Disk {
        /// On the real axis.
        centre: Number,
        /// Positive.
        radius: Number,
    },
    /// `|Im z| < slope |Re z|` and `Re z < 0`.
    Sector {
        /// Tangent of the half angle, positive.
        slope: Number,
    },
}

impl PlaneRegion {
    pub(super) fn check(&self) -> Result<(), Flaw> {
        match self {
            Self::HalfPlane { rate_per_s } => require_at_least_zero("rate_per_s", rate_per_s),
            Self::Disk { centre, radius } => {
                require_plain("centre", centre)?;
                require_positive("radius", radius)
            }
            Self::Sector { slope } => require_positive("slope", slope),
        }
    }

    pub(super) fn in_words(&self) -> String {
        match self {
            Self::HalfPlane { rate_per_s } => format!("Re z < -{rate_per_s}"),
            Self::Disk { centre, radius } => format!("|z - ({centre})| < {radius}"),
            Self::Sector { slope } => format!("Re z < 0, |Im z| < {slope} |Re z|"),
        }
    }

    /// L and M.
    fn parts(&self) -> [Matrix; 2] {
        let (zero, one) = (BigRational::zero, || ratio(1, 1));
        match self {
            Self::HalfPlane { rate_per_s } => [vec![vec![rate_per_s.value() * ratio(2, 1)]], vec![vec![one()]]],
            Self::Disk { centre, radius } => {
                let (c, r) = (-centre.value(), -radius.value());
                [vec![vec![r.clone(), c.clone()], vec![c, r]], vec![vec![zero(), one()], vec![zero(), zero()]]]
            }
            Self::Sector { slope } => {
                let k = || slope.value().clone();
                [zeros(2), vec![vec![k(), one()], vec![-one(), k()]]]
            }
        }
    }
}

/// `P A`.
pub(super) fn product(p: &Integers, a: &Integers) -> Integers {
    let order = p.len();
    let mut product = vec![vec![BigInt::zero(); order]; order];
    for (row, p) in product.iter_mut().zip(p) {
        for (p, a) in p.iter().zip(a) {
            if !p.is_zero() {
                for (entry, a) in row.iter_mut().zip(a).filter(|(_, a)| !a.is_zero()) {
                    *entry += p * a;
                }
            }
        }
    }
    product
}

/// A region's L and M in whole numbers, times the positive `unit`.
pub(super) struct WholeRegion {
    l: Integers,
    m: Integers,
    pub(super) unit: BigInt,
}

impl WholeRegion {
    pub(super) fn new(region: &PlaneRegion) -> Self {
        let parts = region.parts();
        let rows: Vec<Vec<Vec<_>>> =
            parts.iter().map(|part| part.iter().map(|row| row.iter().collect()).collect()).collect();
        let (mut both, unit) = whole(&rows);
        let m = both.pop().unwrap_or_default();
        Self { l: both.pop().unwrap_or_default(), m, unit }
    }

    /// `-F(P, A)` times the unit of the region, that of P and that of A, from the whole matrices `P` and `P A`.
    pub(super) fn inequality(&self, p: &Integers, a_unit: &BigInt, product: &Integers) -> Integers {
        let n = p.len();
        let mut form = vec![vec![BigInt::zero(); self.l.len() * n]; self.l.len() * n];
        for (r, row) in self.l.iter().enumerate() {
            for (c, weight) in row.iter().enumerate() {
                let weight = weight * a_unit;
                for i in 0..n {
                    for j in 0..n {
                        let terms =
                            [(&weight, &p[i][j]), (&self.m[r][c], &product[i][j]), (&self.m[c][r], &product[j][i])];
                        let entry = &mut form[r * n + i][c * n + j];
                        for (weight, x) in terms.into_iter().filter(|(weight, x)| !weight.is_zero() && !x.is_zero()) {
                            *entry -= weight * x;
                        }
                    }
                }
            }
        }
        form
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::slice::from_ref;
    use proptest::prelude::*;

    fn regions() -> Vec<PlaneRegion> {
        let number = |text: &str| text.parse::<Number>().unwrap();
        vec![
            PlaneRegion::HalfPlane { rate_per_s: number("0.3") },
            PlaneRegion::HalfPlane { rate_per_s: number("0") },
            PlaneRegion::Disk { centre: number("-0.7"), radius: number("5p-2") },
            PlaneRegion::Sector { slope: number("1.2") },
        ]
    }

    proptest! {
        /// Against the definition, entry by entry in fractions: `-(L_rc P + M_rc P A + M_cr A'P)`.
        #[test]
        fn whole_numbers_are_the_fractions_of_the_definition(
            a in prop::collection::vec((-50_i64..50, 1_i64..40), 9),
            p in prop::collection::vec((-50_i64..50, 0_u32..30), 6),
        ) {
            let a: Vec<BigRational> = a.iter().map(|&(n, d)| ratio(n, d)).collect();
            let p: Vec<BigRational> = p.iter().map(|&(n, k)| ratio(n, 1 << k)).collect();
            let a_rows: Vec<Vec<&BigRational>> = a.chunks(3).map(|row| row.iter().collect()).collect();
            let at = |i: usize, j: usize| &p[[0, 1, 3][i.min(j)] + i.max(j)];
            let p_rows: Vec<Vec<&BigRational>> = (0..3).map(|i| (0..3).map(|j| at(i, j)).collect()).collect();
            let ((whole_a, a_unit), (whole_p, p_unit)) = (whole(from_ref(&a_rows)), whole(from_ref(&p_rows)));
            let product = product(&whole_p[0], &whole_a[0]);
            for region in regions() {
                let whole_region = WholeRegion::new(&region);
                let form = whole_region.inequality(&whole_p[0], &a_unit, &product);
                let unit = &whole_region.unit * &a_unit * &p_unit;
                let [l, m] = region.parts();
                let times = |i: usize, j: usize| (0..3).map(|k| p_rows[i][k] * a_rows[k][j]).sum::<BigRational>();
                for (r, c, i, j) in (0..l.len()).flat_map(|r| (0..l.len()).flat_map(move |c| (0..9).map(move |k| (r, c, k / 3, k % 3)))) {
                    let entry = &l[r][c] * p_rows[i][j] + &m[r][c] * times(i, j) + &m[c][r] * times(j, i);
                    prop_assert_eq!(BigRational::new(form[r * 3 + i][c * 3 + j].clone(), unit.clone()), -entry);
                }
            }
        }
    }
}
