//! Writes a page of every kind into a folder, with `pages.json`, which says what each must show: `cargo xtask browser` opens them.
//!
//! `cargo run --release -p certune-report --example pages -- FOLDER`

use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

use certune_report::{
    CommandLine, FrontGoal, FrontPoint, FrontReport, Learnt, Verdict, comparison_report, front_report, tuning_report,
};
use serde::Serialize;

#[path = "../tests/pages/synthetic/mod.rs"]
mod synthetic;

/// A page, and the ids of the sections that it must show.
#[derive(Serialize)]
struct Page {
    file: &'static str,
    sections: &'static [&'static str],
    #[serde(skip)]
    html: String,
}

const REPORT: &[&str] = &synthetic::SECTIONS;
const FRONT: &[&str] = &["front", "points", "pick", "method"];
const COMPARISON: &[&str] = &["answer", "controllers", "statements", "findings", "replay", "repeat", "method"];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(env::args_os().nth(1).ok_or("expected the folder to write the pages into")?);
    let pages = [
        Page { file: "report.html", sections: REPORT, html: tuning_report(&synthetic::record())? },
        Page { file: "report-refused.html", sections: REPORT, html: refused()? },
        Page { file: "report-empty.html", sections: REPORT, html: empty()? },
        Page { file: "front.html", sections: FRONT, html: front()? },
        Page {
            file: "compare.html",
            sections: COMPARISON,
            html: comparison_report(&synthetic::comparison::comparison())?,
        },
    ];
    fs::create_dir_all(&folder)?;
    for page in &pages {
        fs::write(folder.join(page.file), &page.html)?;
    }
    fs::write(folder.join("pages.json"), serde_json::to_string_pretty(&pages)?)?;
    Ok(())
}

/// A run that ran away, a claim that is refused and one that is open: colours and words that a good run does not need.
fn refused() -> Result<String, Box<dyn Error>> {
    let mut record = synthetic::record();
    let [refused, open] = record.certificate.claims.as_mut_slice() else { return Err("expected two claims".into()) };
    refused.verdict = Verdict::Refused;
    refused.margins.clear();
    refused.counterexample = vec!["q = (0.1, 1.2, 0, −1.4, 0, 2, 0) rad: eigenvalue 0.31 ± 2.2i /s".to_owned()];
    open.verdict = Verdict::NotProved;
    open.margins.clear();
    if let Some(region) = &mut record.certificate.region {
        region.radius_rad = None;
    }
    let run = &mut record.response.runs.published;
    for torque in &mut run.tau_n_m {
        torque[2000..].fill(f64::NAN);
    }
    run.diverged_at_s = Some(10.0);
    record.learnt = Learnt::default();
    Ok(tuning_report(&record)?)
}

/// A record with nothing in it.
fn empty() -> Result<String, Box<dyn Error>> {
    Ok(tuning_report(&serde_json::from_str(include_str!("../tests/smallest.json"))?)?)
}

/// A front of three goals.
fn front() -> Result<String, Box<dyn Error>> {
    let goal = |name: &str, unit: &str, is_at_least, source: &str| FrontGoal {
        name: name.to_owned(),
        unit: unit.to_owned(),
        is_at_least,
        source: source.to_owned(),
    };
    let figures = |part: f64| vec![2.0 + 2.0 * part, 24.0 - 16.0 * part.sqrt(), 0.1 + 0.3 * part * part];
    let gains = ["kappa_mu", "kappa_a", "sigma_dq", "sigma_mu", "sigma_dmu"];
    let point = |number: usize| FrontPoint {
        number,
        figures: figures(number as f64 / 12.0),
        gains: gains.map(|name| (name.to_owned(), format!("{:.4}", 100.0 / number as f64))).to_vec(),
    };
    let other = |index: u64| {
        let worse = |axis: u64| 1.0 + synthetic::noise(index + 300 * axis);
        figures(synthetic::noise(index)).iter().zip(1..).map(|(figure, axis)| figure * worse(axis)).collect()
    };
    Ok(front_report(&FrontReport {
        about: "panda · aic · pick-and-place · seed 1".to_owned(),
        method: vec!["Each goal was searched for alone, then with the others as limits.".to_owned()],
        goals: vec![
            goal("settling time", "s", false, "simulated"),
            goal("jitter", "N m/s", false, "simulated"),
            goal("certified radius", "rad", true, "proved"),
        ],
        points: (1..=12).map(point).collect(),
        others: (0..300).map(other).collect(),
        published: Some(vec![4.1, 18.0, 0.2]),
        commands: vec![CommandLine {
            command: "autotune pick runs/panda-aic-front-1 --point 3".to_owned(),
            shows: "Writes the gains and the certificates of point 3.".to_owned(),
        }],
    })?)
}
