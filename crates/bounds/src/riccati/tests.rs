//! Tests of the parts against direct computation.
mod explore {
    use crate::riccati::forms::Form;
    use crate::riccati::*;
    use crate::{ArmBox, Ranges};
    use certune_dynamics::{Model, Robot};
    fn env(name: &str, default: f64) -> f64 {
        std::env::var(name).ok().and_then(|s| s.parse().ok()).unwrap_or(default)
    }
    #[test]
    #[ignore]
    fn explore() {
        let rotor = env("ROTOR", 0.0);
        let payload = env("PAY", 0.0);
        let ranges = Ranges {
            rotor_inertia_kg_m2: [rotor, rotor],
            payload_kg: [payload, payload],
            payload_com_m: [0.0, 0.0, 0.307],
            ..Ranges::nominal()
        };
        let arms = ArmBox::<7>::new(&Model::new(&Robot::panda()).unwrap(), &ranges).unwrap();
        let chain = chain::Chain::new(&arms, 1);
        println!("orders {:?}", chain.links.iter().map(|l| l.passage.order).collect::<Vec<_>>());
        let dom = std::env::var("DOM").unwrap_or("torus".into());
        let pi = 3.141_592_653_589_794;
        let set: [[f64; 2]; 7] = match dom.as_str() {
            "torus" => [[-pi, pi]; 7],
            "range" => [
                [-2.8973, 2.8973],
                [-1.7628, 1.7628],
                [-2.8973, 2.8973],
                [-3.0718, -0.0698],
                [-2.8973, 2.8973],
                [-0.0175, 3.7525],
                [-2.8973, 2.8973],
            ],
            _ => [[-1.3, 1.3], [-0.1, 0.8], [-0.3, 0.3], [-2.3, -0.9], [-0.3, 0.3], [0.9, 2.8], [-0.3, 0.3]],
        };
        let mode = env("MODE", 0.0) as usize;
        let k = env("K", 0.001);
        let forms: Vec<Form<7>> = if mode == 0 {
            vec![Form::Inertia([k; 7])]
        } else {
            [1.0, -1.0].map(|sign| Form::Coriolis { joint: mode, k, sign }).to_vec()
        };
        let start = std::time::Instant::now();
        let tally = cover::cover(&chain, &forms, &set, env("BUDGET", 1e5) as u64, &|_| {});
        println!(
            "{dom} rotor {rotor} pay {payload} mode {mode} k {k}: {tally:?} {:.2} s",
            start.elapsed().as_secs_f64()
        );
    }
}

#[test]
#[ignore = "figures"]
fn figures() {
    use crate::rigorous::{AngleSet, Effort};
    use crate::{ArmBox, Ranges, riccati::riccati_bounds};
    use certune_dynamics::{Model, Robot};
    let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|s| s.parse().ok()).unwrap_or(default);
    let (rotor, payload) = (env("ROTOR", 0.0), env("PAY", 0.0));
    let ranges = Ranges {
        mass_uncertainty: env("UNC", 0.0),
        rotor_inertia_kg_m2: [rotor, rotor],
        payload_kg: [env("PAYLO", payload), payload],
        payload_com_m: [0.0, 0.0, 0.307],
    };
    let arms = ArmBox::<7>::new(&Model::new(&Robot::panda()).unwrap(), &ranges).unwrap();
    let dom = std::env::var("DOM").unwrap_or("torus".into());
    let set = match dom.as_str() {
        "torus" => AngleSet::AllAngles,
        "range" => AngleSet::Box {
            lower_rad: [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
            upper_rad: [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        },
        _ => AngleSet::Box {
            lower_rad: [-1.3, -0.1, -0.3, -2.3, -0.3, 0.9, -0.3],
            upper_rad: [1.3, 0.8, 0.3, -0.9, 0.3, 2.8, 0.3],
        },
    };
    let effort = match std::env::var("EFFORT").as_deref() {
        Ok("standard") => Effort::Standard,
        Ok("thorough") => Effort::Thorough,
        _ => Effort::Quick,
    };
    let start = std::time::Instant::now();
    let found = riccati_bounds(&arms, &set, effort, &|_| {}).unwrap();
    println!("{dom} rotor {rotor} pay {payload}: {:.1} s", start.elapsed().as_secs_f64());
    println!(
        "m_lo {} diagonal {:?}\nk {:?} k_r {:.4} k_m {:.4} metric {:?}",
        found.m_lo_kg_m2, found.diagonal_lower_kg_m2, found.k_joint, found.k_r, found.k_m, found.plan.metric_kg_m2
    );
    for c in &found.covers {
        println!("   {:?}", c);
    }
}
