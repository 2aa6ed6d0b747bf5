//! The nonlinear loop in continuous time, by Runge and Kutta, written against the controller's own matrices.

use certune::control::aic::AicParams;
use certune::dynamics::{Model, State, forward_dynamics, gravity_torque, mass_matrix, potential_energy};
use certune::linsys::Joints;
use certune::verify::{JointRegionClaim, Number, RegionClaim};

/// State of the loop: q, dq, beliefs mu, mu', mu'', and the controller's torque u.
#[derive(Clone, Copy, Debug)]
pub struct Continuous<const N: usize> {
    pub q: Joints<N>,
    pub dq: Joints<N>,
    pub beliefs: [Joints<N>; 3],
    pub u: Joints<N>,
}

impl<const N: usize> Continuous<N> {
    /// This state plus `h` times a rate of change.
    pub fn plus(&self, rate: &Self, h: f64) -> Self {
        Self {
            q: self.q + rate.q * h,
            dq: self.dq + rate.dq * h,
            beliefs: [0, 1, 2].map(|k| self.beliefs[k] + rate.beliefs[k] * h),
            u: self.u + rate.u * h,
        }
    }
}

/// An arm of a family under the controller, with a fixed goal.
pub struct Loop<'a, const N: usize> {
    pub model: Model<N>,
    pub params: &'a AicParams<N>,
    pub goal: Joints<N>,
    pub compensated: bool,
}

impl<const N: usize> Loop<'_, N> {
    pub fn equilibrium_torque(&self) -> Joints<N> {
        if self.compensated { Joints::zeros() } else { gravity_torque(&self.model, &self.goal) }
    }

    /// z = (e, m, mu', mu'', u~) as joint vectors.
    pub fn z(&self, x: &Continuous<N>) -> [Joints<N>; 5] {
        let [mu, dmu, ddmu] = x.beliefs;
        [x.q - self.goal, mu - self.goal, dmu, ddmu, x.u - self.equilibrium_torque()]
    }

    /// The state with the given velocity and z.
    pub fn state(&self, dq: Joints<N>, z: [Joints<N>; 5]) -> Continuous<N> {
        Continuous {
            q: self.goal + z[0],
            dq,
            beliefs: [self.goal + z[1], z[2], z[3]],
            u: self.equilibrium_torque() + z[4],
        }
    }

    pub fn derivative(&self, x: &Continuous<N>) -> Continuous<N> {
        let compensation = if self.compensated { gravity_torque(&self.model, &x.q) } else { Joints::zeros() };
        let ddq = forward_dynamics(&self.model, &State { q: x.q, dq: x.dq }, &(x.u + compensation));
        let z = self.z(x);
        let mut rates = [Joints::zeros(); 5];
        for joint in 0..N {
            let controller = self.params.continuous_joint(joint);
            for row in 0..5 {
                rates[row][joint] =
                    (0..5).map(|k| controller.A[(row, k)] * z[k][joint]).sum::<f64>() + controller.b[row] * x.dq[joint];
            }
        }
        Continuous { q: x.dq, dq: ddq, beliefs: [rates[1], rates[2], rates[3]], u: rates[4] }
    }

    pub fn step(&self, x: &Continuous<N>, h: f64) -> Continuous<N> {
        let k1 = self.derivative(x);
        let k2 = self.derivative(&x.plus(&k1, h / 2.0));
        let k3 = self.derivative(&x.plus(&k2, h / 2.0));
        let k4 = self.derivative(&x.plus(&k3, h));
        let mut next = *x;
        for (k, weight) in [(&k1, 1.0), (&k2, 2.0), (&k3, 2.0), (&k4, 1.0)] {
            next = next.plus(k, h * weight / 6.0);
        }
        next
    }

    /// The Lyapunov function of a joint-region's witness; every joint's friction, N m s/rad, between the family's ends.
    pub fn joint_v(&self, claim: &JointRegionClaim, ends: &[[f64; 2]], friction: &Joints<N>, x: &Continuous<N>) -> f64 {
        let w = &claim.witness;
        let z = self.z(x);
        let pi = mass_matrix(&self.model, &x.q) * x.dq;
        let mut v = w.p.to_f64() * x.dq.dot(&pi);
        for (joint, weights) in w.joints.iter().enumerate() {
            let [d0, d1] = ends[joint];
            let share = if d1 > d0 { (friction[joint] - d0) / (d1 - d0) } else { 0.0 };
            let [first, last] = [&weights.s[0], &weights.s[weights.s.len() - 1]];
            let mut entries = first.iter().zip(last).map(|(a, b)| a.to_f64() * (1.0 - share) + b.to_f64() * share);
            for i in 0..5 {
                v += 2.0 * pi[joint] * weights.b[i].to_f64() * z[i][joint];
                for j in i..5 {
                    let twice = if i == j { 1.0 } else { 2.0 };
                    v += twice * entries.next().unwrap() * z[i][joint] * z[j][joint];
                }
            }
        }
        v + self.potential(&w.p, x)
    }

    /// `2p (U(q) - U(goal) - g(goal)'e)`, 0 when gravity is compensated.
    fn potential(&self, p: &Number, x: &Continuous<N>) -> f64 {
        if self.compensated {
            return 0.0;
        }
        let rise = potential_energy(&self.model, &x.q) - potential_energy(&self.model, &self.goal);
        2.0 * p.to_f64() * (rise - gravity_torque(&self.model, &self.goal).dot(&(x.q - self.goal)))
    }

    /// The Lyapunov function of a region's witness.
    pub fn v(&self, claim: &RegionClaim, x: &Continuous<N>) -> f64 {
        let w = &claim.witness;
        let z = self.z(x);
        let y = (0..5).fold(Joints::<N>::zeros(), |sum, k| sum + z[k] * w.b[k].to_f64());
        let m = mass_matrix(&self.model, &x.q);
        let p = w.p.to_f64();
        let mut v = p * x.dq.dot(&(m * x.dq)) + 2.0 * x.dq.dot(&(m * y));
        let mut entries = w.s.iter();
        for i in 0..5 {
            for j in i..5 {
                let weight = if i == j { 1.0 } else { 2.0 };
                v += weight * entries.next().unwrap().to_f64() * z[i].dot(&z[j]);
            }
        }
        v + self.potential(&w.p, x)
    }

    /// `dV/dt` along the loop, by a central difference in the direction of motion.
    pub fn v_slope(&self, claim: &RegionClaim, x: &Continuous<N>) -> f64 {
        const H: f64 = 1e-5;
        let rate = self.derivative(x);
        // The fastest coordinate sets the step, so that the difference stays within a small part of its change.
        let size = rate.dq.norm().max(rate.u.norm()).max(1.0);
        let h = H / size;
        (self.v(claim, &x.plus(&rate, h)) - self.v(claim, &x.plus(&rate, -h))) / (2.0 * h)
    }
}
