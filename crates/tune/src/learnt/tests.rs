//! Surfaces that are known, and records made of them.

use std::collections::BTreeMap;

use certune_closed_loop::{AicTable, PerJoint};
use proptest::prelude::*;

use super::*;
use crate::goals::{Bound, Goals, Limit};
use crate::outcome::{Finite, Outcome};
use crate::record::{Figures, HeldOut, PlantResult, Question, RECORD_SCHEMA, SpaceRecord};
use crate::search::{Phase, SearchSettings, Termination};
use crate::space::{Knob, Method, Range, Scale, Tie};

const NAMES: [&str; 3] = ["kappa_a", "sigma_dq", "sigma_mu"];

fn knob(name: &str) -> Knob {
    Knob {
        name: name.to_owned(),
        range: Range { lower: 0.1, upper: 10.0, scale: Scale::Log },
        tie: Tie::Shared,
        per_unit: BTreeMap::from([(name.to_owned(), PerJoint::Shared(1.0))]),
    }
}

fn gains(place: &[f64]) -> Gains {
    NAMES.iter().zip(place).fold(AicTable::uniform(1.0).into(), |gains: Gains, (name, place)| {
        gains.with(name, PerJoint::Shared((0.1_f64.ln() + place * 100.0_f64.ln()).exp()))
    })
}

/// Points that fill the cube evenly (additive recurrence).
fn place(index: usize) -> Vec<f64> {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_1, 0.549_700_477_901_970_3]
        .map(|step| (0.5 + step * (index + 1) as f64).fract())
        .to_vec()
}

fn record(count: usize, cost: impl Fn(&[f64]) -> f64) -> RunRecord {
    let evaluation = |index: usize| Evaluation {
        index,
        round: 0,
        phase: Phase::Scatter,
        gains: gains(&place(index)),
        outcome: Outcome::Simulated { cost: Finite::saturating(cost(&place(index))) },
    };
    RunRecord {
        schema: RECORD_SCHEMA,
        question: Question {
            robot: String::new(),
            robot_sha256: String::new(),
            scenario: String::new(),
            versions: BTreeMap::new(),
            goals: Goals::default(),
            search: SearchSettings::new(Method::CmaEs, count, 1),
            batch_plants: 1,
            held_out_plants: 1,
            worst_plants: 0,
            certification_attempts: 1,
        },
        space: SpaceRecord { fixed: BTreeMap::new(), knobs: NAMES.map(knob).to_vec() },
        evaluations: (0..count).map(evaluation).collect(),
        termination: Termination::BudgetSpent,
        worst_plants: Vec::new(),
        certification: Vec::new(),
        start: None,
        winner: None,
        held_out: HeldOut::default(),
        sensitivity: Vec::new(),
    }
}

const MIDDLE: [f64; 3] = [0.5; 3];

#[test]
fn a_quadratic_is_found_again_with_its_stiff_and_its_slack_direction() {
    // Only the difference of the first two knobs matters.
    let learnt = surface(&record(40, |x| 3.0 + 20.0 * (x[0] - x[1]).powi(2)), &gains(&MIDDLE)).unwrap();
    assert_eq!((learnt.points, learnt.coefficients, learnt.round), (40, 10, 0));
    assert!(learnt.r_squared > 1.0 - 1e-9 && learnt.predicted_r_squared > 1.0 - 1e-9, "{learnt:?}");
    assert!(learnt.reach > 0.4 && learnt.reach <= 0.5);
    assert_eq!(learnt.pairs[0].0, ["kappa_a".to_owned(), "sigma_dq".to_owned()]);
    assert!(learnt.knobs[2].1 < 1e-9 && (learnt.knobs[0].1 - learnt.knobs[1].1).abs() < 1e-9);
    // With half widths a: 20² a⁴ 4/45 each alone, 40² a⁴/9 together.
    assert!((learnt.pairs[0].1 - (1600.0 / 9.0) / (1600.0 / 9.0 + 2.0 * 1600.0 / 45.0)).abs() < 1e-9);
    let stiff = &learnt.directions[0];
    assert!((stiff.parts[0] * stiff.parts[1] + 0.5).abs() < 1e-6 && stiff.parts[2].abs() < 1e-6, "{stiff:?}");
    assert!(learnt.directions[1].slope < 1e-6 * stiff.slope);
}

#[test]
fn a_slope_counts_where_a_limit_stops_the_search() {
    let learnt = surface(&record(40, |x| 1.0 + 2.0 * x[1]), &gains(&MIDDLE)).unwrap();
    assert!((learnt.knobs[1].1 - 1.0).abs() < 1e-9);
    assert!((learnt.directions[0].slope - 2.0).abs() < 1e-9 && (learnt.directions[0].parts[1] - 1.0).abs() < 1e-9);
}

#[test]
fn too_few_candidates_are_said_to_be() {
    let mut short = record(20, |x| x[0]);
    assert!(surface(&short, &gains(&MIDDLE)).is_ok());
    short.evaluations[3].outcome = Outcome::Stopped { cost_above: Finite::saturating(1.0) };
    let refused = surface(&short, &gains(&MIDDLE)).unwrap_err();
    assert_eq!(refused, TooFew { points: 19, knobs: 3, needed: 20 });
}

#[test]
fn rounds_are_never_mixed_and_the_last_with_enough_is_taken() {
    let mut both = record(60, |x| x[0]);
    for evaluation in &mut both.evaluations[30..] {
        evaluation.round = 1;
        evaluation.outcome = Outcome::Simulated { cost: Finite::saturating(100.0 - place(evaluation.index)[1]) };
    }
    let plant = crate::record::WorstPlant {
        evaluation: 0,
        setting: certune_closed_loop::PlantBox::nominal(true).at(1, &[]),
        outcome: Outcome::Simulated { cost: Finite::saturating(1.0) },
    };
    both.worst_plants.push(plant);
    let learnt = surface(&both, &gains(&MIDDLE)).unwrap();
    assert_eq!((learnt.round, learnt.points), (1, 30));
    assert!((learnt.knobs[1].1 - 1.0).abs() < 1e-9);
    both.evaluations.truncate(45);
    assert_eq!(surface(&both, &gains(&MIDDLE)).unwrap().round, 0);
}

#[test]
fn the_nearest_limit_is_the_one_exceeded_most() {
    let mut record = record(1, |_| 1.0);
    let limit = |goal, bound| Limit { goal, bound: Bound::At(bound) };
    record.question.goals.limits = vec![limit(Goal::Overshoot, 0.02), limit(Goal::Jitter, 20.0)];
    let plant = |overshoot, torque_rate_rms_n_m_per_s| PlantResult {
        plant: 0,
        outcome: Outcome::Simulated { cost: Finite::saturating(1.0) },
        figures: Figures { overshoot: Some(overshoot), torque_rate_rms_n_m_per_s, ..Figures::default() },
    };
    let mut verdict = Verdict {
        outcome: record.evaluations[0].outcome,
        plants: vec![plant(0.01, Some(19.0)), plant(0.012, Some(3.0))],
    };
    assert_eq!(nearest_limit(&record, &verdict), Some((Goal::Jitter, 20.0, 19.0)));
    verdict.plants.push(plant(0.0199, None));
    assert_eq!(nearest_limit(&record, &verdict), Some((Goal::Jitter, 20.0, f64::INFINITY)));
    verdict.plants.pop();
    verdict.plants.push(plant(0.03, Some(1.0)));
    assert_eq!(nearest_limit(&record, &verdict), Some((Goal::Overshoot, 0.02, 0.03)));
    record.question.goals.limits.clear();
    assert_eq!(nearest_limit(&record, &verdict), None);
}

proptest! {
    /// Whatever the quadratic: shares make up the whole, directions are unit vectors in order, and the least-squares fit of a quadratic is exact.
    #[test]
    fn shares_make_up_the_whole(
        slope in prop::array::uniform3(-5.0..5.0_f64),
        curvature in prop::array::uniform6(-20.0..20.0_f64),
        at in prop::array::uniform3(0.0..1.0_f64),
    ) {
        let cost = |x: &[f64]| {
            let squares: f64 = pairs(3).zip(curvature).map(|([i, j], c)| c * x[i] * x[j]).sum();
            100.0 + x.iter().zip(slope).map(|(x, s)| x * s).sum::<f64>() + squares
        };
        let learnt = surface(&record(60, cost), &gains(&at)).unwrap();
        prop_assert_eq!(learnt.points, 40);
        prop_assert!(learnt.r_squared > 1.0 - 1e-8, "{}", learnt.r_squared);
        let whole: f64 = learnt.knobs.iter().map(|(_, share)| share).chain(learnt.pairs.iter().map(|(_, share)| share)).sum();
        prop_assert!((whole - 1.0).abs() < 1e-9);
        prop_assert!(learnt.directions.windows(2).all(|two| two[0].slope >= two[1].slope));
        for direction in &learnt.directions {
            prop_assert!((direction.parts.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-9);
        }
    }
}
