//! What can be wrong with a box or with the options of a search.

use thiserror::Error;

/// A range or an option that describes nothing, with the number that says so.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum BoundsError {
    /// The relative uncertainty of the link masses is outside `[0, 1)`: at 1 a link could be massless.
    #[error("mass uncertainty is {value}, expected 0 <= uncertainty < 1 (0.2 means +-20 %)")]
    MassUncertainty {
        /// The fraction given.
        value: f64,
    },
    /// An interval of masses that is not `0 <= lower <= upper < infinity`.
    #[error("payload is {lower} to {upper} kg, expected 0 <= lower <= upper, both finite")]
    Payload {
        /// Lower end, kg.
        lower: f64,
        /// Upper end, kg.
        upper: f64,
    },
    /// A coordinate of the payload's centre of mass that is not finite.
    #[error("payload position has coordinate {axis} = {value} m, expected a finite number")]
    PayloadPosition {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// The coordinate, m.
        value: f64,
    },
    /// An interval of rotor inertias that is not `0 <= lower <= upper < infinity`.
    #[error("rotor inertia of joint {joint} is {lower} to {upper} kg m^2, expected 0 <= lower <= upper, both finite")]
    RotorInertia {
        /// Joint, counted from 1 at the base.
        joint: usize,
        /// Lower end, kg m².
        lower: f64,
        /// Upper end, kg m².
        upper: f64,
    },
    /// A range of a joint's angle that is not a finite, ordered interval.
    #[error("joint {joint} is {lower} to {upper} rad, expected lower <= upper, both finite")]
    ConfigurationBox {
        /// Joint, counted from 1 at the base.
        joint: usize,
        /// Lower end, rad.
        lower: f64,
        /// Upper end, rad.
        upper: f64,
    },
    /// The margin is negative, infinite or not a number.
    #[error("margin is {value}, expected a finite number >= 0 (0.05 means 5 %)")]
    Margin {
        /// The fraction given.
        value: f64,
    },
    /// A search without a single sample.
    #[error("samples is 0, expected at least 1")]
    Samples,
    /// A list of scales or coordinates that does not match the box.
    #[error("{given} numbers given, the box has {expected}")]
    Length {
        /// Numbers given.
        given: usize,
        /// Numbers expected.
        expected: usize,
    },
    /// A body whose second moments are not positive semidefinite, or not provably so: the convexity that polygons rest on fails.
    #[error("link {link}: second moments of its body (payload included) are not provably positive semidefinite")]
    SecondMoments {
        /// Link, counted from 1 at the base.
        link: usize,
    },
    /// An interval of angles that is not ordered, or beyond what the enclosures of sine and cosine are made for.
    #[error(
        "angles of joint {joint} are {lower} to {upper} rad, expected lower <= upper, both within +-15 or a full turn"
    )]
    Angles {
        /// Joint, counted from 1 at the base.
        joint: usize,
        /// Lower end, rad.
        lower: f64,
        /// Upper end, rad.
        upper: f64,
    },
    /// Too few corners to enclose a circle or an arc, or too few angles for a polynomial of degree 2.
    #[error("{given} pieces for one joint, expected at least {least}")]
    Pieces {
        /// Pieces given.
        given: usize,
        /// Fewest that do.
        least: usize,
    },
    /// A weight of the diagonal bound that is not positive and finite.
    #[error("weight of the diagonal bound is {value}, expected a positive, finite number")]
    Weight {
        /// The weight.
        value: f64,
    },
    /// Enclosures of sine and cosine that came out too wide; a fault of the arithmetic, not of the input.
    #[error("enclosure of a sine or cosine is {width} wide, expected at most 2^-42")]
    Enclosure {
        /// Its width.
        width: f64,
    },
    /// A bound that could not be proved with the boxes allowed, or is false.
    #[error("joint {joint} (0: the inertia): bound {claim} not proved within {boxes} boxes of angles")]
    NotProved {
        /// Joint whose Coriolis constant it is, counted from 1 at the base; 0 for a bound of the inertia.
        joint: usize,
        /// The bound tried.
        claim: f64,
        /// Boxes allowed.
        boxes: u64,
    },
    /// A number of a plan that no proof can start from: negative, not finite, or 0 where it divides.
    #[error("{parameter} of joint {joint} is {value}, expected a finite number >= 0, and > 0 for what k_m divides by")]
    Candidate {
        /// Which number of the plan.
        parameter: &'static str,
        /// Joint, counted from 1 at the base.
        joint: usize,
        /// The number.
        value: f64,
    },
    /// An axis of a search that is not a finite, ordered interval.
    #[error("search axis {axis} is {lower} to {upper}, expected lower <= upper, both finite")]
    Axis {
        /// Its index, from 0.
        axis: usize,
        /// Lower end.
        lower: f64,
        /// Upper end.
        upper: f64,
    },
}

/// True for `0 <= lower <= upper < infinity`; NaN fails.
pub(crate) fn is_range(range: [f64; 2]) -> bool {
    range[0] >= 0.0 && range[0] <= range[1] && range[1].is_finite()
}
