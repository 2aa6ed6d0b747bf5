//! `claims/lyapunov.md` on the Panda: the authors' gains retuned joint by joint, linearised at the task's goals, 42 states.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use std::path::Path;

use certune::ArmCertifier;
use certune::closed_loop::{Gains, GainsFile};
use certune::control::aic::AicGains;
use certune::dynamics::Robot;
use certune::verify::{Certificate, Claim, LyapunovWitness, Number, PlaneRegion, checked_alone};
use proofs::{A, B, C, nominal_family, stored};

fn retuned() -> AicGains<7> {
    let text = include_str!("../../tuning/presets/pezzato2020-robot.toml");
    let file = GainsFile::parse(Path::new("pezzato2020-robot.toml"), text).unwrap();
    let Gains::Aic(table) = file.gains else { panic!("not the AIC") };
    table.bind::<7>().unwrap()
}

fn certificate(goal: [f64; 7], friction: f64) -> Certificate {
    let arm = ArmCertifier::<7>::new(&Robot::panda(), &nominal_family(true, [friction; 2])).unwrap();
    arm.certify_at(&retuned(), goal).unwrap()
}

fn rate(certificate: &Certificate) -> f64 {
    let Claim::Lyapunov(claim) = &certificate.document().claims[0].claim else {
        panic!("{}", certificate.checked()[0].statement)
    };
    let [PlaneRegion::HalfPlane { rate_per_s }] = &claim.regions[..] else { panic!("{:?}", claim.regions) };
    rate_per_s.to_f64()
}

#[test]
fn per_joint_gains_decay_at_the_goals_with_friction() {
    for goal in [A, B, C] {
        let certificate = certificate(goal, 1.0);
        println!("{goal:?}: {} 1/s", rate(&certificate));
        assert!(certificate.all_hold() && rate(&certificate) > 0.3);
        for inequality in &certificate.checked()[0].inequalities {
            assert_eq!(inequality.order, 42);
        }
    }
}

#[test]
fn the_proved_rate_is_close_to_the_slowest_eigenvalue() {
    let certificate = certificate(B, 1.0);
    let Claim::Lyapunov(claim) = &certificate.document().claims[0].claim else { panic!("no claim") };
    let vertex = &claim.polytope.vertices[0];
    let a = nalgebra::DMatrix::from_fn(42, 42, |i, j| vertex[i][j].to_f64());
    let rightmost = a.complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
    assert!(rate(&certificate) < -rightmost && rate(&certificate) > -0.95 * rightmost, "{rightmost}");
}

#[test]
fn an_edited_matrix_is_not_proved() {
    let certificate = certificate(B, 1.0);
    let document = certificate.document();
    let Claim::Lyapunov(claim) = &document.claims[0].claim else { panic!("no claim") };
    let fails = |edit: &dyn Fn(&mut certune::verify::LyapunovClaim)| {
        let mut edited = claim.as_ref().clone();
        edit(&mut edited);
        checked_alone(document, &Claim::Lyapunov(Box::new(edited))).is_err()
    };
    let number = |x: f64| Number::decimal(x).unwrap();
    assert!(!fails(&|_| ()));
    // The first joint's velocity fed back with the wrong sign.
    assert!(fails(&|c| c.polytope.vertices[0][7][7] = number(5.0)));
    assert!(fails(&|c| c.regions = vec![PlaneRegion::HalfPlane { rate_per_s: number(2.0) }]));
    assert!(fails(&|c| {
        if let LyapunovWitness::Common { p } = &mut c.witness {
            p[100] = number(1e6);
        }
    }));
}

#[test]
fn the_stored_certificate_is_the_one_derived() {
    let derived = certificate(B, 1.0);
    let start = std::time::Instant::now();
    let stored = stored("lyapunov", &derived).unwrap();
    println!("read and checked in {:?}", start.elapsed());
    assert!(stored.all_hold());
    assert!((rate(&stored) - rate(&derived)).abs() < 0.01);
}
