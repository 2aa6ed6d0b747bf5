//! The map of learning rates: for which (kappa_mu, kappa_a) the loop is certified, and how fast it decays there.
//!
//! Every cell is decided by the exact check of the claim `exponential`; the box is the one of a certificate, so that whatever its constants
//! rest on holds for the map as well. A cell outside the certified set holds, by the edge theorem, a point of the box whose loop is unstable.

use certune::verify::{AicGains, LoopBox, LoopFamily, Number};
use plotters::coord::Shift;
use plotters::element::{Circle, EmptyElement, Rectangle, Text};
use plotters::prelude::{
    BLACK, ChartBuilder, Color, DrawingArea, IntoDrawingArea, IntoLogRange, RGBColor, SVGBackend, WHITE,
};
use rayon::prelude::*;

/// Decay rates that are told apart, 1/s; the first asks for stability alone.
pub const LEVELS_PER_S: [&str; 6] = ["0", "0.1", "0.25", "0.5", "0.7", "1"];
/// From dark to light, apart in print and for the colour-blind.
const COLOURS: [RGBColor; 6] = [
    RGBColor(68, 1, 84),
    RGBColor(65, 68, 135),
    RGBColor(42, 120, 142),
    RGBColor(34, 168, 132),
    RGBColor(122, 209, 81),
    RGBColor(253, 231, 37),
];
const REFUSED: RGBColor = RGBColor(228, 228, 228);
/// Cells along each axis, and its ends.
const KAPPA_MU: (usize, f64, f64) = (36, 1.0, 100.0);
const KAPPA_A: (usize, f64, f64) = (40, 10.0, 10_000.0);

/// What a panel shows.
pub struct Panel {
    /// Above it.
    pub title: String,
    /// The linearised loops it is about.
    pub range: LoopBox,
}

/// The centre of a cell on a logarithmic axis, in three digits.
fn centre((cells, first, last): (usize, f64, f64), index: usize) -> f64 {
    let share = (index as f64 + 0.5) / cells as f64;
    let x = first * (last / first).powf(share);
    format!("{x:.2e}").parse().unwrap_or(x)
}

fn edges((cells, first, last): (usize, f64, f64), index: usize) -> [f64; 2] {
    [index, index + 1].map(|k| first * (last / first).powf(k as f64 / cells as f64))
}

/// The published gains with other learning rates, on one joint.
pub fn with_learning_rates(published: &AicGains, kappa_mu: f64, kappa_a: f64) -> Option<AicGains> {
    let one = |list: &[Number]| list.first().cloned().map(|number| vec![number]);
    Some(AicGains {
        kappa_mu: vec![Number::decimal(kappa_mu)?],
        kappa_a: vec![Number::decimal(kappa_a)?],
        sigma_q: one(&published.sigma_q)?,
        sigma_dq: one(&published.sigma_dq)?,
        sigma_mu: one(&published.sigma_mu)?,
        sigma_dmu: one(&published.sigma_dmu)?,
        reference_time_constant_s: one(&published.reference_time_constant_s)?,
    })
}

/// The highest of [`LEVELS_PER_S`] that is certified on the box; `None` when not even stability is.
pub fn certified_level(gains: &AicGains, range: &LoopBox) -> Option<usize> {
    let loops = LoopFamily::new(gains).ok()?;
    let holds = |level: &str| level.parse::<Number>().is_ok_and(|rate| loops.decays_on(range, rate.value()).is_ok());
    // Decay at a rate implies decay at every smaller one.
    LEVELS_PER_S.iter().take_while(|level| holds(level)).count().checked_sub(1)
}

/// The levels of all cells, kappa_a row by row.
fn levels(published: &AicGains, range: &LoopBox) -> Vec<Option<usize>> {
    (0..KAPPA_MU.0 * KAPPA_A.0)
        .into_par_iter()
        .map(|cell| {
            let (column, row) = (cell % KAPPA_MU.0, cell / KAPPA_MU.0);
            let gains = with_learning_rates(published, centre(KAPPA_MU, column), centre(KAPPA_A, row))?;
            certified_level(&gains, range)
        })
        .collect()
}

type Drawing<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failure = Box<dyn std::error::Error>;

/// The map as SVG.
///
/// # Errors
/// When a number cannot be drawn, which would be a defect.
pub fn map(published: &AicGains, panels: &[Panel; 2]) -> Result<String, Failure> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (1040, 520)).into_drawing_area();
        root.fill(&WHITE)?;
        let (plots, legend) = root.split_vertically(460);
        let (left, right) = plots.split_horizontally(520);
        for (area, panel) in [left, right].iter().zip(panels) {
            draw(area, published, panel)?;
        }
        key(&legend)?;
        root.present()?;
    }
    Ok(svg)
}

fn draw(area: &Drawing<'_>, published: &AicGains, panel: &Panel) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d((KAPPA_MU.1..KAPPA_MU.2).log_scale(), (KAPPA_A.1..KAPPA_A.2).log_scale())?;
    chart.configure_mesh().disable_mesh().x_desc("kappa_mu").y_desc("kappa_a").draw()?;
    let cells = levels(published, &panel.range);
    chart.draw_series(cells.iter().enumerate().map(|(cell, level)| {
        let [x0, x1] = edges(KAPPA_MU, cell % KAPPA_MU.0);
        let [y0, y1] = edges(KAPPA_A, cell / KAPPA_MU.0);
        let colour = level.map_or(REFUSED, |level| COLOURS[level]);
        Rectangle::new([(x0, y0), (x1, y1)], colour.filled())
    }))?;
    for (kappa_a, label) in [(700.0, "published, simulation"), (200.0, "published, robot")] {
        let mark = EmptyElement::at((11.67, kappa_a))
            + Circle::new((0, 0), 5, WHITE.filled())
            + Circle::new((0, 0), 5, BLACK.stroke_width(2))
            + Rectangle::new([(9, -9), (15 + 6 * i32::try_from(label.len())?, 9)], WHITE.mix(0.85).filled())
            + Text::new(label, (12, -6), ("sans-serif", 12));
        chart.draw_series(std::iter::once(mark))?;
    }
    Ok(())
}

fn key(area: &Drawing<'_>) -> Result<(), Failure> {
    let entries = std::iter::once((REFUSED, "a loop of the box is unstable".to_owned())).chain(
        COLOURS.iter().zip(LEVELS_PER_S).map(|(colour, level)| {
            let words = if level == "0" { "stable".to_owned() } else { format!("rate {level} /s") };
            (*colour, words)
        }),
    );
    let mut x = 60;
    for (colour, words) in entries {
        area.draw(&Rectangle::new([(x, 12), (x + 18, 30)], colour.filled()))?;
        area.draw(&Text::new(words.clone(), (x + 24, 14), ("sans-serif", 14)))?;
        x += 42 + 6 * i32::try_from(words.len())?;
    }
    Ok(())
}
