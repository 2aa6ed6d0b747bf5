//! The words of a claim, derived from its numbers and from nothing else.

use std::fmt::Write as _;

use num_traits::Signed;

use crate::check::allowed_grade;
use crate::document::{Claim, Document, Evidence, Grade};
use crate::number::Number;

/// An assumption of the document, and how well it is supported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assumption {
    /// In words.
    pub text: String,
    /// [`Grade::Conditional`] when it was sampled or is taken on trust, [`Grade::Proved`] when the document proves it.
    pub grade: Grade,
}

/// `0 to 0.7`, or `0.7` when both ends agree.
fn range([lower, upper]: &[Number; 2]) -> String {
    if lower.value() == upper.value() { lower.to_string() } else { format!("{lower} to {upper}") }
}

/// One number when all joints share it, else the list.
fn gain(list: &[Number]) -> String {
    match list {
        [first, rest @ ..] if rest.iter().all(|x| x.value() == first.value()) => first.to_string(),
        _ => format!("[{}]", list.iter().map(Number::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn subject(document: &Document) -> String {
    let Document { arm, gains, family, .. } = document;
    let mut text = format!("Arm `{}` ({} joints) under the AIC with", arm.name, arm.joints);
    for (position, (name, list)) in gains.named().iter().enumerate() {
        let comma = if position == 0 { "" } else { "," };
        let _ = write!(text, "{comma} {name} {}", gain(list));
    }
    let compensated =
        if family.gravity_compensation { "gravity compensated by the robot" } else { "gravity not compensated" };
    let _ = write!(
        text,
        "; {compensated}; viscous friction {} N m s/rad on each joint; link masses within {} of nominal (as a share); payload {} kg; \
         rotor inertia {} kg m^2; continuous time, no torque limit, no delay, no Coulomb friction, joint limits not modelled",
        range(&family.friction_n_m_s_per_rad),
        family.mass_uncertainty,
        range(&family.payload_kg),
        range(&family.rotor_inertia_kg_m2),
    );
    text
}

fn condition(document: &Document) -> String {
    let c = &document.constants;
    match allowed_grade(&c.evidence).0 {
        Grade::Conditional => format!(
            "This is conditional: it holds if these constants hold at every configuration of the family: {}.",
            bounds(document)
        ),
        Grade::Proved => format!("The constants are proved: {}.", bounds(document)),
    }
}

fn bounds(document: &Document) -> String {
    let c = &document.constants;
    format!(
        "eigenvalues of the inertia matrix in [{}, {}] kg m^2, gravity stiffness at most {} N m/rad, Coriolis constants k_c {} kg m^2 and k_r {}",
        c.m_lo_kg_m2, c.m_hi_kg_m2, c.k_g_n_m_per_rad, c.k_c_kg_m2, c.k_r
    )
}

/// The sentence of a claim.
pub(crate) fn statement(document: &Document, claim: &Claim) -> String {
    let subject = subject(document);
    let condition = condition(document);
    match claim {
        Claim::Exponential(c) => format!(
            "{subject}: linearised at rest at any configuration, the loop is exponentially stable, every mode decaying faster than \
             exp(-{} t), t in s. {condition}",
            c.rate_per_s
        ),
        Claim::Region(c) => {
            let torque = if document.family.gravity_compensation {
                "with zero controller torque"
            } else {
                "with the controller's torque holding gravity there"
            };
            format!(
                "{subject}: from rest at any configuration within {} rad of a constant goal (2-norm over the joints), beliefs at the \
                 measurement (mu = q, mu' = mu'' = 0), {torque}, the nonlinear loop converges to the goal, and the Lyapunov function V \
                 falls at least as fast as exp(-2 x {} t), t in s. {condition}",
                c.radius_rad, c.rate_per_s
            )
        }
        Claim::Refused(c) => {
            let wanted = if c.rate_per_s.value().is_positive() {
                format!("does not decay at {} per s", c.rate_per_s)
            } else {
                "is not asymptotically stable".to_owned()
            };
            let mut text = format!(
                "Refused. {subject}: the linearised loop with inertia {} kg m^2, friction {} N m s/rad and gravity stiffness {} N m/rad {wanted}.",
                c.point.inertia_kg_m2, c.point.friction_n_m_s_per_rad, c.point.stiffness_n_m_per_rad
            );
            match &c.attained {
                Some(a) => {
                    let _ = write!(
                        text,
                        " The point is attainable: the search (floating point) found it at q = {} rad with eigenvalue {} {} i per s.",
                        gain_list(&a.q_rad),
                        a.eigenvalue_per_s[0],
                        signed(&a.eigenvalue_per_s[1]),
                    );
                }
                None => text.push_str(" The point lies in the family's box of constants but is not shown attainable by an arm of the family."),
            }
            text
        }
        Claim::NotProved(c) => {
            let distance = c
                .distance
                .as_ref()
                .map(|d| format!(" Distance to feasibility: {d} in the solver's units."))
                .unwrap_or_default();
            format!("Not proved ({}). {subject}: {}.{distance}", c.of.kind(), c.reason)
        }
    }
}

fn gain_list(list: &[Number]) -> String {
    format!("[{}]", list.iter().map(Number::to_string).collect::<Vec<_>>().join(", "))
}

fn signed(x: &Number) -> String {
    if x.value().is_negative() { format!("- {}", x.to_string().trim_start_matches('-')) } else { format!("+ {x}") }
}

/// What the claims of a document take for granted.
pub(crate) fn assumptions(document: &Document) -> Vec<Assumption> {
    let Evidence::Sampled { over, margin, samples, local_starts } = &document.constants.evidence;
    let taken = |text: &str| Assumption { text: text.to_owned(), grade: Grade::Conditional };
    vec![
        Assumption {
            text: format!(
                "Constants of the arm ({}): sampled over {over}, {samples} configurations and {local_starts} local maximisations each, \
                 widened by a share of {margin}. Not proved",
                bounds(document)
            ),
            grade: Grade::Conditional,
        },
        taken("Rigid links and joints, viscous friction within the stated interval, the same gains on every joint"),
        taken("Continuous time: sampling at 1 kHz, measurement noise and actuation delay are outside the claim"),
        taken("Torque limits and joint limits are not reached"),
    ]
}
