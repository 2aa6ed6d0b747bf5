//! The inertia matrix and the Coriolis form over a small box of configurations, enclosed: what no arm of the family can leave.
//!
//! ```text
//! |M_ij(q) - Mc_ij| <= R_ij                                   for every q with lower <= q <= upper and every arm of the box
//! |x'C(q, v) y|     <= k_C |x| |v| |y|                        for all x, v, y
//! ```
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | lower, upper | `lower_rad`, `upper_rad` | rad |
//! | Mc, R | `midpoint_kg_m2`, `radius_kg_m2` | kg m^2 |
//! | k_C | `coriolis_kg_m2` | kg m^2 (per rad) |
//!
//! **How.** The recursions of `certune_dynamics` run on first-order Taylor models with rigorous remainders, group by group of the mass box (M
//! is affine in the scales). With Christoffel symbols `G_ijk = 1/2 (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i)`,
//! `x'C(q,v)y = sum G_ijk x_i y_j v_k`, and the form is at most the largest singular value of any of the three n x n^2 matrices with the
//! entries of G: that of the midpoints, `A A'` having `lambda_max <= (trace (A A')^16)^(1/16)`, plus the Frobenius norm of the radii. Every
//! joint's range but the first's, which M does not depend on, is halved `halvings` times and the results are joined.
//!
//! The model's own numbers were rounded when it was made; each is widened by `2^-45 (|x| + 1)` before use. The results are decimals
//! with four places, rounded outward.
//!
//! Source: R. E. Moore, *Interval Analysis* (1966). Limits: the cost is 2 to the power `(N - 1) halvings`; second-order terms in the width of a
//! piece remain in every number.

mod affine;

use certune_dynamics::{Model, mass_matrix_as_described, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints, Real};
use num_traits::Zero;
use rayon::prelude::*;

use crate::arm_box::ArmBox;
use crate::error::BoundsError;
use crate::interval::Interval;
use crate::rigorous::larger;
use affine::Affine;

/// Results are decimals with this many units.
const UNITS_PER_KG_M2: f64 = 1e4;

/// A proved enclosure; the formulas stand in the module's documentation of `enclosure`.
///
/// Every number is the shortest decimal of its `f64`, with four places at most, and the inequalities hold for that decimal.
#[derive(Clone, Debug, PartialEq)]
pub struct Enclosure<const N: usize> {
    /// Least angle of each joint, rad.
    pub lower_rad: [f64; N],
    /// Largest angle of each joint, rad.
    pub upper_rad: [f64; N],
    /// Mc, symmetric, kg m^2.
    pub midpoint_kg_m2: [[f64; N]; N],
    /// R, symmetric, kg m^2.
    pub radius_kg_m2: [[f64; N]; N],
    /// k_C, kg m^2.
    pub coriolis_kg_m2: f64,
}

/// A group of bodies with its scale.
type Group<const N: usize> = (Model<N, Affine<N>>, Affine<N>);

/// What one piece of the box gives.
#[derive(Clone, Copy)]
struct Piece<const N: usize> {
    mass: JointMatrix<N, Interval>,
    coriolis: f64,
}

/// Encloses M and the Coriolis form of every arm of `arms` for `lower_rad <= q <= upper_rad`, on all cores.
///
/// The ends count as the floating-point numbers given, moved outward by one. Cost: `2^((N - 1) halvings)` evaluations of dM/dq in intervals.
///
/// # Errors
/// [`BoundsError::ConfigurationBox`] names the first joint whose range is not `lower <= upper`, finite.
pub fn enclosure<const N: usize>(
    arms: &ArmBox<N>,
    lower_rad: &[f64; N],
    upper_rad: &[f64; N],
    halvings: u32,
) -> Result<Enclosure<N>, BoundsError> {
    for joint in 0..N {
        let (lower, upper) = (lower_rad[joint], upper_rad[joint]);
        if !(lower <= upper && lower.is_finite() && upper.is_finite()) {
            return Err(BoundsError::ConfigurationBox { joint: joint + 1, lower, upper });
        }
    }
    let groups: Vec<Group<N>> = arms
        .groups()
        .iter()
        .map(|group| {
            let model = Model::pack(&[&group.model], |[x]| Affine::widened(x));
            (model, Affine::from_interval(Interval::new(group.scale[0].next_down(), group.scale[1].next_up())))
        })
        .collect();
    let parts = 1_usize << halvings;
    // M does not depend on the first joint's angle.
    let pieces = parts.pow(u32::try_from(N.saturating_sub(1)).unwrap_or(0));
    let cut = |joint: usize, part: usize| {
        let (lower, upper) = (lower_rad[joint].next_down(), upper_rad[joint].next_up());
        let at = |part: usize| match part {
            0 => lower,
            _ if part == parts => upper,
            _ => lower + (upper - lower) * (part as f64 / parts as f64),
        };
        Affine::angle(joint, at(part), at(part + 1))
    };
    let joined = (0..pieces)
        .into_par_iter()
        .map(|index| {
            let mut rest = index;
            let q = Joints::<N, Affine<N>>::from_fn(|joint, _| {
                if joint == 0 {
                    return Affine::zero();
                }
                let part = rest % parts;
                rest /= parts;
                cut(joint, part)
            });
            piece(&groups, &q)
        })
        .reduce_with(|a, b| Piece {
            mass: a.mass.zip_map(&b.mass, Interval::hull),
            coriolis: larger(a.coriolis, b.coriolis),
        });
    // There is at least one piece.
    let Piece { mut mass, coriolis } = joined.unwrap_or(Piece { mass: JointMatrix::zeros(), coriolis: f64::INFINITY });
    let [rotor_lower, rotor_upper] = arms.rotor_inertia_kg_m2();
    for joint in 0..N {
        mass[(joint, joint)] += Interval::new(rotor_lower[joint], rotor_upper[joint]);
    }
    let mut midpoint_kg_m2 = [[0.0; N]; N];
    let mut radius_kg_m2 = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..N {
            let entry = mass[(i.min(j), i.max(j))];
            let middle = (entry.middle() * UNITS_PER_KG_M2).round() / UNITS_PER_KG_M2;
            midpoint_kg_m2[i][j] = middle;
            radius_kg_m2[i][j] = rounded_up(entry.distance_from(middle));
        }
    }
    Ok(Enclosure {
        lower_rad: *lower_rad,
        upper_rad: *upper_rad,
        midpoint_kg_m2,
        radius_kg_m2,
        coriolis_kg_m2: rounded_up(coriolis),
    })
}

/// A decimal with four places that is at least `x`: up to a whole unit more than needed, which hides the roundings of this very line.
fn rounded_up(x: f64) -> f64 {
    ((x * UNITS_PER_KG_M2).ceil() + 1.0) / UNITS_PER_KG_M2
}

fn piece<const N: usize>(groups: &[Group<N>], q: &Joints<N, Affine<N>>) -> Piece<N> {
    let mut mass = JointMatrix::<N, Affine<N>>::zeros();
    let mut slopes = [JointMatrix::<N, Affine<N>>::zeros(); N];
    for (model, scale) in groups {
        mass += mass_matrix_as_described(model, q).map(|x| x * *scale);
        for (sum, derivative) in slopes.iter_mut().zip(mass_matrix_derivatives(model, q)) {
            *sum += derivative.map(|x| x * *scale);
        }
    }
    Piece { mass: mass.map(Affine::range), coriolis: coriolis_bound(&slopes) }
}

/// An upper bound of `|x'C(q, v) y|` over unit vectors, from enclosures of dM/dq_k.
fn coriolis_bound<const N: usize>(slopes: &[JointMatrix<N, Affine<N>>; N]) -> f64 {
    let half = Affine::from_f64(0.5);
    let christoffel = |i: usize, j: usize, k: usize| (slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)]) * half;
    let mut middle = vec![0.0; N * N * N];
    let mut squares = Interval::zero();
    for i in 0..N {
        for j in 0..N {
            for k in 0..N {
                let entry = christoffel(i, j, k).range();
                let centre = entry.middle();
                middle[(i * N + j) * N + k] = centre;
                let radius = Interval::from_f64(entry.distance_from(centre));
                squares += radius * radius;
            }
        }
    }
    let at = |i: usize, j: usize, k: usize| middle[(i * N + j) * N + k];
    let flattenings: [JointMatrix<N, Interval>; 3] =
        [gram(at), gram(|row, a, b| at(a, row, b)), gram(|row, a, b| at(a, b, row))];
    let norm = flattenings.into_iter().map(largest_singular_value).fold(f64::INFINITY, f64::min);
    (Interval::from_f64(norm) + squares.sqrt()).upper()
}

/// `A A'` for the n x n^2 matrix with rows `entry(row, ., .)`.
fn gram<const N: usize>(entry: impl Fn(usize, usize, usize) -> f64) -> JointMatrix<N, Interval> {
    JointMatrix::from_fn(|r, s| {
        let mut sum = Interval::zero();
        for a in 0..N {
            for b in 0..N {
                sum += Interval::from_f64(entry(r, a, b)) * Interval::from_f64(entry(s, a, b));
            }
        }
        sum
    })
}

/// An upper bound of the square root of the largest eigenvalue of a positive semidefinite `gram`: `(trace gram^16)^(1/32)`.
fn largest_singular_value<const N: usize>(gram: JointMatrix<N, Interval>) -> f64 {
    let mut power = gram;
    for _ in 0..4 {
        power *= power;
    }
    let trace = (0..N).fold(Interval::zero(), |sum, i| sum + power[(i, i)]);
    (0..5).fold(trace, |root, _| root.sqrt()).upper()
}
