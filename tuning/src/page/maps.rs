//! Where loops are stable: maps over two gains each, with the others as tuned.
//!
//! Every cell is looked at by the filter of the search, on fewer samples. Where those decay, the checker decides the inequality of claim `exponential` in exact arithmetic, once, at the
//! smallest rate that a claim may have, for the arms of the run's certificate: a claim would also search for the largest rate and for margins, which takes fifty times as long.

use certune::closed_loop::{Gains, PerJoint};
use certune::dynamics::Robot;
use certune::report::{Pair, Slice, SliceAxis};
use certune::tune::{Knob, Scale, StabilityFilter};
use certune::verify::{AicGains, LoopBox, LoopFamily, Number, family_box};
use rayon::prelude::*;

use super::unit;
use crate::commands::tune::misfit;
use crate::error::Error;
use crate::run::Run;

/// The gains of the maps, horizontal and vertical.
const MAPS: [[&str; 2]; 3] = [["kappa_a", "sigma_dq"], ["kappa_mu", "sigma_mu"], ["kappa_a", "kappa_mu"]];
/// Cells on a side.
const CELLS: usize = 16;
/// Samples of the filter: the lightest arm of the box, the heaviest, and one that is drawn. A cell takes two eigenvalue problems each.
const SAMPLES: usize = 3;
/// The smallest rate that a claim may have, 1/s.
const LEAST_RATE_PER_S: f64 = 0.001;

/// The maps whose two gains are knobs of the space, on logarithmic scales; none for a controller without such gains.
pub fn slices<const N: usize>(run: &Run, robot: &Robot, gains: &Pair<Gains>) -> Result<Vec<Slice>, Error> {
    let record = &run.file.record;
    let find = |name: &str| {
        record.space.knobs.iter().find(|knob| knob.name == name && knob.range.scale == Scale::Log && is_its_row(knob))
    };
    let axes: Vec<[&Knob; 2]> = MAPS.iter().filter_map(|[x, y]| Some([find(x)?, find(y)?])).collect();
    if axes.is_empty() {
        return Ok(Vec::new());
    }
    let scenario = &run.file.scenario;
    let task = scenario.bind::<N>(robot).map_err(|error| misfit(robot, scenario, error.into()))?;
    let filter = StabilityFilter::<N>::new(robot, scenario, &task, record.question.search.seed, SAMPLES)?;
    let stable = |gains: &Gains| filter.growth_of(gains, task.step_s).is_some_and(|growth| growth.get() < 0.0);
    // The claim is about gains that all joints share.
    let arms = run.certificates.first().map(|one| family_box(one.certificate.document()));
    let arms = arms.filter(|_| written(&gains.tuned).is_some());
    let slice = |[x, y]: [&Knob; 2]| {
        let place = |gains: &Gains| [x.value(gains), y.value(gains)];
        let cell = |row: usize, column: usize| {
            let at = |index: usize| (index as f64 + 0.5) / CELLS as f64;
            let gains = y.at(x.at(gains.tuned.clone(), x.range.decode(at(column))), y.range.decode(at(row)));
            let stable = stable(&gains);
            (stable, stable && arms.as_ref().is_some_and(|arms| decays(&gains, arms)))
        };
        let row = |row: usize| (0..CELLS).map(|column| cell(row, column)).unzip();
        let (stable, certified): (Vec<Vec<bool>>, Vec<Vec<bool>>) = (0..CELLS).into_par_iter().map(row).unzip();
        Slice {
            x: axis(x),
            y: axis(y),
            stable,
            certified: if arms.is_some() { certified } else { Vec::new() },
            candidates: record.evaluations.iter().map(|evaluation| place(&evaluation.gains)).collect(),
            gains: Pair { published: place(&gains.published), tuned: place(&gains.tuned) },
        }
    };
    Ok(axes.into_iter().map(slice).collect())
}

/// Whether the knob's value is the number of the row of its name, on every joint.
fn is_its_row(knob: &Knob) -> bool {
    let is_one = |unit: &f64| (unit - 1.0).abs() <= 0.0;
    knob.per_unit.len() == 1 && knob.per_unit.get(&knob.name).is_some_and(|units| units.values().iter().all(is_one))
}

fn axis(knob: &Knob) -> SliceAxis {
    SliceAxis {
        gain: knob.name.clone(),
        unit: unit(&knob.name).to_owned(),
        lower: knob.range.lower,
        upper: knob.range.upper,
    }
}

/// The gains of an AIC as the checker reads them; none for others, or where joints differ.
fn written(gains: &Gains) -> Option<AicGains> {
    let Gains::Aic(_) = gains else { return None };
    let number = |row: &str| Some(vec![Number::decimal(gains.row(row).and_then(PerJoint::shared)?)?]);
    Some(AicGains {
        kappa_mu: number("kappa_mu")?,
        kappa_a: number("kappa_a")?,
        sigma_q: number("sigma_q")?,
        sigma_dq: number("sigma_dq")?,
        sigma_mu: number("sigma_mu")?,
        sigma_dmu: number("sigma_dmu")?,
        reference_time_constant_s: number("reference_time_constant_s")?,
    })
}

/// Whether every linearised loop of the arms decays, by exact arithmetic.
fn decays(gains: &Gains, arms: &LoopBox) -> bool {
    let loops = written(gains).and_then(|gains| LoopFamily::new(&gains).ok());
    let rate = Number::decimal(LEAST_RATE_PER_S);
    loops.zip(rate).is_some_and(|(loops, rate)| loops.decays_on(arms, rate.value()).is_ok())
}
