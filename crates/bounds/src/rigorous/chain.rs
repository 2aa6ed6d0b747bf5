//! An arm as the sweeps see it: constant frames, and bodies as second moments.
//!
//! | symbol | code | meaning | unit |
//! |--------|------|---------|------|
//! | R_j, p_j | [`Chain::rotation`], [`Chain::position`] | frame of joint j in link j-1 at q = 0 | 1, m |
//! | P_j | [`Chain::second_moments`] | `sum m (r;1)(r;1)'` over link j, r in its frame (the pseudo-inertia) | kg m², kg m, kg |
//! | x_j = (c, s) | `corner` | cosine and sine of q_j, or a corner of a polygon around them | 1 |
//! | B_j(x) | [`step`] | `[R_j Rz(x) | p_j]`, affine in x | |
//!
//! `P = [tr(I)/2 - I, h; h', m]` from mass, first moment and inertia I about the origin. A body that can exist has `P >= 0`.
//!
//! **Which arm the bounds are about.** The numbers of the [`Model`] are roundings of what somebody meant: decimals of a file, products, sums
//! over merged bodies, sines of a frame's angles. So the bounds hold for every arm whose frames are rotations and whose numbers are off by
//! at most: mass, positions and gravity 2^-48 of their own size; first moments `2^-48 sqrt(m tr I)`; inertias `2^-48 tr I` (each sum of merged
//! parts is at most that); rotation entries `2^-48` plus three times the largest entry of `R'R - 1`, and nothing where R holds only 0 and +-1.
//! The nearest orthogonal matrix is within `|R'R - 1|`. The bounds hold in particular for the model as compiled, and for the decimal arm.

use certune_dynamics::Model;

use crate::error::BoundsError;
use crate::rigorous::definite::exceeds;
use crate::rigorous::scalar::{Majorant, Scalar, larger};

/// Relative error that every number of an arm may carry.
const DATA: f64 = 1.0 / (1_u64 << 48) as f64;
/// Share of a link's second moments that is added where rounding leaves them not clearly positive definite.
const INFLATION: f64 = 1.0 / (1_u64 << 40) as f64;

pub(crate) type Vec3<T> = [T; 3];
pub(crate) type Mat3<T> = [[T; 3]; 3];
/// Rows 0 to 2 of a homogeneous transform.
pub(crate) type Step<T> = [[T; 4]; 3];
/// A symmetric 4x4 matrix, both triangles stored.
pub(crate) type Sym4<T> = [[T; 4]; 4];

/// One arm, with scalars of any kind.
#[derive(Clone, Debug)]
pub(crate) struct Chain<const N: usize, T> {
    pub rotation: [Mat3<T>; N],
    pub position: [Vec3<T>; N],
    /// Inertia about the origin of the link's frame, full symmetric.
    pub inertia: [Mat3<T>; N],
    pub first_moment: [Vec3<T>; N],
    pub mass: [T; N],
    /// Acceleration of a falling body.
    pub gravity: Vec3<T>,
}

impl<const N: usize> Chain<N, f64> {
    /// The numbers of a model; rotor inertia and friction are left out.
    pub(crate) fn new(model: &Model<N>) -> Self {
        let links = model.link_constants();
        Self {
            rotation: links.map(|link| link.rotation),
            position: links.map(|link| link.position_m),
            inertia: links.map(|link| {
                let [xx, yy, zz, xy, xz, yz] = link.about_origin_kg_m2;
                [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            }),
            first_moment: links.map(|link| link.first_moment_kg_m),
            mass: links.map(|link| link.mass_kg),
            gravity: model.gravity_m_per_s2(),
        }
    }

    /// Bounds of the numbers and of what they may be off by.
    pub(crate) fn majorant(&self) -> Chain<N, Majorant> {
        self.majorant_like(self)
    }

    /// [`Chain::majorant`] for an arm whose bodies are a part of those of `whole`, each computed by one sum or difference.
    pub(crate) fn majorant_like(&self, whole: &Self) -> Chain<N, Majorant> {
        let relative = |x: f64| Majorant::input(x, DATA * x.abs());
        let trace = |j: usize| (0..3).map(|a| whole.inertia[j][a][a].abs()).sum::<f64>();
        Chain {
            rotation: std::array::from_fn(|j| {
                let error = rotation_error(&self.rotation[j]);
                self.rotation[j].map(|row| row.map(|x| Majorant::input(x, error)))
            }),
            position: self.position.map(|p| p.map(relative)),
            inertia: std::array::from_fn(|j| {
                let error = 2.0 * DATA * trace(j);
                self.inertia[j].map(|row| row.map(|x| Majorant::input(x, error)))
            }),
            first_moment: std::array::from_fn(|j| {
                let error = 2.0 * DATA * (whole.mass[j].abs() * trace(j)).sqrt();
                self.first_moment[j].map(|x| Majorant::input(x, error))
            }),
            mass: std::array::from_fn(|j| Majorant::input(self.mass[j], 2.0 * DATA * whole.mass[j].abs())),
            gravity: self.gravity.map(relative),
        }
    }

    /// The same arm with every body checked to have positive semidefinite second moments, in the sense that the sweeps need: the
    /// inertias returned are those of the arm or larger, in the order of second moments.
    ///
    /// # Errors
    /// [`BoundsError::SecondMoments`] names the first link whose body cannot exist.
    pub(crate) fn physical(&self) -> Result<Self, BoundsError> {
        let mut checked = self.clone();
        let bounds = self.majorant();
        for j in 0..N {
            let allowance = bounds.second_moments(j).map(|row| row.map(Majorant::bound));
            let size = bounds.second_moments(j).iter().flatten().map(|x| x.magnitude()).fold(0.0, larger);
            if size <= 0.0 || exceeds(&checked.second_moments(j), &allowance) {
                continue;
            }
            // Adding d to the three second moments adds 2 d to the inertias about the axes.
            let added = INFLATION * size;
            for a in 0..3 {
                checked.inertia[j][a][a] += 2.0 * added;
            }
            checked.mass[j] *= 1.0 + INFLATION;
            if !exceeds(&checked.second_moments(j), &allowance) {
                return Err(BoundsError::SecondMoments { link: j + 1 });
            }
        }
        Ok(checked)
    }

    /// The arm with the last link's body replaced by its mean over turns about its own joint, and with all bodies replaced by what
    /// the last link's lacks of that mean.
    pub(crate) fn split_tip(&self) -> [Self; 2] {
        let Some(tip) = N.checked_sub(1) else { return [self.clone(), self.clone()] };
        let (i, h) = (self.inertia[tip], self.first_moment[tip]);
        let mut mean = self.clone();
        let average = 0.5 * (i[0][0] + i[1][1]);
        mean.inertia[tip] = [[average, 0.0, 0.0], [0.0, average, 0.0], [0.0, 0.0, i[2][2]]];
        mean.first_moment[tip] = [0.0, 0.0, h[2]];
        let mut rest = self.alone(N);
        let half = 0.5 * (i[0][0] - i[1][1]);
        rest.inertia[tip] = [[half, i[0][1], i[0][2]], [i[0][1], -half, i[1][2]], [i[0][2], i[1][2], 0.0]];
        rest.first_moment[tip] = [h[0], h[1], 0.0];
        [mean, rest]
    }

    /// The same arm with only link `only`.
    pub(crate) fn alone(&self, only: usize) -> Self {
        let mut alone = self.clone();
        for j in (0..N).filter(|j| *j != only) {
            alone.inertia[j] = [[0.0; 3]; 3];
            alone.first_moment[j] = [0.0; 3];
            alone.mass[j] = 0.0;
        }
        alone
    }
}

/// How far the entries of a rotation may be from those of the nearest orthogonal matrix.
fn rotation_error(r: &Mat3<f64>) -> f64 {
    if r.iter().flatten().all(|x| x.abs() <= 0.0 || (x.abs() - 1.0).abs() <= 0.0) {
        return 0.0;
    }
    let mut deviation = 0.0_f64;
    for a in 0..3 {
        for b in 0..3 {
            let product: f64 = (0..3).map(|k| r[k][a] * r[k][b]).sum();
            deviation = larger(deviation, (product - if a == b { 1.0 } else { 0.0 }).abs());
        }
    }
    3.0 * deviation + DATA
}

impl<const N: usize, T: Scalar> Chain<N, T> {
    /// `P_j`.
    pub(crate) fn second_moments(&self, j: usize) -> Sym4<T> {
        let i = &self.inertia[j];
        let half = (i[0][0] + i[1][1] + i[2][2]).half();
        let h = self.first_moment[j];
        [
            [half - i[0][0], -i[0][1], -i[0][2], h[0]],
            [-i[0][1], half - i[1][1], -i[1][2], h[1]],
            [-i[0][2], -i[1][2], half - i[2][2], h[2]],
            [h[0], h[1], h[2], self.mass[j]],
        ]
    }

    /// `B_j(x)`.
    #[inline]
    pub(crate) fn step(&self, j: usize, [c, s]: [T; 2]) -> Step<T> {
        let (r, p) = (&self.rotation[j], &self.position[j]);
        std::array::from_fn(|a| [r[a][0] * c + r[a][1] * s, r[a][1] * c - r[a][0] * s, r[a][2], p[a]])
    }
}

/// `own + B K B'`: what hangs on a link, with the link itself, in its frame.
#[inline]
pub(crate) fn composite<T: Scalar>(own: &Sym4<T>, b: &Step<T>, child: &Sym4<T>) -> Sym4<T> {
    let product: Step<T> = std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            b[r][0] * child[0][c] + b[r][1] * child[1][c] + b[r][2] * child[2][c] + b[r][3] * child[3][c]
        })
    });
    let mut sum = *own;
    for r in 0..3 {
        for c in r..3 {
            let term =
                product[r][0] * b[c][0] + product[r][1] * b[c][1] + product[r][2] * b[c][2] + product[r][3] * b[c][3];
            sum[r][c] = own[r][c] + term;
            sum[c][r] = sum[r][c];
        }
        sum[r][3] = own[r][3] + product[r][3];
        sum[3][r] = sum[r][3];
    }
    sum[3][3] = own[3][3] + child[3][3];
    sum
}

/// `A B` for homogeneous transforms; A may also be a derivative of one, B has `(0 0 0 1)` below it.
#[inline]
pub(crate) fn compose<T: Scalar>(a: &Step<T>, b: &Step<T>) -> Step<T> {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let sum = a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
            if c == 3 { sum + a[r][3] } else { sum }
        })
    })
}

/// The identity.
pub(crate) fn identity<T: Scalar>() -> Step<T> {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { T::one() } else { T::zero() }))
}

/// `T E`, E the turn by a right angle about z: the derivative by the angle of `T Rz`.
#[inline]
pub(crate) fn turned<T: Scalar>(t: &Step<T>) -> Step<T> {
    std::array::from_fn(|r| [t[r][1], -t[r][0], T::zero(), T::zero()])
}
