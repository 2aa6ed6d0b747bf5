//! Arms small enough to be solved on paper, and boxes that describe nothing.

use std::f64::consts::{FRAC_PI_2, PI};

use certune_bounds::{ArmBox, BoundsError, Ranges, SamplingOptions, sampled_constants};
use certune_dynamics::{Frame, Inertia, JointLimits, Link, Model, Robot};
use certune_linsys::Joints;

const GRAVITY: f64 = 9.81;
/// Climbs end at a relative gain of 1e-9.
const RTOL: f64 = 1e-7;

/// A link of mass `mass_kg` with its centre of mass at `com_m` along x.
fn link(frame: Frame, mass_kg: f64, com_m: f64, about_com_kg_m2: f64) -> Link {
    Link {
        name: "link".into(),
        joint_name: "joint".into(),
        frame,
        inertia: Inertia {
            mass_kg,
            com_m: [com_m, 0.0, 0.0],
            about_com_kg_m2: [about_com_kg_m2, about_com_kg_m2, about_com_kg_m2, 0.0, 0.0, 0.0],
        },
        limits: JointLimits { lower_rad: -PI, upper_rad: PI, speed_rad_per_s: 1.0, torque_n_m: 1.0 },
        rotor_inertia_kg_m2: 0.0,
        viscous_n_m_s_per_rad: 0.0,
        coulomb_n_m: 0.0,
    }
}

/// The first joint's axis is horizontal, so the arm moves in a vertical plane.
fn vertical_plane() -> Frame {
    Frame::from_rpy([0.0; 3], [FRAC_PI_2, 0.0, 0.0])
}

fn assert_close(name: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= RTOL * expected.abs().max(1e-3), "{name}: {found}, expected {expected}");
}

#[test]
fn a_pendulum_has_constant_inertia_and_gravity_stiffness_m_g_l() {
    let (mass, length, about_com) = (2.0, 0.5, 0.03);
    let robot =
        Robot::new("pendulum", [0.0, 0.0, -GRAVITY], vec![link(vertical_plane(), mass, length, about_com)]).unwrap();
    let ranges = Ranges {
        mass_uncertainty: 0.1,
        payload_kg: [0.2, 0.4],
        payload_com_m: [0.8, 0.0, 0.0],
        rotor_inertia_kg_m2: [0.01, 0.05],
    };
    let arm_box = ArmBox::<1>::new(&Model::new(&robot).unwrap(), &ranges).unwrap();
    let found = sampled_constants(&arm_box, &SamplingOptions::new(50, 4, 0.0).unwrap());
    let inertia = about_com + mass * length * length;
    assert_close("m_lo", found.raw.m_lo_kg_m2, 0.9 * inertia + 0.2 * 0.64 + 0.01);
    assert_close("m_hi", found.raw.m_hi_kg_m2, 1.1 * inertia + 0.4 * 0.64 + 0.05);
    let torque = GRAVITY * (1.1 * mass * length + 0.4 * 0.8);
    assert_close("k_g", found.raw.k_g_n_m_per_rad, torque);
    assert_close("gravity torque", found.raw_gravity_torque_n_m[0], torque);
    assert!(found.raw.k_c_kg_m2.abs() < 1e-12 && found.raw.k_r.abs() < 1e-12);
    assert_eq!(found.raw, found.constants, "margin 0");
}

/// Planar arm with two links: `M = [[a + 2 b c2, d + b c2], [., d]]`, `U = g (α sin q1 + β sin(q1 + q2))`.
#[test]
fn a_planar_arm_with_two_links_has_its_textbook_constants() {
    let (m1, m2, l1, c1, c2, i1, i2) = (3.0, 1.5, 0.6, 0.25, 0.3, 0.04, 0.02);
    let elbow = Frame::from_rpy([l1, 0.0, 0.0], [0.0; 3]);
    let links = vec![link(vertical_plane(), m1, c1, i1), link(elbow, m2, c2, i2)];
    let robot = Robot::new("two links", [0.0, 0.0, -GRAVITY], links).unwrap();
    let arm_box = ArmBox::<2>::nominal(&Model::new(&robot).unwrap()).unwrap();
    let found = sampled_constants(&arm_box, &SamplingOptions::new(400, 8, 0.05).unwrap());

    let a = i1 + m1 * c1 * c1 + i2 + m2 * (l1 * l1 + c2 * c2);
    let b = m2 * l1 * c2;
    let d = i2 + m2 * c2 * c2;
    // Eigenvalues of [[p, r], [r, s]].
    let spread = |p: f64, r: f64, s: f64| ((p - s).powi(2) / 4.0 + r * r).sqrt();
    let middle = |p: f64, s: f64| (p + s) / 2.0;
    // The stretched arm is the heaviest, and the one whose lightest direction is lightest.
    let (p, r) = (a + 2.0 * b, d + b);
    assert_close("m_hi", found.raw.m_hi_kg_m2, middle(p, d) + spread(p, r, d));
    let least = (0..=100_000)
        .map(|k| 2.0 * f64::from(k) / 1e5 - 1.0)
        .map(|cos| middle(a + 2.0 * b * cos, d) - spread(a + 2.0 * b * cos, d + b * cos, d))
        .fold(f64::INFINITY, f64::min);
    assert_close("m_lo", found.raw.m_lo_kg_m2, least);
    // dM/dq2 = -b sin q2 [[2, 1], [1, 0]], whose eigenvalue of largest modulus is 1 + sqrt 2; dM/dq1 = 0.
    assert_close("k_c", found.raw.k_c_kg_m2, 0.5 * b * (1.0 + 2.0_f64.sqrt()));
    // |roots| of det(½ b sin q2 [[2, 1], [1, 0]] - k M) = 0, a quadratic in k, largest over q2.
    let relative = (0..=400_000)
        .map(|k| PI * f64::from(k) / 4e5)
        .map(|q2| {
            let t = 0.5 * b * q2.sin();
            let (m11, m12, m22) = (a + 2.0 * b * q2.cos(), d + b * q2.cos(), d);
            // (2t - k m11)(-k m22) - (t - k m12)² = (m11 m22 - m12²) k² + (2 t m12 - 2 t m22) k - t²
            let (qa, qb, qc) = (m11 * m22 - m12 * m12, 2.0 * t * (m12 - m22), -t * t);
            (qb.abs() + (qb * qb - 4.0 * qa * qc).sqrt()) / (2.0 * qa)
        })
        .fold(0.0, f64::max);
    assert_close("k_r", found.raw.k_r, relative);
    let (alpha, beta) = (GRAVITY * (m1 * c1 + m2 * l1), GRAVITY * m2 * c2);
    assert_close("k_g", found.raw.k_g_n_m_per_rad, middle(alpha + beta, beta) + spread(alpha + beta, beta, beta));
    assert_close("gravity torque 1", found.raw_gravity_torque_n_m[0], alpha + beta);
    assert_close("gravity torque 2", found.raw_gravity_torque_n_m[1], beta);
}

/// With the payload hung on the far side of the joint its weight works against the link's: the worst mass is the least one.
#[test]
fn the_worst_payload_may_be_the_lightest() {
    let robot = Robot::new("pendulum", [0.0, 0.0, -GRAVITY], vec![link(vertical_plane(), 2.0, 0.5, 0.03)]).unwrap();
    let ranges = Ranges { payload_kg: [0.1, 1.0], payload_com_m: [-0.4, 0.0, 0.0], ..Ranges::nominal() };
    let arm_box = ArmBox::<1>::new(&Model::new(&robot).unwrap(), &ranges).unwrap();
    let found = sampled_constants(&arm_box, &SamplingOptions::new(50, 4, 0.05).unwrap());
    assert_close("k_g", found.raw.k_g_n_m_per_rad, GRAVITY * (2.0 * 0.5 - 0.1 * 0.4));
    assert_close("scale", found.attained.k_g.scales[1], 0.1);
    assert_close("gravity torque", found.raw_gravity_torque_n_m[0], GRAVITY * (2.0 * 0.5 - 0.1 * 0.4));
}

#[test]
fn a_box_that_describes_nothing_is_refused_with_its_numbers() {
    let robot = Robot::new("pendulum", [0.0, 0.0, -GRAVITY], vec![link(vertical_plane(), 2.0, 0.5, 0.03)]).unwrap();
    let model = Model::<1>::new(&robot).unwrap();
    let refused = |ranges: Ranges| ArmBox::new(&model, &ranges).unwrap_err();
    let nominal = Ranges::nominal();
    for value in [-0.1, 1.0, f64::NAN] {
        assert!(matches!(refused(Ranges { mass_uncertainty: value, ..nominal }), BoundsError::MassUncertainty { .. }));
    }
    for payload_kg in [[1.0, 0.5], [-1.0, 0.5], [0.0, f64::INFINITY], [f64::NAN, 1.0]] {
        assert!(matches!(refused(Ranges { payload_kg, ..nominal }), BoundsError::Payload { .. }));
    }
    assert_eq!(
        refused(Ranges { payload_com_m: [0.0, f64::INFINITY, 0.0], ..nominal }),
        BoundsError::PayloadPosition { axis: 1, value: f64::INFINITY }
    );
    assert_eq!(
        refused(Ranges { rotor_inertia_kg_m2: [0.2, 0.1], ..nominal }),
        BoundsError::RotorInertia { joint: 1, lower: 0.2, upper: 0.1 }
    );
    let arm_box = ArmBox::nominal(&model).unwrap();
    assert_eq!(
        arm_box.model(&[1.0, 1.0], &Joints::zeros()).unwrap_err(),
        BoundsError::Length { given: 2, expected: 1 }
    );
    assert_eq!(arm_box.member(&[0.0]).unwrap_err(), BoundsError::Length { given: 1, expected: 3 });
    assert_eq!(SamplingOptions::new(0, 1, 0.05), Err(BoundsError::Samples));
    for margin in [-0.01, f64::NAN, f64::INFINITY] {
        assert!(matches!(SamplingOptions::new(1, 1, margin), Err(BoundsError::Margin { .. })));
    }
}
