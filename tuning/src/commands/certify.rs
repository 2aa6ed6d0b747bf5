//! `autotune certify`: claims about given gains on a family of plants.

use certune::certify::FamilyValues;
use certune::closed_loop::PlantBox;
use certune::dynamics::{Link, Robot, for_joint_count};
use certune::verify::{Certificate, ClaimKind};
use certune::{ArmCertifier, certificate_text, family_of};
use serde::Serialize;

use super::claims::{AssumptionSummary, ClaimSummary, claims_in_words, summaries};
use super::verify::exit_of;
use crate::catalogue::{self, GainsSource};
use crate::cli::{CertifyArgs, ClaimName, Context, Exit, Switch};
use crate::error::Error;
use crate::output;
use crate::progress::Terminal;

/// The controller's step for the check of the gains, s; the claims are in continuous time.
const STEP_S: f64 = 1e-3;

#[derive(Debug, Serialize)]
struct Summary {
    robot: String,
    gains: String,
    family: PlantBox,
    /// Arm, gains, family, scope and constants in words: what every statement is about.
    about: String,
    claims: Vec<ClaimSummary>,
    assumptions: Vec<AssumptionSummary>,
    sha256: String,
    /// Where the certificate was written to.
    file: Option<String>,
}

pub fn run(args: &CertifyArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let gains = GainsSource::find(&args.gains)?;
    gains.aic("certify")?;
    let (plant_box, beyond) = match &args.scenario {
        Some(given) => {
            let scenario = catalogue::scenario(Some(given), &robot)?;
            (scenario.plant_box.clone(), super::tune::beyond_the_claims(&scenario))
        }
        None => (plant_box(args, &robot), None),
    };
    let family = family_of(&plant_box)?;
    let certificate =
        for_joint_count!(robot.joints(), N => certificate::<N>(&robot, &gains, &family, args.claim, context))
            .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    if let Some(path) = &args.out {
        output::write_file(path, &certificate_text(&certificate)?)?;
    }
    if context.json {
        output::print_json(&Summary {
            robot: robot.name().to_owned(),
            gains: args.gains.clone(),
            family: plant_box,
            about: certificate.document().about.clone(),
            claims: summaries(&certificate),
            assumptions: certificate.assumptions().into_iter().map(Into::into).collect(),
            sha256: certificate.document().sha256.clone(),
            file: args.out.as_ref().map(|path| path.display().to_string()),
        })?;
    } else {
        let mut text = claims_in_words(&certificate, context.verbose);
        if let Some(note) = beyond {
            text.push_str(&output::wrapped(&note, 0));
        }
        if let Some(path) = &args.out {
            text.push_str(&format!("written to {}; check it with `autotune verify {0}`\n", path.display()));
        }
        output::print(&text)?;
    }
    Ok(exit_of(&certificate))
}

/// The plants that the options speak of.
fn plant_box(args: &CertifyArgs, robot: &Robot) -> PlantBox {
    let own = |value: fn(&Link) -> f64| {
        let values = || robot.links().iter().map(value);
        [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
    };
    PlantBox {
        mass_uncertainty: args.mass_uncertainty.unwrap_or(0.0),
        payload_kg: [0.0, args.payload.unwrap_or(0.0)],
        friction_n_m_s_per_rad: args
            .friction
            .map_or_else(|| own(|link| link.viscous_n_m_s_per_rad), |interval| interval.0),
        rotor_inertia_kg_m2: args
            .rotor_inertia
            .map_or_else(|| own(|link| link.rotor_inertia_kg_m2), |interval| interval.0),
        delay_samples: [0; 2],
        gravity_compensation: args.gravity_compensation == Some(Switch::On),
    }
}

fn certificate<const N: usize>(
    robot: &Robot,
    gains: &GainsSource,
    family: &FamilyValues,
    claim: ClaimName,
    context: Context,
) -> Result<Certificate, Error> {
    let table = gains.aic("certify")?;
    let gains = gains.aic_gains::<N>(table, STEP_S)?;
    let claims = match claim {
        ClaimName::Exponential => &[ClaimKind::Exponential][..],
        ClaimName::Region => &[ClaimKind::Region],
        ClaimName::All => &[ClaimKind::Exponential, ClaimKind::Region],
    };
    let progress = Terminal::new(context.verbose);
    progress.begin("sampling the arm's constants");
    let certifier = ArmCertifier::<N>::new(robot, family)?;
    let constants = &certifier.constants().constants;
    progress.detail(|| {
        format!(
            "          m_lo {:.4} kg m², m_hi {:.3} kg m², k_g {:.2} N m/rad, k_c {:.3} kg m², k_r {:.2}",
            constants.m_lo_kg_m2, constants.m_hi_kg_m2, constants.k_g_n_m_per_rad, constants.k_c_kg_m2, constants.k_r
        )
    });
    progress.begin("searching for proofs");
    let certificate = certifier.certify(&gains, claims);
    progress.finish();
    Ok(certificate?)
}
