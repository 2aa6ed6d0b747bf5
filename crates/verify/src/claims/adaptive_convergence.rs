//! Claim `adaptive-convergence`: the error of the adaptive loop converges with bounded gains, whatever the adaptive gains start at.
//!
//! With `e = q - q_r`, `s = de/dt + lambda e` and the integrals x, X of the adaptation,
//!
//! ```text
//! V = 1/2 s'M(q)s + 1/2 e'Lambda e + 1/2 x'(alpha2/P3)x + 1/2 sum_X tr X'(E2/P3)X,     Lambda diagonal,
//! dV/dt <= -s'K s + s'(M lambda - D) (s - lambda e) + e'Lambda (s - lambda e) + k_C^2/(4 kappa) |lambda e|^2      (q_r = goal)
//! ```
//!
//! for `|s'C(q,dq)y| <= k_C |s||dq||y|`, `kappa = min P3 e11`; every integral term is lossless. M is known up to `|M - Mc| <= R`, entry by entry, D up to its
//! interval: `|s'(M lambda - D - N)v| <= sum rho_ij |s_i||v_j| <= 1/2 (s'Us + v'Wv)` for diagonal U, W with `[[U, -rho], [-rho', W]] > 0`.
//!
//! | inequality | says |
//! |---|---|
//! | split | U and W pay for what is not known of M and D |
//! | decay | `dV/dt < 0` unless s = e = 0 |
//! | start | at rest within `start_radius_rad` with nothing accumulated, `V <= level_j` |
//!
//! The derivation is in `proofs/claims/adaptive-convergence.md`.

use num_rational::BigRational;
use num_traits::Signed;
use serde::{Deserialize, Serialize};

use super::{CONTINUOUS, ClaimKind, Figure, Inequality, Provable, all_hold};
use crate::document::{Document, InertiaEnclosure};
use crate::error::Flaw;
use crate::form::{Field, Form, Row};
use crate::gains::MracLaw;
use crate::mrac::{Adaptation, goal, room};
use crate::number::{Number, positive, ratio};
use crate::quantity::{require, require_length, require_plain, require_positive};
use crate::statement::{each, refused};

/// The error of the adaptive loop converges.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveConvergenceClaim {
    /// The constant goal, rad.
    pub goal_rad: Vec<Number>,
    /// A motion that starts with V at most this never leaves the constants' box, J.
    pub level_j: Number,
    /// Starts at rest within this distance of the goal, nothing accumulated, are among them; rad.
    pub start_radius_rad: Number,
    /// The numbers that prove it.
    pub witness: AdaptiveWitness,
}

/// Diagonals, one entry per joint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveWitness {
    /// Lambda, N m/rad.
    pub spring_n_m_per_rad: Vec<Number>,
    /// U.
    pub split_s: Vec<Number>,
    /// W.
    pub split_dq: Vec<Number>,
}

/// No function V of the claim's form falls: at the goal with this velocity every one of them rises.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveRefusedClaim {
    /// The constant goal, rad.
    pub goal_rad: Vec<Number>,
    /// Direction of the velocity, plain decimals.
    pub direction: Vec<Number>,
}

/// The numbers of the proof that do not depend on the witness.
#[derive(Clone, Debug)]
pub struct AdaptiveLoop<T> {
    /// K, N m s/rad.
    pub damping: Vec<T>,
    /// lambda, 1/s.
    pub lambda: Vec<T>,
    /// Mc, kg m^2.
    pub midpoint: Vec<Vec<T>>,
    /// R, kg m^2.
    pub radius: Vec<Vec<T>>,
    /// Middle of each joint's friction interval, N m s/rad.
    pub friction: Vec<T>,
    /// Half the width of each joint's friction interval.
    pub friction_radius: Vec<T>,
    /// `k_C^2 / (4 kappa)`.
    pub coriolis: T,
    /// Distance from the goal to the box's boundary, joint by joint, rad.
    pub room: Vec<T>,
}

impl AdaptiveLoop<BigRational> {
    /// The loop of a document at a goal.
    ///
    /// # Errors
    /// [`Flaw`] when the proof does not cover the document, or a constant is missing.
    pub fn new(document: &Document, goal_rad: &[Number]) -> Result<Self, Flaw> {
        let adaptation = Adaptation::of(document)?;
        let (_, goal_square) = goal(document, goal_rad)?;
        let (room, least_square) = room(document, goal_rad)?;
        let enclosure = enclosure(document)?;
        let kappa = adaptation.least_velocity_adaptation();
        if !kappa.is_positive() {
            return Err(Flaw::NotCovered { what: "an adaptation without e11, which pays for the Coriolis term" });
        }
        let (half, four) = (ratio(1, 2), ratio(4, 1));
        let matrix = |rows: &[Vec<Number>]| -> Vec<Vec<BigRational>> {
            rows.iter().map(|row| row.iter().map(|x| x.value().clone()).collect()).collect()
        };
        let friction = &document.family.friction_n_m_s_per_rad;
        let k_c = enclosure.coriolis_kg_m2.value();
        Ok(Self {
            damping: (0..document.arm.joints)
                .map(|joint| adaptation.damping(joint, [&least_square, &goal_square]))
                .collect(),
            midpoint: matrix(&enclosure.midpoint_kg_m2),
            radius: matrix(&enclosure.radius_kg_m2),
            friction: friction.iter().map(|[least, most]| (least.value() + most.value()) * &half).collect(),
            friction_radius: friction.iter().map(|[least, most]| (most.value() - least.value()) * &half).collect(),
            coriolis: k_c * k_c / (four * kappa),
            lambda: adaptation.lambda,
            room,
        })
    }

    /// The same in floating point, for a search.
    pub fn to_f64(&self) -> AdaptiveLoop<f64> {
        use num_traits::ToPrimitive;
        let number = |x: &BigRational| x.to_f64().unwrap_or(f64::NAN);
        let list = |xs: &[BigRational]| xs.iter().map(number).collect::<Vec<_>>();
        let matrix = |rows: &[Vec<BigRational>]| rows.iter().map(|row| list(row)).collect();
        AdaptiveLoop {
            damping: list(&self.damping),
            lambda: list(&self.lambda),
            midpoint: matrix(&self.midpoint),
            radius: matrix(&self.radius),
            friction: list(&self.friction),
            friction_radius: list(&self.friction_radius),
            coriolis: number(&self.coriolis),
            room: list(&self.room),
        }
    }
}

impl<T: Field> AdaptiveLoop<T> {
    fn joints(&self) -> usize {
        self.damping.len()
    }

    /// `s`, `e` and `v = s - lambda e` over the coordinates (s, e).
    fn rows(&self) -> [Vec<Row<T>>; 3] {
        let n = self.joints();
        let unit = |index: usize| Row::coordinate(2 * n, index, T::one());
        let s: Vec<Row<T>> = (0..n).map(unit).collect();
        let e: Vec<Row<T>> = (n..2 * n).map(unit).collect();
        let v = (0..n).map(|i| s[i].plus(&-self.lambda[i].clone(), &e[i])).collect();
        [s, e, v]
    }

    /// `[[U, -rho], [-rho', W]]`.
    pub fn split(&self, u: &[T], w: &[T]) -> Form<T> {
        let n = self.joints();
        let mut form = Form::zero(2 * n);
        for i in 0..n {
            form.0[i][i] = u[i].clone();
            form.0[n + i][n + i] = w[i].clone();
            for j in 0..n {
                let mut rho = self.radius[i][j].clone() * &self.lambda[j];
                if i == j {
                    rho = rho + &self.friction_radius[i];
                }
                form.0[i][n + j] = -rho.clone();
                form.0[n + j][i] = -rho;
            }
        }
        form
    }

    /// Minus the bound of dV/dt.
    pub fn decay(&self, spring: &[T], u: &[T], w: &[T]) -> Form<T> {
        let n = self.joints();
        let [s, e, v] = self.rows();
        let half = T::fraction(1, 2);
        let mut form = Form::zero(2 * n);
        for i in 0..n {
            form.add(&-self.damping[i].clone(), &s[i], &s[i]);
            form.add(&-self.friction[i].clone(), &s[i], &v[i]);
            for j in 0..n {
                form.add(&(self.midpoint[i][j].clone() * &self.lambda[j]), &s[i], &v[j]);
            }
            form.add(&spring[i], &e[i], &v[i]);
            form.add(&(self.coriolis.clone() * &self.lambda[i] * &self.lambda[i]), &e[i], &e[i]);
            form.add(&(u[i].clone() * &half), &s[i], &s[i]);
            form.add(&(w[i].clone() * &half), &v[i], &v[i]);
        }
        form.negated()
    }

    /// `2 level/radius^2 - (lambda M lambda + Lambda)` at its worst M.
    pub fn start(&self, spring: &[T], share: &T) -> Form<T> {
        let n = self.joints();
        let mut form = Form::<T>::zero(n);
        for i in 0..n {
            for j in 0..n {
                let weight = self.lambda[i].clone() * &self.lambda[j];
                form.0[i][j] = form.0[i][j].clone() - &(self.midpoint[i][j].clone() * &weight);
                form.0[i][i] = form.0[i][i].clone() - &(self.radius[i][j].clone() * &weight);
            }
            form.0[i][i] = form.0[i][i].clone() - &spring[i] + share;
        }
        form
    }
}

fn enclosure(document: &Document) -> Result<&InertiaEnclosure, Flaw> {
    document.constants.bounds.inertia.as_ref().ok_or(Flaw::Missing { constant: "inertia" })
}

fn values(list: &[Number]) -> Vec<BigRational> {
    list.iter().map(|x| x.value().clone()).collect()
}

/// The inequalities of a claim about `document`, in the order of the module's table, whether they hold or not.
///
/// # Errors
/// [`Flaw`] when the numbers are outside what the proof allows.
pub fn adaptive_inequalities(document: &Document, claim: &AdaptiveConvergenceClaim) -> Result<Vec<Inequality>, Flaw> {
    let numbers = AdaptiveLoop::new(document, &claim.goal_rad)?;
    let AdaptiveWitness { spring_n_m_per_rad: spring, split_s, split_dq } = &claim.witness;
    for (name, list) in [("spring_n_m_per_rad", spring), ("split_s", split_s), ("split_dq", split_dq)] {
        require_length(name, list.len(), document.arm.joints)?;
        for entry in list {
            require(name, entry, positive(entry.value()), "a positive number")?;
        }
    }
    require_positive("level_j", &claim.level_j)?;
    require_positive("start_radius_rad", &claim.start_radius_rad)?;
    let (level, radius) = (claim.level_j.value(), claim.start_radius_rad.value());
    for (entry, room) in spring.iter().zip(&numbers.room) {
        let inside = ratio(2, 1) * level < entry.value() * room * room;
        require("level_j", &claim.level_j, inside, "less than 1/2 Lambda_i times the squared room of every joint")?;
        require("start_radius_rad", &claim.start_radius_rad, radius <= room, "a ball inside the box")?;
    }
    let [spring, u, w] = [spring, split_s, split_dq].map(|list| values(list));
    let share = ratio(2, 1) * level / (radius * radius);
    Ok(vec![
        Inequality::decide("split".to_owned(), &numbers.split(&u, &w).0),
        Inequality::decide("decay".to_owned(), &numbers.decay(&spring, &u, &w).0),
        Inequality::decide("start".to_owned(), &numbers.start(&spring, &share).0),
    ])
}

impl Provable for AdaptiveConvergenceClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::AdaptiveConvergence
    }

    fn sentence(&self, document: &Document) -> String {
        let with_model = document.gains.mrac().is_ok_and(|gains| gains.law == MracLaw::ReferenceModel);
        let (reference, at_rest) = if with_model {
            (", wherever the reference model starts", " and the reference model at rest at the goal")
        } else {
            ("", "")
        };
        format!(
            "for the constant goal [{}] rad, whatever the adaptive gains start at{reference}: on every motion that stays in the box of \
             configurations, q tends to the goal and dq to 0, and K0, K1, Q0, Q1 and f stay bounded. Every motion that starts in the box with V (the \
             file's function, which counts what the integrals hold) at most {} J{at_rest} stays in it, such as those from rest within {} rad of the \
             goal (2-norm over the joints) with nothing accumulated. No rate is claimed, and the adaptive gains need not settle at any value named here",
            each(&self.goal_rad),
            self.level_j,
            self.start_radius_rad
        )
    }

    fn scope(&self, _: &Document) -> String {
        CONTINUOUS.to_owned()
    }

    fn figures(&self) -> Vec<Figure> {
        vec![
            Figure { name: "start radius", value: self.start_radius_rad.clone(), unit: "rad" },
            Figure { name: "level", value: self.level_j.clone(), unit: "J" },
        ]
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        all_hold(adaptive_inequalities(document, self)?)
    }
}

impl Provable for AdaptiveRefusedClaim {
    fn kind(&self) -> ClaimKind {
        ClaimKind::AdaptiveConvergence
    }

    fn sentence(&self, document: &Document) -> String {
        format!(
            "{}: from the goal [{}] rad with a small velocity along [{}], reference at the goal, every function V of the claim's form rises, whatever \
             its Lambda, for every inertia matrix of the enclosure and the least friction. So none of them proves convergence; that the loop \
             diverges is not claimed.",
            refused(document),
            each(&self.goal_rad),
            each(&self.direction)
        )
    }

    fn scope(&self, _: &Document) -> String {
        String::new()
    }

    fn prove(&self, document: &Document, _: usize) -> Result<Vec<Inequality>, Flaw> {
        let adaptation = Adaptation::of(document)?;
        let (_, square) = goal(document, &self.goal_rad)?;
        room(document, &self.goal_rad)?;
        let enclosure = enclosure(document)?;
        let joints = document.arm.joints;
        require_length("direction", self.direction.len(), joints)?;
        for entry in &self.direction {
            require_plain("direction", entry)?;
        }
        // An upper bound of v'(K + D - M lambda)v over the enclosure; dV/dt = -eps^2 times it, to second order in the velocity eps v.
        let v = values(&self.direction);
        let mut most = ratio(0, 1);
        for i in 0..joints {
            let damping = adaptation.damping(i, [&square, &square]);
            let [least, _] = &document.family.friction_n_m_s_per_rad[i];
            most += (damping + least.value()) * &v[i] * &v[i];
            for j in 0..joints {
                let share = &v[i] * &v[j] * &adaptation.lambda[j];
                most += enclosure.radius_kg_m2[i][j].value() * share.abs();
                most -= enclosure.midpoint_kg_m2[i][j].value() * share;
            }
        }
        if most.is_negative() {
            Ok(Vec::new())
        } else {
            Err(Flaw::Counterexample { reason: "some function V is not shown to rise along the direction" })
        }
    }
}
