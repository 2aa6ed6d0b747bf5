//! Contract: every recursion agrees with Pinocchio on the committed states, for the built-in Panda and for arms read from URDF.
//!
//! The difference is taken relative to the largest entry of that quantity over all states of that robot.
//! The data and their maker are in `tests/golden/`.
#![expect(clippy::unwrap_used, reason = "a broken golden file fails the test")]

use std::path::PathBuf;

use certune_dynamics::{
    JointMatrix, Joints, Model, Robot, State, coriolis_matrix, coriolis_torque, for_joint_count, forward_dynamics,
    gravity_jacobian, gravity_torque, inverse_dynamics, linearise, mass_matrix,
};
use serde_json::Value;

/// Both sides add a few hundred products of 1e-16 relative rounding.
const RTOL: f64 = 1e-12;
/// The forward dynamics divides by M, whose condition number reaches 1e4.
const FORWARD_RTOL: f64 = 1e-9;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

/// Largest difference and largest entry so far.
#[derive(Default)]
struct Gap {
    difference: f64,
    entry: f64,
}

impl Gap {
    fn see(&mut self, ours: &[f64], golden: &Value) {
        let golden: Vec<f64> = golden.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert_eq!(ours.len(), golden.len());
        for (&a, b) in ours.iter().zip(golden) {
            assert!(a.is_finite() && b.is_finite());
            self.difference = self.difference.max((a - b).abs());
            self.entry = self.entry.max(b.abs());
        }
    }

    fn check(&self, robot: &str, quantity: &str, rtol: f64) {
        let relative = self.difference / self.entry;
        println!("{robot:12} {quantity:24} {relative:.1e}");
        assert!(relative <= rtol, "{robot}, {quantity}: {relative:e} relative to {}", self.entry);
    }
}

fn upper<const N: usize>(matrix: &JointMatrix<N>) -> Vec<f64> {
    (0..N).flat_map(|i| (i..N).map(move |j| matrix[(i, j)])).collect()
}

fn list<const N: usize>(value: &Value) -> Joints<N> {
    Joints::from_iterator(value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()))
}

fn compare<const N: usize>(robot: &Robot, golden: &Value, at_least: usize) {
    let model = Model::<N>::new(robot).unwrap();
    // Pinocchio's quantities are those of rigid links alone.
    let model = model.with_friction(&Joints::zeros(), &Joints::zeros()).with_rotor_inertia(&Joints::zeros());
    let states = golden["states"].as_array().unwrap();
    assert!(states.len() >= at_least, "{} states", states.len());
    let mut gaps: [Gap; 9] = Default::default();
    for golden in states {
        let at = State { q: list::<N>(&golden["q"]), dq: list(&golden["dq"]) };
        let (ddq, tau) = (list(&golden["ddq"]), list(&golden["tau"]));
        gaps[0].see(&upper(&mass_matrix(&model, &at.q)), &golden["mass_matrix"]);
        gaps[1].see((coriolis_matrix(&model, &at) * at.dq).as_slice(), &golden["coriolis"]);
        gaps[2].see(coriolis_torque(&model, &at).as_slice(), &golden["coriolis"]);
        gaps[3].see(gravity_torque(&model, &at.q).as_slice(), &golden["gravity"]);
        gaps[4].see(inverse_dynamics(&model, &at, &ddq).as_slice(), &golden["inverse"]);
        gaps[5].see(&upper(&gravity_jacobian(&model, &at.q)), &golden["gravity_jacobian"]);
        gaps[6].see(forward_dynamics(&model, &at, &tau).as_slice(), &golden["forward"]);
        let linear = linearise(&model, &at, &tau);
        gaps[7].see(linear.ddq.as_slice(), &golden["forward"]);
        let by_matrix = linear.ddq_dtau * (tau - list::<N>(&golden["coriolis"]) - list::<N>(&golden["gravity"]));
        gaps[8].see(by_matrix.as_slice(), &golden["forward"]);
    }
    let names =
        ["M", "C dq (matrix)", "C dq (recursion)", "g", "RNEA", "dg/dq", "ABA", "linearise: ddq", "linearise: M^-1"];
    for (i, (gap, name)) in gaps.iter().zip(names).enumerate() {
        gap.check(robot.name(), name, if i < 6 { RTOL } else { FORWARD_RTOL });
    }
}

fn golden(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder().join(format!("{name}.json"))).unwrap()).unwrap()
}

fn compare_with(robot: &Robot, golden: &Value, at_least: usize) {
    assert_eq!(golden["joints"].as_array().unwrap().len(), robot.joints());
    for (link, joint) in robot.links().iter().zip(golden["joints"].as_array().unwrap()) {
        assert_eq!(link.joint_name, joint.as_str().unwrap());
    }
    for_joint_count!(robot.joints(), N => compare::<N>(robot, golden, at_least)).unwrap();
}

fn compare_urdf(name: &str, at_least: usize) {
    let golden = golden(name);
    let robot = Robot::from_urdf_file(&folder().join(format!("{name}.urdf")), golden["tip"].as_str()).unwrap();
    compare_with(&robot, &golden, at_least);
}

#[test]
fn the_built_in_panda_agrees_with_pinocchio() {
    compare_with(&Robot::panda(), &golden("panda"), 1000);
}

#[test]
fn the_panda_read_from_urdf_agrees_with_pinocchio() {
    compare_urdf("panda", 1000);
}

#[test]
fn a_ur5_agrees_with_pinocchio() {
    compare_urdf("ur5", 100);
}

#[test]
fn a_kinova_with_continuous_joints_and_locked_fingers_agrees_with_pinocchio() {
    compare_urdf("kinova", 100);
}

#[test]
fn an_xarm7_agrees_with_pinocchio() {
    compare_urdf("xarm7", 100);
}

#[test]
fn one_arm_of_a_branching_robot_agrees_with_pinocchio() {
    compare_urdf("baxter_left", 100);
}

/// The files as the package ships them give the same robots as the committed, shortened ones.
#[test]
fn the_full_descriptions_give_the_same_arms_where_the_package_is_present() {
    let Some(package) = std::env::var_os("EXAMPLE_ROBOT_DATA") else {
        println!("skipped: set EXAMPLE_ROBOT_DATA to the package's robots folder");
        return;
    };
    for name in ["panda", "ur5", "kinova", "xarm7", "baxter_left"] {
        let golden = golden(name);
        let tip = golden["tip"].as_str();
        let full =
            Robot::from_urdf_file(&PathBuf::from(&package).join(golden["source"].as_str().unwrap()), tip).unwrap();
        let short = Robot::from_urdf_file(&folder().join(format!("{name}.urdf")), tip).unwrap();
        assert_eq!(full, short, "{name}");
    }
}
