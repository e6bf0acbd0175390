//! Scales of residuals and of their changes from row to row.

use crate::stats::median::robust_deviation;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::FINEST_V;

/// Returns the robust scale of a residual around zero, in V, at least [`FINEST_V`]. Zeros are left out: noise is never
/// exactly zero, but the rows of a spring at rest in a noise-free record are.
pub fn robust_scale(residual: &[f64]) -> f64 {
    robust_deviation(residual.iter().copied().filter(|r| *r != 0.0))
        .map_or(FINEST_V.get(), |scale| scale.max(FINEST_V.get()))
}

/// Returns true if the root mean square of a residual, in V, is no more than the arithmetic's resolution [`FINEST_V`].
pub fn negligible(residual: &[f64]) -> bool {
    root_mean_square(residual) <= FINEST_V.get()
}

/// Returns the values less their mean.
pub fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

/// Returns the root mean square of the values, in their unit; 0 if there are none.
pub fn root_mean_square(residual: &[f64]) -> f64 {
    (dot(residual, residual) / residual.len().max(1) as f64).sqrt()
}

/// Returns the largest magnitude of the values, in their unit; 0 if there are none.
pub(crate) fn largest_magnitude(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Returns the mean square of the values about their mean, in their unit squared.
pub(crate) fn variance(values: &[f64]) -> f64 {
    root_mean_square(&centred(values)).powi(2)
}

/// Returns the second differences, scaled so that independent noise keeps its standard deviation; a slow signal nearly
/// vanishes.
pub(crate) fn second_differences(reading: &[f64]) -> impl Iterator<Item = f64> {
    reading.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]) / 6f64.sqrt())
}

/// Returns independent, nearly normal numbers of mean 0 and variance 1.
#[cfg(test)]
pub(crate) fn normals(rows: usize) -> Vec<f64> {
    let mut numbers = random_numbers::SplitMix64::new(20_261_121);
    (0..rows).map(|_| numbers.normal()).collect()
}
