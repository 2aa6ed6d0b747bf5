//! The largest certified decay rate of the linearised loops, or a point of the box that contradicts stability.

use certune_verify::{
    Attained, BoxPoint, Claim, ClaimKind, Document, ExponentialClaim, LoopBox, LoopFamily, LoopTiming, NotProvedClaim,
    Number, Reason, RefusedClaim, family_box,
};
use num_rational::BigRational;
use num_traits::Zero;

use crate::margins::{margins, remedies};
use crate::problem::Problem;

/// Rates are certified in steps of 1/1000 per second.
const STEPS_PER_UNIT: u32 = 1000;
/// No rate beyond this is tried, 1/s.
pub(crate) const LARGEST_RATE_PER_S: u32 = 50;
/// Points per axis when a counterexample is searched inside the box.
const GRID: u32 = 24;

/// The one-joint loop of an unstable eigenvector: `v*Mv`, `v*Dv`, `v*Gv` for `|v| = 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnstableLoop {
    /// kg m^2.
    pub inertia_kg_m2: f64,
    /// N m s/rad.
    pub friction_n_m_s_per_rad: f64,
    /// N m/rad.
    pub stiffness_n_m_per_rad: f64,
}

fn rate(steps: u32) -> Option<Number> {
    format!("{}.{:03}", steps / STEPS_PER_UNIT, steps % STEPS_PER_UNIT).parse().ok()
}

/// The claim `exponential` with the largest rate that exact arithmetic certifies, or a refusal, or "not proved".
///
/// `attain` searches an arm and configuration of the family with an unstable linearised loop; it is asked only after the
/// box has been found to hold an unstable point.
pub fn exponential(problem: &Problem, attain: &Attain<'_>) -> Claim {
    let document = problem.document();
    let range = family_box(document);
    let Ok(gains) = document.gains.aic() else {
        return not_proved(Reason::OtherController);
    };
    let Ok(loops) = LoopFamily::new(gains) else {
        return not_proved(Reason::UnequalGains);
    };
    let decays = |rate: &Number| loops.decays_on(&range, rate.value()).is_ok();
    let Some(rate_per_s) = largest_rate(LARGEST_RATE_PER_S, &decays) else {
        return refuse(document, &loops, &range, attain);
    };
    let zero = BigRational::zero();
    let margins = margins(document, false, &|range| loops.decays_on(range, &zero).is_ok());
    Claim::Exponential(ExponentialClaim { rate_per_s, margins })
}

/// The largest rate that passes, in steps of 0.001 per s below `bound`.
pub(crate) fn largest_rate(bound: u32, decays: &dyn Fn(&Number) -> bool) -> Option<Number> {
    let passes = |steps: u32| rate(steps).filter(decays);
    let mut certified = (1, passes(1)?);
    // Stable at rate r implies stable at every smaller rate: bisect between a certified and a refused step.
    let mut refused = STEPS_PER_UNIT * bound;
    while refused - certified.0 > 1 {
        let middle = certified.0.midpoint(refused);
        match passes(middle) {
            Some(number) => certified = (middle, number),
            None => refused = middle,
        }
    }
    Some(certified.1)
}

fn not_proved(reason: Reason) -> Claim {
    crate::not_proved(ClaimKind::Exponential, reason, None)
}

fn refuse(document: &Document, loops: &LoopFamily, range: &LoopBox, attain: &Attain<'_>) -> Claim {
    let zero = BigRational::zero();
    let stable = |range: &LoopBox| loops.decays_on(range, &zero).is_ok();
    if stable(range) {
        return not_proved(Reason::TooSlow);
    }
    let remedies = remedies(document, false, &stable);
    let fails = |point: &BoxPoint| !loops.is_stable_at(coordinates(point), &zero);
    match counterexample(range, attain(None), &fails) {
        Ok((point, attained)) => Claim::Refused(Box::new(RefusedClaim {
            of: ClaimKind::Exponential,
            sampling: None,
            rate_per_s: Number::zero(),
            point,
            attained,
            remedies,
        })),
        Err(reason) => Claim::NotProved(NotProvedClaim {
            of: ClaimKind::Exponential,
            sampling: None,
            distance: None,
            reason,
            remedies,
        }),
    }
}

/// Searches an arm and configuration of the family with an unstable linearised loop, in continuous time or sampled.
pub type Attain<'a> = dyn Fn(Option<&LoopTiming>) -> Option<(UnstableLoop, Attained)> + 'a;

/// A point of the box that fails: the one of an arm that was found, else one of a grid.
pub(crate) fn counterexample(
    range: &LoopBox,
    found: Option<(UnstableLoop, Attained)>,
    fails: &dyn Fn(&BoxPoint) -> bool,
) -> Result<(BoxPoint, Option<Attained>), Reason> {
    let unstable = |point: &BoxPoint| range.contains(coordinates(point)) && fails(point);
    if let Some((found, attained)) = found {
        let values = [found.inertia_kg_m2, found.friction_n_m_s_per_rad, found.stiffness_n_m_per_rad];
        let point = as_point(values).map(|point| pulled_inside(point, range)).ok_or(Reason::OutOfRange)?;
        if !range.contains(coordinates(&point)) {
            return Err(Reason::ConstantsContradicted);
        }
        // Few digits if the loop is unstable there as well.
        let short = as_point(values.map(|x| format!("{x:.3e}").parse().unwrap_or(x)));
        if let Some(point) = short.into_iter().chain([point]).find(unstable) {
            let friction_n_m_s_per_rad = point.friction_n_m_s_per_rad.clone();
            return Ok((point, Some(Attained { friction_n_m_s_per_rad, ..attained })));
        }
    }
    grid(range).find(unstable).map(|point| (point, None)).ok_or(Reason::NoPointFound)
}

pub(crate) fn coordinates(point: &BoxPoint) -> [&BigRational; 3] {
    [&point.inertia_kg_m2, &point.friction_n_m_s_per_rad, &point.stiffness_n_m_per_rad].map(Number::value)
}

fn as_point([m, d, g]: [f64; 3]) -> Option<BoxPoint> {
    Some(BoxPoint {
        inertia_kg_m2: Number::decimal(m)?,
        friction_n_m_s_per_rad: Number::decimal(d)?,
        stiffness_n_m_per_rad: Number::decimal(g)?,
    })
}

/// Rounding may have moved a coordinate just past an end: put it on the end. A point farther out stays where it is, and is
/// then no point of the box: it contradicts the constants, and the caller must not hide that.
fn pulled_inside(point: BoxPoint, range: &LoopBox) -> BoxPoint {
    let pull = |x: Number, ends: &[Number; 2]| {
        let near = |end: &Number| (x.to_f64() - end.to_f64()).abs() <= 1e-9 * end.to_f64().abs();
        match ends.iter().find(|end| near(end)) {
            Some(end) => end.clone(),
            None => x,
        }
    };
    BoxPoint {
        inertia_kg_m2: pull(point.inertia_kg_m2, &range.inertia),
        friction_n_m_s_per_rad: pull(point.friction_n_m_s_per_rad, &range.friction),
        stiffness_n_m_per_rad: pull(point.stiffness_n_m_per_rad, &range.stiffness),
    }
}

/// Corners first, then a grid that is geometric in the inertia.
fn grid(range: &LoopBox) -> impl Iterator<Item = BoxPoint> {
    let ends = |interval: &[Number; 2]| [interval[0].to_f64(), interval[1].to_f64()];
    let (m, d, g) = (ends(&range.inertia), ends(&range.friction), ends(&range.stiffness));
    let share = |k: u32| f64::from(k) / f64::from(GRID);
    let linear = move |[lower, upper]: [f64; 2], k: u32| lower + (upper - lower) * share(k);
    let corners = (0..8_usize).filter_map(move |k| as_point([m[k & 1], d[k >> 1 & 1], g[k >> 2]]));
    let inside = (0..=GRID).flat_map(move |i| {
        (0..=GRID).flat_map(move |j| {
            (0..=GRID).filter_map(move |k| as_point([m[0] * (m[1] / m[0]).powf(share(i)), linear(d, j), linear(g, k)]))
        })
    });
    corners.chain(inside)
}
