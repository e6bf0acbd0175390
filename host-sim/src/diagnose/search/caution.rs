//! Caution where noise has a longer memory than its law can say.

use crate::diagnose::noise::Term;
use crate::diagnose::sums::dot;

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
        if ratio > 1.0 + 2.0 * (2.0 / parts as f64).sqrt() {
            most = most.max(ratio);
        }
    }
    most
}
