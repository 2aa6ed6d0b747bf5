//! The loop of one joint of constant inertia m, friction d and linear gravity stiffness g, in floating point: a member of every family whose constants
//! allow it. Its matrices are written out here once more.

use certune::verify::{Document, LoopBox, Number};
use nalgebra::DMatrix;

/// One joint's gains.
pub struct Joint {
    kappa: f64,
    inverse_q: f64,
    inverse_dq: f64,
    a: f64,
    av: f64,
    b: f64,
    c: f64,
    t: f64,
}

/// State of the sampled loop: e, dq, m, mu', mu'', the torques computed so far (the last one first), the mean velocity of the last period.
pub type Sample = Vec<f64>;

/// How the arm moves in a period.
#[derive(Clone, Copy)]
pub enum Motion {
    /// One semi-implicit step.
    SemiImplicit,
    /// As it does, the torque of `whole` samples ago acting after this share of the period, the one before until then.
    Held { share: f64 },
    /// As it does, gravity compensated with the torque of the sample.
    HeldCompensation,
}

impl Joint {
    pub fn of(document: &Document, joint: usize) -> Self {
        let gains = document.gains.aic().unwrap();
        let gain = |list: &[Number]| list[joint].to_f64();
        let kappa_mu = gain(&gains.kappa_mu);
        let (inverse_q, inverse_dq) = (1.0 / gain(&gains.sigma_q), 1.0 / gain(&gains.sigma_dq));
        Self {
            kappa: gain(&gains.kappa_a),
            inverse_q,
            inverse_dq,
            a: kappa_mu * inverse_q,
            av: kappa_mu * inverse_dq,
            b: kappa_mu / gain(&gains.sigma_mu),
            c: kappa_mu / gain(&gains.sigma_dmu),
            t: gain(&gains.reference_time_constant_s),
        }
    }

    /// States e, dq, m, mu', mu'', u~.
    pub fn continuous(&self, [m, d, g]: [f64; 3]) -> DMatrix<f64> {
        let Self { a, av, b, c, t, .. } = *self;
        let (kq, kdq) = (self.kappa * self.inverse_q, self.kappa * self.inverse_dq);
        #[rustfmt::skip]
        let entries = [
            // e     dq            m                   mu'                       mu''        u~
            0.0,     1.0,          0.0,                0.0,                      0.0,        0.0,
            -g / m,  -d / m,       0.0,                0.0,                      0.0,        1.0 / m,
            a,       0.0,          -a - b / (t * t),   1.0 - b / t,              0.0,        0.0,
            0.0,     av,           -b / t,             -av - b - c / (t * t),    1.0 - c / t, 0.0,
            0.0,     0.0,          0.0,                -c / t,                   -c,         0.0,
            -kq,     -kdq,         kq,                 kdq,                      0.0,        0.0,
        ];
        DMatrix::from_row_slice(6, 6, &entries)
    }

    /// What position and velocity noise add to the rates of the states, and a torque.
    pub fn disturbances(&self, m: f64) -> DMatrix<f64> {
        let (kq, kdq) = (self.kappa * self.inverse_q, self.kappa * self.inverse_dq);
        #[rustfmt::skip]
        let entries = [
            0.0,     0.0,      0.0,
            0.0,     0.0,      1.0 / m,
            self.a,  0.0,      0.0,
            0.0,     self.av,  0.0,
            0.0,     0.0,      0.0,
            -kq,     -kdq,     0.0,
        ];
        DMatrix::from_row_slice(6, 3, &entries)
    }

    /// At rest at e, the beliefs at the measurement.
    pub fn at_rest(e: f64, delay: usize) -> Sample {
        let mut x = vec![0.0; 5 + delay + 2 + 1];
        (x[0], x[2]) = (e, e);
        x
    }

    /// One period with `delay` whole samples of delay.
    pub fn step(&self, x: &[f64], [m, d, g]: [f64; 3], h: f64, delay: usize, motion: Motion) -> Sample {
        let Self { a, av, b, c, t, .. } = *self;
        let [e, dq, mu, dmu, ddmu] = [x[0], x[1], x[2], x[3], x[4]];
        let new_mu = mu + h * (dmu + a * (e - mu) - b / t * (dmu + mu / t));
        let new_dmu = dmu + h * (ddmu + av * (dq - dmu) - b * (dmu + mu / t) - c / t * (ddmu + dmu / t));
        let new_ddmu = ddmu - h * c * (ddmu + dmu / t);
        let torque = x[5] - h * self.kappa * ((e - new_mu) * self.inverse_q + (dq - new_dmu) * self.inverse_dq);
        let mut torques = vec![torque];
        torques.extend(&x[5..x.len() - 2]);
        let (late, later) = (torques[delay], torques[delay + 1]);
        let (q, v) = match motion {
            Motion::SemiImplicit => {
                let v = dq + h / m * (late - g * e - d * dq);
                (e + h * v, v)
            }
            Motion::Held { share } => {
                let between = held([e, dq], [m, d, 0.0], later, share * h);
                held(between, [m, d, 0.0], late, (1.0 - share) * h).into()
            }
            Motion::HeldCompensation => held([e, dq], [m, d, g], late + g * e, h).into(),
        };
        let mut next = vec![q, v, new_mu, new_dmu, new_ddmu];
        next.extend(&torques);
        next.push((q - e) / h);
        next
    }

    /// The period as a matrix.
    pub fn period(&self, at: [f64; 3], h: f64, delay: usize, motion: Motion) -> DMatrix<f64> {
        let order = Self::at_rest(0.0, delay).len();
        let mut matrix = DMatrix::zeros(order, order);
        for column in 0..order {
            let mut x = vec![0.0; order];
            x[column] = 1.0;
            matrix.column_mut(column).copy_from_slice(&self.step(&x, at, h, delay, motion));
        }
        matrix
    }
}

/// Position and velocity after a time under a constant torque.
fn held(state: [f64; 2], [m, d, g]: [f64; 3], torque: f64, time: f64) -> [f64; 2] {
    let a = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -g / m, -d / m, torque / m, 0.0, 0.0, 0.0]) * time;
    let end = a.exp() * DMatrix::from_column_slice(3, 1, &[state[0], state[1], 1.0]);
    [end[(0, 0)], end[(1, 0)]]
}

/// The ends of an interval.
pub fn ends(interval: &[Number; 2]) -> [f64; 2] {
    [interval[0].to_f64(), interval[1].to_f64()]
}

/// A point of a box, as often as not a corner.
pub fn point(range: &LoopBox, uniform: &mut impl FnMut() -> f64) -> [f64; 3] {
    let (m, d, g) = (ends(&range.inertia), ends(&range.friction), ends(&range.stiffness));
    let corner = uniform() < 0.5;
    let mut share = || if corner { uniform().round() } else { uniform() };
    [m[0] * (m[1] / m[0]).powf(share()), d[0] + (d[1] - d[0]) * share(), g[0] + (g[1] - g[0]) * share()]
}
