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

use std::path::Path;

use certune_control::aic::AicGains;
use certune_control::mrac::{MracGains, MracLaw};
use serde::de::{self, Deserializer, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};

use crate::file::{FileError, KeyError, Problem, load, read_text};

/// The schema version of gains files.
pub const GAINS_SCHEMA: i64 = 1;

/// A number for every joint, or one that all joints share. Finite by construction of the reader.
#[derive(Clone, Debug, PartialEq)]
pub enum PerJoint {
    /// One number for all joints.
    Shared(f64),
    /// One number per joint, base to tip.
    Each(Vec<f64>),
}

impl PerJoint {
    /// One number per joint; `key` names the list in the error.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self, key: &str) -> Result<[f64; N], KeyError> {
        match self {
            Self::Shared(value) => Ok([*value; N]),
            Self::Each(values) => values.as_slice().try_into().map_err(|_| KeyError::per_joint(key, values.len(), N)),
        }
    }

    /// The numbers as written: one when shared.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Shared(value) => std::slice::from_ref(value),
            Self::Each(values) => values,
        }
    }

    /// The number that all joints share, also when it was written as a list of equal numbers.
    pub fn shared(&self) -> Option<f64> {
        let (first, rest) = self.values().split_first()?;
        rest.iter().all(|value| value.to_bits() == first.to_bits()).then_some(*first)
    }

    /// Every number as the shortest decimal that reads back as the same `f64`; see the module's text.
    pub fn decimals(&self) -> Vec<String> {
        self.values().iter().copied().map(decimal).collect()
    }
}

impl<const N: usize> From<[f64; N]> for PerJoint {
    /// Shared when all entries are equal to the bit.
    fn from(values: [f64; N]) -> Self {
        let each = Self::Each(values.to_vec());
        each.shared().map_or(each, Self::Shared)
    }
}

/// The shortest decimal, without an exponent, that reads back as `value`.
pub fn decimal(value: f64) -> String {
    format!("{value}")
}

impl Serialize for PerJoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Shared(value) => serializer.serialize_f64(*value),
            Self::Each(values) => values.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for PerJoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrList;
        impl<'de> Visitor<'de> for NumberOrList {
            type Value = PerJoint;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or a list of numbers, one per joint")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<PerJoint, E> {
                Finite::checked(value).map(|finite| PerJoint::Shared(finite.0))
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<PerJoint, E> {
                self.visit_f64(value as f64)
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<PerJoint, E> {
                self.visit_f64(value as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<PerJoint, A::Error> {
                let mut values = Vec::new();
                while let Some(Finite(value)) = entries.next_element()? {
                    values.push(value);
                }
                if values.is_empty() { Err(de::Error::invalid_length(0, &self)) } else { Ok(PerJoint::Each(values)) }
            }
        }
        deserializer.deserialize_any(NumberOrList)
    }
}

/// A number that is neither NaN nor infinite: TOML has words for both.
#[derive(Clone, Copy, Debug)]
struct Finite(f64);

impl Finite {
    fn checked<E: de::Error>(value: f64) -> Result<Self, E> {
        let refuse = || E::invalid_value(Unexpected::Float(value), &"a finite number");
        value.is_finite().then_some(Self(value)).ok_or_else(refuse)
    }
}

impl<'de> Deserialize<'de> for Finite {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        f64::deserialize(deserializer).and_then(Self::checked)
    }
}

fn positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PerJoint, D::Error> {
    let numbers = PerJoint::deserialize(deserializer)?;
    match numbers.values().iter().find(|value| !(**value > 0.0)) {
        None => Ok(numbers),
        Some(value) => Err(de::Error::invalid_value(Unexpected::Float(*value), &"a positive number")),
    }
}

fn non_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PerJoint, D::Error> {
    let numbers = PerJoint::deserialize(deserializer)?;
    match numbers.values().iter().find(|value| !(**value >= 0.0)) {
        None => Ok(numbers),
        Some(value) => Err(de::Error::invalid_value(Unexpected::Float(*value), &"a number, zero or above")),
    }
}

/// The table `[aic]`: seven rows, all strictly positive. `sigma_*` are variances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AicTable {
    /// Learning rate of the beliefs.
    #[serde(deserialize_with = "positive")]
    pub kappa_mu: PerJoint,
    /// Learning rate of the torque.
    #[serde(deserialize_with = "positive")]
    pub kappa_a: PerJoint,
    /// Variance of the measured position.
    #[serde(deserialize_with = "positive")]
    pub sigma_q: PerJoint,
    /// Variance of the measured velocity.
    #[serde(deserialize_with = "positive")]
    pub sigma_dq: PerJoint,
    /// Variance of the belief's position dynamics.
    #[serde(deserialize_with = "positive")]
    pub sigma_mu: PerJoint,
    /// Variance of the belief's velocity dynamics.
    #[serde(deserialize_with = "positive")]
    pub sigma_dmu: PerJoint,
    /// Time constant of the reference model, s; 1 in the literature.
    #[serde(deserialize_with = "positive", default = "one")]
    pub reference_time_constant_s: PerJoint,
}

fn one() -> PerJoint {
    PerJoint::Shared(1.0)
}

impl AicTable {
    /// The gains of an arm with `N` joints.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self) -> Result<AicGains<N>, KeyError> {
        Ok(AicGains {
            kappa_mu: self.kappa_mu.bind("aic.kappa_mu")?,
            kappa_a: self.kappa_a.bind("aic.kappa_a")?,
            sigma_q: self.sigma_q.bind("aic.sigma_q")?,
            sigma_dq: self.sigma_dq.bind("aic.sigma_dq")?,
            sigma_mu: self.sigma_mu.bind("aic.sigma_mu")?,
            sigma_dmu: self.sigma_dmu.bind("aic.sigma_dmu")?,
            reference_time_constant_s: self.reference_time_constant_s.bind("aic.reference_time_constant_s")?,
        })
    }

    /// The rows in the order of the file, each with its key.
    pub fn rows(&self) -> [(&'static str, &PerJoint); 7] {
        [
            ("kappa_mu", &self.kappa_mu),
            ("kappa_a", &self.kappa_a),
            ("sigma_q", &self.sigma_q),
            ("sigma_dq", &self.sigma_dq),
            ("sigma_mu", &self.sigma_mu),
            ("sigma_dmu", &self.sigma_dmu),
            ("reference_time_constant_s", &self.reference_time_constant_s),
        ]
    }
}

impl<const N: usize> From<&AicGains<N>> for AicTable {
    fn from(gains: &AicGains<N>) -> Self {
        Self {
            kappa_mu: gains.kappa_mu.into(),
            kappa_a: gains.kappa_a.into(),
            sigma_q: gains.sigma_q.into(),
            sigma_dq: gains.sigma_dq.into(),
            sigma_mu: gains.sigma_mu.into(),
            sigma_dmu: gains.sigma_dmu.into(),
            reference_time_constant_s: gains.reference_time_constant_s.into(),
        }
    }
}

/// The table `[mrac]`: the law's name and 19 rows. Index 1 is proportional, 2 integral, 3 derivative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MracTable {
    /// Which of the three laws.
    pub law: LawName,
    /// Frequency of the reference model, rad/s.
    #[serde(deserialize_with = "positive")]
    pub omega_rad_per_s: PerJoint,
    /// Damping of the reference model.
    #[serde(deserialize_with = "positive")]
    pub zeta: PerJoint,
    /// Lyapunov weight of the position error.
    #[serde(deserialize_with = "positive")]
    pub l1: PerJoint,
    /// Lyapunov weight of the velocity error.
    #[serde(deserialize_with = "positive")]
    pub l2: PerJoint,
    /// Proportional gain of the modified error.
    #[serde(deserialize_with = "positive")]
    pub alpha1: PerJoint,
    /// Integral gain of the modified error.
    #[serde(deserialize_with = "positive")]
    pub alpha2: PerJoint,
    /// Derivative gain of the modified error; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub alpha3: PerJoint,
    /// Proportional gain of the feedback of position.
    #[serde(deserialize_with = "positive")]
    pub e01: PerJoint,
    /// Integral gain of the feedback of position.
    #[serde(deserialize_with = "positive")]
    pub e02: PerJoint,
    /// Derivative gain of the feedback of position; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub e03: PerJoint,
    /// Proportional gain of the feedback of velocity.
    #[serde(deserialize_with = "positive")]
    pub e11: PerJoint,
    /// Integral gain of the feedback of velocity.
    #[serde(deserialize_with = "positive")]
    pub e12: PerJoint,
    /// Derivative gain of the feedback of velocity; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub e13: PerJoint,
    /// Proportional gain of the feed-forward of the reference position.
    #[serde(deserialize_with = "positive")]
    pub f01: PerJoint,
    /// Integral gain of the feed-forward of the reference position.
    #[serde(deserialize_with = "positive")]
    pub f02: PerJoint,
    /// Derivative gain of the feed-forward of the reference position; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub f03: PerJoint,
    /// Proportional gain of the feed-forward of the reference velocity.
    #[serde(deserialize_with = "positive")]
    pub f11: PerJoint,
    /// Integral gain of the feed-forward of the reference velocity.
    #[serde(deserialize_with = "positive")]
    pub f12: PerJoint,
    /// Derivative gain of the feed-forward of the reference velocity; zero unless given.
    #[serde(deserialize_with = "non_negative", default = "zero")]
    pub f13: PerJoint,
}

fn zero() -> PerJoint {
    PerJoint::Shared(0.0)
}

/// The three adaptive laws by the names they have in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawName {
    /// The paper's equations, the reference from a second-order model.
    ReferenceModel,
    /// The paper's equations, the reference is the goal.
    RawGoal,
    /// The authors' released code.
    ReleasedCode,
}

impl From<LawName> for MracLaw {
    fn from(name: LawName) -> Self {
        match name {
            LawName::ReferenceModel => Self::ReferenceModel,
            LawName::RawGoal => Self::RawGoal,
            LawName::ReleasedCode => Self::ReleasedCode,
        }
    }
}

impl From<MracLaw> for LawName {
    fn from(law: MracLaw) -> Self {
        match law {
            MracLaw::ReferenceModel => Self::ReferenceModel,
            MracLaw::RawGoal => Self::RawGoal,
            MracLaw::ReleasedCode => Self::ReleasedCode,
        }
    }
}

impl MracTable {
    /// The gains of an arm with `N` joints.
    ///
    /// # Errors
    /// [`KeyError`] when a list has another length than `N`.
    pub fn bind<const N: usize>(&self) -> Result<MracGains<N>, KeyError> {
        Ok(MracGains {
            law: self.law.into(),
            omega_rad_per_s: self.omega_rad_per_s.bind("mrac.omega_rad_per_s")?,
            zeta: self.zeta.bind("mrac.zeta")?,
            l1: self.l1.bind("mrac.l1")?,
            l2: self.l2.bind("mrac.l2")?,
            alpha: [
                self.alpha1.bind("mrac.alpha1")?,
                self.alpha2.bind("mrac.alpha2")?,
                self.alpha3.bind("mrac.alpha3")?,
            ],
            e0: [self.e01.bind("mrac.e01")?, self.e02.bind("mrac.e02")?, self.e03.bind("mrac.e03")?],
            e1: [self.e11.bind("mrac.e11")?, self.e12.bind("mrac.e12")?, self.e13.bind("mrac.e13")?],
            f0: [self.f01.bind("mrac.f01")?, self.f02.bind("mrac.f02")?, self.f03.bind("mrac.f03")?],
            f1: [self.f11.bind("mrac.f11")?, self.f12.bind("mrac.f12")?, self.f13.bind("mrac.f13")?],
        })
    }

    /// The rows in the order of the file, each with its key.
    pub fn rows(&self) -> [(&'static str, &PerJoint); 19] {
        [
            ("omega_rad_per_s", &self.omega_rad_per_s),
            ("zeta", &self.zeta),
            ("l1", &self.l1),
            ("l2", &self.l2),
            ("alpha1", &self.alpha1),
            ("alpha2", &self.alpha2),
            ("alpha3", &self.alpha3),
            ("e01", &self.e01),
            ("e02", &self.e02),
            ("e03", &self.e03),
            ("e11", &self.e11),
            ("e12", &self.e12),
            ("e13", &self.e13),
            ("f01", &self.f01),
            ("f02", &self.f02),
            ("f03", &self.f03),
            ("f11", &self.f11),
            ("f12", &self.f12),
            ("f13", &self.f13),
        ]
    }
}

impl<const N: usize> From<&MracGains<N>> for MracTable {
    fn from(gains: &MracGains<N>) -> Self {
        Self {
            law: gains.law.into(),
            omega_rad_per_s: gains.omega_rad_per_s.into(),
            zeta: gains.zeta.into(),
            l1: gains.l1.into(),
            l2: gains.l2.into(),
            alpha1: gains.alpha[0].into(),
            alpha2: gains.alpha[1].into(),
            alpha3: gains.alpha[2].into(),
            e01: gains.e0[0].into(),
            e02: gains.e0[1].into(),
            e03: gains.e0[2].into(),
            e11: gains.e1[0].into(),
            e12: gains.e1[1].into(),
            e13: gains.e1[2].into(),
            f01: gains.f0[0].into(),
            f02: gains.f0[1].into(),
            f03: gains.f0[2].into(),
            f11: gains.f1[0].into(),
            f12: gains.f1[1].into(),
            f13: gains.f1[2].into(),
        }
    }
}

/// The table of a gains file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase", tag = "controller", content = "gains")]
pub enum Gains {
    /// The active inference controller.
    Aic(AicTable),
    /// Model reference adaptive control.
    Mrac(Box<MracTable>),
}

/// A gains file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GainsFile {
    /// Where the numbers come from.
    pub source: Option<String>,
    /// The numbers.
    #[serde(flatten)]
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
        let (controller, rows): (&str, &[(&str, &PerJoint)]) = match &self.gains {
            Gains::Aic(table) => ("aic", &table.rows()),
            Gains::Mrac(table) => ("mrac", &table.rows()),
        };
        let mut text = format!("schema = {GAINS_SCHEMA}\ncontroller = \"{controller}\"\n");
        if let Some(source) = &self.source {
            text.push_str(&format!("source = {}\n", toml::Value::from(source.as_str())));
        }
        text.push_str(&format!("\n[{controller}]\n"));
        if let Gains::Mrac(table) = &self.gains {
            text.push_str(&format!("law = \"{}\"\n", MracLaw::from(table.law).name()));
        }
        for (key, numbers) in rows {
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
        assert_eq!(gains.kappa_a, [700.0; 7]);
        assert_eq!(gains.sigma_q, [1.0, 1.0, 1.0, 1.0, 10.0, 20.0, 100.0]);
        assert_eq!(gains.reference_time_constant_s, [1.0; 7]);
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
