//! The sampled nonlinear claim on the Panda's constants with rotor inertia 0.1 kg m^2.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, Problem, SampledConstantValues, SampledRegionOptions,
    sampled_region,
};
use certune_verify::{Claim, Compensation, sampled_region_inequalities};

#[test]
fn look() {
    for (k, d, c, lim, rate) in [
        (1, [1.0, 1.0], Compensation::Continuous, None, 0.01),
        (1, [1.0, 3.0], Compensation::Held, None, 0.01),
        (0, [1.0, 3.0], Compensation::Held, None, 0.01),
        (2, [1.0, 3.0], Compensation::Held, None, 0.01),
        (1, [0.0, 0.0], Compensation::Continuous, None, 0.01),
        (0, [0.0, 0.0], Compensation::Continuous, None, 0.01),
        (1, [1.0, 1.0], Compensation::Held, Some(87.0), 0.01),
        (1, [1.0, 1.0], Compensation::Held, None, 0.3),
    ] {
        let t = std::time::Instant::now();
        let p = problem(d);
        let claim = sampled_region(
            &p,
            &SampledRegionOptions {
                delay_samples: k,
                compensation: c,
                torque_limit_n_m: lim,
                rate_per_s: rate,
                ..Default::default()
            },
        );
        let s = t.elapsed();
        let t = std::time::Instant::now();
        match &claim {
            Claim::SampledRegion(r) => {
                let n = sampled_region_inequalities(p.document(), r).unwrap().len();
                println!(
                    "{k} {d:?} {c:?} {lim:?} {rate} -> {} rho {} speed {} theta {} in {s:?} check {:?} n {n}",
                    r.radius_rad,
                    r.witness.rho.to_f64(),
                    r.witness.speed.to_f64(),
                    r.witness.theta.to_f64(),
                    t.elapsed()
                );
            }
            other => println!("{other:?} {s:?}"),
        }
    }
}

fn problem(friction: [f64; 2]) -> Problem {
    let joints = 7;
    let arm = ArmValues { name: "panda".into(), joints, sha256: "0".repeat(64), payload_com_m: [0.0; 3] };
    let all = |x: f64| vec![x; joints];
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
        friction_n_m_s_per_rad: friction,
        mass_uncertainty: 0.0,
        payload_kg: [0.0; 2],
        rotor_inertia_kg_m2: [0.1; 2],
    };
    let constants = SampledConstantValues {
        m_lo_kg_m2: 0.1,
        m_hi_kg_m2: 5.0,
        k_g_n_m_per_rad: 70.0,
        k_c_kg_m2: 2.8,
        k_r: 3.1,
        k_m: Some(3.5),
        diagonal_kg_m2: None,
        gravity_torque_n_m: None,
        margin: 0.0,
        samples: 1,
        local_starts: 1,
    };
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}
