//! Curves over time: small multiples, one panel a joint; a lone panel is wide and names its curves.

use super::cast::Cast;
use super::figures::Drawn;
use crate::error::ReportError;
use crate::figure::span;
use crate::format;
use crate::panels::over_time::{Curve, OverTime};
use crate::panels::{PHONE, THIRD, TwoWidths};
use crate::record::{ResponsePanel, Responses};

/// A joint that moves less than this part of the one that moves most counts as resting.
const RESTING: f64 = 0.02;

/// # Errors
/// [`ReportError::Draw`] and [`ReportError::Json`].
pub(super) fn draw(responses: &Responses, cast: Cast<'_>) -> Result<Drawn<'static>, ReportError> {
    let largest = |values: fn(&ResponsePanel) -> &[f64]| {
        let sizes = responses.panels.iter().filter_map(|panel| span(values(panel).iter().copied()));
        sizes.map(|(lower, upper)| upper - lower).fold(0.0, f64::max)
    };
    let goals = largest(|panel| &panel.goal);
    let curves = largest(|panel| panel.curves.first().map_or(&[], |curve| &curve.value));
    let scale = if goals > 0.0 { goals } else { curves };
    let figure = |panel| over_time(responses, panel, cast, scale);
    if let [panel] = &responses.panels[..] {
        let figure = figure(panel);
        // On a phone names at the ends would leave no room for the curves.
        let plot = |size: (f64, f64)| figure.plot(size, size.0 > PHONE.0);
        let both = match figure.readings() {
            Some(readings) => TwoWidths::with(plot, &readings),
            None => TwoWidths::new(plot),
        };
        return Ok(Drawn { wide: Some(both?), ..Drawn::default() });
    }
    let small = responses.panels.iter().map(|panel| figure(panel).svg(THIRD)).collect::<Result<_, _>>()?;
    Ok(Drawn { small, ..Drawn::default() })
}

fn over_time<'a>(responses: &'a Responses, panel: &'a ResponsePanel, cast: Cast<'a>, scale: f64) -> OverTime<'a> {
    let Responses { time_s, quantity, unit, band, moments, .. } = responses;
    let of_unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    let curves: Vec<Curve<'a>> = panel
        .curves
        .iter()
        .filter_map(|curve| {
            let player = cast.player(&curve.controller)?;
            let band = (!curve.lower.is_empty()).then_some((&curve.lower[..], &curve.upper[..]));
            Some(Curve { name: player.name, ink: player.ink, time_s, value: &curve.value, band })
        })
        .collect();
    let ends = curves.iter().filter_map(|curve| {
        let last = curve.value.iter().rev().find(|value| value.is_finite())?;
        Some(format!("{} ends at {}", curve.name, format::with_unit(*last, unit)))
    });
    let description = ends.collect::<Vec<_>>().join("; ");
    let bands = if band.is_empty() { String::new() } else { format!(" Bands: {band}.") };
    OverTime {
        title: format!("{} of {} over time", format::sentence(quantity), panel.name),
        description: format!("{description}.{bands}"),
        caption: format!("{}{of_unit}", panel.name),
        unit,
        goal: (!panel.goal.is_empty()).then_some((&time_s[..], &panel.goal[..])),
        limits: panel.limits.iter().map(|limit| (limit.name.as_str(), limit.value)).collect(),
        moments: moments.iter().map(|moment| (moment.name.as_str(), moment.time_s)).collect(),
        curves,
        least: RESTING * scale,
        reach: scale,
    }
}
