//! A member of the family, with a configuration, whose linearised loop is unstable: what a refusal shows.

use certune_bounds::{Axis, Member, SearchOptions, maximise};
use certune_certify::UnstableLoop;
use certune_closed_loop::{linearise_aic, linearise_aic_sampled};
use certune_control::aic::{AicGains, AicParams};
use certune_dynamics::{Model, gravity_jacobian, mass_matrix_as_described};
use certune_linsys::Joints;
use certune_verify::{Attained, LoopTiming, Number, PlantStep};
use nalgebra::{Complex, DMatrix, DVector};
use num_traits::ToPrimitive;

use super::arm::ArmCertifier;
use super::{STEP_S, StabilityError};

impl<const N: usize> ArmCertifier<N> {
    /// Searches the family for a member, configuration and friction whose linearised loop is unstable, in continuous time or with the
    /// simulator's step; the exact hold is not searched.
    pub(super) fn unstable_member(
        &self,
        gains: &AicGains<N>,
        timing: Option<&LoopTiming>,
        options: &SearchOptions,
    ) -> Result<Option<(UnstableLoop, Attained)>, StabilityError> {
        let Some(time) = Time::new(gains, timing, STEP_S)? else { return Ok(None) };
        let [least, largest] = self.family.friction_n_m_s_per_rad;
        let mut axes = self.members.axes();
        axes.push(Axis::Interval { lower: least, upper: largest });
        let score = |at: &[f64]| self.member_loop(&time, at).map_or(f64::NAN, |found| found.1.per_s.re);
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
        let (member, worst) = self.member_loop(&time, &at)?;
        let friction = at.last().copied().unwrap_or_default();
        Ok(self.describe(&member, &worst, &at, friction))
    }

    fn member_loop(&self, time: &Time<N>, at: &[f64]) -> Result<(Member<N>, Mode), StabilityError> {
        let (place, friction) = at.split_at(at.len().saturating_sub(1));
        let mut member = self.members.member(place)?;
        member.model = member.model.with_friction(&Joints::repeat(friction[0]), &Joints::zeros());
        let compensated = self.family.gravity_compensation;
        let mode = time.worst_mode(&member.model, &member.q, compensated)?;
        Ok((member, mode))
    }

    /// The eigenvector's one-joint loop, and the member in the certificate's terms.
    fn describe(&self, member: &Member<N>, mode: &Mode, at: &[f64], friction: f64) -> Option<(UnstableLoop, Attained)> {
        let e = mode.vector()?.rows(0, N).into_owned();
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
            inertia_kg_m2: form(dense(&mass_matrix_as_described(&member.model, &member.q))),
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
            eigenvalue_per_s: [four_digits(mode.per_s.re)?, four_digits(mode.per_s.im)?],
        };
        found.inertia_kg_m2.is_finite().then_some((found, attained))
    }
}

/// The controller with its step, and its delay when the loop is sampled.
pub(super) struct Time<const N: usize> {
    pub(super) params: AicParams<N>,
    pub(super) delay_samples: Option<usize>,
}

/// The mode of a linearised loop that grows most.
pub(super) struct Mode {
    matrix: DMatrix<f64>,
    /// Of the matrix.
    eigenvalue: Complex<f64>,
    /// As a rate in continuous time.
    pub(super) per_s: Complex<f64>,
}

impl Mode {
    /// Its eigenvector; the first N entries are the joints'.
    pub(super) fn vector(&self) -> Option<DVector<Complex<f64>>> {
        eigenvector(&self.matrix, self.eigenvalue)
    }
}

impl<const N: usize> Time<N> {
    /// The time of a timing, or continuous time with a controller that runs at `step_s`; `None` for the exact hold, whose linearised loop is not at
    /// hand here.
    pub(super) fn new(
        gains: &AicGains<N>,
        timing: Option<&LoopTiming>,
        step_s: f64,
    ) -> Result<Option<Self>, StabilityError> {
        let Some(timing) = timing else {
            return Ok(Some(Self { params: AicParams::new(gains, step_s)?, delay_samples: None }));
        };
        let samples = timing.delay_samples().to_usize();
        if timing.plant == PlantStep::ZeroOrderHold || samples.is_none() {
            return Ok(None);
        }
        Ok(Some(Self { params: AicParams::new(gains, timing.period_s.to_f64())?, delay_samples: samples }))
    }

    pub(super) fn worst_mode(
        &self,
        model: &Model<N>,
        q: &Joints<N>,
        compensated: bool,
    ) -> Result<Mode, StabilityError> {
        Ok(match self.delay_samples {
            None => {
                let closed = linearise_aic(model, q, &self.params, compensated)?;
                let eigenvalue = closed.rightmost_eigenvalue();
                Mode { matrix: closed.matrix().clone(), eigenvalue, per_s: eigenvalue }
            }
            Some(samples) => {
                let closed = linearise_aic_sampled(model, q, &self.params, compensated, samples)?;
                let outermost = closed.eigenvalues().into_iter().max_by(|x, y| x.norm().total_cmp(&y.norm()));
                let eigenvalue = outermost.unwrap_or(Complex::new(f64::NAN, f64::NAN));
                Mode { matrix: closed.matrix().clone(), eigenvalue, per_s: eigenvalue.ln() / self.params.step_s() }
            }
        })
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
