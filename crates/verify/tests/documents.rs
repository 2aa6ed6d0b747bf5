//! Documents that contradict themselves, or would say more than was checked: what is refused, and in which words the rest stands.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

use certune_verify::{Certificate, Document, Flaw, Record, Rejection, seal, verify};
use serde_json::{Value, json};

/// Two joints under the AIC's published gains, over all angles.
fn aic() -> Value {
    let all = |x: &str| json!([x, x]);
    json!({
        "schema": 2,
        "arm": {"name": "bench", "joints": 2, "sha256": "0".repeat(64)},
        "gains": {
            "controller": "aic", "kappa_mu": all("11.67"), "kappa_a": all("700"), "sigma_q": all("1"), "sigma_dq": all("1"),
            "sigma_mu": all("5"), "sigma_dmu": all("10"), "reference_time_constant_s": all("1"),
        },
        "family": {
            "gravity_compensation": true,
            "friction_n_m_s_per_rad": [["1", "3"], ["1", "3"]],
            "arms": {
                "mass_uncertainty": "0.1", "payload_kg": ["0", "0"], "payload_com_m": ["0", "0", "0"],
                "rotor_inertia_kg_m2": ["0.1", "0.2"],
            },
        },
        "constants": {
            "over": {"kind": "all-angles"},
            "bounds": {
                "m_lo_kg_m2": "0.1", "m_hi_kg_m2": "5", "k_g_n_m_per_rad": "70", "k_c_kg_m2": "2.8", "k_r": null, "k_m": null,
                "diagonal_kg_m2": null, "gravity_torque_n_m": null,
            },
            "evidence": {"kind": "sampled", "margin": "0.05", "samples": 100, "local_starts": 10},
        },
        "about": "", "claims": [], "sha256": "",
    })
}

/// The same arm in a small box under an MRAC whose velocity loop has `K = (l2/4 + l1/4) alpha1 = 100`.
fn mrac() -> Value {
    let mut document = aic();
    let all = |x: &str| json!([x, x]);
    let none = || json!([all("0"), all("0"), all("0")]);
    document["gains"] = json!({
        "controller": "mrac", "law": "raw-goal", "omega_rad_per_s": all("1"), "zeta": all("1"), "l1": all("2"), "l2": all("2"),
        "alpha": [all("100"), all("1"), all("0")], "e0": none(), "e1": none(), "f0": none(), "f1": none(),
    });
    document["constants"]["over"] = box_of("0.5");
    document["constants"]["bounds"]["inertia"] = json!({
        "midpoint_kg_m2": [["1", "0"], ["0", "1"]], "radius_kg_m2": [["0.1", "0.1"], ["0.1", "0.1"]], "coriolis_kg_m2": "1",
    });
    document
}

fn box_of(half_width: &str) -> Value {
    let lower = format!("-{half_width}");
    json!({"kind": "box", "lower_rad": [lower, lower], "upper_rad": [half_width, half_width]})
}

fn claimed(mut document: Value, claims: &[Value]) -> Document {
    document["claims"] = claims.iter().map(|claim| json!({"statement": "", "grade": null, "claim": claim})).collect();
    seal(serde_json::from_value(document).unwrap())
}

fn checked(document: &Document, records: &[Record]) -> Result<Certificate, Rejection> {
    verify(&serde_json::to_string(document).unwrap(), records).unwrap()
}

fn words(document: Value, claim: Value) -> String {
    let certificate = checked(&claimed(document, &[claim]), &[]).unwrap_or_else(|rejection| panic!("{rejection}"));
    certificate.checked()[0].statement.clone()
}

fn flaw(document: Value, claim: Value) -> Flaw {
    match checked(&claimed(document, &[claim]), &[]) {
        Err(Rejection::Claim { flaw, .. } | Rejection::Head(flaw)) => flaw,
        other => panic!("{other:?}"),
    }
}

fn exponential(margins: Value) -> Value {
    json!({"kind": "exponential", "rate_per_s": "0.1", "margins": margins})
}

fn moved(of: &str, value: &str) -> Value {
    json!([{"of": of, "value": value}])
}

/// The goal at 0 at 1 kHz: the limit on h K/m is 2 without delay.
fn velocity_loop(step_s: &str) -> Value {
    json!({"goal_rad": ["0", "0"], "step_s": step_s, "delay_samples": 0})
}

fn unstable_velocity_loop() -> Value {
    json!({"kind": "adaptive-sampled-refused", "velocity_loop": velocity_loop("0.1"), "joint": 1})
}

#[test]
fn an_enclosure_must_meet_the_other_constants() {
    words(mrac(), unstable_velocity_loop());
    let mut cases = Vec::new();
    for (bound, value) in [("m_lo_kg_m2", json!("1.2")), ("m_hi_kg_m2", json!("0.8"))] {
        let mut document = mrac();
        document["constants"]["bounds"][bound] = value;
        cases.push((document, "midpoint_kg_m2"));
    }
    for diagonal in [json!([["1.2", "0.5"], ["4", "4"]]), json!([["0.5", "0.5"], ["4", "0.8"]])] {
        let mut document = mrac();
        document["constants"]["bounds"]["diagonal_kg_m2"] = diagonal;
        cases.push((document, "midpoint_kg_m2"));
    }
    let mut rotor = mrac();
    rotor["family"]["arms"]["rotor_inertia_kg_m2"] = json!(["0.1", "1.2"]);
    cases.push((rotor, "midpoint_kg_m2"));
    // M_ii is at most D_hi,i and at least m_lo; at least D_lo,i and at most m_hi.
    for diagonal in [json!([["0.01", "0.5"], ["0.09", "4"]]), json!([["0.5", "6"], ["4", "7"]])] {
        let mut document = aic();
        document["family"]["arms"]["rotor_inertia_kg_m2"] = json!(["0", "0"]);
        document["constants"]["bounds"]["diagonal_kg_m2"] = diagonal;
        cases.push((document, "diagonal_kg_m2"));
    }
    for (document, quantity) in cases {
        let claim = exponential(json!([]));
        match flaw(document, claim) {
            Flaw::Quantity { quantity: found, .. } => assert_eq!(found, quantity),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_refusal_that_rests_on_sampled_constants_says_so() {
    let text = words(mrac(), unstable_velocity_loop());
    assert!(text.starts_with("Refused, if the stated constants hold: "), "{text}");
}

#[test]
fn a_margin_says_the_interval_that_was_checked() {
    let text = words(aic(), exponential(moved("least-friction", "0.5")));
    assert!(text.contains("with viscous friction of 0.5 to 3 N m s/rad on every joint"), "{text}");
    // Beyond the family's largest the value alone is checked.
    let text = words(aic(), exponential(moved("least-friction", "4")));
    assert!(text.contains("with viscous friction of 4 N m s/rad on every joint"), "{text}");
    let text = words(aic(), exponential(moved("least-rotor-inertia", "0.05")));
    assert!(text.contains("with rotor inertia of 0.05 to 0.2 kg m^2 on every joint"), "{text}");
    let text = words(aic(), exponential(moved("largest-inertia", "6")));
    assert!(text.contains("with inertia eigenvalues of 0.1 to 6 kg m^2"), "{text}");
}

fn sampled(margins: Value) -> Value {
    json!({
        "kind": "sampled", "sampling": timing("0"), "rate_per_s": "0.1", "delay_margin_s": "0.001", "margins": margins,
    })
}

fn timing(delay_s: &str) -> Value {
    json!({"plant": "semi-implicit", "period_s": "0.001", "delay_s": delay_s})
}

#[test]
fn the_margins_of_a_sampled_loop_name_their_delays() {
    let text = words(aic(), sampled(moved("least-friction", "0.5")));
    let wanted =
        "up to 1 ms; with a delay of any whole number of samples up to 0 ms it is still stable, at no certified rate";
    assert!(text.contains(wanted), "{text}");
}

#[test]
fn configurations_are_those_of_the_set() {
    for claim in [exponential(json!([])), sampled(json!([]))] {
        assert!(words(aic(), claim.clone()).contains("at rest at any configuration"));
        assert!(!words(aic(), claim.clone()).contains("of the set"));
        let mut document = aic();
        document["constants"]["over"] = box_of("0.5");
        assert!(words(document, claim).contains("at rest at any configuration of the set"));
    }
}

fn not_proved(of: &str, reason: &str, sampling: Value) -> Value {
    json!({"kind": "not-proved", "of": of, "sampling": sampling, "distance": null, "reason": reason, "remedies": []})
}

#[test]
fn what_a_reason_says_of_loops_and_gains_is_checked() {
    let mut steep = aic();
    steep["family"]["gravity_compensation"] = json!(false);
    steep["constants"]["bounds"]["k_g_n_m_per_rad"] = json!("3000");
    for (of, sampling) in [("exponential", json!(null)), ("sampled", timing("0.001"))] {
        words(aic(), not_proved(of, "too-slow", sampling.clone()));
        assert!(matches!(flaw(steep.clone(), not_proved(of, "too-slow", sampling)), Flaw::Polynomial { .. }));
    }
    flaw(aic(), not_proved("region", "too-slow", json!(null)));
    let mut unequal = aic();
    unequal["gains"]["kappa_a"] = json!(["700", "600"]);
    let mut released = mrac();
    released["gains"]["law"] = json!("released-code");
    for (document, of, reason, borne_out) in [
        (aic(), "region", "other-controller", false),
        (aic(), "pi-exponential", "other-controller", true),
        (mrac(), "region", "other-controller", true),
        (mrac(), "pi-exponential", "other-controller", false),
        (aic(), "region", "unequal-gains", false),
        (unequal, "region", "unequal-gains", true),
        (mrac(), "adaptive-convergence", "released-code", false),
        (released, "adaptive-convergence", "released-code", true),
    ] {
        let claim = not_proved(of, reason, json!(null));
        if borne_out {
            words(document, claim);
        } else {
            assert!(matches!(flaw(document, claim), Flaw::Quantity { quantity: "reason", .. }), "{of} {reason}");
        }
    }
}

/// The least inertia at the most negative gravity stiffness.
fn refused(q_rad: &str) -> Value {
    json!({
        "kind": "refused", "of": "exponential", "sampling": null, "rate_per_s": "0",
        "point": {"inertia_kg_m2": "0.1", "friction_n_m_s_per_rad": "1", "stiffness_n_m_per_rad": "-3000"},
        "attained": {
            "q_rad": [q_rad, "0"], "link_mass_scale": ["1", "1"], "payload_kg": "0", "rotor_inertia_kg_m2": "0.1",
            "friction_n_m_s_per_rad": "1", "eigenvalue_per_s": ["1", "0"],
        },
        "remedies": [],
    })
}

#[test]
fn an_arm_that_a_refusal_names_stands_in_the_set() {
    let mut document = aic();
    document["family"]["gravity_compensation"] = json!(false);
    document["constants"]["bounds"]["k_g_n_m_per_rad"] = json!("3000");
    words(document.clone(), refused("0.6"));
    document["constants"]["over"] = box_of("0.5");
    words(document.clone(), refused("0.4"));
    assert!(matches!(flaw(document, refused("0.6")), Flaw::Quantity { quantity: "q_rad", .. }));
}

#[test]
fn a_record_is_about_an_arm_by_name_and_has_to_be_trusted() {
    let mut value = aic();
    let plain = claimed(value.clone(), &[exponential(json!([]))]);
    let record = Record {
        schema: 0,
        arm: plain.arm.clone(),
        arms: plain.family.arms.clone(),
        over: plain.constants.over.clone(),
        bounds: plain.constants.bounds.clone(),
        proofs: Vec::new(),
        sha256: String::new(),
    }
    .sealed();
    value["constants"]["evidence"] = json!({"kind": "proved", "record_sha256": record.sha256});
    let certificate =
        checked(&claimed(value.clone(), &[exponential(json!([]))]), std::slice::from_ref(&record)).unwrap();
    assert!(certificate.assumptions()[0].text.contains("one that the reader trusts"));
    value["arm"]["name"] = json!("another");
    let renamed = checked(&claimed(value, &[exponential(json!([]))]), &[record]);
    assert!(matches!(renamed, Err(Rejection::Record { .. })), "{renamed:?}");
}
