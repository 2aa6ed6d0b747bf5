//! `M(q) <= t diag(w)` for every configuration, by corners.
//!
//! The velocity of a point is affine in each pair `x_j = (cos q_j, sin q_j)`, so for every joint velocity y the kinetic energy `y'M y` is a
//! sum of squares of affine functions of `x_j`: convex, if every body has second moments `P >= 0`. Extended to all of the plane it therefore takes its
//! maximum over a polygon at a corner, one joint after the other. Off the circle
//!
//! ```text
//! M_ab = tr(T_a E A K_b E' T_b'),   A = B_(a+1) .. B_b,  T_b = T_a A,   K_b = P_b + B_(b+1) K_(b+1) B_(b+1)'
//! ```
//!
//! with `E` the generator of a turn about z (`dB = B E`) and only rows 0 to 2 of what stands left of `K`. M does not depend on q_0 (base first,
//! counted from 0), so `T_0 = 1`. Joint 1 is innermost: with the others set, and `r2 = |x_1|^2`,
//!
//! | entry | as a function of the corner x_1 |
//! |-------|--------------------------------|
//! | `M_ab`, a, b >= 1 | `r2 alpha_ab + beta_ab`: the frame of joint 1 is a rotation, but for the factor of its x and y axes |
//! | `M_0b`, b >= 1 | `f_b . xi(x_1)`, six products: the wrench of joint b on the axis of joint 0 |
//! | `M_00` | `K_1 . zeta(x_1)`, ten products |
//!
//! so that a corner of joint 1 costs one row of a Cholesky factor. Corners of nearly equal radius share the largest `r2`: alpha is a Gram
//! matrix, so that only adds to M.

use certune_linsys::JointMatrix;

use crate::eigen::symmetric_eigen;
use crate::error::BoundsError;
use crate::rigorous::angle::Points;
use crate::rigorous::chain::{Chain, Step, Sym4, compose, composite, identity, turned};
use crate::rigorous::definite::{Factor, cholesky_allowance};
use crate::rigorous::scalar::{Majorant, Scalar, UNIT, frobenius, larger};
use crate::rigorous::sweep::Sweep;

/// A bound is raised to what a corner needs and this much more, relative.
const RAISE: f64 = 1.0 / (1_u64 << 30) as f64;
/// Squared radii that differ by less than this, relative, are one.
const SAME_RADIUS: f64 = 1e-9;

/// What is left of M once all joints but 0 and 1 are set.
struct Outer<const N: usize, T> {
    alpha: [[T; N]; N],
    beta: [[T; N]; N],
    wrench: [[T; 6]; N],
}

/// What a corner of joint 1 multiplies.
#[derive(Clone, Copy)]
struct Inner<T> {
    xi: [T; 6],
    zeta: [T; 10],
}

/// Entries of a symmetric 4x4 matrix in the order of [`Inner::zeta`].
const UPPER: [(usize, usize); 10] = [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

#[inline]
fn outer<const N: usize, T: Scalar>(steps: &[Step<T>; N], composites: &[Sym4<T>; N]) -> Outer<N, T> {
    let zero = T::zero();
    let mut out = Outer { alpha: [[zero; N]; N], beta: [[zero; N]; N], wrench: [[zero; 6]; N] };
    let mut moved = [[[zero; 4]; 3]; N];
    let mut frame = identity();
    for b in 1..N {
        if b > 1 {
            for a in 1..b {
                moved[a] = compose(&moved[a], &steps[b]);
            }
            frame = compose(&frame, &steps[b]);
        }
        moved[b] = turned(&frame);
        let k = &composites[b];
        let weighted: Step<T> =
            std::array::from_fn(|r| std::array::from_fn(|c| moved[b][r][0] * k[0][c] + moved[b][r][1] * k[1][c]));
        let row = |a: usize, r: usize| {
            let (d, w) = (&moved[a][r], &weighted[r]);
            d[0] * w[0] + d[1] * w[1] + d[2] * w[2] + d[3] * w[3]
        };
        for a in 1..=b {
            out.alpha[b][a] = row(a, 0) + row(a, 1);
            out.beta[b][a] = row(a, 2);
        }
        let z = |i: usize, r: usize| {
            let (t, w) = (&frame[i], &weighted[r]);
            t[0] * w[0] + t[1] * w[1] + t[2] * w[2] + t[3] * w[3]
        };
        out.wrench[b] =
            [z(1, 2) - z(2, 1), z(2, 0) - z(0, 2), z(0, 1) - z(1, 0), weighted[0][3], weighted[1][3], weighted[2][3]];
    }
    out
}

fn inner<const N: usize, T: Scalar>(chain: &Chain<N, T>, corner: [T; 2]) -> Inner<T> {
    let [l, m, _] = chain.step(1, corner);
    let (p, q) = (l[3], m[3]);
    let double = |x: T| x + x;
    let product = |(i, k): (usize, usize)| {
        let sum = l[i] * l[k] + m[i] * m[k];
        if i == k { sum } else { double(sum) }
    };
    Inner {
        xi: [
            l[1] * m[2] - l[2] * m[1],
            l[2] * m[0] - l[0] * m[2],
            l[0] * m[1] - l[1] * m[0],
            p * m[0] - q * l[0],
            p * m[1] - q * l[1],
            p * m[2] - q * l[2],
        ],
        zeta: UPPER.map(product),
    }
}

#[inline]
fn off_diagonal<T: Scalar>(wrench: &[T; 6], xi: &[T; 6]) -> T {
    let (f, x) = (wrench, xi);
    (f[0] * x[0] + f[1] * x[1] + f[2] * x[2]) + (f[3] * x[3] + f[4] * x[4] + f[5] * x[5])
}

#[inline]
fn corner_inertia<T: Scalar>(own: &Sym4<T>, composite: &[T; 10], zeta: &[T; 10]) -> T {
    let (k, z) = (composite, zeta);
    let sum = (k[0] * z[0] + k[1] * z[1] + k[2] * z[2] + k[3] * z[3] + k[4] * z[4])
        + (k[5] * z[5] + k[6] * z[6] + k[7] * z[7] + k[8] * z[8] + k[9] * z[9]);
    (own[0][0] + own[1][1]) + sum
}

/// The sweep: the smallest t found with `M <= t diag(w)` at every corner visited.
pub(crate) struct InertiaSweep<const N: usize> {
    chain: Chain<N, f64>,
    own: [Sym4<f64>; N],
    rotor: [f64; N],
    weights: [f64; N],
    inner: Vec<(usize, Inner<f64>)>,
    radii: Vec<f64>,
    /// Bound of the spectral norm of what the entries may be off by.
    allowance: f64,
}

pub(crate) struct InertiaState<const N: usize> {
    steps: [Step<f64>; N],
    composites: [Sym4<f64>; N],
    maximum: f64,
}

impl<const N: usize> InertiaSweep<N> {
    /// `corners[j]` is the polygon of joint j; that of joint 0 is not used. `N >= 2`.
    pub(crate) fn new(
        chain: &Chain<N, f64>,
        rotor: [f64; N],
        weights: [f64; N],
        corners: &[Points],
    ) -> Result<Self, BoundsError> {
        let chain = chain.physical()?;
        let mut radii: Vec<f64> = Vec::new();
        let mut inside = Vec::with_capacity(corners[1].at.len());
        for corner in &corners[1].at {
            // Two roundings up, three at most in the sum of two squares.
            let square = (corner[0] * corner[0] + corner[1] * corner[1]) * (1.0 + 8.0 * UNIT);
            let class = match radii.iter().position(|r| (r - square).abs() <= SAME_RADIUS * square) {
                Some(class) => class,
                None => {
                    radii.push(square);
                    radii.len() - 1
                }
            };
            radii[class] = larger(radii[class], square);
            inside.push((class, inner(&chain, *corner)));
        }
        let own = std::array::from_fn(|j| chain.second_moments(j));
        let allowance = allowance(&chain, &rotor, corners, &radii);
        Ok(Self { chain, own, rotor, weights, inner: inside, radii, allowance })
    }

    /// What was added for rounding, kg m².
    pub(crate) fn allowance(&self) -> f64 {
        self.allowance
    }

    /// What is taken from the diagonal of `t diag(w) - M`.
    fn shift(&self, t: f64) -> f64 {
        self.allowance + cholesky_allowance(N, 2.0 * t * self.weights.iter().sum::<f64>())
    }

    /// The factor of rows 1 to N-1 of `t diag(w) - M`, in this order.
    #[inline]
    fn block(&self, outer: &Outer<N, f64>, square: f64, t: f64) -> Option<Factor<N>> {
        let shift = self.shift(t);
        let mut factor = Factor::EMPTY;
        for b in 1..N {
            let mut left = [0.0; N];
            for a in 1..b {
                left[a - 1] = -(square * outer.alpha[b][a] + outer.beta[b][a]);
            }
            let inertia = (square * outer.alpha[b][b] + outer.beta[b][b]) + self.rotor[b];
            if !factor.push(b - 1, &left, t * self.weights[b] - inertia - shift) {
                return None;
            }
        }
        Some(factor)
    }

    /// The whole matrix at one corner, for raising a bound.
    fn matrix(&self, outer: &Outer<N, f64>, composite: &[f64; 10], at: &(usize, Inner<f64>)) -> [[f64; N]; N] {
        let square = self.radii[at.0];
        let mut m = [[0.0; N]; N];
        m[0][0] = corner_inertia(&self.own[0], composite, &at.1.zeta) + self.rotor[0];
        for b in 1..N {
            m[0][b] = off_diagonal(&outer.wrench[b], &at.1.xi);
            m[b][0] = m[0][b];
            for a in 1..=b {
                m[b][a] = square * outer.alpha[b][a] + outer.beta[b][a];
                m[a][b] = m[b][a];
            }
            m[b][b] += self.rotor[b];
        }
        m
    }

    /// A t that suits this corner and passes the test for it.
    fn raised(&self, m: &[[f64; N]; N]) -> f64 {
        let roots = self.weights.map(f64::sqrt);
        let scaled = JointMatrix::<N>::from_fn(|a, b| m[a][b] / (roots[a] * roots[b]));
        let mut t = symmetric_eigen(&scaled).largest().0 * (1.0 + RAISE);
        let least = self.weights.iter().fold(f64::INFINITY, |least, w| least.min(*w));
        loop {
            t += 2.0 * self.shift(t) / least;
            let shift = self.shift(t);
            let mut factor = Factor::<N>::EMPTY;
            // Same order as in the sweep: joint 0 last.
            let order: [usize; N] = std::array::from_fn(|i| (i + 1) % N);
            let passes = (0..N).all(|i| {
                let mut left = [0.0; N];
                for k in 0..i {
                    left[k] = -m[order[i]][order[k]];
                }
                factor.push(i, &left, t * self.weights[order[i]] - m[order[i]][order[i]] - shift)
            });
            if passes || !t.is_finite() {
                return t;
            }
            t *= 1.0 + RAISE;
        }
    }
}

impl<const N: usize> Sweep for InertiaSweep<N> {
    type State = InertiaState<N>;

    fn begin(&self, maxima: &[f64]) -> Self::State {
        InertiaState {
            steps: [[[0.0; 4]; 3]; N],
            composites: self.own,
            maximum: maxima.first().copied().unwrap_or(0.0),
        }
    }

    #[inline]
    fn descend(&self, state: &mut Self::State, joint: usize, corner: [f64; 2]) {
        state.steps[joint] = self.chain.step(joint, corner);
        state.composites[joint - 1] = composite(&self.own[joint - 1], &state.steps[joint], &state.composites[joint]);
    }

    fn visit(&self, state: &mut Self::State) {
        let outer = outer(&state.steps, &state.composites);
        let composite: [f64; 10] = UPPER.map(|(i, k)| state.composites[1][i][k]);
        let mut class = usize::MAX;
        let mut factor = None;
        let mut shift = self.shift(state.maximum);
        for at in &self.inner {
            if at.0 != class {
                class = at.0;
                factor = self.block(&outer, self.radii[class], state.maximum);
            }
            let passes = factor.as_ref().is_some_and(|factor| {
                let mut left = [0.0; N];
                for b in 1..N {
                    left[b - 1] = -off_diagonal(&outer.wrench[b], &at.1.xi);
                }
                let mut row = [0.0; N];
                let square = factor.row(N - 1, &left, &mut row);
                let inertia = corner_inertia(&self.own[0], &composite, &at.1.zeta) + self.rotor[0];
                state.maximum * self.weights[0] - inertia - shift - square > 0.0
            });
            if !passes {
                state.maximum = larger(state.maximum, self.raised(&self.matrix(&outer, &composite, at)));
                factor = self.block(&outer, self.radii[class], state.maximum);
                shift = self.shift(state.maximum);
            }
        }
    }

    fn maxima(&self, state: &Self::State) -> Vec<f64> {
        vec![state.maximum]
    }
}

/// Bound of what the entries of M at any corner are off by, in spectral norm.
fn allowance<const N: usize>(chain: &Chain<N, f64>, rotor: &[f64; N], corners: &[Points], radii: &[f64]) -> f64 {
    let bounds = chain.majorant();
    let at = |j: usize| [Majorant::input(corners[j].size, corners[j].error); 2];
    let zero = Majorant::zero();
    let mut steps = [[[zero; 4]; 3]; N];
    let own: [Sym4<Majorant>; N] = std::array::from_fn(|j| bounds.second_moments(j));
    let mut composites = own;
    for j in (2..N).rev() {
        steps[j] = bounds.step(j, at(j));
        composites[j - 1] = composite(&own[j - 1], &steps[j], &composites[j]);
    }
    let outer = outer(&steps, &composites);
    let inner = inner(&bounds, at(1));
    let square = Majorant::input(radii.iter().fold(0.0, |largest, r| larger(largest, *r)), 0.0);
    let rotor = |j: usize| Majorant::input(rotor[j], rotor[j] / (1_u64 << 48) as f64);
    let mut errors = [[0.0; N]; N];
    let composite = UPPER.map(|(i, k)| composites[1][i][k]);
    errors[0][0] = (corner_inertia(&own[0], &composite, &inner.zeta) + rotor(0)).bound();
    for b in 1..N {
        errors[0][b] = off_diagonal(&outer.wrench[b], &inner.xi).bound();
        errors[b][0] = errors[0][b];
        for a in 1..b {
            errors[b][a] = (square * outer.alpha[b][a] + outer.beta[b][a]).bound();
            errors[a][b] = errors[b][a];
        }
        errors[b][b] = ((square * outer.alpha[b][b] + outer.beta[b][b]) + rotor(b)).bound();
    }
    frobenius(&errors)
}

/// M at one corner of every joint, without rotor inertia.
pub(crate) fn inertia_at<const N: usize, T: Scalar>(chain: &Chain<N, T>, corners: &[[T; 2]; N]) -> [[T; N]; N] {
    let mut m = [[T::zero(); N]; N];
    let own: [Sym4<T>; N] = std::array::from_fn(|j| chain.second_moments(j));
    if N < 2 {
        m[0][0] = own[0][0][0] + own[0][1][1];
        return m;
    }
    let mut steps = [[[T::zero(); 4]; 3]; N];
    let mut composites = own;
    for j in (2..N).rev() {
        steps[j] = chain.step(j, corners[j]);
        composites[j - 1] = composite(&own[j - 1], &steps[j], &composites[j]);
    }
    let outer = outer(&steps, &composites);
    let inner = inner(chain, corners[1]);
    let square = corners[1][0] * corners[1][0] + corners[1][1] * corners[1][1];
    m[0][0] = corner_inertia(&own[0], &UPPER.map(|(i, k)| composites[1][i][k]), &inner.zeta);
    for b in 1..N {
        m[0][b] = off_diagonal(&outer.wrench[b], &inner.xi);
        m[b][0] = m[0][b];
        for a in 1..=b {
            m[b][a] = square * outer.alpha[b][a] + outer.beta[b][a];
            m[a][b] = m[b][a];
        }
    }
    m
}
