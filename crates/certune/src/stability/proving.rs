//! The constants of an arm, proved and written as a record; minutes of work, once.

use certune_bounds::riccati::riccati_bounds;
use certune_bounds::rigorous::{AngleSet, polygon_bounds};
use certune_bounds::{ArmBox, Ranges, record};
use certune_dynamics::{Model, Payload, Robot};
use certune_verify::Record;

use super::StabilityError;
use super::constants::Over;

pub use certune_bounds::rigorous::Effort as ProvingEffort;

/// Which arms, and which of their configurations, constants are wanted for.
#[derive(Clone, Debug, PartialEq)]
pub struct ProvingTask {
    /// Link masses may differ from nominal by this share.
    pub mass_uncertainty: f64,
    /// Payload at the grasp point, `[least, largest]`, kg.
    pub payload_kg: [f64; 2],
    /// Rotor inertia of each joint, `[least, largest]`, kg m^2.
    pub rotor_inertia_kg_m2: [f64; 2],
    /// The configurations.
    pub over: Over,
    /// How much time goes into tightness.
    pub effort: ProvingEffort,
}

/// Proves the constants; `progress` hears the share that is done, from any thread.
///
/// # Errors
/// When the robot has not `N` joints, a range is not valid, or a bound cannot be proved with that effort.
pub fn prove_constants<const N: usize>(
    robot: &Robot,
    task: &ProvingTask,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Record, StabilityError> {
    let ranges = Ranges {
        mass_uncertainty: task.mass_uncertainty,
        payload_kg: task.payload_kg,
        payload_com_m: Payload::at_grasp(robot, 1.0)?.com_m,
        rotor_inertia_kg_m2: task.rotor_inertia_kg_m2,
    };
    let arms = ArmBox::<N>::new(&Model::new(robot)?, &ranges)?;
    let set = task.over.angles(robot).and_then(|(lower, upper)| {
        Some(AngleSet::Box { lower_rad: lower.try_into().ok()?, upper_rad: upper.try_into().ok()? })
    });
    let set = set.unwrap_or(AngleSet::AllAngles);
    let polygons = polygon_bounds(&arms, &set, task.effort, &|share| progress(0.3 * share))?;
    let riccati = riccati_bounds(&arms, &set, task.effort, &|share| progress(0.3 + 0.7 * share))?;
    Ok(record(robot, &ranges, &set, &polygons, &riccati)?)
}
