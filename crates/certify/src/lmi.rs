//! Linear matrix inequalities `F0 + x1 F1 + .. + xk Fk >= 0` for clarabel's semidefinite cone.
//!
//! A block is given as a function that assembles its matrix at a point `x`; the coefficients are read off at the origin and
//! the unit points, so the assembly reads like the formula. Symmetric matrices travel as the scaled upper triangle, column by column
//! (`svec`: off-diagonal entries times sqrt 2), which is clarabel's order.

use std::f64::consts::SQRT_2;
use std::panic::{AssertUnwindSafe, catch_unwind};

use certune_lapack as _;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus,
    SupportedConeT::{self, NonnegativeConeT, PSDTriangleConeT},
};
use nalgebra::DMatrix;

/// The order of a block from which the factorisation works in blocks.
const BLOCKED_FROM: usize = 24;

/// A symmetric matrix, affine in the variables.
pub type Affine<'a> = Box<dyn Fn(&[f64]) -> DMatrix<f64> + 'a>;

/// Minimise `cost' x` subject to blocks that must be positive semidefinite.
pub struct Program<'a> {
    /// Cost of each variable.
    pub cost: Vec<f64>,
    /// Variables that must not be negative.
    pub nonnegative: Vec<usize>,
    /// Matrices that must be positive semidefinite.
    pub blocks: Vec<Affine<'a>>,
}

/// What the solver proposes. Nothing about it is proved.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The variables.
    pub x: Vec<f64>,
    /// Whether the solver met its full accuracy.
    pub accurate: bool,
}

/// Why the solver proposes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// The solver found the inequalities infeasible (in floating point).
    #[error("infeasible")]
    Infeasible,
    /// The cost can fall without bound: the program lacks a normalisation.
    #[error("unbounded")]
    Unbounded,
    /// The solver stopped for another reason.
    #[error("the solver stopped without an answer: {0}")]
    Stopped(&'static str),
}

fn append_column(column: &DMatrix<f64>, sign: f64, first_row: usize, rows: &mut Vec<usize>, values: &mut Vec<f64>) {
    let mut row = first_row;
    for j in 0..column.ncols() {
        for i in 0..=j {
            let scale = if i == j { 1.0 } else { SQRT_2 };
            let value = sign * scale * column[(i, j)];
            if value != 0.0 {
                rows.push(row);
                values.push(value);
            }
            row += 1;
        }
    }
}

impl Program<'_> {
    /// Solves the program.
    ///
    /// # Errors
    /// [`SolveError`] when clarabel returns no usable point.
    pub fn solve(&self) -> Result<Solution, SolveError> {
        let variables = self.cost.len();
        let origin = vec![0.0; variables];
        let constants: Vec<DMatrix<f64>> = self.blocks.iter().map(|block| block(&origin)).collect();
        let mut cones: Vec<SupportedConeT<f64>> = vec![NonnegativeConeT(self.nonnegative.len())];
        cones.extend(constants.iter().map(|block| PSDTriangleConeT(block.nrows())));
        // A x + s = b with s = svec(F(x)): A = -svec(F_i), b = svec(F_0).
        let mut b = vec![0.0; self.nonnegative.len()];
        for block in &constants {
            for j in 0..block.ncols() {
                for i in 0..=j {
                    b.push(if i == j { block[(i, j)] } else { SQRT_2 * block[(i, j)] });
                }
            }
        }
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for k in 0..variables {
            if let Some(row) = self.nonnegative.iter().position(|&index| index == k) {
                rows.push(row);
                values.push(-1.0);
            }
            let mut unit = origin.clone();
            unit[k] = 1.0;
            let mut first_row = self.nonnegative.len();
            for (block, constant) in self.blocks.iter().zip(&constants) {
                append_column(&(block(&unit) - constant), -1.0, first_row, &mut rows, &mut values);
                first_row += constant.nrows() * (constant.nrows() + 1) / 2;
            }
            starts.push(rows.len());
        }
        let a = CscMatrix::new(b.len(), variables, starts, rows, values);
        let objective = CscMatrix::zeros((variables, variables));
        // Up to order 12 or so qdldl is quicker; beyond, faer, which factors in blocks, is: 10 s against 115 s for two vertices of order 42. One thread: the same bits on every run.
        let largest = constants.iter().map(DMatrix::nrows).max().unwrap_or(0);
        let factorisation = if largest < BLOCKED_FROM { "qdldl" } else { "faer" };
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .max_iter(100)
            .max_threads(1)
            .direct_solve_method(factorisation.to_owned())
            .build()
            .map_err(|_| SolveError::Stopped("settings"))?;
        let mut solver = DefaultSolver::new(&objective, &self.cost, &a, &b, &cones, settings)
            .map_err(|_| SolveError::Stopped("data"))?;
        // clarabel panics when a factorisation inside a cone fails; an iterate gone bad is no reason to end the program.
        if catch_unwind(AssertUnwindSafe(|| solver.solve())).is_err() {
            return Err(SolveError::Stopped("factorisation failed"));
        }
        let point = |accurate| Ok(Solution { x: solver.solution.x.clone(), accurate });
        match solver.solution.status {
            SolverStatus::Solved => point(true),
            // A point near the optimum is as good a candidate as any: the exact check decides.
            SolverStatus::AlmostSolved => point(false),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Err(SolveError::Infeasible),
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Err(SolveError::Unbounded),
            SolverStatus::Unsolved => Err(SolveError::Stopped("not started")),
            SolverStatus::MaxIterations => Err(SolveError::Stopped("iteration limit")),
            SolverStatus::MaxTime => Err(SolveError::Stopped("time limit")),
            SolverStatus::NumericalError => Err(SolveError::Stopped("numerical error")),
            SolverStatus::InsufficientProgress => Err(SolveError::Stopped("insufficient progress")),
            SolverStatus::CallbackTerminated => Err(SolveError::Stopped("interrupted")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn the_largest_eigenvalue_as_a_program() {
        // min t with t I - A >= 0.
        let a = dmatrix![2.0, 1.0, 0.0; 1.0, 3.0, -1.0; 0.0, -1.0, 1.0];
        let largest = a.clone().symmetric_eigenvalues().max();
        let program = Program {
            cost: vec![1.0],
            nonnegative: Vec::new(),
            blocks: vec![Box::new(|x| DMatrix::identity(3, 3) * x[0] - &a)],
        };
        assert!((program.solve().unwrap().x[0] - largest).abs() < 1e-6);
    }

    #[test]
    fn an_infeasible_program_is_named() {
        let program =
            Program { cost: vec![1.0], nonnegative: vec![0], blocks: vec![Box::new(|x| dmatrix![-1.0 - x[0]])] };
        assert_eq!(program.solve(), Err(SolveError::Infeasible));
    }
}
