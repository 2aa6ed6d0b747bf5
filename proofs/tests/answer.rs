//! `README.md`'s answer to the paper's open question: the map of learning rates is derived again, and must be the one on the page.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::path::Path;

use certune::verify::{AicGains, ClaimKind, LoopBox, family_box};
use proofs::map::{Panel, certified_level, map, with_learning_rates};
use proofs::{nominal_family, published};

/// The published gains, and the loops of the nominal Panda at every configuration.
fn loops(gravity_compensation: bool) -> (AicGains, LoopBox) {
    let certificate = published(&nominal_family(gravity_compensation, [0.0, 0.0]), ClaimKind::Exponential).unwrap();
    let document = certificate.document();
    (document.gains.aic().unwrap().clone(), family_box(document))
}

#[test]
fn the_map_is_the_one_on_the_page() {
    let (gains, uncompensated) = loops(false);
    let (_, compensated) = loops(true);
    let panels = [
        Panel { title: "gravity not compensated, no friction".to_owned(), range: uncompensated },
        Panel { title: "gravity compensated by the robot, no friction".to_owned(), range: compensated },
    ];
    let svg = map(&gains, &panels).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("learning-rates.svg");
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        std::fs::write(&path, &svg).unwrap();
    }
    assert!(std::fs::read_to_string(&path).unwrap() == svg, "write it again with `cargo xtask claims`");
}

/// The authors needed kappa_a = 700 in simulation and could lower it to 200 only on the robot that compensates gravity.
#[test]
fn the_published_learning_rates_are_where_the_paper_needs_them() {
    let (gains, uncompensated) = loops(false);
    let (_, compensated) = loops(true);
    let level =
        |kappa_a: f64, range: &LoopBox| certified_level(&with_learning_rates(&gains, 11.67, kappa_a).unwrap(), range);
    assert!(level(700.0, &uncompensated) >= Some(4), "0.7 per s");
    assert_eq!(level(200.0, &uncompensated), None);
    assert!(level(200.0, &compensated).is_some());
}
