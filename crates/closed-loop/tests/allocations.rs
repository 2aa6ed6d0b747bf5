//! Contract: the loop at 1 kHz does not touch the heap, whatever the task asks of it.
#![expect(
    unsafe_code,
    reason = "a global allocator is unsafe to implement; this one counts and passes on to the system's"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

use certune_closed_loop::scenario::{Noise, PayloadEvent, Push};
use certune_closed_loop::{
    Gains, GainsFile, KnownModel, NoiseStream, Plant, PlantSetting, Progress, Scenario, Simulation,
};
use certune_control::Controller;
use certune_control::aic::{Aic, AicParams};
use certune_control::baseline::{GravityCompensatedPd, PdGains};
use certune_control::mrac::{Mrac, MracParams};
use certune_dynamics::Robot;

/// The system's allocator, counting per thread: other tests and the harness run on their own threads.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is passed on unchanged to the system's allocator, which upholds the contract; the counter neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's obligations are the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations of a whole run, from the first sample to the last; the run must end in time.
fn allocations<C: Controller<7>>(plant: &Plant<7>, scenario: &Scenario, controller: &C) -> usize {
    let task = scenario.bind::<7>(&Robot::panda()).expect("a task for seven joints");
    let mut run = Simulation::new(plant, &task, controller, NoiseStream { seed: 1, index: 0 });
    let before = ALLOCATIONS.get();
    while run.advance(&mut ()) == Progress::Running {}
    let after = ALLOCATIONS.get();
    assert_eq!(run.progress(), Progress::Finished);
    after - before
}

#[test]
fn no_sample_of_any_controller_allocates() {
    let robot = Robot::panda();
    let file = Path::new("pick-and-place.toml");
    let mut scenario = Scenario::parse(file, include_str!("../../../tuning/scenarios/pick-and-place.toml")).unwrap();
    scenario.segments.iter_mut().for_each(|segment| segment.duration_s = 0.5);
    scenario.noise = Noise { q_rad: 1e-5, dq_rad_per_s: 1e-4 };
    let (torque_n_m, flange_force_n) = (Some(vec![1.0; 7]), Some([0.0, 3.0, 0.0]));
    scenario.pushes = vec![
        Push { from_s: 0.2, until_s: 0.9, torque_n_m, flange_force_n: None },
        Push { from_s: 0.7, until_s: 1.1, torque_n_m: None, flange_force_n },
    ];
    let (mass_kg, com_m, about_com_kg_m2) = (0.7, None, [0.0; 6]);
    scenario.payloads = vec![PayloadEvent { mass_kg, com_m, about_com_kg_m2, attach_s: 0.3, release_s: Some(1.2) }];
    let mut setting = PlantSetting::nominal(&robot, true).with_friction(1.0).with_rotor_inertia(0.1).with_delay(1);
    setting.coulomb_n_m.fill(0.5);
    let plant = Plant::<7>::new(&robot, &setting).unwrap();

    let text = include_str!("../../../tuning/presets/pezzato2020-simulation.toml");
    let Gains::Aic(gains) = GainsFile::parse(Path::new("preset"), text).unwrap().gains else { panic!("an AIC preset") };
    let aic = Aic::new(&AicParams::new(&gains.bind().unwrap(), 1e-3).unwrap());
    assert_eq!(allocations(&plant, &scenario, &aic), 0);

    let text = include_str!("../../../tuning/presets/pezzato2020-mrac-robot.toml");
    let Gains::Mrac(gains) = GainsFile::parse(Path::new("preset"), text).unwrap().gains else {
        panic!("an MRAC preset")
    };
    let mrac = Mrac::new(&MracParams::new(&gains.bind().unwrap(), 1e-3).unwrap());
    assert_eq!(allocations(&plant, &scenario, &mrac), 0);

    let gains = PdGains { stiffness_n_m_per_rad: [50.0; 7], damping_n_m_s_per_rad: [15.0; 7] };
    let pd = GravityCompensatedPd::new(&gains, KnownModel(plant.model().clone())).unwrap();
    let uncompensated = Plant::<7>::new(&robot, &PlantSetting { gravity_compensation: false, ..setting }).unwrap();
    assert_eq!(allocations(&uncompensated, &scenario, &pd), 0);
}

#[test]
fn the_counter_counts() {
    let before = ALLOCATIONS.get();
    let kept = std::hint::black_box(vec![1.0_f64; 16]);
    assert!(ALLOCATIONS.get() > before && kept.len() == 16);
}
