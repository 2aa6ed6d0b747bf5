//! A map of poles: measured, not proved.

use certune_closed_loop::{PlantBox, linearise_aic};
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::Robot;
use certune_linsys::Joints;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::{STEP_S, StabilityError};

/// Eigenvalues, as (real, imaginary) in 1/s, of the linearised loops of random members of a plant box in random configurations.
///
/// # Errors
/// When the robot has not `N` joints or the gains are not valid.
pub fn poles_per_s<const N: usize>(
    robot: &Robot,
    plant_box: &PlantBox,
    gains: &AicGains<N>,
    configurations: usize,
    seed: u64,
) -> Result<Vec<[f64; 2]>, StabilityError> {
    let params = AicParams::new(gains, STEP_S)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut poles = Vec::with_capacity(6 * N * configurations);
    for index in 0..configurations {
        let model = plant_box.draw(N, seed, index as u64).model::<N>(robot)?;
        let q = Joints::from_fn(|_, _| {
            let unit = (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
            std::f64::consts::PI * (2.0 * unit - 1.0)
        });
        let closed = linearise_aic(&model, &q, &params, plant_box.gravity_compensation)?;
        poles.extend(closed.eigenvalues().into_iter().map(|s| [s.re, s.im]));
    }
    Ok(poles)
}
