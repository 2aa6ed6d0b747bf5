//! Textbook loops and polytopes under the Lyapunov checker: what is stable is proved, what is not is refused with a matrix.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune_certify::{LinearFamily, LyapunovFailure, LyapunovMatrix, SolveError, fastest_decay, lyapunov};
use certune_verify::{LyapunovClaim, LyapunovWitness, Number, PlaneRegion};
use nalgebra::DMatrix;
use proptest::prelude::*;

fn family(vertices: Vec<DMatrix<f64>>) -> LinearFamily {
    LinearFamily { vertices, configuration_rad: None }
}

fn square(entries: &[f64]) -> DMatrix<f64> {
    let order = (entries.len() as f64).sqrt() as usize;
    DMatrix::from_row_slice(order, order, entries)
}

fn number(x: f64) -> Number {
    Number::decimal(x).unwrap()
}

fn half_plane(rate: f64) -> PlaneRegion {
    PlaneRegion::HalfPlane { rate_per_s: number(rate) }
}

fn disk(centre: f64, radius: f64) -> PlaneRegion {
    PlaneRegion::Disk { centre: number(centre), radius: number(radius) }
}

fn sector(slope: f64) -> PlaneRegion {
    PlaneRegion::Sector { slope: number(slope) }
}

/// `m x'' + d x' + k x = 0`.
fn oscillator(m: f64, d: f64, k: f64) -> DMatrix<f64> {
    square(&[0.0, 1.0, -k / m, -d / m])
}

fn holds(result: Result<LyapunovClaim, LyapunovFailure>) -> bool {
    match result {
        Ok(claim) => {
            assert!(claim.inequalities().unwrap().iter().all(|i| i.smallest_pivot.is_some()));
            true
        }
        Err(_) => false,
    }
}

#[test]
fn a_mass_on_a_spring_decays_at_its_own_rate() {
    // Roots -1 +- 3i.
    let loops = family(vec![oscillator(1.0, 2.0, 10.0)]);
    let claim = fastest_decay(&loops, LyapunovMatrix::Common).unwrap();
    let PlaneRegion::HalfPlane { rate_per_s } = &claim.regions[0] else { panic!("another region") };
    assert!((0.99..1.0).contains(&rate_per_s.to_f64()), "{rate_per_s}");
    assert!(matches!(lyapunov(&loops, &[half_plane(1.001)], LyapunovMatrix::Common), Err(LyapunovFailure::Refused(_))));
    // |Im| = 3 |Re|, |z| = sqrt 10.
    for (region, inside) in [
        (sector(3.1), true),
        (sector(2.9), false),
        (disk(0.0, 3.2), true),
        (disk(0.0, 3.1), false),
        (disk(-1.0, 3.05), true),
        (disk(-1.0, 2.95), false),
    ] {
        assert_eq!(
            holds(lyapunov(&loops, std::slice::from_ref(&region), LyapunovMatrix::Common)),
            inside,
            "{region:?}"
        );
    }
    // All at once, with one P.
    assert!(holds(lyapunov(&loops, &[half_plane(0.9), sector(3.2), disk(0.0, 3.4)], LyapunovMatrix::Common)));
}

fn rate(claim: &LyapunovClaim) -> f64 {
    let PlaneRegion::HalfPlane { rate_per_s } = &claim.regions[0] else { panic!("another region") };
    rate_per_s.to_f64()
}

#[test]
fn the_fastest_decay_is_an_edge_wherever_the_eigenvalues_send_the_search() {
    // (s + 1)^4 in coordinates of unlike sizes: what double precision knows of P stops well before the eigenvalue.
    let defective = DMatrix::from_fn(4, 4, |i, j| if i == j { -1.0 } else { f64::from(u16::from(j == i + 1)) * 1e3 });
    // A common matrix stops short of the eigenvalues: -0.5 both, switching does worse.
    let pair = vec![oscillator(1.0, 1.0, 1.0), oscillator(1.0, 1.0, 1.5)];
    for (loops, at_least, at_most) in [
        (family(vec![defective]), 0.7, 1.0),
        (family(vec![oscillator(1.0, 2.0, 10.0)]), 0.999, 1.0),
        (family(vec![square(&[-2000.0])]), 999.999, 1000.0),
        (family(vec![square(&[-0.0005])]), 0.0, 0.0005),
        (family(pair), 0.2, 0.5),
    ] {
        let claim = fastest_decay(&loops, LyapunovMatrix::Common).unwrap();
        let found = rate(&claim);
        assert!(claim.inequalities().unwrap().iter().all(|i| i.smallest_pivot.is_some()), "{found} is not proved");
        assert!((at_least..=at_most).contains(&found), "{found}");
        // Halving the whole range, which knows nothing of eigenvalues, ends no higher: at the same step, or where double precision first loses P.
        let (mut certified, mut refused) = (0_u32, 1_000_000);
        while refused - certified > 1 {
            let middle = certified.midpoint(refused);
            let region = half_plane(f64::from(middle) / 1e3);
            if holds(lyapunov(&loops, &[region], LyapunovMatrix::Common)) {
                certified = middle
            } else {
                refused = middle
            }
        }
        let halved = f64::from(certified) / 1e3;
        assert!(found > halved - 1e-9 && (loops.vertices[0].nrows() == 4 || found < halved + 1e-9), "{found} {halved}");
    }
    let unstable = fastest_decay(&family(vec![square(&[0.5])]), LyapunovMatrix::Common);
    assert!(matches!(unstable, Err(LyapunovFailure::Refused(_))));
    let unfit = fastest_decay(&family(vec![square(&[f64::NAN])]), LyapunovMatrix::Common);
    assert_eq!(unfit, Err(LyapunovFailure::Matrices));
}

#[test]
fn a_large_polytope_has_a_common_matrix_or_none() {
    // Seven oscillators turned into each other, so that nothing is block diagonal.
    let loops = |stiffness: f64| {
        let mut a = DMatrix::zeros(14, 14);
        for k in 0..7 {
            let damping = 0.4 + 0.1 * k as f64;
            a.view_mut((2 * k, 2 * k), (2, 2)).copy_from(&oscillator(1.0, damping, stiffness));
        }
        let v = DMatrix::from_fn(14, 1, |i, _| 1.0 + 0.1 * i as f64);
        let turn = DMatrix::identity(14, 14) - &v * v.transpose() * (2.0 / v.norm_squared());
        &turn * a * &turn
    };
    let polytope = |stiffness: f64| family(vec![loops(1.0), loops(stiffness)]);
    assert!(holds(lyapunov(&polytope(1.3), &[half_plane(0.0)], LyapunovMatrix::Common)));
    assert!(holds(lyapunov(&polytope(1.3), &[half_plane(0.05), disk(0.0, 1.5)], LyapunovMatrix::Common)));
    // As for one oscillator: switching between 1 and 10 pumps it up.
    assert_eq!(
        lyapunov(&polytope(10.0), &[half_plane(0.0)], LyapunovMatrix::Common),
        Err(LyapunovFailure::NotFound(SolveError::Infeasible))
    );
}

#[test]
fn a_double_integrator_needs_damping() {
    assert!(holds(lyapunov(&family(vec![oscillator(1.0, 0.7, 1.0)]), &[half_plane(0.3)], LyapunovMatrix::Common)));
    for undamped in [oscillator(1.0, 0.0, 1.0), oscillator(1.0, -0.1, 1.0), oscillator(1.0, 1.0, 0.0)] {
        let refused = lyapunov(&family(vec![undamped]), &[half_plane(0.0)], LyapunovMatrix::Common);
        let Err(LyapunovFailure::Refused(claim)) = refused else { panic!("{refused:?}") };
        claim.check().unwrap();
    }
}

#[test]
fn discrete_loops_live_in_the_unit_disk() {
    // Euler steps of a double integrator under PD, h = 1/8 so that nothing rounds: z^2 - (2 - h d) z + 1 - h d + h^2 k.
    let step = |d: f64, k: f64| square(&[1.0, 0.125, -0.125 * k, 1.0 - 0.125 * d]);
    let unit = [disk(0.0, 1.0)];
    assert!(holds(lyapunov(&family(vec![step(2.0, 4.0)]), &unit, LyapunovMatrix::Common)));
    // On the circle (d = h k) and outside.
    for bad in [step(0.5, 4.0), step(0.0, 4.0), step(25.0, 4.0)] {
        let refused = lyapunov(&family(vec![bad]), &unit, LyapunovMatrix::Common);
        assert!(matches!(refused, Err(LyapunovFailure::Refused(_))), "{refused:?}");
    }
    // z = -1 exactly, which the bilinear map sends to infinity.
    let flip = family(vec![square(&[-1.0, 0.0, 0.0, 0.5])]);
    assert!(matches!(lyapunov(&flip, &unit, LyapunovMatrix::Common), Err(LyapunovFailure::Refused(_))));
}

#[test]
fn two_stable_matrices_may_share_no_matrix_and_have_an_unstable_mean() {
    let (a, b) = (square(&[-1.0, 10.0, 0.0, -1.0]), square(&[-1.0, 0.0, 10.0, -1.0]));
    let Err(LyapunovFailure::Refused(claim)) =
        lyapunov(&family(vec![a, b]), &[half_plane(0.0)], LyapunovMatrix::Common)
    else {
        panic!("an unstable mean was not found")
    };
    assert!(claim.weights.iter().all(|w| w.to_f64() < 1.0), "both vertices are stable");
}

#[test]
fn slow_parameters_may_do_what_fast_ones_may_not() {
    // x'' + 0.4 x' + k x with k in [1, 10]: stable for every constant k; switching between the ends pumps it up.
    let loops = family(vec![oscillator(1.0, 0.4, 1.0), oscillator(1.0, 0.4, 10.0)]);
    assert_eq!(
        lyapunov(&loops, &[half_plane(0.0)], LyapunovMatrix::Common),
        Err(LyapunovFailure::NotFound(SolveError::Infeasible))
    );
    let affine = lyapunov(&loops, &[half_plane(0.0)], LyapunovMatrix::Affine).unwrap();
    assert!(matches!(affine.witness, LyapunovWitness::Affine { .. }));
}

/// One joint under the AIC with the published gains, gravity compensated, no friction: states e, dq, m, mu', mu'', u.
fn aic_joint(m: f64) -> DMatrix<f64> {
    let (kappa_mu, kappa_a, b, c) = (11.67, 700.0, 11.67 / 5.0, 11.67 / 10.0);
    #[rustfmt::skip]
    let a = square(&[
        0.0, 1.0, 0.0, 0.0, 0.0, 0.0,
        0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / m,
        kappa_mu, 0.0, -kappa_mu - b, 1.0 - b, 0.0, 0.0,
        0.0, kappa_mu, -b, -kappa_mu - b - c, 1.0 - c, 0.0,
        0.0, 0.0, 0.0, -c, -c, 0.0,
        -kappa_a, -kappa_a, kappa_a, kappa_a, 0.0, 0.0,
    ]);
    a
}

#[test]
fn one_matrix_does_not_cover_the_published_gains_over_inertias_from_0_3_to_1() {
    // 1/m enters linearly: two vertices are the whole interval.
    let loops = |lower: f64, upper: f64| family(vec![aic_joint(lower), aic_joint(upper)]);
    for m in [0.3, 1.0] {
        assert!(holds(lyapunov(&family(vec![aic_joint(m)]), &[half_plane(0.0)], LyapunovMatrix::Common)));
    }
    assert!(holds(lyapunov(&loops(0.95, 1.0), &[half_plane(0.0)], LyapunovMatrix::Common)));
    let common = lyapunov(&loops(0.3, 1.0), &[half_plane(0.0)], LyapunovMatrix::Common);
    println!("{:?}", common.as_ref().err());
    assert!(matches!(common, Err(LyapunovFailure::NotFound(_) | LyapunovFailure::CandidateFailed)));
}

#[test]
fn what_does_not_fit_is_refused() {
    let stable = square(&[-1.0]);
    for bad in [
        family(vec![]),
        family(vec![DMatrix::zeros(1, 2)]),
        family(vec![stable.clone(), square(&[-1.0, 0.0, 0.0, -1.0])]),
        family(vec![square(&[f64::NAN])]),
    ] {
        assert_eq!(lyapunov(&bad, &[half_plane(0.0)], LyapunovMatrix::Common), Err(LyapunovFailure::Matrices));
    }
    assert_eq!(lyapunov(&family(vec![stable]), &[], LyapunovMatrix::Common), Err(LyapunovFailure::Matrices));
}

#[test]
fn no_edit_of_a_proof_passes() {
    let claim =
        lyapunov(&family(vec![oscillator(1.0, 2.0, 10.0)]), &[half_plane(0.9)], LyapunovMatrix::Common).unwrap();
    let fails = |edit: &dyn Fn(&mut LyapunovClaim)| {
        let mut edited = claim.clone();
        edit(&mut edited);
        !edited.inequalities().is_ok_and(|all| all.iter().all(|i| i.smallest_pivot.is_some()))
    };
    assert!(!fails(&|_| ()));
    assert!(fails(&|c| c.regions = vec![half_plane(1.1)]));
    assert!(fails(&|c| c.regions.clear()));
    assert!(fails(&|c| c.polytope.vertices[0][1][1] = number(0.1)));
    assert!(fails(&|c| c.polytope.vertices.clear()));
    assert!(fails(&|c| c.polytope.vertices[0].truncate(1)));
    assert!(fails(&|c| c.witness = LyapunovWitness::Common { p: vec![number(-1.0), number(0.0), number(-1.0)] }));
    assert!(fails(&|c| c.witness = LyapunovWitness::Common { p: vec![number(1.0)] }));
    assert!(fails(&|c| c.witness = LyapunovWitness::Affine { p: Vec::new() }));
}

proptest! {
    // Exact characteristic polynomials of dyadic matrices: a few hundredths of a second each.
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]
    /// Random loops of order up to 15: proved exactly when the eigenvalues say so, away from the boundary.
    #[test]
    fn the_verdict_is_that_of_the_eigenvalues(order in 1_usize..16, seed in prop::collection::vec(-1.0..1.0_f64, 400), shift in -4.0..1.0_f64) {
        let a = DMatrix::from_fn(order, order, |i, j| seed[i * 20 + j] + if i == j { shift } else { 0.0 });
        let rightmost = a.complex_eigenvalues().iter().map(|z| z.re).fold(f64::NEG_INFINITY, f64::max);
        let farthest = a.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max);
        prop_assume!(rightmost.abs() > 0.02 && (farthest - 1.0).abs() > 0.02);
        let loops = family(vec![a]);
        prop_assert_eq!(holds(lyapunov(&loops, &[half_plane(0.0)], LyapunovMatrix::Common)), rightmost < 0.0);
        prop_assert_eq!(holds(lyapunov(&loops, &[disk(0.0, 1.0)], LyapunovMatrix::Common)), farthest < 1.0);
    }
}
