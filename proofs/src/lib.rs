//! The claims that CI derives again, on the Panda with the published gains.
//!
//! Each claim is three files of one name: `claims/<name>.md` (statement, assumptions, derivation, source), `tests/<name>.rs`, and
//! `certificates/<name>.json`. `cargo xtask claims` writes the certificates again.
#![forbid(unsafe_code)]

pub mod map;

use std::path::{Path, PathBuf};

use certune::certify::FamilyValues;
use certune::closed_loop::{FileError, Gains, GainsFile, KeyError};
use certune::control::mrac::MracGains;
use certune::dynamics::Robot;
use certune::verify::{Certificate, ClaimKind, Record, Rejection, VerifyError, verify};
use certune::{Answer, ArmCertifier, StabilityError, certificate_text};

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
    /// A record of constants cannot be written.
    #[error("a record of constants cannot be written: {0}")]
    Record(#[from] serde_json::Error),
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

/// The proved constants of the nominal Panda over all angles.
///
/// # Errors
/// [`ProofError`] when the file is broken.
pub fn records() -> Result<Vec<Record>, ProofError> {
    Ok(vec![Record::parse(include_str!("../../tuning/constants/panda.json"))??])
}

/// The claims about the gains of the authors' released simulation, derived now.
///
/// # Errors
/// [`ProofError`] when the preset or the arm is broken.
pub fn published(family: &FamilyValues, claim: ClaimKind) -> Result<Certificate, ProofError> {
    let text = include_str!("../../tuning/presets/pezzato2020-simulation.toml");
    let file = GainsFile::parse(Path::new("pezzato2020-simulation.toml"), text)?;
    let Gains::Aic(table) = file.gains else { return Err(ProofError::Controller) };
    let gains = table.bind::<7>()?;
    Ok(ArmCertifier::new(&Robot::panda(), family)?.certify(&gains, &[claim])?)
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

/// The stored certificate of a claim, checked; written first when `CERTUNE_WRITE_CLAIMS` is set.
///
/// # Errors
/// [`ProofError`] when the file is missing, unreadable or rejected.
pub fn stored(name: &str, derived: &Certificate) -> Result<Certificate, ProofError> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("certificates").join(name).with_extension("json");
    let failed = |source| ProofError::Stored { path: path.clone(), source };
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        std::fs::write(&path, certificate_text(derived)?).map_err(failed)?;
    }
    let text = std::fs::read_to_string(&path).map_err(failed)?;
    Ok(verify(&text, &[])??)
}

/// The stored certificate of a claim that rests on a record of its own, checked with the stored record, `constants/<name>.json`; both are written first when
/// `CERTUNE_WRITE_CLAIMS` is set.
///
/// # Errors
/// As [`stored`].
pub fn stored_with_record(name: &str, derived: &Answer) -> Result<(Certificate, Record), ProofError> {
    let file = |folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(name).with_extension("json");
    let [certificate, constants] = ["certificates", "constants"].map(file);
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        |source| ProofError::Stored { path, source }
    };
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        for record in &derived.records {
            let text = serde_json::to_string_pretty(record)? + "\n";
            std::fs::write(&constants, text).map_err(failed(&constants))?;
        }
        std::fs::write(&certificate, certificate_text(&derived.certificate)?).map_err(failed(&certificate))?;
    }
    let record = Record::parse(&std::fs::read_to_string(&constants).map_err(failed(&constants))?)??;
    let text = std::fs::read_to_string(&certificate).map_err(failed(&certificate))?;
    let checked = verify(&text, std::slice::from_ref(&record))??;
    Ok((checked, record))
}
