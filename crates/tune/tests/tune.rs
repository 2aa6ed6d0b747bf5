//! The winner is the best candidate that the certifier accepts, and the record tells how it came about.

mod common;

use std::collections::BTreeMap;
use std::sync::Mutex;

use certune_tune::{
    Bench, Evaluation, Finite, Gains, Judge, Method, ObjectiveName, Outcome, Progress, Question, RunRecord,
    SearchSettings, Space, Stage, TuneError, TuneProgress, Tuned, Verdict, tune,
};
use common::{Numbers, ones as start, space_of};

fn space() -> Space {
    space_of(&["kappa_mu", "kappa_a"], [0.1, 10.0])
}

fn cost_s(gains: &Gains) -> f64 {
    1.0 + (gains.number("kappa_mu") / 4.0).ln().powi(2) + (gains.number("kappa_a") / 0.5).ln().powi(2)
}

fn objective(gains: &Gains) -> Outcome {
    if gains.number("kappa_a") > 3.0 {
        return Outcome::Unstable { abscissa_per_s: Finite::saturating(gains.number("kappa_a")) };
    }
    Outcome::Simulated { cost: Finite::saturating(cost_s(gains)) }
}

struct Held;

impl Judge for Held {
    fn judge(&self, gains: &Gains) -> Verdict {
        Verdict { outcome: Outcome::Simulated { cost: Finite::saturating(1.1 * cost_s(gains)) }, plants: Vec::new() }
    }
}

fn question(method: Method, attempts: usize) -> Question {
    Question {
        robot: "panda".to_owned(),
        robot_sha256: "00".to_owned(),
        scenario: "pick-and-place".to_owned(),
        versions: BTreeMap::from([("autotune".to_owned(), "0.1.0".to_owned())]),
        objective: ObjectiveName::SettlingCost,
        search: SearchSettings::new(method, 60, 3),
        batch_plants: 1,
        held_out_plants: 1,
        certification_attempts: attempts,
    }
}

fn run<C>(attempts: usize, certify: impl FnMut(&Gains) -> Result<C, &'static str>) -> Tuned<C> {
    let bench = Bench { objective: &objective, judge: &Held, progress: &() };
    tune(question(Method::NelderMead, attempts), &space(), Some(&start()), bench, certify).expect("a valid question")
}

fn rank_is_consistent(record: &RunRecord) {
    for attempt in &record.certification {
        let outcome = record.evaluations[attempt.evaluation].outcome;
        match attempt.refusal {
            None => assert!(matches!(outcome, Outcome::Certified { .. })),
            Some(_) => assert!(matches!(outcome, Outcome::Uncertified { .. })),
        }
    }
    let certified =
        record.evaluations.iter().filter(|evaluation| matches!(evaluation.outcome, Outcome::Certified { .. })).count();
    assert_eq!(certified, usize::from(record.winner.is_some()));
    let read: RunRecord =
        serde_json::from_str(&serde_json::to_string(record).expect("a record serialises")).expect("and reads back");
    assert_eq!(&read, record);
}

#[test]
fn the_best_candidate_wins_when_everything_is_certified() {
    let tuned = run(5, |gains| Ok::<_, &str>(gains.number("kappa_mu")));
    let record = &tuned.record;
    rank_is_consistent(record);
    assert_eq!(record.certification.len(), 1);
    let winner = record.winner().unwrap();
    assert!(record.evaluations.iter().all(|other| winner.outcome <= other.outcome));
    assert_eq!(tuned.certificate, Some(winner.gains.number("kappa_mu")));
    assert_eq!(record.start().unwrap().gains, start());
    assert!(record.held_out.tuned.as_ref().unwrap().outcome < record.held_out.start.as_ref().unwrap().outcome);
    assert_eq!(record.sensitivity.len(), 2);
    assert!(
        record
            .sensitivity
            .iter()
            .all(|row| row.at_minus_10_percent > winner.outcome && row.at_plus_10_percent > winner.outcome)
    );
}

#[test]
fn the_best_certified_candidate_wins_over_better_refused_ones() {
    let tuned = run(1000, |gains| if gains.number("kappa_mu") < 2.0 { Ok(()) } else { Err("too fast") });
    rank_is_consistent(&tuned.record);
    let winner = tuned.record.winner().unwrap();
    assert!(winner.gains.number("kappa_mu") < 2.0 && tuned.record.certification.len() > 1);
    let better =
        |other: &&Evaluation| other.outcome.cost() < winner.outcome.cost() && other.gains.number("kappa_mu") < 2.0;
    assert!(tuned.record.evaluations.iter().find(better).is_none(), "a better candidate would have been certified");
}

#[test]
fn near_neighbours_of_a_refused_candidate_are_passed_over() {
    let visited = Mutex::new(Vec::new());
    let tuned = run(1000, |gains| {
        visited.lock().unwrap().push(gains.clone());
        Err::<(), _>("never")
    });
    rank_is_consistent(&tuned.record);
    let simulated = tuned.record.evaluations.iter().filter(|evaluation| evaluation.outcome.cost().is_some()).count();
    let points: Vec<_> = visited.into_inner().unwrap().iter().map(|gains| space().encode(gains)).collect();
    assert!(points.len() < simulated, "a converging simplex has neighbours");
    let (last, earlier) = points.split_last().unwrap();
    assert_eq!(tuned.record.winner, None);
    assert!(
        tuned.certificate.is_none() && tuned.record.held_out.tuned.is_none() && tuned.record.sensitivity.is_empty()
    );
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < certune_tune::tune::NEIGHBOUR);
    assert!(earlier.iter().all(|point| !near(point, last) || *last == space().encode(&start())));
}

#[test]
fn the_start_is_the_last_resort() {
    let tuned = run(3, |gains| if *gains == start() { Ok(()) } else { Err("only the start") });
    rank_is_consistent(&tuned.record);
    assert_eq!(tuned.record.winner, Some(0));
    assert_eq!(tuned.record.certification.len(), 4);
    assert_eq!(tuned.record.held_out.start, tuned.record.held_out.tuned);
}

#[test]
fn the_record_is_the_same_to_the_byte_for_any_number_of_threads() {
    for method in [Method::NelderMead, Method::ParticleSwarm] {
        let record = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let bench = Bench { objective: &objective, judge: &Held, progress: &() };
            let certify = |gains: &Gains| if gains.number("kappa_mu") < 2.0 { Ok(()) } else { Err("too fast") };
            let tuned = pool.install(|| tune(question(method, 20), &space(), Some(&start()), bench, certify)).unwrap();
            serde_json::to_string_pretty(&tuned.record).unwrap()
        };
        let one = record(1);
        assert_eq!(one, record(2));
        assert_eq!(one, record(4));
    }
}

#[test]
fn every_stage_is_announced_and_no_attempt_is_refused() {
    #[derive(Default)]
    struct Log(Mutex<Vec<&'static str>>);
    impl Progress for Log {
        fn evaluated(&self, _: usize, _: usize, _: &Evaluation, _: &Evaluation) {
            self.0.lock().expect("unpoisoned").push("evaluated");
        }
    }
    impl TuneProgress for Log {
        fn stage(&self, stage: Stage<'_>) {
            let name = match stage {
                Stage::Search => "search",
                Stage::Certify { .. } => "certify",
                Stage::Judge => "judge",
            };
            self.0.lock().expect("unpoisoned").push(name);
        }
    }
    let log = Log::default();
    let bench = Bench { objective: &objective, judge: &Held, progress: &log };
    tune(question(Method::NelderMead, 1), &space(), None, bench, |_| Ok::<_, &str>(())).unwrap();
    let mut heard = log.0.into_inner().unwrap();
    assert_eq!(heard.iter().filter(|name| **name == "evaluated").count(), 60);
    heard.dedup();
    assert_eq!(heard, ["search", "evaluated", "certify", "judge"]);
    let bench = Bench { objective: &objective, judge: &Held, progress: &() };
    let none = tune(question(Method::NelderMead, 0), &space(), None, bench, |_| Ok::<_, &str>(()));
    assert!(matches!(none, Err(TuneError::NoAttempts)));
}
