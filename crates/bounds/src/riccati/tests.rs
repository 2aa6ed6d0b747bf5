//! The parts against direct computation, and the whole against sampling and climbing.

use certune_dynamics::{
    Frame, Inertia, JointLimits, Link, Model, Robot, mass_matrix_as_described, mass_matrix_derivatives,
};
use certune_linsys::{JointMatrix, Joints};

use super::angle::{Arc, TRIG_ERROR, sine_cosine};
use super::ball::{Ball, Matrix, ORDER, ZERO, eigen};
use super::chain::Chain;
use super::forms::{Form, Verdict, test};
use super::plan::{Ladder, Proving, intervals};
use super::turn::{Passage, below_arc};
use super::{RiccatiBounds, riccati_bounds, riccati_bounds_with};
use crate::eigen::symmetric_eigen;
use crate::rigorous::{AngleSet, Effort};
use crate::{ArmBox, Ranges};

/// Seconds, not minutes: what a test can afford.
const SMALL: Ladder = Ladder { budget: 3_000, ratios: &[3.0, 1.6, 1.25, 1.1, 1.03] };

fn bounds<const N: usize>(arms: &ArmBox<N>, set: &AngleSet<N>) -> RiccatiBounds {
    Proving::new(arms, &intervals(set).unwrap(), &|_| {}).search(SMALL).unwrap()
}

/// Draws from `[0, 1)`: a fixed sequence from a seed.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        #[expect(clippy::cast_precision_loss, reason = "53 bits")]
        let x = (self.0 >> 11) as f64;
        x / 9_007_199_254_740_992.0
    }

    fn within(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.next()
    }

    fn symmetric(&mut self) -> Matrix {
        let mut a = ZERO;
        for i in 0..ORDER {
            for j in 0..=i {
                a[i][j] = self.within(-1.0, 1.0);
                a[j][i] = a[i][j];
            }
        }
        a
    }
}

fn panda(ranges: &Ranges) -> ArmBox<7> {
    ArmBox::new(&Model::new(&Robot::panda()).unwrap(), ranges).unwrap()
}

/// An arm of boxes at odd places; quarter turns or any.
fn odd_arm<const N: usize>(draws: &mut Draws) -> Model<N> {
    let links = (0..N)
        .map(|i| {
            let any = draws.next() < 0.5;
            let turn = |x: f64| if any { 3.0 * x } else { (4.0 * x).floor() * std::f64::consts::FRAC_PI_2 };
            let rpy = [0; 3].map(|_| turn(draws.next()));
            let xyz = [0; 3].map(|_| if draws.next() < 0.4 { 0.0 } else { draws.within(-0.4, 0.4) });
            let mass_kg = draws.within(0.3, 4.0);
            let sides = [0; 3].map(|_| draws.within(0.05, 0.3));
            let [a, b, c] = sides.map(|s: f64| mass_kg * s * s / 12.0);
            Link {
                name: format!("link {i}"),
                joint_name: format!("joint {i}"),
                frame: Frame::from_rpy(xyz, rpy),
                inertia: Inertia {
                    mass_kg,
                    com_m: [0; 3].map(|_| draws.within(-0.2, 0.2)),
                    about_com_kg_m2: [b + c, a + c, a + b, 0.0, 0.0, 0.0],
                },
                limits: JointLimits::NONE,
                rotor_inertia_kg_m2: 0.0,
                viscous_n_m_s_per_rad: 0.0,
                coulomb_n_m: 0.0,
            }
        })
        .collect();
    Model::new(&Robot::new("odd", [0.0, 0.0, -9.81], links).unwrap()).unwrap()
}

/// The tested form as a matrix, by the recursions of another crate.
fn direct<const N: usize>(model: &Model<N>, form: &Form<N>, q: &Joints<N>) -> JointMatrix<N> {
    let m = mass_matrix_as_described(model, q);
    match form {
        Form::Inertia(diagonal) => m - JointMatrix::from_diagonal(&Joints::from_column_slice(diagonal)),
        Form::Coriolis { joint, k, sign } => m + mass_matrix_derivatives(model, q)[*joint] * (-0.5 * sign / k),
    }
}

/// The largest modulus of an eigenvalue of `½ M^-½ D M^-½`.
fn relative<const N: usize>(m: &JointMatrix<N>, d: &JointMatrix<N>) -> f64 {
    let l = m.cholesky().unwrap().l();
    let half = l.solve_lower_triangular(d).unwrap();
    let scaled: JointMatrix<N> = l.solve_lower_triangular(&half.transpose()).unwrap();
    0.5 * symmetric_eigen(&scaled).values.amax()
}

#[test]
fn sines_and_cosines_are_within_their_error_of_the_library_s() {
    let mut draws = Draws(3);
    for _ in 0..100_000 {
        let angle = draws.within(-8.0, 8.0);
        let (s, c) = sine_cosine(angle);
        assert!((s - angle.sin()).abs() <= 0.1 * TRIG_ERROR && (c - angle.cos()).abs() <= 0.1 * TRIG_ERROR, "{angle}");
    }
}

#[test]
fn parts_of_an_interval_cover_it() {
    let (lower, upper) = (-2.8973, 3.7525);
    for depth in 3..12 {
        let mut reached = lower;
        for index in 0..1_u64 << depth {
            let arc = Arc::part(lower, upper, depth, index).unwrap();
            let middle = arc.sine.atan2(arc.cosine);
            let middle = middle + std::f64::consts::TAU * ((reached - middle) / std::f64::consts::TAU).round();
            assert!(middle - arc.half_width <= reached, "gap before part {index}");
            reached = middle + arc.half_width - 1e-15;
            assert!(arc.tau >= (0.5 * arc.half_width).tan());
        }
        assert!(reached >= upper);
    }
    assert!(Arc::part(lower, upper, 0, 0).is_none(), "too wide");
}

#[test]
fn the_matrix_below_an_arc_is_below_it() {
    let mut draws = Draws(11);
    let mut widest = 0.0_f64;
    for case in 0..2_000 {
        let order = [6, 6, 3][case % 3];
        let parent_order = if order == 3 { 3 } else { [6, 3, 1][(case / 3) % 3] };
        let mut b = draws.symmetric();
        let mut y = draws.symmetric();
        for i in 0..ORDER {
            for j in 0..ORDER {
                if i >= order || j >= parent_order {
                    y[i][j] = 0.0;
                }
                if i >= order || j >= order {
                    b[i][j] = 0.0;
                }
            }
        }
        let mut weight = draws.symmetric();
        for (i, row) in weight.iter_mut().enumerate() {
            row[i] += 6.0;
        }
        let middle = draws.within(-3.0, 3.0);
        let half_width = if case % 7 == 0 { 0.0 } else { draws.within(1e-6, 1.0) };
        let (sine, cosine) = sine_cosine(middle);
        let tau = (0.5 * half_width).tan() * (1.0 + 1e-15);
        let arc = Arc { sine, cosine, tau, half_width };
        let passage = Passage { y: Ball::exact(y), order, parent_order };
        let (bound, cost) = below_arc(&Ball::exact(b), &arc, &passage, &weight).unwrap();
        widest = widest.max(half_width);
        assert!(cost >= -1e-9);
        for step in 0..=40 {
            let angle = middle + half_width * (f64::from(step) / 20.0 - 1.0);
            let (s, c) = angle.sin_cos();
            let mut z = ZERO;
            for p in [0, 3] {
                (z[p][p], z[p][p + 1], z[p + 1][p], z[p + 1][p + 1], z[p + 2][p + 2]) = (c, s, -s, c, 1.0);
            }
            let mut gap = ZERO;
            for i in 0..parent_order {
                for j in 0..parent_order {
                    let mut sum = -bound[i][j];
                    for k in 0..order {
                        for l in 0..order {
                            let zy = |r: usize, col: usize| (0..order).map(|t| z[r][t] * y[t][col]).sum::<f64>();
                            sum += zy(k, i) * b[k][l] * zy(l, j);
                        }
                    }
                    gap[i][j] = sum;
                }
            }
            let (values, _) = eigen(&gap, parent_order);
            let least = values.iter().take(parent_order).copied().fold(f64::INFINITY, f64::min);
            assert!(least >= -1e-12, "case {case}, angle {angle}: {least}");
        }
    }
    assert!(widest > 0.9);
}

#[test]
fn definiteness_is_refused_as_soon_as_rounding_could_hide_its_loss() {
    // diag(1, 1, 1) minus a rank-one matrix that touches zero: v v' with |v| = 1.
    let mut a = ZERO;
    let v = [0.6, 0.0, 0.8];
    for i in 0..3 {
        for j in 0..3 {
            a[i][j] = f64::from(u8::from(i == j)) - v[i] * v[j];
        }
    }
    assert!(!Ball::exact(a).dominates(&ZERO, 3), "exactly singular but for rounding");
    for i in 0..3 {
        a[i][i] += 1e-12;
    }
    assert!(Ball::exact(a).dominates(&ZERO, 3));
    assert!(
        !Ball { middle: a, radius: 1e-12 }.dominates(&ZERO, 3),
        "an error of 1e-12 an entry could make it indefinite"
    );
    a[1][0] = f64::NAN;
    assert!(!Ball::exact(a).dominates(&ZERO, 3));
}

/// A box of no width: the verdict is that of the eigenvalues. A box of some width: positive only if it is so everywhere.
fn agrees<const N: usize>(model: &Model<N>, arms: &ArmBox<N>, draws: &mut Draws, boxes: usize) -> usize {
    let chain = Chain::new(arms, 0);
    let mut positive = 0;
    for case in 0..boxes {
        let q = Joints::<N>::from_fn(|_, _| draws.within(-3.0, 3.0));
        let m = mass_matrix_as_described(model, &q);
        let joint = 1 + case % (N - 1);
        let (truth, form): (f64, &dyn Fn(f64) -> Form<N>) = if case % 3 == 0 {
            (symmetric_eigen(&m).values.min(), &|x| Form::Inertia([x; N]))
        } else {
            let sign = if case % 2 == 0 { 1.0 } else { -1.0 };
            let truth = relative(&m, &mass_matrix_derivatives(model, &q)[joint]);
            (truth, &move |k| Form::Coriolis { joint, k, sign })
        };
        let arc = |x: f64, half_width: f64| {
            let (sine, cosine) = sine_cosine(x);
            Arc { sine, cosine, tau: (0.5 * half_width).tan() * (1.0 + 1e-14), half_width }
        };
        let point: [Arc; N] = std::array::from_fn(|i| arc(q[i], 0.0));
        for factor in [0.98, 1.02] {
            let candidate = form(truth * factor);
            let least = symmetric_eigen(&direct(model, &candidate, &q)).values.min();
            let verdict = test(&chain, &candidate, &point);
            if least.abs() > 1e-9 {
                assert_eq!(
                    matches!(verdict, Verdict::Positive),
                    least > 0.0,
                    "{candidate:?} at {q:?}: {least}, {verdict:?}"
                );
            }
        }
        let loose = if case % 3 == 0 { draws.within(0.3, 0.9) } else { draws.within(1.02, 1.6) };
        let candidate = form(truth * loose);
        let widths: [f64; N] = std::array::from_fn(|_| draws.next().powi(3) * 0.4);
        let arcs: [Arc; N] = std::array::from_fn(|i| arc(q[i], widths[i]));
        if matches!(test(&chain, &candidate, &arcs), Verdict::Positive) {
            positive += 1;
            for trial in 0..40 {
                let at = Joints::<N>::from_fn(|i, _| {
                    let x = draws.within(-1.0, 1.0);
                    q[i] + widths[i] * if trial % 2 == 0 { x.signum() } else { x }
                });
                let least = symmetric_eigen(&direct(model, &candidate, &at)).values.min();
                assert!(least > 0.0, "{candidate:?} at {at:?} in a box around {q:?}: {least}");
            }
        }
    }
    positive
}

#[test]
fn the_recursion_agrees_with_eigenvalues_at_points_and_never_promises_too_much_over_boxes() {
    let mut draws = Draws(5);
    let model = Model::new(&Robot::panda()).unwrap();
    let positive = agrees(&model, &panda(&Ranges::nominal()), &mut draws, 600);
    assert!(positive > 50, "{positive}");
    let mut positive = 0;
    for _ in 0..12 {
        let two = odd_arm::<2>(&mut draws);
        positive += agrees(&two, &ArmBox::nominal(&two).unwrap(), &mut draws, 40);
        let three = odd_arm::<3>(&mut draws);
        positive += agrees(&three, &ArmBox::nominal(&three).unwrap(), &mut draws, 40);
        let five = odd_arm::<5>(&mut draws);
        positive += agrees(&five, &ArmBox::nominal(&five).unwrap(), &mut draws, 40);
    }
    assert!(positive > 200, "{positive}");
}

/// How far a configuration of an arm comes towards each bound: at most 1 in every entry.
fn use_of_bounds<const N: usize>(
    model: &Model<N>,
    bounds: &RiccatiBounds,
    q: &Joints<N>,
    starts: &[Joints<N>],
) -> Vec<f64> {
    let m = mass_matrix_as_described(model, q);
    let d = mass_matrix_derivatives(model, q);
    let diagonal = Joints::<N>::from_column_slice(&bounds.diagonal_lower_kg_m2);
    let mut out = vec![
        bounds.m_lo_kg_m2 / symmetric_eigen(&m).values.min(),
        2.0 * relative(&m, &JointMatrix::from_diagonal(&diagonal)),
    ];
    out.extend((1..N).map(|joint| relative(&m, &d[joint]) / bounds.k_joint[joint]));
    // Alternating climbs over y and v for k_r and k_m.
    let l = m.cholesky().unwrap().l();
    let inverse: JointMatrix<N> = l.solve_lower_triangular(&JointMatrix::identity()).unwrap();
    let scaled: Vec<JointMatrix<N>> = d.iter().map(|d| inverse * d * inverse.transpose()).collect();
    for (metric, bound) in [(JointMatrix::identity(), bounds.k_r.unwrap()), (inverse, bounds.k_m.unwrap())] {
        let mut most = 0.0_f64;
        for start in starts {
            let mut v = *start;
            for _ in 0..6 {
                let slopes = Joints::<N>::from_fn(|j, _| v.dot(&(scaled[j] * v)));
                let y = metric.transpose() * (metric * slopes).normalize();
                let form: JointMatrix<N> =
                    scaled.iter().zip(y.iter()).fold(JointMatrix::zeros(), |sum, (s, y)| sum + s * *y);
                let (value, vector) = symmetric_eigen(&form).dominant();
                v = vector;
                most = most.max(0.5 * value.abs());
            }
        }
        out.push(most / bound);
    }
    out
}

/// Random configurations and masses, then climbs from the best: nothing may pass a bound. Returns the closest approaches.
fn attack<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    bounds: &RiccatiBounds,
    samples: usize,
    climbs: usize,
) -> Vec<f64> {
    let intervals = intervals(set).unwrap();
    let mut draws = Draws(17);
    let starts: Vec<Joints<N>> =
        (0..2).map(|_| Joints::<N>::from_fn(|_, _| draws.within(-1.0, 1.0)).normalize()).collect();
    let mut worst: Vec<f64> = Vec::new();
    let mut best: Vec<Vec<(f64, Vec<f64>, Joints<N>)>> = Vec::new();
    for sample in 0..samples {
        let scales: Vec<f64> = arms
            .groups()
            .iter()
            .map(|group| {
                if sample % 2 == 0 {
                    group.scale[usize::from(draws.next() < 0.5)]
                } else {
                    draws.within(group.scale[0], group.scale[1])
                }
            })
            .collect();
        let [low, high] = arms.rotor_inertia_kg_m2();
        let model = arms.model(&scales, &if sample % 2 == 0 { low } else { high }).unwrap();
        let q = Joints::from_fn(|i, _| {
            let x = draws.within(-0.3, 1.3).clamp(0.0, 1.0);
            intervals[i][0] + (intervals[i][1] - intervals[i][0]) * x
        });
        let used = use_of_bounds(&model, bounds, &q, &starts[..1]);
        worst.resize(used.len(), 0.0);
        best.resize(used.len(), Vec::new());
        for (which, x) in used.iter().enumerate() {
            assert!(*x <= 1.0, "bound {which} passed: {x} at {q:?}, scales {scales:?}");
            worst[which] = worst[which].max(*x);
            best[which].push((*x, scales.clone(), q));
            if best[which].len() > 200 {
                best[which].sort_by(|a, b| b.0.total_cmp(&a.0));
                best[which].truncate(100);
            }
        }
    }
    for which in 0..best.len() {
        best[which].sort_by(|a, b| b.0.total_cmp(&a.0));
        for (value, scales, q) in best[which].iter().take(climbs / best.len() + 1) {
            let model = arms.model(scales, &arms.rotor_inertia_kg_m2()[0]).unwrap();
            let (mut value, mut q, mut width) = (*value, *q, 0.2);
            for _ in 0..120 {
                let trial = Joints::from_fn(|i, _| {
                    (q[i] + draws.within(-width, width)).clamp(intervals[i][0], intervals[i][1])
                });
                let found = use_of_bounds(&model, bounds, &trial, &starts)[which];
                assert!(found <= 1.0, "bound {which} passed: {found} at {trial:?}, scales {scales:?}");
                if found > value {
                    (value, q) = (found, trial);
                } else {
                    width *= 0.96;
                }
            }
            worst[which] = worst[which].max(value);
        }
    }
    worst
}

/// Samples and climbs, times what `CERTUNE_SOUNDNESS_SCALE` says.
fn hunt<const N: usize>(
    arms: &ArmBox<N>,
    set: &AngleSet<N>,
    bounds: &RiccatiBounds,
    samples: usize,
    climbs: usize,
) -> Vec<f64> {
    let scale = std::env::var("CERTUNE_SOUNDNESS_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1);
    attack(arms, set, bounds, samples * scale, climbs)
}

fn task_box() -> AngleSet<7> {
    AngleSet::Box {
        lower_rad: [-1.3, -0.1, -0.3, -2.3, -0.3, 0.9, -0.3],
        upper_rad: [1.3, 0.8, 0.3, -0.9, 0.3, 2.8, 0.3],
    }
}

#[test]
fn bounds_of_the_panda_over_the_task_hold_are_tight_and_are_found_again() {
    let arms = panda(&Ranges::nominal());
    let found = bounds(&arms, &task_box());
    // True values from another program, by local maximisation.
    assert!(found.m_lo_kg_m2 <= 0.0048 && found.m_lo_kg_m2 >= 0.0035, "{}", found.m_lo_kg_m2);
    let k_r = found.k_r.unwrap();
    assert!((4.662..=1.3 * 4.662).contains(&k_r), "{k_r}");
    let again = riccati_bounds_with(&arms, &task_box(), &found.plan, &|_| {}).unwrap();
    assert_eq!(found, again);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| bounds(&arms, &task_box())), found);
    let approach = hunt(&arms, &task_box(), &found, 12_000, 100);
    println!("closest approaches: {approach:.3?}");
    // Within the plan's own tightness, or the search is not a search.
    assert!(approach[0] > 0.75 && approach[2] > 0.75, "{approach:?}");
    let mut bold = found.plan.clone();
    bold.k_joint[1] *= 0.7;
    assert!(riccati_bounds_with(&arms, &task_box(), &bold, &|_| {}).is_err(), "a false claim");
}

#[test]
fn bounds_hold_for_uncertain_masses_a_payload_and_rotor_inertia() {
    let ranges = Ranges {
        mass_uncertainty: 0.2,
        payload_kg: [0.0, 0.7],
        payload_com_m: [0.0, 0.0, 0.307],
        rotor_inertia_kg_m2: [0.05, 0.1],
    };
    let arms = panda(&ranges);
    let found = bounds(&arms, &task_box());
    let approach = hunt(&arms, &task_box(), &found, 10_000, 60);
    println!("closest approaches: {approach:.3?}");
}

#[test]
fn bounds_of_small_arms_hold_over_all_angles() {
    let mut draws = Draws(23);
    for _ in 0..4 {
        let arms =
            ArmBox::<3>::new(&odd_arm(&mut draws), &Ranges { mass_uncertainty: 0.1, ..Ranges::nominal() }).unwrap();
        let found = bounds(&arms, &AngleSet::AllAngles);
        let approach = hunt(&arms, &AngleSet::AllAngles, &found, 5_000, 30);
        assert!(approach[0] > 0.6, "{approach:?}");
    }
}

#[test]
#[ignore = "a minute: all angles of the Panda"]
fn bounds_of_the_panda_over_all_angles_hold() {
    let arms = panda(&Ranges { rotor_inertia_kg_m2: [0.1, 0.1], ..Ranges::nominal() });
    let found = riccati_bounds(&arms, &AngleSet::AllAngles, Effort::Quick, &|_| {}).unwrap();
    println!("{found:?}");
    let approach = hunt(&arms, &AngleSet::AllAngles, &found, 1_000_000, 100);
    println!("closest approaches: {approach:.3?}");
}

#[test]
#[ignore = "prints figures"]
fn figures() {
    let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|s| s.parse().ok()).unwrap_or(default);
    let (rotor, payload) = (env("ROTOR", 0.0), env("PAY", 0.0));
    let arms = panda(&Ranges {
        mass_uncertainty: env("UNC", 0.0),
        rotor_inertia_kg_m2: [rotor, rotor],
        payload_kg: [env("PAYLO", payload), payload],
        payload_com_m: [0.0, 0.0, 0.307],
    });
    let set = match std::env::var("OVER").as_deref() {
        Ok("torus") => AngleSet::AllAngles,
        Ok("range") => AngleSet::Box {
            lower_rad: [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
            upper_rad: [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        },
        _ => task_box(),
    };
    let effort = match std::env::var("EFFORT").as_deref() {
        Ok("standard") => Effort::Standard,
        Ok("thorough") => Effort::Thorough,
        _ => Effort::Quick,
    };
    let start = std::time::Instant::now();
    let found = riccati_bounds(&arms, &set, effort, &|_| {});
    println!("{:.1} s\n{found:#?}", start.elapsed().as_secs_f64());
}
