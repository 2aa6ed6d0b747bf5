//! A record is looked at once, before anything is drawn.

use crate::claims;
use crate::error::ReportError;
use crate::record::{Bands, Grade, Trajectory, TuningReport, Verdict};

/// Series that belong together have one length, and no claim says more than its evidence.
///
/// # Errors
/// [`ReportError::Length`] and [`ReportError::Overclaim`].
pub(crate) fn check(record: &TuningReport) -> Result<(), ReportError> {
    let joints = record.asked.joints;
    length("response.joint_names", joints, record.response.joint_names.len())?;
    if !record.response.torque_limit_n_m.is_empty() {
        length("response.torque_limit_n_m", joints, record.response.torque_limit_n_m.len())?;
    }
    for run in [&record.response.runs.published, &record.response.runs.tuned] {
        trajectory(run, joints)?;
    }
    for band in [&record.held_out.bands.published, &record.held_out.bands.tuned] {
        bands(band)?;
    }
    for slice in &record.learnt.slices {
        for (series, cells) in [("learnt.slices.stable", &slice.stable), ("learnt.slices.certified", &slice.certified)]
        {
            let columns = cells.first().map_or(0, Vec::len);
            cells.iter().try_for_each(|row| length(series, columns, row.len()))?;
        }
    }
    if let Some(surface) = &record.learnt.surface {
        let gains = surface.gains.len();
        surface
            .directions
            .iter()
            .try_for_each(|one| length("learnt.surface.directions.parts", gains, one.parts.len()))?;
    }
    for (index, claim) in record.certificate.claims.iter().enumerate() {
        let short_of_proof = claims::worth(claim) < Grade::Proved;
        if claim.verdict == Verdict::Holds && short_of_proof && claim.statement.to_lowercase().contains("proved") {
            return Err(ReportError::Overclaim { index, kind: claim.kind.clone() });
        }
    }
    Ok(())
}

fn trajectory(run: &Trajectory, joints: usize) -> Result<(), ReportError> {
    let samples = run.time_s.len();
    for (series, rows) in [
        ("response.runs.q_rad", &run.q_rad),
        ("response.runs.goal_rad", &run.goal_rad),
        ("response.runs.tau_n_m", &run.tau_n_m),
    ] {
        length(series, joints, rows.len())?;
        rows.iter().try_for_each(|row| length(series, samples, row.len()))?;
    }
    if run.free_energy.is_empty() {
        Ok(())
    } else {
        length("response.runs.free_energy", samples, run.free_energy.len())
    }
}

fn bands(band: &Bands) -> Result<(), ReportError> {
    let samples = band.time_s.len();
    length("held_out.bands.error_p05_rad", samples, band.error_p05_rad.len())?;
    length("held_out.bands.error_p50_rad", samples, band.error_p50_rad.len())?;
    length("held_out.bands.error_p95_rad", samples, band.error_p95_rad.len())
}

/// # Errors
/// [`ReportError::Length`].
pub(crate) fn length(series: &'static str, expected: usize, found: usize) -> Result<(), ReportError> {
    if expected == found { Ok(()) } else { Err(ReportError::Length { series, expected, found }) }
}
