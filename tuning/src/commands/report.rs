//! `autotune report`: the page of a run again, from its folder.

use serde::Serialize;

use crate::catalogue;
use crate::cli::{Context, Exit, ReportArgs};
use crate::error::Error;
use crate::output;
use crate::page;
use crate::run::Folder;
use crate::sizes::for_joint_count;

#[derive(Debug, Serialize)]
struct Summary {
    report: String,
    certified: bool,
}

pub fn run(args: &ReportArgs, context: Context) -> Result<Exit, Error> {
    let folder = Folder { path: args.run_dir.clone() };
    let run = folder.read()?;
    let question = &run.file.record.question;
    let given = args.robot.as_deref().unwrap_or(&question.robot);
    let robot = catalogue::robot(given, args.tip.as_deref()).map_err(|error| match error {
        Error::Unknown { .. } if args.robot.is_none() => Error::RobotOfRun { robot: question.robot.clone() },
        other => other,
    })?;
    let found = robot.sha256();
    if found != question.robot_sha256 {
        return Err(Error::OtherRobot { recorded: question.robot_sha256.clone(), found });
    }
    let page = for_joint_count!(robot.joints(), N => page::page::<N>(&run, &robot, given, &folder))
        .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    let path = folder.report();
    output::write_file(&path, &page)?;
    let certified = run.file.record.winner.is_some();
    if context.json {
        output::print_json(&Summary { report: path.display().to_string(), certified })?;
    } else {
        output::print(&format!("{}\n", path.display()))?;
    }
    Ok(if certified { Exit::Holds } else { Exit::NotCertified })
}
