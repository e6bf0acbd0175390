//! A power spectrum in bands of constant relative width, from which the autocovariance after a fractional difference
//! follows without filtering.
//!
//! ```text
//! correlation(k) = sum_bands power |1 - exp(-i w)|^(2 d) cos(k w)
//! ```

use std::f64::consts::{PI, TAU};

use crate::stats::periodogram::powers;

/// Width of a band relative to its frequency.
const RELATIVE: f64 = 0.02;
/// Largest width of a band, in radians per row: short compared with a period of the longest lag.
const WIDEST: f64 = PI / 300.0;

/// A band of the spectrum.
struct Band {
    power: f64,
    /// Cosine of its mean frequency in radians per row.
    cosine: f64,
    /// Logarithm of the squared gain of a first difference at that frequency.
    ln_gain: f64,
}

/// The spectrum of some values.
pub(super) struct BandSpectrum {
    bands: Vec<Band>,
}

impl BandSpectrum {
    /// Returns the spectrum of values in additional independent noise of the given variance; the mean counts as half of
    /// the lowest frequency.
    pub(super) fn of(values: &[f64], variance: f64) -> Self {
        let powers = powers(values);
        let length = 2 * (powers.len() - 1);
        let line = TAU / length as f64;
        let mut bands: Vec<(f64, f64)> = Vec::new();
        let mut end = 0.0;
        // Each band holds the sum of power times frequency, and the sum of power.
        for (index, of_values) in powers.into_iter().enumerate() {
            let sides = if index == 0 || 2 * index == length { 1.0 } else { 2.0 };
            let power = sides * (of_values / values.len() as f64 + variance) / length as f64;
            let frequency = line * (index as f64).max(0.5);
            match bands.last_mut() {
                Some(band) if frequency < end => *band = (band.0 + power * frequency, band.1 + power),
                _ => {
                    bands.push((power * frequency, power));
                    end = frequency + (RELATIVE * frequency).min(WIDEST);
                }
            }
        }
        let band = |(sum, power): (f64, f64)| {
            let frequency = sum / power.max(1e-300);
            Band { power, cosine: frequency.cos(), ln_gain: 2.0 * (2.0 * (frequency / 2.0).sin()).ln() }
        };
        Self { bands: bands.into_iter().map(band).collect() }
    }

    /// Returns the autocovariances at lags 0 to `longest` after a fractional difference of order `power`.
    pub(super) fn correlation(&self, power: f64, longest: usize) -> Vec<f64> {
        let mut correlation = vec![0.0; longest + 1];
        for &Band { power: of_band, cosine, ln_gain } in &self.bands {
            let left = if power == 0.0 { of_band } else { of_band * (power * ln_gain).exp() };
            // The recurrence is cos((k + 1) w) = 2 cos(w) cos(k w) - cos((k - 1) w).
            let (mut before, mut now) = (cosine, 1.0);
            let twice = 2.0 * before;
            for sum in &mut correlation {
                *sum += left * now;
                (before, now) = (now, twice * now - before);
            }
        }
        correlation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::scale::normals;

    #[test]
    fn order_0_gives_the_autocovariance_of_the_values() {
        let values = normals(3000);
        let of_bands = BandSpectrum::of(&values, 0.0).correlation(0.0, 12);
        for (lag, of_bands) in of_bands.into_iter().enumerate() {
            let exact: f64 = values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>() / 3000.0;
            assert!((of_bands - exact).abs() < 2e-3, "{lag}: {of_bands} {exact}");
        }
    }

    /// A fractional difference of order 1 is the difference of neighbours.
    #[test]
    fn order_1_gives_the_variance_of_first_differences() {
        let values = normals(3000);
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let exact: f64 = steps.iter().map(|step| step * step).sum::<f64>() / 3000.0;
        let of_bands = BandSpectrum::of(&values, 0.0).correlation(1.0, 12)[0];
        assert!((of_bands - exact).abs() < 5e-3, "{of_bands} {exact}");
    }
}
