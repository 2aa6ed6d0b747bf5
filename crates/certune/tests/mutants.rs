//! Edits of a certificate: without the hash they are rejected; with the hash recomputed a mutant is rejected or is itself a
//! valid proof of the statement it prints. The survivors are attacked.
#![expect(clippy::unwrap_used, reason = "test helpers")]

use std::sync::OnceLock;

use certune::certify::{FamilyValues, to_json};
use certune::control::aic::AicGains;
use certune::dynamics::Robot;
use certune::linsys::Loop;
use certune::verify::{
    Certificate, Claim, ClaimKind, Document, RegionClaim, Rejection, Verdict, VerifyError, family_box, seal,
};
use certune::{ArmCertifier, certificate_text};
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde_json::Value;
use sha2::{Digest, Sha256};

/// These certificates rest on no record.
fn verify(text: &str) -> Result<Result<Certificate, Rejection>, VerifyError> {
    certune::verify::verify(text, &[])
}

/// A certificate that holds (both claims), one without compensation, and a refusal.
fn originals() -> &'static [String] {
    static TEXTS: OnceLock<Vec<String>> = OnceLock::new();
    TEXTS.get_or_init(|| {
        [(true, 700.0, [1.0, 3.0]), (false, 700.0, [1.0, 3.0]), (false, 200.0, [0.0, 0.0])]
            .into_iter()
            .map(|(compensated, kappa_a, friction)| {
                let family = FamilyValues {
                    gravity_compensation: compensated,
                    friction_n_m_s_per_rad: friction,
                    mass_uncertainty: 0.0,
                    payload_kg: [0.0, 0.0],
                    rotor_inertia_kg_m2: [0.0, 0.0],
                };
                let gains = AicGains::<7> {
                    kappa_mu: [11.67; 7],
                    kappa_a: [kappa_a; 7],
                    sigma_q: [1.0; 7],
                    sigma_dq: [1.0; 7],
                    sigma_mu: [5.0; 7],
                    sigma_dmu: [10.0; 7],
                    reference_time_constant_s: [1.0; 7],
                };
                let certifier = ArmCertifier::new(&Robot::panda(), &family).unwrap();
                certificate_text(&certifier.certify(&gains, &[ClaimKind::Exponential, ClaimKind::Region]).unwrap())
                    .unwrap()
            })
            .collect()
    })
}

/// Paths of every leaf of a JSON value.
fn leaves(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, v)| leaves(v, &format!("{path}/{key}"), found)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| leaves(v, &format!("{path}/{k}"), found)),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => found.push(path.to_owned()),
    }
}

/// Another value of the same type: a digit changed, a sign flipped, the number scaled, a flag inverted.
fn mutated(value: &Value, rng: &mut ChaCha8Rng) -> Value {
    match value {
        Value::Bool(flag) => Value::Bool(!flag),
        Value::Number(n) => Value::from(n.as_u64().unwrap_or(0) + 1 + rng.next_u64() % 7),
        Value::String(text) if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
            let negated = text.strip_prefix('-').map_or_else(|| format!("-{text}"), str::to_owned);
            let digits: Vec<usize> =
                text.bytes().enumerate().filter(|(_, c)| c.is_ascii_digit()).map(|(k, _)| k).collect();
            let place = digits[(rng.next_u64() % digits.len() as u64) as usize];
            let mut changed = text.clone().into_bytes();
            changed[place] = b'0' + (changed[place] - b'0' + 1 + (rng.next_u64() % 8) as u8) % 10;
            match rng.next_u64() % 4 {
                0 => Value::String(negated),
                1 if !text.contains(['p', 'e']) => Value::String(format!("{text}e1")),
                2 if !text.contains(['p', 'e']) => Value::String(format!("{text}e-1")),
                _ => Value::String(String::from_utf8(changed).unwrap()),
            }
        }
        Value::String(text) => Value::String(text.chars().rev().collect()),
        Value::Null => Value::String("0".to_owned()),
        Value::Array(_) | Value::Object(_) => unreachable!("leaves only"),
    }
}

fn mutants(text: &str, count: usize, seed: u64) -> impl Iterator<Item = (String, Value)> {
    let original: Value = serde_json::from_str(text).unwrap();
    let mut paths = Vec::new();
    leaves(&original, "", &mut paths);
    paths.retain(|path| path != "/sha256");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(move |k| {
        let path = paths[k % paths.len()].clone();
        let mut mutant = original.clone();
        let leaf = mutant.pointer_mut(&path).unwrap();
        let mut other = mutated(leaf, &mut rng);
        while other == *leaf {
            other = mutated(leaf, &mut rng);
        }
        *leaf = other;
        (path, mutant)
    })
}

/// The hash that `verify` expects, computed without it.
fn rehashed(mutant: &Value) -> Option<String> {
    let mut document: Document = serde_json::from_value(mutant.clone()).ok()?;
    document.sha256 = String::new();
    let digest = Sha256::digest(serde_json::to_vec(&document).unwrap());
    document.sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    to_json(&document).ok()
}

#[test]
fn an_edit_without_rehashing_is_always_rejected() {
    let mut rejected = 0;
    for (k, text) in originals().iter().enumerate() {
        for (path, mutant) in mutants(text, 200, k as u64) {
            let accepted = verify(&mutant.to_string()).is_ok_and(|verdict| verdict.is_ok());
            assert!(!accepted, "edit of {path} accepted");
            rejected += 1;
        }
    }
    println!("{rejected} edits without re-hashing, all rejected");
}

#[test]
fn with_the_hash_recomputed_no_mutant_proves_a_false_statement() {
    let (mut rejected, mut survived) = (0, 0);
    for (k, text) in originals().iter().enumerate() {
        for (path, mutant) in mutants(text, 250, 100 + k as u64) {
            let Some(rehashed_text) = rehashed(&mutant) else {
                rejected += 1;
                continue;
            };
            match verify(&rehashed_text) {
                Ok(Ok(certificate)) => {
                    survived += 1;
                    attack(certificate.document(), &path);
                }
                Ok(Err(_)) | Err(_) => rejected += 1,
            }
            // A cleverer forger also rewrites the words: then only the proof itself can stop him.
            let resealed = seal(serde_json::from_str(&rehashed_text).unwrap());
            if let Ok(Ok(certificate)) = verify(&to_json(&resealed).unwrap()) {
                survived += 1;
                attack(certificate.document(), &path);
            } else {
                rejected += 1;
            }
        }
    }
    println!("{rejected} re-hashed mutants rejected, {survived} survived and withstood attack");
    assert!(survived > 0, "an attack without survivors attacks nothing");
}

/// The one-joint loop of the AIC on an arm of constant inertia m, friction d and stiffness g: a member of every family whose
/// constants allow it. Its matrix is written out here once more.
fn one_joint(document: &Document, [m, d, g]: [f64; 3]) -> DMatrix<f64> {
    let gain = |list: &[certune::verify::Number]| list[0].to_f64();
    let gains = document.gains.aic().unwrap();
    let kappa_mu = gain(&gains.kappa_mu);
    let (sq, sdq) = (gain(&gains.sigma_q), gain(&gains.sigma_dq));
    let (a, av) = (kappa_mu / sq, kappa_mu / sdq);
    let (b, c) = (kappa_mu / gain(&gains.sigma_mu), kappa_mu / gain(&gains.sigma_dmu));
    let t = gain(&gains.reference_time_constant_s);
    let kappa_a = gain(&gains.kappa_a);
    #[rustfmt::skip]
    let entries = [
        // e     dq            m                   mu'                       mu''        u~
        0.0,     1.0,          0.0,                0.0,                      0.0,        0.0,
        -g / m,  -d / m,       0.0,                0.0,                      0.0,        1.0 / m,
        a,       0.0,          -a - b / (t * t),   1.0 - b / t,              0.0,        0.0,
        0.0,     av,           -b / t,             -av - b - c / (t * t),    1.0 - c / t, 0.0,
        0.0,     0.0,          0.0,                -c / t,                   -c,         0.0,
        -kappa_a / sq, -kappa_a / sdq, kappa_a / sq, kappa_a / sdq,          0.0,        0.0,
    ];
    DMatrix::from_row_slice(6, 6, &entries)
}

fn attack(document: &Document, path: &str) {
    let range = family_box(document);
    let ends = |interval: &[certune::verify::Number; 2]| [interval[0].to_f64(), interval[1].to_f64()];
    let (m, d, g) = (ends(&range.inertia), ends(&range.friction), ends(&range.stiffness));
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut uniform = || (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    for k in 0..40 {
        let share = |u: f64| if k < 8 { u.round() } else { u };
        let point = [
            m[0] * (m[1] / m[0]).powf(share(uniform())),
            d[0] + (d[1] - d[0]) * share(uniform()),
            g[0] + (g[1] - g[0]) * share(uniform()),
        ];
        let a = one_joint(document, point);
        for entry in &document.claims {
            match &entry.claim {
                Claim::Exponential(claim) => {
                    let abscissa = Loop::continuous(a.clone()).unwrap().spectral_abscissa_per_s();
                    let rate = claim.rate_per_s.to_f64();
                    assert!(abscissa < -rate + 1e-6 * (1.0 + rate), "{path}: {abscissa} against {rate} at {point:?}");
                }
                Claim::Region(claim) => region_survives(claim, &a, point, document.family.gravity_compensation, path),
                _ => {}
            }
        }
    }
}

/// With constant inertia and linear gravity the loop is linear, and V is a quadratic form: compare `V(0)` and `dV/dt` directly.
fn region_survives(claim: &RegionClaim, a: &DMatrix<f64>, [m, _, g]: [f64; 3], compensated: bool, path: &str) {
    let w = &claim.witness;
    // Coordinates e, dq, m, mu', mu'', u~: z is 0, 2, 3, 4, 5.
    let place = [0, 2, 3, 4, 5];
    let mut v = DMatrix::zeros(6, 6);
    v[(1, 1)] = w.p.to_f64() * m;
    let mut entries = w.s.iter();
    for i in 0..5 {
        v[(1, place[i])] = m * w.b[i].to_f64();
        v[(place[i], 1)] = v[(1, place[i])];
        for j in i..5 {
            let s = entries.next().unwrap().to_f64();
            v[(place[i], place[j])] = s;
            v[(place[j], place[i])] = s;
        }
    }
    // U - U(goal) - g(goal) e = g e^2 / 2 for a spring.
    v[(0, 0)] += w.p.to_f64() * g;
    let radius = claim.radius_rad.to_f64();
    let torque = if compensated { 0.0 } else { g * radius };
    let start = nalgebra::dvector![radius, 0.0, radius, 0.0, 0.0, torque];
    let at_start = start.dot(&(&v * &start));
    assert!(at_start <= 1.0 + 1e-9, "{path}: V starts at {at_start}");
    let slope = a.transpose() * &v + &v * a + &v * (2.0 * claim.rate_per_s.to_f64());
    // Scaled so that every coordinate weighs the same in V.
    let scale = DMatrix::from_diagonal(&v.diagonal().map(|x| x.abs().max(1e-12).sqrt().recip()));
    let worst = (&scale * slope * &scale).symmetric_eigenvalues().max();
    assert!(worst <= 1e-6, "{path}: dV/dt + 2 rate V has eigenvalue {worst}");
}

#[test]
fn the_originals_say_what_they_should() {
    for (text, expected) in originals().iter().zip([Verdict::Holds, Verdict::Holds, Verdict::Refused]) {
        let certificate = verify(text).unwrap().unwrap();
        assert_eq!(certificate.checked()[0].verdict, expected);
    }
}

#[test]
fn truncated_and_scrambled_texts_are_unreadable_and_never_panic() {
    let text = &originals()[0];
    for length in (0..text.len() - 2).step_by(97) {
        assert!(verify(&text[..length]).is_err(), "truncated to {length} bytes");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..500 {
        let mut bytes = text.clone().into_bytes();
        for _ in 0..1 + rng.next_u64() % 8 {
            let place = (rng.next_u64() % bytes.len() as u64) as usize;
            bytes[place] = (rng.next_u64() % 95 + 32) as u8;
        }
        if let Ok(scrambled) = String::from_utf8(bytes) {
            // Only blanks between tokens may differ from the original.
            if verify(&scrambled).is_ok_and(|verdict| verdict.is_ok()) {
                let compact = |t: &str| serde_json::from_str::<Value>(t).unwrap().to_string();
                assert_eq!(compact(&scrambled), compact(text));
            }
        }
    }
}

/// Numbers that would take minutes or gigabytes, or that a reader would mistake, in every place of every document.
#[test]
fn hostile_numbers_are_refused_everywhere() {
    let digits = "1".repeat(300);
    let hostile = ["1e-2147483648", "1p-2147483648", "1e1200", "1e-1200", "1e+-3", "007", "-0", "NaN", "1p9", &digits];
    let mut tried = 0;
    for text in originals() {
        let original: Value = serde_json::from_str(text).unwrap();
        let mut paths = Vec::new();
        leaves(&original, "", &mut paths);
        for path in paths.iter().filter(|path| !path.contains("witness")) {
            for number in hostile {
                let mut mutant = original.clone();
                let leaf = mutant.pointer_mut(path).unwrap();
                if !leaf.is_string() {
                    continue;
                }
                *leaf = Value::String(number.to_owned());
                tried += 1;
                let Ok(document) = serde_json::from_value::<Document>(mutant) else { continue };
                let accepted = verify(&to_json(&seal(document)).unwrap());
                // Statements, hash and description are written again by `seal`; everything else must be refused.
                let rewritten = ["/about", "/sha256"].contains(&path.as_str()) || path.ends_with("/statement");
                let name_alone = path == "/arm/name";
                assert!(
                    rewritten || name_alone || !accepted.is_ok_and(|verdict| verdict.is_ok()),
                    "{number} at {path}"
                );
            }
        }
    }
    println!("{tried} hostile numbers refused");
}

/// An arm whose rotors alone are heavier than `m_hi` does not exist, and everything would be true of it.
#[test]
fn a_family_without_members_is_refused() {
    let mut document: Document = serde_json::from_str(&originals()[0]).unwrap();
    document.family.arms.rotor_inertia_kg_m2 = ["10".parse().unwrap(), "20".parse().unwrap()];
    assert!(verify(&to_json(&seal(document)).unwrap()).unwrap().is_err());
}

/// A refusal that names an arm outside the family is rejected.
#[test]
fn an_attained_arm_must_belong_to_the_family() {
    let document: Document = serde_json::from_str(&originals()[2]).unwrap();
    type Edit = fn(&mut certune::verify::Attained);
    let edits: [Edit; 6] = [
        |a| a.q_rad.clear(),
        |a| a.link_mass_scale[0] = "-5".parse().unwrap(),
        |a| a.payload_kg = "99".parse().unwrap(),
        |a| a.rotor_inertia_kg_m2 = "-3".parse().unwrap(),
        |a| a.friction_n_m_s_per_rad = "1000".parse().unwrap(),
        |a| a.eigenvalue_per_s[0] = "-5".parse().unwrap(),
    ];
    for (k, edit) in edits.into_iter().enumerate() {
        let mut forged = document.clone();
        let Claim::Refused(refusal) = &mut forged.claims[0].claim else { panic!() };
        edit(refusal.attained.as_mut().unwrap());
        assert!(verify(&to_json(&seal(forged)).unwrap()).unwrap().is_err(), "edit {k}");
    }
    assert!(verify(&to_json(&seal(document)).unwrap()).unwrap().is_ok());
}
