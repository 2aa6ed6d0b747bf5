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
use num_traits::Signed;
use serde::{Deserialize, Serialize};

use super::energy::{Energy, Plant, Point, Quantities, State};
use super::{ClaimKind, Figure, Inequality, LoopBox, Provable, all_hold, family_box};
use crate::aic::STATES;
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::normed::{Norm, Normed};
use crate::number::{Number, positive, ratio};
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
        let torque = starting_torque(document);
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

/// The controller's torque at the start, in words.
pub(crate) fn starting_torque(document: &Document) -> &'static str {
    if document.family.gravity_compensation {
        "with zero controller torque"
    } else {
        "with the controller's torque holding gravity there"
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
    all.push(Inequality::decide(
        "start".to_owned(),
        &problem.plant.start(&point, &inverse_square(&claim.radius_rad)).0,
    ));
    Ok(all)
}

impl RegionClaim {
    /// Weight s of a goal step: with gravity compensated, V at rest at the old goal is `s |step|^2` for the new one.
    ///
    /// # Errors
    /// [`Flaw`] when the claim is about uncompensated gravity or its witness has the wrong length.
    pub fn start_weight(&self, document: &Document) -> Result<BigRational, Flaw> {
        require_compensation(document)?;
        Ok(Energy::of(&self.witness.p, &self.witness.b, &self.witness.s)?.start_weight())
    }

    /// The witness as numbers, once the claim's own are what the proof allows.
    pub(crate) fn checked(
        &self,
        document: &Document,
        problem: &RegionProblem<BigRational>,
    ) -> Result<Point<BigRational>, Flaw> {
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
        let joints = document.family.joints();
        require_inside(document, &vec![self.distance_rad.clone(); joints])?;
        let witness = &self.witness;
        // A witness is only ever computed with: dyadics of any size will do.
        let [absolute, relative] = problem.plant.shares(&witness.rho, &witness.theta)?;
        for (name, multiplier) in [
            ("friction_multiplier", &witness.friction_multiplier),
            ("gravity_multiplier", &witness.gravity_multiplier),
            ("start_multiplier", &witness.start_multiplier),
        ] {
            require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
        }
        Ok(Point {
            energy: Energy::of(&witness.p, &witness.b, &witness.s)?,
            rho_squared: witness.rho.value() * witness.rho.value(),
            absolute,
            relative,
            interval_multiplier: witness.friction_multiplier.value().clone(),
            gravity_multiplier: witness.gravity_multiplier.value().clone(),
            start_multiplier: witness.start_multiplier.value().clone(),
        })
    }
}

impl Normed for RegionClaim {
    fn norm(&self, document: &Document) -> Result<Norm, Flaw> {
        let joints = document.family.joints();
        Ok(Norm {
            shift_weights: vec![self.start_weight(document)?; joints],
            rate: self.rate_per_s.value().clone(),
            period: None,
            kept: self.distance_rad.clone().map(|distance| vec![distance; joints]),
        })
    }

    fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw> {
        let problem = RegionProblem::new(document)?;
        let point = self.checked(document, &problem)?;
        let closeness = (most * most).recip();
        let at = |(m, end): (&BigRational, &str)| {
            let form = problem.within(&point, m, State::Position, &closeness);
            Inequality::decide(format!("distance at the {end} inertia"), &form.0)
        };
        Ok(problem.inertia.iter().zip(["least", "largest"]).map(at).collect())
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

pub(crate) fn require_compensation(document: &Document) -> Result<(), Flaw> {
    let covered = document.family.gravity_compensation;
    if covered { Ok(()) } else { Err(Flaw::NotCovered { what: "moving goals without gravity compensation" }) }
}

/// The loop as the proof sees it.
#[derive(Clone, Debug)]
pub struct RegionProblem<T> {
    /// Controller and constants.
    pub plant: Plant<T>,
    /// Ends of the inertia eigenvalues.
    pub inertia: [T; 2],
    /// Ends of the viscous friction.
    pub friction: [T; 2],
    /// Whether the friction is an interval.
    pub has_friction: bool,
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
        let LoopBox { inertia, friction, .. } = family_box(document);
        let values = |interval: [Number; 2]| interval.map(|end| end.value().clone());
        Ok(Self {
            plant: Plant::new(document, controller),
            has_friction: friction[1].value() > friction[0].value(),
            inertia: values(inertia),
            friction: values(friction),
        })
    }

    /// The same over another field.
    pub fn map<T>(&self, convert: impl Fn(&BigRational) -> T) -> RegionProblem<T> {
        RegionProblem {
            plant: self.plant.map(&convert),
            inertia: self.inertia.each_ref().map(&convert),
            friction: self.friction.each_ref().map(&convert),
            has_friction: self.has_friction,
        }
    }
}

impl<T: Field> RegionProblem<T> {
    /// Coordinates (dq, z, ..) at inertia m.
    pub(crate) fn quantities(order: usize, m: &T) -> Quantities<T> {
        let dq = Row::coordinate(order, 0, T::one());
        let z = (0..STATES).map(|k| Row::coordinate(order, Z + k, T::one())).collect();
        Quantities { order, pi: dq.times(m), dq, z }
    }

    /// Over (dq, z, 1): `[[P(m) - p k_g e e', beta], [beta', rho^2]]`, `beta = (0, b)`.
    pub fn containment(&self, point: &Point<T>, m: &T) -> Form<T> {
        self.plant.containment(point, &Self::quantities(Z + STATES + 1, m))
    }

    /// Over (dq, z): `P(m) - p k_g e e' - inverse_square x x'` for a state x.
    pub fn within(&self, point: &Point<T>, m: &T, state: State, inverse_square: &T) -> Form<T> {
        self.plant.within(point, &Self::quantities(Z + STATES, m), state, inverse_square)
    }

    /// Over (dq, z, f, w), the last two as far as friction is an interval and gravity acts: minus the form of
    /// `dV/dt + 2 rate V` with the multiplier terms.
    pub fn decay(&self, point: &Point<T>, rate: &T, m: &T) -> Form<T> {
        let has_gravity = self.plant.has_gravity;
        let order = Z + STATES + usize::from(self.has_friction) + usize::from(has_gravity);
        let at = Self::quantities(order, m);
        let unit = |index| Row::coordinate(order, index, T::one());
        let f = if self.has_friction { unit(Z + STATES) } else { Row::zero(order) };
        let w = if has_gravity { unit(order - 1) } else { Row::zero(order) };
        let [d0, d1] = &self.friction;
        let mut form = self.plant.change(point, &at, [d0, rate], [&f, &w]);
        // f'((d1 - d0) dq - f) >= 0.
        let slack = at.dq.times(&(d1.clone() - d0)).plus(&-T::one(), &f);
        form.add(&point.interval_multiplier, &f, &slack);
        form.negated()
    }
}
