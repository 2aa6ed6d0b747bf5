//! What the linearised loops say about the published experiments on the Panda.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::path::Path;

use certune::ArmCertifier;
use certune::certify::FamilyValues;
use certune::closed_loop::{Gains, GainsFile, linearise_aic};
use certune::control::aic::{AicGains, AicParams};
use certune::dynamics::{Model, Robot};
use certune::verify::{Claim, ClaimKind, Verdict};
use certune_linsys::Joints;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

fn preset(name: &str, text: &str) -> AicGains<7> {
    let Gains::Aic(table) = GainsFile::parse(Path::new(name), text).unwrap().gains else {
        unreachable!("an AIC preset")
    };
    table.bind::<7>().unwrap()
}

fn simulation() -> AicGains<7> {
    preset("pezzato2020-simulation.toml", include_str!("../../../tuning/presets/pezzato2020-simulation.toml"))
}

/// The Panda's joint range, rad. Over all angles the arm is folded more often and its gravity stiffness lower.
const LIMITS_RAD: [[f64; 2]; 7] = [
    [-2.8973, 2.8973],
    [-1.7628, 1.7628],
    [-2.8973, 2.8973],
    [-3.0718, -0.0698],
    [-2.8973, 2.8973],
    [-0.0175, 3.7525],
    [-2.8973, 2.8973],
];

/// The authors could lower kappa_a to 200 only on the robot that compensates gravity: too *low* a torque gain destabilises.
#[test]
fn a_weak_torque_gain_without_compensation_is_unstable_in_a_fifth_of_all_configurations() {
    const CONFIGURATIONS: usize = 2_000;
    let model = Model::<7>::new(&Robot::panda()).unwrap().with_friction(&Joints::zeros(), &Joints::zeros());
    for (kappa_a, compensated, shares) in
        [(200.0, false, 0.18..=0.24), (700.0, false, 0.0..=0.0), (200.0, true, 0.0..=0.0)]
    {
        let params = AicParams::new(&AicGains { kappa_a: [kappa_a; 7], ..simulation() }, 1e-3).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let unstable = (0..CONFIGURATIONS)
            .filter(|_| {
                let q = Joints::<7>::from_fn(|joint, _| {
                    let unit = (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
                    LIMITS_RAD[joint][0] + (LIMITS_RAD[joint][1] - LIMITS_RAD[joint][0]) * unit
                });
                linearise_aic(&model, &q, &params, compensated).unwrap().spectral_abscissa_per_s() > 0.0
            })
            .count();
        let share = unstable as f64 / CONFIGURATIONS as f64;
        println!("kappa_a {kappa_a}, compensated {compensated}: {share}");
        assert!(shares.contains(&share), "kappa_a {kappa_a}, compensated {compensated}: {share}");
    }
}

/// The delay margin of every published set of gains, friction 1 to 3 N m s/rad: sets that differ between joints are not covered.
#[test]
fn delay_margins_of_the_presets() {
    let presets = [
        ("pezzato2020-simulation.toml", include_str!("../../../tuning/presets/pezzato2020-simulation.toml"), Some(1.0)),
        ("pezzato2020-libfranka.toml", include_str!("../../../tuning/presets/pezzato2020-libfranka.toml"), Some(6.0)),
        ("pezzato2020-robot.toml", include_str!("../../../tuning/presets/pezzato2020-robot.toml"), None),
    ];
    let family = FamilyValues {
        gravity_compensation: true,
        friction_n_m_s_per_rad: [1.0, 3.0],
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let certifier = ArmCertifier::new(&Robot::panda(), &family).unwrap();
    for (name, text, margin_ms) in presets {
        let certificate = certifier.certify(&preset(name, text), &[ClaimKind::Sampled]).unwrap();
        let found = match &certificate.document().claims[0].claim {
            Claim::Sampled(claim) => Some((claim.delay_margin_s.to_f64() * 1e3).round()),
            _ => None,
        };
        println!("{name}: {}", certificate.checked()[0].statement);
        assert_eq!(found, margin_ms, "{name}");
    }
}

/// Two samples of delay and no friction: refused with a configuration of the arm, and the friction and rotor inertia that would do.
#[test]
fn a_delay_that_is_too_long_is_refused_with_a_configuration() {
    let family = FamilyValues {
        gravity_compensation: false,
        friction_n_m_s_per_rad: [0.0, 0.0],
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let mut effort = certune::Effort::default();
    effort.proofs.sampled.delay_samples = 2;
    let certifier = ArmCertifier::new(&Robot::panda(), &family).unwrap();
    let certificate = certifier.certify_with(&simulation(), &[ClaimKind::Sampled], &effort).unwrap();
    println!("{}", certificate.checked()[0].statement);
    assert_eq!(certificate.checked()[0].verdict, Verdict::Refused);
    let Claim::Refused(refusal) = &certificate.document().claims[0].claim else { unreachable!("a refusal") };
    let attained = refusal.attained.as_ref().unwrap();
    assert!(attained.eigenvalue_per_s[0].to_f64() > 0.0 && attained.q_rad.len() == 7);
    assert!(refusal.remedies.len() >= 2);
}
