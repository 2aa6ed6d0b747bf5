//! `claims/sampled.md` on the Panda: the published simulation gains at 1 kHz, gravity compensated, friction 1 to 3 N m s/rad.
#![expect(clippy::panic, reason = "test helpers")]

use certune::Request;
use certune::verify::{Certificate, Claim, ClaimKind, Number, SampledClaim, SampledFamily, family_box};
use num_rational::BigRational;
use num_traits::Zero;
use proofs::{asked, nominal_family, published, stored};

fn claim(certificate: &Certificate) -> &SampledClaim {
    match &certificate.document().claims[0].claim {
        Claim::Sampled(claim) => claim,
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by the rounding of another machine's sine: constants by a digit, the rate by a step.
const RATE_STEPS_PER_S: f64 = 0.002;

#[test]
fn the_published_gains_survive_one_sample_of_delay() {
    let derived = published(&nominal_family(true, [1.0, 3.0]), ClaimKind::Sampled).unwrap();
    let stored = stored("sampled", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(claim(certificate).delay_margin_s.to_string(), "0.001");
        assert!(claim(certificate).rate_per_s.to_f64() >= 0.7);
    }
    assert!((claim(&derived).rate_per_s.to_f64() - claim(&stored).rate_per_s.to_f64()).abs() <= RATE_STEPS_PER_S);
    assert_eq!(derived.document().gains, stored.document().gains);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

/// The margin is the largest: with one more sample exact arithmetic refuses the box, and finds an unstable loop in it.
#[test]
fn one_more_sample_is_refused() {
    let certificate = published(&nominal_family(true, [1.0, 3.0]), ClaimKind::Sampled).unwrap();
    let document = certificate.document();
    let timing = &claim(&certificate).sampling;
    let loops = SampledFamily::new(document.gains.aic().unwrap(), &timing.period_s).unwrap();
    let (range, zero) = (family_box(document), BigRational::zero());
    let two = BigRational::from_integer(2.into());
    assert!(loops.decays_on(timing.plant, &range, &two, &zero).is_err());
    let light: &Number = &range.inertia[0];
    assert!(loops.fails_at(timing.plant, [light.value(), range.friction[0].value(), &zero], 2, &zero));
}

/// What the light-inertia rule predicts (`claims/sampled.md`): delay takes its damping from somewhere, and the bare arm has none.
#[test]
fn without_friction_one_sample_of_delay_is_refused() {
    let request = Request { claims: vec![ClaimKind::Sampled], delay_samples: Some(1), ..Request::default() };
    let derived = asked("simulation", &nominal_family(true, [0.0, 0.0]), &request).unwrap();
    let stored = stored("sampled--delay-without-friction", &derived).unwrap();
    for certificate in [&derived, &stored] {
        let Claim::Refused(refused) = &certificate.document().claims[0].claim else {
            panic!("{}", certificate.checked()[0].statement)
        };
        assert_eq!(refused.sampling.as_ref().unwrap().delay_s.to_string(), "0.001");
        assert!(refused.attained.is_some() && !refused.remedies.is_empty(), "{refused:?}");
    }
}
