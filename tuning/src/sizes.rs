//! An arm's number of joints as a type.
//!
//! The unit tests of this program run no arm, and ten sizes take minutes to compile: their build holds one.

#[cfg(not(test))]
pub use certune::dynamics::for_joint_count;

#[cfg(test)]
macro_rules! for_joint_count {
    ($count:expr, $N:ident => $body:expr) => {
        match $count {
            7 => {
                const $N: usize = 7;
                Some($body)
            }
            _ => None,
        }
    };
}
#[cfg(test)]
pub(crate) use for_joint_count;
