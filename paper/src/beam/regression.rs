//! Least squares with intervals (Student's t), and a test for readings that are out of line with the others.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A value and the 95 % interval around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Best estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A linear model fitted to readings: the value is the sum of a row's terms, each with its coefficient.
#[derive(Clone, Debug)]
pub struct Fit {
    /// One a column.
    pub coefficients: Vec<f64>,
    covariance: DMatrix<f64>,
    /// Readings less coefficients.
    pub degrees_of_freedom: usize,
    /// One a reading.
    pub readings: Vec<Reading>,
}

/// A reading seen from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// What the others say it should be, with the interval in which one more reading falls with 95 %.
    pub expected: Interval,
    /// Chance that a reading falls so far off if all of them are alike.
    pub chance: f64,
}

/// How often a table may be accused wrongly.
pub const FALSE_ALARM: f64 = 0.05;

impl Interval {
    /// True if it holds `value`.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// In another unit.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { value: factor * self.value, low: factor * self.low, high: factor * self.high }
    }

    fn around(value: f64, deviation: f64, degrees_of_freedom: usize) -> Result<Self> {
        let half = student(degrees_of_freedom)?.inverse_cdf(0.975) * deviation;
        Ok(Self { value, low: value - half, high: value + half })
    }
}

impl Fit {
    /// Fits `values` by the columns of `rows`.
    ///
    /// # Errors
    /// If there are no more readings than coefficients, or the columns depend on each other.
    pub fn new(rows: &[Vec<f64>], values: &[f64]) -> Result<Self> {
        let columns = rows.first().map_or(0, Vec::len);
        let design = DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column]);
        let values = DVector::from_column_slice(values);
        let degrees_of_freedom =
            rows.len().checked_sub(columns).filter(|&free| free > 0).context("too few readings for a fit")?;
        let inverse = (design.transpose() * &design).cholesky().context("readings do not determine the fit")?.inverse();
        let coefficients = &inverse * design.transpose() * &values;
        let residuals = &values - &design * &coefficients;
        // What scatters by less is not told from the computer's own rounding.
        let rounding = (1e-12 * values.amax()).powi(2);
        let squares = residuals.norm_squared().max(rounding);
        let leverage: Vec<f64> = design.row_iter().map(|row| (row * &inverse * row.transpose())[0]).collect();

        let mut readings = Vec::new();
        if degrees_of_freedom > 1 {
            for ((&value, &residual), &leverage) in values.iter().zip(&residuals).zip(&leverage) {
                // A reading that alone determines a coefficient is contradicted by none.
                let alone = 1.0 - leverage < 1e-9;
                // What the fit without this reading would be, without making it.
                let missed = if alone { 0.0 } else { residual / (1.0 - leverage) };
                let variance = (squares - residual * missed).max(rounding) / (degrees_of_freedom - 1) as f64;
                let deviation = if alone { f64::INFINITY } else { (variance / (1.0 - leverage)).sqrt() };
                let expected = Interval::around(value - missed, deviation, degrees_of_freedom - 1)?;
                let chance = chance_beyond(missed / deviation, degrees_of_freedom - 1)?;
                readings.push(Reading { expected, chance });
            }
        }
        let covariance = inverse * (squares / degrees_of_freedom as f64);
        Ok(Self { coefficients: coefficients.iter().copied().collect(), covariance, degrees_of_freedom, readings })
    }

    /// A sum of coefficients, weighted, with its interval.
    ///
    /// # Errors
    /// If Student's distribution does not exist, which it does.
    pub fn combined(&self, weights: &[f64]) -> Result<Interval> {
        let value = self.coefficients.iter().zip(weights).map(|(coefficient, weight)| coefficient * weight).sum();
        let weights = DVector::from_column_slice(weights);
        let variance = (weights.transpose() * &self.covariance * weights)[0];
        Interval::around(value, variance.sqrt(), self.degrees_of_freedom)
    }

    /// One coefficient with its interval.
    ///
    /// # Errors
    /// As [`Fit::combined`].
    pub fn coefficient(&self, index: usize) -> Result<Interval> {
        let weights: Vec<f64> = (0..self.coefficients.len()).map(|i| f64::from(i == index)).collect();
        self.combined(&weights)
    }

    /// How many standard errors a value is away from a coefficient.
    pub fn standard_errors_from(&self, index: usize, value: f64) -> f64 {
        (value - self.coefficients[index]) / self.covariance[(index, index)].sqrt()
    }

    /// The reading that is most out of line, if one is even when every reading is given a chance to be (Bonferroni).
    pub fn out_of_line(&self) -> Option<usize> {
        let (index, worst) =
            self.readings.iter().enumerate().min_by(|(_, one), (_, other)| one.chance.total_cmp(&other.chance))?;
        (worst.chance * (self.readings.len() as f64) < FALSE_ALARM).then_some(index)
    }
}

/// Two-sided chance of lying so many standard errors off; 1 where nothing scatters and nothing is off.
///
/// # Errors
/// If Student's distribution does not exist: without a degree of freedom.
pub fn chance_beyond(standard_errors: f64, degrees_of_freedom: usize) -> Result<f64> {
    match standard_errors.abs() {
        off if off.is_nan() => Ok(1.0),
        off if off.is_infinite() => Ok(0.0),
        off => Ok(2.0 * student(degrees_of_freedom)?.cdf(-off)),
    }
}

fn student(degrees_of_freedom: usize) -> Result<StudentsT> {
    Ok(StudentsT::new(0.0, 1.0, degrees_of_freedom as f64)?)
}

/// Term by term: (intercept, x).
pub fn straight_line(x: &[f64]) -> Vec<Vec<f64>> {
    x.iter().map(|&x| vec![1.0, x]).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Anscombe's first set: 3.0001 + 0.5001 x, standard errors 1.1247 and 0.1179, 9 degrees of freedom.
    #[test]
    fn anscombe() {
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let fit = Fit::new(&straight_line(&x), &y).unwrap();
        let (at, slope) = (fit.coefficient(0).unwrap(), fit.coefficient(1).unwrap());
        assert!((at.value - 3.000_09).abs() < 1e-4 && (slope.value - 0.500_09).abs() < 1e-4);
        assert!((at.high - at.value - 2.262_157 * 1.124_7).abs() < 1e-3);
        assert!((slope.value - slope.low - 2.262_157 * 0.117_9).abs() < 1e-3);
        assert_eq!(fit.out_of_line(), None);
    }

    #[test]
    fn too_little_is_said() {
        assert!(Fit::new(&straight_line(&[1.0, 2.0]), &[1.0, 2.0]).is_err());
        assert!(Fit::new(&straight_line(&[1.0, 1.0, 1.0]), &[1.0, 2.0, 3.0]).is_err());
    }

    proptest! {
        /// What a reading is expected to be is what a fit without it predicts.
        #[test]
        fn expected_is_the_fit_without(values in prop::collection::vec(-1.0..1.0f64, 6), left_out in 0usize..6) {
            let x = [1.0, 2.0, 3.0, 4.5, 5.0, 7.0];
            let whole = Fit::new(&straight_line(&x), &values).unwrap();
            let others: Vec<usize> = (0..6).filter(|&i| i != left_out).collect();
            let rows: Vec<Vec<f64>> = others.iter().map(|&i| vec![1.0, x[i]]).collect();
            let part = Fit::new(&rows, &others.iter().map(|&i| values[i]).collect::<Vec<_>>()).unwrap();
            let predicted = part.combined(&[1.0, x[left_out]]).unwrap().value;
            prop_assert!((whole.readings[left_out].expected.value - predicted).abs() < 1e-9);
        }

        #[test]
        fn a_spoilt_reading_is_found(noise in prop::collection::vec(-1.0..1.0f64, 12), spoilt in 0usize..12) {
            let x: Vec<f64> = (0..12).map(f64::from).collect();
            let mut y: Vec<f64> = x.iter().zip(&noise).map(|(x, noise)| 3.0 * x + noise).collect();
            y[spoilt] += 30.0;
            prop_assert_eq!(Fit::new(&straight_line(&x), &y).unwrap().out_of_line(), Some(spoilt));
        }
    }
}
