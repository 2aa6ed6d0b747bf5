//! Our side of the yardstick: nanoseconds of CPU time per item, one work at a time. `cargo xtask peers` runs it in turn with the peers' programs.
//!
//! | call | prints |
//! |------|--------|
//! | `yardstick WORK` | `WORK NS_PER_ITEM` |
//! | `yardstick operations WORK` | `WORK OPERATIONS_PER_ITEM`, see [`certune_linsys::operations`] |
//! | `yardstick peak` | `peak OPERATIONS_PER_NS` of one core |
//! | `yardstick model` | the arm for Pinocchio's program |
//! | `yardstick mjcf` | the arm for MuJoCo |
//! | `yardstick check` | accelerations in one state, for comparison with Pinocchio's |
//! | `yardstick` | every work once, briefly: it still runs |
//!
//! States are drawn within the joint limits, as on the other side: 512 of them, so that they stay in the cache and no branch is learnt by heart.
#![expect(clippy::unwrap_used, reason = "a program for measuring")]

use std::hint::black_box;
use std::path::Path;

use certune_closed_loop::{
    Bundle, Gains, GainsFile, NoiseStream, Plant, PlantSetting, Run, Scenario, Task, simulate_many_on,
};
use certune_control::aic::{Aic, AicParams};
use certune_control::mrac::{Mrac, MracParams};
use certune_control::{Controller, Measurement};
use certune_dynamics::{
    Joints, Model, Robot, State, forward_dynamics, gravity_torque, inverse_dynamics, linearise, mass_matrix,
};
use certune_linsys::{Counted, operations};
use certune_simd::{InstructionSet, Kernel, Lanes};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rustix::time::{ClockId, clock_gettime};

const STATES: usize = 512;
/// The works of one arm, then the chains of 2 to 28 joints.
const WORKS: [&str; 13] = [
    "closed-loop",
    "closed-loop-avx2",
    "closed-loop-single",
    "aba",
    "rnea",
    "crba",
    "gravity",
    "linearise",
    "aic",
    "mrac",
    "chain-2",
    "chain-7",
    "chain-14",
];

fn cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Nanoseconds per call over about `seconds`.
fn time_ns(seconds: f64, mut work: impl FnMut(usize) -> f64) -> f64 {
    let mut count = 256_usize;
    loop {
        let start = cpu_s();
        let mut sum = 0.0;
        for k in 0..count {
            sum += work(k % STATES);
        }
        black_box(sum);
        let spent = cpu_s() - start;
        if spent > seconds {
            return spent / count as f64 * 1e9;
        }
        count = if spent > 0.03 * seconds { (count as f64 * 1.3 * seconds / spent) as usize + 1 } else { 4 * count };
    }
}

struct Sample {
    at: State<7>,
    ddq: Joints<7>,
    tau: Joints<7>,
}

fn samples(robot: &Robot) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut between =
        |lower: f64, upper: f64| lower + (upper - lower) * (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    let mut draw = |of: &dyn Fn(usize) -> [f64; 2]| {
        Joints::from_fn(|joint, _| {
            let [lower, upper] = of(joint);
            between(lower, upper)
        })
    };
    let limits = |joint: usize| robot.links()[joint].limits;
    (0..STATES)
        .map(|_| Sample {
            at: State {
                q: draw(&|joint| [limits(joint).lower_rad, limits(joint).upper_rad]),
                dq: draw(&|joint| [-limits(joint).speed_rad_per_s, limits(joint).speed_rad_per_s]),
            },
            ddq: draw(&|_| [-5.0, 5.0]),
            tau: draw(&|joint| [-limits(joint).torque_n_m, limits(joint).torque_n_m]),
        })
        .collect()
}

fn published<const N: usize>() -> AicParams<N> {
    AicParams::new(&certune_testkit::PUBLISHED.on_every_joint(), 1e-3).unwrap()
}

/// The task of the peers' programs: 24 s of pick and place from rest in B, on the bare model with the motors' limits.
fn task(robot: &Robot) -> Task<7> {
    let text = include_str!("../../../tuning/scenarios/pick-and-place.toml");
    let mut scenario = Scenario::parse(Path::new("pick-and-place.toml"), text).unwrap();
    scenario.segments.truncate(4);
    scenario.bind(robot).unwrap()
}

/// Nanoseconds of one plant's step in the closed loop.
fn closed_loop_ns(set: InstructionSet, seconds: f64) -> f64 {
    let robot = Robot::panda();
    let task = task(&robot);
    let params = published();
    let plants: Vec<Plant<7>> = (0..set.lanes())
        .map(|lane| {
            // The arms differ, as in a search.
            let mut setting = PlantSetting::nominal(&robot, false);
            setting.link_mass_scale.fill(1.0 - 0.01 * lane as f64);
            Plant::new(&robot, &setting).unwrap()
        })
        .collect();
    let noise = NoiseStream::default();
    let runs: Vec<_> = plants.iter().map(|plant| (Run { plant, task: &task, noise }, &params)).collect();
    let steps: u64 = task.segments.iter().map(|segment| segment.steps).sum();
    let (mut spent, mut done) = (0.0, 0);
    while spent <= seconds {
        let start = cpu_s();
        let metrics = black_box(simulate_many_on(set, &runs));
        spent += cpu_s() - start;
        done += steps * runs.len() as u64;
        assert!(metrics.iter().all(|run| run.worst_final_error_rad() < 0.02), "a run that did not arrive is no run");
    }
    spent / done as f64 * 1e9
}

/// The closed loop on a random chain of `N` joints.
fn chain_ns<const N: usize>(coulomb: bool, seconds: f64) -> f64 {
    let mut runner = TestRunner::deterministic();
    let robot = certune_testkit::serial_arm::<N>().new_tree(&mut runner).unwrap().current();
    let task = Task {
        step_s: 1e-3,
        start: Joints::zeros(),
        segments: vec![certune_closed_loop::task::TaskSegment { goal: Joints::repeat(0.1), steps: 500 }],
        torque_limits: false,
        torque_rate_limit_n_m_per_s: None,
        goal_limiter: None,
        integrator: Default::default(),
        noise: Default::default(),
        payloads: Vec::new(),
        pushes: Vec::new(),
    };
    // Heavy viscous friction: any chain stays where it is. Without Coulomb friction, which only some of the random joints have, the work of a joint is the same in all.
    let mut setting = PlantSetting::nominal(&robot, false).with_friction(50.0).with_rotor_inertia(1.0);
    setting.coulomb_n_m.fill(if coulomb { 0.5 } else { 0.0 });
    let plant = Plant::<N>::new(&robot, &setting).unwrap();
    let params = published::<N>();
    let set = InstructionSet::widest();
    let run = (Run { plant: &plant, task: &task, noise: NoiseStream::default() }, &params);
    let runs = vec![run; set.lanes()];
    let (mut spent, mut done) = (0.0, 0);
    while spent <= seconds {
        let start = cpu_s();
        let metrics = black_box(simulate_many_on(set, &runs));
        spent += cpu_s() - start;
        assert!(metrics.iter().all(|run| run.diverged_at_s.is_none()));
        done += 500 * runs.len();
    }
    spent / done as f64 * 1e9
}

fn step_ns<C: Controller<7>>(controller: &C, seconds: f64, torque: impl Fn(&C::State) -> f64) -> f64 {
    let mut measured = Measurement { q: Joints::zeros(), dq: Joints::zeros() };
    let goal = Joints::repeat(0.3);
    let mut state = controller.start(&measured);
    time_ns(seconds, |_| {
        state = controller.step(&state, &measured, &goal).0;
        measured.q[0] = torque(&state) * 1e-9;
        torque(&state)
    })
}

fn mrac_params() -> MracParams<7> {
    let text = include_str!("../../../tuning/presets/pezzato2020-mrac-simulation.toml");
    let Gains::Mrac(gains) = GainsFile::parse(Path::new("preset"), text).unwrap().gains else {
        unreachable!("an MRAC preset")
    };
    MracParams::new(&gains.bind().unwrap(), 1e-3).unwrap()
}

fn mrac_ns(seconds: f64) -> f64 {
    let mrac = Mrac::<7>::new(&mrac_params());
    let mut measured = Measurement { q: Joints::zeros(), dq: Joints::zeros() };
    let goal = Joints::repeat(0.3);
    let mut state = mrac.start(&measured);
    time_ns(seconds, |_| {
        let (next, u) = mrac.step(&state, &measured, &goal);
        state = next;
        measured.q[0] = u[0] * 1e-9;
        u[0]
    })
}

fn measure(work: &str, seconds: f64) -> Option<f64> {
    let robot = Robot::panda();
    let arm = Model::<7>::new(&robot).unwrap();
    let states = samples(&robot);
    Some(match work {
        "closed-loop" => closed_loop_ns(InstructionSet::widest(), seconds),
        "closed-loop-avx2" if InstructionSet::available().contains(&InstructionSet::Avx2) => {
            closed_loop_ns(InstructionSet::Avx2, seconds)
        }
        "closed-loop-avx2" | "closed-loop-single" => closed_loop_ns(InstructionSet::Plain, seconds),
        "aba" => time_ns(seconds, |k| forward_dynamics(&arm, &states[k].at, &states[k].tau)[0]),
        "rnea" => time_ns(seconds, |k| inverse_dynamics(&arm, &states[k].at, &states[k].ddq)[0]),
        "crba" => time_ns(seconds, |k| mass_matrix(&arm, &states[k].at.q)[(0, 0)]),
        "gravity" => time_ns(seconds, |k| gravity_torque(&arm, &states[k].at.q)[0]),
        "linearise" => time_ns(seconds, |k| linearise(&arm, &states[k].at, &states[k].tau).ddq_dq[(0, 0)]),
        "aic" => step_ns(&Aic::<7>::new(&published()), seconds, |state| state.u[0]),
        "mrac" => mrac_ns(seconds),
        "chain-2" => chain_ns::<2>(false, seconds),
        "chain-4" => chain_ns::<4>(false, seconds),
        "chain-7" => chain_ns::<7>(false, seconds),
        "chain-7-coulomb" => chain_ns::<7>(true, seconds),
        "chain-14" => chain_ns::<14>(false, seconds),
        "chain-28" => chain_ns::<28>(false, seconds),
        _ => return None,
    })
}

/// Twelve chains of multiply-adds, which nothing but the registers holds up.
struct Chains(u32);

impl Kernel for Chains {
    /// Operations, and the chains' ends.
    type Output = (f64, f64);
    #[inline(always)]
    fn run<T: Lanes>(self) -> (f64, f64) {
        const CHAINS: usize = 12;
        // Started apart, so that no two are the same; towards 1, so that none overflows.
        let mut ends = [T::zero(); CHAINS];
        for chain in 0..CHAINS {
            ends[chain] = T::from_f64(black_box(1.0 + chain as f64));
        }
        let (factor, addend) = (T::from_f64(black_box(0.5)), T::from_f64(black_box(0.5)));
        for _ in 0..self.0 {
            for chain in 0..CHAINS {
                ends[chain] = ends[chain].mul_add(factor, addend);
            }
        }
        let mut sum = T::zero();
        for chain in 0..CHAINS {
            sum += ends[chain];
        }
        (2.0 * (CHAINS * T::LANES) as f64 * f64::from(self.0), sum.lane(0))
    }
}

/// Operations per nanosecond of one core on its widest registers: the best of some tries.
fn peak_per_ns() -> f64 {
    let rounds = 2_000_000;
    let once = || {
        let start = cpu_s();
        let (operations, end) = InstructionSet::widest().run(Chains(rounds));
        black_box(end);
        1e-9 * operations / (cpu_s() - start)
    };
    (0..10).map(|_| once()).fold(0.0, f64::max)
}

fn counted<const N: usize>(joints: &Joints<N>) -> Joints<N, Counted> {
    joints.map(Counted)
}

/// Operations of one item of a work.
fn operations_of(work: &str) -> Option<u64> {
    const STEPS: u64 = 1000;
    let robot = Robot::panda();
    let arm = Model::<7, Counted>::pack(&[&Model::new(&robot).unwrap()], |[number]| Counted(number));
    let sample = &samples(&robot)[0];
    let at = State { q: counted(&sample.at.q), dq: counted(&sample.at.dq) };
    let (ddq, tau) = (counted(&sample.ddq), counted(&sample.tau));
    let measured = Measurement { q: at.q, dq: at.dq };
    Some(match work {
        "closed-loop" | "closed-loop-avx2" | "closed-loop-single" => {
            let task = task(&robot);
            let plant = Plant::<7>::new(&robot, &PlantSetting::nominal(&robot, false)).unwrap();
            let controller = Aic::<7, Counted>::new(&published());
            let run = Run { plant: &plant, task: &task, noise: NoiseStream::default() };
            let mut bundle = Bundle::side_by_side(&[run], &controller);
            operations(|| (0..STEPS).for_each(|_| _ = bundle.advance(&mut ()))) / STEPS
        }
        "aba" => operations(|| forward_dynamics(&arm, &at, &tau)),
        "rnea" => operations(|| inverse_dynamics(&arm, &at, &ddq)),
        "crba" => operations(|| mass_matrix(&arm, &at.q)),
        "gravity" => operations(|| gravity_torque(&arm, &at.q)),
        "linearise" => operations(|| linearise(&arm, &at, &tau)),
        "aic" => {
            let controller = Aic::<7, Counted>::new(&published());
            let state = controller.start(&measured);
            operations(|| controller.step(&state, &measured, &ddq))
        }
        "mrac" => {
            let controller = Mrac::<7, Counted>::new(&mrac_params());
            let state = controller.start(&measured);
            operations(|| controller.step(&state, &measured, &ddq))
        }
        _ => return None,
    })
}

/// The arm as numbers: see the program that reads them.
fn model() -> String {
    let robot = Robot::panda();
    let constants = Model::<7>::new(&robot).unwrap().link_constants();
    let mut lines = vec!["7".to_owned()];
    for (link, constants) in robot.links().iter().zip(&constants) {
        let limits = link.limits;
        let numbers = constants.rotation.as_flattened().iter().chain(&constants.position_m);
        let body = [link.inertia.mass_kg].into_iter().chain(link.inertia.com_m).chain(link.inertia.about_com_kg_m2);
        let ends = [limits.lower_rad, limits.upper_rad, limits.speed_rad_per_s, limits.torque_n_m];
        let all: Vec<String> = numbers.copied().chain(body).chain(ends).map(|x| format!("{x:?}")).collect();
        lines.push(all.join(" "));
    }
    lines.join("\n")
}

fn mjcf() -> String {
    let robot = Robot::panda();
    let constants = Model::<7>::new(&robot).unwrap().link_constants();
    let list = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
    let mut bodies = String::new();
    for (index, (link, constants)) in robot.links().iter().zip(&constants).enumerate() {
        let r = &constants.rotation;
        // Columns of the rotation are the frame's axes.
        let axes = list(&[r[0][0], r[1][0], r[2][0], r[0][1], r[1][1], r[2][1]]);
        bodies += &format!(
            "<body pos=\"{}\" xyaxes=\"{axes}\"><inertial pos=\"{}\" mass=\"{:?}\" fullinertia=\"{}\"/><joint name=\"j{index}\" axis=\"0 0 1\"/>\n",
            list(&constants.position_m),
            list(&link.inertia.com_m),
            link.inertia.mass_kg,
            list(&link.inertia.about_com_kg_m2),
        );
    }
    let ends = "</body>".repeat(robot.joints());
    format!("<mujoco><compiler angle=\"radian\"/><worldbody>\n{bodies}{ends}</worldbody></mujoco>")
}

fn check() -> String {
    let arm = Model::<7>::new(&Robot::panda()).unwrap();
    let spaced = |from: f64, to: f64| Joints::<7>::from_fn(|joint, _| from + (to - from) * joint as f64 / 6.0);
    let ddq = forward_dynamics(&arm, &State { q: spaced(0.1, 0.7), dq: spaced(0.3, -0.3) }, &spaced(2.0, -1.0));
    ddq.iter().fold("check".to_owned(), |text, x| text + &format!(" {x:.17e}"))
}

fn main() {
    const SECONDS: f64 = 0.3;
    let work = std::env::args().nth(1).filter(|word| !word.starts_with('-'));
    match work.as_deref() {
        Some("model") => println!("{}", model()),
        Some("mjcf") => println!("{}", mjcf()),
        Some("check") => println!("{}", check()),
        Some("peak") => println!("peak {:.2}", peak_per_ns()),
        Some("operations") => {
            let work = std::env::args().nth(2).unwrap_or_default();
            println!("{work} {}", operations_of(&work).map_or_else(|| "unknown".to_owned(), |count| count.to_string()));
        }
        Some(work) => match measure(work, SECONDS) {
            Some(ns) => println!("{work} {ns:.2}"),
            None => {
                eprintln!("no such work: {work}");
                std::process::exit(2);
            }
        },
        None => {
            for work in WORKS {
                println!("{work} {:.0}", measure(work, 1e-3).unwrap_or(f64::NAN));
            }
        }
    }
}
