//! Statements about the controllers themselves: parameters, operations, time, models, tuning.

use crate::inputs::names;
use crate::record::{Comparison, StepCost};
use crate::runs::JOINTS;

use super::{COMPARE, DONE_RAD, Draft, Ruling, Statement, Words, share, short, spread};

/// The paper's count of a step: sums of vectors, and products of numbers and vectors.
const PAPER_SUMS: f64 = 16.0;
const PAPER_PRODUCTS: f64 = 15.0;
/// What a step may take, ns.
const BUDGET_NS: f64 = 3e5;

pub(super) fn fewer_parameters(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let aic = draft.read("aic_parameters", found.effort.aic_parameters as f64);
    let free = draft.read("aic_degrees_of_freedom", found.effort.aic_degrees_of_freedom as f64);
    let mrac = draft.read("mrac_parameters", found.effort.mrac_parameters as f64);
    let words = Words {
        name: "fewer-parameters",
        section: "abstract, introduction",
        statement: "The AIC has far fewer parameters to tune than MRAC.",
        rule: "agrees if the AIC has fewer than a tenth of MRAC's",
        figure: "effort",
        command: COMPARE,
    };
    let measured = format!(
        "{aic} against {mrac} for seven joints; multiplying all of the AIC's by one number changes nothing, so {free} are independent"
    );
    draft.state(words, measured, Ruling::of(10.0 * aic < mrac))
}

fn costs<'a>(found: &'a Comparison, controller: &'a str) -> impl Iterator<Item = &'a StepCost> {
    found.cost.iter().filter(move |cost| cost.controller == controller)
}

fn on_the_arm<'a>(found: &'a Comparison, controller: &str) -> Option<&'a StepCost> {
    found.cost.iter().find(|cost| cost.controller == controller && cost.joints == JOINTS)
}

pub(super) fn linear_complexity(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let one = costs(found, "aic").find(|cost| cost.joints == 1).map(StepCost::total);
    let exact = |cost: &StepCost| one.is_some_and(|one| cost.total() == one * cost.joints as u64);
    let most = costs(found, "aic").map(|cost| cost.joints).max();
    let linear = costs(found, "aic").all(exact);
    let per_joint = draft.read("aic_operations_per_joint", one.map(|one| one as f64));
    let most = draft.read("most_joints", most.map(|joints| joints as f64));
    let growth = |controller| {
        let at = |joints| costs(found, controller).find(|cost| cost.joints == joints).map(|cost| cost.total() as f64);
        Some(at(28)? / at(14)?)
    };
    let aic = draft.read("aic_growth_from_14_to_28_joints", growth("aic"));
    let mrac = draft.read("mrac_growth_from_14_to_28_joints", growth("mrac-released-code"));
    let words = Words {
        name: "linear-complexity",
        section: "theory of the controller",
        statement: "A step of the AIC costs a number of operations that grows linearly with the number of joints.",
        rule: "agrees if the counted operations for 1, 2, 4, 7, 14 and 28 joints are exactly proportional",
        figure: "cost-operations",
        command: COMPARE,
    };
    let measured = format!(
        "{per_joint} operations a joint for 1 to {most} joints, {}; from 14 to 28 joints the AIC's grow by {}, MRAC's by {}",
        if linear { "exactly" } else { "not exactly" },
        short(aic),
        short(mrac)
    );
    draft.state(words, measured, Ruling::of(linear))
}

pub(super) fn operations(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let cost = on_the_arm(found, "aic");
    let per_joint = |count: u64| count as f64 / JOINTS as f64;
    let sums = draft.read("aic_vector_sums", cost.map(|cost| per_joint(cost.additions)));
    let products = draft.read("aic_scalar_vector_products", cost.map(|cost| per_joint(cost.multiplications)));
    let words = Words {
        name: "operations",
        section: "theory of the controller",
        statement: "A step of the AIC takes 16 sums of vectors and 15 products of a number and a vector.",
        rule: "agrees if neither count is above the paper's; only if written otherwise, when the two together are within a third",
        figure: "cost-operations",
        command: COMPARE,
    };
    let together = (sums + products) / (PAPER_SUMS + PAPER_PRODUCTS);
    let ruling = if sums <= PAPER_SUMS && products <= PAPER_PRODUCTS {
        Ruling::Agrees
    } else if together <= 4.0 / 3.0 {
        Ruling::OnlyIf(
            "the four products by the rate of the reference are left out, which is 1 in the paper, and a sum more or less does not matter".to_owned(),
        )
    } else {
        Ruling::DoesNotAgree
    };
    draft.state(words, format!("{sums} sums and {products} products of vectors, counted on the code as it runs, of which four by the rate of the reference"), ruling)
}

pub(super) fn budget(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    // Times differ from run to run, so the record says on which side of the budget they lie and keeps them apart.
    let within = |controller: &str| {
        let mut times =
            found.measured_times.iter().filter(|time| time.joints == JOINTS && time.controller.starts_with(controller));
        times.next().map(|first| {
            f64::from(u8::from(first.median_ns < BUDGET_NS && times.all(|time| time.median_ns < BUDGET_NS)))
        })
    };
    let aic = draft.read("aic_within_budget", within("aic"));
    let mrac = draft.read("mrac_within_budget", within("mrac"));
    let operations = |controller| on_the_arm(found, controller).map(|cost| cost.total() as f64);
    let aic_operations = draft.read("aic_operations", operations("aic"));
    let mrac_operations = draft.read("mrac_operations", operations("mrac-released-code"));
    let words = Words {
        name: "fast-loop",
        section: "theory of the controller, experiments",
        statement: "The AIC is cheap enough for a fast loop: a step fits into the 300 us that the robot leaves of its millisecond.",
        rule: "agrees if the median time of a step for seven joints is below 300 us on this machine",
        figure: "cost-times",
        command: COMPARE,
    };
    let side = |within: f64| if within > 0.5 { "below" } else { "above" };
    let measured = format!(
        "AIC {} and MRAC {} the budget (measured times are kept apart); {aic_operations} operations against {mrac_operations}",
        side(aic),
        side(mrac)
    );
    draft.state(words, measured, Ruling::of(aic > 0.5))
}

pub(super) fn no_dynamic_model(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let arms = found.approximated.of(names::AIC);
    let done =
        draft.read("aic_share_done", arms.and_then(|arms| share(arms, "final_error_rad", |error| error < DONE_RAD)));
    draft.read("aic_worst_error_rad", arms.and_then(|arms| arms.quantile("final_error_rad", 1.0)));
    let words = Words {
        name: "no-dynamic-model",
        section: "abstract",
        statement: "The AIC needs no model of the arm's dynamics.",
        rule: "agrees if one set of gains, which sees neither masses nor gravity, ends every move within 50 mrad on every arm",
        figure: "approximated-spread",
        command: "autotune simulate --robot panda-cuboid --gains pezzato2020-simulation --scenario pick-and-place-paper",
    };
    let measured = format!(
        "on {} % of {} arms with unknown masses and gravity every move ends within 50 mrad; errors {} mrad",
        short(100.0 * done),
        found.question.arms,
        spread(arms, "final_error_rad", 1e3)
    );
    draft.state(words, measured, Ruling::of(done >= 1.0))
}

pub(super) fn tuning_effort(found: &Comparison) -> Statement {
    let mut draft = Draft::new();
    let search = |name: &str| found.effort.searches.iter().find(|search| search.contender == name);
    let best = |name: &str| search(name).and_then(|search| Some(search.best_so_far.last()?.1));
    let aic = draft.read("aic_best_cost_s", best(names::AIC_TUNED));
    let matched = draft.read("mrac_matched_best_cost_s", best(names::MRAC_MATCHED));
    let free = draft.read("mrac_free_best_cost_s", best(names::MRAC_FREE));
    // The cost that both controllers reach.
    let common = aic.max(matched);
    let until = |name: &str| search(name).and_then(|search| search.until(common)).map(|candidates| candidates as f64);
    let aic_until = draft.read("aic_candidates_to_common_cost", until(names::AIC_TUNED));
    let mrac_until = draft.read("mrac_candidates_to_common_cost", until(names::MRAC_MATCHED));
    let words = Words {
        name: "tuning-effort",
        section: "experiments, discussion",
        statement: "Tuning MRAC takes more effort than tuning the AIC.",
        rule: "agrees if MRAC with a reference as fast as the AIC's takes at least twice as many candidates to the best cost that both reach",
        figure: "effort",
        command: COMPARE,
    };
    let measured = format!(
        "with {} candidates on the same plants the AIC comes to a settling cost of {} s, MRAC to {} s, with the speed of its reference free to {} s; to the cost that both reach the AIC takes {aic_until} candidates, MRAC {mrac_until}. Both start at published gains: the AIC's are good there already, MRAC's were not made for the equations",
        found.question.candidates,
        short(aic),
        short(matched),
        short(free)
    );
    draft.state(words, measured, Ruling::of(mrac_until >= 2.0 * aic_until))
}
