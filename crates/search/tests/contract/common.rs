//! Objectives and loops for the tests.

use certune_search::Search;

/// Squared distance from a point, some coordinates of which may be out of reach.
pub fn sphere(x: &[f64], optimum: &[f64]) -> f64 {
    x.iter().zip(optimum).map(|(x, o)| (x - o).powi(2)).sum()
}

/// A bent and ill-conditioned valley with its floor at (0.6, …, 0.6).
pub fn valley(x: &[f64]) -> f64 {
    let z: Vec<f64> = x.iter().map(|x| 5.0 * x - 2.0).collect();
    z.windows(2).map(|z| 100.0 * (z[0].powi(2) - z[1]).powi(2) + (z[0] - 1.0).powi(2)).sum()
}

/// Many local optima; the global one at (0.35, …, 0.35).
pub fn bumps(x: &[f64]) -> f64 {
    let term = |z: f64| z * z + 10.0 - 10.0 * (std::f64::consts::TAU * z).cos();
    x.iter().map(|x| term(10.0 * (x - 0.35))).sum()
}

/// Runs up to `generations` batches; all points asked and their scores.
pub fn run(search: &mut impl Search, generations: usize, objective: impl Fn(&[f64]) -> f64) -> Vec<(Vec<f64>, f64)> {
    let mut told = Vec::new();
    for _ in 0..generations {
        if search.ended().is_some() {
            break;
        }
        let points = search.ask();
        let scores: Vec<f64> = points.iter().map(|x| objective(x)).collect();
        search.tell(&scores).unwrap();
        told.extend(points.into_iter().zip(scores));
    }
    told
}

/// Writes a search as JSON and reads it again.
pub fn reread<S: serde::Serialize + serde::de::DeserializeOwned>(search: &S) -> S {
    serde_json::from_str(&serde_json::to_string(search).unwrap()).unwrap()
}

/// Runs like [`run`], but through a written and reread state before every ask
/// and before every tell.
pub fn run_interrupted<S: Search + serde::Serialize + serde::de::DeserializeOwned>(
    search: &mut S,
    generations: usize,
    objective: impl Fn(&[f64]) -> f64,
) -> Vec<(Vec<f64>, f64)> {
    let mut told = Vec::new();
    for _ in 0..generations {
        *search = reread(search);
        if search.ended().is_some() {
            break;
        }
        let points = search.ask();
        *search = reread(search);
        assert_eq!(search.ask(), points, "a question is repeated until it is answered");
        let scores: Vec<f64> = points.iter().map(|x| objective(x)).collect();
        search.tell(&scores).unwrap();
        told.extend(points.into_iter().zip(scores));
    }
    told
}

/// Squares a positive number's power of two: m·2^e becomes m·2^(2e).
///
/// Strictly increasing, far from linear and without any rounding, so that
/// neither ties nor differences in rank can arise.
pub fn distort(score: f64) -> f64 {
    if score > 0.0 && score.is_finite() {
        let exponent = ((score.to_bits() >> 52) & 0x7ff) as i32 - 1023;
        score * 2f64.powi(exponent)
    } else {
        score
    }
}
