//! `claims/moving-goal.md` on the Panda: how fast the goal may move with the published simulation gains, and along the pick-and-place task at
//! that speed.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::certify::{FamilyValues, GoalListValues, MovingGoalOptions, Options};
use certune::closed_loop::Scenario;
use certune::control::aic::AicGains;
use certune::verify::{Certificate, Claim, ClaimKind, Document, Grade, MovingGoalClaim, Number, seal, verify};
use certune::{Effort, Request, TorqueLimits, certificate_text};
use proofs::{grade, kept, nominal_family, panda, records, stored};

fn pick_and_place() -> GoalListValues {
    let text = include_str!("../../tuning/scenarios/pick-and-place-ramped.toml");
    let scenario = Scenario::parse("pick-and-place-ramped.toml".as_ref(), text).unwrap();
    let goals = scenario.segments.into_iter().map(|goal| (goal.goal_rad, goal.duration_s)).collect();
    GoalListValues { start_rad: scenario.start_rad, goals }
}

/// The published simulation gains but for `kappa_a`.
fn derive(kappa_a: f64) -> Certificate {
    let gains = AicGains::<7> {
        kappa_mu: [11.67; 7],
        kappa_a: [kappa_a; 7],
        sigma_q: [1.0; 7],
        sigma_dq: [1.0; 7],
        sigma_mu: [5.0; 7],
        sigma_dmu: [10.0; 7],
        reference_time_constant_s: [1.0; 7],
    };
    let moving_goal =
        MovingGoalOptions { coarse: 5, refinements: 4, list: Some(pick_and_place()), ..MovingGoalOptions::default() };
    let effort = Effort { proofs: Options { moving_goal, ..Options::default() }, ..Effort::default() };
    let certifier = panda(&nominal_family(true, [1.0, 3.0])).unwrap();
    certifier.certify_with(&gains, &[ClaimKind::MovingGoal], &effort).unwrap()
}

fn claim(document: &Document) -> &MovingGoalClaim {
    match &document.claims[1].claim {
        Claim::MovingGoal(claim) => claim,
        other => panic!("{other:?}"),
    }
}

/// Gains that were re-tuned for a slow ramp: a weaker torque and slower beliefs, the same on every joint.
fn derive_sampled() -> Certificate {
    let gains = AicGains::<7> {
        kappa_mu: [11.67; 7],
        kappa_a: [200.0; 7],
        sigma_q: [1.0; 7],
        sigma_dq: [1.0; 7],
        sigma_mu: [15.0; 7],
        sigma_dmu: [30.0; 7],
        reference_time_constant_s: [1.0; 7],
    };
    // The task's order, each goal standing as long as its slow ramp needs.
    let GoalListValues { start_rad, goals } = pick_and_place();
    let goals = goals.into_iter().map(|(goal, duration)| (goal, if duration > 10.0 { 72.0 } else { 45.0 })).collect();
    let request = Request {
        claims: vec![ClaimKind::MovingGoal],
        delay_samples: Some(1),
        torque_limits: TorqueLimits::LessGravity,
        goals: Some(GoalListValues { start_rad, goals }),
        ..Request::default()
    };
    let family = FamilyValues { rotor_inertia_kg_m2: [0.1; 2], ..nominal_family(true, [1.0, 1.0]) };
    panda(&family).unwrap().answer(&gains.into(), &request).unwrap().certificate
}

/// At 1 kHz, one sample late, every motor within its limit. Deriving it takes half a minute of a core: `cargo xtask claims` does.
#[test]
fn a_slow_ramp_is_covered_when_sampled_and_late_with_every_torque_limit_kept() {
    let certificate = if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        stored("moving-goal--sampled", &derive_sampled()).unwrap()
    } else {
        kept("moving-goal--sampled").unwrap()
    };
    assert!(certificate.all_hold());
    assert!(certificate.checked().iter().all(|checked| checked.grade == Some(Grade::Proved)));
    let Claim::SampledRegion(region) = &certificate.document().claims[0].claim else { panic!("no sampled region") };
    assert_eq!(region.sampling.delay_samples, 1);
    // The weakest motor has 12 N m, gravity takes its share of that.
    assert!(region.sampling.torque_limit_n_m.as_ref().unwrap().to_f64() <= 12.0);
    let claim = claim(certificate.document());
    assert!(claim.goal_speed_rad_per_s.to_f64() >= 0.05, "{}", claim.goal_speed_rad_per_s);
    let list = claim.list.as_ref().unwrap();
    assert!(list.goals.len() == 5 && list.goals.iter().all(|goal| goal.arrival_s.value() <= goal.duration_s.value()));
}

#[test]
fn the_published_gains_cover_the_ramped_task_in_its_time() {
    let derived = derive(700.0);
    let stored = stored("moving-goal", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[1].grade, Some(grade(certificate)));
        let claim = claim(certificate.document());
        assert!(claim.goal_speed_rad_per_s.to_f64() >= 0.2, "{}", claim.goal_speed_rad_per_s);
        let list = claim.list.as_ref().unwrap();
        assert!(list.goals.iter().all(|goal| goal.arrival_s.value() <= goal.duration_s.value()));
        // Speed, jumps, five goals that arrive, and the distance at both ends of the inertia.
        assert_eq!(certificate.checked()[1].inequalities.len(), 14);
        assert_eq!(
            claim.covered_jumps(certificate.document()).unwrap(),
            0,
            "no goal of the task is near enough for a jump"
        );
    }
    let speeds = [&derived, &stored].map(|c| claim(c.document()).goal_speed_rad_per_s.to_f64());
    assert!((speeds[0] - speeds[1]).abs() <= 0.01, "{speeds:?}");
}

#[test]
fn a_larger_kappa_a_allows_a_faster_goal() {
    let certificate = derive(2000.0);
    assert!(certificate.all_hold());
    let claim = claim(certificate.document());
    assert!((0.27..0.36).contains(&claim.goal_speed_rad_per_s.to_f64()), "{}", claim.goal_speed_rad_per_s);
}

#[test]
fn what_the_region_does_not_bear_is_rejected() {
    let stored = stored("moving-goal", &derive(700.0)).unwrap();
    let rejected = |edit: &dyn Fn(&mut MovingGoalClaim)| {
        let mut document = stored.document().clone();
        let Claim::MovingGoal(claim) = &mut document.claims[1].claim else { panic!("a moving goal") };
        edit(claim);
        let text = certune::certify::to_json(&seal(document)).unwrap();
        verify(&text, &records().unwrap()).unwrap().is_err()
    };
    let scaled = |number: &Number, share: f64| Number::decimal(number.to_f64() * share).unwrap();
    assert!(!rejected(&|_| {}), "unchanged, it stands");
    assert!(
        !rejected(&|claim| claim.goal_speed_rad_per_s = scaled(&claim.goal_speed_rad_per_s, 0.5)),
        "slower is fine"
    );
    assert!(rejected(&|claim| claim.goal_speed_rad_per_s = scaled(&claim.goal_speed_rad_per_s, 1.01)));
    assert!(rejected(&|claim| claim.jump_rad = scaled(&claim.jump_rad, 1.01)));
    assert!(rejected(&|claim| claim.dwell_s = scaled(&claim.dwell_s, 0.5)));
    assert!(rejected(&|claim| claim.distance_rad = scaled(&claim.distance_rad, 0.99)));
    for index in [0, 2, 3, usize::MAX] {
        assert!(rejected(&|claim| claim.region = index), "entry {index} is no earlier region");
    }
    for edit in [
        &|list: &mut certune::verify::GoalList| list.speed_rad_per_s = Number::decimal(0.4).unwrap(),
        &|list: &mut certune::verify::GoalList| list.speed_rad_per_s = Number::decimal(0.1).unwrap(),
        &|list: &mut certune::verify::GoalList| list.goals[1].arrival_s = Number::decimal(5.0).unwrap(),
        &|list: &mut certune::verify::GoalList| list.goals[1].goal_rad[0] = Number::decimal(-1.0).unwrap(),
        &|list: &mut certune::verify::GoalList| {
            list.start_rad.pop();
        },
        &|list: &mut certune::verify::GoalList| list.goals.clear(),
    ] as [&dyn Fn(&mut certune::verify::GoalList); 6]
    {
        assert!(rejected(&|claim| edit(claim.list.as_mut().unwrap())));
    }
    // The region itself edited: the goal's proof falls with it.
    let mut document = stored.document().clone();
    document.claims.swap(0, 1);
    assert!(verify(&certune::certify::to_json(&seal(document)).unwrap(), &records().unwrap()).unwrap().is_err());
    assert!(certificate_text(&stored).is_ok());
}
