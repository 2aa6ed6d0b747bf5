//! The matrices of the claim `sampled-region`, over any field: with rationals they decide, with `f64` a search is built from them.
//!
//! Coordinates of one eigenvector of M: `dq, vb, y, f, f_-, rb, e, m, mu', mu'', u, u_-1 .. u_-k`; f and `f_-` only when friction is an interval, `rb`
//! only when the compensation is held, and each inequality only with the coordinates that occur in it.
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | vb, y | `mean`, `mean_behind` | mean velocity of the period that starts, and of the one that ended |
//! | F, `F_-` | `force`, `force_behind` | their mean torques less friction |
//! | tau, `tau_-` | `torque`, `torque_behind` | their held torques |
//! | `(m, s)` | [`Corner`] | eigenvalue of M and a number in place of `1/m` |
//!
//! The bounds are those of `proofs/claims/sampled-region.md`.

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};

use super::sampled_region::Sampling;
use crate::aic::{Controller, STATES};
use crate::document::Bounds;
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::number::ratio;

/// A point `(m, s)`: on the curve `s = 1/m`, or where two of its tangents meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Corner<T> {
    /// Eigenvalue of the inertia matrix, kg m^2.
    pub inertia: T,
    /// In place of its inverse, 1/(kg m^2).
    pub inverse: T,
}

impl Corner<BigRational> {
    /// Corners of one triangle for each piece between rising positive points: together they cover the curve `(m, 1/m)`.
    pub fn cover(points: &[BigRational]) -> Vec<Self> {
        let on_curve = |m: &BigRational| Self { inertia: m.clone(), inverse: m.recip() };
        let mut corners: Vec<Self> = points.iter().map(on_curve).collect();
        corners.extend(points.windows(2).filter(|piece| piece[0] < piece[1]).map(|piece| {
            let sum = &piece[0] + &piece[1];
            Self { inertia: ratio(2, 1) * &piece[0] * &piece[1] / &sum, inverse: ratio(2, 1) / sum }
        }));
        corners
    }

    /// The same point in floating point, for a search.
    pub fn to_f64(&self) -> Corner<f64> {
        Corner { inertia: float(&self.inertia), inverse: float(&self.inverse) }
    }
}

/// A bound `kinetic |dq|_M^2 + torque h^2 |tau|_M^-1^2`.
#[derive(Clone, Debug, PartialEq)]
struct Bound<T> {
    kinetic: T,
    torque: T,
}

impl Bound<BigRational> {
    /// Of `(x |dq|_M + y h |tau|_M^-1)^2 <= (1 + t) x^2 .. + (1 + 1/t) y^2 ..`, rounded up.
    fn of_square(x: &BigRational, y: &BigRational, t: &BigRational) -> Self {
        let one = ratio(1, 1);
        Self { kinetic: rounded_up(&((&one + t) * x * x)), torque: rounded_up(&((&one + t.recip()) * y * y)) }
    }

    fn to_f64(&self) -> Bound<f64> {
        Bound { kinetic: float(&self.kinetic), torque: float(&self.torque) }
    }
}

/// The next multiple of 2^-40: short numbers keep the exact elimination short.
fn rounded_up(x: &BigRational) -> BigRational {
    let unit = ratio(1 << 40, 1);
    (x * &unit).ceil() / unit
}

fn float(x: &BigRational) -> f64 {
    x.to_f64().unwrap_or(f64::NAN)
}

/// One eigenvector's sampled loop with everything that is fixed before the Lyapunov function is.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledLoop<T> {
    /// `dz/dt = a z + b dq` of the controller in continuous time.
    a: [[T; STATES]; STATES],
    b: [T; STATES],
    step: T,
    delay: usize,
    rate: T,
    rho: T,
    limit: Option<T>,
    least_friction: T,
    friction_span: T,
    has_friction: bool,
    /// Gravity stiffness when the compensation is held, else 0.
    stiffness: T,
    is_held: bool,
    least_inertia: T,
    coriolis: T,
    pub(crate) coriolis_relative: Option<T>,
    /// `(k_m h / speed)^2 (|dq|_M + h |tau|_M^-1)^2`.
    speed: Bound<T>,
    /// Of the mean velocity's remainder: of the period that starts, and of the one that ended.
    ahead: Bound<T>,
    behind: Bound<T>,
    /// Of `(h max |dv/dt|_M)^2`.
    spread: Bound<T>,
    /// Largest ratio of `|.|_M^2` between instants of a period.
    metric: T,
}

/// The Lyapunov function and the multipliers, as in the claim's witness.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "fields as in SampledRegionWitness")]
pub struct SampledUnknowns<T> {
    pub p: T,
    pub b: Vec<T>,
    pub s: Vec<Vec<T>>,
    pub theta: T,
    pub decay: [T; 4],
    pub containment: [T; 4],
    pub growth: [T; 2],
    pub torque: [T; 2],
    pub held: T,
}

impl SampledLoop<BigRational> {
    pub(crate) fn new(
        controller: &Controller<BigRational>,
        sampling: &Sampling,
        [rho, speed]: [BigRational; 2],
        [least_friction, largest_friction]: [BigRational; 2],
        bounds: &Bounds,
        k_m: &BigRational,
        stiffness: BigRational,
    ) -> Result<Self, Flaw> {
        let (one, two, three) = (ratio(1, 1), ratio(2, 1), ratio(3, 1));
        let step = sampling.step_s.value();
        let m_lo = bounds.m_lo_kg_m2.value();
        let delta = step * &largest_friction / m_lo;
        let gamma = step * step * &stiffness / (&two * m_lo);
        let least = &one - &delta - &two * &gamma;
        if least < ratio(1, 4) {
            return Err(Flaw::NotCovered {
                what: "a period in which friction or gravity can change the speed by more than 3/4",
            });
        }
        let (chi, chi_behind) = ((&one - &two * &gamma).recip(), least.recip());
        let a = &speed * &chi;
        if a > ratio(1, 8) {
            return Err(Flaw::NotCovered { what: "a speed above 1/8" });
        }
        let phi = &one + &a + &three * &a * &a;
        let eps = &delta + &two * &gamma + &three * &a * &phi;
        let remainder = |chi: &BigRational| {
            let kappa = &a * phi.pow(3) * &delta / &three + &delta * &phi * &eps * ratio(1, 12) + &phi * &gamma;
            let alpha = ratio(3, 2) * &a * phi.pow(2) * chi + chi * &kappa;
            let beta = ratio(1, 2) * &a * phi.pow(3) * chi
                + &a * phi.pow(3) / &three
                + &delta * phi.pow(2) * ratio(1, 12)
                + chi * &phi * &kappa;
            Bound::of_square(&alpha, &beta, &ratio(1, 20))
        };
        let growth = k_m * step / &speed;
        Ok(Self {
            a: controller.a.clone(),
            b: controller.b.clone(),
            step: step.clone(),
            delay: sampling.delay_samples,
            rate: sampling.rate_per_s.value().clone(),
            rho,
            limit: sampling.torque_limit_n_m.as_ref().map(|limit| limit.value().clone()),
            friction_span: &largest_friction - &least_friction,
            has_friction: largest_friction > least_friction,
            least_friction,
            is_held: stiffness.is_positive(),
            stiffness,
            least_inertia: m_lo.clone(),
            coriolis: bounds.k_c_kg_m2.value().clone(),
            coriolis_relative: bounds.k_r.as_ref().map(|k_r| k_r.value().clone()),
            speed: Bound::of_square(&growth, &growth, &ratio(1, 20)),
            ahead: remainder(&chi),
            behind: remainder(&chi_behind),
            spread: Bound::of_square(&(&phi * &eps * &chi), &(phi.pow(2) * (&one + &eps * &chi)), &ratio(10, 1)),
            metric: rounded_up(&phi.pow(2)),
        })
    }

    /// The same numbers in floating point, for a search.
    pub fn to_f64(&self) -> SampledLoop<f64> {
        SampledLoop {
            a: self.a.each_ref().map(|row| row.each_ref().map(float)),
            b: self.b.each_ref().map(float),
            step: float(&self.step),
            delay: self.delay,
            rate: float(&self.rate),
            rho: float(&self.rho),
            limit: self.limit.as_ref().map(float),
            least_friction: float(&self.least_friction),
            friction_span: float(&self.friction_span),
            has_friction: self.has_friction,
            stiffness: float(&self.stiffness),
            is_held: self.is_held,
            least_inertia: float(&self.least_inertia),
            coriolis: float(&self.coriolis),
            coriolis_relative: self.coriolis_relative.as_ref().map(float),
            speed: self.speed.to_f64(),
            ahead: self.ahead.to_f64(),
            behind: self.behind.to_f64(),
            spread: self.spread.to_f64(),
            metric: float(&self.metric),
        }
    }
}

/// Which coordinates an inequality has, beside `dq, y, f_-` and the controller's states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// None: what is known at the sample.
    Sample,
    /// `vb` and f.
    Period,
    /// `vb`, f and `rb`.
    Force,
}

/// Positions of the coordinates of an inequality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinates {
    /// How many there are.
    pub order: usize,
    /// The first is dq; then the mean velocity of this period,
    pub mean: Option<usize>,
    /// that of the last one,
    pub mean_behind: usize,
    /// friction away from its least, in this period,
    pub friction: Option<usize>,
    /// in the last one,
    pub friction_behind: Option<usize>,
    /// the held compensation's residue,
    pub held: Option<usize>,
    /// and e, followed by m, mu', mu'', u, u_-1 ..
    pub error: usize,
}

impl<T: Field> SampledLoop<T> {
    /// The coordinates of the inequalities that reach so far.
    pub fn coordinates(&self, reach: Reach) -> Coordinates {
        let mut next = 1;
        let mut take = |present: bool| {
            present.then(|| {
                next += 1;
                next - 1
            })
        };
        let ahead = reach != Reach::Sample;
        let mean = take(ahead);
        take(true);
        let friction = take(ahead && self.has_friction);
        let friction_behind = take(self.has_friction);
        let held = take(reach == Reach::Force && self.is_held);
        let error = next;
        Coordinates {
            order: error + STATES + self.delay,
            mean,
            mean_behind: 1 + usize::from(ahead),
            friction,
            friction_behind,
            held,
            error,
        }
    }

    /// The torques held in the period that starts and in the one that ended.
    pub fn held_torques(&self, reach: Reach) -> [Row<T>; 2] {
        let motion = self.motion(reach);
        [motion.torque, motion.torque_behind]
    }

    /// The states z at the sample and at the next.
    pub fn states(&self, reach: Reach) -> [Vec<Row<T>>; 2] {
        let motion = self.motion(reach);
        [motion.before, motion.after]
    }

    /// Samples of delay.
    pub fn delay(&self) -> usize {
        self.delay
    }

    /// Friction that no joint can be without, N m s/rad, and how much more there may be.
    pub fn friction(&self) -> [&T; 2] {
        [&self.least_friction, &self.friction_span]
    }

    /// The gravity stiffness that a held compensation leaves, N m/rad; 0 when the compensation is continuous.
    pub fn stiffness(&self) -> &T {
        &self.stiffness
    }

    /// Whether the controller's torque is to keep to a limit.
    pub fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    /// Whether the Coriolis term has a bound relative to M.
    pub fn has_relative_bound(&self) -> bool {
        self.coriolis_relative.is_some()
    }

    /// Weights of `|dq|_M^2` and `h^2 |tau|_M^-1^2` in the bound on the mean velocity's remainder: of the period that starts, and of the
    /// one that ended.
    pub fn mean_bounds(&self) -> [[&T; 2]; 2] {
        [&self.ahead, &self.behind].map(|bound| [&bound.kinetic, &bound.torque])
    }

    /// The controller's period, s.
    pub fn step(&self) -> &T {
        &self.step
    }

    fn motion(&self, reach: Reach) -> Motion<T> {
        let at = self.coordinates(reach);
        let unit = |index: usize| Row::coordinate(at.order, index, T::one());
        let optional = |index: Option<usize>| index.map_or_else(|| Row::zero(at.order), unit);
        let (dq, mean, mean_behind) = (unit(0), optional(at.mean), unit(at.mean_behind));
        let (friction, friction_behind) = (optional(at.friction), optional(at.friction_behind));
        // e, m, mu', mu'', u and the torques in transit.
        let known: Vec<Row<T>> = (at.error..at.order).map(unit).collect();
        let (states, history) = known.split_at(STATES);
        let h = &self.step;
        // The belief's Euler step reads the old beliefs; the torque's reads the new ones.
        let rate = |i: usize, z: &[Row<T>]| Row::combination(at.order, &self.a[i], z).plus(&self.b[i], &dq);
        let mut new: Vec<Row<T>> = states.to_vec();
        for i in 1..STATES - 1 {
            new[i] = states[i].plus(h, &rate(i, states));
        }
        let command = states[STATES - 1].plus(h, &rate(STATES - 1, &new));
        let torques: Vec<Row<T>> = [&command, &states[STATES - 1]].into_iter().chain(history).cloned().collect();
        let (torque, torque_behind) = (torques[self.delay].clone(), torques[self.delay + 1].clone());
        let force = |torque: &Row<T>, mean: &Row<T>, friction: &Row<T>| {
            torque.plus(&-self.least_friction.clone(), mean).plus(&-T::one(), friction)
        };
        let mut before = known.clone();
        before.push(mean_behind.clone());
        let mut after = vec![states[0].plus(h, &mean)];
        after.extend_from_slice(&new[1..STATES - 1]);
        after.extend_from_slice(&torques[..=self.delay]);
        after.push(mean.clone());
        Motion {
            order: at.order,
            force: force(&torque, &mean, &friction),
            force_behind: force(&torque_behind, &mean_behind, &friction_behind),
            held: optional(at.held),
            dq,
            mean,
            mean_behind,
            friction,
            friction_behind,
            torque,
            torque_behind,
            command,
            before,
            after,
        }
    }

    /// V.
    fn value(&self, motion: &Motion<T>, x: &SampledUnknowns<T>, at: &Corner<T>) -> Form<T> {
        let mut form = Form::zero(motion.order);
        form.add(&(x.p.clone() * &at.inertia), &motion.dq, &motion.dq);
        let y = Row::combination(motion.order, &x.b, &motion.before);
        form.add(&(T::fraction(2, 1) * &at.inertia), &motion.dq, &y);
        add_states(&mut form, &x.s, &motion.before);
        form
    }

    /// Adds `scale` times a bound.
    fn add_bound(&self, form: &mut Form<T>, scale: &T, bound: &Bound<T>, dq: &Row<T>, torque: &Row<T>, at: &Corner<T>) {
        form.add(&(scale.clone() * &bound.kinetic * &at.inertia), dq, dq);
        form.add(&(scale.clone() * &bound.torque * &self.step * &self.step * &at.inverse), torque, torque);
    }

    /// Adds `scale R`, R of a period's mean velocity; `sign` is 1 for the period that starts and -1 for the one that ended.
    #[expect(clippy::too_many_arguments, reason = "one period's rows")]
    fn add_mean(
        &self,
        form: &mut Form<T>,
        scale: &T,
        bound: &Bound<T>,
        sign: i64,
        dq: &Row<T>,
        [mean, force, torque]: [&Row<T>; 3],
        at: &Corner<T>,
    ) {
        self.add_bound(form, scale, bound, dq, torque, at);
        // |mean - dq -+ (h/2) M^-1 F|_M^2.
        let change = mean.plus(&-T::one(), dq);
        form.add(&-(scale.clone() * &at.inertia), &change, &change);
        form.add(&(scale.clone() * &self.step * &T::fraction(sign, 1)), &change, force);
        form.add(&-(scale.clone() * &self.step * &self.step * &T::fraction(1, 4) * &at.inverse), force, force);
    }

    fn add_ahead(&self, form: &mut Form<T>, [mean, friction]: [&T; 2], motion: &Motion<T>, at: &Corner<T>) {
        let period = [&motion.mean, &motion.force, &motion.torque];
        self.add_mean(form, mean, &self.ahead, 1, &motion.dq, period, at);
        self.add_friction(form, friction, &motion.friction, &motion.mean);
    }

    fn add_behind(&self, form: &mut Form<T>, [mean, friction]: [&T; 2], motion: &Motion<T>, at: &Corner<T>) {
        let period = [&motion.mean_behind, &motion.force_behind, &motion.torque_behind];
        self.add_mean(form, mean, &self.behind, -1, &motion.dq, period, at);
        self.add_friction(form, friction, &motion.friction_behind, &motion.mean_behind);
    }

    /// Adds `scale f ((d1 - d0) v - f)`.
    fn add_friction(&self, form: &mut Form<T>, scale: &T, friction: &Row<T>, mean: &Row<T>) {
        let rest = mean.times(&self.friction_span).plus(&-T::one(), friction);
        form.add(scale, friction, &rest);
    }

    /// `V - (k_m h / speed)^2 (|dq|_M + h |tau|_M^-1)^2` with the multipliers of the last period.
    pub fn growth(&self, x: &SampledUnknowns<T>, at: &Corner<T>) -> Form<T> {
        let motion = self.motion(Reach::Sample);
        let mut form = self.value(&motion, x, at);
        self.add_bound(&mut form, &-T::one(), &self.speed, &motion.dq, &motion.torque, at);
        self.add_behind(&mut form, [&-x.growth[0].clone(), &-x.growth[1].clone()], &motion, at);
        form
    }

    /// `V - inverse_square |e|^2` with the multipliers of growth.
    pub(crate) fn distance(&self, x: &SampledUnknowns<T>, at: &Corner<T>, inverse_square: &T) -> Form<T> {
        let motion = self.motion(Reach::Sample);
        let mut form = self.value(&motion, x, at);
        form.add(&-inverse_square.clone(), &motion.before[0], &motion.before[0]);
        self.add_behind(&mut form, [&-x.growth[0].clone(), &-x.growth[1].clone()], &motion, at);
        form
    }

    /// `V - |u+|^2 / limit^2` with the multipliers of the last period; `None` without a limit.
    pub fn torque(&self, x: &SampledUnknowns<T>, at: &Corner<T>) -> Option<Form<T>> {
        let limit = self.limit.as_ref()?;
        let motion = self.motion(Reach::Sample);
        let mut form = self.value(&motion, x, at);
        form.add(&-(T::one() / &(limit.clone() * limit)), &motion.command, &motion.command);
        self.add_behind(&mut form, [&-x.torque[0].clone(), &-x.torque[1].clone()], &motion, at);
        Some(form)
    }

    /// `[[V with multipliers, Y+], [Y+', rho^2]]`.
    pub fn containment(&self, x: &SampledUnknowns<T>, at: &Corner<T>) -> Form<T> {
        let motion = self.motion(Reach::Period);
        let mut form = self.value(&motion, x, at);
        let [ahead, behind, friction, friction_behind] = x.containment.each_ref().map(|l| -l.clone());
        self.add_ahead(&mut form, [&ahead, &friction], &motion, at);
        self.add_behind(&mut form, [&behind, &friction_behind], &motion, at);
        let y = Row::combination(motion.order, &x.b, &motion.after);
        for (row, entry) in form.0.iter_mut().zip(&y.0) {
            row.push(entry.clone());
        }
        let mut last = y.0;
        last.push(self.rho.clone() * &self.rho);
        form.0.push(last);
        form
    }

    /// Minus the bound on `(V+ - V)/h + 2 rate V`, with the multipliers.
    pub fn decay(&self, x: &SampledUnknowns<T>, at: &Corner<T>) -> Form<T> {
        let motion = self.motion(Reach::Force);
        let (h, two) = (&self.step, T::fraction(2, 1));
        let per_step = T::one() / h;
        let mut form = Form::zero(motion.order);
        form.add_form(&(two.clone() * &self.rate), &self.value(&motion, x, at));
        let [before, after] = [&motion.before, &motion.after].map(|z| Row::combination(motion.order, &x.b, z));
        // p 2 vb'F + (2/h) ((M dq + h F)'Y+ - dq'M Y) + 2 rb'Y+.
        form.add(&(two.clone() * &x.p), &motion.mean, &motion.force);
        let growth = after.plus(&-T::one(), &before);
        form.add(&(two.clone() * &at.inertia * &per_step), &motion.dq, &growth);
        form.add(&two, &motion.force.plus(&T::one(), &motion.held), &after);
        // (z+'S z+ - z'S z)/h = (z+ - z)'S (z+ + z)/h.
        let steps: Vec<Row<T>> =
            motion.after.iter().zip(&motion.before).map(|(new, old)| new.plus(&-T::one(), old)).collect();
        let sums: Vec<Row<T>> =
            motion.after.iter().zip(&motion.before).map(|(new, old)| new.plus(&T::one(), old)).collect();
        for (step, weights) in steps.iter().zip(&x.s) {
            form.add(&per_step, step, &Row::combination(motion.order, weights, &sums));
        }
        // The means of |v|^2 and |v|_M^2 over the period, each with its weight.
        let relative = self.coriolis_relative.clone().unwrap_or_else(T::zero);
        let twice_rho = two * &self.rho;
        let residue = x.held.clone() * &self.stiffness * &self.stiffness * h * h * &T::fraction(1, 3);
        let plain = twice_rho.clone() * &x.theta * &self.coriolis + &(x.p.clone() * &self.stiffness * h) + &residue;
        let metric = twice_rho * &(T::one() - &x.theta) * &relative * &self.metric;
        form.add(&(plain.clone() + &(metric.clone() * &at.inertia)), &motion.mean, &motion.mean);
        let spread = (plain / &self.least_inertia + &metric) * &T::fraction(1, 12);
        self.add_bound(&mut form, &spread, &self.spread, &motion.dq, &motion.torque, at);
        form.add(&-x.held.clone(), &motion.held, &motion.held);
        let [ahead, behind, friction, friction_behind] = x.decay.each_ref();
        self.add_ahead(&mut form, [ahead, friction], &motion, at);
        self.add_behind(&mut form, [behind, friction_behind], &motion, at);
        form.negated()
    }
}

/// One eigenvector's rows over the coordinates of an inequality.
struct Motion<T> {
    order: usize,
    dq: Row<T>,
    mean: Row<T>,
    mean_behind: Row<T>,
    friction: Row<T>,
    friction_behind: Row<T>,
    held: Row<T>,
    force: Row<T>,
    force_behind: Row<T>,
    torque: Row<T>,
    torque_behind: Row<T>,
    /// The torque computed at the sample.
    command: Row<T>,
    /// z at the sample, and at the next.
    before: Vec<Row<T>>,
    after: Vec<Row<T>>,
}

/// Adds `z'S z`.
fn add_states<T: Field>(form: &mut Form<T>, s: &[Vec<T>], z: &[Row<T>]) {
    for (row, weights) in z.iter().zip(s) {
        form.add(&T::one(), row, &Row::combination(form.0.len(), weights, z));
    }
}
