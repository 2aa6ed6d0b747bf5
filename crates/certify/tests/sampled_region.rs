//! The sampled nonlinear claim for the published simulation gains, on constants a little wider than those of the Panda with rotor inertia 0.1 kg m^2.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Options, Problem, SampledConstantValues,
    SampledRegionOptions, certify, sampled_region,
};
use certune_verify::{
    Claim, ClaimKind, Compensation, Number, Reason, SampledRegionClaim, Verdict, sampled_region_inequalities,
};

fn constants() -> SampledConstantValues {
    SampledConstantValues {
        m_lo_kg_m2: 0.1,
        m_hi_kg_m2: 5.0,
        k_g_n_m_per_rad: 70.0,
        k_c_kg_m2: 2.8,
        k_r: 3.1,
        k_m: Some(3.5),
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin: 0.0,
        samples: 1,
        local_starts: 1,
    }
}

fn problem(compensated: bool, friction: [f64; 2], last_kappa_a: f64, constants: SampledConstantValues) -> Problem {
    let all = |x: f64| vec![x; 7];
    let arm = ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0; 3] };
    let mut gains = AicGainValues {
        kappa_mu: all(11.67),
        kappa_a: all(700.0),
        sigma_q: all(1.0),
        sigma_dq: all(1.0),
        sigma_mu: all(5.0),
        sigma_dmu: all(10.0),
        reference_time_constant_s: all(1.0),
    };
    gains.kappa_a[6] = last_kappa_a;
    let family = FamilyValues {
        gravity_compensation: compensated,
        friction_n_m_s_per_rad: friction,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}

fn found(problem: &Problem, options: &SampledRegionOptions) -> SampledRegionClaim {
    match sampled_region(problem, options) {
        Claim::SampledRegion(claim) => *claim,
        other => panic!("{other:?}"),
    }
}

fn holds(problem: &Problem, claim: &SampledRegionClaim) -> bool {
    sampled_region_inequalities(problem.document(), claim)
        .is_ok_and(|all| all.iter().all(|inequality| inequality.smallest_pivot.is_some()))
}

#[test]
fn every_delay_has_a_region_over_the_whole_inertia_interval() {
    let problem = problem(true, [1.0, 3.0], 700.0, constants());
    for (delay_samples, least) in [(0, 0.86), (1, 0.70), (2, 0.53)] {
        let start = std::time::Instant::now();
        let claim = found(&problem, &SampledRegionOptions { delay_samples, ..SampledRegionOptions::default() });
        println!("delay {delay_samples}: radius {} rad in {:?}", claim.radius_rad, start.elapsed());
        assert!(claim.radius_rad.to_f64() >= least, "delay {delay_samples}: {}", claim.radius_rad);
    }
}

#[test]
fn a_torque_limit_and_a_rate_cost_radius() {
    let problem = problem(true, [1.0, 1.0], 700.0, constants());
    let defaults = SampledRegionOptions::default();
    let radius = |options: &SampledRegionOptions| found(&problem, options).radius_rad.to_f64();
    let free = radius(&defaults);
    let limited = radius(&SampledRegionOptions { torque_limit_n_m: Some(30.0), ..defaults });
    let fast = radius(&SampledRegionOptions { rate_per_s: 0.3, ..defaults });
    println!("free {free}, 30 N m {limited}, 0.3 per s {fast}");
    assert!(free >= 0.70 && (0.15..free).contains(&limited) && (0.45..free).contains(&fast));
}

#[test]
fn without_friction_a_continuous_compensation_is_enough() {
    let problem = problem(true, [0.0, 0.0], 700.0, constants());
    let options = SampledRegionOptions { compensation: Compensation::Continuous, ..SampledRegionOptions::default() };
    let claim = found(&problem, &options);
    assert!(claim.radius_rad.to_f64() >= 0.35, "{}", claim.radius_rad);
}

#[test]
fn what_the_claim_cannot_cover_is_said() {
    let reason = |problem: &Problem| match sampled_region(problem, &SampledRegionOptions::default()) {
        Claim::NotProved(claim) => claim.reason,
        other => panic!("{other:?}"),
    };
    let friction = [1.0, 1.0];
    assert_eq!(reason(&problem(false, friction, 700.0, constants())), Reason::FamilyNotCovered);
    assert_eq!(reason(&problem(true, friction, 600.0, constants())), Reason::UnequalGains);
    let unknown = SampledConstantValues { k_m: None, ..constants() };
    assert_eq!(reason(&problem(true, friction, 700.0, unknown)), Reason::ConstantMissing);
    // The bare wrist: friction alone can change its speed by a quarter in a period, and k_m is 11.
    let bare = SampledConstantValues { m_lo_kg_m2: 0.0044, m_hi_kg_m2: 4.66, k_r: 5.0, k_m: Some(11.2), ..constants() };
    assert!(matches!(reason(&problem(true, friction, 700.0, bare)), Reason::Infeasible | Reason::CandidateFailed));
}

#[test]
fn a_document_with_the_claim_is_accepted_and_wider_figures_are_not() {
    let problem = problem(true, [1.0, 1.0], 700.0, constants());
    let options = Options {
        sampled_region: SampledRegionOptions { torque_limit_n_m: Some(87.0), ..SampledRegionOptions::default() },
        ..Options::default()
    };
    let certificate = certify(&problem, &[ClaimKind::SampledRegion], &options, &|_| None).unwrap();
    let checked = &certificate.checked()[0];
    assert_eq!(checked.verdict, Verdict::Holds);
    println!("{}", checked.statement);
    // Growth, containment, decay and torque at five corners, and the start.
    assert_eq!(checked.inequalities.len(), 21);
    let Claim::SampledRegion(claim) = &certificate.document().claims[0].claim else { panic!() };
    let number = |text: &str| -> Number { text.parse().unwrap() };
    type Edit = fn(&mut SampledRegionClaim, Number);
    let edits: [(Edit, &str); 11] = [
        (|claim, x| claim.radius_rad = x, "0.9"),
        (|claim, x| claim.sampling.rate_per_s = x, "0.5"),
        (|claim, x| claim.sampling.torque_limit_n_m = Some(x), "20"),
        (|claim, x| claim.sampling.step_s = x, "0.002"),
        (|claim, x| claim.witness.rho = x, "0.01"),
        (|claim, x| claim.witness.speed = x, "0.001"),
        (|claim, x| claim.witness.speed = x, "0.13"),
        (|claim, x| claim.witness.decay[0] = x, "-1"),
        (|claim, x| claim.witness.theta = x, "1.5"),
        (|claim, x| claim.witness.inertia_kg_m2 = vec![x], "0.05"),
        (|claim, x| claim.witness.inertia_kg_m2 = vec![x], "6"),
    ];
    assert!(holds(&problem, claim));
    for (edit, value) in edits {
        let mut edited = claim.as_ref().clone();
        edit(&mut edited, number(value));
        assert!(edited != **claim && !holds(&problem, &edited), "{value}: {edited:?}");
    }
    let mut more_delay = claim.as_ref().clone();
    more_delay.sampling.delay_samples = usize::MAX;
    assert!(!holds(&problem, &more_delay) && more_delay.goal_step_weight().is_err());
}
