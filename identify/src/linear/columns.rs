//! Linear least squares on columns that cover all rows, or the rows of one record only.
//!
//! The columns are orthonormalised one after another (modified Gram-Schmidt, repeated where much cancels), so that nearly dependent
//! columns, such as two lags with almost the same time constant, cost no accuracy of the fit.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::stats::sums::dot;

/// A column whose part that the earlier ones do not span is smaller than this, relative to the column, is left out.
const DEPENDENT: f64 = 1e-9;
/// The orthogonalisation is repeated if a column's norm shrinks below this part.
const CANCELLED: f64 = 0.1;

/// A column that is zero outside of its rows.
#[derive(Clone)]
pub(super) struct Column {
    /// First row.
    pub(super) first: usize,
    /// Values of its rows.
    pub(super) values: Vec<f64>,
}

/// Orthonormal columns `Q` and upper triangular `R` of `A = Q R`.
pub(super) struct Orthonormal {
    /// The columns of `Q`; a dependent column has no values.
    pub(super) q: Vec<Column>,
    /// The entries of `R` by column.
    r: Vec<Vec<f64>>,
}

impl Column {
    fn rows(&self) -> Range<usize> {
        self.first..self.first + self.values.len()
    }

    /// Scalar product over the rows of both.
    pub(super) fn times(&self, other: &Self) -> f64 {
        let (here, there) = self.common(other);
        dot(&self.values[here], &other.values[there])
    }

    /// Subtracts `factor` times another column on the rows of both.
    pub(super) fn subtract(&mut self, factor: f64, other: &Self) {
        let (here, there) = self.common(other);
        self.values[here].iter_mut().zip(&other.values[there]).for_each(|(value, other)| *value -= factor * other);
    }

    /// The rows of both, as ranges in each column's values.
    fn common(&self, other: &Self) -> (Range<usize>, Range<usize>) {
        let start = self.first.max(other.first);
        let end = self.rows().end.min(other.rows().end);
        if end <= start {
            return (0..0, 0..0);
        }
        (start - self.first..end - self.first, start - other.first..end - other.first)
    }

    pub(super) fn norm(&self) -> f64 {
        dot(&self.values, &self.values).sqrt()
    }
}

impl Orthonormal {
    /// No columns.
    pub(super) fn new() -> Self {
        Self { q: Vec::new(), r: Vec::new() }
    }

    /// Number of columns, with dependent ones.
    pub(super) fn count(&self) -> usize {
        self.q.len()
    }

    /// Adds a column; returns true if it is independent.
    pub(super) fn add(&mut self, mut column: Column) -> bool {
        let whole = column.norm();
        let mut entries = self.reduce(&mut column);
        let left = column.norm();
        // Also rejects a column that is not finite.
        let independent = left > DEPENDENT * whole && left.is_finite() && left > 0.0;
        if independent {
            column.values.iter_mut().for_each(|value| *value /= left);
        } else {
            column.values.clear();
        }
        entries.push(if independent { left } else { 0.0 });
        self.q.push(column);
        self.r.push(entries);
        independent
    }

    /// Subtracts from a column what the columns span of it, to all digits; returns the coordinates of that.
    pub(super) fn reduce(&self, column: &mut Column) -> Vec<f64> {
        let whole = column.norm();
        let mut entries = vec![0.0; self.q.len()];
        let mut before = whole;
        loop {
            for (entry, q) in entries.iter_mut().zip(&self.q) {
                let part = q.times(column);
                if part != 0.0 {
                    column.subtract(part, q);
                    *entry += part;
                }
            }
            let after = column.norm();
            // Not so for a column that is not finite.
            let cancelled = after <= CANCELLED * before && after > DEPENDENT * whole;
            if !cancelled {
                return entries;
            }
            before = after;
        }
    }

    /// Subtracts the projection of `values` from them; returns its coordinates on the orthonormal columns.
    pub(super) fn project(&self, values: &mut Column) -> Vec<f64> {
        let one = |q: &Column| {
            let part = q.times(values);
            values.subtract(part, q);
            part
        };
        self.q.iter().map(one).collect()
    }

    /// Solves `R x = coordinates` for the first columns, as many as there are coordinates; dependent columns get 0.
    pub(super) fn solve(&self, coordinates: &[f64]) -> Vec<f64> {
        let mut x = coordinates.to_vec();
        for column in (0..x.len()).rev() {
            let pivot = self.r[column][column];
            x[column] = if pivot > 0.0 { x[column] / pivot } else { 0.0 };
            for row in 0..column {
                x[row] -= self.r[column][row] * x[column];
            }
        }
        x
    }

    /// Solves `R' x = right`; dependent columns get 0.
    pub(super) fn solve_transposed(&self, right: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = Vec::with_capacity(right.len());
        for (column, right) in right.iter().enumerate() {
            let entries = &self.r[column];
            let before: f64 = x.iter().zip(entries).map(|(x, entry)| x * entry).sum();
            let pivot = entries[column];
            x.push(if pivot > 0.0 { (right - before) / pivot } else { 0.0 });
        }
        x
    }

    /// The square block of `R` of the columns from `first` on.
    pub(super) fn block(&self, first: usize) -> DMatrix<f64> {
        let size = self.q.len() - first;
        DMatrix::from_fn(
            size,
            size,
            |row, column| if row <= column { self.r[first + column][first + row] } else { 0.0 },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    #[test]
    fn coefficients_of_nearly_dependent_columns_are_recovered() {
        let noise = normals(300);
        let base: Vec<f64> = noise[..100].to_vec();
        let near: Vec<f64> = (0..100).map(|row| base[row] + 1e-5 * noise[100 + row]).collect();
        let part: Vec<f64> = noise[200..240].to_vec();
        let mut columns = Orthonormal::new();
        assert!(columns.add(Column { first: 30, values: part.clone() }));
        assert!(columns.add(Column { first: 0, values: base.clone() }));
        assert!(columns.add(Column { first: 0, values: near.clone() }));
        assert!(!columns.add(Column { first: 0, values: base.iter().map(|value| 3.0 * value).collect() }));
        let of_part = |row: usize| if (30..70).contains(&row) { part[row - 30] } else { 0.0 };
        let values = (0..100).map(|row| 2.0 * base[row] - 0.5 * near[row] + 7.0 * of_part(row)).collect();
        let mut rest = Column { first: 0, values };
        let coordinates = columns.project(&mut rest);
        let found = columns.solve(&coordinates);
        for (found, expected) in found.iter().zip([7.0, 2.0, -0.5, 0.0]) {
            assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
        assert!(rest.norm() < 1e-9);
    }

    #[test]
    fn a_column_that_is_not_finite_is_left_out() {
        let mut columns = Orthonormal::new();
        assert!(columns.add(Column { first: 0, values: vec![1.0; 10] }));
        for value in [f64::NAN, f64::INFINITY] {
            let mut values = normals(10);
            values[3] = value;
            assert!(!columns.add(Column { first: 0, values }));
        }
        assert_eq!(columns.project(&mut Column { first: 0, values: vec![2.0; 10] })[1..], [0.0, 0.0]);
    }
}
