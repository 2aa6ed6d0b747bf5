//! Claim `joint-region`: the nonlinear loop decays when every joint has its own gains, friction and motor limit.
//!
//! With `pi = M dq`, `z_i = (e, m, mu', mu'', u~)_i` and `y_i = b_i'z_i` the function
//!
//! ```text
//! V = p dq'M dq + 2 pi'y + sum_i z_i'S_i(d_i) z_i   [+ 2p (U(q) - U(goal) - g(goal)'e)  without gravity compensation]
//! ```
//!
//! splits by joints once the inertia matrix is known only by diagonals, `Dl <= M <= Dh`, which gives
//!
//! ```text
//! sum_i (pi_i - Dl_i dq_i)(Dh_i dq_i - pi_i)/(Dh_i - Dl_i) >= 0,     dq'M dq >= sum_i pi_i^2/Dh_i
//! ```
//!
//! `S_i(d)` is affine in the joint's friction; every matrix below is checked at both ends of it.
//!
//! | inequality, for each joint | says |
//! |---|---|
//! | containment | `V <= 1` implies `\|y\| <= rho` |
//! | decay | `dV/dt + 2 rate V < 0` wherever `\|y\| <= rho` |
//! | torque | `V <= 1` implies `\|u~_i\| <= motor limit - gravity's share`, when limits are claimed |
//! | distance | `V <= 1` implies `\|e_i\| <= distance_i`, when distances are claimed |
//! | start | at rest within the ellipsoid `sum_i (e_i/radius_i)^2 <= 1`, `V <= 1` |
//!
//! The derivation is in `proofs/claims/joint-region.md`.

use std::fmt::Write as _;

use num_rational::BigRational;
use num_traits::Signed;
use serde::{Deserialize, Serialize};

use super::energy::{Energy, Plant, Point, Quantities, State};
use super::region::{controller_share, goal_inside, require_compensation, require_inside, scope, starting_torque};
use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::aic::STATES;
use crate::document::Document;
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::normed::{Norm, Normed};
use crate::number::{Number, unit_interval};
use crate::quantity::{require, require_length, require_plain, require_positive};
use crate::statement::list;

/// The nonlinear loop decays from every start in an ellipsoid.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRegionClaim {
    /// Half-axes of the ellipsoid of starts around the goal, one per joint, rad.
    pub radii_rad: Vec<Number>,
    /// `sqrt V` decays at least as `exp(-rate t)`, 1/s.
    pub rate_per_s: Number,
    /// Motor limits that are respected, gravity's share included, one per joint, N m.
    pub motor_limits_n_m: Option<Vec<Number>>,
    /// Each joint stays within this distance of its goal, rad.
    pub distances_rad: Option<Vec<Number>>,
    /// Steps of the goal.
    pub steps: Option<CoveredSteps>,
    /// The numbers that prove it.
    pub witness: JointRegionWitness,
}

/// Steps of the goal, and how much of each the ellipsoid of starts holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoveredSteps {
    /// The steps, one number per joint, rad.
    pub steps_rad: Vec<Vec<Number>>,
    /// Every step shortened to this share lies in the ellipsoid.
    pub covered_share: Number,
}

/// The Lyapunov function and multipliers of a joint-region claim, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointRegionWitness {
    /// Weight of the kinetic energy.
    pub p: Number,
    /// `|y| <= rho` on the region.
    pub rho: Number,
    /// How the cubic term is shared between its two bounds, in [0, 1].
    pub theta: Number,
    /// Multiplier of the diagonal bounds of the inertia matrix.
    pub inertia_multiplier: Number,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: Number,
    /// Multiplier of the torque at the start.
    pub start_multiplier: Number,
    /// What each joint has of its own.
    pub joints: Vec<JointWeights>,
}

/// Weights of V in one joint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointWeights {
    /// Cross terms of pi with (e, m, mu', mu'', u~).
    pub b: [Number; STATES],
    /// Upper triangle of the symmetric 5 x 5 matrix S, row by row, at the least and at the largest friction; once when they are equal.
    pub s: Vec<Vec<Number>>,
}

/// Most steps that a claim may list.
const MOST_STEPS: usize = 16;

impl Provable for JointRegionClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::JointRegion
    }

    fn sentence(&self, document: &Document) -> String {
        let torque = starting_torque(document);
        let mut text = format!(
            "from rest at any configuration with sum_i ((q_i - goal_i)/r_i)^2 <= 1 around a constant goal, r = {} rad (angles not wrapped){}, beliefs \
             at the measurement (mu = q, mu' = mu'' = 0), {torque}, the nonlinear loop converges to the goal, and the Lyapunov function of the \
             file's witness falls at least as fast as exp(-2 x {} t), t in s, each joint's friction being constant",
            bracketed(&self.radii_rad),
            goal_inside(document, self.distances_rad.as_deref().map(bracketed)),
            self.rate_per_s
        );
        if let Some(CoveredSteps { steps_rad, covered_share }) = &self.steps {
            let steps: Vec<String> = steps_rad.iter().map(|step| bracketed(step)).collect();
            let _ = write!(
                text,
                "; goal steps along {} rad, up to {covered_share} of each, taken at rest, start inside",
                steps.join(", ")
            );
        }
        if let Some(distances) = &self.distances_rad {
            let _ = write!(
                text,
                "; each joint stays within {} rad of its goal, so joint limits are kept for every goal at least that far inside them",
                bracketed(distances)
            );
        }
        if let Some(limits) = &self.motor_limits_n_m {
            let _ = write!(text, "; with gravity's share every motor stays within its limit of {} N m", list(limits));
        }
        text
    }

    fn scope(&self, _: &Document) -> String {
        scope(self.motor_limits_n_m.is_some(), self.distances_rad.is_some())
    }

    fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        if let Some(steps) = &self.steps {
            figures.push(Figure { name: "covered share", value: steps.covered_share.clone(), unit: "1" });
        }
        let least = self.radii_rad.iter().min_by(|a, b| a.value().cmp(b.value()));
        figures.extend(least.map(|r| Figure { name: "least radius", value: r.clone(), unit: "rad" }));
        figures.push(Figure { name: "rate", value: self.rate_per_s.clone(), unit: "1/s" });
        figures
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(joint_region_inequalities(document, self)?)
    }
}

/// Every number in its place, whether the joints share it or not.
fn bracketed(numbers: &[Number]) -> String {
    format!("[{}]", numbers.iter().map(Number::to_string).collect::<Vec<_>>().join(", "))
}

/// The inequalities of a joint-region claim about `document`, joint by joint, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn joint_region_inequalities(document: &Document, claim: &JointRegionClaim) -> Result<Vec<Inequality>, Flaw> {
    let joints = claim.joints(document)?;
    let torques = claim.motor_limits_n_m.as_ref().map(|limits| controller_share(document, limits)).transpose()?;
    let inverse_square = |x: &BigRational| (x * x).recip();
    let mut all = Vec::new();
    for (position, joint) in joints.iter().enumerate() {
        let problem = &joint.problem;
        for ((end, point), friction) in joint.points().zip(&problem.friction) {
            let mut record = |name: &str, form: &Form<BigRational>| {
                let name = format!("{name} of joint {} at the {end} friction", joint.index);
                all.push(Inequality::decide(name, &form.0));
            };
            record("containment", &problem.containment(point));
            record("decay", &problem.decay(point, claim.rate_per_s.value(), friction));
            if let Some(most) = torques.as_ref().and_then(|torques| torques.get(position)) {
                record("torque", &problem.within(point, State::Torque, &inverse_square(most)));
            }
            if let Some(most) = claim.distances_rad.as_ref().and_then(|distances| distances.get(position)) {
                record("distance", &problem.within(point, State::Position, &inverse_square(most.value())));
            }
            let radius = &claim.radii_rad[position];
            record("start", &problem.plant.start(point, &inverse_square(radius.value())));
        }
    }
    if let Some(CoveredSteps { steps_rad, covered_share }) = &claim.steps {
        for (index, step) in steps_rad.iter().enumerate() {
            let length = step.iter().zip(&claim.radii_rad).fold(BigRational::zero(), |sum, (e, r)| {
                let ratio = e.value() * covered_share.value() / r.value();
                sum + &ratio * &ratio
            });
            all.push(Inequality::decide(format!("step {}", index + 1), &vec![vec![BigRational::one() - length]]));
        }
    }
    Ok(all)
}

/// One joint of a claim, with the witness as numbers at each end of its friction.
struct ClaimedJoint {
    /// Counted from 1.
    index: usize,
    problem: JointProblem<BigRational>,
    points: Vec<Point<BigRational>>,
}

impl ClaimedJoint {
    /// The ends of the friction, named.
    fn points(&self) -> impl Iterator<Item = (&'static str, &Point<BigRational>)> {
        ["least", "largest"].into_iter().zip(&self.points)
    }
}

impl JointRegionClaim {
    /// Weights of a goal step: with gravity compensated, V at rest at the old goal is at most `sum_i s_i step_i^2` for the new one.
    ///
    /// # Errors
    /// [`Flaw`] when the claim is about uncompensated gravity or its witness has the wrong length.
    pub fn start_weights(&self, document: &Document) -> Result<Vec<BigRational>, Flaw> {
        require_compensation(document)?;
        let largest = |joint: &ClaimedJoint| {
            joint.points.iter().map(|point| point.energy.start_weight()).max().unwrap_or_else(BigRational::zero)
        };
        Ok(self.joints(document)?.iter().map(largest).collect())
    }

    /// Every joint with its witness, once the claim's own numbers are what the proof allows.
    fn joints(&self, document: &Document) -> Result<Vec<ClaimedJoint>, Flaw> {
        self.check(document)?;
        let claimed = |(index, JointWeights { b, s }): (usize, &JointWeights)| {
            let problem = JointProblem::new(document, index)?;
            require_length("s", s.len(), problem.friction.len())?;
            let points = s.iter().map(|s| self.point(&problem.plant, b, s)).collect::<Result<_, _>>()?;
            Ok(ClaimedJoint { index: index + 1, problem, points })
        };
        self.witness.joints.iter().enumerate().map(claimed).collect()
    }

    /// Whether the claim's own numbers are what the proof allows.
    fn check(&self, document: &Document) -> Result<(), Flaw> {
        let joints = document.family.joints();
        require_length("radii_rad", self.radii_rad.len(), joints)?;
        require_length("joints", self.witness.joints.len(), joints)?;
        require_positive("rate_per_s", &self.rate_per_s)?;
        for radius in &self.radii_rad {
            require_positive("radii_rad", radius)?;
        }
        let mut kept = vec![None; joints];
        if let Some(distances) = &self.distances_rad {
            require_length("distances_rad", distances.len(), joints)?;
            for distance in distances {
                require_positive("distances_rad", distance)?;
            }
            kept = distances.iter().cloned().map(Some).collect();
        }
        require_inside(document, &kept)?;
        if let Some(CoveredSteps { steps_rad, covered_share }) = &self.steps {
            require_positive("covered_share", covered_share)?;
            require("covered_share", covered_share, unit_interval(covered_share.value()), "a share in (0, 1]")?;
            if steps_rad.is_empty() || steps_rad.len() > MOST_STEPS {
                return Err(Flaw::Length { quantity: "steps_rad", found: steps_rad.len(), expected: MOST_STEPS });
            }
            for step in steps_rad {
                require_length("steps_rad", step.len(), joints)?;
                for coordinate in step {
                    require_plain("steps_rad", coordinate)?;
                }
            }
        }
        let witness = &self.witness;
        for (name, multiplier) in [
            ("inertia_multiplier", &witness.inertia_multiplier),
            ("gravity_multiplier", &witness.gravity_multiplier),
            ("start_multiplier", &witness.start_multiplier),
        ] {
            require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
        }
        Ok(())
    }

    /// The witness of one joint at one end of its friction, as numbers.
    fn point(
        &self,
        plant: &Plant<BigRational>,
        b: &[Number; STATES],
        s: &[Number],
    ) -> Result<Point<BigRational>, Flaw> {
        let JointRegionWitness { p, rho, theta, inertia_multiplier, gravity_multiplier, start_multiplier, .. } =
            &self.witness;
        let [absolute, relative] = plant.shares(rho, theta)?;
        Ok(Point {
            energy: Energy::of(p, b, s)?,
            rho_squared: rho.value() * rho.value(),
            absolute,
            relative,
            interval_multiplier: inertia_multiplier.value().clone(),
            gravity_multiplier: gravity_multiplier.value().clone(),
            start_multiplier: start_multiplier.value().clone(),
        })
    }
}

impl Normed for JointRegionClaim {
    fn norm(&self, document: &Document) -> Result<Norm, Flaw> {
        Ok(Norm {
            shift_weights: self.start_weights(document)?,
            rate: self.rate_per_s.value().clone(),
            period: None,
            kept: self.distances_rad.clone(),
        })
    }

    fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw> {
        // V is at least a sum over joints, so the same bound in each joint bounds the 2-norm.
        let closeness = (most * most).recip();
        let mut all = Vec::new();
        for joint in self.joints(document)? {
            for (end, point) in joint.points() {
                let form = joint.problem.within(point, State::Position, &closeness);
                let name = format!("distance of joint {} at the {end} friction", joint.index);
                all.push(Inequality::decide(name, &form.0));
            }
        }
        Ok(all)
    }
}

/// One joint of the loop as the proof sees it.
#[derive(Clone, Debug)]
pub struct JointProblem<T> {
    /// Controller and constants.
    pub plant: Plant<T>,
    /// The joint's entries of Dl and Dh.
    pub diagonal: [T; 2],
    /// Ends of the joint's viscous friction; once when they are equal.
    pub friction: Vec<T>,
}

/// The first coordinate of z, after dq and pi.
const Z: usize = 2;

impl JointProblem<BigRational> {
    /// One joint of the loop that a document describes, joints counted from 0.
    ///
    /// # Errors
    /// [`Flaw`] when the document has another controller, no such joint, or no diagonal bounds.
    pub fn new(document: &Document, joint: usize) -> Result<Self, Flaw> {
        let controller = document.gains.aic()?.controller(joint)?;
        let diagonal = document.constants.bounds.diagonal_kg_m2.as_ref();
        let [lower, upper] = diagonal.ok_or(Flaw::Missing { constant: "diagonal_kg_m2" })?;
        let friction = document.family.friction_n_m_s_per_rad.get(joint);
        let (Some(lower), Some(upper), Some([least, largest])) = (lower.get(joint), upper.get(joint), friction) else {
            return Err(Flaw::Length { quantity: "joints", found: document.arm.joints, expected: joint + 1 });
        };
        require("diagonal_kg_m2", upper, lower.value() < upper.value(), "an upper bound beyond the lower one")?;
        let mut friction = vec![least.value().clone()];
        if largest.value() != least.value() {
            friction.push(largest.value().clone());
        }
        Ok(Self {
            plant: Plant::new(document, controller),
            diagonal: [lower.value().clone(), upper.value().clone()],
            friction,
        })
    }

    /// The same over another field.
    pub fn map<T>(&self, convert: impl Fn(&BigRational) -> T) -> JointProblem<T> {
        JointProblem {
            plant: self.plant.map(&convert),
            diagonal: self.diagonal.each_ref().map(&convert),
            friction: self.friction.iter().map(&convert).collect(),
        }
    }
}

impl<T: Field> JointProblem<T> {
    /// Coordinates (pi, z, ..) with `dq = pi/Dh`, at which V is least.
    fn least(&self, order: usize) -> Quantities<T> {
        let [_, upper] = &self.diagonal;
        let pi = Row::coordinate(order, 0, T::one());
        let z = (0..STATES).map(|k| Row::coordinate(order, 1 + k, T::one())).collect();
        Quantities { order, dq: Row::coordinate(order, 0, T::one() / upper), pi, z }
    }

    /// Over (pi, z, 1).
    pub fn containment(&self, point: &Point<T>) -> Form<T> {
        self.plant.containment(point, &self.least(STATES + 2))
    }

    /// Over (pi, z): V at its least, minus `inverse_square` times the square of a state.
    pub fn within(&self, point: &Point<T>, state: State, inverse_square: &T) -> Form<T> {
        self.plant.within(point, &self.least(STATES + 1), state, inverse_square)
    }

    /// Over (dq, pi, z, w), the last where gravity acts: minus the joint's form of `dV/dt + 2 rate V` with the multiplier terms.
    pub fn decay(&self, point: &Point<T>, rate: &T, friction: &T) -> Form<T> {
        let has_gravity = self.plant.has_gravity;
        let order = Z + STATES + usize::from(has_gravity);
        let unit = |index| Row::coordinate(order, index, T::one());
        let at = Quantities { order, dq: unit(0), pi: unit(1), z: (0..STATES).map(|k| unit(Z + k)).collect() };
        let w = if has_gravity { unit(order - 1) } else { Row::zero(order) };
        let mut form = self.plant.change(point, &at, [friction, rate], [&Row::zero(order), &w]);
        // (pi - Dl dq)(Dh dq - pi)/(Dh - Dl), of which the sum over joints is not negative.
        let [lower, upper] = &self.diagonal;
        let share = point.interval_multiplier.clone() / &(upper.clone() - lower);
        let above = at.pi.plus(&-lower.clone(), &at.dq);
        let below = at.dq.times(upper).plus(&-T::one(), &at.pi);
        form.add(&share, &above, &below);
        form.negated()
    }
}
