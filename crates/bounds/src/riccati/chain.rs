//! The arm as the recursion sees it: passages from link to link, and the inertia of each link at both ends of its mass.
//!
//! The kinetic energy is `½ sum_i V_i' I_i V_i + ½ sum_i r_i v_i²` with `V_i = Z(q_i) X_i V_{i-1} + z v_i`, `X (w, u) = (R' w, R'(u + w x p))`.
//! Nothing below needs R to be exactly orthogonal.
//!
//! **Which arm is meant.** The numbers of a `Model` are roundings of what somebody meant. The bounds hold for every arm whose frames are
//! rotations and whose numbers are off by at most: masses and positions 2^-48 of their own size; first moments `2^-48 sqrt(m tr I)`;
//! inertias `2^-48 tr I`; rotation entries 2^-48 plus three times the largest entry of `R'R - 1`, and nothing where R holds only
//! 0 and ±1. Each inertia carries an error of [`DATA`] times its largest entry, which is more than that (`tr I <= 3 max`, `sqrt(m tr I) <= 2 max`)
//! plus the rounding of its scale.
//!
//! **Reachable velocities.** The first link only turns about its axis. If the first joints' axes meet in one point (a shoulder), the
//! links up to the last of them only turn about that point, and three coordinates suffice: `V = (w, w x (0, 0, -c))` for a point at
//! `(0, 0, c)` of the link's frame. The test for this is exact: quarter turns and a sum that does not round. Without the
//! restriction, unreachable directions would take part in the Loewner order and spoil the bounds.

use certune_dynamics::LinkConstants;

use super::ball::{Ball, Matrix, ROUNDING, ZERO, largest};
use super::turn::Passage;
use crate::arm_box::ArmBox;

/// Relative error of an inertia or a position: 2^-46, four times what a number of the arm may carry.
const DATA: f64 = 1.0 / (1_u64 << 46) as f64;

/// One link of the chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChainLink {
    /// From the parent; of the first link only `order` counts.
    pub passage: Passage,
    /// The inertia with the least masses.
    pub light: Ball,
    /// The inertia with the greatest masses.
    pub heavy: Ball,
    /// Least rotor inertia, kg m².
    pub rotor: f64,
}

/// An arm with one payload mass, its link masses anywhere in their ranges.
#[derive(Clone, Debug)]
pub(crate) struct Chain<const N: usize> {
    pub links: [ChainLink; N],
}

/// `[w; u] -> wrench` of a body: `[[I, ĥ], [ĥ', m 1]]`, scaled.
fn inertia(link: &LinkConstants, scale: f64) -> Matrix {
    let [xx, yy, zz, xy, xz, yz] = link.about_origin_kg_m2;
    let [x, y, z] = link.first_moment_kg_m;
    let m = link.mass_kg;
    let rows = [
        [xx, xy, xz, 0.0, -z, y],
        [xy, yy, yz, z, 0.0, -x],
        [xz, yz, zz, -y, x, 0.0],
        [0.0, z, -y, m, 0.0, 0.0],
        [-z, 0.0, x, 0.0, m, 0.0],
        [y, -x, 0.0, 0.0, 0.0, m],
    ];
    rows.map(|row| row.map(|value| value * scale))
}

/// The sum of two inertias that each carry the error of their data.
fn plus(a: &Matrix, b: &Matrix) -> Ball {
    let one = |m: &Matrix| Ball { middle: *m, radius: DATA * largest(m) };
    Ball::combination([(1.0, 0.0, &one(a)), (1.0, 0.0, &one(b))])
}

/// `X` of a link: six rows and columns.
fn motion(link: &LinkConstants) -> Ball {
    let (r, [x, y, z]) = (&link.rotation, link.position_m);
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let mut middle = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            middle[i][j] = r[j][i];
            middle[3 + i][3 + j] = r[j][i];
            for k in 0..3 {
                middle[3 + i][j] -= r[k][i] * skew[k][j];
            }
        }
    }
    let size = x.abs().max(y.abs()).max(z.abs());
    let turn = if is_quarter_turn(r) {
        0.0
    } else {
        let mut off = 0.0_f64;
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| r[k][i] * r[k][j]).sum();
                off = off.max((product - f64::from(u8::from(i == j))).abs());
            }
        }
        DATA + 4.0 * off
    };
    Ball { middle, radius: (turn * (1.0 + 3.0 * size) + 3.0 * DATA * size) * 1.000_001 }
}

/// True if every entry is 0, 1 or -1.
fn is_quarter_turn(rotation: &[[f64; 3]; 3]) -> bool {
    #[expect(clippy::float_cmp, reason = "exactness is the question")]
    rotation.iter().flatten().all(|&x| x == 0.0 || x.abs() == 1.0)
}

/// Where the point `(0, 0, at)` of the parent lies on this link's axis, if it does so exactly and whatever the data's errors.
///
/// A zero stays a zero under a relative error, but the difference of two equal heights does not, unless one is `defined` as the other.
fn point_on_axis(link: &LinkConstants, at: f64, defined: bool) -> Option<f64> {
    let [x, y, z] = link.position_m;
    // Knuth's two-sum: `rounding` is exactly what the subtraction lost.
    let difference = at - z;
    let back = difference - at;
    let rounding = (at - (difference - back)) + (-z - back);
    let along = link.rotation[2][0] == 0.0 && link.rotation[2][1] == 0.0;
    let sure = defined || along || (at == 0.0 && z == 0.0);
    if !(is_quarter_turn(&link.rotation) && rounding == 0.0 && sure) {
        return None;
    }
    let seen: [f64; 3] =
        std::array::from_fn(|i| link.rotation[0][i] * -x + link.rotation[1][i] * -y + link.rotation[2][i] * difference);
    (seen[0] == 0.0 && seen[1] == 0.0).then_some(seen[2])
}

/// The twist of a link that turns about `(0, 0, at)`, from its angular velocity: six rows, three columns.
fn about(at: f64) -> Ball {
    let mut middle = ZERO;
    for i in 0..3 {
        middle[i][i] = 1.0;
    }
    // w x (0, 0, -at) = (-at w_y, at w_x, 0).
    middle[3][1] = -at;
    middle[4][0] = at;
    Ball { middle, radius: 3.0 * DATA * at.abs() }
}

/// `a b` with the error of one product of order 6.
fn times(a: &Ball, b: &Ball) -> Ball {
    let mut middle = ZERO;
    for i in 0..6 {
        for j in 0..6 {
            middle[i][j] = (0..6).map(|k| a.middle[i][k] * b.middle[k][j]).sum();
        }
    }
    let (sa, sb) = (largest(&a.middle), largest(&b.middle));
    let radius = 6.0 * (sa * b.radius + sb * a.radius + a.radius * b.radius + ROUNDING * sa * sb) * 1.000_001;
    Ball { middle, radius }
}

/// The leading rows of a matrix, the others zero.
fn rows(a: &Ball, count: usize) -> Ball {
    let mut middle = ZERO;
    middle[..count].copy_from_slice(&a.middle[..count]);
    Ball { middle, radius: a.radius }
}

impl<const N: usize> Chain<N> {
    /// The arm of `arms` with its payload at the lower (0) or upper (1) end.
    pub fn new(arms: &ArmBox<N>, payload_end: usize) -> Self {
        let groups = arms.groups();
        let base = arms.base().link_constants();
        let payload = groups.get(N).map(|group| (group.model.link_constants(), group.scale[payload_end]));
        let rotor = arms.rotor_inertia_kg_m2()[0];
        // The fixed point of a shoulder, as a height on the current axis.
        let mut fixed: Option<f64> = None;
        let mut parent_order = 1;
        let links = std::array::from_fn(|i| {
            let link = &base[i];
            let [light, heavy] = [0, 1].map(|end| {
                let body = inertia(link, groups[i].scale[end]);
                match &payload {
                    Some((bodies, mass)) if i + 1 == N => plus(&body, &inertia(&bodies[i], *mass)),
                    _ => plus(&body, &ZERO),
                }
            });
            let x = motion(link);
            let mut seed = ZERO;
            if i == 0 {
                seed[2][0] = 1.0;
                let column = Ball::exact(seed);
                let reduce = |ball: &Ball| ball.congruence(&column, 6, 1);
                let passage = Passage { y: Ball::exact(ZERO), order: 1, parent_order: 1 };
                return ChainLink { passage, light: reduce(&light), heavy: reduce(&heavy), rotor: rotor[i] };
            }
            // From the parent's coordinates to its twist.
            let (expand, here) = if i == 1 {
                seed[2][0] = 1.0;
                // Any point of the first axis may be the fixed one; that at the second joint's height is tried.
                (Ball::exact(seed), point_on_axis(link, link.position_m[2], true))
            } else {
                (fixed.map_or_else(identity, about), fixed.and_then(|at| point_on_axis(link, at, false)))
            };
            let y = times(&x, &expand);
            let order = if here.is_some() { 3 } else { 6 };
            let passage = Passage { y: rows(&y, order), order, parent_order };
            parent_order = order;
            fixed = here;
            let reduce = |ball: &Ball| here.map_or(*ball, |at| ball.congruence(&about(at), 6, 3));
            ChainLink { passage, light: reduce(&light), heavy: reduce(&heavy), rotor: rotor[i] }
        });
        Self { links }
    }
}

/// The identity.
fn identity() -> Ball {
    let mut middle = ZERO;
    for i in 0..6 {
        middle[i][i] = 1.0;
    }
    Ball::exact(middle)
}
