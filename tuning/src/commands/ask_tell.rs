//! `autotune ask-tell`: the search for whoever has the plant: gains out and scores in, a JSON line each.
//!
//! ```text
//! out  {"ask":{"id":0,"gains":{"kappa_mu":11.67, ..}}}      one line a candidate, a generation at a time
//! in   {"tell":{"id":0,"score":1.25}}                       lower is better; in any order within the generation
//! in   {"tell":{"id":1,"failed":true}}                      worse than every score
//! out  {"error":{"line":7,"message":".."}}                  a line that could not be used; nothing is lost by it
//! out  {"done":{"reason":"budget-spent","evaluations":100,"best":{"id":41,"score":0.98,"gains":{..}}}}
//! ```
//!
//! The same space, budget and seed, told the same scores, ask the same gains: a session that broke off is taken up by telling it again what it was told.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::sync::{Mutex, PoisonError};

use certune::closed_loop::Scenario;
use certune::dynamics::Robot;
use certune::tune::filter::{DEFAULT_SAMPLES, StabilityFilter};
use certune::tune::{
    Candidate, Finite, Gains, Objective, Outcome, SearchSettings, Space, Termination, TuneError, search,
};
use serde::{Deserialize, Serialize};

use super::tune::{DEFAULT_BUDGET, DEFAULT_SEED, begun, inertia_kg_m2, misfit};
use crate::catalogue;
use crate::cli::{AskTellArgs, Exit};
use crate::error::Error;
use crate::lines::{Lines, nobody_listens};
use crate::sizes::for_joint_count;

#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
enum Said<'a> {
    Ask { id: usize, gains: &'a Gains },
    Done { reason: &'static str, evaluations: usize, best: Option<Best<'a>> },
}

#[derive(Debug, Serialize)]
struct Best<'a> {
    id: usize,
    score: f64,
    gains: &'a Gains,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heard {
    tell: Tell,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tell {
    id: usize,
    score: Option<f64>,
    #[serde(default)]
    failed: bool,
}

impl Tell {
    fn outcome(&self) -> Result<Outcome, String> {
        match (self.score, self.failed) {
            (Some(score), false) => Ok(Outcome::Simulated {
                cost: Finite::new(score).map_err(|_| format!("score {score} is not a finite number"))?,
            }),
            (None, true) => Ok(Outcome::Diverged { at_s: Finite::saturating(0.0) }),
            (Some(_), true) => Err("both a score and a failure: tell one of the two".to_owned()),
            (None, false) => {
                Err("neither a score nor a failure: tell \"score\": NUMBER or \"failed\": true".to_owned())
            }
        }
    }
}

/// The other side of the two streams.
struct Talk<R, W> {
    lines: Lines<R, W>,
    /// Everything asked for so far; a candidate's place is its id.
    asked: Vec<Gains>,
    /// What a failure of the streams was.
    broken: Option<Error>,
}

impl<R: BufRead, W: Write> Talk<R, W> {
    const fn new(lines: Lines<R, W>) -> Self {
        Self { lines, asked: Vec::new(), broken: None }
    }

    /// Asks for all of `gains` and listens until each has its answer; none when the input has ended before.
    fn answers(&mut self, gains: &[Gains]) -> Result<Option<Vec<Outcome>>, Error> {
        let first = self.asked.len();
        self.asked.extend_from_slice(gains);
        for (offset, gains) in gains.iter().enumerate() {
            self.lines.say(&Said::Ask { id: first + offset, gains })?;
        }
        let mut answers: BTreeMap<usize, Outcome> = BTreeMap::new();
        while answers.len() < gains.len() {
            let Some(text) = self.lines.hear()? else { return Ok(None) };
            if let Err(message) = understood(text, first..self.asked.len(), &mut answers) {
                self.lines.refuse(&message)?;
            }
        }
        Ok(Some(answers.into_values().collect()))
    }
}

/// Takes a line's answer, or says why it cannot be taken.
fn understood(
    text: &[u8],
    open: core::ops::Range<usize>,
    answers: &mut BTreeMap<usize, Outcome>,
) -> Result<(), String> {
    let Heard { tell } = serde_json::from_slice(text)
        .map_err(|error| format!("expected {{\"tell\":{{\"id\":0,\"score\":1.25}}}}: {error}"))?;
    if tell.id < open.start {
        return Err(format!("candidate {} has been answered", tell.id));
    }
    if tell.id >= open.end {
        return Err(format!("candidate {} has not been asked for", tell.id));
    }
    let outcome = tell.outcome().map_err(|reason| format!("candidate {}: {reason}", tell.id))?;
    if answers.contains_key(&tell.id) {
        return Err(format!("candidate {} has been answered; the first answer stands", tell.id));
    }
    answers.insert(tell.id, outcome);
    Ok(())
}

/// The growth of a linearised loop, where the robot is known.
type Filter = Box<dyn Fn(&Gains) -> Option<Outcome> + Sync>;

/// The objective that somebody else knows.
struct Told<R, W> {
    talk: Mutex<Talk<R, W>>,
    filter: Option<Filter>,
}

impl<R: BufRead + Send, W: Write + Send> Objective for Told<R, W> {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        let alone = self.evaluate_all(&[Candidate { gains: gains.clone(), enough }]);
        alone.and_then(|found| found.first().copied()).unwrap_or(Outcome::Diverged { at_s: Finite::saturating(0.0) })
    }

    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        let mut outcomes: Vec<Option<Outcome>> = candidates
            .iter()
            .map(|candidate| self.filter.as_ref().and_then(|filter| filter(&candidate.gains)))
            .collect();
        let open = candidates.iter().zip(&outcomes).filter(|(_, found)| found.is_none());
        let gains: Vec<Gains> = open.map(|(candidate, _)| candidate.gains.clone()).collect();
        let mut talk = self.talk.lock().unwrap_or_else(PoisonError::into_inner);
        let answers = match talk.answers(&gains) {
            Ok(answers) => answers?,
            Err(error) => {
                talk.broken = Some(error);
                return None;
            }
        };
        let mut answers = answers.into_iter();
        for outcome in outcomes.iter_mut().filter(|outcome| outcome.is_none()) {
            *outcome = answers.next();
        }
        outcomes.into_iter().collect()
    }
}

pub fn run(args: &AskTellArgs) -> Result<Exit, Error> {
    let file = catalogue::space(args.space.as_deref(), None)?.space;
    let arm = match &args.robot {
        Some(name) => {
            let robot = catalogue::robot(name, args.tip.as_deref())?;
            let scenario = catalogue::scenario(args.scenario.as_deref(), &robot)?;
            Some((inertia_kg_m2(&robot, &scenario)?, robot, scenario))
        }
        None => None,
    };
    let inertia_kg_m2 = arm.as_ref().map(|(inertia_kg_m2, ..)| inertia_kg_m2.as_slice());
    let (space, start) = begun(&file, inertia_kg_m2)?;
    let start = start.map(|(_, start)| start);
    let budget = args.budget.unwrap_or(DEFAULT_BUDGET);
    let settings = SearchSettings::new(space.method(), budget, args.seed.unwrap_or(DEFAULT_SEED));
    let filter = arm.as_ref().map(|(_, robot, scenario)| filter(robot, scenario, settings.seed)).transpose()?;
    match converse(Lines::standard(), filter, &space, start.as_ref(), &settings) {
        Err(error) if nobody_listens(&error) => Ok(Exit::Unreadable),
        ended => ended,
    }
}

/// The whole search, from the first question to the last line.
fn converse<R: BufRead + Send, W: Write + Send>(
    lines: Lines<R, W>,
    filter: Option<Filter>,
    space: &Space,
    start: Option<&Gains>,
    settings: &SearchSettings,
) -> Result<Exit, Error> {
    let told = Told { talk: Mutex::new(Talk::new(lines)), filter };
    let found = search(space, start, settings, &told, &()).map_err(TuneError::from)?;
    let Talk { mut lines, asked, broken } = told.talk.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(error) = broken {
        return Err(error);
    }
    let best = found.ranked().first().and_then(|best| {
        let id = asked.iter().position(|gains| *gains == best.gains)?;
        Some(Best { id, score: best.outcome.cost()?, gains: &best.gains })
    });
    let (reason, exit) = match found.termination {
        Termination::BudgetSpent => ("budget-spent", Exit::Holds),
        Termination::Converged => ("converged", Exit::Holds),
        Termination::Interrupted => ("input-ended", Exit::Unreadable),
    };
    lines.say(&Said::Done { reason, evaluations: found.evaluations.len(), best })?;
    Ok(exit)
}

/// The eigenvalues of the robot's linearised loops, before anybody is asked.
fn filter(robot: &Robot, scenario: &Scenario, seed: u64) -> Result<Filter, Error> {
    for_joint_count!(robot.joints(), N => {
        let task = scenario.bind::<N>(robot).map_err(|error| misfit(robot, scenario, error.into()))?;
        let filter = StabilityFilter::<N>::new(robot, scenario, &task, seed, DEFAULT_SAMPLES)?;
        let step_s = task.step_s;
        let rejected = move |gains: &Gains| {
            let abscissa_per_s = filter.growth_of(gains, step_s)?;
            (abscissa_per_s.get() >= 0.0).then_some(Outcome::Unstable { abscissa_per_s })
        };
        Ok(Box::new(rejected) as Filter)
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(robot)))
}

#[cfg(test)]
mod tests;
