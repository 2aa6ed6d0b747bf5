//! An arm, a family of plants and gains, to a certificate: the one place where dynamics, bounds and proofs meet.
//!
//! | file | what it holds |
//! |---|---|
//! | `arm` | [`ArmCertifier`]: an arm with its family and constants, ready to certify gains |
//! | `constants` | which constants: of a proved record that covers the family, or sampled |
//! | `request` | what is asked of a certifier, and which claims a controller can have |
//! | `gains` | gains of either controller, as a certificate writes them |
//! | `counterexample`, `growth` | for a refusal: an unstable member of the family, and a simulation that shows it |
//! | `objective` | certified figures as goals of a search |
//! | `poles` | a map of poles |
//! | `proving` | the constants of an arm, proved and written as a record |

mod arm;
mod constants;
mod counterexample;
mod gains;
mod growth;
mod objective;
mod poles;
mod proving;
mod request;

use certune_bounds::{BoundsError, RecordError};
use certune_certify::{CertifyError, FamilyValues, ProblemError, to_json};
use certune_closed_loop::{KeyError, PlantBox, PlantError};
use certune_control::ParamError;
use certune_dynamics::RobotError;
use certune_linsys::LoopError;
use certune_verify::{Certificate, Claim, Document, Record, seal, verify};

pub use arm::ArmCertifier;
pub use constants::Over;
pub use gains::ArmGains;
pub use growth::{Growth, growth};
pub use poles::poles_per_s;
pub use proving::{ProvingEffort, ProvingTask, prove_constants};
pub use request::{Answer, Effort, Request, TorqueLimits, claims_for};

/// The controllers' own step, s. Continuous-time claims do not depend on it; parameters are validated with it.
pub(crate) const STEP_S: f64 = 0.001;

/// Why an arm, a family and gains make no certificate.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The plant box holds delayed plants, which no claim covers.
    #[error(
        "the plant box has an actuation delay of up to {samples} samples, and no claim covers delay: set delay_samples = [0, 0]"
    )]
    Delay {
        /// Largest delay of the box, samples.
        samples: usize,
    },
    /// A claim about one configuration was asked for, and no configuration given.
    #[error("claims about an adaptive controller need a goal of {joints} joint positions")]
    NoConfiguration {
        /// Joints of the arm.
        joints: usize,
    },
    /// Torque limits were asked for, and the robot's description has none for a joint.
    #[error("the robot's description states no torque limit for joint `{joint}`")]
    NoTorqueLimit {
        /// The joint's name.
        joint: String,
    },
    /// The arm cannot be compiled or carry the payload.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The family is no family.
    #[error(transparent)]
    Family(#[from] BoundsError),
    /// The constants make no record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A plant of the family cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A list of gains has another length than the arm.
    #[error(transparent)]
    Length(#[from] KeyError),
    /// The gains are no gains.
    #[error(transparent)]
    Gains(#[from] ParamError),
    /// A number cannot be written in a certificate.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// A linearised loop is not finite.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// The checker does not accept what was written.
    #[error(transparent)]
    Certify(#[from] CertifyError),
}

/// The family of plants that a scenario's plant box spans.
///
/// # Errors
/// [`StabilityError::Delay`] when the box holds delayed plants.
pub fn family_of(plant_box: &PlantBox) -> Result<FamilyValues, StabilityError> {
    let samples = plant_box.delay_samples[1];
    if samples > 0 {
        return Err(StabilityError::Delay { samples });
    }
    Ok(FamilyValues {
        gravity_compensation: plant_box.gravity_compensation,
        friction_n_m_s_per_rad: plant_box.friction_n_m_s_per_rad,
        mass_uncertainty: plant_box.mass_uncertainty,
        payload_kg: plant_box.payload_kg,
        rotor_inertia_kg_m2: plant_box.rotor_inertia_kg_m2,
    })
}

/// The certificate as it is written to a file.
///
/// # Errors
/// [`StabilityError::Certify`] when it does not serialise, which would be a defect.
pub fn certificate_text(certificate: &Certificate) -> Result<String, StabilityError> {
    Ok(to_json(certificate.document()).map_err(CertifyError::from)?)
}

/// The document with more claims behind those it has, checked.
///
/// # Errors
/// [`StabilityError::Certify`] when the checker does not accept it, which would be a defect.
pub(crate) fn checked(
    mut document: Document,
    claims: Vec<Claim>,
    records: &[Record],
) -> Result<Certificate, StabilityError> {
    document.claims.extend(claims.into_iter().map(Into::into));
    let text = to_json(&seal(document)).map_err(CertifyError::from)?;
    Ok(verify(&text, records).map_err(CertifyError::from)?.map_err(CertifyError::from)?)
}
