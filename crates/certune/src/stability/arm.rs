//! An arm with a family of plants and the constants that bound it.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use certune_bounds::{
    ArmBox, BoundsError, Enclosure, Ranges, SampledConstants, SamplingOptions, enclosure, sampled_constants,
};
use certune_certify::{ArmValues, ConstantValues, FamilyValues, GoalListValues, Options, Problem, arm_ranges, certify};
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::{Model, Payload, Robot};
use certune_verify::{Arm, Certificate, ClaimKind, Gains, LoopTiming, Number, Record};

use crate::adaptive::AdaptiveSetting;

use super::constants::{Over, best_record, sampled_diagonals, sampled_values};
use super::gains::ArmGains;
use super::request::{Answer, Effort, Request, TorqueLimits, claims_for};
use super::{STEP_S, StabilityError, checked};

/// An arm with a family of plants, ready to certify any number of gains.
///
/// Its constants are those of a proved record that covers the family, when one was given; otherwise they are sampled, once, when they are first
/// needed.
#[derive(Clone, Debug)]
pub struct ArmCertifier<const N: usize> {
    robot: Robot,
    arm: ArmValues,
    pub(super) family: FamilyValues,
    pub(super) members: ArmBox<N>,
    record: Option<Record>,
    sampled: OnceLock<SampledConstants>,
    diagonals: OnceLock<Option<[Vec<f64>; 2]>>,
    /// Enclosures of M that were asked for, each with its halvings: they do not depend on the gains.
    enclosures: Arc<Mutex<Vec<(u32, Enclosure<N>)>>>,
}

impl<const N: usize> ArmCertifier<N> {
    /// The family's arms, with sampled constants over all angles.
    ///
    /// # Errors
    /// When the robot has not `N` joints or a range of the family is not valid.
    pub fn new(robot: &Robot, family: &FamilyValues) -> Result<Self, StabilityError> {
        let ranges = Ranges {
            mass_uncertainty: family.mass_uncertainty,
            payload_kg: family.payload_kg,
            payload_com_m: Payload::at_grasp(robot, 1.0)?.com_m,
            rotor_inertia_kg_m2: family.rotor_inertia_kg_m2,
        };
        let [least, largest] = family.friction_n_m_s_per_rad;
        if !(least >= 0.0 && least <= largest && largest.is_finite()) {
            return Err(BoundsError::Axis { axis: 0, lower: least, upper: largest }.into());
        }
        let members = ArmBox::new(&Model::<N>::new(robot)?, &ranges)?;
        let arm = ArmValues {
            name: robot.name().to_owned(),
            joints: N,
            sha256: robot.sha256(),
            payload_com_m: ranges.payload_com_m,
        };
        Ok(Self {
            robot: robot.clone(),
            arm,
            family: family.clone(),
            members,
            record: None,
            sampled: OnceLock::new(),
            diagonals: OnceLock::new(),
            enclosures: Arc::default(),
        })
    }

    /// The same arms with the constants of the best of the records that covers them over the set, if one does.
    ///
    /// # Errors
    /// [`StabilityError::Problem`] when a number of the family cannot be written.
    pub fn with_records(self, records: &[Record], over: &Over) -> Result<Self, StabilityError> {
        let arm = Arm { name: self.arm.name.clone(), joints: N, sha256: self.arm.sha256.clone() };
        let ranges = arm_ranges(&self.arm, &self.family)?;
        let record = best_record(records, &arm, &ranges, &over.written(&self.robot)).cloned();
        Ok(Self { record, ..self })
    }

    /// The record whose proved constants the claims rest on; `None` when they rest on sampled ones.
    pub fn record(&self) -> Option<&Record> {
        self.record.as_ref()
    }

    /// The sampled constants, with the configurations that attain them. The first call takes a second or two.
    pub fn constants(&self) -> &SampledConstants {
        self.sampled.get_or_init(|| sampled_constants(&self.members, &SamplingOptions::default()))
    }

    /// The family of plants.
    pub fn family(&self) -> &FamilyValues {
        &self.family
    }

    /// The box of arms.
    pub(crate) fn members(&self) -> &ArmBox<N> {
        &self.members
    }

    /// M and the Coriolis form over a box of configurations, found once.
    pub(crate) fn enclosed(
        &self,
        lower_rad: &[f64; N],
        upper_rad: &[f64; N],
        halvings: u32,
    ) -> Result<Enclosure<N>, BoundsError> {
        let known = || self.enclosures.lock().unwrap_or_else(PoisonError::into_inner);
        // To the bit: the box is the same one.
        let equal = |a: &[f64; N], b: &[f64; N]| a.map(f64::to_bits) == b.map(f64::to_bits);
        let same = |(of, found): &&(u32, Enclosure<N>)| {
            *of == halvings && equal(&found.lower_rad, lower_rad) && equal(&found.upper_rad, upper_rad)
        };
        if let Some((_, found)) = known().iter().find(same) {
            return Ok(found.clone());
        }
        let found = enclosure(&self.members, lower_rad, upper_rad, halvings)?;
        known().push((halvings, found.clone()));
        Ok(found)
    }

    /// The problem of these gains, without claims.
    pub(crate) fn problem(&self, gains: Gains) -> Result<Problem, StabilityError> {
        let constants = match &self.record {
            Some(record) => ConstantValues::Proved(Box::new(record.clone())),
            None => sampled_values(self.constants(), self.diagonals(&gains)),
        };
        Ok(Problem::new(&self.arm, gains, &self.family, &constants)?)
    }

    /// Sampled diagonals, for gains that differ between joints: no other claim looks at them.
    fn diagonals(&self, gains: &Gains) -> Option<[Vec<f64>; 2]> {
        let wanted = gains.aic().is_ok_and(|gains| gains.shared_by_all().is_err());
        let found = || sampled_diagonals(&self.members, self.constants());
        if wanted { self.diagonals.get_or_init(found).clone() } else { None }
    }

    /// Makes the claims about an AIC and has them checked. Whether they hold is for the certificate to say.
    ///
    /// # Errors
    /// When the gains are not valid; [`StabilityError::Certify`] would be a defect of this workspace.
    pub fn certify(&self, gains: &AicGains<N>, claims: &[ClaimKind]) -> Result<Certificate, StabilityError> {
        self.certify_with(gains, claims, &Effort::default())
    }

    /// As [`ArmCertifier::certify`], with an effort of one's own.
    ///
    /// # Errors
    /// As [`ArmCertifier::certify`].
    pub fn certify_with(
        &self,
        gains: &AicGains<N>,
        claims: &[ClaimKind],
        effort: &Effort,
    ) -> Result<Certificate, StabilityError> {
        let request = Request { claims: claims.to_vec(), effort: effort.clone(), ..Request::default() };
        Ok(self.answer(&(*gains).into(), &request)?.certificate)
    }

    /// Makes the claims that are asked for about a controller and has them checked.
    ///
    /// # Errors
    /// As [`ArmCertifier::certify`].
    pub fn answer(&self, gains: &ArmGains<N>, request: &Request) -> Result<Answer, StabilityError> {
        let goal = request.at_rad.as_deref().and_then(|at| <[f64; N]>::try_from(at).ok());
        let all = || {
            let needs_goal = |kind: &ClaimKind| *kind == ClaimKind::Lyapunov && goal.is_none();
            claims_for(gains).into_iter().filter(|kind| !needs_goal(kind)).collect()
        };
        let claims: Vec<ClaimKind> = if request.claims.is_empty() { all() } else { request.claims.clone() };
        let at_goal = || goal.ok_or(StabilityError::NoConfiguration { joints: N });
        match gains {
            ArmGains::Aic(aic) => {
                AicParams::new(aic, STEP_S)?;
                let problem = self.problem(gains.written()?)?;
                let options = self.options(request)?;
                let attain = |timing: Option<&LoopTiming>| {
                    self.unstable_member(aic, timing, &request.effort.counterexample).ok().flatten()
                };
                // A claim that knows the arm stands behind those that know only its constants.
                let (at_one, over_all): (Vec<_>, Vec<_>) =
                    claims.into_iter().partition(|kind| *kind == ClaimKind::Lyapunov);
                let document = match over_all.as_slice() {
                    [] => problem.document().clone(),
                    kinds => certify(&problem, kinds, &options, &attain)?.document().clone(),
                };
                let extra = at_one.iter().map(|_| self.lyapunov_at(aic, at_goal()?)).collect::<Result<_, _>>()?;
                let certificate = checked(document, extra, problem.records())?;
                Ok(Answer::new(certificate, problem.records()))
            }
            ArmGains::Mrac(mrac) => {
                let delay_samples = u32::try_from(request.delay_samples.unwrap_or(0)).unwrap_or(u32::MAX);
                let setting = AdaptiveSetting { delay_samples, ..AdaptiveSetting::around(at_goal()?) };
                self.answer_adaptive(mrac, &setting, &claims)
            }
        }
    }

    /// The search as the request wants it.
    fn options(&self, request: &Request) -> Result<Options, StabilityError> {
        let mut options = request.effort.proofs.clone();
        options.sampled.period_s = STEP_S;
        options.sampled_region.step_s = STEP_S;
        if let Some(samples) = request.delay_samples {
            options.sampled.delay_samples = samples;
            options.sampled_region.delay_samples = samples;
        }
        match request.torque_limits {
            TorqueLimits::None => {}
            TorqueLimits::Norm(limit) => {
                options.region.controller_torque_n_m = Some(limit);
                options.sampled_region.torque_limit_n_m = Some(limit);
            }
            TorqueLimits::LessGravity => {
                let limits = self.motor_limits_n_m()?;
                options.sampled_region.torque_limit_n_m = self.left_by_gravity(&limits);
                options.joint_region.motor_limits_n_m = Some(limits.clone());
                options.region.motor_limits_n_m = Some(limits);
            }
        }
        // A search over many sampled regions takes a minute or so: only for those who ask for it by name and with a delay.
        if request.delay_samples.is_some() && request.claims.contains(&ClaimKind::MovingGoal) {
            options.moving_goal.sampled_region = Some(options.sampled_region);
        }
        options.moving_goal.region = options.region.clone();
        options.moving_goal.joint_region = options.joint_region.clone();
        if request.goals.is_some() {
            options.moving_goal.list.clone_from(&request.goals);
        }
        options.joint_region.steps_rad = request.goals.as_ref().map(steps_rad).unwrap_or_default();
        Ok(options)
    }

    /// The motors' limits, every joint's.
    fn motor_limits_n_m(&self) -> Result<Vec<f64>, StabilityError> {
        let limits: Vec<f64> = self.robot.links().iter().map(|link| link.limits.torque_n_m).collect();
        match limits.iter().position(|limit| !limit.is_finite()) {
            Some(joint) => Err(StabilityError::NoTorqueLimit { joint: self.robot.links()[joint].joint_name.clone() }),
            None => Ok(limits),
        }
    }

    /// What gravity leaves to the controller at the weakest joint, N m; `None` when the constants say nothing about gravity.
    fn left_by_gravity(&self, limits_n_m: &[f64]) -> Option<f64> {
        let gravity: Vec<f64> = match &self.record {
            Some(record) => record.bounds.gravity_torque_n_m.as_ref()?.iter().map(Number::to_f64).collect(),
            None => self.constants().gravity_torque_n_m.clone(),
        };
        limits_n_m.iter().zip(gravity).map(|(limit, gravity)| limit - gravity).reduce(f64::min)
    }
}

/// From each goal of a list to the next.
fn steps_rad(list: &GoalListValues) -> Vec<Vec<f64>> {
    let goals = list.goals.iter().map(|(goal, _)| goal);
    let befores = std::iter::once(&list.start_rad).chain(goals.clone());
    goals
        .zip(befores)
        // As a person would write them: nine decimals.
        .map(|(goal, before)| {
            goal.iter().zip(before).map(|(goal, before)| ((goal - before) * 1e9).round() / 1e9).collect()
        })
        .collect()
}
