//! `claims/pi-exponential.md` on the Panda: the frozen loop at the goals of the task, against eigenvalues of all joints together.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune::control::mrac::{MracGains, MracLaw};
use certune::dynamics::{Model, Robot, mass_matrix};
use certune::linsys::{Continuous, Joints, Loop};
use certune::verify::{Certificate, Claim, ClaimKind, checked_alone};
use certune::{AdaptiveSetting, ArmCertifier};
use nalgebra::DMatrix;
use proofs::{A, B, C, nominal_family, published_mrac, stored};

fn gains(name: &str) -> MracGains<7> {
    MracGains { law: MracLaw::RawGoal, ..published_mrac(name).unwrap() }
}

fn claim(arm: &ArmCertifier<7>, gains: &MracGains<7>, goal: [f64; 7]) -> Certificate {
    let setting = AdaptiveSetting { halvings: 0, ..AdaptiveSetting::around(goal) };
    arm.certify_adaptive(gains, &setting, &[ClaimKind::PiExponential]).unwrap()
}

fn arm(friction: [f64; 2]) -> ArmCertifier<7> {
    ArmCertifier::new(&Robot::panda(), &nominal_family(true, friction)).unwrap()
}

/// The frozen loop of all joints: states e, dq, sigma; `k0` accumulated on q times the identity.
fn frozen(gains: &MracGains<7>, goal: &[f64; 7], q: [f64; 7], friction: f64, k0: f64) -> Loop<Continuous> {
    let model = Model::<7>::new(&Robot::panda()).unwrap();
    let mass = mass_matrix(&model, &Joints::from_column_slice(&q));
    let inverse = mass.try_inverse().unwrap();
    let square: f64 = goal.iter().map(|x| x * x).sum();
    let mut a = DMatrix::zeros(21, 21);
    for j in 0..7 {
        let (w, zeta) = (gains.omega_rad_per_s[j], gains.zeta[j]);
        let p2 = gains.l1[j] / (2.0 * w * w);
        let p3 = gains.l2[j] / (4.0 * zeta * w) + gains.l1[j] / (4.0 * zeta * w.powi(3));
        let lambda = p2 / p3;
        let k = p3 * (gains.alpha[0][j] + (gains.e0[0][j] + gains.f0[0][j]) * square);
        let k_i = p3 * (gains.alpha[1][j] + (gains.e0[1][j] + gains.f0[1][j]) * square);
        a[(j, 7 + j)] = 1.0;
        a[(14 + j, 7 + j)] = 1.0;
        a[(14 + j, j)] = lambda;
        for i in 0..7 {
            a[(7 + i, j)] = inverse[(i, j)] * (k0 - k * lambda);
            a[(7 + i, 7 + j)] = -inverse[(i, j)] * (k + friction);
            a[(7 + i, 14 + j)] = -inverse[(i, j)] * k_i;
        }
    }
    Loop::continuous(a).unwrap()
}

fn accumulated(certificate: &Certificate) -> f64 {
    let Claim::PiExponential(claim) = &certificate.document().claims[0].claim else {
        panic!("{}", certificate.checked()[0].statement)
    };
    claim.accumulated_k0_n_m_per_rad.to_f64()
}

/// Halton's sequence over the joints' full circles.
fn configurations() -> impl Iterator<Item = [f64; 7]> {
    let radical = |mut index: u32, base: u32| {
        let (mut scale, mut sum) = (1.0, 0.0);
        while index > 0 {
            scale /= f64::from(base);
            sum += scale * f64::from(index % base);
            index /= base;
        }
        sum
    };
    (1..200).map(move |k| [2, 3, 5, 7, 11, 13, 17].map(|base| std::f64::consts::PI * (2.0 * radical(k, base) - 1.0)))
}

#[test]
fn the_published_gains_hold_at_the_goals_and_eigenvalues_agree() {
    for (name, friction, least) in [("simulation", [0.0, 3.0], 10.0), ("robot", [0.0, 3.0], 0.3)] {
        let (arm, gains) = (arm(friction), gains(name));
        for goal in [A, B, C] {
            let certificate = claim(&arm, &gains, goal);
            let k0 = accumulated(&certificate);
            println!("{name} at {goal:?}: k0 up to {k0} N m/rad");
            assert!(certificate.all_hold() && k0 > least);
            // The bound is over all inertias: attack it in every configuration, at both ends of friction.
            for q in configurations().chain([goal]) {
                for friction in friction {
                    for k0 in [0.0, 0.5 * k0, k0] {
                        assert!(frozen(&gains, &goal, q, friction, k0).spectral_abscissa_per_s() < 0.0);
                    }
                }
            }
        }
    }
}

#[test]
fn equal_gains_make_the_largest_accumulated_gain_sharp() {
    let mut equal = gains("simulation");
    for family in [&mut equal.alpha, &mut equal.e0, &mut equal.f0] {
        for row in family.iter_mut() {
            *row = [row[0]; 7];
        }
    }
    let arm = arm([0.0, 0.0]);
    let k0 = accumulated(&claim(&arm, &equal, B));
    // Unstable beyond it only where an eigenvalue of M is as large as m_hi; lost for sure a little further out.
    assert!(frozen(&equal, &B, B, 0.0, k0).spectral_abscissa_per_s() < 0.0);
    assert!(frozen(&equal, &B, B, 0.0, 1.1 * k0 + 0.5).spectral_abscissa_per_s() > 0.0);
}

#[test]
fn at_the_zero_goal_the_robot_gains_need_friction() {
    let certificate = claim(&arm([0.0, 3.0]), &gains("robot"), [0.0; 7]);
    let Claim::PiRefused(refused) = &certificate.document().claims[0].claim else {
        panic!("{}", certificate.checked()[0].statement)
    };
    let (joint, m) = (refused.joint - 1, refused.inertia_kg_m2.to_f64());
    // K = P3 alpha1, K_I = P3 alpha2, lambda = 0.8: K (lambda K + K_I) against m lambda K_I.
    let (k, k_i) = (0.15625 * gains("robot").alpha[0][joint], 0.15625 * 0.2);
    assert!(k * (0.8 * k + k_i) <= m * 0.8 * k_i);
    assert!(claim(&arm([1.0, 3.0]), &gains("robot"), [0.0; 7]).all_hold());
}

#[test]
fn the_stored_certificate_is_the_one_derived() {
    let derived = claim(&arm([0.0, 3.0]), &gains("simulation"), B);
    let stored = stored("pi-exponential", &derived).unwrap();
    assert!(stored.all_hold());
    assert!((accumulated(&stored) - accumulated(&derived)).abs() < 0.05);
}

#[test]
fn a_goal_outside_the_configurations_of_the_constants_is_not_covered() {
    let certificate = claim(&arm([0.0, 3.0]), &gains("simulation"), B);
    let document = certificate.document();
    let Claim::PiExponential(found) = &document.claims[0].claim else { panic!("no claim") };
    let mut elsewhere = found.as_ref().clone();
    elsewhere.goal_rad[1] = "0.26".parse().unwrap();
    assert!(checked_alone(document, &Claim::PiExponential(Box::new(elsewhere))).is_err());
    assert!(checked_alone(document, &document.claims[0].claim).is_ok());
}
