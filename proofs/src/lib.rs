//! The claims that CI derives again, on the Panda with the published gains.
//!
//! Each claim is three files of one name: `claims/<name>.md` (statement, assumptions, derivation, source), `tests/<name>.rs`, and
//! `certificates/<name>.json`. Further certificates of a claim, refusals among them, are called `<name>--<what differs>.json`. `README.md` lists them
//! all, and answers the question whether the controller is stable. `cargo xtask claims` writes the certificates again.
#![forbid(unsafe_code)]

pub mod index;
pub mod map;

use std::path::{Path, PathBuf};

use certune::certify::FamilyValues;
use certune::closed_loop::{FileError, Gains, GainsFile, KeyError};
use certune::control::aic::AicGains;
use certune::control::mrac::MracGains;
use certune::dynamics::Robot;
use certune::verify::{Certificate, ClaimKind, Evidence, Grade, Record, Rejection, VerifyError};
use certune::{Answer, ArmCertifier, ArmGains, Over, Request, StabilityError, certificate_text};

/// Why a claim could not be derived or compared.
#[derive(Debug, thiserror::Error)]
pub enum ProofError {
    /// The preset is broken.
    #[error(transparent)]
    Preset(#[from] FileError),
    /// The preset does not fit a Panda.
    #[error(transparent)]
    Gains(#[from] KeyError),
    /// The preset is for another controller.
    #[error("the preset is not for the controller of the claim")]
    Controller,
    /// The certificate could not be made.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The stored certificate is missing or cannot be written.
    #[error("{path}: {source} (write it with `cargo xtask claims`)")]
    Stored {
        /// The file.
        path: PathBuf,
        /// The failure.
        source: std::io::Error,
    },
    /// The stored certificate cannot be read.
    #[error(transparent)]
    Unreadable(#[from] VerifyError),
    /// The stored certificate is rejected.
    #[error(transparent)]
    Rejected(#[from] Rejection),
}

/// The Panda with hand, nominal masses, no payload and no rotor inertia.
pub fn nominal_family(gravity_compensation: bool, friction_n_m_s_per_rad: [f64; 2]) -> FamilyValues {
    FamilyValues {
        gravity_compensation,
        friction_n_m_s_per_rad,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    }
}

/// Where proved constants are stored: those of robots, and those of small boxes around the goals of claims.
const RECORDS: [&str; 2] = ["../tuning/constants", "records"];

/// The stored, proved constants.
///
/// # Errors
/// [`ProofError`] when a file cannot be read, or was edited.
pub fn records() -> Result<Vec<Record>, ProofError> {
    let folders = RECORDS.map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder));
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "json"));
    files.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).map_err(|source| ProofError::Stored { path, source })?;
        Ok(Record::parse(&text)??)
    };
    files.into_iter().map(read).collect()
}

/// The Panda with a family of plants, every configuration, on proved constants where a record covers the family.
///
/// # Errors
/// [`ProofError`] when the family or a record is not valid.
pub fn panda(family: &FamilyValues) -> Result<ArmCertifier<7>, ProofError> {
    Ok(ArmCertifier::new(&Robot::panda(), family)?.with_records(&records()?, &Over::AllAngles)?)
}

/// What a claim may be graded: proved on proved constants; sampled ones prove nothing.
pub fn grade(certificate: &Certificate) -> Grade {
    match certificate.document().constants.evidence {
        Evidence::Proved { .. } => Grade::Proved,
        Evidence::Sampled { .. } => Grade::Conditional,
    }
}

/// The authors' released gains for the active inference controller: `simulation`, `libfranka`, or `robot` (re-tuned joint by joint).
///
/// # Errors
/// [`ProofError`] when there is no such preset or it is broken.
pub fn published_aic(name: &str) -> Result<AicGains<7>, ProofError> {
    let (file, text) = match name {
        "simulation" => {
            ("pezzato2020-simulation.toml", include_str!("../../tuning/presets/pezzato2020-simulation.toml"))
        }
        "libfranka" => ("pezzato2020-libfranka.toml", include_str!("../../tuning/presets/pezzato2020-libfranka.toml")),
        _ => ("pezzato2020-robot.toml", include_str!("../../tuning/presets/pezzato2020-robot.toml")),
    };
    let Gains::Aic(table) = GainsFile::parse(Path::new(file), text)?.gains else { return Err(ProofError::Controller) };
    Ok(table.bind::<7>()?)
}

/// What is asked about published gains on a family, derived now.
///
/// # Errors
/// [`ProofError`] when the preset or the arm is broken.
pub fn asked(name: &str, family: &FamilyValues, request: &Request) -> Result<Certificate, ProofError> {
    let Answer { certificate, .. } = panda(family)?.answer(&ArmGains::from(published_aic(name)?), request)?;
    Ok(certificate)
}

/// One claim about the gains of the authors' released simulation, derived now.
///
/// # Errors
/// As [`asked`].
pub fn published(family: &FamilyValues, claim: ClaimKind) -> Result<Certificate, ProofError> {
    asked("simulation", family, &Request { claims: vec![claim], ..Request::default() })
}

/// The goals of the pick-and-place task, rad.
pub const A: [f64; 7] = [1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0];
/// The second of them.
pub const B: [f64; 7] = [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0];
/// The third of them.
pub const C: [f64; 7] = [-1.0, 0.5, 0.0, -1.2, 0.0, 1.6, 0.0];

/// The published gains of the adaptive controller, `simulation` or `robot`, with the law of the preset: the released code.
///
/// # Errors
/// [`ProofError`] when there is no such preset or it is broken.
pub fn published_mrac(name: &str) -> Result<MracGains<7>, ProofError> {
    let (file, text) = match name {
        "simulation" => {
            ("pezzato2020-mrac-simulation.toml", include_str!("../../tuning/presets/pezzato2020-mrac-simulation.toml"))
        }
        _ => ("pezzato2020-mrac-robot.toml", include_str!("../../tuning/presets/pezzato2020-mrac-robot.toml")),
    };
    let file = GainsFile::parse(Path::new(file), text)?;
    let Gains::Mrac(table) = file.gains else { return Err(ProofError::Controller) };
    Ok(table.bind::<7>()?)
}

/// One claim about the adaptive controller around a goal on a family, derived now; with the records of proved constants that it rests on.
///
/// # Errors
/// [`ProofError`] when the arm is broken.
pub fn asked_mrac(
    gains: MracGains<7>,
    family: &FamilyValues,
    claim: ClaimKind,
    goal: [f64; 7],
    delay_samples: usize,
) -> Result<Answer, ProofError> {
    let request = Request {
        claims: vec![claim],
        at_rad: Some(goal.to_vec()),
        delay_samples: Some(delay_samples),
        ..Request::default()
    };
    Ok(panda(family)?.answer(&ArmGains::from(gains), &request)?)
}

/// As [`stored`], with a record of the box around the goal written beside, where the constants are proved.
///
/// # Errors
/// As [`stored`].
pub fn stored_with_records(name: &str, derived: &Answer) -> Result<Certificate, ProofError> {
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        let known = records()?;
        for record in derived.record.iter().filter(|record| known.iter().all(|known| known.sha256 != record.sha256)) {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(RECORDS[1]).join(format!("{name}.json"));
            let failed = |source| ProofError::Stored { path: path.clone(), source };
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(failed)?;
            }
            let text = serde_json::to_string_pretty(record).map_err(VerifyError::from)?;
            std::fs::write(&path, text + "\n").map_err(failed)?;
        }
    }
    stored(name, &derived.certificate)
}

/// The stored certificate of a claim, checked; written first when `CERTUNE_WRITE_CLAIMS` is set.
///
/// # Errors
/// [`ProofError`] when the file is missing, unreadable or rejected.
pub fn stored(name: &str, derived: &Certificate) -> Result<Certificate, ProofError> {
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        let path = file(name);
        std::fs::write(&path, certificate_text(derived)?).map_err(|source| ProofError::Stored { path, source })?;
    }
    kept(name)
}

/// A stored certificate, checked.
///
/// # Errors
/// As [`stored`].
pub fn kept(name: &str) -> Result<Certificate, ProofError> {
    let path = file(name);
    let text = std::fs::read_to_string(&path).map_err(|source| ProofError::Stored { path, source })?;
    Ok(certune::verify::verify(&text, &records()?)??)
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("certificates").join(format!("{name}.json"))
}
