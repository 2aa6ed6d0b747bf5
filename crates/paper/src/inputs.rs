//! What a comparison is given: arms, gains, scenarios and search spaces as data.

use certune_closed_loop::{Gains, LawName, PerJoint, Scenario};
use certune_dynamics::{Link, Robot};
use certune_tune::SpaceFile;

use crate::error::CompareError;
use crate::record::{Contender, Question};
use crate::runs::JOINTS;

/// Arms, gains, scenarios and search spaces.
#[derive(Clone, Debug)]
pub struct Inputs {
    /// The identified arm with its hand.
    pub robot: Robot,
    /// The approximated model of the same arm.
    pub approximated: Robot,
    /// Published gains.
    pub published: Published,
    /// Gains that are compared as tuned ones; searched where there are none.
    pub tuned_aic: Option<Gains>,
    /// The same for MRAC.
    pub tuned_mrac: Option<Gains>,
    /// Scenarios.
    pub scenarios: Scenarios,
    /// Search spaces.
    pub spaces: Spaces,
    /// How much of everything.
    pub size: Size,
}

/// Published gains.
#[derive(Clone, Debug)]
pub struct Published {
    /// AIC in the simulation.
    pub aic_simulation: Gains,
    /// AIC on the robot.
    pub aic_robot: Gains,
    /// MRAC in the simulation.
    pub mrac_simulation: Gains,
    /// MRAC on the robot.
    pub mrac_robot: Gains,
}

/// Scenarios; plant boxes and noise are those of the experiments, not the files'.
#[derive(Clone, Debug)]
pub struct Scenarios {
    /// Five goals: A B C B A.
    pub pick_and_place: Scenario,
    /// Via-points: right, grab, centre, release, and two bottles.
    pub payloads: Scenario,
    /// At rest, pushed; the first push counts.
    pub push: Scenario,
    /// Whose noise is the sensors' where they have some.
    pub noise: Scenario,
}

/// Search spaces.
#[derive(Clone, Debug)]
pub struct Spaces {
    /// Of the AIC.
    pub aic: SpaceFile,
    /// Of MRAC, the reference model free.
    pub mrac: SpaceFile,
}

/// How much of everything; the default is what the statements are judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Seed of arms, noise and searches.
    pub seed: u64,
    /// Arms of an experiment.
    pub arms: usize,
    /// Arms of a cell of the grid; without any there is no grid.
    pub grid_arms: usize,
    /// Candidates of a search.
    pub candidates: usize,
    /// Plants that a candidate meets.
    pub search_plants: usize,
    /// Repetitions of a measurement of time.
    pub time_batches: usize,
}

impl Default for Size {
    fn default() -> Self {
        Self { seed: 1, arms: 200, grid_arms: 8, candidates: 160, search_plants: 8, time_batches: 21 }
    }
}

/// Relative uncertainty of every link's mass, as the paper has it.
pub(crate) const MASS_UNCERTAINTY: f64 = 0.2;
/// The torque rate at which the Panda stops, N m/s.
pub(crate) const TORQUE_RATE_N_M_PER_S: f64 = 1000.0;
/// Rotor inertia of the approximated model, and of the robot in the experiments, kg m².
pub(crate) const ROTOR_KG_M2: f64 = 0.1;
/// Viscous friction of the robot in the experiments, N m s/rad.
pub(crate) const FRICTION_N_M_S_PER_RAD: f64 = 1.0;
/// Frames this close are the same: descriptions round, m and 1.
const SAME_FRAME: f64 = 1e-6;
/// The limit on every joint's torque in the paper, N m.
const PAPER_LIMIT_N_M: f64 = 85.0;

/// Names of those compared.
pub mod names {
    /// AIC with the gains of the simulation.
    pub const AIC: &str = "aic-published";
    /// AIC with the gains of the robot.
    pub const AIC_ROBOT: &str = "aic-robot";
    /// AIC, tuned.
    pub const AIC_TUNED: &str = "aic-tuned";
    /// MRAC with the gains of the simulation, as the released code has it.
    pub const MRAC: &str = "mrac-code";
    /// The same gains under the paper's equations, with a reference model.
    pub const MRAC_MODEL: &str = "mrac-reference-model";
    /// The same gains under the paper's equations, the goal being the reference.
    pub const MRAC_GOAL: &str = "mrac-raw-goal";
    /// The same with the integral gains that the released code has in effect.
    pub const MRAC_GOAL_SCALED: &str = "mrac-raw-goal-scaled";
    /// MRAC with the gains of the robot, as the released code has it.
    pub const MRAC_ROBOT: &str = "mrac-robot";
    /// MRAC, tuned, its reference as fast as the AIC's.
    pub const MRAC_MATCHED: &str = "mrac-tuned-matched";
    /// MRAC, tuned, its reference free.
    pub const MRAC_FREE: &str = "mrac-tuned-free";
}

impl Inputs {
    /// Checks what the experiments rest on, as [`compare`](crate::compare) does before it begins.
    ///
    /// # Errors
    /// [`CompareError`] for an arm that is not the Panda, gains of the other controller, and scenarios without what their experiments need.
    pub fn check(&self) -> Result<(), CompareError> {
        for robot in [&self.robot, &self.approximated] {
            if robot.joints() != JOINTS {
                return Err(CompareError::Joints { robot: robot.name().to_owned(), joints: robot.joints() });
            }
        }
        let pairs = self.robot.links().iter().zip(self.approximated.links());
        for (link, panda) in pairs {
            let apart = (link.frame.position() - panda.frame.position()).amax();
            let turned = (link.frame.rotation_matrix() - panda.frame.rotation_matrix()).amax();
            if !(apart <= SAME_FRAME && turned <= SAME_FRAME) {
                return Err(CompareError::Geometry { robot: self.robot.name().to_owned(), link: link.name.clone() });
            }
        }
        if self.size.arms == 0 {
            return Err(CompareError::NoArms);
        }
        let enough = |scenario: &Scenario, what, found: usize, expected| {
            let scenario = || scenario.name.clone();
            if found >= expected {
                Ok(())
            } else {
                Err(CompareError::Scenario { scenario: scenario(), what, found, expected })
            }
        };
        let Scenarios { pick_and_place, payloads, push, .. } = &self.scenarios;
        enough(pick_and_place, "goals", pick_and_place.segments.len(), 3)?;
        enough(payloads, "goals", payloads.segments.len(), 4)?;
        enough(payloads, "payloads", payloads.payloads.len(), 2)?;
        enough(push, "goals", push.segments.len(), 1)?;
        enough(push, "pushes", push.pushes.len(), 1)?;
        let kinds = [
            (names::AIC, "aic", Some(&self.published.aic_simulation)),
            (names::AIC_ROBOT, "aic", Some(&self.published.aic_robot)),
            (names::AIC_TUNED, "aic", self.tuned_aic.as_ref()),
            (names::MRAC, "mrac", Some(&self.published.mrac_simulation)),
            (names::MRAC_ROBOT, "mrac", Some(&self.published.mrac_robot)),
            (names::MRAC_MATCHED, "mrac", self.tuned_mrac.as_ref()),
        ];
        for (contender, expected, gains) in kinds {
            if let Some(found) = gains.map(Gains::controller).filter(|found| *found != expected) {
                return Err(CompareError::Controller { contender, found, expected });
            }
        }
        Ok(())
    }

    /// The question as the record keeps it.
    pub(crate) fn question(&self) -> Question {
        Question {
            robot: self.robot.name().to_owned(),
            robot_sha256: self.robot.sha256(),
            seed: self.size.seed,
            arms: self.size.arms,
            grid_arms: self.size.grid_arms,
            candidates: self.size.candidates,
            search_plants: self.size.search_plants,
            mass_uncertainty: MASS_UNCERTAINTY,
            torque_rate_limit_n_m_per_s: TORQUE_RATE_N_M_PER_S,
        }
    }

    /// Those with published gains.
    pub(crate) fn published(&self) -> Vec<Contender> {
        let Published { aic_simulation, aic_robot, mrac_simulation, mrac_robot } = &self.published;
        let step_s = self.scenarios.pick_and_place.step_s;
        let contender =
            |name: &str, title: &str, gains: Gains| Contender { name: name.to_owned(), title: title.to_owned(), gains };
        vec![
            contender(names::AIC, "AIC, published gains of the simulation", aic_simulation.clone()),
            contender(names::AIC_ROBOT, "AIC, published gains of the robot", aic_robot.clone()),
            contender(
                names::MRAC,
                "MRAC as released, published gains of the simulation",
                with_law(mrac_simulation, LawName::ReleasedCode),
            ),
            contender(
                names::MRAC_MODEL,
                "MRAC as in the equations with a reference model, the same gains",
                with_law(mrac_simulation, LawName::ReferenceModel),
            ),
            contender(
                names::MRAC_GOAL,
                "MRAC as in the equations, the goal as reference, the same gains",
                with_law(mrac_simulation, LawName::RawGoal),
            ),
            contender(
                names::MRAC_GOAL_SCALED,
                "MRAC as in the equations, the goal as reference, its integral gains times the samples per second as in the released code",
                integrals_times(with_law(mrac_simulation, LawName::RawGoal), step_s.recip()),
            ),
            contender(
                names::MRAC_ROBOT,
                "MRAC as released, published gains of the robot",
                with_law(mrac_robot, LawName::ReleasedCode),
            ),
        ]
    }

    /// The approximated model with the paper's torque limit on every joint.
    pub(crate) fn paper_limited(&self) -> Result<Robot, CompareError> {
        let limited = |link: &Link| {
            let mut link = link.clone();
            link.limits.torque_n_m = PAPER_LIMIT_N_M;
            link
        };
        let robot = &self.approximated;
        let links = robot.links().iter().map(limited).collect();
        Ok(Robot::new(robot.name(), robot.gravity_m_per_s2(), links)?.with_flange(robot.flange())?)
    }
}

/// The same gains under another law.
fn with_law(gains: &Gains, law: LawName) -> Gains {
    match gains {
        Gains::Mrac(table) => {
            let mut table = table.clone();
            table.law = law;
            Gains::Mrac(table)
        }
        Gains::Aic(_) => gains.clone(),
    }
}

/// The gains of the integrals of outer products times `factor`.
fn integrals_times(gains: Gains, factor: f64) -> Gains {
    ["e02", "e12", "f02", "f12"].into_iter().fold(gains, |gains, row| {
        let scaled = gains.row(row).map(|numbers| match numbers {
            PerJoint::Shared(value) => PerJoint::Shared(value * factor),
            PerJoint::Each(values) => PerJoint::Each(values.iter().map(|value| value * factor).collect()),
        });
        match scaled {
            Some(scaled) => gains.with(row, scaled),
            None => gains,
        }
    })
}
