//! One arm of a family: the numbers that distinguish it from the description.
//!
//! | quantity | code | simplest | unit |
//! |----------|------|----------|------|
//! | factor on a link's mass and inertia | `link_mass_scale` | 1 | 1 |
//! | point mass at the grasp point | `payload_kg` | 0 | kg |
//! | viscous, Coulomb friction | `viscous_n_m_s_per_rad`, `coulomb_n_m` | 0 | N m s/rad, N m |
//! | rotor inertia | `rotor_inertia_kg_m2` | 0 | kg m² |
//! | samples from command to torque | `delay_samples` | 0 | 1 |
//!
//! The fields bear the names of `PlantSetting` in `certune-closed-loop`, which adds whether the arm compensates its gravity.

use std::ops::RangeInclusive;

use certune_dynamics::{Joints, Model, Payload, Robot, RobotError};
use proptest::array::uniform;
use proptest::prelude::*;

use crate::draw::within;

/// The heaviest payload of [`panda_with_masses`], kg: a full bottle.
pub const PANDA_PAYLOAD_KG: f64 = 0.7;

/// What the arms of a family may be.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantRanges {
    /// Factor on every link's mass and inertia, drawn link by link.
    pub link_mass_scale: RangeInclusive<f64>,
    /// Point mass at the grasp point, kg.
    pub payload_kg: RangeInclusive<f64>,
    /// Viscous friction, drawn joint by joint, N m s/rad.
    pub viscous_n_m_s_per_rad: RangeInclusive<f64>,
    /// Coulomb friction, drawn joint by joint, N m.
    pub coulomb_n_m: RangeInclusive<f64>,
    /// Rotor inertia, drawn joint by joint, kg m².
    pub rotor_inertia_kg_m2: RangeInclusive<f64>,
    /// Samples from command to torque.
    pub delay_samples: RangeInclusive<usize>,
}

impl PlantRanges {
    /// Link masses within `share` of nominal, nothing else: no payload, friction, rotor inertia or delay.
    pub fn masses_within(share: f64) -> Self {
        Self {
            link_mass_scale: 1.0 - share..=1.0 + share,
            payload_kg: 0.0..=0.0,
            viscous_n_m_s_per_rad: 0.0..=0.0,
            coulomb_n_m: 0.0..=0.0,
            rotor_inertia_kg_m2: 0.0..=0.0,
            delay_samples: 0..=0,
        }
    }

    /// The plant box of the pick-and-place scenario: masses ±20 %, up to a full bottle in hand, friction 0.5 to 2,
    /// rotor inertia up to 0.1.
    pub fn pick_and_place() -> Self {
        Self {
            payload_kg: 0.0..=PANDA_PAYLOAD_KG,
            viscous_n_m_s_per_rad: 0.5..=2.0,
            rotor_inertia_kg_m2: 0.0..=0.1,
            ..Self::masses_within(0.2)
        }
    }
}

/// One arm of [`PlantRanges`], for a robot of `N` joints; lists run base to tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantNumbers<const N: usize> {
    /// Factor on every link's mass and inertia.
    pub link_mass_scale: [f64; N],
    /// Point mass at the grasp point, kg.
    pub payload_kg: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_n_m_s_per_rad: [f64; N],
    /// Coulomb friction, N m.
    pub coulomb_n_m: [f64; N],
    /// Rotor inertia, kg m².
    pub rotor_inertia_kg_m2: [f64; N],
    /// Samples from command to torque.
    pub delay_samples: usize,
}

impl<const N: usize> PlantNumbers<N> {
    /// `robot` with these numbers; the delay is no part of a model.
    ///
    /// # Errors
    /// [`RobotError`] when the robot has not `N` joints, or for a payload that was not drawn but made up.
    pub fn model(&self, robot: &Robot) -> Result<Model<N>, RobotError> {
        Ok(Model::<N>::new(robot)?
            .with_link_scales(&self.link_mass_scale)
            .with_payload(&Payload::at_grasp(robot, self.payload_kg)?)
            .with_friction(&self.viscous_n_m_s_per_rad.into(), &self.coulomb_n_m.into())
            .with_rotor_inertia(&Joints::from(self.rotor_inertia_kg_m2)))
    }
}

/// `range`, if it holds numbers of at least 0 only.
fn not_negative(quantity: &str, range: &RangeInclusive<f64>) -> RangeInclusive<f64> {
    assert!(*range.start() >= 0.0, "{quantity} is at least 0, not {}", range.start());
    range.clone()
}

/// One factor per link for [`Model::with_link_scales`], each end of `range` included; shrinks to 1.
///
/// # Panics
/// Unless `range` is a range of finite numbers of at least 0.
pub fn link_scales<const N: usize>(range: RangeInclusive<f64>) -> impl Strategy<Value = [f64; N]> + Clone {
    uniform::<_, N>(within(not_negative("a link's scale", &range), 1.0))
}

/// One arm of `ranges`; shrinks to the nominal arm, or the one of the ranges nearest to it.
///
/// # Panics
/// Unless every range is one of finite numbers of at least 0.
pub fn plant_numbers<const N: usize>(ranges: &PlantRanges) -> impl Strategy<Value = PlantNumbers<N>> + Clone + use<N> {
    let each = |quantity, range| uniform::<_, N>(within(not_negative(quantity, range), 0.0));
    (
        link_scales(ranges.link_mass_scale.clone()),
        within(not_negative("a payload", &ranges.payload_kg), 0.0),
        each("viscous friction", &ranges.viscous_n_m_s_per_rad),
        each("Coulomb friction", &ranges.coulomb_n_m),
        each("rotor inertia", &ranges.rotor_inertia_kg_m2),
        ranges.delay_samples.clone(),
    )
        .prop_map(|(link_mass_scale, payload_kg, viscous, coulomb, rotor, delay_samples)| PlantNumbers {
            link_mass_scale,
            payload_kg,
            viscous_n_m_s_per_rad: viscous,
            coulomb_n_m: coulomb,
            rotor_inertia_kg_m2: rotor,
            delay_samples,
        })
}

/// The Panda (arm with hand) whose links weigh `scales` times what is identified, with 0 to [`PANDA_PAYLOAD_KG`] at the grasp point.
/// Shrinks to the Panda as described.
///
/// ```
/// use certune_dynamics::{kinetic_energy, mass_matrix};
/// use certune_testkit::{joint_state, panda_with_masses};
/// use proptest::prelude::*;
///
/// proptest!(|(panda in panda_with_masses(0.8..=1.2), at in joint_state::<7>())| {
///     let from_matrix = 0.5 * at.dq.dot(&(mass_matrix(&panda, &at.q) * at.dq));
///     prop_assert!((from_matrix - kinetic_energy(&panda, &at)).abs() <= 1e-12 * from_matrix.max(1.0));
/// });
/// ```
///
/// # Panics
/// Unless `scales` is a range of finite numbers of at least 0.
pub fn panda_with_masses(scales: RangeInclusive<f64>) -> impl Strategy<Value = Model<7>> {
    let ranges =
        PlantRanges { link_mass_scale: scales, payload_kg: 0.0..=PANDA_PAYLOAD_KG, ..PlantRanges::masses_within(0.0) };
    let panda = Robot::panda();
    plant_numbers::<7>(&ranges).prop_map(move |numbers| numbers.model(&panda).expect("an arm of seven joints"))
}
