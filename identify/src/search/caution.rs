//! Caution where noise has a longer memory than its law can say.

use crate::noise::Term;
use crate::stats::sums::dot;

/// Beyond this normal quantile (0.1 %) a variance is not independent noise's.
const RARE: f64 = 3.09;

/// How much more the means of the rows' pulls over long stretches vary than independent ones would; 1 unless significant.
///
/// Where the noise's law has no memory for it (rounded readings), or too short a one, slow swings pass for a shift or a
/// drift.
pub(super) fn long_memory(terms: &[Term]) -> f64 {
    let pulls: Vec<f64> = terms.iter().map(|term| term.weight * term.residual).collect();
    let variance = dot(&pulls, &pulls) / pulls.len().max(1) as f64;
    let mut most = 1.0f64;
    for parts in [5, 10, 20, 40, 80] {
        let length = pulls.len() / parts;
        if length < 5 || variance <= 0.0 {
            continue;
        }
        let squares = pulls.chunks_exact(length).map(|chunk| chunk.iter().sum::<f64>().powi(2) / length as f64);
        let ratio = squares.take(parts).sum::<f64>() / parts as f64 / variance;
        // Of a mean of `parts` squares, by Wilson and Hilferty's approximation (1931).
        let spread = 2.0 / (9.0 * parts as f64);
        if ratio > (1.0 - spread + RARE * spread.sqrt()).powi(3) {
            most = most.max(ratio);
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    /// Slow swings ask for caution, and chance does not: it would cost small effects their names.
    #[test]
    fn independent_noise_asks_for_none() {
        let noise = normals(200_000);
        let caution = |swing: f64| {
            let records = noise.chunks(2000).map(move |chunk| {
                let swung = chunk.iter().enumerate().map(|(row, noise)| noise + swing * (0.008 * row as f64).sin());
                long_memory(&swung.map(|residual| Term { log: 0.0, residual, weight: 1.0 }).collect::<Vec<_>>())
            });
            records.filter(|caution| *caution > 1.0).count()
        };
        assert!(caution(0.0) < 3, "{} of 100", caution(0.0));
        assert!(caution(0.3) > 97, "{} of 100", caution(0.3));
    }
}
