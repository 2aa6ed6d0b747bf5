//! Attacks on the claim `sampled-region`: its bounds and its Lyapunov function against the arm in continuous time under held torque, with the
//! controller's own code.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use std::sync::LazyLock;

use certune::certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Problem, SampledConstantValues, SampledRegionOptions,
    sampled_region,
};
use certune::control::aic::{Aic, AicGains, AicParams, AicState};
use certune::control::{Controller, Measurement};
use certune::dynamics::{Model, Robot, State, forward_dynamics, gravity_torque, mass_matrix};
use certune::linsys::{JointMatrix, Joints};
use certune::verify::{Claim, Compensation, Number, Reach, SampledRegionClaim, sampled_loop};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const STEP_S: f64 = 1e-3;
const FRICTION: [f64; 2] = [1.0, 3.0];
const INERTIA: [f64; 2] = [0.1, 5.0];
const STIFFNESS: f64 = 70.0;
const K_M: f64 = 3.5;
const LIMIT_N_M: f64 = 60.0;
/// Round-off of V in a sample, and of the integrator.
const ROUNDING: f64 = 1e-9;

const PUBLISHED: AicGains<1> = AicGains {
    kappa_mu: [11.67],
    kappa_a: [700.0],
    sigma_q: [1.0],
    sigma_dq: [1.0],
    sigma_mu: [5.0],
    sigma_dmu: [10.0],
    reference_time_constant_s: [1.0],
};

/// Constants a little wider than those of the Panda with rotor inertia 0.1 kg m^2.
fn problem() -> Problem {
    let all = |x: [f64; 1]| vec![x[0]; 7];
    let arm = ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0; 3] };
    let gains = AicGainValues {
        kappa_mu: all(PUBLISHED.kappa_mu),
        kappa_a: all(PUBLISHED.kappa_a),
        sigma_q: all(PUBLISHED.sigma_q),
        sigma_dq: all(PUBLISHED.sigma_dq),
        sigma_mu: all(PUBLISHED.sigma_mu),
        sigma_dmu: all(PUBLISHED.sigma_dmu),
        reference_time_constant_s: all(PUBLISHED.reference_time_constant_s),
    };
    let family = FamilyValues {
        gravity_compensation: true,
        friction_n_m_s_per_rad: FRICTION,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    let constants = SampledConstantValues {
        m_lo_kg_m2: INERTIA[0],
        m_hi_kg_m2: INERTIA[1],
        k_g_n_m_per_rad: STIFFNESS,
        k_c_kg_m2: 2.8,
        k_r: 3.1,
        k_m: Some(K_M),
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin: 0.0,
        samples: 1,
        local_starts: 1,
    };
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}

/// The claims with 0, 1 and 2 samples of delay, searched once.
static CLAIMS: LazyLock<[SampledRegionClaim; 3]> = LazyLock::new(|| {
    let torque_limit_n_m = Some(LIMIT_N_M);
    [0, 1, 2].map(|delay_samples| {
        let options = SampledRegionOptions { delay_samples, torque_limit_n_m, ..SampledRegionOptions::default() };
        assert_eq!(options.compensation, Compensation::Held);
        match sampled_region(&problem(), &options) {
            Claim::SampledRegion(claim) => *claim,
            other => panic!("{other:?}"),
        }
    })
});

fn uniform(rng: &mut ChaCha8Rng, lower: f64, upper: f64) -> f64 {
    lower + (upper - lower) * ((rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53))
}

fn direction<const N: usize>(rng: &mut ChaCha8Rng) -> Joints<N> {
    Joints::<N>::from_fn(|_, _| (0..12).map(|_| uniform(rng, -0.5, 0.5)).sum()).normalize()
}

/// An arm in continuous time.
trait Arm<const N: usize> {
    fn mass(&self, q: &Joints<N>) -> JointMatrix<N>;
    /// Acceleration under the controller's torque and the compensation `g(held)`.
    fn acceleration(&self, held: &Joints<N>, q: &Joints<N>, dq: &Joints<N>, tau: &Joints<N>) -> Joints<N>;

    /// The held torque over a period: Runge-Kutta of order 4 in quarters of it.
    fn advance(&self, q: &Joints<N>, dq: &Joints<N>, tau: &Joints<N>) -> (Joints<N>, Joints<N>) {
        let (held, h) = (*q, STEP_S / 4.0);
        let (mut q, mut dq) = (*q, *dq);
        for _ in 0..4 {
            let slope = |q: Joints<N>, dq: Joints<N>| (dq, self.acceleration(&held, &q, &dq, tau));
            let k1 = slope(q, dq);
            let k2 = slope(q + k1.0 * (h / 2.0), dq + k1.1 * (h / 2.0));
            let k3 = slope(q + k2.0 * (h / 2.0), dq + k2.1 * (h / 2.0));
            let k4 = slope(q + k3.0 * h, dq + k3.1 * h);
            q += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
            dq += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
        }
        (q, dq)
    }
}

/// The textbook joint: `m ddq + d dq = tau + g(held) - g(q)` with a linear g.
struct Joint {
    inertia: f64,
    friction: f64,
    stiffness: f64,
}

impl Arm<1> for Joint {
    fn mass(&self, _: &Joints<1>) -> JointMatrix<1> {
        JointMatrix::<1>::new(self.inertia)
    }

    fn acceleration(&self, held: &Joints<1>, q: &Joints<1>, dq: &Joints<1>, tau: &Joints<1>) -> Joints<1> {
        (tau - dq * self.friction + (held - q) * self.stiffness) / self.inertia
    }
}

impl Arm<7> for Model<7> {
    fn mass(&self, q: &Joints<7>) -> JointMatrix<7> {
        mass_matrix(self, q)
    }

    fn acceleration(&self, held: &Joints<7>, q: &Joints<7>, dq: &Joints<7>, tau: &Joints<7>) -> Joints<7> {
        forward_dynamics(self, &State { q: *q, dq: *dq }, &(tau + gravity_torque(self, held)))
    }
}

/// The Panda with rotor inertia 0.1 kg m^2 and friction drawn joint by joint.
fn panda(rng: &mut ChaCha8Rng) -> Model<7> {
    let friction = Joints::from_fn(|_, _| uniform(rng, FRICTION[0], FRICTION[1]));
    Model::<7>::new(&Robot::panda())
        .unwrap()
        .with_rotor_inertia(&Joints::repeat(0.1))
        .with_friction(&friction, &Joints::zeros())
}

/// The loop at a sample, before the controller's step.
#[derive(Clone)]
struct Loop<const N: usize> {
    q: Joints<N>,
    dq: Joints<N>,
    goal: Joints<N>,
    beliefs: AicState<N>,
    /// The torques computed, the last one first.
    torques: Vec<Joints<N>>,
    mean_behind: Joints<N>,
}

impl<const N: usize> Loop<N> {
    fn at_rest(q: Joints<N>, goal: Joints<N>, delay: usize) -> Self {
        let beliefs = AicState { mu: q, dmu: Joints::zeros(), ddmu: Joints::zeros(), u: Joints::zeros() };
        let torques = vec![Joints::zeros(); delay + 1];
        Self { q, dq: Joints::zeros(), goal, beliefs, torques, mean_behind: Joints::zeros() }
    }

    fn states(&self) -> Vec<Joints<N>> {
        let mut z = vec![self.q - self.goal, self.beliefs.mu - self.goal, self.beliefs.dmu, self.beliefs.ddmu];
        z.extend(&self.torques);
        z.push(self.mean_behind);
        z
    }

    fn value(&self, claim: &SampledRegionClaim, arm: &impl Arm<N>) -> f64 {
        let witness = &claim.witness;
        let momentum = arm.mass(&self.q) * self.dq;
        let z = self.states();
        let y = witness.b.iter().zip(&z).fold(Joints::<N>::zeros(), |sum, (b, z)| sum + z * b.to_f64());
        let mut value = witness.p.to_f64() * momentum.dot(&self.dq) + 2.0 * momentum.dot(&y);
        let mut entries = witness.s.iter().map(Number::to_f64);
        for i in 0..z.len() {
            for j in i..z.len() {
                value += entries.next().unwrap() * z[i].dot(&z[j]) * if i == j { 1.0 } else { 2.0 };
            }
        }
        value
    }

    fn step(&self, controller: &Aic<N>, arm: &impl Arm<N>, delay: usize) -> Self {
        let (beliefs, u) = controller.step(&self.beliefs, &Measurement { q: self.q, dq: self.dq }, &self.goal);
        let mut torques = vec![u];
        torques.extend(&self.torques);
        let (q, dq) = arm.advance(&self.q, &self.dq, &torques[delay]);
        torques.truncate(delay + 1);
        Self { q, dq, goal: self.goal, beliefs, torques, mean_behind: (q - self.q) / STEP_S }
    }

    /// Runs and checks V and the torque at every sample; returns the largest share of its bound that V took in a sample.
    fn attacked(mut self, claim: &SampledRegionClaim, arm: &impl Arm<N>, samples: usize) -> f64 {
        let delay = claim.sampling.delay_samples;
        let controller = Aic::<N>::new(&AicParams::new(&PUBLISHED.on_every_joint(), STEP_S).unwrap());
        let kept = 1.0 - 2.0 * claim.sampling.rate_per_s.to_f64() * STEP_S;
        let mut value = self.value(claim, arm);
        assert!(value <= 1.0 + ROUNDING, "{value}");
        let mut worst: f64 = 0.0;
        for sample in 0..samples {
            let next = self.step(&controller, arm, delay);
            let after = next.value(claim, arm);
            assert!(after <= kept * value + ROUNDING * value.max(1e-6), "sample {sample}: V {value} to {after}");
            let torque = next.torques[0].norm();
            assert!(torque <= LIMIT_N_M * value.sqrt() * (1.0 + ROUNDING), "sample {sample}: {torque} N m");
            worst = worst.max(after / value);
            (self, value) = (next, after);
        }
        worst
    }
}

fn random_loop<const N: usize>(rng: &mut ChaCha8Rng, delay: usize, size: &[f64; 6]) -> Loop<N> {
    let mut vector = |size: f64| direction::<N>(rng) * size;
    let q = vector(size[0]);
    let beliefs = AicState { mu: vector(size[1]), dmu: vector(size[2]), ddmu: vector(size[3]), u: Joints::zeros() };
    let torques = (0..=delay).map(|_| vector(size[4])).collect::<Vec<_>>();
    let dq = vector(size[5]);
    let beliefs = AicState { u: torques[0], ..beliefs };
    Loop { q, dq, goal: Joints::zeros(), beliefs, torques, mean_behind: Joints::zeros() }
}

/// Every rate of a linear loop, from every state of the boundary: the one-joint arm is linear, so any state with a true past may be scaled
/// onto `V = 1`.
#[test]
fn the_textbook_joint_obeys_every_claim() {
    let mut rng = ChaCha8Rng::seed_from_u64(0x5EC1);
    for (delay, claim) in CLAIMS.iter().enumerate() {
        let controller = Aic::<1>::new(&AicParams::new(&PUBLISHED, STEP_S).unwrap());
        let mut worst: f64 = 0.0;
        for _ in 0..300 {
            let inertia = uniform(&mut rng, INERTIA[0].ln(), INERTIA[1].ln()).exp();
            let friction = uniform(&mut rng, FRICTION[0], FRICTION[1]);
            let stiffness = uniform(&mut rng, -STIFFNESS, STIFFNESS);
            let arm = Joint { inertia, friction, stiffness };
            let sizes: [f64; 6] = [1.0, 1.0, 1.0, 1.0, 40.0, 3.0].map(|size| size * uniform(&mut rng, -6.0, 0.0).exp());
            let start = random_loop::<1>(&mut rng, delay, &sizes).step(&controller, &arm, delay);
            let size = start.value(claim, &arm).sqrt().recip();
            assert!(size.is_finite(), "V is positive");
            let scaled = Loop {
                q: start.q * size,
                dq: start.dq * size,
                goal: start.goal,
                beliefs: AicState {
                    mu: start.beliefs.mu * size,
                    dmu: start.beliefs.dmu * size,
                    ddmu: start.beliefs.ddmu * size,
                    u: start.beliefs.u * size,
                },
                torques: start.torques.iter().map(|u| u * size).collect(),
                mean_behind: start.mean_behind * size,
            };
            worst = worst.max(scaled.attacked(claim, &arm, 400));
        }
        println!("delay {delay}: radius {}, V+ at most {worst} V", claim.radius_rad);
    }
}

#[test]
fn the_panda_obeys_every_claim_from_the_boundary() {
    let mut rng = ChaCha8Rng::seed_from_u64(0x5EC2);
    for (delay, claim) in CLAIMS.iter().enumerate() {
        let radius = claim.radius_rad.to_f64();
        let weight = claim.goal_step_weight().unwrap();
        let weight =
            weight.numer().to_string().parse::<f64>().unwrap() / weight.denom().to_string().parse::<f64>().unwrap();
        let mut worst: f64 = 0.0;
        for _ in 0..12 {
            let arm = panda(&mut rng);
            let q = Joints::<7>::from_fn(|_, _| uniform(&mut rng, -3.1, 3.1));
            let start = Loop::at_rest(q, q + direction::<7>(&mut rng) * radius, delay);
            worst = worst.max(start.clone().attacked(claim, &arm, 500));
            // A goal step on the way.
            let controller = Aic::<7>::new(&AicParams::new(&PUBLISHED.on_every_joint(), STEP_S).unwrap());
            let on_the_way = (0..200).fold(start, |at, _| at.step(&controller, &arm, delay));
            let before = on_the_way.value(claim, &arm).sqrt();
            let change = direction::<7>(&mut rng) * ((1.0 - before) / weight.sqrt());
            let moved = Loop { goal: on_the_way.goal + change, ..on_the_way };
            let after = moved.value(claim, &arm).sqrt();
            assert!(after <= 1.0 + ROUNDING, "goal step: {before} to {after}");
            worst = worst.max(moved.attacked(claim, &arm, 300));
        }
        println!("delay {delay}: radius {radius}, V+ at most {worst} V");
    }
}

/// `|vb - dq - (h/2) M^-1 (tau - D vb)|_M`, and the same backwards, at speeds up to what the bound allows.
#[test]
fn the_mean_velocity_keeps_within_its_bounds() {
    let mut rng = ChaCha8Rng::seed_from_u64(0x5EC3);
    let claim = &CLAIMS[1];
    let witness = &claim.witness;
    let problem = problem();
    let motion = sampled_loop(problem.document(), &claim.sampling, &witness.rho, &witness.speed).unwrap().to_f64();
    let most = witness.speed.to_f64() / (K_M * STEP_S);
    let mut largest = [0.0_f64; 2];
    for _ in 0..2_000 {
        let arm = panda(&mut rng);
        let q = Joints::<7>::from_fn(|_, _| uniform(&mut rng, -3.1, 3.1));
        let (dq, tau) = (direction::<7>(&mut rng), direction::<7>(&mut rng));
        let share = uniform(&mut rng, 0.0, 1.0);
        let mass = arm.mass(&q);
        let norm = |x: &Joints<7>, mass: &JointMatrix<7>| x.dot(&(mass * x)).sqrt();
        let inverse_norm = |f: &Joints<7>, mass: &JointMatrix<7>| f.dot(&mass.cholesky().unwrap().solve(f)).sqrt();
        let dq = dq * (share * most / norm(&dq, &mass));
        let tau = tau * ((1.0 - share) * most / (STEP_S * inverse_norm(&tau, &mass)));
        let (q_next, dq_next) = arm.advance(&q, &dq, &tau);
        let mean = (q_next - q) / STEP_S;
        let force = tau - arm.viscous_n_m_s_per_rad().component_mul(&mean);
        let ends = [(q, dq, 0.5), (q_next, dq_next, -0.5)];
        for (((q, dq, half), bound), largest) in ends.into_iter().zip(motion.mean_bounds()).zip(&mut largest) {
            let mass = arm.mass(&q);
            let rest = mean - dq - mass.cholesky().unwrap().solve(&force) * (half * STEP_S);
            let speed = norm(&dq, &mass);
            let push = STEP_S * inverse_norm(&tau, &mass);
            let allowed = (bound[0] * speed * speed + bound[1] * push * push).sqrt();
            let ratio = norm(&rest, &mass) / allowed;
            assert!(ratio <= 1.0, "{ratio} of the bound");
            *largest = largest.max(ratio);
        }
    }
    println!("largest shares of the bounds {largest:?}");
    // A bound that is never approached would hide a slip in the units.
    assert!(largest.iter().all(|share| *share > 0.02), "{largest:?}");
}

/// The rows of the proof are the controller's own step.
#[test]
fn the_matrices_are_the_controllers_law() {
    let mut rng = ChaCha8Rng::seed_from_u64(0x5EC4);
    let controller = Aic::<1>::new(&AicParams::new(&PUBLISHED, STEP_S).unwrap());
    let problem = problem();
    for delay in 0..3 {
        let mut sampling = CLAIMS[1].sampling.clone();
        sampling.delay_samples = delay;
        let [rho, speed] = ["0.1", "0.01"].map(|text| text.parse::<Number>().unwrap());
        let motion = sampled_loop(problem.document(), &sampling, &rho, &speed).unwrap().to_f64();
        let at = motion.coordinates(Reach::Period);
        for _ in 0..20 {
            let x: Vec<f64> = (0..at.order).map(|_| uniform(&mut rng, -1.0, 1.0)).collect();
            let z = &x[at.error..];
            let joint = Joints::<1>::new;
            let state = AicState { mu: joint(z[1]), dmu: joint(z[2]), ddmu: joint(z[3]), u: joint(z[4]) };
            let measured = Measurement { q: joint(z[0]), dq: joint(x[0]) };
            let (next, u) = controller.step(&state, &measured, &joint(0.0));
            let mut torques = vec![u[0]];
            torques.extend(&z[4..]);
            let mean = x[at.mean.unwrap()];
            let mut expected = vec![z[0] + STEP_S * mean, next.mu[0], next.dmu[0], next.ddmu[0]];
            expected.extend(&torques[..=delay]);
            expected.push(mean);
            let value = |row: &[f64]| row.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>();
            let [_, after] = motion.states(Reach::Period);
            assert_eq!(after.len(), expected.len());
            for (row, expected) in after.iter().zip(&expected) {
                assert!((value(&row.0) - expected).abs() <= 1e-12, "delay {delay}");
            }
            let [tau, tau_behind] = motion.held_torques(Reach::Period);
            assert!((value(&tau.0) - torques[delay]).abs() <= 1e-12);
            assert!((value(&tau_behind.0) - torques[delay + 1]).abs() <= 1e-12);
        }
    }
}
