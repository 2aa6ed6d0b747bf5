//! The nonlinear loop with the controller's own step, its torque held and late, the arm integrated finely in between.

use std::collections::VecDeque;

use certune::control::aic::{Aic, AicParams, AicState};
use certune::control::{Controller, Measurement};
use certune::dynamics::{Model, State, forward_dynamics, gravity_torque, mass_matrix};
use certune::linsys::Joints;
use certune::verify::{Compensation, SampledRegionClaim};

/// Integration steps to a period.
const SUBSTEPS: usize = 8;

pub struct Held<const N: usize> {
    model: Model<N>,
    aic: Aic<N>,
    step_s: f64,
    delay: usize,
    compensation: Compensation,
    pub goal: Joints<N>,
    pub q: Joints<N>,
    pub dq: Joints<N>,
    state: AicState<N>,
    /// The torques computed so far, the last one first: one more than the delay.
    computed: VecDeque<Joints<N>>,
    /// Mean velocity of the last period.
    mean: Joints<N>,
}

impl<const N: usize> Held<N> {
    /// At rest at `q`, nothing computed yet.
    pub fn at_rest(
        model: Model<N>,
        params: &AicParams<N>,
        claim: &SampledRegionClaim,
        q: Joints<N>,
        goal: Joints<N>,
    ) -> Self {
        let aic = Aic::new(params);
        let state = aic.start(&Measurement { q, dq: Joints::zeros() });
        let delay = claim.sampling.delay_samples;
        Self {
            model,
            aic,
            step_s: claim.sampling.step_s.to_f64(),
            delay,
            compensation: claim.sampling.compensation,
            goal,
            q,
            dq: Joints::zeros(),
            state,
            computed: std::iter::repeat_n(Joints::zeros(), delay + 1).collect(),
            mean: Joints::zeros(),
        }
    }

    /// One period; the torque that the controller computed at its start.
    pub fn step(&mut self) -> Joints<N> {
        let (state, command) = self.aic.step(&self.state, &Measurement { q: self.q, dq: self.dq }, &self.goal);
        self.state = state;
        self.computed.push_front(command);
        let torque = self.computed[self.delay];
        self.computed.truncate(self.delay + 1);
        let at_sample = gravity_torque(&self.model, &self.q);
        let rate = |q: &Joints<N>, dq: &Joints<N>| {
            let compensation = match self.compensation {
                Compensation::Continuous => gravity_torque(&self.model, q),
                Compensation::Held => at_sample,
            };
            (*dq, forward_dynamics(&self.model, &State { q: *q, dq: *dq }, &(torque + compensation)))
        };
        let h = self.step_s / SUBSTEPS as f64;
        let (mut q, mut dq) = (self.q, self.dq);
        for _ in 0..SUBSTEPS {
            let k1 = rate(&q, &dq);
            let k2 = rate(&(q + k1.0 * (h / 2.0)), &(dq + k1.1 * (h / 2.0)));
            let k3 = rate(&(q + k2.0 * (h / 2.0)), &(dq + k2.1 * (h / 2.0)));
            let k4 = rate(&(q + k3.0 * h), &(dq + k3.1 * h));
            q += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
            dq += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
        }
        self.mean = (q - self.q) / self.step_s;
        (self.q, self.dq) = (q, dq);
        command
    }

    /// The witness's function at this sample, before the controller's step.
    pub fn v(&self, claim: &SampledRegionClaim) -> f64 {
        let w = &claim.witness;
        let AicState { mu, dmu, ddmu, .. } = self.state;
        let mut z = vec![self.q - self.goal, mu - self.goal, dmu, ddmu];
        z.extend(&self.computed);
        z.push(self.mean);
        let m = mass_matrix(&self.model, &self.q);
        let y = z.iter().zip(&w.b).fold(Joints::<N>::zeros(), |sum, (part, b)| sum + part * b.to_f64());
        let mut v = w.p.to_f64() * self.dq.dot(&(m * self.dq)) + 2.0 * self.dq.dot(&(m * y));
        let mut entries = w.s.iter();
        for i in 0..z.len() {
            for j in i..z.len() {
                let weight = if i == j { 1.0 } else { 2.0 };
                v += weight * entries.next().unwrap().to_f64() * z[i].dot(&z[j]);
            }
        }
        v
    }
}
