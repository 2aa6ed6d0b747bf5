//! `claims/adaptive-sampled.md` on the Panda: the velocity loop of the published MRAC gains at 1 kHz, with and without rotor inertia.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use certune::certify::FamilyValues;
use certune::control::mrac::{MracGains, MracLaw};
use certune::dynamics::{Model, Robot, mass_matrix};
use certune::linsys::Joints;
use certune::verify::{Certificate, Claim, ClaimKind};
use certune::{AdaptiveSetting, ArmCertifier};
use nalgebra::DMatrix;
use proofs::{A, B, C, asked_mrac, nominal_family, published_mrac, stored_with_records};

const STEP_S: f64 = 1e-3;
/// Largest stable `h K/m` for 0, 1, 2 samples of delay.
const LIMITS: [f64; 3] = [2.0, 1.0, 0.618_033_988_749_894_9];

fn gains(name: &str) -> MracGains<7> {
    MracGains { law: MracLaw::RawGoal, ..published_mrac(name).unwrap() }
}

fn rotor(rotor_inertia_kg_m2: f64) -> ArmCertifier<7> {
    let family = FamilyValues { rotor_inertia_kg_m2: [rotor_inertia_kg_m2; 2], ..nominal_family(true, [0.0, 0.0]) };
    ArmCertifier::new(&Robot::panda(), &family).unwrap()
}

fn claim(arm: &ArmCertifier<7>, gains: &MracGains<7>, goal: [f64; 7], delay_samples: u32) -> Certificate {
    // The joint's own inertia is all that is asked of the enclosure: a coarse one will do for a proof.
    enclosed(arm, gains, &AdaptiveSetting { delay_samples, halvings: 0, ..AdaptiveSetting::around(goal) })
}

fn enclosed(arm: &ArmCertifier<7>, gains: &MracGains<7>, setting: &AdaptiveSetting<7>) -> Certificate {
    arm.certify_adaptive(gains, setting, &[ClaimKind::AdaptiveSampled]).unwrap()
}

/// `h lambda_max(M^-1 K)` at the goal.
fn reach(gains: &MracGains<7>, goal: &[f64; 7], rotor_inertia_kg_m2: f64) -> f64 {
    let model = Model::<7>::new(&Robot::panda()).unwrap().with_rotor_inertia(&Joints::repeat(rotor_inertia_kg_m2));
    let mass = mass_matrix(&model, &Joints::from_column_slice(goal));
    let square: f64 = goal.iter().map(|x| x * x).sum();
    let k = |j: usize| 0.15625 * (gains.alpha[0][j] + (gains.e0[0][j] + gains.f0[0][j]) * square);
    let inverse = mass.try_inverse().unwrap();
    let product = DMatrix::from_fn(7, 7, |i, j| STEP_S * inverse[(i, j)] * k(j));
    product.complex_eigenvalues().iter().map(|z| z.re).fold(0.0, f64::max)
}

#[test]
fn the_verdict_is_that_of_the_eigenvalues_at_the_goal() {
    for name in ["simulation", "robot"] {
        for inertia in [0.0, 0.1, 0.5] {
            let arm = rotor(inertia);
            for goal in [A, B, C] {
                let x = reach(&gains(name), &goal, inertia);
                for delay in 0..3_u32 {
                    let limit = LIMITS[delay as usize];
                    let certificate = claim(&arm, &gains(name), goal, delay);
                    let kind = match &certificate.document().claims[0].claim {
                        Claim::AdaptiveSampled(_) => {
                            assert!(x < limit, "proved at {x}");
                            "proved"
                        }
                        Claim::AdaptiveSampledRefused(_) => {
                            assert!(x > limit, "refused at {x}");
                            "refused"
                        }
                        Claim::NotProved(_) => "open",
                        other => panic!("{other:?}"),
                    };
                    println!("{name} rotor {inertia} delay {delay} at {goal:?}: h lambda_max = {x:.2}, {kind}");
                }
            }
        }
    }
}

#[test]
fn the_simulation_gains_chatter_on_the_bare_arm() {
    let bare = enclosed(&rotor(0.0), &gains("simulation"), &AdaptiveSetting::around(A));
    assert!(matches!(bare.document().claims[0].claim, Claim::AdaptiveSampledRefused(_)));
    // With much rotor inertia they do not; one or two samples of delay ask for more of it.
    assert!(claim(&rotor(0.5), &gains("simulation"), A, 2).all_hold());
}

#[test]
fn the_limits_are_those_of_the_roots() {
    for (delay, limit) in LIMITS.into_iter().enumerate() {
        for x in [0.05, 0.3, 0.61, 0.617, 0.619, 0.9, 0.99, 1.01, 1.9, 1.99, 2.01, 3.0] {
            // Companion of z^(k+1) - z^k + x.
            let order = delay + 1;
            let mut companion = DMatrix::zeros(order, order);
            companion[(0, 0)] = 1.0;
            companion[(0, order - 1)] -= x;
            for i in 1..order {
                companion[(i, i - 1)] = 1.0;
            }
            let radius = companion.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max);
            assert_eq!(radius < 1.0, x < limit, "delay {delay}, x {x}");
        }
    }
}

#[test]
fn the_stored_certificate_is_the_one_derived() {
    let family = FamilyValues { rotor_inertia_kg_m2: [0.5; 2], ..nominal_family(true, [0.0, 0.0]) };
    let derived = asked_mrac(gains("simulation"), &family, ClaimKind::AdaptiveSampled, B, 1).unwrap();
    assert!(derived.certificate.all_hold());
    assert!(stored_with_records("adaptive-sampled", &derived).unwrap().all_hold());
}
