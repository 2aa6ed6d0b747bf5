//! A false certificate is the worst defect this workspace could have. So: random arms, families and gains, and whatever is
//! certified is attacked.
//!
//! - Every certified rate is compared with eigenvalues of linearised loops of random members of the family.
//! - Every certified region is attacked in time: random members of the family start at rest on the boundary of the ball, the
//!   nonlinear continuous-time loop is integrated (Runge-Kutta 4), and the certificate's own V must start at most at 1 and fall as claimed.
//! - Every certified region is attacked in space: a local search climbs towards a state where V falls too slowly.
//! - A certified goal speed is attacked by goals that flee, a certified bound on the error by noise that knows V.
//! - Every claim about the sampled loop is compared with eigenvalues at every whole delay it covers; a sampled region with the controller's own code,
//!   its torque held and late, and a finely integrated arm.
//! - Every refusal must name a point where the loop is unstable, an attainable one with an unstable arm.
//!
//! `CERTUNE_HUNT_SECONDS=3600` hunts for an hour; without it the hunt is a fixed number of rounds.
#![expect(clippy::unwrap_used, reason = "test helpers")]

mod attacks;
mod chance;
mod continuous;
mod held;
mod limits;
mod members;
mod moving;
mod subjects;

use std::time::{Duration, Instant};

use certune::Request;
use certune::verify::ClaimKind;
use rayon::prelude::*;

use attacks::{Tally, attack};
use chance::pick;
use subjects::{Subject, effort};

const SEED: u64 = 0xCE27;
/// Rounds when no time is given; each questions the Panda and one serial arm of 2 to 7 joints.
const ROUNDS: u64 = 8;
/// Gain sets that one subject is questioned with.
const GAIN_SETS: u64 = 24;

fn question<const N: usize>(subject: &Subject<N>, stream: u64) -> Tally {
    let sets: Vec<Tally> = (0..GAIN_SETS)
        .into_par_iter()
        .map(|set| {
            let mut rng = chance::stream(SEED ^ 0x5EED, stream * GAIN_SETS + set);
            let gains = chance::gains::<N>(&mut rng);
            let claims: &[ClaimKind] = match set % 12 {
                1 | 2 => &[ClaimKind::JointRegion],
                3 => &[ClaimKind::SampledRegion],
                4 => &[ClaimKind::MovingGoal],
                5 | 6 => &[ClaimKind::Sampled],
                _ => &[ClaimKind::Exponential, ClaimKind::Region],
            };
            let delay_samples = pick(&mut rng, &[0, 1, 2]);
            let request = Request { claims: claims.to_vec(), effort: effort(delay_samples), ..Request::default() };
            let certificate = subject.certifier.answer(&gains.into(), &request).unwrap().certificate;
            attack(subject, &certificate, &gains, &mut rng)
        })
        .collect();
    sets.into_iter().fold(Tally::default(), |mut sum, tally| {
        sum += tally;
        sum
    })
}

fn round(index: u64) -> Tally {
    let mut tally = question(&Subject::panda(SEED, 2 * index), 2 * index);
    let stream = 2 * index + 1;
    tally += match index % 6 {
        0 => question(&Subject::<2>::serial(SEED, stream), stream),
        1 => question(&Subject::<3>::serial(SEED, stream), stream),
        2 => question(&Subject::<4>::serial(SEED, stream), stream),
        3 => question(&Subject::<5>::serial(SEED, stream), stream),
        4 => question(&Subject::<6>::serial(SEED, stream), stream),
        _ => question(&Subject::<7>::serial(SEED, stream), stream),
    };
    tally
}

#[test]
fn no_certificate_is_contradicted() {
    let seconds = std::env::var("CERTUNE_HUNT_SECONDS").ok().map(|text| text.parse::<u64>().unwrap());
    let started = Instant::now();
    let mut total = Tally::default();
    let mut rounds = 0;
    while seconds.map_or(rounds < ROUNDS, |limit| started.elapsed() < Duration::from_secs(limit)) {
        total += round(rounds);
        rounds += 1;
        if rounds % 20 == 0 {
            println!("after {rounds} rounds, {:.0} s: {total:?}", started.elapsed().as_secs_f64());
        }
    }
    println!("{rounds} rounds: {total:?}, none contradicted");
    // A hunt without prey would prove nothing.
    assert!(total.rates > 50 && total.regions > 50 && total.refusals > 20);
}
