//! How a run is coming along: bars on stderr with rate and time left, nothing when stderr is no terminal.

use std::fmt::Write;
use std::time::{Duration, Instant};

use certune::tune::{Evaluation, Goal, Outcome, Progress, Source, Stage, TuneProgress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::dashboard::Dashboard;
use crate::output;

const SPINNER: &str = "  {spinner} {msg}";
const SHARE: &str = "  {msg} {bar:32} {percent}%, {eta} left";
const BAR: &str = "  search {bar:32} {pos}/{len} candidates, {rate}, {eta} left, {msg}";

/// Steps of a bar that is told shares.
const SHARES: u64 = 1000;

/// One line on a terminal, redrawn; with `verbose`, lines that stay as well.
pub struct Terminal {
    bar: ProgressBar,
    verbose: bool,
    objective: Goal,
    began: Instant,
    dashboard: Option<Dashboard>,
}

impl Terminal {
    pub fn new(verbose: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        Self { bar, verbose, objective: Goal::SettlingCost, began: Instant::now(), dashboard: None }
    }

    /// The same for a search after another objective than the settling cost.
    pub fn after(self, objective: Goal) -> Self {
        Self { objective, ..self }
    }

    /// The same on the whole screen: no line, and none that stays.
    pub fn with(self, dashboard: Dashboard) -> Self {
        self.bar.set_draw_target(ProgressDrawTarget::hidden());
        Self { verbose: false, dashboard: Some(dashboard), ..self }
    }

    pub fn dashboard(&self) -> Option<&Dashboard> {
        self.dashboard.as_ref()
    }

    /// An outcome in words.
    fn in_words(&self, outcome: Outcome) -> String {
        in_words(outcome, self.objective)
    }

    /// Something without a measurable length begins.
    pub fn begin(&self, what: &str) {
        self.bar.set_style(style(SPINNER));
        self.bar.set_message(what.to_owned());
        self.bar.enable_steady_tick(Duration::from_millis(120));
        if let Some(dashboard) = &self.dashboard {
            dashboard.stage(what);
        }
        self.detail(|| format!("[{:5.1} s] {what}", self.began.elapsed().as_secs_f64()));
    }

    /// Something that tells which share of it is done begins.
    pub fn begin_share(&self, what: &str) {
        self.bar.reset();
        self.bar.disable_steady_tick();
        self.bar.set_style(style(SHARE));
        self.bar.set_length(SHARES);
        self.bar.set_message(what.to_owned());
        self.detail(|| format!("[{:5.1} s] {what}", self.began.elapsed().as_secs_f64()));
    }

    /// The share that is done, from any thread.
    pub fn share(&self, done: f64) {
        self.bar.set_position((done.clamp(0.0, 1.0) * SHARES as f64) as u64);
    }

    /// A line that stays, for those who asked for more.
    pub fn detail(&self, line: impl FnOnce() -> String) {
        if self.verbose {
            self.bar.suspend(|| output::say(&line()));
        }
    }

    /// Wipes the line, or leaves the screen.
    pub fn finish(&self) {
        if let Some(dashboard) = &self.dashboard {
            dashboard.close();
        }
        self.bar.finish_and_clear();
    }

    pub fn elapsed_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }
}

/// The template is a constant; should it not parse, a plain bar does as well.
fn style(template: &str) -> ProgressStyle {
    let rate = |state: &ProgressState, text: &mut dyn Write| {
        // A text that cannot be written to is nobody to tell.
        let _ = write!(text, "{:.1}/s", state.per_sec());
    };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()).with_key("rate", rate)
}

/// What a cost means.
pub fn achieved(cost: f64, objective: Goal) -> String {
    let figure = objective.figure(cost);
    match objective {
        Goal::SettlingCost => format!("cost {figure:.4} s"),
        Goal::Overshoot => format!("overshoot {:.3} %", 100.0 * figure),
        _ => format!("{} {figure:.4} {}", objective.name().replace('-', " "), objective.unit()),
    }
}

/// An outcome in words.
fn in_words(outcome: Outcome, objective: Goal) -> String {
    match outcome {
        Outcome::Certified { cost } => format!("certified, {}", achieved(cost.get(), objective)),
        Outcome::Simulated { cost } => achieved(cost.get(), objective),
        Outcome::Stopped { cost_above } => format!("given up above {}", achieved(cost_above.get(), objective)),
        Outcome::Uncertified { cost } if objective.source() != Source::Proved => {
            format!("not certified, {}", achieved(cost.get(), objective))
        }
        Outcome::Violates { excess, limit } => {
            format!(
                "beyond the limit of {} (all limits together by {:.1} %)",
                limit.name().replace('-', " "),
                100.0 * excess.get()
            )
        }
        Outcome::Uncertified { .. } => "not certified".to_owned(),
        Outcome::Unstable { abscissa_per_s } => format!("unstable, grows at {:.3} /s", abscissa_per_s.get()),
        Outcome::Diverged { at_s } => format!("diverged at {:.3} s", at_s.get()),
    }
}

impl Progress for Terminal {
    fn evaluated(&self, done: usize, evaluations: usize, evaluation: &Evaluation, best: &Evaluation) {
        self.bar.set_length(evaluations as u64);
        self.bar.set_position(done as u64);
        self.bar.set_message(format!("best {}", self.in_words(best.outcome)));
        if let Some(dashboard) = &self.dashboard {
            dashboard.evaluated(done, evaluations, evaluation, best, self.in_words(best.outcome));
        }
        if evaluation.index == best.index {
            self.detail(|| {
                format!(
                    "[{:5.1} s] candidate {}: {}",
                    self.elapsed_s(),
                    evaluation.index,
                    self.in_words(evaluation.outcome)
                )
            });
        }
    }
}

impl TuneProgress for Terminal {
    fn stage(&self, stage: Stage<'_>) {
        match stage {
            Stage::Search => {
                self.bar.reset();
                self.bar.disable_steady_tick();
                self.bar.set_style(style(BAR));
                self.bar.set_message("first candidate");
                if let Some(dashboard) = &self.dashboard {
                    dashboard.stage("searching");
                }
                self.detail(|| format!("[{:5.1} s] search", self.elapsed_s()));
            }
            Stage::WorstPlant { round } => {
                self.begin(&format!("looking for plants that are worse for the best candidate (round {round})"));
            }
            Stage::Certify { attempt, candidate } => {
                self.begin(&format!(
                    "certifying candidate {} (attempt {attempt}), {}",
                    candidate.index,
                    self.in_words(candidate.outcome)
                ));
            }
            Stage::Judge => self.begin("judging on held-out plants"),
        }
    }
}
