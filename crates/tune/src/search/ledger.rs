//! The cost function that argmin sees: it counts, remembers and records.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use argmin::core::{CostFunction, Error, SendAlias, SyncAlias};
use certune_closed_loop::Gains;

use super::{Candidate, Evaluation, Objective, Phase, Progress, SearchSettings};
use crate::outcome::{Finite, Outcome};
use crate::space::Space;

/// The answer to a request for one evaluation more than the budget holds, or that nobody answers; it ends the solver's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("every evaluation of the budget is used")]
pub(super) struct BudgetSpent;

/// The bits of every number, row by row: the identity of a candidate.
type Bits = Vec<Vec<u64>>;

pub(crate) fn bits(gains: &Gains) -> Bits {
    gains.rows().into_iter().map(|(_, numbers)| numbers.values().iter().map(|x| x.to_bits()).collect()).collect()
}

struct Book {
    evaluations: Vec<Evaluation>,
    /// Index of the evaluation of a candidate.
    known: HashMap<Bits, usize>,
    best: usize,
    phase: Phase,
    /// Best and worst outcome of the last generation.
    generation: Option<[Outcome; 2]>,
    interrupted: bool,
}

/// A candidate to be evaluated; `known` is its index when it was stopped too early before.
struct Task {
    candidate: Candidate,
    known: Option<usize>,
}

pub(super) struct Ledger<'a> {
    space: &'a Space,
    objective: &'a dyn Objective,
    progress: &'a dyn Progress,
    budget: usize,
    stop_early: bool,
    book: Mutex<Book>,
}

impl<'a> Ledger<'a> {
    pub(super) fn new(
        space: &'a Space,
        objective: &'a dyn Objective,
        progress: &'a dyn Progress,
        settings: &SearchSettings,
    ) -> Self {
        let book = Book {
            evaluations: Vec::new(),
            known: HashMap::new(),
            best: 0,
            phase: Phase::Start,
            generation: None,
            interrupted: false,
        };
        let (budget, stop_early) = (settings.evaluations, settings.stop_early);
        Self { space, objective, progress, budget, stop_early, book: Mutex::new(book) }
    }

    /// The book is whole between any two statements that change it, so a panic elsewhere does not spoil it.
    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn is_interrupted(&self) -> bool {
        self.book().interrupted
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

    /// The lowest cost, if any candidate has one.
    pub(super) fn best_cost(&self) -> Option<f64> {
        let book = self.book();
        book.evaluations.get(book.best)?.outcome.cost()
    }

    /// Whether the last generation lies in a basin that is known to the bottom: all of its costs are within a share of each other, and none is lower than the best by that share.
    pub(super) fn is_flat(&self, share: f64) -> bool {
        let book = self.book();
        let best = book.evaluations.get(book.best).and_then(|best| best.outcome.cost());
        let Some([Some(first), Some(last)]) = book.generation.map(|ends| ends.map(Outcome::cost)) else { return false };
        last - first <= share * first.abs() && best.is_some_and(|best| first >= best - share * best.abs())
    }

    pub(super) fn best(&self) -> Option<Gains> {
        let book = self.book();
        book.evaluations.get(book.best).map(|evaluation| evaluation.gains.clone())
    }

    pub(super) fn into_evaluations(self) -> Vec<Evaluation> {
        self.book.into_inner().unwrap_or_else(PoisonError::into_inner).evaluations
    }

    /// Evaluates the start exactly as it was given, unrounded.
    pub(super) fn evaluate_start(&self, start: &Gains) -> Result<(), BudgetSpent> {
        self.evaluate(std::slice::from_ref(start), |_| None).map(|_| ())
    }

    /// The outcomes at `points`, evaluated in parallel and recorded in order. A point whose gains are known costs nothing.
    ///
    /// A point that is worse than its `enough` need not be known better than that.
    pub(super) fn outcomes(
        &self,
        points: &[&Vec<f64>],
        enough: impl Fn(usize) -> Option<Finite>,
    ) -> Result<Vec<Outcome>, BudgetSpent> {
        let candidates: Vec<Gains> = points.iter().map(|point| self.space.decode(point)).collect();
        self.evaluate(&candidates, enough)
    }

    fn evaluate(
        &self,
        candidates: &[Gains],
        enough: impl Fn(usize) -> Option<Finite>,
    ) -> Result<Vec<Outcome>, BudgetSpent> {
        let enough = |place: usize| if self.stop_early { enough(place) } else { None };
        let mut tasks: Vec<Task> = Vec::new();
        {
            let book = self.book();
            let mut left = self.budget - book.evaluations.len();
            for (place, gains) in candidates.iter().enumerate() {
                let (own, enough) = (bits(gains), enough(place));
                if let Some(task) = tasks.iter_mut().find(|task| bits(&task.candidate.gains) == own) {
                    task.candidate.enough = task.candidate.enough.zip(enough).map(|(a, b)| a.max(b));
                    continue;
                }
                let known = book.known.get(&own).copied();
                let settled = known.is_some_and(|index| match book.evaluations[index].outcome {
                    Outcome::Stopped { cost_above } => enough.is_some_and(|enough| enough <= cost_above),
                    _ => true,
                });
                if settled || (known.is_none() && left == 0) {
                    continue;
                }
                left -= usize::from(known.is_none());
                tasks.push(Task { candidate: Candidate { gains: gains.clone(), enough }, known });
            }
        }
        let asked: Vec<Candidate> = tasks.iter().map(|task| task.candidate.clone()).collect();
        let Some(outcomes) = self.objective.evaluate_all(&asked) else {
            self.book().interrupted = true;
            return Err(BudgetSpent);
        };

        let mut book = self.book();
        for (Task { candidate: Candidate { gains, .. }, known }, outcome) in tasks.into_iter().zip(outcomes) {
            let index = known.unwrap_or(book.evaluations.len());
            if known.is_some() {
                book.evaluations[index].outcome = outcome;
            } else {
                book.known.insert(bits(&gains), index);
                let phase = book.phase;
                book.evaluations.push(Evaluation { index, round: 0, phase, gains, outcome });
            }
            if outcome < book.evaluations[book.best].outcome {
                book.best = index;
            }
            if known.is_none() {
                self.progress.evaluated(index + 1, self.budget, &book.evaluations[index], &book.evaluations[book.best]);
            }
        }
        let outcome = |gains: &Gains| {
            let index = book.known.get(&bits(gains)).ok_or(BudgetSpent)?;
            Ok(book.evaluations[*index].outcome)
        };
        let outcomes: Vec<Outcome> = candidates.iter().map(outcome).collect::<Result<_, _>>()?;
        let ends = outcomes.iter().min().zip(outcomes.iter().max());
        book.generation = ends.map(|(best, worst)| [*best, *worst]);
        Ok(outcomes)
    }
}

/// A function from points to scores, as argmin wants its problem.
pub(super) struct Problem<F>(pub(super) F);

impl<F: Fn(&[&Vec<f64>]) -> Result<Vec<f64>, BudgetSpent>> CostFunction for Problem<F> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        (self.0)(&[point])?.first().copied().ok_or_else(|| BudgetSpent.into())
    }

    fn bulk_cost<P>(&self, points: &[P]) -> Result<Vec<f64>, Error>
    where
        P: std::borrow::Borrow<Vec<f64>> + SyncAlias,
        f64: SendAlias,
        Self: SyncAlias,
    {
        let points: Vec<&Vec<f64>> = points.iter().map(std::borrow::Borrow::borrow).collect();
        Ok((self.0)(&points)?)
    }
}

/// Whether a solver stopped because the budget was spent.
pub(super) fn is_budget_spent(error: &Error) -> bool {
    error.downcast_ref::<BudgetSpent>().is_some()
}
