//! The adaptive controller's claims: an arm, gains and a goal, to a certificate.
//!
//! Its proofs look at a box of configurations around the goal, where the inertia matrix is enclosed entry by entry; what is known of the arm over all angles
//! holds there as well.

use certune_certify::{EnclosureValues, Problem, adaptive_convergence, adaptive_sampled, pi_exponential};
use certune_control::mrac::{MracGains, MracParams};
use certune_verify::{Certificate, Claim, ClaimKind};

use crate::stability::{Answer, ArmCertifier, ArmGains, STEP_S, StabilityError, checked};

/// A goal, the box around it, and what the sampled claim assumes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSetting<const N: usize> {
    /// The constant goal, rad.
    pub goal_rad: [f64; N],
    /// Half the width of the box on every joint, rad.
    pub half_width_rad: f64,
    /// How often the box is halved along each joint when M is enclosed: 1 takes half a second, 2 a minute.
    pub halvings: u32,
    /// Samples of delay for the velocity loop.
    pub delay_samples: u32,
}

impl<const N: usize> AdaptiveSetting<N> {
    /// A box of +-0.05 rad, one halving, no delay.
    pub fn around(goal_rad: [f64; N]) -> Self {
        Self { goal_rad, half_width_rad: 0.05, halvings: 1, delay_samples: 0 }
    }
}

impl<const N: usize> ArmCertifier<N> {
    /// Makes claims about the adaptive controller near a goal and has them checked. Whether they hold is for the certificate to say.
    ///
    /// Kinds: `adaptive-convergence`, `pi-exponential`, `adaptive-sampled`; any other is answered as not proved.
    ///
    /// # Errors
    /// When the gains or the box are not valid; [`StabilityError::Certify`] would be a defect of this workspace.
    pub fn certify_adaptive(
        &self,
        gains: &MracGains<N>,
        setting: &AdaptiveSetting<N>,
        claims: &[ClaimKind],
    ) -> Result<Certificate, StabilityError> {
        Ok(self.answer_adaptive(gains, setting, claims)?.certificate)
    }

    pub(crate) fn answer_adaptive(
        &self,
        gains: &MracGains<N>,
        setting: &AdaptiveSetting<N>,
        claims: &[ClaimKind],
    ) -> Result<Answer, StabilityError> {
        MracParams::new(gains, STEP_S)?;
        let problem = self.adaptive_problem(gains, setting)?;
        let made = claims.iter().map(|kind| self.adaptive_claim(&problem, setting, *kind)).collect();
        let certificate = checked(problem.document().clone(), made, problem.records())?;
        Ok(Answer::new(certificate, problem.records()))
    }

    fn adaptive_claim(&self, problem: &Problem, setting: &AdaptiveSetting<N>, kind: ClaimKind) -> Claim {
        let goal = &setting.goal_rad;
        match kind {
            ClaimKind::PiExponential => pi_exponential(problem, goal),
            ClaimKind::AdaptiveSampled => adaptive_sampled(problem, goal, STEP_S, setting.delay_samples),
            // Another kind is about the other controller, and the document says so.
            _ => adaptive_convergence(problem, goal),
        }
    }

    /// The problem over the box of a setting, without claims.
    ///
    /// # Errors
    /// When the gains or the box cannot be written.
    pub fn adaptive_problem(
        &self,
        gains: &MracGains<N>,
        setting: &AdaptiveSetting<N>,
    ) -> Result<Problem, StabilityError> {
        // Ends as a person would write them: nine decimals.
        let end = |x: f64| (x * 1e9).round() / 1e9;
        let lower = setting.goal_rad.map(|x| end(x - setting.half_width_rad));
        let upper = setting.goal_rad.map(|x| end(x + setting.half_width_rad));
        let found = self.enclosed(&lower, &upper, setting.halvings)?;
        let rows = |matrix: &[[f64; N]; N]| matrix.iter().map(|row| row.to_vec()).collect();
        let values = EnclosureValues {
            lower_rad: lower.to_vec(),
            upper_rad: upper.to_vec(),
            midpoint_kg_m2: rows(&found.midpoint_kg_m2),
            radius_kg_m2: rows(&found.radius_kg_m2),
            coriolis_kg_m2: found.coriolis_kg_m2,
            halvings: setting.halvings,
        };
        let written = ArmGains::from(*gains).written()?;
        Ok(self.problem(written)?.over_box(&values)?)
    }
}
