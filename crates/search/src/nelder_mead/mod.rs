//! The downhill simplex of Nelder & Mead.
//!
//! J. C. Lagarias et al., "Convergence properties of the Nelder–Mead simplex
//! method in low dimensions", SIAM J. Optim. 9 (1998), with the coefficients
//! of F. Gao & L. Han, "Implementing the Nelder–Mead simplex algorithm with
//! adaptive parameters", Comput. Optim. Appl. 51 (2012).
//!
//! With the vertices x₁ … x_{n+1} from best to worst, c the centroid of all but
//! the worst, and f(·) their scores, a step asks for the reflection
//! x_r = c + α (c − x_{n+1}) and goes on by its score:
//!
//! | f(x_r)                        | asks for                          | takes it if      | else    |
//! |-------------------------------|-----------------------------------|------------------|---------|
//! | below f(x₁)                   | expansion c + β (x_r − c)         | below f(x_r)     | x_r     |
//! | from f(x₁), below f(x_n)      | –                                 |                  | x_r     |
//! | from f(x_n), below f(x_{n+1}) | outside contraction c + γ (x_r − c) | below f(x_r)   | shrinks |
//! | from f(x_{n+1})               | inside contraction c + γ (x_{n+1} − c) | below f(x_{n+1}) | shrinks |
//!
//! and a shrink asks for x₁ + δ (x_i − x₁) for all i > 1 at once.
//!
//! The simplex lives in the unbounded space that is folded smoothly onto the
//! box (see the source of `bounds`). Were its points clipped to the box, it
//! would be flattened against the first bound it meets and could never leave
//! it again, nor would a fresh one: from a corner of the box, its best vertex,
//! all others are reflected, clipped, onto the faces of that corner, wherever
//! on those faces the optimum may be.
//!
//! Every comparison that discards a point is "not below" (Lagarias et al.
//! accept an outside contraction equal to the reflection; here it is refused),
//! and that is what makes [`NelderMead::enough`] exact: see there.

mod geometry;
mod options;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use crate::bounds::unfold;
use crate::plain;
use crate::search::{Best, Ending, Search, SetupError, TellError, check_scores, check_spread, check_start};
use geometry::{Move, Vertex, along, box_point, centroid, corners};
pub use options::{Coefficients, NelderMeadOptions};

/// A simplex that has grown to so many boxes is lost among the mirror images.
const LARGEST: f64 = 100.0;

/// The downhill simplex, folded onto the unit box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct NelderMead {
    coefficients: Coefficients,
    tol_fun: f64,
    tol_x: f64,
    restarts: u32,
    /// The edge of a fresh simplex.
    size: f64,
    /// From best to worst.
    vertices: Vec<Vertex>,
    purpose: Move,
    /// In the unbounded space.
    asked: Vec<Vec<f64>>,
    /// The best score when the present simplex was set up.
    #[serde(with = "plain::score")]
    score_before: f64,
    /// The best point so far, in the unbounded space and in the box.
    top: Option<Vertex>,
    best: Option<Best>,
    evaluations: u64,
    ended: Option<Ending>,
}

impl NelderMead {
    /// A search whose first simplex has a corner at `start` and edges of length
    /// `size` along the coordinates, away from the upper bound if need be.
    pub fn new(start: &[f64], size: f64, options: NelderMeadOptions) -> Result<NelderMead, SetupError> {
        check_start(start, size)?;
        let coefficients = options.coefficients;
        let start: Vec<f64> = start.iter().copied().map(unfold).collect();
        Ok(NelderMead {
            coefficients: coefficients.unwrap_or_else(|| Coefficients::adaptive(start.len())),
            tol_fun: options.tol_fun,
            tol_x: options.tol_x,
            restarts: options.restarts,
            size,
            vertices: Vec::new(),
            purpose: Move::Vertices,
            asked: std::iter::once(start.clone()).chain(corners(&start, size)).collect(),
            score_before: f64::INFINITY,
            top: None,
            best: None,
            evaluations: 0,
            ended: None,
        })
    }

    /// Sets up a fresh simplex of edge `size` around the best point so far,
    /// also after the end; points asked and not told yet are dropped.
    pub fn restart(&mut self, size: f64) -> Result<(), SetupError> {
        check_spread(size)?;
        if let Some(top) = self.top.clone() {
            self.size = size;
            self.ended = None;
            self.score_before = top.score;
            self.purpose = Move::Vertices;
            self.asked = corners(&top.at, size).collect();
            self.vertices = vec![top];
        }
        Ok(())
    }

    /// Asks for the reflection, unless the simplex has converged.
    fn reflect(&mut self) {
        let [best, .., worst] = self.vertices.as_slice() else { return };
        let spread = if worst.score > best.score { worst.score - best.score } else { 0.0 };
        let radius = geometry::radius(&self.vertices);
        let converged = radius <= self.tol_x && spread <= self.tol_fun;
        if converged || !(f64::EPSILON..LARGEST).contains(&radius) {
            self.converge();
        } else {
            let reflection = along(&centroid(&self.vertices), &worst.at, -self.coefficients.alpha);
            self.purpose = Move::Reflection;
            self.asked = vec![reflection];
        }
    }

    /// Starts anew around the best vertex, or ends.
    fn converge(&mut self) {
        let Some(best) = self.best.as_ref() else { return };
        let gained = best.score < self.score_before - self.tol_fun;
        if gained && self.restarts > 0 && self.restart(self.size).is_ok() {
            self.restarts -= 1;
        } else {
            self.asked.clear();
            self.ended = Some(Ending::Converged);
        }
    }

    /// Puts a vertex in its place, after its equals.
    fn insert(&mut self, vertex: Vertex) {
        let place = self.vertices.partition_point(|v| v.score <= vertex.score);
        self.vertices.insert(place, vertex);
    }

    /// Replaces the worst vertex and goes on.
    fn accept(&mut self, vertex: Vertex) {
        self.vertices.pop();
        self.insert(vertex);
        self.reflect();
    }

    /// Pulls all vertices towards the best and asks for their scores.
    fn shrink(&mut self) {
        let Some((best, others)) = self.vertices.split_first() else { return };
        let delta = self.coefficients.delta;
        self.asked = others.iter().map(|v| along(&best.at, &v.at, delta)).collect();
        self.vertices.truncate(1);
        self.purpose = Move::Vertices;
    }

    /// Decides by the score of the one point that was asked.
    fn decide(&mut self, told: Vertex) {
        let [first, .., last] = self.vertices.as_slice() else { return };
        let second = self.vertices.iter().nth_back(1).map_or(first.score, |v| v.score);
        let (best, worst) = (first.score, last.score);
        let Coefficients { beta, gamma, .. } = self.coefficients;
        let centroid = centroid(&self.vertices);
        match std::mem::replace(&mut self.purpose, Move::Reflection) {
            Move::Reflection if told.score < best => {
                self.asked = vec![along(&centroid, &told.at, beta)];
                self.purpose = Move::Expansion(told);
            }
            Move::Reflection if told.score < second => self.accept(told),
            Move::Reflection if told.score < worst => {
                self.asked = vec![along(&centroid, &told.at, gamma)];
                self.purpose = Move::OutsideContraction(told);
            }
            Move::Reflection => {
                self.asked = vec![along(&centroid, &last.at, gamma)];
                self.purpose = Move::InsideContraction;
            }
            Move::Expansion(reflected) => {
                self.accept(if told.score < reflected.score { told } else { reflected });
            }
            Move::OutsideContraction(reflected) if told.score < reflected.score => {
                self.accept(told);
            }
            Move::InsideContraction if told.score < worst => self.accept(told),
            Move::OutsideContraction(_) | Move::InsideContraction => self.shrink(),
            Move::Vertices => {}
        }
    }

    /// Whether all parts of a state that was read fit together.
    fn sound(&self) -> bool {
        let vertices = || self.vertices.iter().chain(&self.top).map(|v| &v.at);
        let points = || self.asked.iter().chain(vertices());
        let Some(n) = points().next().map(Vec::len) else { return false };
        let corners = n + 1;
        let (held, asked) = (self.vertices.len(), self.asked.len());
        n > 0
            && points().all(|point| point.len() == n)
            && match (&self.purpose, self.ended) {
                (_, Some(_)) => held == corners && asked == 0,
                (Move::Vertices, None) => held <= 1 && held + asked == corners,
                (_, None) => held == corners && asked == 1,
            }
    }
}

impl Search for NelderMead {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        self.asked.iter().map(|at| box_point(at)).collect()
    }

    fn tell(&mut self, scores: &[f64]) -> Result<(), TellError> {
        check_scores(self.asked.len(), scores)?;
        self.evaluations += scores.len() as u64;
        let asked = std::mem::take(&mut self.asked);
        for (at, &score) in asked.into_iter().zip(scores) {
            Best::keep(&mut self.best, &box_point(&at), score);
            let told = Vertex { at, score };
            if self.top.as_ref().is_none_or(|top| score < top.score) {
                self.top = Some(told.clone());
            }
            match self.purpose {
                Move::Vertices => self.insert(told),
                _ => self.decide(told),
            }
        }
        if self.purpose == Move::Vertices && self.asked.is_empty() {
            self.reflect();
        }
        Ok(())
    }

    /// The score below which the point asked has to be for its score to matter:
    ///
    /// * a reflection: that of the worst vertex. Not below it, the point is
    ///   dropped and an inside contraction is asked, whatever the score; below
    ///   it, the point becomes a vertex or the bar for the next one;
    /// * an expansion or an outside contraction: that of the reflected point.
    ///   Not below it, the point is dropped for the reflected one, or shrunk;
    /// * an inside contraction: that of the worst vertex, or the simplex
    ///   shrinks;
    /// * the vertices of a fresh or shrunk simplex: `None`. They become
    ///   vertices however bad, the worst being the bar of the next reflection.
    ///
    /// Nor do the best point and the convergence depend on a dropped score, as
    /// the best vertex is no worse than any of these bars.
    fn enough(&self) -> Option<f64> {
        match &self.purpose {
            _ if self.ended.is_some() => None,
            Move::Vertices => None,
            Move::Expansion(reflected) | Move::OutsideContraction(reflected) => Some(reflected.score),
            Move::Reflection | Move::InsideContraction => self.vertices.last().map(|v| v.score),
        }
    }

    fn ended(&self) -> Option<Ending> {
        self.ended
    }

    fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}

impl Serialize for NelderMead {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        NelderMead::serialize(self, to)
    }
}

impl<'de> Deserialize<'de> for NelderMead {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<NelderMead, D::Error> {
        let search = NelderMead::deserialize(from)?;
        if search.sound() { Ok(search) } else { Err(D::Error::custom("not the state of a simplex")) }
    }
}
