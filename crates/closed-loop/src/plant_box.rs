//! The family of plants that a scenario declares, and seeded draws from it.
//!
//! | symbol | key | meaning | unit |
//! |--------|-----|---------|------|
//! | x      | `mass_uncertainty` | every link's mass and inertia lie within `(1 - x, 1 + x)` of nominal | 1 |
//! | m_p    | `payload_kg` | a point mass at the grasp point | kg |
//! | d      | `friction_n_m_s_per_rad` | viscous friction of every joint | N m s/rad |
//! | r      | `rotor_inertia_kg_m2` | rotor inertia of every joint, seen at the joint | kg m² |
//! | k      | `delay_samples` | whole samples between a command and its torque | 1 |
//!
//! A draw takes every number uniformly and independently, joint by joint, from one ChaCha8 stream per index: plant 17 of
//! a seed is the same whichever other plants are drawn, on every machine.
//!
//! The grasp point lies 0.2 m beyond the flange along its axis ([`Payload::at_grasp`]); for the Panda that is z = 0.307 m in
//! the frame of link 7.

use certune_dynamics::{Model, Payload, Robot, RobotError};
use certune_linsys::Joints;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::file::KeyError;
use crate::simulate::MAX_DELAY_SAMPLES;

/// Ranges of everything that may differ from one plant to the next; `[low, high]`, both ends included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantBox {
    /// Relative uncertainty of every link's mass, in `[0, 1)`.
    pub mass_uncertainty: f64,
    /// Payload at the grasp point, kg.
    pub payload_kg: [f64; 2],
    /// Viscous friction of every joint, N m s/rad.
    pub friction_n_m_s_per_rad: [f64; 2],
    /// Rotor inertia of every joint, kg m².
    pub rotor_inertia_kg_m2: [f64; 2],
    /// Actuation delay in whole samples.
    #[serde(default)]
    pub delay_samples: [usize; 2],
    /// Whether the arm compensates its own gravity.
    pub gravity_compensation: bool,
}

/// Why a robot and a setting make no plant.
#[derive(Debug, thiserror::Error)]
pub enum PlantError {
    /// A number or list of the setting is not acceptable.
    #[error(transparent)]
    Setting(#[from] KeyError),
    /// The arm itself cannot be compiled, or carry the payload.
    #[error(transparent)]
    Robot(#[from] RobotError),
}

impl PlantBox {
    /// The box with one plant in it: nominal masses, no payload, friction, rotor inertia or delay.
    pub fn nominal(gravity_compensation: bool) -> Self {
        Self {
            mass_uncertainty: 0.0,
            payload_kg: [0.0; 2],
            friction_n_m_s_per_rad: [0.0; 2],
            rotor_inertia_kg_m2: [0.0; 2],
            delay_samples: [0; 2],
            gravity_compensation,
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// [`KeyError`] for the first range that is empty, negative or not finite, and for a delay above [`MAX_DELAY_SAMPLES`].
    pub fn validate(&self) -> Result<(), KeyError> {
        if !(self.mass_uncertainty >= 0.0 && self.mass_uncertainty < 1.0) {
            let expected = "a number of at least 0 and below 1";
            return Err(KeyError::out_of_range("plant-box.mass_uncertainty", self.mass_uncertainty, expected));
        }
        let delay = self.delay_samples.map(|samples| samples as f64);
        let ranges = [
            ("plant-box.payload_kg", self.payload_kg, f64::MAX),
            ("plant-box.friction_n_m_s_per_rad", self.friction_n_m_s_per_rad, f64::MAX),
            ("plant-box.rotor_inertia_kg_m2", self.rotor_inertia_kg_m2, f64::MAX),
            ("plant-box.delay_samples", delay, MAX_DELAY_SAMPLES as f64),
        ];
        for (key, [low, high], most) in ranges {
            if !(low >= 0.0 && low <= high && high <= most) {
                let expected = format!("[low, high] with 0 <= low <= high <= {most:e}");
                return Err(KeyError::out_of_range(key, format_args!("[{low}, {high}]"), &expected));
            }
        }
        Ok(())
    }

    /// Plant `index` of `seed` for an arm of `joints` joints.
    pub fn draw(&self, joints: usize, seed: u64, index: u64) -> PlantSetting {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let unit = |_| (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53); // 53 bits, in [0, 1)
        self.at(joints, &(0..self.dimension(joints)).map(unit).collect::<Vec<_>>())
    }

    /// The numbers that may differ between two plants of an arm with `joints` joints.
    pub const fn dimension(&self, joints: usize) -> usize {
        3 * joints + 2
    }

    /// The plant at a point of the unit cube of [`PlantBox::dimension`]: 0 is the low end of a range, 1 the high one; a coordinate that is missing counts as 0. In the order of the
    /// coordinates: masses, payload, friction, rotor inertia, delay. Coulomb friction is zero.
    pub fn at(&self, joints: usize, point: &[f64]) -> PlantSetting {
        let mut units = point.iter().copied();
        let mut uniform = |[low, high]: [f64; 2]| {
            let unit = units.next().unwrap_or(0.0);
            low + unit * (high - low)
        };
        let masses = [1.0 - self.mass_uncertainty, 1.0 + self.mass_uncertainty];
        let link_mass_scale = (0..joints).map(|_| uniform(masses)).collect();
        let payload_kg = uniform(self.payload_kg);
        let viscous_n_m_s_per_rad = (0..joints).map(|_| uniform(self.friction_n_m_s_per_rad)).collect();
        let rotor_inertia_kg_m2 = (0..joints).map(|_| uniform(self.rotor_inertia_kg_m2)).collect();
        let [fewest, most] = self.delay_samples;
        // The range of integers is widened by one so that both ends are equally likely.
        let delay_samples = (uniform([fewest as f64, (most + 1) as f64]) as usize).min(most);
        PlantSetting {
            link_mass_scale,
            payload_kg,
            viscous_n_m_s_per_rad,
            coulomb_n_m: vec![0.0; joints],
            rotor_inertia_kg_m2,
            delay_samples,
            gravity_compensation: self.gravity_compensation,
        }
    }
}

/// One plant of a box: what distinguishes it from the robot's description. Lists run base to tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantSetting {
    /// Factor on every link's mass and inertia.
    pub link_mass_scale: Vec<f64>,
    /// Point mass at the grasp point, kg.
    pub payload_kg: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_n_m_s_per_rad: Vec<f64>,
    /// Coulomb friction, N m.
    pub coulomb_n_m: Vec<f64>,
    /// Rotor inertia seen at the joint, kg m².
    pub rotor_inertia_kg_m2: Vec<f64>,
    /// Whole samples between a command and its torque.
    pub delay_samples: usize,
    /// Whether the arm compensates its own gravity.
    pub gravity_compensation: bool,
}

impl PlantSetting {
    /// The robot as described: its own friction and rotor inertia, no payload, no delay.
    pub fn nominal(robot: &Robot, gravity_compensation: bool) -> Self {
        let each = |value: fn(&certune_dynamics::Link) -> f64| robot.links().iter().map(value).collect();
        Self {
            link_mass_scale: vec![1.0; robot.joints()],
            payload_kg: 0.0,
            viscous_n_m_s_per_rad: each(|link| link.viscous_n_m_s_per_rad),
            coulomb_n_m: each(|link| link.coulomb_n_m),
            rotor_inertia_kg_m2: each(|link| link.rotor_inertia_kg_m2),
            delay_samples: 0,
            gravity_compensation,
        }
    }

    /// The same plant with viscous friction `n_m_s_per_rad` on every joint.
    pub fn with_friction(mut self, n_m_s_per_rad: f64) -> Self {
        self.viscous_n_m_s_per_rad.fill(n_m_s_per_rad);
        self
    }

    /// The same plant with rotor inertia `kg_m2` on every joint.
    pub fn with_rotor_inertia(mut self, kg_m2: f64) -> Self {
        self.rotor_inertia_kg_m2.fill(kg_m2);
        self
    }

    /// The same plant with a point mass of `kg` at the grasp point.
    pub fn with_payload(mut self, kg: f64) -> Self {
        self.payload_kg = kg;
        self
    }

    /// The same plant with a delay of `samples`.
    pub fn with_delay(mut self, samples: usize) -> Self {
        self.delay_samples = samples;
        self
    }

    /// The arm's model with this setting applied.
    ///
    /// # Errors
    /// [`PlantError`] when a list has another length than `N`, a number is negative or not finite, or the robot has not `N` joints.
    pub fn model<const N: usize>(&self, robot: &Robot) -> Result<Model<N>, PlantError> {
        let bind = |key: &'static str, values: &[f64]| -> Result<[f64; N], PlantError> {
            let bound = values.try_into().map_err(|_| KeyError::per_joint(key, values.len(), N))?;
            match values.iter().enumerate().find(|(_, value)| !(**value >= 0.0 && value.is_finite())) {
                Some((index, value)) => {
                    Err(KeyError::out_of_range(&format!("{key}[{index}]"), value, "a finite number, zero or above")
                        .into())
                }
                None => Ok(bound),
            }
        };
        let scales = bind("link_mass_scale", &self.link_mass_scale)?;
        let viscous = Joints::from(bind("viscous_n_m_s_per_rad", &self.viscous_n_m_s_per_rad)?);
        let coulomb = Joints::from(bind("coulomb_n_m", &self.coulomb_n_m)?);
        let rotor = Joints::from(bind("rotor_inertia_kg_m2", &self.rotor_inertia_kg_m2)?);
        let model = Model::<N>::new(robot)?.with_link_scales(&scales);
        let model = model.with_rotor_inertia(&rotor).with_friction(&viscous, &coulomb);
        Ok(model.with_payload(&Payload::at_grasp(robot, self.payload_kg)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pick_and_place() -> PlantBox {
        PlantBox {
            mass_uncertainty: 0.2,
            payload_kg: [0.0, 0.7],
            friction_n_m_s_per_rad: [0.5, 2.0],
            rotor_inertia_kg_m2: [0.0, 0.1],
            delay_samples: [0, 2],
            gravity_compensation: true,
        }
    }

    proptest! {
        #[test]
        fn every_draw_lies_in_the_box(seed: u64, index: u64) {
            let plant = pick_and_place().draw(7, seed, index);
            let within = |values: &[f64], [low, high]: [f64; 2]| values.len() == 7 && values.iter().all(|x| (low..=high).contains(x));
            prop_assert!(within(&plant.link_mass_scale, [0.8, 1.2]));
            prop_assert!(within(&plant.viscous_n_m_s_per_rad, [0.5, 2.0]));
            prop_assert!(within(&plant.rotor_inertia_kg_m2, [0.0, 0.1]));
            prop_assert!((0.0..=0.7).contains(&plant.payload_kg) && plant.delay_samples <= 2 && plant.gravity_compensation);
        }
    }

    #[test]
    fn the_corners_of_the_unit_cube_are_those_of_the_box() {
        let family = pick_and_place();
        let [low, high] = [0.0, 1.0].map(|end| family.at(2, &vec![end; family.dimension(2)]));
        assert_eq!((low.link_mass_scale, high.link_mass_scale), (vec![0.8; 2], vec![1.2; 2]));
        assert_eq!((low.payload_kg, high.payload_kg), (0.0, 0.7));
        assert_eq!((low.viscous_n_m_s_per_rad, high.viscous_n_m_s_per_rad), (vec![0.5; 2], vec![2.0; 2]));
        assert_eq!((low.rotor_inertia_kg_m2, high.rotor_inertia_kg_m2), (vec![0.0; 2], vec![0.1; 2]));
        assert_eq!((low.delay_samples, high.delay_samples), (0, 2));
    }

    #[test]
    fn a_draw_depends_on_its_seed_and_index_alone() {
        let family = pick_and_place();
        let forward: Vec<_> = (0..20).map(|index| family.draw(7, 3, index)).collect();
        let backward: Vec<_> = (0..20).rev().map(|index| family.draw(7, 3, index)).collect();
        assert!(forward.iter().eq(backward.iter().rev()));
        assert_ne!(forward[0], forward[1]);
        assert_ne!(forward[0], family.draw(7, 4, 0));
    }

    #[test]
    fn the_stream_is_the_same_on_every_machine() {
        // ChaCha8 is specified to the bit; recorded plants stay what they were as long as these numbers do.
        let recorded = PlantSetting {
            link_mass_scale: vec![0.9556222304734743, 1.1861686501628768],
            payload_kg: 0.24741283995609573,
            viscous_n_m_s_per_rad: vec![0.8596209130354258, 0.622001340802683],
            coulomb_n_m: vec![0.0, 0.0],
            rotor_inertia_kg_m2: vec![0.05963669898273532, 0.06690796798455594],
            delay_samples: 0,
            gravity_compensation: true,
        };
        assert_eq!(pick_and_place().draw(2, 1, 5), recorded);
    }

    #[test]
    fn all_delays_are_drawn() {
        let mut seen = [0; 3];
        for index in 0..300 {
            seen[pick_and_place().draw(7, 0, index).delay_samples] += 1;
        }
        assert!(seen.iter().all(|&count| count > 70), "{seen:?}");
    }

    #[test]
    fn a_box_out_of_range_is_refused_with_its_key() {
        let key = |edit: fn(&mut PlantBox)| {
            let mut family = pick_and_place();
            edit(&mut family);
            family.validate().expect_err("a bad box").key
        };
        assert_eq!(key(|family| family.mass_uncertainty = 1.0), "plant-box.mass_uncertainty");
        assert_eq!(key(|family| family.mass_uncertainty = f64::NAN), "plant-box.mass_uncertainty");
        assert_eq!(key(|family| family.payload_kg = [0.7, 0.0]), "plant-box.payload_kg");
        assert_eq!(key(|family| family.friction_n_m_s_per_rad = [-1.0, 0.0]), "plant-box.friction_n_m_s_per_rad");
        assert_eq!(key(|family| family.rotor_inertia_kg_m2 = [0.0, f64::INFINITY]), "plant-box.rotor_inertia_kg_m2");
        assert_eq!(key(|family| family.delay_samples = [0, 17]), "plant-box.delay_samples");
        assert!(pick_and_place().validate().is_ok() && PlantBox::nominal(true).validate().is_ok());
    }

    #[test]
    fn a_setting_that_does_not_fit_the_arm_is_refused_with_its_key() {
        let robot = Robot::panda();
        let nominal = PlantSetting::nominal(&robot, true);
        let refused = |setting: PlantSetting| match setting.model::<7>(&robot) {
            Err(PlantError::Setting(error)) => error.key,
            Err(PlantError::Robot(error)) => format!("robot: {error}"),
            Ok(_) => "accepted".to_owned(),
        };
        assert_eq!(refused(nominal.clone()), "accepted");
        assert_eq!(refused(PlantSetting { link_mass_scale: vec![1.0; 6], ..nominal.clone() }), "link_mass_scale");
        assert_eq!(refused(nominal.clone().with_friction(-1.0)), "viscous_n_m_s_per_rad[0]");
        assert!(refused(nominal.clone().with_payload(f64::NAN)).starts_with("robot: "));
        assert!(matches!(nominal.model::<6>(&robot), Err(PlantError::Setting(_))));
    }
}
