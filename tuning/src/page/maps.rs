//! Where loops are stable: maps over two gains each, with the others as tuned.
//!
//! The filter of the search looks at every cell, on fewer samples; of those whose loops decay, the certifier is asked about a coarser grid.

use certune::bounds::SearchOptions;
use certune::closed_loop::Gains;
use certune::dynamics::Robot;
use certune::report::{Pair, Slice, SliceAxis};
use certune::tune::{Knob, Scale, StabilityFilter};
use certune::verify::ClaimKind;
use certune::{ArmCertifier, ArmGains, Effort, Over, family_of};
use rayon::prelude::*;

use super::unit;
use crate::catalogue;
use crate::commands::tune::misfit;
use crate::error::Error;
use crate::run::Run;

/// The gains of the maps, horizontal and vertical.
const MAPS: [[&str; 2]; 3] = [["kappa_a", "sigma_dq"], ["kappa_mu", "sigma_mu"], ["kappa_a", "kappa_mu"]];
/// Cells on a side, for the filter and for the certifier.
const STABLE_CELLS: usize = 24;
const CERTIFIED_CELLS: usize = 12;
/// Samples of the filter: a cell takes two eigenvalue problems each.
const SAMPLES: usize = 6;

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
    let certifier = ArmCertifier::<N>::new(robot, &family_of(&scenario.plant_box)?)?
        .with_records(&catalogue::records(&[])?, &Over::AllAngles)?;
    // Nobody reads the counterexample of a cell.
    let counterexample = SearchOptions { samples: 1, local_starts: 0, ..Effort::default().counterexample };
    let effort = Effort { counterexample, ..Effort::default() };
    let certified = |gains: &Gains| match ArmGains::<N>::bind(gains) {
        Ok(ArmGains::Aic(gains)) => certifier
            .certify_with(&gains, &[ClaimKind::Exponential], &effort)
            .is_ok_and(|certificate| certificate.all_hold()),
        Ok(ArmGains::Mrac(_)) | Err(_) => false,
    };
    // The claim is about gains that all joints share.
    let is_claimed = ArmGains::<N>::bind(&gains.tuned).is_ok_and(|gains| gains.are_shared());
    let slice = |[x, y]: [&Knob; 2]| {
        let place = |gains: &Gains| [x.value(gains), y.value(gains)];
        let cell = |count: usize, row: usize, column: usize| {
            let at = |index: usize| (index as f64 + 0.5) / count as f64;
            y.at(x.at(gains.tuned.clone(), x.range.decode(at(column))), y.range.decode(at(row)))
        };
        let grid = |count: usize, holds: &(dyn Fn(&Gains) -> bool + Sync)| -> Vec<Vec<bool>> {
            let row = |row: usize| (0..count).map(|column| holds(&cell(count, row, column))).collect();
            (0..count).into_par_iter().map(row).collect()
        };
        Slice {
            x: axis(x),
            y: axis(y),
            stable: grid(STABLE_CELLS, &stable),
            certified: if is_claimed {
                grid(CERTIFIED_CELLS, &|gains| stable(gains) && certified(gains))
            } else {
                Vec::new()
            },
            candidates: record.evaluations.iter().map(|evaluation| place(&evaluation.gains)).collect(),
            gains: Pair { published: place(&gains.published), tuned: place(&gains.tuned) },
        }
    };
    Ok(axes.into_iter().map(slice).collect())
}

/// Whether the knob's value is the number of the row of its name, on every joint.
fn is_its_row(knob: &Knob) -> bool {
    let one = |unit: &f64| (unit - 1.0).abs() <= 0.0;
    knob.per_unit.len() == 1 && knob.per_unit.get(&knob.name).is_some_and(|units| units.values().iter().all(one))
}

fn axis(knob: &Knob) -> SliceAxis {
    SliceAxis {
        gain: knob.name.clone(),
        unit: unit(&knob.name).to_owned(),
        lower: knob.range.lower,
        upper: knob.range.upper,
    }
}
