//! Fewer points that draw the same curve.

use std::collections::HashSet;

/// A point of a curve.
pub(crate) type Point = (f64, f64);

/// The stretches without NaN.
pub(crate) fn finite_runs(points: &[Point]) -> impl Iterator<Item = &[Point]> {
    points.split(|(x, y)| !x.is_finite() || !y.is_finite()).filter(|run| !run.is_empty())
}

/// At most about `count` points a curve: of each stretch of neighbours only the lowest and the highest stay, in their
/// order, so that no peak is lost. Gaps stay gaps.
pub(crate) fn thin(points: &[Point], count: usize) -> Vec<Point> {
    if points.len() <= count.max(4) {
        return points.to_vec();
    }
    let per_bucket = (2 * points.len()).div_ceil(count.max(4));
    let mut thinned = Vec::new();
    for run in finite_runs(points) {
        if !thinned.is_empty() {
            thinned.push((f64::NAN, f64::NAN));
        }
        thinned.extend(run.first());
        for bucket in run.chunks(per_bucket) {
            let by_height = |a: &&Point, b: &&Point| a.1.total_cmp(&b.1);
            let (lowest, highest) = (bucket.iter().min_by(by_height), bucket.iter().max_by(by_height));
            let mut pair: Vec<Point> = lowest.into_iter().chain(highest).copied().collect();
            pair.sort_by(|a, b| a.0.total_cmp(&b.0));
            thinned.extend(pair);
        }
        thinned.extend(run.last());
    }
    thinned.dedup();
    thinned
}

/// The corners of a curve that is constant between jumps.
pub(crate) fn corners(points: &[Point]) -> Vec<Point> {
    let same = |a: &Point, b: &Point| (a.1 - b.1).abs() <= f64::EPSILON;
    let mut kept = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let starts = index == 0 || !same(&points[index - 1], point);
        let ends = index + 1 == points.len() || !same(point, &points[index + 1]);
        if starts || ends {
            kept.push(*point);
        }
    }
    kept
}

/// One point for each cell of a `columns` by `rows` grid over the range, coarser until at most `most` remain.
pub(crate) fn on_grid(
    points: &[Point],
    x: (f64, f64),
    y: (f64, f64),
    (columns, rows): (u32, u32),
    most: usize,
) -> Vec<Point> {
    let (mut columns, mut rows) = (f64::from(columns.max(1)), f64::from(rows.max(1)));
    loop {
        let mut seen = HashSet::new();
        let cell =
            |value: f64, (lower, upper): (f64, f64), cells: f64| ((value - lower) / (upper - lower) * cells) as i64;
        let kept: Vec<Point> = points
            .iter()
            .filter(|point| point.0 >= x.0 && point.0 <= x.1 && point.1 >= y.0 && point.1 <= y.1)
            .filter(|point| seen.insert((cell(point.0, x, columns), cell(point.1, y, rows))))
            .copied()
            .collect();
        if kept.len() <= most || (columns < 2.0 && rows < 2.0) {
            return kept;
        }
        columns *= 0.8;
        rows *= 0.8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_ends_and_gaps() {
        let mut points: Vec<Point> = (0..10_000).map(|k| (f64::from(k), (f64::from(k) * 0.001).sin())).collect();
        points[4321].1 = 50.0;
        points[7000].1 = f64::NAN;
        let thinned = thin(&points, 300);
        assert!(thinned.len() < 320, "{}", thinned.len());
        assert!(thinned.contains(&points[4321]) && thinned.contains(&points[0]) && thinned.contains(&points[9999]));
        assert_eq!(finite_runs(&thinned).count(), 2);
        assert!(thinned.windows(2).all(|pair| pair[1].0.is_nan() || pair[0].0.is_nan() || pair[0].0 <= pair[1].0));
        assert_eq!(thin(&points[..10], 300), points[..10]);
        assert!(thin(&[(0.0, f64::NAN); 1000], 100).is_empty());
    }

    #[test]
    fn corners_are_the_ends_of_each_level() {
        let points: Vec<Point> = (0..9).map(|k| (f64::from(k), f64::from(k / 3))).collect();
        assert_eq!(corners(&points), [(0.0, 0.0), (2.0, 0.0), (3.0, 1.0), (5.0, 1.0), (6.0, 2.0), (8.0, 2.0)]);
    }

    #[test]
    fn a_grid_keeps_one_point_a_cell_and_never_too_many() {
        let points: Vec<Point> = (0..5000).map(|k| (f64::from(k % 71) / 70.0, f64::from(k / 71) / 70.0)).collect();
        let kept = on_grid(&points, (0.0, 1.0), (0.0, 1.0), (200, 200), 500);
        assert!(!kept.is_empty() && kept.len() <= 500);
        assert!(on_grid(&[(f64::NAN, 0.0), (5.0, 0.0)], (0.0, 1.0), (0.0, 1.0), (9, 9), 9).is_empty());
    }
}
