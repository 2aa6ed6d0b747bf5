//! Claim `sampled-region`: the nonlinear loop with the controller's own sampling, held torque and delay decays from every start in a ball.
//!
//! At a sample, with `z = (e, m, mu', mu'', u, u_-1, .., u_-k, y)`, `y` the mean velocity of the period before, `Y = (b' (x) I) z`,
//!
//! ```text
//! V = p dq'M dq + 2 dq'M Y + z'(S (x) I) z
//! ```
//!
//! Over a period with held torque tau, mean velocity vb and mean force `F = tau - d0 vb - f`:
//! `e+ = e + h vb`, `M dq` grows by `h F` and the Coriolis impulse, the kinetic term by at most `2h vb'F`, and
//!
//! ```text
//! vb = dq + (h/2) M^-1 F + w,      |w|_M <= alpha |dq|_M + beta h |tau|_M^-1
//! ```
//!
//! In an eigenbasis of M every inequality splits by joints and is affine in `(m, 1/m)`, `m` an eigenvalue: it is checked at the corners
//! of triangles that cover the curve. [`super::sampled_motion`] holds the matrices. The derivation is in `proofs/claims/sampled-region.md`.

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use serde::{Deserialize, Serialize};

use super::sampled_motion::{Corner, SampledLoop, SampledUnknowns};
use super::{ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::algebra::zeros;
use crate::document::{ConfigurationSet, Document};
use crate::error::Flaw;
use crate::form::Form;
use crate::normed::{Norm, Normed};
use crate::number::{Number, positive, unit_interval};
use crate::quantity::{require, require_length, require_positive};

/// The most samples of delay that are checked.
const MOST_DELAY: usize = 4;
/// The most points that cut the inertia interval.
const MOST_POINTS: usize = 32;

/// How the robot adds `g` to the controller's torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compensation {
    /// `g(q(t))` at every instant.
    Continuous,
    /// `g(q)` of the last sample, held over the period.
    Held,
}

/// What is sampled, and how: the parameters that a search is given.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// The controller's period, s.
    pub step_s: Number,
    /// Samples between a measurement and the torque computed from it.
    pub delay_samples: usize,
    /// How gravity is compensated.
    pub compensation: Compensation,
    /// The 2-norm over the joints that the controller's torque keeps to, N m.
    pub torque_limit_n_m: Option<Number>,
    /// `sqrt V` decays at least as `exp(-rate t)` from sample to sample, 1/s.
    pub rate_per_s: Number,
}

/// The sampled nonlinear loop decays from every start in a ball.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledRegionClaim {
    /// Every start at rest within this distance of the goal (2-norm over the joints) is covered, rad.
    pub radius_rad: Number,
    /// The sampling.
    pub sampling: Sampling,
    /// The numbers that prove it.
    pub witness: SampledRegionWitness,
}

/// The Lyapunov function and multipliers, V normalised to 1 on the boundary.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledRegionWitness {
    /// Weight of the kinetic term.
    pub p: Number,
    /// Cross terms of dq'M with z.
    pub b: Vec<Number>,
    /// Upper triangle of the symmetric matrix S, row by row.
    pub s: Vec<Number>,
    /// `|Y+| <= rho` on the region.
    pub rho: Number,
    /// `k_m h (|dq|_M + h |tau|_M^-1) <= speed` on the region.
    pub speed: Number,
    /// How the Coriolis term is shared between its two bounds, in [0, 1].
    pub theta: Number,
    /// Multipliers of decay: this period's mean velocity, the last one's, this period's friction, the last one's.
    pub decay: [Number; 4],
    /// The same of containment.
    pub containment: [Number; 4],
    /// Multipliers of growth: the last period's mean velocity and friction.
    pub growth: [Number; 2],
    /// The same of the torque limit.
    pub torque: [Number; 2],
    /// Multiplier of the held compensation's residue.
    pub held: Number,
    /// Points inside `(m_lo, m_hi)` that cut it into pieces, rising, kg m^2.
    pub inertia_kg_m2: Vec<Number>,
}

impl SampledRegionClaim {
    /// The weight `s` of a goal step: when the goal jumps by `delta` at a sample, before the controller's step, `sqrt V` grows by at most
    /// `sqrt(s) |delta|`.
    ///
    /// # Errors
    /// [`Flaw`] when the witness does not have the length that its delay asks for.
    pub fn goal_step_weight(&self) -> Result<BigRational, Flaw> {
        let s = symmetric("s", &self.witness.s, states(self.sampling.delay_samples)?)?;
        Ok(&s[0][0] + &s[0][1] + &s[1][0] + &s[1][1])
    }

    /// What shows that `V <= 1` implies `|e| <= most` (2-norm over the joints, rad) at the samples.
    ///
    /// # Errors
    /// [`Flaw`] when the numbers are outside what the proof allows.
    pub fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw> {
        let proof = Proof::new(document, self)?;
        let inverse_square = (most * most).recip();
        Ok(proof.at_corners("distance", |corner| Some(proof.motion.distance(&proof.unknowns, corner, &inverse_square))))
    }
}

impl Provable for SampledRegionClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::SampledRegion
    }

    fn sentence(&self, _: &Document) -> String {
        let limit = match &self.sampling.torque_limit_n_m {
            Some(limit) => format!(
                ", the controller's own torque (without the gravity compensation) is at most {limit} N m at every sample (2-norm over the \
                 joints)"
            ),
            None => String::new(),
        };
        format!(
            "from rest at any configuration within {} rad of a constant goal (2-norm over the joints, angles not wrapped), beliefs at the \
             measurement (mu = q, mu' = mu'' = 0), with zero controller torque, also in transit, the sampled nonlinear loop converges to \
             the goal{limit}, and from sample to sample the Lyapunov function of the file's witness falls at least as fast as \
             exp(-2 x {} t), t in s",
            self.radius_rad, self.sampling.rate_per_s
        )
    }

    fn scope(&self, _: &Document) -> String {
        let Sampling { step_s, delay_samples, compensation, .. } = &self.sampling;
        let compensation = match compensation {
            Compensation::Continuous => "gravity compensated at every instant",
            Compensation::Held => "gravity compensated at each sample without delay and held until the next",
        };
        let late = match delay_samples {
            0 => "applied at once".to_owned(),
            1 => "1 sample late".to_owned(),
            k => format!("{k} samples late"),
        };
        let limit = if self.sampling.torque_limit_n_m.is_some() { "no other torque limit" } else { "no torque limit" };
        format!(
            "the controller's own step every {step_s} s, its torque held in between and {late}, the arm in continuous \
             time, {compensation}, friction constant in time, {limit}, no noise, no Coulomb friction, joint limits not modelled"
        )
    }

    fn figures(&self) -> Vec<Figure> {
        let figure = |name, value: &Number, unit| Figure { name, value: value.clone(), unit };
        let mut figures = vec![
            figure("radius", &self.radius_rad, "rad"),
            figure("rate", &self.sampling.rate_per_s, "1/s"),
            figure("step", &self.sampling.step_s, "s"),
        ];
        figures.extend(self.sampling.torque_limit_n_m.as_ref().map(|limit| figure("torque limit", limit, "N m")));
        figures
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(sampled_region_inequalities(document, self)?)
    }
}

impl Normed for SampledRegionClaim {
    fn norm(&self, document: &Document) -> Result<Norm, Flaw> {
        Ok(Norm {
            shift_weights: vec![self.goal_step_weight()?; document.family.joints()],
            rate: self.sampling.rate_per_s.value().clone(),
            period: Some(self.sampling.step_s.value().clone()),
            kept: None,
        })
    }

    fn error_within(&self, document: &Document, most: &BigRational) -> Result<Vec<Inequality>, Flaw> {
        Self::error_within(self, document, most)
    }
}

/// Order of z.
fn states(delay: usize) -> Result<usize, Flaw> {
    if delay > MOST_DELAY {
        return Err(Flaw::quantity("delay_samples", &delay.to_string(), "at most 4 samples"));
    }
    Ok(6 + delay)
}

/// The inequalities of a sampled-region claim about `document`, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn sampled_region_inequalities(document: &Document, claim: &SampledRegionClaim) -> Result<Vec<Inequality>, Flaw> {
    require_positive("radius_rad", &claim.radius_rad)?;
    let proof = Proof::new(document, claim)?;
    let Proof { motion, unknowns, .. } = &proof;
    let mut all = proof.at_corners("growth", |corner| Some(motion.growth(unknowns, corner)));
    all.extend(proof.at_corners("containment", |corner| Some(motion.containment(unknowns, corner))));
    all.extend(proof.at_corners("decay", |corner| Some(motion.decay(unknowns, corner))));
    all.extend(proof.at_corners("torque", |corner| motion.torque(unknowns, corner)));
    let radius = claim.radius_rad.value();
    let start = BigRational::one() - radius * radius * claim.goal_step_weight()?;
    all.push(Inequality::decide("start".to_owned(), &vec![vec![start]]));
    Ok(all)
}

/// A claim's numbers, checked to be such as the proof allows.
struct Proof {
    motion: SampledLoop<BigRational>,
    unknowns: SampledUnknowns<BigRational>,
    corners: Vec<Corner<BigRational>>,
}

impl Proof {
    fn new(document: &Document, claim: &SampledRegionClaim) -> Result<Self, Flaw> {
        let SampledRegionClaim { sampling, witness, .. } = claim;
        let motion = sampled_loop(document, sampling, &witness.rho, &witness.speed)?;
        let unknowns = unknowns(witness, sampling.delay_samples)?;
        if !motion.has_relative_bound() && !unknowns.theta.is_one() {
            return Err(Flaw::Missing { constant: "k_r" });
        }
        Ok(Self { motion, unknowns, corners: corners(document, witness)? })
    }

    fn at_corners(
        &self,
        what: &str,
        form: impl Fn(&Corner<BigRational>) -> Option<Form<BigRational>>,
    ) -> Vec<Inequality> {
        let name = |index: usize| format!("{what} at corner {} of the inertia interval", index + 1);
        let decided = |(index, corner)| form(corner).map(|form| Inequality::decide(name(index), &form.0));
        self.corners.iter().enumerate().filter_map(decided).collect()
    }
}

/// The loop as the proof sees it, for given bounds `rho` and `speed`.
///
/// # Errors
/// [`Flaw`] when the document or the numbers are outside what the proof covers.
pub fn sampled_loop(
    document: &Document,
    sampling: &Sampling,
    rho: &Number,
    speed: &Number,
) -> Result<SampledLoop<BigRational>, Flaw> {
    if !document.family.gravity_compensation {
        return Err(Flaw::NotCovered { what: "a sampled loop whose gravity is not compensated" });
    }
    if document.constants.over != ConfigurationSet::AllAngles {
        return Err(Flaw::NotCovered { what: "constants that hold on a box of configurations only" });
    }
    let gains = document.gains.aic()?.shared(document.arm.joints)?;
    require_positive("step_s", &sampling.step_s)?;
    require_positive("rate_per_s", &sampling.rate_per_s)?;
    states(sampling.delay_samples)?;
    if let Some(limit) = &sampling.torque_limit_n_m {
        require_positive("torque_limit_n_m", limit)?;
    }
    require("rho", rho, positive(rho.value()), "a positive number")?;
    require("speed", speed, positive(speed.value()), "a positive number")?;
    let bounds = &document.constants.bounds;
    let Some(k_m) = &bounds.k_m else { return Err(Flaw::Missing { constant: "k_m" }) };
    let stiffness = match sampling.compensation {
        Compensation::Continuous => BigRational::zero(),
        Compensation::Held => bounds.k_g_n_m_per_rad.value().clone(),
    };
    SampledLoop::new(
        &gains.matrices(),
        sampling,
        [rho, speed].map(|x| x.value().clone()),
        document.family.friction_hull().map(|x| x.value().clone()),
        bounds,
        k_m.value(),
        stiffness,
    )
}

/// The corners of triangles that cover `(m, 1/m)` for every m of the inertia interval.
fn corners(document: &Document, witness: &SampledRegionWitness) -> Result<Vec<Corner<BigRational>>, Flaw> {
    let bounds = &document.constants.bounds;
    if witness.inertia_kg_m2.len() > MOST_POINTS {
        return Err(Flaw::Length {
            quantity: "inertia_kg_m2",
            found: witness.inertia_kg_m2.len(),
            expected: MOST_POINTS,
        });
    }
    let mut points = vec![bounds.m_lo_kg_m2.value()];
    for point in &witness.inertia_kg_m2 {
        require(
            "inertia_kg_m2",
            point,
            points[points.len() - 1] < point.value(),
            "points that rise from m_lo to m_hi",
        )?;
        points.push(point.value());
    }
    let largest = &bounds.m_hi_kg_m2;
    require("m_hi_kg_m2", largest, points[points.len() - 1] <= largest.value(), "an end no smaller than every point")?;
    points.push(largest.value());
    Ok(Corner::cover(&points.into_iter().cloned().collect::<Vec<_>>()))
}

fn symmetric(quantity: &'static str, upper: &[Number], order: usize) -> Result<Vec<Vec<BigRational>>, Flaw> {
    require_length(quantity, upper.len(), order * (order + 1) / 2)?;
    let mut matrix = zeros(order);
    for ((i, j), entry) in (0..order).flat_map(|i| (i..order).map(move |j| (i, j))).zip(upper) {
        matrix[i][j].clone_from(entry.value());
        matrix[j][i].clone_from(entry.value());
    }
    Ok(matrix)
}

fn unknowns(witness: &SampledRegionWitness, delay: usize) -> Result<SampledUnknowns<BigRational>, Flaw> {
    let order = states(delay)?;
    require("p", &witness.p, positive(witness.p.value()), "a positive number")?;
    require("theta", &witness.theta, unit_interval(witness.theta.value()), "a share in [0, 1]")?;
    require_length("b", witness.b.len(), order)?;
    let multipliers = [
        ("decay", &witness.decay[..]),
        ("containment", &witness.containment[..]),
        ("growth", &witness.growth[..]),
        ("torque", &witness.torque[..]),
        ("held", core::slice::from_ref(&witness.held)),
    ];
    for (name, list) in multipliers {
        for multiplier in list {
            require(name, multiplier, !multiplier.value().is_negative(), "a number of at least 0")?;
        }
    }
    let value = |number: &Number| number.value().clone();
    Ok(SampledUnknowns {
        p: value(&witness.p),
        b: witness.b.iter().map(value).collect(),
        s: symmetric("s", &witness.s, order)?,
        theta: value(&witness.theta),
        decay: witness.decay.each_ref().map(value),
        containment: witness.containment.each_ref().map(value),
        growth: witness.growth.each_ref().map(value),
        torque: witness.torque.each_ref().map(value),
        held: value(&witness.held),
    })
}
