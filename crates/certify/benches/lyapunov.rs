//! Time of a claim, candidate and exact check, one work at a time. `cargo xtask peers` runs the first three, the third beside a general solver.
//!
//! | call | prints |
//! |------|--------|
//! | `lyapunov certificate` | ms of CPU time: one loop of 42 states decays, mean over configurations |
//! | `lyapunov thousand` | s of wall-clock time: the same for 1,000 configurations, on two threads |
//! | `lyapunov common-matrix` | s of CPU time: two loops of 42 states decay under one matrix |
//! | `lyapunov fastest-decay` | ms of CPU time: the fastest decay of one loop of 42 states |
//! | `lyapunov region` | ms of CPU time: the order-6 region of the nonlinear loop |
//! | `lyapunov matrices` | the rate and the two loops of `common-matrix`, for the general solver |
//! | `lyapunov` | every work briefly: it still runs |
//!
//! A figure is printed only if every claim of the work was proved. CPU time is that of all threads of the process.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, LinearFamily, LyapunovMatrix, Problem, RegionOptions,
    SampledConstantValues, fastest_decay, lyapunov, region,
};
use certune_closed_loop::linearise_aic;
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::{Joints, Model, Robot};
use certune_verify::{Claim, PlaneRegion};
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;
use rustix::time::{ClockId, clock_gettime};

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// The authors' robot, joint by joint; the slowest eigenvalue decays at about 0.3227 per s.
const SIGMA: [f64; 7] = [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0];
const RATE_PER_S: &str = "0.3";
const GOAL_RAD: [f64; 7] = [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0];
const THREADS: usize = 2;

/// What a work does: its name, how many claims when it is measured, and how many when it is only run.
const WORKS: [(&str, usize, usize); 5] = [
    ("certificate", 100, 1),
    ("thousand", 1000, 4),
    ("common-matrix", 3, 1),
    ("fastest-decay", 20, 1),
    ("region", 5, 1),
];

fn closed_loop(q_rad: [f64; 7]) -> Outcome<DMatrix<f64>> {
    let gains = AicGains {
        kappa_mu: [11.67; 7],
        kappa_a: [200.0; 7],
        sigma_q: SIGMA,
        sigma_dq: SIGMA,
        sigma_mu: [15.0; 7],
        sigma_dmu: [30.0; 7],
        reference_time_constant_s: [1.0; 7],
    };
    let arm = Model::<7>::new(&Robot::panda())?.with_friction(&Joints::repeat(1.0), &Joints::zeros());
    Ok(linearise_aic(&arm, &Joints::from(q_rad), &AicParams::new(&gains, 1e-3)?, true)?.matrix().clone())
}

/// Loops in configurations drawn evenly within the joint limits.
fn loops(count: usize) -> Outcome<Vec<LinearFamily>> {
    let robot = Robot::panda();
    let mut rng = ChaCha8Rng::seed_from_u64(42);
    let mut share = || (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    let mut draw = || {
        std::array::from_fn(|joint| {
            let limits = robot.links()[joint].limits;
            limits.lower_rad + (limits.upper_rad - limits.lower_rad) * share()
        })
    };
    (0..count)
        .map(|_| {
            let q_rad = draw();
            Ok(LinearFamily { vertices: vec![closed_loop(q_rad)?], configuration_rad: Some(q_rad.to_vec()) })
        })
        .collect()
}

/// Two loops, the second and fourth joint 0.2 rad to either side.
fn pair() -> Outcome<LinearFamily> {
    let shifted = |by: f64| {
        let mut q_rad = GOAL_RAD;
        q_rad[1] += by;
        q_rad[3] -= by;
        closed_loop(q_rad)
    };
    Ok(LinearFamily { vertices: vec![shifted(-0.2)?, shifted(0.2)?], configuration_rad: None })
}

fn half_plane() -> Outcome<[PlaneRegion; 1]> {
    Ok([PlaneRegion::HalfPlane { rate_per_s: RATE_PER_S.parse()? }])
}

/// The published simulation gains, gravity compensated.
fn problem() -> Outcome<Problem> {
    let all = |x: f64| vec![x; 7];
    let gains = AicGainValues {
        kappa_mu: all(11.67),
        kappa_a: all(700.0),
        sigma_q: all(1.0),
        sigma_dq: all(1.0),
        sigma_mu: all(5.0),
        sigma_dmu: all(10.0),
        reference_time_constant_s: all(1.0),
    };
    let family = FamilyValues {
        gravity_compensation: true,
        friction_n_m_s_per_rad: [1.0, 3.0],
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    let constants = SampledConstantValues {
        m_lo_kg_m2: 0.0044,
        m_hi_kg_m2: 4.659,
        k_g_n_m_per_rad: 69.28,
        k_c_kg_m2: 2.254,
        k_r: 4.962,
        k_m: None,
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin: 0.1,
        samples: 1,
        local_starts: 1,
    };
    let arm =
        ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0, 0.0, 0.307] };
    Ok(Problem::new(&arm, gains.written()?, &family, &ConstantValues::Sampled(constants))?)
}

fn cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Seconds of CPU time for each of `count` claims.
fn mean_cpu_s(count: usize, mut work: impl FnMut(usize) -> Outcome<()>) -> Outcome<f64> {
    let start = cpu_s();
    for k in 0..count {
        work(k)?;
    }
    Ok((cpu_s() - start) / count as f64)
}

/// The figure of a work, in the unit of the table.
fn measure(work: &str, count: usize) -> Outcome<f64> {
    let (common, regions) = (LyapunovMatrix::Common, half_plane()?);
    let certified = |family: &LinearFamily| -> Outcome<()> {
        black_box(lyapunov(black_box(family), &regions, common)?);
        Ok(())
    };
    match work {
        "certificate" => {
            let loops = loops(count)?;
            Ok(1e3 * mean_cpu_s(count, |k| certified(&loops[k]))?)
        }
        "thousand" => {
            let loops = loops(count)?;
            let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build()?;
            let start = Instant::now();
            pool.install(|| loops.par_iter().try_for_each(certified))?;
            Ok(start.elapsed().as_secs_f64())
        }
        "common-matrix" => {
            let pair = pair()?;
            mean_cpu_s(count, |_| certified(&pair))
        }
        "fastest-decay" => {
            let loops = loops(count)?;
            let fastest = |k: usize| {
                black_box(fastest_decay(&loops[k], common)?);
                Ok(())
            };
            Ok(1e3 * mean_cpu_s(count, fastest)?)
        }
        "region" => {
            let (problem, options) = (problem()?, RegionOptions::default());
            let proved = |_| match black_box(region(black_box(&problem), &options)) {
                Claim::Region(_) => Ok(()),
                _ => Err("the region was not proved".into()),
            };
            Ok(1e3 * mean_cpu_s(count, proved)?)
        }
        _ => Err(format!("no such work: {work}").into()),
    }
}

/// The rate and the matrices as numbers: see the program that reads them.
fn matrices() -> Outcome<String> {
    let pair = pair()?;
    let mut lines = vec![format!("{RATE_PER_S} {} {}", pair.vertices.len(), pair.vertices[0].nrows())];
    for row in pair.vertices.iter().flat_map(DMatrix::row_iter) {
        lines.push(row.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" "));
    }
    Ok(lines.join("\n"))
}

fn main() -> Outcome<()> {
    let word = std::env::args().nth(1).filter(|word| !word.starts_with('-'));
    match word.as_deref() {
        Some("matrices") => println!("{}", matrices()?),
        Some(work) => {
            let count = WORKS.iter().find(|(name, ..)| *name == work).map_or(0, |&(_, count, _)| count);
            println!("{work} {:.3}", measure(work, count)?);
        }
        None => {
            for (work, _, few) in WORKS {
                println!("{work} {:.3}", measure(work, few)?);
            }
        }
    }
    Ok(())
}
