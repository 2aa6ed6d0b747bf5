//! `autotune certify`: claims about given gains on a family of plants.

use certune::certify::GoalListValues;
use certune::closed_loop::{Gains, LawName, PlantBox, Scenario};
use certune::dynamics::{Link, Robot};
use certune::verify::{ConfigurationSet, Evidence, Record};
use certune::{Answer, ArmCertifier, ArmGains, Growth, Over, Request, family_of};
use serde::Serialize;

use super::claims::{AssumptionSummary, ClaimSummary, claims_in_words, growths, summaries};
use super::verify::exit_of;
use crate::catalogue::{self, GainsSource};
use crate::certificate;
use crate::cli::{ArmsArgs, CertifyArgs, Context, Exit, OverName, Switch};
use crate::error::Error;
use crate::output;
use crate::progress::Terminal;
use crate::sizes::for_joint_count;
use crate::values::Numbers;

/// The controller's step, s: that of the sampled claims and of the check of the gains.
const STEP_S: f64 = 1e-3;

/// Room around a scenario's poses in the box of `--over scenario`, rad.
const ROOM_RAD: f64 = 0.3;

#[derive(Debug, Serialize)]
struct Summary {
    robot: String,
    gains: String,
    family: PlantBox,
    /// Arm, gains, family, scope and constants in words: what every statement is about.
    about: String,
    claims: Vec<ClaimSummary>,
    assumptions: Vec<AssumptionSummary>,
    /// Hash of the record whose proved constants the claims rest on; none when the constants were sampled.
    constants_sha256: Option<String>,
    sha256: String,
    /// Where the certificate was written to.
    file: Option<String>,
}

pub fn run(args: &CertifyArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let gains = GainsSource::find(&args.gains)?;
    let records = catalogue::records(&args.constants)?;
    let (plant_box, beyond) = match &args.scenario {
        Some(given) => {
            let scenario = catalogue::scenario(Some(given), &robot)?;
            (scenario.plant_box.clone(), super::tune::beyond_the_claims(&scenario))
        }
        None => (plant_box(args, &robot), None),
    };
    let over = over(args.over, args.scenario.as_deref(), &robot)?;
    let (answer, growth) = for_joint_count!(robot.joints(), N => {
        answer::<N>(args, &robot, &gains, &plant_box, (&records, &over), context)
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    if let Some(path) = &args.out {
        certificate::write(path, &answer)?;
    }
    let certificate = &answer.certificate;
    if context.json {
        output::print_json(&Summary {
            robot: robot.name().to_owned(),
            gains: args.gains.clone(),
            family: plant_box,
            about: certificate.document().about.clone(),
            claims: summaries(certificate, &growth),
            assumptions: certificate.assumptions().into_iter().map(Into::into).collect(),
            constants_sha256: match &certificate.document().constants.evidence {
                Evidence::Proved { record_sha256 } => Some(record_sha256.clone()),
                Evidence::Sampled { .. } => None,
            },
            sha256: certificate.document().sha256.clone(),
            file: args.out.as_ref().map(|path| path.display().to_string()),
        })?;
    } else {
        let mut text = claims_in_words(certificate, &growth, context.verbose);
        let narrower = args.over.is_some_and(|over| over != OverName::Torus);
        if narrower && certificate.document().constants.over == ConfigurationSet::AllAngles {
            let note = "Note: no record of proved constants is at hand for those configurations alone; the claims are about all angles.";
            text.push_str(&output::wrapped(note, 0));
        }
        if let Some(note) = released_code(&gains) {
            text.push_str(&output::wrapped(note, 0));
        }
        if let Some(note) = beyond {
            text.push_str(&output::wrapped(&note, 0));
        }
        if let Some(path) = &args.out {
            text.push_str(&format!("written to {}; check it with `autotune verify {0}`\n", path.display()));
        }
        output::print(&text)?;
    }
    Ok(exit_of(certificate))
}

/// Least and largest value of the robot's own links.
fn own(robot: &Robot, value: fn(&Link) -> f64) -> [f64; 2] {
    let values = || robot.links().iter().map(value);
    [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
}

impl ArmsArgs {
    pub fn payload_kg(&self) -> [f64; 2] {
        [0.0, self.payload.unwrap_or(0.0)]
    }

    pub fn mass_uncertainty(&self) -> f64 {
        self.mass_uncertainty.unwrap_or(0.0)
    }

    pub fn rotor_inertia_kg_m2(&self, robot: &Robot) -> [f64; 2] {
        self.rotor_inertia.map_or_else(|| own(robot, |link| link.rotor_inertia_kg_m2), |interval| interval.0)
    }
}

/// The plants that the options speak of.
fn plant_box(args: &CertifyArgs, robot: &Robot) -> PlantBox {
    PlantBox {
        mass_uncertainty: args.arms.mass_uncertainty(),
        payload_kg: args.arms.payload_kg(),
        friction_n_m_s_per_rad: args
            .friction
            .map_or_else(|| own(robot, |link| link.viscous_n_m_s_per_rad), |interval| interval.0),
        rotor_inertia_kg_m2: args.arms.rotor_inertia_kg_m2(robot),
        delay_samples: [0; 2],
        gravity_compensation: args.gravity_compensation == Some(Switch::On),
    }
}

/// What else could be asked about gains whose law no claim covers.
fn released_code(gains: &GainsSource) -> Option<&'static str> {
    match &gains.gains.gains {
        Gains::Mrac(table) if table.law == LawName::ReleasedCode => Some(
            "Note: the same gains under the paper's equations are another controller, which claims do cover: a gains file with law = \
             \"reference-model\" or \"raw-goal\".",
        ),
        Gains::Mrac(_) | Gains::Aic(_) => None,
    }
}

/// The configuration of claims about one.
fn at<const N: usize>(args: &CertifyArgs, robot: &Robot) -> Result<Vec<f64>, Error> {
    match &args.at {
        Some(Numbers(found)) if found.len() != N => {
            Err(Error::ListLength { flag: "--at", found: found.len(), robot: robot.name().to_owned(), joints: N })
        }
        Some(Numbers(at)) => Ok(at.clone()),
        None => {
            let scenario = catalogue::scenario(args.scenario.as_deref(), robot)?;
            Ok(scenario.segments.first().map_or(scenario.start_rad, |segment| segment.goal_rad.clone()))
        }
    }
}

/// The goals of a scenario, one after the other.
fn goals(scenario: Scenario) -> GoalListValues {
    let goals = scenario.segments.into_iter().map(|segment| (segment.goal_rad, segment.duration_s)).collect();
    GoalListValues { start_rad: scenario.start_rad, goals }
}

/// The configurations that `--over` speaks of.
pub fn over(name: Option<OverName>, scenario: Option<&str>, robot: &Robot) -> Result<Over, Error> {
    Ok(match name {
        None | Some(OverName::Torus) => Over::AllAngles,
        Some(OverName::Range) => Over::JointRange,
        Some(OverName::Scenario) => around(&catalogue::scenario(scenario, robot)?, robot),
    })
}

/// The smallest box that holds the scenario's start and goals, wider by [`ROOM_RAD`] on every side but not beyond the joints' end stops.
fn around(scenario: &Scenario, robot: &Robot) -> Over {
    let poses = || scenario.segments.iter().map(|segment| &segment.goal_rad).chain([&scenario.start_rad]);
    let ends = |joint: usize| {
        let angles = || poses().map(move |pose| pose[joint]);
        let limits = robot.links()[joint].limits;
        let lower = (angles().fold(f64::INFINITY, f64::min) - ROOM_RAD).max(limits.lower_rad);
        let upper = (angles().fold(f64::NEG_INFINITY, f64::max) + ROOM_RAD).min(limits.upper_rad);
        (lower, upper)
    };
    let (lower_rad, upper_rad) = (0..robot.joints()).map(ends).unzip();
    Over::Box { lower_rad, upper_rad }
}

/// The answer, and the growth that each of its claims speaks of.
fn answer<const N: usize>(
    args: &CertifyArgs,
    robot: &Robot,
    source: &GainsSource,
    plant_box: &PlantBox,
    (records, over): (&[Record], &Over),
    context: Context,
) -> Result<(Answer, Vec<Option<Growth>>), Error> {
    let gains: ArmGains<N> = match &source.gains.gains {
        Gains::Aic(table) => source.aic_gains::<N>(table, STEP_S)?.into(),
        Gains::Mrac(table) => (*source.mrac_params::<N>(table, STEP_S)?.gains()).into(),
    };
    let mut request = Request {
        claims: args.claims.clone(),
        delay_samples: args.delay,
        torque_limits: args.torque_limits.unwrap_or_default(),
        at_rad: Some(at::<N>(args, robot)?),
        goals: args
            .scenario
            .is_some()
            .then(|| catalogue::scenario(args.scenario.as_deref(), robot))
            .transpose()?
            .map(goals),
        ..Request::default()
    };
    request.effort.proofs.sampled_region.delay_samples = 0;
    let progress = Terminal::new(context.verbose);
    let certifier = ArmCertifier::<N>::new(robot, &family_of(plant_box)?)?.with_records(records, over)?;
    match certifier.record() {
        Some(record) => progress.detail(|| format!("          proved constants: record {}", record.sha256)),
        None => {
            progress.begin("sampling the arm's constants");
            let constants = certifier.constants().constants;
            progress.detail(|| {
                format!(
                    "          m_lo {:.4} kg m², m_hi {:.3} kg m², k_g {:.2} N m/rad, k_c {:.3} kg m², k_r {:.2}",
                    constants.m_lo_kg_m2,
                    constants.m_hi_kg_m2,
                    constants.k_g_n_m_per_rad,
                    constants.k_c_kg_m2,
                    constants.k_r
                )
            });
        }
    }
    progress.begin("searching for proofs");
    let answer = certifier.answer(&gains, &request).map_err(Error::from).and_then(|answer| {
        let growth = growths::<N>(robot, &answer.certificate)?;
        Ok((answer, growth))
    });
    progress.finish();
    answer
}
