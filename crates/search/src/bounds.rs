//! From all of ℝ to the interval `[0, 1]`, smoothly.
//!
//! CMA-ES samples a Gaussian, which knows no bounds. Clipping its samples to
//! the box would bias what it learns; refusing those outside wastes most of
//! them when the optimum lies in a corner; a penalty needs a weight. Instead
//! the search lives in an unbounded space and [`fold`] maps it onto the box,
//! coordinate by coordinate:
//!
//! * between `MARGIN` and `1 - MARGIN` it is the identity, so that inside the
//!   box the search sees the objective as it is;
//! * over the last `MARGIN` a parabola slows it to rest on the bound, which it
//!   reaches `MARGIN` beyond. An objective that still slopes at an active
//!   bound, the usual case, thereby gets an ordinary quadratic minimum there.
//!   (A plain reflection would leave a kink, `|u|`, and the axis ratio would
//!   have to grow without limit as the search closes in.);
//! * beyond that it is mirrored, with period `2 (1 + 2 MARGIN)`: there is no
//!   plateau in which to get lost.
//!
//! The parabola bends whatever valley runs into it, so it had better be narrow:
//! on rotated ellipsoids and discuses in 5 and 10 dimensions a margin of 0.05
//! costs CMA-ES 15 to 35 % more evaluations than one of 0.02, and one of 0.1
//! twice that. With 0.01 these gain a little more, and what an active bound
//! costs in 2 dimensions begins to grow.
//!
//! The map is continuously differentiable and every point of the box, bounds
//! included, is reached.

/// The width of the parabolic part, on either side of a bound.
const MARGIN: f64 = 0.02;

/// Maps a real number into `[0, 1]`.
pub(crate) fn fold(u: f64) -> f64 {
    let u = mirror(u);
    let x = if u < MARGIN {
        (u + MARGIN).powi(2) / (4.0 * MARGIN)
    } else if u > 1.0 - MARGIN {
        1.0 - (1.0 + MARGIN - u).powi(2) / (4.0 * MARGIN)
    } else {
        u
    };
    x.clamp(0.0, 1.0)
}

/// The one `u` in `[-MARGIN, 1 + MARGIN]` that [`fold`] maps to `x`.
pub(crate) fn unfold(x: f64) -> f64 {
    if x < MARGIN {
        2.0 * (MARGIN * x).sqrt() - MARGIN
    } else if x > 1.0 - MARGIN {
        1.0 + MARGIN - 2.0 * (MARGIN * (1.0 - x)).sqrt()
    } else {
        x
    }
}

/// Mirrors a real number into `[-MARGIN, 1 + MARGIN]`, where it is left alone.
fn mirror(u: f64) -> f64 {
    if (-MARGIN..=1.0 + MARGIN).contains(&u) {
        return u;
    }
    let width = 1.0 + 2.0 * MARGIN;
    let phase = (u + MARGIN).rem_euclid(2.0 * width);
    phase.min(2.0 * width - phase) - MARGIN
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn folding_stays_in_the_box(u in -1e6..1e6) {
            prop_assert!((0.0..=1.0).contains(&fold(u)));
        }

        #[test]
        fn unfolding_inverts_folding(x in 0.0..=1.0) {
            prop_assert!((fold(unfold(x)) - x).abs() < 1e-15);
        }

        #[test]
        fn folding_never_stretches(u in -3.0..3.0, v in -3.0..3.0) {
            prop_assert!((fold(u) - fold(v)).abs() <= (u - v).abs() + 1e-15);
        }

        #[test]
        fn folding_is_even_about_the_preimage_of_a_bound(t in 0.0..2.0) {
            prop_assert!((fold(-MARGIN - t) - fold(-MARGIN + t)).abs() < 1e-14);
            prop_assert!((fold(1.0 + MARGIN - t) - fold(1.0 + MARGIN + t)).abs() < 1e-14);
        }
    }

    #[test]
    fn the_bounds_are_reached_exactly() {
        let same = |a: f64, b: f64| assert_eq!(a.to_bits(), b.to_bits());
        same(fold(unfold(0.0)), 0.0);
        same(fold(unfold(1.0)), 1.0);
        same(fold(0.5), 0.5);
    }
}
