//! `autotune verify`: certificates checked again, from the files alone.

use std::path::Path;

use certune::verify::{Certificate, Record, Rejection, verify};
use serde::Serialize;

use super::claims::{AssumptionSummary, ClaimSummary, claims_in_words, summaries};
use crate::catalogue;
use crate::cli::{Context, Exit, VerifyArgs};
use crate::error::Error;
use crate::output;

/// One file for `--json`.
#[derive(Debug, Serialize)]
struct FileSummary {
    file: String,
    /// `holds`, `does not hold`, `rejected` or `unreadable`.
    verdict: &'static str,
    /// Why it is rejected or unreadable.
    reason: Option<String>,
    sha256: Option<String>,
    /// What every statement is about.
    about: Option<String>,
    claims: Vec<ClaimSummary>,
    assumptions: Vec<AssumptionSummary>,
}

pub fn run(args: &VerifyArgs, context: Context) -> Result<Exit, Error> {
    let records = catalogue::records(&args.constants)?;
    let mut worst = Exit::Holds;
    let mut files = Vec::new();
    for path in &args.files {
        let (exit, summary) = check(path, &records, context)?;
        worst = worst.max(exit);
        files.push(summary);
    }
    if context.json {
        output::print_json(&files)?;
    }
    Ok(worst)
}

fn check(path: &Path, records: &[Record], context: Context) -> Result<(Exit, FileSummary), Error> {
    let file = path.display().to_string();
    let failed = |verdict, reason: String| FileSummary {
        file: file.clone(),
        verdict,
        reason: Some(reason),
        sha256: None,
        about: None,
        claims: Vec::new(),
        assumptions: Vec::new(),
    };
    let read = output::read_file(path).and_then(|text| {
        verify(&text, records).map_err(|source| Error::Certificate { path: path.to_path_buf(), source })
    });
    match read {
        Err(error) => {
            output::say(&error.in_full());
            Ok((Exit::Unreadable, failed("unreadable", error.to_string())))
        }
        Ok(Err(rejection)) => {
            output::say(&format!("rejected: {file}: {rejection}\n  try: {}", advice(&rejection)));
            Ok((Exit::NotCertified, failed("rejected", rejection.to_string())))
        }
        Ok(Ok(certificate)) => {
            if !context.json {
                output::print(&format!("{file}\n{}\n", claims_in_words(&certificate, &[], true)))?;
            }
            let exit = exit_of(&certificate);
            let summary = FileSummary {
                file,
                verdict: if exit == Exit::Holds { "holds" } else { "does not hold" },
                reason: None,
                sha256: Some(certificate.document().sha256.clone()),
                about: Some(certificate.document().about.clone()),
                claims: summaries(&certificate, &[]),
                assumptions: certificate.assumptions().into_iter().map(Into::into).collect(),
            };
            Ok((exit, summary))
        }
    }
}

/// What to do about a rejection.
fn advice(rejection: &Rejection) -> &'static str {
    match rejection {
        Rejection::Record { .. } => {
            "--constants with the record that the certificate was made with (`autotune constants` makes one), or certify again"
        }
        Rejection::Hash { .. }
        | Rejection::Empty
        | Rejection::Crowded { .. }
        | Rejection::Form
        | Rejection::Head(_)
        | Rejection::About { .. }
        | Rejection::Statement { .. }
        | Rejection::Grade { .. }
        | Rejection::Claim { .. } => "the file as it was written, or certify again",
    }
}

/// What a checked certificate means for the exit code.
pub fn exit_of(certificate: &Certificate) -> Exit {
    if certificate.all_hold() { Exit::Holds } else { Exit::NotCertified }
}
