//! Claim `region`: the nonlinear loop, at any configuration, decays from every start at rest within a ball.
//!
//! With `z = (e, m, mu', mu'', u~)` and `y = (b' (x) I) z` the function
//!
//! ```text
//! V = p dq'M dq + 2 dq'M y + z'(S (x) I) z   [+ 2p (U(q) - U(goal) - g(goal)'e)  without gravity compensation]
//! ```
//!
//! obeys, along the loop, with `D = d0 I + Delta`, `f = Delta dq`, `w = g(q) - g(goal)`,
//!
//! ```text
//! dV/dt = 2p dq'(u~ - d0 dq - f) + 2 y'(u~ - d0 dq - f - w) + 2 dq'M (b' (x) I) z' + 2 z'(S (x) I) z' + dq'(sum_j y_j dM/dq_j) dq
//! ```
//!
//! In an eigenbasis of `M(q)` every term splits by joints, affine in the eigenvalue `m`; so each inequality below is checked at `m_lo` and `m_hi`:
//!
//! | inequality | says |
//! |---|---|
//! | containment | `V <= 1` implies `\|y\| <= rho` |
//! | decay | `dV/dt + 2 rate V < 0` wherever `\|y\| <= rho`, with multipliers for f and w |
//! | torque | `V <= 1` implies `\|u~\| <= u_max`, when a torque is claimed |
//! | distance | `V <= 1` implies `\|e\| <= r`, when a distance is claimed |
//! | start | at rest at distance `radius` from the goal, `V <= 1` |
//!
//! Every matrix is affine in `p, b, S`, the multipliers, `rho^2` and the two shares of `rho`. The derivation is in `proofs/claims/region.md`.

use std::fmt::Write as _;

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use serde::{Deserialize, Serialize};

use super::energy::{Energy, Quantities, TRIANGLE};
use super::{ClaimKind, Figure, Inequality, LoopBox, Provable, all_hold, family_box};
use crate::aic::{Controller, STATES};
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::number::{Number, positive, ratio, unit_interval};
use crate::quantity::{require, require_length, require_positive};
use crate::statement::list;

/// The nonlinear loop decays from every start in a ball.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionClaim {
    /// Every start at rest within this distance of the goal (2-norm over the joints) is covered, rad.
    pub radius_rad: Number,
    /// `sqrt V` decays at least as `exp(-rate t)`, 1/s.
    pub rate_per_s: Number,
    /// The controller's torque stays within this of its equilibrium (2-norm over the joints), N m.
    pub controller_torque_n_m: Option<Number>,
    /// Motor limits that are respected, one per joint: the controller's torque and gravity's share fit in each, N m.
    pub motor_limits_n_m: Option<Vec<Number>>,
    /// The position stays within this distance of the goal (2-norm over the joints), rad.
    pub distance_rad: Option<Number>,
    /// The numbers that prove it.
    pub witness: RegionWitness,
}

/// The Lyapunov function and multipliers of a region claim, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionWitness {
    /// Weight of the kinetic energy.
    pub p: Number,
    /// Cross terms of dq'M with (e, m, mu', mu'', u~).
    pub b: [Number; 5],
    /// Upper triangle of the symmetric 5 x 5 matrix S, row by row.
    pub s: Vec<Number>,
    /// `|y| <= rho` on the region.
    pub rho: Number,
    /// How the cubic term is shared between its two bounds, in [0, 1].
    pub theta: Number,
    /// Multiplier of the friction interval.
    pub friction_multiplier: Number,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: Number,
    /// Multiplier of the torque at the start.
    pub start_multiplier: Number,
}

impl Provable for RegionClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Region
    }

    fn sentence(&self, document: &Document) -> String {
        let torque = if document.family.gravity_compensation {
            "with zero controller torque"
        } else {
            "with the controller's torque holding gravity there"
        };
        let mut text = format!(
            "from rest at any configuration within {} rad of a constant goal (2-norm over the joints, angles not wrapped){}, beliefs at the \
             measurement (mu = q, mu' = mu'' = 0), {torque}, the nonlinear loop converges to the goal, and the Lyapunov function of the \
             file's witness falls at least as fast as exp(-2 x {} t), t in s",
            self.radius_rad,
            goal_inside(document, self.distance_rad.as_ref().map(Number::to_string)),
            self.rate_per_s
        );
        if let Some(distance) = &self.distance_rad {
            let _ = write!(
                text,
                "; the position stays within {distance} rad of the goal (2-norm), so joint limits are kept for every goal at least that far \
                 inside them"
            );
        }
        if let Some(most) = &self.controller_torque_n_m {
            let what = torque_in_words(document);
            let _ = write!(text, "; {what} stays within {most} N m (2-norm over the joints)");
        }
        if let Some(limits) = &self.motor_limits_n_m {
            let _ = write!(text, ", and with gravity's share every motor within its limit of {} N m", list(limits));
        }
        text
    }

    fn scope(&self, _: &Document) -> String {
        scope(self.controller_torque_n_m.is_some(), self.distance_rad.is_some())
    }

    fn figures(&self) -> Vec<Figure> {
        let mut figures = vec![
            Figure { name: "radius", value: self.radius_rad.clone(), unit: "rad" },
            Figure { name: "rate", value: self.rate_per_s.clone(), unit: "1/s" },
        ];
        let optional =
            [("controller torque", &self.controller_torque_n_m, "N m"), ("distance", &self.distance_rad, "rad")];
        for (name, value, unit) in optional {
            figures.extend(value.clone().map(|value| Figure { name, value, unit }));
        }
        figures
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(region_inequalities(document, self)?)
    }
}

/// Where the goal must lie for the constants to hold all along, in words.
pub(crate) fn goal_inside(document: &Document, distance: Option<String>) -> String {
    match (&document.constants.over, distance) {
        (ConfigurationSet::Box { .. }, Some(distance)) => {
            format!(", the goal at least {distance} rad inside the angles the constants hold for")
        }
        (ConfigurationSet::Box { .. } | ConfigurationSet::AllAngles, _) => String::new(),
    }
}

/// What a claimed bound on `u~` bounds, in words.
pub(crate) fn torque_in_words(document: &Document) -> &'static str {
    if document.family.gravity_compensation {
        "the controller's own torque"
    } else {
        "the controller's torque less what holds the goal"
    }
}

/// What the nonlinear claims in continuous time leave out.
pub(crate) fn scope(torque: bool, distance: bool) -> String {
    let torque = if torque { "the stated torque bound is respected" } else { "no torque limit" };
    let limits = if distance { "joint limits as stated" } else { "joint limits not shown to be kept" };
    format!("continuous time, {torque}, no delay, no noise, no Coulomb friction, {limits}")
}

/// The inequalities of a region claim about `document`, in the order of the module's table, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn region_inequalities(document: &Document, claim: &RegionClaim) -> Result<Vec<Inequality>, Flaw> {
    let problem = RegionProblem::new(document)?;
    let point = claim.checked(document, &problem)?;
    let inverse_square = |x: &Number| (x.value() * x.value()).recip();
    let mut all = Vec::new();
    for (m, end) in problem.inertia.iter().zip(["least", "largest"]) {
        let mut record = |name: &str, form: &Form<BigRational>| {
            all.push(Inequality::decide(format!("{name} at the {end} inertia"), &form.0));
        };
        record("containment", &problem.containment(&point, m));
        record("decay", &problem.decay(&point, claim.rate_per_s.value(), m));
        if let Some(most) = &claim.controller_torque_n_m {
            record("torque", &problem.within(&point, m, State::Torque, &inverse_square(most)));
        }
        if let Some(most) = &claim.distance_rad {
            record("distance", &problem.within(&point, m, State::Position, &inverse_square(most)));
        }
    }
    all.push(Inequality::decide("start".to_owned(), &problem.start(&point, &inverse_square(&claim.radius_rad)).0));
    Ok(all)
}

impl RegionClaim {
    /// Weight s of a goal step: with gravity compensated, V at rest at the old goal is `s |step|^2` for the new one.
    ///
    /// # Errors
    /// [`Flaw`] when the claim is about uncompensated gravity or its witness has the wrong length.
    pub fn start_weight(&self, document: &Document) -> Result<BigRational, Flaw> {
        require_compensation(document)?;
        Ok(energy(&self.witness.p, &self.witness.b, &self.witness.s)?.start_weight())
    }

    /// The witness as numbers, once the claim's own are what the proof allows.
    fn checked(
        &self,
        document: &Document,
        problem: &RegionProblem<BigRational>,
    ) -> Result<RegionPoint<BigRational>, Flaw> {
        require_positive("radius_rad", &self.radius_rad)?;
        require_positive("rate_per_s", &self.rate_per_s)?;
        for (name, number) in
            [("controller_torque_n_m", &self.controller_torque_n_m), ("distance_rad", &self.distance_rad)]
        {
            if let Some(number) = number {
                require_positive(name, number)?;
            }
        }
        if let Some(limits) = &self.motor_limits_n_m {
            let Some(most) = &self.controller_torque_n_m else {
                return Err(Flaw::NotCovered { what: "motor limits without a bound on the controller's torque" });
            };
            for share in controller_share(document, limits)? {
                require(
                    "controller_torque_n_m",
                    most,
                    *most.value() <= share,
                    "no more than gravity leaves of each limit",
                )?;
            }
        }
        let joints = document.arm.joints;
        require_inside(document, &vec![self.distance_rad.clone(); joints])?;
        let witness = &self.witness;
        // A witness is only ever computed with: dyadics of any size will do.
        require("p", &witness.p, positive(witness.p.value()), "a positive number")?;
        let [absolute, relative] = cubic_shares(&witness.rho, &witness.theta, problem.coriolis_relative.is_some())?;
        for (name, multiplier) in [
            ("friction_multiplier", &witness.friction_multiplier),
            ("gravity_multiplier", &witness.gravity_multiplier),
            ("start_multiplier", &witness.start_multiplier),
        ] {
            require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
        }
        Ok(RegionPoint {
            energy: energy(&witness.p, &witness.b, &witness.s)?,
            rho_squared: witness.rho.value() * witness.rho.value(),
            absolute,
            relative,
            friction_multiplier: witness.friction_multiplier.value().clone(),
            gravity_multiplier: witness.gravity_multiplier.value().clone(),
            start_multiplier: witness.start_multiplier.value().clone(),
        })
    }
}

/// What is left of each motor limit when gravity has taken its share.
pub(crate) fn controller_share(document: &Document, limits: &[Number]) -> Result<Vec<BigRational>, Flaw> {
    require_length("motor_limits_n_m", limits.len(), document.arm.joints)?;
    let Some(gravity) = &document.constants.bounds.gravity_torque_n_m else {
        return Err(Flaw::Missing { constant: "gravity_torque_n_m" });
    };
    let mut shares = Vec::new();
    for (limit, gravity) in limits.iter().zip(gravity) {
        require_positive("motor_limits_n_m", limit)?;
        let share = limit.value() - gravity.value();
        require("motor_limits_n_m", limit, positive(&share), "a limit beyond gravity's share")?;
        shares.push(share);
    }
    Ok(shares)
}

/// Constants over a box serve only a motion that stays in it: then a distance to keep is needed, and a goal that far inside.
pub(crate) fn require_inside(document: &Document, distances: &[Option<Number>]) -> Result<(), Flaw> {
    let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over else { return Ok(()) };
    for ((lower, upper), distance) in lower_rad.iter().zip(upper_rad).zip(distances) {
        let Some(distance) = distance else {
            return Err(Flaw::NotCovered { what: "a motion that may leave the angles the constants hold for" });
        };
        let room = upper.value() - lower.value();
        let fits = distance.value() * ratio(2, 1) <= room;
        require("distance_rad", distance, fits, "at most half the width of every joint's angles")?;
    }
    Ok(())
}

/// The shares of `rho` that the two bounds of the cubic term take: without the relative one the absolute takes all.
pub(crate) fn cubic_shares(rho: &Number, theta: &Number, relative: bool) -> Result<[BigRational; 2], Flaw> {
    require("rho", rho, positive(rho.value()), "a positive number")?;
    require("theta", theta, unit_interval(theta.value()), "a share in [0, 1]")?;
    if !relative && !theta.value().is_one() {
        return Err(Flaw::Missing { constant: "k_r" });
    }
    let absolute = theta.value() * rho.value();
    Ok([absolute.clone(), rho.value() - absolute])
}

/// A witness's weights as numbers.
pub(crate) fn energy(p: &Number, b: &[Number; STATES], s: &[Number]) -> Result<Energy<BigRational>, Flaw> {
    let s: &[Number; TRIANGLE] =
        s.try_into().map_err(|_| Flaw::Length { quantity: "s", found: s.len(), expected: TRIANGLE })?;
    let value = |x: &Number| x.value().clone();
    Ok(Energy { p: value(p), b: b.each_ref().map(value), s: s.each_ref().map(value) })
}

pub(crate) fn require_compensation(document: &Document) -> Result<(), Flaw> {
    let covered = document.family.gravity_compensation;
    if covered { Ok(()) } else { Err(Flaw::NotCovered { what: "moving goals without gravity compensation" }) }
}

/// The loop as the proof sees it.
#[derive(Clone, Debug)]
pub struct RegionProblem<T> {
    /// The controller of each joint.
    pub controller: Controller<T>,
    /// Ends of the inertia eigenvalues.
    pub inertia: [T; 2],
    /// Ends of the viscous friction.
    pub friction: [T; 2],
    /// Largest gravity stiffness, zero when gravity is compensated.
    pub stiffness: T,
    /// `k_c`.
    pub coriolis: T,
    /// `k_r`, when it is known.
    pub coriolis_relative: Option<T>,
    /// Whether the friction is an interval.
    pub has_friction: bool,
    /// Whether gravity acts.
    pub has_gravity: bool,
}

/// A point of the search: weights, bounds and multipliers.
#[derive(Clone, Debug)]
pub struct RegionPoint<T> {
    /// `p, b, S`.
    pub energy: Energy<T>,
    /// `rho^2`.
    pub rho_squared: T,
    /// `rho theta`.
    pub absolute: T,
    /// `rho (1 - theta)`.
    pub relative: T,
    /// Multiplier of the friction interval.
    pub friction_multiplier: T,
    /// Multiplier of the gravity residue.
    pub gravity_multiplier: T,
    /// Multiplier of the torque at the start.
    pub start_multiplier: T,
}

/// A state that the region bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// `e`.
    Position,
    /// `u~`.
    Torque,
}

impl State {
    pub(crate) fn index(self) -> usize {
        match self {
            Self::Position => 0,
            Self::Torque => STATES - 1,
        }
    }
}

/// The first coordinate of z.
const Z: usize = 1;

impl RegionProblem<BigRational> {
    /// The loop that a document describes.
    ///
    /// # Errors
    /// [`Flaw`] when it has another controller, or gains that differ between joints.
    pub fn new(document: &Document) -> Result<Self, Flaw> {
        let controller = document.gains.aic()?.shared(document.arm.joints)?.matrices();
        let bounds = &document.constants.bounds;
        let LoopBox { inertia, friction, stiffness: [_, stiffness] } = family_box(document);
        let values = |interval: [Number; 2]| interval.map(|end| end.value().clone());
        Ok(Self {
            controller,
            has_friction: friction[1].value() > friction[0].value(),
            has_gravity: !stiffness.value().is_zero(),
            inertia: values(inertia),
            friction: values(friction),
            stiffness: stiffness.value().clone(),
            coriolis: bounds.k_c_kg_m2.value().clone(),
            coriolis_relative: bounds.k_r.as_ref().map(|k_r| k_r.value().clone()),
        })
    }

    /// The same over another field.
    pub fn map<T>(&self, convert: impl Fn(&BigRational) -> T) -> RegionProblem<T> {
        RegionProblem {
            controller: self.controller.map(&convert),
            inertia: self.inertia.each_ref().map(&convert),
            friction: self.friction.each_ref().map(&convert),
            stiffness: convert(&self.stiffness),
            coriolis: convert(&self.coriolis),
            coriolis_relative: self.coriolis_relative.as_ref().map(&convert),
            has_friction: self.has_friction,
            has_gravity: self.has_gravity,
        }
    }
}

impl<T: Field> RegionProblem<T> {
    /// Coordinates (dq, z, ..) at inertia m.
    fn quantities(order: usize, m: &T) -> Quantities<T> {
        let dq = Row::coordinate(order, 0, T::one());
        let z = (0..STATES).map(|k| Row::coordinate(order, Z + k, T::one())).collect();
        Quantities { order, pi: dq.times(m), dq, z }
    }

    /// A lower bound of V over (dq, z, ..): its potential is at least `-p k_g |e|^2`.
    fn least_value(&self, point: &RegionPoint<T>, at: &Quantities<T>) -> Form<T> {
        let mut form = point.energy.value(at);
        form.add(&-(point.energy.p.clone() * &self.stiffness), &at.z[0], &at.z[0]);
        form
    }

    /// Over (dq, z, 1): `[[P(m) - p k_g e e', beta], [beta', rho^2]]`, `beta = (0, b)`.
    pub fn containment(&self, point: &RegionPoint<T>, m: &T) -> Form<T> {
        let order = Z + STATES + 1;
        let at = Self::quantities(order, m);
        let mut form = self.least_value(point, &at);
        let one = Row::coordinate(order, order - 1, T::one());
        form.add(&T::fraction(2, 1), &point.energy.y(&at), &one);
        form.add(&point.rho_squared, &one, &one);
        form
    }

    /// Over (dq, z): `P(m) - p k_g e e' - inverse_square x x'` for a state x.
    pub fn within(&self, point: &RegionPoint<T>, m: &T, state: State, inverse_square: &T) -> Form<T> {
        let at = Self::quantities(Z + STATES, m);
        let mut form = self.least_value(point, &at);
        let state = &at.z[state.index()];
        form.add(&-inverse_square.clone(), state, state);
        form
    }

    /// Over (dq, z, f, w), the last two as far as friction is an interval and gravity acts: minus the form of
    /// `dV/dt + 2 rate V` with the multiplier terms.
    pub fn decay(&self, point: &RegionPoint<T>, rate: &T, m: &T) -> Form<T> {
        let order = Z + STATES + usize::from(self.has_friction) + usize::from(self.has_gravity);
        let at = Self::quantities(order, m);
        let unit = |index| Row::coordinate(order, index, T::one());
        let absent = || Row::zero(order);
        let f = if self.has_friction { unit(Z + STATES) } else { absent() };
        let w = if self.has_gravity { unit(order - 1) } else { absent() };
        let [d0, d1] = &self.friction;
        let minus = -T::one();
        let powered = at.z[STATES - 1].plus(&-d0.clone(), &at.dq).plus(&minus, &f);
        let mut form = point.energy.change(&at, &self.controller, &powered.plus(&minus, &w), &powered);
        // The cubic term is at most 2 rho (theta k_c + (1 - theta) k_r m) |dq|^2.
        let two = T::fraction(2, 1);
        form.add(&(two.clone() * &point.absolute * &self.coriolis), &at.dq, &at.dq);
        if let Some(k_r) = &self.coriolis_relative {
            form.add(&(two.clone() * &point.relative * k_r), &at.dq, &at.pi);
        }
        // V's potential is at most p k_g |e|^2.
        let twice_rate = two * rate;
        form.add_form(&twice_rate, &point.energy.value(&at));
        form.add(&(twice_rate * &point.energy.p * &self.stiffness), &at.z[0], &at.z[0]);
        // f'((d1 - d0) dq - f) >= 0 and k_g^2 |e|^2 - |w|^2 >= 0.
        let slack = at.dq.times(&(d1.clone() - d0)).plus(&minus, &f);
        form.add(&point.friction_multiplier, &f, &slack);
        let squared = self.stiffness.clone() * &self.stiffness * &point.gravity_multiplier;
        form.add(&squared, &at.z[0], &at.z[0]);
        form.add(&-point.gravity_multiplier.clone(), &w, &w);
        form.negated()
    }

    /// Over (e0, u~0), the latter where gravity acts: `e = m = e0`, the rest zero, `|u~0| <= k_g |e0|`; positive definite when
    /// `V < inverse_square |e0|^2`.
    pub fn start(&self, point: &RegionPoint<T>, inverse_square: &T) -> Form<T> {
        let bound = inverse_square.clone() - &(point.energy.p.clone() * &self.stiffness);
        if !self.has_gravity {
            return Form(vec![vec![bound - &point.energy.start_weight()]]);
        }
        let multiplier = &point.start_multiplier;
        let bound = bound - &(self.stiffness.clone() * &self.stiffness * multiplier);
        point.energy.start_excess(bound, multiplier.clone())
    }
}
