//! Claim `disturbance`: the error stays bounded under bounded noise and pushes.
//!
//! The controller is told `q + n_q` and `dq + n_v`; a torque `w` acts on the joints besides the motors. With `z`, `y` and V as in `region`
//! (gravity compensated), `dz/dt = A z + B dq + N_q n_q + N_v n_v` and `M ddq = -C dq - d0 dq - f + u~ + w`:
//!
//! ```text
//! dV/dt + 2 rate V < 2 rate sum_i t_i |n_i|^2 / max_i^2   wherever |y| <= rho,   sum_i t_i <= 1
//! ```
//!
//! over the three disturbances `n_q, n_v, w`. So `{V <= 1}` is kept, and V ends at no more than `sum_i t_i`. A constant push only moves the
//! equilibrium of the torque: it is a start with `|u~|` as large as the push.
//!
//! | inequality | says |
//! |---|---|
//! | containment | `V <= 1` implies `\|y\| <= rho` |
//! | decay | the line above, with a multiplier for f |
//! | start | at rest within `radius`, with the first noise in the beliefs and the push in the torque, `V <= 1` |
//! | excursion | `V <= 1` implies `\|e\| <= excursion` |
//! | ultimate | `excursion^2 sum_i t_i < ultimate^2` |
//!
//! The derivation is in `proofs/claims/disturbance.md`.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use serde::{Deserialize, Serialize};

use super::energy::{Energy, Plant, Point, Quantities, State};
use super::region::{RegionProblem, goal_inside, require_compensation, require_inside};
use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::aic::STATES;
use crate::document::Document;
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::number::{Number, ratio};
use crate::quantity::{require, require_at_least_zero, require_positive};

/// The error stays bounded under bounded noise and pushes. All norms are 2-norms over the joints.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceClaim {
    /// The measured positions are never further off, rad.
    pub position_noise_rad: Number,
    /// The measured velocities are never further off, rad/s.
    pub velocity_noise_rad_per_s: Number,
    /// A torque besides the motors', of any course in time, is never larger, N m.
    pub torque_n_m: Number,
    /// A constant torque besides the motors', from the start on, is no larger, N m.
    pub push_n_m: Number,
    /// Every start at rest within this distance of the goal is covered, rad.
    pub radius_rad: Number,
    /// The rate of the inequality `decay`, 1/s.
    pub rate_per_s: Number,
    /// The arm is never further from the goal, rad.
    pub excursion_rad: Number,
    /// Nor, in the end, further than this, rad.
    pub ultimate_rad: Number,
    /// The numbers that prove it.
    pub witness: DisturbanceWitness,
}

/// The Lyapunov function and multipliers of a disturbance claim, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisturbanceWitness {
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
    /// Shares t of position noise, velocity noise and torque.
    pub disturbance_shares: [Number; 3],
    /// Shares at the start of distance, position noise, velocity noise and push.
    pub start_shares: [Number; 4],
}

impl Provable for DisturbanceClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::Disturbance
    }

    fn sentence(&self, document: &Document) -> String {
        let mut acting = Vec::new();
        let mut name = |number: &Number, text: String| {
            if !number.value().is_zero() {
                acting.push(text);
            }
        };
        name(
            &self.position_noise_rad,
            format!("position measurements off by at most {} rad at every instant", self.position_noise_rad),
        );
        name(
            &self.velocity_noise_rad_per_s,
            format!("velocity measurements off by at most {} rad/s at every instant", self.velocity_noise_rad_per_s),
        );
        name(&self.torque_n_m, format!("a torque on the joints of any course and at most {} N m", self.torque_n_m));
        name(
            &self.push_n_m,
            format!("a constant torque on the joints of at most {} N m from the start on", self.push_n_m),
        );
        let acting = if acting.is_empty() { "no disturbance".to_owned() } else { acting.join(", ") };
        let start = if self.radius_rad.value().is_zero() {
            "at a constant goal".to_owned()
        } else {
            format!("at any configuration within {} rad of a constant goal", self.radius_rad)
        };
        let end = if self.ultimate_rad.value().is_zero() {
            "and converges to the goal".to_owned()
        } else {
            format!("and in the limit of time within {} rad", self.ultimate_rad)
        };
        format!(
            "with {acting} (2-norms over the joints): from rest {start}{}, beliefs at the measurement (mu = q as measured, mu' = dq as measured, \
             mu'' = 0) and zero controller torque, the arm stays within {} rad of the goal {end}",
            goal_inside(document, Some(self.excursion_rad.to_string())),
            self.excursion_rad
        )
    }

    fn scope(&self, _: &Document) -> String {
        "continuous time, no torque limit, no delay, noise in the controller's measurements alone, no Coulomb friction, joint limits not \
         modelled"
            .to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        vec![
            Figure { name: "ultimate error", value: self.ultimate_rad.clone(), unit: "rad" },
            Figure { name: "excursion", value: self.excursion_rad.clone(), unit: "rad" },
            Figure { name: "radius", value: self.radius_rad.clone(), unit: "rad" },
        ]
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(disturbance_inequalities(document, self)?)
    }
}

/// The inequalities of a disturbance claim about `document`, in the order of the module's table, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn disturbance_inequalities(document: &Document, claim: &DisturbanceClaim) -> Result<Vec<Inequality>, Flaw> {
    let arm = DisturbedArm::new(document, claim)?;
    check(claim)?;
    // Constants over a box of angles serve only a motion that stays in it.
    require_inside(document, &vec![Some(claim.excursion_rad.clone()); document.family.joints()])?;
    let point = claim.witness.point(&arm.region.plant)?;
    let shares = claim.witness.disturbance_shares.each_ref().map(|x| x.value().clone());
    let excursion = claim.excursion_rad.value();
    let closeness = (excursion * excursion).recip();
    let mut all = Vec::new();
    let mut record = |name: String, form: Form<BigRational>| all.push(Inequality::decide(name, &form.0));
    for (m, end) in arm.region.inertia.iter().zip(["least", "largest"]) {
        record(format!("containment at the {end} inertia"), arm.region.containment(&point, m));
        record(format!("decay at the {end} inertia"), arm.decay(&point, &shares, claim.rate_per_s.value(), m));
        let within = arm.region.within(&point, m, State::Position, &closeness);
        record(format!("excursion at the {end} inertia"), within);
    }
    let start = arm.start(&point, claim.witness.start_shares.each_ref().map(Number::value));
    if !start.0.is_empty() {
        record("start".to_owned(), start);
    }
    let level: BigRational = shares.iter().sum();
    let ultimate = claim.ultimate_rad.value();
    if level.is_zero() {
        require("ultimate_rad", &claim.ultimate_rad, ultimate.is_zero(), "0 where nothing disturbs")?;
    } else {
        record("ultimate".to_owned(), Form(vec![vec![ultimate * ultimate - excursion * excursion * level]]));
    }
    Ok(all)
}

/// The loop and what disturbs it.
#[derive(Clone, Debug)]
pub struct DisturbedArm<T> {
    /// The loop without disturbances.
    pub region: RegionProblem<T>,
    /// Bounds of position noise, velocity noise and torque; `None` for what is zero.
    pub disturbances: [Option<T>; 3],
    /// Bounds at the start of distance, position noise, velocity noise and push; `None` for what is zero.
    pub start: [Option<T>; 4],
}

impl DisturbedArm<BigRational> {
    /// What a claim's bounds say about a document; its witness is not looked at.
    ///
    /// # Errors
    /// [`Flaw`] for another controller, gains that differ between joints, or gravity that is not compensated.
    pub fn new(document: &Document, claim: &DisturbanceClaim) -> Result<Self, Flaw> {
        require_compensation(document)?;
        let bound = |number: &Number| (!number.value().is_zero()).then(|| number.value().clone());
        let [position, velocity] = [bound(&claim.position_noise_rad), bound(&claim.velocity_noise_rad_per_s)];
        Ok(Self {
            region: RegionProblem::new(document)?,
            disturbances: [position.clone(), velocity.clone(), bound(&claim.torque_n_m)],
            start: [bound(&claim.radius_rad), position, velocity, bound(&claim.push_n_m)],
        })
    }

    /// The same over another field.
    pub fn map<T>(&self, convert: impl Fn(&BigRational) -> T) -> DisturbedArm<T> {
        DisturbedArm {
            region: self.region.map(&convert),
            disturbances: self.disturbances.each_ref().map(|x| x.as_ref().map(&convert)),
            start: self.start.each_ref().map(|x| x.as_ref().map(&convert)),
        }
    }
}

/// The first coordinate of z, after dq.
const Z: usize = 1;

impl<T: Field> DisturbedArm<T> {
    /// Over (dq, z, f, the disturbances that act): minus the form of `dV/dt + 2 rate V - 2 rate sum_i t_i |n_i|^2 / max_i^2`, with the bound of
    /// the cubic term and the multiplier of f.
    pub fn decay(&self, point: &Point<T>, shares: &[T; 3], rate: &T, m: &T) -> Form<T> {
        let first = Z + STATES + usize::from(self.region.has_friction);
        let order = first + self.disturbances.iter().flatten().count();
        let unit = |index| Row::coordinate(order, index, T::one());
        let at = RegionProblem::quantities(order, m);
        let minus = -T::one();
        let f = if self.region.has_friction { unit(Z + STATES) } else { Row::zero(order) };
        let mut next = first;
        let acting = self.disturbances.each_ref().map(|bound| {
            next += usize::from(bound.is_some());
            if bound.is_some() { unit(next - 1) } else { Row::zero(order) }
        });
        let [position, velocity, torque] = &acting;
        let Plant { controller, .. } = &self.region.plant;
        let [d0, d1] = &self.region.friction;
        let mut form = self.region.plant.change(point, &at, [d0, rate], [&f.plus(&minus, torque), &Row::zero(order)]);
        // The controller knows q and dq as measured; e itself follows the true velocity.
        let noise: Vec<Row<T>> = (0..STATES)
            .map(|i| {
                let of_position = position.times(&controller.a[i][0]);
                if i == 0 { of_position } else { of_position.plus(&controller.b[i], velocity) }
            })
            .collect();
        let two = T::fraction(2, 1);
        form.add(&two, &at.pi, &Row::combination(order, &point.energy.b, &noise));
        point.energy.add_weighted(&mut form, &two, &at, &noise);
        // f'((d1 - d0) dq - f) >= 0.
        let slack = at.dq.times(&(d1.clone() - d0)).plus(&minus, &f);
        form.add(&point.interval_multiplier, &f, &slack);
        for ((share, bound), row) in shares.iter().zip(&self.disturbances).zip(&acting) {
            if let Some(bound) = bound {
                let weight = two.clone() * rate * share / &(bound.clone() * bound);
                form.add(&-weight, row, row);
            }
        }
        form.negated()
    }

    /// `sum_i share_i x_i^2 / max_i^2 - V(0)` over what the start may hold: distance, noise in the two beliefs, push.
    pub fn start(&self, point: &Point<T>, shares: [&T; 4]) -> Form<T> {
        let order = self.start.iter().flatten().count();
        let mut form = Form::zero(order);
        let mut z = vec![Row::zero(order); STATES];
        let places: [&[usize]; 4] = [&[0, 1], &[1], &[2], &[4]];
        let mut next = 0;
        for ((bound, share), places) in self.start.iter().zip(shares).zip(places) {
            let Some(bound) = bound else { continue };
            let source = Row::coordinate(order, next, T::one());
            next += 1;
            for &place in places {
                z[place] = z[place].plus(&T::one(), &source);
            }
            form.add(&(share.clone() / &(bound.clone() * bound)), &source, &source);
        }
        let at = Quantities { order, dq: Row::zero(order), pi: Row::zero(order), z };
        form.add_form(&-T::one(), &point.energy.value(&at));
        form
    }
}

impl DisturbanceWitness {
    fn point(&self, plant: &Plant<BigRational>) -> Result<Point<BigRational>, Flaw> {
        let [absolute, relative] = plant.shares(&self.rho, &self.theta)?;
        let multiplier = &self.friction_multiplier;
        require("friction_multiplier", multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
        Ok(Point {
            energy: Energy::of(&self.p, &self.b, &self.s)?,
            rho_squared: self.rho.value() * self.rho.value(),
            absolute,
            relative,
            interval_multiplier: multiplier.value().clone(),
            gravity_multiplier: ratio(0, 1),
            start_multiplier: ratio(0, 1),
        })
    }
}

fn check(claim: &DisturbanceClaim) -> Result<(), Flaw> {
    for (name, number) in [
        ("position_noise_rad", &claim.position_noise_rad),
        ("velocity_noise_rad_per_s", &claim.velocity_noise_rad_per_s),
        ("torque_n_m", &claim.torque_n_m),
        ("push_n_m", &claim.push_n_m),
        ("radius_rad", &claim.radius_rad),
        ("ultimate_rad", &claim.ultimate_rad),
    ] {
        require_at_least_zero(name, number)?;
    }
    require_positive("rate_per_s", &claim.rate_per_s)?;
    require_positive("excursion_rad", &claim.excursion_rad)?;
    let witness = &claim.witness;
    check_shares("disturbance_shares", &witness.disturbance_shares)?;
    check_shares("start_shares", &witness.start_shares)?;
    let acting = [&claim.position_noise_rad, &claim.velocity_noise_rad_per_s, &claim.torque_n_m];
    for (share, bound) in witness.disturbance_shares.iter().zip(acting) {
        let spent = !bound.value().is_zero() || share.value().is_zero();
        require("disturbance_shares", share, spent, "0 for what does not disturb")?;
    }
    Ok(())
}

/// Not negative, and together at most 1.
fn check_shares(quantity: &'static str, shares: &[Number]) -> Result<(), Flaw> {
    for share in shares {
        require(quantity, share, !share.value().is_negative(), "a share of at least 0")?;
    }
    let sum: BigRational = shares.iter().map(Number::value).sum();
    if sum <= ratio(1, 1) { Ok(()) } else { Err(Flaw::quantity(quantity, &sum.to_string(), "a sum of at most 1")) }
}
