//! Claim `lyapunov`: every matrix of a polytope has its eigenvalues in a region of the plane.
//!
//! By the inequality `F(P, A) < 0` of the region ([`PlaneRegion`]) and `P > 0`. F is linear in A: one P that passes at the vertices passes on their hull, even when the matrix moves in it with time (half plane, disk about 0). One P for
//! each vertex, `P(w) = sum w_i P_i` at `A(w) = sum w_i A_i`, passes if `F(P_i, A_i) < 0` and `F(P_i, A_j) + F(P_j, A_i) < 0`, for constant weights.
//!
//! Source: M. Chilali and P. Gahinet, "H-infinity design with pole placement constraints: an LMI approach", IEEE TAC 41(3), 1996. The
//! derivation is in `proofs/claims/lyapunov.md`. Nothing here is about an arm: [`LyapunovClaim::inequalities`] needs no document.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use serde::{Deserialize, Serialize};

use super::plane_region::{PlaneRegion, WholeRegion, product};
use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::algebra::{characteristic_polynomial, common_integers, is_hurwitz, zeros};
use crate::definite::{Integers, whole};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::{Number, ratio};
use crate::quantity::{require, require_at_least_zero, require_length, require_plain};
use crate::statement::each;

/// Vertices beyond this make more matrices than anyone wants to wait for.
const MOST_VERTICES: usize = 16;
const LARGEST_ORDER: usize = 64;

/// The hull of some matrices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polytope {
    /// Square matrices of one order, row by row.
    pub vertices: Vec<Vec<Vec<Number>>>,
}

/// The Lyapunov matrix: upper triangles, row by row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum LyapunovWitness {
    /// One matrix for the whole polytope.
    Common {
        /// P.
        p: Vec<Number>,
    },
    /// One matrix for each vertex, for constant weights.
    Affine {
        /// P_i, in the order of the vertices.
        p: Vec<Vec<Number>>,
    },
}

/// Every matrix of a polytope has its eigenvalues in a region.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LyapunovClaim {
    /// The configuration whose linearised loop the matrices are, if they are one's, rad; computed in floating point, not checked.
    pub configuration_rad: Option<Vec<Number>>,
    /// The matrices.
    pub polytope: Polytope,
    /// The eigenvalues lie in all of these.
    pub regions: Vec<PlaneRegion>,
    /// The numbers that prove it.
    pub witness: LyapunovWitness,
}

/// One matrix of a polytope has an eigenvalue that is not in the region.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LyapunovRefusedClaim {
    /// The matrices.
    pub polytope: Polytope,
    /// A half plane or a disk.
    pub region: PlaneRegion,
    /// Weights of the vertices: not negative, with sum 1.
    pub weights: Vec<Number>,
}

impl Polytope {
    /// Rows of the matrices.
    ///
    /// # Errors
    /// [`Flaw`] unless there is at least one, all are square and of one order, within the limits.
    fn values(&self) -> Result<Vec<Vec<Vec<&BigRational>>>, Flaw> {
        let order = self.vertices.first().map_or(0, Vec::len);
        if order == 0 || order > LARGEST_ORDER || self.vertices.len() > MOST_VERTICES {
            return Err(Flaw::NotCovered { what: "a polytope without matrices, or with too many or too large ones" });
        }
        for vertex in &self.vertices {
            require_length("vertices", vertex.len(), order)?;
            for row in vertex {
                require_length("vertices", row.len(), order)?;
            }
        }
        Ok(self
            .vertices
            .iter()
            .map(|vertex| vertex.iter().map(|row| row.iter().map(Number::value).collect()).collect())
            .collect())
    }

    fn in_words(&self) -> String {
        let order = self.vertices.first().map_or(0, Vec::len);
        match self.vertices.len() {
            1 => format!("the file's matrix (order {order})"),
            vertices => format!("every matrix in the hull of the file's {vertices} matrices (order {order})"),
        }
    }
}

/// A symmetric matrix by its upper triangle.
fn symmetric(order: usize, triangle: &[Number]) -> Result<Vec<Vec<&BigRational>>, Flaw> {
    require_length("p", triangle.len(), order * (order + 1) / 2)?;
    let entry = |i: usize, j: usize| {
        let (first, second) = (i.min(j), i.max(j));
        triangle[first * (2 * order + 1 - first) / 2 + second - first].value()
    };
    Ok((0..order).map(|i| (0..order).map(|j| entry(i, j)).collect()).collect())
}

fn sum(mut a: Integers, b: &Integers) -> Integers {
    for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
        *a += b;
    }
    a
}

impl LyapunovClaim {
    /// The inequalities, whether they hold or not.
    ///
    /// # Errors
    /// [`Flaw`] when the matrices do not fit together or a region is none.
    pub fn inequalities(&self) -> Result<Vec<Inequality>, Flaw> {
        let vertices = self.polytope.values()?;
        let order = vertices[0].len();
        if self.regions.is_empty() {
            return Err(Flaw::NotCovered { what: "a claim without a region" });
        }
        for region in &self.regions {
            region.check()?;
        }
        let p = match &self.witness {
            LyapunovWitness::Common { p } => vec![symmetric(order, p)?],
            LyapunovWitness::Affine { p } => {
                require_length("p", p.len(), vertices.len())?;
                p.iter().map(|p| symmetric(order, p)).collect::<Result<_, _>>()?
            }
        };
        let ((a, a_unit), (p, p_unit)) = (whole(&vertices), whole(&p));
        let regions: Vec<(String, WholeRegion)> =
            self.regions.iter().map(|region| (region.in_words(), WholeRegion::new(region))).collect();
        let form = |region: &WholeRegion, p: &Integers, a: &Integers| region.inequality(p, &a_unit, &product(p, a));
        let unit = |region: &WholeRegion| &region.unit * &a_unit * &p_unit;
        let mut all = Vec::new();
        match &self.witness {
            LyapunovWitness::Common { .. } => {
                all.push(Inequality::decide_whole("P".to_owned(), &p[0], &p_unit));
                for (k, a) in a.iter().enumerate() {
                    let product = product(&p[0], a);
                    for (words, region) in &regions {
                        let form = region.inequality(&p[0], &a_unit, &product);
                        all.push(Inequality::decide_whole(
                            format!("{words} at vertex {}", k + 1),
                            &form,
                            &unit(region),
                        ));
                    }
                }
            }
            LyapunovWitness::Affine { .. } => {
                for (i, (p_i, a_i)) in p.iter().zip(&a).enumerate() {
                    all.push(Inequality::decide_whole(format!("P {}", i + 1), p_i, &p_unit));
                    for (words, region) in &regions {
                        let (unit, own) = (unit(region), form(region, p_i, a_i));
                        all.push(Inequality::decide_whole(format!("{words} at vertex {}", i + 1), &own, &unit));
                        for (j, (p_j, a_j)) in p.iter().zip(&a).enumerate().skip(i + 1) {
                            let mixed = sum(form(region, p_i, a_j), &form(region, p_j, a_i));
                            let name = format!("{words} between vertices {} and {}", i + 1, j + 1);
                            all.push(Inequality::decide_whole(name, &mixed, &unit));
                        }
                    }
                }
            }
        }
        Ok(all)
    }
}

impl Provable for LyapunovClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Lyapunov
    }

    fn sentence(&self, _: &Document) -> String {
        let at = self.configuration_rad.as_ref().map_or_else(String::new, |q| {
            format!(
                " The matrices are meant to be those of the loop linearised at rest at [{}] rad; they were computed in floating point, which is not checked",
                each(q)
            )
        });
        let constant = match self.witness {
            LyapunovWitness::Common { .. } => "",
            LyapunovWitness::Affine { .. } => ", its weights constant,",
        };
        let regions: Vec<String> = self.regions.iter().map(PlaneRegion::in_words).collect();
        let end = if at.is_empty() { "" } else { "." };
        format!(
            "{}{constant} has all its eigenvalues z where {}{end}{at}",
            self.polytope.in_words(),
            regions.join(" and ")
        )
    }

    fn scope(&self, _: &Document) -> String {
        "the linear loop of the file's matrices and nothing else; the constants above do not enter".to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |region: &PlaneRegion| match region {
            PlaneRegion::HalfPlane { rate_per_s } => Figure { name: "rate", value: rate_per_s.clone(), unit: "1/s" },
            PlaneRegion::Disk { radius, .. } => Figure { name: "radius", value: radius.clone(), unit: "1" },
            PlaneRegion::Sector { slope } => Figure { name: "slope", value: slope.clone(), unit: "1" },
        };
        self.regions.iter().map(figure).collect()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        if let Some(q) = &self.configuration_rad {
            require_length("configuration_rad", q.len(), document.arm.joints)?;
            for angle in q {
                require_plain("configuration_rad", angle)?;
            }
        }
        all_hold(self.inequalities()?)
    }
}

impl LyapunovRefusedClaim {
    /// A characteristic polynomial is computed exactly up to this order.
    pub const LARGEST_ORDER: usize = 12;

    /// Checks that the matrix of the weights has an eigenvalue outside the open region.
    ///
    /// # Errors
    /// [`Flaw`] when it has none, or the region is a sector, or the matrix is too large for an exact characteristic polynomial.
    pub fn check(&self) -> Result<(), Flaw> {
        let vertices = self.polytope.values()?;
        let order = vertices[0].len();
        if order > Self::LARGEST_ORDER {
            return Err(Flaw::NotCovered { what: "a refusal of such a large matrix" });
        }
        self.region.check()?;
        require_length("weights", self.weights.len(), vertices.len())?;
        let mut total = BigRational::zero();
        let mut a = zeros(order);
        for (weight, vertex) in self.weights.iter().zip(&vertices) {
            require_at_least_zero("weights", weight)?;
            total += weight.value();
            for i in 0..order {
                for j in 0..order {
                    a[i][j] += weight.value() * vertex[i][j];
                }
            }
        }
        if let Some(last) = self.weights.last() {
            require("weights", last, total == ratio(1, 1), "weights with sum 1")?;
        }
        let inside = match &self.region {
            PlaneRegion::HalfPlane { rate_per_s } => {
                for (i, row) in a.iter_mut().enumerate() {
                    row[i] += rate_per_s.value();
                }
                hurwitz(&characteristic_polynomial(&a))
            }
            PlaneRegion::Disk { centre, radius } => {
                for (i, row) in a.iter_mut().enumerate() {
                    row[i] -= centre.value();
                    for entry in row {
                        *entry /= radius.value();
                    }
                }
                hurwitz(&mapped(&characteristic_polynomial(&a)))
            }
            PlaneRegion::Sector { .. } => return Err(Flaw::NotCovered { what: "a refusal of a sector" }),
        };
        if inside {
            Err(Flaw::Counterexample { reason: "all eigenvalues of the matrix lie in the region" })
        } else {
            Ok(())
        }
    }
}

/// Whether all roots lie in the open left half plane, whatever the sign of the leading coefficient.
fn hurwitz(p: &[BigRational]) -> bool {
    let negative = p.first().is_some_and(Signed::is_negative);
    let p: Vec<BigRational> = p.iter().map(|c| if negative { -c } else { c.clone() }).collect();
    common_integers(&[p]).iter().all(|p| is_hurwitz(p))
}

/// `(1 - w)^n p((1 + w)/(1 - w))`: the unit disk becomes the left half plane, -1 the point at infinity (a leading zero, which is then not Hurwitz).
fn mapped(p: &[BigRational]) -> Vec<BigRational> {
    let times = |p: &[BigRational], sign: i64| -> Vec<BigRational> {
        // p (sign w + 1), highest power first.
        let mut product = vec![BigRational::zero(); p.len() + 1];
        for (k, c) in p.iter().enumerate() {
            product[k] += c * ratio(sign, 1);
            product[k + 1] += c;
        }
        product
    };
    let degree = p.len() - 1;
    let mut all = vec![BigRational::zero(); p.len()];
    for (k, c) in p.iter().enumerate() {
        // c z^(degree - k).
        let mut term = vec![c.clone()];
        for _ in k..degree {
            term = times(&term, 1);
        }
        for _ in 0..k {
            term = times(&term, -1);
        }
        for (sum, x) in all.iter_mut().zip(term) {
            *sum += x;
        }
    }
    all
}

impl Provable for LyapunovRefusedClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Lyapunov
    }

    fn sentence(&self, _: &Document) -> String {
        let which = match self.polytope.vertices.len() {
            1 => String::new(),
            _ => format!(" with the weights [{}]", each(&self.weights)),
        };
        format!(
            "Refused: of {}, the one{which} has an eigenvalue z that does not satisfy {}.",
            self.polytope.in_words(),
            self.region.in_words()
        )
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, _: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        self.check().map(|()| Vec::new())
    }
}
