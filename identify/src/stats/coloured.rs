//! Autocorrelated noise for tests.

/// Returns a first-order autoregression of unit variance from independent numbers of unit variance.
pub(crate) fn autoregressive(noise: &[f64], coefficient: f64) -> Vec<f64> {
    let mut last = 0.0;
    let follow = |noise: &f64| {
        last = coefficient * last + (1.0 - coefficient * coefficient).sqrt() * noise;
        last
    };
    noise.iter().map(follow).collect()
}

/// Returns 1/f noise of unit variance from eight times as many independent numbers: an equal sum of autoregressions an octave apart.
pub(crate) fn one_over_f(noise: &[f64], rows: usize) -> Vec<f64> {
    let octaves: Vec<Vec<f64>> = (0..8)
        .map(|octave| autoregressive(&noise[octave * rows..][..rows], (-(0.5f64.powi(octave as i32))).exp()))
        .collect();
    (0..rows).map(|row| octaves.iter().map(|octave| octave[row]).sum::<f64>() / 8f64.sqrt()).collect()
}
