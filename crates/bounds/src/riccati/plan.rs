//! Candidates, and the order in which they are tried.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::chain::Chain;
use super::cover::{Tally, cover};
use super::forms::Form;
use super::guess::Guess;
use super::{CoverSize, Inequality, RiccatiBounds};
use crate::arm_box::ArmBox;
use crate::error::BoundsError;
use crate::rigorous::{AngleSet, Effort};

/// Tried when the loosest candidate of a ladder fails: the sample missed what the proof has to cover, or bounds over boxes are wide for this arm.
const LOOSER: [f64; 2] = [10.0, 30.0];
/// No k below this is tried, per rad: rounding would hide it.
const LEAST_K: f64 = 1e-6;
/// Half a turn, rounded up.
const HALF_TURN: f64 = PI + 4.0 * f64::EPSILON;
/// An end of an interval is moved outward by this, for decimals that an `f64` only approximates, rad.
const OUTWARD_RAD: f64 = 1e-12;
/// A claim is proved with this share to spare, so that its shortest decimal holds as well.
const SPARE: f64 = 1e-12;

/// The numbers a proof claims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RiccatiPlan {
    /// `M >= m_lo I`, kg m².
    pub m_lo_kg_m2: f64,
    /// `M >= diag(..)`, kg m².
    pub diagonal_lower_kg_m2: Vec<f64>,
    /// k of each joint, per rad; that of the first is 0 and not proved. Empty when no k was proved for some joint: then there is no k_r and no k_m.
    pub k_joint: Vec<f64>,
    /// The diagonal below M that k_m rests on, kg m²; 0 where k_j is 0. As long as `k_joint`.
    pub metric_kg_m2: Vec<f64>,
    /// Boxes allowed for each proof.
    pub budget: u64,
}

impl RiccatiPlan {
    /// What is proved is about `|k_j|` and diagonals below M; what follows from it divides by the latter, so signs matter.
    fn check(&self) -> Result<(), BoundsError> {
        let refused =
            |parameter, joint: usize, value| Err(BoundsError::Candidate { parameter, joint: joint + 1, value });
        let lists = [
            ("m_lo", std::slice::from_ref(&self.m_lo_kg_m2)),
            ("diagonal", self.diagonal_lower_kg_m2.as_slice()),
            ("k", self.k_joint.as_slice()),
            ("metric", self.metric_kg_m2.as_slice()),
        ];
        for (parameter, numbers) in lists {
            if let Some(joint) = numbers.iter().position(|x| !(*x >= 0.0 && x.is_finite())) {
                return refused(parameter, joint, numbers[joint]);
            }
        }
        for (joint, (k, metric)) in self.k_joint.iter().zip(&self.metric_kg_m2).enumerate() {
            if *k > 0.0 && *metric <= 0.0 {
                return refused("metric", joint, *metric);
            }
        }
        Ok(())
    }
}

/// Every configuration of a set lies in these intervals, up to full turns.
pub(crate) fn intervals<const N: usize>(set: &AngleSet<N>) -> Result<[[f64; 2]; N], BoundsError> {
    let mut out = [[-HALF_TURN, HALF_TURN]; N];
    if let AngleSet::Box { lower_rad, upper_rad } = set {
        for joint in 0..N {
            let (lower, upper) = (lower_rad[joint], upper_rad[joint]);
            if !(lower <= upper) {
                return Err(BoundsError::Angles { joint: joint + 1, lower, upper });
            }
            if upper - lower < 2.0 * HALF_TURN {
                if !(lower.abs() <= 7.0 && upper.abs() <= 7.0) {
                    return Err(BoundsError::Angles { joint: joint + 1, lower, upper });
                }
                out[joint] = [lower - OUTWARD_RAD, upper + OUTWARD_RAD];
            }
        }
    }
    Ok(out)
}

/// How hard candidates are tightened: boxes for one proof, and the ratios to the sampled value that are tried in turn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ladder {
    /// Boxes for one proof.
    pub budget: u64,
    /// From loose to tight, all above 1.
    pub ratios: &'static [f64],
}

impl Ladder {
    pub fn of(effort: Effort) -> Self {
        match effort {
            Effort::Quick => Self { budget: 40_000, ratios: &[3.0, 2.2, 1.6, 1.25, 1.1, 1.03] },
            Effort::Standard => Self { budget: 400_000, ratios: &[3.0, 2.2, 1.6, 1.25, 1.1, 1.04] },
            Effort::Thorough => Self { budget: 4_000_000, ratios: &[3.0, 2.2, 1.6, 1.25, 1.1, 1.05, 1.02] },
        }
    }
}

/// Rounds to four significant digits, up or down.
fn plain(x: f64, up: bool) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 0.0;
    }
    let text = format!("{x:.3e}");
    let mut rounded: f64 = text.parse().unwrap_or(x);
    if (up && rounded < x) || (!up && rounded > x) {
        #[expect(clippy::cast_possible_truncation, reason = "within +-300")]
        let digit = 10_f64.powi(x.log10().floor().clamp(-300.0, 300.0) as i32 - 3);
        rounded += if up { digit } else { -digit };
        rounded = format!("{rounded:.3e}").parse().unwrap_or(rounded);
    }
    rounded
}

/// A computation in progress: the arm at both ends of its payload, and what has been proved so far.
pub(crate) struct Proving<'a, const N: usize> {
    arms: &'a ArmBox<N>,
    intervals: [[f64; 2]; N],
    chains: Vec<Chain<N>>,
    progress: &'a (dyn Fn(f64) + Sync),
    covers: Vec<CoverSize>,
}

impl<'a, const N: usize> Proving<'a, N> {
    pub fn new(arms: &'a ArmBox<N>, intervals: &[[f64; 2]; N], progress: &'a (dyn Fn(f64) + Sync)) -> Self {
        let ends = match arms.groups().get(N) {
            Some(group) if group.scale[0] < group.scale[1] => 2,
            _ => 1,
        };
        let chains = (0..ends).map(|end| Chain::new(arms, end)).collect();
        Self { arms, intervals: *intervals, chains, progress, covers: Vec::new() }
    }

    /// Proves one inequality at every end of the payload that matters, or says no.
    fn prove(&mut self, inequality: &Inequality, budget: u64, from: f64, to: f64) -> Option<()> {
        let mut sizes = Vec::new();
        let (forms, ends) = match inequality {
            Inequality::Inertia { kg_m2 } => {
                let mut diagonal = [0.0; N];
                for (to, from) in diagonal.iter_mut().zip(kg_m2) {
                    *to = from * (1.0 + SPARE);
                }
                // M grows with the payload.
                (vec![Form::Inertia(diagonal)], 1)
            }
            Inequality::Coriolis { joint, k } => {
                let k = k * (1.0 - SPARE);
                let joint = joint - 1;
                ([1.0, -1.0].map(|sign| Form::Coriolis { joint, k, sign }).to_vec(), self.chains.len())
            }
        };
        for (payload_end, chain) in self.chains.iter().enumerate().take(ends) {
            let report = |share: f64| (self.progress)(from + (to - from) * share);
            let Tally { boxes, depth } = cover(chain, &forms, &self.intervals, budget, &report)?;
            sizes.push(CoverSize { inequality: inequality.clone(), payload_end, boxes, cuts: depth });
        }
        self.covers.extend(sizes);
        Some(())
    }

    /// The tightest candidate of the ladder that can be proved, and its proof kept.
    fn tighten(
        &mut self,
        ladder: Ladder,
        from: f64,
        to: f64,
        candidate: impl Fn(f64) -> Inequality,
    ) -> Result<Inequality, BoundsError> {
        let Ladder { budget, ratios } = ladder;
        let mut best: Option<(Inequality, Vec<CoverSize>)> = None;
        let kept = std::mem::take(&mut self.covers);
        for ratio in ratios {
            let inequality = candidate(*ratio);
            self.covers.clear();
            if self.prove(&inequality, budget, from, to).is_none() {
                break;
            }
            best = Some((inequality, std::mem::take(&mut self.covers)));
        }
        for ratio in LOOSER {
            if best.is_some() {
                break;
            }
            let inequality = candidate(ratio);
            self.covers.clear();
            if self.prove(&inequality, budget, from, to).is_some() {
                best = Some((inequality, std::mem::take(&mut self.covers)));
            }
        }
        self.covers = kept;
        let Some((inequality, sizes)) = best else {
            return Err(not_proved(&candidate(LOOSER[1]), budget));
        };
        self.covers.extend(sizes);
        Ok(inequality)
    }

    /// Candidates from a sample, tightened. Only `m_lo` must succeed: it serves for a diagonal that fails, and a k that fails is left out.
    pub fn search(mut self, ladder: Ladder) -> Result<RiccatiBounds, BoundsError> {
        let guesses: Vec<Guess<N>> =
            self.arms.corner_models().iter().map(|model| Guess::new(model, &self.intervals)).collect();
        let light = &guesses[0];
        // Least masses against greatest: what cancels between them for one arm does not for a range, of which the second term is a guess.
        let spread = self.arms.groups().iter().take(N).map(|group| group.scale[1] / group.scale[0]).fold(1.0, f64::max);
        let mut k = [0.0; N];
        for guess in &guesses {
            for joint in 1..N {
                k[joint] = f64::max(k[joint], (guess.k[joint].powi(2) * spread + 0.3 * (spread - 1.0)).sqrt());
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "a handful of joints")]
        let step = 1.0 / (N + 2) as f64;
        let mut done = 0.0;
        let mut next = || {
            done += step;
            (done - step, done)
        };
        let (from, to) = next();
        let m_lo = self.tighten(ladder, from, to, |ratio| Inequality::Inertia {
            kg_m2: vec![plain(light.m_lo / ratio, false); N],
        })?;
        let (from, to) = next();
        let shape = light.diagonal(None);
        let scaled = |shape: &[f64; N], ratio: f64| Inequality::Inertia {
            kg_m2: shape.iter().map(|x| plain(x / ratio, false)).collect(),
        };
        let diagonal = self.tighten(ladder, from, to, |ratio| scaled(&shape, ratio)).unwrap_or_else(|_| m_lo.clone());
        let mut k_joint = vec![0.0; N];
        for joint in 1..N {
            // A joint whose k is far below the others' need not be sharp.
            let (from, to) = next();
            let floor = 0.02 * k.iter().copied().fold(LEAST_K / 0.02, f64::max);
            let guess = k[joint].max(floor);
            let found = self.tighten(ladder, from, to, |ratio| Inequality::Coriolis {
                joint: joint + 1,
                k: plain(guess * ratio, true),
            });
            let Ok(Inequality::Coriolis { k, .. }) = found else {
                k_joint.clear();
                break;
            };
            k_joint[joint] = k;
        }
        let (from, to) = next();
        let metric = match <[f64; N]>::try_from(k_joint.as_slice()) {
            Err(_) => Inequality::Inertia { kg_m2: Vec::new() },
            Ok(_) if N == 1 => Inequality::Inertia { kg_m2: vec![0.0; N] },
            Ok(proved_k) => {
                let shape = light.diagonal(Some(&proved_k));
                self.tighten(ladder, from, to, |ratio| scaled(&shape, ratio)).unwrap_or_else(|_| m_lo.clone())
            }
        };
        let plan = RiccatiPlan {
            m_lo_kg_m2: first(&m_lo),
            diagonal_lower_kg_m2: all(&diagonal),
            k_joint,
            metric_kg_m2: all(&metric),
            budget: ladder.budget,
        };
        Ok(self.finish(plan))
    }

    /// A plan from before.
    pub fn follow(mut self, plan: &RiccatiPlan) -> Result<RiccatiBounds, BoundsError> {
        let joints_of_k = if plan.k_joint.is_empty() { 0 } else { N };
        for (list, expected) in
            [(&plan.diagonal_lower_kg_m2, N), (&plan.k_joint, joints_of_k), (&plan.metric_kg_m2, joints_of_k)]
        {
            if list.len() != expected {
                return Err(BoundsError::Length { given: list.len(), expected });
            }
        }
        plan.check()?;
        let mut wanted = vec![
            Inequality::Inertia { kg_m2: vec![plan.m_lo_kg_m2; N] },
            Inequality::Inertia { kg_m2: plan.diagonal_lower_kg_m2.clone() },
        ];
        wanted
            .extend(plan.k_joint.iter().enumerate().skip(1).map(|(j, k)| Inequality::Coriolis { joint: j + 1, k: *k }));
        if joints_of_k > 1 {
            wanted.push(Inequality::Inertia { kg_m2: plan.metric_kg_m2.clone() });
        }
        #[expect(clippy::cast_precision_loss, reason = "a handful of inequalities")]
        let share = |i: usize| i as f64 / wanted.len() as f64;
        for (i, inequality) in wanted.iter().enumerate() {
            self.prove(inequality, plan.budget, share(i), share(i + 1))
                .ok_or_else(|| not_proved(inequality, plan.budget))?;
        }
        Ok(self.finish(plan.clone()))
    }

    /// The numbers that follow from what was proved, rounded upward.
    fn finish(self, plan: RiccatiPlan) -> RiccatiBounds {
        (self.progress)(1.0);
        let up = 1.0 + 1e-13;
        let known = !plan.k_joint.is_empty();
        let k_r = plan.k_joint.iter().map(|k| k * k).sum::<f64>().sqrt() * up;
        let terms = plan.k_joint.iter().zip(&plan.metric_kg_m2).filter(|(k, _)| **k != 0.0).map(|(k, e)| k * k / e);
        let k_m = terms.sum::<f64>().sqrt() * up;
        RiccatiBounds {
            m_lo_kg_m2: plan.m_lo_kg_m2,
            diagonal_lower_kg_m2: plan.diagonal_lower_kg_m2.clone(),
            k_joint: plan.k_joint.clone(),
            k_r: known.then_some(k_r),
            k_m: known.then_some(k_m),
            plan,
            covers: self.covers,
        }
    }
}

fn first(inequality: &Inequality) -> f64 {
    all(inequality).first().copied().unwrap_or(0.0)
}

fn all(inequality: &Inequality) -> Vec<f64> {
    match inequality {
        Inequality::Inertia { kg_m2 } => kg_m2.clone(),
        Inequality::Coriolis { .. } => Vec::new(),
    }
}

fn not_proved(inequality: &Inequality, budget: u64) -> BoundsError {
    match inequality {
        Inequality::Inertia { kg_m2 } => BoundsError::NotProved {
            joint: 0,
            claim: kg_m2.iter().copied().fold(f64::INFINITY, f64::min),
            boxes: budget,
        },
        Inequality::Coriolis { joint, k } => BoundsError::NotProved { joint: *joint, claim: *k, boxes: budget },
    }
}
