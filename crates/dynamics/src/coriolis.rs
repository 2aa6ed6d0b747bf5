//! Derivatives of the inertia matrix and the Coriolis matrix in Christoffel form.
//!
//! Turning joint k carries every body k, k+1, .. along, so in the base frame, for i <= j:
//!
//! ```text
//! dM_ij/dq_k = 0                                                      k <= i
//!            = (S_i x S_k) . I_j^C S_j                                i < k <= j
//!            = -(S_k x S_i) . I_k^C S_j - S_i . I_k^C (S_k x S_j)     k > j
//! C_ij       = 1/2 sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) dq_k
//! ```
//!
//! | symbol | code | shape | unit |
//! |--------|------|-------|------|
//! | dM/dq_k | [`mass_matrix_derivatives`] | N of N x N | kg m^2/rad |
//! | C | [`coriolis_matrix`] | N x N | kg m^2/s |
//! | C dq | [`coriolis_torque`] | N | N m |
//!
//! In this form `dM/dt = C + C'`, so `dM/dt - 2 C` is skew, and `d(C dq)/d(dq) = 2 C`. Source: Featherstone 2008, ch. 2 and 6, for
//! `d/dq_k = S_k x`; the Christoffel form is Echeandia & Wensing, "Numerical methods to compute the Coriolis matrix and Christoffel
//! symbols for rigid-body systems" (2021). Limits: O(N^3).

use certune_linsys::{JointMatrix, Joints, Real};

use crate::base::Base;
use crate::inverse::newton_euler;
use crate::model::{Model, State};
use crate::spatial::{Twist, Wrench};

/// `dM/dq_k` for every joint k, kg m^2/rad; each is symmetric to the bit. O(N^3), no heap.
pub fn mass_matrix_derivatives<const N: usize, T: Real>(
    model: &Model<N, T>,
    q: &Joints<N, T>,
) -> [JointMatrix<N, T>; N] {
    let base = Base::at(model, q);
    let composite = base.composites(model);
    let axis = &base.axis;
    let mut derivative = [JointMatrix::<N, T>::zeros(); N];
    for k in 1..N {
        // S_k x S_j, and the momenta of S_j and of S_k x S_j in the subtree that joint k carries, for j < k.
        let mut carried = [Twist::zero(); N];
        let mut momentum = [Wrench::zero(); N];
        let mut carried_momentum = [Wrench::zero(); N];
        for j in 0..k {
            carried[j] = axis[k].carry(&axis[j]);
            momentum[j] = composite[k].apply(&axis[j]);
            carried_momentum[j] = composite[k].apply(&carried[j]);
        }
        for j in 0..k {
            for i in 0..=j {
                let entry = -(carried[i].power(&momentum[j]) + axis[i].power(&carried_momentum[j]));
                derivative[k][(i, j)] = entry;
                derivative[k][(j, i)] = entry;
            }
        }
        for j in k..N {
            let momentum = composite[j].apply(&axis[j]);
            for i in 0..k {
                let entry = -carried[i].power(&momentum);
                derivative[k][(i, j)] = entry;
                derivative[k][(j, i)] = entry;
            }
        }
    }
    derivative
}

/// Contracts `dM/dq` with a velocity into the Christoffel matrix.
#[inline]
pub(crate) fn christoffel<const N: usize, T: Real>(
    derivative: &[JointMatrix<N, T>; N],
    dq: &Joints<N, T>,
) -> JointMatrix<N, T> {
    let half = T::from_f64(0.5);
    // a_ij = sum_k dM_ij/dq_k dq_k (symmetric), b_ij = sum_k dM_ik/dq_j dq_k: C = (a + b - b') / 2.
    let mut a = JointMatrix::<N, T>::zeros();
    let mut b = JointMatrix::<N, T>::zeros();
    for j in 0..N {
        for i in 0..N {
            let (mut along, mut across) = (T::zero(), T::zero());
            for k in 0..N {
                along += derivative[k][(i, j)] * dq[k];
                across += derivative[j][(i, k)] * dq[k];
            }
            a[(i, j)] = along;
            b[(i, j)] = across;
        }
    }
    JointMatrix::from_fn(|i, j| half * (a[(i, j)] + b[(i, j)] - b[(j, i)]))
}

/// The Coriolis matrix `C(q, dq)` in Christoffel form, kg m^2/s: `dM/dt = C + C'`. O(N^3), no heap.
pub fn coriolis_matrix<const N: usize, T: Real>(model: &Model<N, T>, at: &State<N, T>) -> JointMatrix<N, T> {
    christoffel(&mass_matrix_derivatives(model, &at.q), &at.dq)
}

/// Coriolis and centrifugal torque `C(q, dq) dq`, N m, by recursion. O(N), no heap.
pub fn coriolis_torque<const N: usize, T: Real>(model: &Model<N, T>, at: &State<N, T>) -> Joints<N, T> {
    newton_euler(model, &at.q, &at.dq, &Joints::zeros(), &nalgebra::Vector3::zeros())
}
