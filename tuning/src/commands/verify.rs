//! `autotune verify`: certificates checked again, from the files alone.

use std::path::Path;

use certune::Answer;
use certune::bounds::recheck;
use certune::verify::{Certificate, Evidence, Record, Rejection};
use serde::Serialize;

use super::claims::{AssumptionSummary, ClaimSummary, claims_in_words, summaries};
use crate::catalogue;
use crate::certificate;
use crate::cli::{Context, Exit, VerifyArgs};
use crate::error::Error;
use crate::output;
use crate::progress::Terminal;
use crate::sizes::for_joint_count;

/// One file for `--json`.
#[derive(Debug, Serialize)]
struct FileSummary {
    file: String,
    /// `holds`, `does not hold`, `rejected` or `unreadable`.
    verdict: &'static str,
    /// Why it is rejected or unreadable.
    reason: Option<String>,
    sha256: Option<String>,
    /// The record of proved constants that it rests on, and, with `--full`, whether it was derived again.
    constants: Option<ConstantsSummary>,
    /// What every statement is about.
    about: Option<String>,
    claims: Vec<ClaimSummary>,
    assumptions: Vec<AssumptionSummary>,
}

/// A record for `--json`.
#[derive(Clone, Debug, Serialize)]
struct ConstantsSummary {
    record_sha256: String,
    robot: String,
    /// Whether every constant follows from its proof; none unless it was derived again.
    derived_again: Option<bool>,
    /// Why one does not.
    reason: Option<String>,
}

/// All of it for `--json --full`.
#[derive(Debug, Serialize)]
struct FullSummary {
    files: Vec<FileSummary>,
    constants: Vec<ConstantsSummary>,
}

pub fn run(args: &VerifyArgs, context: Context) -> Result<Exit, Error> {
    let records = catalogue::records(&args.constants)?;
    let mut worst = Exit::Holds;
    let mut files = Vec::new();
    let mut used: Vec<Record> = Vec::new();
    for path in &args.files {
        let (exit, summary, record) = check(path, &records, context)?;
        worst = worst.max(exit);
        files.push(summary);
        used.extend(record.filter(|record| used.iter().all(|other| other.sha256 != record.sha256)));
    }
    if !args.full {
        if context.json {
            output::print_json(&files)?;
        }
        return Ok(worst);
    }
    let mut constants = Vec::new();
    for record in if args.files.is_empty() { &records } else { &used } {
        let (exit, summary) = derive_again(record, args, context)?;
        worst = worst.max(exit);
        constants.push(summary);
    }
    if context.json {
        output::print_json(&FullSummary { files, constants })?;
    } else if constants.is_empty() {
        output::print("nothing to derive again: no certificate here rests on proved constants\n")?;
    }
    Ok(worst)
}

/// Proves the constants of a record again, from the robot.
fn derive_again(record: &Record, args: &VerifyArgs, context: Context) -> Result<(Exit, ConstantsSummary), Error> {
    let robot = match &args.robot {
        Some(file) => catalogue::robot(file, args.tip.as_deref())?,
        None => catalogue::robot_of(record)?,
    };
    let progress = Terminal::new(context.verbose);
    progress.begin_share(&format!("deriving record {} again", short(&record.sha256)));
    let derived = for_joint_count!(robot.joints(), N => recheck::<N>(record, &robot, &|share| progress.share(share)));
    progress.finish();
    let reason = match derived {
        Some(Ok(())) => None,
        Some(Err(error)) => Some(error.to_string()),
        None => return Err(catalogue::too_many_joints(&robot)),
    };
    let words = format!("record {} of {}", short(&record.sha256), record.arm.name);
    match &reason {
        None if !context.json => output::print(&format!(
            "{words}: every constant follows from its proof, derived again in {:.1} s\n",
            progress.elapsed_s()
        ))?,
        None => {}
        Some(reason) => output::say(&format!(
            "rejected: {words}: {reason}\n  try: `autotune constants` for a record that follows from its proofs"
        )),
    }
    let exit = if reason.is_none() { Exit::Holds } else { Exit::NotCertified };
    let summary = ConstantsSummary {
        record_sha256: record.sha256.clone(),
        robot: record.arm.name.clone(),
        derived_again: Some(reason.is_none()),
        reason,
    };
    Ok((exit, summary))
}

fn short(sha256: &str) -> &str {
    sha256.get(..12).unwrap_or(sha256)
}

/// The verdict on a file, and the record that it rests on.
fn check(path: &Path, records: &[Record], context: Context) -> Result<(Exit, FileSummary, Option<Record>), Error> {
    let file = path.display().to_string();
    let failed = |verdict, reason: String| FileSummary {
        file: file.clone(),
        verdict,
        reason: Some(reason),
        sha256: None,
        constants: None,
        about: None,
        claims: Vec::new(),
        assumptions: Vec::new(),
    };
    match certificate::read(path, records) {
        Err(error) => {
            output::say(&error.in_full());
            Ok((Exit::Unreadable, failed("unreadable", error.to_string()), None))
        }
        Ok(Err(rejection)) => {
            output::say(&format!("rejected: {file}: {rejection}\n  try: {}", advice(&rejection)));
            Ok((Exit::NotCertified, failed("rejected", rejection.to_string()), None))
        }
        Ok(Ok(Answer { certificate, record })) => {
            if !context.json {
                output::print(&format!("{file}\n{}\n", claims_in_words(&certificate, &[], true)))?;
            }
            let exit = exit_of(&certificate);
            let summary = FileSummary {
                file,
                verdict: if exit == Exit::Holds { "holds" } else { "does not hold" },
                reason: None,
                sha256: Some(certificate.document().sha256.clone()),
                constants: constants(&certificate),
                about: Some(certificate.document().about.clone()),
                claims: summaries(&certificate, &[]),
                assumptions: certificate.assumptions().into_iter().map(Into::into).collect(),
            };
            Ok((exit, summary, record))
        }
    }
}

/// The record that a certificate rests on.
fn constants(certificate: &Certificate) -> Option<ConstantsSummary> {
    match &certificate.document().constants.evidence {
        Evidence::Sampled { .. } => None,
        Evidence::Proved { record_sha256 } => Some(ConstantsSummary {
            record_sha256: record_sha256.clone(),
            robot: certificate.document().arm.name.clone(),
            derived_again: None,
            reason: None,
        }),
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
