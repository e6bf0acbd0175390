//! Finished records with the true values of their effects.

use std::ops::RangeInclusive;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cause::Cause;
use super::effect::Effect;
use super::noise::Noise;
use super::physics::{Further, SHARE};
use super::schedule::Schedule;
use super::sensor::Readings;
use super::spring::Spring;

/// Integration steps per row.
const STEPS: usize = 20;

/// Description of a random record. The same recipe and seed give the same record, to the bit.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// Causes in the record, each at most once.
    pub causes: Vec<Cause>,
    /// False: the first form of each cause. True: one of the other forms, where the cause has any.
    pub other_forms: bool,
    /// Noise on the readings.
    pub noise: Noise,
    /// Number of rows of the record.
    pub rows: usize,
    /// True for uneven time steps and missing rows.
    pub uneven: bool,
}

impl Recipe {
    /// 2401 even rows, white noise of 0.2 % of 500 V, first forms.
    pub fn of(causes: &[Cause]) -> Self {
        Self { causes: causes.to_vec(), other_forms: false, noise: Noise::white(0.2), rows: 2401, uneven: false }
    }

    /// Draws schedule, effect values and noise. Full scale is 500 V, in one record of five 700 V.
    pub fn draw(&self, seed: u64) -> LabelledRecord {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let steps_only = self.causes.iter().any(|cause| cause.facts().needs_steps);
        let schedule = Schedule::draw_any(&mut random, self.rows, self.uneven, steps_only);
        let mut draw = |&cause: &Cause| {
            let others: RangeInclusive<usize> = 1..=cause.facts().forms.len() - 1;
            let form = if self.other_forms && !others.is_empty() { random.random_range(others) } else { 0 };
            Effect::draw(&mut random, cause, form, &schedule, self.noise.sigma_v)
        };
        let effects = self.causes.iter().map(&mut draw).collect();
        LabelledRecord::new(schedule, effects, self.noise, seed)
    }
}

/// A record with the true effects in it.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledRecord {
    /// Commanded voltages.
    pub schedule: Schedule,
    /// True effects.
    pub effects: Vec<Effect>,
    /// Noise on the readings.
    pub noise: Noise,
    /// Seed of noise and outliers.
    pub seed: u64,
    /// Readings of the sensor.
    pub readings: Readings,
}

impl LabelledRecord {
    /// Simulates the spring and its sensor.
    pub fn new(schedule: Schedule, effects: Vec<Effect>, noise: Noise, seed: u64) -> Self {
        let spring = Spring::with(&effects);
        Self::of(&spring, schedule, effects, noise, seed)
    }

    /// Simulates the record's schedule, effects and noise with a spring whose instantaneous share is `share`, 0 to 1, unless an effect
    /// sets it.
    pub fn with_share(&self, share: f64) -> Self {
        self.with_relaxation(share, [Further::default(); 2])
    }

    /// Simulates the record with another instantaneous share, see [`with_share`](Self::with_share), and with further lags.
    pub fn with_relaxation(&self, share: f64, further: [Further; 2]) -> Self {
        let own = Spring { further, ..Spring::with(&self.effects) };
        let spring = if own.share == SHARE { Spring { share, ..own } } else { own };
        Self::of(&spring, self.schedule.clone(), self.effects.clone(), self.noise, self.seed)
    }

    /// Simulates a given spring, whose effects before the sensor are part of it, and its sensor with those of `effects` that act on
    /// readings.
    pub fn of(spring: &Spring, schedule: Schedule, effects: Vec<Effect>, noise: Noise, seed: u64) -> Self {
        // A random stream of its own: the noise does not depend on the effects.
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(1);
        let rows = noise.draw(&mut random, schedule.time_s.len());
        random.set_stream(2);
        let stiffness = spring.run(&schedule, STEPS);
        let readings = Readings::of(stiffness, &rows, &schedule, &effects, &mut random);
        Self { schedule, effects, noise, seed, readings }
    }

    /// Simulates the record's schedule and noise with its effects at another size, 0 for none to 1 for full size.
    pub fn at(&self, size: f64) -> Self {
        let effects = self.effects.iter().map(|effect| effect.at(size)).collect();
        Self::new(self.schedule.clone(), effects, self.noise, self.seed)
    }

    /// Root mean square error of a simulation with the true effects, in V: what noise, outliers and rounding leave.
    pub fn floor_rmse(&self) -> f64 {
        let squares = self.readings.read.iter().zip(&self.readings.expected).map(|(read, y)| (read - y).powi(2));
        (squares.sum::<f64>() / self.readings.read.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stiffness of the spring, row by row, in V, without sensor and noise.
    fn stiffness(schedule: &Schedule, effects: &[Effect], steps: usize) -> Vec<f64> {
        Spring::with(effects).run(schedule, steps)
    }

    fn every_form() -> Vec<(Cause, bool, LabelledRecord)> {
        let mut records = Vec::new();
        for cause in Cause::ALL {
            for other_forms in [false, true].into_iter().take(cause.facts().forms.len()) {
                let recipe = Recipe { other_forms, ..Recipe::of(&[cause]) };
                records.extend((100..106).map(|seed| (cause, other_forms, recipe.draw(seed))));
            }
        }
        records
    }

    fn furthest(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_effect_exceeds_the_noise_at_full_size_and_vanishes_at_size_0() {
        for (cause, other, hidden) in every_form() {
            let null = LabelledRecord::new(hidden.schedule.clone(), Vec::new(), hidden.noise, hidden.seed);
            let shown = furthest(&hidden.readings.read, &null.readings.read);
            assert!(shown > 3.0 * hidden.noise.sigma_v, "{cause} ({other}) shows {shown} V, seed {}", hidden.seed);
            assert_eq!(hidden.at(0.0).readings, null.readings, "{cause}");
            // It shrinks with its size and does not vanish at 0 only.
            let least = hidden.at(hidden.effects[0].least());
            let small = furthest(&hidden.at(0.01).readings.read, &least.readings.read);
            assert!(small < 0.2 * shown, "{cause} ({other}) shows {small} of {shown} V at a hundredth");
        }
    }

    #[test]
    fn finer_time_steps_change_less_than_a_fiftieth_of_the_noise() {
        for (cause, other, hidden) in every_form() {
            let finer = stiffness(&hidden.schedule, &hidden.effects, 4 * STEPS);
            let apart = furthest(&stiffness(&hidden.schedule, &hidden.effects, STEPS), &finer);
            assert!(apart < 0.02 * hidden.noise.sigma_v, "{cause} ({other}): {apart} V, seed {}", hidden.seed);
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_record() {
        let recipe = Recipe::of(&[Cause::Hysteresis, Cause::Outliers]);
        assert_eq!(recipe.draw(7), recipe.draw(7));
        assert_ne!(recipe.draw(7).readings, recipe.draw(8).readings);
    }
}
