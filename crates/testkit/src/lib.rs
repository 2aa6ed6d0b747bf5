//! Proptest strategies for arms, masses, states and gains, and tolerances that scale with them: what a test of one's own robot or
//! controller needs.
//!
//! | strategy | draws | simplest value |
//! |----------|-------|----------------|
//! | [`link_scales`] | factors on the links' masses | 1 |
//! | [`payload`] | a box in the hand | an empty hand |
//! | [`plant_numbers`] | all that distinguishes one arm of a family from another | the nominal arm |
//! | [`panda_with_masses`] | the Panda with other masses and a payload | the Panda as described |
//! | [`serial_arm`] | any valid arm of `N` revolute joints | equal cubes on one axis |
//! | [`configuration`], [`configuration_within`] | joint positions, anywhere or inside an arm's limits | 0, or what is nearest to it |
//! | [`joint_state`] | positions and velocities | at rest in 0 |
//! | [`joints_within`] | accelerations, torques | 0 |
//! | [`aic_gains`], [`shared_aic_gains`] | gains of the active inference controller | the published gains |
//!
//! Every number comes from [`within`] or [`log_within`]: the ends of a range are drawn themselves, since that is where
//! arms and controllers fail first, and a failure shrinks towards the simplest value, so that the arm reported is as
//! ordinary as a failing arm can be. All chance is proptest's: a failure replays from its seed.
//!
//! # A test for one's own gains
//!
//! My gains reach the goal on every arm whose links weigh within 20 % of what the maker says:
//!
//! ```
//! use certune_closed_loop::{NoiseStream, Plant, PlantBox, PlantSetting, Scenario, simulate};
//! use certune_control::aic::{Aic, AicGains, AicParams};
//! use certune_dynamics::Robot;
//! use certune_testkit::{PlantRanges, plant_numbers};
//! use proptest::prelude::*;
//!
//! const MINE: AicGains<1> = AicGains {
//!     kappa_mu: [11.67],
//!     kappa_a: [700.0],
//!     sigma_q: [1.0],
//!     sigma_dq: [1.0],
//!     sigma_mu: [5.0],
//!     sigma_dmu: [10.0],
//!     reference_time_constant_s: [1.0],
//! };
//!
//! proptest! {
//!     #![proptest_config(ProptestConfig::with_cases(8))] // 256, in a test that runs optimised
//!     // #[test], in a test file
//!     fn my_gains_reach_the_goal(arm in plant_numbers::<7>(&PlantRanges::masses_within(0.2))) {
//!         let robot = Robot::panda();
//!         let setting = PlantSetting {
//!             link_mass_scale: arm.link_mass_scale.to_vec(),
//!             ..PlantSetting::nominal(&robot, true)
//!         };
//!         let plant = Plant::<7>::new(&robot, &setting)?;
//!         let mut scenario = Scenario::generic(&robot, PlantBox::nominal(true));
//!         scenario.segments.truncate(1);
//!         let aic = Aic::new(&AicParams::new(&MINE.on_every_joint::<7>(), scenario.step_s)?);
//!         let metrics = simulate(&plant, &scenario.bind(&robot)?, &aic, NoiseStream::default(), &mut ());
//!         prop_assert_eq!(metrics.diverged_at_s, None);
//!         prop_assert!(metrics.worst_final_error_rad() < 10e-3);
//!     }
//! }
//! my_gains_reach_the_goal();
//! ```
//!
//! Limits: revolute joints on a fixed base, as everywhere in this workspace. A strategy panics when it is made from a
//! range that is none (empty, NaN, a scale below 0): such a test is wrong, whatever it tests.
#![forbid(unsafe_code)]

mod arm;
mod draw;
mod gains;
mod joints;
mod plant;
pub mod tolerance;

pub use arm::{payload, serial_arm};
pub use draw::{log_within, within};
pub use gains::{AicRanges, PUBLISHED, aic_gains, shared_aic_gains};
pub use joints::{FASTEST_RAD_PER_S, configuration, configuration_within, joint_state, joints_within};
pub use plant::{PANDA_PAYLOAD_KG, PlantNumbers, PlantRanges, link_scales, panda_with_masses, plant_numbers};
