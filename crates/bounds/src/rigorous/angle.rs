//! Points of the unit circle with proved errors, and polygons that provably contain a circle or an arc.
//!
//! | symbol | code | meaning |
//! |--------|------|---------|
//! | w, p | width and number of pieces of an arc; a circle has w = 2 pi | rad, 1 |
//! | h = w/(2p) | half the angle between neighbouring points of tangency | rad |
//! | eps = 2^-38, delta = 2^-23 | [`SWELL`], [`WIDEN_RAD`] | |
//!
//! **Sine and cosine** need no library: Taylor sums of degree 22 and 23 at `x/2^k`, at most 1 in size, and k doublings
//! `(c, s) -> (2c^2 - 1, 2 s c)`, all in intervals rounded outward ([`Interval`]); the remainder of the sum is below 1/24!.
//!
//! **Circle.** The exact corners `(1 + eps) sec(pi/p) exp(2 pi i k/p)` span a polygon whose edges lie `1 + eps` from the centre. The
//! computed corners are off by less than eps/2 (checked: the enclosures are narrower than [`NARROW`]); a convex hull's support function
//! changes by no more than its corners move, so it stays above 1 in every direction: the hull contains the circle.
//!
//! **Arc** `[lo, hi]` of width at least 2^-9 (narrower ones are widened) and at most `2 pi - 2^-8` (wider ones count as circles).
//! Let `[a, b] = [lo - delta, hi + delta]`. Corners: `(1 + eps)` times `exp(ia)`, the p points `sec(h) exp(i(a + (2k+1) h))` and
//! `exp(ib)`. The edges between neighbours lie `1 + eps` from the centre. The chord that closes the hull lies beyond none of the
//! arc: with `m` the middle, the distance of the arc's point t from the chord, measured outward along m, is
//! `cos(t - m) - (1 + eps) cos(w/2 + delta) >= cos(w/2) - cos(w/2 + delta) - eps >= delta 2^-11 - eps > 2^-35`. So every point of the arc keeps
//! a distance of at least eps from the border of the exact hull and stays within the computed one. That `delta` also covers a joint
//! limit given as a decimal, which an `f64` only approximates.

use std::f64::consts::PI;

use certune_linsys::Real;

use crate::error::BoundsError;
use crate::interval::Interval;

/// Polygons are larger by this share than they need be, to pay for rounding.
const SWELL: f64 = 1.0 / (1_u64 << 38) as f64;
/// An arc is longer by this at both ends than it need be.
const WIDEN_RAD: f64 = 1.0 / (1_u64 << 23) as f64;
/// Enclosures of sine and cosine are narrower than this.
const NARROW: f64 = 1.0 / (1_u64 << 42) as f64;
/// The shortest arc that is not widened.
const SHORTEST_RAD: f64 = 1.0 / 512.0;
/// What is left open by the longest arc that is not taken for a circle.
const OPENING_RAD: f64 = 1.0 / 256.0;
/// Largest angle that can be given.
pub(crate) const LARGEST_RAD: f64 = 15.0;

/// pi: the constant of the library is the `f64` just below it.
fn pi() -> Interval {
    Interval::new(PI, PI.next_up())
}

/// Points with `[cos, sin]` of each, and the largest error of a coordinate.
#[derive(Clone, Debug)]
pub(crate) struct Points {
    pub at: Vec<[f64; 2]>,
    pub error: f64,
    /// Largest size of a coordinate.
    pub size: f64,
}

fn middles(enclosures: &[[Interval; 2]], radius: f64) -> Result<Points, BoundsError> {
    let mut points = Points { at: Vec::with_capacity(enclosures.len()), error: 0.0, size: 0.0 };
    for pair in enclosures {
        for side in pair {
            if !(side.width() <= NARROW) {
                return Err(BoundsError::Enclosure { width: side.width() });
            }
            points.error = points.error.max(side.width());
        }
        let point = pair.map(|side| radius * side.middle());
        points.size = point.iter().fold(points.size, |size, x| size.max(x.abs()));
        points.at.push(point);
    }
    Ok(points)
}

/// `fraction pi / count`.
fn part_of_pi(fraction: f64, count: usize) -> Interval {
    pi() * Interval::from_f64(fraction) / Interval::from_f64(count as f64)
}

/// `exp(2 pi i k/count)`, k from 0: angles within half a turn.
fn equispaced(count: usize) -> Vec<[Interval; 2]> {
    let turn = part_of_pi(2.0, count);
    let signed = |k: usize| if 2 * k > count { k as f64 - count as f64 } else { k as f64 };
    (0..count).map(|k| (turn * Interval::from_f64(signed(k))).cos_sin()).collect()
}

/// `count` equispaced points of the unit circle, from angle 0; exact to [`Points::error`].
pub(crate) fn nodes(count: usize) -> Result<Points, BoundsError> {
    middles(&equispaced(count), 1.0)
}

/// Upper bound of `1/cos(x)` for an `x` in `[0, pi/2)`; infinite if the enclosure of the cosine reaches 0.
fn secant(x: Interval) -> f64 {
    let [cos, _] = x.cos_sin();
    if cos.lower() > 0.0 { (1.0 / cos.lower()).next_up() } else { f64::INFINITY }
}

/// The factor `1/cos(2 pi/count)` of a trigonometric polynomial of degree 2, rounded up.
pub(crate) fn degree_two_factor(count: usize) -> f64 {
    secant(part_of_pi(2.0, count))
}

/// The angles of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Span {
    /// Every angle.
    Circle,
    /// From the first to the second, rad.
    Arc(f64, f64),
}

impl Span {
    /// The span of an interval of angles; infinite ends, and intervals of nearly a turn, make a circle.
    pub(crate) fn between(joint: usize, lower: f64, upper: f64) -> Result<Self, BoundsError> {
        if !(lower <= upper) {
            return Err(BoundsError::Angles { joint: joint + 1, lower, upper });
        }
        if upper - lower > 2.0 * PI - OPENING_RAD {
            return Ok(Self::Circle);
        }
        if !(lower.abs() <= LARGEST_RAD && upper.abs() <= LARGEST_RAD) {
            return Err(BoundsError::Angles { joint: joint + 1, lower, upper });
        }
        let missing = (SHORTEST_RAD - (upper - lower)).max(0.0);
        Ok(Self::Arc(lower - missing, upper + missing))
    }

    /// Its width, rad.
    pub(crate) fn width_rad(self) -> f64 {
        match self {
            Self::Circle => 2.0 * PI,
            Self::Arc(lower, upper) => upper - lower,
        }
    }

    /// Corners that `pieces` need.
    pub(crate) fn corner_count(self, pieces: usize) -> usize {
        match self {
            Self::Circle => pieces,
            Self::Arc(..) => pieces + 2,
        }
    }

    /// Fewest pieces that make a polygon of moderate size.
    pub(crate) fn fewest_pieces(self) -> usize {
        match self {
            Self::Circle => 4,
            Self::Arc(lower, upper) => ((upper - lower) / 2.0).ceil().max(1.0) as usize,
        }
    }

    /// Corners whose hull contains the span; the error is zero: the corners *are* these numbers.
    pub(crate) fn corners(self, pieces: usize) -> Result<Points, BoundsError> {
        if pieces < self.fewest_pieces() {
            return Err(BoundsError::Pieces { given: pieces, least: self.fewest_pieces() });
        }
        let mut points = match self {
            Self::Circle => {
                let radius = (1.0 + SWELL) * secant(part_of_pi(1.0, pieces));
                middles(&equispaced(pieces), radius)?
            }
            Self::Arc(lower, upper) => {
                let start = Interval::from_f64(lower) - Interval::from_f64(WIDEN_RAD);
                let end = Interval::from_f64(upper) + Interval::from_f64(WIDEN_RAD);
                let half = (end - start) * Interval::from_f64(0.5) / Interval::from_f64(pieces as f64);
                let ends = middles(&[start.cos_sin(), end.cos_sin()], 1.0 + SWELL)?;
                let tangents: Vec<_> =
                    (0..pieces).map(|k| (start + half * Interval::from_f64((2 * k + 1) as f64)).cos_sin()).collect();
                let mut points = middles(&tangents, (1.0 + SWELL) * secant(half))?;
                points.at.extend(ends.at);
                points.size = points.size.max(ends.size);
                points
            }
        };
        points.error = 0.0;
        Ok(points)
    }
}
