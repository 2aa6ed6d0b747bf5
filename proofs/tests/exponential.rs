//! `claims/exponential.md` on the Panda: the published simulation gains, gravity not compensated.
#![expect(clippy::panic, reason = "test helpers")]

use certune::verify::{Certificate, Claim, ClaimKind, Grade, LoopFamily, Number, family_box};
use proofs::{nominal_family, published, stored};

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
        assert_eq!(certificate.checked()[0].grade, Some(Grade::Conditional), "sampled constants prove nothing");
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
