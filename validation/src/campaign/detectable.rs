//! The smallest effect that an oracle detector, a likelihood-ratio test with known structure, can detect.
//!
//! The test knows the paper's plant, the noise (white, Gaussian) and the cause; it estimates the effect's k unknown
//! values. At the 5 % level it detects the effect in 95 % of the records if the noncentrality, the sum of squares of
//! the change of the expected readings over the variance of the noise, is [`NONCENTRALITY`] (noncentral chi-square, k
//! degrees of freedom).
//!
//! Where an effect does not shift the expected readings, an equivalent test is used:
//! - Quantisation: a test of the residual's variance, which rounding increases by step^2/12. The quantisation grid
//!   itself could be found at any step size, but is not visible below this one in the noise.
//! - Outliers: the likelihood ratio of the true [`mixture`](super::mixture).
//! - Saturation: the shift by which the limit clips the expected readings; that clipped readings are identical is not
//!   used.
//! - Delay and slew: compared with the smallest one (see [`Effect::least`](crate::ground_truth::Effect::least)), not
//!   with none.

use super::mixture::Mixture;
use crate::ground_truth::{Cause, LabelledRecord};
use crate::statistics::NORMAL_95;

/// Noncentrality for a detection probability of 95 % at the 5 % level, by the number of unknown values from 1 to 3.
pub const NONCENTRALITY: [f64; 3] = [12.9947, 15.4432, 17.1699];

/// Detectable size of the record's effect, as a fraction of its full size; `None` if full size is too small.
///
/// # Panics
/// If the record does not have exactly one effect.
pub fn size(hidden: &LabelledRecord) -> Option<f64> {
    let [effect] = hidden.effects.as_slice() else { panic!("expected exactly one effect") };
    let (rows, sigma) = (hidden.readings.read.len() as f64, hidden.noise.sigma_v);
    match effect.cause {
        Cause::Quantisation => {
            // The variance is 1 + r times that of the noise, with r sqrt(n/2) = 1.645 + 1.645 (1 + r).
            let scatter = NORMAL_95 * (2.0 / rows).sqrt();
            let step = sigma * (12.0 * 2.0 * scatter / (1.0 - scatter)).sqrt();
            Some(step / effect.full_size[0]).filter(|&size| size <= 1.0)
        }
        Cause::Outliers => smallest(|size| Mixture::of(effect, size, sigma).excess_over_noise(rows)),
        cause => {
            let least = hidden.at(effect.least());
            let needed = NONCENTRALITY[cause.facts().unknowns - 1];
            smallest(|size| {
                let changed = hidden.at(size);
                let pairs = changed.readings.expected.iter().zip(&least.readings.expected);
                pairs.map(|(a, b)| ((a - b) / sigma).powi(2)).sum::<f64>() - needed
            })
        }
    }
}

/// Smallest size, to 1 %, at which `excess` is positive; `None` if it is negative at size 1.
pub(super) fn smallest(excess: impl Fn(f64) -> f64) -> Option<f64> {
    if excess(1.0) < 0.0 {
        return None;
    }
    let (mut low, mut high) = (1e-4f64, 1.0f64);
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::ground_truth::noise::Noise;
    use crate::ground_truth::record::Recipe;

    /// Runs the test on noisy readings: the estimate of a gain is linear in them, so that its statistic has a closed
    /// form.
    #[test]
    fn a_gain_of_the_detectable_size_is_detected_in_95_percent() {
        let hidden = Recipe::of(&[Cause::GainError]).draw(5);
        let size = size(&hidden).unwrap();
        let null = hidden.at(0.0).readings.expected;
        let shift: Vec<f64> = hidden.at(size).readings.expected.iter().zip(&null).map(|(a, b)| a - b).collect();
        let power: f64 = null.iter().map(|y| y * y).sum();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let detected = (0..2000).filter(|_| {
            let noise = Noise::white(0.2).draw(&mut random, null.len());
            let product: f64 = null.iter().zip(&shift).zip(noise).map(|((y, d), e)| y * (d + e)).sum();
            product * product / power > 3.8415
        });
        let share = detected.count() as f64 / 2000.0;
        assert!((share - 0.95).abs() < 0.02, "{share}");
    }

    #[test]
    fn every_cause_has_a_detectable_size_below_half_its_full_size() {
        for cause in Cause::ALL {
            let size = size(&Recipe::of(&[cause]).draw(11));
            assert!(size.is_some_and(|size| (1e-4..0.5).contains(&size)), "{cause}: {size:?}");
        }
    }
}
