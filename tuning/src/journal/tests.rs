//! What a journal promises: nothing that was found is lost, and nothing else is believed.

use std::sync::atomic::AtomicUsize;

use certune::closed_loop::PerJoint;
use certune::tune::{Goals, SearchRun, SearchSettings, Space, Termination, search};
use proptest::prelude::*;

use super::*;
use crate::catalogue;
use crate::commands::tune::{inertia_kg_m2, started};

/// A bowl with a cliff; it takes every chance to stop, and counts.
#[derive(Default)]
struct Bowl {
    evaluated: AtomicUsize,
}

impl Objective for Bowl {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        self.evaluated.fetch_add(1, Ordering::Relaxed);
        let [kappa_mu, kappa_a] = ["kappa_mu", "kappa_a"].map(|row| gains.row(row).and_then(PerJoint::shared).unwrap());
        if kappa_a > 3000.0 {
            return Outcome::Unstable { abscissa_per_s: Finite::saturating(kappa_a) };
        }
        let cost = 1.0 + (kappa_mu / 20.0).ln().powi(2) + (kappa_a / 2000.0).ln().powi(2) / 3.0;
        match enough {
            Some(enough) if cost > enough.get() => Outcome::Stopped { cost_above: enough },
            _ => Outcome::Simulated { cost: Finite::saturating(cost) },
        }
    }
}

/// A search that nobody has begun.
struct Bench {
    header: Header,
    space: Space,
    folder: Folder,
    _temporary: tempfile::TempDir,
}

impl Bench {
    fn new(budget: usize) -> Self {
        let source = catalogue::space(None, None).unwrap();
        let robot = catalogue::robot("panda", None).unwrap();
        let scenario = catalogue::scenario(None, &robot).unwrap();
        let inertia_kg_m2 = inertia_kg_m2(&robot, &scenario).unwrap();
        let (preset, space, start) = started(&source, Some(&inertia_kg_m2)).unwrap();
        let question = Question {
            robot: "panda".to_owned(),
            robot_sha256: robot.sha256(),
            scenario: scenario.name.clone(),
            versions: crate::versions::versions(),
            goals: Goals::default(),
            search: SearchSettings::new(space.method(), budget, 1),
            batch_plants: 1,
            held_out_plants: 1,
            worst_plants: 0,
            certification_attempts: 1,
        };
        let header = Header {
            robot: "panda".to_owned(),
            robot_file: None,
            tip: None,
            controller: "aic".to_owned(),
            scenario,
            space_name: source.name,
            space: source.text,
            preset,
            start,
            question,
        };
        let temporary = tempfile::tempdir().unwrap();
        let folder = Folder { path: temporary.path().to_path_buf() };
        Self { header, space, folder, _temporary: temporary }
    }

    fn begin(&self) -> Journal {
        Journal::begin(&self.folder, &self.header).unwrap()
    }

    fn search(&self, journal: &mut Journal, bowl: &Bowl, stop: bool) -> (SearchRun, Result<(), Error>) {
        let stop = AtomicBool::new(stop);
        let objective = Journalled::new(bowl, journal, &stop);
        let Header { question, start, .. } = &self.header;
        let run = search(&self.space, Some(start), &question.search, &objective, &()).unwrap();
        (run, objective.failure())
    }

    /// The search, never interrupted, and its journal.
    fn whole(&self) -> (SearchRun, Vec<u8>) {
        let mut journal = self.begin();
        let (run, failure) = self.search(&mut journal, &Bowl::default(), false);
        failure.unwrap();
        let bytes = self.bytes();
        journal.finish().unwrap();
        (run, bytes)
    }

    fn bytes(&self) -> Vec<u8> {
        std::fs::read(self.folder.journal()).unwrap()
    }

    fn write(&self, bytes: &[u8]) {
        std::fs::write(self.folder.journal(), bytes).unwrap();
    }
}

fn problem<T>(result: Result<T, Error>) -> JournalError {
    match result {
        Err(Error::Journal(error)) => error,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("no error"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    /// Wherever the process was killed.
    #[test]
    fn a_journal_cut_off_anywhere_leads_to_the_same_end(share in 0.0..1.0_f64) {
        let bench = Bench::new(60);
        let (expected, bytes) = bench.whole();
        let stopped = expected.evaluations.iter().any(|one| matches!(one.outcome, Outcome::Stopped { .. }));
        prop_assert!(stopped, "the search never stops a candidate early");
        let header = bytes.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        let cut = header + (share * (bytes.len() - header + 1) as f64) as usize;
        bench.write(&bytes[..cut]);
        let (read, mut journal) = Journal::open(&bench.folder).unwrap();
        prop_assert_eq!(&read, &bench.header);
        let held: usize = journal.generations.iter().map(|generation| generation.asked.len()).sum();
        let bowl = Bowl::default();
        let (run, failure) = bench.search(&mut journal, &bowl, false);
        prop_assert!(failure.is_ok());
        prop_assert_eq!(run, expected);
        prop_assert_eq!(bench.bytes(), bytes.clone());
        // Nothing that it holds is evaluated again.
        let whole = Content::read(Path::new("whole"), &mut File::open(bench.folder.journal()).unwrap()).unwrap();
        let asked: usize = whole.generations.iter().map(|generation| generation.asked.len()).sum();
        prop_assert_eq!(bowl.evaluated.into_inner(), asked - held);
    }

    /// Whatever stands in the file is read or refused.
    #[test]
    fn bytes_never_do_harm(place in 0.0..1.0_f64, with in proptest::collection::vec(any::<u8>(), 0..30)) {
        let bench = Bench::new(20);
        let (expected, mut bytes) = bench.whole();
        let at = (place * bytes.len() as f64) as usize;
        let end = (at + with.len()).min(bytes.len());
        bytes.splice(at..end, with);
        bench.write(&bytes);
        if let Ok((header, mut journal)) = Journal::open(&bench.folder) {
            let (run, failure) = bench.search(&mut journal, &Bowl::default(), false);
            // Only an outcome or a name may have changed unnoticed, or the torn end; what was asked is compared.
            prop_assert!(failure.is_err() || header != bench.header || run.evaluations.len() == expected.evaluations.len());
        }
    }
}

#[test]
fn an_interrupted_search_has_a_candidate_and_goes_on() {
    let bench = Bench::new(40);
    let (expected, _) = bench.whole();
    let mut journal = bench.begin();
    let (run, failure) = bench.search(&mut journal, &Bowl::default(), true);
    failure.unwrap();
    assert_eq!((run.evaluations.len(), run.termination), (1, Termination::Interrupted));
    drop(journal);
    let (_, mut journal) = Journal::open(&bench.folder).unwrap();
    assert_eq!(bench.search(&mut journal, &Bowl::default(), false).0, expected);
}

#[test]
fn one_process_at_a_time_and_one_run_in_a_folder() {
    let bench = Bench::new(5);
    let journal = bench.begin();
    assert!(matches!(problem(Journal::open(&bench.folder)), JournalError::InUse { .. }));
    assert!(matches!(problem(Journal::begin(&bench.folder, &bench.header)), JournalError::InUse { .. }));
    assert!(Journal::glance(&bench.folder).unwrap().in_use);
    drop(journal);
    assert!(!Journal::glance(&bench.folder).unwrap().in_use);
    assert!(matches!(problem(Journal::begin(&bench.folder, &bench.header)), JournalError::Unfinished { .. }));
    let (_, journal) = Journal::open(&bench.folder).unwrap();
    journal.finish().unwrap();
    assert!(matches!(problem(Journal::open(&bench.folder)), JournalError::NoJournal { .. }));
    assert_eq!(std::fs::read_dir(&bench.folder.path).unwrap().count(), 0);
}

#[test]
fn a_journal_of_other_candidates_is_refused_and_kept() {
    let bench = Bench::new(20);
    let (_, bytes) = bench.whole();
    let text = String::from_utf8(bytes).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let edited = lines[3].replacen("\"sigma_q\":1.0", "\"sigma_q\":1.0000000000000002", 1);
    assert_ne!(edited, lines[3]);
    lines[3] = edited;
    let text = lines.join("\n") + "\n";
    bench.write(text.as_bytes());
    let (_, mut journal) = Journal::open(&bench.folder).unwrap();
    let (_, failure) = bench.search(&mut journal, &Bowl::default(), false);
    assert!(matches!(problem(failure), JournalError::OtherCandidates { line: 4, .. }));
    assert_eq!(bench.bytes(), text.as_bytes());
}

/// A device that takes nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_search_and_keeps_what_is_there() {
    let bench = Bench::new(20);
    let (expected, _) = bench.whole();
    let mut journal = bench.begin();
    let stopped = bench.search(&mut journal, &Bowl::default(), true).0;
    let before = bench.bytes();
    let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
    let whole = std::mem::replace(&mut journal.file, full);
    let (run, failure) = bench.search(&mut journal, &Bowl::default(), false);
    assert_eq!(run, stopped);
    assert!(matches!(problem(failure), JournalError::Append { .. }));
    assert_eq!(bench.bytes(), before);
    journal.file = whole;
    let (run, failure) = bench.search(&mut journal, &Bowl::default(), false);
    failure.unwrap();
    assert_eq!(run, expected);
}

#[test]
fn a_journal_that_is_removed_is_missed() {
    let bench = Bench::new(20);
    let mut journal = bench.begin();
    std::fs::remove_file(bench.folder.journal()).unwrap();
    let (_, failure) = bench.search(&mut journal, &Bowl::default(), false);
    assert!(matches!(problem(failure), JournalError::Removed { .. }));
}
