//! Numbers, directions and gains by chance, from one stream a subject.

use certune::control::aic::AicGains;
use certune::linsys::Joints;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

pub fn stream(seed: u64, index: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    rng
}

pub fn uniform(rng: &mut ChaCha8Rng, lower: f64, upper: f64) -> f64 {
    lower + (upper - lower) * ((rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53))
}

pub fn log_uniform(rng: &mut ChaCha8Rng, lower: f64, upper: f64) -> f64 {
    uniform(rng, lower.ln(), upper.ln()).exp()
}

/// Three digits, as a person would write them.
pub fn short(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap()
}

pub fn pick<T: Copy>(rng: &mut ChaCha8Rng, choices: &[T]) -> T {
    choices[(rng.next_u64() % choices.len() as u64) as usize]
}

/// A normal number: the sum of twelve uniform ones is near enough for directions.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| uniform(rng, -0.5, 0.5)).sum()
}

pub fn vector<const N: usize>(rng: &mut ChaCha8Rng) -> Joints<N> {
    Joints::from_fn(|_, _| normal(rng))
}

pub fn direction<const N: usize>(rng: &mut ChaCha8Rng) -> Joints<N> {
    vector::<N>(rng).normalize()
}

pub fn angles<const N: usize>(rng: &mut ChaCha8Rng) -> Joints<N> {
    Joints::from_fn(|_, _| uniform(rng, -3.1, 3.1))
}

pub fn gains<const N: usize>(rng: &mut ChaCha8Rng) -> AicGains<N> {
    let mut gain = |lower: f64, upper: f64| short(log_uniform(rng, lower, upper));
    AicGains {
        kappa_mu: [gain(2.0, 200.0); N],
        kappa_a: [gain(50.0, 2e4); N],
        sigma_q: [1.0; N],
        sigma_dq: [gain(0.1, 4.0); N],
        sigma_mu: [gain(0.5, 50.0); N],
        sigma_dmu: [gain(0.5, 50.0); N],
        reference_time_constant_s: [gain(0.4, 2.0); N],
    }
}
