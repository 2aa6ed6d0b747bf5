//! How vectors, matrices and scores are written: as plain lists of numbers.
//!
//! Text formats such as JSON know no infinity, yet scores may be infinite;
//! these are written as the words `"inf"` and `"-inf"`.

use serde::{Deserialize, Serialize};

/// A score as it is written.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Finite(f64),
    Word(Word),
}

#[derive(Serialize, Deserialize)]
enum Word {
    #[serde(rename = "inf")]
    Infinity,
    #[serde(rename = "-inf")]
    MinusInfinity,
}

impl From<f64> for Written {
    fn from(score: f64) -> Written {
        if score.is_finite() {
            Written::Finite(score)
        } else if score > 0.0 {
            Written::Word(Word::Infinity)
        } else {
            Written::Word(Word::MinusInfinity)
        }
    }
}

impl From<Written> for f64 {
    fn from(written: Written) -> f64 {
        match written {
            Written::Finite(score) => score,
            Written::Word(Word::Infinity) => f64::INFINITY,
            Written::Word(Word::MinusInfinity) => f64::NEG_INFINITY,
        }
    }
}

/// One score.
pub(crate) mod score {
    use super::{Deserialize, Serialize, Written};
    use serde::{Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(score: &f64, to: S) -> Result<S::Ok, S::Error> {
        Written::from(*score).serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Written::deserialize(from).map(f64::from)
    }
}

/// A list of scores.
pub(crate) mod scores {
    use super::{Deserialize, Written};
    use serde::{Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(scores: &[f64], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(scores.iter().copied().map(Written::from))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let scores = Vec::<Written>::deserialize(from)?;
        Ok(scores.into_iter().map(f64::from).collect())
    }
}

/// A vector.
pub(crate) mod vector {
    use super::Deserialize;
    use nalgebra::DVector;
    use serde::{Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(v: &DVector<f64>, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(v.iter())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<DVector<f64>, D::Error> {
        Vec::deserialize(from).map(DVector::from_vec)
    }
}

/// A list of vectors.
pub(crate) mod vectors {
    use super::Deserialize;
    use nalgebra::DVector;
    use serde::{Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(v: &[DVector<f64>], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(v.iter().map(|v| v.as_slice()))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DVector<f64>>, D::Error> {
        let lists = Vec::<Vec<f64>>::deserialize(from)?;
        Ok(lists.into_iter().map(DVector::from_vec).collect())
    }
}

/// A square matrix, the list of its columns one after the other.
pub(crate) mod matrix {
    use super::Deserialize;
    use nalgebra::DMatrix;
    use serde::{Deserializer, Serializer, de::Error};

    pub(crate) fn serialize<S: Serializer>(m: &DMatrix<f64>, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(m.iter())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<DMatrix<f64>, D::Error> {
        let elements = Vec::<f64>::deserialize(from)?;
        let n = elements.len().isqrt();
        if n * n == elements.len() {
            Ok(DMatrix::from_vec(n, n, elements))
        } else {
            Err(D::Error::custom("the matrix is not square"))
        }
    }
}
