//! Gravity stiffness and gravity torques, by corners.
//!
//! The potential energy is affine in each pair `x_j = (cos q_j, sin q_j)`, and so are its derivatives. With `gamma` minus the gravity
//! vector as a row, `h_b` the first moment and mass of what hangs on joint b (four numbers, in frame b), `E` the generator of a turn about z,
//!
//! ```text
//! g_b = gamma T_b E h_b,    dg_a/dq_b = gamma T_a E B_(a+1) .. B_b E h_b   (a <= b)
//! ```
//!
//! The largest eigenvalue, its negative at the other end, and `|g_b|` are convex in the matrix entries, so each has its maximum at corners of polygons.
//! Joint `s` is innermost: 0, or 1 where gravity is exactly along the first axis, which then has neither torque nor stiffness. With the others set,
//! `dg/dq = gamma_x Y_x + gamma_y Y_y + gamma_z Y_z`, gamma seen in frame s, its x and y parts on a polygon of radius at most rho:
//!
//! ```text
//! |dg/dq| <= |gamma_z| |Y_z| + rho |Y_x^2 + Y_y^2|^(1/2),    since (c X + s Y)^2 + (-s X + c Y)^2 = (c^2 + s^2) (X^2 + Y^2)
//! ```
//!
//! which settles most of the configurations without looking at the corners of joint s.

use certune_linsys::JointMatrix;

use crate::eigen::symmetric_eigen;
use crate::rigorous::angle::{Points, Span};
use crate::rigorous::chain::{Chain, Step, Vec3, compose, identity, turned};
use crate::rigorous::definite::{Factor, cholesky_allowance};
use crate::rigorous::scalar::{Majorant, Scalar, UNIT, frobenius, larger};
use crate::rigorous::sweep::Sweep;

/// A bound is raised to what a corner needs and this much more, relative.
const RAISE: f64 = 1.0 / (1_u64 << 30) as f64;
/// What the quick tests leave unused, relative: far more than they can be off by.
const QUICK: f64 = 1e-9;

/// First moment (three) and mass.
type Moment<T> = [T; 4];

/// `dg_a/dq_b` and `g_b` as rows that `gamma` multiplies; entries before joint s are zero.
struct Outer<const N: usize, T> {
    stiffness: [[Vec3<T>; N]; N],
    torque: [Vec3<T>; N],
}

#[inline]
fn outer<const N: usize, T: Scalar>(first: usize, steps: &[Step<T>; N], moments: &[Moment<T>; N]) -> Outer<N, T> {
    let zero = T::zero();
    let mut out = Outer { stiffness: [[[zero; 3]; N]; N], torque: [[zero; 3]; N] };
    let mut moved = [[[zero; 4]; 3]; N];
    let mut frame = identity();
    for b in first..N {
        if b > first {
            for a in first..b {
                moved[a] = compose(&moved[a], &steps[b]);
            }
            frame = compose(&frame, &steps[b]);
        }
        moved[b] = turned(&frame);
        let h = &moments[b];
        for a in first..b {
            out.stiffness[b][a] = std::array::from_fn(|r| moved[a][r][1] * h[0] - moved[a][r][0] * h[1]);
        }
        out.torque[b] = std::array::from_fn(|r| frame[r][1] * h[0] - frame[r][0] * h[1]);
        out.stiffness[b][b] = std::array::from_fn(|r| -(frame[r][0] * h[0] + frame[r][1] * h[1]));
    }
    out
}

#[inline]
fn shifted<T: Scalar>(own: &Moment<T>, b: &Step<T>, child: &Moment<T>) -> Moment<T> {
    let row = |r: usize| own[r] + (b[r][0] * child[0] + b[r][1] * child[1] + b[r][2] * child[2] + b[r][3] * child[3]);
    [row(0), row(1), row(2), own[3] + child[3]]
}

fn own_moments<const N: usize, T: Scalar>(chain: &Chain<N, T>) -> [Moment<T>; N] {
    std::array::from_fn(|j| {
        let h = chain.first_moment[j];
        [h[0], h[1], h[2], chain.mass[j]]
    })
}

/// Minus gravity as a row in the frame before the turn of joint `first`.
fn before_turn<const N: usize, T: Scalar>(chain: &Chain<N, T>, first: usize) -> Vec3<T> {
    let mut row = chain.gravity.map(|x| -x);
    for j in 0..=first {
        let r = &chain.rotation[j];
        row = std::array::from_fn(|c| row[0] * r[0][c] + row[1] * r[1][c] + row[2] * r[2][c]);
    }
    row
}

#[inline]
fn turned_row<T: Scalar>(row: &Vec3<T>, [c, s]: [T; 2]) -> Vec3<T> {
    [row[0] * c + row[1] * s, row[1] * c - row[0] * s, row[2]]
}

#[inline]
fn dot<T: Scalar>(a: &Vec3<T>, b: &Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The joint that comes first: 1 if gravity is along the axis of joint 0 whatever the rounding of its frame, else 0.
pub(crate) fn first_joint<const N: usize>(chain: &Chain<N, f64>) -> usize {
    let r = &chain.rotation[0];
    let zero = |x: f64| x.abs() <= 0.0;
    let along = (0..3).all(|i| {
        zero(chain.gravity[i])
            || (zero(r[i][0]) && zero(r[i][1]) && (0..3).all(|k| k == i || zero(r[k][2])) && zero(r[i][2].abs() - 1.0))
    });
    usize::from(along)
}

/// What a sweep looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The stiffness.
    Stiffness,
    /// The torque of each joint.
    Torque,
}

/// The sweep: the stiffness, then the torque of each joint; zero for what is not wanted.
pub(crate) struct GravitySweep<const N: usize> {
    chain: Chain<N, f64>,
    own: [Moment<f64>; N],
    first: usize,
    wanted: Wanted,
    gammas: Vec<Vec3<f64>>,
    /// Largest `|gamma_z|`, and largest length of the x and y parts over the corners and over the circle itself.
    along: f64,
    radius: f64,
    unit_radius: Option<f64>,
    stiffness_allowance: f64,
    torque_allowance: [f64; N],
}

pub(crate) struct GravityState<const N: usize> {
    steps: [Step<f64>; N],
    moments: [Moment<f64>; N],
    stiffness: f64,
    torque: [f64; N],
}

impl<const N: usize> GravitySweep<N> {
    /// `corners[j]` is the polygon of joint j; those before [`first_joint`] are not used, and that joint is below N.
    pub(crate) fn new(chain: &Chain<N, f64>, spans: &[Span; N], corners: &[Points], wanted: Wanted) -> Self {
        let first = first_joint(chain);
        let row = before_turn(chain, first);
        let gammas: Vec<Vec3<f64>> = corners[first].at.iter().map(|corner| turned_row(&row, *corner)).collect();
        let length = |g: &Vec3<f64>| (g[0] * g[0] + g[1] * g[1]).sqrt() * (1.0 + 16.0 * UNIT);
        let unit_radius = match spans[first] {
            Span::Circle => Some(length(&row)),
            Span::Arc(..) => None,
        };
        let (stiffness_allowance, torque_allowance) = allowances(chain, first, corners);
        Self {
            own: own_moments(chain),
            first,
            wanted,
            along: row[2].abs(),
            radius: gammas.iter().map(length).fold(0.0, larger),
            unit_radius,
            gammas,
            stiffness_allowance,
            torque_allowance,
            chain: chain.clone(),
        }
    }

    /// What was added to the stiffness for rounding, N m/rad.
    pub(crate) fn allowance(&self) -> f64 {
        self.stiffness_allowance
    }

    fn order(&self) -> usize {
        N - self.first
    }

    /// Whether `t I +- G > 0`, rounding included.
    #[inline]
    fn suffices(&self, t: f64, stiffness: &[[f64; N]; N]) -> bool {
        let shift = self.stiffness_allowance + cholesky_allowance(N, 2.0 * t * N as f64);
        let diagonal = t - shift;
        [1.0, -1.0].into_iter().all(|sign| {
            let mut factor = Factor::<N>::EMPTY;
            (0..self.order()).all(|i| {
                let left = stiffness[i].map(|x| sign * x);
                factor.push(i, &left, diagonal + left[i])
            })
        })
    }

    /// Whether t suffices at every corner of the first joint.
    #[inline]
    fn quick(&self, t: f64, outer: &Outer<N, f64>) -> bool {
        let mut squares = [0.0; 3];
        for b in self.first..N {
            for a in self.first..=b {
                let weight = if a == b { 1.0 } else { 2.0 };
                for (square, y) in squares.iter_mut().zip(outer.stiffness[b][a]) {
                    *square += weight * y * y;
                }
            }
        }
        let left = (t - 2.0 * self.stiffness_allowance) * (1.0 - QUICK) - self.along * squares[2].sqrt();
        if !(left > 0.0) {
            return false;
        }
        let limit = (left / self.radius).powi(2) * (1.0 - QUICK);
        if squares[0] + squares[1] <= limit {
            return true;
        }
        // Products of order N sum 2 N terms each; the squares bound their sizes.
        let n = N as f64;
        let shift = 16.0 * n * UNIT * (squares[0] + squares[1]) + cholesky_allowance(N, n * limit);
        let entry = |a: usize, b: usize| &outer.stiffness[a.max(b)][a.min(b)];
        let mut factor = Factor::<N>::EMPTY;
        (self.first..N).all(|a| {
            let mut left = [0.0; N];
            for b in self.first..=a {
                let sum: f64 =
                    (self.first..N).map(|k| entry(a, k)[0] * entry(k, b)[0] + entry(a, k)[1] * entry(k, b)[1]).sum();
                left[b - self.first] = -sum;
            }
            let i = a - self.first;
            factor.push(i, &left, limit - shift + left[i])
        })
    }

    fn raised(&self, stiffness: &[[f64; N]; N]) -> f64 {
        let matrix = JointMatrix::<N>::from_fn(|a, b| stiffness[a.max(b)][a.min(b)]);
        let mut t = symmetric_eigen(&matrix).dominant().0.abs() * (1.0 + RAISE) + 2.0 * self.stiffness_allowance;
        while !self.suffices(t, stiffness) && t.is_finite() {
            t = t * (1.0 + RAISE) + f64::MIN_POSITIVE.sqrt();
        }
        t
    }

    #[inline]
    fn visit_torque(&self, state: &mut GravityState<N>, outer: &Outer<N, f64>) {
        for j in self.first..N {
            let v = &outer.torque[j];
            let across = (v[0] * v[0] + v[1] * v[1]).sqrt();
            let most = |radius: f64| {
                (self.along * v[2].abs() + radius * across) * (1.0 + 16.0 * UNIT) + self.torque_allowance[j]
            };
            if most(self.radius) <= state.torque[j] {
                continue;
            }
            let here = match self.unit_radius {
                Some(radius) => most(radius),
                None => {
                    let largest = self.gammas.iter().map(|gamma| dot(gamma, v).abs()).fold(0.0, larger);
                    largest * (1.0 + 16.0 * UNIT) + self.torque_allowance[j]
                }
            };
            state.torque[j] = larger(state.torque[j], here);
        }
    }

    #[inline]
    fn visit_stiffness(&self, state: &mut GravityState<N>, outer: &Outer<N, f64>) {
        if self.quick(state.stiffness, outer) {
            return;
        }
        for gamma in &self.gammas {
            let mut stiffness = [[0.0; N]; N];
            for b in self.first..N {
                for a in self.first..=b {
                    stiffness[b - self.first][a - self.first] = dot(gamma, &outer.stiffness[b][a]);
                }
            }
            if !self.suffices(state.stiffness, &stiffness) {
                state.stiffness = larger(state.stiffness, self.raised(&stiffness));
            }
        }
    }
}

impl<const N: usize> Sweep for GravitySweep<N> {
    type State = GravityState<N>;

    fn begin(&self, maxima: &[f64]) -> Self::State {
        let known = |i: usize| maxima.get(i).copied().unwrap_or(0.0);
        GravityState {
            steps: [[[0.0; 4]; 3]; N],
            moments: self.own,
            stiffness: known(0),
            torque: std::array::from_fn(|j| known(1 + j)),
        }
    }

    #[inline]
    fn descend(&self, state: &mut Self::State, joint: usize, corner: [f64; 2]) {
        state.steps[joint] = self.chain.step(joint, corner);
        state.moments[joint - 1] = shifted(&self.own[joint - 1], &state.steps[joint], &state.moments[joint]);
    }

    fn visit(&self, state: &mut Self::State) {
        let outer = outer(self.first, &state.steps, &state.moments);
        match self.wanted {
            Wanted::Stiffness => self.visit_stiffness(state, &outer),
            Wanted::Torque => self.visit_torque(state, &outer),
        }
    }

    fn maxima(&self, state: &Self::State) -> Vec<f64> {
        std::iter::once(state.stiffness).chain(state.torque).collect()
    }
}

/// What the entries of `dg/dq` are off by, in spectral norm, and the torques, at any corner.
fn allowances<const N: usize>(chain: &Chain<N, f64>, first: usize, corners: &[Points]) -> (f64, [f64; N]) {
    let bounds = chain.majorant();
    let at = |j: usize| [Majorant::input(corners[j].size, corners[j].error); 2];
    let own = own_moments(&bounds);
    let mut moments = own;
    let mut steps = [[[Majorant::zero(); 4]; 3]; N];
    for j in (first + 1..N).rev() {
        steps[j] = bounds.step(j, at(j));
        moments[j - 1] = shifted(&own[j - 1], &steps[j], &moments[j]);
    }
    let outer = outer(first, &steps, &moments);
    let gamma = turned_row(&before_turn(&bounds, first), at(first));
    let mut errors = [[0.0; N]; N];
    for b in first..N {
        for a in first..=b {
            errors[b][a] = dot(&gamma, &outer.stiffness[b][a]).bound();
            errors[a][b] = errors[b][a];
        }
    }
    (frobenius(&errors), std::array::from_fn(|j| dot(&gamma, &outer.torque[j]).bound()))
}

/// `dg/dq` at one corner of every joint.
pub(crate) fn stiffness_at<const N: usize>(chain: &Chain<N, f64>, corners: &[[f64; 2]; N]) -> [[f64; N]; N] {
    stiffness_from(chain, first_joint(chain), corners)
}

/// The same, when the first joint is known.
pub(crate) fn stiffness_from<const N: usize, T: Scalar>(
    chain: &Chain<N, T>,
    first: usize,
    corners: &[[T; 2]; N],
) -> [[T; N]; N] {
    let mut stiffness = [[T::zero(); N]; N];
    if first < N {
        let (outer, gamma) = at_corners(chain, first, corners);
        for b in first..N {
            for a in first..=b {
                stiffness[b][a] = dot(&gamma, &outer.stiffness[b][a]);
                stiffness[a][b] = stiffness[b][a];
            }
        }
    }
    stiffness
}

/// Gravity torques at one corner of every joint.
pub(crate) fn torque_at<const N: usize>(chain: &Chain<N, f64>, corners: &[[f64; 2]; N]) -> [f64; N] {
    let mut torque = [0.0; N];
    let first = first_joint(chain);
    if first < N {
        let (outer, gamma) = at_corners(chain, first, corners);
        for j in first..N {
            torque[j] = dot(&gamma, &outer.torque[j]);
        }
    }
    torque
}

/// All joints set; `first < N`.
fn at_corners<const N: usize, T: Scalar>(
    chain: &Chain<N, T>,
    first: usize,
    corners: &[[T; 2]; N],
) -> (Outer<N, T>, Vec3<T>) {
    let own = own_moments(chain);
    let mut moments = own;
    let mut steps = [[[T::zero(); 4]; 3]; N];
    for j in (first + 1..N).rev() {
        steps[j] = chain.step(j, corners[j]);
        moments[j - 1] = shifted(&own[j - 1], &steps[j], &moments[j]);
    }
    (outer(first, &steps, &moments), turned_row(&before_turn(chain, first), corners[first]))
}
