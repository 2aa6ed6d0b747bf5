//! Statements about pick and place on the approximated model, payloads and pushes.

use certune_closed_loop::metrics::SETTLING_BAND;

use crate::inputs::names;
use crate::record::{Arms, Comparison, Experiment};

use super::{
    COMPARE, DONE_RAD, Draft, HARDLY_ANY, NEARLY_ALL, Ruling, SIGNIFICANT, Statement, Words, chance, share, short,
    spread,
};

const SIMULATE_MRAC: &str =
    "autotune simulate --robot panda-cuboid --gains pezzato2020-mrac-simulation --scenario pick-and-place-paper";

/// Whether the first has the lower figure on significantly more arms; the p-value.
fn lower(draft: &mut Draft, experiment: &Experiment, figure: &str, first: &str, second: &str) -> (bool, f64) {
    let test = experiment.test(figure, first, second);
    let p_value = draft.read(&format!("p_value_of_{figure}"), test.map(|test| test.p_value));
    let more = test.is_some_and(|test| test.first_lower > test.second_lower);
    (more && p_value < SIGNIFICANT, p_value)
}

pub(super) fn adaptability(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let experiment = &found.approximated;
    let [aic, mrac] = [names::AIC, names::MRAC].map(|name| experiment.of(name));
    let mut better = |figure: &str| lower(&mut draft, experiment, figure, names::AIC, names::MRAC);
    let (settles, p_settling) = better("settling_time_s");
    let (swings, p_swings) = better("reversals");
    let largest = draft.read("aic_largest_overshoot", aic.and_then(|arms| arms.quantile("overshoot", 1.0)));
    let overshoot = largest < SETTLING_BAND;
    draft.read("aic_reversals", aic.and_then(|arms| arms.median("reversals")));
    draft.read("mrac_reversals", mrac.and_then(|arms| arms.median("reversals")));
    let words = Words {
        name: "adaptability",
        section: "abstract, experiments",
        statement: "On an approximated model the AIC adapts better than MRAC: it settles without the oscillations of MRAC.",
        rule: "agrees if the AIC settles earlier and its joints turn back less often (each p < 0.01 over the same arms), and if it overshoots by less than the 2 % band on every arm; only if, when one of the three does not hold",
        figure: "approximated-spread",
        command: SIMULATE_MRAC,
    };
    let measured = format!(
        "settling {} s against {} s ({}); joints turn back {} against {} times in five moves ({}); overshoot {} against {} %; under the paper's equations with a reference model MRAC ends moves off by {} mrad",
        spread(aic, "settling_time_s", 1.0),
        spread(mrac, "settling_time_s", 1.0),
        chance(p_settling),
        spread(aic, "reversals", 1.0),
        spread(mrac, "reversals", 1.0),
        chance(p_swings),
        spread(aic, "overshoot", 100.0),
        spread(mrac, "overshoot", 100.0),
        spread(experiment.of(names::MRAC_MODEL), "final_error_rad", 1e3)
    );
    let held = [(settles, "settling"), (swings, "turning back"), (overshoot, "overshoot")];
    let ruling = match held.iter().filter(|(held, _)| *held).count() {
        3 => Ruling::Agrees,
        0 => Ruling::DoesNotAgree,
        _ => {
            let good: Vec<&str> = held.iter().filter(|(held, _)| *held).map(|(_, what)| *what).collect();
            Ruling::OnlyIf(format!("judged by {} with published gains", good.join(" and ")))
        }
    };
    draft.state(words, measured, ruling)
}

pub(super) fn same_tuning(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let experiment = &found.approximated;
    let [aic, mrac] = [names::AIC_TUNED, names::MRAC_MATCHED].map(|name| experiment.of(name));
    let mut better = |figure: &str| lower(&mut draft, experiment, figure, names::AIC_TUNED, names::MRAC_MATCHED);
    let (error, p_error) = better("itae_rad_s2");
    let (overshoot, p_overshoot) = better("overshoot");
    let (jitter, p_jitter) = better("torque_rate_rms_n_m_per_s");
    let held = [(error, "time-weighted error"), (overshoot, "overshoot"), (jitter, "torque rate")];
    let words = Words {
        name: "same-tuning",
        section: "experiments",
        statement: "The AIC's advantage on the approximated model is one of the controller, not of its gains.",
        rule: "with both tuned alike and references equally fast: agrees if the AIC has less time-weighted error, overshoot and torque rate (each p < 0.01); only if, when one does not hold",
        figure: "approximated-spread",
        command: COMPARE,
    };
    let measured = format!(
        "time-weighted error {} against {} rad s² ({}); overshoot {} against {} % ({}); torque rate {} against {} N m/s ({})",
        spread(aic, "itae_rad_s2", 1.0),
        spread(mrac, "itae_rad_s2", 1.0),
        chance(p_error),
        spread(aic, "overshoot", 100.0),
        spread(mrac, "overshoot", 100.0),
        chance(p_overshoot),
        spread(aic, "torque_rate_rms_n_m_per_s", 1.0),
        spread(mrac, "torque_rate_rms_n_m_per_s", 1.0),
        chance(p_jitter)
    );
    let good: Vec<&str> = held.iter().filter(|(held, _)| *held).map(|(_, what)| *what).collect();
    let ruling = match good.len() {
        3 => Ruling::Agrees,
        0 => Ruling::DoesNotAgree,
        _ => Ruling::OnlyIf(format!("judged by {}", good.join(" and "))),
    };
    draft.state(words, measured, ruling)
}

pub(super) fn mrac_saturates(found: &Comparison) -> Statement {
    saturates(
        found,
        &found.approximated,
        "mrac-saturates",
        "MRAC asks for more torque than the motors have right after a new goal.",
    )
}

pub(super) fn mrac_saturates_at_the_papers_limit(found: &Comparison) -> Statement {
    saturates(
        found,
        &found.paper_limit,
        "mrac-saturates-at-85",
        "The same with the limit of 85 N m on every joint that the paper gives.",
    )
}

fn saturates(found: &Comparison, experiment: &Experiment, name: &str, statement: &str) -> Statement {
    let mut draft = Draft::new();
    let arms = experiment.of(names::MRAC);
    let any = draft.read(
        "mrac_share_saturating_after_a_goal",
        arms.and_then(|arms| share(arms, "saturated_after_goal", |count| count > 0.0)),
    );
    let sum = |figure: &str| arms.and_then(|arms| Some(arms.figures.get(figure)?.values.iter().flatten().sum::<f64>()));
    let after = draft.read("mrac_saturated_samples_after_a_goal", sum("saturated_after_goal"));
    let all = draft.read("mrac_saturated_samples", sum("saturated_samples"));
    let words = Words {
        name,
        section: "experiments",
        statement,
        rule: "agrees if, as released, MRAC saturates within 0.25 s of a goal on at least 95 % of the arms",
        figure: "approximated-torques",
        command: SIMULATE_MRAC,
    };
    let measured = format!(
        "on {} % of {} arms; {} of {} saturated samples lie within 0.25 s of a goal; peak torque asked for {} N m",
        short(100.0 * any),
        found.question.arms,
        short(after),
        short(all),
        spread(arms, "peak_torque_n_m", 1.0)
    );
    draft.state(words, measured, Ruling::of(any >= NEARLY_ALL))
}

pub(super) fn aic_does_not_saturate(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let arms = found.approximated.of(names::AIC);
    let any =
        draft.read("aic_share_saturating", arms.and_then(|arms| share(arms, "saturated_samples", |count| count > 0.0)));
    let words = Words {
        name: "aic-does-not-saturate",
        section: "experiments",
        statement: "The AIC keeps within the motors' torques.",
        rule: "agrees if it saturates on no arm",
        figure: "approximated-torques",
        command: "autotune simulate --robot panda-cuboid --gains pezzato2020-simulation --scenario pick-and-place-paper",
    };
    let measured = format!(
        "it saturates on {} % of {} arms; peak torque {} N m",
        short(100.0 * any),
        found.question.arms,
        spread(arms, "peak_torque_n_m", 1.0)
    );
    draft.state(words, measured, Ruling::of(any <= 0.0))
}

pub(super) fn smoother(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let experiment = &found.approximated;
    let figure = "torque_rate_rms_n_m_per_s";
    let (is_lower, p_value) = lower(&mut draft, experiment, figure, names::AIC, names::MRAC);
    let [aic, mrac] = [names::AIC, names::MRAC].map(|name| experiment.of(name));
    let ratio = |one: Option<&Arms>, other: Option<&Arms>| Some(other?.median(figure)? / one?.median(figure)?);
    let times = draft.read("mrac_over_aic", ratio(aic, mrac));
    let words = Words {
        name: "smoother",
        section: "experiments, discussion",
        statement: "The AIC's torques are smoother than MRAC's.",
        rule: "agrees if the torque rate of the worst joint is lower with the AIC (p < 0.01 over the same arms)",
        figure: "approximated-spread",
        command: SIMULATE_MRAC,
    };
    let measured = format!(
        "root mean square of the torque's rate {} against {} N m/s, {} times as much ({})",
        spread(aic, figure, 1.0),
        spread(mrac, figure, 1.0),
        short(times),
        chance(p_value)
    );
    draft.state(words, measured, Ruling::of(is_lower))
}

pub(super) fn steady_state(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let pushed = found.push.of(names::AIC);
    let moved = found.approximated.of(names::AIC);
    let after =
        draft.read("aic_largest_error_after_a_push_rad", pushed.and_then(|arms| arms.quantile("final_error_rad", 1.0)));
    let largest_step = 1.3;
    // A first-order lag of a second leaves this of its largest step after six.
    let lag = draft.read("error_left_by_the_reference_rad", largest_step * (-6.0_f64).exp());
    let error = draft.read("aic_median_error_after_a_move_rad", moved.and_then(|arms| arms.median("final_error_rad")));
    let words = Words {
        name: "no-steady-state-error",
        section: "theory of the controller",
        statement: "Integral action takes the error to zero although gravity and disturbances are not modelled.",
        rule: "agrees if 7 s after a push no joint of any arm is off by more than 2 mrad, and 6 s after a goal no more is left than twice what the reference leaves",
        figure: "push-responses",
        command: "autotune simulate --robot panda --gains pezzato2020-simulation --scenario push",
    };
    let measured = format!(
        "after a push at most {} mrad; 6 s after a goal {} mrad, of which the reference itself leaves {}",
        short(1e3 * after),
        spread(moved, "final_error_rad", 1e3),
        short(1e3 * lag)
    );
    draft.state(words, measured, Ruling::of(after < 2e-3 && error < 2.0 * lag))
}

pub(super) fn bottles(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let mut done = |name: &str| {
        let arms = found.payloads.of(name);
        let done = arms.and_then(|arms| share(arms, "final_error_rad", |error| error < DONE_RAD));
        draft.read(&format!("{name}_share_done"), done)
    };
    let (aic, mrac) = (done(names::AIC_ROBOT), done(names::MRAC_ROBOT));
    let simulation = done(names::AIC);
    let words = Words {
        name: "either-bottle",
        section: "experiments",
        statement: "Both controllers carry out the pick and place with either bottle.",
        rule: "agrees if, with the gains of the robot, both end every goal within 50 mrad on at least 95 % of the arms with the full bottle",
        figure: "payload-spread",
        command: "autotune simulate --robot panda --gains pezzato2020-libfranka --scenario payload-swap",
    };
    let of = |name| spread(found.payloads.of(name), "final_error_rad", 1e3);
    let measured = format!(
        "AIC on {} %, MRAC on {} % of the arms; largest errors {} and {} mrad; AIC with the gains of the simulation on {} %",
        short(100.0 * aic),
        short(100.0 * mrac),
        of(names::AIC_ROBOT),
        of(names::MRAC_ROBOT),
        short(100.0 * simulation)
    );
    let ruling = match (aic >= NEARLY_ALL, mrac >= NEARLY_ALL) {
        (true, true) => Ruling::Agrees,
        (true, false) => Ruling::OnlyIf("the controller is the AIC".to_owned()),
        (false, true) => {
            Ruling::OnlyIf("the controller is MRAC, or the AIC has the gains of the simulation".to_owned())
        }
        (false, false) => Ruling::DoesNotAgree,
    };
    draft.state(words, measured, ruling)
}

pub(super) fn compliance_to_payloads(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let [aic, mrac] = [names::AIC_ROBOT, names::MRAC_ROBOT].map(|name| found.payloads.of(name));
    let test = found.payloads.test("lift_deviation_rad", names::AIC_ROBOT, names::MRAC_ROBOT);
    let p_value = draft.read("p_value_of_lift_deviation", test.map(|test| test.p_value));
    draft.read("aic_lift_deviation_rad", aic.and_then(|arms| arms.median("lift_deviation_rad")));
    draft.read("mrac_lift_deviation_rad", mrac.and_then(|arms| arms.median("lift_deviation_rad")));
    let stiffer = test.is_some_and(|test| test.second_lower > test.first_lower) && p_value < SIGNIFICANT;
    let words = Words {
        name: "compliance-to-payloads",
        section: "experiments, discussion",
        statement: "A heavier bottle makes the AIC deviate more than MRAC: it is the more compliant one.",
        rule: "agrees if, with the gains of the robot, MRAC's trajectories with either bottle differ less when the bottle is lifted (p < 0.01 over the same arms)",
        figure: "payload-spread",
        command: COMPARE,
    };
    let of = |arms, figure: &str| spread(arms, figure, 1e3);
    let measured = format!(
        "on lifting {} against {} mrad ({}), carrying {} against {}, releasing {} against {}; motion ripple {} against {} rad/s²",
        of(aic, "lift_deviation_rad"),
        of(mrac, "lift_deviation_rad"),
        chance(p_value),
        of(aic, "carry_deviation_rad"),
        of(mrac, "carry_deviation_rad"),
        of(aic, "release_deviation_rad"),
        of(mrac, "release_deviation_rad"),
        spread(aic, "ripple_rad_per_s2", 1.0),
        spread(mrac, "ripple_rad_per_s2", 1.0)
    );
    draft.state(words, measured, Ruling::of(stiffer))
}

pub(super) fn push_is_recovered_smoothly(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let of = [names::AIC, names::AIC_ROBOT, names::MRAC_ROBOT].map(|name| found.push.of(name));
    let [aic, robot, _] = of;
    let back = |arms: Option<&Arms>| arms.and_then(|arms| share(arms, "recovery_s", |_| true));
    let largest = |arms: Option<&Arms>, figure: &str| arms.and_then(|arms| arms.quantile(figure, 1.0));
    let all_back = draft.read("aic_share_back", back(aic)).min(draft.read("aic_robot_share_back", back(robot)));
    let swings = draft
        .read("aic_largest_swings", largest(aic, "swings"))
        .max(draft.read("aic_robot_largest_swings", largest(robot, "swings")));
    let rebound = draft
        .read("aic_largest_rebound", largest(aic, "rebound"))
        .max(draft.read("aic_robot_largest_rebound", largest(robot, "rebound")));
    let words = Words {
        name: "smooth-return",
        section: "experiments",
        statement: "After a push the AIC returns to the goal smoothly, without oscillations.",
        rule: "with the gains of the simulation and of the robot alike: agrees if every arm comes back to a tenth of its deviation without a change of side and with a rebound below a fifth of it; only if, when there is one change of side at most",
        figure: "push-responses",
        command: "autotune simulate --robot panda --gains pezzato2020-libfranka --scenario push",
    };
    let three = |figure: &str, scale| of.map(|arms| spread(arms, figure, scale)).join(", ");
    let measured = format!(
        "AIC with the gains of the simulation, of the robot, and MRAC with those of the robot: back after {} s; rebound {} %; changes of side {}",
        three("recovery_s", 1.0),
        three("rebound", 100.0),
        three("swings", 1.0)
    );
    let ruling = if all_back < 1.0 || swings > 1.0 {
        Ruling::DoesNotAgree
    } else if swings < 1.0 && rebound < 0.2 {
        Ruling::Agrees
    } else {
        let rebound = short(100.0 * rebound);
        Ruling::OnlyIf(format!(
            "one swing to the other side counts as smooth: what the integral has taken up against the push throws the arm back by up to {rebound} % of the deviation"
        ))
    };
    draft.state(words, measured, ruling)
}

pub(super) fn push_is_given_way_to(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let [aic, mrac] = [names::AIC_ROBOT, names::MRAC_ROBOT].map(|name| found.push.of(name));
    let test = found.push.test("stiffness_n_per_m", names::AIC_ROBOT, names::MRAC_ROBOT);
    let p_value = draft.read("p_value_of_stiffness", test.map(|test| test.p_value));
    draft.read("aic_stiffness_n_per_m", aic.and_then(|arms| arms.median("stiffness_n_per_m")));
    draft.read("mrac_stiffness_n_per_m", mrac.and_then(|arms| arms.median("stiffness_n_per_m")));
    let softer = test.is_some_and(|test| test.first_lower > test.second_lower) && p_value < SIGNIFICANT;
    let failed =
        draft.read("mrac_share_diverged", mrac.map(|arms| arms.diverged as f64 / found.question.arms.max(1) as f64));
    let words = Words {
        name: "compliance-to-pushes",
        section: "experiments, discussion",
        statement: "The AIC gives way to a push where MRAC is stiff.",
        rule: "agrees if, with the gains of the robot, the AIC is softer at the flange (p < 0.01 over the same arms) and MRAC runs away on at most 5 % of them",
        figure: "push-spread",
        command: "autotune simulate --robot panda --gains pezzato2020-mrac-robot --scenario push",
    };
    let measured = format!(
        "{} against {} N/m ({}); largest deviation of a joint {} against {} mrad",
        spread(aic, "stiffness_n_per_m", 1.0),
        spread(mrac, "stiffness_n_per_m", 1.0),
        chance(p_value),
        spread(aic, "peak_deviation_rad", 1e3),
        spread(mrac, "peak_deviation_rad", 1e3)
    );
    draft.state(words, measured, Ruling::of(softer && failed <= HARDLY_ANY))
}
