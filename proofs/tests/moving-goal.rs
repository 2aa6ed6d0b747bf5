//! `claims/moving-goal.md` on the Panda: how fast the goal may move with the published simulation gains, and along the pick-and-place task at
//! that speed.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::certify::{GoalListValues, MovingGoalOptions, Options};
use certune::closed_loop::Scenario;
use certune::control::aic::AicGains;
use certune::verify::{Certificate, Claim, ClaimKind, Document, MovingGoalClaim, Number, seal, verify};
use certune::{Effort, certificate_text};
use proofs::{grade, nominal_family, panda, records, stored};

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
