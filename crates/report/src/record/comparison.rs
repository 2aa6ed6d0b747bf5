//! What a comparison of controllers hands to the page: plain data, no behaviour.
//!
//! A controller is named by its `id` in every figure and table, so that it has one colour everywhere. Series that share a
//! time base have its length; NaN is a gap, for instance after a run was stopped. Strings are plain text, never markup.

use serde::{Deserialize, Serialize};

use super::series;
use super::{CommandLine, Version};

/// A comparison of controllers with what a paper says about them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparisonReport {
    /// Above the headline: the paper, the robot, the seed.
    pub about: String,
    /// The result in one sentence that needs no knowledge of control.
    pub headline: String,
    /// The first screen: what came out, one sentence an entry.
    pub answer: Vec<String>,
    /// What the answer rests on, one an entry: the arms, the friction, the step of the loop, what was left out.
    pub assumptions: Vec<String>,
    /// Those compared, in the order of every legend.
    pub controllers: Vec<Controller>,
    /// The statements of the paper, one after the other.
    pub statements: Vec<Statement>,
    /// What was found beside the statements, for instance mistakes of released code and what they change.
    pub findings: Vec<Finding>,
    /// The experiments.
    pub experiments: Vec<Experiment>,
    /// Some of the runs as moving stick figures.
    pub replay: Option<Replay>,
    /// Commands with which a reader repeats the comparison.
    pub commands: Vec<CommandLine>,
    /// How it was done, one paragraph an entry.
    pub method: Vec<String>,
    /// Software that took part.
    pub versions: Vec<Version>,
}

/// One of those compared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// What figures and tables call it by: small letters, digits and hyphens.
    pub id: String,
    /// Short name, as it stands beside a curve: at most about 20 letters.
    pub name: String,
    /// What it is: law, gains and their source.
    pub in_words: String,
    /// Its colour; no two controllers of a page share one.
    pub ink: ControllerInk,
}

/// The colours of controllers: the active inference controllers are cool, the adaptive ones warm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerInk {
    /// AIC with published gains.
    AicPublished,
    /// AIC with tuned gains.
    AicTuned,
    /// A further AIC, for instance with the gains of the robot.
    AicOther,
    /// MRAC as the released code has it.
    MracCode,
    /// MRAC as the equations of the paper have it.
    MracPaper,
    /// MRAC with tuned gains.
    MracTuned,
    /// A controller of another kind.
    Baseline,
}

/// A statement of the paper, and what was measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statement {
    /// Its number on the page; no two are the same.
    pub number: u32,
    /// Where the paper says it, for instance `V-A, fig. 4`.
    pub section: String,
    /// What the paper says, in our words.
    pub statement: String,
    /// What was measured, with figures and units.
    pub measured: String,
    /// What follows.
    pub agreement: Agreement,
    /// What must hold for the statement to agree; for [`Agreement::AgreesOnlyIf`] only, otherwise empty.
    pub condition: String,
    /// `id` of the figure that shows it.
    pub figure: Option<String>,
    /// The command that measures it; may be empty.
    pub command: String,
}

/// Whether measurements agree with a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Agreement {
    /// They do.
    Agrees,
    /// They do under a condition that the statement does not name.
    AgreesOnlyIf,
    /// They do not.
    DoesNotAgree,
}

/// Something found beside the statements.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    /// In a few words.
    pub title: String,
    /// What it is and what it changes.
    pub text: String,
}

/// One experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Small letters, digits and hyphens; no two experiments or figures of a page share one.
    pub id: String,
    /// In a few words.
    pub title: String,
    /// What it asks.
    pub question: String,
    /// What came out.
    pub answer: String,
    /// How it was done, one paragraph an entry.
    pub method: Vec<String>,
    /// Figures, in order.
    pub figures: Vec<ExperimentFigure>,
    /// Tables, after the figures.
    pub tables: Vec<FigureTable>,
    /// Commands that repeat it.
    pub commands: Vec<CommandLine>,
}

/// One figure of an experiment; it may have several panels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentFigure {
    /// Small letters, digits and hyphens; statements name it.
    pub id: String,
    /// Stands above it.
    pub title: String,
    /// Stands below it: what is to be seen; may be empty.
    pub caption: String,
    /// What it shows.
    pub drawing: Drawing,
}

/// The kinds of figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drawing {
    /// Curves over time, one panel a joint.
    Responses(Responses),
    /// Every arm a dot, with median and quartiles.
    Spread(Spread),
    /// One quantity over another.
    Lines(Lines),
    /// What happened where: rows against columns, in words.
    Grid(OutcomeGrid),
}

/// Curves over time, in small multiples.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Responses {
    /// The times of every series of the figure, rising.
    #[serde(with = "series")]
    pub time_s: Vec<f64>,
    /// What is shown, for instance `angle`.
    pub quantity: String,
    /// Its unit, empty when it has none.
    pub unit: String,
    /// What the bands of the curves are, for instance `5 to 95 % of 200 arms`; empty when there are none.
    pub band: String,
    /// What happened when, in every panel.
    pub moments: Vec<Moment>,
    /// One panel a joint.
    pub panels: Vec<ResponsePanel>,
}

/// One panel of [`Responses`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponsePanel {
    /// Name, for instance `joint 1`.
    pub name: String,
    /// The goal at each time; empty when there is none.
    #[serde(with = "series")]
    pub goal: Vec<f64>,
    /// Horizontal lines, drawn where they are near the curves.
    pub limits: Vec<Limit>,
    /// The curves, at most one a controller.
    pub curves: Vec<ResponseCurve>,
}

/// One curve over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResponseCurve {
    /// `id` of the controller.
    pub controller: String,
    /// Value at each time; NaN where there is none.
    #[serde(with = "series")]
    pub value: Vec<f64>,
    /// Lower end of the band at each time; empty when there is none.
    #[serde(with = "series")]
    pub lower: Vec<f64>,
    /// Upper end of the band at each time; empty when there is none.
    #[serde(with = "series")]
    pub upper: Vec<f64>,
}

/// A value with a name: a limit or a budget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// What it is, in a few words; may be empty.
    pub name: String,
    /// Where it lies, in the unit of the axis.
    pub value: f64,
}

/// A time with a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moment {
    /// What happened, in a word or two.
    pub name: String,
    /// When.
    pub time_s: f64,
}

/// Figures of merit over many arms, one panel a figure of merit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// The panels.
    pub panels: Vec<SpreadPanel>,
}

/// One figure of merit over many arms; lower is better.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpreadPanel {
    /// What is shown.
    pub quantity: Quantity,
    /// The clouds of dots, the first at the top.
    pub rows: Vec<SpreadRow>,
}

/// The arms of one controller under one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpreadRow {
    /// `id` of the controller.
    pub controller: String,
    /// The condition, for instance `0.7 kg`; rows of one condition stand together; may be empty.
    pub category: String,
    /// One value an arm; NaN where it has none because the run did not finish.
    #[serde(with = "series")]
    pub values: Vec<f64>,
}

/// What an axis shows.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// Name.
    pub name: String,
    /// Unit, empty when it has none.
    pub unit: String,
    /// Equal ratios instead of equal distances; values that are not positive are then drawn on the edge.
    pub log: bool,
}

/// One quantity over another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lines {
    /// Horizontal axis.
    pub x: Quantity,
    /// Vertical axis.
    pub y: Quantity,
    /// Horizontal lines, for instance a budget.
    pub limits: Vec<Limit>,
    /// The curves.
    pub series: Vec<LineSeries>,
}

/// One curve of [`Lines`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineSeries {
    /// `id` of the controller.
    pub controller: String,
    /// What tells it from the other curves of the same controller; may be empty.
    pub name: String,
    /// Horizontal coordinates, rising.
    #[serde(with = "series")]
    pub x: Vec<f64>,
    /// Vertical coordinates; NaN where there is none.
    #[serde(with = "series")]
    pub y: Vec<f64>,
    /// Lower end of a band; empty when there is none.
    #[serde(with = "series")]
    pub lower: Vec<f64>,
    /// Upper end of a band; empty when there is none.
    #[serde(with = "series")]
    pub upper: Vec<f64>,
}

/// What happened where.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutcomeGrid {
    /// What the rows are, for instance `controller`.
    pub row_name: String,
    /// Names of the columns, for instance conditions.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<GridRow>,
}

/// One row of an [`OutcomeGrid`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridRow {
    /// `id` of the controller whose row it is, if of one.
    pub controller: Option<String>,
    /// Name; may be empty when the controller says it all.
    pub name: String,
    /// One cell a column.
    pub cells: Vec<GridCell>,
}

/// One cell of an [`OutcomeGrid`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridCell {
    /// What happened.
    pub outcome: Outcome,
    /// More in a few words, for instance `joint 2 overspeeds at 0.25 s`; may be empty.
    pub detail: String,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The task was done.
    Worked,
    /// The task was done, but the arm or its torques jittered.
    WorkedWithJitter,
    /// The run ended, but the goal was missed.
    Missed,
    /// The safety monitor stopped the arm.
    SafetyStop,
    /// Nothing was run.
    NotRun,
}

/// A table of figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FigureTable {
    /// Stands above it.
    pub caption: String,
    /// What the rows are, for instance `controller`.
    pub row_name: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<TableRow>,
}

/// A column of a [`FigureTable`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Unit, empty when it has none.
    pub unit: String,
}

/// A row of a [`FigureTable`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRow {
    /// `id` of the controller whose row it is, if of one.
    pub controller: Option<String>,
    /// Name; may be empty when the controller says it all.
    pub name: String,
    /// One cell a column.
    pub cells: Vec<Cell>,
}

/// What a cell of a table holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number, shown with three significant digits; `None` where it does not exist.
    Number(Option<f64>),
    /// Words.
    Text(String),
}

/// Runs as moving stick figures, side by side.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Replay {
    /// What is to be seen, in a sentence.
    pub caption: String,
    /// Time between two frames.
    pub step_s: f64,
    /// The runs; a shorter one stands still at its end.
    pub runs: Vec<ReplayRun>,
}

/// One run of a [`Replay`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReplayRun {
    /// `id` of the controller.
    pub controller: String,
    /// What is said when it stands still before the others, for instance `safety stop at 0.25 s`; may be empty.
    pub end: String,
    /// `[frame][point]`: origins of the joints from base to tip, then the flange or hand, as x, y, z in m; z is up.
    pub frames_m: Vec<Vec<[f64; 3]>>,
}
