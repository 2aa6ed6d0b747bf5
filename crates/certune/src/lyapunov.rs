//! Gains that differ from joint to joint, at one configuration: the linearised loop of all joints together.

use certune_certify::{LinearFamily, LyapunovFailure, LyapunovMatrix, lyapunov};
use certune_closed_loop::linearise_aic;
use certune_control::aic::{AicGains, AicParams};
use certune_linsys::Joints;
use certune_verify::{Certificate, Claim, ClaimKind, NotProvedClaim, Number, PlaneRegion, Reason};

use crate::stability::{ArmCertifier, ArmGains, STEP_S, StabilityError, checked};

/// Shares of the slowest eigenvalue's decay that are tried in turn.
const SHARES: [f64; 4] = [0.99, 0.97, 0.9, 0.5];

impl<const N: usize> ArmCertifier<N> {
    /// The claim `lyapunov` for the nominal arm at rest in `q_rad` with the least friction of the family, at close to the loop's own decay rate.
    ///
    /// # Errors
    /// When the gains are not valid or the loop is not finite; [`StabilityError::Certify`] would be a defect of this workspace.
    pub fn certify_at(&self, gains: &AicGains<N>, q_rad: [f64; N]) -> Result<Certificate, StabilityError> {
        let problem = self.problem(ArmGains::from(*gains).written()?)?;
        checked(problem.document().clone(), vec![self.lyapunov_at(gains, q_rad)?], problem.records())
    }

    pub(crate) fn lyapunov_at(&self, gains: &AicGains<N>, q_rad: [f64; N]) -> Result<Claim, StabilityError> {
        let params = AicParams::new(gains, STEP_S)?;
        let least = self.family().friction_n_m_s_per_rad[0];
        let axes = self.members().axes();
        // The middle of every scale: the nominal masses.
        let mut at: Vec<f64> = q_rad.to_vec();
        at.extend(self.members().groups().iter().map(|group| 0.5 * (group.scale[0] + group.scale[1])));
        at.resize(axes.len(), 0.0);
        let member = self.members().member(&at)?;
        let model = member.model.with_friction(&Joints::repeat(least), &Joints::zeros());
        let closed = linearise_aic(&model, &member.q, &params, self.family().gravity_compensation)?;
        let decay = -closed.spectral_abscissa_per_s();
        let family = LinearFamily { vertices: vec![closed.matrix().clone()], configuration_rad: Some(q_rad.to_vec()) };
        let not_proved = |reason| {
            Claim::NotProved(NotProvedClaim {
                of: ClaimKind::Lyapunov,
                sampling: None,
                distance: None,
                reason,
                remedies: Vec::new(),
            })
        };
        let mut claim = not_proved(if decay > 0.0 { Reason::CandidateFailed } else { Reason::NoPointFound });
        for share in SHARES {
            let rate = (decay * share * 1e3).floor() / 1e3;
            let Some(rate_per_s) = Number::decimal(rate).filter(|_| rate > 0.0) else { break };
            match lyapunov(&family, &[PlaneRegion::HalfPlane { rate_per_s }], LyapunovMatrix::Common) {
                Ok(found) => {
                    claim = Claim::Lyapunov(Box::new(found));
                    break;
                }
                Err(LyapunovFailure::Refused(refused)) => {
                    claim = Claim::LyapunovRefused(refused);
                    break;
                }
                Err(LyapunovFailure::Matrices | LyapunovFailure::NotFound(_) | LyapunovFailure::CandidateFailed) => {}
            }
        }
        Ok(claim)
    }
}
