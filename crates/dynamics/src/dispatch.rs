//! From a number of joints known at run time to one known to the compiler.

/// The most joints that [`crate::for_joint_count!`] reaches.
pub const MOST_JOINTS: usize = 10;

/// Evaluates an expression with a constant equal to a run-time number of joints, 1 to [`MOST_JOINTS`].
///
/// `for_joint_count!(n, N => expression)` is `Some(expression)`, or `None` for any other `n`. The expression is compiled once for each count.
///
/// ```
/// use certune_dynamics::{Joints, Model, Robot, for_joint_count, gravity_torque};
///
/// let robot = Robot::panda();
/// let largest = for_joint_count!(robot.joints(), N => {
///     Model::<N>::new(&robot).map(|arm| gravity_torque(&arm, &Joints::zeros()).amax())
/// });
/// assert!(largest.is_some_and(|torque_n_m| torque_n_m.is_ok_and(|x| x > 1.0)));
/// assert_eq!(for_joint_count!(11, N => N), None);
/// ```
#[macro_export]
macro_rules! for_joint_count {
    ($count:expr, $N:ident => $body:expr) => {
        $crate::for_joint_count!(@each $count, $N, $body, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10)
    };
    (@each $count:expr, $N:ident, $body:expr, $($joints:literal),+) => {
        match $count {
            $($joints => {
                const $N: usize = $joints;
                ::core::option::Option::Some($body)
            })+
            _ => ::core::option::Option::None,
        }
    };
}

#[cfg(test)]
mod tests {
    use super::MOST_JOINTS;

    #[test]
    fn every_supported_count_becomes_its_own_constant() {
        for n in 1..=MOST_JOINTS {
            assert_eq!(for_joint_count!(n, N => [0_u8; N].len()), Some(n));
        }
        assert_eq!(for_joint_count!(0, N => N), None);
        assert_eq!(for_joint_count!(MOST_JOINTS + 1, N => N), None);
    }
}
