//! `autotune tune`: search, certify, judge, report.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use certune::certify::FamilyValues;
use certune::closed_loop::Scenario;
use certune::control::mrac::MracLaw;
use certune::dynamics::{Joints, Model, Robot, mass_matrix};
use certune::tune::filter::DEFAULT_SAMPLES;
use certune::tune::{
    Batch, BatchError, Bench, Evaluation, Gains, Goal, Goals, HeldOut, Objective, Outcome, Question, RunRecord,
    SearchError, SearchSettings, Setting, SimulatedObjective, Source, Space, SpaceFile, Termination, TuneError, Tuned,
    tune,
};
use certune::verify::{Certificate, Claim, Record, Verdict};
use certune::{Answer, ArmCertifier, Growth, Over, StabilityError, family_of};
use serde::Serialize;

use super::claims::{ClaimSummary, claims_in_words, growths, summaries};
use crate::catalogue::{self, GainsSource, SpaceSource, default_preset};
use crate::cli::{Context, ControllerName, Exit, TuneArgs};
use crate::dashboard::Dashboard;
use crate::error::Error;
use crate::interrupt::flag_of_ctrl_c;
use crate::journal::{Header, Journal, Journalled};
use crate::output::{self, table};
use crate::page::{self, FIGURES, Spread, largest_error, percent_of_tail, spread};
use crate::progress::{Terminal, achieved};
use crate::promise::{self, Promised};
use crate::run::{Folder, Run, RunFile};
use crate::sizes::for_joint_count;
use crate::versions::versions;

pub const DEFAULT_BUDGET: usize = 300;
pub const DEFAULT_SEED: u64 = 1;
/// Plants on which every candidate is simulated.
pub const DEFAULT_PLANTS: usize = 8;
/// Plants that judge start and winner.
const HELD_OUT_PLANTS: usize = 200;
/// Plants that are searched for at most, on which the best candidate fares worse than on those that were drawn.
const WORST_PLANTS: u32 = 2;
/// Candidates brought before the certifier at most.
const ATTEMPTS: usize = 12;

/// Everything a run needs, found before anything is computed.
pub struct Plan {
    pub robot: Robot,
    pub family: FamilyValues,
    pub records: Vec<Record>,
    pub space: Space,
    /// What is asked, as the journal holds it.
    pub header: Header,
    pub folder: Folder,
}

#[derive(Debug, Serialize)]
struct Summary<'a> {
    directory: String,
    certified: bool,
    /// Ended by Ctrl-C; `autotune resume` goes on.
    interrupted: bool,
    files: Vec<String>,
    gains: Option<&'a Gains>,
    held_out: Compared,
    /// What the statements of each certificate are about.
    about: Vec<String>,
    claims: Vec<ClaimSummary>,
    elapsed_s: f64,
}

#[derive(Debug, Serialize)]
struct Compared {
    published: Option<Spread>,
    tuned: Option<Spread>,
}

pub fn run(args: &TuneArgs, context: Context) -> Result<Exit, Error> {
    let plan = plan(args)?;
    let progress = watched(&plan, args.dashboard, context)?;
    let existed = plan.folder.path.exists();
    output::prepare_folder(&plan.folder.path)?;
    let outcome = Journal::begin(&plan.folder, &plan.header)
        .and_then(|journal| carry_out(&plan, journal, args.threads, &progress, context));
    if outcome.is_err() && !existed {
        // Only a folder that is empty goes; what keeps it from going is no part of the message.
        let _ = std::fs::remove_dir(&plan.folder.path);
    }
    outcome
}

/// What shows how the run is coming along.
pub fn watched(plan: &Plan, dashboard: bool, context: Context) -> Result<Terminal, Error> {
    let objective = plan.header.question.goals.objective;
    let progress = Terminal::new(context.verbose).after(objective);
    Ok(if dashboard { progress.with(Dashboard::open(&plan.space, objective)?) } else { progress })
}

/// Does what is planned and not in the journal yet.
pub fn carry_out(
    plan: &Plan,
    mut journal: Journal,
    threads: Option<usize>,
    progress: &Terminal,
    context: Context,
) -> Result<Exit, Error> {
    let question = &plan.header.question;
    let outcome = tune_on(plan, &mut journal, threads.unwrap_or(0), progress);
    progress.finish();
    let (run, page, growth) = match outcome {
        Ok(found) => found,
        Err(error) => {
            journal.fail(&error)?;
            return Err(error);
        }
    };
    let files = plan.folder.write(&run, &page).map_err(|error| journal.without_results(error))?;
    let interrupted = run.file.record.termination == Termination::Interrupted;
    if !interrupted {
        journal.finish()?;
    }
    let certified = run.file.record.winner.is_some();
    if context.json {
        let HeldOut { start, tuned } = &run.file.record.held_out;
        output::print_json(&Summary {
            directory: plan.folder.path.display().to_string(),
            certified,
            interrupted,
            files: files.iter().map(|path| path.display().to_string()).collect(),
            gains: run.file.record.tuned(),
            held_out: Compared { published: start.as_ref().map(spread), tuned: tuned.as_ref().map(spread) },
            about: run.certificates.iter().map(|one| one.certificate.document().about.clone()).collect(),
            claims: run
                .certificates
                .iter()
                .zip(&growth)
                .flat_map(|(one, growth)| summaries(&one.certificate, growth))
                .collect(),
            elapsed_s: progress.elapsed_s(),
        })?;
    } else {
        output::print(&in_words(plan, &run, &growth, &files, progress.elapsed_s()))?;
    }
    if interrupted {
        output::say(&format!(
            "interrupted after {} of {} candidates\n  try: `autotune resume {}` to go on",
            run.file.record.evaluations.len(),
            question.search.evaluations,
            plan.folder.path.display()
        ));
        return Ok(Exit::Interrupted);
    }
    Ok(if certified { Exit::Holds } else { Exit::NotCertified })
}

fn plan(args: &TuneArgs) -> Result<Plan, Error> {
    let budget = args.budget.unwrap_or(DEFAULT_BUDGET);
    if budget == 0 {
        return Err(TuneError::from(SearchError::NoBudget).into());
    }
    let robot = catalogue::robot(&args.robot, args.tip.as_deref())?;
    let scenario = catalogue::scenario(args.scenario.as_deref(), &robot)?;
    let source = catalogue::space(args.space.as_deref(), args.controller)?;
    let controller = source.space.controller();
    let inertia_kg_m2 = inertia_kg_m2(&robot, &scenario)?;
    // A run is judged and reported beside the gains that it starts from.
    let (preset, space, start) = started(&source, Some(&inertia_kg_m2))?;
    let SpaceSource { name: space_name, text, .. } = source;
    let goals = Goals { objective: args.objective.unwrap_or(space.goals().objective), ..space.goals().clone() };
    if let (Gains::Mrac(_), Some(goal)) = (&start, goals.from(Source::Proved).first()) {
        return Err(Error::NoFigure { goal: *goal });
    }
    let seed = args.seed.unwrap_or(DEFAULT_SEED);
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(run_name(&robot, controller, seed)));
    let question = Question {
        robot: robot.name().to_owned(),
        robot_sha256: robot.sha256(),
        scenario: scenario.name.clone(),
        versions: versions(),
        goals,
        search: SearchSettings::new(space.method(), budget, seed),
        batch_plants: args.plants.unwrap_or(DEFAULT_PLANTS),
        held_out_plants: HELD_OUT_PLANTS,
        worst_plants: WORST_PLANTS,
        certification_attempts: ATTEMPTS,
    };
    Ok(Plan {
        family: family_of(&scenario.plant_box)?,
        records: catalogue::records(&[])?,
        header: Header {
            robot_file: catalogue::robot_file(&args.robot)?,
            robot: args.robot.clone(),
            tip: args.tip.clone(),
            controller: controller.to_owned(),
            scenario,
            space_name,
            space: text,
            // A path is the machine's business; the record holds the file's name.
            preset: Path::new(&preset)
                .file_name()
                .map_or_else(|| preset.clone(), |name| name.to_string_lossy().into_owned()),
            start,
            question,
        },
        robot,
        space,
        folder: Folder { path },
    })
}

/// The space of a file with the gains at which its search begins, as the space writes them, and their name; neither for a cold start. A start outside the space is refused before
/// anything is computed.
pub fn begun(file: &SpaceFile, inertia_kg_m2: Option<&[f64]>) -> Result<(Space, Option<(String, Gains)>), Error> {
    if file.is_cold() {
        return Ok((file.on(Setting { start: None, inertia_kg_m2 })?, None));
    }
    let controller = if file.controller() == "mrac" { ControllerName::Mrac } else { ControllerName::Aic };
    let preset = file.start().unwrap_or(default_preset(controller)).to_owned();
    let published = GainsSource::find(&preset)?.gains.gains;
    let space = file.on(Setting { start: Some(&published), inertia_kg_m2 })?;
    let start = space.admit(&published)?;
    Ok((space, Some((preset, start))))
}

/// The same for whoever needs a start: the name of the gains, the space, and the gains.
pub fn started(source: &SpaceSource, inertia_kg_m2: Option<&[f64]>) -> Result<(String, Space, Gains), Error> {
    let (space, start) = begun(&source.space, inertia_kg_m2)?;
    let (preset, start) = start.ok_or_else(|| Error::ColdStart { space: source.name.clone() })?;
    Ok((preset, space, start))
}

/// The diagonal of the nominal arm's inertia matrix where the scenario starts.
pub fn inertia_kg_m2(robot: &Robot, scenario: &Scenario) -> Result<Vec<f64>, Error> {
    for_joint_count!(robot.joints(), N => {
        let model = Model::<N>::new(robot).map_err(|source| Error::Robot { file: None, source })?;
        let inertia = mass_matrix(&model, &Joints::from_fn(|joint, _| scenario.start_rad[joint]));
        Ok((0..N).map(|joint| inertia[(joint, joint)]).collect())
    })
    .unwrap_or_else(|| Err(catalogue::too_many_joints(robot)))
}

/// `panda-aic-1`; a URDF may name its robot with anything, a folder may not.
pub fn run_name(robot: &Robot, controller: &str, seed: u64) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') { c } else { '_' };
    let name: String = robot.name().chars().map(plain).take(64).collect();
    format!("{}-{controller}-{seed}", if name.is_empty() { "robot" } else { &name })
}

/// What does not fit, in terms of the files.
pub fn misfit(robot: &Robot, scenario: &Scenario, error: BatchError) -> Error {
    match error {
        BatchError::Task(source) => Error::ScenarioFit {
            scenario: scenario.name.clone(),
            robot: robot.name().to_owned(),
            source: Box::new(source),
        },
        BatchError::NoPlants | BatchError::Plant(_) => Error::Batch(error),
    }
}

/// A run, its page, and the growth that each claim speaks of.
type Made = (Run, String, Vec<Growths>);

fn tune_on(plan: &Plan, journal: &mut Journal, threads: usize, progress: &Terminal) -> Result<Made, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| Error::Threads { threads, source })?;
    let stop = flag_of_ctrl_c()?;
    if let Some(dashboard) = progress.dashboard() {
        dashboard.leave_at(Arc::clone(&stop));
    }
    pool.install(|| {
        for_joint_count!(plan.robot.joints(), N => tune_arm::<N>(plan, journal, &stop, progress))
            .unwrap_or_else(|| Err(catalogue::too_many_joints(&plan.robot)))
    })
}

/// The run and its page.
fn tune_arm<const N: usize>(
    plan: &Plan,
    journal: &mut Journal,
    stop: &AtomicBool,
    progress: &Terminal,
) -> Result<Made, Error> {
    let Plan { robot, header, .. } = plan;
    let Header { scenario, question, start, .. } = header;
    let seed = question.search.seed;
    let misfit = |error| misfit(robot, scenario, error);
    let judge = Batch::<N>::held_out(robot, scenario, seed, question.held_out_plants).map_err(misfit)?;
    let certifier = ArmCertifier::<N>::new(robot, &plan.family)?.with_records(&plan.records, &Over::AllAngles)?;
    if certifier.record().is_none() {
        progress.begin("sampling the arm's constants");
        certifier.constants();
    }
    let objective =
        SimulatedObjective::<N>::new(robot, scenario, seed, question.batch_plants, DEFAULT_SAMPLES).map_err(misfit)?;
    let goals = objective.batch().resolved(question.goals.clone(), start);
    let simulated = objective.with_goals(&goals, &certifier).hardest_first(start);
    let judge = judge.with_goals(&goals.for_comparison());
    if let Some(dashboard) = progress.dashboard() {
        dashboard.respond_with(largest_error::<N>(robot, scenario)?);
    }
    let question = Question { goals, ..question.clone() };
    let objective: Box<dyn Objective> = match start {
        Gains::Aic(_) => Box::new(simulated),
        Gains::Mrac(_) => Box::new(Promised { objective: Box::new(simulated), certifier: &certifier, scenario }),
    };
    let journalled = Journalled::new(&*objective, journal, stop);
    let bench = Bench { objective: &journalled, judge: &judge, progress };
    let mut first_refusal: Option<Vec<Answer>> = None;
    let mut failure: Option<StabilityError> = None;
    let certify = |gains: &Gains| match promise::certify(&certifier, scenario, gains) {
        Ok(certificates) if promise::holds(&certificates) => Ok(certificates),
        Ok(refused) => {
            let reason = refused.last().map(|refusal| why_not(&refusal.certificate)).unwrap_or_default();
            progress.detail(|| format!("          {reason}"));
            first_refusal.get_or_insert(refused);
            Err(reason)
        }
        Err(error) => {
            let reason = error.to_string();
            failure = Some(error);
            Err(reason)
        }
    };
    let Tuned { record, certificate } = tune(question, &plan.space, Some(start), bench, certify)?;
    journalled.failure()?;
    if let Some(error) = failure {
        return Err(error.into());
    }
    let file = RunFile {
        controller: header.controller.clone(),
        preset: header.preset.clone(),
        space_name: header.space_name.clone(),
        scenario: scenario.clone(),
        record,
    };
    let run = Run { file, certificates: certificate.or(first_refusal).unwrap_or_default() };
    progress.begin("writing the report");
    let page = page::page::<N>(&run, robot, &header.robot, &plan.folder)?;
    let growth = run.certificates.iter().map(|one| growths::<N>(robot, &one.certificate));
    let growth = growth.collect::<Result<_, _>>()?;
    Ok((run, page, growth))
}

/// What the simulated refusals of a certificate show, claim by claim.
type Growths = Vec<Option<Growth>>;

/// The claims that do not hold, in a few words.
fn why_not(refusal: &Certificate) -> String {
    let entries = refusal.document().claims.iter().zip(refusal.checked());
    let reasons =
        entries.filter(|(_, checked)| checked.verdict != Verdict::Holds).map(|(entry, checked)| match &entry.claim {
            Claim::Refused(claim) => format!(
                "{} refused: unstable at inertia {} kg m^2, friction {} N m s/rad, gravity stiffness {} N m/rad",
                checked.kind.name(),
                claim.point.inertia_kg_m2,
                claim.point.friction_n_m_s_per_rad,
                claim.point.stiffness_n_m_per_rad
            ),
            Claim::NotProved(claim) => format!("{} not proved: {}", checked.kind.name(), claim.reason.in_words()),
            _ => checked.kind.name().to_owned(),
        });
    reasons.collect::<Vec<_>>().join("; ")
}

/// The limits that runs answer, and on how many held-out plants the tuned gains keep them.
fn limits_kept(record: &RunRecord) -> Option<String> {
    let limits: Vec<String> = record.question.goals.limits.iter().map(ToString::to_string).collect();
    let tuned = record.held_out.tuned.as_ref()?;
    (!limits.is_empty()).then(|| {
        format!(
            "Limits: {}; the tuned gains keep them on {} of {} held-out plants.",
            limits.join(", "),
            tuned.keep_limits(&record.question.goals),
            tuned.plants.len()
        )
    })
}

/// Why no candidate came before the certifier.
fn nobody_came(record: &RunRecord) -> String {
    let best = record.evaluations.iter().min_by_key(|evaluation| (evaluation.outcome, evaluation.index));
    match best.map(|best| best.outcome) {
        Some(Outcome::Violates { limit, .. }) => {
            let limits: Vec<String> = record.question.goals.limits.iter().map(ToString::to_string).collect();
            format!(
                "no candidate keeps the limits ({}); the closest is furthest beyond that of {}",
                limits.join(", "),
                limit.name().replace('-', " ")
            )
        }
        _ => {
            "no candidate was stable and finished the task on every plant, so none came before the certifier".to_owned()
        }
    }
}

/// What a scenario does that no claim about its plant box covers.
pub fn beyond_the_claims(scenario: &Scenario) -> Option<String> {
    let mut parts = Vec::new();
    if !scenario.payloads.is_empty() {
        parts.push("loads attached and released");
    }
    if !scenario.pushes.is_empty() {
        parts.push("pushes");
    }
    if scenario.noise.q_rad > 0.0 || scenario.noise.dq_rad_per_s > 0.0 {
        parts.push("sensor noise");
    }
    (!parts.is_empty()).then(|| {
        format!(
            "Note: the claims speak of the scenario's plant box; its {} are outside them, simulation is the evidence there.",
            parts.join(" and ")
        )
    })
}

/// Under which law published gains were compared, where there are several.
pub fn law_of_the_start(file: &RunFile) -> Option<String> {
    let Gains::Mrac(table) = &file.record.start()?.gains else { return None };
    Some(format!(
        "Note: the gains of {} ran under the law of the search space, {}, which need not be the one that they were published with.",
        file.preset,
        MracLaw::from(table.law)
    ))
}

fn in_words(plan: &Plan, run: &Run, growth: &[Growths], files: &[PathBuf], elapsed_s: f64) -> String {
    let record = &run.file.record;
    let question = &record.question;
    let objective = question.goals.objective;
    let mut text = format!(
        "{} under the {} in {}: {} candidates{}, {elapsed_s:.1} s\n\n",
        question.robot,
        run.file.controller.to_uppercase(),
        question.scenario,
        record.evaluations.len(),
        if question.goals.from(Source::Simulated).is_empty() {
            format!(" for the largest {}", objective.name().replace('-', " "))
        } else {
            format!(" on {} plants", question.batch_plants)
        }
    );
    if objective != Goal::SettlingCost {
        let reached = |evaluation: Option<&Evaluation>| match evaluation.map(|evaluation| evaluation.outcome) {
            Some(Outcome::Certified { cost } | Outcome::Simulated { cost }) => achieved(cost.get(), objective),
            Some(Outcome::Violates { limit, .. }) => format!("beyond the limit of {}", limit.name().replace('-', " ")),
            _ => "not certified".to_owned(),
        };
        let _ =
            writeln!(text, "{}: {}; tuned: {}\n", run.file.preset, reached(record.start()), reached(record.winner()));
    }
    let HeldOut { start, tuned } = &record.held_out;
    let [published, tuned] = [start, tuned].map(|verdict| verdict.as_ref().map(spread));
    let figures = [published, tuned];
    let held_out = format!("{} held-out plants", question.held_out_plants);
    let header = [held_out.as_str(), &run.file.preset, "tuned"];
    text.push_str(&table(&header, &FIGURES.map(|figure| figure.row(&figures))));
    let judged = question.goals.for_comparison();
    let _ = writeln!(
        text,
        "cost: {}, {}; tail: the mean over the worst {} % of the plants",
        judged.objective.name().replace('-', " "),
        judged.objective.cost_unit(),
        percent_of_tail(&question.goals)
    );
    if let Some(kept) = limits_kept(record) {
        text.push_str(&output::wrapped(&kept, 0));
    }
    let _ = writeln!(text);
    let claims =
        run.certificates.iter().zip(growth).map(|(one, growth)| claims_in_words(&one.certificate, growth, false));
    let claims = claims.collect::<Vec<_>>().join("\n");
    match record.winner() {
        Some(_) => text.push_str(&claims),
        None => {
            let reason = match record.certification.len() {
                0 => nobody_came(record),
                1 => "the candidate brought before the certifier does not hold all claims".to_owned(),
                count => format!("none of the {count} candidates brought before the certifier holds all claims"),
            };
            text.push_str(&output::wrapped(&format!("NOT CERTIFIED: {reason}; no gains.toml was written."), 0));
            text.push_str(
                "  try: more friction, a smaller payload or gravity compensation in the scenario's plant box\n\n",
            );
            if !claims.is_empty() {
                let _ = writeln!(text, "The best of them:\n{claims}");
            }
        }
    }
    if let Some(note) = law_of_the_start(&run.file) {
        text.push_str(&output::wrapped(&note, 0));
    }
    if let Some(note) = beyond_the_claims(&run.file.scenario) {
        text.push_str(&output::wrapped(&note, 0));
    }
    let names: Vec<_> = files.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
    let _ = writeln!(text, "\n{}: {}", plan.folder.path.display(), names.join(", "));
    if !run.certificates.is_empty() {
        let paths = plan.folder.certificates(run.file.certificates());
        let paths = paths.iter().take(run.certificates.len()).map(|path| path.display().to_string());
        let _ = writeln!(text, "check it: autotune verify {}", paths.collect::<Vec<_>>().join(" "));
    }
    text
}
