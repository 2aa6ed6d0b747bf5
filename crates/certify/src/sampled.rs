//! The linearised loops with a sampled controller: decay rate, delay margin, margins; or a point that contradicts stability.

use certune_verify::{
    BoxPoint, Claim, ClaimKind, LoopBox, LoopTiming, MOST_DELAY_SAMPLES, NotProvedClaim, Number, PlantStep, Reason,
    RefusedClaim, SampledClaim, SampledFamily, family_box,
};
use num_rational::BigRational;
use num_traits::Zero;

use crate::exponential::{Attain, LARGEST_RATE_PER_S, coordinates, counterexample, largest_rate};
use crate::margins::{margins, remedies};
use crate::problem::Problem;

/// Parts of a sample in which a delay margin is bisected.
const PARTS: usize = 100;

/// How the sampled loop is taken to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledOptions {
    /// How the arm moves between two samples.
    pub plant: PlantStep,
    /// The controller's period, s.
    pub period_s: f64,
    /// Samples of delay up to which the claim must hold.
    pub delay_samples: usize,
}

impl Default for SampledOptions {
    /// The simulator's step at 1 kHz, without delay.
    fn default() -> Self {
        Self { plant: PlantStep::SemiImplicit, period_s: 1e-3, delay_samples: 0 }
    }
}

/// The claim `sampled` with the largest rate at the delays asked for and the largest delay that exact arithmetic certifies, or a refusal, or "not
/// proved". `attain` is asked only after the box has been found to hold an unstable point.
pub fn sampled(problem: &Problem, options: &SampledOptions, attain: &Attain<'_>) -> Claim {
    let document = problem.document();
    let range = family_box(document);
    let unwritable = || crate::not_proved(ClaimKind::Sampled, Reason::OutOfRange, None);
    let Some(period_s) = Number::decimal(options.period_s) else { return unwritable() };
    let samples = |parts: usize| BigRational::new(parts.into(), PARTS.into());
    let Some(delay_s) = delay(&period_s, &samples(options.delay_samples * PARTS)) else { return unwritable() };
    let sampling = LoopTiming { plant: options.plant, period_s, delay_s };
    let not_proved = |reason, remedies| {
        Claim::NotProved(NotProvedClaim {
            of: ClaimKind::Sampled,
            sampling: Some(sampling.clone()),
            distance: None,
            reason,
            remedies,
        })
    };
    let Ok(gains) = document.gains.aic() else { return not_proved(Reason::OtherController, Vec::new()) };
    if gains.shared_by_all().is_err() {
        return not_proved(Reason::UnequalGains, Vec::new());
    }
    let Ok(loops) = SampledFamily::new(gains, &sampling.period_s) else {
        return not_proved(Reason::OutOfRange, Vec::new());
    };
    let exact_hold = options.plant == PlantStep::ZeroOrderHold;
    if exact_hold && !document.family.gravity_compensation {
        return not_proved(Reason::FamilyNotCovered, Vec::new());
    }
    if options.delay_samples > MOST_DELAY_SAMPLES {
        return not_proved(Reason::OutOfRange, Vec::new());
    }
    let (asked, zero) = (samples(options.delay_samples * PARTS), BigRational::zero());
    let stable = |range: &LoopBox| loops.decays_on(options.plant, range, &asked, &zero).is_ok();
    let decays = |rate: &Number| loops.decays_on(options.plant, &range, &asked, rate.value()).is_ok();
    let Some(rate_per_s) = largest_rate(LARGEST_RATE_PER_S, &decays) else {
        if stable(&range) {
            return not_proved(Reason::TooSlow, Vec::new());
        }
        let remedies = remedies(document, exact_hold, &stable);
        return refuse(&sampling, options, &loops, &range, attain, remedies.clone())
            .unwrap_or_else(|reason| not_proved(reason, remedies));
    };
    // Delays that a shorter piece already covers are not checked again.
    let stable_to = |parts: usize| {
        let (k, rest) = (parts / PARTS, samples(parts % PARTS));
        loops.decays_between(options.plant, &range, k, &rest, &zero).is_ok()
    };
    let mut margin = options.delay_samples * PARTS;
    let step = |whole: usize| if exact_hold { whole..=whole } else { whole + 1..=whole + 1 };
    let mut whole = options.delay_samples;
    while whole < MOST_DELAY_SAMPLES
        && step(whole).all(|k| {
            loops.decays_between(options.plant, &range, k, &samples(if exact_hold { PARTS } else { 0 }), &zero).is_ok()
        })
    {
        whole += 1;
        margin = whole * PARTS;
    }
    if exact_hold && whole < MOST_DELAY_SAMPLES {
        let mut refused = margin + PARTS;
        while refused - margin > 1 {
            let middle = margin.midpoint(refused);
            if stable_to(middle) {
                margin = middle;
            } else {
                refused = middle;
            }
        }
    }
    let Some(delay_margin_s) = delay(&sampling.period_s, &samples(margin)) else {
        return not_proved(Reason::OutOfRange, Vec::new());
    };
    let margins = margins(document, exact_hold, &stable);
    Claim::Sampled(Box::new(SampledClaim { sampling, rate_per_s, delay_margin_s, margins }))
}

/// So many periods, as a decimal.
fn delay(period_s: &Number, samples: &BigRational) -> Option<Number> {
    Number::decimal_of(period_s.value() * samples)
}

fn refuse(
    sampling: &LoopTiming,
    options: &SampledOptions,
    loops: &SampledFamily,
    range: &LoopBox,
    attain: &Attain<'_>,
    remedies: Vec<certune_verify::Variation>,
) -> Result<Claim, Reason> {
    let zero = BigRational::zero();
    let mut last = Reason::NoPointFound;
    // The longest delay is the likeliest to fail; a refusal names the very delay at which its loop does.
    for k in (0..=options.delay_samples).rev() {
        let delay_s = delay(&sampling.period_s, &BigRational::from_integer(k.into())).ok_or(Reason::OutOfRange)?;
        let at = LoopTiming { delay_s, ..sampling.clone() };
        let fails = |point: &BoxPoint| loops.fails_at(options.plant, coordinates(point), k, &zero);
        match counterexample(range, attain(Some(&at)), &fails) {
            Ok((point, attained)) => {
                return Ok(Claim::Refused(Box::new(RefusedClaim {
                    of: ClaimKind::Sampled,
                    sampling: Some(at),
                    rate_per_s: Number::zero(),
                    point,
                    attained,
                    remedies,
                })));
            }
            Err(reason) => last = reason,
        }
    }
    Err(last)
}

/// The delay that a closed-form rule for light inertias allows, s: `tau < [d + m (kappa_mu/sigma_dq - sigma_dq/sigma_q)] sigma_dq/kappa_a`. No proof:
/// it comes from the fast mode `sqrt(kappa_a/(sigma_dq m))` alone. Least inertia and friction of the family; `None` unless the gains are the AIC's and shared.
pub fn light_inertia_rule_s(problem: &Problem) -> Option<f64> {
    let document = problem.document();
    let gains = document.gains.aic().ok()?;
    gains.shared_by_all().ok()?;
    let range = family_box(document);
    let of = |list: &[Number]| list.first().map(Number::to_f64);
    let (kappa_mu, kappa_a) = (of(&gains.kappa_mu)?, of(&gains.kappa_a)?);
    let (sigma_q, sigma_dq) = (of(&gains.sigma_q)?, of(&gains.sigma_dq)?);
    let damping = range.friction[0].to_f64() + range.inertia[0].to_f64() * (kappa_mu / sigma_dq - sigma_dq / sigma_q);
    Some(damping * sigma_dq / kappa_a)
}
