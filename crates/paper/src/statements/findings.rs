//! What the released code does otherwise than the paper says, and what that changes.

use crate::inputs::names;
use crate::record::Comparison;

use super::{Draft, Finding, spread};

/// All findings.
pub(crate) fn findings(found: &Comparison) -> Vec<Finding> {
    vec![missing_step(found), wrong_accumulator(found), indefinite_inertias()]
}

fn missing_step(found: &Comparison) -> Finding {
    let mut draft = Draft::new();
    let [code, equations] = [names::MRAC, names::MRAC_GOAL].map(|name| found.approximated.of(name));
    draft.read("code_final_error_rad", code.and_then(|arms| arms.median("final_error_rad")));
    draft.read("equations_final_error_rad", equations.and_then(|arms| arms.median("final_error_rad")));
    Finding {
        title: "MRAC's integrals lack the step".to_owned(),
        text: format!(
            "The released code adds the outer products of a sample to their integrals without multiplying by the step, so at 1 kHz the integral gains act a thousand times stronger than written. Error after a move {} mrad as released, {} mrad with the same gains under the equations, which cannot hold gravity: overshoot {} against {} %. The published gains belong to the code, not to the equations.",
            spread(code, "final_error_rad", 1e3),
            spread(equations, "final_error_rad", 1e3),
            spread(code, "overshoot", 100.0),
            spread(equations, "overshoot", 100.0)
        ),
        readings: draft.readings(),
    }
}

fn wrong_accumulator(found: &Comparison) -> Finding {
    let mut draft = Draft::new();
    let [code, right] = [names::MRAC, names::MRAC_GOAL_SCALED].map(|name| found.approximated.of(name));
    draft.read("code_reversals", code.and_then(|arms| arms.median("reversals")));
    draft.read("right_accumulator_reversals", right.and_then(|arms| arms.median("reversals")));
    let test = found.approximated.test("itae_rad_s2", names::MRAC, names::MRAC_GOAL_SCALED);
    draft.read("p_value_of_itae", test.map(|test| test.p_value));
    Finding {
        title: "K1 reads the sum of K0".to_owned(),
        text: format!(
            "The integral part of K1, which multiplies the velocity, reads the sum that belongs to K0, which is one of positions. With the right sum and integral gains as strong as the code's: error {} against {} mrad as released, time-weighted error {} against {} rad s², joints turn back {} against {} times.",
            spread(right, "final_error_rad", 1e3),
            spread(code, "final_error_rad", 1e3),
            spread(right, "itae_rad_s2", 1.0),
            spread(code, "itae_rad_s2", 1.0),
            spread(right, "reversals", 1.0),
            spread(code, "reversals", 1.0)
        ),
        readings: draft.readings(),
    }
}

fn indefinite_inertias() -> Finding {
    Finding {
        title: "Inertias that no body has".to_owned(),
        text: "The released robot description has indefinite inertias on links 3 and 5 and a placeholder on link 7. Such a description is refused here with the link's name, so nothing was run on it: the approximated model is made of boxes with the identified masses, centres and diagonal inertias instead.".to_owned(),
        readings: Draft::new().readings(),
    }
}
