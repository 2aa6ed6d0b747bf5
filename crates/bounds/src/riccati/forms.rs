//! Whether a quadratic form of the arm is positive over a box of angles: the articulated-body recursion on Loewner bounds.
//!
//! Two kinds of form in the joint velocities v are tested over every angle of a box and every mass of a [`Chain`]:
//!
//! ```text
//! inertia    v' M v - sum_i D_i v_i² > 0
//! Coriolis   v' M v -+ v' (∂M/∂q_j) v / (2 k) > 0        (both signs: then ½ |v' (∂M/∂q_j) v| <= k v' M v)
//! ```
//!
//! **Inertia.** With `V_i = U_i + z v_i`, `U_i = Z(q_i) Y_i V_{i-1}`, minimise over v_N, then v_{N-1}, ...: what link i and its successors
//! contribute is `V_i' A_i V_i`, with `A_N = I_N` and
//!
//! ```text
//! d_i = z'A_i z + r_i - D_i > 0,   Â_i = A_i - A_i z z'A_i / d_i,   A_{i-1} = I_{i-1} + Y_i' Z(q_i)' Â_i Z(q_i) Y_i
//! ```
//!
//! The form is positive definite if and only if every d_i > 0 (they are the pivots of an LDL' from the last joint). The step
//! `A_i -> Â_i` is a minimum of forms, so it is monotone in the Loewner order, and so is the congruence: **a matrix below A_i for all angles
//! beyond i, masses included, gives one below A_{i-1}** after one [`below_arc`] over q_i alone. That is what lets a box split one
//! angle at a time. D and r enter with their worst ends; A takes every link at its least mass.
//!
//! **Coriolis.** `½ v'(∂M/∂q_j)v = sum_{i >= j} V_i' I_i W_i`, where `W_i` is `-J U_j` carried along to link i. Completing the square link by link,
//!
//! ```text
//! V_i'I_iV_i -+ V_i'I_iW_i/k = (V_i -+ W_i/2k)' I_i (V_i -+ W_i/2k) - W_i'I_iW_i / 4k²
//! ```
//!
//! `V_i -+ W_i/2k` obeys the same recursion as V_i but starts from `(1 ± J/2k) U_j`. So beyond j run the inertia recursion for A (least
//! masses) and `C_{i-1} = I_{i-1} + Y_i'Z'C_iZY_i` (greatest masses, bounded from above), at j form
//!
//! ```text
//! Φ = (1 ± J/2k)' Â_j (1 ± J/2k) - J' C_j J / 4k²
//! ```
//!
//! in the place of Â_j, and go on towards the base as before. A link's share is nonnegative minus nonnegative, each proportional to
//! its mass, so the least masses in the first and the greatest in the second are below every choice of masses (exact without
//! uncertainty). In the payload's mass the form is affine: its two ends are tested.
//!
//! **Weights.** [`below_arc`] wants to know which directions matter. If `d_i` are the pivots in the middle of the box, the sum of their
//! logarithms falls, to first order, by `tr(P dA)` where P is the covariance of the link's velocity when v is drawn from `N(0, S^-1)`, S the tested
//! form; it is passed from base to tip by `V_i = U_i - z (z'A_iU_i)/d_i + z e_i`, `var e_i = 1/d_i`. Near a maximum of k the slope of the
//! critical direction's form vanishes, and with these weights the bound loses only to second order in the width of the box.
//! Weights decide how good a bound is, never whether it holds.

use super::angle::Arc;
use super::ball::{Ball, Matrix, ORDER, ROUNDING, ZERO, cholesky, largest};
use super::chain::Chain;
use super::turn::{axis, below_arc, both_sides, one_side, turned};

/// A form to be tested.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form<const N: usize> {
    /// `M - diag(D)`, kg m².
    Inertia([f64; N]),
    /// `M - sign (∂M/∂q_joint) / 2k` with a sign of 1 or -1; the joint counts from 0 and is not the first.
    Coriolis { joint: usize, k: f64, sign: f64 },
}

/// What a test of one box said.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Verdict<const N: usize> {
    /// The form is positive definite over the whole box.
    Positive,
    /// Not shown; what the width of each angle cost, as far as the recursion got.
    Open([f64; N]),
    /// In the middle of the box the form is not positive, as far as floating point can tell.
    Violated,
}

/// Share of the plain metric in a weight.
const REGULAR: f64 = 0.02;

impl<const N: usize> Form<N> {
    fn taken(&self, joint: usize) -> f64 {
        match self {
            Self::Inertia(diagonal) => diagonal[joint],
            Self::Coriolis { .. } => 0.0,
        }
    }

    fn turning_joint(&self) -> usize {
        match self {
            Self::Inertia(_) => N,
            Self::Coriolis { joint, .. } => *joint,
        }
    }
}

/// `Â` of an exact A, with its error; nothing unless the pivot is surely positive.
fn articulated(a: &Matrix, order: usize, rotor: f64, taken: f64) -> Option<Ball> {
    let z = axis(order);
    let pivot = a[z][z] + (rotor - taken);
    let error = ROUNDING * (a[z][z].abs() + rotor + taken.abs());
    let surely = pivot - error;
    if !(surely > 4.0 * error) {
        return None;
    }
    let mut middle = *a;
    let mut most = 0.0_f64;
    for i in 0..order {
        most = most.max(a[i][z].abs());
        for j in 0..order {
            middle[i][j] -= a[i][z] * a[z][j] / pivot;
        }
    }
    let quotient = most * most / surely;
    let radius = (quotient * (error / surely + ROUNDING) + ROUNDING * (largest(a) + quotient)) * 1.000_01;
    Some(Ball { middle, radius })
}

/// Φ of the joint whose derivative is taken, from balls.
fn across(hat: &Ball, heavy: &Matrix, k: f64, sign: f64) -> Ball {
    let half = 0.5 * sign / k;
    let square = half * half;
    let first = one_side(&hat.middle);
    let first = Ball { middle: first, radius: 2.0 * hat.radius + ROUNDING * largest(&first) };
    let second = Ball { middle: both_sides(&hat.middle), radius: hat.radius };
    let third = Ball::exact(both_sides(heavy));
    let (e1, e2) = (ROUNDING * half.abs(), ROUNDING * square);
    Ball::combination([(1.0, 0.0, hat), (half, e1, &first), (square, e2, &second), (-square, e2, &third)])
}

/// An exact matrix below (`direction` -1) or above (1) every matrix of a ball.
fn settle(ball: &Ball, order: usize, direction: f64) -> Matrix {
    let mut out = ball.middle;
    #[expect(clippy::cast_precision_loss, reason = "order <= 6")]
    let shift = order as f64 * (ball.radius + ROUNDING * largest(&ball.middle)) * 1.000_01;
    for i in 0..order {
        out[i][i] += direction * shift;
        for j in 0..i {
            out[j][i] = out[i][j];
        }
    }
    out
}

/// The sum of a link's inertia and an exact matrix.
fn sum(link: &Ball, a: &Matrix) -> Ball {
    Ball::combination([(1.0, 0.0, link), (1.0, 0.0, &Ball::exact(*a))])
}

/// `Z(q) a Z(q)'` in floating point.
fn carried(a: &Matrix, arc: &Arc) -> Matrix {
    let back = Arc { sine: -arc.sine, ..*arc };
    turned(&Ball::exact(*a), &back).middle
}

/// `y a y'` in floating point.
fn outward(a: &Matrix, y: &Matrix, order: usize, parent: usize) -> Matrix {
    let mut half = ZERO;
    for i in 0..order {
        for j in 0..parent {
            half[i][j] = (0..parent).map(|k| y[i][k] * a[k][j]).sum();
        }
    }
    let mut out = ZERO;
    for i in 0..order {
        for j in 0..order {
            out[i][j] = (0..parent).map(|k| half[i][k] * y[j][k]).sum();
        }
    }
    out
}

/// `p + share g^-1`, the share relative to the size of p in the metric g.
fn regular(p: &Matrix, g: &Matrix, order: usize) -> Option<Matrix> {
    let l = cholesky(g, order)?;
    let mut inverse = ZERO;
    for column in 0..order {
        let mut x = [0.0; ORDER];
        for i in 0..order {
            let mut sum = if i == column { 1.0 } else { 0.0 };
            for k in 0..i {
                sum -= l[i][k] * x[k];
            }
            x[i] = sum / l[i][i];
        }
        for i in (0..order).rev() {
            let mut sum = x[i];
            for k in i + 1..order {
                sum -= l[k][i] * inverse[k][column];
            }
            inverse[i][column] = sum / l[i][i];
        }
    }
    let mut size = 0.0;
    for i in 0..order {
        for j in 0..order {
            size += p[i][j] * g[j][i];
        }
    }
    let share = if size > 1e-200 { REGULAR * size } else { 1.0 };
    let mut out = ZERO;
    for i in 0..order {
        for j in 0..=i {
            out[i][j] = 0.5 * (p[i][j] + p[j][i]) + share * 0.5 * (inverse[i][j] + inverse[j][i]);
            out[j][i] = out[i][j];
        }
    }
    Some(out)
}

/// Weights of every passage, for A and for C.
struct Weights<const N: usize> {
    slack: [Matrix; N],
    heavy: [Matrix; N],
    /// What passes through each joint in the middle of the box: Â or Φ, and C.
    hats: [Ball; N],
    bodies: [Matrix; N],
}

/// The recursion in the middle of a box, in floating point, and the weights it gives; nothing if the form is not positive there.
fn weights<const N: usize>(chain: &Chain<N>, form: &Form<N>, arcs: &[Arc; N]) -> Option<Weights<N>> {
    let turning = form.turning_joint();
    let mut slack = [ZERO; N];
    let mut plain = [ZERO; N];
    let mut heavy = [ZERO; N];
    let mut pivots = [0.0; N];
    let mut hats = [Ball::exact(ZERO); N];
    slack[N - 1] = chain.links[N - 1].light.middle;
    plain[N - 1] = slack[N - 1];
    heavy[N - 1] = chain.links[N - 1].heavy.middle;
    for i in (0..N).rev() {
        let link = &chain.links[i];
        let order = link.passage.order;
        let z = axis(order);
        pivots[i] = slack[i][z][z] + link.rotor - form.taken(i);
        let mut hat = articulated(&slack[i], order, link.rotor, form.taken(i))?;
        if i == 0 {
            break;
        }
        if let Form::Coriolis { joint, k, sign } = *form
            && i == joint
        {
            hat = across(&hat, &heavy[i], k, sign);
        }
        hats[i] = hat;
        let parent = link.passage.parent_order;
        let back = |ball: &Ball| turned(ball, &arcs[i]).congruence(&link.passage.y, order, parent).middle;
        let rigid = articulated(&plain[i], order, link.rotor, 0.0)?;
        slack[i - 1] = sum(&chain.links[i - 1].light, &back(&hat)).middle;
        plain[i - 1] = sum(&chain.links[i - 1].light, &back(&rigid)).middle;
        if i > turning {
            heavy[i - 1] = sum(&chain.links[i - 1].heavy, &back(&Ball::exact(heavy[i]))).middle;
        }
    }
    let mut out = Weights { slack: [ZERO; N], heavy: [ZERO; N], hats, bodies: heavy };
    let mut covariance = ZERO;
    let mut dragged = ZERO;
    covariance[0][0] = 1.0 / pivots[0];
    for i in 1..N {
        let passage = &chain.links[i].passage;
        let (order, parent) = (passage.order, passage.parent_order);
        out.slack[i] = regular(&covariance, &plain[i - 1], parent)?;
        if i > turning {
            out.heavy[i] = regular(&dragged, &heavy[i - 1], parent)?;
            dragged = carried(&outward(&dragged, &passage.y.middle, order, parent), &arcs[i]);
        }
        let mut arriving = carried(&outward(&covariance, &passage.y.middle, order, parent), &arcs[i]);
        if let Form::Coriolis { joint, k, sign } = *form
            && i == joint
        {
            let half = 0.5 * sign / k;
            // J a J' = J' a J for this J; (1 + half J) a (1 + half J)' = a + half (J a + a J') + half² J a J'.
            let around = both_sides(&arriving);
            let side = one_side(&arriving);
            for row in 0..ORDER {
                for column in 0..ORDER {
                    dragged[row][column] = half * half * around[row][column];
                    arriving[row][column] += -half * side[row][column] + dragged[row][column];
                }
            }
        }
        // (1 - z K) U + z e.
        let z = axis(order);
        let mut closed = ZERO;
        for row in 0..order {
            closed[row][row] = 1.0;
            closed[z][row] -= slack[i][z][row] / pivots[i];
        }
        covariance = outward(&arriving, &closed, order, order);
        covariance[z][z] += 1.0 / pivots[i];
    }
    Some(out)
}

/// What the width of each angle alone costs, all others in the middle of the box.
fn costs<const N: usize>(chain: &Chain<N>, form: &Form<N>, arcs: &[Arc; N], weights: &Weights<N>) -> [f64; N] {
    let turning = form.turning_joint();
    std::array::from_fn(|i| {
        if i == 0 {
            return 0.0;
        }
        let passage = &chain.links[i].passage;
        let cost = |b: &Ball, weight| below_arc(b, &arcs[i], passage, weight).map_or(f64::INFINITY, |(_, cost)| cost);
        let slack = cost(&weights.hats[i], &weights.slack[i]);
        let heavy = || cost(&Ball::exact(weights.bodies[i]).negated(), &weights.heavy[i]);
        if i > turning { slack + heavy() } else { slack }
    })
}

/// Tests a form over a box of angles; `arcs` of the first joint is ignored, since M does not depend on it.
pub(crate) fn test<const N: usize>(chain: &Chain<N>, form: &Form<N>, arcs: &[Arc; N]) -> Verdict<N> {
    let Some(weights) = weights(chain, form, arcs) else {
        return Verdict::Violated;
    };
    let turning = form.turning_joint();
    let open = || Verdict::Open(costs(chain, form, arcs, &weights));
    let last = &chain.links[N - 1];
    let mut below = settle(&last.light, last.passage.order, -1.0);
    let mut above = settle(&last.heavy, last.passage.order, 1.0);
    for i in (0..N).rev() {
        let link = &chain.links[i];
        let order = link.passage.order;
        let Some(mut hat) = articulated(&below, order, link.rotor, form.taken(i)) else {
            return open();
        };
        if i == 0 {
            return Verdict::Positive;
        }
        if let Form::Coriolis { joint, k, sign } = *form
            && i == joint
        {
            hat = across(&hat, &above, k, sign);
        }
        let parent = &chain.links[i - 1];
        let parent_order = link.passage.parent_order;
        let Some((bound, _)) = below_arc(&hat, &arcs[i], &link.passage, &weights.slack[i]) else {
            return open();
        };
        below = settle(&sum(&parent.light, &bound), parent_order, -1.0);
        if i > turning {
            let negative = Ball::exact(above).negated();
            let Some((bound, _)) = below_arc(&negative, &arcs[i], &link.passage, &weights.heavy[i]) else {
                return open();
            };
            let raised = Ball::exact(bound).negated();
            above = settle(&sum(&parent.heavy, &raised.middle), parent_order, 1.0);
        }
    }
    open()
}
