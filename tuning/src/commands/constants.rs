//! `autotune constants`: the constants of an arm, proved, and stored as a record that claims can rest on.

use certune::dynamics::Robot;
use certune::verify::{Number, Record};
use certune::{ProvingEffort, ProvingTask, prove_constants};
use serde::Serialize;

use super::certify::over;
use crate::catalogue;
use crate::cli::{ConstantsArgs, Context, EffortName, Exit};
use crate::error::Error;
use crate::output;
use crate::progress::Terminal;
use crate::sizes::for_joint_count;

#[derive(Debug, Serialize)]
struct Summary<'a> {
    file: String,
    elapsed_s: f64,
    record: &'a Record,
}

pub fn run(args: &ConstantsArgs, context: Context) -> Result<Exit, Error> {
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let task = task(args, &robot)?;
    // Minutes of work are not lost to a folder that does not exist.
    output::check_writable(&args.out)?;
    let progress = Terminal::new(context.verbose);
    progress.begin_share("proving the arm's constants");
    let proved = for_joint_count!(robot.joints(), N => {
        prove_constants::<N>(&robot, &task, &|share| progress.share(share)).map_err(Error::from)
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)));
    progress.finish();
    let record = proved?;
    output::write_file(&args.out, &(serde_json::to_string_pretty(&record)? + "\n"))?;
    let file = args.out.display().to_string();
    if context.json {
        output::print_json(&Summary { file, elapsed_s: progress.elapsed_s(), record: &record })?;
    } else {
        output::print(&in_words(&record, &file, progress.elapsed_s()))?;
    }
    Ok(Exit::Holds)
}

fn task(args: &ConstantsArgs, robot: &Robot) -> Result<ProvingTask, Error> {
    Ok(ProvingTask {
        mass_uncertainty: args.arms.mass_uncertainty(),
        payload_kg: args.arms.payload_kg(),
        rotor_inertia_kg_m2: args.arms.rotor_inertia_kg_m2(robot),
        over: over(args.over, args.scenario.as_deref(), robot)?,
        effort: match args.effort {
            Some(EffortName::Quick) => ProvingEffort::Quick,
            None | Some(EffortName::Standard) => ProvingEffort::Standard,
            Some(EffortName::Thorough) => ProvingEffort::Thorough,
        },
    })
}

fn in_words(record: &Record, file: &str, elapsed_s: f64) -> String {
    let bounds = &record.bounds;
    let one = |name: &str, number: &Number, unit: &str| (name.to_owned(), format!("{number} {unit}"));
    let each = |numbers: &[Number]| numbers.iter().map(Number::to_string).collect::<Vec<_>>().join(", ");
    let mut rows = vec![
        one("inertia at least", &bounds.m_lo_kg_m2, "kg m²"),
        one("inertia at most", &bounds.m_hi_kg_m2, "kg m²"),
        one("gravity stiffness", &bounds.k_g_n_m_per_rad, "N m/rad"),
        one("Coriolis, absolute", &bounds.k_c_kg_m2, "kg m²"),
    ];
    rows.extend(bounds.k_r.iter().map(|k_r| one("Coriolis, relative", k_r, "")));
    rows.extend(bounds.k_m.iter().map(|k_m| one("Coriolis, in the metric of M", k_m, "1/sqrt(kg m²)")));
    if let Some([lower, upper]) = &bounds.diagonal_kg_m2 {
        rows.push(("diagonal below M".to_owned(), format!("{} kg m²", each(lower))));
        rows.push(("diagonal above M".to_owned(), format!("{} kg m²", each(upper))));
    }
    rows.extend(
        bounds
            .gravity_torque_n_m
            .iter()
            .map(|torques| ("gravity torques".to_owned(), format!("{} N m", each(torques)))),
    );
    format!(
        "{}: proved in {elapsed_s:.1} s, record {}\n{}written to {file}; claims rest on it with `autotune certify ... --constants {file}`\n",
        record.arm.name,
        record.sha256,
        output::list(&rows)
    )
}
