//! What a record knows about the cost around one set of gains: which knobs matter, which of them together, and along which directions it hardly changes.
//!
//! A quadratic is fitted by least squares to the cost of the nearest candidates that have one, in the coordinates `x` of the space, each in `[0, 1]`, about the gains `x0`:
//!
//! ```text
//! f(x0 + z) = c + gᵀz + ½ zᵀHz
//! ```
//!
//! What it says is said of the box of the fitted candidates, `|z_j| <= reach` within the space, with centre `m` and half widths `a`, as if every point of it were as likely as any other. With
//! `g(m) = g + H(m - x0)` the variance of `f` falls into parts, which are exact for a quadratic (analysis of variance, Sobol 1993):
//!
//! ```text
//! knob i            g_i(m)² a_i²/3 + H_ii² a_i⁴/45
//! knobs i and j     H_ij² a_i² a_j²/9
//! ```
//!
//! and the directions are the eigenvectors of the mean of `∇f ∇fᵀ`, that is `g(m) g(m)ᵀ + H diag(a²/3) H` (active subspaces, Constantine 2015). Where the gains lie inside of every
//! bound and limit, `g` vanishes and they are those of the Hessian; where a limit stops them, the slope counts too.
//!
//! Limits: candidates that were given up, or that are beyond a limit, have no cost, so the fit sees only what lies on this side. A surface that predicts badly says little.

use certune_closed_loop::Gains;
use nalgebra::{DMatrix, DVector};

use crate::goals::{Goal, Source};
use crate::record::{RunRecord, Verdict};
use crate::search::Evaluation;

/// A fit takes at least this many candidates for each of its coefficients, and no more than twice that.
const LEAST: usize = 2;

/// Singular values below this share of the largest belong to knobs that did not move.
const RANK: f64 = 1e-9;

/// Why nothing can be said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{points} candidates of one round have a cost, and a quadratic in {knobs} knobs needs at least {needed}; a larger budget would tell"
)]
pub struct TooFew {
    /// The most candidates of one round with a cost.
    pub points: usize,
    /// The knobs of the space.
    pub knobs: usize,
    /// Twice the coefficients of the quadratic.
    pub needed: usize,
}

/// The cost around one set of gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The round whose candidates were fitted: the last with enough of them.
    pub round: u32,
    /// How many candidates were fitted.
    pub points: usize,
    /// Coefficients of the quadratic.
    pub coefficients: usize,
    /// How far from the gains the candidates lie, at most, as a fraction of each knob's range.
    pub reach: f64,
    /// The share of the variance of the fitted costs that the surface explains.
    pub r_squared: f64,
    /// The same for each cost as predicted from all others; far below `r_squared`, or negative, when the surface has learnt the candidates by heart.
    pub predicted_r_squared: f64,
    /// The share of each knob alone in the variance of the surface, in the order of the space.
    pub knobs: Vec<(String, f64)>,
    /// The share of each two knobs together, from the largest.
    pub pairs: Vec<([String; 2], f64)>,
    /// Directions, from the one along which the cost changes most.
    pub directions: Vec<Direction>,
}

/// A direction in the space.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// The part of each knob, in the order of the space; of length 1, and the largest part is positive.
    pub parts: Vec<f64>,
    /// Root mean square of the slope along it, in units of the cost for the whole range of the knobs.
    pub slope: f64,
}

/// The surface around `gains`, from the last round of the record that has enough candidates.
///
/// # Errors
/// [`TooFew`] when no round has.
pub fn surface(record: &RunRecord, gains: &Gains) -> Result<Surface, TooFew> {
    let knobs = &record.space.knobs;
    let place = |gains: &Gains| DVector::from_iterator(knobs.len(), knobs.iter().map(|knob| knob.place(gains)));
    let centre = place(gains);
    let coefficients = (knobs.len() + 1) * (knobs.len() + 2) / 2;
    let needed = LEAST * coefficients;
    let of_round = |round: u32| -> Vec<Point> {
        let costs = record.evaluations.iter().filter(|evaluation| evaluation.round == round);
        let point = |evaluation: &Evaluation| Some((place(&evaluation.gains) - &centre, evaluation.outcome.cost()?));
        costs.filter_map(point).collect()
    };
    let rounds: Vec<(u32, Vec<Point>)> =
        (0..=record.worst_plants.len() as u32).map(|round| (round, of_round(round))).collect();
    let points = rounds.iter().map(|(_, points)| points.len()).max().unwrap_or(0);
    let enough = rounds.into_iter().rev().find(|(_, points)| points.len() >= needed);
    let (round, mut near) = enough.ok_or(TooFew { points, knobs: knobs.len(), needed })?;
    near.sort_by(|(a, _), (b, _)| a.amax().total_cmp(&b.amax()));
    near.truncate(2 * needed);

    let reach = near.last().map_or(0.0, |(offset, _)| offset.amax());
    let fit = Quadratic::fit(&near, reach);
    let name = |index: usize| knobs[index].name.clone();
    let ends = centre.map(|place| [(-reach).max(-place), reach.min(1.0 - place)]);
    let Shares { alone, together, directions } = fit
        .shares(&ends.map(|[lower, upper]| 0.5 * (lower + upper)), &ends.map(|[lower, upper]| 0.5 * (upper - lower)));
    Ok(Surface {
        round,
        points: near.len(),
        coefficients,
        reach,
        r_squared: fit.r_squared,
        predicted_r_squared: fit.predicted_r_squared,
        knobs: alone.into_iter().enumerate().map(|(index, share)| (name(index), share)).collect(),
        pairs: together.into_iter().map(|([i, j], share)| ([name(i), name(j)], share)).collect(),
        directions,
    })
}

/// The limit that held-out plants come nearest to, or exceed most, as a share: the goal, its bound, and the worst figure over the plants. `None` without a limit that runs answer. A plant
/// without the figure counts as beyond every bound.
pub fn nearest_limit(record: &RunRecord, verdict: &Verdict) -> Option<(Goal, f64, f64)> {
    let figure = |goal: Goal| {
        let figures = verdict.plants.iter().map(|plant| plant.figures.get(goal).unwrap_or(f64::INFINITY));
        figures.reduce(f64::max)
    };
    let limits = record.question.goals.limits_from(Source::Simulated);
    let found = limits.filter_map(|(goal, bound)| Some((goal, bound, figure(goal)?)));
    found.max_by(|(one, bound, figure), (other, other_bound, other_figure)| {
        one.excess(*figure, *bound).total_cmp(&other.excess(*other_figure, *other_bound))
    })
}

/// Where a candidate lies from the gains, and its cost.
type Point = (DVector<f64>, f64);

/// A quadratic and how well it fits.
struct Quadratic {
    slope: DVector<f64>,
    hessian: DMatrix<f64>,
    r_squared: f64,
    predicted_r_squared: f64,
}

/// The parts of a variance.
struct Shares {
    alone: Vec<f64>,
    together: Vec<([usize; 2], f64)>,
    directions: Vec<Direction>,
}

/// Each two of `count` knobs, a knob with itself included.
fn pairs(count: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..count).flat_map(move |i| (i..count).map(move |j| [i, j]))
}

impl Quadratic {
    /// Least squares by singular values; offsets are taken in units of `reach`, so that the columns are of one size.
    fn fit(points: &[Point], reach: f64) -> Self {
        let knobs = points.first().map_or(0, |(offset, _)| offset.len());
        let unit = if reach > 0.0 { reach } else { 1.0 };
        let columns = |offset: &DVector<f64>| -> Vec<f64> {
            let z = offset / unit;
            let squares = pairs(knobs).map(|[i, j]| if i == j { 0.5 * z[i] * z[i] } else { z[i] * z[j] });
            core::iter::once(1.0).chain(z.iter().copied()).chain(squares).collect()
        };
        let rows: Vec<Vec<f64>> = points.iter().map(|(offset, _)| columns(offset)).collect();
        let width = rows.first().map_or(0, Vec::len);
        let design = DMatrix::from_row_iterator(rows.len(), width, rows.into_iter().flatten());
        let costs = DVector::from_iterator(points.len(), points.iter().map(|(_, cost)| *cost));
        let svd = design.clone().svd(true, true);
        let cut = RANK * svd.singular_values.max();
        // It fails only when the vectors were not asked for.
        let found = svd.solve(&costs, cut).unwrap_or_else(|_| DVector::zeros(width));
        let residuals = &costs - &design * &found;
        // The part of each cost in its own prediction: a row's share in the column space.
        let leverage = |row: usize| {
            let columns = svd.u.iter().flat_map(|u| u.row(row).iter().copied().collect::<Vec<_>>());
            let kept = columns.zip(svd.singular_values.iter()).filter(|(_, value)| **value > cut);
            kept.map(|(part, _)| part * part).sum::<f64>()
        };
        let predicted = residuals.iter().enumerate().map(|(row, residual)| residual / (1.0 - leverage(row)).max(RANK));
        let mean = costs.mean();
        let spread: f64 = costs.iter().map(|cost| (cost - mean).powi(2)).sum();
        // Costs that are all the same are explained by a constant.
        let explained = |squares: f64| if spread > 0.0 { 1.0 - squares / spread } else { 1.0 };
        let mut hessian = DMatrix::zeros(knobs, knobs);
        for ([i, j], value) in pairs(knobs).zip(found.iter().skip(1 + knobs)) {
            hessian[(i, j)] = value / (unit * unit);
            hessian[(j, i)] = hessian[(i, j)];
        }
        Self {
            slope: DVector::from_iterator(knobs, found.iter().skip(1).take(knobs).map(|value| value / unit)),
            hessian,
            r_squared: explained(residuals.norm_squared()),
            predicted_r_squared: explained(predicted.map(|error| error * error).sum()),
        }
    }

    /// What the quadratic does in the box of this middle, seen from the gains, and half widths.
    fn shares(&self, middle: &DVector<f64>, half: &DVector<f64>) -> Shares {
        let slope = &self.slope + &self.hessian * middle;
        let variances = half.map(|half| half * half / 3.0);
        let part = |[i, j]: [usize; 2]| {
            let curvature = self.hessian[(i, j)].powi(2);
            if i == j {
                slope[i].powi(2) * variances[i] + curvature * half[i].powi(4) / 45.0
            } else {
                curvature * variances[i] * variances[j]
            }
        };
        let knobs = slope.len();
        let total: f64 = pairs(knobs).map(part).sum();
        let share = |pair: [usize; 2]| if total > 0.0 { part(pair) / total } else { 0.0 };
        let mut together: Vec<_> = pairs(knobs).filter(|[i, j]| i != j).map(|pair| (pair, share(pair))).collect();
        together.sort_by(|(_, a), (_, b)| b.total_cmp(a));

        let squares = &slope * slope.transpose() + &self.hessian * DMatrix::from_diagonal(&variances) * &self.hessian;
        let eigen = squares.symmetric_eigen();
        let mut directions: Vec<Direction> = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
            .map(|(value, vector)| {
                let largest = vector[vector.iamax()];
                let parts = vector.iter().map(|part| part * largest.signum()).collect();
                Direction { parts, slope: value.max(0.0).sqrt() }
            })
            .collect();
        directions.sort_by(|a, b| b.slope.total_cmp(&a.slope));
        Shares { alone: (0..knobs).map(|knob| share([knob, knob])).collect(), together, directions }
    }
}

#[cfg(test)]
mod tests;
