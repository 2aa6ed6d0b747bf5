//! `autotune resume`: a run that was interrupted, from its journal to its end.

use std::path::Path;

use certune::family_of;
use certune::tune::{Setting, SpaceFile};

use super::tune::{Plan, carry_out, inertia_kg_m2, watched};
use crate::catalogue;
use crate::cli::{Context, Exit, ResumeArgs};
use crate::error::Error;
use crate::journal::{Header, Journal, JournalError};
use crate::run::Folder;
use crate::versions::versions;

pub fn run(args: &ResumeArgs, context: Context) -> Result<Exit, Error> {
    // Without a slash at its end, the folder is named as in the run's own commands.
    let folder = Folder { path: args.run_dir.components().collect() };
    let (header, journal) = Journal::open(&folder)?;
    let plan = plan(header, folder)?;
    let progress = watched(&plan, args.dashboard, context)?;
    carry_out(&plan, journal, args.threads, &progress, context)
}

/// The plan of the run that the header is of, with the files as they are now.
fn plan(header: Header, folder: Folder) -> Result<Plan, Error> {
    let question = &header.question;
    let found = versions();
    if question.versions != found {
        let in_words = |versions: &std::collections::BTreeMap<String, String>| {
            let named: Vec<String> = versions.iter().map(|(name, version)| format!("{name} {version}")).collect();
            named.join(", ")
        };
        let (recorded, found) = (in_words(&question.versions), in_words(&found));
        return Err(JournalError::OtherVersions { recorded, found }.into());
    }
    let given = header.robot_file.as_ref().map_or_else(|| header.robot.clone().into(), |file| file.to_string_lossy());
    let robot = catalogue::robot(&given, header.tip.as_deref())?;
    let found = robot.sha256();
    if question.robot_sha256 != found {
        return Err(JournalError::OtherRobot { recorded: question.robot_sha256.clone(), found }.into());
    }
    let file = SpaceFile::parse(Path::new(&header.space_name), &header.space)?;
    let inertia_kg_m2 = inertia_kg_m2(&robot, &header.scenario)?;
    let space = file.on(Setting { start: Some(&header.start), inertia_kg_m2: Some(&inertia_kg_m2) })?;
    Ok(Plan {
        robot,
        family: family_of(&header.scenario.plant_box)?,
        records: catalogue::records(&[])?,
        space,
        header,
        folder,
    })
}
