//! What a certificate says about the nonlinear loop, on its linear members: constant inertia, linear gravity. There V is a quadratic form, and decay,
//! start, limits and distances are eigenvalues; a moving goal and noise are simulated by exact steps, each chosen to raise V most.

use certune::verify::{
    Claim, Compensation, DisturbanceClaim, Document, GoalList, JointRegionClaim, MovingGoalClaim, Number, RegionClaim,
    SampledRegionClaim, family_box,
};
use nalgebra::{DMatrix, DVector};

use super::loops::{Joint, Motion, Sample, ends, point};

const SLACK: f64 = 1e-6;
const POINTS: usize = 12;
/// Place of e, m, mu', mu'', u~ among e, dq, m, mu', mu'', u~.
const PLACE: [usize; 5] = [0, 2, 3, 4, 5];

/// V of one joint as a matrix over e, dq, m, mu', mu'', u~.
fn energy(p: f64, b: &[Number], s: &[f64], [m, g]: [f64; 2]) -> DMatrix<f64> {
    let mut v = DMatrix::zeros(6, 6);
    v[(1, 1)] = p * m;
    let mut entries = s.iter();
    for i in 0..5 {
        v[(1, PLACE[i])] = m * b[i].to_f64();
        v[(PLACE[i], 1)] = v[(1, PLACE[i])];
        for j in i..5 {
            let entry = *entries.next().unwrap();
            v[(PLACE[i], PLACE[j])] = entry;
            v[(PLACE[j], PLACE[i])] = entry;
        }
    }
    // U - U(goal) - g(goal) e = g e^2 / 2 for a spring.
    v[(0, 0)] += p * g;
    v
}

fn floats(numbers: &[Number]) -> Vec<f64> {
    numbers.iter().map(Number::to_f64).collect()
}

/// A region on one joint of one linear member.
struct Member {
    joint: Joint,
    at: [f64; 3],
    v: DMatrix<f64>,
    rate: f64,
}

impl Member {
    /// Of a region or joint-region; `None` when this attack knows no member.
    fn draw(document: &Document, claim: &Claim, index: usize, uniform: &mut impl FnMut() -> f64) -> Option<Self> {
        let joint = Joint::of(document, index);
        match claim {
            Claim::Region(claim) => {
                let at = point(&family_box(document), uniform);
                let w = &claim.witness;
                let v = energy(w.p.to_f64(), &w.b, &floats(&w.s), [at[0], at[2]]);
                Some(Self { joint, at, v, rate: claim.rate_per_s.to_f64() })
            }
            Claim::JointRegion(claim) => {
                let mut range = family_box(document);
                range.friction = document.family.friction_n_m_s_per_rad[index].clone();
                if let Some([lower, upper]) = &document.constants.bounds.diagonal_kg_m2 {
                    let tighter = |a: &Number, b: &Number, larger: bool| {
                        if (a.value() > b.value()) == larger { a.clone() } else { b.clone() }
                    };
                    range.inertia = [
                        tighter(&lower[index], &range.inertia[0], true),
                        tighter(&upper[index], &range.inertia[1], false),
                    ];
                }
                if range.inertia[0].value() > range.inertia[1].value() {
                    return None;
                }
                let at = point(&range, uniform);
                let weights = &claim.witness.joints[index];
                let [least, largest] = ends(&range.friction);
                let share = if largest > least { (at[1] - least) / (largest - least) } else { 0.0 };
                let (first, last) = (floats(weights.s.first()?), floats(weights.s.last()?));
                let s: Vec<f64> = first.iter().zip(&last).map(|(a, b)| a * (1.0 - share) + b * share).collect();
                let v = energy(claim.witness.p.to_f64(), &weights.b, &s, [at[0], at[2]]);
                Some(Self { joint, at, v, rate: claim.rate_per_s.to_f64() })
            }
            _ => None,
        }
    }

    fn decays(&self, edit: &str) {
        let a = self.joint.continuous(self.at);
        let slope = a.transpose() * &self.v + &self.v * a + &self.v * (2.0 * self.rate);
        // Scaled so that every coordinate weighs the same in V.
        let scale = DMatrix::from_diagonal(&self.v.diagonal().map(|x| x.abs().max(1e-12).sqrt().recip()));
        let worst = (&scale * slope * &scale).symmetric_eigenvalues().max();
        assert!(worst <= SLACK, "{edit}: dV/dt + 2 rate V has eigenvalue {worst} at {:?}", self.at);
    }

    /// V at rest at a distance from the goal.
    fn starts(&self, radius: f64, compensated: bool, edit: &str) {
        let torque = if compensated { 0.0 } else { self.at[2] * radius };
        let start = nalgebra::dvector![radius, 0.0, radius, 0.0, 0.0, torque];
        let at_start = start.dot(&(&self.v * &start));
        assert!(at_start <= 1.0 + 1e-9, "{edit}: V starts at {at_start}");
    }

    /// The largest value of a coordinate on `{V <= 1}`.
    fn largest(&self, coordinate: usize) -> f64 {
        self.v.clone().try_inverse().unwrap()[(coordinate, coordinate)].sqrt()
    }

    fn within(&self, coordinate: usize, limit: f64, edit: &str) {
        let found = self.largest(coordinate);
        assert!(found <= limit * (1.0 + SLACK), "{edit}: coordinate {coordinate} reaches {found} of {limit}");
    }
}

/// What gravity takes of a motor, N m.
fn gravity(document: &Document, joint: usize) -> f64 {
    document.constants.bounds.gravity_torque_n_m.as_ref().map_or(0.0, |torques| torques[joint].to_f64())
}

pub fn region(document: &Document, claim: &RegionClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let compensated = document.family.gravity_compensation;
    for _ in 0..POINTS {
        let whole = Claim::Region(Box::new(claim.clone()));
        let member = Member::draw(document, &whole, 0, uniform).unwrap();
        member.decays(edit);
        member.starts(claim.radius_rad.to_f64(), compensated, edit);
        if compensated {
            if let Some(limit) = &claim.controller_torque_n_m {
                member.within(5, limit.to_f64(), edit);
            }
            for (joint, limit) in claim.motor_limits_n_m.iter().flatten().enumerate() {
                member.within(5, limit.to_f64() - gravity(document, joint), edit);
            }
        }
        if let Some(distance) = &claim.distance_rad {
            member.within(0, distance.to_f64(), edit);
        }
    }
}

pub fn joint_region(document: &Document, claim: &JointRegionClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let compensated = document.family.gravity_compensation;
    let whole = Claim::JointRegion(Box::new(claim.clone()));
    for joint in 0..document.arm.joints {
        for _ in 0..4 {
            let Some(member) = Member::draw(document, &whole, joint, uniform) else { continue };
            member.decays(edit);
            member.starts(claim.radii_rad[joint].to_f64(), compensated, edit);
            if let Some(limits) = claim.motor_limits_n_m.as_ref().filter(|_| compensated) {
                member.within(5, limits[joint].to_f64() - gravity(document, joint), edit);
            }
            if let Some(distances) = &claim.distances_rad {
                member.within(0, distances[joint].to_f64(), edit);
            }
        }
    }
    for (step, share) in
        claim.steps.iter().flat_map(|s| s.steps_rad.iter().map(|step| (step, s.covered_share.to_f64())))
    {
        let length: f64 =
            step.iter().zip(&claim.radii_rad).map(|(e, r)| (share * e.to_f64() / r.to_f64()).powi(2)).sum();
        assert!(length <= 1.0 + SLACK, "{edit}: a step of length {length} in an ellipsoid of 1");
    }
}

/// V of the sampled loop at a sample.
fn sampled_energy(claim: &SampledRegionClaim, x: &Sample, m: f64) -> f64 {
    let (w, delay) = (&claim.witness, claim.sampling.delay_samples);
    let mut z = vec![x[0], x[2], x[3], x[4]];
    z.extend(&x[5..6 + delay]);
    z.push(x[x.len() - 1]);
    let y: f64 = z.iter().zip(&w.b).map(|(z, b)| z * b.to_f64()).sum();
    let mut v = w.p.to_f64() * m * x[1] * x[1] + 2.0 * m * x[1] * y;
    let mut entries = w.s.iter();
    for i in 0..z.len() {
        for j in i..z.len() {
            v += if i == j { 1.0 } else { 2.0 } * entries.next().unwrap().to_f64() * z[i] * z[j];
        }
    }
    v
}

pub fn sampled_region(document: &Document, claim: &SampledRegionClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let joint = Joint::of(document, 0);
    let sampling = &claim.sampling;
    let (h, delay) = (sampling.step_s.to_f64(), sampling.delay_samples);
    let decay = 1.0 - 2.0 * sampling.rate_per_s.to_f64() * h;
    let mut range = family_box(document);
    let motion = match sampling.compensation {
        Compensation::Continuous => Motion::Held { share: 0.0 },
        Compensation::Held => {
            let k_g = &document.constants.bounds.k_g_n_m_per_rad;
            range.stiffness = [format!("-{k_g}").parse().unwrap_or_else(|_| k_g.clone()), k_g.clone()];
            Motion::HeldCompensation
        }
    };
    for _ in 0..4 {
        let at = point(&range, uniform);
        let mut x = Joint::at_rest(claim.radius_rad.to_f64(), delay);
        let mut before = sampled_energy(claim, &x, at[0]);
        assert!(before <= 1.0 + SLACK, "{edit}: V starts at {before}");
        for k in 0..200 {
            x = joint.step(&x, at, h, delay, motion);
            let v = sampled_energy(claim, &x, at[0]);
            assert!(v <= decay * before + 1e-9, "{edit}: V from {before} to {v} in step {k} at {at:?}");
            before = v;
            if let Some(limit) = &sampling.torque_limit_n_m {
                assert!(x[5].abs() <= limit.to_f64(), "{edit}: torque {}", x[5]);
            }
        }
        let radius =
            joint.period(at, h, delay, motion).complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max);
        assert!(radius <= decay.sqrt() + 1e-9, "{edit}: radius {radius} at {at:?}");
    }
}

/// `exp(A h)` and what constant inputs add within h.
fn stepped(a: &DMatrix<f64>, inputs: &DMatrix<f64>, h: f64) -> [DMatrix<f64>; 2] {
    let (n, k) = (a.nrows(), inputs.ncols());
    let mut all = DMatrix::zeros(n + k, n + k);
    all.view_mut((0, 0), (n, n)).copy_from(a);
    all.view_mut((0, n), (n, k)).copy_from(inputs);
    let end = (all * h).exp();
    [end.view((0, 0), (n, n)).into_owned(), end.view((0, n), (n, k)).into_owned()]
}

/// Steps of the simulations, s.
const STEP_S: f64 = 2e-3;

pub fn moving_goal(document: &Document, claim: &MovingGoalClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let under = &document.claims[claim.region - 1].claim;
    if let Claim::SampledRegion(region) = under {
        return moving_goal_sampled(document, claim, region, edit, uniform);
    }
    for _ in 0..4 {
        let index = (uniform() * document.arm.joints as f64) as usize;
        let Some(member) = Member::draw(document, under, index, uniform) else { continue };
        let v = |x: &DVector<f64>| x.dot(&(&member.v * x));
        let [free, driven] = stepped(&member.joint.continuous(member.at), &goal_motion(), STEP_S);
        let way = DVector::from_column_slice(goal_motion().as_slice());
        // It flees where V grows.
        let mut x = DVector::zeros(6);
        for _ in 0..1500 {
            let sign = if x.dot(&(&member.v * &way)) >= 0.0 { 1.0 } else { -1.0 };
            x = &free * &x + driven.column(0) * (sign * claim.goal_speed_rad_per_s.to_f64());
            assert!(v(&x) <= 1.0 + SLACK, "{edit}: V = {} behind a moving goal", v(&x));
            assert!(x[0].abs() <= claim.distance_rad.to_f64(), "{edit}: {} from the goal", x[0]);
        }
        // It jumps as often as it may.
        let [pause, _] = stepped(&member.joint.continuous(member.at), &goal_motion(), claim.dwell_s.to_f64());
        let mut x = DVector::zeros(6);
        for _ in 0..20 {
            let sign = if x.dot(&(&member.v * &way)) >= 0.0 { 1.0 } else { -1.0 };
            x += &way * (sign * claim.jump_rad.to_f64());
            assert!(v(&x) <= 1.0 + SLACK, "{edit}: V = {} after a jump", v(&x));
            x = &pause * x;
        }
        if let Some(list) = claim.list.as_ref().filter(|_| matches!(under, Claim::Region(_))) {
            listed(list, &member, [&free, &driven], edit);
        }
    }
}

/// What a goal's velocity does to the state seen from it.
fn goal_motion() -> DMatrix<f64> {
    DMatrix::from_column_slice(6, 1, &[-1.0, 0.0, -1.0, 0.0, 0.0, 0.0])
}

/// The list of goals, all joints at once, each with the member's inertia.
fn listed(list: &GoalList, member: &Member, [free, driven]: [&DMatrix<f64>; 2], edit: &str) {
    let mut from = floats(&list.start_rad);
    let mut x = DMatrix::zeros(6, from.len());
    let speed = list.speed_rad_per_s.to_f64();
    for goal in &list.goals {
        let to = floats(&goal.goal_rad);
        let way: Vec<f64> = to.iter().zip(&from).map(|(to, from)| to - from).collect();
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        let arrival = goal.arrival_s.to_f64();
        assert!(length / speed <= arrival + SLACK, "{edit}: {length} rad at {speed} rad/s in {arrival} s");
        let (stands, mut gone, mut time) = (arrival.max(goal.duration_s.to_f64()).min(60.0), 0.0, 0.0);
        while time < stands {
            let part = if length > 0.0 { (speed * STEP_S).min(length - gone).max(0.0) } else { 0.0 };
            let rate = DMatrix::from_fn(1, way.len(), |_, j| way[j] / length.max(1e-12) * part / STEP_S);
            x = free * &x + driven * rate;
            (gone, time) = (gone + part, time + STEP_S);
            let v: f64 = (0..way.len()).map(|j| x.column(j).dot(&(&member.v * x.column(j)))).sum();
            assert!(v <= 1.0 + SLACK, "{edit}: V = {v} along the list");
        }
        from = to;
    }
}

fn moving_goal_sampled(
    document: &Document,
    claim: &MovingGoalClaim,
    region: &SampledRegionClaim,
    edit: &str,
    uniform: &mut impl FnMut() -> f64,
) {
    let joint = Joint::of(document, 0);
    let (h, delay) = (region.sampling.step_s.to_f64(), region.sampling.delay_samples);
    for _ in 0..4 {
        let at = point(&family_box(document), uniform);
        let mut x = Joint::at_rest(0.0, delay);
        for _ in 0..800 {
            let step = claim.goal_speed_rad_per_s.to_f64() * h;
            let moved = |sign: f64| {
                let mut x = x.clone();
                (x[0], x[2]) = (x[0] + sign * step, x[2] + sign * step);
                x
            };
            let v = |x: &Sample| sampled_energy(region, x, at[0]);
            let (left, right) = (moved(-1.0), moved(1.0));
            x = if v(&left) > v(&right) { left } else { right };
            assert!(sampled_energy(region, &x, at[0]) <= 1.0 + SLACK, "{edit}: V behind a moving goal");
            assert!(x[0].abs() <= claim.distance_rad.to_f64(), "{edit}: {} from the goal", x[0]);
            x = joint.step(&x, at, h, delay, Motion::Held { share: 0.0 });
        }
    }
}

pub fn disturbance(document: &Document, claim: &DisturbanceClaim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    let joint = Joint::of(document, 0);
    let w = &claim.witness;
    let most = [&claim.position_noise_rad, &claim.velocity_noise_rad_per_s, &claim.torque_n_m].map(Number::to_f64);
    let [excursion, ultimate, rate] =
        [&claim.excursion_rad, &claim.ultimate_rad, &claim.rate_per_s].map(Number::to_f64);
    for _ in 0..4 {
        let at = point(&family_box(document), uniform);
        let v = energy(w.p.to_f64(), &w.b, &floats(&w.s), [at[0], at[2]]);
        let inputs = joint.disturbances(at[0]);
        let [free, driven] = stepped(&joint.continuous(at), &inputs, STEP_S);
        let (radius, push) = (claim.radius_rad.to_f64(), claim.push_n_m.to_f64());
        let mut x = nalgebra::dvector![radius, 0.0, radius + most[0], most[1], 0.0, push];
        for k in 0..5000 {
            let raises = inputs.transpose() * (&v * &x);
            let noise = DVector::from_fn(3, |i, _| most[i].copysign(raises[i]));
            x = &free * &x + &driven * noise;
            let fades = excursion * (-rate * STEP_S * f64::from(k)).exp();
            let bound = (ultimate * ultimate + fades * fades).sqrt().min(excursion);
            assert!(x[0].abs() <= bound + SLACK, "{edit}: {} beyond {bound} after {k} steps", x[0]);
        }
    }
}

/// Simulations and eigenvalues of what is claimed about the nonlinear loop; other claims are for others.
pub fn attack(document: &Document, claim: &Claim, edit: &str, uniform: &mut impl FnMut() -> f64) {
    match claim {
        Claim::Region(claim) => region(document, claim, edit, uniform),
        Claim::JointRegion(claim) => joint_region(document, claim, edit, uniform),
        Claim::SampledRegion(claim) => sampled_region(document, claim, edit, uniform),
        Claim::MovingGoal(claim) => moving_goal(document, claim, edit, uniform),
        Claim::Disturbance(claim) => disturbance(document, claim, edit, uniform),
        _ => {}
    }
}
