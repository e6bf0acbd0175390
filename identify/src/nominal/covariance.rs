//! Standard deviations of linear functions of autocorrelated errors.
//!
//! ```text
//! variance(sum_n z(n) e(n)) = sum_n,m z(n) gamma(n - m) z(m) = mean over f of S(f) |Z(f)|^2
//! ```
//!
//! with the errors' spectrum `S` from an autoregression, and the discrete Fourier transform `Z` of the weights.

use std::f64::consts::PI;

use rustfft::num_complex::Complex;

use crate::stats::periodogram::powers;
use crate::stats::sums::dot;

/// Largest order of the autoregression, relative to the common logarithm of the number of rows.
const ORDER_PER_DECADE: f64 = 10.0;
/// Most rows of the record for each lag.
const ROWS_PER_LAG: usize = 10;

/// Spectrum of the errors: an autoregression.
#[derive(Clone, Debug)]
pub struct Spectrum {
    /// Coefficients, lag 1 first; empty for independent errors.
    pub ar: Vec<f64>,
    /// Variance of the innovations, in the squared unit of the errors.
    pub innovations: f64,
}

impl Spectrum {
    /// Fits the autoregression whose order Akaike's criterion chooses to residuals; several records follow each other at `starts`.
    /// `fitted` holds the orthonormal directions in which the fit has taken the errors away. Slow errors lose most, so that their
    /// share is put back: `covariance(lag) += sum of variance(q) sum_n q(n) q(n + lag) / rows`, once.
    pub fn of(residual: &[f64], starts: &[usize], fitted: &[Vec<f64>]) -> Self {
        let rows = residual.len();
        let longest = (ORDER_PER_DECADE * (rows.max(2) as f64).log10()).ceil() as usize;
        let longest = longest.min(rows / ROWS_PER_LAG);
        let covariance = |values: &[f64], lag: usize| {
            let parts = starts.iter().zip(starts.iter().skip(1).chain([&rows]));
            let of = |(&start, &end): (&usize, &usize)| dot(&values[start..end], &values[(start + lag).min(end)..end]);
            parts.map(of).sum::<f64>() / rows as f64
        };
        let mut covariances: Vec<f64> = (0..=longest).map(|lag| covariance(residual, lag)).collect();
        let first = Self::of_covariances(&covariances, rows);
        for direction in fitted {
            let variance = first.deviation(direction).powi(2);
            for (lag, sum) in covariances.iter_mut().enumerate() {
                *sum += variance * covariance(direction, lag);
            }
        }
        Self::of_covariances(&covariances, rows)
    }

    /// Levinson's recursion.
    fn of_covariances(covariance: &[f64], rows: usize) -> Self {
        let mut error = covariance[0];
        let (mut ar, mut best) = (Vec::new(), (Vec::new(), error, f64::INFINITY));
        for order in 0..covariance.len() {
            if order > 0 {
                let ahead: f64 = ar.iter().enumerate().map(|(lag, phi)| phi * covariance[order - 1 - lag]).sum();
                let reflection = (covariance[order] - ahead) / error;
                let reversed: Vec<f64> = ar.iter().rev().copied().collect();
                ar.iter_mut().zip(&reversed).for_each(|(phi, other)| *phi -= reflection * other);
                ar.push(reflection);
                error *= 1.0 - reflection * reflection;
            }
            if error.is_nan() || error <= 0.0 {
                break;
            }
            let criterion = rows as f64 * error.ln() + 2.0 * order as f64;
            if criterion < best.2 {
                best = (ar.clone(), error, criterion);
            }
        }
        Self { ar: best.0, innovations: best.1 }
    }

    /// Standard deviation of the sum of the errors with the given weights.
    pub fn deviation(&self, weights: &[f64]) -> f64 {
        if self.ar.is_empty() {
            return (self.innovations * dot(weights, weights)).sqrt();
        }
        let power = powers(weights);
        let half = (power.len() - 1) as f64;
        let sum: f64 = power
            .iter()
            .enumerate()
            .map(|(at, power)| {
                let of_one_row = Complex::cis(PI * at as f64 / half);
                let mut of_lag = of_one_row;
                let mut filter = Complex::new(1.0, 0.0);
                for phi in &self.ar {
                    filter -= of_lag * phi;
                    of_lag *= of_one_row;
                }
                // All but the first and the last frequency stand for two.
                let times = if at == 0 || at as f64 == half { 1.0 } else { 2.0 };
                times * power / filter.norm_sqr()
            })
            .sum();
        (self.innovations * sum / (2.0 * half)).sqrt()
    }

    /// Correlation of neighbouring residuals.
    pub fn neighbours(residual: &[f64]) -> f64 {
        let power = dot(residual, residual);
        if power > 0.0 { dot(residual, &residual[1.min(residual.len())..]) / power } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    /// The mean of `n` values of `e(n) = phi e(n-1) + w(n)` has nearly the variance `1 / (1 - phi)^2 / n`.
    #[test]
    fn mean_of_autocorrelated_errors_has_its_deviation() {
        for phi in [0.0, 0.8, -0.5] {
            let mut errors = normals(4000);
            for row in 1..errors.len() {
                errors[row] += phi * errors[row - 1];
            }
            let spectrum = Spectrum::of(&errors, &[0], &[]);
            let expected = 1.0 / (1.0 - phi) / 4000f64.sqrt();
            let found = spectrum.deviation(&vec![1.0 / 4000.0; 4000]);
            assert!((found / expected - 1.0).abs() < 0.2, "{phi}: {found} {expected}");
        }
    }
}
