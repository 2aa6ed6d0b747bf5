//! What a run of CMA-ES promises.

use crate::common::{distort, reread, run, run_interrupted, sphere, valley};
use certune_search::{Cma, Ending, Options, Search, SetupError, TellError};
use proptest::prelude::*;

fn ranks_only() -> Options {
    Options { tol_fun: 0.0, ..Options::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn only_the_order_of_the_scores_counts(seed: u64, n in 2_usize..6) {
        let mut plain = Cma::new(&vec![0.4; n], 0.2, seed, ranks_only()).unwrap();
        let mut distorted = plain.clone();
        let a = run(&mut plain, 150, valley);
        let b = run(&mut distorted, 150, |x| distort(valley(x)));
        prop_assert_eq!(a.len(), b.len());
        for ((x, _), (y, _)) in a.iter().zip(&b) {
            prop_assert_eq!(x, y);
        }
        prop_assert_eq!(plain.ended(), distorted.ended());
    }

    #[test]
    fn an_interrupted_run_goes_on_to_the_bit(seed: u64, n in 1_usize..6) {
        // Infinite scores are part of the state too.
        let objective = |x: &[f64]| if x[0] > 0.7 { f64::INFINITY } else { sphere(x, &[0.3; 6]) };
        let mut whole = Cma::new(&vec![0.6; n], 0.3, seed, Options::default()).unwrap();
        let mut parts = whole.clone();
        prop_assert_eq!(run(&mut whole, 60, objective), run_interrupted(&mut parts, 60, objective));
        prop_assert_eq!(whole, parts);
    }

    #[test]
    fn all_points_asked_lie_in_the_box(
        seed: u64,
        start in prop::collection::vec(0.0..=1.0, 1..5),
        sigma in 1e-3..=1.0,
        optimum in prop::collection::vec(-1.0..2.0, 5),
    ) {
        let mut search = Cma::new(&start, sigma, seed, Options::default()).unwrap();
        for (x, _) in run(&mut search, 60, |x| sphere(x, &optimum)) {
            prop_assert!(x.iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }

    #[test]
    fn optima_on_and_beyond_the_bounds_are_found(
        seed: u64,
        optimum in prop::collection::vec(prop_oneof![Just(0.0), Just(1.0), -1.0..2.0], 1..6),
    ) {
        let mut search = Cma::new(&vec![0.5; optimum.len()], 0.2, seed, Options::default()).unwrap();
        run(&mut search, 10_000, |x| sphere(x, &optimum));
        let nearest: Vec<f64> = optimum.iter().map(|o: &f64| o.clamp(0.0, 1.0)).collect();
        let gap = search.best().unwrap().score - sphere(&nearest, &optimum);
        prop_assert!(gap < 1e-10, "{gap} {:?}", search.ended());
    }

    #[test]
    fn any_scores_whatsoever_are_survived(
        seed: u64,
        n in 1_usize..4,
        scores in prop::collection::vec(
            prop_oneof![Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(0.0), -1e300..1e300], 97),
    ) {
        let mut search = Cma::new(&vec![0.5; n], 0.2, seed, Options::default()).unwrap();
        let mut scores = scores.iter().cycle();
        for _ in 0..300 {
            let points = search.ask();
            prop_assert!(points.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
            if points.is_empty() {
                break;
            }
            let told: Vec<f64> = points.iter().map(|_| *scores.next().unwrap()).collect();
            search.tell(&told).unwrap();
        }
    }
}

/// The first generation is drawn from N(start, σ² I).
#[test]
fn the_first_samples_have_the_covariance_they_should() {
    let lambda = 40_000;
    let options = Options { lambda: Some(lambda), ..Options::default() };
    let mut search = Cma::new(&[0.5, 0.4, 0.6], 0.05, 3, options).unwrap();
    let points = search.ask();
    let mean = |i: usize| points.iter().map(|x| x[i]).sum::<f64>() / lambda as f64;
    let means = [mean(0), mean(1), mean(2)];
    for (i, center) in [0.5, 0.4, 0.6].iter().enumerate() {
        assert!((means[i] - center).abs() < 1e-3);
        for j in 0..3 {
            let products = points.iter().map(|x| (x[i] - means[i]) * (x[j] - means[j]));
            let covariance = products.sum::<f64>() / lambda as f64;
            let expected = if i == j { 0.05 * 0.05 } else { 0.0 };
            assert!((covariance - expected).abs() < 6e-5, "{i} {j} {covariance}");
        }
    }
}

/// Near the optimum of a quadratic C becomes the inverse Hessian, up to scale.
#[test]
fn the_covariance_learns_the_inverse_hessian() {
    let objective = |x: &[f64]| {
        let (a, b) = (x[0] - 0.5 + (x[1] - 0.5), x[0] - 0.5 - (x[1] - 0.5));
        a * a + 1e4 * b * b
    };
    let mut search = Cma::new(&[0.3, 0.4], 0.1, 5, ranks_only()).unwrap();
    run(&mut search, 60, objective);
    let deviations = search.deviations();
    // The valley runs along x₀ = x₁, so both coordinates vary alike …
    assert!((deviations[0] / deviations[1]).ln().abs() < 0.2, "{deviations:?}");
    // … and together: the next generation lies along it.
    let points: Vec<_> = std::iter::repeat_with(|| {
        let points = search.ask();
        let scores: Vec<f64> = points.iter().map(|x| objective(x)).collect();
        search.tell(&scores).unwrap();
        points
    })
    .take(20)
    .flatten()
    .collect();
    let along = points.iter().map(|x| (x[0] + x[1] - 1.0).powi(2)).sum::<f64>();
    let across = points.iter().map(|x| (x[0] - x[1]).powi(2)).sum::<f64>();
    assert!((10.0..1000.0).contains(&(along / across).sqrt()), "{}", (along / across).sqrt());
}

#[test]
fn equal_seeds_give_equal_runs_and_other_seeds_other_ones() {
    let ask = |seed| Cma::new(&[0.5; 3], 0.2, seed, Options::default()).unwrap().ask();
    assert_eq!(ask(1), ask(1));
    assert_ne!(ask(1), ask(2));
}

#[test]
fn a_run_ends_for_the_reason_it_should() {
    let end = |options: Options, sigma: f64, objective: &dyn Fn(&[f64]) -> f64| {
        let mut search = Cma::new(&[0.5, 0.5], sigma, 1, options).unwrap();
        run(&mut search, 100_000, objective);
        assert!(search.ask().is_empty());
        assert_eq!(search.tell(&[]), Err(TellError::Count { asked: 0, told: 0 }));
        search.ended().unwrap()
    };
    let off = Options { tol_fun: 0.0, tol_x: 0.0, lambda: None, max_iterations: Some(1 << 40) };
    let bowl = |x: &[f64]| sphere(x, &[0.3, 0.4]);
    assert_eq!(end(Options { tol_fun: 1e-6, ..off }, 0.2, &bowl), Ending::TolFun);
    assert_eq!(end(Options { tol_x: 1e-4, ..off }, 0.2, &bowl), Ending::TolX);
    assert_eq!(end(Options { max_iterations: Some(3), ..off }, 0.2, &bowl), Ending::MaxIter);
    assert_eq!(end(off, 0.2, &|_| 1.0), Ending::EqualFunValues);
    assert_eq!(end(off, 0.2, &|_| f64::INFINITY), Ending::EqualFunValues);
    assert_eq!(end(off, 1e-9, &|x| x[0] + x[1]), Ending::TolXUp);
    let cigar = |x: &[f64]| (x[0] - 0.5).abs() + 1e16 * (x[1] - 0.5).powi(2);
    assert_eq!(end(off, 0.1, &cigar), Ending::ConditionCov);
    // A sharp optimum away from 0: the mean's last digit is the limit.
    let sharp = end(off, 0.2, &|x| sphere(x, &[0.3, 0.4]).sqrt().sqrt() - 1e-5);
    assert!(matches!(sharp, Ending::NoEffectAxis | Ending::NoEffectCoord | Ending::EqualFunValues));
    // Scores that are noise and nothing else.
    let noise = |x: &[f64]| (x[0] * 1e9).sin() + (x[1] * 1e9).cos();
    assert_eq!(end(off, 0.2, &noise), Ending::Stagnation);
}

#[test]
fn what_is_not_in_order_is_refused() {
    let setup =
        |start: &[f64], sigma, lambda| Cma::new(start, sigma, 0, Options { lambda, ..Options::default() }).err();
    assert_eq!(setup(&[], 0.1, None), Some(SetupError::NoDimension));
    assert_eq!(setup(&[0.5, 1.1], 0.1, None), Some(SetupError::StartOutsideBox));
    assert_eq!(setup(&[f64::NAN], 0.1, None), Some(SetupError::StartOutsideBox));
    for sigma in [0.0, -1.0, 1.5, f64::NAN] {
        assert_eq!(setup(&[0.5], sigma, None), Some(SetupError::Sigma));
    }
    assert_eq!(setup(&[0.5], 0.1, Some(1)), Some(SetupError::Population));

    let mut search = Cma::new(&[0.5; 2], 0.2, 0, Options::default()).unwrap();
    assert_eq!(search.tell(&[]), Err(TellError::Count { asked: 0, told: 0 }));
    let asked = search.ask();
    assert_eq!(search.tell(&[1.0]), Err(TellError::Count { asked: 6, told: 1 }));
    assert_eq!(search.tell(&[f64::NAN; 6]), Err(TellError::NotANumber));
    assert_eq!(search.ask(), asked, "a refused answer changes nothing");
    assert_eq!(search.evaluations(), 0);
    assert_eq!(search.enough(), None);
}

#[test]
fn a_state_whose_parts_do_not_fit_is_refused() {
    let search = Cma::new(&[0.5; 2], 0.2, 0, Options::default()).unwrap();
    assert_eq!(reread(&search), search);
    let mut state = serde_json::to_value(&search).unwrap();
    state["mean"] = serde_json::json!([0.5]);
    assert!(serde_json::from_value::<Cma>(state).is_err());
}
