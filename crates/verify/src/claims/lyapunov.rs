//! Claim `lyapunov`: every matrix of a polytope has its eigenvalues in a region of the plane.
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
//! F is linear in A: one P that passes at the vertices passes on their hull, even when the matrix moves in it with time (half plane, disk about 0). One P for
//! each vertex, `P(w) = sum w_i P_i` at `A(w) = sum w_i A_i`, passes if `F(P_i, A_i) < 0` and `F(P_i, A_j) + F(P_j, A_i) < 0`, for constant weights.
//!
//! Source: M. Chilali and P. Gahinet, "H-infinity design with pole placement constraints: an LMI approach", IEEE TAC 41(3), 1996. The
//! derivation is in `proofs/claims/lyapunov.md`. Nothing here is about an arm: [`LyapunovClaim::inequalities`] needs no document.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use serde::{Deserialize, Serialize};

use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::algebra::{Matrix, characteristic_polynomial, common_integers, is_hurwitz, zeros};
use crate::document::Document;
use crate::error::Flaw;
use crate::number::{Number, ratio};
use crate::quantity::{require, require_at_least_zero, require_length, require_plain, require_positive};
use crate::statement::each;

/// Vertices beyond this make more matrices than anyone wants to wait for.
const MOST_VERTICES: usize = 16;
const LARGEST_ORDER: usize = 64;
/// A characteristic polynomial is computed exactly up to this order.
const LARGEST_REFUSED_ORDER: usize = 12;

/// The hull of some matrices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Polytope {
    /// Square matrices of one order, row by row.
    pub vertices: Vec<Vec<Vec<Number>>>,
}

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
    /// The matrices as rationals.
    ///
    /// # Errors
    /// [`Flaw`] unless there is at least one, all are square and of one order, within the limits.
    fn matrices(&self) -> Result<Vec<Matrix>, Flaw> {
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
        let row = |row: &Vec<Number>| row.iter().map(|x| x.value().clone()).collect();
        Ok(self.vertices.iter().map(|vertex| vertex.iter().map(row).collect()).collect())
    }

    fn in_words(&self) -> String {
        let order = self.vertices.first().map_or(0, Vec::len);
        match self.vertices.len() {
            1 => format!("the file's matrix (order {order})"),
            vertices => format!("every matrix in the hull of the file's {vertices} matrices (order {order})"),
        }
    }
}

impl PlaneRegion {
    fn check(&self) -> Result<(), Flaw> {
        match self {
            Self::HalfPlane { rate_per_s } => require_at_least_zero("rate_per_s", rate_per_s),
            Self::Disk { centre, radius } => {
                require_plain("centre", centre)?;
                require_positive("radius", radius)
            }
            Self::Sector { slope } => require_positive("slope", slope),
        }
    }

    fn in_words(&self) -> String {
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

    /// `-F(P, A)`.
    fn inequality(&self, p: &Matrix, a: &Matrix) -> Matrix {
        let [l, m] = self.parts();
        let n = p.len();
        let mut product = zeros(n);
        for i in 0..n {
            for k in 0..n {
                if !p[i][k].is_zero() {
                    for j in 0..n {
                        product[i][j] += &p[i][k] * &a[k][j];
                    }
                }
            }
        }
        let mut form = zeros(l.len() * n);
        for (r, row) in l.iter().enumerate() {
            for (c, weight) in row.iter().enumerate() {
                for i in 0..n {
                    for j in 0..n {
                        let entry = weight * &p[i][j] + &m[r][c] * &product[i][j] + &m[c][r] * &product[j][i];
                        form[r * n + i][c * n + j] = -entry;
                    }
                }
            }
        }
        form
    }
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
}

fn symmetric(order: usize, triangle: &[Number]) -> Result<Matrix, Flaw> {
    require_length("p", triangle.len(), order * (order + 1) / 2)?;
    let mut matrix = zeros(order);
    let mut entries = triangle.iter();
    for (i, j) in (0..order).flat_map(|i| (i..order).map(move |j| (i, j))) {
        if let Some(entry) = entries.next() {
            matrix[i][j].clone_from(entry.value());
            matrix[j][i].clone_from(entry.value());
        }
    }
    Ok(matrix)
}

impl LyapunovClaim {
    /// The inequalities, whether they hold or not.
    ///
    /// # Errors
    /// [`Flaw`] when the matrices do not fit together or a region is none.
    pub fn inequalities(&self) -> Result<Vec<Inequality>, Flaw> {
        let matrices = self.polytope.matrices()?;
        let order = matrices[0].len();
        if self.regions.is_empty() {
            return Err(Flaw::NotCovered { what: "a claim without a region" });
        }
        for region in &self.regions {
            region.check()?;
        }
        let mut all = Vec::new();
        let mut decide = |name: String, matrix: &Matrix| all.push(Inequality::decide_large(name, matrix));
        match &self.witness {
            LyapunovWitness::Common { p } => {
                let p = symmetric(order, p)?;
                decide("P".to_owned(), &p);
                for (k, a) in matrices.iter().enumerate() {
                    for region in &self.regions {
                        decide(format!("{} at vertex {}", region.in_words(), k + 1), &region.inequality(&p, a));
                    }
                }
            }
            LyapunovWitness::Affine { p } => {
                require_length("p", p.len(), matrices.len())?;
                let p = p.iter().map(|p| symmetric(order, p)).collect::<Result<Vec<_>, _>>()?;
                for (i, (p_i, a_i)) in p.iter().zip(&matrices).enumerate() {
                    decide(format!("P {}", i + 1), p_i);
                    for region in &self.regions {
                        decide(format!("{} at vertex {}", region.in_words(), i + 1), &region.inequality(p_i, a_i));
                        for (j, (p_j, a_j)) in p.iter().zip(&matrices).enumerate().skip(i + 1) {
                            let mixed = sum(&region.inequality(p_i, a_j), &region.inequality(p_j, a_i));
                            decide(format!("{} between vertices {} and {}", region.in_words(), i + 1, j + 1), &mixed);
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
    /// Checks that the matrix of the weights has an eigenvalue outside the open region.
    ///
    /// # Errors
    /// [`Flaw`] when it has none, or the region is a sector, or the matrix is too large for an exact characteristic polynomial.
    pub fn check(&self) -> Result<(), Flaw> {
        let matrices = self.polytope.matrices()?;
        let order = matrices[0].len();
        self.region.check()?;
        require_length("weights", self.weights.len(), matrices.len())?;
        let mut total = BigRational::zero();
        let mut a = zeros(order);
        for (weight, vertex) in self.weights.iter().zip(&matrices) {
            require_at_least_zero("weights", weight)?;
            total += weight.value();
            for i in 0..order {
                for j in 0..order {
                    a[i][j] += weight.value() * &vertex[i][j];
                }
            }
        }
        if let Some(last) = self.weights.last() {
            require("weights", last, total == ratio(1, 1), "weights with sum 1")?;
        }
        if order > LARGEST_REFUSED_ORDER {
            return Err(Flaw::NotCovered { what: "a refusal of such a large matrix" });
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
