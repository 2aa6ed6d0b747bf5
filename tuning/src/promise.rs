//! What a tuned set of gains must have certified before it is written.
//!
//! | gains | claims | certificates |
//! |---|---|---|
//! | AIC, the same on every joint | `exponential`, `region` | one |
//! | AIC, joint by joint | `joint-region` | one |
//! | MRAC | `adaptive-convergence`, `pi-exponential` | one for each goal of the scenario: they are about a box around a goal |
//!
//! An AIC that does well is certified almost always, so that the best of a search are asked. The adaptive controller's claims end well inside of what simulates well: its
//! search asks about every candidate that finishes the task ([`Promised`]).

use certune::closed_loop::{Gains, Scenario};
use certune::tune::{Finite, Hardened, Objective, Outcome};
use certune::verify::ClaimKind;
use certune::{Answer, ArmCertifier, ArmGains, Request, StabilityError};

/// The goals of a scenario, each once, in their order.
pub fn goals(scenario: &Scenario) -> Vec<&[f64]> {
    let mut goals: Vec<&[f64]> = Vec::new();
    for segment in &scenario.segments {
        if !goals.contains(&segment.goal_rad.as_slice()) {
            goals.push(&segment.goal_rad);
        }
    }
    goals
}

/// How many certificates a winner has.
pub fn certificates(gains: &Gains, scenario: &Scenario) -> usize {
    match gains {
        Gains::Aic(_) => 1,
        Gains::Mrac(_) => goals(scenario).len(),
    }
}

/// The certificates of `gains`, up to the first that does not hold. The gains keep the promise if all hold ([`holds`]).
pub fn certify<const N: usize>(
    certifier: &ArmCertifier<N>,
    scenario: &Scenario,
    gains: &Gains,
) -> Result<Vec<Answer>, StabilityError> {
    let bound = ArmGains::<N>::bind(gains)?;
    let asked: Vec<Request> = match gains {
        Gains::Aic(_) if bound.are_shared() => {
            vec![Request { claims: vec![ClaimKind::Exponential, ClaimKind::Region], ..Request::default() }]
        }
        Gains::Aic(_) => vec![Request { claims: vec![ClaimKind::JointRegion], ..Request::default() }],
        Gains::Mrac(_) => goals(scenario)
            .into_iter()
            .map(|goal| Request {
                claims: vec![ClaimKind::AdaptiveConvergence, ClaimKind::PiExponential],
                at_rad: Some(goal.to_vec()),
                ..Request::default()
            })
            .collect(),
    };
    let mut made = Vec::new();
    for request in &asked {
        let answer = certifier.answer(&bound, request)?;
        let holds = answer.certificate.all_hold();
        made.push(answer);
        if !holds {
            break;
        }
    }
    Ok(made)
}

/// Whether every claim of every certificate holds.
pub fn holds(certificates: &[Answer]) -> bool {
    certificates.iter().all(|answer| answer.certificate.all_hold())
}

/// An objective behind the promise: a candidate that does not keep it is worse than any that does, whatever it costs.
pub struct Promised<'a, const N: usize> {
    pub objective: Box<dyn Objective + 'a>,
    pub certifier: &'a ArmCertifier<N>,
    pub scenario: &'a Scenario,
}

impl<const N: usize> Objective for Promised<'_, N> {
    fn evaluate(&self, gains: &Gains, enough: Option<Finite>) -> Outcome {
        let outcome = self.objective.evaluate(gains, enough);
        let Outcome::Simulated { cost } = outcome else { return outcome };
        match certify(self.certifier, self.scenario, gains) {
            Ok(made) if holds(&made) => outcome,
            Ok(_) | Err(_) => Outcome::Uncertified { cost },
        }
    }

    fn hardened(&self, gains: &Gains, round: u32) -> Option<Hardened<'_>> {
        let Hardened { objective, plant } = self.objective.hardened(gains, round)?;
        let promised = Promised { objective, certifier: self.certifier, scenario: self.scenario };
        Some(Hardened { objective: Box::new(promised), plant })
    }
}
