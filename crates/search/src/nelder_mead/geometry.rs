//! The simplex, its points and the ways from one to another.

use serde::{Deserialize, Serialize};

use crate::{bounds::fold, plain};

/// A point of the unbounded space and what was told of its image in the box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Vertex {
    pub(super) at: Vec<f64>,
    #[serde(with = "plain::score")]
    pub(super) score: f64,
}

/// What the points now asked are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Move {
    /// New vertices of the simplex: all of it at the start, or what shrank.
    Vertices,
    Reflection,
    /// Beyond the reflected point, which is better than all vertices.
    Expansion(Vertex),
    /// Short of the reflected point, which is better than the worst vertex only.
    OutsideContraction(Vertex),
    InsideContraction,
}

/// The ends of the edges of length `size` from `corner` along the coordinates.
pub(super) fn corners(corner: &[f64], size: f64) -> impl Iterator<Item = Vec<f64>> {
    (0..corner.len()).map(move |i| {
        let mut point = corner.to_vec();
        if let Some(x) = point.get_mut(i) {
            *x += if *x + size <= 1.0 { size } else { -size };
        }
        point
    })
}

/// The image in the box of a point of the unbounded space.
pub(super) fn box_point(at: &[f64]) -> Vec<f64> {
    at.iter().copied().map(fold).collect()
}

/// `from + share (to − from)`.
pub(super) fn along(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect()
}

/// The centroid of all vertices but the last.
pub(super) fn centroid(vertices: &[Vertex]) -> Vec<f64> {
    let better = vertices.split_last().map_or(&[][..], |(_, better)| better);
    let mut sum = vec![0.0; better.first().map_or(0, |vertex| vertex.at.len())];
    for vertex in better {
        sum.iter_mut().zip(&vertex.at).for_each(|(sum, x)| *sum += x);
    }
    sum.iter().map(|sum| sum / better.len() as f64).collect()
}

/// How far any vertex is from the first, in the coordinate of most difference.
pub(super) fn radius(vertices: &[Vertex]) -> f64 {
    let Some((first, others)) = vertices.split_first() else { return 0.0 };
    let differences = others.iter().flat_map(|v| v.at.iter().zip(&first.at));
    differences.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
