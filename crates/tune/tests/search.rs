//! The search finds known minima, spends its budget exactly, and does not depend on the number of threads.

mod common;

use std::sync::atomic::{AtomicUsize, Ordering};

use certune_closed_loop::PerJoint;
use certune_tune::{
    Candidate, Evaluation, Finite, Gains, Method, Objective, Outcome, Phase, Progress, SearchError, SearchSettings,
    Space, SpaceError, Termination, search,
};
use common::{Numbers, ones, space_of};
use proptest::prelude::*;

/// A space whose free gains are the first `free` of the list, each over `[0.01, 100]`.
fn space(free: usize) -> Space {
    space_of(&["kappa_mu", "kappa_a", "sigma_dq", "sigma_mu", "sigma_dmu"][..free], [0.01, 100.0])
}

const METHODS: [Method; 4] = [Method::Schedule, Method::CmaEs, Method::NelderMead, Method::ParticleSwarm];

/// The same gains with another number in a row, on every joint.
fn holding(gains: Gains, row: &str, value: f64) -> Gains {
    gains.with(row, PerJoint::Shared(value))
}

fn simulated(cost_s: f64) -> Outcome {
    Outcome::Simulated { cost: Finite::saturating(cost_s) }
}

/// Squared distance, in natural logarithms, to a point that is far from the start in every gain.
fn bowl(gains: &Gains) -> Outcome {
    let squares = [("kappa_mu", 3.0_f64), ("kappa_a", 0.2), ("sigma_dq", 5.0), ("sigma_mu", 0.5), ("sigma_dmu", 2.0)];
    simulated(squares.iter().map(|(gain, at)| (gains.number(gain) / at).ln().powi(2)).sum())
}

/// Rosenbrock's valley in the logarithms of two gains; minimum 0 at ln = (1, 1).
fn valley(gains: &Gains) -> Outcome {
    let (x, y) = (gains.number("kappa_mu").ln(), gains.number("kappa_a").ln());
    simulated(100.0 * (y - x * x).powi(2) + (1.0 - x).powi(2))
}

/// A bowl with a cliff: half of the space is unstable, a corner of it diverges.
fn cliff(gains: &Gains) -> Outcome {
    if gains.number("kappa_mu") * gains.number("kappa_a") > 50.0 {
        Outcome::Diverged { at_s: Finite::saturating(100.0 / gains.number("kappa_mu")) }
    } else if gains.number("kappa_mu") > 3.5 {
        Outcome::Unstable { abscissa_per_s: Finite::saturating(gains.number("kappa_mu") - 3.5) }
    } else {
        bowl(gains)
    }
}

fn cost_s(evaluation: &Evaluation) -> f64 {
    evaluation.outcome.cost().expect("a simulated outcome")
}

#[test]
fn nelder_mead_finds_the_bottom_of_a_bowl_in_five_gains() {
    let settings = SearchSettings::new(Method::NelderMead, 400, 0);
    let run = search(&space(5), Some(&ones()), &settings, &bowl, &()).unwrap();
    let best = run.ranked()[0];
    assert!(cost_s(best) < 1e-6, "{best:?}");
    assert!((best.gains.number("kappa_mu") / 3.0 - 1.0).abs() < 1e-2, "{best:?}");
}

#[test]
fn nelder_mead_follows_rosenbrocks_valley() {
    let settings = SearchSettings::new(Method::NelderMead, 300, 0);
    let start = holding(holding(ones(), "kappa_mu", (-1.2_f64).exp()), "kappa_a", std::f64::consts::E);
    let run = search(&space(2), Some(&start), &settings, &valley, &()).unwrap();
    assert!(cost_s(run.ranked()[0]) < 1e-6, "{:?}", run.ranked()[0]);
}

#[test]
fn nelder_mead_walks_along_a_cliff_without_falling() {
    let settings = SearchSettings::new(Method::NelderMead, 400, 0);
    let run = search(&space(5), Some(&ones()), &settings, &cliff, &()).unwrap();
    assert!(run.evaluations.iter().any(|evaluation| evaluation.outcome.cost().is_none()), "the cliff was never met");
    assert!(cost_s(run.ranked()[0]) < 1e-3, "{:?}", run.ranked()[0]);
}

#[test]
fn a_cold_swarm_finds_both() {
    for (dimension, objective) in [(5, bowl as fn(&Gains) -> Outcome), (2, valley)] {
        let settings = SearchSettings { particles: 20, ..SearchSettings::new(Method::ParticleSwarm, 3000, 7) };
        let run = search(&space(dimension), None, &settings, &objective, &()).unwrap();
        assert!(cost_s(run.ranked()[0]) < 1e-3, "{:?}", run.ranked()[0]);
    }
}

/// A second basin, deeper than the one at the start and far from it.
fn two_basins(gains: &Gains) -> Outcome {
    let distance = |at: f64| ["kappa_mu", "kappa_a", "sigma_dq"].map(|gain| (gains.number(gain) / at).ln().powi(2));
    let [here, there] = [1.3, 30.0].map(|at| distance(at).iter().sum::<f64>());
    simulated((1.0 + here).min(0.5 + there))
}

#[test]
fn the_schedule_leaves_the_basin_of_its_start_for_a_better_one() {
    let cost = |method, seed| {
        let settings = SearchSettings::new(method, 800, seed);
        cost_s(search(&space(3), Some(&ones()), &settings, &two_basins, &()).unwrap().ranked()[0])
    };
    assert!((cost(Method::NelderMead, 0) - 1.0).abs() < 1e-3);
    let found: Vec<f64> = (0..10).map(|seed| cost(Method::Schedule, seed)).collect();
    // Nobody can promise the deeper basin; a restart meets it more often than not.
    assert!(found.iter().filter(|cost| (**cost - 0.5).abs() < 1e-3).count() >= 8, "{found:?}");
}

#[test]
fn a_small_budget_is_the_simplexs_as_long_as_it_gains() {
    let run = |budget| {
        let settings = SearchSettings::new(Method::Schedule, budget, 3);
        search(&space(5), Some(&ones()), &settings, &bowl, &()).unwrap().evaluations
    };
    assert!(run(200)[1..].iter().all(|evaluation| evaluation.phase == Phase::Simplex));
    assert!(run(300).iter().any(|evaluation| evaluation.phase == Phase::Scatter), "and no more than a small one");
}

/// An objective that takes every chance to stop.
struct Hasty(fn(&Gains) -> Outcome);

impl Objective for Hasty {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        match (self.0(gains), enough) {
            (Outcome::Simulated { cost }, Some(enough)) if cost > enough => Outcome::Stopped { cost_above: enough },
            (outcome, _) => outcome,
        }
    }
}

/// An objective that answers a given number of generations.
struct Tired(AtomicUsize);

impl Objective for Tired {
    fn evaluate(&self, gains: &Gains, _: Option<Finite>) -> Outcome {
        bowl(gains)
    }
    fn evaluate_all(&self, candidates: &[Candidate]) -> Option<Vec<Outcome>> {
        let left = self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
        left.ok().map(|_| candidates.iter().map(|candidate| bowl(&candidate.gains)).collect())
    }
}

#[test]
fn a_search_that_nobody_answers_any_more_ends_with_what_it_has() {
    for method in METHODS {
        for generations in [0, 1, 5] {
            let tired = Tired(AtomicUsize::new(generations));
            let whole = search(&space(3), Some(&ones()), &SearchSettings::new(method, 100, 1), &bowl, &()).unwrap();
            let run = search(&space(3), Some(&ones()), &SearchSettings::new(method, 100, 1), &tired, &()).unwrap();
            assert_eq!(run.termination, Termination::Interrupted);
            assert!(run.evaluations.len() >= generations && run.evaluations.len() < whole.evaluations.len());
            assert_eq!(run.evaluations, whole.evaluations[..run.evaluations.len()]);
        }
    }
}

#[test]
fn a_swarm_does_not_see_the_start_and_depends_on_its_seed() {
    let settings = SearchSettings::new(Method::ParticleSwarm, 40, 1);
    let with = search(&space(5), Some(&ones()), &settings, &bowl, &()).unwrap().evaluations;
    let without = search(&space(5), None, &settings, &bowl, &()).unwrap().evaluations;
    assert_eq!(with[0].phase, Phase::Start);
    assert!(with[1..].iter().zip(&without).all(|(a, b)| a.gains == b.gains));
    let reseeded = search(&space(5), None, &SearchSettings { seed: 2, ..settings }, &bowl, &()).unwrap().evaluations;
    assert_ne!(without[0].gains, reseeded[0].gains);
}

#[test]
fn a_search_that_knows_everything_ends_before_its_budget() {
    let flat = |_: &Gains| simulated(1.0);
    let run = search(&space(1), Some(&ones()), &SearchSettings::new(Method::NelderMead, 1000, 0), &flat, &()).unwrap();
    assert_eq!(run.termination, Termination::Converged);
    assert!(run.evaluations.len() < 100);
}

#[test]
fn progress_hears_every_evaluation_in_order() {
    struct Counter(AtomicUsize);
    impl Progress for Counter {
        fn evaluated(&self, done: usize, evaluations: usize, evaluation: &Evaluation, best: &Evaluation) {
            assert_eq!(done, self.0.fetch_add(1, Ordering::SeqCst) + 1);
            assert_eq!(evaluation.index + 1, done);
            assert!(evaluations == 35 && best.outcome <= evaluation.outcome);
        }
    }
    for method in METHODS {
        let counter = Counter(AtomicUsize::new(0));
        search(&space(3), Some(&ones()), &SearchSettings::new(method, 35, 0), &bowl, &counter).unwrap();
        assert_eq!(counter.0.into_inner(), 35);
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let run = |settings: &SearchSettings| search(&space(2), None, settings, &bowl, &()).unwrap_err();
    let good = SearchSettings::new(Method::NelderMead, 10, 0);
    assert_eq!(run(&SearchSettings { evaluations: 0, ..good }), SearchError::NoBudget);
    assert_eq!(run(&SearchSettings { particles: 1, ..good }), SearchError::Particles { particles: 1 });
    assert_eq!(run(&SearchSettings { simplex_step: 0.0, ..good }), SearchError::SimplexStep { simplex_step: 0.0 });
    assert!(matches!(run(&SearchSettings { simplex_step: f64::NAN, ..good }), SearchError::SimplexStep { .. }));
    let outside = search(&space(2), Some(&holding(ones(), "kappa_a", 1e3)), &good, &bowl, &());
    assert!(matches!(outside, Err(SearchError::Start(SpaceError::StartOutside { knob, .. })) if knob == "kappa_a"));
}

fn method() -> impl Strategy<Value = Method> {
    proptest::sample::select(METHODS.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_budget_is_exact(method in method(), budget in 1_usize..60, free in 1_usize..6, seed: u64, given: bool) {
        let calls = AtomicUsize::new(0);
        let counted = |gains: &Gains| {
            calls.fetch_add(1, Ordering::SeqCst);
            bowl(gains)
        };
        let start = given.then_some(ones());
        let run = search(&space(free), start.as_ref(), &SearchSettings::new(method, budget, seed), &counted, &()).unwrap();
        let calls = calls.into_inner();
        prop_assert_eq!(run.evaluations.len(), calls);
        match run.termination {
            Termination::BudgetSpent => prop_assert_eq!(calls, budget),
            Termination::Converged => prop_assert!(calls < budget),
            Termination::Interrupted => prop_assert!(false, "somebody always answers"),
        }
        prop_assert!(run.evaluations.iter().enumerate().all(|(index, evaluation)| evaluation.index == index));
    }

    #[test]
    fn stopping_early_changes_no_candidate(method in method(), seed: u64, which in 0..3_usize) {
        let objective = Hasty([bowl, cliff, two_basins][which]);
        let run = |stop_early| {
            let settings = SearchSettings { stop_early, ..SearchSettings::new(method, 120, seed) };
            search(&space(3), Some(&ones()), &settings, &objective, &()).unwrap()
        };
        let (with, without) = (run(true), run(false));
        prop_assert_eq!(with.termination, without.termination);
        prop_assert_eq!(with.evaluations.len(), without.evaluations.len());
        for (with, without) in with.evaluations.iter().zip(&without.evaluations) {
            prop_assert_eq!(&with.gains, &without.gains);
            match with.outcome {
                Outcome::Stopped { cost_above } => prop_assert!(without.outcome.cost().is_some_and(|cost| cost > cost_above.get())),
                outcome => prop_assert_eq!(outcome, without.outcome),
            }
        }
        prop_assert_eq!(with.ranked()[0], without.ranked()[0]);
    }

    #[test]
    fn the_record_is_the_same_to_the_byte_for_any_number_of_threads(method in method(), seed: u64) {
        let record = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let settings = SearchSettings::new(method, 60, seed);
            let run = pool.install(|| search(&space(5), Some(&ones()), &settings, &cliff, &())).unwrap();
            serde_json::to_string(&run).unwrap()
        };
        let one = record(1);
        prop_assert_eq!(&one, &record(2));
        prop_assert_eq!(&one, &record(4));
        let read: certune_tune::SearchRun = serde_json::from_str(&one).unwrap();
        prop_assert_eq!(serde_json::to_string(&read).unwrap(), one);
    }
}
