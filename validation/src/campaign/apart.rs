//! The smallest effect that can be told from another: below it no diagnosis names it, however well it detects it.
//!
//! A small effect changes the expected readings in one direction, d, and so does a small effect of another cause, e. What
//! e cannot imitate of d is |d| sin(d, e). A test that is told both structures, and nothing but these two to choose from,
//! picks the right one in 95 % of the records if that is at least 2 x 1.645 standard deviations of the noise.
//!
//! It is a lower bound: e has the few shapes (time constants, frequencies, stretches) that are drawn, and there may be more
//! than one other cause at work. It holds while effects are small: a delay and a slew of less than a row are one and the
//! same on equal steps, whatever the noise; not so when they last longer. Quantisation, outliers and saturation move no
//! small expected reading, and imitate nothing. But outliers may be a heavy tail of the noise, which is no effect.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::detectable::{NONCENTRALITY, NORMAL_95, smallest};
use super::mixture::Mixture;
use crate::hidden::{Cause, Effect, Hidden};

/// In standard deviations of the noise: 5 % to be wrong, either way.
const TELLING: f64 = 2.0 * NORMAL_95;
/// Small enough for directions to be straight.
const SMALL: f64 = 0.01;
/// Shapes drawn of each other cause.
const SHAPES: u64 = 2;

/// In units of the detectable size `size` of the record's one effect: the least size that can be told from any other
/// cause, at least 1.
///
/// # Panics
/// If the record doesn't hide exactly one effect.
pub fn factor(hidden: &Hidden, size: f64) -> f64 {
    let [effect] = hidden.effects.as_slice() else { panic!("one effect at a time") };
    if effect.cause == Cause::Outliers {
        let (rows, sigma) = (hidden.readings.read.len() as f64, hidden.noise.sigma_v);
        let told = smallest(|size| Mixture::of(effect, size, sigma).told_from_a_tail(rows));
        return told.map_or(f64::INFINITY, |told| (told / size).max(1.0));
    }
    if moves_nothing(effect.cause) {
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
    (TELLING / (detected * sine)).max(1.0)
}

/// Directions of the causes that may be taken for this one, and whether they have but one sign.
fn others(hidden: &Hidden, effect: &Effect) -> impl Iterator<Item = (Vec<f64>, bool)> {
    // Delay and slew show in full at the least size: they imitate each other, no small effect.
    let shows_at_once = effect.least() > 0.0;
    let causes = Cause::ALL.into_iter().filter(move |&cause| cause != effect.cause && !moves_nothing(cause));
    causes.flat_map(|cause| (0..SHAPES).map(move |shape| (cause, shape))).filter_map(move |(cause, shape)| {
        let mut random = ChaCha8Rng::seed_from_u64(hidden.seed ^ (1000 * (cause as u64 + 1) + shape));
        let other = Effect::draw(&mut random, cause, 0, &hidden.schedule, hidden.noise.sigma_v);
        (shows_at_once || other.least() == 0.0).then(|| (direction(hidden, &other, SMALL), one_sided(cause)))
    })
}

/// What an effect changes in the expected readings.
fn direction(hidden: &Hidden, effect: &Effect, size: f64) -> Vec<f64> {
    let expected = |size: f64| {
        let effects = vec![effect.at(size)];
        Hidden::new(hidden.schedule.clone(), effects, hidden.noise, hidden.seed).readings.expected
    };
    expected(size).iter().zip(expected(effect.least())).map(|(a, b)| a - b).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn moves_nothing(cause: Cause) -> bool {
    matches!(cause, Cause::Quantisation | Cause::Outliers | Cause::SensorSaturation)
}

/// There is no such thing as less than none of it.
fn one_sided(cause: Cause) -> bool {
    use Cause::{AmplifierLimit, AmplifierSlew, ChargeLeakage, Delay, Hysteresis, Resonance, SecondRelaxation};
    matches!(cause, AmplifierLimit | AmplifierSlew | ChargeLeakage | Delay | Hysteresis | Resonance | SecondRelaxation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::detectable;
    use crate::hidden::record::Recipe;

    #[test]
    fn hum_is_like_nothing_else_and_gain_like_much() {
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
