//! The penalty factor: how much dearer blocks become where noise is autocorrelated beyond what its model describes.
//!
//! Slow noise that the noise model does not describe (no autoregression is fitted to rounded readings, and one may be too
//! short) is easily explained by a shift or a drift, so that chance finds gain more than in independent noise.

use crate::noise::Term;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::ROWS_PER_MEAN;
use crate::stats::thresholds::probability::Z_LONG_MEMORY;

/// Numbers of stretches that the record is divided into.
const STRETCHES: [usize; 5] = [5, 10, 20, 40, 80];

/// Returns the ratio of the variance of stretch means of the rows' scores (weight times residual) to that of independent
/// rows, the largest over all numbers of stretches; 1 unless it is significant.
pub(super) fn penalty_factor(terms: &[Term]) -> f64 {
    let scores: Vec<f64> = terms.iter().map(|term| term.weight * term.residual).collect();
    let variance = dot(&scores, &scores) / scores.len().max(1) as f64;
    let mut largest = 1.0f64;
    for parts in STRETCHES {
        let length = scores.len() / parts;
        if length < ROWS_PER_MEAN.count() || variance <= 0.0 {
            continue;
        }
        let squares = scores.chunks_exact(length).map(|chunk| chunk.iter().sum::<f64>().powi(2) / length as f64);
        let ratio = squares.take(parts).sum::<f64>() / parts as f64 / variance;
        // Quantile of a mean of `parts` squares, by Wilson and Hilferty's approximation (1931).
        let spread = 2.0 / (9.0 * parts as f64);
        if ratio > (1.0 - spread + Z_LONG_MEMORY * spread.sqrt()).powi(3) {
            largest = largest.max(ratio);
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    /// Slow swings raise the factor above 1, independent noise in fewer than 3 of 100 records: small effects would be lost.
    #[test]
    fn only_slow_swings_raise_the_factor() {
        let noise = normals(200_000);
        let raised = |swing: f64| {
            let records = noise.chunks(2000).map(move |chunk| {
                let swung = chunk.iter().enumerate().map(|(row, noise)| noise + swing * (0.008 * row as f64).sin());
                penalty_factor(&swung.map(|residual| Term { residual, weight: 1.0 }).collect::<Vec<_>>())
            });
            records.filter(|factor| *factor > 1.0).count()
        };
        assert!(raised(0.0) < 3, "{} of 100", raised(0.0));
        assert!(raised(0.3) > 97, "{} of 100", raised(0.3));
    }
}
