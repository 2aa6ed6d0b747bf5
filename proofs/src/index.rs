//! The list of certificates in `README.md`: what each is about is written here, what became of it is read from the certificate.

use std::fmt::Write as _;

use certune::verify::{Certificate, Claim, Grade, Number, Quantity, Verdict};

use crate::{ProofError, kept};

/// Certificates in the order of the page, and what they are about.
pub const INDEX: [(&str, &str); 22] = [
    ("exponential", "simulation gains, gravity not compensated, no friction"),
    ("exponential--masses-and-payload", "the same with link masses within 20 % and a payload up to 0.7 kg"),
    ("exponential--payload-3-kg", "the same with nominal masses and a payload up to 3 kg"),
    ("exponential--libfranka", "libfranka gains, gravity compensated, no friction"),
    ("exponential--libfranka-uncompensated", "libfranka gains, gravity not compensated, no friction"),
    ("sampled", "simulation gains at 1 kHz, gravity compensated, friction 1 to 3"),
    ("sampled--delay-without-friction", "simulation gains, one sample of delay, gravity compensated, no friction"),
    ("region", "simulation gains, gravity compensated, friction 1 to 3"),
    ("region--torque-limit", "the same, the controller's torque at most 87 N m"),
    ("region--without-friction", "simulation gains, gravity compensated, no friction"),
    ("region--uncompensated", "simulation gains, gravity not compensated, friction 1 to 3"),
    ("joint-region", "robot gains (re-tuned joint by joint), gravity compensated, friction 1 to 3, motor limits"),
    ("sampled-region", "simulation gains at 1 kHz, one sample of delay, rotor inertia 0.1, friction 1"),
    ("moving-goal", "simulation gains, gravity compensated, friction 1 to 3; the ramped pick-and-place task"),
    (
        "moving-goal--sampled",
        "gains tuned for a slow ramp at 1 kHz, one sample of delay, every motor limit kept; rotor inertia 0.1, friction 1",
    ),
    ("disturbance", "simulation gains, gravity compensated, friction 1 to 3, noise of the encoders"),
    ("lyapunov", "robot gains, all 42 states: the matrix linearised at goal B, computed in floating point"),
    ("adaptive-convergence", "MRAC, simulation gains with the paper's equations, around goal B"),
    ("adaptive-convergence--robot", "MRAC, robot gains with the paper's equations, around goal B"),
    ("adaptive-convergence--released-code", "MRAC, simulation gains with the law of the released code, around goal B"),
    ("pi-exponential", "MRAC, simulation gains, adaptation frozen, at goal B"),
    ("adaptive-sampled", "MRAC, simulation gains, velocity loop at 1 kHz, one sample of delay, rotor inertia 0.5"),
];

/// Figures that a line has room for.
const MOST_FIGURES: usize = 3;

/// The list as a table, every certificate checked.
///
/// # Errors
/// [`ProofError`] when a certificate is missing or rejected.
pub fn table() -> Result<String, ProofError> {
    let mut text = "| claim | about | verdict | figures |\n|---|---|---|---|\n".to_owned();
    for (name, about) in INDEX {
        let stem = name.split("--").next().unwrap_or(name);
        let certificate = kept(name)?;
        let (verdict, figures) = outcome(&certificate);
        let _ = writeln!(
            text,
            "| [{stem}](claims/{stem}.md) ([test](tests/{stem}.rs)) | [{about}](certificates/{name}.json) | {verdict} | {figures} |"
        );
    }
    Ok(text)
}

/// Verdict and figures of the last claim: earlier ones are what it rests on.
fn outcome(certificate: &Certificate) -> (&'static str, String) {
    let last = certificate.checked().last().map(|checked| (checked.verdict, checked.grade));
    let verdict = match last {
        Some((Verdict::Holds, Some(Grade::Proved))) => "proved",
        Some((Verdict::Holds, _)) => "conditional",
        Some((Verdict::Refused, _)) => "refused",
        Some((Verdict::NotProved, _)) | None => "not proved",
    };
    let figures = certificate.document().claims.last().map(|entry| in_words(&entry.claim)).unwrap_or_default();
    (verdict, figures)
}

fn in_words(claim: &Claim) -> String {
    let numbers = |list: &[Number]| list.iter().map(Number::to_string).collect::<Vec<_>>().join(", ");
    match claim {
        Claim::Refused(refused) => {
            let point = &refused.point;
            let mut text = format!(
                "unstable with inertia {}, friction {}, stiffness {}",
                point.inertia_kg_m2, point.friction_n_m_s_per_rad, point.stiffness_n_m_per_rad
            );
            if let Some(attained) = &refused.attained {
                let [real, imaginary] = &attained.eigenvalue_per_s;
                let size = imaginary.to_string().replace('-', "");
                let _ = write!(text, ": eigenvalue {real} ± {size}i /s at q = [{}]", numbers(&attained.q_rad));
            }
            for remedy in &refused.remedies {
                let name = match remedy.of {
                    Quantity::LeastFriction => "least friction",
                    Quantity::LeastRotorInertia => "least rotor inertia",
                    Quantity::LargestInertia => "largest inertia",
                    Quantity::LargestStiffness => "largest gravity stiffness",
                };
                let _ = write!(text, "; stable with {name} {}", remedy.value);
            }
            text
        }
        Claim::NotProved(open) => open.reason.in_words().to_owned(),
        Claim::AdaptiveRefused(refused) => {
            format!("every V of the form rises at the goal along dq = [{}]", numbers(&refused.direction))
        }
        other => {
            let figures = other.figures().into_iter().take(MOST_FIGURES);
            figures
                .map(|figure| match figure.unit {
                    "1" => format!("{} {}", figure.name, figure.value),
                    unit => format!("{} {} {unit}", figure.name, figure.value),
                })
                .collect::<Vec<_>>()
                .join(", ")
        }
    }
}
