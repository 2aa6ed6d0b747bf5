//! The inner maximisations: for one configuration, the worst masses and directions of each constant.
//!
//! | constant | maximised over directions and scales at fixed q |
//! |----------|--------------------------------------------------|
//! | m_lo | `-x' M x`, every scale and rotor inertia at its lower end (`M` is monotone in them) |
//! | m_hi | `x' M x`, every scale and rotor inertia at its upper end |
//! | k_g | `\|x' (Σ s_i G_i) x\|`: x an eigenvector, each s_i by the sign of `x' G_i x`, in turn |
//! | k_c | `h(x, s)' y`, `h_j = ½ x' (Σ s_i ∂M_i/∂q_j) x`, over unit x and y, in turn with the scales by sign |
//! | k_r | `h(x, s)' y / x' (Σ s_i M_i + diag(r_lo)) x`: x a generalised eigenvector, the scales by Dinkelbach's rule |
//!
//! Alternating over blocks never loses value; it ends in a local maximum of the inner problem, of which the outer search sees
//! many. Dinkelbach: for `max a(s)/b(s)` with both affine, maximise `a(s) - λ b(s)` at the current ratio λ.
//!
//! Slopes along q at fixed directions and scales (the slope of a maximum is the slope of its maximiser) come from central differences of
//! one evaluation on one compiled arm. Source: Dinkelbach, *On nonlinear fractional programming* (1967).

use certune_dynamics::{Model, gravity_jacobian, gravity_torque, mass_matrix_as_described, mass_matrix_derivatives};
use certune_linsys::{JointMatrix, Joints};

use crate::arm_box::ArmBox;
use crate::ascent::Foothold;
use crate::eigen::symmetric_eigen;

/// Rounds of the alternation over scales and directions; two to four are usual.
const ROUNDS: usize = 12;
/// Alternations between the two directions within one round.
const TURNS: usize = 4;
/// A round that gains less than this, relatively, is the last.
const RELATIVE_GAIN: f64 = 1e-10;
/// Angle of the central differences, rad: truncation 1e-10, rounding 1e-11, both relative.
const DIFFERENCE_RAD: f64 = 1e-5;

/// What is maximised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Minus the smallest eigenvalue of M.
    LeastInertia,
    /// The largest eigenvalue of M.
    GreatestInertia,
    /// The largest modulus of an eigenvalue of the gravity Jacobian.
    GravityStiffness,
    /// The Coriolis form.
    Coriolis,
    /// The Coriolis form relative to the kinetic energy.
    RelativeCoriolis,
    /// The modulus of one joint's gravity torque.
    GravityTorque(usize),
}

/// A configuration with the masses and directions found for it.
#[derive(Clone, Debug)]
pub(crate) struct Point<const N: usize> {
    pub(crate) q: Joints<N>,
    pub(crate) value: f64,
    /// One scale per group of the box.
    pub(crate) scales: Vec<f64>,
    pub(crate) x: Joints<N>,
    pub(crate) y: Joints<N>,
}

impl<const N: usize> Foothold<N> for Point<N> {
    fn q(&self) -> Joints<N> {
        self.q
    }
    fn value(&self) -> f64 {
        self.value
    }
}

/// One additive part of the arm: the sum of all groups whose scale is fixed, or one group whose scale varies.
struct Part<const N: usize> {
    model: Model<N>,
    range: [f64; 2],
    /// The group it stands for; none for the lump of fixed groups.
    group: Option<usize>,
}

/// A box prepared for many evaluations.
pub(crate) struct Search<'a, const N: usize> {
    arm_box: &'a ArmBox<N>,
    parts: Vec<Part<N>>,
    lightest: Model<N>,
    heaviest: Model<N>,
    rotor: [Joints<N>; 2],
}

/// `h_j = ½ Σ_i c_i x' D_ij x`, the Coriolis form as a vector against y.
fn form<const N: usize>(slopes: &[JointMatrix<N>; N], x: &Joints<N>) -> Joints<N> {
    Joints::from_fn(|j, _| 0.5 * x.dot(&(slopes[j] * x)))
}

fn weighted<const N: usize>(parts: &[JointMatrix<N>], weights: &[f64]) -> JointMatrix<N> {
    parts.iter().zip(weights).fold(JointMatrix::zeros(), |sum, (part, weight)| sum + part * *weight)
}

/// A vector of unit length, or zero if it has none.
fn unit<const N: usize>(vector: &Joints<N>) -> Joints<N> {
    let norm = vector.norm();
    if norm > 0.0 { vector / norm } else { Joints::zeros() }
}

impl<'a, const N: usize> Search<'a, N> {
    pub(crate) fn new(arm_box: &'a ArmBox<N>) -> Self {
        let groups = arm_box.groups();
        let varies = |range: [f64; 2]| range[1] > range[0];
        let mut parts = Vec::new();
        if groups.iter().any(|group| !varies(group.scale)) {
            let fixed: Vec<f64> = groups.iter().map(|g| if varies(g.scale) { 0.0 } else { g.scale[0] }).collect();
            parts.push(Part { model: arm_box.model_unchecked(&fixed), range: [1.0, 1.0], group: None });
        }
        for (index, group) in groups.iter().enumerate().filter(|(_, group)| varies(group.scale)) {
            parts.push(Part { model: group.model.clone(), range: group.scale, group: Some(index) });
        }
        let end = |i: usize| groups.iter().map(|group| group.scale[i]).collect::<Vec<f64>>();
        Self {
            arm_box,
            parts,
            lightest: arm_box.model_unchecked(&end(0)),
            heaviest: arm_box.model_unchecked(&end(1)),
            rotor: arm_box.rotor_inertia_kg_m2(),
        }
    }

    /// Rotor inertia at which a quantity is largest; the lower end where it does not enter.
    pub(crate) fn rotor(&self, quantity: Quantity) -> Joints<N> {
        match quantity {
            Quantity::GreatestInertia => self.rotor[1],
            Quantity::LeastInertia
            | Quantity::GravityStiffness
            | Quantity::Coriolis
            | Quantity::RelativeCoriolis
            | Quantity::GravityTorque(_) => self.rotor[0],
        }
    }

    /// The worst masses and directions at `q`, started from those of `warm` if there is one.
    pub(crate) fn evaluate(&self, quantity: Quantity, q: &Joints<N>, warm: Option<&Point<N>>) -> Point<N> {
        match quantity {
            Quantity::LeastInertia => {
                let (value, x) = symmetric_eigen(&self.inertia(&self.lightest, q, &self.rotor[0])).smallest();
                self.point(q, -value, &self.ends(0), x, Joints::zeros())
            }
            Quantity::GreatestInertia => {
                let (value, x) = symmetric_eigen(&self.inertia(&self.heaviest, q, &self.rotor[1])).largest();
                self.point(q, value, &self.ends(1), x, Joints::zeros())
            }
            Quantity::GravityStiffness => self.gravity_stiffness(q),
            Quantity::Coriolis | Quantity::RelativeCoriolis => self.coriolis(quantity, q, warm),
            Quantity::GravityTorque(joint) => self.gravity_torque(joint, q),
        }
    }

    /// The slope of the value along q, at the masses and directions of `at`.
    pub(crate) fn gradient(&self, quantity: Quantity, at: &Point<N>) -> Joints<N> {
        let model = self.arm_box.model_unchecked(&at.scales);
        let inertia_slope = |sign: f64| {
            let slopes = mass_matrix_derivatives(&model, &at.q);
            form(&slopes, &at.x) * (2.0 * sign)
        };
        match quantity {
            Quantity::LeastInertia => inertia_slope(-1.0),
            Quantity::GreatestInertia => inertia_slope(1.0),
            Quantity::GravityStiffness => {
                let value = |q: &Joints<N>| at.x.dot(&(gravity_jacobian(&model, q) * at.x));
                differences(&at.q, value) * value(&at.q).signum()
            }
            Quantity::Coriolis => differences(&at.q, |q| form(&mass_matrix_derivatives(&model, q), &at.x).dot(&at.y)),
            Quantity::RelativeCoriolis => differences(&at.q, |q| {
                let slope = form(&mass_matrix_derivatives(&model, q), &at.x).dot(&at.y);
                slope / at.x.dot(&(self.inertia(&model, q, &self.rotor[0]) * at.x))
            }),
            Quantity::GravityTorque(joint) => {
                let sign = gravity_torque(&model, &at.q)[joint].signum();
                gravity_jacobian(&model, &at.q).row(joint).transpose() * sign
            }
        }
    }

    fn inertia(&self, model: &Model<N>, q: &Joints<N>, rotor: &Joints<N>) -> JointMatrix<N> {
        mass_matrix_as_described(model, q) + JointMatrix::from_diagonal(rotor)
    }

    /// The weights of the parts at one end of every range.
    fn ends(&self, end: usize) -> Vec<f64> {
        self.parts.iter().map(|part| part.range[end]).collect()
    }

    /// The weights that make `Σ weight_i share_i` largest.
    fn by_sign(&self, shares: impl Iterator<Item = f64>) -> Vec<f64> {
        self.parts.iter().zip(shares).map(|(part, share)| part.range[usize::from(share > 0.0)]).collect()
    }

    fn point(&self, q: &Joints<N>, value: f64, weights: &[f64], x: Joints<N>, y: Joints<N>) -> Point<N> {
        let mut scales: Vec<f64> = self.arm_box.groups().iter().map(|group| group.scale[0]).collect();
        for (part, weight) in self.parts.iter().zip(weights) {
            if let Some(group) = part.group {
                scales[group] = *weight;
            }
        }
        Point { q: *q, value, scales, x, y }
    }

    /// The weights of the parts that belong to the scales of a point.
    fn weights(&self, at: &Point<N>) -> Vec<f64> {
        self.parts.iter().map(|part| part.group.map_or(1.0, |group| at.scales[group])).collect()
    }

    fn gravity_torque(&self, joint: usize, q: &Joints<N>) -> Point<N> {
        let shares: Vec<f64> = self.parts.iter().map(|part| gravity_torque(&part.model, q)[joint]).collect();
        let total = |weights: &[f64]| shares.iter().zip(weights).map(|(share, weight)| share * weight).sum::<f64>();
        let upper = self.by_sign(shares.iter().copied());
        let lower = self.by_sign(shares.iter().map(|share| -share));
        let (value, weights) =
            if total(&upper) >= -total(&lower) { (total(&upper), upper) } else { (-total(&lower), lower) };
        self.point(q, value, &weights, Joints::zeros(), Joints::zeros())
    }

    fn gravity_stiffness(&self, q: &Joints<N>) -> Point<N> {
        let parts: Vec<JointMatrix<N>> = self.parts.iter().map(|part| gravity_jacobian(&part.model, q)).collect();
        let mut weights = self.ends(1);
        let (mut signed, mut x) = symmetric_eigen(&weighted(&parts, &weights)).dominant();
        for _ in 0..ROUNDS {
            let sign = signed.signum();
            let better = self.by_sign(parts.iter().map(|part| sign * x.dot(&(part * x))));
            let (next, direction) = symmetric_eigen(&weighted(&parts, &better)).dominant();
            if next.abs() <= signed.abs() * (1.0 + RELATIVE_GAIN) {
                break;
            }
            (signed, x, weights) = (next, direction, better);
        }
        self.point(q, signed.abs(), &weights, x, Joints::zeros())
    }

    fn coriolis(&self, quantity: Quantity, q: &Joints<N>, warm: Option<&Point<N>>) -> Point<N> {
        let relative = quantity == Quantity::RelativeCoriolis;
        let local = Local {
            slopes: self.parts.iter().map(|part| mass_matrix_derivatives(&part.model, q)).collect(),
            masses: if relative {
                self.parts.iter().map(|part| mass_matrix_as_described(&part.model, q)).collect()
            } else {
                Vec::new()
            },
            rotor: self.rotor[0],
        };
        let mut weights = warm.map_or_else(|| self.ends(1), |at| self.weights(at));
        let mut best = local.directions(&weights, warm.map(|at| at.y));
        for _ in 0..ROUNDS {
            let shares = (0..self.parts.len()).map(|i| local.share(i, &best));
            let better = self.by_sign(shares);
            if better == weights {
                break;
            }
            let next = local.directions(&better, Some(best.y));
            if next.value <= best.value * (1.0 + RELATIVE_GAIN) {
                break;
            }
            (best, weights) = (next, better);
        }
        self.point(q, best.value, &weights, best.x, best.y)
    }
}

/// The derivatives of every part's inertia at one configuration; its inertia too if the form is relative.
struct Local<const N: usize> {
    slopes: Vec<[JointMatrix<N>; N]>,
    masses: Vec<JointMatrix<N>>,
    rotor: Joints<N>,
}

/// Directions with the value of the form for them.
#[derive(Clone, Copy)]
struct Directions<const N: usize> {
    value: f64,
    x: Joints<N>,
    y: Joints<N>,
}

impl<const N: usize> Local<N> {
    /// What one unit of part `i` adds to `a(s) - λ b(s)` at the current directions.
    fn share(&self, i: usize, at: &Directions<N>) -> f64 {
        let gain = form(&self.slopes[i], &at.x).dot(&at.y);
        self.masses.get(i).map_or(gain, |mass| gain - at.value * at.x.dot(&(mass * at.x)))
    }

    /// The best directions for given weights, from `y` or else from the principal direction of the derivatives.
    fn directions(&self, weights: &[f64], y: Option<Joints<N>>) -> Directions<N> {
        let slopes: [JointMatrix<N>; N] = std::array::from_fn(|j| {
            self.slopes.iter().zip(weights).fold(JointMatrix::zeros(), |sum, (part, weight)| sum + part[j] * *weight)
        });
        // In coordinates where the metric is the identity the generalised problem is an ordinary one.
        let whitening = if self.masses.is_empty() {
            None
        } else {
            let metric = weighted(&self.masses, weights) + JointMatrix::from_diagonal(&self.rotor);
            metric.cholesky().and_then(|factor| factor.l().try_inverse())
        };
        let white = match &whitening {
            Some(inverse) => slopes.map(|slope| inverse * slope * inverse.transpose()),
            None => slopes,
        };
        let mut y = y.unwrap_or_else(|| principal(&white));
        let mut best = Directions { value: 0.0, x: Joints::zeros(), y: Joints::zeros() };
        for _ in 0..TURNS {
            let along = white.iter().zip(y.iter()).fold(JointMatrix::zeros(), |sum, (slope, yj)| sum + slope * *yj);
            let (_, x) = symmetric_eigen(&along).dominant();
            let h = form(&white, &x);
            let value = h.norm();
            if value <= best.value * (1.0 + RELATIVE_GAIN) {
                break;
            }
            y = unit(&h);
            best = Directions { value, x, y };
        }
        if let Some(inverse) = &whitening {
            best.x = unit(&(inverse.transpose() * best.x));
        }
        best
    }
}

/// The unit y for which `Σ_j y_j D_j` has the largest Frobenius norm.
fn principal<const N: usize>(slopes: &[JointMatrix<N>; N]) -> Joints<N> {
    let gram = JointMatrix::<N>::from_fn(|i, j| slopes[i.min(j)].dot(&slopes[i.max(j)]));
    symmetric_eigen(&gram).largest().1
}

/// Central differences of a function of the joint angles.
fn differences<const N: usize>(q: &Joints<N>, value: impl Fn(&Joints<N>) -> f64) -> Joints<N> {
    Joints::from_fn(|j, _| {
        let mut ahead = *q;
        let mut behind = *q;
        ahead[j] += DIFFERENCE_RAD;
        behind[j] -= DIFFERENCE_RAD;
        (value(&ahead) - value(&behind)) / (2.0 * DIFFERENCE_RAD)
    })
}
