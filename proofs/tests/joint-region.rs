//! `claims/joint-region.md` on the Panda: the gains of the authors' robot controller, retuned joint by joint, gravity compensated, friction 1 to 3
//! N m s/rad, every motor within its limit.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use std::path::Path;

use certune::ArmCertifier;
use certune::bounds::SampledConstants;
use certune::certify::{
    AicGainValues, ArmValues, ConstantValues, JointRegionOptions, Options, Problem, SampledConstantValues, certify,
};
use certune::closed_loop::{Gains, GainsFile};
use certune::dynamics::{Model, Payload, Robot, mass_matrix};
use certune::linsys::Joints;
use certune::verify::{Certificate, Claim, ClaimKind, Grade, Verdict};
use proofs::{nominal_family, stored};

const MOTOR_LIMITS_N_M: [f64; 7] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
/// A to B and B to C of the paper's task; the way back is the same with the other sign.
const STEPS_RAD: [[f64; 7]; 2] = [[1.0, 0.3, 0.0, -1.0, 0.0, 1.3, 0.0], [-1.0, 0.3, 0.0, -0.2, 0.0, 0.4, 0.0]];
/// Proportions of diagonals below and above M, found by a search over many configurations; their size is sampled here.
const LOWER: [f64; 7] = [0.025, 0.183, 0.0067, 0.047, 0.0046, 0.0126, 0.0036];
const UPPER: [f64; 7] = [7.94, 8.31, 3.17, 2.99, 0.128, 0.131, 0.0089];
const SAMPLES: usize = 20_000;

/// Diagonals that hold at `SAMPLES` configurations of a low-discrepancy sequence, widened by a margin.
fn diagonals(model: &Model<7>, margin: f64) -> [Vec<f64>; 2] {
    let scaled = |m: &mut certune::dynamics::JointMatrix<7>, by: [f64; 7]| {
        for i in 0..7 {
            for j in 0..7 {
                m[(i, j)] /= (by[i] * by[j]).sqrt();
            }
        }
        m.symmetric_eigenvalues()
    };
    let steps = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0].map(f64::sqrt);
    let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
    for k in 0..SAMPLES {
        let q = Joints::<7>::from_fn(|i, _| std::f64::consts::TAU * (k as f64 * steps[i]).fract());
        let m = mass_matrix(model, &q);
        least = least.min(scaled(&mut m.clone(), LOWER).min());
        largest = largest.max(scaled(&mut m.clone(), UPPER).max());
    }
    [LOWER.map(|x| x * least / (1.0 + margin)).to_vec(), UPPER.map(|x| x * largest * (1.0 + margin)).to_vec()]
}

fn problem(friction: [f64; 2]) -> Problem {
    let (robot, family) = (Robot::panda(), nominal_family(true, friction));
    let certifier = ArmCertifier::<7>::new(&robot, &family).unwrap();
    let SampledConstants { constants: c, gravity_torque_n_m, margin, samples, .. } = certifier.constants().clone();
    let text = include_str!("../../tuning/presets/pezzato2020-robot.toml");
    let Gains::Aic(table) = GainsFile::parse(Path::new("pezzato2020-robot.toml"), text).unwrap().gains else {
        panic!("the preset is for the AIC")
    };
    let gains = table.bind::<7>().unwrap();
    let arm = ArmValues {
        name: robot.name().to_owned(),
        joints: 7,
        sha256: robot.sha256(),
        payload_com_m: Payload::at_grasp(&robot, 1.0).unwrap().com_m,
    };
    let constants = SampledConstantValues {
        m_lo_kg_m2: c.m_lo_kg_m2,
        m_hi_kg_m2: c.m_hi_kg_m2,
        k_g_n_m_per_rad: c.k_g_n_m_per_rad,
        k_c_kg_m2: c.k_c_kg_m2,
        k_r: c.k_r,
        k_m: None,
        diagonal_kg_m2: Some(diagonals(&Model::new(&robot).unwrap(), margin)),
        gravity_torque_n_m: Some(gravity_torque_n_m),
        margin,
        samples: samples.min(SAMPLES),
        // The diagonals had none.
        local_starts: 0,
    };
    let values = AicGainValues {
        kappa_mu: gains.kappa_mu.to_vec(),
        kappa_a: gains.kappa_a.to_vec(),
        sigma_q: gains.sigma_q.to_vec(),
        sigma_dq: gains.sigma_dq.to_vec(),
        sigma_mu: gains.sigma_mu.to_vec(),
        sigma_dmu: gains.sigma_dmu.to_vec(),
        reference_time_constant_s: gains.reference_time_constant_s.to_vec(),
    };
    Problem::new(&arm, values.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}

fn derived(friction: [f64; 2]) -> Certificate {
    let joint_region = JointRegionOptions {
        motor_limits_n_m: Some(MOTOR_LIMITS_N_M.to_vec()),
        steps_rad: STEPS_RAD.map(Vec::from).to_vec(),
        ..JointRegionOptions::default()
    };
    let options = Options { joint_region, ..Options::default() };
    certify(&problem(friction), &[ClaimKind::JointRegion], &options, &|_| None).unwrap()
}

fn covered_share(certificate: &Certificate) -> f64 {
    match &certificate.document().claims[0].claim {
        Claim::JointRegion(claim) => claim.steps.as_ref().unwrap().covered_share.to_f64(),
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by where an interior-point iteration stops.
const SHARE_SPREAD: f64 = 0.01;

#[test]
fn the_robots_gains_cover_a_share_of_the_papers_steps() {
    let derived = derived([1.0, 3.0]);
    let stored = stored("joint-region", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[0].grade, Some(Grade::Conditional), "sampled constants prove nothing");
        assert!(covered_share(certificate) >= 0.22, "{}", covered_share(certificate));
        // Containment, decay, torque and start of seven joints at two frictions, and two steps.
        assert_eq!(certificate.checked()[0].inequalities.len(), 7 * 2 * 4 + 2);
    }
    assert!((covered_share(&derived) - covered_share(&stored)).abs() <= SHARE_SPREAD);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

#[test]
fn without_friction_the_retuned_wrist_has_no_proof() {
    assert_eq!(derived([0.0, 0.0]).checked()[0].verdict, Verdict::NotProved);
}
