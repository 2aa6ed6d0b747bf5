//! Two bottles, one after the other, over the via-points of the robot experiment; the difference between the two trajectories.
//!
//! From rest in "grab" the bottle is attached after 2 s, carried over "centre" to "release" and released there. The arm compensates its own gravity and not the bottle's.
//!
//! | figure | definition | unit |
//! |--------|------------|------|
//! | `lift_deviation_rad`, `carry_..`, `release_..` | largest difference of any joint between the runs with either bottle: 5 s from the attachment, until the release, behind it | rad |
//! | `full_lift_rad`, `full_release_rad` | with the full bottle, largest way of any joint from where it was at the attachment, and at the release | rad |
//! | `final_error_rad` | with the full bottle, largest error of any joint at the end of any goal | rad |
//! | `ripple_rad_per_s2` | with the full bottle, root mean square of the acceleration while it is carried, worst joint, from velocities 10 ms apart | rad/s² |

use certune_closed_loop::scenario::{Goal, Noise};
use certune_closed_loop::{Row, Scenario};
use certune_linsys::Joints;

use crate::error::CompareError;
use crate::inputs::{FRICTION_N_M_S_PER_RAD, Inputs, MASS_UNCERTAINTY, ROTOR_KG_M2, names};
use crate::pick_and_place::{PAIRS, chosen};
use crate::record::{Contender, Experiment, Trace};
use crate::runs::{self, JOINTS, Law, Rows, Stand, TRACE_EVERY, Title, arms, masses_only, rows};

/// Samples between rows: 10 ms at 1 kHz.
const EVERY: u64 = 10;
/// When the bottle is attached, when it begins to move, when it is released, and the end, s.
const TIMES_S: [f64; 4] = [2.0, 7.0, 17.0, 21.0];

pub(crate) const FIGURES: [&str; 7] = [
    "lift_deviation_rad",
    "carry_deviation_rad",
    "release_deviation_rad",
    "full_lift_rad",
    "full_release_rad",
    "final_error_rad",
    "ripple_rad_per_s2",
];

/// The task with the bottle of that place.
pub(crate) fn task(inputs: &Inputs, bottle: usize) -> Scenario {
    let mut scenario = inputs.scenarios.payloads.clone();
    let [_, grab, centre, release] = core::array::from_fn(|place| scenario.segments[place].goal_rad.clone());
    let [attach_s, leave_s, release_s, end_s] = TIMES_S;
    let half_s = 0.5 * (release_s - leave_s);
    scenario.start_rad.clone_from(&grab);
    let stay = [(grab, leave_s), (centre, half_s), (release.clone(), half_s), (release, end_s - release_s)];
    scenario.segments = stay.map(|(goal_rad, duration_s)| Goal { goal_rad, duration_s }).to_vec();
    let mut event = scenario.payloads.swap_remove(bottle);
    (event.attach_s, event.release_s) = (attach_s, Some(release_s));
    scenario.payloads = vec![event];
    scenario.plant_box = masses_only(MASS_UNCERTAINTY, FRICTION_N_M_S_PER_RAD, ROTOR_KG_M2, 0, true);
    scenario.noise = Noise::default();
    scenario
}

type Moves = Vec<(Joints<JOINTS>, Joints<JOINTS>)>;

pub(crate) fn payloads(
    inputs: &Inputs,
    contenders: &[Contender],
    traces: &mut Vec<Trace>,
) -> Result<Experiment, CompareError> {
    let names = [names::AIC, names::AIC_ROBOT, names::AIC_TUNED, names::MRAC, names::MRAC_ROBOT, names::MRAC_MATCHED];
    let those = chosen(contenders, &names);
    let scenarios = [0, 1].map(|bottle| task(inputs, bottle));
    let size = inputs.size;
    let mut results = Vec::new();
    for contender in those {
        let mut found: [Vec<(Moves, Option<f64>)>; 2] = [Vec::new(), Vec::new()];
        for (scenario, found) in scenarios.iter().zip(&mut found) {
            let stand = Stand::new(&inputs.robot, scenario, size.seed, size.arms)?;
            let law = Law::new(&contender.gains, scenario.step_s)?;
            *found = stand.run(
                &law,
                || rows(EVERY),
                |metrics, rows: Rows| {
                    let moves = rows.into_rows().into_iter().map(|Row { q, dq, .. }| (q, dq)).collect();
                    (moves, metrics.diverged_at_s.is_none().then(|| metrics.worst_final_error_rad()))
                },
            );
            if [names::AIC_ROBOT, names::MRAC_ROBOT].contains(&contender.name.as_str()) {
                traces.push(nominal(inputs, scenario, contender)?);
            }
        }
        let row_s = EVERY as f64 * scenarios[0].step_s;
        let [light, full] = &found;
        let figures: Vec<_> = light.iter().zip(full).map(|(light, full)| figures(light, full, row_s)).collect();
        let diverged = light.iter().zip(full).filter(|(light, full)| light.1.is_none() || full.1.is_none()).count();
        results.push(arms(&contender.name, &FIGURES, &figures, diverged));
    }
    let masses: Vec<String> =
        scenarios.iter().flat_map(|s| &s.payloads).map(|event| format!("{} kg", event.mass_kg)).collect();
    let conditions = format!(
        "identified arm with hand, masses uncertain by 20 %, gravity of the arm compensated, friction 1 N m s/rad, rotor inertia 0.1 kg m²; bottles of {}, 0.2 m beyond the flange",
        masses.join(" and ")
    );
    Ok(Experiment { name: "payloads".to_owned(), conditions, results, tests: Vec::new() }.with_tests(&PAIRS))
}

fn nominal(inputs: &Inputs, scenario: &Scenario, contender: &Contender) -> Result<Trace, CompareError> {
    let stand = Stand::nominal(&inputs.robot, scenario, inputs.size.seed)?;
    let law = Law::new(&contender.gains, scenario.step_s)?;
    let mass = scenario.payloads.first().map_or(0.0, |event| event.mass_kg);
    let case = format!("{mass} kg");
    let title = Title { experiment: "payloads", contender: &contender.name, case: &case };
    let row_s = TRACE_EVERY as f64 * scenario.step_s;
    stand
        .run(&law, || rows(TRACE_EVERY), |_, rows| runs::trace(&title, &rows, row_s, None, None))
        .pop()
        .ok_or(CompareError::NoArms)
}

fn figures(light: &(Moves, Option<f64>), full: &(Moves, Option<f64>), row_s: f64) -> Vec<Option<f64>> {
    let ((light, Some(_)), (full, Some(final_error))) = (light, full) else { return vec![None; FIGURES.len()] };
    let [attach, leave, release, end] = TIMES_S.map(|time_s| (time_s / row_s).round() as usize);
    let window = |from: usize, until: usize| from..until.min(light.len()).min(full.len());
    let apart = |from, until| window(from, until).map(|row| (light[row].0 - full[row].0).amax()).fold(0.0, f64::max);
    let way =
        |from: usize, until| window(from, until).map(|row| (full[row].0 - full[from].0).amax()).fold(0.0, f64::max);
    let mut squares = Joints::<JOINTS>::zeros();
    for row in window(leave, release) {
        squares += (full[row].1 - full[row - 1].1).map(|change| change * change);
    }
    let ripple = (squares.amax() / (release - leave) as f64).sqrt() / row_s;
    vec![
        Some(apart(attach, leave)),
        Some(apart(leave, release)),
        Some(apart(release, end)),
        Some(way(attach, leave)),
        Some(way(release, end)),
        Some(*final_error),
        Some(ripple),
    ]
}
