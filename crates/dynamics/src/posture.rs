//! An arm's joints turned to one configuration, for several recursions there.
//!
//! The sines and cosines of a configuration are taken once, and the scratch of the articulated-body algorithm is kept from one call to the next: who calls it a million times
//! does not clear it a million times.

use certune_linsys::{Joints, Real};

use crate::forward::JointShare;
use crate::local::{Passage, Turn};
use crate::model::Model;

/// The joints of an arm at some configuration.
///
/// Arms of the same geometry share postures, whatever their bodies, loads and friction are; with another geometry the results are those of no arm.
///
/// ```
/// use certune_dynamics::{Joints, Model, Posture, Robot, gravity_torque};
///
/// let arm = Model::<7>::new(&Robot::panda())?;
/// let heavier = arm.with_link_scales(&[1.1; 7]);
/// let q = Joints::repeat(0.3);
/// let posture = Posture::at(&arm, &q);
/// assert_eq!(posture.gravity_torque(&heavier), gravity_torque(&heavier, &q));
/// # Ok::<(), certune_dynamics::RobotError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Posture<const N: usize, T: Real = f64> {
    turns: [Turn<T>; N],
    /// Scratch of the forward dynamics.
    pub(crate) shares: [JointShare<T>; N],
}

impl<const N: usize, T: Real> Posture<N, T> {
    /// The posture of `model` at `q`, rad.
    #[inline(always)]
    pub fn at(model: &Model<N, T>, q: &Joints<N, T>) -> Self {
        let still = Turn { sin: T::zero(), cos: T::zero() };
        let mut posture = Self { turns: [still; N], shares: [JointShare::zero(); N] };
        posture.move_to(model, q);
        posture
    }

    /// Moves it to `q`, rad.
    #[inline(always)]
    pub fn move_to(&mut self, model: &Model<N, T>, q: &Joints<N, T>) {
        for i in 0..N {
            self.turns[i] = model.chain[i].turn(q[i]);
        }
    }

    /// The way from a link to its parent.
    #[inline(always)]
    pub(crate) fn passage(&self, model: &Model<N, T>, link: usize) -> Passage<T> {
        model.chain[link].turned(self.turns[link])
    }
}
