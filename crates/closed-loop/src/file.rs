//! Files that people edit: TOML text into typed values, with errors that say where, what was expected and what to do.
//!
//! A file is read ([`load`], [`read_text`]) in three steps: TOML syntax, the schema version, the types. Every error is a [`FileError`]: the file, the
//! line and the column, the path of the key (`aic.kappa_mu`, `segments[2].goal_rad`) and a [`Problem`], which for a misspelled
//! key holds the nearest valid one.
//!
//! The types are ordinary `serde` types; those of this workspace refuse unknown keys (`deny_unknown_fields`). Limits: enums
//! are read from strings only, and a datetime is never a valid value.

mod node;

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use node::{Fault, Node};

/// The key that every file opens with.
const SCHEMA_KEY: &str = "schema";
/// Two words this similar (Jaro-Winkler, 0 to 1) are offered as each other's correction.
const SIMILAR: f64 = 0.7;

/// Where in a file something was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file, as the caller named it.
    pub file: PathBuf,
    /// Line from 1 and column from 1, in characters; absent when the file could not be read at all.
    pub line_column: Option<(usize, usize)>,
    /// The key, by its path from the top of the file; empty when no key is concerned.
    pub key: String,
}

impl std::fmt::Display for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.line_column {
            write!(f, ":{line}:{column}")?;
        }
        if self.key.is_empty() { Ok(()) } else { write!(f, ": key `{}`", self.key) }
    }
}

/// What is wrong at a [`Location`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// The operating system would not give the file.
    #[error("cannot be read ({kind}); check the path and its permissions")]
    Unreadable {
        /// What the operating system says.
        kind: std::io::ErrorKind,
    },
    /// The text is no TOML.
    #[error("is not valid TOML: {message}; correct the syntax at this place")]
    Syntax {
        /// The TOML parser's own words.
        message: String,
    },
    /// The file is of another schema version, newer or older than this program.
    #[error(
        "schema version {found} is not supported, expected {expected}; set `schema = {expected}` and adapt the keys"
    )]
    Schema {
        /// The version in the file.
        found: i64,
        /// The version this program reads.
        expected: i64,
    },
    /// A key that means nothing here.
    #[error("unknown key{}; valid keys are {}", suggestion(nearest), listed(expected))]
    UnknownKey {
        /// The valid key nearest in spelling, if any is near.
        nearest: Option<String>,
        /// All valid keys at this place.
        expected: Vec<String>,
    },
    /// A word that is none of those allowed as this key's value.
    #[error("unknown value `{found}`{}; valid values are {}", suggestion(nearest), listed(expected))]
    UnknownName {
        /// The word in the file.
        found: String,
        /// The valid word nearest in spelling, if any is near.
        nearest: Option<String>,
        /// All valid words.
        expected: Vec<String>,
    },
    /// A key that must be there is not.
    #[error("missing key; add it")]
    MissingKey,
    /// A key occurs twice.
    #[error("the key occurs twice; remove one")]
    DuplicateKey,
    /// The value has another type.
    #[error("has the wrong type: found {found}, expected {expected}")]
    WrongType {
        /// What the file holds.
        found: String,
        /// What the key takes.
        expected: String,
    },
    /// The value has the right type and is out of its range.
    #[error("is {found}, expected {expected}")]
    OutOfRange {
        /// What the file holds.
        found: String,
        /// What the key takes.
        expected: String,
    },
    /// A list has the wrong number of entries.
    #[error("has {found} entries, expected {expected}")]
    Length {
        /// Entries in the file.
        found: usize,
        /// What the key takes.
        expected: String,
    },
    /// A type's own rule is broken.
    #[error("is not acceptable: {reason}")]
    Rejected {
        /// The rule, in the type's words.
        reason: String,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|word| format!(", did you mean `{word}`?")).unwrap_or_default()
}

fn listed(words: &[String]) -> String {
    words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

/// A file that people edit could not be turned into its type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{location}: {problem}")]
pub struct FileError {
    /// The place.
    pub location: Location,
    /// What is wrong there.
    pub problem: Box<Problem>,
}

/// A problem at a key whose file is not known where it is noticed: when a file's numbers are checked against each other, or
/// bound to an arm.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("key `{key}`: {problem}")]
pub struct KeyError {
    /// The key, by its path from the top of its file.
    pub key: String,
    /// What is wrong there.
    pub problem: Problem,
}

impl KeyError {
    /// A list that should have had one entry per joint.
    pub fn per_joint(key: &str, found: usize, joints: usize) -> Self {
        let expected = format!("{joints}, one per joint; correct the list or choose another robot");
        Self { key: key.to_owned(), problem: Problem::Length { found, expected } }
    }

    /// A value outside its range.
    pub fn out_of_range(key: &str, found: impl std::fmt::Display, expected: &str) -> Self {
        let problem = Problem::OutOfRange { found: found.to_string(), expected: expected.to_owned() };
        Self { key: key.to_owned(), problem }
    }

    /// The same problem with its place in `text`, the content of `file`. A key that is not there is placed at the
    /// innermost table that is.
    pub fn locate(self, file: &Path, text: &str) -> FileError {
        let offset = DeTable::parse(text).ok().map_or(0, |table| offset_of(&table, &self.key));
        let location =
            Location { file: file.to_path_buf(), line_column: Some(line_and_column(text, offset)), key: self.key };
        FileError { location, problem: Box::new(self.problem) }
    }
}

/// Where the value at a path such as `segments[2].goal_rad` starts.
fn offset_of(table: &Spanned<DeTable<'_>>, key: &str) -> usize {
    let steps = key.split(['.', '[', ']']).filter(|step| !step.is_empty());
    let mut place = None;
    let mut node: Option<&DeValue<'_>> = None;
    for step in steps {
        let next = match (node, step.parse::<usize>()) {
            (None, _) => table.get_ref().get(step),
            (Some(DeValue::Array(entries)), Ok(index)) => entries.get(index),
            (Some(DeValue::Table(inner)), _) => inner.get(step),
            (Some(_), _) => None,
        };
        let Some(found) = next else { break };
        place = Some(found.span().start);
        node = Some(found.get_ref());
    }
    place.unwrap_or(0)
}

/// The text of the file at `path`.
///
/// # Errors
/// [`FileError`] with [`Problem::Unreadable`].
pub fn load(path: &Path) -> Result<String, FileError> {
    std::fs::read_to_string(path).map_err(|error| FileError {
        location: Location { file: path.to_path_buf(), line_column: None, key: String::new() },
        problem: Box::new(Problem::Unreadable { kind: error.kind() }),
    })
}

/// Reads TOML text, which must open with `schema = <schema>`, into `T`; `file` only names the text in errors. `T` does not
/// see the `schema` key.
///
/// # Errors
/// [`FileError`] with any [`Problem`] but [`Problem::Unreadable`].
pub fn read_text<T: DeserializeOwned>(file: &Path, text: &str, schema: i64) -> Result<T, FileError> {
    let locate = |fault: Fault| FileError {
        location: Location {
            file: file.to_path_buf(),
            line_column: Some(line_and_column(text, fault.span.map_or(0, |span| span.start))),
            key: fault.key,
        },
        problem: Box::new(fault.problem),
    };
    let parsed = DeTable::parse(text).map_err(|error| {
        let message = error.message().lines().collect::<Vec<_>>().join(", ");
        locate(Fault { span: error.span(), key: String::new(), problem: Problem::Syntax { message } })
    })?;
    let span = parsed.span();
    let mut table = parsed.into_inner();
    take_schema(&mut table, schema).map_err(locate)?;
    T::deserialize(Node { value: &DeValue::Table(table), span: span.start..span.start }).map_err(locate)
}

fn take_schema(table: &mut DeTable<'_>, expected: i64) -> Result<(), Fault> {
    let fault = |span, key: &str, problem| Fault { span, key: key.to_owned(), problem };
    let Some((_, value)) = table.remove_entry(SCHEMA_KEY) else {
        let similar = |key: &&Spanned<_>| -> bool {
            strsim::jaro_winkler(AsRef::<str>::as_ref(key.get_ref()), SCHEMA_KEY) > 0.85
        };
        return Err(match table.keys().find(similar) {
            Some(key) => {
                let problem =
                    Problem::UnknownKey { nearest: Some(SCHEMA_KEY.to_owned()), expected: vec![SCHEMA_KEY.to_owned()] };
                fault(Some(key.span()), key.get_ref(), problem)
            }
            None => fault(None, SCHEMA_KEY, Problem::MissingKey),
        });
    };
    let node = Node { value: value.get_ref(), span: value.span() };
    let found =
        <i64 as serde::Deserialize>::deserialize(node).map_err(|inner| inner.under(SCHEMA_KEY, value.span()))?;
    if found == expected {
        Ok(())
    } else {
        Err(fault(Some(value.span()), SCHEMA_KEY, Problem::Schema { found, expected }))
    }
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The entry of `candidates` nearest to `word` in spelling, unless none is near. For a command line's "did you mean".
///
/// One slip of the finger (a letter missing, added, changed, or two swapped) always counts as near.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |candidate: &str| {
        let slips = strsim::damerau_levenshtein(word, candidate);
        if slips <= 1 { 1.0 } else { strsim::jaro_winkler(word, candidate) }
    };
    candidates
        .into_iter()
        .map(|candidate| (likeness(candidate), candidate))
        .filter(|(similarity, _)| *similarity > SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Dish {
        name: String,
        salt_kg: f64,
        #[serde(default)]
        portions: Option<u32>,
        #[serde(default)]
        steps: Vec<Step>,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Step {
        what: What,
        minutes: f64,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(rename_all = "kebab-case")]
    enum What {
        Boil,
        DeepFry,
    }

    fn read(text: &str) -> Result<Dish, FileError> {
        read_text(Path::new("dish.toml"), text, 3)
    }

    fn refused(text: &str) -> (String, Option<(usize, usize)>, Problem) {
        let error = read(text).expect_err(text);
        assert_eq!(error.location.file, Path::new("dish.toml"));
        (error.location.key, error.location.line_column, *error.problem)
    }

    #[test]
    fn a_valid_file_is_read() {
        let dish =
            read("schema = 3\nname = 'chips'\nsalt_kg = 1\n[[steps]]\nwhat = 'deep-fry'\nminutes = 7.5").unwrap();
        let steps = vec![Step { what: What::DeepFry, minutes: 7.5 }];
        assert_eq!(dish, Dish { name: "chips".into(), salt_kg: 1.0, portions: None, steps });
    }

    #[test]
    fn broken_syntax_is_placed() {
        let (key, at, problem) = refused("schema = 3\nname = 'chips\nsalt_kg = 1.0\n");
        assert!(key.is_empty() && at.is_some_and(|(line, _)| line == 2), "{at:?}");
        assert!(matches!(problem, Problem::Syntax { .. }));
    }

    #[test]
    fn an_unknown_key_comes_with_the_nearest_valid_one() {
        let (key, at, problem) = refused("schema = 3\nname = 'x'\nslat_kg = 1.0\n");
        assert_eq!((key.as_str(), at), ("slat_kg", Some((3, 1))));
        assert!(matches!(problem, Problem::UnknownKey { nearest: Some(near), .. } if near == "salt_kg"));
        let (key, at, problem) =
            refused("schema = 3\nname = 'x'\nsalt_kg = 1.0\n[[steps]]\nwhat = 'boil'\n  minuts = 1");
        assert_eq!((key.as_str(), at), ("steps[0].minuts", Some((6, 3))));
        assert!(matches!(problem, Problem::UnknownKey { nearest: Some(near), .. } if near == "minutes"));
        let (_, _, problem) = refused("schema = 3\nname = 'x'\nsalt_kg = 1.0\nqqq = 1\n");
        assert!(matches!(problem, Problem::UnknownKey { nearest: None, expected } if expected.len() == 4));
    }

    #[test]
    fn a_missing_key_names_its_table() {
        let (key, at, problem) = refused("schema = 3\nname = 'x'\nsalt_kg = 1.0\n[[steps]]\nwhat = 'boil'\n");
        assert_eq!((key.as_str(), at.map(|(line, _)| line)), ("steps[0].minutes", Some(4)));
        assert_eq!(problem, Problem::MissingKey);
    }

    #[test]
    fn wrong_types_say_found_and_expected() {
        let (key, at, problem) = refused("schema = 3\nname = 'x'\nsalt_kg = 'much'\n");
        assert_eq!((key.as_str(), at), ("salt_kg", Some((3, 11))));
        assert!(matches!(problem, Problem::WrongType { found, .. } if found.contains("much")));
        let (key, _, problem) = refused("schema = 3\nname = 'x'\nsalt_kg = 1\nportions = -2\n");
        assert_eq!(key, "portions");
        assert!(matches!(problem, Problem::OutOfRange { .. }));
        let (key, _, problem) = refused("schema = 3\nname = 1979-05-27\nsalt_kg = 1\n");
        assert_eq!(key, "name");
        assert!(matches!(problem, Problem::WrongType { .. }));
        let (key, _, problem) = refused("schema = 3\nname = 'x'\nsalt_kg = 1\nsteps = [{what = 3, minutes = 1}]");
        assert_eq!(key, "steps[0].what");
        assert!(matches!(problem, Problem::WrongType { .. }));
    }

    #[test]
    fn an_unknown_word_comes_with_the_nearest_valid_one() {
        let (key, _, problem) =
            refused("schema = 3\nname = 'x'\nsalt_kg = 1\nsteps = [{what = 'deep-fri', minutes = 1}]");
        assert_eq!(key, "steps[0].what");
        assert!(matches!(problem, Problem::UnknownName { nearest: Some(near), .. } if near == "deep-fry"));
    }

    #[test]
    fn the_schema_is_checked_first() {
        assert_eq!(refused("name = 1").2, Problem::MissingKey);
        assert_eq!(refused("schema = 4\nnonsense = 1").2, Problem::Schema { found: 4, expected: 3 });
        assert!(matches!(refused("schema = '3'").2, Problem::WrongType { .. }));
        assert!(matches!(refused("shema = 3").2, Problem::UnknownKey { nearest: Some(near), .. } if near == "schema"));
    }

    #[test]
    fn a_problem_found_later_is_placed_by_its_key() {
        let text = "schema = 3\nname = 'x'\n[[steps]]\nwhat = 'boil'\nminutes = 1\n[[steps]]\nminutes = [1, 2]\n";
        let at =
            |key: &str| KeyError::out_of_range(key, 1, "2").locate(Path::new("dish.toml"), text).location.line_column;
        assert_eq!(at("name"), Some((2, 8)));
        assert_eq!(at("steps[1].minutes"), Some((7, 11)));
        assert_eq!(at("steps[1].minutes[1]"), Some((7, 15)));
        assert_eq!(at("steps[0].what.ever"), Some((4, 8)));
        assert_eq!(at("nothing"), Some((1, 1)));
    }

    #[test]
    fn a_missing_file_is_unreadable() {
        let error = load(Path::new("no/such/dish.toml")).unwrap_err();
        assert_eq!(*error.problem, Problem::Unreadable { kind: std::io::ErrorKind::NotFound });
        assert!(error.to_string().starts_with("no/such/dish.toml: cannot be read"));
    }
}
