//! `claims/region.md` on the Panda: the published simulation gains, gravity compensated, friction 1 to 3 N m s/rad.
#![expect(clippy::panic, reason = "test helpers")]

use certune::verify::{Certificate, Claim, ClaimKind, Grade};
use proofs::{nominal_family, published, stored};

fn radius(certificate: &Certificate) -> f64 {
    match &certificate.document().claims[0].claim {
        Claim::Region(claim) => claim.radius_rad.to_f64(),
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by where an interior-point iteration stops.
const RADIUS_SPREAD_RAD: f64 = 0.01;

#[test]
fn the_published_gains_have_a_region_with_friction() {
    let derived = published(&nominal_family(true, [1.0, 3.0]), ClaimKind::Region).unwrap();
    let stored = stored("region", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[0].grade, Some(Grade::Conditional), "sampled constants prove nothing");
        assert!(radius(certificate) >= 0.80, "{}", radius(certificate));
        // Containment and decay at both ends of the inertia, and the start.
        assert_eq!(certificate.checked()[0].inequalities.len(), 5);
    }
    assert!((radius(&derived) - radius(&stored)).abs() <= RADIUS_SPREAD_RAD);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

#[test]
fn without_friction_the_region_is_smaller_and_still_there() {
    let certificate = published(&nominal_family(true, [0.0, 0.0]), ClaimKind::Region).unwrap();
    assert!(radius(&certificate) >= 0.33, "{}", radius(&certificate));
}

#[test]
fn without_gravity_compensation_there_is_a_region_too() {
    let certificate = published(&nominal_family(false, [1.0, 3.0]), ClaimKind::Region).unwrap();
    assert!(radius(&certificate) >= 0.2, "{}", radius(&certificate));
}
