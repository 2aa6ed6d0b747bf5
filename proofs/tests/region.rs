//! `claims/region.md` on the Panda: the published simulation gains, gravity compensated, friction 1 to 3 N m s/rad.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::verify::{Certificate, Claim, ClaimKind};
use certune::{Request, TorqueLimits};
use proofs::{asked, grade, nominal_family, published, stored};

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
        assert_eq!(certificate.checked()[0].grade, Some(grade(certificate)));
        println!("radius {} rad", radius(certificate));
        assert!(radius(certificate) >= 0.65, "{}", radius(certificate));
        // Containment and decay at both ends of the inertia, and the start.
        assert_eq!(certificate.checked()[0].inequalities.len(), 5);
    }
    assert!((radius(&derived) - radius(&stored)).abs() <= RADIUS_SPREAD_RAD);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

/// Derived, compared with what is stored, and no smaller than asked.
fn compared(name: &str, derived: &Certificate, least_rad: f64) -> Certificate {
    let stored = stored(name, derived).unwrap();
    assert!(radius(&stored) >= least_rad && radius(derived) >= least_rad, "{}", radius(derived));
    assert!((radius(derived) - radius(&stored)).abs() <= RADIUS_SPREAD_RAD);
    stored
}

#[test]
fn without_friction_the_region_is_smaller_and_still_there() {
    let derived = published(&nominal_family(true, [0.0, 0.0]), ClaimKind::Region).unwrap();
    compared("region--without-friction", &derived, 0.20);
}

#[test]
fn without_gravity_compensation_there_is_a_region_too() {
    let derived = published(&nominal_family(false, [1.0, 3.0]), ClaimKind::Region).unwrap();
    compared("region--uncompensated", &derived, 0.18);
}

#[test]
fn a_torque_limit_costs_a_part_of_the_region() {
    let torque_limits = TorqueLimits::Norm(87.0);
    let request = Request { claims: vec![ClaimKind::Region], torque_limits, ..Request::default() };
    let derived = asked("simulation", &nominal_family(true, [1.0, 3.0]), &request).unwrap();
    let stored = compared("region--torque-limit", &derived, 0.55);
    let Claim::Region(claim) = &stored.document().claims[0].claim else { panic!("no region") };
    assert_eq!(claim.controller_torque_n_m.as_ref().map(|limit| limit.to_f64().to_bits()), Some(87.0_f64.to_bits()));
}
