//! What a certificate says about the adaptive loop, on members drawn from its enclosures.

use certune::verify::{
    AdaptiveConvergenceClaim, AdaptiveRefusedClaim, AdaptiveSampledClaim, AdaptiveSampledRefusedClaim, Claim,
    ConfigurationSet, Document, MracGains, MracLaw, Number, PiExponentialClaim, PiRefusedClaim,
};
use nalgebra::DMatrix;

use super::loops::ends;

const SLACK: f64 = 1e-6;
const MEMBERS: usize = 24;
/// Largest stable `h K/m` for 0, 1, 2 samples of delay.
const LIMITS: [f64; 3] = [2.0, 1.0, 0.618_033_988_749_895];

fn floats(numbers: &[Number]) -> Vec<f64> {
    numbers.iter().map(Number::to_f64).collect()
}

/// The gains as the claims need them, joint by joint.
struct Law<'a> {
    gains: &'a MracGains,
    p3: Vec<f64>,
    lambda: Vec<f64>,
    /// `|r|^2`.
    goal: f64,
}

impl<'a> Law<'a> {
    fn of(document: &'a Document, goal: &[Number]) -> Self {
        let gains = document.gains.mrac().unwrap();
        let lists = [&gains.omega_rad_per_s, &gains.zeta, &gains.l1, &gains.l2];
        let (mut p3, mut lambda) = (Vec::new(), Vec::new());
        for joint in 0..document.arm.joints {
            let [w, zeta, l1, l2] = lists.map(|list| list[joint].to_f64());
            let weight = l2 / (4.0 * zeta * w) + l1 / (4.0 * zeta * w.powi(3));
            lambda.push(l1 / (2.0 * w * w) / weight);
            p3.push(weight);
        }
        Self { gains, p3, lambda, goal: floats(goal).iter().map(|x| x * x).sum() }
    }

    /// Damping of the proportional terms at a configuration with `|q|^2`.
    fn damping(&self, joint: usize, q: f64) -> f64 {
        let g = self.gains;
        let e = g.e0[0][joint].to_f64() * q + g.f0[0][joint].to_f64() * self.goal;
        self.p3[joint] * (g.alpha[0][joint].to_f64() + e)
    }

    fn stiffness(&self, joint: usize) -> f64 {
        let g = self.gains;
        let e = (g.e0[1][joint].to_f64() + g.f0[1][joint].to_f64()) * self.goal;
        self.p3[joint] * (g.alpha[1][joint].to_f64() + e)
    }
}

/// A friction matrix of the family.
fn friction(document: &Document, uniform: &mut impl FnMut() -> f64) -> Vec<f64> {
    let intervals = document.family.friction_n_m_s_per_rad.iter().map(ends);
    intervals.map(|[least, most]| least + (most - least) * uniform().round()).collect()
}

/// A symmetric matrix of the enclosure, at its ends.
fn enclosed(document: &Document, uniform: &mut impl FnMut() -> f64) -> DMatrix<f64> {
    let inertia = document.constants.bounds.inertia.as_ref().unwrap();
    let n = document.arm.joints;
    let mut m = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in i..n {
            let (middle, radius) = (inertia.midpoint_kg_m2[i][j].to_f64(), inertia.radius_kg_m2[i][j].to_f64());
            m[(i, j)] = middle + radius * (2.0 * uniform().round() - 1.0);
            m[(j, i)] = m[(i, j)];
        }
    }
    m
}

fn convergence(document: &Document, claim: &AdaptiveConvergenceClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let law = Law::of(document, &claim.goal_rad);
    assert!(law.gains.law != MracLaw::ReleasedCode, "{edit}: the released code is not covered");
    let n = document.arm.joints;
    let (goal, spring) = (floats(&claim.goal_rad), floats(&claim.witness.spring_n_m_per_rad));
    let ConfigurationSet::Box { lower_rad, upper_rad } = &document.constants.over else { panic!("{edit}: no box") };
    let (lower, upper) = (floats(lower_rad), floats(upper_rad));
    // |q| is least at the point of the box that is nearest to zero.
    let least: f64 = lower.iter().zip(&upper).map(|(l, u)| l.max(0.0).max(-u).powi(2)).sum();
    let kappa = (0..n).map(|j| law.p3[j] * law.gains.e1[0][j].to_f64()).fold(f64::INFINITY, f64::min);
    let k_c = document.constants.bounds.inertia.as_ref().unwrap().coriolis_kg_m2.to_f64();
    let (level, radius) = (claim.level_j.to_f64(), claim.start_radius_rad.to_f64());
    for j in 0..n {
        let room = (goal[j] - lower[j]).min(upper[j] - goal[j]);
        assert!(0.5 * spring[j] * room * room >= level * (1.0 - SLACK), "{edit}: joint {j} leaves the box");
    }
    let lambda = DMatrix::from_fn(n, n, |i, j| if i == j { law.lambda[i] } else { 0.0 });
    let lambda_e = DMatrix::from_fn(n, n, |i, j| if i == j { spring[i] } else { 0.0 });
    let k = DMatrix::from_fn(n, n, |i, j| if i == j { law.damping(i, least) } else { 0.0 });
    for _ in 0..MEMBERS {
        let m = enclosed(document, uniform);
        let d = friction(document, uniform);
        let d = DMatrix::from_fn(n, n, |i, j| if i == j { d[i] } else { 0.0 });
        // dV/dt = -s'Ks + s'(M lambda - D) v + e'Lambda v + k_C^2/(4 kappa) |lambda e|^2, v = s - lambda e.
        let mut change = DMatrix::zeros(2 * n, 2 * n);
        let drift = &m * &lambda - d;
        let ss = -&k + &drift;
        change.view_mut((0, 0), (n, n)).copy_from(&ss);
        change.view_mut((0, n), (n, n)).copy_from(&(&lambda_e - &drift * &lambda));
        let ee = -&lambda_e * &lambda + &lambda * &lambda * (k_c * k_c / (4.0 * kappa));
        change.view_mut((n, n), (n, n)).copy_from(&ee);
        let symmetric = (&change + change.transpose()) * 0.5;
        let scale = symmetric.diagonal().map(|x| x.abs().max(1e-9).sqrt().recip());
        let scale = DMatrix::from_diagonal(&scale);
        let worst = (&scale * symmetric * &scale).symmetric_eigenvalues().max();
        assert!(worst <= SLACK, "{edit}: dV/dt has eigenvalue {worst}");
        let start = (&lambda * &m * &lambda + &lambda_e) * (0.5 * radius * radius);
        assert!(start.symmetric_eigenvalues().max() <= level * (1.0 + SLACK), "{edit}: V starts above its level");
    }
}

fn refused(document: &Document, claim: &AdaptiveRefusedClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let law = Law::of(document, &claim.goal_rad);
    let v = nalgebra::DVector::from_vec(floats(&claim.direction));
    for _ in 0..MEMBERS {
        let m = enclosed(document, uniform);
        let d = friction(document, uniform);
        let push = (0..v.len()).map(|i| {
            let row: f64 = (0..v.len()).map(|j| m[(i, j)] * law.lambda[j] * v[j]).sum();
            v[i] * (row - (d[i] + law.damping(i, law.goal)) * v[i])
        });
        let rise: f64 = push.sum();
        assert!(rise >= -SLACK * v.norm_squared(), "{edit}: V falls at the goal: {rise}");
    }
}

fn random_rotation(n: usize, uniform: &mut impl FnMut() -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |_, _| uniform() - 0.5).qr().q()
}

/// A symmetric matrix with eigenvalues at the ends of an interval.
fn between(n: usize, [least, most]: [f64; 2], uniform: &mut impl FnMut() -> f64) -> DMatrix<f64> {
    let rotation = if uniform() < 0.5 { DMatrix::identity(n, n) } else { random_rotation(n, uniform) };
    let values = DMatrix::from_fn(n, n, |i, j| if i == j { least + (most - least) * uniform().round() } else { 0.0 });
    &rotation * values * rotation.transpose()
}

fn frozen(document: &Document, claim: &PiExponentialClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let law = Law::of(document, &claim.goal_rad);
    let n = document.arm.joints;
    let bounds = &document.constants.bounds;
    let k0 = claim.accumulated_k0_n_m_per_rad.to_f64();
    for _ in 0..MEMBERS {
        let m = between(n, [bounds.m_lo_kg_m2.to_f64(), bounds.m_hi_kg_m2.to_f64()], uniform);
        let gained = between(n, [0.0, k0], uniform);
        let d = friction(document, uniform);
        let inverse = m.try_inverse().unwrap();
        let mut a = DMatrix::zeros(3 * n, 3 * n);
        let (mut stiffness, mut damping) = (gained, DMatrix::zeros(n, n));
        let mut integral = DMatrix::zeros(n, n);
        for j in 0..n {
            let k = law.damping(j, law.goal);
            stiffness[(j, j)] -= k * law.lambda[j];
            damping[(j, j)] = -(k + d[j]);
            integral[(j, j)] = -law.stiffness(j);
            (a[(j, n + j)], a[(2 * n + j, n + j)], a[(2 * n + j, j)]) = (1.0, 1.0, law.lambda[j]);
        }
        for (column, block) in [stiffness, damping, integral].iter().enumerate() {
            a.view_mut((n, column * n), (n, n)).copy_from(&(&inverse * block));
        }
        let worst = a.complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
        assert!(worst < SLACK, "{edit}: eigenvalue {worst} with K0 up to {k0}");
    }
}

fn frozen_refused(document: &Document, claim: &PiRefusedClaim, edit: &str) {
    let law = Law::of(document, &claim.goal_rad);
    let (joint, m) = (claim.joint - 1, claim.inertia_kg_m2.to_f64());
    let (k, k_i, lambda) = (law.damping(joint, law.goal), law.stiffness(joint), law.lambda[joint]);
    let d = document.family.friction_n_m_s_per_rad[joint][0].to_f64();
    let (least, largest) = ((k + d) * (lambda * k + k_i), m * lambda * k_i);
    assert!(least <= largest * (1.0 + SLACK), "{edit}: the frozen loop of the joint is stable");
}

fn sampled(document: &Document, claim: &AdaptiveSampledClaim, edit: &str) {
    let law = Law::of(document, &claim.goal_rad);
    let bounds = &document.constants.bounds;
    for joint in 0..document.arm.joints {
        let lightest = bounds.diagonal_kg_m2.as_ref().map_or(&bounds.m_lo_kg_m2, |[lower, _]| &lower[joint]);
        let x = claim.step_s.to_f64() * law.damping(joint, law.goal) / lightest.to_f64();
        let limit = LIMITS[claim.delay_samples as usize];
        assert!(x > 0.0 && x < limit * (1.0 + SLACK), "{edit}: h K/m = {x} of {limit} at joint {joint}");
    }
}

fn sampled_refused(document: &Document, claim: &AdaptiveSampledRefusedClaim, edit: &str) {
    let of = &claim.velocity_loop;
    let law = Law::of(document, &of.goal_rad);
    let (joint, inertia) = (claim.joint - 1, document.constants.bounds.inertia.as_ref().unwrap());
    let heaviest = inertia.midpoint_kg_m2[joint][joint].to_f64() + inertia.radius_kg_m2[joint][joint].to_f64();
    let x = of.step_s.to_f64() * law.damping(joint, law.goal) / heaviest;
    let limit = LIMITS[of.delay_samples as usize];
    assert!(x > limit * (1.0 - SLACK), "{edit}: h K/m = {x} of {limit}");
}

/// What is claimed about the adaptive controller; other claims are for others.
pub fn attack(document: &Document, claim: &Claim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    match claim {
        Claim::AdaptiveConvergence(claim) => convergence(document, claim, edit, uniform),
        Claim::AdaptiveRefused(claim) => refused(document, claim, edit, uniform),
        Claim::PiExponential(claim) => frozen(document, claim, edit, uniform),
        Claim::PiRefused(claim) => frozen_refused(document, claim, edit),
        Claim::AdaptiveSampled(claim) => sampled(document, claim, edit),
        Claim::AdaptiveSampledRefused(claim) => sampled_refused(document, claim, edit),
        _ => {}
    }
}
