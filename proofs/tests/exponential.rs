//! `claims/exponential.md` on the Panda: the published simulation gains, gravity not compensated.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::Request;
use certune::certify::FamilyValues;
use certune::verify::{Certificate, Claim, ClaimKind, LoopFamily, Number, Quantity, family_box};
use proofs::{asked, grade, nominal_family, published, stored};

fn rate(certificate: &Certificate) -> f64 {
    match &certificate.document().claims[0].claim {
        Claim::Exponential(claim) => claim.rate_per_s.to_f64(),
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by the rounding of another machine's sine: constants by a digit, the rate by a step.
const RATE_STEPS_PER_S: f64 = 0.002;

#[test]
fn the_published_gains_decay_at_every_configuration_without_gravity_compensation() {
    let derived = published(&nominal_family(false, [0.0, 0.0]), ClaimKind::Exponential).unwrap();
    let stored = stored("exponential", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[0].grade, Some(grade(certificate)));
        assert!(rate(certificate) >= 0.7, "{}", rate(certificate));
    }
    assert!((rate(&derived) - rate(&stored)).abs() <= RATE_STEPS_PER_S);
    assert_eq!(derived.document().gains, stored.document().gains);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

/// The rate is the largest: exact arithmetic refuses the next step, and the box holds a loop that slow.
#[test]
fn the_next_rate_is_not_certified() {
    let certificate = published(&nominal_family(false, [0.0, 0.0]), ClaimKind::Exponential).unwrap();
    let next: Number = format!("{:.3}", rate(&certificate) + 0.001).parse().unwrap();
    let loops = LoopFamily::new(certificate.document().gains.aic().unwrap()).unwrap();
    assert!(loops.decays_on(&family_box(certificate.document()), next.value()).is_err());
}

/// Both derive the same, and the stored certificate stands.
fn compared(name: &str, derived: &Certificate) -> Certificate {
    let stored = stored(name, derived).unwrap();
    assert_eq!(stored.checked()[0].verdict, derived.checked()[0].verdict);
    assert_eq!(derived.document().gains, stored.document().gains);
    assert_eq!(derived.document().family, stored.document().family);
    stored
}

#[test]
fn masses_and_payload_cost_a_little_of_the_rate() {
    let nominal = nominal_family(false, [0.0, 0.0]);
    let uncertain = FamilyValues { mass_uncertainty: 0.2, payload_kg: [0.0, 0.7], ..nominal.clone() };
    let heavy = FamilyValues { payload_kg: [0.0, 3.0], ..nominal };
    for (name, family, least) in
        [("exponential--masses-and-payload", uncertain, 0.5), ("exponential--payload-3-kg", heavy, 0.0)]
    {
        let derived = published(&family, ClaimKind::Exponential).unwrap();
        for certificate in [&derived, &compared(name, &derived)] {
            assert!(certificate.all_hold() && rate(certificate) > least, "{name}: {}", rate(certificate));
        }
    }
}

/// The authors lowered kappa_a to 200 on the robot, which compensates gravity; without that a stretched arm held above its shoulder sways ever further.
#[test]
fn libfrankas_gains_need_the_robot_to_compensate_gravity() {
    let request = Request { claims: vec![ClaimKind::Exponential], ..Request::default() };
    let derived = asked("libfranka", &nominal_family(true, [0.0, 0.0]), &request).unwrap();
    assert!(compared("exponential--libfranka", &derived).all_hold());
    let derived = asked("libfranka", &nominal_family(false, [0.0, 0.0]), &request).unwrap();
    let stored = compared("exponential--libfranka-uncompensated", &derived);
    for certificate in [&derived, &stored] {
        let Claim::Refused(refused) = &certificate.document().claims[0].claim else { panic!("not refused") };
        let attained = refused.attained.as_ref().unwrap();
        assert!(attained.eigenvalue_per_s[0].to_f64() > 0.0 && attained.q_rad.len() == 7);
        assert!(refused.remedies.iter().any(|remedy| remedy.of == Quantity::LargestStiffness));
    }
}
