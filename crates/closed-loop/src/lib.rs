//! Plant, controller and task together: in time, and linearised.
//!
//! | module | what it holds |
//! |--------|---------------|
//! | [`file`](mod@file) | TOML read into types, with errors that carry line, key and what to do |
//! | [`gains`] | gains files, for any number of joints |
//! | [`scenario`] | scenario files, and tasks bound to an arm |
//! | [`plant_box`] | the family of plants a scenario declares, and seeded draws |
//! | [`simulate`](mod@simulate) | the loop at 1 kHz, without a heap |
//! | [`metrics`] | figures per goal and joint |
//! | [`trajectory`] | a run kept for plots |
//! | [`linear`] | plant and active inference controller linearised, continuous and sampled |
//! | [`knowledge`] | the arm's model handed to a baseline controller |
//!
//! Controllers come from `certune-control` and never see the plant; arms come from `certune-dynamics` and know no controller. They
//! meet here and nowhere else.
#![forbid(unsafe_code)]

pub mod file;
pub mod gains;
pub mod knowledge;
pub mod linear;
pub mod metrics;
pub mod plant_box;
pub mod scenario;
pub mod simulate;
pub mod trajectory;

pub use file::{FileError, KeyError, Location, Problem};
pub use gains::{AicTable, Gains, GainsFile, LawName, MracTable, PerJoint};
pub use knowledge::KnownModel;
pub use linear::{linearise_aic, linearise_aic_sampled};
pub use metrics::{Metrics, Segment};
pub use plant_box::{PlantBox, PlantError, PlantSetting};
pub use scenario::{Scenario, Task};
pub use simulate::{NoiseStream, Plant, Progress, Recorder, Sample, Simulation, simulate};
pub use trajectory::{AicDiagnostics, Row, Trajectory, aic_diagnostics};
