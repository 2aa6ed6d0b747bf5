//! The five constants by sampling all angles and climbing from the best samples.
//!
//! `k = max_q F(q)`, where `F` is the inner maximum over directions and masses at `q` (module `quantity`). Points of a Kronecker
//! sequence cover the torus; from the best ones of each constant a quasi-Newton method climbs. Every reduction is over an ordered list,
//! so the result is the same to the bit for any number of threads. Limits: a lower estimate of the truth (see the head of the crate).

use std::f64::consts::{PI, TAU};

use certune_linsys::Joints;
use rayon::prelude::*;

use crate::arm_box::ArmBox;
use crate::ascent::climb;
use crate::constants::{Attained, Constants, Extremes, SampledConstants, SamplingOptions};
use crate::quantity::{Point, Quantity, Search};
use crate::sequence::Kronecker;

/// Steps of one climb; ten to thirty are usual.
const ITERATIONS: usize = 60;
/// Gravity torques are of degree 1 in every angle: fewer climbs find their maximum.
const TORQUE_STARTS: usize = 16;

/// The constants of a box over all angles, by sampling and local maximisation, widened by the margin of `options`.
///
/// Deterministic, and independent of the number of threads. Runs on the current rayon pool. Under a second for the Panda with the
/// default options on two cores; the cost grows with the number of groups whose scale varies.
///
/// ```
/// use certune_bounds::{ArmBox, Ranges, SamplingOptions, sampled_constants};
/// use certune_dynamics::{Model, Payload, Robot};
/// let robot = Robot::panda();
/// let ranges = Ranges {
///     mass_uncertainty: 0.2,
///     payload_kg: [0.0, 0.7],
///     payload_com_m: Payload::at_grasp(&robot, 0.7)?.com_m,
///     rotor_inertia_kg_m2: [0.0, 0.1],
/// };
/// let arms = ArmBox::<7>::new(&Model::new(&robot)?, &ranges)?;
/// let found = sampled_constants(&arms, &SamplingOptions::default());
/// // Every mass and rotor inertia is at its upper end there.
/// assert!((found.raw.m_hi_kg_m2 - 6.753).abs() < 0.01);
/// assert!(found.constants.m_hi_kg_m2 > 1.049 * found.raw.m_hi_kg_m2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn sampled_constants<const N: usize>(arm_box: &ArmBox<N>, options: &SamplingOptions) -> SampledConstants {
    let search = Search::new(arm_box);
    let quantities: Vec<Quantity> = [
        Quantity::LeastInertia,
        Quantity::GreatestInertia,
        Quantity::GravityStiffness,
        Quantity::Coriolis,
        Quantity::RelativeCoriolis,
    ]
    .into_iter()
    .chain((0..N).map(Quantity::GravityTorque))
    .collect();

    let sequence = Kronecker::new(N);
    let sample = |index: usize| -> Joints<N> { Joints::from_iterator(sequence.point(index).map(|u| TAU * u - PI)) };
    let values: Vec<Vec<f64>> = (0..options.samples())
        .into_par_iter()
        .map(|index| {
            let q = sample(index);
            quantities.iter().map(|quantity| search.evaluate(*quantity, &q, None).value).collect()
        })
        .collect();

    let starts: Vec<(usize, usize)> = quantities
        .iter()
        .enumerate()
        .flat_map(|(which, quantity)| {
            let count = match quantity {
                Quantity::GravityTorque(_) => options.local_starts().min(TORQUE_STARTS),
                Quantity::LeastInertia
                | Quantity::GreatestInertia
                | Quantity::GravityStiffness
                | Quantity::Coriolis
                | Quantity::RelativeCoriolis => options.local_starts(),
            };
            best_indices(&values, which, count.max(1)).into_iter().map(move |index| (which, index))
        })
        .collect();
    let iterations = if options.local_starts() == 0 { 0 } else { ITERATIONS };
    let tops: Vec<(usize, Point<N>)> = starts
        .into_par_iter()
        .map(|(which, index)| {
            let quantity = quantities[which];
            let start = search.evaluate(quantity, &sample(index), None);
            let top = climb(
                start,
                iterations,
                |q, from| search.evaluate(quantity, q, Some(from)),
                |at| search.gradient(quantity, at),
            );
            (which, top)
        })
        .collect();

    let mut best: Vec<Option<Point<N>>> = vec![None; quantities.len()];
    for (which, top) in tops {
        if best[which].as_ref().is_none_or(|held| top.value > held.value) {
            best[which] = Some(top);
        }
    }
    // At least one start per quantity: none is missing.
    let found: Vec<(f64, Attained)> = quantities
        .iter()
        .zip(best.iter().flatten())
        .map(|(quantity, point)| record(&search, *quantity, point))
        .collect();
    assemble(&found, options)
}

/// Indices of the `count` largest values, the largest first, the earlier of equals first; NaN ranks last.
fn best_indices(values: &[Vec<f64>], which: usize, count: usize) -> Vec<usize> {
    let key = |index: usize| {
        let value = values[index][which];
        if value.is_nan() { f64::NEG_INFINITY } else { value }
    };
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| key(*b).total_cmp(&key(*a)).then(a.cmp(b)));
    order.truncate(count);
    order
}

/// The value with its sign as reported, and where it is attained.
fn record<const N: usize>(search: &Search<'_, N>, quantity: Quantity, at: &Point<N>) -> (f64, Attained) {
    let value = match quantity {
        Quantity::LeastInertia => -at.value,
        Quantity::GreatestInertia
        | Quantity::GravityStiffness
        | Quantity::Coriolis
        | Quantity::RelativeCoriolis
        | Quantity::GravityTorque(_) => at.value,
    };
    let attained = Attained {
        q_rad: at.q.iter().map(|angle| wrapped(*angle)).collect(),
        scales: at.scales.clone(),
        rotor_inertia_kg_m2: search.rotor(quantity).iter().copied().collect(),
        direction: at.x.iter().copied().collect(),
        slope_direction: at.y.iter().copied().collect(),
    };
    (value, attained)
}

/// An angle in `[-π, π)`.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// `found` holds the five constants in the order of [`Constants`], then one gravity torque per joint.
fn assemble(found: &[(f64, Attained)], options: &SamplingOptions) -> SampledConstants {
    let value = |i: usize| found[i].0;
    let attained = |i: usize| found[i].1.clone();
    let raw = Constants {
        m_lo_kg_m2: value(0),
        m_hi_kg_m2: value(1),
        k_g_n_m_per_rad: value(2),
        k_c_kg_m2: value(3),
        k_r: value(4),
    };
    let raw_gravity_torque_n_m: Vec<f64> = found[5..].iter().map(|(value, _)| *value).collect();
    SampledConstants {
        constants: raw.widened(options.margin()),
        raw,
        gravity_torque_n_m: raw_gravity_torque_n_m.iter().map(|torque| torque * (1.0 + options.margin())).collect(),
        raw_gravity_torque_n_m,
        margin: options.margin(),
        samples: options.samples(),
        local_starts: options.local_starts(),
        over: "all angles".to_owned(),
        attained: Extremes {
            m_lo: attained(0),
            m_hi: attained(1),
            k_g: attained(2),
            k_c: attained(3),
            k_r: attained(4),
            gravity_torque: found[5..].iter().map(|(_, at)| at.clone()).collect(),
        },
    }
}
