//! Small symmetric matrices with a rigorous error: what is true lies within `radius` of `middle`, entry by entry.
//!
//! Every operation computes its middle in doubles, rounded to nearest, and a radius that dominates what the operands' radii and the
//! roundings can do, from the largest moduli of the operands alone. With unit roundoff `u = 2^-53` and `gamma_n = n u / (1 - n u)`:
//!
//! ```text
//! |fl(a . b) - a . b| <= gamma_n |a| . |b|                                       (Higham 2002, eq. 3.5)
//! fl-Cholesky of A runs through  =>  A >= -gamma_{n+1} / (1 - gamma_{n+1}) tr A   (Higham 2002, thm 10.3; Rump 2006)
//! ```
//!
//! The radii themselves are sums of a few positive terms; they are multiplied by [`WIDEN`], far more than their own roundings.
//! Limits: numbers of ordinary size, between 1e-100 and 1e100, so that nothing over- or underflows; orders up to 6.

/// Largest order.
pub(crate) const ORDER: usize = 6;
/// A matrix of order at most [`ORDER`]; the order itself is passed along.
pub(crate) type Matrix = [[f64; ORDER]; ORDER];
/// All zeros.
pub(crate) const ZERO: Matrix = [[0.0; ORDER]; ORDER];

/// 18 u: more than `gamma_n` for every n <= 16.
pub(crate) const ROUNDING: f64 = 2e-15;
/// Covers the roundings in the computation of a radius.
const WIDEN: f64 = 1.000_001;
/// Added to every radius: far above the underflow threshold times any count of operations here.
const TINY: f64 = 1e-290;

/// A matrix known up to an error of `radius` in each entry.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    pub middle: Matrix,
    pub radius: f64,
}

/// The largest modulus of an entry.
pub(crate) fn largest(a: &Matrix) -> f64 {
    a.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()))
}

impl Ball {
    /// A matrix that is known exactly.
    pub fn exact(middle: Matrix) -> Self {
        Self { middle, radius: 0.0 }
    }

    /// The sum of matrices, each times a weight that is itself known up to an error.
    pub fn combination<const K: usize>(terms: [(f64, f64, &Ball); K]) -> Self {
        let mut middle = ZERO;
        let mut radius = TINY;
        for (weight, weight_error, ball) in terms {
            let size = largest(&ball.middle);
            for (row, other) in middle.iter_mut().zip(&ball.middle) {
                for (x, y) in row.iter_mut().zip(other) {
                    *x += weight * y;
                }
            }
            let most = weight.abs() + weight_error;
            radius += most * ball.radius + (weight_error + ROUNDING * most) * size;
        }
        Self { middle, radius: radius * WIDEN }
    }

    /// `y' self y` for a `y` with `rows` rows and `columns` columns.
    pub fn congruence(&self, y: &Ball, rows: usize, columns: usize) -> Self {
        let half = product(self, y, rows, rows, columns, false);
        product(y, &half, columns, rows, columns, true)
    }

    /// The negative.
    pub fn negated(&self) -> Self {
        Self { middle: self.middle.map(|row| row.map(|x| -x)), radius: self.radius }
    }

    /// True only if `self - other >= 0` on the leading block of order `order`, for every matrix of the ball; `other` is exact.
    ///
    /// Reads the lower triangles. False proves nothing.
    pub fn dominates(&self, other: &Matrix, order: usize) -> bool {
        let mut gap = ZERO;
        let mut trace = 0.0;
        for row in 0..order {
            for column in 0..=row {
                gap[row][column] = self.middle[row][column] - other[row][column];
            }
            trace += self.middle[row][row].abs() + other[row][row].abs();
        }
        let size = largest(&self.middle) + largest(other);
        // Entry errors: the ball's and one rounding each; norm <= order times the largest. The rest is the theorem above.
        #[expect(clippy::cast_precision_loss, reason = "order <= 6")]
        let shift = (order as f64 * (self.radius + ROUNDING * size) + 4.0 * ROUNDING * trace) * WIDEN + TINY;
        for row in 0..order {
            gap[row][row] -= shift;
        }
        cholesky(&gap, order).is_some()
    }
}

/// `a b` or `a' b`, where the sum runs over `inner` indices.
fn product(a: &Ball, b: &Ball, rows: usize, inner: usize, columns: usize, transpose: bool) -> Ball {
    let mut middle = ZERO;
    for i in 0..rows {
        for j in 0..columns {
            let mut sum = 0.0;
            for k in 0..inner {
                sum += if transpose { a.middle[k][i] } else { a.middle[i][k] } * b.middle[k][j];
            }
            middle[i][j] = sum;
        }
    }
    let (sa, sb) = (largest(&a.middle), largest(&b.middle));
    #[expect(clippy::cast_precision_loss, reason = "inner <= 6")]
    let n = inner as f64;
    let radius = n * (sa * b.radius + sb * a.radius + a.radius * b.radius + ROUNDING * sa * sb);
    Ball { middle, radius: radius * WIDEN + TINY }
}

/// The lower Cholesky factor in floating point, or nothing if a pivot is not positive.
pub(crate) fn cholesky(a: &Matrix, order: usize) -> Option<Matrix> {
    let mut l = ZERO;
    for j in 0..order {
        let mut pivot = a[j][j];
        for k in 0..j {
            pivot -= l[j][k] * l[j][k];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        l[j][j] = root;
        for i in j + 1..order {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            l[i][j] = sum / root;
        }
    }
    Some(l)
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by Jacobi's rotations; a witness, never a proof.
pub(crate) fn eigen(a: &Matrix, order: usize) -> ([f64; ORDER], Matrix) {
    let mut a = *a;
    let mut v = ZERO;
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for _ in 0..12 {
        let (mut off, mut diagonal) = (0.0, 0.0);
        for i in 0..order {
            diagonal += a[i][i] * a[i][i];
            for j in 0..i {
                off += a[i][j] * a[i][j];
            }
        }
        if off <= 1e-22 * diagonal {
            break;
        }
        for p in 0..order - 1 {
            for q in p + 1..order {
                if a[p][q].abs() <= 1e-300 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..order {
                    let (x, y) = (a[k][p], a[k][q]);
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for k in 0..order {
                    let (x, y) = (a[p][k], a[q][k]);
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for k in 0..order {
                    let (x, y) = (v[k][p], v[k][q]);
                    v[k][p] = c * x - s * y;
                    v[k][q] = s * x + c * y;
                }
            }
        }
    }
    let mut values = [0.0; ORDER];
    for (i, value) in values.iter_mut().enumerate().take(order) {
        *value = a[i][i];
    }
    (values, v)
}
