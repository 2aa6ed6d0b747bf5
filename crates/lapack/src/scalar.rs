//! What the routines need of a number, so that `s` and `d` share their code.

use faer_traits::RealField;

/// `f32` or `f64`.
pub(crate) trait Scalar: RealField + Copy {
    const ZERO: Self;
    const ONE: Self;
    const NAN: Self;

    fn is_finite(self) -> bool;

    fn abs(self) -> Self;

    /// `(s, 1/s)`, both powers of two, with `s * self` in [1, 4) for a normal positive `self`.
    fn power_of_two_scale(self) -> (Self, Self);

    /// The smallest number of this type that is not below `count`: how a workspace query answers.
    fn from_count(count: u64) -> Self;
}

macro_rules! scalar {
    ($float:ident, $bits:ident) => {
        impl Scalar for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const NAN: Self = Self::NAN;

            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }

            fn abs(self) -> Self {
                $float::abs(self)
            }

            fn power_of_two_scale(self) -> (Self, Self) {
                const MANTISSA: u32 = $float::MANTISSA_DIGITS - 1;
                const BIAS: $bits = $float::MAX_EXP as $bits - 1;
                // The clamp keeps both powers normal at the two ends of the range.
                let biased = (self.to_bits() << 1 >> 1 >> MANTISSA).clamp(1, 2 * BIAS - 1);
                ($float::from_bits((2 * BIAS - biased) << MANTISSA), $float::from_bits(biased << MANTISSA))
            }

            fn from_count(count: u64) -> Self {
                let near = count as $float;
                if (near as u64) < count { near.next_up() } else { near }
            }
        }
    };
}

scalar!(f32, u32);
scalar!(f64, u64);

#[cfg(test)]
mod tests {
    use super::Scalar;

    #[test]
    #[expect(clippy::float_cmp, reason = "powers of two multiply exactly")]
    fn the_scale_brings_any_normal_number_near_one() {
        for x in [f64::MIN_POSITIVE, 1e-300, 0.7, 1.0, 3.5, 1e300, f64::MAX] {
            let (down, up) = x.power_of_two_scale();
            assert_eq!(down * up, 1.0, "{x}");
            assert!((1.0..4.0).contains(&(x * down)), "{x}");
            assert_eq!(x * down * up, x);
        }
        for x in [f32::MIN_POSITIVE, 1e-30, 1.0, 3.5, 1e30, f32::MAX] {
            let (down, up) = x.power_of_two_scale();
            assert_eq!(down * up, 1.0, "{x}");
            assert!((1.0..4.0).contains(&(x * down)), "{x}");
        }
        let (down, up) = 5e-324_f64.power_of_two_scale();
        assert!(down.is_finite() && up > 0.0);
    }

    #[test]
    fn a_workspace_size_survives_the_way_through_a_float() {
        for count in [0, 1, 26 * 42, (1 << 24) + 1, (1 << 40) + 3] {
            assert!(f32::from_count(count) as u64 >= count);
            assert!(f64::from_count(count) as u64 == count);
        }
    }
}
