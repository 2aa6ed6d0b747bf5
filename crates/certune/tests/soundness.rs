//! A false certificate is the worst defect this workspace could have. So: thousands of random gains, and whatever is
//! certified is attacked.
//!
//! - Every certified rate is compared with eigenvalues of linearised loops of random members of the family.
//! - Every certified region is attacked in time: random members of the family start at rest on the boundary of the ball, the
//!   nonlinear continuous-time loop is integrated (Runge-Kutta 4), and the certificate's own V must start at most at 1 and fall as claimed.
//! - Every refusal must name a point where the loop is unstable, an attainable one with an unstable arm.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use certune::bounds::{ArmBox, Ranges, SearchOptions};
use certune::certify::{FamilyValues, Options, RegionOptions};
use certune::closed_loop::{PlantBox, linearise_aic};
use certune::control::aic::{AicGains, AicParams};
use certune::dynamics::{
    Model, Payload, Robot, State, forward_dynamics, gravity_torque, mass_matrix, potential_energy,
};
use certune::linsys::Joints;
use certune::verify::{Certificate, Claim, ClaimKind, RegionClaim};
use certune::{ArmCertifier, Effort, family_of};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;

const SEED: u64 = 0xCE27;
const SETS_PER_FAMILY: u64 = 500;
const N: usize = 7;
/// Eigenvalues of a 42 x 42 matrix in floating point, against a rate proved exactly.
const EIGENVALUE_SLACK_PER_S: f64 = 1e-6;
/// V along the integrated loop against the claim, relative to V(0).
const V_SLACK: f64 = 1e-6;

fn uniform(rng: &mut ChaCha8Rng, lower: f64, upper: f64) -> f64 {
    lower + (upper - lower) * ((rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53))
}

fn log_uniform(rng: &mut ChaCha8Rng, lower: f64, upper: f64) -> f64 {
    uniform(rng, lower.ln(), upper.ln()).exp()
}

fn random_gains(rng: &mut ChaCha8Rng) -> AicGains<N> {
    let mut gain = |lower: f64, upper: f64| {
        // Three digits, as a person would write them.
        let x = log_uniform(rng, lower, upper);
        format!("{x:.2e}").parse::<f64>().unwrap()
    };
    AicGains {
        kappa_mu: [gain(2.0, 200.0); N],
        kappa_a: [gain(50.0, 2e4); N],
        sigma_q: [1.0; N],
        sigma_dq: [gain(0.1, 4.0); N],
        sigma_mu: [gain(0.5, 50.0); N],
        sigma_dmu: [gain(0.5, 50.0); N],
        reference_time_constant_s: [gain(0.4, 2.0); N],
    }
}

fn random_direction(rng: &mut ChaCha8Rng) -> Joints<N> {
    // Sum of twelve uniforms: near enough to normal for a direction.
    Joints::<N>::from_fn(|_, _| (0..12).map(|_| uniform(rng, -0.5, 0.5)).sum::<f64>()).normalize()
}

/// State of one joint block: q, dq, mu, mu', mu'', u.
#[derive(Clone, Copy)]
struct Continuous {
    q: Joints<N>,
    dq: Joints<N>,
    beliefs: [Joints<N>; 3],
    u: Joints<N>,
}

struct Loop<'a> {
    model: Model<N>,
    params: &'a AicParams<N>,
    goal: Joints<N>,
    compensated: bool,
}

impl Loop<'_> {
    fn equilibrium_torque(&self) -> Joints<N> {
        if self.compensated { Joints::zeros() } else { gravity_torque(&self.model, &self.goal) }
    }

    /// z = (e, m, mu', mu'', u~) as joint vectors.
    fn z(&self, x: &Continuous) -> [Joints<N>; 5] {
        let [mu, dmu, ddmu] = x.beliefs;
        [x.q - self.goal, mu - self.goal, dmu, ddmu, x.u - self.equilibrium_torque()]
    }

    fn derivative(&self, x: &Continuous) -> Continuous {
        let compensation = if self.compensated { gravity_torque(&self.model, &x.q) } else { Joints::zeros() };
        let ddq = forward_dynamics(&self.model, &State { q: x.q, dq: x.dq }, &(x.u + compensation));
        let z = self.z(x);
        let mut rates = [Joints::zeros(); 5];
        for joint in 0..N {
            let controller = self.params.continuous_joint(joint);
            for row in 0..5 {
                rates[row][joint] =
                    (0..5).map(|k| controller.A[(row, k)] * z[k][joint]).sum::<f64>() + controller.b[row] * x.dq[joint];
            }
        }
        Continuous { q: x.dq, dq: ddq, beliefs: [rates[1], rates[2], rates[3]], u: rates[4] }
    }

    fn step(&self, x: &Continuous, h: f64) -> Continuous {
        let add = |x: &Continuous, d: &Continuous, h: f64| Continuous {
            q: x.q + d.q * h,
            dq: x.dq + d.dq * h,
            beliefs: [0, 1, 2].map(|k| x.beliefs[k] + d.beliefs[k] * h),
            u: x.u + d.u * h,
        };
        let k1 = self.derivative(x);
        let k2 = self.derivative(&add(x, &k1, h / 2.0));
        let k3 = self.derivative(&add(x, &k2, h / 2.0));
        let k4 = self.derivative(&add(x, &k3, h));
        let mut next = *x;
        for (k, weight) in [(&k1, 1.0), (&k2, 2.0), (&k3, 2.0), (&k4, 1.0)] {
            next = add(&next, k, h * weight / 6.0);
        }
        next
    }

    fn v(&self, claim: &RegionClaim, x: &Continuous) -> f64 {
        let w = &claim.witness;
        let z = self.z(x);
        let y = (0..5).fold(Joints::<N>::zeros(), |sum, k| sum + z[k] * w.b[k].to_f64());
        let m = mass_matrix(&self.model, &x.q);
        let p = w.p.to_f64();
        let mut v = p * x.dq.dot(&(m * x.dq)) + 2.0 * x.dq.dot(&(m * y));
        let mut entries = w.s.iter();
        for i in 0..5 {
            for j in i..5 {
                let weight = if i == j { 1.0 } else { 2.0 };
                v += weight * entries.next().unwrap().to_f64() * z[i].dot(&z[j]);
            }
        }
        if !self.compensated {
            let rise = potential_energy(&self.model, &x.q) - potential_energy(&self.model, &self.goal);
            v += 2.0 * p * (rise - gravity_torque(&self.model, &self.goal).dot(&z[0]));
        }
        v
    }
}

struct Attacked {
    rates: usize,
    regions: usize,
    refusals: usize,
    attainable: usize,
}

fn attack(certificate: &Certificate, plant_box: &PlantBox, gains: &AicGains<N>, rng: &mut ChaCha8Rng) -> Attacked {
    let robot = Robot::panda();
    let params = AicParams::new(gains, 0.001).unwrap();
    let mut attacked = Attacked { rates: 0, regions: 0, refusals: 0, attainable: 0 };
    let angles = |rng: &mut ChaCha8Rng| Joints::<N>::from_fn(|_, _| uniform(rng, -3.1, 3.1));
    for entry in &certificate.document().claims {
        match &entry.claim {
            Claim::Exponential(claim) => {
                attacked.rates += 1;
                for _ in 0..4 {
                    let model = plant_box.draw(N, SEED, rng.next_u64() >> 8).model::<N>(&robot).unwrap();
                    let closed = linearise_aic(&model, &angles(rng), &params, plant_box.gravity_compensation).unwrap();
                    let abscissa = closed.spectral_abscissa_per_s();
                    let rate = claim.rate_per_s.to_f64();
                    assert!(
                        abscissa < -rate + EIGENVALUE_SLACK_PER_S * (1.0 + rate),
                        "{gains:?}: {abscissa} against {rate}"
                    );
                }
            }
            Claim::Region(claim) => {
                attacked.regions += 1;
                let model = plant_box.draw(N, SEED, rng.next_u64() >> 8).model::<N>(&robot).unwrap();
                let goal = angles(rng);
                let q = goal + random_direction(rng) * claim.radius_rad.to_f64();
                let compensated = plant_box.gravity_compensation;
                let closed = Loop { model, params: &params, goal, compensated };
                let u = if compensated { Joints::zeros() } else { gravity_torque(&closed.model, &q) };
                let mut x = Continuous { q, dq: Joints::zeros(), beliefs: [q, Joints::zeros(), Joints::zeros()], u };
                let start = closed.v(claim, &x);
                assert!(start <= 1.0 + V_SLACK, "{gains:?}: V starts at {start}");
                // The fastest mode is near sqrt(kappa_a / (sigma_dq m_lo)) rad/s.
                let h = (0.3 / (gains.kappa_a[0] / (gains.sigma_dq[0] * 0.003)).sqrt()).min(5e-4);
                let steps = ((0.6 / h) as usize).min(4_000);
                let rate = claim.rate_per_s.to_f64();
                for k in 1..=steps {
                    x = closed.step(&x, h);
                    if k % 10 == 0 {
                        let bound = start * (-2.0 * rate * k as f64 * h).exp();
                        let v = closed.v(claim, &x);
                        assert!(
                            v <= bound + V_SLACK * start,
                            "{gains:?}: V = {v} above {bound} after {k} steps of {h} s"
                        );
                    }
                }
            }
            Claim::Refused(claim) => {
                attacked.refusals += 1;
                if let Some(attained) = &claim.attained {
                    attacked.attainable += 1;
                    let numbers =
                        |list: &[certune::verify::Number]| list.iter().map(|x| x.to_f64()).collect::<Vec<_>>();
                    let scales: [f64; N] = numbers(&attained.link_mass_scale).try_into().unwrap();
                    let payload = attained.payload_kg.to_f64();
                    let mut model = Model::<N>::new(&robot).unwrap().with_link_scales(&scales);
                    if payload > 0.0 {
                        model = model.with_payload(&Payload::at_grasp(&robot, payload).unwrap());
                    }
                    let model = model
                        .with_rotor_inertia(&Joints::repeat(attained.rotor_inertia_kg_m2.to_f64()))
                        .with_friction(&Joints::repeat(attained.friction_n_m_s_per_rad.to_f64()), &Joints::zeros());
                    let q = Joints::from_vec(numbers(&attained.q_rad));
                    let closed = linearise_aic(&model, &q, &params, plant_box.gravity_compensation).unwrap();
                    assert!(closed.spectral_abscissa_per_s() > 0.0, "{gains:?}: the refusal's arm is stable");
                }
            }
            _ => {}
        }
    }
    attacked
}

fn hunt(name: &str, plant_box: &PlantBox, seed: u64) -> Attacked {
    let robot = Robot::panda();
    let certifier = ArmCertifier::<N>::new(&robot, &family_of(plant_box).unwrap()).unwrap();
    // Less effort finds smaller regions and fewer attainable points; what it claims must be as true.
    let effort = Effort {
        proofs: Options { region: RegionOptions { coarse: 4, refinements: 0, ..RegionOptions::default() } },
        counterexample: SearchOptions { samples: 64, local_starts: 0, enough: 0.0, ..SearchOptions::default() },
    };
    let all: Vec<Attacked> = (0..SETS_PER_FAMILY)
        .into_par_iter()
        .map(|index| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(index);
            let gains = random_gains(&mut rng);
            let certificate =
                certifier.certify_with(&gains, &[ClaimKind::Exponential, ClaimKind::Region], &effort).unwrap();
            attack(&certificate, plant_box, &gains, &mut rng)
        })
        .collect();
    let sum = |field: fn(&Attacked) -> usize| all.iter().map(field).sum();
    let total = Attacked {
        rates: sum(|a| a.rates),
        regions: sum(|a| a.regions),
        refusals: sum(|a| a.refusals),
        attainable: sum(|a| a.attainable),
    };
    println!(
        "{name}: {SETS_PER_FAMILY} gain sets, {} rates and {} regions attacked, {} refusals of which {} attainable",
        total.rates, total.regions, total.refusals, total.attainable
    );
    total
}

fn plant_box(gravity_compensation: bool, friction: [f64; 2]) -> PlantBox {
    PlantBox { friction_n_m_s_per_rad: friction, ..PlantBox::nominal(gravity_compensation) }
}

#[test]
fn no_certificate_is_contradicted() {
    let wide = PlantBox {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        rotor_inertia_kg_m2: [0.0, 0.1],
        ..plant_box(true, [0.5, 2.0])
    };
    let families = [
        ("compensated, no friction", plant_box(true, [0.0, 0.0])),
        ("compensated, friction 1 to 3", plant_box(true, [1.0, 3.0])),
        ("not compensated, friction 1 to 3", plant_box(false, [1.0, 3.0])),
        ("compensated, masses, payload, rotor inertia", wide),
    ];
    let (mut rates, mut regions, mut refusals) = (0, 0, 0);
    for (index, (name, plant_box)) in families.iter().enumerate() {
        let attacked = hunt(name, plant_box, SEED + index as u64);
        rates += attacked.rates;
        regions += attacked.regions;
        refusals += attacked.refusals;
    }
    println!("in all: {rates} rates, {regions} regions, {refusals} refusals, none contradicted");
    // A hunt without prey would prove nothing.
    assert!(rates > 200 && regions > 200 && refusals > 20);
}

/// The constants are assumptions of every certificate; random members of a family must respect them.
#[test]
fn random_members_respect_the_constants() {
    let family = FamilyValues {
        gravity_compensation: false,
        friction_n_m_s_per_rad: [0.0, 0.0],
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    let robot = Robot::panda();
    let certifier = ArmCertifier::<N>::new(&robot, &family).unwrap();
    let constants = &certifier.constants().constants;
    let ranges = Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        payload_com_m: Payload::at_grasp(&robot, 1.0).unwrap().com_m,
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    let members = ArmBox::new(&Model::<N>::new(&robot).unwrap(), &ranges).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    for _ in 0..2_000 {
        let scales: Vec<f64> = members.groups().iter().map(|g| uniform(&mut rng, g.scale[0], g.scale[1])).collect();
        let rotor = Joints::from_fn(|_, _| uniform(&mut rng, 0.0, 0.1));
        let model = members.model(&scales, &rotor).unwrap();
        let q = Joints::from_fn(|_, _| uniform(&mut rng, -3.2, 3.2));
        let eigenvalues = mass_matrix(&model, &q).symmetric_eigenvalues();
        assert!(eigenvalues.min() >= constants.m_lo_kg_m2 && eigenvalues.max() <= constants.m_hi_kg_m2);
        let other = Joints::from_fn(|_, _| uniform(&mut rng, -3.2, 3.2));
        let change = (gravity_torque(&model, &q) - gravity_torque(&model, &other)).norm();
        assert!(change <= constants.k_g_n_m_per_rad * (q - other).norm());
        let (y, dq) = (random_direction(&mut rng), random_direction(&mut rng));
        let slopes = certune::dynamics::mass_matrix_derivatives(&model, &q);
        let slope = (0..N).map(|j| y[j] * dq.dot(&(slopes[j] * dq))).sum::<f64>();
        assert!(0.5 * slope.abs() <= constants.k_c_kg_m2);
        assert!(0.5 * slope.abs() <= constants.k_r * dq.dot(&(mass_matrix(&model, &q) * dq)));
    }
}
