//! What was learnt, in sentences.

use serde::Serialize;

use crate::answer;
use crate::format;
use crate::record::{Direction, Learnt, NearestLimit, PlantRow, Surface, TuningReport, WorstPlantRow};

/// A gain moves along in a direction when its part is at least this share of the largest.
const MOVES_ALONG: f64 = 0.3;

/// A direction is slack when the cost changes by less than this share of the change along the stiffest.
const SLACK: f64 = 0.2;

/// Below this, costs that the surface has not seen are not predicted.
const TRUSTED: f64 = 0.5;

/// A limit this near, as a share, is what holds the gains back.
const NEAR: f64 = 0.05;

/// The section's words.
#[derive(Debug, Serialize)]
pub(crate) struct LearntView {
    /// How the surface was made and what it is worth, or why there is none.
    surface: String,
    /// The stiffest direction, and the slack ones.
    directions: Vec<String>,
    /// What holds the tuned gains back.
    held_back: Vec<String>,
    /// Plants that were searched for, and what became of the candidate on each.
    worst_plants: Vec<String>,
    /// Whether the maps say where a certificate holds.
    certified: bool,
}

/// Writes the section's words.
pub(crate) fn learnt(record: &TuningReport) -> LearntView {
    let Learnt { surface, no_surface, worst_plants, slices, .. } = &record.learnt;
    LearntView {
        surface: match surface {
            Some(surface) => worth(surface),
            None if no_surface.is_empty() => "The importance of the gains was not measured.".to_owned(),
            None => format!("The importance of the gains is not known: {no_surface}."),
        },
        directions: surface.as_ref().map_or_else(Vec::new, |surface| directions(surface, &record.search.unit)),
        held_back: held_back(record),
        worst_plants: worst_plants.iter().map(worst_plant).collect(),
        certified: slices.iter().any(|slice| !slice.certified.is_empty()),
    }
}

fn percent(share: f64) -> String {
    format!("{}\u{a0}%", format::number(100.0 * share))
}

fn worth(surface: &Surface) -> String {
    let Surface { points, coefficients, reach, r_squared, predicted_r_squared, .. } = surface;
    let trust = if *predicted_r_squared >= TRUSTED {
        ""
    } else {
        " It predicts badly what it has not seen: what it says is a hint at most."
    };
    format!(
        "A quadratic surface was fitted to the cost of the {points} candidates nearest to the tuned gains, up to {} of each range away: {coefficients} coefficients, \
         R² {}, and {} when each cost is predicted from the others.{trust}",
        percent(*reach),
        format::number(*r_squared),
        format::number(*predicted_r_squared),
    )
}

/// The stiffest direction first, then those along which the cost hardly changes, the slackest last.
fn directions(surface: &Surface, unit: &str) -> Vec<String> {
    let Some(stiffest) = surface.directions.first() else { return Vec::new() };
    let moves = |direction: &Direction| {
        let largest = direction.parts.iter().fold(0.0_f64, |largest, part| largest.max(part.abs()));
        let named = surface.gains.iter().zip(&direction.parts).filter(|(_, part)| part.abs() >= MOVES_ALONG * largest);
        let way = |part: f64| if part > 0.0 { "up" } else { "down" };
        named.map(|(gain, part)| format!("{} {}", gain.gain, way(*part))).collect::<Vec<_>>().join(" with ")
    };
    let stiff = format!(
        "Stiff: {}. A tenth of the range changes the cost by {}.",
        moves(stiffest),
        format::with_unit(stiffest.change, unit)
    );
    let slack = surface.directions.iter().skip(1).filter(|direction| direction.change < SLACK * stiffest.change);
    let slack = slack.map(|direction| {
        format!(
            "Slack: {}. The cost hardly changes: {} for a tenth of the range.",
            moves(direction),
            format::with_unit(direction.change, unit)
        )
    });
    std::iter::once(stiff).chain(slack).collect()
}

fn held_back(record: &TuningReport) -> Vec<String> {
    let Learnt { limit, cost_parts, .. } = &record.learnt;
    let on_bound = answer::on_bound(&record.gains);
    let on_bound = if on_bound.is_empty() {
        "No tuned gain lies on a bound of the search.".to_owned()
    } else {
        format!("On a bound of the search: {}. A wider range might do better.", on_bound.join(", "))
    };
    let parts: Vec<String> = cost_parts.iter().map(|part| format!("{} {}", part.name, percent(part.share))).collect();
    let parts =
        (!parts.is_empty()).then(|| format!("What the cost on the nominal arm is made of: {}.", parts.join(", ")));
    let costliest = costliest(&record.held_out.plants).map(|(plant, cost)| {
        format!(
            "The costliest held-out arm is draw {}{}, at {}.",
            plant.index,
            if plant.in_words.is_empty() { String::new() } else { format!(" ({})", plant.in_words) },
            format::with_unit(cost, &record.asked.cost.unit)
        )
    });
    limit.iter().map(nearest).chain(parts).chain(costliest).chain([on_bound]).collect()
}

fn nearest(limit: &NearestLimit) -> String {
    let NearestLimit { in_words, figure_in_words, excess } = limit;
    let found = format!("The nearest limit: {in_words}.");
    match excess.filter(|excess| excess.is_finite()) {
        None => format!("{found} A held-out arm has no such figure, so that the limit is not kept."),
        Some(excess) if excess > 0.0 => {
            format!("{found} The worst held-out arm reaches {figure_in_words}, {} beyond it.", percent(excess))
        }
        Some(excess) if excess > -NEAR => format!(
            "{found} The worst held-out arm reaches {figure_in_words}, {} inside: this limit holds the gains back.",
            percent(-excess)
        ),
        Some(excess) => format!(
            "{found} The worst held-out arm reaches {figure_in_words}, {} inside: no limit holds the gains back.",
            percent(-excess)
        ),
    }
}

/// The plant with the highest cost of the tuned gains; none when one has no cost, which the page says elsewhere.
fn costliest(plants: &[PlantRow]) -> Option<(&PlantRow, f64)> {
    let costs: Option<Vec<(&PlantRow, f64)>> =
        plants.iter().map(|plant| Some((plant, plant.cost.tuned.filter(|cost| cost.is_finite())?))).collect();
    costs?.into_iter().max_by(|(_, a), (_, b)| a.total_cmp(b))
}

fn worst_plant(row: &WorstPlantRow) -> String {
    format!("{}. Candidate {}, the best until then: {}.", format::sentence(&row.in_words), row.candidate, row.outcome)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Share;

    fn surface(directions: Vec<Direction>) -> Surface {
        let gain = |name: &str| Share { gain: name.to_owned(), share: 0.5 };
        Surface { gains: vec![gain("kappa_mu"), gain("sigma_mu")], directions, ..Surface::default() }
    }

    #[test]
    fn a_slack_direction_is_named_and_a_middling_one_is_not() {
        let along = |parts: [f64; 2], change| Direction { parts: parts.to_vec(), change };
        let said = directions(&surface(vec![along([0.8, -0.6], 0.05), along([0.6, 0.8], 0.001)]), "s");
        assert_eq!(
            said[0],
            "Stiff: kappa_mu up with sigma_mu down. A tenth of the range changes the cost by 0.0500\u{a0}s."
        );
        assert!(said[1].starts_with("Slack: kappa_mu up with sigma_mu up. The cost hardly changes"));
        assert_eq!(directions(&surface(vec![along([1.0, 0.1], 0.05), along([-0.1, 1.0], 0.02)]), "s").len(), 1);
        assert!(directions(&surface(Vec::new()), "s").is_empty());
    }

    #[test]
    fn a_surface_that_learnt_by_heart_is_called_a_hint() {
        let with = |predicted_r_squared| worth(&Surface { r_squared: 0.99, predicted_r_squared, ..Surface::default() });
        assert!(with(-0.4).ends_with("a hint at most.") && with(f64::NAN).ends_with("a hint at most."));
        assert!(with(0.9).ends_with("predicted from the others."));
    }

    #[test]
    fn a_limit_is_kept_near_far_or_not_at_all() {
        let said = |excess| {
            nearest(&NearestLimit {
                in_words: "overshoot at most 2 %".to_owned(),
                figure_in_words: "1.9 %".to_owned(),
                excess,
            })
        };
        assert!(said(Some(-0.02)).ends_with("this limit holds the gains back."));
        assert!(said(Some(-0.5)).ends_with("no limit holds the gains back."));
        assert!(said(Some(0.1)).ends_with("10.0\u{a0}% beyond it."));
        assert!(said(None).ends_with("the limit is not kept.") && said(Some(f64::INFINITY)) == said(None));
    }
}
