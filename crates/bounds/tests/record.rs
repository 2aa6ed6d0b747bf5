//! Bounds become a record; the record holds, an edited one does not.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use certune_bounds::riccati::{RiccatiPlan, riccati_bounds, riccati_bounds_with};
use certune_bounds::rigorous::{AngleSet, Effort, PolygonPlan, polygon_bounds_with};
use certune_bounds::{ArmBox, BoundsError, Ranges, RecordError, enclosure, recheck, record};
use certune_dynamics::{Model, Robot};
use certune_verify::{BoundProof, ConfigurationSet, InertiaEnclosure, Number, Record};

fn silent(_: f64) {}

/// The Panda's first two links: small enough to prove everything in a moment.
fn short_arm() -> Robot {
    let panda = Robot::panda();
    Robot::new("short", panda.gravity_m_per_s2(), panda.links()[..2].to_vec()).unwrap()
}

fn proved(robot: &Robot) -> Record {
    let ranges = Ranges { mass_uncertainty: 0.1, rotor_inertia_kg_m2: [0.1, 0.2], ..Ranges::nominal() };
    let arms = ArmBox::<2>::new(&Model::new(robot).unwrap(), &ranges).unwrap();
    let set = AngleSet::Box { lower_rad: [-1.0, -1.7], upper_rad: [1.0, 1.7] };
    let plan = PolygonPlan::new(&arms, &set, Effort::Quick).unwrap();
    let polygons = polygon_bounds_with(&arms, &set, &plan, &silent).unwrap();
    let riccati = riccati_bounds(&arms, &set, Effort::Quick, &silent).unwrap();
    let record = record(robot, &ranges, &set, &polygons, &riccati).unwrap();
    // Five digits, outward.
    let m_hi = record.bounds.m_hi_kg_m2.to_f64();
    assert!(m_hi >= polygons.m_hi_kg_m2 && m_hi <= polygons.m_hi_kg_m2 * (1.0 + 2e-4));
    let m_lo = record.bounds.m_lo_kg_m2.to_f64();
    assert!(m_lo <= riccati.m_lo_kg_m2 && m_lo >= riccati.m_lo_kg_m2 * (1.0 - 2e-4));
    assert!(record.bounds.m_hi_kg_m2.to_string().chars().filter(char::is_ascii_digit).count() <= 6);
    record
}

#[test]
fn a_record_survives_its_file_and_its_proofs() {
    let robot = short_arm();
    let record = proved(&robot);
    let text = serde_json::to_string(&record).unwrap();
    let read = Record::parse(&text).unwrap().unwrap();
    assert_eq!(read, record);
    recheck::<2>(&read, &robot, &silent).unwrap();
}

#[test]
fn a_record_that_claims_more_than_its_proofs_is_refused() {
    let robot = short_arm();
    let record = proved(&robot);
    let edited = |edit: &dyn Fn(&mut Record)| {
        let mut edited = record.clone();
        edit(&mut edited);
        recheck::<2>(&edited.sealed(), &robot, &silent).unwrap_err()
    };
    let scaled = |number: &Number, factor: f64| Number::decimal(number.to_f64() * factor).unwrap();
    type Edit = (&'static str, fn(&mut Record) -> &mut Number, f64);
    let edits: [Edit; 8] = [
        ("m_lo_kg_m2", |r| &mut r.bounds.m_lo_kg_m2, 1.001),
        ("m_hi_kg_m2", |r| &mut r.bounds.m_hi_kg_m2, 0.999),
        ("k_g_n_m_per_rad", |r| &mut r.bounds.k_g_n_m_per_rad, 0.999),
        ("k_c_kg_m2", |r| &mut r.bounds.k_c_kg_m2, 0.999),
        ("k_r", |r| r.bounds.k_r.as_mut().unwrap(), 0.999),
        ("k_m", |r| r.bounds.k_m.as_mut().unwrap(), 0.999),
        ("diagonal_kg_m2", |r| &mut r.bounds.diagonal_kg_m2.as_mut().unwrap()[1][1], 0.999),
        ("gravity_torque_n_m", |r| &mut r.bounds.gravity_torque_n_m.as_mut().unwrap()[1], 0.999),
    ];
    for (name, field, factor) in edits {
        let error = edited(&|r| {
            let number = field(r);
            *number = scaled(number, factor);
        });
        assert!(matches!(&error, RecordError::Tighter { bound, .. } if *bound == name), "{name}: {error}");
    }
    // Other masses, another arm, another set, no proof.
    assert!(matches!(
        edited(&|r| r.arms.mass_uncertainty = Number::decimal(0.3).unwrap()),
        RecordError::Tighter { .. } | RecordError::Bounds(_)
    ));
    assert!(matches!(edited(&|r| r.proofs.clear()), RecordError::Parameter { .. }));
    assert!(matches!(edited(&|r| r.arm.sha256 = "0".repeat(64)), RecordError::OtherArm { .. }));
}

#[test]
fn a_candidate_that_proves_nothing_is_refused() {
    let robot = short_arm();
    let record = proved(&robot);
    let refused = |bound: &str, name: &str, change: fn(f64) -> f64| {
        let mut edited = record.clone();
        for proof in edited.proofs.iter_mut().filter(|proof| bound.is_empty() || proof.bound == bound) {
            for number in proof.parameters.get_mut(name).into_iter().flatten() {
                *number = Number::decimal(change(number.to_f64())).unwrap();
            }
        }
        // What would follow if the sign were not looked at.
        edited.bounds.k_m = Some(Number::decimal(1e-3).unwrap());
        recheck::<2>(&edited.sealed(), &robot, &silent).unwrap_err()
    };
    // `k_r` and `k_m` name the same numbers; each is read from one of them.
    for (bound, name) in [("k_r", "candidate"), ("k_m", "metric"), ("m_lo_kg_m2", "candidate")] {
        let error = refused(bound, name, |x| -x);
        assert!(matches!(error, RecordError::Bounds(BoundsError::Candidate { .. })), "{bound}: {error}");
    }
    let error = refused("k_m", "metric", |_| 0.0);
    assert!(matches!(error, RecordError::Bounds(BoundsError::Candidate { parameter: "metric", .. })), "{error}");
}

#[test]
fn a_record_without_k_holds_and_none_can_be_added() {
    let robot = short_arm();
    let ranges = Ranges::nominal();
    let arms = ArmBox::<2>::new(&Model::new(&robot).unwrap(), &ranges).unwrap();
    let plan = PolygonPlan::new(&arms, &AngleSet::AllAngles, Effort::Quick).unwrap();
    let polygons = polygon_bounds_with(&arms, &AngleSet::AllAngles, &plan, &silent).unwrap();
    let full = riccati_bounds(&arms, &AngleSet::AllAngles, Effort::Quick, &silent).unwrap();
    let plan = RiccatiPlan { k_joint: Vec::new(), metric_kg_m2: Vec::new(), ..full.plan.clone() };
    let riccati = riccati_bounds_with(&arms, &AngleSet::AllAngles, &plan, &silent).unwrap();
    let without = record(&robot, &ranges, &AngleSet::<2>::AllAngles, &polygons, &riccati).unwrap();
    assert!(without.bounds.k_r.is_none() && without.bounds.k_m.is_none());
    recheck::<2>(&without, &robot, &silent).unwrap();
    let mut added = without.clone();
    added.bounds.k_r = Some(Number::decimal(100.0).unwrap());
    assert!(matches!(recheck::<2>(&added.sealed(), &robot, &silent), Err(RecordError::Parameter { .. })));
    // Lists of which one is missing are no plan.
    let torn = RiccatiPlan { metric_kg_m2: Vec::new(), ..full.plan.clone() };
    assert!(riccati_bounds_with(&arms, &AngleSet::AllAngles, &torn, &silent).is_err());
}

#[test]
fn an_enclosure_is_derived_over_its_own_box() {
    let robot = short_arm();
    let record = proved(&robot);
    let ranges = Ranges { mass_uncertainty: 0.1, rotor_inertia_kg_m2: [0.1, 0.2], ..Ranges::nominal() };
    let arms = ArmBox::<2>::new(&Model::new(&robot).unwrap(), &ranges).unwrap();
    let found = enclosure(&arms, &[0.1, 0.4], &[0.2, 0.5], 1).unwrap();
    let number = |x: f64| Number::decimal(x).unwrap();
    let numbers = |list: &[f64]| list.iter().map(|x| number(*x)).collect::<Vec<_>>();
    let rows = |matrix: &[[f64; 2]; 2]| matrix.iter().map(|row| numbers(row)).collect::<Vec<_>>();
    let ConfigurationSet::Box { lower_rad, upper_rad } = record.over.clone() else { unreachable!("a box") };
    let mut narrow = record;
    narrow.over = ConfigurationSet::Box { lower_rad: numbers(&[0.1, 0.4]), upper_rad: numbers(&[0.2, 0.5]) };
    narrow.bounds.inertia = Some(InertiaEnclosure {
        midpoint_kg_m2: rows(&found.midpoint_kg_m2),
        radius_kg_m2: rows(&found.radius_kg_m2),
        coriolis_kg_m2: number(found.coriolis_kg_m2),
    });
    let parameters = [("halvings", numbers(&[1.0])), ("others_lower_rad", lower_rad), ("others_upper_rad", upper_rad)];
    narrow.proofs.push(BoundProof {
        bound: "inertia".to_owned(),
        method: "enclosure".to_owned(),
        parameters: parameters.into_iter().map(|(name, list)| (name.to_owned(), list)).collect(),
    });
    recheck::<2>(&narrow.clone().sealed(), &robot, &silent).unwrap();

    type Edit<'a> = &'a dyn Fn(&mut InertiaEnclosure, &mut Vec<Number>, &mut Vec<Number>);
    let refused = |edit: Edit| {
        let mut edited = narrow.clone();
        let (Some(inertia), ConfigurationSet::Box { upper_rad, .. }, Some(proof)) =
            (&mut edited.bounds.inertia, &mut edited.over, edited.proofs.last_mut())
        else {
            unreachable!("made above")
        };
        edit(inertia, upper_rad, proof.parameters.get_mut("halvings").unwrap());
        recheck::<2>(&edited.sealed(), &robot, &silent).unwrap_err()
    };
    let tighter = |error: &RecordError| matches!(error, RecordError::Tighter { .. });
    assert!(tighter(&refused(&|inertia, _, _| inertia.radius_kg_m2[1][1] = number(0.0))));
    let middle = found.midpoint_kg_m2[0][0] + 0.001;
    assert!(tighter(&refused(&|inertia, _, _| inertia.midpoint_kg_m2[0][0] = number(middle))));
    assert!(tighter(&refused(&|inertia, _, _| inertia.coriolis_kg_m2 = number(found.coriolis_kg_m2 - 1e-4))));
    // A wider box, then one that leaves the set of the other bounds; too many pieces.
    assert!(tighter(&refused(&|_, upper, _| upper[1] = number(0.9))));
    let outside = refused(&|inertia, upper, _| {
        upper[1] = number(1.8);
        inertia.radius_kg_m2 = vec![vec![number(9.0); 2]; 2];
        inertia.coriolis_kg_m2 = number(9.0);
    });
    assert!(matches!(outside, RecordError::Parameter { parameter: "others_lower_rad", .. }), "{outside}");
    assert!(matches!(refused(&|_, _, halvings| halvings[0] = number(40.0)), RecordError::Parameter { .. }));
}
