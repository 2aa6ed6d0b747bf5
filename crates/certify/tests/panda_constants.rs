//! The Panda's published gains from constants alone, against figures computed once with cvxpy in floating point.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Options, Problem, RegionOptions, SampledConstantValues,
    certify,
};
use certune_verify::{Certificate, Claim, ClaimKind, Verdict};

fn problem(kappa_a: f64, compensated: bool, friction: [f64; 2], margin: f64) -> Problem {
    from_constants(kappa_a, compensated, friction, constants(margin))
}

fn from_constants(kappa_a: f64, compensated: bool, friction: [f64; 2], values: SampledConstantValues) -> Problem {
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
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(values)).unwrap()
}

fn constants(margin: f64) -> SampledConstantValues {
    let up = 1.0 + margin;
    SampledConstantValues {
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
    }
}

fn claims(problem: &Problem, claim: ClaimKind) -> Certificate {
    certify(problem, &[claim], &Options::default(), &|_| None).unwrap()
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

/// Constants as wide as bounds over every configuration come out, instead of the truth: what the radii lose.
#[test]
fn radii_with_wide_constants_and_limits() {
    let wide = |friction, compensated, k_r| {
        let mut values = constants(0.0);
        (values.m_lo_kg_m2, values.m_hi_kg_m2, values.k_g_n_m_per_rad) = (0.001, 4.97, 71.0);
        (values.k_c_kg_m2, values.k_r) = (2.6, k_r);
        from_constants(700.0, compensated, friction, values)
    };
    let with = |problem: &Problem, region: RegionOptions| {
        let start = std::time::Instant::now();
        let certificate =
            certify(problem, &[ClaimKind::Region], &Options { region: region.clone(), ..Options::default() }, &|_| {
                None
            })
            .unwrap();
        let Claim::Region(claim) = &certificate.document().claims[0].claim else {
            panic!("{:?}", certificate.document().claims[0])
        };
        println!("{} rad in {:?}, {region:?}", claim.radius_rad, start.elapsed());
        claim.radius_rad.to_f64()
    };
    let free = RegionOptions::default();
    let limited = RegionOptions { controller_torque_n_m: Some(87.0), ..free.clone() };
    let kept = RegionOptions { distance_rad: Some(0.4), ..free.clone() };
    let rubbing = wide([1.0, 3.0], true, 10.0);
    assert!(with(&rubbing, free.clone()) >= 0.72);
    assert!(with(&rubbing, limited) >= 0.69);
    assert!(with(&rubbing, kept) >= 0.38);
    assert!(with(&wide([0.0, 0.0], true, 10.0), free.clone()) >= 0.205);
    assert!(with(&wide([1.0, 3.0], false, 10.0), free) >= 0.235);
}
