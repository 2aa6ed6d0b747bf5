//! A quadratic form seen through a joint that turns within an arc: one matrix below all of it, in the Loewner order.
//!
//! Let `Z(d) = exp(-d J)` be the change of frame of a joint turned by `d` about z: `J` is the motion product with z, so on an angular
//! or a linear triple `J (x, y, z) = (-y, x, 0)`. For a symmetric `B` and a fixed matrix `Y`
//!
//! ```text
//! F(d) = Y' Z(d)' B Z(d) Y = F0 + cos d C1 + sin d S1 + cos 2d C2 + sin 2d S2
//! B1 := JB - BJ = S1 + 2 S2,  B2 := J B1 - B1 J = -(C1 + 4 C2),  B3 = -(S1 + 8 S2),  B4 = C1 + 16 C2     (at d = 0, before Y)
//! ```
//!
//! With `t = tan(d/2)`, `(1 + t²)² F` is a polynomial of degree 4 in t. On `|t| <= tau < 1` it is `sum_k beta_k(t) b_k` with Bernstein's
//! polynomials `beta_k >= 0`, and `(1 + t²)² = sum_k beta_k(t) w_k` with `w = (1 + 2 tau² + tau⁴, 1 - tau⁴, 1 - 2/3 tau² + tau⁴, ..)`,
//! all positive. So **every F(d) of the arc is a convex combination of the five matrices `P_k = b_k / w_k`**, and any `T` with
//! `T <= P_k` for all five is below the whole arc. No remainder is estimated: `P_0` and `P_4` are F at the ends.
//!
//! `T` itself is a guess in floating point, checked by [`Ball::dominates`]. Among the guesses we want the one that costs least.
//! Which directions count is told by a weight `W > 0`, a covariance of the coordinates: with `W = R R'`,
//!
//! ```text
//! T = (P_0 + P_4)/2 - R'^-1 |R' (P_4 - P_0)/2 R| R^-1
//! ```
//!
//! is the matrix below both ends with the largest `tr(W T)`; then `T <- T - R'^-1 [R'(T - P_k)R]_+ R^-1` brings it below the others.

use super::angle::{Arc, TRIG_ERROR};
use super::ball::{Ball, Matrix, ORDER, ROUNDING, ZERO, cholesky, eigen, largest};

/// How a state passes from a link to the next, up to the turn: `s = Z(q) Y s_parent + z v`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage {
    /// Y, `order` rows and `parent_order` columns.
    pub y: Ball,
    /// Coordinates of this link: 6 for a twist, 3 for an angular velocity about a fixed point, 1 for that of the first joint.
    pub order: usize,
    /// Coordinates of the parent.
    pub parent_order: usize,
}

/// The index of the joint's own angular velocity among `order` coordinates.
pub(crate) fn axis(order: usize) -> usize {
    if order == 1 { 0 } else { 2 }
}

/// `J B - B J`, the derivative of `Z(d)' B Z(d)` at 0; exact but for at most three roundings of an entry.
fn derivative(b: &Matrix) -> Matrix {
    one_side(b).map(|row| row.map(|entry| -entry))
}

/// [`derivative`] of a ball.
fn derivative_ball(b: &Ball) -> Ball {
    let middle = derivative(&b.middle);
    Ball { middle, radius: (2.0 * b.radius + ROUNDING * largest(&b.middle)) * 1.000_001 }
}

/// `J' B J`, exact.
pub(crate) fn both_sides(b: &Matrix) -> Matrix {
    // J' picks rows: (J'B)_0 = B_1, (J'B)_1 = -B_0; likewise columns.
    let row = |i: usize| match i {
        0 => Some((1, 1.0)),
        1 => Some((0, -1.0)),
        3 => Some((4, 1.0)),
        4 => Some((3, -1.0)),
        _ => None,
    };
    let mut out = ZERO;
    for i in 0..ORDER {
        for j in 0..ORDER {
            if let (Some((k, s)), Some((l, t))) = (row(i), row(j)) {
                out[i][j] = s * t * b[k][l];
            }
        }
    }
    out
}

/// `J' B + B J` of a symmetric matrix, one rounding an entry.
pub(crate) fn one_side(b: &Matrix) -> Matrix {
    let mut out = ZERO;
    for i in 0..ORDER {
        for j in 0..ORDER {
            let left = match i {
                0 => b[1][j],
                1 => -b[0][j],
                3 => b[4][j],
                4 => -b[3][j],
                _ => 0.0,
            };
            let right = match j {
                0 => b[i][1],
                1 => -b[i][0],
                3 => b[i][4],
                4 => -b[i][3],
                _ => 0.0,
            };
            out[i][j] = left + right;
        }
    }
    out
}

/// `Z0' B Z0` where `Z0` turns by the middle of the arc.
pub(crate) fn turned(b: &Ball, arc: &Arc) -> Ball {
    let (c, s) = (arc.cosine, arc.sine);
    let turn = |a: &Matrix| {
        let mut out = *a;
        for p in [0, 3] {
            for row in &mut out {
                let (x, y) = (row[p], row[p + 1]);
                row[p] = c * x - s * y;
                row[p + 1] = s * x + c * y;
            }
        }
        out
    };
    let half = turn(&b.middle);
    let mut transposed = ZERO;
    for i in 0..ORDER {
        for j in 0..ORDER {
            transposed[j][i] = half[i][j];
        }
    }
    let middle = turn(&transposed);
    // Each pass: |c| + |s| < 1.5, coordinates off by TRIG_ERROR and two roundings.
    let size = largest(&b.middle);
    let pass = |radius: f64, size: f64| 1.5 * radius + (2.0 * TRIG_ERROR + ROUNDING) * (size + radius);
    let radius = pass(pass(b.radius, size), 1.5 * size) * 1.000_001;
    Ball { middle, radius }
}

/// The control matrices `P_k` of `Y' Z(d)' B Z(d) Y` over an arc; equal when the arc is a point.
fn controls(b: &Ball, arc: &Arc, passage: &Passage) -> Option<[Ball; 5]> {
    let centre = turned(b, arc);
    let seen = |ball: &Ball| ball.congruence(&passage.y, passage.order, passage.parent_order);
    let here = seen(&centre);
    if arc.half_width <= 0.0 {
        return Some([here; 5]);
    }
    let d1 = derivative_ball(&centre);
    let d2 = derivative_ball(&d1);
    let d3 = derivative_ball(&d2);
    let d4 = derivative_ball(&d3);
    let derivatives = [seen(&d1), seen(&d2), seen(&d3), seen(&d4)];
    let square = arc.tau * arc.tau;
    let fourth = square * square;
    let weights = [1.0 + 2.0 * square + fourth, 1.0 - fourth, 1.0 - 2.0 / 3.0 * square + fourth];
    if !(arc.tau < 0.9 && weights[1] > 0.1) {
        return None;
    }
    // Powers of t: a0 = F(0), a1 = 2 S1 + 4 S2, a2 = 2 F0 - 6 C2, a3 = 2 S1 - 4 S2, a4 = F0 - C1 + C2, where
    // S2 = -(d1 + d3)/6, S1 = d1 - 2 S2, C2 = (d2 + d4)/12, C1 = -d2 - 4 C2, F0 = F(0) - C1 - C2.
    // In terms of (F(0), d1, d2, d3, d4):
    let powers: [[f64; 5]; 5] = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0, 0.0, 0.0],
        [2.0, 0.0, 2.0, 0.0, 0.0],
        [0.0, 10.0 / 3.0, 0.0, 4.0 / 3.0, 0.0],
        [1.0, 0.0, 8.0 / 3.0, 0.0, 2.0 / 3.0],
    ];
    // Bernstein coefficients of x^0 .. x^4 on [-1, 1].
    let blossom: [[f64; 5]; 5] = [
        [1.0, -1.0, 1.0, -1.0, 1.0],
        [1.0, -0.5, 0.0, 0.5, -1.0],
        [1.0, 0.0, -1.0 / 3.0, 0.0, 1.0],
        [1.0, 0.5, 0.0, -0.5, -1.0],
        [1.0, 1.0, 1.0, 1.0, 1.0],
    ];
    let tau_powers = [1.0, arc.tau, square, square * arc.tau, fourth];
    let mut out = [here; 5];
    for (k, control) in out.iter_mut().enumerate() {
        let weight = weights[k.min(4 - k)];
        let mut coefficients = [(0.0, 0.0); 5];
        for (source, coefficient) in coefficients.iter_mut().enumerate() {
            for power in 0..5 {
                let term = blossom[k][power] * tau_powers[power] * powers[power][source];
                coefficient.0 += term / weight;
                coefficient.1 += ROUNDING * 4.0 * term.abs() / weight;
            }
        }
        let [c0, c1, c2, c3, c4] = coefficients;
        let [d1, d2, d3, d4] = &derivatives;
        *control = Ball::combination([
            (c0.0, c0.1, &here),
            (c1.0, c1.1, d1),
            (c2.0, c2.1, d2),
            (c3.0, c3.1, d3),
            (c4.0, c4.1, d4),
        ]);
    }
    Some(out)
}

/// A matrix below `Y' Z(q)' B Z(q) Y` for every q of the arc, exactly as returned; and what it costs, `tr W (F(middle) - T)`.
///
/// `weight` is a positive definite guess of the covariance of the parent's coordinates; it decides how good the bound is, not
/// whether it is one. Nothing is returned if no bound could be checked.
pub(crate) fn below_arc(b: &Ball, arc: &Arc, passage: &Passage, weight: &Matrix) -> Option<(Matrix, f64)> {
    let n = passage.parent_order;
    let controls = controls(b, arc, passage)?;
    let root = cholesky(weight, n)?;
    let inverse = inverse_lower(&root, n);
    // Into the coordinates of the weight: R' A R.
    let into = |a: &Matrix| sandwich(a, &root, n, true);
    let [first, second, third, fourth, fifth] = controls.map(|ball| into(&ball.middle));
    let mut scale = 0.0_f64;
    for a in [&first, &third, &fifth] {
        scale = scale.max(largest(a));
    }
    let mut guess = third;
    if arc.half_width > 0.0 {
        let mut half = ZERO;
        for i in 0..n {
            for j in 0..n {
                half[i][j] = 0.5 * (fifth[i][j] - first[i][j]);
                guess[i][j] = 0.5 * (fifth[i][j] + first[i][j]);
            }
        }
        subtract_function(&mut guess, &half, n, f64::abs);
        for control in [&third, &second, &fourth] {
            let mut gap = ZERO;
            let mut negative = ZERO;
            for i in 0..n {
                for j in 0..n {
                    gap[i][j] = guess[i][j] - control[i][j];
                    negative[i][j] = -gap[i][j];
                }
                negative[i][i] += 1e-12 * scale;
            }
            if cholesky(&negative, n).is_none() {
                subtract_function(&mut guess, &gap, n, |x| x.max(0.0));
            }
        }
    }
    let size = largest(&controls[2].middle);
    #[expect(clippy::cast_precision_loss, reason = "n <= 6")]
    let order = n as f64;
    // What the check below must subtract itself, and as much again.
    let blur = controls.iter().fold(0.0_f64, |most, control| most.max(control.radius));
    let blur = 2.0 * order * (blur + 16.0 * ROUNDING * size);
    // Slack for the roundings of the guess, in the weight's metric and absolutely; more where the weight is ill conditioned.
    for slack in [1e-12, 1e-10, 1e-8, 1e-6] {
        let mut trial = guess;
        for (i, row) in trial.iter_mut().enumerate().take(n) {
            row[i] -= slack * scale;
        }
        let mut bound = if arc.half_width > 0.0 { sandwich(&trial, &inverse, n, true) } else { controls[2].middle };
        for i in 0..n {
            bound[i][i] -= slack * size + blur;
            for j in 0..i {
                bound[j][i] = bound[i][j];
            }
        }
        if controls.iter().all(|control| control.dominates(&bound, n)) {
            let mut cost = 0.0;
            for i in 0..n {
                cost += third[i][i] - trial[i][i];
            }
            return Some((bound, cost));
        }
    }
    None
}

/// `a -= f(b)` for a symmetric b.
fn subtract_function(a: &mut Matrix, b: &Matrix, n: usize, f: impl Fn(f64) -> f64) {
    let (values, vectors) = eigen(b, n);
    for k in 0..n {
        let value = f(values[k]);
        if value > 0.0 {
            for i in 0..n {
                for j in 0..n {
                    a[i][j] -= value * vectors[i][k] * vectors[j][k];
                }
            }
        }
    }
}

/// `L' a L` (or `L a L'`) for a lower triangular L.
fn sandwich(a: &Matrix, l: &Matrix, n: usize, transpose_first: bool) -> Matrix {
    let at = |i: usize, k: usize| if transpose_first { l[k][i] } else { l[i][k] };
    let mut half = ZERO;
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                half[i][j] += at(i, k) * a[k][j];
            }
        }
    }
    let mut out = ZERO;
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                out[i][j] += half[i][k] * at(j, k);
            }
        }
    }
    out
}

/// The inverse of a lower triangular matrix.
fn inverse_lower(l: &Matrix, n: usize) -> Matrix {
    let mut out = ZERO;
    for j in 0..n {
        out[j][j] = 1.0 / l[j][j];
        for i in j + 1..n {
            let mut sum = 0.0;
            for k in j..i {
                sum += l[i][k] * out[k][j];
            }
            out[i][j] = -sum / l[i][i];
        }
    }
    out
}
