//! An arm of one's own, written down link by link: checked, simulated, and its gains certified.
//!
//! `cargo run --release -p examples --example 06_your_own_arm`

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use certune::closed_loop::{NoiseStream, Plant, PlantBox, PlantSetting, Scenario, simulate};
use certune::control::aic::{Aic, AicGains, AicParams};
use certune::dynamics::{Frame, GRAVITY_M_PER_S2, Inertia, JointLimits, Link, Robot, RobotError};
use certune::verify::ClaimKind;
use certune::{ArmCertifier, family_of};
use certune_testkit::PUBLISHED;

/// A link: a tube of `mass_kg` along x of its frame, `length_m` long and 8 cm thick.
fn tube(name: &str, frame: Frame, mass_kg: f64, length_m: f64) -> Link {
    let (about, across) = (0.5 * mass_kg * 0.04 * 0.04, mass_kg * (length_m * length_m / 12.0 + 0.04 * 0.04 / 4.0));
    Link {
        name: name.to_owned(),
        joint_name: format!("{name}_joint"),
        frame,
        inertia: Inertia {
            mass_kg,
            com_m: [0.5 * length_m, 0.0, 0.0],
            about_com_kg_m2: [about, across, across, 0.0, 0.0, 0.0],
        },
        limits: JointLimits { lower_rad: -2.0, upper_rad: 2.0, speed_rad_per_s: 3.0, torque_n_m: 80.0 },
        rotor_inertia_kg_m2: 0.02,
        viscous_n_m_s_per_rad: 1.0,
        coulomb_n_m: 0.0,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    // Waist, shoulder, elbow. Each frame is the joint's in the link before, at zero; the joint turns about its z.
    let links = vec![
        tube("waist", Frame::from_rpy([0.0, 0.0, 0.2], [0.0; 3]), 3.0, 0.1),
        tube("upper_arm", Frame::from_rpy([0.1, 0.0, 0.1], [FRAC_PI_2, 0.0, 0.0]), 2.0, 0.35),
        tube("forearm", Frame::from_rpy([0.35, 0.0, 0.0], [0.0; 3]), 1.2, 0.3),
    ];
    let robot = Robot::new("mine", GRAVITY_M_PER_S2, links.clone())?;

    // What no body can be is refused, with the link's name and the numbers.
    let mut broken = links;
    broken[1].inertia.about_com_kg_m2[0] = 1.0;
    let error = Robot::new("mine", GRAVITY_M_PER_S2, broken).err().ok_or("an impossible link was accepted")?;
    println!("a mistyped inertia: {error}\n");
    assert!(matches!(error, RobotError::TriangleInequality { link, .. } if link == "upper_arm"));

    // Out, to the mirror image and back, on arms whose links may weigh 10 % more or less; the arm holds up its own weight.
    let family = PlantBox {
        mass_uncertainty: 0.1,
        friction_n_m_s_per_rad: [1.0, 2.0],
        rotor_inertia_kg_m2: [0.02, 0.02],
        ..PlantBox::nominal(true)
    };
    let scenario = Scenario::generic(&robot, family);
    let gains = AicGains { kappa_a: [300.0; 3], ..PUBLISHED.on_every_joint() };
    let plant = Plant::<3>::new(&robot, &PlantSetting::nominal(&robot, true))?;
    let controller = Aic::new(&AicParams::new(&gains, scenario.step_s)?);
    let metrics = simulate(&plant, &scenario.bind(&robot)?, &controller, NoiseStream::default(), &mut ());
    for segment in &metrics.segments {
        let (goal, error_mrad) = (&segment.goal_rad, 1e3 * segment.worst_final_error_rad());
        println!("goal {goal:.2?} rad: {error_mrad:.2} mrad off after {} s", segment.duration_s);
    }
    assert_eq!((metrics.diverged_at_s, metrics.saturated_steps()), (None, 0));
    assert!(metrics.worst_final_error_rad() < 5e-3);

    let certifier = ArmCertifier::<3>::new(&robot, &family_of(&scenario.plant_box)?)?;
    let certificate = certifier.certify(&gains, &[ClaimKind::Exponential, ClaimKind::Region])?;
    for claim in certificate.checked() {
        println!("\n{}: {}", claim.kind.name(), claim.statement);
    }
    assert!(certificate.all_hold());
    Ok(())
}
