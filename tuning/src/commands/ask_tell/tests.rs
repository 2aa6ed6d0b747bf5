//! Conversations with partners who make mistakes.

use std::io::Read;
use std::sync::{Arc, Mutex};

use proptest::prelude::*;
use serde_json::{Value, json};

use certune::closed_loop::AicTable;

use super::*;

type Said = Arc<Mutex<Vec<u8>>>;

/// Somebody who says `input` whatever is asked, and what is said to them.
fn talk(input: &str) -> (Talk<&[u8], Shared>, Gains, Said) {
    let gains = AicTable::uniform(1.0).into();
    let said = Arc::new(Mutex::new(Vec::new()));
    (Talk::new(Lines::new(input.as_bytes(), Shared(Arc::clone(&said)))), gains, said)
}

#[test]
fn answers_come_in_any_order_and_bad_lines_lose_nothing() {
    let lines = [
        "{\"tell\":{\"id\":1,\"failed\":true}}",
        "",
        "not json",
        "{\"tell\":{\"id\":7,\"score\":1}}",
        "{\"tell\":{\"id\":0}}",
        "{\"tell\":{\"id\":0,\"score\":NaN}}",
        "{\"tell\":{\"id\":0,\"score\":1e999}}",
        "{\"tell\":{\"id\":1,\"score\":3}}",
        "{\"tell\":{\"id\":0,\"score\":2.5,\"colour\":1}}",
        "{\"tell\":{\"id\":0,\"score\":2.5}}",
    ];
    let text = lines.join("\n");
    let (mut talk, gains, said) = talk(&text);
    let answers = talk.answers(&[gains.clone(), gains]).unwrap().unwrap();
    let expected =
        [Outcome::Simulated { cost: Finite::new(2.5).unwrap() }, Outcome::Diverged { at_s: Finite::saturating(0.0) }];
    assert_eq!(answers, expected);
    let said = String::from_utf8(said.lock().unwrap().clone()).unwrap();
    let errors: Vec<&str> = said.lines().filter(|line| line.contains("\"error\"")).collect();
    assert_eq!(errors.len(), 7, "{said}");
    for (line, number) in errors.iter().zip([3, 4, 5, 6, 7, 8, 9]) {
        assert!(line.contains(&format!("\"line\":{number},")), "{line}");
    }
}

#[test]
fn an_input_that_ends_leaves_no_answer() {
    let (mut talk, gains, _) = talk("{\"tell\":{\"id\":0,\"score\":1}}\n");
    assert_eq!(talk.answers(&[gains.clone(), gains]).unwrap(), None);
}

/// A line that is no answer.
#[derive(Clone, Debug)]
enum Mistake {
    Bytes(Vec<u8>),
    NoNumber(&'static str),
    /// Neither a score nor a failure, of a candidate that is waited for.
    Missing,
    Both,
    /// About a candidate that has not been asked for.
    Early(usize),
    /// About one whose answer stands, of this generation or an earlier one; the share says which.
    Late(f64),
}

fn mistake() -> impl Strategy<Value = Mistake> {
    prop_oneof![
        proptest::collection::vec(any::<u8>().prop_filter("one line", |byte| *byte != b'\n'), 1..40)
            .prop_filter("not blank", |bytes| !bytes.iter().all(u8::is_ascii_whitespace))
            .prop_map(Mistake::Bytes),
        Just(Mistake::Bytes(b"{\"tell\":{\"id\":0,\"score\":\xff}}".to_vec())),
        prop::sample::select(vec!["NaN", "Infinity", "-Infinity", "1e999", "\"1.0\"", "null", "[]", "true"])
            .prop_map(Mistake::NoNumber),
        Just(Mistake::Missing),
        Just(Mistake::Both),
        (0..1000_usize).prop_map(Mistake::Early),
        (0.0..1.0).prop_map(Mistake::Late),
    ]
}

/// Hears what is said, answers all of a generation in an order of its own, and makes mistakes in between.
struct Partner {
    said: Said,
    heard: usize,
    asked: usize,
    waiting: Vec<(usize, f64)>,
    /// What is wrong with the next line, if anything, and which answer it is otherwise.
    mistakes: std::vec::IntoIter<(Option<Mistake>, usize)>,
    made: Arc<Mutex<usize>>,
    line: Vec<u8>,
    read: usize,
}

impl Partner {
    /// Reads the questions that have come since.
    fn listen(&mut self) {
        let said = self.said.lock().unwrap();
        let new = String::from_utf8(said[self.heard..].to_vec()).unwrap();
        self.heard = said.len();
        for ask in new.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()) {
            if let Some(ask) = ask.get("ask") {
                self.asked += 1;
                self.waiting.push((ask["id"].as_u64().unwrap() as usize, score(&ask["gains"])));
            }
        }
    }

    /// A mistake, or the next answer.
    fn next_line(&mut self) -> Vec<u8> {
        self.listen();
        let (mistake, pick) = self.mistakes.next().unwrap_or((None, 0));
        let Some((open, _)) = self.waiting.first().copied() else { return Vec::new() };
        let answered = |share: f64| {
            let done: Vec<usize> =
                (0..self.asked).filter(|id| self.waiting.iter().all(|(open, _)| open != id)).collect();
            done.get((share * done.len() as f64) as usize).copied()
        };
        let tell = |tell: Value| Some(json!({ "tell": tell }).to_string().into_bytes());
        let line = mistake.and_then(|mistake| match mistake {
            Mistake::Bytes(bytes) => Some(bytes),
            Mistake::NoNumber(word) => Some(format!("{{\"tell\":{{\"id\":{open},\"score\":{word}}}}}").into_bytes()),
            Mistake::Missing => tell(json!({"id": open})),
            Mistake::Both => tell(json!({"id": open, "score": 1, "failed": true})),
            Mistake::Early(by) => tell(json!({"id": self.asked + by, "score": 0})),
            Mistake::Late(share) => answered(share).and_then(|id| tell(json!({"id": id, "score": 0}))),
        });
        if let Some(mut line) = line {
            *self.made.lock().unwrap() += 1;
            line.push(b'\n');
            return line;
        }
        let (id, score) = self.waiting.remove(pick % self.waiting.len());
        format!("{}\n", json!({"tell": {"id": id, "score": score}})).into_bytes()
    }
}

impl Read for Partner {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.read == self.line.len() {
            (self.line, self.read) = (self.next_line(), 0);
        }
        let count = buffer.len().min(self.line.len() - self.read);
        buffer[..count].copy_from_slice(&self.line[self.read..self.read + count]);
        self.read += count;
        Ok(count)
    }
}

/// A writer that the partner hears.
struct Shared(Said);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A bowl around other gains than the published ones.
fn score(gains: &Value) -> f64 {
    let aims = [("kappa_mu", 20.0), ("kappa_a", 2000.0), ("sigma_dq", 0.5), ("sigma_mu", 2.0), ("sigma_dmu", 30.0)];
    1.0 + aims.iter().map(|(name, at)| (gains[name].as_f64().unwrap() / at).ln().powi(2)).sum::<f64>()
}

/// What is asked, how many lines are refused and how many mistakes are made, and the last line.
fn session(budget: usize, mistakes: Vec<(Option<Mistake>, usize)>) -> (Vec<Value>, usize, usize, Value) {
    let said = Arc::new(Mutex::new(Vec::new()));
    let made = Arc::new(Mutex::new(0));
    let partner = Partner {
        said: Arc::clone(&said),
        heard: 0,
        asked: 0,
        waiting: Vec::new(),
        mistakes: mistakes.into_iter(),
        made: Arc::clone(&made),
        line: Vec::new(),
        read: 0,
    };
    let file = catalogue::space(None, None).unwrap().space;
    let (space, start) = begun(&file, None).unwrap();
    let (_, start) = start.unwrap();
    let settings = SearchSettings::new(space.method(), budget, 1);
    // No buffer beyond a line: whatever is read is read in answer to what has been said.
    let lines = Lines::new(std::io::BufReader::new(partner), Shared(Arc::clone(&said)));
    let exit = converse(lines, None, &space, Some(&start), &settings).unwrap();
    assert_eq!(exit, Exit::Holds);
    let text = String::from_utf8(said.lock().unwrap().clone()).unwrap();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let asked = lines.iter().filter(|line| line.get("ask").is_some()).cloned().collect();
    let errors = lines.iter().filter(|line| line["error"]["message"].is_string()).count();
    let made = *made.lock().unwrap();
    (asked, errors, made, lines.last().unwrap().clone())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn a_session_with_mistakes_ends_like_a_clean_one(mistakes in proptest::collection::vec((proptest::option::of(mistake()), any::<usize>()), 0..300)) {
        let (asked, errors, made, done) = session(60, mistakes);
        let (clean, none, _, expected) = session(60, Vec::new());
        prop_assert_eq!(none, 0);
        prop_assert_eq!(errors, made, "a mistake is one error line");
        prop_assert_eq!(done, expected);
        prop_assert_eq!(asked, clean);
    }
}
