//! Quadratic forms assembled from linear ones, over any field.
//!
//! A *row* is the list of coefficients of a linear form over the coordinates of a proof; a sum of products `l(x) r(x)` of rows is a
//! quadratic form, and its symmetric matrix is what a proof checks. Matrices of claims are written once over [`Field`]: with rationals they
//! decide, with `f64` a search assembles its programs from the same formulas.

use core::ops::{Add, Div, Mul, Neg, Sub};

use num_rational::BigRational;

use crate::number::ratio;

/// Numbers that a matrix can be assembled from.
pub trait Field:
    Clone
    + for<'a> Add<&'a Self, Output = Self>
    + for<'a> Sub<&'a Self, Output = Self>
    + for<'a> Mul<&'a Self, Output = Self>
    + for<'a> Div<&'a Self, Output = Self>
    + Neg<Output = Self>
{
    /// `numerator / denominator`.
    fn fraction(numerator: i64, denominator: i64) -> Self;

    /// 0.
    fn zero() -> Self {
        Self::fraction(0, 1)
    }

    /// 1.
    fn one() -> Self {
        Self::fraction(1, 1)
    }
}

impl Field for f64 {
    fn fraction(numerator: i64, denominator: i64) -> Self {
        numerator as f64 / denominator as f64
    }
}

impl Field for BigRational {
    fn fraction(numerator: i64, denominator: i64) -> Self {
        ratio(numerator, denominator)
    }
}

/// A linear form: its coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<T>(pub Vec<T>);

impl<T: Field> Row<T> {
    /// The zero form over `order` coordinates.
    #[must_use]
    pub fn zero(order: usize) -> Self {
        Self(vec![T::zero(); order])
    }

    /// `scale` times one coordinate.
    #[must_use]
    pub fn coordinate(order: usize, index: usize, scale: T) -> Self {
        let mut row = Self::zero(order);
        row.0[index] = scale;
        row
    }

    /// This form plus `scale` times another.
    #[must_use]
    pub fn plus(&self, scale: &T, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a.clone() + &(b.clone() * scale)).collect())
    }

    /// This form times a number.
    #[must_use]
    pub fn times(&self, scale: &T) -> Self {
        Self(self.0.iter().map(|a| a.clone() * scale).collect())
    }

    /// `sum_i weights_i rows_i`.
    #[must_use]
    pub fn combination(order: usize, weights: &[T], rows: &[Self]) -> Self {
        weights.iter().zip(rows).fold(Self::zero(order), |sum, (weight, row)| sum.plus(weight, row))
    }
}

/// A quadratic form as its symmetric matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Form<T>(pub Vec<Vec<T>>);

impl<T: Field> Form<T> {
    /// The zero form.
    #[must_use]
    pub fn zero(order: usize) -> Self {
        Self(vec![vec![T::zero(); order]; order])
    }

    /// Adds `scale l(x) r(x)`.
    pub fn add(&mut self, scale: &T, left: &Row<T>, right: &Row<T>) {
        let half = scale.clone() * &T::fraction(1, 2);
        for (i, l) in left.0.iter().enumerate() {
            for (j, r) in right.0.iter().enumerate() {
                let share = l.clone() * r * &half;
                self.0[i][j] = self.0[i][j].clone() + &share;
                self.0[j][i] = self.0[j][i].clone() + &share;
            }
        }
    }

    /// Adds `scale` times another form of the same order.
    pub fn add_form(&mut self, scale: &T, other: &Self) {
        for (row, others) in self.0.iter_mut().zip(&other.0) {
            for (entry, x) in row.iter_mut().zip(others) {
                *entry = entry.clone() + &(x.clone() * scale);
            }
        }
    }

    /// Minus the form.
    #[must_use]
    pub fn negated(self) -> Self {
        Self(self.0.into_iter().map(|row| row.into_iter().map(|x| -x).collect()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_of_rows_is_its_symmetric_matrix() {
        // (x + 2 y)(3 x - y) = 3 x^2 + 5 x y - 2 y^2, doubled.
        let (l, r) = (Row(vec![1.0, 2.0]), Row(vec![3.0, -1.0]));
        let mut form = Form::zero(2);
        form.add(&2.0, &l, &r);
        assert_eq!(form.0, vec![vec![6.0, 5.0], vec![5.0, -4.0]]);
    }
}
