//! What a region bounds beside its decay, attacked on the Panda: torques, distances and |y| everywhere in `{V <= 1}`, in the form that all joints
//! share and in the form of each joint.
//!
//! At a random configuration V is a quadratic form, so the largest torque, distance or |y| on its level set is an eigenvalue: no search can
//! find a worse state there. The states that the quadratic part of `dV/dt` likes least are tried on the nonlinear loop, and so are
//! random ones; and the loop is integrated from the boundary of the starts.

use certune::certify::{
    AicGainValues, ArmValues, ConstantValues, FamilyValues, JointRegionOptions, Options, Problem, RegionOptions,
    SampledConstantValues, certify,
};
use certune::control::aic::{AicGains, AicParams};
use certune::dynamics::{Model, Robot, gravity_torque, mass_matrix};
use certune::linsys::Joints;
use certune::verify::{Claim, ClaimKind, Number, triangle};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::chance::{angles, direction, stream, uniform, vector};
use super::continuous::{Continuous, Loop};

const N: usize = 7;
const STATES: usize = 5;
const ORDER: usize = N * (1 + STATES);
const FRICTION: [f64; 2] = [1.0, 3.0];
const MOTOR_LIMITS_N_M: [f64; N] = [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
/// V, and what it bounds, in floating point against what was decided exactly.
const SLACK: f64 = 1e-6;

fn constants() -> SampledConstantValues {
    SampledConstantValues {
        m_lo_kg_m2: 0.004,
        m_hi_kg_m2: 4.9,
        k_g_n_m_per_rad: 72.0,
        k_c_kg_m2: 2.4,
        k_r: 5.3,
        k_m: None,
        diagonal_kg_m2: Some([
            [0.025, 0.183, 0.0067, 0.047, 0.0046, 0.0126, 0.0036].map(|x| 0.5 * x).to_vec(),
            [7.94, 8.31, 3.17, 2.99, 0.128, 0.131, 0.0089].map(|x| 1.1 * x).to_vec(),
        ]),
        gravity_torque_n_m: Some(vec![0.1, 60.0, 33.0, 25.0, 3.4, 3.2, 0.1]),
        margin: 0.05,
        samples: 1,
        local_starts: 1,
    }
}

fn problem(gains: &AicGains<N>, gravity_compensation: bool) -> Problem {
    let robot = Robot::panda();
    let arm = ArmValues {
        name: robot.name().to_owned(),
        joints: N,
        sha256: robot.sha256(),
        payload_com_m: [0.0, 0.0, 0.307],
    };
    let values = AicGainValues {
        kappa_mu: gains.kappa_mu.to_vec(),
        kappa_a: gains.kappa_a.to_vec(),
        sigma_q: gains.sigma_q.to_vec(),
        sigma_dq: gains.sigma_dq.to_vec(),
        sigma_mu: gains.sigma_mu.to_vec(),
        sigma_dmu: gains.sigma_dmu.to_vec(),
        reference_time_constant_s: gains.reference_time_constant_s.to_vec(),
    };
    let family = FamilyValues {
        gravity_compensation,
        friction_n_m_s_per_rad: FRICTION,
        mass_uncertainty: 0.0,
        payload_kg: [0.0, 0.0],
        rotor_inertia_kg_m2: [0.0, 0.0],
    };
    Problem::new(&arm, values.written().unwrap(), &family, &ConstantValues::Sampled(constants())).unwrap()
}

fn gains(kappa_a: f64, sigma: [f64; N], models: [f64; 2]) -> AicGains<N> {
    AicGains {
        kappa_mu: [11.67; N],
        kappa_a: [kappa_a; N],
        sigma_q: sigma,
        sigma_dq: sigma,
        sigma_mu: [models[0]; N],
        sigma_dmu: [models[1]; N],
        reference_time_constant_s: [1.0; N],
    }
}

/// A region's function and what it promises, for one choice of friction.
struct Region {
    p: f64,
    b: [[f64; STATES]; N],
    s: [[f64; 15]; N],
    rho: f64,
    rate: f64,
    /// Half-axes of the starts, rad.
    radii: [f64; N],
    /// Each joint's controller torque, N m.
    torques: Option<[f64; N]>,
    /// The controller's torque, 2-norm, N m.
    torque_norm: Option<f64>,
    distances: Option<[f64; N]>,
    distance_norm: Option<f64>,
}

fn floats<const K: usize>(numbers: &[Number]) -> [f64; K] {
    std::array::from_fn(|k| numbers[k].to_f64())
}

impl Region {
    fn of(claim: &Claim, friction: &Joints<N>) -> Self {
        match claim {
            Claim::Region(claim) => {
                let w = &claim.witness;
                Self {
                    p: w.p.to_f64(),
                    b: [floats(&w.b); N],
                    s: [floats(&w.s); N],
                    rho: w.rho.to_f64(),
                    rate: claim.rate_per_s.to_f64(),
                    radii: [claim.radius_rad.to_f64(); N],
                    torques: None,
                    torque_norm: claim.controller_torque_n_m.as_ref().map(Number::to_f64),
                    distances: None,
                    distance_norm: claim.distance_rad.as_ref().map(Number::to_f64),
                }
            }
            Claim::JointRegion(claim) => {
                let w = &claim.witness;
                let gravity = constants().gravity_torque_n_m.unwrap();
                let s = |joint: usize| {
                    let ends = &w.joints[joint].s;
                    let share = (friction[joint] - FRICTION[0]) / (FRICTION[1] - FRICTION[0]);
                    let [least, largest]: [[f64; 15]; 2] = [floats(&ends[0]), floats(&ends[1])];
                    std::array::from_fn(|k| (1.0 - share) * least[k] + share * largest[k])
                };
                Self {
                    p: w.p.to_f64(),
                    b: std::array::from_fn(|joint| floats(&w.joints[joint].b)),
                    s: std::array::from_fn(s),
                    rho: w.rho.to_f64(),
                    rate: claim.rate_per_s.to_f64(),
                    radii: floats(&claim.radii_rad),
                    torques: claim.motor_limits_n_m.as_ref().map(|limits| {
                        // The document's gravity shares are rounded up by a unit of the fourth digit.
                        std::array::from_fn(|joint| limits[joint].to_f64() - gravity[joint])
                    }),
                    torque_norm: None,
                    distances: claim.distances_rad.as_ref().map(|distances| floats(distances)),
                    distance_norm: None,
                }
            }
            other => unreachable!("{other:?}"),
        }
    }

    fn y(&self, z: &[Joints<N>; STATES]) -> Joints<N> {
        Joints::from_fn(|i, _| (0..STATES).map(|k| self.b[i][k] * z[k][i]).sum::<f64>())
    }

    /// V, gravity compensated.
    fn v(&self, closed: &Loop<'_, N>, x: &Continuous<N>) -> f64 {
        let z = closed.z(x);
        let momentum = mass_matrix(&closed.model, &x.q) * x.dq;
        let mut v = self.p * x.dq.dot(&momentum) + 2.0 * momentum.dot(&self.y(&z));
        for i in 0..N {
            for k in 0..STATES {
                for l in 0..STATES {
                    v += self.s[i][triangle(k, l)] * z[k][i] * z[l][i];
                }
            }
        }
        v
    }

    fn slope(&self, closed: &Loop<'_, N>, x: &Continuous<N>) -> f64 {
        let rate = closed.derivative(x);
        let h = 1e-5 / rate.dq.norm().max(rate.u.norm()).max(1.0);
        (self.v(closed, &x.plus(&rate, h)) - self.v(closed, &x.plus(&rate, -h))) / (2.0 * h)
    }

    /// V at a configuration as a matrix over (dq, z).
    fn form(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let mut form = DMatrix::zeros(ORDER, ORDER);
        form.view_mut((0, 0), (N, N)).copy_from(&(m * self.p));
        for i in 0..N {
            for k in 0..STATES {
                let at = N * (1 + k) + i;
                for j in 0..N {
                    form[(j, at)] = m[(j, i)] * self.b[i][k];
                    form[(at, j)] = form[(j, at)];
                }
                for l in 0..STATES {
                    form[(at, N * (1 + l) + i)] = self.s[i][triangle(k, l)];
                }
            }
        }
        form
    }

    /// What the state may not exceed on `{V <= 1}`.
    fn holds_at(&self, x: &DVector<f64>) {
        let part = |k: usize| x.rows(N * (1 + k), N).into_owned();
        let z: [Joints<N>; STATES] = std::array::from_fn(|k| Joints::from_iterator(part(k).iter().copied()));
        let most = 1.0 + SLACK;
        assert!(self.y(&z).norm() <= self.rho * most);
        for joint in 0..N {
            assert!(self.torques.is_none_or(|torques| z[4][joint].abs() <= torques[joint] * most));
            assert!(self.distances.is_none_or(|distances| z[0][joint].abs() <= distances[joint] * most));
        }
        assert!(self.torque_norm.is_none_or(|torque| z[4].norm() <= torque * most));
        assert!(self.distance_norm.is_none_or(|distance| z[0].norm() <= distance * most));
    }

    /// Extreme states at a random configuration.
    fn attack_states(&self, closed: &mut Loop<'_, N>, friction: &Joints<N>, rng: &mut ChaCha8Rng) {
        let q = angles::<N>(rng);
        let m = mass_matrix(&closed.model, &q);
        let m = DMatrix::from_fn(N, N, |i, j| m[(i, j)]);
        let form = self.form(&m);
        let factor = form.clone().cholesky().unwrap();
        let to_state = factor.l().transpose().try_inverse().unwrap();
        // The linear part of the loop.
        let inverse = m.clone().try_inverse().unwrap();
        let mut a = DMatrix::zeros(ORDER, ORDER);
        a.view_mut((0, 0), (N, N))
            .copy_from(&-(&inverse * DMatrix::from_diagonal(&DVector::from_fn(N, |i, _| friction[i]))));
        a.view_mut((0, N * STATES), (N, N)).copy_from(&inverse);
        for joint in 0..N {
            let controller = closed.params.continuous_joint(joint);
            for row in 0..STATES {
                a[(N * (1 + row) + joint, joint)] = controller.b[row];
                for k in 0..STATES {
                    a[(N * (1 + row) + joint, N * (1 + k) + joint)] = controller.A[(row, k)];
                }
            }
        }
        let change = a.transpose() * &form + &form * &a;
        let normal = to_state.transpose() * change * &to_state;
        let slopes = normal.symmetric_eigen();
        assert!(slopes.eigenvalues.max() <= -2.0 * self.rate + SLACK, "{}", slopes.eigenvalues.max());
        let mut states: Vec<DVector<f64>> = (0..ORDER).map(|k| &to_state * slopes.eigenvectors.column(k)).collect();
        // The states where a linear quantity is largest are rows of the inverse of the form.
        let all = factor.inverse();
        for coordinate in 0..ORDER {
            let row = all.column(coordinate).into_owned();
            states.push(&row / all[(coordinate, coordinate)].sqrt());
        }
        for _ in 0..60 {
            let chance = DVector::from_iterator(
                ORDER,
                (0..6).flat_map(|_| vector::<N>(rng).iter().copied().collect::<Vec<_>>()),
            );
            states.push(&to_state * chance.normalize());
        }
        // The largest norms.
        let block = |k: usize| DMatrix::from_fn(N, ORDER, |i, j| if j == N * (1 + k) + i { 1.0 } else { 0.0 });
        let y = DMatrix::from_fn(N, ORDER, |i, j| if j >= N && j % N == i { self.b[i][j / N - 1] } else { 0.0 });
        for rows in [block(0), block(4), y] {
            let largest = (&rows * &all * rows.transpose()).symmetric_eigen();
            let at = largest.eigenvalues.imax();
            states.push(&all * rows.transpose() * largest.eigenvectors.column(at) / largest.eigenvalues[at].sqrt());
        }
        for state in states {
            for sign in [1.0, -1.0] {
                let x = &state * sign;
                self.holds_at(&x);
                let part = |k: usize| Joints::<N>::from_fn(|i, _| x[N * k + i]);
                closed.goal = q - part(1);
                let x = closed.state(part(0), std::array::from_fn(|k| part(1 + k)));
                let v = self.v(closed, &x);
                assert!((v - 1.0).abs() <= SLACK, "{v}");
                let slope = self.slope(closed, &x) + 2.0 * self.rate * v;
                // A central difference loses about half of the digits.
                assert!(slope <= 1e-4, "dV/dt + 2 rate V = {slope} at {x:?}");
            }
        }
    }

    /// The loop in time, from rest on the boundary of the starts.
    fn attack_in_time(&self, closed: &mut Loop<'_, N>, rng: &mut ChaCha8Rng) {
        closed.goal = angles(rng);
        let along = direction::<N>(rng);
        let q = closed.goal + Joints::from_fn(|i, _| along[i] * self.radii[i]);
        let mut x =
            Continuous { q, dq: Joints::zeros(), beliefs: [q, Joints::zeros(), Joints::zeros()], u: Joints::zeros() };
        let start = self.v(closed, &x);
        assert!(start <= 1.0 + SLACK, "V starts at {start}");
        let h = 3e-4;
        for k in 1..=3_000 {
            x = closed.step(&x, h);
            if k % 10 == 0 {
                let bound = start * (-2.0 * self.rate * f64::from(k) * h).exp();
                let v = self.v(closed, &x);
                assert!(v <= bound + SLACK * start, "V = {v} above {bound} after {k} steps");
                let z = closed.z(&x);
                let parts: Vec<f64> =
                    std::iter::once(x.dq).chain(z).flat_map(|part| part.iter().copied().collect::<Vec<_>>()).collect();
                self.holds_at(&DVector::from_vec(parts));
                if self.torques.is_some() {
                    let motors = x.u + gravity_torque(&closed.model, &x.q);
                    assert!((0..N).all(|joint| motors[joint].abs() <= MOTOR_LIMITS_N_M[joint]), "{motors:?}");
                }
            }
        }
    }
}

fn attack(kind: ClaimKind, gains: &AicGains<N>, options: &Options, seed: u64) {
    let certificate = certify(&problem(gains, true), &[kind], options, &|_| None).unwrap();
    assert!(certificate.all_hold(), "{}", certificate.checked()[0].statement);
    let claim = &certificate.document().claims[0].claim;
    let params = AicParams::new(gains, 0.001).unwrap();
    let nominal = Model::<N>::new(&Robot::panda()).unwrap();
    let mut rng = stream(seed, 0);
    for round in 0..12 {
        let friction = Joints::<N>::from_fn(|_, _| match round % 3 {
            0 => uniform(&mut rng, FRICTION[0], FRICTION[1]),
            1 => FRICTION[0],
            _ => FRICTION[usize::from(uniform(&mut rng, 0.0, 1.0) < 0.5)],
        });
        let model = nominal.clone().with_friction(&friction, &Joints::zeros());
        let region = Region::of(claim, &friction);
        let mut closed = Loop { model, params: &params, goal: Joints::zeros(), compensated: true };
        region.attack_states(&mut closed, &friction, &mut rng);
        region.attack_in_time(&mut closed, &mut rng);
    }
}

#[test]
fn the_constants_of_these_claims_hold_where_they_are_looked_at() {
    let model = Model::<N>::new(&Robot::panda()).unwrap();
    let values = constants();
    let [lower, upper] = values.diagonal_kg_m2.unwrap().map(|list| DMatrix::from_diagonal(&DVector::from_vec(list)));
    let gravity = values.gravity_torque_n_m.unwrap();
    let mut rng = stream(7, 0);
    for _ in 0..5_000 {
        let q = angles::<N>(&mut rng);
        let m = mass_matrix(&model, &q);
        let m = DMatrix::from_fn(N, N, |i, j| m[(i, j)]);
        assert!((&m - &lower).symmetric_eigenvalues().min() > 0.0 && (&upper - &m).symmetric_eigenvalues().min() > 0.0);
        let torques = gravity_torque(&model, &q);
        assert!((0..N).all(|joint| torques[joint].abs() <= gravity[joint]), "{torques:?}");
    }
}

#[test]
fn a_region_keeps_its_torque_and_distance() {
    let region =
        RegionOptions { controller_torque_n_m: Some(87.0), distance_rad: Some(0.7), ..RegionOptions::default() };
    let options = Options { region, ..Options::default() };
    attack(ClaimKind::Region, &gains(700.0, [1.0; N], [5.0, 10.0]), &options, 1);
}

#[test]
fn a_region_of_each_joint_keeps_every_motor_limit() {
    let joint_region = JointRegionOptions {
        motor_limits_n_m: Some(MOTOR_LIMITS_N_M.to_vec()),
        steps_rad: vec![vec![1.0, 0.3, 0.0, -1.0, 0.0, 1.3, 0.0], vec![-1.0, 0.3, 0.0, -0.2, 0.0, 0.4, 0.0]],
        ..JointRegionOptions::default()
    };
    let options = Options { joint_region: joint_region.clone(), ..Options::default() };
    let robot = gains(200.0, [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0], [15.0, 30.0]);
    attack(ClaimKind::JointRegion, &robot, &options, 2);
    // Limits that bind: the simulation's gains fill the wrist's.
    let distances_rad = Some(vec![0.3; N]);
    let options = Options { joint_region: JointRegionOptions { distances_rad, ..joint_region }, ..Options::default() };
    attack(ClaimKind::JointRegion, &gains(700.0, [1.0; N], [5.0, 10.0]), &options, 3);
}
