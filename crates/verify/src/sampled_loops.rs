//! The linearised loops with the controller as it is coded, in steps of h, with a delayed torque.
//!
//! The controller takes its own Euler step (`x+ = F x + G y`, `y = (e, dq)`, torque from the *new* beliefs); the torque of a sample is held for
//! one period and acts after a constant delay. Two plants:
//!
//! ```text
//! semi-implicit     m (dq+ - dq) = h (-g e - d dq + v),   e+ = e + h dq+       delay of whole samples; any (m, d, g)
//! zero-order hold   m ddq = -d dq + v,  v piecewise constant                   any constant delay; g = 0, friction d I
//! ```
//!
//! With `chi = det(zI - F)`, `(n_e, n_dq) = c adj(zI - F) G`, c the last row of I, and k whole samples of delay, an eigenvalue z of a loop is 0 or a root of
//!
//! ```text
//! z^k chi { m (z-1)^2 + d h (z-1) + g h^2 z } - z { n_e h^2 z + n_dq h (z-1) }                                    semi-implicit
//! z^k chi { m^ (z-1)^2 + d h (z^2-1)/2 } - z { n_e h^2 [1 + theta (z-1)] + n_dq h (z-1) }
//!         + (z-1) { n_e h^2 [omega + nu (z-1)] + n_dq h (z-1) lambda }                                            zero-order hold
//! ```
//!
//! both of degree k + 6 and affine in their parameters. `m^ = (d h/2) coth(d h/(2m))`, `theta = 1/(1 - exp(-d h/m)) - m/(d h)`, and lambda, omega, nu for the fraction of a sample
//! by which the delay exceeds k are enclosed by rationals ([`exact_hold_ranges`]). Each is Schur, with z scaled by `1 - rate h <= exp(-rate h)`, if its image under
//! `z = (1 + w)/(1 - w)` is Hurwitz: [`polytope`](crate::polytope). Derivation: `proofs/claims/sampled.md`.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};
use serde::{Deserialize, Serialize};

use crate::aic::AicGains;
use crate::algebra::resolvent;
use crate::claims::{LoopBox, in_words};
use crate::error::Flaw;
use crate::number::{Number, positive, ratio, unit_interval};
use crate::polytope::{AffineFamily, moebius};

/// No claim speaks of a longer delay: the polynomials' degree grows with it.
pub const MOST_DELAY_SAMPLES: usize = 16;

/// How the arm moves between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlantStep {
    /// One semi-implicit Euler step a sample, as the simulator takes it.
    SemiImplicit,
    /// The linearised differential equation itself under a held torque.
    ZeroOrderHold,
}

/// The sampled one-joint loops of one set of gains.
#[derive(Clone, Debug)]
pub struct SampledFamily {
    period: BigRational,
    /// chi, n_e, n_dq: coefficients from the highest power of z down.
    characteristic: Vec<BigRational>,
    by_position: Vec<BigRational>,
    by_velocity: Vec<BigRational>,
}

impl SampledFamily {
    /// The loops of these gains at a sampling period in s.
    ///
    /// # Errors
    /// [`Flaw`] when a gain is missing, not positive, or not the same on every joint, or the period is not positive.
    pub fn new(gains: &AicGains, period: &Number) -> Result<Self, Flaw> {
        if !positive(period.value()) {
            return Err(Flaw::quantity("period_s", &period.to_string(), "a positive number"));
        }
        let matrices = gains.shared(gains.kappa_mu.len())?.sampled(period.value());
        let (characteristic, adjugate) = resolvent(&matrices.f.map(Vec::from).to_vec());
        let numerator = |input: usize| {
            let row_times_column =
                |part: &Vec<Vec<BigRational>>| part[3].iter().zip(&matrices.g).map(|(x, g)| x * &g[input]).sum();
            adjugate.iter().map(row_times_column).collect()
        };
        Ok(Self {
            period: period.value().clone(),
            characteristic,
            by_position: numerator(0),
            by_velocity: numerator(1),
        })
    }

    /// The polynomials with k whole samples of delay, after `z -> (1 - rate h) z` and the map to w: parameters (m, d, g), or
    /// (m^, d, theta, lambda, omega, nu).
    fn polynomials(&self, plant: PlantStep, k: usize, rate: &BigRational) -> AffineFamily {
        let (h, square) = (&self.period, &self.period * &self.period);
        let one = BigRational::one;
        let (z, difference) = (vec![one(), BigRational::zero()], vec![one(), -one()]);
        let mut delay = vec![BigRational::zero(); k + 1];
        delay[0] = one();
        let open = product(&[&delay, &self.characteristic]);
        let (position, velocity) = (scaled(&self.by_position, &square), scaled(&self.by_velocity, h));
        let inertia = product(&[&open, &difference, &difference]);
        let by_dq = product(&[&z, &velocity, &difference]);
        let parts = match plant {
            PlantStep::SemiImplicit => vec![
                negated_sum(&product(&[&z, &position, &z]), &by_dq),
                inertia,
                scaled(&product(&[&open, &difference]), h),
                scaled(&product(&[&open, &z]), &square),
            ],
            PlantStep::ZeroOrderHold => {
                let sum = vec![one(), one()];
                vec![
                    negated_sum(&product(&[&z, &position]), &by_dq),
                    inertia,
                    scaled(&product(&[&open, &difference, &sum]), &(h * ratio(1, 2))),
                    scaled(&product(&[&z, &position, &difference]), &-one()),
                    product(&[&difference, &difference, &velocity]),
                    product(&[&difference, &position]),
                    product(&[&difference, &difference, &position]),
                ]
            }
        };
        let length = k + 7;
        let padded: Vec<Vec<BigRational>> = parts
            .into_iter()
            .map(|part| {
                let mut padded = vec![BigRational::zero(); length.saturating_sub(part.len())];
                padded.extend(part);
                padded
            })
            .collect();
        // z -> (n/d) z, times d to the degree: coefficient of z^j times n^j d^(degree - j).
        let scale = one() - rate * h;
        AffineFamily::new(&padded).map(|part| {
            let mut scaled = part.to_vec();
            let (mut up, mut down) = (BigInt::one(), BigInt::one());
            for (k, j) in (0..scaled.len()).zip((0..scaled.len()).rev()) {
                scaled[j] *= &up;
                scaled[k] *= &down;
                up *= scale.numer();
                down *= scale.denom();
            }
            moebius(&scaled)
        })
    }

    /// Whether every loop of the box decays faster than `exp(-rate t)` at every constant delay from 0 to `delay` samples (whole ones only for the
    /// semi-implicit plant), by exact arithmetic.
    ///
    /// # Errors
    /// Where the proof stops, in words.
    pub fn decays_on(
        &self,
        plant: PlantStep,
        range: &LoopBox,
        delay: &BigRational,
        rate: &BigRational,
    ) -> Result<(), String> {
        let whole = delay.trunc().to_usize().filter(|&k| k <= MOST_DELAY_SAMPLES && delay >= &BigRational::zero());
        let Some(whole) = whole else {
            return Err(format!("the delay is not within [0, {MOST_DELAY_SAMPLES}] samples"));
        };
        let rest = delay.fract();
        // The exact hold at delays from k to k + 1 for each k that there is, and the rest; the semi-implicit plant at each k.
        let pieces = (0..whole)
            .map(|k| (k, if plant == PlantStep::ZeroOrderHold { BigRational::one() } else { BigRational::zero() }));
        pieces
            .chain([(whole, rest)])
            .try_for_each(|(k, fraction)| self.decays_between(plant, range, k, &fraction, rate))
    }

    /// As [`SampledFamily::decays_on`], at delays from k to k + `fraction` samples only.
    ///
    /// # Errors
    /// As there.
    pub fn decays_between(
        &self,
        plant: PlantStep,
        range: &LoopBox,
        k: usize,
        fraction: &BigRational,
        rate: &BigRational,
    ) -> Result<(), String> {
        if !positive(range.inertia[0].value()) {
            return Err("the box reaches inertia 0, where the degree drops".to_owned());
        }
        if range.friction[0].value() < &BigRational::zero() || range.inertia[1].value() < range.inertia[0].value() {
            return Err("the box is empty or its friction negative".to_owned());
        }
        if rate < &BigRational::zero() || !positive(&(BigRational::one() - rate * &self.period)) {
            return Err("the rate is not within [0, 1/period)".to_owned());
        }
        if !unit_interval(fraction) || k > MOST_DELAY_SAMPLES {
            return Err(format!("the delay is not within [0, {MOST_DELAY_SAMPLES}] samples"));
        }
        let polynomials = self.polynomials(plant, k, rate);
        let (ranges, axes) = match plant {
            PlantStep::SemiImplicit => {
                if !fraction.is_zero() {
                    return Err("the semi-implicit plant knows whole samples of delay only".to_owned());
                }
                let ranges = [&range.inertia, &range.friction, &range.stiffness].map(values).to_vec();
                (ranges, ["inertia", "friction", "stiffness"].as_slice())
            }
            PlantStep::ZeroOrderHold => {
                if range.stiffness.iter().any(|end| !end.value().is_zero()) {
                    return Err("the exact hold is proved with gravity compensated only".to_owned());
                }
                (
                    exact_hold_ranges(range, &self.period, fraction).to_vec(),
                    ["inertia", "friction", "the hold"].as_slice(),
                )
            }
        };
        let after = |flaw| format!("with {k} samples of delay: {}", in_words(flaw, axes));
        polynomials.is_hurwitz_on(&ranges).map_err(after)
    }

    /// Whether the loop at (inertia, friction, stiffness) with k samples of delay is shown *not* to decay faster than `exp(-rate t)`.
    ///
    /// Exact for the semi-implicit plant up to the replacement of `exp(-rate h)` by `1 - rate h`, so give rate 0 for instability. For the exact hold
    /// an enclosure of the loop must have no root on the circle and a root outside.
    pub fn fails_at(&self, plant: PlantStep, point: [&BigRational; 3], k: usize, rate: &BigRational) -> bool {
        let [m, d, g] = point;
        if !positive(m) || k > MOST_DELAY_SAMPLES || !positive(&(BigRational::one() - rate * &self.period)) {
            return false;
        }
        match plant {
            PlantStep::SemiImplicit => !self.polynomials(plant, k, rate).is_hurwitz_at(&point),
            PlantStep::ZeroOrderHold => {
                g.is_zero()
                    && self.polynomials(plant, k, rate).is_nowhere_hurwitz_on(&exact_hold_at(m, d, &self.period))
            }
        }
    }
}

fn values(ends: &[Number; 2]) -> [BigRational; 2] {
    ends.each_ref().map(|x| x.value().clone())
}

fn product(factors: &[&[BigRational]]) -> Vec<BigRational> {
    factors.iter().fold(vec![BigRational::one()], |so_far, factor| {
        let mut next = vec![BigRational::zero(); so_far.len() + factor.len() - 1];
        for (i, x) in so_far.iter().enumerate() {
            for (j, y) in factor.iter().enumerate() {
                next[i + j] += x * y;
            }
        }
        next
    })
}

fn scaled(p: &[BigRational], factor: &BigRational) -> Vec<BigRational> {
    p.iter().map(|c| c * factor).collect()
}

/// `-(p + q)`, coefficients from the highest power down.
fn negated_sum(p: &[BigRational], q: &[BigRational]) -> Vec<BigRational> {
    let length = p.len().max(q.len());
    let at = |p: &[BigRational], k: usize| {
        (k + p.len()).checked_sub(length).and_then(|k| p.get(k)).cloned().unwrap_or_else(BigRational::zero)
    };
    (0..length).map(|k| -(at(p, k) + at(q, k))).collect()
}

/// Rational ranges of (m^, d, theta, lambda, omega, nu) that hold every loop of the box at every delay from k to k + `fraction` samples.
///
/// With `x = d h/m`: `m <= m^ <= m (1 + x^2/12)` and m^ grows with m and d; `1/2 <= theta <= min(1, 1/2 + x/12)`; lambda is at most the fraction f; omega at most
/// `2f - f^2`, nu at most that times theta.
pub(crate) fn exact_hold_ranges(range: &LoopBox, h: &BigRational, fraction: &BigRational) -> [[BigRational; 2]; 6] {
    let ([least, largest], [d0, d1]) = (values(&range.inertia), values(&range.friction));
    let zero = BigRational::zero;
    let step = &d1 * h;
    let theta = (ratio(1, 2) + &step / &least * ratio(1, 12)).min(BigRational::one());
    let late = fraction * (ratio(2, 1) - fraction);
    [
        [least, &largest + &step * &step / &largest * ratio(1, 12)],
        [d0, d1],
        [ratio(1, 2), theta.clone()],
        [zero(), fraction.clone()],
        [zero(), late.clone()],
        [zero(), late * theta],
    ]
}

/// A small box around the parameters of the loop at (m, d) with a whole number of samples of delay.
fn exact_hold_at(m: &BigRational, d: &BigRational, h: &BigRational) -> [[BigRational; 2]; 6] {
    // t coth t - 1 lies in [t^2/3 - t^4/45, t^2/3], coth t - 1/t in [t/3 - t^3/45, t/3]; t = x/2.
    let x = d * h / m;
    let square = &x * &x;
    let correction = BigRational::one() - &square * ratio(1, 60);
    let (inertia, theta) = (m * &square * ratio(1, 12), &x * ratio(1, 12));
    let at = |x: BigRational| [x.clone(), x];
    let zero = || at(BigRational::zero());
    let half = ratio(1, 2);
    [
        [m + &inertia * &correction, m + inertia],
        at(d.clone()),
        [&half + &theta * correction, half + theta],
        zero(),
        zero(),
        zero(),
    ]
}
