//! The adaptive gains of the published simulation gains drift as the arm goes round its goals: integrals that never leak.

use certune_closed_loop::gain_drift;
use certune_control::mrac::{MracGains, MracLaw, MracParams};
use certune_dynamics::{Model, Robot};
use certune_linsys::Joints;

const GOALS: [[f64; 7]; 3] =
    [[1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0], [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0], [-1.0, 0.5, 0.0, -1.2, 0.0, 1.6, 0.0]];

#[test]
fn gains_grow_with_every_round_and_the_error_still_converges() {
    let zeros = [0.0; 7];
    let gains = MracGains::<7> {
        law: MracLaw::ReferenceModel,
        omega_rad_per_s: [2.0; 7],
        zeta: [1.0; 7],
        l1: [1.0; 7],
        l2: [1.0; 7],
        alpha: [[40.0, 200.0, 40.0, 200.0, 200.0, 200.0, 40.0], [4.0; 7], zeros],
        e0: [[20.0, 40.0, 20.0, 40.0, 20.0, 40.0, 20.0], [2.0, 4.0, 2.0, 4.0, 2.0, 4.0, 2.0], zeros],
        e1: [[10.0, 20.0, 10.0, 20.0, 10.0, 20.0, 10.0], [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 1.0], zeros],
        f0: [[10.0, 10.0, 10.0, 10.0, 50.0, 50.0, 50.0], [1.0; 7], zeros],
        f1: [[1.0; 7], [1.0, 1.0, 1.0, 1.0, 10.0, 10.0, 10.0], zeros],
    };
    let params = MracParams::new(&gains, 1e-3).expect("published gains");
    // Rotor inertia 0.3: the velocity loop survives the sampling.
    let robot = Model::<7>::new(&Robot::panda()).expect("seven joints").with_rotor_inertia(&Joints::repeat(0.3));
    let goals = GOALS.map(|goal| Joints::from_column_slice(&goal));
    let drift = gain_drift(&robot, &params, &goals, 6.0, 15);
    assert_eq!(drift.len(), 15, "the loop ran away");
    let size = |k: usize| drift[k].k0.hypot(drift[k].q0);
    for round in 0..5 {
        println!("{:?}", drift[3 * round + 2]);
    }
    assert!(drift.iter().all(|stay| stay.error_rad < 0.05));
    assert!(size(14) > size(5) && size(5) > size(2), "{} {} {}", size(2), size(5), size(14));
}
