//! `README.md`'s answer to the paper's open question: the map of learning rates is derived again, and must be the one on the page.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::fmt::Write as _;
use std::path::Path;

use certune::verify::{AicGains, ClaimKind, LoopBox, PlantStep, SampledFamily, family_box};
use num_rational::BigRational;
use num_traits::Zero;
use proofs::map::{Panel, certified_level, map, with_learning_rates};
use proofs::{nominal_family, published};

/// The published gains, and the loops of the nominal Panda at every configuration.
fn loops(gravity_compensation: bool) -> (AicGains, LoopBox) {
    loops_with(gravity_compensation, [0.0, 0.0])
}

fn loops_with(gravity_compensation: bool, friction_n_m_s_per_rad: [f64; 2]) -> (AicGains, LoopBox) {
    let family = nominal_family(gravity_compensation, friction_n_m_s_per_rad);
    let certificate = published(&family, ClaimKind::Exponential).unwrap();
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

const BEFORE: &str = "<!-- learning rates, written by `cargo xtask claims` -->\n";
const AFTER: &str = "<!-- end of learning rates -->\n";
/// Learning rates of the belief that the page speaks of.
const KAPPA_MU: [f64; 5] = [2.0, 5.0, 11.67, 20.0, 50.0];

/// Three digits.
fn short(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap()
}

/// The ends of the first interval of kappa_a, in three digits and from 1 to 1e6, in which `holds` holds; both hold, their neighbours do not.
fn interval(holds: &dyn Fn(f64) -> bool) -> Option<[f64; 2]> {
    let grid: Vec<f64> = (0..=60).map(|k| short(10_f64.powf(f64::from(k) / 10.0))).collect();
    let first = grid.iter().position(|&x| holds(x))?;
    let last = first + grid[first..].iter().position(|&x| !holds(x)).unwrap_or(grid.len() - first) - 1;
    let bisected = |mut inside: f64, mut outside: f64| loop {
        let middle = short((inside * outside).sqrt());
        // Neighbours in three digits.
        if middle.to_bits() == inside.to_bits() || middle.to_bits() == outside.to_bits() {
            return inside;
        }
        if holds(middle) { inside = middle } else { outside = middle }
    };
    let least = if first == 0 { grid[0] } else { bisected(grid[first], grid[first - 1]) };
    let largest = if last + 1 == grid.len() { f64::INFINITY } else { bisected(grid[last], grid[last + 1]) };
    Some([least, largest])
}

#[test]
fn the_pages_learning_rates_are_those_that_are_certified() {
    let (gains, uncompensated) = loops(false);
    let (_, compensated) = loops(true);
    let (_, with_friction) = loops_with(true, [1.0, 3.0]);
    let mut table =
        "| kappa_mu | not compensated | compensated | compensated, 1 kHz | the same, one sample of delay |\n\
        |---|---|---|---|---|\n"
            .to_owned();
    for kappa_mu in KAPPA_MU {
        let with = |kappa_a: f64| with_learning_rates(&gains, kappa_mu, kappa_a).unwrap();
        let continuous = |range: &LoopBox| interval(&|kappa_a| certified_level(&with(kappa_a), range).is_some());
        let sampled = |delay: u32| {
            interval(&|kappa_a| {
                let loops = SampledFamily::new(&with(kappa_a), &"0.001".parse().unwrap()).unwrap();
                let delay = BigRational::from_integer(delay.into());
                loops.decays_on(PlantStep::SemiImplicit, &with_friction, &delay, &BigRational::zero()).is_ok()
            })
        };
        let cells = [continuous(&uncompensated), continuous(&compensated), sampled(0), sampled(1)];
        let words = cells.map(|found| match found {
            None => "none".to_owned(),
            Some([least, largest]) if largest.is_finite() => format!("{least} to {largest}"),
            Some([least, _]) => format!("from {least}"),
        });
        let _ = writeln!(table, "| {kappa_mu} | {} |", words.join(" | "));
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(BEFORE).unwrap();
    let (listed, tail) = rest.split_once(AFTER).unwrap();
    if std::env::var_os("CERTUNE_WRITE_CLAIMS").is_some() {
        std::fs::write(&path, format!("{head}{BEFORE}{table}{AFTER}{tail}")).unwrap();
    } else {
        assert_eq!(listed, table, "write it again with `cargo xtask claims`");
    }
}
