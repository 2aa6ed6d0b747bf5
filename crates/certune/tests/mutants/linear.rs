//! What a certificate says about linear loops, against eigenvalues.

use certune::verify::{
    Claim, ClaimKind, Document, LoopTiming, LyapunovClaim, NotProvedClaim, Number, PlaneRegion, PlantStep, Polytope,
    RefusedClaim, SampledClaim, Variation, family_box,
};
use nalgebra::{Complex, DMatrix};

use super::loops::{Joint, Motion, point};

/// Eigenvalues in floating point against a rate proved exactly.
const SLACK: f64 = 1e-6;
const POINTS: usize = 16;

fn abscissa(a: &DMatrix<f64>) -> f64 {
    a.complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max)
}

fn radius(a: &DMatrix<f64>) -> f64 {
    a.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max)
}

/// Every loop of the box decays.
pub fn decays(
    document: &Document,
    range: &certune::verify::LoopBox,
    rate: f64,
    edit: &str,
    uniform: &mut impl FnMut() -> f64,
) {
    let joint = Joint::of(document, 0);
    for _ in 0..POINTS {
        let at = point(range, uniform);
        let found = abscissa(&joint.continuous(at));
        assert!(found < -rate + SLACK * (1.0 + rate), "{edit}: {found} against {rate} at {at:?}");
    }
}

/// Spectral radius of one sampled loop.
fn sampled_radius(joint: &Joint, timing: &LoopTiming, delay_s: f64, at: [f64; 3]) -> f64 {
    let h = timing.period_s.to_f64();
    let samples = delay_s / h;
    let whole = (samples + 1e-9).floor();
    let motion = match timing.plant {
        PlantStep::SemiImplicit => Motion::SemiImplicit,
        PlantStep::ZeroOrderHold => Motion::Held { share: (samples - whole).max(0.0) },
    };
    radius(&joint.period(at, h, whole as usize, motion))
}

/// Every loop of the box decays at every delay.
fn sampled_decays(
    document: &Document,
    range: &certune::verify::LoopBox,
    timing: &LoopTiming,
    [delay_s, rate]: [f64; 2],
    edit: &str,
    uniform: &mut impl FnMut() -> f64,
) {
    let joint = Joint::of(document, 0);
    let h = timing.period_s.to_f64();
    for _ in 0..POINTS {
        let at = point(range, uniform);
        // The ends, and in between; whole samples alone where the claim is about those.
        let tried = uniform() * 1.5 * delay_s;
        let delay = match timing.plant {
            PlantStep::SemiImplicit => (tried.min(delay_s) / h + 1e-9).floor() * h,
            PlantStep::ZeroOrderHold => tried.min(delay_s),
        };
        let found = sampled_radius(&joint, timing, delay, at);
        assert!(found < 1.0 - rate * h + 1e-9, "{edit}: radius {found} against {rate} at {at:?}, delay {delay} s");
    }
}

pub fn sampled(document: &Document, claim: &SampledClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let (range, timing) = (family_box(document), &claim.sampling);
    let delay = timing.delay_s.to_f64();
    sampled_decays(document, &range, timing, [delay, claim.rate_per_s.to_f64()], edit, uniform);
    sampled_decays(document, &range, timing, [claim.delay_margin_s.to_f64(), 0.0], edit, uniform);
    for margin in &claim.margins {
        sampled_decays(document, &margin.applied(document), timing, [delay, 0.0], edit, uniform);
    }
}

/// The families that would be stable.
fn remedies(
    document: &Document,
    sampling: Option<&LoopTiming>,
    remedies: &[Variation],
    edit: &str,
    uniform: &mut impl FnMut() -> f64,
) {
    for remedy in remedies {
        let range = remedy.applied(document);
        match sampling {
            Some(timing) => {
                sampled_decays(document, &range, timing, [timing.delay_s.to_f64(), 0.0], edit, uniform);
            }
            None => decays(document, &range, 0.0, edit, uniform),
        }
    }
}

pub fn refused(document: &Document, claim: &RefusedClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let joint = Joint::of(document, 0);
    let at = [&claim.point.inertia_kg_m2, &claim.point.friction_n_m_s_per_rad, &claim.point.stiffness_n_m_per_rad];
    let at = at.map(Number::to_f64);
    let rate = claim.rate_per_s.to_f64();
    match &claim.sampling {
        Some(timing) => {
            let found = sampled_radius(&joint, timing, timing.delay_s.to_f64(), at);
            assert!(found > 1.0 - rate * timing.period_s.to_f64() - 1e-9, "{edit}: radius {found} at {at:?}");
        }
        None => {
            let found = abscissa(&joint.continuous(at));
            assert!(found > -rate - SLACK * (1.0 + rate), "{edit}: {found} at {at:?}");
        }
    }
    remedies(document, claim.sampling.as_ref(), &claim.remedies, edit, uniform);
}

pub fn not_proved(document: &Document, claim: &NotProvedClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    // Only these kinds name remedies, and only with shared gains.
    if matches!(claim.of, ClaimKind::Exponential | ClaimKind::Sampled) && document.gains.aic().is_ok() {
        remedies(document, claim.sampling.as_ref(), &claim.remedies, edit, uniform);
    }
}

pub fn margins(document: &Document, margins: &[Variation], edit: &str, uniform: &mut impl FnMut() -> f64) {
    remedies(document, None, margins, edit, uniform);
}

fn contains(region: &PlaneRegion, z: Complex<f64>) -> bool {
    let slack = SLACK * (1.0 + z.norm());
    match region {
        PlaneRegion::HalfPlane { rate_per_s } => z.re < -rate_per_s.to_f64() + slack,
        PlaneRegion::Disk { centre, radius } => (z - centre.to_f64()).norm() < radius.to_f64() + slack,
        PlaneRegion::Sector { slope } => z.re < slack && z.im.abs() < slope.to_f64() * z.re.abs() + slack,
    }
}

/// A matrix of the hull.
fn mixed(polytope: &Polytope, weights: &[f64]) -> DMatrix<f64> {
    let order = polytope.vertices[0].len();
    let vertices = polytope.vertices.iter().zip(weights);
    vertices.fold(DMatrix::zeros(order, order), |sum, (vertex, weight)| {
        sum + DMatrix::from_fn(order, order, |i, j| weight * vertex[i][j].to_f64())
    })
}

pub fn lyapunov(claim: &LyapunovClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let count = claim.polytope.vertices.len();
    for _ in 0..count {
        let weights: Vec<f64> = (0..count).map(|_| -uniform().ln()).collect();
        let sum: f64 = weights.iter().sum();
        let weights: Vec<f64> = weights.iter().map(|weight| weight / sum).collect();
        for z in mixed(&claim.polytope, &weights).complex_eigenvalues().iter() {
            assert!(claim.regions.iter().all(|region| contains(region, *z)), "{edit}: eigenvalue {z}");
        }
    }
}

/// Eigenvalues of what is claimed about linear loops; other claims are for others.
pub fn attack(document: &Document, claim: &Claim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    match claim {
        Claim::Exponential(claim) => {
            decays(document, &family_box(document), claim.rate_per_s.to_f64(), edit, uniform);
            margins(document, &claim.margins, edit, uniform);
        }
        Claim::Sampled(claim) => sampled(document, claim, edit, uniform),
        Claim::Refused(claim) => refused(document, claim, edit, uniform),
        Claim::NotProved(claim) => not_proved(document, claim, edit, uniform),
        Claim::Lyapunov(claim) => lyapunov(claim, edit, uniform),
        Claim::LyapunovRefused(claim) => {
            let weights: Vec<f64> = claim.weights.iter().map(Number::to_f64).collect();
            let values = mixed(&claim.polytope, &weights).complex_eigenvalues();
            assert!(values.iter().any(|z| !contains(&claim.region, *z) || z.re.abs() < SLACK), "{edit}: none outside");
        }
        _ => {}
    }
}
