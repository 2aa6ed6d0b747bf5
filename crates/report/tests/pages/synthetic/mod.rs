//! A record with plausible signals: an arm of seven joints that steps between three goals, each joint a damped
//! second-order system; faster with the tuned gains.

pub mod comparison;

use certune_report::*;

/// The ids of the sections that the page of a tuning run has, whatever its record.
pub const SECTIONS: [&str; 11] = [
    "answer",
    "asked",
    "gains",
    "response",
    "held-out",
    "search",
    "sensitivity",
    "learnt",
    "certificate",
    "recheck",
    "method",
];

const GOALS: [[f64; 7]; 5] = [A, B, C, B, A];
const A: [f64; 7] = [1.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.0];
const B: [f64; 7] = [0.0, 0.2, 0.0, -1.0, 0.0, 1.2, 0.0];
const C: [f64; 7] = [-1.0, 0.5, 0.0, -1.2, 0.0, 1.6, 0.0];
const MOVES: [&str; 5] = ["B to A", "A to B", "B to C", "C to B", "B to A, return"];
const MOVE_S: f64 = 6.0;
const STEP_S: f64 = 0.005;
const SAMPLES: usize = 6000;

/// A repeatable stand-in for chance, 0 to 1.
pub fn noise(index: u64) -> f64 {
    let mixed = (index.wrapping_add(0x9e37_79b9)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed >> 40) as f64 / (1u64 << 24) as f64
}

fn trajectory(pole_per_s: f64, jitter: f64) -> Trajectory {
    let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * STEP_S).collect();
    let mut run = Trajectory { time_s, ..Trajectory::default() };
    for joint in 0..7 {
        let (mut q, mut dq) = (B[joint], 0.0);
        let (mut angles, mut goals, mut torques) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..SAMPLES {
            let goal = GOALS[((k as f64 * STEP_S / MOVE_S) as usize).min(4)][joint];
            let ddq = pole_per_s * pole_per_s * (goal - q) - 1.8 * pole_per_s * dq;
            angles.push(q);
            goals.push(goal);
            torques.push((7 - joint) as f64 * (ddq + 0.8 * q) + jitter * (noise(k as u64 * 7 + joint as u64) - 0.5));
            dq += STEP_S * ddq;
            q += STEP_S * dq;
        }
        run.q_rad.push(angles);
        run.goal_rad.push(goals);
        run.tau_n_m.push(torques);
    }
    run.free_energy = (0..SAMPLES)
        .map(|k| (0..7).map(|joint| (run.q_rad[joint][k] - run.goal_rad[joint][k]).powi(2)).sum::<f64>() / 10.0 + 1e-7)
        .collect();
    run
}

fn bands(pole_per_s: f64) -> Bands {
    let time_s: Vec<f64> = (0..600).map(|k| f64::from(k) * 0.05).collect();
    let decay = |spread: f64, floor: f64| {
        let size = [1.94, 1.94, 1.14, 1.14, 1.94];
        let at = |t: &f64| {
            let index = ((t / MOVE_S) as usize).min(4);
            size[index] * (-(pole_per_s * spread) * (t - MOVE_S * index as f64)).exp() + floor
        };
        time_s.iter().map(at).collect()
    };
    Bands {
        error_p05_rad: decay(1.15, 0.0006),
        error_p50_rad: decay(1.0, 0.0015),
        error_p95_rad: decay(0.85, 0.004),
        time_s,
    }
}

fn metrics(settling_time_s: f64, scale: f64) -> SegmentMetrics {
    SegmentMetrics {
        settling_time_s: Some(settling_time_s),
        final_error_rad: Some(0.00271 * scale),
        overshoot: Some(0.004 / scale),
        peak_torque_n_m: Some(52.3 / scale.sqrt()),
        torque_rate_rms_n_m_per_s: Some(14.2 / scale),
        saturated_steps: 0,
        itae_rad_s2: Some(3.31 * scale),
    }
}

fn poles(shift: f64, seed: u64) -> Vec<Pole> {
    let mut poles = Vec::new();
    for k in 0..3000 {
        let (a, b) = (noise(seed + 2 * k), noise(seed + 2 * k + 1));
        match k % 3 {
            0 => poles.push(Pole { re: -shift * (1.0 + 0.4 * a), im: 0.0 }),
            1 => {
                let (re, im) = (-9.0 * shift - 2.0 * a, 12.0 + 90.0 * b * b);
                poles.extend([Pole { re, im }, Pole { re, im: -im }]);
            }
            _ => {
                let (re, im) = (-1.5 * shift - a, 0.4 * shift * b);
                poles.extend([Pole { re, im }, Pole { re, im: -im }]);
            }
        }
    }
    poles
}

fn evaluations() -> Vec<Evaluation> {
    let mut best: Option<f64> = None;
    (0..400)
        .map(|index| {
            let progress = (-(index as f64) / 90.0).exp();
            let cost = 1.9 + 1.5 * progress + 1.6 * noise(9000 + index).powi(3);
            let outcome = match (noise(index) * 10.0) as u32 {
                0 => "unstable",
                1 => "diverged",
                2 => "uncertified",
                3 => "given up",
                4 => "beyond a limit",
                _ => "certified",
            };
            let lost = matches!(outcome, "unstable" | "diverged" | "given up" | "beyond a limit");
            if outcome == "certified" {
                best = Some(best.map_or(cost, |best: f64| best.min(cost)));
            }
            let phase = if index < 160 { "nelder-mead" } else { "particle-swarm" };
            Evaluation {
                index,
                phase: phase.to_owned(),
                outcome: outcome.to_owned(),
                cost: (!lost).then_some(cost),
                best_so_far: best,
            }
        })
        .collect()
}

fn learnt() -> Learnt {
    let names = ["kappa_mu", "kappa_a", "sigma_dq", "sigma_mu", "sigma_dmu"];
    let axis =
        |gain: &str, unit: &str, lower, upper| SliceAxis { gain: gain.to_owned(), unit: unit.to_owned(), lower, upper };
    let slice = |x: SliceAxis, y: SliceAxis| {
        // The loop needs damping: what lies above a falling line is stable, a strip less of it is certified.
        let cells = |count: usize, edge: f64| -> Vec<Vec<bool>> {
            let at = |index: usize| (index as f64 + 0.5) / count as f64;
            (0..count).map(|row| (0..count).map(|column| at(row) + 0.5 * at(column) > edge).collect()).collect()
        };
        let inside = |axis: &SliceAxis, part: f64| axis.lower * (axis.upper / axis.lower).powf(part);
        let candidates = (0..300).map(|k| [inside(&x, noise(k)), inside(&y, noise(k + 300))]).collect();
        let gains = Pair { published: [inside(&x, 0.5), inside(&y, 0.5)], tuned: [inside(&x, 0.9), inside(&y, 0.4)] };
        Slice { stable: cells(24, 0.3), certified: cells(12, 0.6), candidates, gains, x, y }
    };
    Learnt {
        surface: Some(Surface {
            points: 84,
            coefficients: 21,
            reach: 0.21,
            r_squared: 0.964,
            predicted_r_squared: 0.911,
            gains: names
                .iter()
                .zip([0.31, 0.08, 0.12, 0.35, 0.02])
                .map(|(gain, share)| Share { gain: (*gain).to_owned(), share })
                .collect(),
            pairs: [
                (["kappa_mu", "sigma_mu"], 0.1),
                (["kappa_a", "sigma_dq"], 0.015),
                (["kappa_a", "kappa_mu"], 0.005),
            ]
            .map(|(gains, share)| PairShare { gains: gains.map(str::to_owned), share })
            .to_vec(),
            directions: vec![
                Direction { parts: vec![0.7, 0.1, 0.0, -0.7, 0.0], change: 0.052 },
                Direction { parts: vec![0.0, 0.8, 0.6, 0.0, 0.0], change: 0.02 },
                Direction { parts: vec![0.7, 0.0, 0.1, 0.7, 0.0], change: 0.001 },
            ],
        }),
        no_surface: String::new(),
        limit: Some(NearestLimit {
            in_words: "jitter at most 18.8 N m/s".to_owned(),
            figure_in_words: "18.4 N m/s".to_owned(),
            excess: Some(-0.021),
        }),
        cost_parts: [("lag", 0.972), ("jitter", 0.018), ("overshoot", 0.01)]
            .map(|(name, share)| CostPart { name: name.to_owned(), share })
            .to_vec(),
        worst_plants: vec![WorstPlantRow {
            candidate: 211,
            in_words: "payload 0.70 kg, link masses +20 % on average, friction 2.00 N m s/rad on average".to_owned(),
            outcome: "settling time 2.41 s".to_owned(),
        }],
        slices: vec![
            slice(axis("kappa_a", "N m/(rad s)", 50.0, 20_000.0), axis("sigma_dq", "", 0.2, 5.0)),
            slice(axis("kappa_mu", "1/s", 2.0, 60.0), axis("sigma_mu", "", 0.5, 50.0)),
        ],
    }
}

fn gain(name: &str, unit: &str, (published, tuned): (f64, f64), bounds: Option<(f64, f64, bool)>) -> GainRow {
    let bounds = bounds.map(|(lower, upper, on_bound)| SearchBounds { lower, upper, on_bound });
    GainRow { name: name.to_owned(), joint: None, unit: unit.to_owned(), published, tuned, bounds }
}

fn assumption(text: &str, grade: Grade) -> Assumption {
    Assumption { text: text.to_owned(), grade: Some(grade) }
}

fn margin(name: &str, value: f64, unit: &str) -> Margin {
    Margin { name: name.to_owned(), value: Some(value), unit: unit.to_owned() }
}

fn range(name: &str, lower: f64, upper: f64, unit: &str) -> RangeRow {
    RangeRow { name: name.to_owned(), lower, upper, unit: unit.to_owned() }
}

fn claims() -> Vec<Claim> {
    vec![
        Claim {
            kind: "exponential".to_owned(),
            verdict: Verdict::Holds,
            grade: Grade::Conditional,
            statement: "At every configuration, for link masses within 20 %, payload 0 to 0.7 kg, friction 0.5 to 2 N m s/rad and \
                        rotor inertia 0 to 0.1 kg m², the linearised loop decays at least as exp(−0.82 t)."
                .to_owned(),
            assumptions: vec![
                assumption("every eigenvalue of the inertia matrix lies in 0.0044 to 8.72 kg m²", Grade::Conditional),
                assumption("gravity is compensated without error", Grade::Conditional),
            ],
            margins: vec![
                margin("certified decay rate", 0.82, "/s"),
                margin("slowest sampled pole", -0.853, "/s"),
                margin("least friction needed", 0.0, "N m s/rad"),
                margin("delay margin at the lightest inertia", 0.0021, "s"),
            ],
            counterexample: vec![],
        },
        Claim {
            kind: "region".to_owned(),
            verdict: Verdict::Holds,
            grade: Grade::Conditional,
            statement: "If these constants hold, every move of the nonlinear arm that starts at rest at most 1.31 rad from its goal \
                        converges to it, at least as exp(−0.3 t)."
                .to_owned(),
            assumptions: vec![
                assumption("every eigenvalue of the inertia matrix lies in 0.0044 to 8.72 kg m²", Grade::Conditional),
                assumption("k_c ≤ 1.83 kg m², k_r ≤ 11.2: worst of 20,000 samples and 64 local searches, plus 5 %", Grade::Conditional),
                assumption("the controller acts in continuous time", Grade::Conditional),
            ],
            margins: vec![margin("certified radius", 1.31, "rad"), margin("decay rate", 0.3, "/s")],
            counterexample: vec![],
        },
    ]
}

/// The record; each test changes what it is about.
pub fn record() -> TuningReport {
    let plants = (0..64)
        .map(|index| {
            let hard = noise(500 + index);
            PlantRow {
                index,
                in_words: format!("payload {:.2} kg, friction {:.2} N m s/rad", 0.7 * hard, 0.5 + 1.5 * noise(index)),
                cost: Pair {
                    published: Some(3.1 + 0.9 * hard + 0.2 * noise(900 + index)),
                    tuned: Some(1.95 + 0.5 * hard + 0.2 * noise(700 + index)),
                },
            }
        })
        .collect();
    let sensitivity = [
        ("kappa_mu", 1.031, 0.994),
        ("kappa_a", 1.008, 1.011),
        ("sigma_dq", 1.014, 1.022),
        ("sigma_mu", 1.047, 1.052),
        ("sigma_dmu", 1.003, 1.002),
    ];
    TuningReport {
        asked: Asked {
            robot: "panda".to_owned(),
            joints: 7,
            controller: "aic".to_owned(),
            preset: "pezzato2020-simulation".to_owned(),
            scenario: "pick-and-place".to_owned(),
            scenario_in_words: "A new goal every 6 s, five moves between three places; a payload is carried.".to_owned(),
            plant_box: vec![
                range("link masses, relative", 0.8, 1.2, ""),
                range("payload", 0.0, 0.7, "kg"),
                range("friction", 0.5, 2.0, "N m s/rad"),
                range("rotor inertia", 0.0, 0.1, "kg m²"),
            ],
            cost: CostMeaning {
                unit: "rad s²".to_owned(),
                in_words: "Time-weighted absolute error, summed over joints and moves, mean over the plants.".to_owned(),
            },
            seed: 1,
            budget: 400,
            command: "autotune --robot panda --controller aic --scenario pick-and-place --seed 1 --budget 400".to_owned(),
        },
        gains: vec![
            gain("kappa_mu", "1/s", (11.67, 23.4), Some((2.0, 200.0, false))),
            gain("kappa_a", "", (700.0, 2000.0), Some((50.0, 2000.0, true))),
            gain("sigma_q", "rad²", (1.0, 1.0), None),
            gain("sigma_dq", "rad²/s²", (1.0, 0.412), Some((0.05, 10.0, false))),
            gain("sigma_mu", "rad²/s²", (5.0, 2.61), Some((0.5, 50.0, false))),
            gain("sigma_dmu", "rad²/s⁴", (10.0, 9.37), Some((0.5, 100.0, false))),
        ],
        response: Response {
            joint_names: (1..=7).map(|joint| format!("panda_joint{joint}")).collect(),
            torque_limit_n_m: vec![87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
            runs: Pair { published: trajectory(1.6, 0.4), tuned: trajectory(2.3, 0.6) },
        },
        segments: MOVES
            .iter()
            .enumerate()
            .map(|(index, label)| SegmentRow {
                label: (*label).to_owned(),
                metrics: Pair {
                    published: metrics(4.05 + 0.01 * index as f64, 1.0),
                    tuned: metrics(3.02 + 0.02 * index as f64, 0.6),
                },
            })
            .collect(),
        held_out: HeldOut { plants, bands: Pair { published: bands(1.1), tuned: bands(1.6) } },
        search: SearchRecord { evaluations: evaluations(), unit: "s".to_owned(), published_cost: Some(3.42) },
        sensitivity: sensitivity
            .map(|(gain, minus, plus)| SensitivityRow {
                gain: gain.to_owned(),
                ratio_at_minus_10_percent: Some(minus),
                ratio_at_plus_10_percent: Some(plus),
            })
            .to_vec(),
        learnt: learnt(),
        certificate: CertificateRecord {
            file_name: "certificate.json".to_owned(),
            sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".to_owned(),
            claims: claims(),
            pole_map: Some(PoleMap {
                configurations: 1000,
                poles: Pair { published: poles(0.9, 11), tuned: poles(1.2, 77_777) },
                certified_rate_per_s: Some(0.82),
            }),
            region: Some(RegionRecord {
                radius_rad: Some(1.31),
                steps: MOVES
                    .iter()
                    .zip([1.94, 1.94, 1.14, 1.14, 1.94])
                    .map(|(label, size_rad)| GoalStep { label: (*label).to_owned(), size_rad })
                    .collect(),
            }),
        },
        recheck: vec![
            CommandLine {
                command: "autotune verify runs/panda-aic-1/certificate.json".to_owned(),
                shows: "Reads the certificate alone, derives every matrix again and checks it in exact arithmetic.".to_owned(),
            },
            CommandLine {
                command: "autotune simulate --robot panda --gains runs/panda-aic-1/gains.toml --scenario pick-and-place --payload 0.7".to_owned(),
                shows: "Repeats the nominal run with the tuned gains.".to_owned(),
            },
        ],
        method: vec![
            "The search minimises the cost over a fixed batch of arms drawn from the box. A candidate whose linearised loop has \
             an unstable pole at a sampled configuration is dropped before it is simulated."
                .to_owned(),
            "Nelder-Mead starts from the published gains, a particle swarm starts cold; the best certified candidate wins."
                .to_owned(),
        ],
        versions: [("certune", "0.1.0"), ("argmin", "0.11.0"), ("clarabel", "0.11.1"), ("nalgebra", "0.34.1")]
            .map(|(name, version)| Version { name: name.to_owned(), version: version.to_owned() })
            .to_vec(),
    }
}
