//! Two or three goals at once: the gains of which none is better in every goal than another.
//!
//! The front is found by sweeps of constraints. Each goal is sought alone first; the ends that this gives span a grid of bounds on all goals but the first, and in each cell of the grid
//! the first goal is sought under the cell's bounds, by Nelder-Mead from the best point that is known for the cell. Every point that was ever measured counts, whichever cell it was measured for.
//!
//! Goals are compared by their costs ([`Goal::cost`]), so that lower is better in each. A point is on the front when no other measured point is at least as good in every goal and better in one.
//!
//! Limits: a front of what was measured. That nothing better exists is not claimed.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use certune_closed_loop::Gains;
use serde::{Deserialize, Serialize};

use crate::goals::{Excess, Goal};
use crate::outcome::{Finite, Outcome};
use crate::search::{Objective, SearchError, SearchSettings, bits, search};
use crate::space::{Method, Space};

/// Share of the evaluations that seek the ends of the front.
const ENDS: f64 = 0.4;
/// Cells of a front of two goals.
const CELLS_OF_TWO: usize = 12;
/// Cells a goal of a front of three.
const CELLS_OF_THREE: usize = 4;
/// Edge of the simplex of a cell, a fraction of each range.
const SIMPLEX: f64 = 0.08;

/// Who measures goals.
pub trait Measure: Sync {
    /// The figures of `goals` in their order, or why there are none: gains that fail, or are beyond a limit.
    ///
    /// # Errors
    /// The outcome of gains that have no figures.
    fn measure(&self, gains: &Gains, goals: &[Goal]) -> Result<Vec<f64>, Outcome>;
}

/// Gains and the figures of the goals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The gains.
    pub gains: Gains,
    /// The figures, in the order of the goals.
    pub figures: Vec<f64>,
}

/// Goals that make no front.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FrontError {
    /// One goal has a best point, and more than three nobody can look at.
    #[error("a front needs 2 or 3 different goals, got {found}")]
    Goals {
        /// How many different ones there are.
        found: usize,
    },
    /// A search was refused.
    #[error(transparent)]
    Search(#[from] SearchError),
}

/// What was measured, and what of it is on the front.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// Every point with figures, in the order in which it was first asked for.
    pub measured: Vec<Measured>,
    /// The places of those on the front, from the best in the first goal on.
    pub front: Vec<usize>,
    /// Evaluations, failed ones included.
    pub evaluations: usize,
}

/// Whether the costs `a` are at least as good as `b` in every goal, and better in one.
fn dominates(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a <= b) && a.iter().zip(b).any(|(a, b)| a < b)
}

fn costs(goals: &[Goal], figures: &[f64]) -> Vec<f64> {
    goals.iter().zip(figures).map(|(goal, figure)| goal.cost(*figure).get()).collect()
}

/// The places of the points that no other dominates, from the best in the first goal on; of equal points the first.
pub fn non_dominated(goals: &[Goal], points: &[Measured]) -> Vec<usize> {
    let costs: Vec<Vec<f64>> = points.iter().map(|point| costs(goals, &point.figures)).collect();
    let is_on_front = |place: &usize| {
        let own = &costs[*place];
        costs.iter().enumerate().all(|(other, found)| !dominates(found, own) && (found != own || other >= *place))
    };
    let mut front: Vec<usize> = (0..points.len()).filter(is_on_front).collect();
    front.sort_by(|a, b| costs[*a][0].total_cmp(&costs[*b][0]).then(a.cmp(b)));
    front
}

/// At most `most` places of a front that lie far apart: its ends, then each time the one that is the farthest from those chosen, goals on the scale of the front's logarithms.
pub fn spread_out(goals: &[Goal], points: &[Measured], front: &[usize], most: usize) -> Vec<usize> {
    let logs: Vec<Vec<f64>> = front
        .iter()
        .map(|place| costs(goals, &points[*place].figures).iter().map(|cost| cost.max(1e-12).ln()).collect())
        .collect();
    let span = |goal: usize| {
        let (low, high) =
            logs.iter().fold((f64::MAX, f64::MIN), |(low, high), log| (low.min(log[goal]), high.max(log[goal])));
        (high - low).max(1e-9)
    };
    let spans: Vec<f64> = (0..goals.len()).map(span).collect();
    let distance = |a: usize, b: usize| -> f64 {
        spans.iter().enumerate().map(|(goal, span)| ((logs[a][goal] - logs[b][goal]) / span).powi(2)).sum()
    };
    let end = |goal: usize| (0..front.len()).min_by(|a, b| logs[*a][goal].total_cmp(&logs[*b][goal]));
    let mut chosen: Vec<usize> = (0..goals.len()).filter_map(end).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.truncate(most);
    while chosen.len() < most.min(front.len()) {
        let nearest = |place: &usize| chosen.iter().map(|other| distance(*place, *other)).fold(f64::MAX, f64::min);
        let left = (0..front.len()).filter(|place| !chosen.contains(place));
        let Some(next) = left.max_by(|a, b| nearest(a).total_cmp(&nearest(b)).then(b.cmp(a))) else { break };
        chosen.push(next);
    }
    chosen.sort_unstable();
    chosen.into_iter().map(|place| front[place]).collect()
}

type Known = HashMap<Vec<Vec<u64>>, Result<Vec<f64>, Outcome>>;

/// A sweep over the cells.
struct Sweep<'a> {
    space: &'a Space,
    goals: &'a [Goal],
    measure: &'a dyn Measure,
    settings: SearchSettings,
    known: Mutex<Known>,
    measured: Vec<Measured>,
    evaluations: usize,
}

/// One goal under bounds on the costs of the others.
struct Cell<'a, 'b> {
    sweep: &'a Sweep<'b>,
    goal: usize,
    bounds: Vec<Option<f64>>,
}

impl Cell<'_, '_> {
    fn outcome(&self, figures: &[f64]) -> Outcome {
        let goals = self.sweep.goals;
        let mut excess = Excess::default();
        for ((goal, figure), bound) in goals.iter().zip(figures).zip(&self.bounds) {
            if let Some(bound) = bound {
                excess.add(*goal, *figure, goal.figure(*bound));
            }
        }
        excess.judge(Outcome::Simulated { cost: goals[self.goal].cost(figures[self.goal]) })
    }
}

impl Objective for Cell<'_, '_> {
    fn evaluate(&self, gains: &Gains, _: Option<Finite>) -> Outcome {
        match self.sweep.figures(gains) {
            Ok(figures) => self.outcome(&figures),
            Err(outcome) => outcome,
        }
    }
}

impl Sweep<'_> {
    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Each gains are measured once.
    fn figures(&self, gains: &Gains) -> Result<Vec<f64>, Outcome> {
        let key = bits(gains);
        if let Some(found) = self.known().get(&key) {
            return found.clone();
        }
        let found = self.measure.measure(gains, self.goals);
        self.known().insert(key, found.clone());
        found
    }

    /// Seeks one goal under bounds, from `start`.
    fn seek(
        &mut self,
        goal: usize,
        bounds: Vec<Option<f64>>,
        start: &Gains,
        method: Method,
        evaluations: usize,
    ) -> Result<(), SearchError> {
        let settings =
            SearchSettings { method, evaluations, simplex_step: SIMPLEX, stop_early: false, ..self.settings };
        let run = search(self.space, Some(start), &settings, &Cell { sweep: self, goal, bounds }, &())?;
        self.evaluations += run.evaluations.len();
        for evaluation in run.evaluations {
            let found = self.known().get(&bits(&evaluation.gains)).cloned();
            let is_new = self.measured.iter().all(|known| known.gains != evaluation.gains);
            if let (Some(Ok(figures)), true) = (found, is_new) {
                self.measured.push(Measured { gains: evaluation.gains, figures });
            }
        }
        Ok(())
    }

    /// The best point that is known for a cell.
    fn best(&self, goal: usize, bounds: &[Option<f64>]) -> Option<Gains> {
        let cell = Cell { sweep: self, goal, bounds: bounds.to_vec() };
        let points = self.measured.iter().map(|point| (cell.outcome(&point.figures), &point.gains));
        points.min_by(|a, b| a.0.cmp(&b.0)).map(|(_, gains)| gains.clone())
    }

    /// The bounds of every cell: on all goals but the first, evenly between the ends on a logarithmic scale.
    fn cells(&self) -> Vec<Vec<Option<f64>>> {
        let ends = |goal: usize| {
            let front = non_dominated(self.goals, &self.measured);
            let costs = front.iter().map(|place| self.goals[goal].cost(self.measured[*place].figures[goal]).get());
            costs.fold((f64::MAX, f64::MIN), |(low, high), cost| (low.min(cost), high.max(cost)))
        };
        let levels =
            |goal: usize, count: usize| -> Vec<f64> {
                let (low, high) = ends(goal);
                let part = |place: usize| (place + 1) as f64 / count as f64;
                (0..count)
                    .map(|place| {
                        if low > 0.0 { low * (high / low).powf(part(place)) } else { low + part(place) * (high - low) }
                    })
                    .collect()
            };
        match self.goals.len() {
            2 => levels(1, CELLS_OF_TWO).into_iter().map(|bound| vec![None, Some(bound)]).collect(),
            _ => {
                let (second, third) = (levels(1, CELLS_OF_THREE), levels(2, CELLS_OF_THREE));
                second.iter().flat_map(|a| third.iter().map(|b| vec![None, Some(*a), Some(*b)])).collect()
            }
        }
    }
}

/// Whether goals make a front.
///
/// # Errors
/// [`FrontError::Goals`] when they are not two or three different ones.
pub fn check(goals: &[Goal]) -> Result<(), FrontError> {
    let mut different = goals.to_vec();
    different.sort_unstable();
    different.dedup();
    if (2..=3).contains(&goals.len()) && different.len() == goals.len() {
        Ok(())
    } else {
        Err(FrontError::Goals { found: different.len() })
    }
}

/// The front of two or three goals. `settings.evaluations` candidates are measured at most; the same settings and measure give the same front.
///
/// # Errors
/// [`FrontError`] when the goals are not two or three different ones, or a search is refused.
pub fn front(
    space: &Space,
    start: &Gains,
    goals: &[Goal],
    settings: &SearchSettings,
    measure: &dyn Measure,
) -> Result<Front, FrontError> {
    check(goals)?;
    let (known, measured) = (Mutex::default(), Vec::new());
    let mut sweep = Sweep { space, goals, measure, settings: *settings, known, measured, evaluations: 0 };
    let open = vec![None; goals.len()];
    let share = ((ENDS * settings.evaluations as f64) as usize / goals.len()).max(1);
    for goal in 0..goals.len() {
        let from = sweep.best(goal, &open).unwrap_or_else(|| start.clone());
        sweep.seek(goal, open.clone(), &from, settings.method, share)?;
    }
    let cells = sweep.cells();
    let count = cells.len();
    for (place, bounds) in cells.into_iter().enumerate() {
        let left = settings.evaluations.saturating_sub(sweep.evaluations);
        let share = left / (count - place);
        let Some(from) = sweep.best(0, &bounds).filter(|_| share > 0) else { break };
        sweep.seek(0, bounds, &from, Method::NelderMead, share)?;
    }
    let front = non_dominated(goals, &sweep.measured);
    Ok(Front { measured: sweep.measured, front, evaluations: sweep.evaluations })
}

#[cfg(test)]
mod tests {
    use super::*;
    use certune_closed_loop::{AicTable, PerJoint};
    use proptest::prelude::*;

    const GOALS: [Goal; 3] = [Goal::SettlingTime, Goal::Jitter, Goal::CertifiedRadius];

    fn point(figures: &[f64]) -> Measured {
        Measured { gains: AicTable::uniform(1.0).into(), figures: figures.to_vec() }
    }

    proptest! {
        #[test]
        fn a_front_is_what_nothing_dominates(figures in proptest::collection::vec(proptest::collection::vec(0.1..10.0_f64, 3), 1..40)) {
            let points: Vec<Measured> = figures.iter().map(|figures| point(figures)).collect();
            let front = non_dominated(&GOALS, &points);
            let better = |a: &[f64], b: &[f64]| a[0] <= b[0] && a[1] <= b[1] && a[2] >= b[2] && a != b;
            for place in 0..points.len() {
                let beaten = figures.iter().any(|other| better(other, &figures[place]));
                prop_assert_eq!(front.contains(&place), !beaten);
            }
            for few in 1..6 {
                let chosen = spread_out(&GOALS, &points, &front, few);
                prop_assert_eq!(chosen.len(), few.min(front.len()));
                prop_assert!(chosen.iter().all(|place| front.contains(place)));
            }
        }
    }

    /// Two bowls whose bottoms lie apart: between them every point is on the front.
    struct Bowls;

    impl Measure for Bowls {
        fn measure(&self, gains: &Gains, goals: &[Goal]) -> Result<Vec<f64>, Outcome> {
            let x = |row: &str| gains.row(row).and_then(PerJoint::shared).map_or(f64::NAN, f64::ln);
            let (a, b) = (x("kappa_mu"), x("kappa_a"));
            let bowl = |centre: f64| 1.0 + (a - centre).powi(2) + b * b;
            Ok(goals.iter().map(|goal| bowl(if *goal == Goal::SettlingTime { 0.0 } else { 1.0 })).collect())
        }
    }

    fn space() -> Space {
        let mut text = "schema = 1\ncontroller = \"aic\"\n[search]\nmethod = \"schedule\"\n[fixed]\n".to_owned();
        for row in ["sigma_q", "sigma_dq", "sigma_mu", "sigma_dmu", "reference_time_constant_s"] {
            text.push_str(&format!("{row} = 1.0\n"));
        }
        for row in ["kappa_mu", "kappa_a"] {
            text.push_str(&format!("[gains.{row}]\nlower = 0.05\nupper = 20.0\nscale = \"log\"\n"));
        }
        crate::space::SpaceFile::parse(std::path::Path::new("space.toml"), &text)
            .unwrap()
            .on(Default::default())
            .unwrap()
    }

    #[test]
    fn the_front_of_two_bowls_is_the_line_between_their_bottoms() {
        let goals = [Goal::SettlingTime, Goal::Jitter];
        let start: Gains = AicTable::uniform(1.0).into();
        let settings = SearchSettings::new(Method::Schedule, 500, 1);
        let found = front(&space(), &start, &goals, &settings, &Bowls).unwrap();
        assert!(found.evaluations <= 500 && found.front.len() >= 12, "{} {}", found.evaluations, found.front.len());
        let chosen = spread_out(&goals, &found.measured, &found.front, 12);
        for place in &chosen {
            let [a, b] = found.measured[*place].figures[..] else { unreachable!() };
            // On the line sqrt(a - 1) + sqrt(b - 1) = 1.
            let off = (a - 1.0).sqrt() + (b - 1.0).sqrt() - 1.0;
            assert!(off.abs() < 0.12, "{a} {b}");
        }
        let again = front(&space(), &start, &goals, &settings, &Bowls).unwrap();
        assert_eq!(found, again);
    }

    #[test]
    fn a_front_needs_two_or_three_different_goals() {
        let start: Gains = AicTable::uniform(1.0).into();
        let settings = SearchSettings::new(Method::Schedule, 10, 1);
        for goals in [vec![Goal::Jitter], vec![Goal::Jitter, Goal::Jitter], Goal::ALL[..4].to_vec()] {
            assert!(matches!(front(&space(), &start, &goals, &settings, &Bowls), Err(FrontError::Goals { .. })));
        }
    }
}
