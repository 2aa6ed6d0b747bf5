//! Local maximisation of a smooth function of the joint angles: BFGS with backtracking.
//!
//! Each constant is a supremum of smooth functions, so its kinks point down and never sit at a maximum: near one the
//! function is smooth and a quasi-Newton method converges fast. Source: Nocedal and Wright, *Numerical Optimization*
//! (2nd ed.), ch. 6. Limits: finds a local maximum only.

use certune_linsys::{JointMatrix, Joints};

/// Longest step in the largest angle, rad: a quarter of a half turn, within one hill of a trigonometric polynomial of degree 2.
const LONGEST_STEP_RAD: f64 = 0.4;
/// Share of the predicted gain that a step must bring (Armijo).
const ARMIJO: f64 = 1e-4;
/// A step that gains less than this, relative to the value, ends the climb.
const RELATIVE_GAIN: f64 = 1e-9;
/// Halvings of one step before it is given up.
const HALVINGS: usize = 14;

/// A point of a climb: where, how high, and whatever the caller needs to continue from there.
pub(crate) trait Foothold<const N: usize>: Sized {
    /// Joint angles, rad.
    fn q(&self) -> Joints<N>;
    /// The value to be made large.
    fn value(&self) -> f64;
}

/// Climbs from `start` for at most `iterations` steps; the value never falls.
pub(crate) fn climb<const N: usize, P: Foothold<N>>(
    start: P,
    iterations: usize,
    evaluate: impl Fn(&Joints<N>, &P) -> P,
    gradient: impl Fn(&P) -> Joints<N>,
) -> P {
    let mut here = start;
    let mut slope = gradient(&here);
    let mut metric = initial_metric(&slope);
    let mut fresh = true;
    for _ in 0..iterations {
        let mut direction = metric * slope;
        let mut gain = direction.dot(&slope);
        if gain <= 0.0 || gain.is_nan() {
            metric = initial_metric(&slope);
            fresh = true;
            direction = metric * slope;
            gain = direction.dot(&slope);
            if gain <= 0.0 || gain.is_nan() {
                break;
            }
        }
        let shrink = (LONGEST_STEP_RAD / direction.amax()).min(1.0);
        let Some((next, step)) = search_line(&here, &(direction * shrink), gain * shrink, &evaluate) else {
            if fresh {
                break;
            }
            metric = initial_metric(&slope);
            fresh = true;
            continue;
        };
        let gained = next.value() - here.value();
        let next_slope = gradient(&next);
        update_metric(&mut metric, &step, &(slope - next_slope));
        fresh = false;
        here = next;
        slope = next_slope;
        if gained <= RELATIVE_GAIN * here.value().abs() {
            break;
        }
    }
    here
}

/// Halves `step` until it gains enough.
fn search_line<const N: usize, P: Foothold<N>>(
    here: &P,
    step: &Joints<N>,
    predicted: f64,
    evaluate: impl Fn(&Joints<N>, &P) -> P,
) -> Option<(P, Joints<N>)> {
    let mut fraction = 1.0;
    for _ in 0..HALVINGS {
        let tried = step * fraction;
        let next = evaluate(&(here.q() + tried), here);
        if next.value() > here.value() + ARMIJO * fraction * predicted {
            return Some((next, tried));
        }
        fraction *= 0.5;
    }
    None
}

/// A multiple of the identity whose first step is of the order of the longest one.
fn initial_metric<const N: usize>(slope: &Joints<N>) -> JointMatrix<N> {
    let size = slope.amax();
    if size > 0.0 { JointMatrix::identity() * (0.5 * LONGEST_STEP_RAD / size) } else { JointMatrix::zeros() }
}

/// BFGS update of the inverse Hessian of `-f`; `bend` is the fall of the slope along `step`. Skipped where `f` is not concave.
fn update_metric<const N: usize>(metric: &mut JointMatrix<N>, step: &Joints<N>, bend: &Joints<N>) {
    let curvature = step.dot(bend);
    if curvature <= 1e-10 * step.norm() * bend.norm() || curvature.is_nan() {
        return;
    }
    let rho = curvature.recip();
    let left = JointMatrix::<N>::identity() - step * bend.transpose() * rho;
    *metric = left * *metric * left.transpose() + step * step.transpose() * rho;
}

#[cfg(test)]
mod tests {
    use certune_linsys::Joints;

    use super::{Foothold, climb};

    struct Here(Joints<3>, f64);
    impl Foothold<3> for Here {
        fn q(&self) -> Joints<3> {
            self.0
        }
        fn value(&self) -> f64 {
            self.1
        }
    }

    #[test]
    fn climbs_to_the_top_of_an_ill_conditioned_hill() {
        let top = Joints::<3>::new(0.3, -0.8, 1.1);
        let weight = Joints::<3>::new(1.0, 30.0, 0.02);
        let height = |q: &Joints<3>| (0..3).map(|i| weight[i] * (q[i] - top[i]).cos()).sum::<f64>();
        let slope = |at: &Here| Joints::<3>::from_fn(|i, _| -weight[i] * (at.0[i] - top[i]).sin());
        let start = Joints::<3>::new(1.7, 0.4, -0.2);
        let end = climb(Here(start, height(&start)), 60, |q, _| Here(*q, height(q)), slope);
        assert!((end.1 - weight.sum()).abs() <= 1e-6 * weight.sum());
        // The flattest direction decides: a relative gain of 1e-9 of the sum is an angle of sqrt(2e-9 * 31 / 0.02) = 2 mrad.
        assert!((end.0 - top).amax() <= 5e-3, "{:?}", end.0);
    }

    #[test]
    fn a_flat_function_ends_where_it_began() {
        let end = climb(Here(Joints::zeros(), 1.0), 60, |q, _| Here(*q, 1.0), |_| Joints::zeros());
        assert!(end.0.amax() < f64::MIN_POSITIVE);
    }
}
