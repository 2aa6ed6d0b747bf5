//! Pole map, and the certified radius against the moves of the scenario.

use super::HALF;
use crate::error::ReportError;
use crate::figure::{Anchor, Axis, Ink, Mark, Plot, on_grid, row_at, span};
use crate::format;
use crate::record::{CertificateRecord, Pole, PoleMap};

/// Dots for one set of gains in one figure.
const MOST_POLES: usize = 1000;

/// All poles; then those near the imaginary axis, where the certified rate can be seen.
pub(super) fn poles(certificate: &CertificateRecord) -> Result<Vec<String>, ReportError> {
    let Some(map) = &certificate.pole_map else { return Ok(Vec::new()) };
    let all = || map.poles.published.iter().chain(&map.poles.tuned);
    let Some((slowest, fastest)) = span(all().map(|pole| pole.re)).map(|(re, edge)| (edge, re)) else {
        return Ok(Vec::new());
    };
    let right = slowest.max(0.0);
    let whole = (fastest.min(-1e-3), right.max(-0.04 * fastest));
    let near = 6.0 * map.certified_rate_per_s.filter(|rate| *rate > 0.0).unwrap_or(0.0).max(-slowest).max(0.2);
    let mut figures = vec![pole_figure(map, "All poles", whole)?];
    if near < -0.7 * fastest {
        figures.push(pole_figure(map, "Poles near the imaginary axis", (-near, right.max(0.12 * near).min(near)))?);
    }
    Ok(figures)
}

fn pole_figure(map: &PoleMap, title: &str, (left, right): (f64, f64)) -> Result<String, ReportError> {
    let inside = |pole: &&Pole| pole.re >= left && pole.re <= right;
    // Poles come in conjugate pairs: the upper half says it all.
    let upper_half =
        |poles: &[Pole]| poles.iter().filter(inside).map(|pole| (pole.re, pole.im.abs())).collect::<Vec<_>>();
    let clouds = [(Ink::Published, upper_half(&map.poles.published)), (Ink::Tuned, upper_half(&map.poles.tuned))];
    let top = span(clouds.iter().flat_map(|(_, cloud)| cloud.iter().map(|(_, im)| *im))).map_or(1.0, |(_, im)| im);
    let x = Axis::padded("real part (1/s)", (left, right), 5);
    let y = Axis::linear("imaginary part (rad/s)", (-0.04 * top.max(0.1), 1.12 * top.max(0.1)), 5);
    let (x_range, y_range) = (x.range(), y.range());

    let mut marks =
        vec![Mark::Block { ink: Ink::Outside, opacity: 0.1, from: (0.0, y_range.0), to: (x_range.1, y_range.1) }];
    let mut heights = Vec::new();
    for (ink, cloud) in clouds {
        let points = on_grid(&cloud, x_range, y_range, (180, 120), MOST_POLES);
        heights.push((ink, cloud.len()));
        marks.push(Mark::Dots { ink, radius: 2.0, opacity: 0.6, points });
    }
    if let Some(rate) = map.certified_rate_per_s.filter(|rate| -rate >= left && *rate > 0.0) {
        marks.push(Mark::Vertical { ink: Ink::Certified, x: -rate });
        // Written where the line is not crossed by it: left of the line in the close view only.
        if rate > 0.1 * (right - left) {
            let text = format!("certified: {}", format::certified(rate, "/s"));
            let at = (-rate, y_range.1);
            marks.push(Mark::Label { ink: Ink::Certified, text, at, shift: (-5.0, 8.0), anchor: Anchor::End });
        }
    }
    let text = "unstable".to_owned();
    let wide_enough = right > 0.22 * (right - left);
    if wide_enough {
        let at = (0.0, y_range.1);
        marks.push(Mark::Label { ink: Ink::Outside, text, at, shift: (5.0, 8.0), anchor: Anchor::Start });
    }
    Plot {
        title: format!("{title} (upper half plane)"),
        description: format!(
            "Poles of the linearised loop at {} configurations, published and tuned gains; stable means left of zero.",
            map.configurations
        ),
        size: (HALF.0, 300.0),
        x,
        y,
        right: 12.0,
        marks,
    }
    .svg()
}

/// One bar a move, the certified radius as a line.
pub(super) fn region(certificate: &CertificateRecord) -> Result<Option<String>, ReportError> {
    let Some(region) = certificate.region.as_ref().filter(|region| !region.steps.is_empty()) else { return Ok(None) };
    let radius = region.radius_rad.filter(|radius| *radius > 0.0);
    let longest = span(region.steps.iter().map(|step| step.size_rad).chain(radius)).map_or(1.0, |(_, longest)| longest);
    let mut marks = Vec::new();
    if let Some(radius) = radius {
        let rows = region.steps.len();
        let (from, to) = ((0.0, row_at(rows) + 0.5), (radius, 0.5));
        marks.push(Mark::Block { ink: Ink::Certified, opacity: 0.14, from, to });
    }
    for (index, step) in region.steps.iter().enumerate() {
        let covered = radius.is_some_and(|radius| step.size_rad <= radius);
        let ink = if covered { Ink::Certified } else { Ink::Candidate };
        let from = (0.0, row_at(index));
        marks.push(Mark::Bar { ink, opacity: 1.0, height: 13.0, from, to_x: step.size_rad });
        // In a column of their own, where no bar and no line crosses them.
        let text = format!("{} {}", format::number(step.size_rad), if covered { "inside" } else { "outside" });
        marks.push(Mark::EndLabel { ink: Ink::Text, text, y: row_at(index) });
    }
    if let Some(radius) = radius {
        marks.push(Mark::Vertical { ink: Ink::Certified, x: radius });
    }
    let edge = radius.map_or_else(|| "none".to_owned(), |radius| format::certified(radius, "rad"));
    Plot {
        title: format!("Certified radius ({edge}) against the moves"),
        description: "One bar for each move of the scenario; the shaded area is covered by the claim.".to_owned(),
        size: (HALF.0, 68.0 + 28.0 * region.steps.len() as f64),
        x: Axis::linear("size of the move, norm over the joints (rad)", (0.0, 1.05 * longest), 4),
        y: Axis::rows(region.steps.iter().map(|step| step.label.clone())),
        right: 92.0,
        marks,
    }
    .svg()
    .map(Some)
}
