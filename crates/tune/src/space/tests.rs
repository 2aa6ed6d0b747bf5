use super::*;
use proptest::prelude::*;

const SHIPPED: &str = include_str!("../../../../tuning/spaces/panda-aic.toml");

fn shipped() -> Space {
    Space::parse(Path::new("space.toml"), SHIPPED).unwrap()
}

fn published() -> Gains {
    Gains {
        kappa_mu: 11.67,
        kappa_a: 700.0,
        sigma_q: 1.0,
        sigma_dq: 1.0,
        sigma_mu: 5.0,
        sigma_dmu: 10.0,
        reference_time_constant_s: 1.0,
    }
}

/// The shipped file with one piece of text replaced.
fn edited(from: &str, to: &str) -> Result<Space, SpaceError> {
    assert!(SHIPPED.contains(from), "{from:?} is not in the shipped space");
    match Space::parse(Path::new("space.toml"), &SHIPPED.replacen(from, to, 1)) {
        Err(SpaceError::At { location, problem }) => {
            assert!(location.line_column.is_some(), "{problem} has no line");
            Err(*problem)
        }
        other => other,
    }
}

#[test]
fn the_shipped_space_has_five_degrees_of_freedom_and_holds_the_published_gains() {
    let space = shipped();
    assert_eq!(space.dimension(), 5);
    assert_eq!(space.method(), Method::Schedule);
    assert_eq!(space.admit(&published()).unwrap(), published());
    assert_eq!(space.decode(&space.encode(&published())), published());
}

#[test]
fn a_cold_start_is_no_preset() {
    let from = |start: &str| edited("start = \"pezzato2020-simulation\"\n", start).unwrap();
    let (cold, preset, silent) = (from("start = \"cold\"\n"), shipped(), from(""));
    assert_eq!((cold.is_cold(), cold.start()), (true, None));
    assert_eq!((preset.is_cold(), preset.start()), (false, Some("pezzato2020-simulation")));
    assert_eq!((silent.is_cold(), silent.start()), (false, None));
}

#[test]
fn every_corner_of_the_shipped_space_is_slow_enough_for_euler_at_1_khz() {
    let space = shipped();
    let upper = |gain| match space.freedom(gain) {
        Freedom::Free(range) => range.upper,
        Freedom::Fixed(value) => value,
    };
    let lower = |gain| match space.freedom(gain) {
        Freedom::Free(range) => range.lower,
        Freedom::Fixed(value) => value,
    };
    let leak_per_s = upper(Gain::KappaMu)
        * [Gain::SigmaQ, Gain::SigmaDq, Gain::SigmaMu, Gain::SigmaDmu]
            .map(|gain| 1.0 / lower(gain))
            .iter()
            .sum::<f64>();
    assert!(leak_per_s * 1e-3 < 0.75, "the beliefs leak at {leak_per_s} /s");
}

#[test]
fn a_start_is_scaled_to_the_fixed_variance() {
    let space = shipped();
    assert_eq!(space.admit(&published().rescaled(4.0)).unwrap(), published());
    assert!(matches!(
        space.admit(&published().with(Gain::KappaA, 1e6)),
        Err(SpaceError::StartOutside { gain: Gain::KappaA, value: 1e6, .. })
    ));
    assert!(matches!(
        space.admit(&published().with(Gain::ReferenceTimeConstantS, 0.5)),
        Err(SpaceError::StartNotFixed { gain: Gain::ReferenceTimeConstantS, .. })
    ));
}

#[test]
fn bad_files_are_refused_with_the_gain_and_the_numbers() {
    let range = "[gains.kappa_mu]\nlower = 2.0\nupper = 60.0";
    let replaced = |with| edited(range, &format!("[gains.kappa_mu]\n{with}"));
    let inverted = replaced("lower = 60.0\nupper = 2.0").unwrap_err();
    assert_eq!(inverted, SpaceError::Inverted { gain: Gain::KappaMu, lower: 60.0, upper: 2.0 });
    assert!(matches!(replaced("lower = 2.0\nupper = 2.0"), Err(SpaceError::Inverted { .. })));
    assert!(matches!(replaced("lower = 0.0\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = -1.0\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = nan\nupper = 2.0"), Err(SpaceError::Bounds { .. })));
    assert!(matches!(replaced("lower = 1.0\nupper = inf"), Err(SpaceError::Bounds { .. })));
    let file = |error: SpaceError| match error {
        SpaceError::File(error) => *error.problem,
        other => panic!("{other}"),
    };
    assert_eq!(file(edited("schema = 1", "schema = 2").unwrap_err()), Problem::Schema { found: 2, expected: 1 });
    assert!(matches!(edited("\"aic\"", "\"mrac\""), Err(SpaceError::MracNotTunable)));
    assert!(matches!(file(edited("\"aic\"", "\"pid\"").unwrap_err()), Problem::UnknownName { .. }));
    assert!(matches!(file(edited("method = \"schedule\"", "").unwrap_err()), Problem::MissingKey));
    assert!(matches!(file(edited("lower = 2.0", "lower = \"two\"").unwrap_err()), Problem::WrongType { .. }));
    assert!(matches!(file(edited("schema = 1", "schema = 1\nschema = 1").unwrap_err()), Problem::Syntax { .. }));
    assert!(matches!(edited("sigma_q = 1.0", ""), Err(SpaceError::Missing { gain: Gain::SigmaQ })));
    assert!(matches!(edited("sigma_q = 1.0", "sigma_q = -1.0"), Err(SpaceError::Fixed { gain: Gain::SigmaQ, .. })));
    assert!(matches!(
        edited("sigma_q = 1.0", "sigma_q = 1.0\nkappa_mu = 1.0"),
        Err(SpaceError::Twice { gain: Gain::KappaMu })
    ));
    let freed = "\n[gains.sigma_q]\nlower = 0.1\nupper = 2.0\nscale = \"log\"\n";
    let both = "sigma_q = 1.0\nreference_time_constant_s = 1.0\n";
    let error = edited(both, &format!("reference_time_constant_s = 1.0\n{freed}")).unwrap_err();
    assert_eq!(error, SpaceError::Redundant);
    let fixed = Gain::ALL.map(|gain| Freedom::Fixed(published().get(gain)));
    assert_eq!(Space::new(Method::NelderMead, None, fixed).unwrap_err(), SpaceError::NothingFree);
}

#[test]
fn a_misspelt_key_is_named_with_its_line() {
    let error = edited("[gains.kappa_mu]", "[gains.kapa_mu]").unwrap_err().to_string();
    let line = 1 + SHIPPED.split("[gains.kappa_mu]").next().unwrap().matches('\n').count();
    assert!(error.starts_with(&format!("space.toml:{line}:")), "{error}");
    assert!(error.contains("gains.kapa_mu") && error.contains("did you mean `kappa_mu`"), "{error}");
}

proptest! {
    #[test]
    fn decoding_stays_in_the_box_and_is_undone_by_encoding(point in proptest::collection::vec(-3.0..4.0_f64, 5)) {
        let space = shipped();
        let gains = space.decode(&point);
        prop_assert_eq!(space.admit(&gains).unwrap(), gains);
        prop_assert_eq!(space.decode(&space.encode(&gains)), gains);
    }

    #[test]
    fn folding_is_continuous(x in -5.0..5.0_f64) {
        prop_assert!((folded(x) - folded(x + 1e-9)).abs() < 2e-9);
        prop_assert!((0.0..=1.0).contains(&folded(x)));
    }
}
