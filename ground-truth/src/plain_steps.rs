//! Plain step experiments: records of one to three levels, with one effect, the paper's spring, or a gain and a time constant that
//! are both off.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cause::Cause;
use super::effect::Effect;
use super::noise::Noise;
use super::physics::TAU_S;
use super::record::LabelledRecord;
use super::schedule::{Sampling, Schedule};

/// Course of the voltage after a rest at 0 V; every level is held for the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One level.
    Step,
    /// One level and back to 0 V.
    UpDown,
    /// Two rising levels.
    TwoLevels,
    /// Three levels, one of them lower than the one before.
    ThreeLevels,
}

/// Plain step experiment of random levels, duration and number of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlainSteps {
    /// Course of the voltage.
    pub shape: Shape,
    /// True for a record of 10 to 30 time constants, false for one of 4 to 10.
    pub long: bool,
}

impl PlainSteps {
    /// All shapes, each short and long.
    pub fn all() -> Vec<Self> {
        let shapes = [Shape::Step, Shape::UpDown, Shape::TwoLevels, Shape::ThreeLevels];
        shapes.into_iter().flat_map(|shape| [false, true].map(|long| Self { shape, long })).collect()
    }

    /// Name in tables.
    pub fn name(self) -> String {
        let shape = match self.shape {
            Shape::Step => "one step",
            Shape::UpDown => "step up and down",
            Shape::TwoLevels => "two levels",
            Shape::ThreeLevels => "three levels",
        };
        format!("{shape}, {} time constants", if self.long { "10 to 30" } else { "4 to 10" })
    }

    /// True if a record of this experiment can show the cause itself, and not only what another cause shows as well.
    ///
    /// A law needs two levels, since on one it is a gain; a bound of the voltage needs two levels below it, since above one it
    /// is a law; hysteresis needs a reversal; a slow relaxation, a leakage and a drift need time.
    pub fn carries(self, cause: Cause) -> bool {
        let (levels, falls) = match self.shape {
            Shape::Step => (1, false),
            Shape::UpDown => (1, true),
            Shape::TwoLevels => (2, false),
            Shape::ThreeLevels => (3, true),
        };
        match cause {
            Cause::StaticNonlinearity => levels >= 2,
            Cause::VoltageDependentTimeConstant => levels >= 2 || falls,
            Cause::AmplifierLimit => levels >= 3,
            Cause::Hysteresis => falls,
            Cause::SecondRelaxation | Cause::ChargeLeakage | Cause::Drift => self.long,
            _ => true,
        }
    }

    /// Record of this experiment with random effects of full size of these causes and 0.2 % white noise.
    ///
    /// The levels are 150 to 500 V, 60 V apart or more; the record has 300 to 2000 rows.
    pub fn draw(self, causes: &[Cause], seed: u64) -> LabelledRecord {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let schedule = self.schedule(&mut random);
        let noise = Noise::white(0.2);
        let effect = |&cause: &Cause| Effect::draw(&mut random, cause, 0, &schedule, noise.sigma_v);
        let effects: Vec<Effect> = causes.iter().map(effect).collect();
        LabelledRecord::new(schedule, effects, noise, seed)
    }

    fn schedule(self, random: &mut ChaCha8Rng) -> Schedule {
        let (low, high): (f64, f64) = if self.long { (10.0, 30.0) } else { (4.0, 10.0) };
        let duration_s = TAU_S * random.random_range(low.ln()..high.ln()).exp();
        let rows = random.random_range(300f64.ln()..2000f64.ln()).exp() as usize;
        let levels = self.levels(random);
        let rest = duration_s * random.random_range(0.02..0.08);
        let hold = 1.0001 * (duration_s - rest) / levels.len() as f64;
        let sampling = Sampling { rows, every_s: duration_s / (rows - 1) as f64, uneven: false };
        let time_s = sampling.times(random);
        let level = |t: f64| if t < rest { 0.0 } else { levels[((t - rest) / hold) as usize] };
        Schedule { voltage_v: time_s.iter().map(|&t| level(t)).collect(), time_s }
    }

    fn levels(self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let mut between = |low: f64, high: f64| random.random_range(low..high).round();
        match self.shape {
            Shape::Step => vec![between(150.0, 500.0)],
            Shape::UpDown => vec![between(150.0, 500.0), 0.0],
            Shape::TwoLevels => {
                let first = between(150.0, 380.0);
                vec![first, between(first + 60.0, 500.0)]
            }
            Shape::ThreeLevels => {
                let first = between(150.0, 250.0);
                let second = between(first + 60.0, 380.0);
                let rising = vec![first, second, between(second + 60.0, 500.0)];
                let mut levels = rising.clone();
                while levels == rising {
                    levels.shuffle(random);
                }
                levels
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spring::Spring;

    #[test]
    fn experiments_have_their_levels_durations_and_the_papers_spring_without_an_effect() {
        for plain in PlainSteps::all() {
            for seed in 0..10 {
                let hidden = plain.draw(&[], seed);
                let mut levels = hidden.schedule.voltage_v.clone();
                levels.dedup();
                let held = [2, 3, 3, 4][plain.shape as usize];
                assert!(levels.len() == held && levels[0] == 0.0, "{plain:?}: {levels:?}");
                assert_eq!(levels.is_sorted(), matches!(plain.shape, Shape::Step | Shape::TwoLevels));
                let taus = hidden.schedule.duration_s() / TAU_S;
                let range = if plain.long { 9.99..30.01 } else { 3.99..10.01 };
                assert!(range.contains(&taus), "{taus}");
                let paper = Spring::default().run(&hidden.schedule, 20);
                assert_eq!(hidden.readings.expected, paper);
            }
        }
    }

    #[test]
    fn every_effect_that_an_experiment_carries_exceeds_the_noise() {
        for plain in PlainSteps::all() {
            for cause in Cause::ALL.into_iter().filter(|&cause| plain.carries(cause)) {
                for seed in 20..24 {
                    let hidden = plain.draw(&[cause], seed);
                    let null = LabelledRecord::new(hidden.schedule.clone(), Vec::new(), hidden.noise, seed);
                    let off = |(a, b): (&f64, &f64)| ((a - b) / hidden.noise.sigma_v).powi(2);
                    let shown: f64 = hidden.readings.read.iter().zip(&null.readings.read).map(off).sum();
                    assert!(shown > 25.0, "{plain:?} {cause}, seed {seed}: {shown}");
                }
            }
        }
    }

    #[test]
    fn what_needs_levels_a_reversal_or_time_is_not_asked_of_a_short_step() {
        let short = PlainSteps { shape: Shape::Step, long: false };
        use Cause::*;
        for cause in [StaticNonlinearity, Hysteresis, AmplifierLimit, VoltageDependentTimeConstant, Drift] {
            assert!(!short.carries(cause), "{cause}");
        }
        assert!(PlainSteps { shape: Shape::ThreeLevels, long: true }.carries(AmplifierLimit));
    }
}
