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
use num_traits::{Signed, ToPrimitive, Zero};
use serde::{Deserialize, Serialize};

use super::{ClaimKind, Figure, Inequality, Provable, all_hold, family_box};
use crate::aic::STATES;
use crate::document::Document;
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::normed::require_norm;
use crate::number::{Number, positive, ratio, unit_interval};
use crate::quantity::{require, require_at_least_zero, require_length, require_positive};

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

    fn sentence(&self, _: &Document) -> String {
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
            "with {acting} (2-norms over the joints): from rest {start}, beliefs at the measurement (mu = q as measured, mu' = dq as measured, \
             mu'' = 0) and zero controller torque, the arm stays within {} rad of the goal {end}",
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
    let v = check(claim)?;
    if arm.coriolis_relative.is_none() && v.theta != ratio(1, 1) {
        return Err(Flaw::Missing { constant: "k_r" });
    }
    let value = |number: &Number| number.value().clone();
    let (rho, rate) = (value(&claim.witness.rho), value(&claim.rate_per_s));
    let excursion = value(&claim.excursion_rad);
    let closeness = (&excursion * &excursion).recip();
    let mut all = Vec::new();
    let mut record = |name: String, form: Form<BigRational>| all.push(Inequality::decide(name, &form.0));
    for (m, end) in family_box(document).inertia.iter().zip(["least", "largest"]) {
        record(format!("containment at the {end} inertia"), v.containment(m.value(), &rho));
        record(format!("decay at the {end} inertia"), arm.decay(&v, m.value(), &rho, &rate));
        record(format!("excursion at the {end} inertia"), v.excursion(m.value(), &closeness));
    }
    let start = arm.start(&v, claim.witness.start_shares.each_ref().map(Number::value));
    if !start.0.is_empty() {
        record("start".to_owned(), start);
    }
    let level: BigRational = v.disturbance_shares.iter().sum();
    let ultimate = claim.ultimate_rad.value();
    if level.is_zero() {
        require("ultimate_rad", &claim.ultimate_rad, ultimate.is_zero(), "0 where nothing disturbs")?;
    } else {
        record("ultimate".to_owned(), Form(vec![vec![ultimate * ultimate - &excursion * &excursion * level]]));
    }
    Ok(all)
}

/// The arm, the controller and what disturbs them.
#[derive(Clone, Debug)]
pub struct DisturbedArm<T> {
    /// `dz/dt = a z + b dq`, z = (e, m, mu', mu'', u~).
    pub a: [[T; 5]; 5],
    /// See `a`.
    pub b: [T; 5],
    /// Least and largest friction, N m s/rad.
    pub friction: [T; 2],
    /// k_c, kg m^2.
    pub coriolis: T,
    /// k_r.
    pub coriolis_relative: Option<T>,
    /// Bounds of position noise, velocity noise and torque; `None` for what is zero.
    pub disturbances: [Option<T>; 3],
    /// Bounds at the start of distance, position noise, velocity noise and push; `None` for what is zero.
    pub start: [Option<T>; 4],
}

impl DisturbedArm<BigRational> {
    /// What a claim's bounds say about a document; its witness is not looked at.
    ///
    /// # Errors
    /// [`Flaw`] for another controller, gains that differ between joints, or a family that the proof does not cover.
    pub fn new(document: &Document, claim: &DisturbanceClaim) -> Result<Self, Flaw> {
        require_norm(document)?;
        let controller = document.gains.aic()?.shared(document.arm.joints)?.matrices();
        let friction = family_box(document).friction.map(|end| end.value().clone());
        let bounds = &document.constants.bounds;
        let bound = |number: &Number| (!number.value().is_zero()).then(|| number.value().clone());
        let [position, velocity] = [bound(&claim.position_noise_rad), bound(&claim.velocity_noise_rad_per_s)];
        Ok(Self {
            a: controller.a,
            b: controller.b,
            friction,
            coriolis: bounds.k_c_kg_m2.value().clone(),
            coriolis_relative: bounds.k_r.as_ref().map(|number| number.value().clone()),
            disturbances: [position.clone(), velocity.clone(), bound(&claim.torque_n_m)],
            start: [bound(&claim.radius_rad), position, velocity, bound(&claim.push_n_m)],
        })
    }

    /// The nearest floating-point numbers, for a search.
    pub fn to_f64(&self) -> DisturbedArm<f64> {
        let float = |x: &BigRational| x.to_f64().unwrap_or(f64::NAN);
        DisturbedArm {
            a: self.a.each_ref().map(|row| row.each_ref().map(float)),
            b: self.b.each_ref().map(float),
            friction: self.friction.each_ref().map(float),
            coriolis: float(&self.coriolis),
            coriolis_relative: self.coriolis_relative.as_ref().map(float),
            disturbances: self.disturbances.each_ref().map(|x| x.as_ref().map(float)),
            start: self.start.each_ref().map(|x| x.as_ref().map(float)),
        }
    }
}

/// The unknowns of the proof.
#[derive(Clone, Debug)]
pub struct DisturbanceUnknowns<T> {
    /// Weight of the kinetic energy.
    pub p: T,
    /// Cross terms.
    pub b: [T; 5],
    /// The symmetric matrix S.
    pub s: [[T; 5]; 5],
    /// Share of k_c in the cubic term.
    pub theta: T,
    /// Multiplier of the friction interval.
    pub friction_multiplier: T,
    /// Shares of position noise, velocity noise and torque.
    pub disturbance_shares: [T; 3],
}

/// Coordinates: dq, then z, then f where friction is an interval, then the disturbances that act.
const DQ: usize = 0;
const Z: usize = 1;

impl<T: Field> DisturbanceUnknowns<T> {
    /// Adds `scale V` over coordinates that begin with (dq, z).
    fn add_value(&self, form: &mut Form<T>, m: &T, scale: &T) {
        let order = form.0.len();
        let at = |k: usize| Row::coordinate(order, k, T::one());
        let z: Vec<Row<T>> = (0..STATES).map(|k| at(Z + k)).collect();
        let y = Row::combination(order, &self.b, &z);
        form.add(&(self.p.clone() * m * scale), &at(DQ), &at(DQ));
        form.add(&(T::fraction(2, 1) * m * scale), &at(DQ), &y);
        for (i, row) in self.s.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                form.add(&(entry.clone() * scale), &z[i], &z[j]);
            }
        }
    }

    /// `[[P(m), beta], [beta', rho^2]]`.
    pub fn containment(&self, m: &T, rho: &T) -> Form<T> {
        let order = Z + STATES + 1;
        let mut form = Form::zero(order);
        self.add_value(&mut form, m, &T::one());
        let last = Row::coordinate(order, order - 1, T::one());
        let z: Vec<Row<T>> = (0..STATES).map(|k| Row::coordinate(order, Z + k, T::one())).collect();
        form.add(&T::fraction(2, 1), &Row::combination(order, &self.b, &z), &last);
        form.add(&(rho.clone() * rho), &last, &last);
        form
    }

    /// `P(m) - closeness e_e e_e'`.
    pub fn excursion(&self, m: &T, closeness: &T) -> Form<T> {
        let order = Z + STATES;
        let mut form = Form::zero(order);
        self.add_value(&mut form, m, &T::one());
        let e = Row::coordinate(order, Z, T::one());
        form.add(&-closeness.clone(), &e, &e);
        form
    }
}

impl<T: Field> DisturbedArm<T> {
    /// Whether the friction is an interval, told by the caller's ordering of its ends.
    fn span(&self) -> T {
        self.friction[1].clone() - &self.friction[0]
    }
}

impl<T: Field + PartialOrd> DisturbedArm<T> {
    /// Minus the form of `dV/dt + 2 rate V - 2 rate sum_i t_i |n_i|^2 / max_i^2`, with the bound of the cubic term and the multiplier of f.
    pub fn decay(&self, v: &DisturbanceUnknowns<T>, m: &T, rho: &T, rate: &T) -> Form<T> {
        let has_friction = self.span() > T::zero();
        let first = Z + STATES + usize::from(has_friction);
        let order = first + self.disturbances.iter().flatten().count();
        let at = |k: usize| Row::coordinate(order, k, T::one());
        let (dq, two) = (at(DQ), T::fraction(2, 1));
        let z: Vec<Row<T>> = (0..STATES).map(|k| at(Z + k)).collect();
        let f = if has_friction { at(Z + STATES) } else { Row::zero(order) };
        // What acts, in the order of the coordinates behind f.
        let mut next = first;
        let [position, velocity, torque] = self.disturbances.each_ref().map(|bound| match bound {
            Some(_) => {
                next += 1;
                at(next - 1)
            }
            None => Row::zero(order),
        });
        // The controller knows q and dq as measured; e itself follows the true velocity.
        let z_dot: Vec<Row<T>> = (0..STATES)
            .map(|i| {
                let clean = Row::combination(order, &self.a[i], &z).plus(&self.b[i], &dq);
                let noisy = clean.plus(&self.a[i][0], &position);
                if i == 0 { noisy } else { noisy.plus(&self.b[i], &velocity) }
            })
            .collect();
        let y = Row::combination(order, &v.b, &z);
        let y_dot = Row::combination(order, &v.b, &z_dot);
        let minus = -T::one();
        let force = z[STATES - 1].plus(&-self.friction[0].clone(), &dq).plus(&minus, &f).plus(&T::one(), &torque);
        let mut form = Form::zero(order);
        form.add(&(two.clone() * &v.p), &dq, &force);
        form.add(&two, &y, &force);
        form.add(&(two.clone() * m), &dq, &y_dot);
        for (i, row) in v.s.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                form.add(&(two.clone() * entry), &z[i], &z_dot[j]);
            }
        }
        let relative = self.coriolis_relative.clone().unwrap_or_else(T::zero);
        let cubic = v.theta.clone() * &self.coriolis + &((T::one() - &v.theta) * &relative * m);
        form.add(&(two.clone() * rho * &cubic), &dq, &dq);
        v.add_value(&mut form, m, &(two.clone() * rate));
        form.add(&v.friction_multiplier, &f, &dq.times(&self.span()).plus(&minus, &f));
        for (share, (row, bound)) in
            v.disturbance_shares.iter().zip([position, velocity, torque].iter().zip(&self.disturbances))
        {
            if let Some(bound) = bound {
                let weight = two.clone() * rate * share / &(bound.clone() * bound);
                form.add(&-weight, row, row);
            }
        }
        form.negated()
    }

    /// `sum_i share_i x_i^2 / max_i^2 - V(0)` over what the start may hold: distance, noise in the two beliefs, push.
    pub fn start(&self, v: &DisturbanceUnknowns<T>, shares: [&T; 4]) -> Form<T> {
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
        for (i, row) in v.s.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                form.add(&-entry.clone(), &z[i], &z[j]);
            }
        }
        form
    }
}

/// Checks the claim's numbers and reads its witness.
fn check(claim: &DisturbanceClaim) -> Result<DisturbanceUnknowns<BigRational>, Flaw> {
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
    require("p", &witness.p, positive(witness.p.value()), "a positive number")?;
    require("rho", &witness.rho, positive(witness.rho.value()), "a positive number")?;
    require("theta", &witness.theta, unit_interval(witness.theta.value()), "a share in [0, 1]")?;
    let multiplier = &witness.friction_multiplier;
    require("friction_multiplier", multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
    check_shares("disturbance_shares", &witness.disturbance_shares)?;
    check_shares("start_shares", &witness.start_shares)?;
    let acting = [&claim.position_noise_rad, &claim.velocity_noise_rad_per_s, &claim.torque_n_m];
    for (share, bound) in witness.disturbance_shares.iter().zip(acting) {
        let spent = !bound.value().is_zero() || share.value().is_zero();
        require("disturbance_shares", share, spent, "0 for what does not disturb")?;
    }
    require_length("s", witness.s.len(), 15)?;
    let mut s: [[BigRational; 5]; 5] = core::array::from_fn(|_| core::array::from_fn(|_| ratio(0, 1)));
    let places = (0..STATES).flat_map(|i| (i..STATES).map(move |j| (i, j)));
    for ((i, j), entry) in places.zip(&witness.s) {
        s[i][j].clone_from(entry.value());
        s[j][i].clone_from(entry.value());
    }
    Ok(DisturbanceUnknowns {
        p: witness.p.value().clone(),
        b: witness.b.each_ref().map(|x| x.value().clone()),
        s,
        theta: witness.theta.value().clone(),
        friction_multiplier: multiplier.value().clone(),
        disturbance_shares: witness.disturbance_shares.each_ref().map(|x| x.value().clone()),
    })
}

/// Not negative, and together at most 1.
fn check_shares(quantity: &'static str, shares: &[Number]) -> Result<(), Flaw> {
    for share in shares {
        require(quantity, share, !share.value().is_negative(), "a share of at least 0")?;
    }
    let sum: BigRational = shares.iter().map(Number::value).sum();
    if sum <= ratio(1, 1) { Ok(()) } else { Err(Flaw::quantity(quantity, &sum.to_string(), "a sum of at most 1")) }
}
