//! The smallest effect that can be detected: by a likelihood-ratio test that is told the structure.
//!
//! The test knows the paper's plant, the noise (white, Gaussian) and what to look for; it has to find the effect's k
//! unknown values. At the 5 % level it detects an effect in 95 % of the records if the noncentrality, the sum of squares of
//! what the effect changes over the noise's variance, is [`NONCENTRALITY`] (noncentral chi-square, k degrees of freedom).
//!
//! Where an effect is no shift of the expected readings, an equivalent stands in:
//! - Quantisation: a test of the residual's variance, which rounding raises by step^2/12. Finding the lattice itself needs
//!   no size at all, but a lattice finer than this hides in the noise.
//! - Outliers: the likelihood ratio of the true [`mixture`](super::mixture).
//! - Saturation: the shift by which the bound clips the expected readings; that clipped readings repeat to the bit is left
//!   out.
//! - Delay and slew: against the least of them (see [`Effect::least`](crate::hidden::Effect::least)), not against none.

use super::mixture::Mixture;
use crate::hidden::{Cause, Hidden};

/// By number of unknowns, from 1. From the noncentral chi-square distribution.
pub const NONCENTRALITY: [f64; 3] = [12.9947, 15.4432, 17.1699];

/// One-sided 95 % point of the normal distribution.
pub(super) const NORMAL_95: f64 = 1.6449;

/// The detectable size of the record's one effect. None if even the plain effect is too small.
///
/// # Panics
/// If the record doesn't hide exactly one effect.
pub fn size(hidden: &Hidden) -> Option<f64> {
    let [effect] = hidden.effects.as_slice() else { panic!("one effect at a time") };
    let (rows, sigma) = (hidden.readings.read.len() as f64, hidden.noise.sigma_v);
    match effect.cause {
        Cause::Quantisation => {
            // A variance 1 + r times as large: r sqrt(n/2) = 1.645 + 1.645 (1 + r).
            let scatter = NORMAL_95 * (2.0 / rows).sqrt();
            let step = sigma * (12.0 * 2.0 * scatter / (1.0 - scatter)).sqrt();
            Some(step / effect.plain[0]).filter(|&size| size <= 1.0)
        }
        Cause::Outliers => smallest(|size| Mixture::of(effect, size, sigma).detected(rows)),
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

/// The least size, to a percent, from where on `excess` is positive; none if it isn't at 1.
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
    use crate::hidden::noise::Noise;
    use crate::hidden::record::Recipe;

    /// The test itself, on noisy readings: a gain's estimate is linear in them, so that its statistic is a formula.
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
    fn every_cause_has_a_detectable_size_below_its_plain_one() {
        for cause in Cause::ALL {
            let size = size(&Recipe::of(&[cause]).draw(11));
            assert!(size.is_some_and(|size| (1e-4..0.5).contains(&size)), "{cause}: {size:?}");
        }
    }
}
