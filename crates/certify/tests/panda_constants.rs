//! The Panda's published gains from constants alone, against figures computed once with cvxpy in floating point.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Options, Problem, SampledConstantValues, certify,
};
use certune_verify::{Certificate, Claim, ClaimKind, Verdict};

fn problem(kappa_a: f64, compensated: bool, friction: [f64; 2], margin: f64) -> Problem {
    let all = |x: f64| vec![x; 7];
    let arm =
        ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0, 0.0, 0.307] };
    let gains = AicGainValues {
        kappa_mu: all(11.67),
        kappa_a: all(kappa_a),
        sigma_q: all(1.0),
        sigma_dq: all(1.0),
        sigma_mu: all(5.0),
        sigma_dmu: all(10.0),
        reference_time_constant_s: all(1.0),
    };
    let family = FamilyValues {
        gravity_compensation: compensated,
        friction_n_m_s_per_rad: friction,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let up = 1.0 + margin;
    let constants = SampledConstantValues {
        m_lo_kg_m2: 0.0044 / up,
        m_hi_kg_m2: 4.659 * up,
        k_g_n_m_per_rad: 69.28 * up,
        k_c_kg_m2: 2.254 * up,
        k_r: 4.962 * up,
        k_m: None,
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin,
        samples: 1,
        local_starts: 1,
    };
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}

fn claims(problem: &Problem, claim: ClaimKind) -> Certificate {
    certify(problem, &[claim], &Options::default(), &|| None).unwrap()
}

fn radius(problem: &Problem) -> f64 {
    match &claims(problem, ClaimKind::Region).document().claims[0].claim {
        Claim::Region(c) => c.radius_rad.to_f64(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn published_gains_decay_without_gravity_compensation() {
    let certificate = claims(&problem(700.0, false, [0.0, 0.0], 0.05), ClaimKind::Exponential);
    let Claim::Exponential(claim) = &certificate.document().claims[0].claim else { panic!() };
    println!("rate {}", claim.rate_per_s);
    assert!(claim.rate_per_s.to_f64() >= 0.7, "{}", claim.rate_per_s);
}

#[test]
fn a_weak_torque_gain_without_compensation_is_refused() {
    let certificate = claims(&problem(200.0, false, [0.0, 0.0], 0.05), ClaimKind::Exponential);
    assert_eq!(certificate.checked()[0].verdict, Verdict::Refused);
}

#[test]
fn radii_agree_with_cvxpy() {
    for (compensated, friction, least) in
        [(true, [1.0, 3.0], 0.80), (true, [0.0, 0.0], 0.33), (false, [1.0, 3.0], 0.25), (true, [1.0, 1.0], 0.80)]
    {
        let start = std::time::Instant::now();
        let found = radius(&problem(700.0, compensated, friction, 0.05));
        println!("compensated {compensated} friction {friction:?} radius {found} in {:?}", start.elapsed());
        assert!(found >= least, "compensated {compensated}, friction {friction:?}: {found}");
    }
}
