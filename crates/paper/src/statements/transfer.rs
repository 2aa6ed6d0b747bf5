//! Statements about the gains of the simulation on the robot.

use crate::inputs::names;
use crate::record::{Arms, CellResult, Comparison, Effects};
use crate::runs::JOINTS;

use super::{COMPARE, DONE_RAD, Draft, HARDLY_ANY, NEARLY_ALL, Ruling, Statement, Words, share, short, spread};

/// A stop within this is at once, s.
const AT_ONCE_S: f64 = 1.0;

fn stopped(arms: Option<&Arms>) -> Option<f64> {
    arms.and_then(|arms| share(arms, "safety_stop_s", |_| true))
}

/// The results of a controller in the cells that are chosen.
fn cells<'a>(
    found: &'a Comparison,
    contender: &'a str,
    chosen: impl Fn(&Effects) -> bool + 'a,
) -> impl Iterator<Item = (&'a Effects, &'a CellResult)> {
    let cells = found.transfer.cells.iter().filter(move |cell| chosen(&cell.effects));
    cells.filter_map(move |cell| {
        Some((&cell.effects, cell.results.iter().find(|result| result.contender == contender)?))
    })
}

/// Arms stopped by anything but a torque that is too fast, as a share of those in the chosen cells.
fn stopped_in(found: &Comparison, contender: &str, chosen: impl Fn(&Effects) -> bool) -> Option<f64> {
    let (mut stopped, mut cells_seen) = (0, 0);
    for (_, result) in cells(found, contender, chosen) {
        stopped += result.stopped_rate_apart;
        cells_seen += 1;
    }
    (cells_seen > 0).then(|| stopped as f64 / (cells_seen * found.question.grid_arms.max(1)) as f64)
}

pub(super) fn aic_transfers(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let arms = found.transfer.robot.of(names::AIC);
    let stops = draft.read("aic_share_stopped", stopped(arms));
    let done =
        draft.read("aic_share_done", arms.and_then(|arms| share(arms, "final_error_rad", |error| error < DONE_RAD)));
    let rotor = draft.read(
        "aic_share_stopped_with_rotor_inertia",
        stopped_in(found, names::AIC, |effects| effects.rotor_inertia_kg_m2 > 0.0),
    );
    let bare = draft.read(
        "aic_share_stopped_without",
        stopped_in(found, names::AIC, |effects| {
            effects.rotor_inertia_kg_m2 <= 0.0 && effects.friction_n_m_s_per_rad <= 0.0
        }),
    );
    let words = Words {
        name: "aic-transfers",
        section: "abstract, experiments",
        statement: "The AIC's gains of the simulation work on the robot without being tuned again.",
        rule: "agrees if, with noise, a sample of delay and a limited torque rate, it is stopped on at most 5 % of the arms and ends every move within 50 mrad on at least 95 %; only if, when that holds in the grid with rotor inertia and not without",
        figure: "transfer-grid",
        command: COMPARE,
    };
    let measured = format!(
        "stopped on {} %, done on {} % of {} arms, errors {} mrad; in the grid stopped on {} % with rotor inertia, on {} % with neither rotor inertia nor friction",
        short(100.0 * stops),
        short(100.0 * done),
        found.question.arms,
        spread(arms, "final_error_rad", 1e3),
        short(100.0 * rotor),
        short(100.0 * bare)
    );
    let works = stops <= HARDLY_ANY && done >= NEARLY_ALL;
    let ruling = match (works, bare <= HARDLY_ANY) {
        (true, true) => Ruling::Agrees,
        (true, false) => Ruling::OnlyIf(
            "the wrist has rotor inertia or friction, as the real arm has: delayed by a sample it jitters otherwise"
                .to_owned(),
        ),
        (false, _) => Ruling::DoesNotAgree,
    };
    draft.state(words, measured, ruling)
}

pub(super) fn jitter_at_joint_6(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    // Where the delay is at least a sample and the sensors are noisy.
    let jitters = |result: &CellResult| -> Option<(usize, f64)> {
        let rates: Vec<f64> = result.acceleration_rad_per_s2.iter().copied().collect::<Option<_>>()?;
        let worst = (0..JOINTS).max_by(|a, b| rates[*a].total_cmp(&rates[*b]))?;
        let next = (0..JOINTS).filter(|joint| *joint != worst).map(|joint| rates[joint]).fold(0.0, f64::max);
        Some((worst + 1, rates[worst] / next))
    };
    let real = |effects: &Effects| effects.noise && effects.delay_samples >= 1;
    let seen: Vec<(usize, f64)> = cells(found, names::AIC, real).filter_map(|(_, result)| jitters(result)).collect();
    let at = |joint: usize| seen.iter().filter(|(worst, _)| *worst == joint).count();
    let share_6 = draft.read(
        "share_of_cells_with_most_jitter_at_joint_6",
        (!seen.is_empty()).then(|| at(6) as f64 / seen.len() as f64),
    );
    let alone = seen.iter().filter(|(worst, ratio)| *worst == 6 && *ratio >= 2.0).count();
    draft.read(
        "share_of_cells_with_twice_the_jitter_at_joint_6",
        (!seen.is_empty()).then(|| alone as f64 / seen.len() as f64),
    );
    let counts: Vec<String> =
        (1..=JOINTS).filter(|joint| at(*joint) > 0).map(|joint| format!("joint {joint} in {}", at(joint))).collect();
    let words = Words {
        name: "jitter-at-joint-6",
        section: "experiments",
        statement: "With the gains of the simulation there is some jitter on the robot, at joint 6 alone.",
        rule: "of the cells of the grid with noise and delay, agrees if joint 6 has at least twice the acceleration of any other in nine of ten; only if, when it has the largest in some",
        figure: "transfer-jitter",
        command: COMPARE,
    };
    let measured = format!(
        "of {} cells with noise and delay the joint with most jitter is {}; joint 6 has twice that of any other in {alone}",
        seen.len(),
        counts.join(", ")
    );
    let ruling = if !seen.is_empty() && alone * 10 >= seen.len() * 9 {
        Ruling::Agrees
    } else if share_6 > 0.0 {
        Ruling::OnlyIf(format!("the plant is one of {} of {} in the grid", at(6), seen.len()))
    } else {
        Ruling::DoesNotAgree
    };
    draft.state(words, measured, ruling)
}

pub(super) fn mrac_stops(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let mut at_once = |kind: &str, place: &str, arms: Option<&Arms>| {
        let share = arms.and_then(|arms| share(arms, &format!("safety_stop_{kind}_s"), |time_s| time_s <= AT_ONCE_S));
        draft.read(&format!("mrac_share_stopped_at_once_by_{kind}_{place}"), share)
    };
    let [ideal, robot] = [&found.transfer.ideal, &found.transfer.robot].map(|experiment| experiment.of(names::MRAC));
    let (command_robot, command_ideal) =
        (at_once("rate_apart", "on_robot", robot), at_once("rate_apart", "without_effects", ideal));
    let (motion_robot, motion_ideal) =
        (at_once("motion", "on_robot", robot), at_once("motion", "without_effects", ideal));
    let mut in_grid = |name: &str, chosen: &dyn Fn(&Effects) -> bool| {
        let (mut stopped, mut of) = (0, 0);
        for (_, result) in cells(found, names::MRAC, chosen) {
            stopped += result.stopped_motion;
            of += found.question.grid_arms;
        }
        draft.read(name, (of > 0).then(|| stopped as f64 / of as f64))
    };
    let rotor = |effects: &Effects| effects.rotor_inertia_kg_m2 > 0.0;
    let limiter = in_grid("mrac_share_moving_too_far_or_fast_with_limiter", &|effects| {
        rotor(effects) && effects.torque_rate_limited
    });
    let rest = in_grid("mrac_share_moving_too_far_or_fast_without_limiter", &|effects| {
        rotor(effects) && !effects.torque_rate_limited
    });
    let words = Words {
        name: "mrac-stops",
        section: "experiments",
        statement: "MRAC with the gains of the simulation triggers the robot's safety stop at once.",
        rule: "agrees if what the arm does (range, speed) stops at least 95 % of the arms within a second with and without noise, delay and limiter; only if, when it does with them, or when a command beyond the motors' torque counts as well",
        figure: "transfer-grid",
        command: COMPARE,
    };
    let measured = format!(
        "with noise, a sample of delay and the limiter {} % of the arms move too far or too fast within a second, without them {} %; in the grid with rotor inertia {} % do with a limited torque rate and {} % without; the command goes beyond the motors' torque at once on {} and {} %",
        short(100.0 * motion_robot),
        short(100.0 * motion_ideal),
        short(100.0 * limiter),
        short(100.0 * rest),
        short(100.0 * command_robot),
        short(100.0 * command_ideal)
    );
    let still = if rest <= HARDLY_ANY { "; friction and noise alone do not make it move too fast" } else { "" };
    let ruling = match (motion_robot >= NEARLY_ALL, motion_ideal >= NEARLY_ALL, command_ideal >= NEARLY_ALL) {
        (true, true, _) => Ruling::Agrees,
        (true, false, true) => Ruling::OnlyIf(
            "the torque's rate is limited, as the robot's interface does, or a command beyond the motors' torque stops the arm".to_owned() + still,
        ),
        (true, false, false) => Ruling::OnlyIf("the torque's rate is limited, as the robot's interface does".to_owned()),
        (false, _, true) => Ruling::OnlyIf("a command beyond the motors' torque stops the arm".to_owned()),
        (false, _, false) => Ruling::DoesNotAgree,
    };
    draft.state(words, measured, ruling)
}

pub(super) fn mrac_returned_works(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let arms = found.transfer.robot.of(names::MRAC_ROBOT);
    let stops = draft.read("mrac_share_stopped", stopped(arms));
    let done =
        draft.read("mrac_share_done", arms.and_then(|arms| share(arms, "final_error_rad", |error| error < DONE_RAD)));
    let words = Words {
        name: "mrac-retuned-works",
        section: "experiments",
        statement: "MRAC works on the robot once it is tuned again.",
        rule: "agrees if, with its gains of the robot, noise, a sample of delay and a limited torque rate, it is stopped on at most 5 % of the arms and ends every move within 50 mrad on at least 95 %; only if, when it is not stopped and ends none further off than 0.1 rad",
        figure: "transfer-grid",
        command: COMPARE,
    };
    let measured = format!(
        "stopped on {} %, done on {} % of {} arms; overshoot {} %, errors {} mrad",
        short(100.0 * stops),
        short(100.0 * done),
        found.question.arms,
        spread(arms, "overshoot", 100.0),
        spread(arms, "final_error_rad", 1e3)
    );
    let worst = draft.read("mrac_largest_error_rad", arms.and_then(|arms| arms.quantile("final_error_rad", 1.0)));
    let ruling = match (stops <= HARDLY_ANY, done >= NEARLY_ALL) {
        (true, true) => Ruling::Agrees,
        (true, false) if worst < 0.1 => Ruling::OnlyIf(format!(
            "an error of up to {} mrad 6 s after the goal is small enough: it is not stopped, but joints still swing",
            short(1e3 * worst)
        )),
        _ => Ruling::DoesNotAgree,
    };
    draft.state(words, measured, ruling)
}
