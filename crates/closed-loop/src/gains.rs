//! Gains files: a controller's numbers as people write them, for any number of joints.
//!
//! ```toml
//! schema = 1
//! controller = "aic"
//! source = "where the numbers come from"   # optional
//! [aic]
//! kappa_mu = 11.67                         # one number for all joints ...
//! sigma_q = [1, 1, 1, 1, 10, 20, 100]      # ... or one per joint, base to tip
//! # kappa_a, sigma_dq, sigma_mu, sigma_dmu, reference_time_constant_s (default 1)
//! ```
//!
//! A number is kept as the `f64` nearest to what was written. Printed with the fewest digits that read back as the same
//! `f64` ([`decimal`]), it is the text the user wrote whenever that had 15 significant digits or fewer; exact proofs start from
//! that decimal, so they speak about the number in the file and not about its binary neighbour.
//!
//! Limits: lengths are compared with the arm only when the file is bound to it ([`AicTable::bind`], [`MracTable::bind`]).

mod aic;
mod mrac;
mod per_joint;

use std::path::Path;

use certune_control::mrac::MracLaw;
use serde::{Deserialize, Serialize};

use crate::file::{FileError, KeyError, Problem, load, read_text};

pub use aic::AicTable;
pub use mrac::{LawName, MracTable};
pub use per_joint::{PerJoint, decimal};

/// The schema version of gains files.
pub const GAINS_SCHEMA: i64 = 1;

/// The table of a gains file. In records it is the table alone: no two controllers have the same rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Gains {
    /// The active inference controller.
    Aic(AicTable),
    /// Model reference adaptive control.
    Mrac(Box<MracTable>),
}

impl Gains {
    /// The controller's name in files.
    pub const fn controller(&self) -> &'static str {
        match self {
            Self::Aic(_) => "aic",
            Self::Mrac(_) => "mrac",
        }
    }

    /// The rows in the order of the file, each with its key.
    pub fn rows(&self) -> Vec<(&'static str, &PerJoint)> {
        match self {
            Self::Aic(table) => table.rows().to_vec(),
            Self::Mrac(table) => table.rows().to_vec(),
        }
    }

    /// The row of that key, if the controller has it.
    pub fn row(&self, key: &str) -> Option<&PerJoint> {
        self.rows().into_iter().find(|(name, _)| *name == key).map(|(_, numbers)| numbers)
    }

    /// The same gains with other numbers in the row of that key; a key of another controller changes nothing.
    #[must_use]
    pub fn with(mut self, key: &str, numbers: PerJoint) -> Self {
        let row = match &mut self {
            Self::Aic(table) => table.row_mut(key),
            Self::Mrac(table) => table.row_mut(key),
        };
        if let Some(row) = row {
            *row = numbers;
        }
        self
    }
}

impl From<AicTable> for Gains {
    fn from(table: AicTable) -> Self {
        Self::Aic(table)
    }
}

impl From<MracTable> for Gains {
    fn from(table: MracTable) -> Self {
        Self::Mrac(Box::new(table))
    }
}

/// A gains file.
#[derive(Clone, Debug, PartialEq)]
pub struct GainsFile {
    /// Where the numbers come from.
    pub source: Option<String>,
    /// The numbers.
    pub gains: Gains,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ControllerName {
    Aic,
    Mrac,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    controller: ControllerName,
    #[serde(default)]
    source: Option<String>,
    #[serde(default)]
    aic: Option<AicTable>,
    #[serde(default)]
    mrac: Option<Box<MracTable>>,
}

impl GainsFile {
    /// Reads a gains file; `file` names the text in errors.
    ///
    /// # Errors
    /// [`FileError`] with the line and the key: broken TOML, an unknown or missing key, a number that is no gain, the table of another
    /// controller.
    pub fn parse(file: &Path, text: &str) -> Result<Self, FileError> {
        let raw: Raw = read_text(file, text, GAINS_SCHEMA)?;
        let at = |key: &str, problem| KeyError { key: key.to_owned(), problem }.locate(file, text);
        let missing = |key| at(key, Problem::MissingKey);
        let foreign = |key, own: &str| {
            let expected = ["schema", "controller", "source", own].map(str::to_owned).to_vec();
            at(key, Problem::UnknownKey { nearest: None, expected })
        };
        let gains = match (raw.controller, raw.aic, raw.mrac) {
            (ControllerName::Aic, Some(table), None) => Gains::Aic(table),
            (ControllerName::Mrac, None, Some(table)) => Gains::Mrac(table),
            (ControllerName::Aic, None, None | Some(_)) => return Err(missing("aic")),
            (ControllerName::Mrac, None | Some(_), None) => return Err(missing("mrac")),
            (ControllerName::Aic, Some(_), Some(_)) => return Err(foreign("mrac", "aic")),
            (ControllerName::Mrac, Some(_), Some(_)) => return Err(foreign("aic", "mrac")),
        };
        Ok(Self { source: raw.source, gains })
    }

    /// Reads the gains file at `path`.
    ///
    /// # Errors
    /// [`FileError`], as [`GainsFile::parse`] or because the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        Self::parse(path, &load(path)?)
    }

    /// The file's text. Read again it gives the same numbers to the bit.
    pub fn to_toml(&self) -> String {
        let controller = self.gains.controller();
        let mut text = format!("schema = {GAINS_SCHEMA}\ncontroller = \"{controller}\"\n");
        if let Some(source) = &self.source {
            text.push_str(&format!("source = {}\n", toml::Value::from(source.as_str())));
        }
        text.push_str(&format!("\n[{controller}]\n"));
        if let Gains::Mrac(table) = &self.gains {
            text.push_str(&format!("law = \"{}\"\n", MracLaw::from(table.law).name()));
        }
        for (key, numbers) in self.gains.rows() {
            // `{:?}` is the shortest text that reads back as the same number, and always a TOML float.
            let value = match numbers {
                PerJoint::Shared(value) => format!("{value:?}"),
                PerJoint::Each(values) => format!("{values:?}"),
            };
            text.push_str(&format!("{key} = {value}\n"));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AIC: &str = "schema = 1\ncontroller = 'aic'\nsource = 'a \"quoted\" place'\n[aic]\nkappa_mu = 11.67\nkappa_a = 700\n\
        sigma_q = [1, 1, 1, 1, 10, 20, 100]\nsigma_dq = 1.0\nsigma_mu = 5\nsigma_dmu = 10\n";

    fn parse(text: &str) -> Result<GainsFile, FileError> {
        GainsFile::parse(Path::new("gains.toml"), text)
    }

    fn refused(text: &str) -> (String, usize, Problem) {
        let error = parse(text).expect_err(text);
        (error.location.key, error.location.line_column.map_or(0, |(line, _)| line), *error.problem)
    }

    #[test]
    fn numbers_are_shared_or_one_per_joint() {
        let Gains::Aic(table) = parse(AIC).unwrap().gains else { panic!("an AIC file") };
        let gains = table.bind::<7>().unwrap();
        assert_eq!(PerJoint::from(gains.kappa_a), PerJoint::Shared(700.0));
        assert_eq!(PerJoint::from(gains.sigma_q), PerJoint::Each(vec![1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0]));
        assert_eq!(PerJoint::from(gains.reference_time_constant_s), PerJoint::Shared(1.0));
        assert_eq!(AicTable::from(&gains), table);
        let error = table.bind::<6>().unwrap_err();
        assert_eq!(error.key, "aic.sigma_q");
        assert!(matches!(error.problem, Problem::Length { found: 7, .. }));
    }

    #[test]
    fn a_bad_file_is_refused_with_key_and_line() {
        let edit = |from: &str, to: &str| refused(&AIC.replace(from, to));
        for bad in ["nan", "-1.0", "0", "inf"] {
            let (key, line, problem) = edit("kappa_a = 700", &format!("kappa_a = {bad}"));
            assert_eq!((key.as_str(), line), ("aic.kappa_a", 6));
            assert!(matches!(problem, Problem::OutOfRange { .. }), "{bad}: {problem}");
        }
        assert_eq!(edit("10, 20, 100", "10, nan, 100").0, "aic.sigma_q[5]");
        assert!(matches!(
            edit("sigma_q = [1, 1, 1, 1, 10, 20, 100]", "sigma_q = []").2,
            Problem::Length { found: 0, .. }
        ));
        assert!(
            matches!(edit("kappa_a", "kapa_a").2, Problem::UnknownKey { nearest: Some(key), .. } if key == "kappa_a")
        );
        assert!(matches!(edit("'aic'", "'aci'").2, Problem::UnknownName { nearest: Some(name), .. } if name == "aic"));
        assert_eq!(edit("'aic'", "'mrac'").0, "mrac");
        assert_eq!(edit("sigma_mu = 5\n", "").0, "aic.sigma_mu");
        assert!(matches!(edit("kappa_mu = 11.67", "kappa_mu = 'fast'").2, Problem::WrongType { .. }));
        assert!(matches!(edit("schema = 1", "schema = 2").2, Problem::Schema { found: 2, expected: 1 }));
    }

    #[test]
    fn an_adaptive_file_is_read_and_its_derivative_rows_may_be_left_out() {
        let row = |name: &str| format!("{name} = 2\n");
        let rows: String = [
            "omega_rad_per_s",
            "zeta",
            "l1",
            "l2",
            "alpha1",
            "alpha2",
            "e01",
            "e02",
            "e11",
            "e12",
            "f01",
            "f02",
            "f11",
            "f12",
        ]
        .into_iter()
        .map(row)
        .collect();
        let text = format!("schema = 1\ncontroller = 'mrac'\n[mrac]\nlaw = 'released-code'\n{rows}");
        let file = parse(&text).unwrap();
        let Gains::Mrac(table) = &file.gains else { panic!("an MRAC file") };
        let gains = table.bind::<3>().unwrap();
        assert_eq!((gains.law, gains.e1), (MracLaw::ReleasedCode, [[2.0; 3], [2.0; 3], [0.0; 3]]));
        assert_eq!(MracTable::from(&gains), **table);
        assert_eq!(parse(&file.to_toml()).unwrap(), file);
        assert!(matches!(refused(&text.replace("released-code", "released")).2, Problem::UnknownName { .. }));
        assert_eq!(refused(&text.replace("l2 = 2\n", "")).0, "mrac.l2");
    }

    #[test]
    fn decimals_are_what_was_written() {
        let Gains::Aic(table) = parse(&AIC.replace("700", "[700, 0.1, 1e-7, 123456.789012345]")).unwrap().gains else {
            panic!("an AIC file")
        };
        assert_eq!(table.kappa_a.decimals(), ["700", "0.1", "0.0000001", "123456.789012345"]);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back_to_the_bit(
            numbers in prop::array::uniform7(prop::collection::vec(any::<f64>().prop_map(f64::abs).prop_filter("a gain", |x| *x > 0.0 && x.is_finite()), 1..=7)),
            source in proptest::option::of(".*"),
        ) {
            let [a, b, c, d, e, f, g] = numbers.map(|list| if list.len() == 1 { PerJoint::Shared(list[0]) } else { PerJoint::Each(list) });
            let table = AicTable { kappa_mu: a, kappa_a: b, sigma_q: c, sigma_dq: d, sigma_mu: e, sigma_dmu: f, reference_time_constant_s: g };
            let file = GainsFile { source, gains: Gains::Aic(table) };
            prop_assert_eq!(parse(&file.to_toml()).expect("readable"), file);
        }
    }
}
