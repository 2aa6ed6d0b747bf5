//! What a run has learnt about its gains, beyond the gains themselves.

use serde::{Deserialize, Serialize};

use super::Pair;

/// What the candidates say together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learnt {
    /// The cost around the tuned gains; `None` where too few candidates have one.
    pub surface: Option<Surface>,
    /// Why there is no surface, in one clause; empty with one.
    pub no_surface: String,
    /// The limit to which the tuned gains come nearest on the held-out plants; `None` without limits.
    pub limit: Option<NearestLimit>,
    /// What the cost of the tuned gains is the sum of, on the nominal plant; empty for a cost that is one figure.
    pub cost_parts: Vec<CostPart>,
    /// Plants that the search looked for, in the order in which they joined.
    pub worst_plants: Vec<WorstPlantRow>,
    /// Where loops are stable, two gains at a time.
    pub slices: Vec<Slice>,
}

/// A quadratic that was fitted to the cost of the candidates nearest to the tuned gains.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// How many candidates.
    pub points: u64,
    /// How many coefficients.
    pub coefficients: u64,
    /// How far the candidates lie from the tuned gains, at most, as a fraction of each range.
    pub reach: f64,
    /// Share of the variance of the costs that the surface explains.
    pub r_squared: f64,
    /// The same, each cost predicted from the others.
    pub predicted_r_squared: f64,
    /// Share of each gain alone, in the order of the space.
    pub gains: Vec<Share>,
    /// Share of each two gains together, from the largest.
    pub pairs: Vec<PairShare>,
    /// Directions, from the one along which the cost changes most.
    pub directions: Vec<Direction>,
}

/// How much of the surface's variance comes from one gain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// The gain.
    pub gain: String,
    /// From 0 to 1.
    pub share: f64,
}

/// How much of the surface's variance comes from two gains together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairShare {
    /// The gains.
    pub gains: [String; 2],
    /// From 0 to 1.
    pub share: f64,
}

/// A direction in the space, in which several gains move together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direction {
    /// Part of each gain, in the order of [`Surface::gains`]; of length 1.
    pub parts: Vec<f64>,
    /// Root mean square of the change of the cost over a tenth of the ranges, in the unit of the search's costs.
    pub change: f64,
}

/// A limit and how near the held-out plants come to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NearestLimit {
    /// In words, for instance `overshoot at most 2 %`.
    pub in_words: String,
    /// The worst figure over the plants, in words; may be `none`, for a plant without it.
    pub figure_in_words: String,
    /// By which share the figure is beyond the limit; negative when it is kept, `None` when a plant has no figure.
    pub excess: Option<f64>,
}

/// A part of a cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostPart {
    /// What it is.
    pub name: String,
    /// Share of the whole, 0 to 1.
    pub share: f64,
}

/// A plant that was searched for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorstPlantRow {
    /// The best candidate at that time, which fared worse on it than on all plants before.
    pub candidate: u64,
    /// The plant in a few words.
    pub in_words: String,
    /// What became of the candidate on it, in a few words.
    pub outcome: String,
}

/// A map over two gains; the others are the tuned ones. Cells of equal size on logarithmic axes, each looked at in its middle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slice {
    /// The horizontal gain.
    pub x: SliceAxis,
    /// The vertical gain.
    pub y: SliceAxis,
    /// Whether every loop of a sample decays, `[row][column]`, lowest row first.
    pub stable: Vec<Vec<bool>>,
    /// Whether a certificate holds for the whole plant box, likewise; its grid may be coarser. Empty when it was not asked for.
    pub certified: Vec<Vec<bool>>,
    /// The gains of every candidate.
    pub candidates: Vec<[f64; 2]>,
    /// The gains that are compared.
    pub gains: Pair<[f64; 2]>,
}

/// One axis of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliceAxis {
    /// The gain.
    pub gain: String,
    /// Its unit, empty when it has none.
    pub unit: String,
    /// Smallest value, above zero.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
}
