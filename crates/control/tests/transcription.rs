//! The controllers against their equations, written a second time in the plainest way: loops over `Vec<Vec<f64>>`, one equation
//! a line, nothing shared with the crate but the numbers.
#![expect(clippy::unwrap_used, reason = "a strategy draws only valid gains; a failure is a failed test")]

use certune_control::aic::{Aic, AicGains, AicParams};
use certune_control::mrac::{Mrac, MracGains, MracLaw, MracParams};
use certune_control::{Controller, Measurement};
use certune_linsys::Joints;
use proptest::prelude::*;

const N: usize = 3;
const H: f64 = 1e-3;
const STEPS: usize = 60;
/// Each step adds a few dozen roundings, and sixty steps carry them on.
const RTOL: f64 = 60.0 * 64.0 * f64::EPSILON;

type Row = Vec<f64>;
type Table = Vec<Vec<f64>>;

/// What the sensors and the operator say at each step.
#[derive(Clone, Debug)]
struct Sequence {
    q: Vec<[f64; N]>,
    dq: Vec<[f64; N]>,
    goal: Vec<[f64; N]>,
}

fn three(range: core::ops::Range<f64>) -> impl Strategy<Value = [f64; N]> {
    prop::array::uniform3(range)
}

fn sequence() -> impl Strategy<Value = Sequence> {
    let many = |limit: f64| prop::collection::vec(three(-limit..limit), STEPS);
    // A new goal every twenty steps.
    let goal = prop::collection::vec(three(-2.0..2.0), 3).prop_map(|goals| (0..STEPS).map(|k| goals[k / 20]).collect());
    (many(2.0), many(1.5), goal).prop_map(|(q, dq, goal)| Sequence { q, dq, goal })
}

fn run(controller: &impl Controller<N>, sequence: &Sequence) -> Table {
    let at = |k: usize| Measurement { q: Joints::<N>::from(sequence.q[k]), dq: Joints::<N>::from(sequence.dq[k]) };
    let mut state = controller.start(&at(0));
    (0..STEPS)
        .map(|k| {
            let (next, u) = controller.step(&state, &at(k), &Joints::<N>::from(sequence.goal[k]));
            state = next;
            u.iter().copied().collect()
        })
        .collect()
}

fn assert_close(is: &Table, should: &Table) -> Result<(), TestCaseError> {
    let mut scale = 1.0_f64;
    for k in 0..STEPS {
        for i in 0..N {
            scale = scale.max(should[k][i].abs());
            let error = (is[k][i] - should[k][i]).abs();
            prop_assert!(error <= RTOL * scale, "step {k}, joint {i}: {} is not {}", is[k][i], should[k][i]);
        }
    }
    Ok(())
}

fn plain_aic(g: &AicGains<N>, s: &Sequence) -> Table {
    let mut mu: Row = s.q[0].to_vec();
    let mut mu_p: Row = s.dq[0].to_vec();
    let mut mu_pp: Row = vec![0.0; N];
    let mut u: Row = vec![0.0; N];
    let mut torques = Vec::new();
    for k in 0..STEPS {
        for i in 0..N {
            let t = g.reference_time_constant_s[i];
            let error_q = (s.q[k][i] - mu[i]) / g.sigma_q[i];
            let error_dq = (s.dq[k][i] - mu_p[i]) / g.sigma_dq[i];
            let error_mu = (mu_p[i] - (s.goal[k][i] - mu[i]) / t) / g.sigma_mu[i];
            let error_mu_p = (mu_pp[i] + mu_p[i] / t) / g.sigma_dmu[i];
            let mu_dot = mu_p[i] - g.kappa_mu[i] * (-error_q + error_mu / t);
            let mu_p_dot = mu_pp[i] - g.kappa_mu[i] * (-error_dq + error_mu + error_mu_p / t);
            let mu_pp_dot = -g.kappa_mu[i] * error_mu_p;
            mu[i] += H * mu_dot;
            mu_p[i] += H * mu_p_dot;
            mu_pp[i] += H * mu_pp_dot;
            u[i] -= H * g.kappa_a[i] * ((s.q[k][i] - mu[i]) / g.sigma_q[i] + (s.dq[k][i] - mu_p[i]) / g.sigma_dq[i]);
        }
        torques.push(u.clone());
    }
    torques
}

fn zeros() -> Table {
    vec![vec![0.0; N]; N]
}

fn outer(a: &[f64], b: &[f64]) -> Table {
    let mut product = zeros();
    for i in 0..N {
        for j in 0..N {
            product[i][j] = a[i] * b[j];
        }
    }
    product
}

/// `into += by * what`.
fn add(into: &mut Table, by: f64, what: &Table) {
    for i in 0..N {
        for j in 0..N {
            into[i][j] += by * what[i][j];
        }
    }
}

/// `(now - before) / h`, zero at the first sample.
fn rate(now: &Table, before: Option<&Table>) -> Table {
    let mut rate = zeros();
    if let Some(before) = before {
        add(&mut rate, 1.0 / H, now);
        add(&mut rate, -1.0 / H, before);
    }
    rate
}

/// Row i of `diag(g1) now + diag(g2) integral + diag(g3) derivative` times a vector.
fn row_times(g: &[[f64; N]; 3], now: &Table, integral: &Table, derivative: &Table, i: usize, by: &[f64]) -> f64 {
    let mut sum = 0.0;
    for j in 0..N {
        sum += (g[0][i] * now[i][j] + g[1][i] * integral[i][j] + g[2][i] * derivative[i][j]) * by[j];
    }
    sum
}

fn modified_error(g: &MracGains<N>, q: &[f64], dq: &[f64], q_r: &[f64], dq_r: &[f64]) -> Row {
    let mut q_e = vec![0.0; N];
    for i in 0..N {
        let (w, z) = (g.omega_rad_per_s[i], g.zeta[i]);
        let p2 = g.l1[i] / (2.0 * w.powi(2));
        let p3 = g.l2[i] / (4.0 * z * w) + g.l1[i] / (4.0 * z * w.powi(3));
        q_e[i] = p2 * (q_r[i] - q[i]) + p3 * (dq_r[i] - dq[i]);
    }
    q_e
}

/// The paper's equations, for whatever reference is given.
fn plain_mrac(g: &MracGains<N>, s: &Sequence, reference_model: bool) -> Table {
    let mut reference = (s.q[0].to_vec(), vec![0.0; N]);
    let mut integral_q_e = [0.0; N];
    let mut integrals = [zeros(), zeros(), zeros(), zeros()];
    let mut before: Option<(Row, [Table; 4])> = None;
    let mut torques = Vec::new();
    for k in 0..STEPS {
        let (q, dq) = (&s.q[k], &s.dq[k]);
        let (q_r, dq_r) = if reference_model { reference.clone() } else { (s.goal[k].to_vec(), vec![0.0; N]) };
        let q_e = modified_error(g, q, dq, &q_r, &dq_r);
        let products = [outer(&q_e, q), outer(&q_e, dq), outer(&q_e, &q_r), outer(&q_e, &dq_r)];
        let mut u = vec![0.0; N];
        for i in 0..N {
            let derivative_q_e = before.as_ref().map_or(0.0, |(q_e_before, _)| (q_e[i] - q_e_before[i]) / H);
            u[i] = g.alpha[0][i] * q_e[i] + g.alpha[1][i] * integral_q_e[i] + g.alpha[2][i] * derivative_q_e;
            let terms: [(&[[f64; N]; 3], &[f64]); 4] = [(&g.e0, q), (&g.e1, dq), (&g.f0, &q_r), (&g.f1, &dq_r)];
            for (term, (gains, signal)) in terms.into_iter().enumerate() {
                let derivative = rate(&products[term], before.as_ref().map(|(_, products)| &products[term]));
                u[i] += row_times(gains, &products[term], &integrals[term], &derivative, i, signal);
            }
        }
        torques.push(u);
        for i in 0..N {
            integral_q_e[i] += H * q_e[i];
            let w = g.omega_rad_per_s[i];
            let pull = w * w * (s.goal[k][i] - reference.0[i]) - 2.0 * g.zeta[i] * w * reference.1[i];
            reference.1[i] += H * pull;
            reference.0[i] += H * reference.1[i];
        }
        for term in 0..4 {
            add(&mut integrals[term], H, &products[term]);
        }
        before = Some((q_e, products));
    }
    torques
}

/// The released code: raw goal; sums without the step; K1 reads the sum of q_e q', which has just been brought up to date.
fn plain_released(g: &MracGains<N>, s: &Sequence) -> Table {
    let rest = vec![0.0; N];
    let mut x_q_e = [0.0; N];
    let (mut x_q, mut x_q_r, mut x_dq_r) = (zeros(), zeros(), zeros());
    let mut torques = Vec::new();
    for k in 0..STEPS {
        let (q, dq, q_r, dq_r) = (&s.q[k], &s.dq[k], &s.goal[k], &rest);
        let q_e = modified_error(g, q, dq, q_r, dq_r);
        let mut u = vec![0.0; N];
        for i in 0..N {
            u[i] += g.alpha[0][i] * q_e[i] + g.alpha[1][i] * x_q_e[i];
            u[i] += row_times(&g.e0, &outer(&q_e, q), &x_q, &zeros(), i, q);
        }
        add(&mut x_q, 1.0, &outer(&q_e, q));
        for i in 0..N {
            u[i] += row_times(&g.e1, &outer(&q_e, dq), &x_q, &zeros(), i, dq);
            u[i] += row_times(&g.f0, &outer(&q_e, q_r), &x_q_r, &zeros(), i, q_r);
            u[i] += row_times(&g.f1, &outer(&q_e, dq_r), &x_dq_r, &zeros(), i, dq_r);
            x_q_e[i] += H * q_e[i];
        }
        add(&mut x_q_r, 1.0, &outer(&q_e, q_r));
        add(&mut x_dq_r, 1.0, &outer(&q_e, dq_r));
        torques.push(u);
    }
    torques
}

fn aic_gains() -> impl Strategy<Value = AicGains<N>> {
    let gain = || three(0.1..20.0);
    (gain(), three(10.0..900.0), gain(), gain(), gain(), gain(), three(0.3..3.0)).prop_map(
        |(kappa_mu, kappa_a, sigma_q, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s)| AicGains {
            kappa_mu,
            kappa_a,
            sigma_q,
            sigma_dq,
            sigma_mu,
            sigma_dmu,
            reference_time_constant_s,
        },
    )
}

/// Gains with derivative terms where the law has them.
fn mrac_gains(law: MracLaw) -> impl Strategy<Value = MracGains<N>> {
    let derivative = if law == MracLaw::ReleasedCode { 0.0 } else { 0.02 };
    let family = move || {
        (three(0.1..40.0), three(0.1..5.0), three(0.0..1.0))
            .prop_map(move |(p, i, d)| [p, i, d.map(|d| d * derivative)])
    };
    let reference = (three(0.5..4.0), three(0.5..1.5), three(0.2..2.0), three(0.2..2.0));
    (reference, family(), family(), family(), family(), family()).prop_map(
        move |((omega_rad_per_s, zeta, l1, l2), alpha, e0, e1, f0, f1)| MracGains {
            law,
            omega_rad_per_s,
            zeta,
            l1,
            l2,
            alpha,
            e0,
            e1,
            f0,
            f1,
        },
    )
}

fn mrac(gains: &MracGains<N>) -> Mrac<N> {
    Mrac::new(&MracParams::new(gains, H).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn active_inference(gains in aic_gains(), sequence in sequence()) {
        let aic = Aic::<N>::new(&AicParams::new(&gains, H).unwrap());
        assert_close(&run(&aic, &sequence), &plain_aic(&gains, &sequence))?;
    }

    #[test]
    fn mrac_with_the_reference_model(gains in mrac_gains(MracLaw::ReferenceModel), sequence in sequence()) {
        assert_close(&run(&mrac(&gains), &sequence), &plain_mrac(&gains, &sequence, true))?;
    }

    #[test]
    fn mrac_on_the_raw_goal(gains in mrac_gains(MracLaw::RawGoal), sequence in sequence()) {
        assert_close(&run(&mrac(&gains), &sequence), &plain_mrac(&gains, &sequence, false))?;
    }

    #[test]
    fn mrac_as_released(gains in mrac_gains(MracLaw::ReleasedCode), sequence in sequence()) {
        assert_close(&run(&mrac(&gains), &sequence), &plain_released(&gains, &sequence))?;
    }
}
