//! Derivative-free minimisation in the unit box `[0, 1]^d`, asked and told.
//!
//! Every method here has the same shape, [`Search`]: it asks for the scores of
//! a batch of points, is told them, and asks again. Who evaluates the points,
//! where, and how many at once is the caller's business. Lower is better.
//!
//! * [`Cma`] is one run of CMA-ES, the covariance matrix adaptation evolution
//!   strategy: few assumptions, robust against noise and ill-conditioning.
//! * [`Bipop`] restarts it with large and small populations: for many optima.
//! * [`Scatter`] draws points over the whole box, to know where to start.
//! * [`NelderMead`] is a simplex polish for the last digits in few dimensions.
//!
//! A search is a plain value: it can be written at any moment and, read again,
//! goes on to the bit as if it had never stopped. It draws from its own seeded
//! generator and from nothing else. (To the bit on one platform: `ln`, `exp`
//! and the like are the platform's own and may differ in the last place.)
//!
//! ```
//! use certune_search::{Cma, Options, Search};
//!
//! let mut search = Cma::new(&[0.5, 0.5], 0.2, 1, Options::default())?;
//! while search.ended().is_none() {
//!     let scores: Vec<f64> = search
//!         .ask()
//!         .iter()
//!         .map(|x| (x[0] - 0.3).powi(2) + (x[1] - 1.0).powi(2))
//!         .collect();
//!     search.tell(&scores)?;
//! }
//! assert!(search.best().is_some_and(|best| best.score < 1e-9));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bipop;
mod bounds;
mod cma;
mod gauss;
mod nelder_mead;
mod plain;
mod scatter;
mod search;

pub use bipop::{Bipop, BipopOptions};
pub use cma::{Cma, Options, Parameters};
pub use nelder_mead::{Coefficients, NelderMead, NelderMeadOptions};
pub use scatter::Scatter;
pub use search::{Best, Ending, Search, SetupError, TellError};
