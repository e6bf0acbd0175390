//! Linear least squares with intervals by Student's t, and an outlier test.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Best estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A linear model fitted to readings: each value is the sum of a row's terms times the coefficients.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Estimated coefficients, one per column.
    pub coefficients: Vec<f64>,
    covariance: DMatrix<f64>,
    /// Number of readings minus number of coefficients.
    pub degrees_of_freedom: usize,
    /// Diagnostics of each reading, in the order of the rows.
    pub readings: Vec<Reading>,
}

/// A reading compared with the prediction of all other readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Prediction of the other readings, with the interval that contains a further reading with 95 % probability.
    pub expected: Interval,
    /// Two-sided p-value of the reading's deviation from that prediction.
    pub chance: f64,
}

/// Probability that the outlier test names any reading of a table without outliers.
pub const FALSE_ALARM: f64 = 0.05;

impl Interval {
    /// True if the interval contains `value`.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// The interval in another unit: all values multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { value: factor * self.value, low: factor * self.low, high: factor * self.high }
    }

    fn around(value: f64, deviation: f64, degrees_of_freedom: usize) -> Result<Self> {
        let half = student(degrees_of_freedom)?.inverse_cdf(0.975) * deviation;
        Ok(Self { value, low: value - half, high: value + half })
    }
}

impl Fit {
    /// Fits `values` by the columns of `rows`, one row per value.
    ///
    /// # Errors
    /// If there are no more readings than coefficients, or the columns are linearly dependent.
    pub fn new(rows: &[Vec<f64>], values: &[f64]) -> Result<Self> {
        let columns = rows.first().map_or(0, Vec::len);
        let design = DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column]);
        let values = DVector::from_column_slice(values);
        let degrees_of_freedom =
            rows.len().checked_sub(columns).filter(|&free| free > 0).context("too few readings for a fit")?;
        let inverse = (design.transpose() * &design).cholesky().context("readings do not determine the fit")?.inverse();
        let coefficients = &inverse * design.transpose() * &values;
        let residuals = &values - &design * &coefficients;
        // A smaller scatter cannot be distinguished from rounding errors.
        let rounding = (1e-12 * values.amax()).powi(2);
        let squares = residuals.norm_squared().max(rounding);
        let leverage: Vec<f64> = design.row_iter().map(|row| (row * &inverse * row.transpose())[0]).collect();

        let mut readings = Vec::new();
        if degrees_of_freedom > 1 {
            for ((&value, &residual), &leverage) in values.iter().zip(&residuals).zip(&leverage) {
                // A reading that alone determines a coefficient cannot deviate from the others.
                let alone = 1.0 - leverage < 1e-9;
                // The deviation from the fit without this reading, without computing that fit.
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

    /// A weighted sum of the coefficients with its 95 % interval.
    ///
    /// # Errors
    /// If there is no degree of freedom.
    pub fn combined(&self, weights: &[f64]) -> Result<Interval> {
        let value = self.coefficients.iter().zip(weights).map(|(coefficient, weight)| coefficient * weight).sum();
        let weights = DVector::from_column_slice(weights);
        let variance = (weights.transpose() * &self.covariance * weights)[0];
        Interval::around(value, variance.sqrt(), self.degrees_of_freedom)
    }

    /// One coefficient with its 95 % interval.
    ///
    /// # Errors
    /// Returns the errors of [`Fit::combined`].
    pub fn coefficient(&self, index: usize) -> Result<Interval> {
        let weights: Vec<f64> = (0..self.coefficients.len()).map(|i| f64::from(i == index)).collect();
        self.combined(&weights)
    }

    /// Distance of `value` from a coefficient, in standard errors.
    pub fn standard_errors_from(&self, index: usize, value: f64) -> f64 {
        (value - self.coefficients[index]) / self.covariance[(index, index)].sqrt()
    }

    /// Index of the most significant outlier, if it remains significant after Bonferroni's correction for the number of
    /// readings.
    pub fn out_of_line(&self) -> Option<usize> {
        let (index, worst) =
            self.readings.iter().enumerate().min_by(|(_, one), (_, other)| one.chance.total_cmp(&other.chance))?;
        (worst.chance * (self.readings.len() as f64) < FALSE_ALARM).then_some(index)
    }
}

/// Two-sided p-value of a deviation given in standard errors; 1 if neither scatter nor deviation exists.
///
/// # Errors
/// If there is no degree of freedom.
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

/// Rows of a straight line: the terms (1, x) of each point.
pub fn straight_line(x: &[f64]) -> Vec<Vec<f64>> {
    x.iter().map(|&x| vec![1.0, x]).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Anscombe's first data set: 3.0001 + 0.5001 x, standard errors 1.1247 and 0.1179, 9 degrees of freedom.
    #[test]
    fn coefficients_and_errors_agree_with_anscombes_first_set() {
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
    fn too_few_readings_are_an_error() {
        assert!(Fit::new(&straight_line(&[1.0, 2.0]), &[1.0, 2.0]).is_err());
        assert!(Fit::new(&straight_line(&[1.0, 1.0, 1.0]), &[1.0, 2.0, 3.0]).is_err());
    }

    proptest! {
        /// The expected value of a reading is the prediction of the fit without that reading.
        #[test]
        fn expected_value_is_the_prediction_without_the_reading(values in prop::collection::vec(-1.0..1.0f64, 6), left_out in 0usize..6) {
            let x = [1.0, 2.0, 3.0, 4.5, 5.0, 7.0];
            let whole = Fit::new(&straight_line(&x), &values).unwrap();
            let others: Vec<usize> = (0..6).filter(|&i| i != left_out).collect();
            let rows: Vec<Vec<f64>> = others.iter().map(|&i| vec![1.0, x[i]]).collect();
            let part = Fit::new(&rows, &others.iter().map(|&i| values[i]).collect::<Vec<_>>()).unwrap();
            let predicted = part.combined(&[1.0, x[left_out]]).unwrap().value;
            prop_assert!((whole.readings[left_out].expected.value - predicted).abs() < 1e-9);
        }

        #[test]
        fn an_outlier_is_found(noise in prop::collection::vec(-1.0..1.0f64, 12), spoilt in 0usize..12) {
            let x: Vec<f64> = (0..12).map(f64::from).collect();
            let mut y: Vec<f64> = x.iter().zip(&noise).map(|(x, noise)| 3.0 * x + noise).collect();
            y[spoilt] += 30.0;
            prop_assert_eq!(Fit::new(&straight_line(&x), &y).unwrap().out_of_line(), Some(spoilt));
        }
    }
}
