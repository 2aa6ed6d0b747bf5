//! Edits of every shipped certificate: without the hash they are rejected; with the hash recomputed a mutant is rejected or is itself a valid proof of
//! the statement it prints. The survivors are attacked: eigenvalues and simulations of members of the family, in arithmetic that shares
//! nothing with the check.
#![expect(clippy::unwrap_used, clippy::panic, reason = "test helpers")]

mod adaptive;
mod forge;
mod linear;
mod loops;
mod regions;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use certune::certify::to_json;
use certune::verify::{
    Bounds, Certificate, Claim, Document, Evidence, Grade, Number, Record, Rejection, Verdict, VerifyError, seal,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;
use serde_json::Value;

use forge::{fields, mutants, rehashed};

/// Edits of each kind for each field of each certificate.
const ROUNDS: usize = 1;

fn files(folder: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder)) else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "json"));
    files.sort();
    files
}

/// The proved constants that the certificates may rest on.
fn records() -> &'static [Record] {
    static RECORDS: OnceLock<Vec<Record>> = OnceLock::new();
    RECORDS.get_or_init(|| {
        let stored = ["tuning/constants", "proofs/records"].into_iter().flat_map(files);
        stored.map(|file| Record::parse(&std::fs::read_to_string(file).unwrap()).unwrap().unwrap()).collect()
    })
}

/// Every shipped certificate with its name.
fn originals() -> &'static [(String, String)] {
    static TEXTS: OnceLock<Vec<(String, String)>> = OnceLock::new();
    TEXTS.get_or_init(|| {
        let shipped = files("proofs/certificates").into_iter().chain(files("tuning/results/panda-aic-1"));
        let named = shipped.map(|file| {
            let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read_to_string(file).unwrap())
        });
        named.filter(|(name, _)| name != "run").collect()
    })
}

fn original(name: &str) -> &'static str {
    &originals().iter().find(|(known, _)| known == name).unwrap().1
}

fn verify(text: &str) -> Result<Result<Certificate, Rejection>, VerifyError> {
    certune::verify::verify(text, records())
}

fn accepted(text: &str) -> Option<Certificate> {
    verify(text).ok()?.ok()
}

/// Everything that is claimed is attacked.
fn attack(document: &Document, edit: &str) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut uniform = || (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
    for entry in &document.claims {
        linear::attack(document, &entry.claim, edit, &mut uniform);
        regions::attack(document, &entry.claim, edit, &mut uniform);
        adaptive::attack(document, &entry.claim, edit, &mut uniform);
    }
}

#[test]
fn the_originals_withstand_attack_themselves() {
    originals().par_iter().for_each(|(name, text)| {
        let certificate = accepted(text).unwrap_or_else(|| panic!("{name}: rejected"));
        attack(certificate.document(), name);
    });
    for (name, verdict) in [
        ("exponential", Verdict::Holds),
        ("region", Verdict::Holds),
        ("exponential--libfranka-uncompensated", Verdict::Refused),
    ] {
        assert_eq!(accepted(original(name)).unwrap().checked()[0].verdict, verdict);
    }
}

/// The attacks are worth something: each kind of statement, made false, is contradicted.
#[test]
fn false_statements_do_not_withstand_attack() {
    let number = |text: &str| -> Number { text.parse().unwrap() };
    type Lie<'a> = (&'a str, usize, &'a dyn Fn(&mut Claim));
    let lies: [Lie<'_>; 12] = [
        ("exponential", 0, &|c| {
            if let Claim::Exponential(c) = c {
                c.rate_per_s = number("0.9")
            }
        }),
        ("sampled", 0, &|c| {
            if let Claim::Sampled(c) = c {
                c.rate_per_s = number("1.2")
            }
        }),
        ("sampled", 0, &|c| {
            if let Claim::Sampled(c) = c {
                c.delay_margin_s = number("0.003")
            }
        }),
        ("region", 0, &|c| {
            if let Claim::Region(c) = c {
                c.radius_rad = number("1.3")
            }
        }),
        ("joint-region", 0, &|c| {
            if let Claim::JointRegion(c) = c {
                c.radii_rad[0] = number("0.6")
            }
        }),
        ("sampled-region", 0, &|c| {
            if let Claim::SampledRegion(c) = c {
                c.radius_rad = number("1.4")
            }
        }),
        ("moving-goal", 1, &|c| {
            if let Claim::MovingGoal(c) = c {
                c.goal_speed_rad_per_s = number("1")
            }
        }),
        ("disturbance", 0, &|c| {
            if let Claim::Disturbance(c) = c {
                c.excursion_rad = number("0.29")
            }
        }),
        ("lyapunov", 0, &|c| {
            if let Claim::Lyapunov(c) = c {
                c.regions = vec![certune::verify::PlaneRegion::HalfPlane { rate_per_s: number("0.5") }];
            }
        }),
        ("adaptive-convergence", 0, &|c| {
            if let Claim::AdaptiveConvergence(c) = c {
                c.start_radius_rad = number("0.1")
            }
        }),
        ("pi-exponential", 0, &|c| {
            if let Claim::PiExponential(c) = c {
                c.accumulated_k0_n_m_per_rad = number("60")
            }
        }),
        ("exponential--libfranka-uncompensated", 0, &|c| {
            if let Claim::Refused(c) = c {
                c.point.stiffness_n_m_per_rad = number("5");
            }
        }),
    ];
    for (name, entry, lie) in lies {
        let mut document: Document = serde_json::from_str(original(name)).unwrap();
        let claim = &mut document.claims[entry].claim;
        let before = claim.clone();
        lie(claim);
        assert_ne!(*claim, before, "{name} was not changed");
        let caught = std::panic::catch_unwind(|| attack(&document, name));
        assert!(caught.is_err(), "the attack does not see that {name} is false");
    }
}

#[test]
fn an_edit_without_rehashing_is_always_rejected() {
    let tried: usize = originals()
        .par_iter()
        .enumerate()
        .map(|(k, (name, text))| {
            let edits = mutants(text, ROUNDS, k as u64);
            for mutant in &edits {
                assert!(accepted(&mutant.value.to_string()).is_none(), "{name}: {} accepted", mutant.edit);
            }
            edits.len()
        })
        .sum();
    println!("{tried} edits without re-hashing, all rejected");
    assert!(tried >= 1000);
}

#[test]
fn with_the_hash_recomputed_no_mutant_proves_a_false_statement() {
    let edits: Vec<_> = originals()
        .iter()
        .enumerate()
        .flat_map(|(k, (name, text))| mutants(text, ROUNDS, 100 + k as u64).into_iter().map(move |edit| (name, edit)))
        .collect();
    let survived: usize = edits
        .par_iter()
        .map(|(name, mutant)| {
            let Some(rehashed_text) = rehashed(&mutant.value) else { return 0 };
            // A cleverer forger also rewrites the words: then only the proof itself can stop him.
            let resealed = to_json(&seal(serde_json::from_str(&rehashed_text).unwrap())).unwrap();
            let both = [&rehashed_text, &resealed].into_iter().filter_map(|text| accepted(text));
            let documents: Vec<Document> = both.map(|certificate| certificate.document().clone()).collect();
            if let Some(document) = documents.first() {
                attack(document, &format!("{name}: {}", mutant.edit));
            }
            documents.len()
        })
        .sum();
    let tried = 2 * edits.len();
    println!(
        "{tried} re-hashed or re-sealed mutants: {} rejected, {survived} survived and withstood attack",
        tried - survived
    );
    assert!(tried >= 1000 && survived > 0, "an attack without survivors attacks nothing");
}

/// The largest takes no longer than a reader would wait.
#[test]
fn every_shipped_certificate_is_checked_in_no_time() {
    let mut slowest = (Duration::ZERO, String::new());
    for (name, text) in originals() {
        let timed = || {
            let start = Instant::now();
            assert!(accepted(text).is_some(), "{name}");
            start.elapsed()
        };
        let best = (0..3).map(|_| timed()).min().unwrap();
        println!("{name}: {} bytes, {:.3} s", text.len(), best.as_secs_f64());
        slowest = slowest.max((best, name.clone()));
    }
    println!("slowest: {} in {:.3} s", slowest.1, slowest.0.as_secs_f64());
    assert!(slowest.0 < Duration::from_secs(2));
}

#[test]
fn truncated_and_scrambled_texts_are_unreadable_and_never_panic() {
    for (name, text) in originals() {
        for length in (0..text.len() - 2).step_by(text.len() / 50) {
            assert!(verify(&text[..length]).is_err(), "{name} truncated to {length} bytes");
        }
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..50 {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..1 + rng.next_u64() % 8 {
                let place = (rng.next_u64() % bytes.len() as u64) as usize;
                bytes[place] = (rng.next_u64() % 95 + 32) as u8;
            }
            let Ok(scrambled) = String::from_utf8(bytes) else { continue };
            // Only blanks between tokens may differ from the original.
            if accepted(&scrambled).is_some() {
                let compact = |t: &str| serde_json::from_str::<Value>(t).unwrap().to_string();
                assert_eq!(compact(&scrambled), compact(text));
            }
        }
    }
}

/// Numbers that would take minutes or gigabytes, or that a reader would mistake, in every field of every document.
#[test]
fn hostile_numbers_are_refused_everywhere() {
    let digits = "1".repeat(300);
    let hostile = ["1e-2147483648", "1p-2147483648", "1e1200", "1e-1200", "1e+-3", "007", "-0", "NaN", "1p9", &digits];
    let tried: usize = originals()
        .par_iter()
        .map(|(name, text)| {
            let original: Value = serde_json::from_str(text).unwrap();
            let mut tried = 0;
            // Witnesses and the matrices of a polytope are dyadic numbers that nobody reads.
            let read = fields(&original)
                .into_iter()
                .filter(|(field, _)| !field.contains("witness") && !field.contains("polytope"));
            for path in read.flat_map(|(_, paths)| [paths[0].clone(), paths[paths.len() - 1].clone()]) {
                for number in hostile {
                    let mut mutant = original.clone();
                    let leaf = mutant.pointer_mut(&path).unwrap();
                    if !leaf.is_string() {
                        continue;
                    }
                    *leaf = Value::String(number.to_owned());
                    tried += 1;
                    let Ok(document) = serde_json::from_value::<Document>(mutant) else { continue };
                    // Statements, hash and description are written again by `seal`; everything else must be refused.
                    let rewritten = ["/about", "/sha256"].contains(&path.as_str()) || path.ends_with("/statement");
                    let name_alone = path == "/arm/name";
                    let stands = rewritten || name_alone || accepted(&to_json(&seal(document)).unwrap()).is_none();
                    assert!(stands, "{name}: {number} at {path}");
                }
            }
            tried
        })
        .sum();
    println!("{tried} hostile numbers refused");
}

/// An arm whose rotors alone are heavier than `m_hi` does not exist, and everything would be true of it.
#[test]
fn a_family_without_members_is_refused() {
    let mut document: Document = serde_json::from_str(original("exponential")).unwrap();
    document.family.arms.rotor_inertia_kg_m2 = ["10".parse().unwrap(), "20".parse().unwrap()];
    assert!(verify(&to_json(&seal(document)).unwrap()).unwrap().is_err());
}

/// A refusal that names an arm outside the family is rejected.
#[test]
fn an_attained_arm_must_belong_to_the_family() {
    let document: Document = serde_json::from_str(original("exponential--libfranka-uncompensated")).unwrap();
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

/// The constants of a document as a record, as if they had been proved.
fn as_proved(document: &Document) -> (Document, Record) {
    let record = Record {
        schema: 1,
        arm: document.arm.clone(),
        arms: document.family.arms.clone(),
        over: document.constants.over.clone(),
        bounds: document.constants.bounds.clone(),
        proofs: Vec::new(),
        sha256: String::new(),
    }
    .sealed();
    let mut proved = document.clone();
    proved.constants.evidence = Evidence::Proved { record_sha256: record.sha256.clone() };
    (seal(proved), record)
}

/// Every bound of ours is as wide as theirs, in floating point.
fn no_tighter(ours: &Bounds, theirs: &Bounds) -> bool {
    let above = |a: &Number, b: &Number| a.to_f64() >= b.to_f64();
    let maybe = |a: &Option<Number>, b: &Option<Number>| a.as_ref().is_none_or(|a| above(a, b.as_ref().unwrap()));
    let lists = |a: &[Number], b: &[Number]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| above(a, b));
    let diagonals = ours.diagonal_kg_m2.as_ref().is_none_or(|[lower, upper]| {
        let [lower_known, upper_known] = theirs.diagonal_kg_m2.as_ref().unwrap();
        lists(lower_known, lower) && lists(upper, upper_known)
    });
    let torques = ours.gravity_torque_n_m.as_ref();
    let torques = torques.is_none_or(|torques| lists(torques, theirs.gravity_torque_n_m.as_ref().unwrap()));
    above(&theirs.m_lo_kg_m2, &ours.m_lo_kg_m2)
        && above(&ours.m_hi_kg_m2, &theirs.m_hi_kg_m2)
        && above(&ours.k_g_n_m_per_rad, &theirs.k_g_n_m_per_rad)
        && above(&ours.k_c_kg_m2, &theirs.k_c_kg_m2)
        && maybe(&ours.k_r, &theirs.k_r)
        && maybe(&ours.k_m, &theirs.k_m)
        && diagonals
        && torques
        && (ours.inertia.is_none() || ours.inertia == theirs.inertia)
}

/// With `Evidence::Proved` an edited constant stands only when it is wider than the record's.
#[test]
fn constants_that_are_called_proved_are_the_records() {
    let (mut rejected, mut wider) = (0, 0);
    for (index, (name, text)) in originals().iter().enumerate() {
        let (document, record) = as_proved(&serde_json::from_str(text).unwrap());
        let known = std::slice::from_ref(&record);
        let stands = |document: &Document| certune::verify::verify(&to_json(document).unwrap(), known).unwrap();
        let certificate = stands(&document).unwrap_or_else(|rejection| panic!("{name}: {rejection}"));
        assert!(certificate.checked().iter().all(|entry| entry.grade.is_none_or(|grade| grade == Grade::Proved)));
        assert!(certune::verify::verify(&to_json(&document).unwrap(), &[]).unwrap().is_err(), "{name}: no record");
        let head = ["/constants", "/family/arms", "/arm/sha256"];
        for mutant in mutants(&to_json(&document).unwrap(), 3, 200 + index as u64) {
            if !head.iter().any(|part| mutant.edit.starts_with(part)) {
                continue;
            }
            let Ok(edited) = serde_json::from_value::<Document>(mutant.value) else { continue };
            let edited = seal(edited);
            match stands(&edited) {
                Ok(certificate) => {
                    let claims_proof = matches!(edited.constants.evidence, Evidence::Proved { .. });
                    assert!(
                        !claims_proof || no_tighter(&edited.constants.bounds, &record.bounds),
                        "{name}: {}",
                        mutant.edit
                    );
                    attack(certificate.document(), &mutant.edit);
                    wider += 1;
                }
                Err(_) => rejected += 1,
            }
        }
        // The record itself: an edit shows.
        let text = serde_json::to_string(&record).unwrap();
        for mutant in mutants(&text, 1, 300 + index as u64) {
            assert!(!Record::parse(&mutant.value.to_string()).is_ok_and(|read| read.is_ok()), "{}", mutant.edit);
        }
    }
    println!("{rejected} edits of constants called proved rejected, {wider} wider ones stand");
    assert!(rejected > 100);
}
