//! One attack for each kind of claim.

use certune::closed_loop::{linearise_aic, linearise_aic_sampled};
use certune::control::aic::{AicGains, AicParams};
use certune::dynamics::{Model, Payload, gravity_torque};
use certune::linsys::Joints;
use certune::verify::{
    Certificate, Claim, ExponentialClaim, JointRegionClaim, MovingGoalClaim, Number, RefusedClaim, RegionClaim,
    SampledClaim, SampledRegionClaim,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::RngCore;

use super::chance::{angles, direction, uniform, vector};
use super::continuous::{Continuous, Loop};
use super::held::Held;
use super::subjects::Subject;

/// Eigenvalues of a 42 x 42 matrix in floating point, against a rate proved exactly.
const EIGENVALUE_SLACK_PER_S: f64 = 1e-6;
/// V along an integrated loop against the claim, relative to V(0).
const V_SLACK: f64 = 1e-6;

/// How many statements were attacked, and how often.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub rates: usize,
    pub regions: usize,
    pub sampled: usize,
    pub joint_regions: usize,
    pub sampled_regions: usize,
    pub moving_goals: usize,
    pub refusals: usize,
    pub attainable: usize,
    /// Eigenvalue problems, simulations and states of local searches.
    pub attacks: usize,
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rates += other.rates;
        self.regions += other.regions;
        self.sampled += other.sampled;
        self.joint_regions += other.joint_regions;
        self.sampled_regions += other.sampled_regions;
        self.moving_goals += other.moving_goals;
        self.refusals += other.refusals;
        self.attainable += other.attainable;
        self.attacks += other.attacks;
    }
}

/// Everything a certificate claims is attacked; a contradiction panics with the gains.
pub fn attack<const N: usize>(
    subject: &Subject<N>,
    certificate: &Certificate,
    gains: &AicGains<N>,
    rng: &mut ChaCha8Rng,
) -> Tally {
    let params = AicParams::new(gains, 0.001).unwrap();
    let mut tally = Tally::default();
    for entry in &certificate.document().claims {
        match &entry.claim {
            Claim::Exponential(claim) => exponential(subject, claim, &params, rng, &mut tally),
            Claim::Region(claim) => region(subject, claim, &params, rng, &mut tally),
            Claim::Sampled(claim) => sampled(subject, claim, &params, rng, &mut tally),
            Claim::JointRegion(claim) => joint_region(subject, claim, &params, rng, &mut tally),
            Claim::SampledRegion(claim) => sampled_region(subject, claim, &params, rng, &mut tally),
            Claim::MovingGoal(claim) => {
                let under = &certificate.document().claims[claim.region - 1].claim;
                moving_goal(subject, claim, under, &params, rng, &mut tally);
            }
            Claim::Refused(claim) => refused(subject, claim, &params, &mut tally),
            _ => {}
        }
    }
    tally
}

/// A random member of the family, as often as not with every mass at an end.
fn member<const N: usize>(subject: &Subject<N>, rng: &mut ChaCha8Rng) -> Model<N> {
    member_and_friction(subject, rng).0
}

/// The same with its friction, N m s/rad.
fn member_and_friction<const N: usize>(subject: &Subject<N>, rng: &mut ChaCha8Rng) -> (Model<N>, Joints<N>) {
    let index = rng.next_u64() >> 8;
    let mut setting = subject.plant_box.draw(N, 0xCE27, index);
    if index.is_multiple_of(2) {
        let [least, largest] = [1.0 - subject.plant_box.mass_uncertainty, 1.0 + subject.plant_box.mass_uncertainty];
        for scale in &mut setting.link_mass_scale {
            *scale = if rng.next_u64().is_multiple_of(2) { least } else { largest };
        }
    }
    let friction = Joints::from_fn(|joint, _| setting.viscous_n_m_s_per_rad[joint]);
    (setting.model::<N>(&subject.robot).unwrap(), friction)
}

/// An integration step that follows the fastest mode, near sqrt(kappa_a / (sigma_dq m_lo)) rad/s.
fn fine_step_s<const N: usize>(subject: &Subject<N>, params: &AicParams<N>) -> f64 {
    let least = subject.certifier.constants().constants.m_lo_kg_m2;
    let gains = params.gains();
    let fastest = (0..N).map(|k| gains.kappa_a[k] / (gains.sigma_dq[k] * least)).fold(0.0, f64::max).sqrt();
    (0.3 / fastest).min(5e-4)
}

/// At rest at `q`, beliefs at the measurement, the torque that a region's start has.
fn at_rest<const N: usize>(closed: &Loop<'_, N>, q: Joints<N>) -> Continuous<N> {
    let u = if closed.compensated { Joints::zeros() } else { gravity_torque(&closed.model, &q) };
    Continuous { q, dq: Joints::zeros(), beliefs: [q, Joints::zeros(), Joints::zeros()], u }
}

/// Eigenvalues of linearised loops of random members at random configurations.
fn exponential<const N: usize>(
    subject: &Subject<N>,
    claim: &ExponentialClaim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    tally.rates += 1;
    let rate = claim.rate_per_s.to_f64();
    for _ in 0..4 {
        let model = member(subject, rng);
        let closed = linearise_aic(&model, &angles(rng), params, subject.plant_box.gravity_compensation).unwrap();
        let abscissa = closed.spectral_abscissa_per_s();
        let name = &subject.name;
        assert!(abscissa < -rate + EIGENVALUE_SLACK_PER_S * (1.0 + rate), "{name}, {params:?}: {abscissa}, {rate}");
        tally.attacks += 1;
    }
}

/// From rest on the boundary of the ball V must fall as claimed; and no state of `V <= 1` near the worst found may break it.
fn region<const N: usize>(
    subject: &Subject<N>,
    claim: &RegionClaim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    tally.regions += 1;
    let compensated = subject.plant_box.gravity_compensation;
    let closed = Loop { model: member(subject, rng), params, goal: angles(rng), compensated };
    let q = closed.goal + direction(rng) * claim.radius_rad.to_f64();
    let mut x = at_rest(&closed, q);
    let start = closed.v(claim, &x);
    assert!(start <= 1.0 + V_SLACK, "{}: V starts at {start}", subject.name);
    let h = fine_step_s(subject, params);
    let steps = ((0.6 / h) as usize).min(4_000);
    let rate = claim.rate_per_s.to_f64();
    for k in 1..=steps {
        x = closed.step(&x, h);
        if k % 10 == 0 {
            let bound = start * (-2.0 * rate * k as f64 * h).exp();
            let v = closed.v(claim, &x);
            let name = &subject.name;
            assert!(v <= bound + V_SLACK * start, "{name}, {params:?}: V = {v} above {bound} after {k} steps of {h} s");
        }
    }
    tally.attacks += 1 + search(&closed, claim, rng, &subject.name);
}

/// Climbs towards a state of the region where V falls too slowly: random directions, kept when they are worse.
fn search<const N: usize>(closed: &Loop<'_, N>, claim: &RegionClaim, rng: &mut ChaCha8Rng, name: &str) -> usize {
    const STATES: usize = 60;
    let rate = claim.rate_per_s.to_f64();
    let torque_size = 5.0 * closed.params.gains().kappa_a[0].sqrt();
    let draw = |rng: &mut ChaCha8Rng| {
        let mut z: [Joints<N>; 5] = std::array::from_fn(|_| vector(rng));
        z[4] *= torque_size;
        (vector::<N>(rng), z)
    };
    // The level V = 1 along a ray, by bisection: without compensation V is no quadratic form.
    let on_level = |dq: &Joints<N>, z: &[Joints<N>; 5], level: f64| {
        let at = |t: f64| closed.state(dq * t, z.map(|part| part * t));
        let (mut low, mut high) = (0.0, 1e-3);
        while closed.v(claim, &at(high)) < level && high < 1e3 {
            (low, high) = (high, high * 2.0);
        }
        for _ in 0..30 {
            let middle: f64 = 0.5 * (low + high);
            if closed.v(claim, &at(middle)) < level { low = middle } else { high = middle }
        }
        at(low)
    };
    let level = uniform(rng, 0.2, 1.0);
    let badness = |x: &Continuous<N>| {
        let v = closed.v(claim, x);
        (closed.v_slope(claim, x) + 2.0 * rate * v) / v
    };
    let (mut dq, mut z) = draw(rng);
    let mut worst = f64::NEG_INFINITY;
    let mut spread = 1.0;
    for _ in 0..STATES {
        let (step_dq, step_z) = draw(rng);
        let tried = (dq + step_dq * spread, std::array::from_fn(|k| z[k] + step_z[k] * spread));
        let x = on_level(&tried.0, &tried.1, level);
        let found = badness(&x);
        // A central difference loses about half of the digits.
        assert!(found <= 1e-4 * (1.0 + rate), "{name}: dV/dt + 2 rate V = {found} V at {x:?}");
        if found > worst {
            (worst, (dq, z)) = (found, tried);
            spread *= 1.2;
        } else {
            spread *= 0.9;
        }
    }
    STATES
}

/// Eigenvalues of sampled loops of random members, at every whole delay up to the claim's and up to its margin.
fn sampled<const N: usize>(
    subject: &Subject<N>,
    claim: &SampledClaim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    tally.sampled += 1;
    let period = claim.sampling.period_s.to_f64();
    let samples = |delay: &Number| (delay.to_f64() / period + 1e-9).floor() as usize;
    let compensated = subject.plant_box.gravity_compensation;
    for _ in 0..3 {
        let (model, q) = (member(subject, rng), angles(rng));
        for delay in 0..=samples(&claim.delay_margin_s).min(8) {
            let closed = linearise_aic_sampled(&model, &q, params, compensated, delay).unwrap();
            let outermost = closed.eigenvalues().into_iter().map(|z| z.norm()).fold(0.0, f64::max);
            let certified = delay <= samples(&claim.sampling.delay_s);
            let most = if certified { 1.0 - claim.rate_per_s.to_f64() * period } else { 1.0 };
            assert!(outermost < most + 1e-9, "{}, {params:?}: {outermost} at delay {delay}", subject.name);
            tally.attacks += 1;
        }
    }
}

/// From rest on the ellipsoid V must fall, every motor keep to its limit and every joint to its distance.
fn joint_region<const N: usize>(
    subject: &Subject<N>,
    claim: &JointRegionClaim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    tally.joint_regions += 1;
    let name = &subject.name;
    let compensated = subject.plant_box.gravity_compensation;
    let ends = vec![subject.plant_box.friction_n_m_s_per_rad; N];
    for _ in 0..2 {
        let (model, friction) = member_and_friction(subject, rng);
        let closed = Loop { model, params, goal: angles(rng), compensated };
        let way = direction::<N>(rng);
        let q = closed.goal + Joints::from_fn(|k, _| way[k] * claim.radii_rad[k].to_f64());
        let mut x = at_rest(&closed, q);
        let v = |x: &Continuous<N>| closed.joint_v(claim, &ends, &friction, x);
        let start = v(&x);
        assert!(start <= 1.0 + V_SLACK, "{name}: V starts at {start}");
        let h = fine_step_s(subject, params);
        let rate = claim.rate_per_s.to_f64();
        for k in 1..=((0.6 / h) as usize).min(4_000) {
            x = closed.step(&x, h);
            if k % 10 != 0 {
                continue;
            }
            let bound = start * (-2.0 * rate * k as f64 * h).exp();
            assert!(v(&x) <= bound + V_SLACK * start, "{name}, {params:?}: V = {} above {bound}", v(&x));
            if let Some(limits) = &claim.motor_limits_n_m {
                let gravity = if compensated { gravity_torque(&closed.model, &x.q) } else { Joints::zeros() };
                let motor = x.u + gravity;
                assert!((0..N).all(|j| motor[j].abs() <= limits[j].to_f64()), "{name}: motors carry {motor:?}");
            }
            if let Some(distances) = &claim.distances_rad {
                let e = x.q - closed.goal;
                assert!((0..N).all(|j| e[j].abs() <= distances[j].to_f64()), "{name}: at {e:?} from the goal");
            }
        }
        tally.attacks += 1;
    }
}

/// From rest on the boundary of the ball V must fall from sample to sample, and the torque keep to its limit.
fn sampled_region<const N: usize>(
    subject: &Subject<N>,
    claim: &SampledRegionClaim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    tally.sampled_regions += 1;
    let name = &subject.name;
    let decay = (-2.0 * claim.sampling.rate_per_s.to_f64() * claim.sampling.step_s.to_f64()).exp();
    for _ in 0..2 {
        let goal = angles(rng);
        let q = goal + direction(rng) * claim.radius_rad.to_f64();
        let mut arm = Held::at_rest(member(subject, rng), params, claim, q, goal);
        let mut before = arm.v(claim);
        assert!(before <= 1.0 + V_SLACK, "{name}: V starts at {before}");
        for k in 0..500 {
            let torque = arm.step();
            let v = arm.v(claim);
            assert!(
                v <= decay * before + V_SLACK * 1e-3,
                "{name}, {params:?}: V rises from {before} to {v} in step {k}"
            );
            before = v;
            if let Some(limit) = &claim.sampling.torque_limit_n_m {
                assert!(torque.norm() <= limit.to_f64(), "{name}: torque {}", torque.norm());
            }
        }
        tally.attacks += 1;
    }
}

/// A goal at the certified speed, turning at random, must leave the state in the region and the arm near the goal.
fn moving_goal<const N: usize>(
    subject: &Subject<N>,
    claim: &MovingGoalClaim,
    under: &Claim,
    params: &AicParams<N>,
    rng: &mut ChaCha8Rng,
    tally: &mut Tally,
) {
    const STEPS: usize = 4_000;
    tally.moving_goals += 1;
    let name = &subject.name;
    let speed = claim.goal_speed_rad_per_s.to_f64();
    let near = |e: Joints<N>| assert!(e.norm() <= claim.distance_rad.to_f64(), "{name}: {} from the goal", e.norm());
    let (model, friction) = member_and_friction(subject, rng);
    let mut way = direction::<N>(rng);
    // Now and then another way; mostly on, which is worse.
    let turn = |k: usize| k.is_multiple_of(STEPS / 4);
    tally.attacks += 1;
    if let Claim::SampledRegion(region) = under {
        let goal = angles(rng);
        let mut arm = Held::at_rest(model, params, region, goal, goal);
        for k in 0..STEPS {
            if turn(k) {
                way = direction(rng);
            }
            arm.goal += way * (speed * region.sampling.step_s.to_f64());
            let v = arm.v(region);
            assert!(v <= 1.0 + V_SLACK, "{name}, {params:?}: V = {v} while the goal moves");
            near(arm.q - arm.goal);
            arm.step();
        }
        return;
    }
    let compensated = subject.plant_box.gravity_compensation;
    let mut closed = Loop { model, params, goal: angles(rng), compensated };
    let mut x = at_rest(&closed, closed.goal);
    let h = fine_step_s(subject, params);
    let ends = vec![subject.plant_box.friction_n_m_s_per_rad; N];
    for k in 0..STEPS {
        if turn(k) {
            way = direction(rng);
        }
        // A goal in small jumps is ahead of one that glides by at most half a step.
        closed.goal += way * (speed * h);
        x = closed.step(&x, h);
        let v = match under {
            Claim::Region(region) => closed.v(region, &x),
            Claim::JointRegion(region) => closed.joint_v(region, &ends, &friction, &x),
            other => unreachable!("{other:?} is no region"),
        };
        assert!(v <= 1.0 + 1e-3, "{name}, {params:?}: V = {v} while the goal moves");
        near(x.q - closed.goal);
    }
}

/// The arm that a refusal names must be unstable.
fn refused<const N: usize>(subject: &Subject<N>, claim: &RefusedClaim, params: &AicParams<N>, tally: &mut Tally) {
    tally.refusals += 1;
    let Some(attained) = &claim.attained else { return };
    tally.attainable += 1;
    let numbers = |list: &[Number]| list.iter().map(Number::to_f64).collect::<Vec<_>>();
    let scales: [f64; N] = numbers(&attained.link_mass_scale).try_into().unwrap();
    let payload = attained.payload_kg.to_f64();
    let mut model = Model::<N>::new(&subject.robot).unwrap().with_link_scales(&scales);
    if payload > 0.0 {
        model = model.with_payload(&Payload::at_grasp(&subject.robot, payload).unwrap());
    }
    let model = model
        .with_rotor_inertia(&Joints::repeat(attained.rotor_inertia_kg_m2.to_f64()))
        .with_friction(&Joints::repeat(attained.friction_n_m_s_per_rad.to_f64()), &Joints::zeros());
    let q = Joints::from_vec(numbers(&attained.q_rad));
    let compensated = subject.plant_box.gravity_compensation;
    let grows = match &claim.sampling {
        None => linearise_aic(&model, &q, params, compensated).unwrap().spectral_abscissa_per_s() > 0.0,
        Some(timing) => {
            let samples = (timing.delay_s.to_f64() / timing.period_s.to_f64()).round() as usize;
            let closed = linearise_aic_sampled(&model, &q, params, compensated, samples).unwrap();
            closed.eigenvalues().into_iter().any(|z| z.norm() > 1.0)
        }
    };
    assert!(grows, "{}: the refusal's arm is stable", subject.name);
    tally.attacks += 1;
}
