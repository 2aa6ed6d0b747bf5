//! The words of a claim, derived from its numbers and from nothing else.

use std::fmt::Write as _;

use num_traits::Signed;

use crate::check::allowed_grade;
use crate::document::{Claim, Document, Evidence, Grade, SampledSet};
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

/// Arm, gains, family, scope and constants: what every statement of the document is about.
pub(crate) fn about(document: &Document) -> String {
    let Document { arm, gains, family, .. } = document;
    let mut text = format!("Arm `{}` ({} joints) under the AIC with", arm.name, arm.joints);
    for (position, (name, list)) in gains.named().iter().enumerate() {
        let comma = if position == 0 { "" } else { "," };
        let _ = write!(text, "{comma} {name} {}", gain(list));
    }
    let compensated = if family.gravity_compensation {
        "gravity compensated exactly by the robot, with the true masses and payload"
    } else {
        "gravity not compensated"
    };
    let [x, y, z] = &family.payload_com_m;
    let _ = write!(
        text,
        " (arm description {}). The family: {compensated}; viscous friction {} N m s/rad on each joint; each link's mass and inertia scaled \
         together within a share of {} of nominal, centre of mass unchanged; point payload {} kg at ({x}, {y}, {z}) m in the last \
         link's frame; rotor inertia {} kg m^2 on each joint; every configuration, all angles. The scope: continuous time, no torque \
         limit, no delay, no noise, no Coulomb friction, joint limits not modelled. {}",
        arm.sha256.get(..12).unwrap_or_default(),
        range(&family.friction_n_m_s_per_rad),
        family.mass_uncertainty,
        range(&family.payload_kg),
        range(&family.rotor_inertia_kg_m2),
        condition(document),
    );
    text
}

fn condition(document: &Document) -> String {
    match allowed_grade(&document.constants.evidence).0 {
        Grade::Conditional => {
            format!(
                "The condition: these constants hold for the whole family (they were sampled): {}.",
                bounds(document)
            )
        }
        Grade::Proved => format!("The constants are proved for the whole family: {}.", bounds(document)),
    }
}

/// How a statement of this grade begins.
fn opening(document: &Document) -> &'static str {
    match allowed_grade(&document.constants.evidence).0 {
        Grade::Conditional => "Conditional, if the constants hold: ",
        Grade::Proved => "",
    }
}

fn bounds(document: &Document) -> String {
    let c = &document.constants;
    format!(
        "eigenvalues of the inertia matrix M in [{}, {}] kg m^2; gravity stiffness dg/dq at most {} N m/rad; and for all y and dq, \
         1/2 |dq'(sum_j y_j dM/dq_j) dq| at most {} |y| |dq|^2 (kg m^2) and at most {} |y| dq'M dq",
        c.m_lo_kg_m2, c.m_hi_kg_m2, c.k_g_n_m_per_rad, c.k_c_kg_m2, c.k_r
    )
}

/// The sentence of a claim, about what [`about`] describes.
pub(crate) fn statement(document: &Document, claim: &Claim) -> String {
    let opening = opening(document);
    match claim {
        Claim::Exponential(c) => format!(
            "{opening}linearised at rest at any configuration, the loop is exponentially stable, every mode decaying faster than \
             exp(-{} t), t in s.",
            c.rate_per_s
        ),
        Claim::Region(c) => {
            let torque = if document.family.gravity_compensation {
                "with zero controller torque"
            } else {
                "with the controller's torque holding gravity there"
            };
            format!(
                "{opening}from rest at any configuration within {} rad of a constant goal (2-norm over the joints, angles not wrapped), beliefs at the \
                 measurement (mu = q, mu' = mu'' = 0), {torque}, the nonlinear loop converges to the goal, and the Lyapunov function of the \
                 file's witness falls at least as fast as exp(-2 x {} t), t in s.",
                c.radius_rad, c.rate_per_s
            )
        }
        Claim::Refused(c) => {
            let wanted = if c.rate_per_s.value().is_positive() {
                format!("does not decay faster than exp(-{} t), t in s", c.rate_per_s)
            } else {
                "is not asymptotically stable".to_owned()
            };
            let mut text = format!(
                "Refused: the linearised loop with inertia {} kg m^2, friction {} N m s/rad and gravity stiffness {} N m/rad {wanted}.",
                c.point.inertia_kg_m2, c.point.friction_n_m_s_per_rad, c.point.stiffness_n_m_per_rad
            );
            match &c.attained {
                Some(a) => {
                    let _ = write!(
                        text,
                        " The point is attainable if the file's floating-point search is right (not checked exactly): an arm of the family at \
                         q = {} rad with eigenvalue {} {}i per s.",
                        gain_list(&a.q_rad),
                        a.eigenvalue_per_s[0],
                        signed(&a.eigenvalue_per_s[1]),
                    );
                }
                None => text.push_str(
                    " The point lies in the family's box of constants but is not shown attainable by an arm of the family.",
                ),
            }
            text
        }
        Claim::NotProved(c) => {
            let distance = c
                .distance
                .as_ref()
                .map(|d| format!(" Distance to feasibility: {d} in the solver's units."))
                .unwrap_or_default();
            format!("Not proved ({}): {}.{distance}", c.of.kind(), c.reason.in_words())
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
    let over = match over {
        SampledSet::AllAngles => "all angles",
    };
    let taken = |text: &str| Assumption { text: text.to_owned(), grade: Grade::Conditional };
    let gravity = document.family.gravity_compensation;
    let mut all = vec![
        taken(&format!(
            "The constants ({}) were sampled over {over}: {samples} configurations and {local_starts} local maximisations each, widened \
             by a share of {margin}. A sample is no bound",
            bounds(document)
        )),
        taken("Rigid links and joints, viscous friction within the stated interval, the same gains on every joint"),
        taken("Continuous time: sampling at 1 kHz, measurement noise and actuation delay are outside the claim"),
        taken("Torque limits and joint limits are not reached"),
    ];
    if gravity {
        all.push(taken("The robot's gravity compensation is exact: it knows the true masses and payload"));
    }
    all
}
