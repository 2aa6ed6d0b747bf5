//! The Panda with the gains of the authors' robot, from constants alone.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use std::time::Instant;

use certune_certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, JointRegionOptions, Options, Problem,
    SampledConstantValues, certify, joint_region,
};
use certune_verify::{Claim, ClaimKind, JointRegionClaim, Number, Reason};

const ROBOT: [f64; 7] = [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0];
const MOTOR_LIMITS_N_M: [f64; 7] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
/// A to B and B to C; the way back is the same with the other sign.
const STEPS_RAD: [[f64; 7]; 2] = [[1.0, 0.3, 0.0, -1.0, 0.0, 1.3, 0.0], [-1.0, 0.3, 0.0, -0.2, 0.0, 0.4, 0.0]];

/// Diagonals, Coriolis constant and gravity shares as a search finds them, widened: M within 10 %, k_c by 15 %.
fn constants() -> SampledConstantValues {
    let widened = |values: [f64; 7], share: f64| values.iter().map(|x| x * share).collect::<Vec<_>>();
    SampledConstantValues {
        m_lo_kg_m2: 0.001,
        m_hi_kg_m2: 4.97,
        k_g_n_m_per_rad: 71.0,
        k_c_kg_m2: 2.6,
        k_r: 10.0,
        k_m: None,
        diagonal_kg_m2: Some([
            widened([0.025, 0.183, 0.0067, 0.047, 0.0046, 0.0126, 0.0036], 0.5),
            widened([7.94, 8.31, 3.17, 2.99, 0.128, 0.131, 0.0089], 1.1),
        ]),
        gravity_torque_n_m: Some(vec![0.5, 57.0, 31.0, 23.0, 3.1, 2.9, 0.4]),
        margin: 0.1,
        samples: 1,
        local_starts: 1,
    }
}

fn gains(kappa_a: f64, sigma: [f64; 7], models: [f64; 2]) -> AicGainValues {
    let all = |x: f64| vec![x; 7];
    AicGainValues {
        kappa_mu: all(11.67),
        kappa_a: all(kappa_a),
        sigma_q: sigma.to_vec(),
        sigma_dq: sigma.to_vec(),
        sigma_mu: all(models[0]),
        sigma_dmu: all(models[1]),
        reference_time_constant_s: all(1.0),
    }
}

fn problem(gains: &AicGainValues, compensated: bool, friction: [f64; 2], constants: SampledConstantValues) -> Problem {
    let arm =
        ArmValues { name: "panda".to_owned(), joints: 7, sha256: "0".repeat(64), payload_com_m: [0.0, 0.0, 0.307] };
    let family = FamilyValues {
        gravity_compensation: compensated,
        friction_n_m_s_per_rad: friction,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    Problem::new(&arm, gains.written().unwrap(), &family, &ConstantValues::Sampled(constants)).unwrap()
}

fn robot(friction: [f64; 2]) -> Problem {
    problem(&gains(200.0, ROBOT, [15.0, 30.0]), true, friction, constants())
}

fn limited() -> JointRegionOptions {
    JointRegionOptions {
        motor_limits_n_m: Some(MOTOR_LIMITS_N_M.to_vec()),
        steps_rad: STEPS_RAD.map(Vec::from).to_vec(),
        ..JointRegionOptions::default()
    }
}

fn proved(problem: &Problem, options: &JointRegionOptions) -> JointRegionClaim {
    let start = Instant::now();
    let options = Options { joint_region: options.clone(), ..Options::default() };
    let certificate = certify(problem, &[ClaimKind::JointRegion], &options, &|_| None).unwrap();
    let Claim::JointRegion(claim) = &certificate.document().claims[0].claim else {
        panic!("{}", certificate.document().claims[0].statement)
    };
    let share = claim.steps.as_ref().map(|steps| steps.covered_share.to_string());
    println!("share {share:?} rho {} {:?}", claim.witness.rho.to_f64(), start.elapsed());
    println!("{}", certificate.checked()[0].statement);
    claim.as_ref().clone()
}

fn share(claim: &JointRegionClaim) -> f64 {
    claim.steps.as_ref().unwrap().covered_share.to_f64()
}

#[test]
fn the_robots_gains_cover_a_share_of_the_papers_steps_within_every_motor_limit() {
    assert!(share(&proved(&robot([1.0, 3.0]), &limited())) >= 0.22);
}

#[test]
fn friction_of_each_joint_counts() {
    // The wrist's own friction may be smaller, the base's larger.
    let frictions = [[2.0, 3.0], [2.0, 3.0], [2.0, 3.0], [2.0, 3.0], [1.0, 3.0], [1.0, 3.0], [1.0, 1.0]];
    let own = robot([1.0, 3.0]).with_friction_of_joints(&frictions).unwrap();
    let (own, shared) = (proved(&own, &limited()), proved(&robot([1.0, 3.0]), &limited()));
    assert!(share(&own) > share(&shared));
    assert_eq!(own.witness.joints[6].s.len(), 1);
}

#[test]
fn distances_are_kept_and_a_radius_is_found_without_steps() {
    let options = JointRegionOptions { distances_rad: Some(vec![0.2; 7]), ..JointRegionOptions::default() };
    let claim = proved(&robot([1.0, 3.0]), &options);
    let least = claim.radii_rad.iter().map(Number::to_f64).fold(f64::INFINITY, f64::min);
    assert!((0.1..0.2).contains(&least), "{least}");
}

#[test]
fn gravity_may_act() {
    let uncompensated = problem(&gains(700.0, [1.0; 7], [5.0, 10.0]), false, [1.0, 3.0], constants());
    let claim = proved(&uncompensated, &JointRegionOptions::default());
    assert!(claim.radii_rad.iter().all(|r| r.to_f64() > 0.02));
}

#[test]
fn without_friction_there_is_no_proof_and_without_diagonals_none_is_sought() {
    for (found, expected) in [
        (joint_region(&robot([0.0, 0.0]), &limited()), Reason::Infeasible),
        (
            joint_region(
                &problem(
                    &gains(200.0, ROBOT, [15.0, 30.0]),
                    true,
                    [1.0, 3.0],
                    SampledConstantValues { diagonal_kg_m2: None, ..constants() },
                ),
                &limited(),
            ),
            Reason::ConstantMissing,
        ),
    ] {
        let Claim::NotProved(claim) = found else { panic!("{found:?}") };
        println!("{claim:?}");
        assert_eq!(claim.reason, expected);
    }
}
