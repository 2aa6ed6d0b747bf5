//! Contract: on every instruction set of this machine each lane holds what the number alone would give.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use certune_linsys::{hyperbolic, trig};
use certune_simd::{InstructionSet, Kernel, Lanes};
use proptest::prelude::*;

/// The operations of the scalar, each on two numbers a lane.
struct Operations<'a>(&'a [f64], &'a [f64]);

type Rows = Vec<(&'static str, Vec<f64>)>;

impl Kernel for Operations<'_> {
    type Output = Rows;
    #[inline(always)]
    fn run<T: Lanes>(self) -> Rows {
        let mut rows: Rows = Vec::new();
        let count = self.0.len();
        for start in (0..count).step_by(T::LANES) {
            let load = |from: &[f64]| T::from_lanes(|lane| from[(start + lane) % count]);
            let (a, b) = (load(self.0), load(self.1));
            let (sine, cosine) = a.sin_cos();
            let results = [
                ("sum", a + b),
                ("difference", a - b),
                ("product", a * b),
                ("quotient", a / b),
                ("negative", -a),
                ("root", a.abs().sqrt()),
                ("size", a.abs()),
                ("clamped", a.clamp_symmetric(b.abs())),
                ("tanh", a.tanh()),
                ("chosen", a.choose(b, T::one(), T::from_f64(2.0))),
                ("sine", sine),
                ("cosine", cosine),
                ("fused", a.mul_add(b, T::one())),
            ];
            for (row, (name, value)) in results.into_iter().enumerate() {
                if rows.len() <= row {
                    rows.push((name, Vec::new()));
                }
                rows[row].1.extend((0..T::LANES).map(|lane| value.lane(lane)));
            }
        }
        for row in &mut rows {
            row.1.truncate(count);
        }
        rows
    }
}

fn assert_agree(a: &[f64], b: &[f64]) {
    let plain = InstructionSet::Plain.run(Operations(a, b));
    for set in InstructionSet::available() {
        for ((name, expected), (_, found)) in plain.iter().zip(set.run(Operations(a, b))) {
            for (lane, (expected, found)) in expected.iter().zip(found).enumerate() {
                let size = match *name {
                    // Polynomials with and without a fused multiply-add.
                    "sine" | "cosine" => 2.0 * trig::ERROR,
                    "tanh" => hyperbolic::ERROR,
                    "fused" => (1.0 + (a[lane] * b[lane]).abs()) * f64::EPSILON,
                    _ => 0.0,
                };
                let same = expected.to_bits() == found.to_bits() || (expected.is_nan() && found.is_nan());
                let near = (expected - found).abs() <= size;
                assert!(same || near, "{set:?}: {name} of {} and {}: {expected} against {found}", a[lane], b[lane]);
            }
        }
    }
}

#[test]
fn odd_numbers_are_treated_alike() {
    let odd = [0.0, -0.0, 1.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300, 1e-310, 2e5, -3e7, 0.5];
    for shift in 0..odd.len() {
        let mut other = odd;
        other.rotate_left(shift);
        assert_agree(&odd, &other);
    }
}

proptest! {
    #[test]
    fn a_lane_is_the_number_alone(pairs in proptest::collection::vec((-1e3..1e3_f64, -1e3..1e3_f64), 1..20)) {
        let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        assert_agree(&a, &b);
    }

    #[test]
    fn a_result_does_not_depend_on_the_lane(a in -10.0..10.0_f64, b in -10.0..10.0_f64, others in proptest::collection::vec(-10.0..10.0_f64, 8)) {
        for set in InstructionSet::available() {
            let at = |place: usize| {
                let (mut left, mut right) = (others.clone(), others.clone());
                (left[place], right[place]) = (a, b);
                set.run(Operations(&left, &right)).iter().map(|(_, row)| row[place].to_bits()).collect::<Vec<_>>()
            };
            for place in 1..8 {
                prop_assert_eq!(at(0), at(place));
            }
        }
    }
}

/// Ten million sines and cosines.
struct Trig;

impl Kernel for Trig {
    type Output = f64;
    #[inline(always)]
    fn run<T: Lanes>(self) -> f64 {
        let mut worst = 0.0_f64;
        let mut index = 0_u32;
        while index < 10_000_000 {
            let x = T::from_lanes(|lane| {
                let share = (f64::from(index + u32::try_from(lane).unwrap()) * 0.618_033_988_749_894_9).fract();
                [1.0, 4.0, 30.0, trig::LIMIT_RAD][(index / 64 % 4) as usize] * (2.0 * share - 1.0)
            });
            let (sine, cosine) = x.sin_cos();
            for lane in 0..T::LANES {
                let (exact_sine, exact_cosine) = x.lane(lane).sin_cos();
                worst = worst.max((sine.lane(lane) - exact_sine).abs()).max((cosine.lane(lane) - exact_cosine).abs());
            }
            index += u32::try_from(T::LANES).unwrap();
        }
        worst
    }
}

#[test]
fn sines_and_cosines_in_lanes_are_within_their_bound() {
    // The library's own error is below one unit of the last place.
    for set in InstructionSet::available() {
        let worst = set.run(Trig);
        assert!(worst <= trig::ERROR + f64::EPSILON / 2.0 && worst > 0.1 * trig::ERROR, "{set:?}: {worst:e}");
    }
}
