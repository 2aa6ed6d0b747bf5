//! What one step of a controller costs: operations, counted on a scalar that counts them, and time, measured on this machine.
//!
//! A vector sum of N joints is N additions, a product of a number and a vector N multiplications, so counts over N are what the paper calls vector sums and scalar-vector products.

use std::hint::black_box;
use std::time::Instant;

use certune_control::aic::{Aic, AicGains, AicParams, AicState};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams, MracState};
use certune_control::{Controller, Measurement};
use certune_linsys::{Counted, Joints, Real, operations_by_kind};

use crate::error::CompareError;
use crate::record::{StepCost, StepTime};
use crate::statistics::quantile;

/// Sampling step, s.
const STEP_S: f64 = 1e-3;
/// Steps of one measurement.
const STEPS: u32 = 2000;

/// Numbers in the place of gains: neither counts nor times depend on them.
fn aic<const N: usize>() -> Result<AicParams<N>, CompareError> {
    let gains = AicGains {
        kappa_mu: [11.67; N],
        kappa_a: [700.0; N],
        sigma_q: [1.0; N],
        sigma_dq: [1.0; N],
        sigma_mu: [5.0; N],
        sigma_dmu: [10.0; N],
        reference_time_constant_s: [1.0; N],
    };
    Ok(AicParams::new(&gains, STEP_S)?)
}

fn mrac<const N: usize>(law: MracLaw) -> Result<MracParams<N>, CompareError> {
    let one = [[1.0; N], [0.1; N], [0.0; N]];
    let gains = MracGains {
        law,
        omega_rad_per_s: [2.0; N],
        zeta: [1.0; N],
        l1: [1.0; N],
        l2: [1.0; N],
        alpha: one,
        e0: one,
        e1: one,
        f0: one,
        f1: one,
    };
    Ok(MracParams::new(&gains, STEP_S)?)
}

/// A measurement and a goal that are neither zero nor equal.
fn situation<const N: usize, T: Real>() -> (Measurement<N, T>, Joints<N, T>) {
    let number = |scale: f64| Joints::<N, T>::from_fn(|joint, _| T::from_f64(scale * (1.0 + joint as f64 / N as f64)));
    (Measurement { q: number(0.3), dq: number(0.1) }, number(0.5))
}

/// The operations of a step that is not the first.
fn counted<const N: usize, C: Controller<N, Counted>>(controller: &C, name: &str, state_numbers: usize) -> StepCost {
    let (measurement, goal) = situation::<N, Counted>();
    let mut state = controller.start(&measurement);
    controller.advance(&mut state, &measurement, &goal);
    let done = operations_by_kind(|| controller.advance(&mut state, &measurement, &goal));
    StepCost {
        controller: name.to_owned(),
        joints: N,
        additions: done.additions,
        multiplications: done.multiplications,
        others: done.others,
        state: state_numbers,
    }
}

/// Median over batches of the time of a step, ns.
fn measured<const N: usize, C: Controller<N>>(controller: &C, name: &str, batches: usize) -> StepTime {
    let (measurement, goal) = situation::<N, f64>();
    let mut state = controller.start(&measurement);
    let batch = |_| {
        let begun = Instant::now();
        for _ in 0..STEPS {
            black_box(controller.advance(&mut state, black_box(&measurement), &goal));
        }
        begun.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
    };
    let times: Vec<f64> = (0..batches).map(batch).collect();
    StepTime { controller: name.to_owned(), joints: N, median_ns: quantile(&times, 0.5).unwrap_or(0.0) }
}

fn at<const N: usize>(
    batches: usize,
    costs: &mut Vec<StepCost>,
    times: &mut Vec<StepTime>,
) -> Result<(), CompareError> {
    let number = size_of::<f64>();
    let aic = aic::<N>()?;
    costs.push(counted(&Aic::<N, Counted>::new(&aic), "aic", size_of::<AicState<N>>() / number));
    times.push(measured(&Aic::<N>::new(&aic), "aic", batches));
    for law in MracLaw::ALL {
        let mrac = mrac::<N>(law)?;
        // The last sample is kept for derivative terms alone, which the published gains do not have.
        let integrals = N + 4 * N * N;
        let reference = if law == MracLaw::ReferenceModel { 2 * N } else { 0 };
        debug_assert!(size_of::<MracState<N>>() / number >= integrals + reference);
        let name = format!("mrac-{}", law.name());
        costs.push(counted(&Mrac::<N, Counted>::new(&mrac), &name, integrals + reference));
        times.push(measured(&Mrac::<N>::new(&mrac), &name, batches));
    }
    Ok(())
}

/// Counts and times for 1 to 28 joints.
pub(crate) fn cost(batches: usize) -> Result<(Vec<StepCost>, Vec<StepTime>), CompareError> {
    let (mut costs, mut times) = (Vec::new(), Vec::new());
    at::<1>(batches, &mut costs, &mut times)?;
    at::<2>(batches, &mut costs, &mut times)?;
    at::<4>(batches, &mut costs, &mut times)?;
    at::<7>(batches, &mut costs, &mut times)?;
    at::<14>(batches, &mut costs, &mut times)?;
    at::<28>(batches, &mut costs, &mut times)?;
    Ok((costs, times))
}
