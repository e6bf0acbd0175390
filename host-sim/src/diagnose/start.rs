//! Where a record begins in mid-course: how far the spring has come by then.
//!
//! The prediction is straight in the lags' starting value `x`: `prediction(x) = prediction(0) + x kernel`, and the kernel
//! dies away with the relaxation. So `x` is no coordinate of a fit; every model gets the one that suits it best, by
//! Huber's robust least squares. It counts as given: that also holds for stretches that are held out.

use super::noise::scale;

/// Errors this many scales large count as that large.
const FAR: f64 = 3.0;
/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Rows where the start matters less, as a part of where it matters most, do not tell its scale.
const FADED: f64 = 0.05;

/// The likeliest start for a residual, in units of the kernel's.
pub(super) fn likeliest(residual: &[f64], kernel: &[f64]) -> f64 {
    let most = kernel.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let early = kernel.iter().rposition(|value| value.abs() > FADED * most).map_or(0, |last| last + 1);
    let (residual, kernel) = (&residual[..early], &kernel[..early]);
    let mut start = 0.0;
    let mut far = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (mut along, mut power) = (0.0, 0.0);
        for (left, kernel) in residual.iter().zip(kernel) {
            let weight = (far / (left - start * kernel).abs()).min(1.0);
            along += weight * left * kernel;
            power += weight * kernel * kernel;
        }
        if power <= 0.0 {
            return 0.0;
        }
        start = along / power;
        let left: Vec<f64> = residual.iter().zip(kernel).map(|(left, kernel)| left - start * kernel).collect();
        far = FAR * scale(&left);
    }
    start
}
