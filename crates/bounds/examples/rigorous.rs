//! Measured figures.
use certune_bounds::rigorous::*;
use certune_bounds::*;
use certune_dynamics::{Model, Robot};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let effort = match args[1].as_str() {
        "quick" => Effort::Quick,
        "standard" => Effort::Standard,
        _ => Effort::Thorough,
    };
    let mut ranges = Ranges { payload_com_m: [0.0, 0.0, 0.307], ..Ranges::nominal() };
    let mut truth = [4.6587, 69.2823, 2.2541];
    for a in &args[2..] {
        match a.as_str() {
            "pay" => {
                ranges.payload_kg = [3.0, 3.0];
                truth = [9.4838, 116.9065, 4.6640];
            }
            "family" => {
                ranges.payload_kg = [0.0, 0.7];
                ranges.mass_uncertainty = 0.2;
            }
            "rotor" => ranges.rotor_inertia_kg_m2 = [0.1, 0.1],
            _ => {}
        }
    }
    let robot = Robot::panda();
    let arms = ArmBox::<7>::new(&Model::new(&robot).unwrap(), &ranges).unwrap();
    let set = if args.iter().any(|a| a == "range") {
        AngleSet::Box {
            lower_rad: std::array::from_fn(|i| robot.links()[i].limits.lower_rad),
            upper_rad: std::array::from_fn(|i| robot.links()[i].limits.upper_rad),
        }
    } else if args.iter().any(|a| a == "task") {
        AngleSet::Box {
            lower_rad: [-1.3, -0.1, -0.3, -2.3, -0.3, 0.9, -0.3],
            upper_rad: [1.3, 0.8, 0.3, -0.9, 0.3, 2.8, 0.3],
        }
    } else {
        AngleSet::AllAngles
    };
    let t = std::time::Instant::now();
    let plan = PolygonPlan::new(&arms, &set, effort).unwrap();
    println!("plan {:.1} s {plan:?}", t.elapsed().as_secs_f64());
    let t = std::time::Instant::now();
    let last = std::sync::Mutex::new(0.0);
    let b = polygon_bounds_with(&arms, &set, &plan, &|x| {
        let mut l = last.lock().unwrap();
        for m in [0.35, 0.49, 0.55, 0.91] {
            if *l < m && x >= m {
                println!("  {m} at {:.1} s", t.elapsed().as_secs_f64());
            }
        }
        if x > *l {
            *l = x;
        }
    })
    .unwrap();
    println!("{b:?}\n{:.1} s", t.elapsed().as_secs_f64());
    println!("ratios {:.4} {:.4} {:.4}", b.m_hi_kg_m2 / truth[0], b.k_g_n_m_per_rad / truth[1], b.k_c_kg_m2 / truth[2]);
    let s = sampled_constants(&arms, &SamplingOptions::default());
    println!("sampled {:?}\n torque {:?}", s.raw, s.raw_gravity_torque_n_m);
    println!(
        "to sampled {:.4} {:.4} {:.4}",
        b.m_hi_kg_m2 / s.raw.m_hi_kg_m2,
        b.k_g_n_m_per_rad / s.raw.k_g_n_m_per_rad,
        b.k_c_kg_m2 / s.raw.k_c_kg_m2
    );
}
