//! Edits of a certificate's text: every field, digits and signs, exchanged entries, lists cut short, turned round, emptied, with a double.

use std::collections::BTreeMap;

use certune::certify::to_json;
use certune::verify::Document;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use serde_json::Value;
use sha2::{Digest, Sha256};

/// What was done, and the edited text as a value.
pub struct Mutant {
    pub edit: String,
    pub value: Value,
}

/// A number below `bound`.
fn below(rng: &mut ChaCha8Rng, bound: usize) -> usize {
    (rng.next_u64() % bound as u64) as usize
}

/// Paths of every node of a JSON value, its own first.
fn nodes(value: &Value, path: &str, found: &mut Vec<String>) {
    found.push(path.to_owned());
    match value {
        Value::Object(map) => map.iter().for_each(|(key, v)| nodes(v, &format!("{path}/{key}"), found)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, v)| nodes(v, &format!("{path}/{k}"), found)),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// The nodes that differ only by their place in a list, together: a field of the format.
pub fn fields(value: &Value) -> BTreeMap<String, Vec<String>> {
    let mut paths = Vec::new();
    nodes(value, "", &mut paths);
    let mut fields = BTreeMap::<String, Vec<String>>::new();
    for path in paths {
        let parts = path.split('/').map(|part| if part.parse::<usize>().is_ok() { "*" } else { part });
        fields.entry(parts.collect::<Vec<_>>().join("/")).or_default().push(path);
    }
    fields
}

/// Another value of the same type: a digit changed, a sign flipped, the number scaled, a flag inverted.
fn mutated(value: &Value, rng: &mut ChaCha8Rng) -> Value {
    match value {
        Value::Bool(flag) => Value::Bool(!flag),
        Value::Number(n) => match rng.next_u64() % 3 {
            0 => Value::from(0),
            1 => Value::from(u64::MAX),
            _ => Value::from(n.as_u64().unwrap_or(0) + 1 + rng.next_u64() % 7),
        },
        Value::String(text) if text.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
            let negated = text.strip_prefix('-').map_or_else(|| format!("-{text}"), str::to_owned);
            let digits: Vec<usize> =
                text.bytes().enumerate().filter(|(_, c)| c.is_ascii_digit()).map(|(k, _)| k).collect();
            let place = digits[below(rng, digits.len())];
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

/// What can be done to a list.
const LIST_EDITS: [&str; 5] = ["exchanged", "cut", "doubled", "turned round", "emptied"];

fn rearranged(list: &[Value], edit: usize, rng: &mut ChaCha8Rng) -> Vec<Value> {
    let mut list = list.to_vec();
    let (i, j) = (below(rng, list.len()), below(rng, list.len()));
    match edit {
        0 => list.swap(i, j),
        1 => {
            list.pop();
        }
        2 => list.push(list[i].clone()),
        3 => list.reverse(),
        _ => list.clear(),
    }
    list
}

/// Edits of every field: `rounds` of each kind that changes anything.
pub fn mutants(text: &str, rounds: usize, seed: u64) -> Vec<Mutant> {
    let original: Value = serde_json::from_str(text).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut found = Vec::new();
    for paths in fields(&original).into_values() {
        for _ in 0..rounds {
            let path = &paths[below(&mut rng, paths.len())];
            if path.is_empty() || path == "/sha256" {
                continue;
            }
            let mut keep = |what: &str, edited: Value| {
                let mut value = original.clone();
                *value.pointer_mut(path).unwrap() = edited;
                if value != original {
                    found.push(Mutant { edit: format!("{path} {what}"), value });
                }
            };
            match original.pointer(path).unwrap() {
                Value::Array(list) if !list.is_empty() => {
                    for (edit, name) in LIST_EDITS.iter().enumerate() {
                        keep(name, Value::Array(rearranged(list, edit, &mut rng)));
                    }
                }
                Value::Array(_) => {}
                Value::Object(map) => {
                    let keys: Vec<&String> = map.keys().collect();
                    let (a, b) = (keys[below(&mut rng, keys.len())], keys[below(&mut rng, keys.len())]);
                    let (mut swapped, mut shorter, mut longer) = (map.clone(), map.clone(), map.clone());
                    swapped.insert(a.clone(), map[b].clone());
                    swapped.insert(b.clone(), map[a].clone());
                    keep("with two fields exchanged", Value::Object(swapped));
                    shorter.remove(a);
                    keep("without a field", Value::Object(shorter));
                    longer.insert("proof".to_owned(), Value::from("obvious"));
                    keep("with a field more", Value::Object(longer));
                }
                leaf => keep("edited", mutated(leaf, &mut rng)),
            }
        }
    }
    found
}

/// The hash that `verify` expects, computed without it.
pub fn rehashed(mutant: &Value) -> Option<String> {
    let mut document: Document = serde_json::from_value(mutant.clone()).ok()?;
    document.sha256 = String::new();
    let digest = Sha256::digest(serde_json::to_vec(&document).unwrap());
    document.sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    to_json(&document).ok()
}
