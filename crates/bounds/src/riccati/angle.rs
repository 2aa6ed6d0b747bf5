//! Angles without a trusted library: sine and cosine by Taylor sums with their remainders, and arcs that are surely covered.
//!
//! An [`Arc`] is all angles within `half_width` of a middle angle. What the bounds need of it is an enclosure of the middle's
//! cosine and sine, and a `tau >= tan(half_width / 2)`.
//!
//! For |x| <= 1/2 the Taylor sums of sine and cosine to degree 15 and 14 are off by less than `x^17/17! < 3e-20` and `x^16/16! < 8e-19`; their
//! terms fall so fast that all roundings together stay below `4 u`. A larger angle is divided by 2^k, k <= 4, and doubled back:
//! `(c, s) <- (c² - s², 2 s c)`, each of which at most triples the error of either and adds `4 u`.

/// Error of either coordinate of [`sine_cosine`]: `3^4 * 4 u + 4 u (1 + 3 + 9 + 27) < 4.9e2 u`, rounded up.
pub(crate) const TRIG_ERROR: f64 = 1e-13;

/// All angles within `half_width` of a middle angle, with a little to spare.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    /// Cosine of the middle, within [`TRIG_ERROR`].
    pub cosine: f64,
    /// Sine of the middle, within [`TRIG_ERROR`].
    pub sine: f64,
    /// At least the tangent of half the half-width.
    pub tau: f64,
    /// Half-width, rad; at most 1.
    pub half_width: f64,
}

/// Sine and cosine of an angle of at most 8 rad, each within [`TRIG_ERROR`].
pub(crate) fn sine_cosine(angle: f64) -> (f64, f64) {
    let x = angle / 16.0;
    let square = x * x;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for k in (1..=7).rev() {
        let n = f64::from(2 * k);
        cosine = (1.0 + cosine) * (-square / (n * (n - 1.0)));
        sine = (1.0 + sine) * (-square / (n * (n + 1.0)));
    }
    let (mut c, mut s) = (1.0 + cosine, x * (1.0 + sine));
    for _ in 0..4 {
        (c, s) = (c * c - s * s, 2.0 * s * c);
    }
    (s, c)
}

impl Arc {
    /// The arc around the `index`-th of `2^depth` equal parts of `[lower, upper]`; all parts together cover it.
    ///
    /// Both ends within 8 rad of zero and the part at most 2 rad wide, or nothing is returned.
    pub fn part(lower: f64, upper: f64, depth: u32, index: u64) -> Option<Self> {
        let parts = f64::from(1_u32.checked_shl(depth)?);
        #[expect(clippy::cast_precision_loss, reason = "index < 2^32")]
        let place = (2 * index + 1) as f64;
        let width = upper - lower;
        let middle = lower + width * place / (2.0 * parts);
        // The roundings of the middle and of the width stay below 8 u * 16 rad.
        let half_width = width / (2.0 * parts) * (1.0 + 1e-12) + 1e-13;
        if !(lower.abs() <= 8.0 && upper.abs() <= 8.0 && half_width <= 1.0) {
            return None;
        }
        let (sine, cosine) = sine_cosine(middle);
        let (half_sine, half_cosine) = sine_cosine(0.5 * half_width);
        // Cosine >= 0.87 here, so that the quotient is off by less than 3 TRIG_ERROR.
        let tau = half_sine / half_cosine + 4.0 * TRIG_ERROR;
        Some(Self { cosine, sine, tau, half_width })
    }
}
