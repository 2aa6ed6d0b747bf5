//! `autotune inspect`: the arm's dynamics at one state.

use certune::dynamics::{
    Joints, Model, Robot, State, coriolis_torque, flange_pose, forward_dynamics, friction_torque, gravity_jacobian,
    gravity_torque, mass_matrix,
};
use serde::Serialize;

use crate::catalogue;
use crate::cli::{Context, Exit, InspectArgs};
use crate::error::Error;
use crate::output::{self, number, table};
use crate::sizes::for_joint_count;
use crate::values::Numbers;

#[derive(Debug, Serialize)]
struct Dynamics {
    robot: String,
    q_rad: Vec<f64>,
    dq_rad_per_s: Vec<f64>,
    tau_n_m: Vec<f64>,
    mass_matrix_kg_m2: Vec<Vec<f64>>,
    coriolis_torque_n_m: Vec<f64>,
    gravity_torque_n_m: Vec<f64>,
    friction_torque_n_m: Vec<f64>,
    gravity_jacobian_n_m_per_rad: Vec<Vec<f64>>,
    /// Of the arm under `tau_n_m`, gravity and friction acting.
    ddq_rad_per_s2: Vec<f64>,
    flange_position_m: [f64; 3],
}

pub fn run(args: &InspectArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let dynamics = for_joint_count!(robot.joints(), N => inspect::<N>(&robot, args))
        .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    if context.json {
        output::print_json(&dynamics)?;
    } else {
        output::print(&in_words(&robot, &dynamics))?;
    }
    Ok(Exit::Holds)
}

fn joints<const N: usize>(flag: &'static str, given: Option<&Numbers>, robot: &Robot) -> Result<Joints<N>, Error> {
    let Some(Numbers(values)) = given else { return Ok(Joints::zeros()) };
    let bound: Result<[f64; N], _> = values.as_slice().try_into();
    bound.map(Joints::from).map_err(|_| Error::ListLength {
        flag,
        found: values.len(),
        robot: robot.name().to_owned(),
        joints: N,
    })
}

fn inspect<const N: usize>(robot: &Robot, args: &InspectArgs) -> Result<Dynamics, Error> {
    let q = joints::<N>("--q", Some(&args.q), robot)?;
    let dq = joints::<N>("--dq", args.dq.as_ref(), robot)?;
    let tau = joints::<N>("--tau", args.tau.as_ref(), robot)?;
    let model = Model::<N>::new(robot).map_err(|source| Error::Robot { file: None, source })?;
    let at = State { q, dq };
    let list = |values: Joints<N>| values.as_slice().to_vec();
    let mass = mass_matrix(&model, &q);
    let stiffness = gravity_jacobian(&model, &q);
    Ok(Dynamics {
        robot: robot.name().to_owned(),
        q_rad: list(q),
        dq_rad_per_s: list(dq),
        tau_n_m: list(tau),
        mass_matrix_kg_m2: mass.row_iter().map(|row| row.iter().copied().collect()).collect(),
        coriolis_torque_n_m: list(coriolis_torque(&model, &at)),
        gravity_torque_n_m: list(gravity_torque(&model, &q)),
        friction_torque_n_m: list(friction_torque(&model, &dq)),
        gravity_jacobian_n_m_per_rad: stiffness.row_iter().map(|row| row.iter().copied().collect()).collect(),
        ddq_rad_per_s2: list(forward_dynamics(&model, &at, &tau)),
        flange_position_m: flange_pose(&model, &q).0.into(),
    })
}

fn in_words(robot: &Robot, dynamics: &Dynamics) -> String {
    let joint = |index: usize| robot.links()[index].joint_name.clone();
    let count = robot.joints();
    let header: Vec<String> =
        std::iter::once(String::new()).chain((1..=count).map(|joint| joint.to_string())).collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let matrix = |rows: &[Vec<f64>]| {
        let row = |(index, row): (usize, &Vec<f64>)| {
            std::iter::once(joint(index)).chain(row.iter().map(|value| number(Some(*value), 5))).collect()
        };
        table(&header, &rows.iter().enumerate().map(row).collect::<Vec<Vec<String>>>())
    };
    let columns = [
        &dynamics.q_rad,
        &dynamics.dq_rad_per_s,
        &dynamics.tau_n_m,
        &dynamics.coriolis_torque_n_m,
        &dynamics.gravity_torque_n_m,
        &dynamics.friction_torque_n_m,
        &dynamics.ddq_rad_per_s2,
    ];
    let rows: Vec<Vec<String>> = (0..count)
        .map(|index| {
            std::iter::once(joint(index)).chain(columns.iter().map(|column| number(Some(column[index]), 5))).collect()
        })
        .collect();
    let per_joint = table(&["joint", "q", "dq", "tau", "Coriolis", "gravity", "friction", "ddq"], &rows);
    let [x, y, z] = dynamics.flange_position_m.map(|value| number(Some(value), 5));
    format!(
        "{}: angles in rad, torques in N m, SI units throughout\n{per_joint}flange at ({x}, {y}, {z}) m\n\
         mass matrix, kg m²\n{}gravity Jacobian dg/dq, N m/rad\n{}",
        dynamics.robot,
        matrix(&dynamics.mass_matrix_kg_m2),
        matrix(&dynamics.gravity_jacobian_n_m_per_rad),
    )
}
