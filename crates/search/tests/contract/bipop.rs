//! What the search with restarts promises.

use crate::common::{bumps, distort, run, run_interrupted};
use certune_search::{Bipop, BipopOptions, Ending, Options, Search};
use proptest::prelude::*;

fn search(n: usize, seed: u64, options: BipopOptions) -> Bipop {
    Bipop::new(&vec![0.8; n], 0.05, seed, options).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn only_the_order_of_the_scores_counts(seed: u64) {
        let run_options = Options { tol_fun: 0.0, ..Options::default() };
        let mut plain = search(2, seed, BipopOptions { run: run_options, ..Default::default() });
        let mut distorted = plain.clone();
        let a = run(&mut plain, 500, bumps);
        let b = run(&mut distorted, 500, |x| distort(bumps(x)));
        prop_assert!(a.iter().zip(&b).all(|((x, _), (y, _))| x == y));
    }

    #[test]
    fn an_interrupted_search_goes_on_to_the_bit(seed: u64) {
        let mut whole = search(2, seed, BipopOptions::default());
        let mut parts = whole.clone();
        prop_assert_eq!(run(&mut whole, 500, bumps), run_interrupted(&mut parts, 500, bumps));
        prop_assert_eq!(whole, parts);
    }

    #[test]
    fn a_global_optimum_far_from_the_start_is_found(seed: u64) {
        let mut search = search(2, seed, BipopOptions::default());
        while search.evaluations() < 50_000 && search.best().is_none_or(|b| b.score > 1e-8) {
            run(&mut search, 1, bumps);
        }
        prop_assert!(search.best().unwrap().score < 1e-8);
    }
}

#[test]
fn the_two_regimes_take_turns_within_their_budgets() {
    let options = BipopOptions { max_restarts: 3, ..BipopOptions::default() };
    let mut search = search(2, 11, options);
    let (mut runs, mut before) = (Vec::new(), 0);
    let mut points = 0;
    while search.ended().is_none() {
        let lambda = search.run().parameters().lambda;
        points += run(&mut search, 1, bumps).len() as u64;
        // A run with no evaluations has just begun.
        if search.run().evaluations() == 0 || search.ended().is_some() {
            runs.push((lambda, points - before));
            before = points;
        }
    }
    assert_eq!(search.ended(), Some(Ending::MaxRestarts));
    assert_eq!(search.evaluations(), points);
    assert_eq!(runs[0].0, 6);
    assert_eq!(runs[1].0, 12, "the first restart is a large one: {runs:?}");
    let largest = runs.iter().map(|run| run.0).max().unwrap();
    assert_eq!(largest, 6 << 3);
    // The regimes' budgets differ by no more than the longest run.
    let mut doubled = 6;
    let (mut large, mut small, mut longest) = (0, 0, 0);
    for &(lambda, spent) in &runs {
        longest = longest.max(spent);
        if lambda == 2 * doubled && small >= large {
            doubled = lambda;
            large += spent;
        } else {
            small += spent;
        }
        assert!(small.abs_diff(large) <= longest, "{runs:?}");
    }
}

#[test]
fn the_best_is_kept_across_restarts() {
    let mut search = search(3, 2, BipopOptions::default());
    let told = run(&mut search, 1500, bumps);
    let least = told.iter().map(|(_, score)| *score).fold(f64::INFINITY, f64::min);
    assert_eq!(search.best().unwrap().score, least);
    assert_eq!(bumps(&search.best().unwrap().point), least);
}
