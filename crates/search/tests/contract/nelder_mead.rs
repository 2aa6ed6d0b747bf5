//! What the simplex promises.

use crate::common::{reread, run, run_interrupted, sphere, valley};
use certune_search::{Coefficients, Ending, NelderMead, NelderMeadOptions, Search, TellError};
use proptest::prelude::*;

fn simplex(n: usize, size: f64) -> NelderMead {
    NelderMead::new(&vec![0.45; n], size, NelderMeadOptions::default()).unwrap()
}

/// An objective with plateaus, so that ties and thresholds meet.
fn terraces(x: &[f64]) -> f64 {
    (valley(x) * 4.0).floor()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// The promise of `enough`: what is not below it may be told as anything
    /// else that is not below it, and no question changes ever after.
    #[test]
    fn a_score_at_or_above_enough_is_as_good_as_any_other(
        n in 1_usize..6,
        size in 0.01..0.6,
        stepped: bool,
        raised in prop::collection::vec(
            prop_oneof![Just(0.0), 0.0..1e3, Just(f64::INFINITY)], 31),
    ) {
        let objective = if stepped { terraces } else { valley };
        let mut exact = simplex(n, size);
        let mut capped = exact.clone();
        let mut raised = raised.iter().cycle();
        let mut replaced = 0;
        for _ in 0..3000 {
            let points = exact.ask();
            prop_assert_eq!(&points, &capped.ask());
            prop_assert_eq!(exact.enough(), capped.enough());
            prop_assert_eq!(exact.ended(), capped.ended());
            prop_assert_eq!(exact.best(), capped.best());
            if points.is_empty() {
                break;
            }
            let scores: Vec<f64> = points.iter().map(|x| objective(x)).collect();
            let told: Vec<f64> = scores
                .iter()
                .map(|&score| match exact.enough() {
                    Some(enough) if score >= enough => {
                        replaced += 1;
                        enough + raised.next().unwrap()
                    }
                    _ => score,
                })
                .collect();
            exact.tell(&scores).unwrap();
            capped.tell(&told).unwrap();
        }
        prop_assert!(replaced > 0);
    }

    #[test]
    fn an_interrupted_search_goes_on_to_the_bit(n in 1_usize..5, size in 0.01..0.6) {
        let objective = |x: &[f64]| if x[0] > 0.5 { f64::INFINITY } else { valley(x) };
        let mut whole = simplex(n, size);
        let mut parts = whole.clone();
        prop_assert_eq!(run(&mut whole, 400, objective), run_interrupted(&mut parts, 400, objective));
        prop_assert_eq!(whole, parts);
    }

    #[test]
    fn all_points_asked_lie_in_the_box(
        start in prop::collection::vec(0.0..=1.0, 1..5),
        size in 1e-6..1.0,
        optimum in prop::collection::vec(-1.0..2.0, 5),
    ) {
        let mut search = NelderMead::new(&start, size, NelderMeadOptions::default()).unwrap();
        for (x, _) in run(&mut search, 500, |x| sphere(x, &optimum)) {
            prop_assert!(x.iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }

    #[test]
    fn any_scores_whatsoever_are_survived(
        n in 1_usize..4,
        scores in prop::collection::vec(
            prop_oneof![Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(0.0), -1e300..1e300], 97),
    ) {
        let mut search = simplex(n, 0.1);
        let mut scores = scores.iter().cycle();
        run(&mut search, 2000, |_| 0.0);
        search.restart(0.1).unwrap();
        for _ in 0..2000 {
            let told: Vec<f64> = search.ask().iter().map(|_| *scores.next().unwrap()).collect();
            if told.is_empty() {
                break;
            }
            search.tell(&told).unwrap();
            search = reread(&search);
        }
    }

    #[test]
    fn optima_on_and_beyond_the_bounds_are_found(
        optimum in prop::collection::vec(prop_oneof![Just(0.0), Just(1.0), -0.5..1.5], 1..4),
    ) {
        let mut search = simplex(optimum.len(), 0.1);
        run(&mut search, 20_000, |x| sphere(x, &optimum));
        let nearest: Vec<f64> = optimum.iter().map(|o: &f64| o.clamp(0.0, 1.0)).collect();
        let gap = search.best().unwrap().score - sphere(&nearest, &optimum);
        prop_assert!(gap < 1e-8, "{gap}");
    }
}

#[test]
fn a_smooth_valley_is_descended_to_its_floor() {
    for (n, coefficients) in [(2, Some(Coefficients::classic())), (2, None), (4, None)] {
        let options = NelderMeadOptions { coefficients, ..NelderMeadOptions::default() };
        let mut search = NelderMead::new(&vec![0.3; n], 0.1, options).unwrap();
        run(&mut search, 20_000, valley);
        assert_eq!(search.ended(), Some(Ending::Converged));
        assert!(search.best().unwrap().score < 1e-10);
    }
}

#[test]
fn a_finished_search_may_be_restarted_closer() {
    let mut search = simplex(2, 0.1);
    run(&mut search, 20, valley);
    let best = search.best().cloned().unwrap();
    search.restart(0.01).unwrap();
    assert_eq!(search.ask().len(), 2, "the score of the best vertex is known");
    assert_eq!(search.best(), Some(&best));
    run(&mut search, 20_000, valley);
    assert_eq!(search.ended(), Some(Ending::Converged));
    assert_eq!(search.tell(&[0.0]), Err(TellError::Count { asked: 0, told: 1 }));
    search.restart(0.01).unwrap();
    assert_eq!(search.ended(), None);
}

#[test]
fn a_flat_objective_ends_the_search() {
    let mut search = simplex(3, 0.1);
    run(&mut search, 10_000, |_| f64::INFINITY);
    assert_eq!(search.ended(), Some(Ending::Converged));
}

#[test]
fn an_objective_that_falls_at_every_question_does_not_carry_the_simplex_off() {
    let mut search = simplex(2, 0.1);
    let mut score = 0.0;
    for _ in 0..100_000 {
        let points = search.ask();
        assert!(points.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
        let told: Vec<f64> = points
            .iter()
            .map(|_| {
                score -= 1.0;
                score
            })
            .collect();
        if told.is_empty() {
            break;
        }
        search.tell(&told).unwrap();
    }
    assert_eq!(search.ended(), Some(Ending::Converged));
}
