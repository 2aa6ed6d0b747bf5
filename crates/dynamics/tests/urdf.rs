//! Contract: a URDF file becomes the arm it describes, or an error that names what is at fault.

use certune_dynamics::{Joints, Model, Robot, RobotError, gravity_torque, mass_matrix};
use proptest::prelude::*;

const BODY: &str = r#"<inertial><origin xyz="0.1 0 0.2" rpy="0.1 0.2 0.3"/><mass value="2"/><inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.025"/></inertial>"#;
const LIMIT: &str = r#"<limit lower="-2" upper="2" effort="50" velocity="3"/>"#;

fn link(name: &str, inertial: &str) -> String {
    format!(r#"<link name="{name}">{inertial}</link>"#)
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, rest: &str) -> String {
    format!(
        r#"<joint name="{name}" type="{kind}"><origin xyz="0 0.1 0.3" rpy="0.2 0 0.5"/><parent link="{parent}"/><child link="{child}"/>{rest}</joint>"#
    )
}

fn robot(elements: &[String]) -> String {
    format!(r#"<robot name="sample">{}</robot>"#, elements.concat())
}

/// base -j1-> one -j2-> two -weld-> tool, and a finger on the tool.
fn arm(change: impl Fn(&mut Vec<String>)) -> String {
    let turning = format!(r#"{LIMIT}<axis xyz="0 1 0"/><dynamics damping="0.5" friction="0.25"/>"#);
    let mut elements = vec![
        link("base", ""),
        link("one", BODY),
        link("two", BODY),
        link("tool", BODY),
        link("pad", BODY),
        joint("j1", "revolute", "base", "one", &turning),
        joint("j2", "revolute", "one", "two", &turning),
        joint("weld", "fixed", "two", "tool", ""),
        joint("left_finger", "prismatic", "tool", "pad", &turning),
    ];
    change(&mut elements);
    robot(&elements)
}

fn refusal(xml: &str, tip: Option<&str>) -> String {
    match Robot::from_urdf_str(xml, tip) {
        Ok(robot) => format!("accepted: {robot:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn welded_and_locked_links_ride_on_the_link_that_moves() {
    let robot = Robot::from_urdf_str(&arm(|_| {}), None).unwrap();
    assert_eq!(robot.name(), "sample");
    assert_eq!(robot.links().iter().map(|l| l.joint_name.as_str()).collect::<Vec<_>>(), ["j1", "j2"]);
    assert!((robot.links()[1].inertia.mass_kg - 6.0).abs() < 1e-15);
    let last = &robot.links()[1];
    assert!((last.viscous_n_m_s_per_rad - 0.5).abs() <= 0.0 && (last.coulomb_n_m - 0.25).abs() <= 0.0);
    assert!((last.limits.torque_n_m - 50.0).abs() <= 0.0 && (last.limits.speed_rad_per_s - 3.0).abs() <= 0.0);
    // The flange is the tool: one joint origin beyond the last moving link, whose frame is turned so that y became z.
    let expected = [0.0, -0.3, 0.1];
    for (have, want) in robot.flange().xyz_m.iter().zip(expected) {
        assert!((have - want).abs() < 1e-15, "{:?}", robot.flange());
    }
}

#[test]
fn a_tip_locks_the_side_branches() {
    let xml = arm(|elements| {
        elements.push(link("other", BODY));
        elements.push(joint("side", "revolute", "one", "other", LIMIT));
    });
    let message = refusal(&xml, None);
    assert!(message.contains("--tip") && message.contains("two") && message.contains("other"), "{message}");
    let robot = Robot::from_urdf_str(&xml, Some("tool")).unwrap();
    assert_eq!(robot.joints(), 2);
    assert!((robot.links()[0].inertia.mass_kg - 4.0).abs() < 1e-15);
    assert_eq!(Robot::from_urdf_str(&xml, Some("other")).unwrap().joints(), 2);
    // Joints beyond the tip are locked as well.
    let short = Robot::from_urdf_str(&arm(|_| {}), Some("one")).unwrap();
    assert_eq!(short.joints(), 1);
    assert!((short.links()[0].inertia.mass_kg - 8.0).abs() < 1e-14);
}

#[test]
fn a_mimic_joint_is_locked() {
    let xml = arm(|elements| {
        elements.push(link("follower", BODY));
        elements.push(joint("copy", "revolute", "tool", "follower", r#"<mimic joint="j1"/>"#));
    });
    let robot = Robot::from_urdf_str(&xml, None).unwrap();
    assert!((robot.links()[1].inertia.mass_kg - 8.0).abs() < 1e-14);
}

#[test]
fn a_continuous_joint_has_no_range_and_an_unstated_effort_no_limit() {
    let xml = arm(|elements| elements[6] = joint("j2", "continuous", "one", "two", r#"<axis xyz="0 0 1"/>"#));
    let limits = Robot::from_urdf_str(&xml, None).unwrap().links()[1].limits;
    assert_eq!(limits, certune_dynamics::JointLimits::NONE);
}

/// An arm about any axis is the arm with that axis along z of a turned frame.
#[test]
fn an_axis_is_a_direction_whatever_its_length() {
    let about = |axis: &str| {
        let rest = format!(r#"{LIMIT}<axis xyz="{axis}"/>"#);
        let xml = arm(|elements| elements[6] = joint("j2", "revolute", "one", "two", &rest));
        let robot = Robot::from_urdf_str(&xml, None).unwrap();
        let model = Model::<2>::new(&robot).unwrap();
        move |q2: f64| {
            let q = Joints::from([0.3, q2]);
            (mass_matrix(&model, &q), gravity_torque(&model, &q))
        }
    };
    for (axis, longer, opposite) in [
        ("0 0 1", "0 0 7", "0 0 -1"),
        ("1 0 0", "2 0 0", "-1 0 0"),
        ("0 -1 0", "0 -0.5 0", "0 1 0"),
        ("1 2 -3", "0.1 0.2 -0.3", "-1 -2 3"),
    ] {
        let ((m, g), (m_long, g_long), (m_back, g_back)) =
            (about(axis)(0.7), about(longer)(0.7), about(opposite)(-0.7));
        assert!((m - m_long).amax() < 1e-14 && (g - g_long).amax() < 1e-13, "{axis}");
        // The opposite axis reverses the joint's sign.
        assert!((m[(0, 1)] + m_back[(0, 1)]).abs() < 1e-14 && (m[(1, 1)] - m_back[(1, 1)]).abs() < 1e-14, "{axis}");
        assert!((g[0] - g_back[0]).abs() < 1e-13 && (g[1] + g_back[1]).abs() < 1e-13, "{axis}");
    }
}

#[test]
fn an_inertia_that_no_body_has_is_refused_by_name() {
    let indefinite = BODY.replace(r#"ixy="0.001""#, r#"ixy="0.05""#);
    let lopsided = BODY.replace(r#"izz="0.025""#, r#"izz="0.3""#);
    let weightless = BODY.replace(r#"value="2""#, r#"value="0""#);
    let negative = BODY.replace(r#"value="2""#, r#"value="-2""#);
    let unknown = BODY.replace(r#"ixx="0.02""#, r#"ixx="nan""#);
    let lost = BODY.replace(r#"xyz="0.1 0 0.2""#, r#"xyz="inf 0 0.2""#);
    for (body, expected) in [
        (indefinite, "not positive definite"),
        (lopsided, "exceeds the sum of the others"),
        (weightless, "no body is like that"),
        (negative, "the mass is -2 kg"),
        (unknown, "an entry of the inertia is NaN"),
        (lost, "entry inf"),
    ] {
        // On a moving link, and on one that would vanish into another by merging.
        for (index, name) in [(2, "two"), (3, "tool"), (4, "pad")] {
            let message = refusal(&arm(|elements| elements[index] = link(name, &body)), None);
            assert!(message.contains(&format!("link `{name}`")) && message.contains(expected), "{message}");
        }
    }
    // A moving link without any mass.
    let message = refusal(&arm(|elements| elements[1] = link("one", "")), None);
    assert!(message.contains("link `one`: the mass is 0 kg"), "{message}");
}

#[test]
fn every_unusable_tree_is_named() {
    let set = |index: usize, element: String| arm(move |elements| elements[index] = element.clone());
    let add = |element: String| arm(move |elements| elements.push(element.clone()));
    let cases = [
        (set(6, joint("j2", "prismatic", "one", "two", LIMIT)), None, "joint `j2` is prismatic"),
        (set(6, joint("j2", "floating", "one", "two", LIMIT)), None, "joint `j2` is floating"),
        (set(6, joint("j2", "planar", "one", "two", LIMIT)), None, "joint `j2` is planar"),
        (set(6, joint("j2", "revolute", "one", "two", "")), None, "link `two`: the joint's range is [0, 0]"),
        (set(6, joint("j2", "hinge", "one", "two", LIMIT)), None, "not a readable URDF"),
        (
            set(6, joint("j2", "revolute", "one", "two", &format!(r#"{LIMIT}<axis xyz="0 0 0"/>"#))),
            None,
            "joint `j2`: the axis is [0.0, 0.0, 0.0]",
        ),
        (
            set(6, joint("j2", "revolute", "one", "two", &format!(r#"{LIMIT}<dynamics damping="-1"/>"#))),
            None,
            "link `two`: the viscous friction in N m s/rad is -1",
        ),
        (set(6, joint("j2", "revolute", "one", "nowhere", LIMIT)), None, "joint `j2` refers to the link `nowhere`"),
        (add(link("one", BODY)), None, "link name `one` occurs twice"),
        (add(joint("j1", "fixed", "one", "two", "")), None, "joint name `j1` occurs twice"),
        (add(joint("j9", "fixed", "base", "two", "")), None, "link `two` is the child of two joints"),
        (add(link("island", BODY)), None, "hang on nothing: [base, island]"),
        (
            arm(|e| {
                e.extend([
                    link("x", ""),
                    link("y", ""),
                    joint("xy", "fixed", "x", "y", ""),
                    joint("yx", "fixed", "y", "x", ""),
                ]);
            }),
            None,
            "form a loop",
        ),
        (arm(|_| {}), Some("hand"), "there is no link `hand` to be the tip; the tree ends in: pad"),
        (arm(|_| {}), Some("base"), "no movable joint lies between `base` and the tip `base`"),
        (robot(&[link("base", "")]), None, "no movable joint"),
        (robot(&[]), None, "hang on nothing: []"),
        (String::from("<robot name='a'><link"), None, "not a readable URDF"),
        (String::from("no markup"), None, "not a readable URDF"),
        (String::new(), None, "not a readable URDF"),
    ];
    for (xml, tip, expected) in cases {
        let message = refusal(&xml, tip);
        assert!(message.contains(expected), "expected `{expected}`, got `{message}`");
    }
}

#[test]
fn more_joints_than_supported_is_an_error() {
    let mut elements = vec![link("l0", "")];
    for i in 0..11 {
        elements.push(link(&format!("l{}", i + 1), BODY));
        elements.push(joint(&format!("j{i}"), "revolute", &format!("l{i}"), &format!("l{}", i + 1), LIMIT));
    }
    assert!(matches!(
        Robot::from_urdf_str(&robot(&elements), None),
        Err(RobotError::TooManyJoints { joints: 11, most: 10, .. })
    ));
    assert_eq!(Robot::from_urdf_str(&robot(&elements), Some("l10")).unwrap().joints(), 10);
}

#[test]
fn a_missing_file_is_named() {
    let message = Robot::from_urdf_file(std::path::Path::new("no/such/arm.urdf"), None).unwrap_err().to_string();
    assert!(message.contains("no/such/arm.urdf"), "{message}");
}

proptest! {
    /// Whatever a damaged file says, the answer is a robot or an error, and a robot is one the recursions can use.
    #[test]
    fn a_damaged_file_never_breaks_the_reader(at in 0_usize..4000, cut in 0_usize..40, with in "[<>/\"'a-z0-9 .=-]{0,6}") {
        let mut xml = arm(|_| {});
        let start = at % xml.len();
        let end = (start + cut).min(xml.len());
        xml.replace_range(start..end, &with);
        if let Ok(robot) = Robot::from_urdf_str(&xml, None)
            && let Ok(model) = Model::<2>::new(&robot)
        {
            let mass = mass_matrix(&model, &Joints::zeros());
            prop_assert!(mass.symmetric_eigenvalues().min() > 0.0, "{}", mass);
        }
    }
}
