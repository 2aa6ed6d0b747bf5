//! The cost function that argmin sees: it counts, remembers and records.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use argmin::core::{CostFunction, Error, SendAlias, SyncAlias};
use rayon::prelude::*;

use super::{Evaluation, Objective, Phase, Progress};
use crate::gains::Gains;
use crate::space::Space;

/// The answer to a request for one evaluation more than the budget holds; it ends the solver's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("every evaluation of the budget is used")]
pub(super) struct BudgetSpent;

struct Book {
    evaluations: Vec<Evaluation>,
    /// Index of the evaluation of a candidate.
    known: HashMap<[u64; 7], usize>,
    best: usize,
    phase: Phase,
}

pub(super) struct Ledger<'a> {
    space: &'a Space,
    objective: &'a dyn Objective,
    progress: &'a dyn Progress,
    budget: usize,
    book: Mutex<Book>,
}

impl<'a> Ledger<'a> {
    pub(super) fn new(
        space: &'a Space,
        objective: &'a dyn Objective,
        progress: &'a dyn Progress,
        budget: usize,
    ) -> Self {
        let book = Book { evaluations: Vec::new(), known: HashMap::new(), best: 0, phase: Phase::Start };
        Self { space, objective, progress, budget, book: Mutex::new(book) }
    }

    /// The book is whole between any two statements that change it, so a panic elsewhere does not spoil it.
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) const fn space(&self) -> &Space {
        self.space
    }

    pub(super) fn enter(&self, phase: Phase) {
        self.book().phase = phase;
    }

    pub(super) fn len(&self) -> usize {
        self.book().evaluations.len()
    }

    pub(super) fn left(&self) -> usize {
        self.budget - self.len()
    }

    pub(super) fn best(&self) -> Option<Gains> {
        let book = self.book();
        book.evaluations.get(book.best).map(|evaluation| evaluation.gains)
    }

    pub(super) fn into_evaluations(self) -> Vec<Evaluation> {
        self.book.into_inner().unwrap_or_else(PoisonError::into_inner).evaluations
    }

    /// Evaluates the start exactly as it was given, unrounded.
    pub(super) fn evaluate_start(&self, start: Gains) -> Result<(), BudgetSpent> {
        self.evaluate(&[start]).map(|_| ())
    }

    /// The scores at `points`, evaluated in parallel and recorded in order. A point whose gains are known costs nothing.
    pub(super) fn scores(&self, points: &[&Vec<f64>]) -> Result<Vec<f64>, BudgetSpent> {
        let candidates: Vec<Gains> = points.iter().map(|point| self.space.decode(point)).collect();
        self.evaluate(&candidates)
    }

    fn evaluate(&self, candidates: &[Gains]) -> Result<Vec<f64>, BudgetSpent> {
        let mut fresh: Vec<Gains> = Vec::new();
        {
            let book = self.book();
            for candidate in candidates {
                let bits = candidate.bits();
                if !book.known.contains_key(&bits) && !fresh.iter().any(|other| other.bits() == bits) {
                    fresh.push(*candidate);
                }
            }
        }
        fresh.truncate(self.left());
        // Indexed, so that the outcomes come back in the order of the candidates whatever thread made them.
        let outcomes: Vec<_> = fresh.par_iter().map(|gains| self.objective.evaluate(gains)).collect();

        let mut book = self.book();
        for (gains, outcome) in fresh.into_iter().zip(outcomes) {
            let index = book.evaluations.len();
            let evaluation = Evaluation { index, phase: book.phase, gains, outcome };
            book.evaluations.push(evaluation);
            book.known.insert(gains.bits(), index);
            if outcome < book.evaluations[book.best].outcome {
                book.best = index;
            }
            self.progress.evaluated(index + 1, self.budget, &evaluation, &book.evaluations[book.best]);
        }
        candidates
            .iter()
            .map(|candidate| {
                let index = book.known.get(&candidate.bits()).ok_or(BudgetSpent)?;
                Ok(book.evaluations[*index].outcome.score())
            })
            .collect()
    }
}

/// A solver's view of the ledger: argmin takes its problem by value.
pub(super) struct Problem<'a, 'b> {
    pub(super) ledger: &'a Ledger<'b>,
    /// What to do before a batch, such as to count a generation.
    pub(super) before_batch: &'a (dyn Fn() + Sync),
}

impl CostFunction for Problem<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        let scores = self.ledger.scores(&[point])?;
        scores.first().copied().ok_or_else(|| BudgetSpent.into())
    }

    fn bulk_cost<P>(&self, points: &[P]) -> Result<Vec<f64>, Error>
    where
        P: std::borrow::Borrow<Vec<f64>> + SyncAlias,
        f64: SendAlias,
        Self: SyncAlias,
    {
        (self.before_batch)();
        let points: Vec<&Vec<f64>> = points.iter().map(std::borrow::Borrow::borrow).collect();
        Ok(self.ledger.scores(&points)?)
    }
}

/// Whether a solver stopped because the budget was spent.
pub(super) fn is_budget_spent(error: &Error) -> bool {
    error.downcast_ref::<BudgetSpent>().is_some()
}
