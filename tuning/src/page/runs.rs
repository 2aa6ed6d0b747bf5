//! Runs that are simulated again for their curves: the nominal plant, and the held-out plants.

use certune::closed_loop::{
    Gains, Metrics, NoiseStream, Plant, PlantBox, PlantSetting, Row, Sample, Scenario, Segment, Task, Trajectory,
    simulate,
};
use certune::control::Controller;
use certune::control::aic::{Aic, AicParams, AicState};
use certune::control::mrac::{Mrac, MracParams};
use certune::dynamics::{Joints, Robot};
use certune::report::{
    Bands, CostPart, HeldOut, Pair, PlantRow, Response, SegmentMetrics, SegmentRow, Trajectory as Curves,
};
use certune::tune::score::Parts;
use certune::tune::streams::FIRST_HELD_OUT_PLANT;
use certune::tune::{Batch, Goal, PlantResult, Verdict};
use certune::{ArmGains, StabilityError};
use rayon::prelude::*;

use crate::commands::tune::misfit;
use crate::error::Error;
use crate::run::Run;

/// Samples from one point of a nominal curve to the next.
const CURVE_EVERY: u64 = 10;
/// Samples from one point of a band to the next.
const BAND_EVERY: u64 = 50;

/// What `runs` makes.
pub struct Runs {
    pub response: Response,
    pub segments: Vec<SegmentRow>,
    pub held_out: HeldOut,
    /// Parts of the tuned gains' cost on the nominal plant; none for a cost that is one figure.
    pub cost_parts: Vec<CostPart>,
}

/// One plant in the middle of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Middle {
    pub payload_kg: f64,
    pub friction_n_m_s_per_rad: f64,
    pub rotor_inertia_kg_m2: f64,
}

/// The middle of a box, in decimals that a command line takes.
pub fn middle(plants: &PlantBox) -> Middle {
    let of = |[low, high]: [f64; 2]| (1e6 * 0.5 * (low + high)).round() / 1e6;
    Middle {
        payload_kg: of(plants.payload_kg),
        friction_n_m_s_per_rad: of(plants.friction_n_m_s_per_rad),
        rotor_inertia_kg_m2: of(plants.rotor_inertia_kg_m2),
    }
}

/// The plant in the middle of a box.
fn nominal<const N: usize>(robot: &Robot, plants: &PlantBox) -> Result<Plant<N>, Error> {
    let centre = middle(plants);
    let setting = PlantSetting::nominal(robot, plants.gravity_compensation)
        .with_payload(centre.payload_kg)
        .with_friction(centre.friction_n_m_s_per_rad)
        .with_rotor_inertia(centre.rotor_inertia_kg_m2);
    Ok(Plant::new(robot, &setting)?)
}

/// A function from gains to the largest joint error on that plant over time, s and rad; empty for gains that do not fit.
pub fn largest_error<const N: usize>(
    robot: &Robot,
    scenario: &Scenario,
) -> Result<impl Fn(&Gains) -> Vec<(f64, f64)> + Send + use<N>, Error> {
    let plant = nominal::<N>(robot, &scenario.plant_box)?;
    let task = scenario.bind::<N>(robot).map_err(|error| misfit(robot, scenario, error.into()))?;
    let noise = NoiseStream::default();
    Ok(move |gains: &Gains| {
        let Ok(bound) = ArmGains::<N>::bind(gains) else { return Vec::new() };
        let curves = match bound {
            ArmGains::Aic(gains) => {
                AicParams::new(&gains, task.step_s).map(|of| curves(&plant, &task, &Aic::new(&of), noise, |_| None))
            }
            ArmGains::Mrac(gains) => {
                MracParams::new(&gains, task.step_s).map(|of| curves(&plant, &task, &Mrac::new(&of), noise, |_| None))
            }
        };
        let Ok((Curves { time_s, q_rad, goal_rad, .. }, _)) = curves else { return Vec::new() };
        let largest = |row: usize| {
            let errors = q_rad.iter().zip(&goal_rad).map(|(q, goal)| (q[row] - goal[row]).abs());
            errors.fold(0.0, f64::max)
        };
        time_s.iter().enumerate().map(|(row, t_s)| (*t_s, largest(row))).collect()
    })
}

/// Simulates both sets of gains.
pub fn runs<const N: usize>(run: &Run, robot: &Robot, gains: &Pair<Gains>) -> Result<Runs, Error> {
    let record = &run.file.record;
    let (scenario, question) = (&run.file.scenario, &record.question);
    let seed = question.search.seed;
    let goals = question.goals.for_comparison();
    let batch = Batch::<N>::held_out(robot, scenario, seed, question.held_out_plants)?.with_goals(&goals);
    let nominal = nominal::<N>(robot, &scenario.plant_box)?;
    let noise = NoiseStream { seed, index: 0 };
    let course = |gains: &Gains| course(gains, &nominal, noise, &batch);
    let Course { curves: published, metrics: published_metrics, bands: published_bands, costs: published_costs } =
        course(&gains.published)?;
    let Course { curves: tuned, metrics: tuned_metrics, bands: tuned_bands, costs: tuned_costs } =
        course(&gains.tuned)?;
    let published_costs = recorded(record.held_out.start.as_ref()).unwrap_or(published_costs);
    let tuned_costs = recorded(record.held_out.tuned.as_ref()).unwrap_or(tuned_costs);
    let plants = batch.plants().iter().zip(published_costs.into_iter().zip(tuned_costs));
    let limits = robot.links().iter().map(|link| link.limits.torque_n_m);
    Ok(Runs {
        response: Response {
            joint_names: robot.links().iter().map(|link| link.joint_name.clone()).collect(),
            torque_limit_n_m: if scenario.torque_limits && limits.clone().all(f64::is_finite) {
                limits.collect()
            } else {
                Vec::new()
            },
            runs: Pair { published, tuned },
        },
        cost_parts: match goals.objective {
            Goal::SettlingCost => cost_parts(&tuned_metrics, batch.task()),
            _ => Vec::new(),
        },
        segments: segments(&published_metrics, &tuned_metrics),
        held_out: HeldOut {
            plants: plants
                .map(|((index, _), (published, tuned))| PlantRow {
                    index: index - FIRST_HELD_OUT_PLANT + 1,
                    in_words: in_words(&scenario.plant_box.draw(N, seed, *index)),
                    cost: Pair { published, tuned },
                })
                .collect(),
            bands: Pair { published: published_bands, tuned: tuned_bands },
        },
    })
}

/// The parts of the settling cost over the moves of a run, as shares; none of a run that ran away.
fn cost_parts<const N: usize>(metrics: &Metrics, task: &Task<N>) -> Vec<CostPart> {
    if metrics.diverged_at_s.is_some() {
        return Vec::new();
    }
    let mut previous: Vec<f64> = task.start.iter().copied().collect();
    let mut sums = [("lag", 0.0), ("jitter", 0.0), ("overshoot", 0.0), ("torque limits", 0.0)];
    for segment in &metrics.segments {
        let Parts { lag_s, jitter_s, overshoot_s, saturation_s } = Parts::of(segment, &previous, task.step_s);
        for ((_, sum), part_s) in sums.iter_mut().zip([lag_s, jitter_s, overshoot_s, saturation_s]) {
            *sum += part_s;
        }
        previous.clone_from(&segment.goal_rad);
    }
    let total: f64 = sums.iter().map(|(_, sum)| sum).sum();
    let shares = sums.into_iter().filter(|(_, sum)| *sum > 0.0);
    shares.map(|(name, sum)| CostPart { name: name.to_owned(), share: sum / total }).collect()
}

/// The costs that a verdict holds.
fn recorded(verdict: Option<&Verdict>) -> Option<Vec<Option<f64>>> {
    let cost = |plant: &PlantResult| plant.outcome.cost();
    verdict.map(|verdict| verdict.plants.iter().map(cost).collect())
}

/// What one set of gains does.
struct Course {
    curves: Curves,
    metrics: Metrics,
    bands: Bands,
    costs: Vec<Option<f64>>,
}

fn course<const N: usize>(
    gains: &Gains,
    nominal: &Plant<N>,
    noise: NoiseStream,
    batch: &Batch<N>,
) -> Result<Course, Error> {
    let task = batch.task();
    let bad = |source| Error::Gains { gains: "of the run".to_owned(), source };
    let ((curves, metrics), (bands, costs)) = match ArmGains::<N>::bind(gains).map_err(StabilityError::from)? {
        ArmGains::Aic(gains) => {
            let aic = Aic::new(&AicParams::new(&gains, task.step_s).map_err(bad)?);
            let free_energy = |sample: &Sample<'_, N, AicState<N>>| {
                Some(aic.free_energy(sample.state, &sample.measurement, &sample.goal))
            };
            (curves(nominal, task, &aic, noise, free_energy), held_out(batch, &aic))
        }
        ArmGains::Mrac(gains) => {
            let mrac = Mrac::new(&MracParams::new(&gains, task.step_s).map_err(bad)?);
            (curves(nominal, task, &mrac, noise, |_| None), held_out(batch, &mrac))
        }
    };
    Ok(Course { curves, metrics, bands, costs })
}

/// The nominal run; `free_energy` is read off the controllers that have one.
fn curves<const N: usize, C: Controller<N>>(
    plant: &Plant<N>,
    task: &Task<N>,
    controller: &C,
    noise: NoiseStream,
    free_energy: impl Fn(&Sample<'_, N, C::State>) -> Option<f64>,
) -> (Curves, Metrics) {
    let mut recorder = Trajectory::new(CURVE_EVERY, free_energy);
    let metrics = simulate(plant, task, controller, noise, &mut recorder);
    let rows = recorder.into_rows();
    let series = |value: fn(&Row<N, Option<f64>>) -> &Joints<N>| {
        (0..N).map(|joint| rows.iter().map(|row| value(row)[joint]).collect()).collect()
    };
    let curves = Curves {
        time_s: rows.iter().map(|row| row.t_s).collect(),
        q_rad: series(|row| &row.q),
        goal_rad: series(|row| &row.goal),
        tau_n_m: series(|row| &row.tau),
        free_energy: rows.iter().filter_map(|row| row.diagnostics).collect(),
        diverged_at_s: metrics.diverged_at_s,
    };
    (curves, metrics)
}

/// How a move is called.
pub fn label(index: usize) -> String {
    format!("move {}", index + 1)
}

fn segments(published: &Metrics, tuned: &Metrics) -> Vec<SegmentRow> {
    let count = published.segments.len().max(tuned.segments.len());
    let figures =
        |metrics: &Metrics, index: usize| metrics.segments.get(index).map_or_else(SegmentMetrics::default, figures);
    (0..count)
        .map(|index| SegmentRow {
            label: label(index),
            metrics: Pair { published: figures(published, index), tuned: figures(tuned, index) },
        })
        .collect()
}

fn figures(segment: &Segment) -> SegmentMetrics {
    let largest = |values: &[f64]| values.iter().copied().reduce(f64::max);
    SegmentMetrics {
        settling_time_s: segment.slowest_settling_time_s(),
        final_error_rad: Some(segment.worst_final_error_rad()),
        overshoot: Some(segment.worst_overshoot()),
        peak_torque_n_m: largest(&segment.peak_torque_n_m),
        torque_rate_rms_n_m_per_s: largest(&segment.torque_rate_rms_n_m_per_s),
        saturated_steps: segment.saturated_steps.iter().sum(),
        itae_rad_s2: Some(segment.itae_rad_s2.iter().sum()),
    }
}

/// Bands of the position error over the plants, and each plant's cost.
fn held_out<const N: usize, C: Controller<N> + Sync>(batch: &Batch<N>, controller: &C) -> (Bands, Vec<Option<f64>>) {
    let task = batch.task();
    let one = |(index, plant): &(u64, Plant<N>)| {
        let mut recorder = Trajectory::new(BAND_EVERY, |_: &Sample<'_, N, C::State>| ());
        let metrics = simulate(plant, task, controller, batch.noise(*index), &mut recorder);
        let errors: Vec<f64> = recorder.rows().iter().map(|row| (row.q - row.goal).norm()).collect();
        (errors, batch.scoring().of_run(&metrics).cost())
    };
    let (errors, costs): (Vec<Vec<f64>>, Vec<Option<f64>>) = batch.plants().par_iter().map(one).unzip();
    let samples = errors.iter().map(Vec::len).max().unwrap_or(0);
    let mut bands = Bands::default();
    for sample in 0..samples {
        // A run that has diverged has no error any more: it counts as larger than all others.
        let mut column: Vec<f64> =
            errors.iter().map(|errors| errors.get(sample).copied().unwrap_or(f64::INFINITY)).collect();
        column.sort_by(f64::total_cmp);
        bands.time_s.push(sample as f64 * BAND_EVERY as f64 * task.step_s);
        bands.error_p05_rad.push(quantile(&column, 0.05));
        bands.error_p50_rad.push(quantile(&column, 0.5));
        bands.error_p95_rad.push(quantile(&column, 0.95));
    }
    (bands, costs)
}

/// The smallest of sorted values that the given part of them does not exceed; NaN when it is infinite.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let rank = ((part * sorted.len() as f64).ceil() as usize).max(1);
    sorted.get(rank - 1).copied().filter(|value| value.is_finite()).unwrap_or(f64::NAN)
}

/// A plant in a few words.
pub fn in_words(plant: &PlantSetting) -> String {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    format!(
        "payload {:.2} kg, link masses {:+.0} % on average, friction {:.2} N m s/rad on average",
        plant.payload_kg,
        100.0 * (mean(&plant.link_mass_scale) - 1.0),
        mean(&plant.viscous_n_m_s_per_rad)
    )
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn a_quantile_counts_diverged_runs_as_the_worst() {
        let sorted = [1.0, 2.0, 3.0, f64::INFINITY];
        assert!((quantile(&sorted, 0.05) - 1.0).abs() < 1e-15);
        assert!((quantile(&sorted, 0.5) - 2.0).abs() < 1e-15);
        assert!(quantile(&sorted, 0.95).is_nan() && quantile(&[], 0.5).is_nan());
    }
}
