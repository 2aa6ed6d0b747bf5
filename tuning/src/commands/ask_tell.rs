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
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use certune::closed_loop::Scenario;
use certune::control::aic::AicParams;
use certune::dynamics::Robot;
use certune::tune::filter::{DEFAULT_SAMPLES, StabilityFilter};
use certune::tune::{Candidate, Finite, Gains, Objective, Outcome, SearchSettings, Termination, TuneError, search};
use serde::{Deserialize, Serialize};

use super::tune::{DEFAULT_BUDGET, DEFAULT_SEED, start_of};
use crate::catalogue;
use crate::cli::{AskTellArgs, Exit};
use crate::error::Error;
use crate::sizes::for_joint_count;

#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
enum Said<'a> {
    Ask { id: usize, gains: &'a Gains },
    Error { line: usize, message: String },
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
    input: R,
    output: W,
    /// Lines read.
    line: usize,
    /// Candidates asked so far.
    asked: usize,
    /// What a failure of the streams was.
    broken: Option<std::io::Error>,
}

impl<R: BufRead, W: Write> Talk<R, W> {
    fn say(&mut self, said: &Said<'_>) -> std::io::Result<()> {
        let text = serde_json::to_string(said)?;
        writeln!(self.output, "{text}")?;
        self.output.flush()
    }

    /// Asks for all of `gains` and listens until each has its answer; none when the input has ended before.
    fn answers(&mut self, gains: &[&Gains]) -> std::io::Result<Option<Vec<Outcome>>> {
        let first = self.asked;
        self.asked += gains.len();
        for (offset, gains) in gains.iter().enumerate() {
            self.say(&Said::Ask { id: first + offset, gains })?;
        }
        let mut answers: BTreeMap<usize, Outcome> = BTreeMap::new();
        let mut text = Vec::new();
        while answers.len() < gains.len() {
            text.clear();
            if self.input.read_until(b'\n', &mut text)? == 0 {
                return Ok(None);
            }
            self.line += 1;
            if text.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            if let Err(message) = understood(&text, first..self.asked, &mut answers) {
                let line = self.line;
                self.say(&Said::Error { line, message })?;
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
    /// Candidates that the filter has kept from being asked for.
    unstable: AtomicUsize,
}

impl<R: BufRead + Send, W: Write + Send> Objective for Told<R, W> {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        let alone = self.evaluate_all(&[Candidate { gains: *gains, enough }]);
        alone.and_then(|found| found.first().copied()).unwrap_or(Outcome::Diverged { at_s: Finite::saturating(0.0) })
    }

    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        let mut outcomes: Vec<Option<Outcome>> = candidates
            .iter()
            .map(|candidate| self.filter.as_ref().and_then(|filter| filter(&candidate.gains)))
            .collect();
        self.unstable.fetch_add(outcomes.iter().flatten().count(), Ordering::Relaxed);
        let open = || candidates.iter().zip(&outcomes).filter(|(_, found)| found.is_none());
        let gains: Vec<&Gains> = open().map(|(candidate, _)| &candidate.gains).collect();
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
    let (_, space) = catalogue::space(args.space.as_deref())?;
    let start = start_of(&space)?.map(|(_, start)| start);
    let budget = args.budget.unwrap_or(DEFAULT_BUDGET);
    let settings = SearchSettings::new(space.method(), budget, args.seed.unwrap_or(DEFAULT_SEED));
    let filter = match &args.robot {
        Some(name) => {
            let robot = catalogue::robot(name, args.tip.as_deref())?;
            Some(filter(&robot, &catalogue::scenario(args.scenario.as_deref(), &robot)?, settings.seed)?)
        }
        None => None,
    };
    let talk = Talk {
        input: std::io::BufReader::new(std::io::stdin()),
        output: std::io::stdout(),
        line: 0,
        asked: 0,
        broken: None,
    };
    let told = Told { talk: Mutex::new(talk), filter, unstable: AtomicUsize::new(0) };
    let found = search(&space, start.as_ref(), &settings, &told, &()).map_err(TuneError::from)?;
    let mut talk = told.talk.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(error) = talk.broken {
        return if error.kind() == std::io::ErrorKind::BrokenPipe {
            Ok(Exit::Unreadable)
        } else {
            Err(Error::Stdout(error))
        };
    }
    // Ids count the candidates that were asked for, not those that the filter kept back.
    let asked = |index: usize| {
        let before = &found.evaluations[..index];
        before.iter().filter(|evaluation| !matches!(evaluation.outcome, Outcome::Unstable { .. })).count()
    };
    let best = found
        .ranked()
        .first()
        .and_then(|best| Some(Best { id: asked(best.index), score: best.outcome.cost()?, gains: &best.gains }));
    let interrupted = found.termination == Termination::Interrupted;
    let reason = match found.termination {
        Termination::BudgetSpent => "budget-spent",
        Termination::Converged => "converged",
        Termination::Interrupted => "input-ended",
    };
    talk.say(&Said::Done { reason, evaluations: found.evaluations.len(), best }).map_err(Error::Stdout)?;
    Ok(if interrupted { Exit::Unreadable } else { Exit::Holds })
}

/// The eigenvalues of the robot's linearised loops, before anybody is asked.
fn filter(robot: &Robot, scenario: &Scenario, seed: u64) -> Result<Filter, Error> {
    for_joint_count!(robot.joints(), N => {
        let misfit = |source| Error::ScenarioFit {
            scenario: scenario.name.clone(),
            robot: robot.name().to_owned(),
            source: Box::new(source),
        };
        let task = scenario.bind::<N>(robot).map_err(misfit)?;
        let filter = StabilityFilter::<N>::new(robot, scenario, &task, seed, DEFAULT_SAMPLES)?;
        let step_s = task.step_s;
        let rejected = move |gains: &Gains| {
            let params = AicParams::new(&gains.on_every_joint::<N>(), step_s).ok()?;
            let abscissa_per_s = filter.growth_per_s(&params);
            (abscissa_per_s.get() >= 0.0).then_some(Outcome::Unstable { abscissa_per_s })
        };
        Ok(Box::new(rejected) as Filter)
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(robot)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn talk(input: &str) -> (Talk<&[u8], Vec<u8>>, Gains) {
        let gains = Gains {
            kappa_mu: 1.0,
            kappa_a: 2.0,
            sigma_q: 1.0,
            sigma_dq: 1.0,
            sigma_mu: 1.0,
            sigma_dmu: 1.0,
            reference_time_constant_s: 1.0,
        };
        (Talk { input: input.as_bytes(), output: Vec::new(), line: 0, asked: 0, broken: None }, gains)
    }

    #[test]
    fn answers_come_in_any_order_and_bad_lines_lose_nothing() {
        let lines = [
            "{\"tell\":{\"id\":1,\"failed\":true}}",
            "",
            "not json",
            "{\"tell\":{\"id\":7,\"score\":1}}",
            "{\"tell\":{\"id\":0}}",
            "{\"tell\":{\"id\":0,\"score\":NaN}}",
            "{\"tell\":{\"id\":0,\"score\":1e999}}",
            "{\"tell\":{\"id\":1,\"score\":3}}",
            "{\"tell\":{\"id\":0,\"score\":2.5,\"colour\":1}}",
            "{\"tell\":{\"id\":0,\"score\":2.5}}",
        ];
        let text = lines.join("\n");
        let (mut talk, gains) = talk(&text);
        let answers = talk.answers(&[&gains, &gains]).unwrap().unwrap();
        let expected = [
            Outcome::Simulated { cost: Finite::new(2.5).unwrap() },
            Outcome::Diverged { at_s: Finite::saturating(0.0) },
        ];
        assert_eq!(answers, expected);
        let said = String::from_utf8(talk.output).unwrap();
        let errors: Vec<&str> = said.lines().filter(|line| line.contains("\"error\"")).collect();
        assert_eq!(errors.len(), 7, "{said}");
        for (line, number) in errors.iter().zip([3, 4, 5, 6, 7, 8, 9]) {
            assert!(line.contains(&format!("\"line\":{number},")), "{line}");
        }
    }

    #[test]
    fn an_input_that_ends_leaves_no_answer() {
        let (mut talk, gains) = talk("{\"tell\":{\"id\":0,\"score\":1}}\n");
        assert_eq!(talk.answers(&[&gains, &gains]).unwrap(), None);
    }
}
