//! The enclosure of M and of the Coriolis form against arms and configurations drawn inside it.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use certune_bounds::{ArmBox, Enclosure, Ranges, enclosure};
use certune_dynamics::{Model, Robot, State, coriolis_matrix, mass_matrix};
use certune_linsys::Joints;

const HALF_WIDTH_RAD: f64 = 0.05;
/// The goals of the pick-and-place task, rad.
const GOALS: [(&str, [f64; 7]); 3] = [
    ("A", [1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0]),
    ("B", [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0]),
    ("C", [-1.0, 0.5, 0.0, -1.2, 0.0, 1.6, 0.0]),
];

fn family() -> ArmBox<7> {
    let ranges = Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        payload_com_m: [0.0, 0.0, 0.307],
        rotor_inertia_kg_m2: [0.0, 0.1],
    };
    ArmBox::new(&Model::new(&Robot::panda()).unwrap(), &ranges).unwrap()
}

fn nominal() -> ArmBox<7> {
    ArmBox::nominal(&Model::new(&Robot::panda()).unwrap()).unwrap()
}

fn around(arms: &ArmBox<7>, goal: &[f64; 7], half_width: f64, halvings: u32) -> Enclosure<7> {
    enclosure(arms, &goal.map(|x| x - half_width), &goal.map(|x| x + half_width), halvings).unwrap()
}

/// Van der Corput's sequence in one base per coordinate.
fn draw(index: u32, coordinate: usize) -> f64 {
    let base = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71][coordinate % 20];
    let (mut rest, mut scale, mut sum) = (index + 1, 1.0, 0.0);
    while rest > 0 {
        scale /= f64::from(base);
        sum += scale * f64::from(rest % base);
        rest /= base;
    }
    sum
}

/// Checks one member of the box; returns the largest share of the radius that M used and of k_C that the form used.
fn check(arms: &ArmBox<7>, found: &Enclosure<7>, index: u32) -> [f64; 2] {
    // A third of the coordinates at an end of their range, where the extremes are.
    let share = |coordinate: usize| {
        let x = draw(index, coordinate);
        (x * 1.5 - 0.25).clamp(0.0, 1.0)
    };
    let groups = arms.groups();
    let mut point: Vec<f64> =
        (0..7).map(|j| found.lower_rad[j] + share(j) * (found.upper_rad[j] - found.lower_rad[j])).collect();
    point.extend(
        groups.iter().enumerate().map(|(g, group)| group.scale[0] + share(7 + g) * (group.scale[1] - group.scale[0])),
    );
    point.push(share(19));
    let member = arms.member(&point).unwrap();
    let mass = mass_matrix(&member.model, &member.q);
    let mut used = [0.0_f64; 2];
    for i in 0..7 {
        for j in 0..7 {
            let off = (mass[(i, j)] - found.midpoint_kg_m2[i][j]).abs();
            assert!(off <= found.radius_kg_m2[i][j], "M[{i}][{j}] off by {off}");
            used[0] = used[0].max(off / found.radius_kg_m2[i][j]);
        }
    }
    // x'C(q, v) y at alternating directions: a local maximum of the trilinear form.
    let unit = |shift: usize| Joints::<7>::from_fn(|j, _| draw(index, j + shift) - 0.5).normalize();
    let (mut v, mut y) = (unit(5), unit(9));
    let mut value = 0.0;
    for _ in 0..12 {
        let c = |v: Joints<7>| coriolis_matrix(&member.model, &State { q: member.q, dq: v });
        let x = (c(v) * y).normalize();
        y = (c(v).transpose() * x).normalize();
        let along = Joints::<7>::from_fn(|k, _| x.dot(&(c(Joints::from_fn(|j, _| f64::from(u8::from(j == k)))) * y)));
        value = along.norm();
        v = along.normalize();
    }
    assert!(value <= found.coriolis_kg_m2, "Coriolis form {value} beyond {}", found.coriolis_kg_m2);
    used[1] = value / found.coriolis_kg_m2;
    used
}

#[test]
fn no_member_leaves_the_enclosure() {
    for (arms, halvings) in [(nominal(), 0), (family(), 0), (nominal(), 1), (family(), 1)] {
        for (name, goal) in &GOALS {
            let found = around(&arms, goal, HALF_WIDTH_RAD, halvings);
            let used =
                (0..3000).map(|k| check(&arms, &found, k)).fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
            println!("{name}, {halvings} halvings: k_C {} kg m^2, shares used {used:?}", found.coriolis_kg_m2);
            // Not vacuous: some member comes near both bounds.
            assert!(used[0] > 0.4 && used[1] > 0.2, "{used:?}");
        }
    }
}

#[test]
fn a_smaller_box_has_a_smaller_enclosure() {
    let wide = around(&nominal(), &GOALS[1].1, 0.05, 0);
    let narrow = around(&nominal(), &GOALS[1].1, 0.005, 0);
    assert!(narrow.coriolis_kg_m2 < wide.coriolis_kg_m2);
    for i in 0..7 {
        for j in 0..7 {
            assert!(narrow.radius_kg_m2[i][j] <= 0.2 * wide.radius_kg_m2[i][j] + 2e-4);
        }
    }
}

#[test]
fn a_reversed_box_is_refused_with_its_joint() {
    let mut upper = [0.1; 7];
    upper[3] = -0.1;
    let error = enclosure(&nominal(), &[0.0; 7], &upper, 0).unwrap_err();
    assert_eq!(error.to_string(), "joint 4 is 0 to -0.1 rad, expected lower <= upper, both finite");
}
