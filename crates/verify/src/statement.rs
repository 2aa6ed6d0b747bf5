//! The words of a claim, derived from its numbers and from nothing else.

use std::fmt::Write as _;

use crate::check::allowed_grade;
use crate::claims::{Claim, Verdict};
use crate::document::{Bounds, ConfigurationSet, Document, Evidence, Grade};
use crate::number::Number;

/// An assumption of the document, and how well it is supported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assumption {
    /// In words.
    pub text: String,
    /// [`Grade::Conditional`] when it was sampled or is taken on trust, [`Grade::Proved`] when a record proves it.
    pub grade: Grade,
}

/// `0 to 0.7`, or `0.7` when both ends agree.
pub(crate) fn range([lower, upper]: &[Number; 2]) -> String {
    if lower.value() == upper.value() { lower.to_string() } else { format!("{lower} to {upper}") }
}

/// One text when all joints share it, else the list.
pub(crate) fn per_joint(texts: &[String]) -> String {
    match texts {
        [first, rest @ ..] if rest.iter().all(|x| x == first) => first.clone(),
        _ => format!("[{}]", texts.join(", ")),
    }
}

/// One number when all joints share it, else the list.
pub(crate) fn list(numbers: &[Number]) -> String {
    match numbers {
        [first, rest @ ..] if rest.iter().all(|x| x.value() == first.value()) => first.to_string(),
        _ => format!("[{}]", each(numbers)),
    }
}

/// Every number, with commas between.
pub(crate) fn each(numbers: &[Number]) -> String {
    numbers.iter().map(Number::to_string).collect::<Vec<_>>().join(", ")
}

/// Arm, gains, family and constants: what every statement of the document is about.
pub(crate) fn about(document: &Document) -> String {
    let Document { arm, gains, family, .. } = document;
    let (controller, named) = gains.named();
    let mut text = format!("Arm `{}` ({} joints) under the {controller} with", arm.name, arm.joints);
    for (position, (name, numbers)) in named.iter().enumerate() {
        let comma = if position == 0 { "" } else { "," };
        let _ = write!(text, "{comma} {name} {}", list(numbers));
    }
    let compensated = if family.gravity_compensation {
        "gravity compensated exactly by the robot, with the true masses and payload"
    } else {
        "gravity not compensated"
    };
    let friction: Vec<String> = family.friction_n_m_s_per_rad.iter().map(range).collect();
    let arms = &family.arms;
    let [x, y, z] = &arms.payload_com_m;
    let _ = write!(
        text,
        " (arm description {}). The family: {compensated}; viscous friction {} N m s/rad on each joint; each link's mass and inertia scaled \
         together within a share of {} of nominal, centre of mass unchanged; point payload {} kg at ({x}, {y}, {z}) m in the last \
         link's frame; rotor inertia {} kg m^2 on each joint; {}. {}",
        arm.sha256.get(..12).unwrap_or_default(),
        per_joint(&friction),
        arms.mass_uncertainty,
        range(&arms.payload_kg),
        range(&arms.rotor_inertia_kg_m2),
        configurations(&document.constants.over),
        condition(document),
    );
    text
}

/// A set of configurations in words.
pub(crate) fn configurations(over: &ConfigurationSet) -> String {
    match over {
        ConfigurationSet::AllAngles => "every configuration, all angles".to_owned(),
        ConfigurationSet::Box { lower_rad, upper_rad } => {
            let sides: Vec<String> =
                lower_rad.iter().zip(upper_rad).map(|(lower, upper)| format!("{lower} to {upper}")).collect();
            format!("every configuration with joint angles in [{}] rad", sides.join(", "))
        }
    }
}

/// `any configuration`, of those that the constants hold for.
pub(crate) fn any_configuration(document: &Document) -> &'static str {
    match document.constants.over {
        ConfigurationSet::AllAngles => "any configuration",
        ConfigurationSet::Box { .. } => "any configuration of the set",
    }
}

fn condition(document: &Document) -> String {
    let bounds = bounds(&document.constants.bounds);
    match &document.constants.evidence {
        Evidence::Sampled { .. } => {
            format!("The condition: these constants hold for the whole family (they were sampled): {bounds}.")
        }
        Evidence::Proved { record_sha256 } => format!(
            "The constants are proved for the whole family (record {}): {bounds}.",
            record_sha256.get(..12).unwrap_or_default()
        ),
    }
}

fn bounds(c: &Bounds) -> String {
    let mut text = format!(
        "eigenvalues of the inertia matrix M in [{}, {}] kg m^2; gravity stiffness dg/dq at most {} N m/rad; and for all y and v, with \
         c(y, v) = 1/2 |v'(sum_j y_j dM/dq_j) v|, c at most {} |y| |v|^2 (kg m^2)",
        c.m_lo_kg_m2, c.m_hi_kg_m2, c.k_g_n_m_per_rad, c.k_c_kg_m2
    );
    if let Some(k_r) = &c.k_r {
        let _ = write!(text, ", at most {k_r} |y| v'Mv");
    }
    if let Some(k_m) = &c.k_m {
        let _ = write!(text, ", at most {k_m} (y'My)^(1/2) v'Mv (1/sqrt(kg m^2))");
    }
    if let Some([lower, upper]) = &c.diagonal_kg_m2 {
        let _ = write!(text, "; M at least diag({}) and at most diag({}) kg m^2", list(lower), list(upper));
    }
    if let Some(inertia) = &c.inertia {
        let rows =
            |matrix: &[Vec<Number>]| matrix.iter().map(|row| format!("[{}]", each(row))).collect::<Vec<_>>().join(", ");
        let _ = write!(
            text,
            "; M within [{}] of [{}] kg m^2, entry by entry, and |x'C(q, v) y| at most {} |x||v||y| (kg m^2)",
            rows(&inertia.radius_kg_m2),
            rows(&inertia.midpoint_kg_m2),
            inertia.coriolis_kg_m2
        );
    }
    if let Some(torques) = &c.gravity_torque_n_m {
        let _ = write!(text, "; gravity torques at most {} N m", list(torques));
    }
    text
}

/// The sentence of a claim, about what [`about`] describes, and its scope.
pub(crate) fn statement(document: &Document, claim: &Claim) -> String {
    let sentence = claim.provable().sentence(document);
    match claim.verdict() {
        Verdict::Holds => {
            let opening = match allowed_grade(&document.constants.evidence).0 {
                Grade::Conditional => "Conditional, if the constants hold: ",
                Grade::Proved => "Proved: ",
            };
            format!("{opening}{sentence}. Scope: {}.", claim.provable().scope(document))
        }
        Verdict::Refused | Verdict::NotProved => sentence,
    }
}

/// How a refusal opens whose counterexample is as good as the constants.
pub(crate) fn refused(document: &Document) -> &'static str {
    match allowed_grade(&document.constants.evidence).0 {
        Grade::Conditional => "Refused, if the stated constants hold",
        Grade::Proved => "Refused",
    }
}

/// What the claims of a document take for granted.
pub(crate) fn assumptions(document: &Document) -> Vec<Assumption> {
    let numbers = bounds(&document.constants.bounds);
    let taken = |text: &str| Assumption { text: text.to_owned(), grade: Grade::Conditional };
    let constants = match &document.constants.evidence {
        Evidence::Sampled { margin, samples, local_starts } => taken(&format!(
            "The constants ({numbers}) were sampled: {samples} configurations and {local_starts} local maximisations each, widened by a \
             share of {margin}. A sample is no bound"
        )),
        Evidence::Proved { record_sha256 } => Assumption {
            text: format!(
                "The constants ({numbers}) are those of the record {record_sha256}, proved by outward-rounded arithmetic. A record is as good as \
                 its source: it has to be one that the reader trusts, or has derived again from the arm with `verify --full`"
            ),
            grade: Grade::Proved,
        },
    };
    let mut all = vec![
        constants,
        taken("Rigid links and joints; friction is viscous and within the stated interval"),
        taken("Each claim's scope says what the loop is taken to be: time, torque limits, delay, noise"),
    ];
    if document.family.gravity_compensation {
        all.push(taken("The robot's gravity compensation is exact: it knows the true masses and payload"));
    }
    all
}
