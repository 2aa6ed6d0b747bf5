//! CMA-ES with BIPOP restarts on ten classic functions, from 25 starts each. `cargo xtask peers search` runs it beside pycma.
//!
//! | call | prints |
//! |------|--------|
//! | `classics problems` | the problems as JSON, for another program to solve |
//! | `classics run` | a line `function,dimension,seed,solved,evaluations` for each run |
//! | `classics` | the same in two dimensions and from one start: it still runs |
//!
//! A run is solved at its first value below 1e-8; one that is not counts as its whole budget. Every random number of a problem comes from a seed that its place in the list
//! gives, so the problems are always the same ones.

use std::error::Error;
use std::f64::consts::PI;

use certune_search::{Bipop, BipopOptions, Search};
use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use serde::Serialize;

const DIMENSIONS: [usize; 4] = [2, 5, 10, 20];
const SEEDS: usize = 25;
const SIGMA: f64 = 0.2;
const TARGET: f64 = 1e-8;

/// Name, shape, whether it is rotated, and how steep it is where it rests on the bounds (0: its optimum lies inside).
const FUNCTIONS: [(&str, Shape, bool, f64); 10] = [
    ("sphere", Shape::Sphere, false, 0.0),
    ("ellipsoid rotated", Shape::Ellipsoid, true, 0.0),
    ("rosenbrock", Shape::Rosenbrock, false, 0.0),
    ("rosenbrock rotated", Shape::Rosenbrock, true, 0.0),
    ("rastrigin", Shape::Rastrigin, false, 0.0),
    ("rastrigin rotated", Shape::Rastrigin, true, 0.0),
    ("discus rotated", Shape::Discus, true, 0.0),
    ("powers rotated", Shape::Powers, true, 0.0),
    ("sphere on bounds", Shape::Sphere, false, 2.0),
    ("ellipsoid on bounds", Shape::Ellipsoid, true, 1e3),
];

#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum Shape {
    Sphere,
    Ellipsoid,
    Rosenbrock,
    Rastrigin,
    Discus,
    Powers,
}

/// A function of y = 10 x − 5 in `[-5, 5]^n`, whose least value there is 0.
#[derive(Serialize)]
struct Problem {
    name: &'static str,
    shape: Shape,
    dimension: usize,
    /// The optimum, in y.
    optimum: Vec<f64>,
    /// The gradient at the optimum: into the box where a bound is active.
    gradient: Vec<f64>,
    /// The rows of the rotation R; z = R (y − optimum).
    rotation: Vec<Vec<f64>>,
    /// Evaluations granted to a run.
    budget: u64,
    /// One start for each seed, in x.
    starts: Vec<Vec<f64>>,
    /// A point and its value, to check another implementation with.
    probe: (Vec<f64>, f64),
}

impl Problem {
    fn new((name, shape, rotated, pressure): (&'static str, Shape, bool, f64), n: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut optimum: Vec<f64> = (0..n).map(|_| rng.random_range(-3.0..3.0)).collect();
        let mut gradient = vec![0.0; n];
        if pressure > 0.0 {
            // Of every three coordinates one at rest on the lower bound, one pressing against the upper bound, and one inside.
            for i in 0..n {
                match i % 3 {
                    0 => optimum[i] = -5.0,
                    1 => (optimum[i], gradient[i]) = (5.0, -pressure),
                    _ => {}
                }
            }
        }
        let mut gauss = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let square = DMatrix::from_fn(n, n, |_, _| gauss());
        let rotation = if rotated { square.qr().q() } else { DMatrix::identity(n, n) };
        // Ten thousand a dimension; many optima take many restarts, and patience ends somewhere.
        let many = matches!(shape, Shape::Rastrigin) && n > 2;
        let budget = if many { 100_000 } else { 10_000 * n as u64 };
        let mut point = || (0..n).map(|_| rng.random()).collect::<Vec<f64>>();
        let mut problem = Self {
            name,
            shape,
            dimension: n,
            optimum,
            gradient,
            rotation: rotation.row_iter().map(|row| row.iter().copied().collect()).collect(),
            budget,
            starts: (0..SEEDS).map(|_| point()).collect(),
            probe: (point(), 0.0),
        };
        problem.probe.1 = problem.value(&problem.probe.0);
        problem
    }

    fn all() -> impl Iterator<Item = Self> {
        let of = |(f, function)| DIMENSIONS.map(|n| Self::new(function, n, (100 * f + n) as u64));
        FUNCTIONS.into_iter().enumerate().flat_map(of)
    }

    fn value(&self, x: &[f64]) -> f64 {
        let n = self.dimension;
        let off = DVector::from_fn(n, |i, _| 10.0 * x[i] - 5.0 - self.optimum[i]);
        let z: Vec<f64> = self.rotation.iter().map(|r| r.iter().zip(&off).map(|(r, y)| r * y).sum()).collect();
        let slope: f64 = self.gradient.iter().zip(&off).map(|(g, y)| g * y).sum();
        let share = |i: usize| i as f64 / (n as f64 - 1.0);
        let sum = |term: &dyn Fn(usize, f64) -> f64| -> f64 { z.iter().enumerate().map(|(i, &z)| term(i, z)).sum() };
        slope
            + match self.shape {
                Shape::Sphere => sum(&|_, z| z * z),
                Shape::Ellipsoid => sum(&|i, z| 1e6_f64.powf(share(i)) * z * z),
                Shape::Rosenbrock => z
                    .windows(2)
                    .map(|z| (z[0] + 1.0, z[1] + 1.0))
                    .map(|(a, b)| 100.0 * (a * a - b).powi(2) + (a - 1.0).powi(2))
                    .sum(),
                Shape::Rastrigin => sum(&|_, z| z * z + 10.0 - 10.0 * (2.0 * PI * z).cos()),
                Shape::Discus => sum(&|i, z| if i == 0 { 1e6 * z * z } else { z * z }),
                Shape::Powers => sum(&|i, z| z.abs().powf(2.0 + 4.0 * share(i))),
            }
    }

    /// The evaluations up to the first below the target; none if the budget, or the restarts, end before.
    fn solve(&self, seed: usize) -> Result<Option<u64>, Box<dyn Error>> {
        let mut search = Bipop::new(&self.starts[seed], SIGMA, seed as u64, BipopOptions::default())?;
        let mut evaluations = 0;
        while search.ended().is_none() {
            let mut scores = Vec::new();
            for x in search.ask() {
                let value = self.value(&x);
                evaluations += 1;
                if value < TARGET {
                    return Ok(Some(evaluations));
                }
                if evaluations >= self.budget {
                    return Ok(None);
                }
                scores.push(value);
            }
            search.tell(&scores)?;
        }
        Ok(None)
    }

    fn run(&self, seed: usize) -> Result<(), Box<dyn Error>> {
        let solved = self.solve(seed)?;
        let (count, solved) = (solved.unwrap_or(self.budget), u8::from(solved.is_some()));
        println!("{},{},{seed},{solved},{count}", self.name, self.dimension);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).filter(|word| !word.starts_with('-')).as_deref() {
        Some("problems") => println!("{}", serde_json::to_string(&Problem::all().collect::<Vec<_>>())?),
        Some("run") => {
            for problem in Problem::all() {
                (0..SEEDS).try_for_each(|seed| problem.run(seed))?;
            }
        }
        Some(word) => return Err(format!("{word}: expected problems, run or nothing").into()),
        None => Problem::all().filter(|problem| problem.dimension == 2).try_for_each(|problem| problem.run(0))?,
    }
    Ok(())
}
