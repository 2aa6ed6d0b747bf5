//! An arm, a family of plants and gains, to a certificate: the one place where dynamics, bounds and proofs meet.

use certune_bounds::{
    ArmBox, Axis, BoundsError, Ranges, SampledConstants, SamplingOptions, SearchOptions, maximise, sampled_constants,
};
use certune_certify::{
    AicGainValues, ArmValues, CertifyError, ConstantValues, FamilyValues, Options, Problem, ProblemError,
    SampledConstantValues, UnstableLoop, certify, to_json,
};
use certune_closed_loop::{PlantBox, PlantError, linearise_aic};
use certune_control::ParamError;
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::{Model, Payload, Robot, RobotError, gravity_jacobian, mass_matrix};
use certune_linsys::{Continuous, Joints, Loop, LoopError};
use certune_verify::{Attained, Certificate, ClaimKind, Number};
use nalgebra::{Complex, DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// The controllers' own step, s. Continuous-time claims do not depend on it; parameters are validated with it.
const STEP_S: f64 = 0.001;

/// Why an arm, a family and gains make no certificate.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The plant box holds delayed plants, which no claim covers.
    #[error(
        "the plant box has an actuation delay of up to {samples} samples, and no claim covers delay: set delay_samples = [0, 0]"
    )]
    Delay {
        /// Largest delay of the box, samples.
        samples: usize,
    },
    /// The arm cannot be compiled or carry the payload.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The family is no family.
    #[error(transparent)]
    Family(#[from] BoundsError),
    /// A plant of the family cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The gains are no gains.
    #[error(transparent)]
    Gains(#[from] ParamError),
    /// A number cannot be written in a certificate.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// A linearised loop is not finite.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// The checker does not accept what was written.
    #[error(transparent)]
    Certify(#[from] CertifyError),
}

/// The family of plants that a scenario's plant box spans.
///
/// # Errors
/// [`StabilityError::Delay`] when the box holds delayed plants.
pub fn family_of(plant_box: &PlantBox) -> Result<FamilyValues, StabilityError> {
    let samples = plant_box.delay_samples[1];
    if samples > 0 {
        return Err(StabilityError::Delay { samples });
    }
    Ok(FamilyValues {
        gravity_compensation: plant_box.gravity_compensation,
        friction_n_m_s_per_rad: plant_box.friction_n_m_s_per_rad,
        mass_uncertainty: plant_box.mass_uncertainty,
        payload_kg: plant_box.payload_kg,
        rotor_inertia_kg_m2: plant_box.rotor_inertia_kg_m2,
    })
}

/// How hard a certificate is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// The search for proofs.
    pub proofs: Options,
    /// The arm and configuration of a refusal.
    pub counterexample: SearchOptions,
}

impl Default for Effort {
    /// A few seconds at most on two cores.
    fn default() -> Self {
        let counterexample = SearchOptions {
            samples: 1_000,
            local_starts: 4,
            evaluations_per_start: 300,
            // An eigenvalue this far right is no rounding of a stable one, and the search may stop.
            enough: 0.05,
            ..SearchOptions::default()
        };
        Self { proofs: Options::default(), counterexample }
    }
}

/// An arm with a family of plants, its constants found once, ready to certify any number of gains.
#[derive(Clone, Debug)]
pub struct ArmCertifier<const N: usize> {
    arm: ArmValues,
    family: FamilyValues,
    members: ArmBox<N>,
    sampled: SampledConstants,
}

impl<const N: usize> ArmCertifier<N> {
    /// Samples the arm's constants over the family, which takes a second or two.
    ///
    /// # Errors
    /// When the robot has not `N` joints or a range of the family is not valid.
    pub fn new(robot: &Robot, family: &FamilyValues) -> Result<Self, StabilityError> {
        let ranges = Ranges {
            mass_uncertainty: family.mass_uncertainty,
            payload_kg: family.payload_kg,
            payload_com_m: Payload::at_grasp(robot, 1.0)?.com_m,
            rotor_inertia_kg_m2: family.rotor_inertia_kg_m2,
        };
        let [least, largest] = family.friction_n_m_s_per_rad;
        if !(least >= 0.0 && least <= largest && largest.is_finite()) {
            return Err(BoundsError::Axis { axis: 0, lower: least, upper: largest }.into());
        }
        let members = ArmBox::new(&Model::<N>::new(robot)?, &ranges)?;
        let sampled = sampled_constants(&members, &SamplingOptions::default());
        let arm = ArmValues {
            name: robot.name().to_owned(),
            joints: N,
            sha256: robot.sha256(),
            payload_com_m: ranges.payload_com_m,
        };
        Ok(Self { arm, family: family.clone(), members, sampled })
    }

    /// The sampled constants, with the configurations that attain them.
    pub fn constants(&self) -> &SampledConstants {
        &self.sampled
    }

    /// The family of plants.
    pub fn family(&self) -> &FamilyValues {
        &self.family
    }

    /// Makes the claims and has them checked. Whether they hold is for the certificate to say.
    ///
    /// # Errors
    /// When the gains are not valid; [`StabilityError::Certify`] would be a defect of this workspace.
    pub fn certify(&self, gains: &AicGains<N>, claims: &[ClaimKind]) -> Result<Certificate, StabilityError> {
        self.certify_with(gains, claims, &Effort::default())
    }

    /// As [`ArmCertifier::certify`], with an effort of one's own.
    ///
    /// # Errors
    /// As [`ArmCertifier::certify`].
    pub fn certify_with(
        &self,
        gains: &AicGains<N>,
        claims: &[ClaimKind],
        effort: &Effort,
    ) -> Result<Certificate, StabilityError> {
        let params = AicParams::new(gains, STEP_S)?;
        let problem = Problem::new(&self.arm, gain_values(gains).written()?, &self.family, &self.constant_values())?;
        let attain = || self.unstable_member(&params, &effort.counterexample).ok().flatten();
        Ok(certify(&problem, claims, &effort.proofs, &attain)?)
    }

    fn constant_values(&self) -> ConstantValues {
        let s = &self.sampled;
        ConstantValues::Sampled(SampledConstantValues {
            m_lo_kg_m2: s.constants.m_lo_kg_m2,
            m_hi_kg_m2: s.constants.m_hi_kg_m2,
            k_g_n_m_per_rad: s.constants.k_g_n_m_per_rad,
            k_c_kg_m2: s.constants.k_c_kg_m2,
            k_r: s.constants.k_r,
            k_m: None,
            diagonal_kg_m2: None,
            gravity_torque_n_m: Some(s.gravity_torque_n_m.clone()),
            margin: s.margin,
            samples: s.samples,
            local_starts: s.local_starts,
        })
    }

    /// Searches the family for a member, configuration and friction whose linearised loop is unstable.
    fn unstable_member(
        &self,
        params: &AicParams<N>,
        options: &SearchOptions,
    ) -> Result<Option<(UnstableLoop, Attained)>, StabilityError> {
        let [least, largest] = self.family.friction_n_m_s_per_rad;
        let mut axes = self.members.axes();
        axes.push(Axis::Interval { lower: least, upper: largest });
        let score =
            |at: &[f64]| self.member_loop(params, at).map_or(f64::NAN, |found| found.1.spectral_abscissa_per_s());
        let top = maximise(&axes, options, score)?;
        if top.value.is_nan() || top.value <= 0.0 {
            return Ok(None);
        }
        // Angles that a person can type, if the loop is unstable there as well.
        let mut short = top.at.clone();
        for angle in &mut short[..N] {
            *angle = (*angle * 1e3).round() / 1e3;
        }
        let at = if score(&short) > 0.0 { short } else { top.at };
        let (member, closed) = self.member_loop(params, &at)?;
        let friction = at.last().copied().unwrap_or_default();
        Ok(self.describe(&member, &closed, &at, friction))
    }

    fn member_loop(
        &self,
        params: &AicParams<N>,
        at: &[f64],
    ) -> Result<(certune_bounds::Member<N>, Loop<Continuous>), StabilityError> {
        let (place, friction) = at.split_at(at.len().saturating_sub(1));
        let mut member = self.members.member(place)?;
        member.model = member.model.with_friction(&Joints::repeat(friction[0]), &Joints::zeros());
        let closed = linearise_aic(&member.model, &member.q, params, self.family.gravity_compensation)?;
        Ok((member, closed))
    }

    /// The eigenvector's one-joint loop, and the member in the certificate's terms.
    fn describe(
        &self,
        member: &certune_bounds::Member<N>,
        closed: &Loop<Continuous>,
        at: &[f64],
        friction: f64,
    ) -> Option<(UnstableLoop, Attained)> {
        let eigenvalue = closed.rightmost_eigenvalue();
        let e = eigenvector(closed.matrix(), eigenvalue)?.rows(0, N).into_owned();
        let norm_squared = e.norm_squared();
        let form = |matrix: DMatrix<f64>| {
            let product = matrix.map(|x| Complex::new(x, 0.0)) * &e;
            e.dotc(&product).re / norm_squared
        };
        let dense = |matrix: &nalgebra::SMatrix<f64, N, N>| DMatrix::from_fn(N, N, |i, j| matrix[(i, j)]);
        let stiffness = if self.family.gravity_compensation {
            0.0
        } else {
            form(dense(&gravity_jacobian(&member.model, &member.q)))
        };
        let found = UnstableLoop {
            inertia_kg_m2: form(dense(&mass_matrix(&member.model, &member.q))),
            friction_n_m_s_per_rad: friction,
            stiffness_n_m_per_rad: stiffness,
        };
        let numbers = |values: &[f64]| values.iter().map(|&x| decimal(x)).collect::<Option<Vec<_>>>();
        let scales = &at[N..];
        let [rotor_lower, rotor_upper] = self.family.rotor_inertia_kg_m2;
        let groups = self.members.groups().len();
        let fraction = scales.get(groups).copied().unwrap_or_default();
        let payload = if groups > N { scales[N] } else { 0.0 };
        let attained = Attained {
            q_rad: numbers(member.q.as_slice())?,
            link_mass_scale: numbers(&scales[..N])?,
            payload_kg: decimal(payload)?,
            rotor_inertia_kg_m2: decimal(rotor_lower + fraction * (rotor_upper - rotor_lower))?,
            friction_n_m_s_per_rad: decimal(friction)?,
            eigenvalue_per_s: [four_digits(eigenvalue.re)?, four_digits(eigenvalue.im)?],
        };
        found.inertia_kg_m2.is_finite().then_some((found, attained))
    }
}

/// Four significant digits, of something that only illustrates.
fn four_digits(x: f64) -> Option<Number> {
    decimal(format!("{x:.3e}").parse().ok()?)
}

/// The decimal of a search's result; what is zero to rounding is written as zero.
fn decimal(x: f64) -> Option<Number> {
    Number::decimal(if x.abs() < 1e-12 { 0.0 } else { x })
}

/// An eigenvector by three steps of inverse iteration, from a start without symmetry.
fn eigenvector(a: &DMatrix<f64>, eigenvalue: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    let order = a.nrows();
    // A shift a little off the eigenvalue keeps the factorisation regular.
    let shift = eigenvalue + Complex::new(1e-9, 1e-9) * (1.0 + eigenvalue.norm());
    let shifted = a.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(order, order) * shift;
    let factors = shifted.lu();
    let mut vector = DVector::from_fn(order, |i, _| Complex::new(1.0 + (i as f64).sin(), (i as f64).cos()));
    for _ in 0..3 {
        vector = factors.solve(&vector)?.normalize();
    }
    vector.iter().all(|x| x.re.is_finite() && x.im.is_finite()).then_some(vector)
}

fn gain_values<const N: usize>(gains: &AicGains<N>) -> AicGainValues {
    AicGainValues {
        kappa_mu: gains.kappa_mu.to_vec(),
        kappa_a: gains.kappa_a.to_vec(),
        sigma_q: gains.sigma_q.to_vec(),
        sigma_dq: gains.sigma_dq.to_vec(),
        sigma_mu: gains.sigma_mu.to_vec(),
        sigma_dmu: gains.sigma_dmu.to_vec(),
        reference_time_constant_s: gains.reference_time_constant_s.to_vec(),
    }
}

/// The certificate as it is written to a file.
///
/// # Errors
/// [`StabilityError::Certify`] when it does not serialise, which would be a defect.
pub fn certificate_text(certificate: &Certificate) -> Result<String, StabilityError> {
    Ok(to_json(certificate.document()).map_err(CertifyError::from)?)
}

/// Eigenvalues, as (real, imaginary) in 1/s, of the linearised loops of random members of a plant box in random configurations.
///
/// # Errors
/// When the robot has not `N` joints or the gains are not valid.
pub fn poles_per_s<const N: usize>(
    robot: &Robot,
    plant_box: &PlantBox,
    gains: &AicGains<N>,
    configurations: usize,
    seed: u64,
) -> Result<Vec<[f64; 2]>, StabilityError> {
    let params = AicParams::new(gains, STEP_S)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut poles = Vec::with_capacity(6 * N * configurations);
    for index in 0..configurations {
        let model = plant_box.draw(N, seed, index as u64).model::<N>(robot)?;
        let q = Joints::from_fn(|_, _| {
            let unit = (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
            std::f64::consts::PI * (2.0 * unit - 1.0)
        });
        let closed = linearise_aic(&model, &q, &params, plant_box.gravity_compensation)?;
        poles.extend(closed.eigenvalues().into_iter().map(|s| [s.re, s.im]));
    }
    Ok(poles)
}
