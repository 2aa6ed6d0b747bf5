//! `claims/disturbance.md` on the Panda: the published simulation gains, gravity compensated, friction 1 to 3 N m s/rad.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::Effort;
use certune::certify::{DisturbanceOptions, Options, to_json};
use certune::control::aic::AicGains;
use certune::verify::{Certificate, Claim, ClaimKind, DisturbanceClaim, Number, seal, verify};
use proofs::{nominal_family, panda, records, stored};

const QUIET: DisturbanceOptions = DisturbanceOptions {
    position_noise_rad: 0.0,
    velocity_noise_rad_per_s: 0.0,
    torque_n_m: 0.0,
    push_n_m: 0.0,
    radius_rad: 0.0,
};

fn derive(disturbance: DisturbanceOptions, compensated: bool) -> Certificate {
    let gains = AicGains::<7> {
        kappa_mu: [11.67; 7],
        kappa_a: [700.0; 7],
        sigma_q: [1.0; 7],
        sigma_dq: [1.0; 7],
        sigma_mu: [5.0; 7],
        sigma_dmu: [10.0; 7],
        reference_time_constant_s: [1.0; 7],
    };
    let effort = Effort { proofs: Options { disturbance, ..Options::default() }, ..Effort::default() };
    let certifier = panda(&nominal_family(compensated, [1.0, 3.0])).unwrap();
    certifier.certify_with(&gains, &[ClaimKind::Disturbance], &effort).unwrap()
}

fn claim(certificate: &Certificate) -> &DisturbanceClaim {
    match &certificate.document().claims[0].claim {
        Claim::Disturbance(claim) => claim,
        other => panic!("{other:?}"),
    }
}

#[test]
fn encoder_noise_leaves_a_bounded_error_from_a_third_of_a_radian_away() {
    let derived = derive(DisturbanceOptions { radius_rad: 0.3, ..DisturbanceOptions::default() }, true);
    let stored = stored("disturbance", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        let claim = claim(certificate);
        assert!(claim.ultimate_rad.to_f64() <= 0.02 && claim.excursion_rad.to_f64() <= 0.45, "{claim:?}");
    }
    let ends = [&derived, &stored].map(|c| claim(c).ultimate_rad.to_f64());
    assert!((ends[0] - ends[1]).abs() <= 0.005, "{ends:?}");
}

#[test]
fn at_the_goal_noise_and_pushes_move_the_arm_no_further_than_this() {
    let noise = derive(DisturbanceOptions::default(), true);
    assert!(claim(&noise).excursion_rad.to_f64() <= 0.008, "{}", claim(&noise).excursion_rad);
    let push = derive(DisturbanceOptions { push_n_m: 5.0, ..QUIET }, true);
    assert!(claim(&push).excursion_rad.to_f64() <= 0.028, "{}", claim(&push).excursion_rad);
    assert_eq!(claim(&push).ultimate_rad, Number::zero());
    assert!(push.checked()[0].statement.contains("converges to the goal"));
}

#[test]
fn nothing_is_claimed_without_compensation_nor_without_a_disturbance() {
    for certificate in [derive(DisturbanceOptions::default(), false), derive(QUIET, true)] {
        assert!(matches!(certificate.document().claims[0].claim, Claim::NotProved(_)));
    }
}

#[test]
fn louder_noise_and_tighter_bounds_are_rejected() {
    let stored =
        stored("disturbance", &derive(DisturbanceOptions { radius_rad: 0.3, ..DisturbanceOptions::default() }, true));
    let stored = stored.unwrap();
    let rejected = |edit: &dyn Fn(&mut DisturbanceClaim)| {
        let mut document = stored.document().clone();
        let Claim::Disturbance(claim) = &mut document.claims[0].claim else { panic!("a disturbance") };
        edit(claim);
        verify(&to_json(&seal(document)).unwrap(), &records().unwrap()).unwrap().is_err()
    };
    let scaled = |number: &Number, share: f64| Number::decimal(number.to_f64() * share).unwrap();
    assert!(!rejected(&|_| {}), "unchanged, it stands");
    assert!(!rejected(&|c| c.position_noise_rad = scaled(&c.position_noise_rad, 0.5)), "less noise is fine");
    assert!(rejected(&|c| c.position_noise_rad = scaled(&c.position_noise_rad, 1.1)));
    assert!(rejected(&|c| c.velocity_noise_rad_per_s = scaled(&c.velocity_noise_rad_per_s, 1.1)));
    assert!(rejected(&|c| c.torque_n_m = Number::decimal(0.1).unwrap()), "a torque without a share");
    assert!(rejected(&|c| c.push_n_m = Number::decimal(1.0).unwrap()), "a push without a share");
    assert!(rejected(&|c| c.radius_rad = scaled(&c.radius_rad, 1.01)));
    assert!(rejected(&|c| c.excursion_rad = scaled(&c.excursion_rad, 0.99)));
    assert!(rejected(&|c| c.ultimate_rad = scaled(&c.ultimate_rad, 0.99)));
    assert!(rejected(&|c| c.ultimate_rad = Number::zero()));
    assert!(rejected(&|c| c.rate_per_s = scaled(&c.rate_per_s, 2.0)));
    assert!(rejected(&|c| c.witness.disturbance_shares[0] = Number::decimal(1.0).unwrap()), "shares beyond 1");
    assert!(rejected(&|c| c.witness.theta = Number::decimal(1.5).unwrap()));
}
