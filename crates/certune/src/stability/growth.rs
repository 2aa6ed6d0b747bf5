//! What a refusal looks like in time: the nonlinear loop, let go close to its equilibrium at the arm and configuration that the refusal names.
//!
//! The goal is the refusal's configuration; the arm starts at rest beside it, along the joint part of the unstable eigenvector, with the controller at
//! its equilibrium. In continuous time the controller runs at [`STEP_S`] tenfold refined, so that what grows is not the sampling's doing; a refusal of
//! the sampled loop is simulated with its own period and delay. Measured in floating point: an
//! illustration, not evidence.

use std::f64::consts::TAU;

use certune_closed_loop::scenario::{Integrator, Method, Noise};
use certune_closed_loop::simulate::MAX_DELAY_SAMPLES;
use certune_closed_loop::task::TaskSegment;
use certune_closed_loop::{NoiseStream, Plant, PlantSetting, Progress, Simulation, Task};
use certune_control::aic::{Aic, AicGains, AicState};
use certune_dynamics::{Robot, State, gravity_torque};
use certune_linsys::Joints;
use certune_verify::{AicGains as WrittenGains, Document, Number, RefusedClaim};

use super::counterexample::Time;
use super::{STEP_S, StabilityError};

/// Length of the run, s.
const RUN_S: f64 = 2.0;
/// Deviation at its start, 2-norm over the joints, rad.
const START_RAD: f64 = 1e-3;
/// Steps of the controller per step of the published one.
const REFINEMENT: f64 = 10.0;

/// How a small deviation has grown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Length of the run, s; shorter than 2 s when the arm ran away before.
    pub after_s: f64,
    /// Deviation from the goal at the start, 2-norm over the joints, rad.
    pub from_rad: f64,
    /// Largest deviation over the last period of the unstable mode, rad.
    pub to_rad: f64,
}

/// The run of a refusal that names an arm and configuration; `None` for one that names none, or for another controller than the AIC.
///
/// # Errors
/// When the document is not about an arm of `N` joints or not about this robot.
pub fn growth<const N: usize>(
    robot: &Robot,
    document: &Document,
    refused: &RefusedClaim,
) -> Result<Option<Growth>, StabilityError> {
    let (Some(attained), Some(gains)) = (&refused.attained, document.gains.aic().ok().and_then(read::<N>)) else {
        return Ok(None);
    };
    let compensated = document.family.gravity_compensation;
    let values = |numbers: &[Number]| numbers.iter().map(Number::to_f64).collect::<Vec<_>>();
    let Some(goal) = joints::<N>(&values(&attained.q_rad)) else { return Ok(None) };
    let setting = PlantSetting {
        link_mass_scale: values(&attained.link_mass_scale),
        ..PlantSetting::nominal(robot, compensated)
            .with_payload(attained.payload_kg.to_f64())
            .with_friction(attained.friction_n_m_s_per_rad.to_f64())
            .with_rotor_inertia(attained.rotor_inertia_kg_m2.to_f64())
    };
    let Some(time) = Time::new(&gains, refused.sampling.as_ref(), STEP_S / REFINEMENT)? else { return Ok(None) };
    let delay_samples = time.delay_samples.unwrap_or(0);
    if delay_samples > MAX_DELAY_SAMPLES {
        return Ok(None);
    }
    let setting = PlantSetting { coulomb_n_m: vec![0.0; N], delay_samples, ..setting };
    let plant = Plant::<N>::new(robot, &setting)?;
    let step_s = time.params.step_s();
    let mode = time.worst_mode(plant.model(), &goal, compensated)?;
    let Some(vector) = mode.vector() else { return Ok(None) };
    let Some(direction) = Joints::<N>::from_fn(|joint, _| vector[joint].re).try_normalize(0.0) else { return Ok(None) };

    let steps = (RUN_S / step_s).round() as u64;
    let task = Task {
        step_s,
        start: goal + direction * START_RAD,
        segments: vec![TaskSegment { goal, steps }],
        torque_limits: false,
        torque_rate_limit_n_m_per_s: None,
        goal_limiter: None,
        // A sampled refusal is about the semi-implicit step.
        integrator: Integrator {
            method: if time.delay_samples.is_some() { Method::SemiImplicitEuler } else { Method::RungeKutta4 },
            substeps: 1,
        },
        noise: Noise::default(),
        payloads: Vec::new(),
        pushes: Vec::new(),
    };
    let controller = Aic::new(&time.params);
    let mut run = Simulation::new(&plant, &task, &controller, NoiseStream::default());
    let held = if compensated { Joints::zeros() } else { gravity_torque(plant.model(), &goal) };
    run.set_controller_state(AicState { mu: task.start, dmu: Joints::zeros(), ddmu: Joints::zeros(), u: held });
    let deviation = |state: &State<N>| (state.q - goal).norm();
    let mut course = vec![deviation(run.state())];
    let after_s = loop {
        match run.advance(&mut ()) {
            Progress::Running => course.push(deviation(run.state())),
            Progress::Finished => break RUN_S,
            Progress::Diverged(at_s) => break at_s,
        }
    };
    // An oscillation passes through zero: look back over one period of it, at most half of the run.
    let period_s = if mode.per_s.im.abs() > 0.0 { TAU / mode.per_s.im.abs() } else { 0.0 };
    let back = ((period_s / step_s).ceil() as usize).clamp(1, course.len().div_ceil(2));
    let to_rad = course.iter().rev().take(back).copied().fold(0.0, f64::max);
    Ok(Some(Growth { after_s, from_rad: START_RAD, to_rad }))
}

fn joints<const N: usize>(values: &[f64]) -> Option<Joints<N>> {
    <[f64; N]>::try_from(values).ok().map(Joints::from)
}

fn read<const N: usize>(written: &WrittenGains) -> Option<AicGains<N>> {
    let list = |numbers: &[Number]| <[f64; N]>::try_from(numbers.iter().map(Number::to_f64).collect::<Vec<_>>()).ok();
    Some(AicGains {
        kappa_mu: list(&written.kappa_mu)?,
        kappa_a: list(&written.kappa_a)?,
        sigma_q: list(&written.sigma_q)?,
        sigma_dq: list(&written.sigma_dq)?,
        sigma_mu: list(&written.sigma_mu)?,
        sigma_dmu: list(&written.sigma_dmu)?,
        reference_time_constant_s: list(&written.reference_time_constant_s)?,
    })
}
