//! The smallest effect that can be isolated, that is, distinguished from every other cause. A smaller effect may be
//! detected, but no diagnosis can name it reliably.
//!
//! A small effect changes the expected readings along a direction d, a small effect of another cause along e. The part
//! of d that e cannot reproduce is |d| sin(d, e). A test that chooses between these two known structures picks the
//! correct one in 95 % of the records if that part is at least 2 x 1.645 standard deviations of the noise.
//!
//! This is a lower bound: e has only the few shapes (time constants, frequencies, segments) that are drawn, and more
//! than one other cause may be present. It holds for small effects only: a delay and a slew of less than a row are
//! identical on equal steps, but differ when they last longer. Quantisation, outliers and saturation do not shift the
//! expected readings along a direction and are not confused with other causes. Outliers may be confused with
//! heavy-tailed noise.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::detectable::{NONCENTRALITY, smallest};
use super::mixture::Mixture;
use crate::ground_truth::{Cause, Effect, LabelledRecord};
use crate::statistics::{NORMAL_95, dot};

/// Distance for an error probability of 5 % either way, in standard deviations of the noise.
const SEPARATION: f64 = 2.0 * NORMAL_95;
/// Size at which the expected readings are linear in the size.
const SMALL: f64 = 0.01;
/// Number of random shapes of each other cause.
const SHAPES: u64 = 2;

/// Smallest size of the record's effect that can be distinguished from every other cause, relative to its detectable size `size`;
/// at least 1.
///
/// # Panics
/// If the record does not have exactly one effect.
pub fn factor(hidden: &LabelledRecord, size: f64) -> f64 {
    let [effect] = hidden.effects.as_slice() else { panic!("expected exactly one effect") };
    if effect.cause == Cause::Outliers {
        let (rows, sigma) = (hidden.readings.read.len() as f64, hidden.noise.sigma_v);
        let isolable = smallest(|size| Mixture::of(effect, size, sigma).excess_over_heavy_tail(rows));
        return isolable.map_or(f64::INFINITY, |isolable| (isolable / size).max(1.0));
    }
    if has_no_direction(effect.cause) {
        return 1.0;
    }
    let changed = direction(hidden, effect, size);
    let length = dot(&changed, &changed).sqrt();
    let most = others(hidden, effect).map(|(other, one_sided)| {
        let cosine = dot(&changed, &other) / (length * dot(&other, &other).sqrt());
        if one_sided { cosine.max(0.0) } else { cosine.abs() }
    });
    let cosine = most.filter(|cosine| cosine.is_finite()).fold(0.0, f64::max);
    let sine = (1.0 - cosine * cosine).max(1e-12).sqrt();
    let detected = NONCENTRALITY[effect.cause.facts().unknowns - 1].sqrt();
    (SEPARATION / (detected * sine)).max(1.0)
}

/// Directions of the causes that may be confused with `effect`, and whether each can have one sign only.
fn others(hidden: &LabelledRecord, effect: &Effect) -> impl Iterator<Item = (Vec<f64>, bool)> {
    // Delay and slew have a finite effect at the smallest size: they resemble each other, but no small effect.
    let is_finite_at_least_size = effect.least() > 0.0;
    let causes = Cause::ALL.into_iter().filter(move |&cause| cause != effect.cause && !has_no_direction(cause));
    causes.flat_map(|cause| (0..SHAPES).map(move |shape| (cause, shape))).filter_map(move |(cause, shape)| {
        let mut random = ChaCha8Rng::seed_from_u64(hidden.seed ^ (1000 * (cause as u64 + 1) + shape));
        let other = Effect::draw(&mut random, cause, 0, &hidden.schedule, hidden.noise.sigma_v);
        (is_finite_at_least_size || other.least() == 0.0).then(|| (direction(hidden, &other, SMALL), one_sided(cause)))
    })
}

/// Change of the expected readings by an effect of size `size`, in V.
fn direction(hidden: &LabelledRecord, effect: &Effect, size: f64) -> Vec<f64> {
    let expected = |size: f64| {
        let effects = vec![effect.at(size)];
        LabelledRecord::new(hidden.schedule.clone(), effects, hidden.noise, hidden.seed).readings.expected
    };
    expected(size).iter().zip(expected(effect.least())).map(|(a, b)| a - b).collect()
}

/// True for causes that do not shift the expected readings in proportion to their size.
fn has_no_direction(cause: Cause) -> bool {
    matches!(cause, Cause::Quantisation | Cause::Outliers | Cause::SensorSaturation)
}

/// True for causes whose effect cannot be negative.
fn one_sided(cause: Cause) -> bool {
    use Cause::{AmplifierLimit, AmplifierSlew, ChargeLeakage, Delay, Hysteresis, Resonance, SecondRelaxation};
    matches!(cause, AmplifierLimit | AmplifierSlew | ChargeLeakage | Delay | Hysteresis | Resonance | SecondRelaxation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::detectable;
    use crate::ground_truth::record::Recipe;

    #[test]
    fn a_hum_is_isolated_when_detected_but_a_gain_error_or_outliers_are_not() {
        let of = |cause: Cause| {
            let factors = (0..4).map(|seed| {
                let hidden = Recipe::of(&[cause]).draw(seed);
                factor(&hidden, detectable::size(&hidden).unwrap())
            });
            factors.fold(0.0, f64::max)
        };
        assert!((of(Cause::Hum) - 1.0).abs() < 0.05, "{}", of(Cause::Hum));
        assert!(of(Cause::GainError) > 1.5, "{}", of(Cause::GainError));
        assert!(of(Cause::Outliers) > 1.5, "{}", of(Cause::Outliers));
    }
}
