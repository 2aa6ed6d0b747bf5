//! The journal of a run that is not finished: `journal.jsonl` in its folder.
//!
//! A search is a pure function of its question and of the outcomes it is told, so its state is not stored. The journal's first line, the [`Header`], says what was asked; every further line is
//! a generation, the candidates with their outcomes. To resume is to search again from the beginning, where the journal answers the generations that it holds, and only then the plants. The files of a
//! resumed run are therefore those of one that was never interrupted, to the byte.
//!
//! - The header is put in place whole, before anything is computed. A generation is appended and on the disk before the next one is asked for. A last line without its end belongs to a write that was
//!   cut off, and is dropped; its generation is evaluated again.
//! - The journal is removed when all files of the run are in place: it is there exactly while the run is not finished.
//! - Whoever works on the run holds an exclusive lock on the journal; the system lets go of it with the process, however that ends.
//!
//! Limits: what comes after the search (certificate, held-out plants, report) is not journalled; it is done again.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use certune::closed_loop::Scenario;
use certune::tune::{Candidate, Finite, Gains, Hardened, Objective, Outcome, Question};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::output::{self, Staged, cannot};
use crate::run::Folder;

/// What can be wrong with a journal.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    #[error("{} holds no unfinished run", folder.display())]
    NoJournal { folder: PathBuf },
    #[error("another process is at work on the run in {}", folder.display())]
    InUse { folder: PathBuf },
    #[error("{} holds an unfinished run", folder.display())]
    Unfinished { folder: PathBuf },
    #[error("{}, line {line}: not a line of a journal: {source}", path.display())]
    Line { path: PathBuf, line: usize, source: serde_json::Error },
    #[error("{}, line {line}: {asked} candidates with {found} outcomes", path.display())]
    Outcomes { path: PathBuf, line: usize, asked: usize, found: usize },
    #[error("{}, line {line}: these are not the candidates that the search asks for", path.display())]
    OtherCandidates { path: PathBuf, line: usize },
    #[error("the run was begun with {recorded}; this is {found}")]
    OtherVersions { recorded: String, found: String },
    #[error("the robot's description has changed since the run was begun: it hashes to {found}, then to {recorded}")]
    OtherRobot { recorded: String, found: String },
    #[error("cannot append to the journal in {}: {source}; what it holds is kept", folder.display())]
    Append { folder: PathBuf, source: std::io::Error },
    #[error("{source}; the journal is kept")]
    Results { folder: PathBuf, source: Box<Error> },
    #[error("{} was removed while the run was going on", path.display())]
    Removed { path: PathBuf },
}

impl JournalError {
    /// What to do about it.
    pub fn advice(&self) -> Option<String> {
        let anew = "begin the run anew, with another --out";
        match self {
            Self::NoJournal { .. } => {
                Some("a folder in which `autotune tune` was interrupted; `autotune runs` lists them".to_owned())
            }
            Self::InUse { .. } => Some("another --out, or wait until it is done".to_owned()),
            Self::Unfinished { folder } => Some(format!(
                "`autotune resume {}` to finish it, another --out to leave it, or delete its journal.jsonl to give it up",
                folder.display()
            )),
            Self::Line { .. } | Self::Outcomes { .. } | Self::OtherCandidates { .. } => {
                Some(format!("the journal as the run left it; if it was edited, {anew}"))
            }
            Self::OtherVersions { .. } => Some(format!("the program that began it, or {anew}")),
            Self::OtherRobot { .. } => Some(format!("the robot's file as it was, or {anew}")),
            Self::Append { folder, .. } | Self::Results { folder, .. } => {
                Some(format!("make room there, then `autotune resume {}`", folder.display()))
            }
            Self::Removed { .. } => Some(anew.to_owned()),
        }
    }
}

/// What was asked, in full: a run is repeated from this alone, and a URDF file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// How the robot was named on the command line.
    pub robot: String,
    /// Its file, if it is not built in.
    pub robot_file: Option<PathBuf>,
    pub tip: Option<String>,
    pub controller: String,
    pub scenario: Scenario,
    pub space_name: String,
    /// The text of the space's file.
    pub space: String,
    pub preset: String,
    pub start: Gains,
    pub question: Question,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    gains: Gains,
    enough: Option<Finite>,
}

/// A line: candidates in the order of the search, and what became of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Generation {
    asked: Vec<Asked>,
    found: Vec<Outcome>,
}

/// A journal that this process works on.
#[derive(Debug)]
pub struct Journal {
    folder: Folder,
    /// Locked; written at its end.
    file: File,
    generations: Vec<Generation>,
}

/// A journal that somebody looks at.
pub struct Glance {
    pub header: Header,
    /// Candidates whose outcomes it holds.
    pub candidates: usize,
    /// Whether a process works on the run right now.
    pub in_use: bool,
}

impl Journal {
    /// The journal of a new run in `folder`, which must hold no unfinished one.
    pub fn begin(folder: &Folder, header: &Header) -> Result<Self, Error> {
        let path = folder.journal();
        let staged = Staged::write(&path, &line(header)?)?;
        let Some(file) = staged.commit_new_locked()? else {
            let folder = folder.path.clone();
            return Err(if is_in_use(&path)? {
                JournalError::InUse { folder }.into()
            } else {
                JournalError::Unfinished { folder }.into()
            });
        };
        output::remove_staged(&folder.path);
        Ok(Self { folder: folder.clone(), file, generations: Vec::new() })
    }

    /// The journal of the unfinished run in `folder`, to go on with it.
    pub fn open(folder: &Folder) -> Result<(Header, Self), Error> {
        let path = folder.journal();
        let mut file = OpenOptions::new().read(true).write(true).open(&path).map_err(|error| absent(folder, error))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse { folder: folder.path.clone() }.into()),
            Err(TryLockError::Error(error)) => return Err(cannot("lock", &path)(error)),
            Ok(()) => {}
        }
        let Content { header, generations, whole } = Content::read(&path, &mut file)?;
        file.set_len(whole).and_then(|()| file.seek(SeekFrom::End(0))).map_err(cannot("write", &path))?;
        output::remove_staged(&folder.path);
        Ok((header, Self { folder: folder.clone(), file, generations }))
    }

    /// What the journal in `folder` says now; whoever works on it is not disturbed.
    pub fn glance(folder: &Folder) -> Result<Glance, Error> {
        let path = folder.journal();
        let mut file = File::open(&path).map_err(|error| absent(folder, error))?;
        let Content { header, generations, .. } = Content::read(&path, &mut file)?;
        // A candidate that was stopped too early is asked for twice.
        let asked = generations.iter().flat_map(|generation| &generation.asked);
        let candidates: BTreeSet<String> =
            asked.map(|asked| serde_json::to_string(&asked.gains)).collect::<Result<_, _>>()?;
        Ok(Glance { header, candidates: candidates.len(), in_use: is_in_use(&path)? })
    }

    /// The run is finished, and its files are in place.
    pub fn finish(self) -> Result<(), Error> {
        output::remove_file(&self.folder.journal())
    }

    /// The files of the run could not be put in place.
    pub fn without_results(&self, source: Error) -> Error {
        match self.still_there() {
            Ok(()) => JournalError::Results { folder: self.folder.path.clone(), source: Box::new(source) }.into(),
            Err(removed) => removed.into(),
        }
    }

    /// The run has failed. A journal without a generation is worth nothing, unless the disk is what failed.
    pub fn fail(self, error: &Error) -> Result<(), Error> {
        if self.generations.is_empty() && !matches!(error, Error::Journal(_)) {
            return output::remove_file(&self.folder.journal());
        }
        Ok(())
    }

    fn still_there(&self) -> Result<(), JournalError> {
        let path = self.folder.journal();
        if path.exists() { Ok(()) } else { Err(JournalError::Removed { path }) }
    }

    fn append(&mut self, generation: Generation) -> Result<(), Error> {
        self.still_there()?;
        let text = line(&generation)?;
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|source| JournalError::Append { folder: self.folder.path.clone(), source })?;
        self.generations.push(generation);
        Ok(())
    }
}

fn line(value: &impl Serialize) -> Result<String, Error> {
    Ok(serde_json::to_string(value)? + "\n")
}

fn absent(folder: &Folder, error: std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => {
            JournalError::NoJournal { folder: folder.path.clone() }.into()
        }
        _ => cannot("read", &folder.journal())(error),
    }
}

fn is_in_use(path: &Path) -> Result<bool, Error> {
    match File::open(path).map_err(cannot("read", path))?.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Ok(true),
        Err(TryLockError::Error(error)) => Err(cannot("lock", path)(error)),
        Ok(()) => Ok(false),
    }
}

/// What a journal's file holds.
struct Content {
    header: Header,
    generations: Vec<Generation>,
    /// Bytes up to the end of the last whole line.
    whole: u64,
}

impl Content {
    fn read(path: &Path, file: &mut File) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(cannot("read", path))?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        let mut lines = bytes[..whole].split_inclusive(|byte| *byte == b'\n');
        let header = parsed(path, 1, lines.next().unwrap_or_default())?;
        let mut generations = Vec::new();
        for (line, text) in (2..).zip(lines) {
            let generation: Generation = parsed(path, line, text)?;
            let (asked, found) = (generation.asked.len(), generation.found.len());
            if asked != found {
                return Err(JournalError::Outcomes { path: path.to_path_buf(), line, asked, found }.into());
            }
            generations.push(generation);
        }
        Ok(Self { header, generations, whole: whole as u64 })
    }
}

fn parsed<T: DeserializeOwned>(path: &Path, line: usize, text: &[u8]) -> Result<T, JournalError> {
    serde_json::from_slice(text).map_err(|source| JournalError::Line { path: path.to_path_buf(), line, source })
}

/// An objective whose generations are in a journal: those that it holds are answered by it, the others are added to it.
pub struct Journalled<'a> {
    objective: &'a dyn Objective,
    /// Whether the search is to end after this generation.
    stop: &'a AtomicBool,
    book: Mutex<Book<'a>>,
}

struct Book<'a> {
    journal: &'a mut Journal,
    /// Generations answered.
    answered: usize,
    failure: Option<Error>,
}

impl<'a> Journalled<'a> {
    pub const fn new(objective: &'a dyn Objective, journal: &'a mut Journal, stop: &'a AtomicBool) -> Self {
        Self { objective, stop, book: Mutex::new(Book { journal, answered: 0, failure: None }) }
    }

    /// What has ended the search, unless it was its own end or `stop`.
    pub fn failure(self) -> Result<(), Error> {
        self.book.into_inner().unwrap_or_else(PoisonError::into_inner).failure.map_or(Ok(()), Err)
    }

    fn book(&self) -> MutexGuard<'_, Book<'a>> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The outcomes on `objective`: the journal's, or new ones that go into it.
    fn answer(&self, candidates: &[Candidate], objective: &dyn Objective) -> Option<Vec<Outcome>> {
        if candidates.is_empty() {
            return Some(Vec::new()); // a generation of candidates that are known
        }
        let mut book = self.book();
        match book.answer(candidates, objective, self.stop) {
            Ok(found) => found,
            Err(error) => {
                book.failure = Some(error);
                None
            }
        }
    }
}

impl Book<'_> {
    fn answer(
        &mut self,
        candidates: &[Candidate],
        objective: &dyn Objective,
        stop: &AtomicBool,
    ) -> Result<Option<Vec<Outcome>>, Error> {
        let asked: Vec<Asked> = candidates
            .iter()
            .map(|Candidate { gains, enough }| Asked { gains: gains.clone(), enough: *enough })
            .collect();
        if let Some(recorded) = self.journal.generations.get(self.answered) {
            // Positive finite numbers: equal ones have equal bits.
            if recorded.asked != asked {
                let (path, line) = (self.journal.folder.journal(), self.answered + 2);
                return Err(JournalError::OtherCandidates { path, line }.into());
            }
            self.answered += 1;
            return Ok(Some(recorded.found.clone()));
        }
        // A report needs one candidate at least.
        if self.answered > 0 && stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let Some(found) = objective.evaluate_all(candidates) else { return Ok(None) };
        self.journal.append(Generation { asked, found: found.clone() })?;
        self.answered += 1;
        Ok(Some(found))
    }
}

impl Objective for Journalled<'_> {
    // Asked after the search, when nothing is lost any more.
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        self.objective.evaluate(gains, enough)
    }

    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        self.answer(candidates, self.objective)
    }

    fn hardened(&self, gains: &Gains, round: u32) -> Option<Hardened<'_>> {
        harder(self.objective, self, gains, round)
    }
}

/// A harder objective, in the same journal. The search for the plant that makes it harder is not journalled: it is a pure function of what is.
struct Harder<'a, 'b> {
    objective: Box<dyn Objective + 'a>,
    journalled: &'a Journalled<'b>,
}

fn harder<'a, 'b: 'a>(
    objective: &'a dyn Objective,
    journalled: &'a Journalled<'b>,
    gains: &Gains,
    round: u32,
) -> Option<Hardened<'a>> {
    let Hardened { objective, plant } = objective.hardened(gains, round)?;
    Some(Hardened { objective: Box::new(Harder { objective, journalled }), plant })
}

impl Objective for Harder<'_, '_> {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        self.objective.evaluate(gains, enough)
    }

    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        self.journalled.answer(candidates, &*self.objective)
    }

    fn hardened(&self, gains: &Gains, round: u32) -> Option<Hardened<'_>> {
        harder(&*self.objective, self.journalled, gains, round)
    }
}

#[cfg(test)]
mod tests;
