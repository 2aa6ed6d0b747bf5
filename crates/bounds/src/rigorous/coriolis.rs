//! `1/2 |v'(sum_j y_j dM/dq_j) v| <= k_c |y| |v|^2` over all angles, by equispaced angles.
//!
//! For fixed y and v the left side is a trigonometric polynomial of degree at most 2 in each angle. One of degree d on `n > 2d` equispaced
//! points obeys `sup |f| <= max |f| / cos(pi d/n)` (Ehlich and Zeller, *Schwankung von Polynomen zwischen Gitterpunkten*, Math. Z. 86
//! (1964); from M. Riesz: near its largest value f stays above `sup |f| cos(d (q - q*))`). One angle after the other, the others held, each brings
//! its factor. At a grid point the maximum over y and v is at most half the largest singular value of the matrix with rows `dM/dq_j`,
//! entries off the diagonal times `sqrt 2`, so that rows have the Frobenius inner product.
//!
//! Twists and bodies in frame 1 about its origin, `S_b` the axis of joint b, `I_b` the body of all that hangs on it (base is 0):
//!
//! ```text
//! dM_ab/dq_j = S_a . phi_jb,  a <= b, a < j;  0 for j <= a
//! phi_jb = dI_j S_b  (b < j),   S_j x* (I_b S_b)  (b >= j),   dI_j = what turns of joint j make of I_j, a body without mass
//! ```
//!
//! Only `S_0` depends on q_1: joint 1 is innermost, and its row costs three coefficients an entry (`S_0 = s + c cos q_1 + d sin q_1`).
//! Nothing depends on q_0.
//!
//! **The last link** enters as the mean of its body over turns about its own joint plus the rest: T is linear in bodies, the mean makes T
//! independent of the last angle, and the rest is small for most tools; a sum of norms bounds the norm of the sum.
//!
//! Limits: all angles, no box (a box is a part of them).

use certune_linsys::JointMatrix;

use crate::eigen::symmetric_eigen;
use crate::rigorous::angle::{Points, degree_two_factor};
use crate::rigorous::chain::{Chain, Mat3, Step, Vec3, compose, identity};
use crate::rigorous::definite::{Factor, cholesky_allowance};
use crate::rigorous::scalar::{Majorant, Scalar, UNIT, larger};
use crate::rigorous::sweep::Sweep;

/// A bound is raised to what a grid point needs and this much more, relative.
const RAISE: f64 = 1.0 / (1_u64 << 30) as f64;

fn cross<T: Scalar>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot<T: Scalar>(a: &Vec3<T>, b: &Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn sum<T: Scalar>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// A rotational and a linear part.
#[derive(Clone, Copy)]
struct Screw<T> {
    turn: Vec3<T>,
    line: Vec3<T>,
}

/// A body, or the rate of one: six numbers of the inertia (xx yy zz xy xz yz), first moment, mass.
#[derive(Clone, Copy)]
struct Body<T> {
    inertia: [T; 6],
    moment: Vec3<T>,
    mass: T,
}

impl<T: Scalar> Body<T> {
    fn rotate(&self, w: &Vec3<T>) -> Vec3<T> {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        [xx * w[0] + xy * w[1] + xz * w[2], xy * w[0] + yy * w[1] + yz * w[2], xz * w[0] + yz * w[1] + zz * w[2]]
    }

    /// Momentum of a velocity.
    fn apply(&self, s: &Screw<T>) -> Screw<T> {
        let line = cross(&s.turn, &self.moment);
        Screw {
            turn: sum(&self.rotate(&s.turn), &cross(&self.moment, &s.line)),
            line: [self.mass * s.line[0] + line[0], self.mass * s.line[1] + line[1], self.mass * s.line[2] + line[2]],
        }
    }

    /// `2 (a . b) 1 - a b' - b a'`, in the order of [`Body::inertia`].
    fn pair(a: &Vec3<T>, b: &Vec3<T>) -> [T; 6] {
        let product: Vec3<T> = std::array::from_fn(|i| a[i] * b[i]);
        let twice = |x: T| x + x;
        [
            twice(product[1] + product[2]),
            twice(product[0] + product[2]),
            twice(product[0] + product[1]),
            -(a[0] * b[1] + a[1] * b[0]),
            -(a[0] * b[2] + a[2] * b[0]),
            -(a[1] * b[2] + a[2] * b[1]),
        ]
    }

    /// The rate of the body when it is carried along by `s`.
    fn rate(&self, s: &Screw<T>) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        let w = &s.turn;
        let rows: Mat3<T> = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        // w^ I + (w^ I)': column k of w^ I is w x (column k of I).
        let columns: Mat3<T> = rows.map(|column| cross(w, &column));
        let turned = |i: usize, k: usize| columns[k][i] + columns[i][k];
        let moved = Self::pair(&self.moment, &s.line);
        let line = cross(w, &self.moment);
        Self {
            inertia: [
                turned(0, 0) + moved[0],
                turned(1, 1) + moved[1],
                turned(2, 2) + moved[2],
                turned(0, 1) + moved[3],
                turned(0, 2) + moved[4],
                turned(1, 2) + moved[5],
            ],
            moment: [self.mass * s.line[0] + line[0], self.mass * s.line[1] + line[1], self.mass * s.line[2] + line[2]],
            mass: T::zero(),
        }
    }
}

/// The body of a link, seen in the frame that `t` leads to.
fn seen<T: Scalar>(inertia: &Mat3<T>, moment: &Vec3<T>, mass: T, t: &Step<T>) -> Body<T> {
    let rotated =
        |v: &Vec3<T>| -> Vec3<T> { std::array::from_fn(|r| t[r][0] * v[0] + t[r][1] * v[1] + t[r][2] * v[2]) };
    let half: Mat3<T> = std::array::from_fn(|k| rotated(&inertia[k]));
    let entry = |i: usize, k: usize| t[i][0] * half[0][k] + t[i][1] * half[1][k] + t[i][2] * half[2][k];
    let origin = [t[0][3], t[1][3], t[2][3]];
    let first = rotated(moment);
    let shift: Vec3<T> = origin.map(|x| mass * x);
    // R h + (m/2) o
    let middle: Vec3<T> = std::array::from_fn(|i| first[i] + shift[i].half());
    let moved = Body::pair(&origin, &middle);
    Body {
        inertia: [
            entry(0, 0) + moved[0],
            entry(1, 1) + moved[1],
            entry(2, 2) + moved[2],
            entry(0, 1) + moved[3],
            entry(0, 2) + moved[4],
            entry(1, 2) + moved[5],
        ],
        moment: sum(&first, &shift),
        mass,
    }
}

/// `s x* f`.
fn carried<T: Scalar>(s: &Screw<T>, f: &Screw<T>) -> Screw<T> {
    Screw { turn: sum(&cross(&s.turn, &f.turn), &cross(&s.line, &f.line)), line: cross(&s.turn, &f.line) }
}

/// The axis of joint 0 in frame 1: a constant, a cosine and a sine part of each entry, and how its square enters.
struct Base<T> {
    turn: Vec3<T>,
    line: Vec3<T>,
}

impl<T: Scalar> Base<T> {
    /// The axis and its moment before the turn of joint 1.
    fn new<const N: usize>(chain: &Chain<N, T>) -> Self {
        let (r, p) = (&chain.rotation[1], &chain.position[1]);
        Self { turn: r[2], line: std::array::from_fn(|k| r[1][k] * p[0] - r[0][k] * p[1]) }
    }

    /// Constant, cosine and sine coefficient of `S_0 . f`.
    #[inline]
    fn power(&self, f: &Screw<T>) -> [T; 3] {
        let (w, v) = (&self.turn, &self.line);
        [
            f.turn[2] * w[2] + f.line[2] * v[2],
            (f.turn[0] * w[0] + f.turn[1] * w[1]) + (f.line[0] * v[0] + f.line[1] * v[1]),
            (f.turn[0] * w[1] - f.turn[1] * w[0]) + (f.line[0] * v[1] - f.line[1] * v[0]),
        ]
    }

    /// What `S_0 . dI S_0` multiplies: six for the inertia, three for the moment.
    fn square(&self, [c, s]: [T; 2]) -> [T; 9] {
        let turn = |a: &Vec3<T>| [a[0] * c + a[1] * s, a[1] * c - a[0] * s, a[2]];
        let (w, v) = (turn(&self.turn), turn(&self.line));
        let across = cross(&v, &w);
        let twice = |x: T| x + x;
        [
            w[0] * w[0],
            w[1] * w[1],
            w[2] * w[2],
            twice(w[0] * w[1]),
            twice(w[0] * w[2]),
            twice(w[1] * w[2]),
            twice(across[0]),
            twice(across[1]),
            twice(across[2]),
        ]
    }
}

#[inline]
fn nine<T: Scalar>(rate: &Body<T>, square: &[T; 9]) -> T {
    let (i, h, z) = (&rate.inertia, &rate.moment, square);
    ((i[0] * z[0] + i[1] * z[1] + i[2] * z[2]) + (i[3] * z[3] + i[4] * z[4] + i[5] * z[5]))
        + (h[0] * z[6] + h[1] * z[7] + h[2] * z[8])
}

/// T with all joints but 0 and 1 set. `N - 1` rows j = 1 .. N-1, stored at index j.
struct Outer<const N: usize, T> {
    /// `dM_ab/dq_j`, `1 <= a <= b`, at `[j][b][a]`.
    block: [[[T; N]; N]; N],
    /// Coefficients of `dM_0b/dq_j`, b >= 1, at `[j][b]`.
    row: [[[T; 3]; N]; N],
    /// `dI_j`: multiplies into `dM_00/dq_j`.
    rate: [Body<T>; N],
}

#[inline]
fn outer<const N: usize, T: Scalar>(chain: &Chain<N, T>, steps: &[Step<T>; N], base: &Base<T>) -> Outer<N, T> {
    let zero = T::zero();
    let nobody = Body { inertia: [zero; 6], moment: [zero; 3], mass: zero };
    let mut axes = [Screw { turn: [zero; 3], line: [zero; 3] }; N];
    let mut bodies = [nobody; N];
    let mut frame = identity();
    for b in 1..N {
        if b > 1 {
            frame = compose(&frame, &steps[b]);
        }
        let axis = [frame[0][2], frame[1][2], frame[2][2]];
        axes[b] = Screw { turn: axis, line: cross(&[frame[0][3], frame[1][3], frame[2][3]], &axis) };
        bodies[b] = seen(&chain.inertia[b], &chain.first_moment[b], chain.mass[b], &frame);
    }
    for b in (2..N).rev() {
        let (child, own) = (bodies[b], &mut bodies[b - 1]);
        for (x, y) in own.inertia.iter_mut().zip(child.inertia) {
            *x = *x + y;
        }
        own.moment = sum(&own.moment, &child.moment);
        own.mass = own.mass + child.mass;
    }
    let mut out = Outer { block: [[[zero; N]; N]; N], row: [[[zero; 3]; N]; N], rate: [nobody; N] };
    for j in 1..N {
        out.rate[j] = bodies[j].rate(&axes[j]);
    }
    for b in 1..N {
        let momentum = bodies[b].apply(&axes[b]);
        for j in 1..N {
            let phi = if b < j { out.rate[j].apply(&axes[b]) } else { carried(&axes[j], &momentum) };
            out.row[j][b] = base.power(&phi);
            for a in 1..=b.min(j - 1) {
                out.block[j][b][a] = dot(&axes[a].turn, &phi.turn) + dot(&axes[a].line, &phi.line);
            }
        }
    }
    out
}

/// The sweep: the largest singular value of T found on the grid.
pub(crate) struct CoriolisSweep<const N: usize> {
    chain: Chain<N, f64>,
    base: Base<f64>,
    inner: Vec<([f64; 2], [f64; 9])>,
    /// Bound of what T is off by, in Frobenius norm.
    allowance: f64,
    factor: f64,
}

pub(crate) struct CoriolisState<const N: usize> {
    steps: [Step<f64>; N],
    norm: f64,
}

impl<const N: usize> CoriolisSweep<N> {
    /// `grid[j]` has the equispaced angles of joint j, one where nothing depends on it; `scale` is the arm whose numbers are off
    /// by what every number of `chain` may be off by. `N >= 2`.
    pub(crate) fn new(chain: &Chain<N, f64>, scale: &Chain<N, f64>, grid: &[Points]) -> Self {
        let base = Base::new(chain);
        let inner = grid[1].at.iter().map(|node| (*node, base.square(*node))).collect();
        let factor = grid[1..]
            .iter()
            .filter(|points| points.at.len() > 1)
            .map(|points| degree_two_factor(points.at.len()))
            .fold(1.0, |product, factor| (product * factor).next_up());
        Self { chain: chain.clone(), base, inner, allowance: allowance(chain, scale, grid), factor }
    }

    /// What was added for rounding, kg m².
    pub(crate) fn allowance(&self) -> f64 {
        0.5 * self.allowance
    }

    /// The bound that follows from the largest singular value on the grid.
    pub(crate) fn bound(&self, norm: f64) -> f64 {
        (0.5 * self.factor * (norm + self.allowance)) * (1.0 + 8.0 * UNIT)
    }
}

impl<const N: usize> Sweep for CoriolisSweep<N> {
    type State = CoriolisState<N>;

    fn begin(&self, maxima: &[f64]) -> Self::State {
        CoriolisState { steps: [[[0.0; 4]; 3]; N], norm: maxima.first().copied().unwrap_or(0.0) }
    }

    #[inline]
    fn descend(&self, state: &mut Self::State, joint: usize, corner: [f64; 2]) {
        state.steps[joint] = self.chain.step(joint, corner);
    }

    fn visit(&self, state: &mut Self::State) {
        let outer = outer(&self.chain, &state.steps, &self.base);
        let mut block = [[0.0; N]; N];
        for j in 2..N {
            for k in 2..=j {
                let mut sum = 0.0;
                for b in 1..N {
                    let (x, y) = (&outer.block[j][b], &outer.block[k][b]);
                    let mut twice = 0.0;
                    for a in 1..b {
                        twice += x[a] * y[a];
                    }
                    sum += 2.0 * twice + x[b] * y[b];
                }
                block[j][k] = sum;
            }
        }
        let trace: f64 = (2..N).map(|j| block[j][j]).sum();
        let n = N as f64;
        let mut limit = state.norm * state.norm;
        // Entries of the Gram matrix sum at most N^2 products of entries whose squares sum to at most the trace, N limit.
        let slack = |limit: f64| 4.0 * (n * n + 8.0) * UNIT * n * limit + cholesky_allowance(N, 2.0 * n * limit);
        let mut shift = slack(limit);
        for ([c, s], square) in &self.inner {
            let mut row = [[0.0; N]; N];
            let mut total = trace;
            for j in 1..N {
                let zero = nine(&outer.rate[j], square);
                row[j][0] = zero;
                let mut twice = 0.0;
                for b in 1..N {
                    let [x, y, z] = outer.row[j][b];
                    let entry = x + (y * c + z * s);
                    row[j][b] = entry;
                    twice += entry * entry;
                }
                total += 2.0 * twice + zero * zero;
            }
            if total <= limit - shift {
                continue;
            }
            let mut gram = [[0.0; N]; N];
            for j in 1..N {
                for k in 1..=j {
                    let (x, y) = (&row[j], &row[k]);
                    let mut twice = 0.0;
                    for b in 1..N {
                        twice += x[b] * y[b];
                    }
                    gram[j][k] = block[j][k] + (2.0 * twice + x[0] * y[0]);
                }
            }
            let passes = |limit: f64, shift: f64| {
                let mut factor = Factor::<N>::EMPTY;
                (1..N).all(|j| {
                    let mut left = [0.0; N];
                    for k in 1..=j {
                        left[k - 1] = -gram[j][k];
                    }
                    factor.push(j - 1, &left, limit - shift + left[j - 1])
                })
            };
            if !passes(limit, shift) {
                let matrix = JointMatrix::<N>::from_fn(|a, b| gram[a.max(b)][a.min(b)]);
                let mut norm = symmetric_eigen(&matrix).largest().0.max(0.0).sqrt() * (1.0 + RAISE);
                while !passes(norm * norm, slack(norm * norm)) && norm.is_finite() {
                    norm = norm * (1.0 + RAISE) + f64::MIN_POSITIVE.sqrt();
                }
                state.norm = larger(state.norm, norm);
                limit = state.norm * state.norm;
                shift = slack(limit);
            }
        }
    }

    fn maxima(&self, state: &Self::State) -> Vec<f64> {
        vec![state.norm]
    }
}

/// What T is off by at any node, in Frobenius norm.
fn allowance<const N: usize>(chain: &Chain<N, f64>, scale: &Chain<N, f64>, grid: &[Points]) -> f64 {
    let bounds = chain.majorant_like(scale);
    let at = |j: usize| [Majorant::input(grid[j].size, grid[j].error); 2];
    let mut steps = [[[Majorant::zero(); 4]; 3]; N];
    for (j, step) in steps.iter_mut().enumerate().skip(2) {
        *step = bounds.step(j, at(j));
    }
    let base = Base::new(&bounds);
    let outer = outer(&bounds, &steps, &base);
    let square = base.square(at(1));
    let [c, s] = at(1);
    let mut sum = 0.0;
    for j in 1..N {
        sum += nine(&outer.rate[j], &square).bound().powi(2);
        for b in 1..N {
            let [x, y, z] = outer.row[j][b];
            sum += 2.0 * (x + (y * c + z * s)).bound().powi(2);
            for a in 1..=b {
                sum += 2.0 * outer.block[j][b][a].bound().powi(2);
            }
        }
    }
    1.01 * sum.sqrt() + f64::MIN_POSITIVE.sqrt()
}

/// `dM/dq_j`, for every j, at one point of the circle for each joint; `N >= 2`.
#[cfg(test)]
pub(crate) fn slopes_at<const N: usize, T: Scalar>(chain: &Chain<N, T>, at: &[[T; 2]; N]) -> [[[T; N]; N]; N] {
    let mut steps = [[[T::zero(); 4]; 3]; N];
    for j in 2..N {
        steps[j] = chain.step(j, at[j]);
    }
    let base = Base::new(chain);
    let outer = outer(chain, &steps, &base);
    let square = base.square(at[1]);
    let [c, s] = at[1];
    let mut slopes = outer.block;
    for j in 1..N {
        slopes[j][0][0] = nine(&outer.rate[j], &square);
        for b in 1..N {
            let [x, y, z] = outer.row[j][b];
            slopes[j][b][0] = x + (y * c + z * s);
            for a in 0..b {
                slopes[j][a][b] = slopes[j][b][a];
            }
        }
    }
    slopes
}
