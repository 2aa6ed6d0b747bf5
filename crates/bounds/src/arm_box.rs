//! The family of arms that constants are computed for: `M(q) = Σ_i s_i M_i(q) + diag(r)`.
//!
//! | symbol | code | unit |
//! |--------|------|------|
//! | s_i | [`MassGroup::scale`] | 1 for a link (its mass over the nominal one), kg for the payload |
//! | M_i | [`MassGroup::model`] | kg m², kg m² per kg for the payload |
//! | r_j | [`ArmBox::rotor_inertia_kg_m2`] | kg m² |
//!
//! A box is closed and convex; a *member* is one arm in it. Limits: scales multiply mass and inertia tensor together and keep
//! the centre of mass; the payload is rigid at one fixed place.

use std::f64::consts::PI;

use certune_dynamics::{Model, Payload};
use certune_linsys::Joints;

use crate::error::{BoundsError, is_range};
use crate::maximise::Axis;

/// The ranges that span an [`ArmBox`] around a nominal arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    /// Each link's mass and inertia may be off by this fraction, independently: 0.2 means ±20 %; in `[0, 1)`.
    pub mass_uncertainty: f64,
    /// Mass of a point payload, lower and upper end, kg.
    pub payload_kg: [f64; 2],
    /// Where that payload sits, in the frame of the last link, m; for a payload given by its mass alone,
    /// `Payload::at_grasp(robot, mass)?.com_m`.
    pub payload_com_m: [f64; 3],
    /// Rotor inertia seen at each joint, lower and upper end, kg m².
    pub rotor_inertia_kg_m2: [f64; 2],
}

impl Ranges {
    /// The nominal arm alone: no uncertainty, no payload, no rotor inertia. Fields are then set one by one.
    #[must_use]
    pub const fn nominal() -> Self {
        Self {
            mass_uncertainty: 0.0,
            payload_kg: [0.0, 0.0],
            payload_com_m: [0.0, 0.0, 0.0],
            rotor_inertia_kg_m2: [0.0, 0.0],
        }
    }
}

impl Default for Ranges {
    fn default() -> Self {
        Self::nominal()
    }
}

/// Bodies whose masses scale together.
#[derive(Clone, Debug)]
pub struct MassGroup<const N: usize> {
    /// The arm with nothing but this group, at scale 1, without rotor inertia or friction.
    pub model: Model<N>,
    /// Lower and upper end of the scale, `0 <= lower <= upper`.
    pub scale: [f64; 2],
}

/// A box of arms: one scale per link, one for the payload, one interval of rotor inertia per joint.
#[derive(Clone, Debug)]
pub struct ArmBox<const N: usize> {
    base: Model<N>,
    groups: Vec<MassGroup<N>>,
    payload_com_m: [f64; 3],
    rotor_lower: Joints<N>,
    rotor_upper: Joints<N>,
}

/// One arm of a box in one configuration.
#[derive(Clone, Debug)]
pub struct Member<const N: usize> {
    /// Joint positions, rad.
    pub q: Joints<N>,
    /// The arm, with its payload and rotor inertia, without friction.
    pub model: Model<N>,
}

impl<const N: usize> ArmBox<N> {
    /// The box of `ranges` around a nominal arm.
    ///
    /// `nominal` is taken without its rotor inertia and friction (the first is what `ranges` says, the second does not enter
    /// any constant). A payload it already carries belongs to its last link and is scaled with it.
    ///
    /// # Errors
    /// Any range that is reversed, negative, infinite or NaN; a mass uncertainty outside `[0, 1)`.
    pub fn new(nominal: &Model<N>, ranges: &Ranges) -> Result<Self, BoundsError> {
        let uncertainty = ranges.mass_uncertainty;
        if !(0.0..1.0).contains(&uncertainty) {
            return Err(BoundsError::MassUncertainty { value: uncertainty });
        }
        if !is_range(ranges.payload_kg) {
            return Err(BoundsError::Payload { lower: ranges.payload_kg[0], upper: ranges.payload_kg[1] });
        }
        if let Some((axis, &value)) = ranges.payload_com_m.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(BoundsError::PayloadPosition { axis, value });
        }
        let base = nominal.with_rotor_inertia(&Joints::zeros()).with_friction(&Joints::zeros(), &Joints::zeros());
        let mut groups: Vec<MassGroup<N>> = (0..N)
            .map(|link| {
                let mut only = [0.0; N];
                only[link] = 1.0;
                MassGroup { model: base.with_link_scales(&only), scale: [1.0 - uncertainty, 1.0 + uncertainty] }
            })
            .collect();
        if ranges.payload_kg[1] > 0.0 {
            let unit = point(1.0, ranges.payload_com_m);
            let model = base.with_link_scales(&[0.0; N]).with_payload(&unit);
            groups.push(MassGroup { model, scale: ranges.payload_kg });
        }
        let arm_box = Self {
            base,
            groups,
            payload_com_m: ranges.payload_com_m,
            rotor_lower: Joints::zeros(),
            rotor_upper: Joints::zeros(),
        };
        let [lower, upper] = ranges.rotor_inertia_kg_m2;
        arm_box.with_rotor_inertia(&Joints::repeat(lower), &Joints::repeat(upper))
    }

    /// The nominal arm alone, without payload or rotor inertia.
    ///
    /// # Errors
    /// None in practice: the nominal ranges are valid.
    pub fn nominal(nominal: &Model<N>) -> Result<Self, BoundsError> {
        Self::new(nominal, &Ranges::nominal())
    }

    /// The same box with another interval of rotor inertia on every joint, kg m², base to tip.
    ///
    /// # Errors
    /// [`BoundsError::RotorInertia`] names the first joint whose interval is not `0 <= lower <= upper < infinity`.
    pub fn with_rotor_inertia(mut self, lower: &Joints<N>, upper: &Joints<N>) -> Result<Self, BoundsError> {
        for joint in 0..N {
            if !is_range([lower[joint], upper[joint]]) {
                return Err(BoundsError::RotorInertia { joint: joint + 1, lower: lower[joint], upper: upper[joint] });
            }
        }
        self.rotor_lower = *lower;
        self.rotor_upper = *upper;
        Ok(self)
    }

    /// The groups: one per link, base to tip, then the payload if its mass can be positive.
    #[must_use]
    pub fn groups(&self) -> &[MassGroup<N>] {
        &self.groups
    }

    /// The nominal arm, without payload of the box, rotor inertia and friction.
    pub(crate) fn base(&self) -> &Model<N> {
        &self.base
    }

    /// Lower and upper rotor inertia of every joint, kg m².
    #[must_use]
    pub fn rotor_inertia_kg_m2(&self) -> [Joints<N>; 2] {
        [self.rotor_lower, self.rotor_upper]
    }

    /// The arm with the given scales (in the order of [`ArmBox::groups`]) and rotor inertia, without friction.
    ///
    /// # Errors
    /// [`BoundsError::Length`] unless there is one scale per group. Scales outside the box are not refused.
    pub fn model(&self, scales: &[f64], rotor_inertia_kg_m2: &Joints<N>) -> Result<Model<N>, BoundsError> {
        if scales.len() != self.groups.len() {
            return Err(BoundsError::Length { given: scales.len(), expected: self.groups.len() });
        }
        Ok(self.model_unchecked(scales).with_rotor_inertia(rotor_inertia_kg_m2))
    }

    /// [`ArmBox::model`] without rotor inertia; a missing scale counts as zero.
    pub(crate) fn model_unchecked(&self, scales: &[f64]) -> Model<N> {
        let mut links = [0.0; N];
        for (link, scale) in links.iter_mut().zip(scales) {
            *link = *scale;
        }
        let model = self.base.with_link_scales(&links);
        match scales.get(N) {
            Some(&mass_kg) if mass_kg > 0.0 => model.with_payload(&point(mass_kg, self.payload_com_m)),
            _ => model,
        }
    }

    /// The arm with every mass at its upper end, without rotor inertia.
    pub(crate) fn upper_model(&self) -> Model<N> {
        let scales: Vec<f64> = self.groups.iter().map(|group| group.scale[1]).collect();
        self.model_unchecked(&scales)
    }

    /// The arm with every link's mass in the middle, without rotor inertia: with the least and with the largest payload.
    pub(crate) fn nominal_models(&self) -> Vec<Model<N>> {
        let mut scales: Vec<f64> = self.groups.iter().map(|group| 0.5 * (group.scale[0] + group.scale[1])).collect();
        let payload = self.groups.get(N).map_or([0.0; 2], |group| group.scale);
        scales.truncate(N);
        let loads = if payload[0] < payload[1] { &payload[..] } else { &payload[..1] };
        loads.iter().map(|load| self.model_unchecked(&[&scales[..], &[*load]].concat())).collect()
    }

    /// The arms whose masses are all least, and all greatest, with the least rotor inertia.
    pub(crate) fn corner_models(&self) -> [Model<N>; 2] {
        [0, 1].map(|end| {
            let scales: Vec<f64> = self.groups.iter().map(|group| group.scale[end]).collect();
            self.model_unchecked(&scales).with_rotor_inertia(&self.rotor_lower)
        })
    }

    /// Each link with half the width of its scale's interval.
    pub(crate) fn uncertain_links(&self) -> impl Iterator<Item = (&MassGroup<N>, f64)> {
        self.groups.iter().take(N).map(|group| {
            let [lower, upper] = group.scale;
            // Scales are of order 1: the ends and the middle are roundings of what was meant.
            let half = if lower < upper { 0.5 * (upper - lower) + 4.0 * f64::EPSILON } else { 0.0 };
            (group, half)
        })
    }

    /// The axes of a search over members: N joint angles (full circles), then one scale per group, then one common
    /// fraction in `[0, 1]` between the lower and the upper rotor inertia.
    ///
    /// A caller appends its own axes (friction, say) and hands the leading part of each point to [`ArmBox::member`].
    #[must_use]
    pub fn axes(&self) -> Vec<Axis> {
        let angles = std::iter::repeat_n(Axis::Circle { start: -PI }, N);
        let scales = self.groups.iter().map(|group| Axis::Interval { lower: group.scale[0], upper: group.scale[1] });
        angles.chain(scales).chain([Axis::Interval { lower: 0.0, upper: 1.0 }]).collect()
    }

    /// The member at a point over [`ArmBox::axes`].
    ///
    /// # Errors
    /// [`BoundsError::Length`] unless `at` has exactly as many coordinates as there are axes.
    pub fn member(&self, at: &[f64]) -> Result<Member<N>, BoundsError> {
        let expected = N + self.groups.len() + 1;
        if at.len() != expected {
            return Err(BoundsError::Length { given: at.len(), expected });
        }
        let (q, rest) = at.split_at(N);
        let (scales, fraction) = rest.split_at(self.groups.len());
        let rotor = self.rotor_lower.lerp(&self.rotor_upper, fraction[0]);
        Ok(Member { q: Joints::from_column_slice(q), model: self.model(scales, &rotor)? })
    }
}

/// A point mass in the last link's frame.
fn point(mass_kg: f64, com_m: [f64; 3]) -> Payload {
    Payload { mass_kg, com_m, about_com_kg_m2: [0.0; 6] }
}
