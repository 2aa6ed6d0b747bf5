//! `claims/joint-region.md` on the Panda: the gains of the authors' robot controller, retuned joint by joint, gravity compensated, friction 1 to 3
//! N m s/rad, every motor within its limit.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune::certify::GoalListValues;
use certune::verify::{Certificate, Claim, ClaimKind, Number, Verdict};
use certune::{Request, TorqueLimits};
use proofs::{A, B, C, asked, grade, nominal_family, stored};

const MOTOR_LIMITS_N_M: [f64; 7] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];

/// The paper's steps: from B to A and back, from B to C; the way back from C is the same with the other sign.
fn derived(friction: [f64; 2]) -> Certificate {
    let goals = [A, B, C].map(|goal| (goal.to_vec(), 6.0)).to_vec();
    let request = Request {
        claims: vec![ClaimKind::JointRegion],
        torque_limits: TorqueLimits::LessGravity,
        goals: Some(GoalListValues { start_rad: B.to_vec(), goals }),
        ..Request::default()
    };
    asked("robot", &nominal_family(true, friction), &request).unwrap()
}

fn covered_share(certificate: &Certificate) -> f64 {
    match &certificate.document().claims[0].claim {
        Claim::JointRegion(claim) => {
            let limits: Vec<f64> = claim.motor_limits_n_m.iter().flatten().map(Number::to_f64).collect();
            assert!(limits.iter().zip(MOTOR_LIMITS_N_M).all(|(a, b)| a.to_bits() == b.to_bits()) && limits.len() == 7);
            claim.steps.as_ref().unwrap().covered_share.to_f64()
        }
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by where an interior-point iteration stops.
const SHARE_SPREAD: f64 = 0.01;

#[test]
fn the_robots_gains_cover_a_share_of_the_papers_steps() {
    let derived = derived([1.0, 3.0]);
    println!("{}", derived.checked()[0].statement);
    let stored = stored("joint-region", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[0].grade, Some(grade(certificate)));
        assert!(covered_share(certificate) >= 0.22, "{}", covered_share(certificate));
        // Containment, decay, torque and start of seven joints at two frictions, and three steps.
        assert_eq!(certificate.checked()[0].inequalities.len(), 7 * 2 * 4 + 3);
    }
    assert!((covered_share(&derived) - covered_share(&stored)).abs() <= SHARE_SPREAD);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

#[test]
fn without_friction_the_retuned_wrist_has_no_proof() {
    assert_eq!(derived([0.0, 0.0]).checked()[0].verdict, Verdict::NotProved);
}
