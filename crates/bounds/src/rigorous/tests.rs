//! The rounding argument against exact rational arithmetic, and polygons against exact geometry.

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul, Neg, Sub};

use certune_dynamics::{Model, Robot};
use certune_testkit::serial_arm;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use super::angle::{Points, Span, nodes};
use super::chain::Chain;
use super::coriolis::{CoriolisSweep, slopes_at};
use super::definite::exceeds;
use super::gravity::{GravitySweep, Wanted, first_joint, stiffness_at, torque_at};
use super::inertia::{InertiaSweep, inertia_at};
use super::scalar::{Majorant, Scalar};
use super::*;
use crate::interval::Interval;
use crate::sequence::Kronecker;
use certune_linsys::Real;

/// A rational number that can be copied: its memory is never returned, which a test can afford.
#[derive(Clone, Copy, Debug)]
struct Exact(&'static BigRational);

impl Exact {
    fn new(x: BigRational) -> Self {
        Self(Box::leak(Box::new(x)))
    }
    fn float(x: f64) -> Self {
        Self::new(BigRational::from_float(x).unwrap())
    }
    fn minus_float(self, x: f64) -> f64 {
        (self.0 - BigRational::from_float(x).unwrap()).to_f64().unwrap()
    }
}

impl Add for Exact {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.0 + other.0)
    }
}
impl Sub for Exact {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.0 - other.0)
    }
}
impl Mul for Exact {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self::new(self.0 * other.0)
    }
}
impl Neg for Exact {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.0)
    }
}
impl Scalar for Exact {
    fn zero() -> Self {
        Self::new(BigRational::zero())
    }
    fn one() -> Self {
        Self::new(BigRational::one())
    }
    fn half(self) -> Self {
        Self::new(self.0 / BigRational::from_integer(2.into()))
    }
}

fn exact_chain<const N: usize>(chain: &Chain<N, f64>) -> Chain<N, Exact> {
    Chain {
        rotation: chain.rotation.map(|r| r.map(|row| row.map(Exact::float))),
        position: chain.position.map(|p| p.map(Exact::float)),
        inertia: chain.inertia.map(|i| i.map(|row| row.map(Exact::float))),
        first_moment: chain.first_moment.map(|h| h.map(Exact::float)),
        mass: chain.mass.map(Exact::float),
        gravity: chain.gravity.map(Exact::float),
    }
}

fn panda() -> Chain<7, f64> {
    Chain::new(&Model::new(&Robot::panda()).unwrap())
}

fn serial() -> Vec<Chain<4, f64>> {
    let mut runner = TestRunner::deterministic();
    (0..6)
        .map(|_| Chain::new(&Model::new(&serial_arm::<4>().new_tree(&mut runner).unwrap().current()).unwrap()))
        .collect()
}

/// Corner of every joint, drawn by a low-discrepancy sequence.
fn draw<const N: usize>(corners: &[Points], index: usize) -> [[f64; 2]; N] {
    let shares: Vec<f64> = Kronecker::new(N).point(index).collect();
    std::array::from_fn(|j| corners[j].at[(shares[j] * corners[j].at.len() as f64) as usize])
}

fn polygons_of<const N: usize>() -> Vec<Points> {
    (0..N).map(|j| Span::Circle.corners(5 + 2 * j).unwrap()).collect()
}

/// Largest difference between computed and exact entries, at several corners.
fn worst<const N: usize, const R: usize>(
    chain: &Chain<N, f64>,
    corners: &[Points],
    computed: impl Fn(&Chain<N, f64>, &[[f64; 2]; N]) -> [[f64; N]; R],
    exact: impl Fn(&Chain<N, Exact>, &[[Exact; 2]; N]) -> [[Exact; N]; R],
) -> f64 {
    let rational = exact_chain(chain);
    let mut worst = 0.0_f64;
    for index in 0..3 {
        let at: [[f64; 2]; N] = draw(corners, index);
        let (floats, truth) = (computed(chain, &at), exact(&rational, &at.map(|x| x.map(Exact::float))));
        let mut square = 0.0;
        for a in 0..R {
            for b in 0..N {
                square += truth[a][b].minus_float(floats[a][b]).powi(2);
            }
        }
        worst = worst.max(square.sqrt());
    }
    worst
}

fn rounding_is_bounded<const N: usize>(chain: &Chain<N, f64>) {
    let corners = polygons_of::<N>();
    let inertia = InertiaSweep::new(chain, [0.0; N], [1.0; N], &corners).unwrap();
    let error = worst(chain, &corners, inertia_at, inertia_at);
    assert!(error > 0.0 && error <= inertia.allowance(), "{error} against {}", inertia.allowance());

    let gravity = GravitySweep::new(chain, &[Span::Circle; N], &corners, Wanted::Stiffness);
    let error = worst(chain, &corners, stiffness_at, |c, x| stiffness_from(c, first_joint(chain), x));
    assert!(error <= gravity.allowance(), "{error} against {}", gravity.allowance());
    assert!(torque_at(chain, &draw(&corners, 0)).iter().all(|g| g.is_finite()));

    let grid: Vec<Points> = (0..N).map(|_| nodes(16).unwrap()).collect();
    let coriolis = CoriolisSweep::new(chain, chain, &grid);
    let error =
        (2..N).map(|j| worst(chain, &grid, |c, x| slopes_at(c, x)[j], |c, x| slopes_at(c, x)[j])).fold(0.0, f64::max);
    assert!(error > 0.0 && error <= coriolis.allowance(), "{error} against {}", coriolis.allowance());
    // What rounding costs is nowhere near the digits that are reported.
    for allowance in [inertia.allowance(), gravity.allowance(), coriolis.allowance()] {
        assert!(allowance < 1e-7, "{allowance}");
    }
}

fn stiffness_from<const N: usize>(chain: &Chain<N, Exact>, first: usize, at: &[[Exact; 2]; N]) -> [[Exact; N]; N] {
    super::gravity::stiffness_from(chain, first, at)
}

#[test]
fn every_entry_is_off_by_no_more_than_was_allowed_for() {
    rounding_is_bounded(&panda());
    for chain in serial() {
        rounding_is_bounded(&chain);
    }
}

proptest! {
    #[test]
    fn a_majorant_bounds_every_straight_line(
        inputs in proptest::collection::vec(-1e3..1e3_f64, 4),
        program in proptest::collection::vec((0..3_u8, any::<u16>(), any::<u16>()), 1..30),
    ) {
        let mut floats = inputs.clone();
        let mut truth: Vec<Exact> = inputs.iter().map(|x| Exact::float(*x)).collect();
        let mut bounds: Vec<Majorant> = inputs.iter().map(|x| Majorant::input(*x, 0.0)).collect();
        for (operation, i, k) in program {
            let (i, k) = (usize::from(i) % floats.len(), usize::from(k) % floats.len());
            // Sizes stay moderate, as in a recursion.
            if operation == 2 && bounds[i].magnitude() * bounds[k].magnitude() > 1e100 {
                continue;
            }
            match operation {
                0 => { floats.push(floats[i] + floats[k]); truth.push(truth[i] + truth[k]); bounds.push(bounds[i] + bounds[k]); }
                1 => { floats.push(floats[i] - floats[k]); truth.push(truth[i] - truth[k]); bounds.push(bounds[i] - bounds[k]); }
                _ => { floats.push(floats[i] * floats[k]); truth.push(truth[i] * truth[k]); bounds.push(bounds[i] * bounds[k]); }
            }
        }
        for ((x, t), bound) in floats.iter().zip(&truth).zip(&bounds) {
            prop_assert!(t.minus_float(*x).abs() <= bound.bound());
            prop_assert!(x.abs() <= bound.magnitude());
        }
    }

    /// Matrices within a few roundings of singular: what passes is positive definite, in exact arithmetic.
    #[test]
    fn what_cholesky_accepts_is_positive_definite(
        entries in proptest::array::uniform9(-1.0..1.0_f64), scale in -1.0..1.0_f64, near in 10..17_i32,
    ) {
        // Rank two, plus something of either sign that is about as small as the allowance.
        let v = |k: usize| [entries[3 * k], entries[3 * k + 1], entries[3 * k + 2]];
        let (x, y) = (v(0), v(1));
        let mut a = [[0.0; 3]; 3];
        for i in 0..3 {
            for k in 0..=i {
                a[i][k] = x[i] * x[k] + y[i] * y[k];
                a[k][i] = a[i][k];
            }
            a[i][i] += scale * 10.0_f64.powi(-near);
        }
        if exceeds(&a, &[[0.0; 3]; 3]) {
            let e = a.map(|row| row.map(|x| BigRational::from_float(x).unwrap()));
            let minor = &e[0][0] * &e[1][1] - &e[0][1] * &e[1][0];
            let det = &e[0][0] * (&e[1][1] * &e[2][2] - &e[1][2] * &e[2][1])
                - &e[0][1] * (&e[1][0] * &e[2][2] - &e[1][2] * &e[2][0])
                + &e[0][2] * (&e[1][0] * &e[2][1] - &e[1][1] * &e[2][0]);
            prop_assert!(e[0][0].is_positive() && minor.is_positive() && det.is_positive());
        }
    }

    /// Every point of the arc keeps clear of the border of the hull by far more than a rounding.
    #[test]
    fn an_arc_lies_within_its_corners(lower in -7.0..7.0_f64, width in 0.0..6.27_f64, more in 0_usize..6) {
        let span = Span::between(0, lower, lower + width).unwrap();
        prop_assume!(matches!(span, Span::Arc(..)));
        let pieces = span.fewest_pieces() + more;
        let found = span.corners(pieces).unwrap().at;
        prop_assert_eq!(found.len(), span.corner_count(pieces));
        // Tangents first, then both ends: in order around the hull.
        let (tangents, ends) = found.split_at(pieces);
        let hull: Vec<[f64; 2]> = std::iter::once(ends[0]).chain(tangents.iter().copied()).chain([ends[1]]).collect();
        for k in 0..=200 {
            let angle = lower + width * f64::from(k) / 200.0;
            let point = [angle.cos(), angle.sin()];
            for i in 0..hull.len() {
                let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
                let edge = [b[0] - a[0], b[1] - a[1]];
                let across = edge[0] * (point[1] - a[1]) - edge[1] * (point[0] - a[0]);
                prop_assert!(across > 1e-12 * edge[0].hypot(edge[1]), "edge {} at {}", i, angle);
            }
        }
    }

    #[test]
    fn enclosures_hold_sine_and_cosine(x in -15.0..15.0_f64) {
        let [cos, sin] = Interval::from_f64(x).cos_sin();
        for (enclosure, value) in [(cos, x.cos()), (sin, x.sin())] {
            prop_assert!(enclosure.lower() <= value.next_up() && value.next_down() <= enclosure.upper());
            prop_assert!(enclosure.width() < 1e-12);
        }
    }
}

#[test]
fn a_circle_lies_within_its_corners_exactly() {
    for pieces in 4..200 {
        let corners = Span::Circle.corners(pieces).unwrap().at;
        let exact: Vec<[BigRational; 2]> =
            corners.iter().map(|corner| corner.map(|x| BigRational::from_float(x).unwrap())).collect();
        let mut turn = 0.0;
        for k in 0..pieces {
            let (a, b) = (&exact[k], &exact[(k + 1) % pieces]);
            let cross = &a[0] * &b[1] - &a[1] * &b[0];
            let edge = [&b[0] - &a[0], &b[1] - &a[1]];
            let length = &edge[0] * &edge[0] + &edge[1] * &edge[1];
            // The edge's line is at least 1 away, and the centre is on its left.
            assert!(cross.is_positive() && &cross * &cross >= length, "{pieces} pieces, edge {k}");
            let (p, q) = (corners[k], corners[(k + 1) % pieces]);
            turn += (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
        }
        assert!((turn - TAU).abs() < 1e-9);
        // And not much larger than it has to be.
        let tight = 1.0 / (PI / pieces as f64).cos();
        assert!(corners.iter().all(|c| c[0].hypot(c[1]) < tight * (1.0 + 1e-11)));
    }
}

#[test]
fn equispaced_angles_are_where_they_should_be() {
    for count in 5..100 {
        let points = nodes(count).unwrap();
        assert!(points.error < 1e-12 && points.size <= 1.0 + 1e-12);
        for (k, point) in points.at.iter().enumerate() {
            let angle = TAU * k as f64 / count as f64;
            assert!((point[0] - angle.cos()).hypot(point[1] - angle.sin()) < 1e-14);
        }
    }
}

#[test]
fn a_body_that_cannot_exist_is_refused() {
    let mut chain = panda();
    assert_eq!(chain.physical().unwrap().inertia, chain.inertia, "the identified arm needs no help");
    // The identified link 2 meets the triangle inequality by 1.7e-6 kg m²; a hundredth more breaks it.
    chain.inertia[1][1][1] += 0.01;
    assert_eq!(chain.physical().unwrap_err(), BoundsError::SecondMoments { link: 2 });
    // A flat plate is on the border: it is made larger by next to nothing.
    let mut plate = panda();
    plate.first_moment[3] = [0.0; 3];
    plate.inertia[3] = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];
    let larger = plate.physical().unwrap();
    for a in 0..3 {
        let added = larger.inertia[3][a][a] - plate.inertia[3][a][a];
        assert!(added > 0.0 && added < 1e-10);
    }
}

#[test]
fn the_last_link_is_the_sum_of_its_mean_and_the_rest() {
    let chain = panda();
    let [mean, rest] = chain.split_tip();
    for a in 0..3 {
        for b in 0..3 {
            let sum = mean.inertia[6][a][b] + rest.inertia[6][a][b];
            assert!((sum - chain.inertia[6][a][b]).abs() < 1e-17);
        }
        let moment = mean.first_moment[6][a] + rest.first_moment[6][a];
        assert!((moment - chain.first_moment[6][a]).abs() < 1e-17);
    }
    assert!(rest.mass.iter().all(|m| m.abs() <= 0.0) && mean.inertia[..6] == chain.inertia[..6]);
}

/// The recursions against the library's, on the circle.
#[test]
fn on_the_circle_the_entries_are_those_of_the_arm() {
    let model = Model::<7>::new(&Robot::panda()).unwrap();
    let chain = Chain::new(&model);
    let sequence = Kronecker::new(7);
    for index in 0..50 {
        let q = certune_linsys::Joints::<7>::from_iterator(sequence.point(index).map(|u| TAU * u - PI));
        let at: [[f64; 2]; 7] = std::array::from_fn(|j| [q[j].cos(), q[j].sin()]);
        let inertia = certune_dynamics::mass_matrix_as_described(&model, &q);
        let slopes = certune_dynamics::mass_matrix_derivatives(&model, &q);
        let stiffness = certune_dynamics::gravity_jacobian(&model, &q);
        let torque = certune_dynamics::gravity_torque(&model, &q);
        let (m, g, t) = (inertia_at(&chain, &at), stiffness_at(&chain, &at), torque_at(&chain, &at));
        let d = slopes_at(&chain, &at);
        for a in 0..7 {
            assert!((t[a] - torque[a]).abs() < 1e-12);
            for b in 0..7 {
                assert!((m[a][b] - inertia[(a, b)]).abs() < 1e-12, "M{a}{b}: {} {}", m[a][b], inertia[(a, b)]);
                assert!((g[a][b] - stiffness[(a, b)]).abs() < 1e-12);
                for j in 0..7 {
                    assert!((d[j][a][b] - slopes[j][(a, b)]).abs() < 1e-12, "dM{a}{b}/dq{j}");
                }
            }
        }
    }
}

/// `y'M y` along chords of the plane of `(cos q_j, sin q_j)`: never above the mean of the ends.
#[test]
fn kinetic_energy_is_convex_in_each_pair() {
    let chain = panda();
    let corners = polygons_of::<7>();
    let mut bent = 0.0_f64;
    for index in 0..200 {
        let at: [[f64; 2]; 7] = draw(&corners, index);
        let other: [[f64; 2]; 7] = draw(&corners, index + 1000);
        let y: Vec<f64> = Kronecker::new(7).point(index).map(|u| 2.0 * u - 1.0).collect();
        let energy = |x: &[[f64; 2]; 7]| -> f64 {
            let m = inertia_at(&chain, x);
            (0..7).map(|a| (0..7).map(|b| y[a] * m[a][b] * y[b]).sum::<f64>()).sum()
        };
        for j in 1..7 {
            let (mut end, mut middle) = (at, at);
            end[j] = other[j];
            middle[j] = [0.5 * (at[j][0] + other[j][0]), 0.5 * (at[j][1] + other[j][1])];
            let gap = 0.5 * (energy(&at) + energy(&end)) - energy(&middle);
            assert!(gap >= -1e-12);
            bent = bent.max(gap);
        }
    }
    assert!(bent > 0.1, "somewhere it is more than linear");
}
