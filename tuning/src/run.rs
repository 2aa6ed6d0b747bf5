//! A run's folder: `gains.toml`, `run.json`, `certificate.json`, `report.html`.
//!
//! `run.json` and `gains.toml` are the same to the byte for the same question and versions: they hold no time, no path and nothing of
//! the machine. All files are written beside their places first and moved there together.

use std::path::{Path, PathBuf};

use certune::closed_loop::{AicTable, Gains, GainsFile, Scenario};
use certune::tune::{Gains as SharedGains, RunRecord};
use certune::verify::{Certificate, verify};
use serde::Serialize;
use serde_json::Value;

use crate::error::Error;
use crate::output::{self, Staged};
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
    /// For a run without winner, the refusal of its best candidate.
    pub certificate: Option<Certificate>,
}

/// The four names.
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
    pub fn certificate(&self) -> PathBuf {
        self.path.join("certificate.json")
    }
    pub fn report(&self) -> PathBuf {
        self.path.join("report.html")
    }
    /// There exactly while the run is not finished.
    pub fn journal(&self) -> PathBuf {
        self.path.join("journal.jsonl")
    }

    /// Reads `run.json` and `certificate.json`, which is checked, not believed.
    pub fn read(&self) -> Result<Run, Error> {
        let path = self.record();
        let text = std::fs::read_to_string(&path).map_err(|source| Error::NoRun { path: path.clone(), source })?;
        let file = RunFile::parse(&path, &text)?;
        let path = self.certificate();
        let certificate = match output::read_file(&path) {
            Err(Error::Io { source, .. })
                if source.kind() == std::io::ErrorKind::NotFound && file.record.winner.is_none() =>
            {
                None
            }
            text => Some(
                verify(&text?, &crate::catalogue::records(&[])?)
                    .map_err(|source| Error::Certificate { path: path.clone(), source })?
                    .map_err(|source| Error::Rejected { path, source })?,
            ),
        };
        Ok(Run { file, certificate })
    }

    /// Writes all files of a run; those that this run has not, of an earlier run in the same folder, are removed.
    pub fn write(&self, run: &Run, page: &str) -> Result<Vec<PathBuf>, Error> {
        let record = serde_json::to_string_pretty(&run.file)? + "\n";
        let gains = run.file.gains_toml();
        let certificate = run.certificate.as_ref().map(certune::certificate_text).transpose()?;
        let files = [
            (self.gains(), gains),
            (self.record(), Some(record)),
            (self.certificate(), certificate),
            (self.report(), Some(page.to_owned())),
        ];
        let mut staged = Vec::new();
        for (path, content) in &files {
            if let Some(content) = content {
                staged.push(Staged::write(path, content)?);
            }
        }
        for (path, content) in &files {
            if content.is_none() {
                output::remove_file(path)?;
            }
        }
        staged.into_iter().try_for_each(Staged::commit)?;
        Ok(files.into_iter().filter(|(_, content)| content.is_some()).map(|(path, _)| path).collect())
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

    /// The gains file of the winner.
    pub fn gains_toml(&self) -> Option<String> {
        let question = &self.record.question;
        let source = format!(
            "autotune {VERSION}: tuned for robot {} in scenario {}, seed {}, {} candidates from {} in space {}; certified, see \
             certificate.json",
            question.robot,
            question.scenario,
            question.search.seed,
            self.record.evaluations.len(),
            self.preset,
            self.space_name,
        );
        let gains = Gains::Aic(table(self.record.tuned()?));
        Some(GainsFile { source: Some(source), gains }.to_toml())
    }
}

/// Gains that all joints share, as a file holds them.
fn table(gains: &SharedGains) -> AicTable {
    AicTable::from(&gains.on_every_joint::<1>())
}
