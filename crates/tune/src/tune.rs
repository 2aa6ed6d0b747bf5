//! From a question to certified gains: search, certify, judge.
//!
//! 1. [`search`] ranks candidates by simulation; the start is among them.
//! 2. A search over the plant box looks for the plant on which the best candidate fares worst. If it is worse than all that the search has met, it joins them: the best candidates are
//!    evaluated again, and the search goes on around the best of them with its share of a fifth of the evaluations. At most `question.worst_plants` rounds; candidates of the last one go on.
//! 3. The candidates that finished the task, or met the objective otherwise, go before the certifier from the lowest cost upwards until one is certified. A candidate closer than
//!    [`NEIGHBOUR`] in every coordinate to one that was refused is passed over: its certificate would fail for the same reason.
//!    When the attempts are used up without a certificate, the start is tried last.
//! 4. Start and winner run on plants that the search never saw, and each knob of the winner is changed by ±10 %.
//!
//! The certifier is a closure, so this module knows nothing about proofs: whoever calls it decides what "certified" means, and keeps the evidence.

use core::fmt::Display;

use certune_closed_loop::Gains;
use rayon::prelude::*;

use crate::outcome::Outcome;
use crate::record::{
    Attempt, HeldOut, Question, RECORD_SCHEMA, RunRecord, Sensitivity, SpaceRecord, Verdict, WorstPlant,
};
use crate::search::{
    Candidate, Evaluation, Hardened, Objective, Phase, Progress, SearchError, SearchRun, SearchSettings, Termination,
    search,
};
use crate::space::{Knob, Method, Space};

/// Distance, as a fraction of each knob's range, below which two candidates share the fate of one certificate.
pub const NEIGHBOUR: f64 = 0.01;
/// Candidates that are evaluated again when a worse plant has joined.
const RETESTED: usize = 8;
/// Edge of the simplex around the best of them, a fraction of each range.
const POLISH: f64 = 0.03;

/// Plants that the search never sees.
pub trait Judge: Sync {
    /// What each plant says about `gains`, and all of them together: a pure function of the gains.
    fn judge(&self, gains: &Gains) -> Verdict;
}

/// What a run is busy with, for [`TuneProgress`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage<'a> {
    /// The search; its evaluations are reported through [`Progress`].
    Search,
    /// A plant is looked for that is worse for the best candidate; then the search goes on with it.
    WorstPlant {
        /// The round, from 1.
        round: u32,
    },
    /// A candidate is before the certifier.
    Certify {
        /// The visit, from 1.
        attempt: usize,
        /// The candidate.
        candidate: &'a Evaluation,
    },
    /// Held-out plants and sensitivities.
    Judge,
}

/// Who is told about the progress of a run; `()` is nobody.
pub trait TuneProgress: Progress {
    /// A stage begins.
    fn stage(&self, stage: Stage<'_>);
}

impl TuneProgress for () {
    fn stage(&self, _: Stage<'_>) {}
}

/// Why a run could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TuneError {
    /// The search was refused.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// Without a visit to the certifier nothing can win.
    #[error("a run needs at least 1 certification attempt, got 0")]
    NoAttempts,
}

/// A finished run.
#[derive(Clone, Debug)]
pub struct Tuned<C> {
    /// What happened.
    pub record: RunRecord,
    /// The winner's evidence, as the certifier returned it; `None` exactly when the record has no winner.
    pub certificate: Option<C>,
}

/// The parts that a run is made of.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    /// Scores a candidate during the search.
    pub objective: &'a dyn Objective,
    /// Judges start and winner afterwards.
    pub judge: &'a dyn Judge,
    /// Hears how it goes.
    pub progress: &'a dyn TuneProgress,
}

/// Searches `space`, certifies the best candidate that can be certified, and judges it.
///
/// `certify` returns the evidence for gains, or why there is none. It is called from the current thread, at most
/// `question.certification_attempts + 1` times. A run in which nothing is certified is no error: its record has no winner.
///
/// # Errors
/// [`TuneError`] for settings out of range or a start outside the space.
pub fn tune<C, R: Display>(
    question: Question,
    space: &Space,
    start: Option<&Gains>,
    bench: Bench<'_>,
    certify: impl FnMut(&Gains) -> Result<C, R>,
) -> Result<Tuned<C>, TuneError> {
    if question.certification_attempts == 0 {
        return Err(TuneError::NoAttempts);
    }
    bench.progress.stage(Stage::Search);
    // A fifth of the evaluations waits for what the worst plants will show.
    let reserve = if round_share(&question) == 0 { 0 } else { question.search.evaluations / 5 };
    let settings = SearchSettings { evaluations: question.search.evaluations - reserve, ..question.search };
    let run = search(space, start, &settings, bench.objective, bench.progress)?;
    // A search that nobody answers has not even evaluated its start.
    let start = start.filter(|_| !run.evaluations.is_empty()).map(|_| 0);
    let campaign = Campaign { question, space, bench, start, run, worst_plants: Vec::new() };
    Ok(campaign.finish(bench.objective, certify))
}

/// The evaluations of a round with a worse plant; 0 where there are too few for any.
fn round_share(question: &Question) -> usize {
    let share = (question.search.evaluations / 5).checked_div(question.worst_plants as usize).unwrap_or(0);
    if share < 2 { 0 } else { share }
}

/// A run between its first search and its end.
struct Campaign<'a> {
    question: Question,
    space: &'a Space,
    bench: Bench<'a>,
    start: Option<usize>,
    run: SearchRun,
    worst_plants: Vec<WorstPlant>,
}

impl Campaign<'_> {
    /// As long as a plant is found that is worse for the best candidate, it joins the others and the search goes on; then certificates and judgement. An objective lives as long as
    /// the next harder one is made of it, hence the recursion, which is as deep as there are rounds.
    fn finish<C, R: Display>(
        mut self,
        objective: &dyn Objective,
        certify: impl FnMut(&Gains) -> Result<C, R>,
    ) -> Tuned<C> {
        if let Some(harder) = self.harden(objective) {
            return self.finish(&*harder, certify);
        }
        // What no plant has asked for is the last digits'.
        let left = self.question.search.evaluations.saturating_sub(self.run.evaluations.len());
        let best = self.ranked().first().map(|best| best.gains.clone());
        if let Some(best) = best
            .filter(|_| self.question.worst_plants > 0 && left > 1 && self.run.termination == Termination::BudgetSpent)
        {
            self.polish(objective, &best, left);
        }
        self.conclude(objective, certify)
    }

    /// The number of the current round.
    const fn round(&self) -> u32 {
        self.worst_plants.len() as u32
    }

    /// The candidates of the current round that have a cost, from the best.
    fn ranked(&self) -> Vec<Evaluation> {
        let current =
            |evaluation: &&&Evaluation| evaluation.round == self.round() && evaluation.outcome.cost().is_some();
        self.run.ranked().iter().filter(current).map(|evaluation| (*evaluation).clone()).collect()
    }

    /// A harder objective, with the best candidates so far and those around them evaluated on it.
    fn harden<'o>(&mut self, objective: &'o dyn Objective) -> Option<Box<dyn Objective + 'o>> {
        let share = round_share(&self.question);
        if self.round() >= self.question.worst_plants || share == 0 || self.run.termination == Termination::Interrupted
        {
            return None;
        }
        let ranked = self.ranked();
        let best = ranked.first()?;
        self.bench.progress.stage(Stage::WorstPlant { round: self.round() + 1 });
        let Hardened { objective: harder, plant } = objective.hardened(&best.gains, self.round())?;
        let again: Vec<Candidate> = ranked
            .iter()
            .take(RETESTED.min(share / 2))
            .map(|evaluation| Candidate { gains: evaluation.gains.clone(), enough: None })
            .collect();
        let Some(outcomes) = harder.evaluate_all(&again) else {
            self.run.termination = Termination::Interrupted;
            return None;
        };
        self.worst_plants.push(WorstPlant { evaluation: best.index, setting: plant.setting, outcome: plant.outcome });
        let retested = again.len();
        for (Candidate { gains, .. }, outcome) in again.into_iter().zip(outcomes) {
            self.record(Phase::Retest, gains, outcome);
        }
        let start = self.run.evaluations[self.run.evaluations.len() - retested..]
            .iter()
            .min_by_key(|evaluation| (evaluation.outcome, evaluation.index))?
            .gains
            .clone();
        self.polish(&*harder, &start, share - retested);
        Some(harder)
    }

    /// Nelder-Mead around the best candidate of the round.
    fn polish(&mut self, objective: &dyn Objective, best: &Gains, evaluations: usize) {
        let settings =
            SearchSettings { method: Method::NelderMead, evaluations, simplex_step: POLISH, ..self.question.search };
        let Ok(polished) = search(self.space, Some(best), &settings, objective, &()) else { return };
        if polished.termination == Termination::Interrupted {
            self.run.termination = Termination::Interrupted;
        }
        // Its own start is known.
        for Evaluation { gains, outcome, .. } in polished.evaluations.into_iter().skip(1) {
            self.record(Phase::Polish, gains, outcome);
        }
    }

    fn record(&mut self, phase: Phase, gains: Gains, outcome: Outcome) {
        let (index, round) = (self.run.evaluations.len(), self.round());
        self.run.evaluations.push(Evaluation { index, round, phase, gains, outcome });
    }

    /// Certificates, and the judgement of plants that the search never saw.
    fn conclude<C, R: Display>(
        mut self,
        objective: &dyn Objective,
        certify: impl FnMut(&Gains) -> Result<C, R>,
    ) -> Tuned<C> {
        let (round, start) = (self.round(), self.start);
        let Bench { judge, progress, .. } = self.bench;
        let (certification, winner) = certify_best(
            &mut self.run,
            self.space,
            objective,
            (start, round),
            self.question.certification_attempts,
            progress,
            certify,
        );
        progress.stage(Stage::Judge);
        let Self { question, space, run, worst_plants, .. } = self;
        let winner_index = winner.as_ref().map(|(index, _)| *index);
        let gains_at =
            |index: Option<usize>| index.and_then(|index| run.evaluations.get(index)).map(|found| found.gains.clone());
        let (start_gains, tuned_gains) = (gains_at(start), gains_at(winner_index));
        let start_verdict = start_gains.map(|gains| judge.judge(&gains));
        let tuned_verdict = if winner_index == start {
            start_verdict.clone()
        } else {
            tuned_gains.as_ref().map(|gains| judge.judge(gains))
        };
        let record = RunRecord {
            schema: RECORD_SCHEMA,
            question,
            space: SpaceRecord::from(space),
            termination: run.termination,
            worst_plants,
            certification,
            start,
            winner: winner_index,
            held_out: HeldOut { start: start_verdict, tuned: tuned_verdict },
            sensitivity: tuned_gains.map_or_else(Vec::new, |gains| sensitivity(space, objective, &gains)),
            evaluations: run.evaluations,
        };
        Tuned { record, certificate: winner.map(|(_, certificate)| certificate) }
    }
}

/// Brings candidates before `certify`, and writes the verdicts into their outcomes.
fn certify_best<C, R: Display>(
    run: &mut SearchRun,
    space: &Space,
    objective: &dyn Objective,
    (start, round): (Option<usize>, u32),
    attempts: usize,
    progress: &dyn TuneProgress,
    mut certify: impl FnMut(&Gains) -> Result<C, R>,
) -> (Vec<Attempt>, Option<(usize, C)>) {
    let mut visits: Vec<Attempt> = Vec::new();
    let mut visit = |candidate: &mut Evaluation, visits: &mut Vec<Attempt>| {
        let (Outcome::Certified { cost } | Outcome::Simulated { cost }) = candidate.outcome else { return None };
        progress.stage(Stage::Certify { attempt: visits.len() + 1, candidate });
        let (outcome, refusal, certificate) = match certify(&candidate.gains) {
            Ok(certificate) => (Outcome::Certified { cost }, None, Some(certificate)),
            Err(reason) => (Outcome::Uncertified { cost }, Some(reason.to_string()), None),
        };
        visits.push(Attempt { evaluation: candidate.index, refusal });
        candidate.outcome = outcome;
        certificate
    };
    let mut refused: Vec<Vec<f64>> = Vec::new();
    let current = |index: &usize| run.evaluations[*index].round == round;
    let mut waiting: Vec<usize> = (0..run.evaluations.len()).filter(current).collect();
    while visits.len() < attempts
        && let Some(index) = take_best(run, &mut waiting, objective)
    {
        let point = space.encode(&run.evaluations[index].gains);
        if refused.iter().any(|other| are_neighbours(other, &point)) {
            continue;
        }
        if let Some(certificate) = visit(&mut run.evaluations[index], &mut visits) {
            return (visits, Some((index, certificate)));
        }
        refused.push(point);
    }
    let last_resort = start.filter(|start| visits.iter().all(|visit| visit.evaluation != *start));
    let certified = last_resort.and_then(|index| Some((index, visit(&mut run.evaluations[index], &mut visits)?)));
    (visits, certified)
}

/// Takes the best of the candidates in `waiting` that may be certified; of equals the earlier. A stopped one whose turn comes is evaluated to its end first.
fn take_best(run: &mut SearchRun, waiting: &mut Vec<usize>, objective: &dyn Objective) -> Option<usize> {
    loop {
        let place = |index: usize| {
            let (number, is_exact) = match run.evaluations[index].outcome {
                Outcome::Certified { cost } | Outcome::Simulated { cost } => (cost, true),
                Outcome::Stopped { cost_above } => (cost_above, false),
                Outcome::Violates { .. }
                | Outcome::Uncertified { .. }
                | Outcome::Unstable { .. }
                | Outcome::Diverged { .. } => return None,
            };
            Some((number, is_exact, index))
        };
        let (_, is_exact, index) = waiting.iter().filter_map(|index| place(*index)).min()?;
        if is_exact {
            waiting.retain(|other| *other != index);
            return Some(index);
        }
        let evaluation = &mut run.evaluations[index];
        evaluation.outcome = objective.evaluate(&evaluation.gains, None);
    }
}

fn are_neighbours(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < NEIGHBOUR)
}

/// What a change of each knob by ±10 % does to the outcome; the bounds of the space do not apply. Costs two evaluations per knob.
pub fn sensitivity(space: &Space, objective: &dyn Objective, gains: &Gains) -> Vec<Sensitivity> {
    let changed = |knob: &Knob| Sensitivity {
        knob: knob.name.clone(),
        at_minus_10_percent: objective.evaluate(&knob.scaled(gains, 0.9), None),
        at_plus_10_percent: objective.evaluate(&knob.scaled(gains, 1.1), None),
    };
    space.knobs().par_iter().map(changed).collect()
}
