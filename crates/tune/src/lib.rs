//! Search space, score and derivative-free search.
//!
//! A [`Space`] says which gains may move, an [`Objective`] turns gains into a ranked [`Outcome`], [`search()`] spends an exact number of
//! evaluations on finding good ones, and [`tune()`] brings the best before a certifier and held-out plants before the winner. The record is the same to
//! the bit for any number of threads.
#![forbid(unsafe_code)]

pub mod batch;
mod checked;
pub mod filter;
pub mod front;
pub mod goals;
pub mod learnt;
pub mod outcome;
pub mod record;
pub mod score;
pub mod search;
pub mod space;
pub mod streams;
pub mod tune;
pub mod worst;

pub use batch::{Batch, BatchError, Prover, SimulatedObjective};
pub use certune_closed_loop::Gains;
pub use filter::StabilityFilter;
pub use goals::{Bound, Excess, Goal, GoalError, Goals, Limit, Reference, Source};
pub use learnt::{Direction, Surface, TooFew};
pub use outcome::{Finite, NotFinite, Outcome};
pub use record::{
    Attempt, Figures, HeldOut, PlantResult, Question, RunRecord, Sensitivity, SpaceRecord, Verdict, WorstPlant,
};
pub use search::{
    Candidate, Evaluation, Hardened, Objective, Phase, Progress, SearchError, SearchRun, SearchSettings, Termination,
    search,
};
pub use space::{Knob, Method, Range, Scale, Setting, Space, SpaceError, SpaceFile, Tie};
pub use tune::{Bench, Judge, Stage, TuneError, TuneProgress, Tuned, tune};
pub use worst::WorsePlant;
