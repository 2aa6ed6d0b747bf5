//! A search on the whole screen: how the best figure came down, what the best gains do, and where the candidates lie in the box.
//!
//! What is shown is what the search has been told, on the plants it draws; the held-out plants judge at the end and are not looked at before. The first Ctrl-C leaves the screen, so that a
//! second one, which ends the program at once, leaves a terminal in order.

use std::io::{IsTerminal, Stderr, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use certune::tune::{Evaluation, Gains, Goal, Outcome, Space};
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{EnterAlternateScreen, LeaveAlternateScreen};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Style, Stylize as _};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, Gauge, GraphType, Paragraph};
use ratatui::{Frame, Terminal};

use crate::error::Error;

/// Time from one drawing to the next, at least.
const REDRAW: Duration = Duration::from_millis(100);
/// Numbers from here on are no figure of a robot.
const MOST: f64 = 1e6;
/// Candidates whose places are shown.
const RECENT: usize = 30;

/// The gains' largest joint error over time, s and rad.
type Response = Box<dyn Fn(&Gains) -> Vec<(f64, f64)> + Send>;

pub struct Dashboard(Mutex<State>);

struct State {
    /// None when the screen has been left.
    screen: Option<Terminal<CrosstermBackend<Stderr>>>,
    respond: Option<Response>,
    /// Raised by Ctrl-C.
    leave: Option<Arc<AtomicBool>>,
    drawn: Option<Instant>,
    view: View,
}

/// All that is shown.
struct View {
    space: Space,
    objective: Goal,
    began: Instant,
    stage: String,
    done: usize,
    evaluations: usize,
    /// The best figure after so many candidates.
    course: Vec<(f64, f64)>,
    /// The latest candidates in the unit box, the last one at the end.
    recent: Vec<Vec<f64>>,
    best: Option<Evaluation>,
    best_in_words: String,
    response: Vec<(f64, f64)>,
}

impl Dashboard {
    /// Takes the screen.
    pub fn open(space: &Space, objective: Goal) -> Result<Self, Error> {
        if !stderr().is_terminal() {
            return Err(Error::NoTerminal);
        }
        let screen = Terminal::new(CrosstermBackend::new(stderr()));
        let entered = execute!(stderr(), EnterAlternateScreen, Hide);
        let screen = screen.and_then(|screen| entered.map(|()| screen)).map_err(Error::Screen)?;
        let view = View::new(space.clone(), objective);
        Ok(Self(Mutex::new(State { screen: Some(screen), respond: None, leave: None, drawn: None, view })))
    }

    /// What the gains do is found by this.
    pub fn respond_with(&self, respond: impl Fn(&Gains) -> Vec<(f64, f64)> + Send + 'static) {
        self.state().respond = Some(Box::new(respond));
    }

    /// The screen is left once this is raised.
    pub fn leave_at(&self, raised: Arc<AtomicBool>) {
        self.state().leave = Some(raised);
    }

    /// Something begins.
    pub fn stage(&self, what: &str) {
        let mut state = self.state();
        what.clone_into(&mut state.view.stage);
        state.draw();
    }

    /// A candidate has been evaluated.
    pub fn evaluated(
        &self,
        done: usize,
        evaluations: usize,
        evaluation: &Evaluation,
        best: &Evaluation,
        words: String,
    ) {
        if self.state().leave.as_ref().is_some_and(|raised| raised.load(Ordering::Relaxed)) {
            self.close();
        }
        let mut state = self.state();
        let is_new = state.view.evaluated(done, evaluations, evaluation, best, words);
        if is_new && state.screen.is_some() {
            state.view.response = state.respond.as_ref().map(|respond| respond(&best.gains)).unwrap_or_default();
        }
        if state.drawn.is_none_or(|drawn| drawn.elapsed() >= REDRAW) || done == evaluations {
            state.draw();
        }
    }

    /// Gives the screen back; nothing is drawn any more.
    pub fn close(&self) {
        if self.state().screen.take().is_some() {
            // A terminal that is gone is nobody to tell.
            let _ = execute!(stderr(), LeaveAlternateScreen, Show);
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Dashboard {
    fn drop(&mut self) {
        self.close();
    }
}

impl State {
    fn draw(&mut self) {
        self.drawn = Some(Instant::now());
        if let Some(screen) = &mut self.screen {
            let view = &self.view;
            // As above.
            let _ = screen.draw(|frame| view.draw(frame));
        }
    }
}

impl View {
    fn new(space: Space, objective: Goal) -> Self {
        Self {
            space,
            objective,
            began: Instant::now(),
            stage: String::new(),
            done: 0,
            evaluations: 0,
            course: Vec::new(),
            recent: Vec::new(),
            best: None,
            best_in_words: String::new(),
            response: Vec::new(),
        }
    }

    /// Whether the best is another one than before.
    fn evaluated(
        &mut self,
        done: usize,
        evaluations: usize,
        one: &Evaluation,
        best: &Evaluation,
        words: String,
    ) -> bool {
        (self.done, self.evaluations, self.best_in_words) = (done, evaluations, words);
        if self.recent.len() == RECENT {
            self.recent.remove(0);
        }
        self.recent.push(self.space.encode(&one.gains));
        if let Outcome::Simulated { cost } | Outcome::Certified { cost } = best.outcome {
            self.course.push((done as f64, self.objective.figure(cost.get())));
        }
        let is_new = self.best.as_ref().is_none_or(|known| known.index != best.index);
        if is_new {
            self.best = Some(best.clone());
        }
        is_new
    }

    fn draw(&self, frame: &mut Frame<'_>) {
        let rows = self.space.dimension() as u16 + 2;
        let parts = Layout::vertical([
            Constraint::Length(2),
            Constraint::Length(1),
            Constraint::Min(6),
            Constraint::Length(rows),
        ]);
        let [words, progress, charts, gains] = parts.areas(frame.area());
        let head = vec![Line::from(self.stage.as_str()).bold(), Line::from(format!("best: {}", self.best_in_words))];
        frame.render_widget(Paragraph::new(head), words);
        frame.render_widget(self.gauge(), progress);
        let [course, response] = Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]).areas(charts);
        let name = self.objective.name().replace('-', " ");
        chart(frame, course, &format!("best {name}, {}", self.objective.unit()), "candidates", &self.course);
        chart(frame, response, "largest joint error of the best, rad", "s", &self.response);
        self.gains(frame, gains);
    }

    fn gauge(&self) -> Gauge<'_> {
        let share = self.done as f64 / self.evaluations.max(1) as f64;
        let elapsed_s = self.began.elapsed().as_secs_f64();
        let rate = self.done as f64 / elapsed_s.max(1e-3);
        let left_s = self.evaluations.saturating_sub(self.done) as f64 / rate.max(1e-3);
        let label = if self.done == 0 {
            String::new()
        } else {
            format!("{} of {} candidates, {rate:.1}/s, {left_s:.0} s left", self.done, self.evaluations)
        };
        Gauge::default().ratio(share.clamp(0.0, 1.0)).label(label).use_unicode(true)
    }

    /// A line for each free gain: its bounds, the latest candidates between them, the best one, and how far the latest spread.
    fn gains(&self, frame: &mut Frame<'_>, area: Rect) {
        let best = self.best.as_ref().map(|best| self.space.encode(&best.gains)).unwrap_or_default();
        let width = usize::from(area.width.saturating_sub(64)).clamp(10, 120);
        let lines = self.space.knobs().iter().enumerate().map(|(knob, what)| {
            let mut strip = vec!['─'; width];
            let at = |place: f64| ((place * width as f64) as usize).min(width - 1);
            let places: Vec<f64> = self.recent.iter().filter_map(|point| point.get(knob).copied()).collect();
            places.iter().for_each(|place| strip[at(*place)] = '•');
            if let Some(place) = best.get(knob) {
                strip[at(*place)] = '◆';
            }
            let value = self.best.as_ref().map_or(f64::NAN, |best| what.value(&best.gains));
            let strip: String = strip.into_iter().collect();
            let (lower, upper) = (what.range.lower, what.range.upper);
            Line::from(format!(
                "{:<26} {value:>10.4} {lower:>8} {strip} {upper:<8} ±{:.2}",
                what.name,
                deviation(&places)
            ))
        });
        let title =
            format!("the gains in their box: ◆ best, • the latest {RECENT}, ± their spread, 1 is the whole box");
        frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()).block(Block::bordered().title(title)), area);
    }
}

/// Standard deviation; 0 of fewer than two numbers.
fn deviation(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// A curve with its axes from the least to the largest value; what lies beyond every scale of a robot is left out.
fn chart(frame: &mut Frame<'_>, area: Rect, title: &str, along: &str, points: &[(f64, f64)]) {
    let block = Block::bordered().title(title);
    let shown: Vec<(f64, f64)> = points.iter().copied().filter(|(x, y)| x.abs() < MOST && y.abs() < MOST).collect();
    if shown.is_empty() {
        frame.render_widget(block, area);
        return;
    }
    let span = |value: fn(&(f64, f64)) -> f64| {
        let values = || shown.iter().map(value);
        let (low, high) = (values().fold(MOST, f64::min), values().fold(-MOST, f64::max));
        let room = (1e-6 * low.abs().max(high.abs()) - (high - low)).max(1e-6);
        [low - room, high + room]
    };
    let (x, y) = (span(|point| point.0), span(|point| point.1));
    let curve =
        Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(Style::new().cyan()).data(&shown);
    let x = Axis::default().bounds(x).labels(x.map(|bound| format!("{:.0} {along}", bound.round() + 0.0)));
    let y = Axis::default().bounds(y).labels(y.map(|bound| format!("{bound:.4}")));
    frame.render_widget(Chart::new(vec![curve]).block(block).x_axis(x).y_axis(y), area);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue;
    use certune::tune::{Finite, Phase};
    use proptest::prelude::*;
    use ratatui::backend::TestBackend;

    fn view() -> View {
        let source = catalogue::space(None, None).unwrap();
        let (_, space, _) = crate::commands::tune::started(&source, None).unwrap();
        View::new(space, Goal::SettlingTime)
    }

    fn shown(view: &View, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    fn candidate(view: &View, index: usize, point: &[f64], cost: f64) -> Evaluation {
        Evaluation {
            index,
            round: 0,
            phase: Phase::Start,
            gains: view.space.decode(point),
            outcome: Outcome::Simulated { cost: Finite::new(cost).unwrap() },
        }
    }

    #[test]
    fn it_shows_the_best_and_where_it_lies() {
        let mut view = view();
        "searching".clone_into(&mut view.stage);
        let first = candidate(&view, 0, &[0.5; 5], 4.0);
        let second = candidate(&view, 1, &[0.0, 1.0, 0.2, 0.7, 0.9], 3.0);
        assert!(view.evaluated(1, 10, &first, &first, "settling time 4.0000 s".to_owned()));
        assert!(view.evaluated(2, 10, &second, &second, "settling time 3.0000 s".to_owned()));
        assert!(!view.evaluated(3, 10, &first, &second, "settling time 3.0000 s".to_owned()));
        let text = shown(&view, 120, 40);
        for words in [
            "searching",
            "best: settling time 3.0000 s",
            "3 of 10 candidates",
            "kappa_mu",
            "sigma_dmu",
            "4.0000",
            "◆",
            "•",
        ] {
            assert!(text.contains(words), "{words} is missing:\n{text}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn nothing_breaks_it(
            width in 1..300_u16,
            height in 1..80_u16,
            costs in proptest::collection::vec(-1e300..1e300_f64, 0..40),
            response in proptest::collection::vec((any::<f64>(), any::<f64>()), 0..20),
        ) {
            let mut view = view();
            for (index, cost) in costs.iter().enumerate() {
                let one = candidate(&view, index, &[cost.abs().fract(); 5], *cost);
                view.evaluated(index + 1, costs.len(), &one, &one, String::new());
            }
            view.response = response;
            shown(&view, width, height);
        }
    }
}
