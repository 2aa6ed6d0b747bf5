//! The certificates as the page shows them: claims with margins, the pole map, the radius against the moves.

use std::path::PathBuf;

use certune::closed_loop::Gains;
use certune::dynamics::Robot;
use certune::report::{
    Assumption, CertificateRecord, Claim, GoalStep, Grade, Margin, Pair, Pole, PoleMap, RegionRecord, Verdict,
};
use certune::verify::{self, Certificate, Checked};
use certune::{StabilityError, poles_per_s};
use num_traits::ToPrimitive;

use super::runs::label;
use crate::commands::claims::{growth_in_words, growths};
use crate::error::Error;
use crate::run::{Folder, Run};

/// Configurations, each with a plant, of the pole map.
const CONFIGURATIONS: usize = 120;

/// The evidence of a run.
pub fn evidence<const N: usize>(run: &Run, robot: &Robot, gains: &Pair<Gains>) -> Result<CertificateRecord, Error> {
    let poles = poles::<N>(run, robot, gains)?;
    let slowest = poles.iter().flat_map(|poles| &poles.tuned).map(|pole| pole.re).reduce(f64::max);
    let claims = || run.certificates.iter().flat_map(|one| &one.certificate.document().claims);
    let find = |value: fn(&verify::Claim) -> Option<f64>| claims().find_map(|entry| value(&entry.claim));
    let certified_rate_per_s = find(|claim| match claim {
        verify::Claim::Exponential(claim) => Some(claim.rate_per_s.to_f64()),
        _ => None,
    });
    let radius_rad = find(|claim| match claim {
        verify::Claim::Region(claim) => Some(claim.radius_rad.to_f64()),
        _ => None,
    });
    let mut rows = Vec::new();
    for certune::Answer { certificate, .. } in &run.certificates {
        let entries = certificate.document().claims.iter().zip(certificate.checked());
        for ((entry, checked), growth) in entries.zip(growths::<N>(robot, certificate)?) {
            let mut row = claim_row(&entry.claim, checked, certificate, slowest);
            row.counterexample.extend(growth.as_ref().map(growth_in_words));
            rows.push(row);
        }
    }
    let joined = |words: Vec<String>| words.join(", ");
    let files = Folder { path: PathBuf::new() }.certificates(run.file.certificates());
    let files = files.iter().take(run.certificates.len()).map(|path| path.display().to_string());
    let hashes = run.certificates.iter().map(|one| one.certificate.document().sha256.clone());
    let map = |poles| PoleMap { configurations: CONFIGURATIONS as u64, poles, certified_rate_per_s };
    Ok(CertificateRecord {
        file_name: joined(files.collect()),
        sha256: joined(hashes.collect()),
        claims: rows,
        pole_map: poles.map(map),
        // The region's claim is about any goal; the adaptive controller's is about motions near one.
        region: match gains.tuned {
            Gains::Aic(_) if !run.certificates.is_empty() => Some(RegionRecord { radius_rad, steps: steps(run) }),
            Gains::Aic(_) | Gains::Mrac(_) => None,
        },
    })
}

/// The poles of an AIC's linearised loops. The adaptive controller's gains do not rest, so that its loop has none.
fn poles<const N: usize>(run: &Run, robot: &Robot, gains: &Pair<Gains>) -> Result<Option<Pair<Vec<Pole>>>, Error> {
    let seed = run.file.record.question.search.seed;
    let of = |gains: &Gains| -> Result<Option<Vec<Pole>>, Error> {
        let Gains::Aic(table) = gains else { return Ok(None) };
        let gains = table.bind().map_err(StabilityError::from)?;
        let poles = poles_per_s::<N>(robot, &run.file.scenario.plant_box, &gains, CONFIGURATIONS, seed)?;
        Ok(Some(poles.into_iter().map(|[re, im]| Pole { re, im }).collect()))
    };
    Ok(of(&gains.published)?.zip(of(&gains.tuned)?).map(|(published, tuned)| Pair { published, tuned }))
}

fn grade(grade: verify::Grade) -> Grade {
    match grade {
        verify::Grade::Conditional => Grade::Conditional,
        verify::Grade::Proved => Grade::Proved,
    }
}

fn claim_row(claim: &verify::Claim, checked: &Checked, certificate: &Certificate, slowest: Option<f64>) -> Claim {
    // The constants are evidence of a grade; the rest says what arm and loop are taken to be.
    let assumptions = certificate.assumptions().into_iter().enumerate().map(|(index, assumption)| Assumption {
        grade: (index == 0).then(|| grade(assumption.grade)),
        text: assumption.text,
    });
    // The statement alone does not say of which arm, gains and plants it speaks.
    let about = Assumption { text: certificate.document().about.clone(), grade: None };
    Claim {
        kind: checked.kind.name().to_owned(),
        verdict: match checked.verdict {
            verify::Verdict::Holds => Verdict::Holds,
            verify::Verdict::Refused => Verdict::Refused,
            verify::Verdict::NotProved => Verdict::NotProved,
        },
        grade: checked.grade.map_or(Grade::Sampled, grade),
        statement: checked.statement.clone(),
        assumptions: std::iter::once(about).chain(assumptions).collect(),
        margins: margins(claim, checked, slowest),
        counterexample: counterexample(claim),
    }
}

fn margins(claim: &verify::Claim, checked: &Checked, slowest: Option<f64>) -> Vec<Margin> {
    let margin =
        |name: &str, value: Option<f64>, unit: &str| Margin { name: name.to_owned(), value, unit: unit.to_owned() };
    let mut margins = match claim {
        verify::Claim::Exponential(claim) => vec![
            margin("certified decay rate", Some(claim.rate_per_s.to_f64()), "/s"),
            margin("slowest pole of the sample", slowest, "/s"),
        ],
        verify::Claim::Refused(_) => vec![margin("slowest pole of the sample", slowest, "/s")],
        verify::Claim::NotProved(claim) => {
            vec![margin(
                "distance to feasibility",
                claim.distance.as_ref().map(verify::Number::to_f64),
                "solver's units",
            )]
        }
        other => {
            let figures = other.figures().into_iter();
            figures.map(|f| margin(&format!("certified {}", f.name), Some(f.value.to_f64()), f.unit)).collect()
        }
    };
    let pivots = checked.inequalities.iter().filter_map(|inequality| inequality.smallest_pivot.as_ref()?.to_f64());
    if let Some(smallest) = pivots.reduce(f64::min) {
        margins.push(margin("smallest pivot of the exact matrix inequalities", Some(smallest), ""));
    }
    margins
}

/// What a refusal's statement leaves out: the arm that the search found.
fn counterexample(claim: &verify::Claim) -> Vec<String> {
    let refused = match claim {
        verify::Claim::Refused(refused) => refused,
        _ => return Vec::new(),
    };
    refused.attained.iter().map(|arm| {
        let scales: Vec<String> = arm.link_mass_scale.iter().map(ToString::to_string).collect();
        format!(
            "The arm that the search found there: link masses [{}] of nominal, payload {} kg, rotor inertia {} kg m², friction {} N m s/rad.",
            scales.join(", "),
            arm.payload_kg,
            arm.rotor_inertia_kg_m2,
            arm.friction_n_m_s_per_rad
        )
    }).collect()
}

/// The distance of each goal from the one before, as the region's claim measures it.
fn steps(run: &Run) -> Vec<GoalStep> {
    let scenario = &run.file.scenario;
    let goals = scenario.segments.iter().map(|segment| &segment.goal_rad);
    let befores = std::iter::once(&scenario.start_rad).chain(goals.clone());
    let size = |(goal, before): (&Vec<f64>, &Vec<f64>)| {
        goal.iter().zip(before).map(|(goal, before)| (goal - before).powi(2)).sum::<f64>().sqrt()
    };
    let sizes = goals.zip(befores).map(size);
    sizes.enumerate().map(|(index, size_rad)| GoalStep { label: label(index), size_rad }).collect()
}
