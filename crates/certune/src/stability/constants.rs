//! Which constants a certificate rests on: those of a proved record that covers the family, or sampled ones.

use certune_bounds::{ArmBox, SampledConstants, SearchOptions, maximise};
use certune_certify::{ConstantValues, SampledConstantValues};
use certune_dynamics::{Model, Robot, mass_matrix_as_described};
use certune_linsys::{JointMatrix, Joints};
use certune_verify::{Arm, ArmRanges, ConfigurationSet, Number, Record};
use nalgebra::{DMatrix, SymmetricEigen};

/// The configurations that claims are wanted for.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Over {
    /// Every angle of every joint, joint limits or not.
    #[default]
    AllAngles,
    /// Between the joints' end stops; all angles when a joint has none.
    JointRange,
    /// Between two ends, joint by joint.
    Box {
        /// Lower ends, rad.
        lower_rad: Vec<f64>,
        /// Upper ends, rad.
        upper_rad: Vec<f64>,
    },
}

impl Over {
    /// The ends of the box; `None` for all angles, also when a joint has no end stop or an interval is empty.
    pub(super) fn angles(&self, robot: &Robot) -> Option<(Vec<f64>, Vec<f64>)> {
        let limits = |value: fn(&certune_dynamics::Link) -> f64| robot.links().iter().map(value).collect::<Vec<_>>();
        let (lower, upper) = match self {
            Self::AllAngles => return None,
            Self::JointRange => (limits(|link| link.limits.lower_rad), limits(|link| link.limits.upper_rad)),
            Self::Box { lower_rad, upper_rad } => (lower_rad.clone(), upper_rad.clone()),
        };
        let finite = lower.iter().chain(&upper).all(|angle| angle.is_finite());
        (finite && lower.iter().zip(&upper).all(|(lower, upper)| lower < upper)).then_some((lower, upper))
    }

    /// The set as records and certificates write it.
    pub fn written(&self, robot: &Robot) -> ConfigurationSet {
        let numbers = |values: &[f64]| values.iter().map(|&value| Number::decimal(value)).collect::<Option<Vec<_>>>();
        self.angles(robot)
            .and_then(|(lower, upper)| {
                Some(ConfigurationSet::Box { lower_rad: numbers(&lower)?, upper_rad: numbers(&upper)? })
            })
            .unwrap_or(ConfigurationSet::AllAngles)
    }
}

/// The record that covers the arms over the set, with the least largest inertia; records over the set itself or a box around it go before
/// those over all angles.
pub(super) fn best_record<'a>(
    records: &'a [Record],
    arm: &Arm,
    ranges: &ArmRanges,
    over: &ConfigurationSet,
) -> Option<&'a Record> {
    let covering = || records.iter().filter(|record| record.covers(arm, ranges).is_ok());
    let tightest = |candidates: Vec<&'a Record>| {
        candidates.into_iter().min_by(|a, b| a.bounds.m_hi_kg_m2.value().cmp(b.bounds.m_hi_kg_m2.value()))
    };
    let around = |record: &&Record| record.over != ConfigurationSet::AllAngles && holds(&record.over, over);
    tightest(covering().filter(around).collect())
        .or_else(|| tightest(covering().filter(|record| record.over == ConfigurationSet::AllAngles).collect()))
}

/// Whether every configuration of `inner` is one of `outer`.
fn holds(outer: &ConfigurationSet, inner: &ConfigurationSet) -> bool {
    match (outer, inner) {
        (ConfigurationSet::AllAngles, _) => true,
        (ConfigurationSet::Box { .. }, ConfigurationSet::AllAngles) => false,
        (
            ConfigurationSet::Box { lower_rad, upper_rad },
            ConfigurationSet::Box { lower_rad: inner_lower, upper_rad: inner_upper },
        ) => {
            let at_most =
                |a: &[Number], b: &[Number]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.value() <= b.value());
            at_most(lower_rad, inner_lower) && at_most(inner_upper, upper_rad)
        }
    }
}

/// `diag(lower) <= M <= diag(upper)` over the members, sampled: the shape from the largest diagonal entries of M and of its inverse, the size
/// from the extreme eigenvalues of M seen in that shape, widened by the margin.
pub(super) fn sampled_diagonals<const N: usize>(
    members: &ArmBox<N>,
    found: &SampledConstants,
) -> Option<[Vec<f64>; 2]> {
    let margin = found.margin;
    let angles = &members.axes()[..N];
    let ends = |end: usize| members.groups().iter().map(|group| group.scale[end]).collect::<Vec<f64>>();
    let [rotor_lower, rotor_upper] = members.rotor_inertia_kg_m2();
    let lightest = members.model(&ends(0), &rotor_lower).ok()?;
    let heaviest = members.model(&ends(1), &rotor_upper).ok()?;
    let inertia = |model: &Model<N>, at: &[f64]| mass_matrix_as_described(model, &Joints::from_column_slice(at));
    let inverse = |at: &[f64]| inertia(&lightest, at).try_inverse();
    let options = SearchOptions {
        samples: found.samples,
        local_starts: found.local_starts,
        evaluations_per_start: 300,
        ..SearchOptions::default()
    };
    let largest = |score: &(dyn Fn(&[f64]) -> f64 + Sync)| maximise(angles, &options, score).ok().map(|top| top.value);
    // The eigenvalues of S M S, S = diag(scale).
    let largest_seen = |matrix: JointMatrix<N>, scale: &[f64]| {
        let seen = DMatrix::from_fn(N, N, |i, j| scale[i] * matrix[(i, j)] * scale[j]);
        SymmetricEigen::new(seen).eigenvalues.max()
    };
    let entry = |joint: usize| largest(&|at| inertia(&heaviest, at)[(joint, joint)]);
    let inverse_entry = |joint: usize| largest(&|at| inverse(at).map_or(f64::NAN, |matrix| matrix[(joint, joint)]));
    let upper_shape = (0..N).map(entry).collect::<Option<Vec<f64>>>()?;
    let lower_shape = (0..N).map(inverse_entry).collect::<Option<Vec<f64>>>()?;
    let roots = |shape: &[f64]| shape.iter().map(|x| x.sqrt().recip()).collect::<Vec<f64>>();
    let (upper_root, lower_root) = (roots(&upper_shape), roots(&lower_shape));
    let upper_size = largest(&|at| largest_seen(inertia(&heaviest, at), &upper_root))?;
    let lower_size = largest(&|at| inverse(at).map_or(f64::NAN, |matrix| largest_seen(matrix, &lower_root)))?;
    let upper = upper_shape.iter().map(|x| x * upper_size * (1.0 + margin)).collect();
    let lower = lower_shape.iter().map(|x| (x * lower_size * (1.0 + margin)).recip()).collect();
    Some([lower, upper])
}

/// Sampled constants as a problem takes them: over all angles, whatever smaller set was asked for. What was not sampled itself follows from what was:
/// `|y| <= |y|_M / sqrt m_lo` gives k_m.
pub(super) fn sampled_values(found: &SampledConstants, diagonal_kg_m2: Option<[Vec<f64>; 2]>) -> ConstantValues {
    ConstantValues::Sampled(SampledConstantValues {
        m_lo_kg_m2: found.constants.m_lo_kg_m2,
        m_hi_kg_m2: found.constants.m_hi_kg_m2,
        k_g_n_m_per_rad: found.constants.k_g_n_m_per_rad,
        k_c_kg_m2: found.constants.k_c_kg_m2,
        k_r: found.constants.k_r,
        k_m: Some(found.constants.k_r / found.constants.m_lo_kg_m2.sqrt()),
        diagonal_kg_m2,
        gravity_torque_n_m: Some(found.gravity_torque_n_m.clone()),
        margin: found.margin,
        samples: found.samples,
        local_starts: found.local_starts,
    })
}
