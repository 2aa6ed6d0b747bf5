//! How close two numbers must be, and why: tolerances with a name and a scale.
//!
//! A comparison has two parts. The **scale** is the size of what was added up on the way to the numbers, in their unit:
//! a result that is small because large terms cancel carries the rounding of the large ones. The **relative tolerance**
//! counts roundings.
//!
//! ```text
//! |left - right|  <=  rtol * scale          entry by entry; NaN never passes
//! ```
//!
//! | scale | bounds, in any configuration | unit |
//! |-------|------------------------------|------|
//! | [`inertia_scale_kg_m2`] | every entry of M | kg m² |
//! | [`gravity_scale_n_m`] | every entry of g | N m |
//!
//! ```
//! use certune_dynamics::{Model, Robot, State, forward_dynamics, inverse_dynamics};
//! use certune_testkit::tolerance::{close, gravity_scale_n_m, recursion_rtol};
//!
//! let robot = Robot::panda();
//! let panda = Model::<7>::new(&robot)?;
//! let at = State::at_rest([0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0].into());
//! let tau = [1.0, -20.0, 0.0, 15.0, 0.0, 2.0, 0.0].into();
//! let again = inverse_dynamics(&panda, &at, &forward_dynamics(&panda, &at, &tau));
//! close(again.as_slice(), tau.as_slice(), 20.0 + gravity_scale_n_m(&robot), recursion_rtol(7))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use certune_dynamics::Robot;
use nalgebra::Vector3;

/// Roundings of the size of the scale that one joint adds to a result of a recursion. The recursions of this workspace stay
/// below one on the arms of [`serial_arm`](crate::serial_arm), since the scales here are those of a stretched arm.
pub const ROUNDINGS_PER_JOINT: u32 = 10;

/// Two lists that should agree and do not.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// They are not of the same length.
    #[error("{left} entries on the left, {right} on the right")]
    Length {
        /// Entries on the left.
        left: usize,
        /// Entries on the right.
        right: usize,
    },
    /// An entry differs by more than allowed, or is no number.
    #[error("entry {index}: {left:e} and {right:e} differ by {difference:e}, allowed is {allowed:e}")]
    Entry {
        /// The entry, counted from 0.
        index: usize,
        /// Its value on the left.
        left: f64,
        /// Its value on the right.
        right: f64,
        /// Their distance.
        difference: f64,
        /// The largest distance allowed.
        allowed: f64,
    },
}

/// Whether two lists agree entry by entry to within `rtol * scale`; `scale` in the unit of the entries. `?` hands a
/// mismatch to proptest.
///
/// # Errors
/// [`Mismatch`] for lists of different length, or the first entry that is further away, or for which that cannot be
/// said because a number is NaN.
pub fn close(left: &[f64], right: &[f64], scale: f64, rtol: f64) -> Result<(), Mismatch> {
    if left.len() != right.len() {
        return Err(Mismatch::Length { left: left.len(), right: right.len() });
    }
    let allowed = rtol * scale;
    for (index, (&left, &right)) in left.iter().zip(right).enumerate() {
        let difference = (left - right).abs();
        if !(difference <= allowed && allowed.is_finite()) {
            return Err(Mismatch::Entry { index, left, right, difference, allowed });
        }
    }
    Ok(())
}

/// Relative tolerance between two ways to compute M, C, g or a torque of an arm with `joints` joints.
pub fn recursion_rtol(joints: usize) -> f64 {
    f64::from(ROUNDINGS_PER_JOINT) * joints as f64 * f64::EPSILON
}

/// Relative tolerance between two accelerations, which a division by M gives; `condition` is the condition number of M.
pub fn solve_rtol(joints: usize, condition: f64) -> f64 {
    recursion_rtol(joints) * condition
}

/// Relative tolerance between a derivative and the central difference `(f(x + step) - f(x - step)) / (2 step)`:
/// rounding of f over the step, and the third derivative that the difference leaves out.
///
/// `step` is relative to the length over which `f` changes by its own size (1 rad for functions of joint angles, whose
/// every derivative is as large as they are). With 100 roundings the best step is about 2e-5 and the tolerance there
/// 1.5e-9.
pub fn central_difference_rtol(step: f64, roundings: f64) -> f64 {
    roundings * f64::EPSILON / step + step * step
}

/// Per link: how far its centre of mass can be from the base, m, and its mass and trace of inertia.
fn reaches(robot: &Robot) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
    robot.links().iter().scan(0.0, |reach, link| {
        *reach += link.frame.position().norm();
        let [xx, yy, zz, ..] = link.inertia.about_com_kg_m2;
        Some((*reach + Vector3::from(link.inertia.com_m).norm(), link.inertia.mass_kg, xx + yy + zz))
    })
}

/// No entry of M is larger in any configuration, kg m²: `sum m r² + tr J` over the links, r the stretched arm's length
/// to the centre of mass, plus the largest rotor inertia.
///
/// Times a joint acceleration it bounds `M ddq`; times a squared joint speed it scales `C dq`.
pub fn inertia_scale_kg_m2(robot: &Robot) -> f64 {
    let rotor = robot.links().iter().map(|link| link.rotor_inertia_kg_m2).fold(0.0, f64::max);
    reaches(robot).map(|(reach, mass, trace)| mass * reach * reach + trace).sum::<f64>() + rotor
}

/// No entry of g is larger in any configuration, N m: `|gravity| sum m r` over the links, r as in [`inertia_scale_kg_m2`].
pub fn gravity_scale_n_m(robot: &Robot) -> f64 {
    let gravity = Vector3::from(robot.gravity_m_per_s2()).norm();
    gravity * reaches(robot).map(|(reach, mass, _)| mass * reach).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_within_the_tolerance_passes_and_nothing_else() {
        assert_eq!(close(&[1.0, 2.0], &[1.0, 2.0], 0.0, 0.0), Ok(()));
        assert_eq!(close(&[100.0], &[100.5], 100.0, 0.01), Ok(()));
        let far = close(&[0.0, 100.0], &[0.0, 102.0], 100.0, 0.01);
        assert_eq!(
            far,
            Err(Mismatch::Entry { index: 1, left: 100.0, right: 102.0, difference: 2.0, allowed: 1.0 }),
            "the first entry that is too far is named"
        );
        assert_eq!(close(&[1.0], &[], 1.0, 1.0), Err(Mismatch::Length { left: 1, right: 0 }));
    }

    #[test]
    fn no_number_is_close_to_nothing() {
        for (left, right, scale) in
            [(f64::NAN, 0.0, 1.0), (0.0, f64::NAN, 1.0), (0.0, 0.0, f64::NAN), (f64::INFINITY, 0.0, f64::INFINITY)]
        {
            assert!(close(&[left], &[right], scale, 1.0).is_err(), "{left} {right} {scale}");
        }
    }

    #[test]
    fn the_best_step_of_a_difference_is_where_its_two_errors_meet() {
        let best = central_difference_rtol(2e-5, 100.0);
        assert!(best < 2e-9, "{best}");
        assert!(
            central_difference_rtol(1e-7, 100.0) > 50.0 * best && central_difference_rtol(1e-3, 100.0) > 50.0 * best
        );
    }
}
