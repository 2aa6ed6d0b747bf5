//! A run's folder: `gains.toml`, `run.json`, `certificate.json`, `report.html`. Where the claims are about one goal each, there is a certificate for
//! every goal: `certificate-1.json`, `certificate-2.json`, .., and the constants that it rests on beside it: `certificate-1.constants.json`, ..
//!
//! `run.json` and `gains.toml` are the same to the byte for the same question and versions: they hold no time, no path and nothing of
//! the machine. All files are written beside their places first and moved there together.

use std::path::{Path, PathBuf};

use certune::Answer;
use certune::closed_loop::{GainsFile, Scenario};
use certune::tune::RunRecord;
use serde::Serialize;
use serde_json::Value;

use crate::catalogue;
use crate::certificate;
use crate::error::Error;
use crate::output;
use crate::promise;
use crate::versions::VERSION;

/// The content of `run.json`: the record of the search, and what else a page needs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunFile {
    /// The controller that was tuned.
    pub controller: String,
    /// The published gains that the result is compared with.
    pub preset: String,
    /// Name of the search space.
    pub space_name: String,
    /// The scenario in full.
    pub scenario: Scenario,
    /// Every number that led to the gains.
    #[serde(flatten)]
    pub record: RunRecord,
}

/// A run as its folder holds it.
#[derive(Debug)]
pub struct Run {
    pub file: RunFile,
    /// For a run without winner, those of its best candidate up to the refusal.
    pub certificates: Vec<Answer>,
}

/// The names.
#[derive(Clone, Debug)]
pub struct Folder {
    pub path: PathBuf,
}

impl Folder {
    pub fn gains(&self) -> PathBuf {
        self.path.join("gains.toml")
    }
    pub fn record(&self) -> PathBuf {
        self.path.join("run.json")
    }
    /// The certificate's file, or those of `count` certificates.
    pub fn certificates(&self, count: usize) -> Vec<PathBuf> {
        match count {
            0 | 1 => vec![self.path.join("certificate.json")],
            _ => (1..=count).map(|number| self.path.join(format!("certificate-{number}.json"))).collect(),
        }
    }
    pub fn report(&self) -> PathBuf {
        self.path.join("report.html")
    }
    /// There exactly while the run is not finished.
    pub fn journal(&self) -> PathBuf {
        self.path.join("journal.jsonl")
    }

    /// Reads `run.json` and the certificates, which are checked, not believed.
    pub fn read(&self) -> Result<Run, Error> {
        let path = self.record();
        let text = std::fs::read_to_string(&path).map_err(|source| Error::NoRun { path: path.clone(), source })?;
        let file = RunFile::parse(&path, &text)?;
        let records = catalogue::records(&[])?;
        let mut certificates = Vec::new();
        for path in self.certificates(file.certificates()) {
            // Those of a refused candidate end with the refusal.
            if file.record.winner.is_none() && !path.exists() {
                break;
            }
            certificates.push(certificate::read(&path, &records)?.map_err(|source| Error::Rejected { path, source })?);
        }
        Ok(Run { file, certificates })
    }

    /// The certificates' files of an earlier run in the folder.
    fn earlier_certificates(&self) -> Result<Vec<PathBuf>, Error> {
        let broken = |source| Error::Io { action: "read", path: self.path.clone(), source };
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.path).map_err(broken)? {
            let name = entry.map_err(broken)?.file_name();
            let number = name.to_str().and_then(|name| name.strip_prefix("certificate")?.strip_suffix(".json"));
            let is_ours = |number: &str| {
                let number = number.strip_suffix(".constants").unwrap_or(number);
                number.is_empty() || number.strip_prefix('-').is_some_and(|digits| digits.parse::<usize>().is_ok())
            };
            if number.is_some_and(is_ours) {
                found.push(self.path.join(name));
            }
        }
        Ok(found)
    }

    /// Writes all files of a run; those that this run has not, of an earlier run in the same folder, are removed.
    pub fn write(&self, run: &Run, page: &str) -> Result<Vec<PathBuf>, Error> {
        let record = serde_json::to_string_pretty(&run.file)? + "\n";
        let mut files: Vec<(PathBuf, String)> =
            run.file.gains_toml().map(|gains| (self.gains(), gains)).into_iter().collect();
        files.push((self.record(), record));
        for (path, answer) in self.certificates(run.file.certificates()).iter().zip(&run.certificates) {
            files.extend(certificate::files(path, answer)?);
        }
        files.push((self.report(), page.to_owned()));
        let staged = output::stage(&files)?;
        let is_new = |path: &PathBuf| files.iter().any(|(new, _)| new == path);
        for path in self.earlier_certificates()?.into_iter().chain([self.gains()]) {
            if !is_new(&path) {
                output::remove_file(&path)?;
            }
        }
        output::commit(staged)?;
        Ok(files.into_iter().map(|(path, _)| path).collect())
    }
}

impl RunFile {
    /// Reads the text of a `run.json`.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let unreadable = |source| Error::RunRecord { path: path.to_path_buf(), source };
        let inconsistent = |what| Error::RunInconsistent { path: path.to_path_buf(), what };
        let mut value: Value = serde_json::from_str(text).map_err(unreadable)?;
        let object = value.as_object_mut().ok_or_else(|| inconsistent("it is no JSON object"))?;
        let mut take = |key: &str| object.remove(key).unwrap_or(Value::Null);
        let [controller, preset, space_name, scenario] =
            ["controller", "preset", "space_name", "scenario"].map(&mut take);
        let word = |value: Value| serde_json::from_value::<String>(value).map_err(unreadable);
        let file = Self {
            controller: word(controller)?,
            preset: word(preset)?,
            space_name: word(space_name)?,
            scenario: serde_json::from_value(scenario).map_err(unreadable)?,
            record: serde_json::from_value(value).map_err(unreadable)?,
        };
        file.scenario.validate().map_err(|_| inconsistent("its scenario is not valid"))?;
        let evaluations = file.record.evaluations.len();
        let inside = |index: Option<usize>| index.is_none_or(|index| index < evaluations);
        if evaluations > 0 && inside(file.record.start) && inside(file.record.winner) {
            Ok(file)
        } else {
            Err(inconsistent("it names a candidate that it does not hold"))
        }
    }

    /// How many certificates the run's winner has.
    pub fn certificates(&self) -> usize {
        self.record.evaluations.first().map_or(1, |first| promise::certificates(&first.gains, &self.scenario))
    }

    /// The gains file of the winner.
    pub fn gains_toml(&self) -> Option<String> {
        let question = &self.record.question;
        let source = format!(
            "autotune {VERSION}: tuned for robot {} in scenario {}, seed {}, {} candidates from {} in space {}; certified, see \
             {}",
            question.robot,
            question.scenario,
            question.search.seed,
            self.record.evaluations.len(),
            self.preset,
            self.space_name,
            if self.certificates() > 1 { "the certificates" } else { "certificate.json" },
        );
        let gains = self.record.tuned()?.clone();
        Some(GainsFile { source: Some(source), gains }.to_toml())
    }
}
