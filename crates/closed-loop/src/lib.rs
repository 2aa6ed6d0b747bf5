//! Plant, controller and task together: in time, and linearised.
//!
//! | module | what it holds |
//! |--------|---------------|
//! | [`file`](mod@file) | TOML read into types, with errors that carry line, key and what to do |
//! | [`gains`] | gains files, for any number of joints |
//! | [`scenario`] | scenario files |
//! | [`task`] | a scenario bound to an arm |
//! | [`plant_box`] | the family of plants a scenario declares, and seeded draws |
//! | [`simulate`](mod@simulate) | the loop at 1 kHz, without a heap |
//! | [`recorded`] | many runs side by side, each with its own recorder |
//! | [`safety`] | when the arm's own protection would have stopped a run |
//! | [`metrics`] | figures per goal and joint |
//! | [`drift`] | how far the adaptive gains drift from goal to goal |
//! | [`trajectory`] | a run kept for plots |
//! | [`parameters`] | what simulation and linearisation need of a controller |
//! | [`linear`] | plant and controller linearised, continuous and sampled |
//! | [`knowledge`] | the arm's model handed to a baseline controller |
//!
//! Controllers come from `certune-control` and never see the plant; arms come from `certune-dynamics` and know no controller. They
//! meet here and nowhere else.
//!
//! ```
//! use certune_closed_loop::{NoiseStream, Plant, PlantBox, Scenario, simulate};
//! use certune_control::aic::{Aic, AicGains, AicParams};
//! use certune_dynamics::Robot;
//!
//! let robot = Robot::panda();
//! let family = PlantBox { mass_uncertainty: 0.2, payload_kg: [0.0, 0.7], ..PlantBox::nominal(true) };
//! let scenario = Scenario::generic(&robot, family);
//! let plant = Plant::<7>::new(&robot, &scenario.plant_box.draw(robot.joints(), 1, 0))?;
//! let published = AicGains {
//!     kappa_mu: [11.67],
//!     kappa_a: [700.0],
//!     sigma_q: [1.0],
//!     sigma_dq: [1.0],
//!     sigma_mu: [5.0],
//!     sigma_dmu: [10.0],
//!     reference_time_constant_s: [1.0],
//! };
//! let aic = Aic::new(&AicParams::new(&published.on_every_joint::<7>(), scenario.step_s)?);
//! let metrics = simulate(&plant, &scenario.bind(&robot)?, &aic, NoiseStream::default(), &mut ());
//! assert!(metrics.diverged_at_s.is_none() && metrics.worst_final_error_rad() < 5e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod drift;
pub mod file;
pub mod gains;
pub mod knowledge;
pub mod linear;
pub mod metrics;
pub mod parameters;
pub mod plant_box;
pub mod recorded;
pub mod safety;
pub mod scenario;
pub mod simulate;
pub mod task;
pub mod trajectory;

pub use drift::{GainDrift, gain_drift};
pub use file::{FileError, KeyError, Location, Problem};
pub use gains::{AicTable, Gains, GainsFile, LawName, MracTable, PerJoint};
pub use knowledge::KnownModel;
pub use linear::{linearise_aic, linearise_aic_sampled, linearise_mrac, linearise_mrac_sampled};
pub use metrics::{Metrics, Segment};
pub use parameters::Parameters;
pub use plant_box::{PlantBox, PlantError, PlantSetting};
pub use recorded::simulate_many_recorded;
pub use safety::{Guarded, SafetyLimits, SafetyMonitor, Violation};
pub use scenario::Scenario;
pub use simulate::{
    Bundle, MAX_DELAY_SAMPLES, NoiseStream, Plant, Progress, Recorder, Run, Sample, Simulation, simulate,
    simulate_many, simulate_many_on, simulate_many_while,
};
pub use task::Task;
pub use trajectory::{AicDiagnostics, Row, Trajectory, aic_diagnostics};
