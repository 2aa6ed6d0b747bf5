//! A certificate's files: `NAME.json`, and `NAME.constants.json` beside it when it rests on constants that no built-in record holds.
//!
//! Whoever reads a certificate looks beside it, so that it can be checked from its own folder.

use std::path::{Path, PathBuf};

use certune::verify::{Record, Rejection, verify};
use certune::{Answer, certificate_text};

use crate::catalogue;
use crate::error::Error;
use crate::output;

/// Where the constants are that a certificate brings with it.
fn constants_beside(path: &Path) -> PathBuf {
    path.with_extension("constants.json")
}

/// What is written for a certificate at `path`, each file with its content.
pub fn files(path: &Path, answer: &Answer) -> Result<Vec<(PathBuf, String)>, Error> {
    let mut files = vec![(path.to_path_buf(), certificate_text(&answer.certificate)?)];
    if let Some(record) = &answer.record {
        let is_built_in = catalogue::records(&[])?.iter().any(|known| known.sha256 == record.sha256);
        if !is_built_in {
            files.push((constants_beside(path), serde_json::to_string_pretty(record)? + "\n"));
        }
    }
    Ok(files)
}

/// Writes a certificate, and the constants that go with it, to a file; a device or a pipe gets the certificate alone.
pub fn write(path: &Path, answer: &Answer) -> Result<(), Error> {
    if output::is_device(path) {
        return output::write_file(path, &certificate_text(&answer.certificate)?);
    }
    output::commit(output::stage(&files(path, answer)?)?)
}

/// Reads a certificate and checks it: constants that it calls proved must be those of one of the `records`, or of the one beside it.
pub fn read(path: &Path, records: &[Record]) -> Result<Result<Answer, Rejection>, Error> {
    let text = output::read_file(path)?;
    let mut records = records.to_vec();
    let beside = constants_beside(path);
    if beside.exists() {
        records.push(catalogue::record(&beside)?);
    }
    let checked = verify(&text, &records).map_err(|source| Error::Certificate { path: path.to_path_buf(), source })?;
    Ok(checked.map(|certificate| Answer::new(certificate, &records)))
}
