//! A push at the flange: how far the arm gives way, and how it comes back.
//!
//! At rest in B; errors `e = q - goal`. The joint that gives way furthest is the one that swings are counted at.
//!
//! | figure | definition | unit |
//! |--------|------------|------|
//! | `peak_deviation_rad` | largest error of any joint | rad |
//! | `peak_flange_m` | largest way of the flange | m |
//! | `stiffness_n_per_m` | force over that way: high is stiff, low is compliant | N/m |
//! | `recovery_s` | from the end of the push until every joint stays within a tenth of the peak deviation | s |
//! | `recovery_to_5_mrad_s` | the same until every joint stays within 5 mrad | s |
//! | `swings` | changes of side after the push, counted between errors above a twentieth of the peak | 1 |
//! | `rebound` | largest error on the other side after the push, as a share of the peak | 1 |
//! | `final_error_rad` | largest error of any joint at the end | rad |

use certune_closed_loop::scenario::Noise;
use certune_closed_loop::{Plant, Row, Scenario};
use certune_dynamics::{Model, flange_pose};

use crate::error::CompareError;
use crate::inputs::{FRICTION_N_M_S_PER_RAD, Inputs, MASS_UNCERTAINTY, ROTOR_KG_M2, names};
use crate::pick_and_place::{PAIRS, chosen};
use crate::record::{Contender, Experiment, Trace};
use crate::runs::{self, JOINTS, Law, Stand, Title, arms, masses_only, rows};

/// Samples between rows: 5 ms at 1 kHz.
const EVERY: u64 = 5;
/// Samples between rows of a trace.
const EVERY_TRACED: u64 = 40;
/// How long the arm is watched, s.
const END_S: f64 = 10.0;
/// What counts as back, rad.
const BACK_RAD: f64 = 5e-3;

pub(crate) const FIGURES: [&str; 8] = [
    "peak_deviation_rad",
    "peak_flange_m",
    "stiffness_n_per_m",
    "recovery_s",
    "recovery_to_5_mrad_s",
    "swings",
    "rebound",
    "final_error_rad",
];

/// The task: the scenario's first push alone.
pub(crate) fn task(inputs: &Inputs) -> Scenario {
    let mut scenario = inputs.scenarios.push.clone();
    scenario.segments.truncate(1);
    scenario.segments[0].duration_s = END_S;
    scenario.pushes.truncate(1);
    scenario.plant_box = masses_only(MASS_UNCERTAINTY, FRICTION_N_M_S_PER_RAD, ROTOR_KG_M2, 0, true);
    scenario.noise = Noise::default();
    scenario
}

pub(crate) fn push(
    inputs: &Inputs,
    contenders: &[Contender],
    traces: &mut Vec<Trace>,
) -> Result<Experiment, CompareError> {
    let scenario = task(inputs);
    let size = inputs.size;
    let stand = Stand::new(&inputs.robot, &scenario, size.seed, size.arms)?;
    let middle = Stand::nominal(&inputs.robot, &scenario, size.seed)?;
    let model = middle.plants.first().map(Plant::model).ok_or(CompareError::NoArms)?;
    let force_n = scenario.pushes.first().and_then(|push| push.flange_force_n).unwrap_or_default();
    let force_n = force_n.iter().map(|force| force * force).sum::<f64>().sqrt();
    let until_s = scenario.pushes.first().map_or(0.0, |push| push.until_s);
    let of = [
        names::AIC,
        names::AIC_ROBOT,
        names::AIC_TUNED,
        names::MRAC,
        names::MRAC_MODEL,
        names::MRAC_ROBOT,
        names::MRAC_MATCHED,
    ];
    let mut results = Vec::new();
    for contender in chosen(contenders, &of) {
        let law = Law::new(&contender.gains, scenario.step_s)?;
        let found = stand.run(
            &law,
            || rows(EVERY),
            |metrics, rows| metrics.diverged_at_s.is_none().then(|| figures(rows.rows(), model, force_n, until_s)),
        );
        let diverged = found.iter().filter(|figures| figures.is_none()).count();
        let figures: Vec<Vec<Option<f64>>> = found.into_iter().map(|figures| figures.unwrap_or_default()).collect();
        results.push(arms(&contender.name, &FIGURES, &figures, diverged));
        let title = Title { experiment: "push", contender: &contender.name, case: "" };
        let row_s = EVERY_TRACED as f64 * scenario.step_s;
        traces.extend(middle.run(&law, || rows(EVERY_TRACED), |_, rows| runs::trace(&title, &rows, row_s, None, None)));
    }
    let conditions = format!(
        "identified arm with hand at rest in B, masses uncertain by 20 %, gravity compensated, friction 1 N m s/rad, rotor inertia 0.1 kg m²; {force_n} N sideways at the flange for {} s",
        until_s - scenario.pushes.first().map_or(0.0, |push| push.from_s)
    );
    Ok(Experiment { name: "push".to_owned(), conditions, results, tests: Vec::new() }.with_tests(&PAIRS))
}

/// Loads do not change the geometry, so any model of the arm gives the flange's place.
fn figures(rows: &[Row<JOINTS, ()>], model: &Model<JOINTS>, force_n: f64, until_s: f64) -> Vec<Option<f64>> {
    let Some(first) = rows.first() else { return vec![None; FIGURES.len()] };
    let error = |row: &Row<JOINTS, ()>| row.q - row.goal;
    let peak = rows.iter().map(|row| error(row).amax()).fold(0.0, f64::max);
    let widest = |joint: &usize| rows.iter().map(|row| error(row)[*joint].abs()).fold(0.0, f64::max);
    let joint = (0..JOINTS).max_by(|a, b| widest(a).total_cmp(&widest(b))).unwrap_or(0);
    let rest = flange_pose(model, &first.q).0;
    let way = rows.iter().map(|row| (flange_pose(model, &row.q).0 - rest).norm()).fold(0.0, f64::max);
    let behind = || rows.iter().filter(|row| row.t_s >= until_s);
    // The time of the first row from which on all are inside.
    let back = |band: f64| {
        let outside = behind().rfind(|row| error(row).amax() > band).map_or(until_s, |row| row.t_s);
        let end = rows.last().map_or(until_s, |row| row.t_s);
        (outside < end).then_some(outside - until_s)
    };
    // The side to which the push went.
    let extreme = rows.iter().map(|row| error(row)[joint]).fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
    let mut side = extreme.signum();
    let mut swings = 0;
    for row in behind() {
        let at = error(row)[joint];
        if at.abs() > 0.05 * peak && at * side < 0.0 {
            swings += 1;
            side = -side;
        }
    }
    let rebound = behind().map(|row| -error(row)[joint] * extreme.signum()).fold(0.0, f64::max) / extreme.abs();
    vec![
        Some(peak),
        Some(way),
        Some(force_n / way),
        back(0.1 * peak),
        back(BACK_RAD),
        Some(f64::from(swings)),
        Some(rebound),
        rows.last().map(|row| error(row).amax()),
    ]
}
