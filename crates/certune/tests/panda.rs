//! The published gains on the Panda, from robot to certificate.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use certune::certify::FamilyValues;
use certune::control::aic::AicGains;
use certune::dynamics::Robot;
use certune::verify::{Certificate, Claim, ClaimKind, Verdict};
use certune::{ArmCertifier, certificate_text};

const BOTH: &[ClaimKind] = &[ClaimKind::Exponential, ClaimKind::Region];

fn published(kappa_a: f64) -> AicGains<7> {
    AicGains {
        kappa_mu: [11.67; 7],
        kappa_a: [kappa_a; 7],
        sigma_q: [1.0; 7],
        sigma_dq: [1.0; 7],
        sigma_mu: [5.0; 7],
        sigma_dmu: [10.0; 7],
        reference_time_constant_s: [1.0; 7],
    }
}

fn certify(compensated: bool, friction: [f64; 2], kappa_a: f64, claims: &[ClaimKind]) -> Certificate {
    let family = FamilyValues {
        gravity_compensation: compensated,
        friction_n_m_s_per_rad: friction,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    ArmCertifier::new(&Robot::panda(), &family).unwrap().certify(&published(kappa_a), claims).unwrap()
}

#[test]
fn published_gains_are_exponentially_stable_without_gravity_compensation() {
    let certificate = certify(false, [0.0, 0.0], 700.0, &[ClaimKind::Exponential]);
    let Claim::Exponential(claim) = &certificate.document().claims[0].claim else {
        panic!("{:?}", certificate.checked())
    };
    assert!(claim.rate_per_s.to_f64() >= 0.7, "{}", claim.rate_per_s);
}

#[test]
fn published_gains_have_the_regions_that_were_predicted() {
    for (friction, least) in [([1.0, 3.0], 0.80), ([0.0, 0.0], 0.33)] {
        let certificate = certify(true, friction, 700.0, &[ClaimKind::Region]);
        let Claim::Region(claim) = &certificate.document().claims[0].claim else {
            panic!("{:?}", certificate.checked())
        };
        assert!(claim.radius_rad.to_f64() >= least, "friction {friction:?}: {}", claim.radius_rad);
    }
}

/// The authors could lower kappa_a to 200 only on the robot that compensates gravity.
#[test]
fn a_weak_torque_gain_without_compensation_is_refused_with_an_unstable_configuration() {
    let certificate = certify(false, [0.0, 0.0], 200.0, &[ClaimKind::Exponential]);
    assert_eq!(certificate.checked()[0].verdict, Verdict::Refused);
    let Claim::Refused(refusal) = &certificate.document().claims[0].claim else { panic!() };
    let attained = refusal.attained.as_ref().expect("an attainable point");
    assert!(attained.eigenvalue_per_s[0].to_f64() > 0.0);
    assert_eq!(attained.q_rad.len(), 7);
}

#[test]
fn a_written_certificate_is_accepted_again() {
    let certificate = certify(true, [1.0, 3.0], 700.0, BOTH);
    let text = certificate_text(&certificate).unwrap();
    let again = certune::verify::verify(&text, &[]).unwrap().unwrap();
    assert_eq!(again.checked(), certificate.checked());
    assert!(again.all_hold());
}
