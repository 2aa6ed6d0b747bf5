//! `autotune front`: what two or three goals cost each other; and `autotune pick`, which takes one point of it.
//!
//! A front's folder holds `front.json`, the points with everything that is needed to certify one of them again, and `front.html`. Every point of it has passed the same certifier as the
//! winner of a run; `pick` asks it once more and writes `gains.toml` and the certificates.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use certune::certify::FamilyValues;
use certune::closed_loop::{Gains, GainsFile, Scenario};
use certune::dynamics::Robot;
use certune::report::{CommandLine, FrontGoal, FrontPoint, FrontReport, front_report};
use certune::tune::filter::DEFAULT_SAMPLES;
use certune::tune::front::{Front, Measure, Measured, check, front, non_dominated, spread_out};
use certune::tune::{Goal, Goals, SearchSettings, SimulatedObjective, Source, Space};
use certune::verify::Record;
use certune::{ArmCertifier, Over, family_of};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::tune::{DEFAULT_PLANTS, DEFAULT_SEED, inertia_kg_m2, misfit, run_name, started};
use crate::catalogue::{self, SpaceSource};
use crate::certificate;
use crate::cli::{Context, Exit, FrontArgs, PickArgs};
use crate::error::Error;
use crate::output::{self, number, table};
use crate::progress::Terminal;
use crate::promise;
use crate::run::Folder;
use crate::sizes::for_joint_count;
use crate::versions::{VERSION, versions};

/// Candidates that are measured.
const DEFAULT_BUDGET: usize = 600;
/// Points that are shown.
const MOST_POINTS: usize = 24;
/// The version of `front.json`.
const SCHEMA: u32 = 1;

/// The content of `front.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrontFile {
    schema: u32,
    controller: String,
    robot: String,
    robot_sha256: String,
    scenario: Scenario,
    preset: String,
    space_name: String,
    versions: std::collections::BTreeMap<String, String>,
    /// The goals of the front, in the order of the figures.
    goals: Vec<Goal>,
    /// The limits that every point keeps, and the level of the conditional value at risk.
    kept: Goals,
    search: SearchSettings,
    batch_plants: usize,
    /// Candidates that were measured, failed ones included.
    evaluations: usize,
    /// Points of the front that the certifier refused.
    refused: usize,
    /// Figures of the gains that the search started from.
    start: Option<Vec<f64>>,
    /// The front, from the best in the first goal on; numbered from 1.
    points: Vec<Measured>,
    /// Figures of the other gains that were measured.
    others: Vec<Vec<f64>>,
}

/// What a front is made of.
struct Plan {
    robot: Robot,
    scenario: Scenario,
    family: FamilyValues,
    records: Vec<Record>,
    space: Space,
    start: Gains,
    file: FrontFile,
    folder: PathBuf,
}

#[derive(Debug, Serialize)]
struct Summary<'a> {
    directory: String,
    goals: &'a [Goal],
    points: &'a [Measured],
    refused: usize,
    elapsed_s: f64,
}

pub fn run(args: &FrontArgs, context: Context) -> Result<Exit, Error> {
    let mut plan = plan(args)?;
    output::prepare_folder(&plan.folder)?;
    let threads = args.threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| Error::Threads { threads, source })?;
    let progress = Terminal::new(context.verbose);
    progress.begin("measuring candidates");
    let found = pool.install(|| {
        for_joint_count!(plan.robot.joints(), N => sweep::<N>(&plan, &progress))
            .unwrap_or_else(|| Err(catalogue::too_many_joints(&plan.robot)))
    });
    progress.finish();
    plan.file = found?;
    let page = front_report(&report(&plan, &args.robot.robot))?;
    let json = serde_json::to_string_pretty(&plan.file)? + "\n";
    let files = [(record_of(&plan.folder), json), (plan.folder.join("front.html"), page)];
    output::commit(output::stage(&files)?)?;
    if context.json {
        output::print_json(&Summary {
            directory: plan.folder.display().to_string(),
            goals: &plan.file.goals,
            points: &plan.file.points,
            refused: plan.file.refused,
            elapsed_s: progress.elapsed_s(),
        })?;
    } else {
        output::print(&in_words(&plan, progress.elapsed_s()))?;
    }
    Ok(if plan.file.points.is_empty() { Exit::NotCertified } else { Exit::Holds })
}

fn record_of(folder: &Path) -> PathBuf {
    folder.join("front.json")
}

fn plan(args: &FrontArgs) -> Result<Plan, Error> {
    check(&args.goals)?;
    let robot = catalogue::robot(&args.robot.robot, args.robot.tip.as_deref())?;
    let scenario = catalogue::scenario(args.scenario.as_deref(), &robot)?;
    let source = catalogue::space(args.space.as_deref(), args.controller)?;
    let controller = source.space.controller();
    let (preset, space, start) = started(&source, Some(&inertia_kg_m2(&robot, &scenario)?))?;
    let SpaceSource { name: space_name, .. } = source;
    if let (Gains::Mrac(_), Some(goal)) = (
        &start,
        args.goals.iter().chain(&space.goals().from(Source::Proved)).find(|goal| goal.source() == Source::Proved),
    ) {
        return Err(Error::NoFigure { goal: *goal });
    }
    let seed = args.seed.unwrap_or(DEFAULT_SEED);
    let folder = PathBuf::from("runs").join(run_name(&robot, &format!("{controller}-front"), seed));
    Ok(Plan {
        family: family_of(&scenario.plant_box)?,
        records: catalogue::records(&[])?,
        file: FrontFile {
            schema: SCHEMA,
            controller: controller.to_owned(),
            robot: robot.name().to_owned(),
            robot_sha256: robot.sha256(),
            scenario: scenario.clone(),
            preset,
            space_name,
            versions: versions(),
            goals: args.goals.clone(),
            kept: space.goals().clone(),
            search: SearchSettings::new(space.method(), args.budget.unwrap_or(DEFAULT_BUDGET), seed),
            batch_plants: args.plants.unwrap_or(DEFAULT_PLANTS),
            evaluations: 0,
            refused: 0,
            start: None,
            points: Vec::new(),
            others: Vec::new(),
        },
        robot,
        scenario,
        space,
        start,
        folder: args.out.clone().unwrap_or(folder),
    })
}

/// Measures, and keeps what the certifier accepts.
fn sweep<const N: usize>(plan: &Plan, progress: &Terminal) -> Result<FrontFile, Error> {
    let Plan { robot, scenario, file, space, start, .. } = plan;
    let certifier = certifier::<N>(robot, &plan.family, &plan.records)?;
    let objective = SimulatedObjective::<N>::new(robot, scenario, file.search.seed, file.batch_plants, DEFAULT_SAMPLES)
        .map_err(|error| misfit(robot, scenario, error))?;
    // What is a goal of the front is no limit as well.
    let mut kept = objective.batch().resolved(file.kept.clone(), start);
    kept.limits.retain(|limit| !file.goals.contains(&limit.goal));
    let objective = objective.with_goals(&Goals { objective: Goal::SettlingCost, ..kept.clone() }, &certifier);
    let Front { mut measured, evaluations, .. } = front(space, start, &file.goals, &file.search, &objective)?;
    progress.begin("certifying the front");
    let mut refused = 0;
    let mut certified: Vec<Gains> = Vec::new();
    let points = loop {
        let front = non_dominated(&file.goals, &measured);
        let open: Vec<&Gains> =
            front.iter().map(|place| &measured[*place].gains).filter(|gains| !certified.contains(gains)).collect();
        let verdicts: Vec<(Gains, bool)> = open
            .into_par_iter()
            .map(|gains| {
                let made = promise::certify(&certifier, scenario, gains);
                (gains.clone(), made.is_ok_and(|made| promise::holds(&made)))
            })
            .collect();
        let bad: Vec<Gains> = verdicts.iter().filter(|(_, holds)| !holds).map(|(gains, _)| gains.clone()).collect();
        certified.extend(verdicts.into_iter().filter(|(_, holds)| *holds).map(|(gains, _)| gains));
        if bad.is_empty() {
            break spread_out(&file.goals, &measured, &front, MOST_POINTS);
        }
        // With a point gone, others may come to the front.
        refused += bad.len();
        measured.retain(|point| !bad.contains(&point.gains));
    };
    let others = (0..measured.len()).filter(|place| !points.contains(place));
    Ok(FrontFile {
        kept,
        evaluations,
        refused,
        start: objective.measure(start, &file.goals).ok(),
        others: others.map(|place| measured[place].figures.clone()).collect(),
        points: points.iter().map(|place| measured[*place].clone()).collect(),
        ..file.clone()
    })
}

fn certifier<const N: usize>(
    robot: &Robot,
    family: &FamilyValues,
    records: &[Record],
) -> Result<ArmCertifier<N>, Error> {
    Ok(ArmCertifier::<N>::new(robot, family)?.with_records(records, &Over::AllAngles)?)
}

fn report(plan: &Plan, robot_argument: &str) -> FrontReport {
    let file = &plan.file;
    let folder = plan.folder.display();
    let limits: Vec<String> = file.kept.limits.iter().map(ToString::to_string).collect();
    let refused = match file.refused {
        0 => "The certifier accepted every point of the front.".to_owned(),
        count => format!("The certifier refused {count} points, which are left out."),
    };
    let mut method = vec![
        format!(
            "{} candidates were measured on {} plants drawn with seed {}: each goal was sought alone, then the first under bounds on the others. Simulated figures are the mean over \
             the worst {} % of the plants; proved ones hold for the whole plant box.",
            file.evaluations,
            file.batch_plants,
            file.search.seed,
            crate::page::percent_of_tail(&file.kept)
        ),
        refused,
    ];
    if !limits.is_empty() {
        method.push(format!("Every point keeps the limits: {}.", limits.join(", ")));
    }
    let robot = if catalogue::robot_file(robot_argument).is_ok_and(|file| file.is_none()) {
        String::new()
    } else {
        format!(" --robot {robot_argument}")
    };
    FrontReport {
        about: format!("{} · {} · {} · seed {}", file.robot, file.controller, file.scenario.name, file.search.seed),
        method,
        goals: file
            .goals
            .iter()
            .map(|goal| FrontGoal {
                name: goal.name().replace('-', " "),
                unit: goal.unit().to_owned(),
                is_at_least: goal.is_at_least(),
                source: match goal.source() {
                    Source::Simulated => "simulated",
                    Source::Proved => "proved",
                    Source::Linearised => "linearised",
                }
                .to_owned(),
            })
            .collect(),
        points: file
            .points
            .iter()
            .enumerate()
            .map(|(place, Measured { gains, figures })| FrontPoint {
                number: place + 1,
                figures: figures.clone(),
                gains: plan.space.knobs().iter().map(|knob| (knob.name.clone(), short(knob.value(gains)))).collect(),
            })
            .collect(),
        others: file.others.clone(),
        published: file.start.clone(),
        commands: vec![CommandLine {
            command: format!("autotune pick {folder} --point 1{robot}"),
            shows: "Certifies the point of that number again, and writes its gains and certificates.".to_owned(),
        }],
    }
}

/// Five significant digits.
fn short(value: f64) -> String {
    format!("{}", format!("{value:.4e}").parse::<f64>().unwrap_or(value))
}

fn in_words(plan: &Plan, elapsed_s: f64) -> String {
    let file = &plan.file;
    let mut text = format!(
        "{} under the {} in {}: {} candidates on {} plants, {elapsed_s:.1} s\n\n",
        file.robot,
        file.controller.to_uppercase(),
        file.scenario.name,
        file.evaluations,
        file.batch_plants
    );
    let names: Vec<String> =
        file.goals.iter().map(|goal| format!("{}, {}", goal.name().replace('-', " "), goal.unit())).collect();
    let header: Vec<&str> = std::iter::once("point").chain(names.iter().map(String::as_str)).collect();
    let row = |name: String, figures: &Vec<f64>| -> Vec<String> {
        std::iter::once(name).chain(figures.iter().map(|figure| number(Some(*figure), 4))).collect()
    };
    let points = file.points.iter().enumerate().map(|(place, point)| row((place + 1).to_string(), &point.figures));
    let start = file.start.iter().map(|figures| row(file.preset.clone(), figures));
    text.push_str(&table(&header, &points.chain(start).collect::<Vec<_>>()));
    let folder = plan.folder.display();
    let _ = writeln!(
        text,
        "\n{} points are certified{}.\n\n{folder}: front.json, front.html\ntake one: autotune pick {folder} --point K",
        file.points.len(),
        if file.refused == 0 { String::new() } else { format!("; {} were refused and left out", file.refused) }
    );
    text
}

/// `autotune pick`.
pub fn pick(args: &PickArgs, context: Context) -> Result<Exit, Error> {
    let path = record_of(&args.front_dir);
    let text = std::fs::read_to_string(&path).map_err(|source| Error::NoRun { path: path.clone(), source })?;
    let file: FrontFile =
        serde_json::from_str(&text).map_err(|source| Error::RunRecord { path: path.clone(), source })?;
    let Some(point) = args.point.checked_sub(1).and_then(|place| file.points.get(place)) else {
        return Err(Error::NoPoint { point: args.point, most: file.points.len() });
    };
    let given = args.robot.as_deref().unwrap_or(&file.robot);
    let robot = catalogue::robot(given, args.tip.as_deref()).map_err(|error| match error {
        Error::Unknown { .. } if args.robot.is_none() => Error::RobotOfRun { robot: file.robot.clone() },
        other => other,
    })?;
    let found = robot.sha256();
    if found != file.robot_sha256 {
        return Err(Error::OtherRobot { recorded: file.robot_sha256, found });
    }
    let folder =
        Folder { path: args.out.clone().unwrap_or_else(|| args.front_dir.join(format!("point-{}", args.point))) };
    let family = family_of(&file.scenario.plant_box)?;
    let records = catalogue::records(&[])?;
    let certificates = for_joint_count!(robot.joints(), N => {
        certifier::<N>(&robot, &family, &records)
            .and_then(|certifier| Ok(promise::certify(&certifier, &file.scenario, &point.gains)?))
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(&robot)))?;
    if !promise::holds(&certificates) {
        return Err(Error::PointRefused { point: args.point });
    }
    let source = format!(
        "autotune {VERSION}: point {} of a front for robot {} in scenario {}, seed {}; certified",
        args.point, file.robot, file.scenario.name, file.search.seed
    );
    let gains = GainsFile { source: Some(source), gains: point.gains.clone() }.to_toml();
    output::prepare_folder(&folder.path)?;
    let mut files = vec![(folder.gains(), gains)];
    let paths = folder.certificates(certificates.len());
    for (path, answer) in paths.iter().zip(&certificates) {
        files.extend(certificate::files(path, answer)?);
    }
    output::commit(output::stage(&files)?)?;
    let names =
        |paths: &mut dyn Iterator<Item = &PathBuf>| paths.map(|path| path.display().to_string()).collect::<Vec<_>>();
    let written = names(&mut files.iter().map(|(path, _)| path));
    if context.json {
        output::print_json(&Picked {
            files: &written,
            gains: &point.gains,
            figures: &point.figures,
            goals: &file.goals,
        })?;
    } else {
        output::print(&format!(
            "{}\ncheck it: autotune verify {}\n",
            written.join("\n"),
            names(&mut paths.iter()).join(" ")
        ))?;
    }
    Ok(Exit::Holds)
}

#[derive(Debug, Serialize)]
struct Picked<'a> {
    files: &'a [String],
    gains: &'a Gains,
    goals: &'a [Goal],
    figures: &'a [f64],
}
